"""Random shapes x motions x laws x gravity x doors: every run ends, nothing is outside, every joule is booked, and as
long as no contact lasts each particle is where a plain event loop has it.
"""

import dataclasses

import numpy as np
import pytest
from bounded import bounded
from energy_books import unbooked
from physics.event_loop import follow

import swarm
from swarm.kernel.vector import dot, norm
from swarm.sources.births import with_births

UNTIL, FRAMES, NUMBER = 1.0, 8, 4
# Coarse steps while it slides: the event loop says nothing of those.
METHOD = swarm.Impact(sliding_tolerance=1e-7)
# Passes of all kernels in one run; most take a dozen, sliding ones hundreds.
PASSES = 5_000
# Of the ring that takes minutes.
SEEDS = range(16)
# What 1e-9 m at the start grows to by a time, an error of round-off grows to in proportion.
NUDGE, SPARE, LEAST = 1e-9, 1e-3, 1e-11
# Of so many surfaces restitution and friction are a law of the user's.
OWN = 0.3
# And of so many those of the package are in front of both.
PACKAGE = 0.5
# Of so many solids the wall goes, and of so many vessels at rest an opening opens, for a time.
DOORS = 0.4
# [m], and of the largest energy.
OUTSIDE, UNBOOKED = 1e-12, 1e-11

VESSELS = {
    "box": lambda **wall: [swarm.Box((0.5, 0.4, 0.35), **wall)],
    "askew box": lambda **wall: [swarm.Box((0.5, 0.4, 0.35), rotation=(0.9, 0.1, 0.3, 0.2), **wall)],
    "slabs": lambda **wall: [
        swarm.Slab((1.0, 0.2, 0.0), 0.5, **wall),
        swarm.Slab((0.0, 1.0, 0.3), 0.4, **wall),
        swarm.Slab((-0.2, 0.0, 1.0), 0.35, **wall),
    ],
    "sphere": lambda **wall: [swarm.Sphere(0.5, **wall)],
    "ellipsoid": lambda **wall: [swarm.Ellipsoid((0.5, 0.4, 0.6), **wall)],
    "can": lambda **wall: [swarm.Cylinder(0.4, (1.0, 0.5, 0.3), 0.9, **wall)],
    "drum": lambda **wall: [swarm.Cylinder(0.4, (0.0, 1.0, 0.0), 0.5, **wall)],
    "capsule": lambda **wall: [swarm.Capsule(0.35, 0.5, **wall)],
    "torus": lambda **wall: [swarm.Torus(0.6, 0.3, **wall)],
    "cone and lid": lambda **wall: [
        swarm.Cone(0.7, center=(0.0, 0.0, -0.5), **wall),
        swarm.Plane((0.0, 0.0, 1.0), 0.3, **wall),
    ],
    "bowl and lid": lambda **wall: [
        swarm.Paraboloid(0.2, center=(0.0, 0.0, -0.5), **wall),
        swarm.Plane((0.0, 0.0, 1.0), 0.2, **wall),
    ],
}
SOLIDS = {
    "nothing": lambda **wall: [],
    "ball": lambda **wall: [swarm.Sphere(0.12, (0.05, 0.0, 0.02), side="outside", **wall)],
    "block": lambda **wall: [swarm.Box((0.1, 0.12, 0.08), side="outside", **wall)],
    "rod": lambda **wall: [swarm.Cylinder(0.08, (0.0, 1.0, 0.5), 0.2, side="outside", **wall)],
}


# Vessels of several parts, of one law and one motion each.
UNIONS = {
    "two balls": lambda **wall: [
        swarm.Union([swarm.Sphere(0.4, (-0.2, 0.0, 0.0)), swarm.Sphere(0.35, (0.25, 0.1, 0.0))], **wall)
    ],
    "ball and tube": lambda **wall: [
        swarm.Union([swarm.Sphere(0.4), swarm.Cylinder(0.15, (0.2, 0.1, 1.0), 1.0, (0.1, 0.0, -0.4))], **wall)
    ],
    "boxes": lambda **wall: [
        swarm.Union([swarm.Box((0.5, 0.3, 0.35)), swarm.Box((0.2, 0.6, 0.25), (0.2, 0.2, -0.1))], **wall)
    ],
    "T": lambda **wall: [
        swarm.Union(
            [
                swarm.Cylinder(0.25, (1.0, 0.0, 0.0), 1.2),
                swarm.Cylinder(0.2, (0.1, 0.1, 1.0), 0.8, (0.0, 0.0, -0.4)),
                swarm.Capsule(0.2, 0.5, (0.0, 1.0, 0.0), (0.2, 0.3, 0.0)),
            ],
            **wall,
        )
    ],
}


