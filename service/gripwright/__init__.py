"""Gripwright: the smallest set of robot grippers that can assemble a product."""

__version__ = "0.1.0"
