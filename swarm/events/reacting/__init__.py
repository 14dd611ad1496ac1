"""Walls that impacts move: the particles are no longer independent, and impacts are taken in order of time."""
