"""Counting and logging of particles in lanes."""
