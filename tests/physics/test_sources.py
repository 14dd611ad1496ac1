"""Runs with sources: counts, books, steady states, and Clausing's factors of tubes."""

import math

import numpy as np
import pytest
from conftest import rarely

import swarm
from examples import tube_flow
from swarm.observables import drift

pytestmark = pytest.mark.physics

BOX = swarm.Scene([swarm.Box((0.5, 0.5, 0.5))])


@pytest.mark.parametrize("ratio", [1.0, rarely(2.0), 5.0, rarely(10.0)])
def test_the_part_that_comes_through_a_tube_is_clausings_factor(ratio):
    flow = tube_flow.run(60_000, ratio, seed=3)
    assert flow.inside[0] == flow.inside[-1] == 0
    assert abs(flow.factor - tube_flow.FACTORS[ratio]) < 3.0 * flow.error
    assert flow.error < 0.0025
    # The density falls from the open end where the gas is to the other.
    assert flow.density[0] > 1.3
    assert flow.density[-1] < 0.7


def test_births_of_each_frame_are_those_of_a_poisson_process():
    """Of 400 frames, independent counts whose mean and variance are rate times frame."""
    rate, frames = 5000.0, 400
    source = swarm.Source(0, rate=rate, temperature=1.0)
    result = swarm.simulate(BOX, None, swarm.Impact(), until=4.0, every=4.0 / frames, sources=[source], seed=5)
    counts, mean = np.diff(result.observables["born"][:, 0]), rate * 4.0 / frames
    assert abs(counts.mean() - mean) < 4.0 * math.sqrt(mean / frames)
    assert abs(counts.var() / mean - 1.0) < 4.0 * math.sqrt(2.0 / frames)
    assert abs(np.corrcoef(counts[1:], counts[:-1])[0, 1]) < 4.0 / math.sqrt(frames)
    assert len(result.particles) == result.observables["born"][-1, 0]
    np.testing.assert_array_equal(
        result.observables["born"][:, 0], [(result.birth_time <= t).sum() for t in result.observables["time"]]
    )


def test_what_comes_in_through_an_opening_replaces_what_leaves():
    """A gas outside an opening: n v A/4 come a second, and as many leave a vessel with the same gas."""
    hole, count = 0.2, 20_000
    opening = swarm.Sphere(hole, center=(0.0, 0.0, 0.5))
    scene = swarm.Scene([swarm.Box((0.5, 0.5, 0.5), openings=[opening], temperature=1.0)])
    start = swarm.fill(scene, count, temperature=1.0, seed=1)
    rate = count * math.sqrt(8.0 / math.pi) * math.pi * hole**2 / 4.0
    source = swarm.Source(opening, rate=rate, temperature=1.0)
    seen = swarm.simulate(scene, start, swarm.Impact(), until=30.0, every=2.0, sources=[source], seed=2).observables
    assert seen["born"][-1, 0] > 1.4 * count
    inside = count + seen["born"][:, 0] - seen["escaped"]
    # How many are inside is a Poisson number once those of the start have left, and less uncertain before.
    assert np.abs(inside - count).max() < 4.0 * math.sqrt(count)
    assert drift(seen) < 1e-13


def test_a_hopper_that_is_fed_comes_to_rest_with_all_books():
    """Grains that fall from a source on a floor that takes their energy."""
    floor = swarm.Box((0.2, 0.2, 0.5), restitution=0.4, friction=0.5)
    scene = swarm.Scene([floor], gravity=(0.0, 0.0, -9.81))
    mouth = swarm.Box((0.1, 0.1, 0.05), center=(0.0, 0.0, 0.4))
    source = swarm.Source(mouth, volume=True, rate=200.0, speed=0.1, stop=1.0, mass=1e-3)
    result = swarm.simulate(scene, None, swarm.Impact(), until=6.0, every=0.5, sources=[source], seed=1)
    seen, n = result.observables, len(result.particles)
    assert seen["sliding"][-1] == n > 150
    # At rest: on the floor, to round-off.
    np.testing.assert_allclose(result.particles.position[2], -0.5, atol=1e-12)
    assert drift(seen) < 1e-13
    fall = 1e-3 * 9.81
    assert seen["potential_energy"][-1] == pytest.approx(-0.5 * fall * n, rel=1e-12)
    brought = seen["source_energy"][-1]
    assert seen["dissipated_energy"][-1] == pytest.approx(brought - seen["total_energy"][-1], rel=1e-12)


def test_a_source_and_walls_that_absorb_settle_at_rate_times_life():
    """By Cauchy's mean chord each flight lasts 4V/Av between diffuse walls, and 1/p of them are a life."""
    speed, part, rate = 1.0, 0.2, 1500.0
    wall = swarm.Box((0.5, 0.5, 0.5), laws=[swarm.Absorb(part), swarm.Lambert()])
    life = 4.0 / (6.0 * speed * part)
    source = swarm.Source(0, rate=rate, speed=speed)
    result = swarm.simulate(
        swarm.Scene([wall]), None, swarm.Impact(), until=12.0 * life, every=2.0 * life, sources=[source], seed=7
    )
    seen = result.observables
    inside = seen["born"][:, 0] - seen["absorbed"][:, 0]
    # From the first on, exp(-6) of it is missing: a Poisson number, independent after two lives.
    settled = inside[3:]
    assert np.abs(settled - rate * life).max() < 4.0 * math.sqrt(rate * life)
    assert abs(settled.mean() - rate * life) < 4.0 * math.sqrt(rate * life / len(settled)) + 13.0
    lives = (result.absorbed_time - result.birth_time)[result.birth_time < 6.0 * life]
    lives = np.where(np.isnan(lives), 6.0 * life, lives)
    assert abs(lives.mean() - life) < 4.0 * lives.std() / math.sqrt(len(lives)) + 0.003 * life
    assert drift(seen) < 1e-13


def test_gravity_in_a_cell_that_repeats():
    """What falls through faces of the cell: the books know where it was born."""
    ball = swarm.Sphere(0.2, (0.5, 0.5, 0.5), side="outside", restitution=0.8)
    scene = swarm.Scene([ball], gravity=(0.0, 0.0, -1.0), period=(1.0, 1.0, 1.0))
    source = swarm.Source(0, rate=500.0, temperature=1.0)
    seen = swarm.simulate(scene, None, swarm.Impact(), until=3.0, every=0.5, sources=[source], seed=3).observables
    assert seen["born"][-1, 0] > 1300
    assert drift(seen) < 1e-12
