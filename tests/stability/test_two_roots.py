"""Steps longer than the cavity: the contact equation (K) has several roots, all with exact energy."""

import numpy as np
import pytest
from conftest import call

import swarm
from swarm.contact import impulse
from swarm.contact.impulse import Step
from swarm.contact.regularisation import regularisation
from swarm.kernel.vector import vec

pytestmark = pytest.mark.physics

# A flat ellipsoid, a step of ten times its thickness along it: alpha = 300, h = 1 s, m = 1/2, so c = h^2/(2m) = 1.
AXES, ALPHA, MASS = np.array([1.0, 0.05, 1.0]), 300.0, 0.5
START, FREE = np.array([0.0, 0.05, 0.0]), np.array([0.5, 0.1, 0.0])


def ends(axes, start, free, kappa):
    """r1 = [(1 - kappa A) r0 + p]/(1 + kappa A), one row a kappa."""
    pull = np.multiply.outer(kappa, 1.0 / axes**2)
    return ((1.0 - pull) * start + free) / (1.0 + pull)


def gaps(axes, points):
    """g = r.Ar - 1"""
    return (points**2 / axes**2).sum(axis=-1) - 1.0


def misses(axes, start, free, alpha, kappa):
    """kappa less the right side of (K) with c = 1 and exponent 1, from a start on the wall or inside."""
    g0, g1 = gaps(axes, start), gaps(axes, ends(axes, start, free, kappa))
    return kappa - 0.5 * alpha * np.maximum(g1, 0.0) ** 2 / np.where(g1 > 0.0, g1 - g0, 1.0)


def roots(axes, start, free, alpha):
    """All roots, between neighbours of a fine grid, by halving."""
    grid = np.concatenate([[0.0], np.logspace(-8, 6, 20_000)])
    signs = np.sign(misses(axes, start, free, alpha, grid))
    found = []
    for i in np.flatnonzero(signs[1:] * signs[:-1] < 0.0):
        low, high = grid[i], grid[i + 1]
        for _halving in range(80):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if misses(axes, start, free, alpha, middle) * signs[i] > 0.0 else (low, middle)
        found.append(high)
    return np.array(found)


def taken(axes, start, free, alpha):
    """The root that a contact takes."""
    (numbers,) = swarm.Ellipsoid(tuple(axes)).walls()
    step = Step(vec(start), vec(free), np.float64(1.0))
    kappa, solved = call(impulse.equation(regularisation(alpha, 1.0), None, numbers, step).careful)
    assert solved
    return kappa


def test_the_smallest_root_is_taken():
    """Here it was once the largest, which energy cannot tell."""
    found = roots(AXES, START, FREE, ALPHA)
    assert len(found) == 3
    assert taken(AXES, START, FREE, ALPHA) == pytest.approx(found[0], rel=1e-9)
    method = swarm.Penalty(1.0, ALPHA)
    step = swarm.contact_history(swarm.Scene([swarm.Ellipsoid(tuple(AXES))]), START, FREE, MASS, method)
    assert step.position[0] == pytest.approx(ends(AXES, START, FREE, found[0]), abs=1e-9)


def test_what_the_others_would_do():
    """Every root keeps the energy to round-off. The first brakes at the wall ahead; the others cross the cavity."""
    found = roots(AXES, START, FREE, ALPHA)
    end = ends(AXES, START, FREE, found)
    # v1 = 2 (r1 - r0)/h - v0
    velocity = 2.0 * (end - START) - FREE
    energy = 0.5 * MASS * (velocity**2).sum(axis=1) + 0.5 * ALPHA * np.maximum(gaps(AXES, end), 0.0) ** 2
    assert energy == pytest.approx(np.full(3, 0.5 * MASS * FREE @ FREE), rel=1e-11)
    # Nearly all of the way along the wall, and on this side of the cavity,
    assert end[0, 0] > 0.99 * FREE[0]
    assert end[0, 1] > 0.5 * AXES[1]
    # against out through the far side, and by the last one even thrown back along the wall.
    assert (end[1:, 1] < -0.5 * AXES[1]).all()
    assert velocity[0, 0] > 0.0 > velocity[2, 0]
    assert (np.diff(found) > 0.0).all()


def test_it_is_the_smallest_of_random_ones():
    """Long and flat ellipsoids, steps of 0.1 to 10 times their length, soft to stiff: 1 in 100 has several roots.

    Two within a factor of 2 of each other, where the residual all but touches 0, are not separated.
    """
    random = np.random.default_rng(1)
    several = 0
    for _step in range(1500):
        axes = np.array([1.0, *10.0 ** random.uniform(-1.5, 0.0, 2)])
        direction = random.standard_normal(3)
        start = direction / np.sqrt((direction**2 / axes**2).sum()) * random.choice([1.0, 0.9])
        free, alpha = random.standard_normal(3) * 10.0 ** random.uniform(-1.0, 1.0), 10.0 ** random.uniform(-4.0, 4.0)
        grid = np.concatenate([[0.0], np.logspace(-7, 4, 1500)])
        signs = np.sign(misses(axes, start, free, alpha, grid))
        if (signs[1:] * signs[:-1] < 0.0).sum() < 2:
            continue
        found = roots(axes, start, free, alpha)
        if len(found) == 3 and found[1] > 2.0 * found[0]:
            several += 1
            assert taken(axes, start, free, alpha) == pytest.approx(found[0], rel=1e-6)
    assert several >= 5


def test_a_contact_step_has_one_root():
    """Impact's chord, g1 = 0, has up to three roots for steps longer than the cavity; those are refused."""
    random = np.random.default_rng(2)
    grid = np.logspace(-9, 6, 6000)
    numbers = {0.99: set(), 6.0: set()}
    for _launch in range(400):
        axes = np.array([1.0, *10.0 ** random.uniform(-1.0, 0.0, 2)])
        direction, free = random.standard_normal((2, 3))
        start = direction / np.sqrt((direction**2 / axes**2).sum())
        normal = start / axes**2
        # Out of the wall, at 0.05 at least of the right angle: a graze ends where the grid is too coarse for it.
        free *= np.sign(free @ normal) / np.linalg.norm(free)
        if free @ normal < 0.05 * np.linalg.norm(normal):
            continue
        for times, counts in numbers.items():
            signs = np.sign(gaps(axes, ends(axes, start, times * axes.min() * free, grid)))
            counts.add(int((signs[1:] * signs[:-1] < 0.0).sum()))
    assert numbers[0.99] == {1}
    assert max(numbers[6.0]) == 3
    scene = swarm.Scene([swarm.Ellipsoid(tuple(AXES))])
    with pytest.raises(swarm.SceneError, match="contact_step must be at most the crossing time"):
        swarm.simulate(scene, swarm.Particles(0.5 * START, FREE), swarm.Impact(contact_step=1.0), until=1.0)
