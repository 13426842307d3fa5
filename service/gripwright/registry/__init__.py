"""Which plug-ins are installed, and the toolbox of a plan."""
