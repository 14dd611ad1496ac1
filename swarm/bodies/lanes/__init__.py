"""Lanes of bodies: points that are tied together. Outer loops are over points and ties, inner loops over lanes."""
