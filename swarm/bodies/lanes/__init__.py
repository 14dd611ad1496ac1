"""Lanes of bodies: points that are tied together. Loops over points and ties are outside, over the lanes inside."""
