"""Surfaces of several walls: boxes, capped cylinders and cones, as cavities and as solids."""

import itertools
import math

import numpy as np
import pytest
from conftest import call, rarely
from hypothesis import given
from hypothesis import strategies as st

import swarm
from swarm.surfaces import rotation
from swarm.surfaces.shapes.plane import PlaneNumbers
from swarm.surfaces.shapes.slab import SlabNumbers
from swarm.surfaces.time_of_impact.flights import first_hit
from swarm.surfaces.walls import all_walls

TURN = {"axis": (1.0, 2.0, 3.0), "angle": 0.7}
CENTER = (0.3, -0.2, 0.1)
CAVITIES = {
    "box": swarm.Box((0.5, 0.4, 0.3)),
    "rotated box": swarm.Box((0.5, 0.4, 0.3), CENTER, rotation=TURN),
    "can": swarm.Cylinder(0.3, length=1.0),
    "rotated can": swarm.Cylinder(0.3, (1.0, 0.0, 1.0), 1.0, CENTER, rotation=TURN),
}


def inside_by_hand(surface, points):
    """Whether points are inside, from what a box, a cylinder and a cone are."""
    d = rotation.matrix(surface.rotation).T @ (points - np.array(surface.center)[:, None])
    if isinstance(surface, swarm.Box):
        return (np.abs(d) <= np.array(surface.half_widths)[:, None]).all(axis=0)
    along = np.array(surface.axis) @ d
    rho = np.sqrt(np.maximum((d * d).sum(axis=0) - along**2, 0.0))
    if isinstance(surface, swarm.Cone):
        return (along >= 0.0) & (rho <= along * math.tan(surface.half_angle))
    return (rho <= surface.radius) & (np.abs(along) <= 0.5 * surface.length)


def hit(surface, position, velocity):
    return call(first_hit, all_walls([surface]), None, position, velocity)


@pytest.mark.parametrize("side", ["inside", "outside"])
@pytest.mark.parametrize(
    "make",
    [
        lambda side: swarm.Box((0.5, 0.4, 0.3), CENTER, side),
        lambda side: swarm.Box((0.5, 0.4, 0.3), CENTER, side, rotation=TURN),
        lambda side: swarm.Cylinder(0.3, (1.0, 0.0, 1.0), 1.0, CENTER, side),
        lambda side: swarm.Cylinder(0.3, (1.0, 0.0, 1.0), 1.0, CENTER, side, rotation=TURN),
        lambda side: swarm.Cone(0.6, (1.0, 0.0, 1.0), CENTER, side),
        lambda side: swarm.Cone(0.6, (1.0, 0.0, 1.0), CENTER, side, rotation=TURN),
    ],
)
def test_phi_is_below_0_inside(make, side):
    points = np.random.default_rng(0).uniform(-1.0, 1.0, (3, 2000))
    surface = make(side)
    inside = inside_by_hand(surface, points)
    assert 20 < inside.sum() < 1900
    assert ((surface.phi(points) <= 0.0) == inside).all()
    low, high = (np.array(corner)[:, None] for corner in surface.bounds())
    if side == "inside":
        assert ((points[:, inside] >= low) & (points[:, inside] <= high)).all()
    else:
        assert np.isinf(low).all()
        assert np.isinf(high).all()


@pytest.mark.parametrize("name", CAVITIES)
def test_bounds_of_a_cavity_touch_it(name):
    surface = CAVITIES[name]
    low, high = (np.array(corner) for corner in surface.bounds())
    points = np.random.default_rng(1).uniform(low, high, (200_000, 3)).T
    inside = points[:, inside_by_hand(surface, points)]
    assert inside.min(axis=1) == pytest.approx(low, abs=0.06)
    assert inside.max(axis=1) == pytest.approx(high, abs=0.06)


@given(seed=st.integers(0, 10_000))
def test_a_box_is_left_through_the_nearest_face(seed):
    random = np.random.default_rng(seed)
    box, velocity = CAVITIES["rotated box"], random.normal(size=3)
    matrix, half = rotation.matrix(box.rotation), np.array(box.half_widths)
    own, flight = random.uniform(-1.0, 1.0, 3) * half, matrix.T @ velocity
    times = (np.copysign(half, flight) - own) / flight
    time, face = hit(box, np.array(CENTER) + matrix @ own, velocity)
    assert time == pytest.approx(times.min(), rel=1e-12, abs=1e-15)
    assert face == times.argmin()


