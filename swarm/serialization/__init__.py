"""Scenes, methods, counters and sources as plain tables, the form of scene files and trajectories."""
