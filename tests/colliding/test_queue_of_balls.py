"""The queue, the cells and the ways of balls through them, by brute force."""

import itertools
import math

import numpy as np
import pytest
from colliding.gases import frames, gas, run_of

import swarm
from swarm.events.colliding import rows
from swarm.events.colliding.clock import EVENTS
from swarm.events.colliding.events import _COUNTED, _begin_counts_anew
from swarm.events.colliding.next_collision import _MOST
from swarm.events.colliding.queue import FIRST, SPARE, build, requeue
from swarm.events.colliding.rows import CELL, FLOATS, LEAVES, MEETS, NO_PARTNER, PARTNER, WHOLES, Flock
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
    made = Flock(none, event, none, tag, np.arange(FIRST, FIRST + n, dtype=np.int32), key, item, none)
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
        for k in range(10):
            run.advance(0.05, 0.05 * (k + 1))
            x = run.state.position
            b = x[:, :, None] - x[:, None, :]
            gaps = np.sqrt((b * b).sum(axis=0)) - start.radius[:, None] - start.radius
            assert gaps[np.triu_indices(len(start), 1)].min() > -1e-15
        seen = run.seen()
    assert seen["collisions"] > 40
    assert seen["energy_error"] < 1e-14


def times_of_pairs(x, v, radius, shift=(0.0, 0.0, 0.0)):
    """When each ball meets each other one, that far away, by brute force."""
    b, u = x[:, :, None] - x[:, None, :] + np.array(shift)[:, None, None], v[:, :, None] - v[:, None, :]
    closing, u2 = (b * u).sum(axis=0), (u * u).sum(axis=0)
    gap = (b * b).sum(axis=0) - (radius[:, None] + radius) ** 2
    root = closing**2 - u2 * gap
    with np.errstate(all="ignore"):
        return np.where((closing < 0.0) & (root > 0.0), gap / (np.sqrt(root) - closing), math.inf)


def balls_of_cells(run):
    """The balls of each cell that has any, by their links."""
    flock, found = run._flock, {}
    for cell, first in enumerate(flock.head.tolist()):
        ball = first
        while ball >= 0:
            found.setdefault(cell, []).append(ball)
            ball = int(flock.after(ball))
    return found


def test_the_next_collisions_where_cells_have_many_balls():
    """Two that are each other's soonest know it, also if more balls are around them than are looked at at once."""
    start = cell_of_many(6.0, 330)
    with run_of(swarm.Scene([swarm.Box((1.0, 1.0, 1.0))]), start) as run:
        run.observe()
        counts = np.zeros([axis.count for axis in run._box.grid.axes()])
        for x in zip(*run._flock.tag.reshape(-1, WHOLES)[:, CELL : CELL + 3].T - 1, strict=True):
            counts[x] += 1
        assert max(counts[k : k + 3, 1:4, 1:4].sum() for k in range(2)) > _MOST
        times = times_of_pairs(start.position, start.velocity, start.radius)
        mate = times.argmin(axis=0)
        first, leaves = times.min(axis=0), run._flock.event[LEAVES::FLOATS]
        # Those that meet after one of them has left its cell need not know it yet.
        mutual = (mate[mate] == np.arange(len(start))) & (first < np.minimum(leaves, leaves[mate]))
        assert mutual.sum() > 50
        assert np.abs(run._flock.event[MEETS::FLOATS][mutual] - first[mutual]).max() < 1e-12


def test_all_balls_come_into_one_cell():
    scene = swarm.Scene([swarm.Box((1.0, 1.0, 1.0))])
    corners = 0.6 * np.array(list(itertools.product((-1.0, 0.0, 1.0), repeat=3))).T
    target = np.array([0.9, 0.9, 0.9])[:, None] + 0.05 * corners
    start = swarm.Particles(corners, target - corners, radius=0.01)
    with run_of(scene, start) as run:
        run.observe()
        assert max(map(len, balls_of_cells(run).values())) < 27
        run.advance(0.95, 0.95)
        (balls,) = balls_of_cells(run).values()
        assert sorted(balls) == list(range(27))
        kept = {name: array.copy() for name, array in run.arrays().items()}
        run.advance(1.0, 1.95)
        expected = run.state.position.copy()
        balls = balls_of_cells(run)
        assert sorted(itertools.chain(*balls.values())) == list(range(27))
        for cell, some in balls.items():
            assert {int(run._box.grid.number(ball, run._flock)) for ball in some} == {cell}
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
    with run_of(scene, start) as run:
        run.observe()
        for k in range(40):
            run.advance(0.02, 0.02 * (k + 1))
            x, v = run.state.position, run.state.velocity
            soonest = math.inf
            for shift in itertools.product((-1.0, 0.0, 1.0), repeat=3) if scene.period else [(0.0, 0.0, 0.0)]:
                away = shift if scene.period is None else np.multiply(shift, scene.period)
                soonest = min(soonest, times_of_pairs(x, v, start.radius, away).min())
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


@pytest.mark.parametrize("compile", ["never", pytest.param("always", marks=pytest.mark.slow)])
def test_counts_of_32_bits_begin_anew(compile):
    scene, start = gas()
    times, many = [0.5, 1.0], 2**31 - 20
    one, other = run_of(scene, start, compile=compile), run_of(scene, start, compile=compile)
    whole = other._flock.tag.reshape(-1, WHOLES)
    whole[:, rows.STAMP] = whole[:, rows.MET] = many
    other._clock[EVENTS] = _COUNTED - 20
    found, later = frames(one, times), frames(other, times)
    assert max(other._clock[EVENTS] - _COUNTED, np.median(one.state.collisions)) > 1
    for mine, its in zip(found[:2], later[:2], strict=True):
        assert (mine == its).all()
    assert (other.state.collisions == one.state.collisions + many).all()
    assert later[2]["collisions"] == found[2]["collisions"] + len(start) * many // 2
    assert later[2]["collision_rate"] == pytest.approx(found[2]["collision_rate"])
    assert whole[:, [rows.STAMP, rows.MET]].max() < many - 2**29, "they are far from their ends again"
    # A copy, as writers of files take it, has counts of its own.
    copy = other.state.having(collisions=other.state.collisions[1:])
    assert (copy.collisions == other.state.collisions[1:]).all()
    assert (other.state.of(np.arange(len(start)) < 3).collisions == other.state.collisions[:3]).all()


def test_no_flight_is_taken_for_another_one_where_counts_begin_anew():
    scene, start = gas()
    run = run_of(scene, start)
    frames(run, [0.5])
    whole = run._flock.tag.reshape(-1, WHOLES)

    def are_same():
        mate, seen = whole[:, PARTNER], whole[:, rows.SEEN]
        return (mate >= 0) & (whole[mate, rows.STAMP] == seen)

    before = are_same()
    assert 0 < before.sum() < (whole[:, PARTNER] >= 0).sum(), "some have changed since they were seen"
    # Such as 0, from which stamps begin anew.
    whole[~before, rows.SEEN] = 0
    _begin_counts_anew(run._flock)
    assert (are_same() == before).all()
    whole[:, rows.STAMP] += 1
    assert not are_same().any()
