"""Walls that move, as kernels take them."""
