"""Random shapes x radii x masses x losses x gravity x cells x planes x motions with balls that meet: every run ends, no
ball is in another one or in a wall, every joule is booked, the bits are the same for any threads, halts and sessions,
and as long as rounding allows each ball is where a plain event loop has it.
"""

import functools
import math

import mpmath
import numpy as np
import pytest
from conftest import rarely
from cut_short import require_same_bits
from energy_books import unbooked
from physics import ball_loop
from physics.ball_loop import follow
from physics.ball_walls import Walls
from same_bits import require_same
from stability.test_against_an_event_loop import SOLIDS, VESSELS, a_motion

import swarm
from swarm.events.balls_run import CollidingRun
from swarm.events.colliding import events

UNTIL, FRAMES, NUMBER = 1.0, 8, 7
REFUSED = []
# The contact durations of pairs that scenes draw [s].
SHORT, LONG = 1e-4, 1e-2
# Most runs take some hundred events. A ball that rests on a wall takes one in each contact duration.
EVENTS = NUMBER * round(UNTIL / SHORT)
SEEDS = range(24)
# What 1e-9 m at the start grows to by a time, an error of round-off grows to in proportion.
NUDGE, SPARE, LEAST = 1e-9, 1e-4, 1e-13
# Starts nearer than this to one another or to a wall are not taken [m].
APART = 1e-3
# Of the largest energy.
UNBOOKED = 1e-13
# Places of frames are r + v t and a square of it: so many roundings of the farthest one.
ROUNDINGS = 4
# A parabola is no shape whose distance the loop knows.
SHAPES = {name: make for name, make in VESSELS.items() if name != "bowl and lid"}
DISCS = {
    "box": lambda **wall: [swarm.Box((0.5, 0.4, 0.35), **wall)],
    "slabs": lambda **wall: [swarm.Slab((1.0, 0.2, 0.0), 0.5, **wall), swarm.Slab((0.0, 1.0, 0.0), 0.4, **wall)],
    "pipe": lambda **wall: [swarm.Cylinder(0.5, **wall)],
}
POSTS = {
    "nothing": lambda **wall: [],
    # No ball is as wide as a way past it: a ball that just fits between two walls ends a run.
    "post": lambda **wall: [swarm.Cylinder(0.11, center=(0.05, 0.0, 0.0), side="outside", **wall)],
}


def walls_of(scene):
    """The walls of a scene as the event loop knows them, at rest at time 0."""
    made = Walls(float, math, 2.0**-52, scene.period)
    return [wall for one in scene.surfaces for wall in made.of(one)]


def balls_in(scene, radii, seed):
    """Balls of these radii at places with room, as many as there are, largest first."""
    walls, points = walls_of(scene), swarm.fill(scene, 3000, speed=1.0, seed=seed).position
    places, held = [], []
    for radius in sorted(radii, reverse=True):
        for r in points.T:
            near = [r - other for other in places]
            if scene.period is not None:
                lengths = np.array([length or np.inf for length in scene.period])
                near = [d - np.where(np.isfinite(lengths), lengths, 0.0) * np.round(d / lengths) for d in near]
            clear = all(math.hypot(*d) > radius + other + APART for d, other in zip(near, held, strict=True))
            if clear and all(wall.distance(r) > radius + APART for wall in walls):
                places.append(r)
                held.append(radius)
                break
    return np.array(places).T, np.array(held)


