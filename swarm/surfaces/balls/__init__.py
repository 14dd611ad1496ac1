"""Walls for the centres of balls that are of another kind than the wall itself: edges are round, tips are moved."""
