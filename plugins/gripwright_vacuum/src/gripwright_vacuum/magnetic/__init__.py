"""A magnet with a round pole face: `magnetic-1`."""
