"""Random shapes x laws x sources x counters x openings x gravity x motions at once: all books and numbers balance, and
the bits are the same for any threads, blocks, halts, sessions and tiers.
"""

import functools

import numpy as np
import pytest
from bounded import bounded
from conftest import rarely
from cut_short import require_same_bits
from energy_books import unbooked
from same_bits import require_same
from stability.test_against_an_event_loop import (
    FRAMES,
    METHOD,
    PASSES,
    SOLIDS,
    UNIONS,
    UNTIL,
    VESSELS,
    Rubbing,
    a_motion,
    compared,
    laws_in,
    with_opening,
)

import swarm
from swarm.kernel.vector import dot
from swarm.run.engine import Run
from swarm.sources.births import with_births

NUMBER = 6
ALL = {**VESSELS, **UNIONS}
OUTSIDE, UNBOOKED = 1e-12, 1e-12
# Nearer to a counter than this a position does not say on which side of it a particle is [m].
ON = 1e-9
SEEDS = range(12)
# What does not go together, each a sentence before the run or at the moment.
REFUSED = (
    "must be free when particles come",
    "must be in the vessel",
    "must come where no particle is",
    "wait where walls move",
)
# A cone has a tip, into which particles slide: there a run may end with this sentence.
TIP = "meets its walls without end, as in a cusp"


class Damped(swarm.WallLaw):
    """A restitution that depends on a random number, and a loss at slow impacts."""

    e: float
    slow: float
    book = "dissipated"

    def leave(self, v, n, u, random, mass):
        b = -dot(v - u, n)
        e = self.e + (1.0 - self.e) * random.uniform(0)
        return swarm.Leave(v + (1.0 + e) * b * n, stays=(b > self.slow) | (random.uniform(1) < 0.5))


def some_laws(random, moves, certain):
    """What a surface has of laws: built in, user-defined, several, or restitution, friction and a temperature.

    `certain`: what the event loop knows.
    """
    e, mu = float(random.choice([1.0, 0.9, 0.5])), float(random.choice([0.0, 0.3, 1.0]))
    if certain:
        kinds = {"restitution": e, "friction": mu}, {"laws": [Rubbing(e, mu)]}, {"laws": laws_in(random)}
        return kinds[random.integers(3)]
    lists = [
        [swarm.Lambert(float(random.choice([0.3, 1.0])))],
        [swarm.Absorb(0.1)],
        [swarm.Absorb(barrier=1.5, loss=0.05)],
        [swarm.CercignaniLampis(0.4, 0.7, 0.3)],
        [swarm.Absorb(0.05), swarm.Lambert()],
        [Damped(0.5, 0.3)],
        [Damped(0.8, 0.05), swarm.CercignaniLampis(0.1, 0.2, 1.0)],
        [Rubbing(e, mu), swarm.Absorb(barrier=3.0)],
    ]
    if not moves:
        lists += [[swarm.Sticky(0.1)], [swarm.Absorb(0.1), swarm.Lambert(), swarm.Sticky(0.02)]]
    kinds = len(lists) + 3
    k = int(random.integers(kinds))
    if k >= len(lists):
        return [{}, {"restitution": e, "friction": mu}, {"temperature": 0.5, "accommodation": 0.6}][k - len(lists)]
    more = {"restitution": e, "friction": mu} if random.random() < 0.3 else {}
    return {"laws": lists[k], **more}


def a_scene(seed, certain=False):
    """(scene, start, sources, counters), all drawn; `certain`: as the event loop knows them."""
    random = np.random.default_rng([61, seed])
    vessel = str(random.choice(sorted(ALL)))
    solid = "nothing" if vessel == "torus" else str(random.choice(sorted(SOLIDS)))
    moves = random.random() < 0.4
    surfaces = []
    for make in (ALL[vessel], SOLIDS[solid]):
        motion = a_motion(random) if moves and random.random() < 0.7 else None
        made = make(motion=motion, **some_laws(random, moves, certain))
        if make is ALL[vessel] and motion is None and random.random() < 0.5:
            made[0] = with_opening(made[0], (0.0, np.inf) if random.random() < 0.5 else (0.2, 0.7), random)
        surfaces += made
    gravity = [None, (0.0, 0.0, -9.81), (-1.0, 2.0, -3.0)][random.integers(3)]
    scene = swarm.Scene(surfaces, gravity)
    start = swarm.fill(scene, NUMBER, speed=float(random.choice([0.0, 1.0, 2.0])), seed=seed)
    return scene, start, some_sources(scene, start, random, 1.0 if certain else 2.0), some_counters(random)


