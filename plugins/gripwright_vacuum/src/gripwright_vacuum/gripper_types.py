"""The gripper types of this distribution. The number at the end is how many faces they hold by."""

VACUUM_1 = "vacuum-1"
MAGNETIC_1 = "magnetic-1"
