"""A cavity by a phi of one's own: a superellipsoid, |x/a|^n + |y/b|^n + |z/c|^n = 1 with n = 4."""

from typing import NamedTuple

import swarm


class Axes(NamedTuple):
    """Half the widths of the cavity [m]; other values need no new compilation."""

    a: float
    b: float
    c: float


def phi(axes, x, y, z):
    """Below 0 inside, 0 on the surface, above 0 outside."""
    return (x / axes.a) ** 4 + (y / axes.b) ** 4 + (z / axes.c) ** 4 - 1.0


def gradient(axes, x, y, z):
    """Its derivatives by x, y and z."""
    return 4.0 * x**3 / axes.a**4, 4.0 * y**3 / axes.b**4, 4.0 * z**3 / axes.c**4


if __name__ == "__main__":
    bounds = ((-0.31, -0.41, -0.51), (0.31, 0.41, 0.51))
    cavity = swarm.OwnSurface(Axes(0.3, 0.4, 0.5), phi, gradient, size=0.3, bounds=bounds)
    scene = swarm.Scene(surfaces=[cavity])
    particles = swarm.fill(scene, 2_000, speed=0.5, seed=1)
    result = swarm.simulate(scene, particles, swarm.Impact(), until=20.0, every=1.0)
    print(result.observables["impacts"][-1], "impacts")
    print(result.observables["energy_error"].max(), "worst relative energy error of a particle")
    print(result.observables["max_penetration"].max(), "m outside at most")
