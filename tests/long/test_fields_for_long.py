"""1e9 impacts among balls at random that overlap, and 1e5 first hits: none gets in, and none is missed.

`pytest -m long -s` prints the figures. SWARM_IMPACTS says of how many impacts, a billion else.
"""

import os
import time as clock

import numpy as np
import pytest

import swarm
from swarm.kernel.vector import vec
from swarm.surfaces.time_of_impact import flights

pytestmark = pytest.mark.long

IMPACTS = int(float(os.environ.get("SWARM_IMPACTS", "1e9")))
# Runs of so many frames, and so many impacts a particle in each.
FRAMES, PARTICLES = 10, 20_000
EPSILON = np.finfo(np.float64).eps


def packing(n=1000):
    random = np.random.default_rng(3)
    return swarm.Spheres(random.uniform(-0.5, 0.5, (n, 3)), random.uniform(0.01, 0.05, n))


def test_nothing_gets_into_a_packing(capsys):
    field, began = packing(), clock.perf_counter()
    scene = swarm.Scene([swarm.Box((0.5, 0.5, 0.5)), field])
    start = swarm.fill(scene, PARTICLES, speed=1.0, seed=4)
    trial = swarm.simulate(scene, start, swarm.Impact(), until=1.0, threads=2).observables["impacts"][-1]
    until = 1.02 * IMPACTS / trial
    end = swarm.simulate(scene, start, swarm.Impact(), until=until, every=until / FRAMES, threads=2)
    seen, points = end.observables, end.particles.position
    impacts, outside, lost = int(seen["impacts"][-1]), seen["max_penetration"].max(), seen["energy_error"].max()
    # Independently of cells: the distances to all balls
    least = min(
        float((np.sqrt(((points - c[:, None]) ** 2).sum(axis=0)) - r).min())
        for c, r in zip(field.centers, field.radii, strict=True)
    )
    with capsys.disabled():
        print(
            f"\n{impacts:,} impacts among 1000 balls that overlap: outside by {outside:.1e} m, {-least:.1e} m by all "
            f"balls, energy off by {lost:.1e}, {clock.perf_counter() - began:.0f} s",
            end="",
        )
    assert impacts >= IMPACTS
    assert np.abs(points).max() <= 0.5 + 4.0 * EPSILON
    assert outside <= 1e-14
    assert least >= -1e-14
    assert lost <= 1e-12


def first_of_all(field, r, v):
    """The first hits of straight flights (3, n) with all balls, the numbers of these, and how near to grazing: (n,)."""
    d = r[:, :, None] - field.centers.T[:, None, :]
    b, a = (d * v[:, :, None]).sum(axis=0), (v**2).sum(axis=0)[:, None]
    c = (d**2).sum(axis=0) - field.radii**2
    under = b * b - a * c
    with np.errstate(all="ignore"):
        times = np.where((b < 0.0) & (under > 0.0), c / (-b + np.sqrt(under)), np.inf)
    which = times.argmin(axis=1)
    rows = np.arange(len(which))
    return times[rows, which], which, under[rows, which] / (b * b)[rows, which]


def test_no_first_hit_is_missed(capsys):
    """Of flights from cell to cell, against a look at all balls."""
    field, count, random = packing(), 100_000, np.random.default_rng(5)
    members, points = swarm.Scene([field]).compiled().walls(), np.empty((3, 0))
    while points.shape[1] < count:
        some = random.uniform(-0.6, 0.6, (3, count))
        points = np.concatenate([points, some[:, field.phi(some) > 0.0]], axis=1)
    points, speeds = points[:, :count], random.standard_normal((3, count))
    off, missed, hits = [], 0, 0
    with np.errstate(all="ignore"):
        for part in range(0, count, 1000):
            r, v = points[:, part : part + 1000], speeds[:, part : part + 1000]
            wanted, number, sharp = first_of_all(field, r, v)
            for k in range(r.shape[1]):
                here, passed, wall = r[:, k], 0.0, -1
                while wall < 0:
                    time, wall = flights.first_hit(members, None, vec(here.tolist()), vec(v[:, k].tolist()))
                    passed, here = passed + time, here + time * v[:, k]
                    if not time < np.inf:
                        break
                hits += wall >= 0
                missed += (passed < np.inf) != (wanted[k] < np.inf) or (wall >= 0 and wall != number[k])
                if wall >= 0 and sharp[k] > 1e-2:
                    off.append(abs(passed - wanted[k]) * np.sqrt((v[:, k] ** 2).sum()))
    with capsys.disabled():
        print(
            f"\n{hits} of {count} flights hit, {missed} not as wanted, places off by {max(off):.1e} m at most", end=""
        )
    assert missed == 0
    # A place is a sum of the places of cells that it comes through, each of which is rounded.
    assert np.median(off) <= 2.0 * EPSILON
    assert max(off) <= 1e-13
