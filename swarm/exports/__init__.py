"""Trajectories and walls in the formats of other programs."""
