"""Runs in order of events: balls that meet one another, walls with a mass."""
