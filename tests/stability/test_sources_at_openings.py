"""Sources at openings of parts, at random: births lie on the open wall and go into the vessel.

A failure prints its seed; `check(seed)` repeats it.
"""

import math
import tomllib

import numpy as np
import pytest
import tomli_w

import swarm
from swarm.serialization import run_tables, tables
from swarm.sources.births import with_births
from swarm.surfaces.union import nodes_of

N = 200


def a_leaf(random):
    """A cavity at the origin, and a place on its wall with the normal out of it there."""
    a, b = random.uniform(0.4, 0.8, 2).tolist()
    normal = random.normal(size=3)
    normal /= math.sqrt(normal @ normal)
    kind = random.integers(4)
    if kind == 0:
        return swarm.Sphere(a), a * normal, normal
    if kind == 1:
        axis = int(random.integers(3))
        return swarm.Box((a, a, a)), a * np.eye(3)[axis], np.eye(3)[axis]
    if kind == 2:
        return swarm.Cylinder(a, tuple(normal.tolist()), 2.0 * b), b * normal, normal
    plane = swarm.Plane(tuple(normal.tolist()), 0.3)
    return swarm.Intersection([swarm.Sphere(a), plane]), 0.3 * normal, normal


def a_vessel(random):
    """(a surface with an opening on a wall of one of its leaves, the opening, its place, the normal there)."""
    leaf, place, normal = a_leaf(random)
    around = 0.3 * math.hypot(*place)
    volume = swarm.Sphere(float(random.uniform(0.3, 0.6)) * around, tuple(place.tolist()))
    opening = [volume, swarm.Opening(volume), swarm.Opening(volume, times=[(0.0, 9.0)])][random.integers(3)]
    node = swarm.Intersection([leaf], openings=[opening]) if random.random() < 0.3 else None
    if node is None and isinstance(leaf, swarm.Intersection):
        sphere, plane = leaf.parts
        node = swarm.Intersection([sphere, swarm.Plane(plane.normal, plane.offset, openings=[opening])])
    if node is None:
        fields = {
            name: getattr(leaf, name) for name in ("half_widths", "radius", "axis", "length") if hasattr(leaf, name)
        }
        node = type(leaf)(**fields, openings=[opening])
    for _level in range(random.integers(1, 4)):
        # What is behind the opening covers nothing of it.
        beside = swarm.Sphere(0.35, tuple((-0.5 * normal).tolist()))
        post = swarm.Sphere(0.05, tuple((-0.2 * normal).tolist()), side="outside")
        node = (
            swarm.Union([beside, node][:: random.choice([-1, 1])])
            if random.random() < 0.6
            else swarm.Intersection([node, post])
        )
    return node, opening, place, normal


def check(seed):
    random = np.random.default_rng([55, seed])
    vessel, opening, _place, normal = a_vessel(random)
    other = swarm.Sphere(20.0, openings=[swarm.Sphere(0.1, (20.0, 0.0, 0.0))])
    scene = swarm.Scene([vessel, other][:: random.choice([-1, 1])])
    volume = opening.surface if isinstance(opening, swarm.Opening) else opening
    source = swarm.Source(opening, count=N, stop=1.0, temperature=1.0)
    births = with_births(scene, None, (source,), seed, 1.0)
    r, v = births.position, births.velocity
    assert np.abs(vessel.phi(r)).max() < 1e-11, seed
    assert (volume.phi(r) <= 1e-12).all(), seed
    # The wall is seen from within: a step along its normal leads out, a step along the velocity in.
    out = vessel.gradient(r)
    assert (normal @ out > 0.0).all(), seed
    assert ((out * v).sum(axis=0) < 0.0).all(), seed
    speed = np.sqrt((v**2).sum(axis=0))
    assert (vessel.phi(r + 1e-6 * v / speed) < 0.0).all(), seed
    assert scene.outside(r, 1e-11).size == 0, seed
    # The same bits from a scene file, which names the opening by its part.
    surface, part, number = next(
        (i, at, k)
        for i, one in enumerate(scene.surfaces)
        for at, node in nodes_of(one)
        for k, given in enumerate(node.openings)
        if given is opening
    )
    place = {"surface": surface, "part": list(part), "opening": number}
    table = {
        "surface": [tables.table_of(one) for one in scene.surfaces],
        "source": [{"where": place, "count": N, "stop": 1.0, "temperature": 1.0}],
    }
    read = tomllib.loads(tomli_w.dumps(table))
    again = tables.scene_of(read["surface"], None)
    births = with_births(again, None, run_tables.sources_of(read["source"], again), seed, 1.0)
    assert np.array_equal(births.position, r), seed
    # A source on all of the wall leaves out what is open, also of a part.
    number = scene.surfaces.index(vessel)
    births = with_births(scene, None, (swarm.Source(number, count=N, stop=1.0, speed=1.0),), seed, 1.0)
    assert (volume.phi(births.position) > 0.0).all(), seed


@pytest.mark.parametrize("seed", range(6))
def test_births_at_an_opening_of_a_part(seed):
    check(seed)


@pytest.mark.long
def test_births_at_five_hundred_openings_of_parts():
    for seed in range(500):
        check(seed)


@pytest.mark.parametrize("given_to", ["the part", "a part of a part", "the union"])
def test_transmission_of_a_tube_of_two_parts_is_the_view_factor_of_its_ends(given_to):
    """Walls absorb: what comes through has met none, from one disc of radius R to another at a distance L."""
    radius, length, n = 0.4, 1.0, 1000
    ways = [swarm.Cylinder(radius, (1, 0, 0), 0.02, (x, 0.0, 0.0)) for x in (-0.5 * length, 0.5 * length)]
    mine, whole = (ways, []) if given_to != "the union" else ([], ways)
    tubes = [
        swarm.Cylinder(0.5, (1, 0, 0), 0.6 * length, (x, 0.0, 0.0), laws=[swarm.Absorb(1.0)], openings=mine[k : k + 1])
        for k, x in enumerate((-0.2 * length, 0.2 * length))
    ]
    if given_to == "a part of a part":
        tubes[0] = swarm.Union([tubes[0]])
    scene = swarm.Scene([swarm.Union(tubes, openings=whole)])
    source = swarm.Source(ways[0], count=n, stop=0.1, speed=1.0)
    seen = swarm.simulate(scene, None, swarm.Impact(), until=40.0, every=40.0, sources=[source], compile="never")
    x = 2.0 + (length / radius) ** 2
    expected = 0.5 * (x - math.sqrt(x * x - 4.0))
    passed = seen.observables["escaped"][-1] / n
    assert abs(passed - expected) < 4.0 * math.sqrt(expected * (1.0 - expected) / n)
    assert seen.observables["escaped"][-1] + seen.observables["absorbed"][-1] == n
    assert (seen.particles.velocity[0] > 0.0).all()
