"""Outlines of lines and arcs: what they are, and the walls that stand on them."""