def some_sources(scene, start, random, mass):
    """In a volume, on a wall at rest, and at an opening."""
    by = {"speed": 1.0}, {"temperature": 0.5}, {"speed": 0.0}
    here = swarm.Sphere(0.02, tuple(start.position[:, 0].tolist()))
    sources = [swarm.Source(here, volume=True, count=3, stop=UNTIL, mass=mass, **by[random.integers(3)])]
    first = scene.surfaces[0]
    if first.motion is None:
        sources.append(swarm.Source(0, rate=4.0, even=True, start=0.1, **by[random.integers(2)]))
        if first.openings:
            sources.append(swarm.Source(first.openings[0], rate=4.0, even=True, **by[random.integers(2)]))
    return sources


def some_counters(random):
    """A plane, a volume, and a patch of a plane."""
    center = tuple(random.uniform(-0.15, 0.15, 3).tolist())
    volumes = [
        swarm.Sphere(0.2, center),
        swarm.Sphere(0.15, center, side="outside"),
        swarm.Box((0.2, 0.15, 0.1), center, rotation=(0.9, 0.1, 0.3, 0.2)),
        swarm.Union([swarm.Sphere(0.15), swarm.Sphere(0.12, center)]),
        swarm.Cylinder(0.12, (0.2, 0.3, 1.0), 0.5),
    ]
    normal = tuple(random.standard_normal(3).tolist())
    plane = swarm.Plane(normal, float(random.uniform(-0.1, 0.1)))
    return [plane, volumes[random.integers(len(volumes))], swarm.Counter(plane, inside=swarm.Sphere(0.25, center))]


def run(made, **more):
    """The scene with the arguments that all runs of it have."""
    scene, start, sources, counters = made
    given = {"until": UNTIL, "every": UNTIL / FRAMES, "threads": 1, "compile": "never"}
    return swarm.simulate(scene, start, METHOD, sources=sources, counters=counters, **{**given, **more})


def ran(made, **more):
    """The run of a scene, or None where what does not go together is refused."""
    try:
        return run(made, **more)
    except (swarm.SceneError, swarm.RunError) as refused:
        in_tip = TIP in str(refused) and isinstance(made[0].surfaces[0], swarm.Cone)
        if in_tip or any(sentence in str(refused) for sentence in REFUSED):
            return None
        raise


def is_out(surface, points):
    """1 out of the admissible side of a counter, 0 inside, -1 where round-off decides."""
    value = (-1.0 if getattr(surface, "side", "inside") == "outside" else 1.0) * surface.phi(points)
    slope = np.linalg.norm(surface.gradient(points), axis=0)
    return np.where(np.abs(value) <= ON * np.maximum(slope, 1e-3), -1, value > 0.0)


def require_balance(made, result, frames, born):
    """Of numbers, of what crosses the counters, and of energy."""
    scene, start, _sources, counters = made
    seen, n = result.observables, len(start)
    assert seen["max_penetration"].max() <= OUTSIDE
    assert (np.diff(seen["impacts"]) >= 0).all()
    ends = seen["time"]
    absorbed = seen.get("absorbed", np.zeros((len(ends), 1), int)).sum(axis=1)
    taken, gone, birth = result.absorbed_time, result.escape_time, result.birth_time
    gone = np.full(len(birth), np.nan) if gone is None else gone
    assert not (np.isfinite(taken) & np.isfinite(gone)).any()
    assert not (taken < birth).any()
    assert not (gone < birth).any()
    for k, (time, frame) in enumerate(frames):
        here = np.isfinite(frame.position).all(axis=0)
        np.testing.assert_array_equal(here, birth <= time)
        assert absorbed[k] == np.count_nonzero(taken <= time)
        assert seen["escaped"][k] == np.count_nonzero(gone <= time)
        assert here.sum() == n + seen["born"][k].sum()
    scale = max(np.abs(seen[name]).max() for name in ("kinetic_energy", "potential_energy", "source_energy"))
    assert unbooked(seen) <= UNBOOKED * scale
    # A particle that ended stays where it ended.
    ended = np.isfinite(taken) | np.isfinite(gone)
    if ended.any():
        gaps = scene.gaps(result.particles.position[:, ended])
        assert (np.abs(gaps).min(axis=0) <= OUTSIDE).all() or any(one.motion is not None for one in scene.surfaces)
    for c, counter in enumerate(counters):
        if isinstance(counter, swarm.Counter):
            continue
        before, net = is_out(counter, born.position), np.diff(seen["crossings"][:, c], axis=1)[:, 0]
        for k, (time, frame) in enumerate(frames):
            there = birth <= time
            after = is_out(counter, frame.position[:, there])
            unsure = np.count_nonzero((before[there] < 0) | (after < 0))
            change = np.where((before[there] < 0) | (after < 0), 0, after - before[there]).sum()
            assert abs(-net[k] - change) <= unsure, f"counter {c}, frame {k}"


