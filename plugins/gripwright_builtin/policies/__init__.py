"""Policies of the house: what it forbids and what it prefers."""
