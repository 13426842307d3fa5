"""An independent judge of design folders: written from the interface alone, it shares no code with the calculation."""
