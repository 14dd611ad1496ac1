"""Impacts of balls on one another and on walls, in order of time."""
