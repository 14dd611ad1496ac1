"""Checks before a run: its arguments, the capabilities of its engine, and properties that may not be meant."""
