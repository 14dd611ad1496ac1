"""Random bodies thrown into boxes that take energy: at rest they rest, and energy is kept to round-off until then."""

import itertools
import math

import numpy as np
import pytest

import swarm

SIZE = 0.016
CUBE = 0.5 * SIZE * np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
RING = [(math.cos(0.25 * math.pi * k), math.sin(0.25 * math.pi * k)) for k in range(8)]
# Points at the ends of a capsule, and between.
CAPSULE = [(z * SIZE, 0.3 * SIZE * x, 0.3 * SIZE * y) for z in (-0.7, 0.7) for x, y in RING]
CAPSULE += [(-SIZE, 0.0, 0.0), (SIZE, 0.0, 0.0)]
BODIES = {
    "die": lambda: swarm.rigid(CUBE, 1200.0),
    "tile": lambda: swarm.rigid(CUBE * [1.0, 0.6, 0.25], 1200.0),
    "capsule": lambda: swarm.rigid(CAPSULE, 900.0),
    "cluster": lambda: swarm.tetrahedron(edge=SIZE, mass=5e-3),
}
# What moves less from one of ten frames to the next is at rest [m].
STILL = 1e-11


def check(seed, kind, dt, *, rough=True):
    """Throw three bodies with laws drawn from the seed, with friction if `rough`, and look at them 1.5 s later."""
    rng = np.random.default_rng(seed)
    friction, restitution = float(rng.uniform(0.1, 1.0)), float(rng.uniform(0.0, 0.9))
    if not rough:
        # A third of these walls take all of an approach: the hardest case.
        friction, restitution = 0.0, max(0.0, float(rng.uniform(-0.45, 0.9)))
    repeat = f"check({seed}, {kind!r}, {dt:g}, rough={rough}): friction = {friction!r}, restitution = {restitution!r}"
    box = swarm.Box((0.1, 0.1, 0.1), (0.0, 0.0, 0.1), friction=friction, restitution=restitution)
    scene = swarm.Scene([box], gravity=(0.0, 0.0, -9.81))
    start = swarm.place(scene, BODIES[kind](), 3, speed=0.5, spin=20.0, seed=seed)
    seen = []
    result = swarm.simulate(
        scene, start, swarm.Impact(dt=dt), until=1.5, every=0.15, threads=1, compile="always",
        observables={"place": lambda frame: seen.append(frame.position.copy()) or 0.0}, progress=False,
    )  # fmt: skip
    moved = np.abs(seen[-1] - seen[-2]).reshape(3, -1, 3).max(axis=(0, 1))
    speeds = np.abs(result.bodies.velocity).max(axis=(0, 1))
    # Without friction a body slides as slowly as it likes.
    assert not rough or speeds[moved < STILL].max(initial=0.0) < 1e-15, repeat
    assert result.observables["energy_error"].max() < 1e-12, repeat
    assert result.observables["link_error"].max() < 1e-13, repeat
    return int(np.count_nonzero(moved < STILL))


@pytest.mark.parametrize(("seed", "kind", "dt"), [(1, "die", 1e-3), (2, "capsule", 1e-3)])
def test_bodies_at_rest_have_no_velocity_and_no_error_of_energy(seed, kind, dt):
    """Speeds below 1e-15 m/s, and an energy that is kept to 1e-12 of itself."""
    assert check(seed, kind, dt) > 0


@pytest.mark.long
@pytest.mark.parametrize("dt", [1e-3, 1e-4])
@pytest.mark.parametrize("kind", list(BODIES))
def test_many_bodies_at_rest(kind, dt):
    """The same of more bodies, most of which come to rest."""
    assert sum(check(seed, kind, dt) for seed in range(10, 22)) > 18


@pytest.mark.parametrize(("seed", "kind", "dt"), [(1, "die", 1e-3), (12, "capsule", 1e-3)])
def test_walls_without_friction_that_take_energy_book_all_of_it(seed, kind, dt):
    """The last bounces of a body that goes on to slide move its energy by round-off alone."""
    check(seed, kind, dt, rough=False)


@pytest.mark.long
@pytest.mark.parametrize("dt", [1e-3, 1e-4])
@pytest.mark.parametrize("kind", list(BODIES))
def test_many_bodies_at_walls_without_friction(kind, dt):
    """The same of more bodies."""
    for seed in range(10, 22):
        check(seed, kind, dt, rough=False)