class Rubbing(swarm.WallLaw):
    """Restitution and Coulomb's friction, as a user may write them."""

    e: float
    mu: float

    def leave(self, v, n, u, random, mass):
        b = -dot(v - u, n)
        slip = v - u + b * n
        speed = norm(slip)
        share = min(self.mu * (1.0 + self.e) * b / speed, 1.0) if speed > 0.0 else 0.0
        return u + (1.0 - share) * slip + self.e * b * n


def a_motion(random):
    """A motion, or none; displacements of some centimetres."""
    spot = tuple(random.uniform(-0.1, 0.1, 3).tolist())
    parts = {
        "translation": swarm.Translation(tuple(random.uniform(-0.05, 0.05, 3).tolist())),
        "oscillation": swarm.Oscillation(
            tuple((random.uniform(-0.05, 0.05, 3) * random.integers(0, 2, 3)).tolist()),
            float(random.uniform(0.5, 3.0)),
            float(random.choice([0.0, 1.0])),
        ),
        "rotation": swarm.Rotation(
            [(0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 2.0, 3.0)][random.integers(3)],
            float(random.choice([0.0, -0.7, 1.0, 3.0])),
            [(0.0, 0.0, 0.0), spot][random.integers(2)],
        ),
    }
    chosen = [[], ["translation"], ["oscillation"], ["rotation"], ["oscillation", "rotation"], list(parts)]
    motions = [parts[name] for name in chosen[random.integers(len(chosen))]]
    return sum(motions[1:], start=motions[0]) if motions else None


def laws_in(random):
    """One, two or three laws of the package, in any order."""
    kinds = [
        swarm.Lambert(float(random.choice([0.5, 1.0]))),
        swarm.CercignaniLampis(*random.uniform([0.1, 0.0, 0.0], [1.0, 1.0, 2.0]).tolist()),
        [swarm.Absorb(0.2), swarm.Absorb(barrier=0.8, loss=0.1)][random.integers(2)],
    ]
    return [kinds[k] for k in random.permutation(3)[: random.integers(1, 4)]]


def with_opening(wall, times, random):
    """A wall with an opening at a place of it, open between two times."""
    r = random.standard_normal(3)
    r *= 0.3 / np.linalg.norm(r)
    for _move in range(50):
        slope = wall.gradient(r[:, None])[:, 0]
        r = r - wall.phi(r[:, None])[0] / (slope @ slope) * slope
    return dataclasses.replace(wall, openings=[swarm.Opening(swarm.Sphere(0.25, tuple(r.tolist())), [tuple(times)])])


def a_scene(seed, vessels=VESSELS):
    """(scene, particles): kinds, motions, laws and gravity, all drawn."""
    random, own, doors, package = (np.random.default_rng([key, seed]) for key in (39, 41, 43, 47))
    vessel, solid = (str(random.choice(sorted(kinds))) for kinds in (vessels, SOLIDS))
    if vessel == "torus":
        solid = "nothing"
    surfaces = []
    for make in (vessels[vessel], SOLIDS[solid]):
        law = {"restitution": float(random.choice([1.0, 0.9, 0.5])), "friction": float(random.choice([0.0, 0.3, 1.0]))}
        if own.random() < OWN:
            law = {"laws": [Rubbing(law["restitution"], law["friction"])]}
        elif package.random() < PACKAGE:
            law["laws"] = laws_in(package)
        motion = a_motion(random)
        times = np.round(np.sort(doors.uniform(0.05, 0.95, 2)), 3).tolist()
        if doors.random() < DOORS and make is SOLIDS[solid]:
            law["present"] = [(0.0, times[0]), *([(times[1], np.inf)] if doors.random() < DOORS else [])]
        made = make(motion=motion, **law)
        if doors.random() < DOORS and make is vessels[vessel] and motion is None:
            made[0] = with_opening(made[0], times, doors)
        surfaces += made
    gravity = [None, (0.0, 0.0, -9.81), (-1.0, 2.0, -3.0)][random.integers(3)]
    scene = swarm.Scene(surfaces, gravity)
    return scene, swarm.fill(scene, NUMBER, speed=float(random.choice([0.0, 1.0, 2.0])), seed=seed)


def compared(scene, start, frames, result):
    """Hold every particle against the event loop, as long as that can say; returns how many states were compared."""
    states = 0
    times, born = [time for time, _ in frames], result.birth_time
    for i in range(len(born)):
        r, v = start.position[:, i], start.velocity[:, i]
        late = [time for time in times if time >= born[i]]
        first = len(times) - len(late)
        exact = follow(scene, r, v, late, born[i], i)
        near = [follow(scene, r + nudge, v, late, born[i], i) for nudge in NUDGE * np.eye(3)]
        certain = min(len(one.position) for one in (exact, *near))
        for k in range(certain):
            grown = max(np.abs(one.position[k] - exact.position[k]).max() for one in near)
            if grown > 1e4 * NUDGE or any(one.impacts[k] != exact.impacts[k] for one in near):
                certain = k
                break
            bar = LEAST + SPARE * grown
            frame = frames[first + k][1]
            assert frame.position[:, i] == pytest.approx(exact.position[k], abs=bar), f"particle {i}, frame {k}"
            assert frame.velocity[:, i] == pytest.approx(exact.velocity[k], abs=1e2 * bar), f"particle {i}, frame {k}"
        states += certain
        if certain == len(late):
            assert result.impacts_per_particle[i] == exact.impacts[-1], f"particle {i}"
    return states


