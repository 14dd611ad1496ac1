"""The examples of billiards: the stadium's exponent, the mushroom's island, and the maze."""

import math

import numpy as np
import pytest

from examples import maze, mushroom, stadium

pytestmark = pytest.mark.physics


def by_hand(ratio, count, until, seed):
    """The exponents of a stadium of radius 1 by pairs of particles that are brought near again, without swarm."""
    rng = np.random.default_rng(seed)
    half, apart = 0.5 * ratio, 1e-7
    r = rng.uniform(-1.0, 1.0, (2, 20 * count)) * np.array([[half + 1.0], [1.0]])
    r = r[:, np.hypot(np.maximum(np.abs(r[0]) - half, 0.0), r[1]) < 1.0][:, :count]
    angle, turn = rng.uniform(0.0, 2.0 * math.pi, (2, count))
    v = np.array([np.cos(angle), np.sin(angle)])
    near = r + apart * np.array([np.cos(turn), np.sin(turn)]), v.copy()
    grown, kept = np.zeros(count), 0.0
    for k in range(int(until)):
        r, v = flown(half, r, v, 1.0)
        s, w = flown(half, *near, 1.0)
        size = np.sqrt(((s - r) ** 2 + (w - v) ** 2).sum(axis=0))
        if k >= stadium.FORGOTTEN * until:
            grown += np.log(size / apart)
            kept += 1.0
        w = v + (w - v) * (apart / size)
        near = r + (s - r) * (apart / size), w / np.hypot(*w)
    return grown / kept


def flown(half, r, v, until):
    """Particles in the stadium after a time, one impact after the other."""
    left = np.full(r.shape[1], until)
    while (left > 0.0).any():
        lines = np.where(v[1] != 0.0, (np.copysign(1.0, v[1]) - r[1]) / np.where(v[1] != 0.0, v[1], 1.0), np.inf)
        end = np.abs(r[0] + lines * v[0]) <= half
        arcs = []
        for side in (-1.0, 1.0):
            d = r - np.array([[side * half], [0.0]])
            b, c = (d * v).sum(axis=0), (d * d).sum(axis=0) - 1.0
            time = -b + np.sqrt(np.maximum(b * b - c, 0.0))
            arcs.append(np.where((side * (r[0] + time * v[0]) >= half) & (b * b >= c), time, np.inf))
        time = np.where(end, lines, np.minimum(*arcs))
        time = np.where((time > 0.0) & np.isfinite(time), time, 0.0)
        step = np.minimum(time, left)
        r, left, hit = r + step * v, left - step, (time <= left) & (left > 0.0)
        normal = np.where(end, np.array([np.zeros_like(r[0]), np.sign(r[1])]), 0.0)
        bent = r - np.array([np.sign(r[0]) * half, np.zeros_like(r[0])])
        normal = np.where(end, normal, bent / np.hypot(*bent))
        into = (v * normal).sum(axis=0)
        v = np.where(hit & (into > 0.0), v - 2.0 * into * normal, v)
    return r, v / np.hypot(*v)


def test_the_exponent_of_the_stadium_is_that_of_neighbours_without_swarm(compiled_at_once):
    value, error = stadium.measure(2.0, 600, 300.0)
    found = by_hand(2.0, 600, 300, 5)
    other, its_error = found.mean(), found.std() / math.sqrt(len(found))
    assert abs(value - other) < 3.0 * math.hypot(error, its_error)
    assert math.hypot(error, its_error) < 0.01 * value
    # And without lines, or with long ones, it is smaller.
    assert stadium.measure(0.05, 200, 300.0)[0] < 0.5 * value


def test_particles_that_stay_in_the_mushroom_are_known_one_by_one():
    found = mushroom.run(10_000, 300.0)
    stays = found.stays()
    assert pytest.approx(0.7831, abs=5e-5) == mushroom.STAYS
    assert not ((found.distance > 1.0) & ~stays).any()
    # Particles that all but touch the rim of the stem take long.
    assert np.count_nonzero((found.distance < 1.0) & stays) <= 10
    error = math.sqrt(mushroom.STAYS * (1.0 - mushroom.STAYS) / len(stays))
    assert abs(stays.mean() - mushroom.STAYS) < 3.0 * error


def test_the_maze_lets_out_through_its_exit_alone(compiled_at_once):
    scene, result = maze.run(300, 300.0)
    gone = ~np.isnan(result.escape_time)
    assert 0.2 < gone.mean() < 0.6
    x, y, _z = result.particles.position[:, gone]
    assert np.abs(x - 8.8).max() < 1e-12
    assert (np.abs(y - 5.4) < 0.3 + 1e-9).all()
    assert scene.gaps(result.particles.position).max() < 1e-13
    # Corridors are along x and y: each keeps the sizes of its components.
    assert np.abs(np.sqrt((result.particles.velocity**2).sum(axis=0)) - 1.0).max() < 1e-12
