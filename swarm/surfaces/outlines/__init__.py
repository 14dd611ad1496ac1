"""Outlines of lines and arcs, and the walls that stand on them."""
