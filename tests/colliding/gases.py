"""Gases of balls, and their runs from frame to frame."""

import itertools

import numpy as np

import swarm
from swarm.events.balls_run import CollidingRun
from swarm.kernel.random import Seeding
from swarm.run.tally import Watched

BOX = swarm.Box((1.0, 1.0, 1.0))


def run_of(scene, particles, threads=1, compile="never"):
    return CollidingRun(
        scene.compiled(), particles.copy(), swarm.Impact(), threads, None, compile, Seeding(), Watched()
    )


def gas(n=40, radius=0.17, seed=1, period=None, gravity=None, **pairs):
    """Balls in a box, or in a cell with a small solid in its middle."""
    random = np.random.default_rng(seed)
    places = np.array(list(itertools.product((-0.66, -0.22, 0.22, 0.66), repeat=3)))
    position = random.permutation(places)[:n].T + random.uniform(-0.05, 0.05, (3, n))
    walls = [BOX]
    if period is not None:
        position, walls = position + 1.0, [swarm.Sphere(0.05, center=(1.0, 1.0, 1.0), side="outside")]
    known = swarm.Pairs(**pairs) if pairs else None
    scene = swarm.Scene(walls, gravity=gravity, period=period, pairs=known)
    radii = random.uniform(0.5, 1.0, n) * radius
    return scene, swarm.Particles(position, random.normal(size=(3, n)), random.uniform(0.5, 2.0, n), radius=radii)


def frames(run, times):
    with run:
        run.observe()
        for before, moment in itertools.pairwise([0.0, *times]):
            while not run.advance(moment - before, moment):
                pass
        return run.state.position.copy(), run.state.velocity.copy(), run.seen()


def depth(scene, position, radius):
    """How much balls overlap at most [m]."""
    b = position[:, :, None] - position[:, None, :]
    if scene.period is not None:
        lengths = np.array(scene.period)[:, None, None]
        b -= lengths * np.round(b / lengths)
    gaps = np.sqrt((b * b).sum(axis=0)) - radius[:, None] - radius
    return -gaps[np.triu_indices(len(radius), 1)].min()
