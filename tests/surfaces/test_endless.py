"""A phi that does not depend on a coordinate is a cylinder: bounded across it, and in a plane across it closed."""

import math
from collections import namedtuple

import numpy as np
import pytest

import swarm
from swarm.triangles.shapes import shapes_of

AREA = 2.0 * math.pi  # of an ellipse with semi-axes 2 and 1
PLANES = "xyz"
Nothing = namedtuple("Nothing", [])
# phi of that ellipse in the two directions of the plane, from its right to upwards
QUADRIC = {
    "x": np.diag([0.0, 0.25, 1.0]),
    "y": np.diag([1.0, 0.0, 0.25]),
    "z": np.diag([0.25, 1.0, 0.0]),
}


def formula(plane, **more):
    k = PLANES.index(plane)
    u, v = PLANES[(k + 1) % 3], PLANES[(k + 2) % 3]
    return swarm.Formula(f"{u}**2/4 + {v}**2 - 1", **more)


def own(plane, **more):
    p, q, r = np.diag(QUADRIC[plane]).tolist()

    def phi(_p, x, y, z):
        return p * x * x + q * y * y + r * z * z - 1.0

    def gradient(_p, x, y, z):
        return 2.0 * p * x, 2.0 * q * y, 2.0 * r * z

    half = np.roll([2.1, 1.1, 1.0], PLANES.index(plane) + 1)
    return swarm.OwnSurface(Nothing(), phi, gradient, size=1.0, bounds=(-half, half), **more)


def sampled(plane, **more):
    """On a grid of few samples across the plane."""
    k = PLANES.index(plane)
    counts = np.roll([33, 17, 4], k + 1)
    low = np.roll([-2.4, -1.3, -0.1], k + 1)
    rows = [np.linspace(a, -a, n) for a, n in zip(low, counts, strict=True)]
    grid = np.stack(np.meshgrid(*rows, indexing="ij"))
    values = np.einsum("i,i...->...", np.diag(QUADRIC[plane]), grid**2) - 1.0
    return swarm.Sampled(values, tuple((-2.0 * low / (counts - 1)).tolist()), tuple(low.tolist()), **more)


KINDS = {"formula": formula, "own": own, "sampled": sampled}


@pytest.mark.parametrize(
    ("kind", "plane"), [*((kind, plane) for kind in ("formula", "own") for plane in PLANES), ("sampled", "y")]
)
def test_in_a_plane_it_is_filled_evenly_and_a_billiard(kind, plane):
    scene = swarm.Scene([KINDS[kind](plane)], plane=plane)
    assert not scene.is_open()
    particles = swarm.fill(scene, 20_000, speed=1.0, seed=1)
    assert particles.volume == pytest.approx(AREA, rel=0.01)
    # Uniform: a quarter of them in the ellipse of half the size, and as many on each side; 5 standard deviations
    k = PLANES.index(plane)
    right, up = particles.position[(k + 1) % 3], particles.position[(k + 2) % 3]
    inner = (right**2 / 4.0 + up**2 < 0.25).mean()
    assert inner == pytest.approx(0.25, abs=5.0 * math.sqrt(0.25 * 0.75 / 20_000))
    assert [(right > 0.0).mean(), (up > 0.0).mean()] == pytest.approx(2 * [0.5], abs=5.0 * 0.5 / math.sqrt(20_000))
    few = swarm.Particles(particles.position[:, :2], particles.velocity[:, :2])
    of_quadric = swarm.Scene([swarm.Quadric(QUADRIC[plane], constant=-1.0)], plane=plane)
    ends = [swarm.simulate(one, few, swarm.Impact(), until=4.0, compile="never") for one in (scene, of_quadric)]
    np.testing.assert_allclose(ends[0].particles.position, ends[1].particles.position, atol=1e-10)
    assert ends[0].observables["impacts"][-1] == ends[1].observables["impacts"][-1] > 2
    assert not ends[0].particles.position[k].any()
    (shape,) = shapes_of(scene, few.position)
    assert sum(len(curve) for curve in shape.edges) > 100


