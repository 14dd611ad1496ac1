"""Samples that the tests of surfaces from data share."""

import functools

import numpy as np

import swarm


def grid(n, reach=0.55):
    """The axis and the coordinates (n, n, n) of a cube of samples."""
    axis = np.linspace(-reach, reach, n)
    return axis, np.meshgrid(axis, axis, axis, indexing="ij")


@functools.cache
def ball(n=32, side="inside", radius=0.5):
    """A sphere by its signed distance, whose spline is no polynomial of all of space."""
    axis, points = grid(n, 1.1 * radius)
    return swarm.Sampled(np.sqrt(sum(x * x for x in points)) - radius, axis[1] - axis[0], (axis[0],) * 3, side)


@functools.cache
def bumpy(n=20, side="inside", scale=1.0):
    """A body with bumps and a dent, on a grid with three spacings."""
    x, y, z = np.meshgrid(*(np.linspace(-1.0, 1.0, n + k) for k in (0, 2, 5)), indexing="ij")
    phi = x**2 + 1.2 * y**2 + z**2 - 0.55 + 0.15 * np.sin(5.0 * x + y) * np.cos(4.0 * z) + 0.2 * np.exp(-8.0 * y**2)
    spacing = [2.0 * scale / (n + k - 1) for k in (0, 2, 5)]
    return swarm.Sampled(phi, spacing, (-scale, -scale, -scale), side)