def a_scene(seed):
    """(scene, particles), all drawn."""
    random = np.random.default_rng([71, seed])
    flat, repeats = random.random() < 0.25, random.random() < 0.25
    moves = not repeats and random.random() < 0.4
    law = {"restitution": float(random.choice([1.0, 1.0, 0.9, 0.5]))}
    gravity = [None, None, (0.0, 0.0, -9.81), (-1.0, 2.0, -3.0)][random.integers(4)]
    if flat:
        gravity = None if gravity is None else (-1.0, -2.0, 0.0)
        vessel, solid = str(random.choice(sorted(DISCS))), str(random.choice(sorted(POSTS)))
        makers = DISCS[vessel], POSTS[solid]
    else:
        vessel, solid = str(random.choice(sorted(SHAPES))), str(random.choice(sorted(SOLIDS)))
        makers = SHAPES[vessel], SOLIDS["nothing" if vessel == "torus" else solid]
    period, surfaces = None, []
    if repeats:
        period = (0.9, 1.0, None if flat else 1.1)
        if random.random() < 0.5:
            center = (0.05, 0.5, 0.0 if flat else 0.6)
            shape = swarm.Cylinder if flat else swarm.Sphere
            surfaces = [shape(0.12, center=center, side="outside", **law)]
        elif not flat and random.random() < 0.5:
            period, surfaces = (0.9, 1.0, None), [swarm.Slab((0.0, 0.0, 1.0), 0.5, **law)]
    else:
        for make in makers:
            motion = a_motion(random) if moves and not flat and random.random() < 0.7 else None
            surfaces += make(motion=motion, **law)
    pairs = swarm.Pairs(
        restitution=float(random.choice([1.0, 1.0, 0.9, 0.6])), contact_duration=float(random.choice([SHORT, LONG]))
    )
    scene = swarm.Scene(surfaces, gravity, period, "z" if flat else None, pairs)
    sizes = [(0.08,), (0.05, 0.1), (0.02, 0.06, 0.15)][random.integers(3)]
    position, radius = balls_in(scene, random.choice(sizes, NUMBER), seed)
    n = len(radius)
    velocity = random.normal(size=(3, n)) * float(random.choice([0.5, 1.0, 2.0]))
    velocity[2] *= not flat
    mass = [1.0, 1000.0 * radius**3, 10.0 ** random.uniform(-2.0, 2.0, n)][random.integers(3)]
    return scene, swarm.Particles(position, velocity, mass, radius=radius)


def run(made, **more):
    """The scene with the arguments that all runs of it have."""
    given = {"until": UNTIL, "every": UNTIL / FRAMES, "threads": 1, "compile": "never"}
    return swarm.simulate(*made, swarm.Impact(), **{**given, **more})


def bounded(monkeypatch):
    """Let runs fail after so many events: the count so far."""
    count = [0]

    def counted(one):
        def call(*arguments):
            count[0] += 1
            assert count[0] <= EVENTS, "time does not pass"
            return one(*arguments)

        return call

    for name in ("_collide", "_at_wall", "_enter"):
        monkeypatch.setattr(events, name, counted(getattr(events, name)))
    return count


def overlap(scene, particles):
    """The deepest that two balls, or a ball and an image, are in one another [m]."""
    r, radius = particles.position, particles.radius
    shifts = [np.zeros(3)]
    if scene.period is not None:
        ways = [(0.0,) if length is None else (-length, 0.0, length) for length in scene.period]
        shifts = [np.array(way) for way in np.stack(np.meshgrid(*ways), -1).reshape(-1, 3)]
    deepest = -math.inf
    for shift in shifts:
        between = np.sqrt(((r[:, :, None] - r[:, None] + shift[:, None, None]) ** 2).sum(axis=0))
        np.fill_diagonal(between, math.inf)
        deepest = max(deepest, (radius[:, None] + radius - between).max(initial=-math.inf))
    return deepest


def compared(scene, start, frames, seen):
    """Hold all balls against the event loop, as long as that can say; returns how many frames were compared."""
    times = [time for time, _ in frames]
    exact = follow(scene, start, times)
    random, near = np.random.default_rng(5), []
    flat = np.array([1.0, 1.0, 0.0 if scene.plane else 1.0])[:, None]
    for _nudged in range(3):
        nudged = start.copy()
        nudged.position = start.position + NUDGE * flat * random.uniform(-1.0, 1.0, start.position.shape)
        near.append(follow(scene, nudged, times))
    certain = min(len(one.position) for one in (exact, *near))
    for k in range(certain):
        grown = max(np.abs(one.position[k] - exact.position[k]).max() for one in near)
        same = all((one.collisions[k], one.impacts[k]) == (exact.collisions[k], exact.impacts[k]) for one in near)
        if grown > 1e4 * NUDGE or not same:
            return k
        bar, frame = LEAST + SPARE * grown, frames[k][1]
        assert (seen["collisions"][k], seen["impacts"][k]) == (exact.collisions[k], exact.impacts[k]), f"frame {k}"
        assert scene.unwrapped(frame) == pytest.approx(exact.position[k], abs=bar), f"frame {k}"
        assert frame.velocity == pytest.approx(exact.velocity[k], abs=1e2 * bar), f"frame {k}"
    return certain


