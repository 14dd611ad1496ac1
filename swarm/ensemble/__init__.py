"""Sweeps: many runs of one scene file, carried out by worker processes, and their results in one table."""
