"""Settings of the service, from the environment."""