def require_books(scene, start, frames, seen):
    """Energies, momenta where no wall takes any, and nothing in anything."""
    scale = max(np.abs(seen[name]).max() for name in ("kinetic_energy", "potential_energy", "dissipated_energy"))
    assert unbooked(seen) <= UNBOOKED * scale
    assert (np.diff(seen["collisions"]) >= 0).all()
    if not scene.surfaces and scene.gravity is None:
        off = np.abs(seen["momentum"] - seen["momentum"][0]).max()
        assert off <= 1e-14 * (start.mass * np.abs(start.velocity)).sum()
    for k, (_time, frame) in enumerate(frames):
        far = max(np.abs(frame.position).max(), 1.0)
        assert overlap(scene, frame) <= ROUNDINGS * np.spacing(far), f"frame {k}"
        assert seen["max_penetration"][k] <= 64 * np.spacing(far), f"frame {k}"
        if scene.plane is not None:
            assert not frame.position[2].any()
            assert not frame.velocity[2].any()


def holds(seed, folder):
    """The run of a seed; returns the scene, the result or None where it is refused, and how many frames compared."""
    made, path = a_scene(seed), folder / f"{seed}.h5"
    try:
        result = run(made, trajectory=path)
    except swarm.SceneError as refused:
        REFUSED.append(str(refused))
        return made, None, 0
    scene, start = made
    with swarm.load(path) as trajectory:
        frames = [(float(time), trajectory.frame(k)) for k, time in enumerate(trajectory.times)]
    for _time, frame in frames:
        frame.radius = start.radius
    require_books(scene, start, frames, result.observables)
    return made, result, compared(scene, start, frames, result.observables)


def has_same_bits(seed, folder, monkeypatch):
    """Any threads and blocks, halts within frames, and sessions."""
    made = a_scene(seed)
    try:
        whole = run(made)
    except swarm.SceneError:
        return
    require_same_bits(monkeypatch, CollidingRun, whole, functools.partial(run, made), folder / "parts.h5")


@pytest.mark.physics
@pytest.mark.parametrize("seed", SEEDS)
def test_some_scenes(seed, tmp_path, monkeypatch):
    bounded(monkeypatch)
    holds(seed, tmp_path)


@pytest.mark.physics
@pytest.mark.parametrize("seed", [1, 4, 7, 10])
def test_some_scenes_have_the_same_bits(seed, tmp_path, monkeypatch):
    has_same_bits(seed, tmp_path, monkeypatch)


@pytest.mark.physics
@pytest.mark.parametrize("seed", [3, *map(rarely, range(20, 26))])
def test_kernels_that_are_compiled_have_the_same_bits(seed, tmp_path):
    made, result, _ = holds(seed, tmp_path)
    if result is not None:
        require_same(result, run(made, compile="always", threads=2))


@pytest.mark.long
@pytest.mark.parametrize("hundred", range(5))
def test_many_scenes(hundred, tmp_path, monkeypatch, capsys):
    """Few are refused, and the event loop says something of most frames."""
    count, states, none = bounded(monkeypatch), 0, 0
    for seed in range(100 * hundred, 100 * hundred + 100):
        count[0] = 0
        _made, result, some = holds(seed, tmp_path)
        states, none = states + some, none + (result is None)
    with capsys.disabled():
        print(f"\n{states} frames are those of the event loop, {none} scenes are refused", end="")
    assert states >= 300
    assert none <= 30