def holds(seed, folder, certain=False):
    """The run of a seed, with what balances; returns the scene, the result, and states compared to the event loop."""
    made, path = a_scene(seed, certain), folder / f"{seed}.h5"
    result = ran(made, trajectory=path)
    if result is None:
        return made, None, 0
    with swarm.load(path) as trajectory:
        frames = [(float(time), trajectory.frame(k)) for k, time in enumerate(trajectory.times)]
    scene, start, sources, _counters = made
    born = with_births(scene, start, tuple(sources), 0, UNTIL)
    require_balance(made, result, frames, born)
    return made, result, compared(scene, born, frames, result) if certain else 0


def has_same_bits(seed, folder, monkeypatch):
    """Any threads and blocks, halts within frames, and sessions."""
    made = a_scene(seed)
    whole = ran(made)
    if whole is not None:
        require_same_bits(monkeypatch, Run, whole, functools.partial(run, made), folder / "parts.h5")


def hold_many(seeds, folder, monkeypatch, certain=False):
    """Of many seeds; returns how many states were compared, and how many scenes were none."""
    count, states, none = bounded(monkeypatch, PASSES), 0, 0
    for seed in seeds:
        count[0] = 0
        _made, result, compared_ones = holds(seed, folder, certain)
        states, none = states + compared_ones, none + (result is None)
    return states, none


@pytest.mark.physics
@pytest.mark.parametrize("seed", SEEDS)
def test_some_scenes(seed, tmp_path, monkeypatch):
    bounded(monkeypatch, PASSES)
    holds(seed, tmp_path)


@pytest.mark.physics
@pytest.mark.parametrize("seed", SEEDS)
def test_some_scenes_against_the_event_loop(seed, tmp_path, monkeypatch):
    bounded(monkeypatch, PASSES)
    holds(seed, tmp_path, certain=True)


@pytest.mark.physics
@pytest.mark.parametrize("seed", [1, 4, 7])
def test_some_scenes_have_the_same_bits(seed, tmp_path, monkeypatch):
    has_same_bits(seed, tmp_path, monkeypatch)


@pytest.mark.physics
@pytest.mark.parametrize("seed", [2, *map(rarely, range(20, 26))])
def test_kernels_that_are_compiled_have_the_same_bits(seed, tmp_path):
    made, result, _ = holds(seed, tmp_path)
    if result is not None:
        require_same(result, run(made, compile="always", threads=2))


@pytest.mark.long
@pytest.mark.parametrize("hundred", range(5))
def test_many_scenes(hundred, tmp_path, monkeypatch):
    _states, none = hold_many(range(100 * hundred, 100 * hundred + 100), tmp_path, monkeypatch)
    assert none < 20


@pytest.mark.long
@pytest.mark.parametrize("hundred", range(5))
def test_many_scenes_against_the_event_loop(hundred, tmp_path, monkeypatch):
    states, _none = hold_many(range(100 * hundred, 100 * hundred + 100), tmp_path, monkeypatch, certain=True)
    assert states >= 2000


@pytest.mark.long
@pytest.mark.parametrize("seed", range(30, 90))
def test_many_scenes_have_the_same_bits(seed, tmp_path, monkeypatch):
    has_same_bits(seed, tmp_path, monkeypatch)
