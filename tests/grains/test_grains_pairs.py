"""Soft balls that meet one another: closed forms, and what is conserved at any step."""

import math

import numpy as np
import pytest
from grains_runs import ROOM, cloud, ran

import swarm
from swarm.grains import contacts, lanes_of_pairs, lists
from swarm.grains import grain_arrays as arrays
from swarm.grains.cell import Lengths, nearest
from swarm.grains.grain_arrays import ENDS
from swarm.grains.grains_run import GrainsRun
from swarm.kernel.random import Seeding
from swarm.kernel.vector import Vec
from swarm.run.tally import Watched

RADIUS, MASS, ALPHA, SPEED = 0.01, 0.002, 1e5, 1.0


def two_balls(dt, exponent=1.5, speed=SPEED):
    """A head-on collision, which begins at once, with a frame at each step."""
    position, velocity = np.zeros((3, 2)), np.zeros((3, 2))
    position[0], velocity[0] = (-RADIUS, RADIUS), (0.5 * speed, -0.5 * speed)
    start = swarm.Particles(position, velocity, MASS, radius=RADIUS)
    return start, swarm.Penalty(dt, ALPHA, exponent)


def closest_and_duration(exponent, speed=SPEED):
    """Of m* g'' = -alpha g^a: the deepest gap from the energy, and the time by Gamma functions."""
    mass, a = MASS / 2, exponent
    deepest = (mass * speed**2 * (a + 1) / (2 * ALPHA)) ** (1 / (a + 1))
    p = 1 / (a + 1)
    return deepest, 2 * math.sqrt(math.pi) * math.gamma(1 + p) / math.gamma(0.5 + p) * deepest / speed


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.0])
def test_two_balls_meet_as_the_closed_form_says(exponent):
    """Order 2: half the step makes a fourth of the error."""
    deepest, duration = closest_and_duration(exponent)
    errors = []
    for steps in (64, 128):
        start, method = two_balls(duration / steps, exponent)
        result = ran(ROOM, start, method, duration)
        assert result.observables["collisions"].tolist() == [0, 1]
        half = ran(ROOM, start, method, duration / 2)
        stored = ALPHA / (exponent + 1) * deepest ** (exponent + 1)
        gap = 2 * RADIUS - abs(half.particles.position[0] @ (1, -1))
        # At the end of the contact the balls are where they touched, and fly apart.
        end = 2 * RADIUS - abs(result.particles.position[0] @ (1, -1))
        errors.append((abs(gap - deepest) / deepest, abs(end) / deepest))
        assert half.observables["contact_energy"][-1] == pytest.approx(stored, rel=0.02)
        assert result.observables["energy_error"].max() < 1e-14
    (closest, late), (closest_half, late_half) = errors
    assert closest_half < 1e-3
    assert closest / closest_half > 3.5
    assert late / late_half > 3.0


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.5])
@pytest.mark.parametrize("dt", [0.002, 0.02])
def test_energy_momentum_and_angular_momentum_are_conserved_at_any_step(exponent, dt):
    result = ran(ROOM, cloud(), swarm.Penalty(dt, 200.0, exponent), 0.4, every=0.1)
    seen = result.observables
    assert seen["collisions"][-1] > 10
    assert seen["contact_energy"].max() > 0.01 * seen["kinetic_energy"][0]
    assert seen["energy_error"].max() < 1e-13
    scale = (result.particles.mass * np.sqrt((result.particles.velocity**2).sum(axis=0))).sum()
    assert abs(seen["momentum"] - seen["momentum"][0]).max() < 1e-14 * scale
    assert abs(seen["angular_momentum"] - seen["angular_momentum"][0]).max() < 1e-14 * 5.0 * scale


def test_a_step_that_is_far_too_long_is_refused_with_a_sentence():
    start, _method = two_balls(1e-3)
    with pytest.raises(swarm.SceneError, match="use dt < "):
        ran(ROOM, start, swarm.Penalty(1.0, ALPHA), 1.0)


@pytest.mark.parametrize("period", [None, (4.0, None, 3.0), (2.3, 2.3, 2.3), (1.1, 5.0, None)])
def test_the_lists_are_those_of_all_pairs(period):
    random = np.random.default_rng(5)
    n, skin = 200, 0.1
    lengths = None if period is None else Lengths(*period)
    centres = random.uniform(0.0, [one or 5.0 for one in period or (4.0, 3.0, 5.0)], (n, 3))
    radius = random.uniform(0.05, 0.2, n)
    grains = arrays.grains_of(centres.T, np.zeros((3, n)), radius, np.ones(n))
    near = arrays.near_of(n, 1, 40 * n, n)
    cells, order = lists.cells_of(grains.place[:, :3], 0.4 + skin, lengths)
    for rows in (grains.number, grains.place):
        rows[:] = rows[order]
    found = lists.list_pairs(lengths, grains, near, cells, skin)
    pairs = [
        frozenset((grains.number[i], grains.number[j]))
        for i in range(n)
        for j in near.mate[near.first[i] : near.first[i + 1]]
    ]
    assert len(pairs) == len(set(pairs)) == found
    apart = np.array([[np.linalg.norm(nearest(lengths, Vec(*r), Vec(*s))) for s in centres] for r in centres])
    reach = radius[:, None] + radius + skin
    expected = {frozenset((i, j)) for i in range(n) for j in range(i) if apart[i, j] < reach[i, j]}
    assert set(pairs) == expected


