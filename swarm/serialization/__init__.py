"""Scenes, methods, sources and counters to and from plain tables, the form of scene files and trajectories."""