@given(seed=st.integers(0, 10_000))
def test_a_can_is_left_through_its_side_or_a_cap(seed):
    random = np.random.default_rng(seed)
    can = CAVITIES["can"]
    position, velocity = random.uniform(-0.2, 0.2, 3), random.normal(size=3)
    (x, y, z), (u, v, w) = position, velocity
    a, b, c = u * u + v * v, x * u + y * v, x * x + y * y - 0.09
    around, cap = (-b + math.sqrt(b * b - a * c)) / a, (math.copysign(0.5, w) - z) / w
    time, face = hit(can, position, velocity)
    assert time == pytest.approx(min(around, cap), rel=1e-12)
    assert face == (0 if around < cap else 1)


def test_walls_of_a_box():
    """One slab an axis, one plane where a face is open, nothing where both are."""
    kinds = lambda *open_faces: [type(w) for w in swarm.Box((1, 2, 3), open=open_faces).walls()]  # noqa: E731
    assert kinds() == [SlabNumbers] * 3
    assert kinds("+z") == [SlabNumbers, SlabNumbers, PlaneNumbers]
    assert kinds("+x", "-x", "-y") == [PlaneNumbers, SlabNumbers]


@pytest.mark.parametrize("face", ["-x", "+x", "-y", "+y", "-z", "+z"])
def test_an_open_face_lets_through_and_the_others_do_not(face):
    box = swarm.Box((0.5, 0.4, 0.3), CENTER, open=[face], rotation=TURN)
    matrix = rotation.matrix(box.rotation)
    for axis, sign in itertools.product(range(3), (-1.0, 1.0)):
        time, _wall = hit(box, np.array(CENTER), sign * matrix[:, axis])
        here = face == "-+"[sign > 0.0] + "xyz"[axis]
        # Across the other walls nothing but the round-off of the rotation moves it.
        assert time > 1e15 if here else time == pytest.approx(box.half_widths[axis], rel=1e-14)
    assert np.isinf(box.bounds()).all()
    straight = swarm.Box((0.5, 0.4, 0.3), open=[face])
    assert np.isinf(straight.bounds()).sum() == 1
    assert straight.bounds()["-+".index(face[0])]["xyz".index(face[1])] == (-math.inf if face[0] == "-" else math.inf)


@pytest.mark.parametrize("name", [rarely(name) if name.startswith("rotated") else name for name in CAVITIES])
def test_particles_stay_and_keep_their_energy(name):
    scene = swarm.Scene([CAVITIES[name]])
    particles = swarm.fill(scene, 200, speed=0.5, seed=1)
    seen = swarm.simulate(scene, particles, swarm.Impact(), until=10.0, every=1.0).observables
    assert seen["impacts"][-1] > 1000
    assert seen["energy_error"].max() <= 1e-14
    assert seen["max_penetration"].max() <= 1e-15


def test_into_a_corner_and_out_again():
    """Three walls at once: the particle comes back the way it came."""
    scene = swarm.Scene([swarm.Box((0.5, 0.5, 0.5))])
    particles = swarm.Particles(np.zeros((3, 1)), np.full((3, 1), 0.25))
    after = swarm.simulate(scene, particles, swarm.Impact(), until=3.0, every=3.0).particles
    assert after.velocity[:, 0] == pytest.approx([-0.25] * 3, abs=1e-15)
    assert after.position[:, 0] == pytest.approx([0.25] * 3, abs=1e-3)


def test_a_beam_along_the_axis_of_a_cone_comes_back_from_the_apex():
    scene = swarm.Scene([swarm.Cone(0.5), swarm.Plane((0, 0, 1), 1.0)])
    offsets = np.array([0.0, 1e-17, 1e-9, -1e-3])
    start = np.array([offsets, 0.0 * offsets, 0.0 * offsets + 0.5])
    particles = swarm.Particles(start, np.array([0.0 * offsets, 0.0 * offsets, 0.0 * offsets - 1.0]))
    result = swarm.simulate(scene, particles, swarm.Impact(), until=4.0, every=0.5)
    assert np.isfinite(result.particles.position).all()
    assert result.observables["energy_error"].max() <= 1e-14
    # The flight at the apex is a double root, of which half the digits are known.
    assert result.observables["max_penetration"].max() <= 1e-8
