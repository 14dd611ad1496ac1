"""Random vessels x laws of walls x balls, points, bodies x gravity: impacts keep, or book, the energy without a bias.

A law that keeps the speed keeps the energy of a ball exactly. Of what is booked, and of balls that collide, the error
is a random walk of round-off. A failure prints the seed and the law, which `made` turns into the run again.
"""

import itertools
import math

import numpy as np
import pytest

import swarm
from swarm.kernel.vector import cross, dot
from swarm.surfaces.wall_law import mirrored

EPS = np.finfo(np.float64).eps
# Errors of a ball alone that keeps its energy, and of a random walk: in units of round-off, and of its standard error.
EXACT, WALK = 4.0, 4.0


class Turning(swarm.WallLaw):
    """A mirror that turns what is along the wall by a right angle, and keeps the speed but for round-off."""

    def leave(self, v, n, u, random, mass):
        """A quarter of a turn about the normal."""
        w = mirrored(v, n, u) - u
        return u + dot(w, n) * n + cross(n, w)


class Reversing(swarm.WallLaw):
    """The way back."""

    def leave(self, v, n, u, random, mass):
        """The other velocity."""
        return 2.0 * u - v


class Damped(swarm.WallLaw):
    """Restitution, as a user-defined law."""

    e: float
    book = "dissipated"

    def leave(self, v, n, u, random, mass):
        """(1 + e) times the normal velocity is turned."""
        return v - (1.0 + self.e) * dot(v - u, n) * n


def laws(*each):
    return {"laws": list(each)}


STILL = {"motion": swarm.Translation((0.0, 0.0, 0.0))}
SHAKEN = {"motion": swarm.Oscillation((0.01, 0.0, 0.005), 1.3)}
KEEP = {
    "mirror": {},
    "restitution 1": {"restitution": 1.0},
    "friction 0": {"friction": 0.0},
    "accommodation 0": {"temperature": 1.0, "accommodation": 0.0},
    "lambert": laws(swarm.Lambert()),
    "half lambert": laws(swarm.Lambert(0.5)),
    "cercignani-lampis of a mirror": laws(swarm.CercignaniLampis(1.0, 0.0, 0.0)),
    "absorbs none": laws(swarm.Absorb(0.0)),
    "barrier": laws(swarm.Absorb(barrier=1e9), swarm.Lambert()),
    "turning": laws(Turning()),
    "reversing": laws(Reversing()),
    "damped by nothing": laws(Damped(1.0)),
    "lambert, damped by nothing": laws(swarm.Lambert(), Damped(1.0)),
    "still": STILL,
    "still lambert": {**STILL, **laws(swarm.Lambert())},
}
BOOK = {
    "restitution": {"restitution": 0.999},
    "friction": {"friction": 0.01},
    "temperature": {"temperature": 1.0},
    "half accommodation": {"temperature": 1.0, "accommodation": 0.5},
    "cercignani-lampis": laws(swarm.CercignaniLampis(1.0, 0.7, 0.4)),
    "damped": laws(Damped(0.999)),
    "lambert, damped": laws(swarm.Lambert(), Damped(0.999)),
    "shaken": SHAKEN,
    "shaken lambert": {**SHAKEN, **laws(swarm.Lambert())},
    "half lambert, damped, shaken": {**SHAKEN, **laws(swarm.Lambert(0.5), Damped(0.999))},
}
VESSELS = {
    "box": lambda **law: [swarm.Box((0.5, 0.4, 0.45), **law)],
    "ball": lambda **law: [swarm.Sphere(0.5, **law)],
    "can": lambda **law: [swarm.Cylinder(0.5, length=0.9, **law)],
    "box and post": lambda **law: [
        swarm.Box((0.5, 0.4, 0.45), **law), swarm.Sphere(0.1, (0.1, 0.0, 0.0), side="outside", **law)
    ],
}  # fmt: skip
GRAVITIES = [None, (0.3, -0.2, -1.0)]