def with_sources(scene, start, seed):
    """Two sources: on the vessel, if that is at rest, by any law; and where the first particle is at the start."""
    random = np.random.default_rng([47, seed])
    laws = {"speed": 1.0}, {"temperature": 0.5}, {"speed": 0.0}
    here = swarm.Sphere(0.02, tuple(start.position[:, 0].tolist()))
    sources = [swarm.Source(here, volume=True, count=2, stop=UNTIL, **laws[random.integers(3)])]
    for i, surface in enumerate(scene.surfaces):
        if surface.motion is None and surface.present is None and not surface.is_solid():
            sources.append(swarm.Source(i, rate=2.0, even=True, start=0.1, **laws[random.integers(2)]))
            break
    return sources


def holds(seed, folder, vessels=VESSELS, sourced=False):
    """Run the scene of a seed and look at everything; returns how many states were compared with the event loop."""
    scene, start = a_scene(seed, vessels)
    path = folder / f"{seed}.h5"
    times = {"until": UNTIL, "every": UNTIL / FRAMES, "trajectory": path, "threads": 1, "compile": "never"}
    times["sources"] = with_sources(scene, start, seed) if sourced else None
    try:
        result = swarm.simulate(scene, start, METHOD, **times)
    except swarm.SceneError as refused:
        if "must be free when particles come" in str(refused) or "must be in the vessel" in str(refused):
            return 0  # a wall that moves, or comes, is there
        raise
    except swarm.RunError as failed:
        # A solid has come back where a particle was.
        if "must come where no particle is" in str(failed) and len(scene.surfaces[-1].present or ()) > 1:
            return 0
        raise
    seen = result.observables
    assert seen["max_penetration"].max() <= OUTSIDE
    scale = max(np.abs(seen[name]).max() for name in ("kinetic_energy", "potential_energy"))
    assert unbooked(seen) <= UNBOOKED * scale
    assert (np.diff(seen["impacts"]) >= 0).all()
    with swarm.load(path) as trajectory:
        frames = [(float(time), trajectory.frame(k)) for k, time in enumerate(trajectory.times)]
    if sourced:
        start = with_births(scene, start, tuple(times["sources"]), 0, UNTIL)
    return compared(scene, start, frames, result)


@pytest.mark.physics
@pytest.mark.parametrize("seed", SEEDS)
def test_some_scenes_that_move(seed, tmp_path, monkeypatch):
    bounded(monkeypatch, PASSES)
    holds(seed, tmp_path)


@pytest.mark.physics
@pytest.mark.parametrize("seed", range(8))
def test_some_unions_that_move(seed, tmp_path, monkeypatch):
    bounded(monkeypatch, PASSES)
    holds(seed, tmp_path, UNIONS)


@pytest.mark.physics
@pytest.mark.parametrize("seed", range(8))
def test_some_scenes_that_move_with_sources(seed, tmp_path, monkeypatch):
    bounded(monkeypatch, PASSES)
    holds(seed, tmp_path, sourced=True)


@pytest.mark.long
@pytest.mark.parametrize("hundred", range(5))
def test_many_scenes_with_sources(hundred, tmp_path, monkeypatch, capsys):
    """A fourth of the vessels unions."""
    count, states = bounded(monkeypatch, PASSES), 0
    for seed in range(100 * hundred, 100 * hundred + 100):
        count[0] = 0
        states += holds(seed, tmp_path, UNIONS if seed % 4 == 0 else VESSELS, sourced=True)
    with capsys.disabled():
        print(f"\n{states} states are those of the event loop", end="")
    assert states >= 1000


@pytest.mark.long
@pytest.mark.parametrize("twenty", range(10))
def test_many_unions_that_move(twenty, tmp_path, monkeypatch):
    count = bounded(monkeypatch, PASSES)
    for seed in range(20 * twenty, 20 * twenty + 20):
        count[0] = 0
        holds(seed, tmp_path, UNIONS)


@pytest.mark.long
@pytest.mark.parametrize("hundred", range(10))
def test_many_scenes_that_move(hundred, tmp_path, monkeypatch, capsys):
    """A thousand, and how many states the event loop could say something of."""
    count, states = bounded(monkeypatch, PASSES), 0
    for seed in range(100 * hundred, 100 * hundred + 100):
        count[0] = 0
        states += holds(seed, tmp_path)
    with capsys.disabled():
        print(f"\n{states} states are those of the event loop", end="")
    assert states >= 1000