def test_pairs_that_are_looked_at_twice_are_those_that_may_have_met(monkeypatch):
    """What misses by more than a step can be off course is left out, and the run has the same bits without that."""
    looks, find_missed = [], contacts._find_missed
    monkeypatch.setattr(contacts, "_find_missed", lambda *given: looks.append(1) or find_missed(*given))

    # One that flies into a row, the others of which are hardly apart: a step finds contacts that it had not foreseen.
    position, velocity = np.zeros((3, 4)), np.zeros((3, 4))
    position[0], velocity[0, 0] = [-1e-4, 0.02, 0.04 + 1e-9, 0.06 + 2e-9], 1.0
    start = swarm.Particles(position, velocity, MASS, radius=RADIUS)

    def ended(wider):
        monkeypatch.setattr(contacts, "_WIDER", wider)
        looks.clear()
        result = ran(ROOM, start, swarm.Penalty(2e-5, ALPHA, 1.0), 2e-3)
        assert result.observables["collisions"][-1] == 3
        return len(looks), result.particles

    (short, quick), (fewer, thorough) = ended(contacts._WIDER), ended(0.0)
    # In some thirty steps balls push one another.
    assert short > fewer + 25
    assert np.array_equal(quick.position, thorough.position)
    assert np.array_equal(quick.velocity, thorough.velocity)


def test_a_pair_among_others_ends_as_it_does_alone():
    """Its contact is in a group with those of others, each of which goes by itself."""
    n, scene = 9, swarm.Scene([swarm.Sphere(3.0)])
    position, velocity = np.zeros((3, 2 * n)), np.random.default_rng(3).uniform(-1.0, 1.0, (3, 2 * n))
    position[1] = np.repeat(np.linspace(-1.0, 1.0, n), 2)
    position[0, 0::2], position[0, 1::2], velocity[0, 0::2], velocity[0, 1::2] = -RADIUS, RADIUS, 1.0, -1.0

    def end_of(some):
        start = swarm.Particles(position[:, some], velocity[:, some], MASS, radius=RADIUS)
        return ran(scene, start, swarm.Penalty(2e-5, ALPHA, 1.0), 2e-4).particles

    together = end_of(slice(None))
    for k in range(0, 2 * n, 2):
        alone = end_of(slice(k, k + 2))
        assert together.velocity[:, k : k + 2] == pytest.approx(alone.velocity, rel=1e-12, abs=1e-12)
        assert together.position[:, k : k + 2] == pytest.approx(alone.position, rel=1e-14, abs=1e-14)


@pytest.mark.parametrize("most", [1, 2, 288], ids=lambda most: f"{most} groups a slice")
def test_each_contact_is_in_one_lane_and_no_ball_twice_in_a_part(most, monkeypatch):
    """However many slices there are; and contacts that are solved to round-off do not depend on their order."""

    def run_of(most):
        monkeypatch.setattr(lanes_of_pairs, "_SLICE", most)
        place = 0.98 * 2.0 * RADIUS * (np.indices((3, 3, 3)).reshape(3, -1) - 1.0)
        start = swarm.Particles(place, -5.0 * place, MASS, radius=RADIUS)
        with GrainsRun(ROOM.compiled(), start, swarm.Penalty(1e-4, 1e3), 1, None, "never", Seeding(), Watched()) as run:
            run.observe()
            assert run.advance(2.0, 2e-4)
            return run.state.position, run._world.touches

    position, touches = run_of(most)
    (contacts, groups), found = touches.used, []
    assert contacts == 54
    for g in range(groups):
        ends, lanes, splits, part = touches.tile.ends[g * ENDS :], touches.lanes[g], touches.splits[g], set()
        for lane in range(lanes):
            one, other, place = ends[:ENDS, lane]
            part = set() if splits >> lane & 1 else part
            assert not part & {one, other}
            part |= {one, other}
            found.append((one, other, place))
    assert sorted(found) == sorted(map(tuple, touches.found[:contacts]))
    np.testing.assert_allclose(position, run_of(10**6)[0], rtol=0.0, atol=1e-14 * RADIUS)
