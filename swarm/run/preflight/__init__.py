"""Checks before a run: what it needs, what its engine supports, what the user may not have meant."""