TURNED = {"center": (0.5, -2.0, 0.0), "rotation": (math.cos(0.3), 0.0, 0.0, math.sin(0.3))}
# Two discs of radius 1 whose middles are 1 apart
TWO = 2.0 * math.pi - (2.0 * math.acos(0.5) - 0.5 * math.sqrt(3.0))
MORE = {
    "a turned formula": lambda: ([formula("z", **TURNED)], AREA),
    "turned functions": lambda: ([own("z", **TURNED)], AREA),
    "with bounds": lambda: ([formula("z", bounds=((-3.0, -2.0, -1.0), (3.0, 2.0, 1.0)))], AREA),
    "of fourth degree": lambda: ([swarm.Formula("x**4 + y**2 - 1")], 2.0 * 1.748038369528),  # 2 int sqrt(1 - x^4)
    "around a solid": lambda: (
        [formula("z"), swarm.Formula("x**2 + y**2 - 0.25", side="outside")],
        AREA - 0.25 * math.pi,
    ),
    "two strips": lambda: ([swarm.Formula("x**2 - 0.25"), swarm.Formula("y**2 - 0.16")], 0.8),
    "a union": lambda: ([swarm.Union([swarm.Formula("x**2 + y**2 - 1"), swarm.Formula("(x - 1)**2 + y**2 - 1")])], TWO),
    "with a cylinder": lambda: (
        [swarm.Union([swarm.Formula("x**2 + y**2 - 1"), swarm.Cylinder(1.0, center=(1.0, 0.0, 0.0))])],
        TWO,
    ),
    "in another ellipse": lambda: ([swarm.Intersection([formula("z"), swarm.Cylinder(2.5)])], AREA),
}


@pytest.mark.parametrize("name", MORE)
def test_areas_of_more(name):
    surfaces, area = MORE[name]()
    particles = swarm.fill(swarm.Scene(surfaces, plane="z"), 20_000, speed=1.0, seed=2)
    assert particles.volume == pytest.approx(area, rel=0.015)


@pytest.mark.parametrize(("kind", "at"), [("formula", 40.0), ("own", 40.0), ("sampled", 0.0)])
def test_with_lids_it_is_a_vessel(kind, at):
    """Also far from the bounds that a surface of functions was given; samples are known in their grid only."""
    surface = KINDS[kind]("z")
    lids = swarm.Slab((0.0, 0.0, 1.0), 0.1, center=(0.0, 0.0, at))
    scene = swarm.Scene([surface, lids])
    np.testing.assert_allclose(scene.bounds(), [(-2.1, -1.1, at - 0.1), (2.1, 1.1, at + 0.1)], atol=0.15)
    start = swarm.Particles([[0.0, 0.5], [0.1, 0.2], [at, at]], [[1.0, -0.4], [0.6, 1.0], [0.3, -0.2]])
    end = swarm.simulate(scene, start, swarm.Impact(), until=4.0, compile="never")
    assert end.observables["impacts"][-1] > 5
    assert end.observables["energy_error"].max() < 1e-14
    assert end.observables["max_penetration"].max() < 1e-12
    assert not surface.gradient([[0.5], [0.5], [at]])[2].any()


def test_samples_are_not_known_beyond_their_grid():
    """In a plane that is not in the grid, or without lids."""
    for scene in ({"plane": "z"}, {}):
        pipe = sampled("z")
        x, y, _z = pipe.origin
        with pytest.raises(swarm.SceneError, match="must be known wherever particles go"):
            swarm.Scene([swarm.Sampled(pipe.values, pipe.spacing, (x, y, 1.0))], **scene)


def test_a_cylinder_that_is_open_across_stays_open():
    for text in ("x**2 - y**2 - 1", "x - 1", "y - x**2"):
        with pytest.raises(swarm.SceneError, match="open to infinity"):
            swarm.fill(swarm.Scene([swarm.Formula(text)], plane="z"), 10, speed=1.0)


def test_a_rotated_box_without_ends_is_bounded_where_it_is_narrow():
    """About the open axis; about another one nothing is known of what it sweeps."""
    turn = math.cos(math.pi / 8.0), math.sin(math.pi / 8.0)  # by pi/4
    pit = {"half_widths": (1.0, 0.5, 2.0), "open": ("+z",)}
    low, high = swarm.Box(**pit, rotation=(turn[0], 0.0, 0.0, turn[1])).bounds()
    reach = 1.5 / math.sqrt(2.0)
    assert high == pytest.approx((reach, reach, math.inf))
    assert low[:2] == pytest.approx((-reach, -reach))
    low, high = swarm.Box(**pit, rotation=(turn[0], turn[1], 0.0, 0.0)).bounds()
    assert (low[0], high[0]) == (-1.0, 1.0)
    assert high[2] == math.inf
