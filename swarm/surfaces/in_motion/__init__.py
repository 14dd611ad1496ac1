"""Walls that move, in kernels."""
