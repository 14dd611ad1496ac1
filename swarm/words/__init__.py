"""A run in words and numbers: for titles, reports, recordings and `swarm info`."""
