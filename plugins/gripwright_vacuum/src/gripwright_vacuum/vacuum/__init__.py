"""A suction cup: `vacuum-1`."""
