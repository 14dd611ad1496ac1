"""The queue, the cells and the ways of balls through them, by brute force."""

import itertools
import math

import numpy as np
import pytest
from colliding.gases import frames, gas, run_of

import swarm
from swarm.events.colliding.queue import FIRST, SPARE, build, requeue
from swarm.events.colliding.rows import FLOATS, LEAVES, NO_PARTNER, PARTNER, WHOLES, Flock
from swarm.kernel import cache


def flock_of(times):
    """Balls that have one event each, which is no collision."""
    n = len(times)
    event = np.full(FLOATS * n, math.inf)
    event[LEAVES::FLOATS] = times
    tag = event.view(np.int32)
    tag[PARTNER::WHOLES] = NO_PARTNER
    item = np.zeros(n + SPARE, np.int32)
    item[FIRST : FIRST + n] = np.arange(n)
    none = np.zeros(0)
    key = np.full(n + SPARE, math.inf)
    made = Flock(none, event, tag, np.arange(FIRST, FIRST + n, dtype=np.int32), key, item, none)
    build(made)
    return made


@pytest.mark.parametrize("count", [1, 2, 5, 6, 21, 100])
def test_the_first_is_the_least(count):
    random = np.random.default_rng(count)
    # Few different times: many are equal, and some never come.
    times = np.array([0.0, 1.0, 2.0, 3.0, math.inf])
    flock = flock_of(times[random.integers(0, 5, count)])
    for _step in range(300):
        first = int(flock.item[FIRST])
        keys = flock.event[LEAVES::FLOATS]
        assert flock.key[FIRST] == keys.min()
        if keys.min() < math.inf:
            assert first == int(np.argmin(keys))
        assert (flock.item[flock.node] == np.arange(count)).all()
        assert (flock.key[flock.node] == keys).all()
        one = int(random.integers(count))
        flock.event[FLOATS * one + LEAVES] = times[random.integers(0, 5)]
        requeue(flock, one)


def cell_of_many(ratio, n=150):
    """A large ball among small ones, some of which share a cell."""
    random = np.random.default_rng(3)
    small = 0.25 / ratio
    places = np.array(list(itertools.product(np.arange(-0.92, 0.93, 0.1), repeat=3)))
    away = places[(places**2).sum(axis=1) > (0.25 + small) ** 2]
    position = np.vstack([np.zeros(3), random.permutation(away)[: n - 1]]).T
    radius = np.append(0.25, np.full(n - 1, small))
    mass = (radius / 0.25) ** 3
    return swarm.Particles(position, random.normal(size=(3, n)), mass, radius=radius)


def test_a_large_ball_among_small_ones():
    start = cell_of_many(6.0)
    scene = swarm.Scene([swarm.Box((1.0, 1.0, 1.0))])
    with run_of(scene, start) as run:
        run.observe()
        stride = run._box.grid.stride
        for k in range(10):
            run.advance(0.05, 0.05 * (k + 1))
            x = run.state.position
            b = x[:, :, None] - x[:, None, :]
            gaps = np.sqrt((b * b).sum(axis=0)) - start.radius[:, None] - start.radius
            assert gaps[np.triu_indices(len(start), 1)].min() > -1e-15
        seen = run.seen()
        assert stride > 5
    assert seen["collisions"] > 40
    assert seen["energy_error"] < 1e-14


def test_cells_get_more_room():
    """All balls come into one cell, which has room for fewer at the start."""
    scene = swarm.Scene([swarm.Box((1.0, 1.0, 1.0))])
    corners = 0.6 * np.array(list(itertools.product((-1.0, 0.0, 1.0), repeat=3))).T
    target = np.array([0.9, 0.9, 0.9])[:, None] + 0.05 * corners
    start = swarm.Particles(corners, target - corners, radius=0.01)
    with run_of(scene, start) as run:
        run.observe()
        before, coarse = run._box.grid.stride, run._box.grid.x.count
        run.advance(0.95, 0.95)
        assert run._box.grid.stride > before
        assert coarse > 2
        kept = {name: array.copy() for name, array in run.arrays().items()}
        run.advance(1.0, 1.95)
        expected = run.state.position.copy()
    with run_of(scene, start) as run:
        run.restore(kept, False)
        run.advance(1.0, 1.95)
        assert (run.state.position == expected).all()


@pytest.mark.parametrize("options", [
    {}, {"gravity": (0.3, 0.0, -2.0)}, {"period": (2.0, 2.0, 2.0)},
])  # fmt: skip
def test_each_event_is_the_first_that_there_is(options):
    """The next collision of a gas at any time is the least of those of all pairs, by brute force."""
    scene, start = gas(n=20, **options)
    start.image = None if scene.period is None else np.zeros((3, 20), np.int64)
    lengths = None if scene.period is None else np.array(scene.period)[:, None, None]
    with run_of(scene, start) as run:
        run.observe()
        for k in range(40):
            run.advance(0.02, 0.02 * (k + 1))
            x, v = run.state.position, run.state.velocity
            soonest = math.inf
            for shift in itertools.product((-1.0, 0.0, 1.0), repeat=3) if scene.period else [(0.0, 0.0, 0.0)]:
                b = x[:, :, None] - x[:, None, :]
                b = b if lengths is None else b + np.array(shift)[:, None, None] * lengths
                u = v[:, :, None] - v[:, None, :]
                closing, u2 = (b * u).sum(axis=0), (u * u).sum(axis=0)
                gap = (b * b).sum(axis=0) - (start.radius[:, None] + start.radius) ** 2
                root = closing**2 - u2 * gap
                with np.errstate(all="ignore"):
                    time = np.where((closing < 0.0) & (root > 0.0), gap / (np.sqrt(root) - closing), math.inf)
                soonest = min(soonest, time.min())
            meets = run._flock.event[0::FLOATS].min() - run._since(0.02 * (k + 1))
            # A known collision may not come to pass: then no collision is sooner.
            assert meets <= soonest + 1e-12
            assert meets > -1e-12


@pytest.mark.level3
@pytest.mark.skipif(cache.is_disabled(), reason="nothing is compiled here")
def test_compiled_it_has_the_same_bits():
    scene, start = gas(n=12, restitution=0.9, gravity=(0.0, 0.0, -1.0))
    one = frames(run_of(scene, start), [0.5, 1.0])
    two = frames(run_of(scene, start, compile="always"), [0.5, 1.0])
    assert (one[0] == two[0]).all()
    assert (one[1] == two[1]).all()
    assert one[2]["energy_error"] == two[2]["energy_error"]