def made(law, seed, radius=0.06, count=1):
    """(scene, particles) of a seed."""
    random = np.random.default_rng([55, seed])
    name, gravity = str(random.choice(sorted(VESSELS))), GRAVITIES[random.integers(len(GRAVITIES))]
    scene = swarm.Scene(VESSELS[name](**law), gravity)
    sized = {} if radius is None else {"radius": radius}
    mass = float(10.0 ** random.uniform(-3.0, 3.0))
    return scene, swarm.fill(scene, count, speed=1.0, mass=mass, seed=seed, **sized)


def errors(made, until, dt=None, **options):
    """(error of the energy that is kept or booked, relative to the largest part of it; impacts and collisions)."""
    options = {"compile": "never", "threads": 1, "every": until / 8, **options}
    seen = swarm.simulate(*made, swarm.Impact(dt=dt), until=until, **options).observables
    parts = [seen["total_energy"], seen["dissipated_energy"]]
    parts += [-np.asarray(seen[name]).sum(axis=1) for name in ("wall_heat", "wall_work") if name in seen]
    scale = max(np.abs(part).max() for part in (*parts, seen["kinetic_energy"], seen["potential_energy"]))
    kept = np.sum(parts, axis=0)
    happened = float(seen["impacts"][-1] + (seen["collisions"][-1] if "collisions" in seen else 0.0))
    return (kept - kept[0]) / scale, happened


@pytest.mark.parametrize("name", KEEP)
def test_a_ball_alone_keeps_its_energy_exactly(name):
    seed = list(KEEP).index(name)
    found, happened = errors(made(KEEP[name], seed), 90.0)
    assert happened > 90
    assert np.abs(found).max() <= EXACT * EPS, f"made(KEEP[{name!r}], {seed})"


@pytest.mark.parametrize("name", ["mirror", "lambert", "turning", "still lambert"])
def test_a_point_is_the_control(name):
    found, happened = errors(made(KEEP[name], 3, radius=None), 90.0)
    assert happened > 90
    assert np.abs(found).max() <= EXACT * EPS, f"made(KEEP[{name!r}], 3, None)"


@pytest.mark.parametrize("name", BOOK)
def test_the_books_of_a_ball_are_a_walk_of_round_off(name):
    seed = list(BOOK).index(name)
    found, happened = errors(made(BOOK[name], seed), 60.0)
    assert happened > 60
    assert np.abs(found).max() <= WALK * EPS * math.sqrt(happened), f"made(BOOK[{name!r}], {seed})"


def test_a_body_is_the_control():
    """Its energy decides its speed too."""
    scene = swarm.Scene([swarm.Box((0.3, 0.25, 0.2), restitution=1.0, friction=0.0)])
    corners = 0.05 * np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
    die = swarm.place(scene, swarm.rigid(corners, 1000.0), 1, speed=1.0, seed=1)
    found, happened = errors((scene, die), 3.0, dt=0.01)
    assert happened > 5
    assert np.abs(found).max() <= WALK * EPS * math.sqrt(happened)


# --- Many impacts ----------------------------------------------------------------------------------------


@pytest.mark.long
@pytest.mark.parametrize("name", KEEP)
def test_balls_keep_their_energy_for_a_million_impacts(name):
    """Alone exactly, and as many that collide but for a walk: 1e6 impacts show a bias of 1e-19 each."""
    seed = list(KEEP).index(name)
    found, happened = errors(made(KEEP[name], seed), 9e5, compile="auto")
    assert happened > 1e6
    assert np.abs(found).max() <= EXACT * EPS, f"made(KEEP[{name!r}], {seed})"
    found, happened = errors(made(KEEP[name], seed, count=8), 7e4, compile="auto")
    assert happened > 1e6
    assert np.abs(found).max() <= WALK * EPS * math.sqrt(happened), f"made(KEEP[{name!r}], {seed}, count=8)"


@pytest.mark.long
@pytest.mark.parametrize("name", BOOK)
def test_the_books_hold_for_many_impacts(name):
    seed = list(BOOK).index(name)
    found, happened = errors(made(BOOK[name], seed, count=8), 1e4, compile="auto")
    assert np.abs(found).max() <= WALK * EPS * math.sqrt(happened), f"made(BOOK[{name!r}], {seed}, count=8)"
