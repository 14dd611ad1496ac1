"""Random vessels x solids x friction x restitution x sizes x gravity x motions with grains: every run ends, and every
joule is booked.
"""

import numpy as np
import pytest

import swarm

SEEDS = range(40)
FRICTIONS = (0.0, 0.1, 0.5, 1.0)
# Of the largest energy.
UNBOOKED = 1e-12
G = (0.0, 0.0, -9.81)
POSTS = [(x, y, -0.7) for x in (-0.5, 0.0, 0.5) for y in (-0.5, 0.0, 0.5)]
CUBE = np.array([[x, y, z] for x in (-0.9, 0.9) for y in (-0.9, 0.9) for z in (-0.9, 0.9)])
# Each side as two triangles.
SIDES = np.array([[a, b, c] for a, b, c, d in (
    (0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)
) for a, b, c in ((a, b, c), (a, c, d))])  # fmt: skip
# Vessels of about 1 m with a point 0 in them.
VESSELS = {
    "box": lambda law: [swarm.Box((0.8, 0.7, 0.9), **law)],
    "sphere": lambda law: [swarm.Sphere(1.0, **law)],
    "tube": lambda law: [swarm.Cylinder(0.8, length=1.8, **law)],
    "lying tube": lambda law: [swarm.Cylinder(0.8, axis=(1.0, 0.2, 0.0), length=1.8, **law)],
    "capsule": lambda law: [swarm.Capsule(0.8, 0.5, axis=(0.3, 0.0, 1.0), **law)],
    "hopper": lambda law: [swarm.Cylinder(0.9, length=2.0, **law), swarm.Cone(0.7, center=(0.0, 0.0, -0.9), **law)],
    "off the origin": lambda law: [
        swarm.Cylinder(0.9, length=2.4, center=(0.03, 0.0, 0.0), **law),
        swarm.Cone(0.5, center=(0.03, 0.02, -1.1), axis=(0.1, 0.0, 1.0), **law),
    ],
}
# At rest only.
BY_FACES = {
    "mesh": lambda law: [swarm.Mesh(CUBE, SIDES, **law)],
    "posts": lambda law: [swarm.Box((0.8, 0.8, 0.9), **law), swarm.Spheres(POSTS, 0.12, **law)],
    "prism": lambda law: [swarm.Prism([(-1.0, -0.8), (1.0, -0.8), (0.7, 0.9), (-0.7, 0.8)], 1.8, **law)],
    "turned cubes": lambda law: [swarm.Box((0.8, 0.8, 0.9), **law), swarm.Boxes(POSTS, (0.1, 0.1, 0.1), **law)],
}
REPEATING = {
    "floor": lambda law: [swarm.Plane((0.0, 0.0, -1.0), 0.7, **law)],
    "nothing": lambda law: [],
}


def a_scene(seed):
    """(scene, particles, method), all drawn."""
    random = np.random.default_rng([72, seed])
    law, grain = (
        {"restitution": float(random.choice([1.0, 0.9, 0.5, 0.1])), "friction": float(random.choice(FRICTIONS))}
        for _both in range(2)
    )
    kind, period = random.integers(4), None
    makers = VESSELS
    if kind == 0:
        makers = BY_FACES
    elif kind == 1 and random.random() < 0.5:
        makers, period = REPEATING, (1.5, 1.5, None)
    name = str(random.choice(sorted(makers)))
    if name == "nothing":
        period = (1.5, 1.5, 1.5)
    if kind == 2:
        law["motion"] = [
            swarm.Oscillation((0.0, 0.05, 0.1), 3.0),
            swarm.Rotation((1.0, 0.0, 0.0), 2.0, (0.0, 0.0, 0.0)),
            swarm.Rotation((0.0, 0.0, 1.0), -6.0, (0.0, 0.0, 0.0)),
        ][random.integers(3)]
        if len(makers[name](law)) > 1:
            del law["motion"]
    gravity = [None, G, G, (-3.0, 2.0, -9.0)][random.integers(4)]
    scene = swarm.Scene(makers[name](law), gravity, period, pairs=swarm.Pairs(**grain))
    n = int(random.integers(20, 81))
    largest = 0.13 if n < 50 else 0.1
    radius = [largest, random.uniform(0.4, 1.0, n) * largest, random.choice([1.0, 0.3], n) * largest][
        random.integers(3)
    ]
    if period is not None:
        room = swarm.Scene([swarm.Box((0.72, 0.72, 0.68))])
        start = swarm.fill(room, n, speed=1.0, seed=seed, radius=radius)
        start.position += np.array([[0.75], [0.75], [0.0 if name == "floor" else 0.75]])
        start.volume = None
    else:
        start = swarm.fill(scene, n, speed=float(random.choice([0.0, 1.0, 3.0])), seed=seed, radius=radius)
    start.mass = [np.full(n, 1.0), 1000.0 * np.broadcast_to(radius, n) ** 3][random.integers(2)]
    dt, exponent = float(random.choice([2e-3, 1e-3, 5e-4])), float(random.choice([1.0, 1.5, 2.0]))
    # With each exponent the force at this overlap is the same: below it a larger one alone would be much softer.
    overlap = 0.005
    return scene, start, swarm.Penalty(dt, 5e4 * overlap ** (1.0 - exponent), exponent)


def ends(seed, steps, compile):
    """The run of a scene, whose books balance."""
    scene, start, method = a_scene(seed)
    until = steps * method.dt
    result = swarm.simulate(scene, start, method, until=until, every=until / 4, compile=compile)
    assert result.observables["energy_error"].max() < UNBOOKED
    return result


@pytest.mark.parametrize("seed", SEEDS[:3])
def test_grains_run_and_every_joule_is_booked(seed):
    ends(seed, 60, "never")


@pytest.mark.long
@pytest.mark.parametrize("seed", SEEDS)
def test_grains_run_until_they_rest(seed):
    ends(seed, 2000, "always")