@pytest.mark.long
@pytest.mark.parametrize("seed", range(30, 60))
def test_many_scenes_have_the_same_bits(seed, tmp_path, monkeypatch):
    has_same_bits(seed, tmp_path, monkeypatch)


# --- Three balls against fifty digits --------------------------------------------------------------------

# The first difference of the digits, what it grows to by a frame is what a round-off grows to.
TINY = mpmath.mpf(10) ** -30
# The scene, its middle, and when a difference has grown 1e12 times [s].
THREE = {
    "in a ball": (lambda: swarm.Scene([swarm.Sphere(0.5)]), 0.0, 6.75),
    "falling in a box": (lambda: swarm.Scene([swarm.Box((0.5, 0.4, 0.45))], gravity=(0.3, 0.0, -2.0)), 0.0, 4.0),
    "in a cell with a ball": (
        lambda: swarm.Scene([swarm.Sphere(0.1, (0.9, 0.5, 0.5), side="outside")], period=(1.0, 1.0, 1.0)),
        0.5,
        6.25,
    ),
    "in a cell": (lambda: swarm.Scene([], period=(1.0, 1.0, 1.0)), 0.5, 6.5),
}


@pytest.mark.physics
@pytest.mark.parametrize("name", THREE)
def test_three_balls_are_where_fifty_digits_have_them(name, tmp_path):
    """Until round-off has grown to 1e-3: some ten collisions a ball."""
    make, middle, until = THREE[name]
    scene, random = make(), np.random.default_rng(3)
    position = middle + np.array([[-0.2, 0.15, 0.0], [0.0, 0.05, 0.25], [0.02, -0.2, 0.1]])
    start = swarm.Particles(position, random.normal(size=(3, 3)), [1.0, 2.0, 0.5], radius=[0.1, 0.07, 0.12])
    result = run((scene, start), until=until, every=0.25, trajectory=tmp_path / "three.h5")
    with mpmath.workdps(50):
        times = result.observables["time"].tolist()
        exact = follow(scene, start, times, mpmath.mp)
        nudged = start.copy()
        nudged.position = start.position + np.vectorize(mpmath.mpf)(random.normal(size=(3, 3))) * TINY
        near = follow(scene, nudged, times, mpmath.mp)
        with swarm.load(tmp_path / "three.h5") as trajectory:
            for k in range(len(times)):
                grown = float(max(abs((near.position[k] - exact.position[k]) / TINY).ravel()))
                if grown > 1e12:
                    break
                happened = int(exact.collisions[k] + exact.impacts[k])
                off = np.abs((scene.unwrapped(trajectory.frame(k)) - exact.position[k]).astype(float)).max()
                assert off <= 2.0**-52 * grown * (8 + happened), f"at {times[k]} s, after {happened} events"
                assert result.observables["collisions"][k] == exact.collisions[k]
    assert grown > 1e12
    assert exact.collisions[k - 1] >= 6


def test_the_event_loop_itself():
    """Two balls head on in a tube: they exchange velocities, and lose by the square of the restitution."""
    scene = swarm.Scene([swarm.Slab((1.0, 0.0, 0.0), 1.0)], pairs=swarm.Pairs(restitution=0.5))
    start = swarm.Particles([[-0.5, 0.5], [0.0, 0.0], [0.0, 0.0]], [[1.0, -1.0], [0.0, 0.0], [0.0, 0.0]], radius=0.1)
    found = follow(scene, start, [0.0, 0.4, 1.0, 1.9])
    assert found.position[:, 0, 0] == pytest.approx([-0.5, -0.1, -0.4, -0.85])
    assert found.velocity[-1][0] == pytest.approx([-0.5, 0.5])
    assert found.lost == pytest.approx(0.75)
    assert found.virial == pytest.approx(0.2 * 1.5)
    assert found.events == [(pytest.approx(0.4), 0, 1)]
    assert ball_loop.WALL == -1
