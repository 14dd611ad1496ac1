"""Runs of soft balls in plain Python."""

import math

import numpy as np

import swarm

ROOM = swarm.Scene([swarm.Sphere(100.0)])


def ran(scene, particles, method, until, **options):
    options = {"every": until, "compile": "never", "progress": False, **options}
    return swarm.simulate(scene, particles, method, until=until, **options)


def cloud(n=30, seed=3, speed=1.0):
    """Balls of many sizes that overlap a little or fly into one another."""
    random = np.random.default_rng(seed)
    side = math.ceil(n ** (1 / 3))
    grid = np.stack(np.meshgrid(*[np.arange(side)] * 3, indexing="ij")).reshape(3, -1)[:, :n].astype(float)
    radius = random.uniform(0.3, 0.52, n)
    velocity = speed * random.normal(size=(3, n)) - 0.3 * grid
    return swarm.Particles(grid + random.uniform(-0.02, 0.02, (3, n)), velocity, radius**3, radius=radius)
