"""Values and rules of gripper selection. No I/O, no dependencies beyond NumPy."""
