"""`place`: uniform over places and orientations, within the walls, with the speed and spin that are asked for."""

import itertools
import math
import os
import subprocess
import sys

import numpy as np
import pytest

import swarm
from swarm.bodies import placing

N = 20_000
# The statistics of N copies are off by a few 1/sqrt(N).
FEW = 4.5 / math.sqrt(N)
CUBE = np.array(list(itertools.product((-0.5, 0.5), repeat=3)))
TETRAHEDRON = swarm.tetrahedron(edge=0.3, mass=2.0)
CAVITY = swarm.Scene([swarm.Sphere(1.0, (0.5, 0.0, -1.0))])

OF_PROCESSOR = """
import numpy as np
import swarm
from swarm.bodies.elastic import block
from swarm.bodies.numbers import ties_of
cavity = swarm.Scene([swarm.Sphere(1.0)])
corners = 0.1 * np.random.default_rng(1).normal(size=(9, 3))
rigid = swarm.rigid(corners, 700.0, contacts=0.07)
jelly = swarm.elastic(block((0.3, 0.2, 0.1), (3, 2, 1)), 1e4, 0.3, 1e3, mass="consistent")
for body in swarm.dumbbell(0.2, 1.0), swarm.chain(5, 0.3, 1.0), swarm.tetrahedron(0.2, 1.0), rigid, jelly:
    placed = swarm.place(cavity, body, 10, speed=1.0, spin=2.0, seed=1)
    held = swarm.Bodies(body, placed.position, placed.position**2, project=True)
    matrices = ties_of(body)
    print([values.tobytes().hex() for values in (placed.velocity, placed.centers(), held.velocity)])
    print([values.tobytes().hex() for values in (body.points, body.contacts, body.inverse_mass())])
    print([values.tobytes().hex() for values in (matrices.couplings, matrices.compliance)])
start = swarm.place(cavity, rigid, 2, speed=1.0, spin=2.0, seed=1)
end = swarm.simulate(cavity, start, swarm.Impact(dt=0.02), until=0.4, compile="never")
print(end.observables["impacts"][-1] > 0, end.particles.position.tobytes().hex())
"""


def centers(bodies):
    weights = bodies.body.mass_matrix.sum(axis=1)
    return np.einsum("p,xpn->xn", weights, bodies.position) / weights.sum()


def test_centres_are_uniform_where_the_walls_do_not_matter():
    """The ball of places at which the body cannot reach the wall: <r^k> = 3/(3 + k), and no direction is preferred."""
    bodies = swarm.place(CAVITY, TETRAHEDRON, N, seed=3)
    reach = 1.0 - 0.3 * math.sqrt(3.0 / 8.0)
    unit = (centers(bodies) - [[0.5], [0.0], [-1.0]]) / reach
    radius = np.sqrt((unit**2).sum(axis=0))
    inner = radius[radius <= 1.0]
    assert inner.size > 0.75 * N
    for k in (1, 2, 6):
        assert (inner**k).mean() == pytest.approx(3.0 / (3.0 + k), abs=FEW * 1.2)
    assert unit.mean(axis=1) == pytest.approx(np.zeros(3), abs=FEW)


def test_a_rod_in_a_slab_leaves_out_what_the_walls_forbid():
    """Height z and tilt u of a rod of half length c in |z| < a are uniform over |z| + c |u| < a, u in (-1, 1)."""
    a, c = 1.0, 0.8
    scene = swarm.Scene([swarm.Box((500.0, 500.0, a))])
    bodies = swarm.place(scene, swarm.dumbbell(2.0 * c, 1.0), N, seed=1)
    assert (scene.gaps(bodies.contact_points().reshape(3, -1)) <= 0.0).all()
    tilt = (bodies.position[2, 1] - bodies.position[2, 0]) / (2.0 * c)
    # The share of u is a - c |u|, so <|u|> = (a/2 - c/3)/(a - c/2). The box is so wide that its sides do not matter.
    assert np.abs(tilt).mean() == pytest.approx((a / 2.0 - c / 3.0) / (a - c / 2.0), abs=FEW)
    middle = centers(bodies)[2]
    assert (np.abs(middle) + c * np.abs(tilt)).max() <= a + 1e-12


def test_orientations_are_uniform():
    """Every entry of a rotation matrix has mean 0, square 1/3 and fourth power 1/5; entries do not correlate."""
    turns = placing._rotations(np.random.default_rng(4), N)
    assert np.abs(np.einsum("xyn,xzn->nyz", turns, turns) - np.eye(3)).max() < 1e-14
    assert np.abs(np.linalg.det(turns.transpose(2, 0, 1)) - 1.0).max() < 1e-14
    assert turns.mean(axis=2) == pytest.approx(np.zeros((3, 3)), abs=FEW)
    flat = turns.reshape(9, N)
    assert flat @ flat.T / N == pytest.approx(np.eye(9) / 3.0, abs=FEW)
    assert (flat**4).mean(axis=1) == pytest.approx(0.2, abs=FEW)


def test_copies_are_turned_and_not_mirrored():
    bodies = swarm.place(CAVITY, TETRAHEDRON, 100)
    sides = (bodies.position[:, 1:] - bodies.position[:, :1]).transpose(2, 0, 1)
    points = TETRAHEDRON.points
    assert np.linalg.det(sides) == pytest.approx(np.linalg.det((points[1:] - points[0]).T), rel=1e-12)


@pytest.mark.parametrize(
    "body",
    [
        TETRAHEDRON,
        swarm.Body(TETRAHEDRON.points, [1.0, 2.0, 3.0, 4.0], links=TETRAHEDRON.links),
        swarm.rigid(0.2 * CUBE + 3.0, density=5.0),
        swarm.Body(TETRAHEDRON.points, mass_matrix=np.eye(4) + 0.5),
    ],
    ids=["equal", "unequal", "cube", "full matrix"],
)
def test_speed_and_spin_are_exact_and_isotropic(body):
    """Momentum is m v; angular momentum about the centre is that of a rigid rotation; its energy m v^2/2 + w.I w/2."""
    n, speed, spin = 4000, 3.0, 5.0
    bodies = swarm.place(CAVITY, body, n, speed=speed, spin=spin, seed=2)
    matrix, mass = body.mass_matrix, body.mass_matrix.sum()
    drift = np.einsum("p,xpn->xn", matrix.sum(axis=1), bodies.velocity) / mass
    assert np.sqrt((drift**2).sum(axis=0)) == pytest.approx(speed, rel=1e-12)
    assert drift.mean(axis=1) == pytest.approx(np.zeros(3), abs=speed * 4.5 / math.sqrt(n))
    # v - drift = w x (r - c), of the same w at every point
    arms, rest = bodies.position - centers(bodies)[:, None], bodies.velocity - drift[:, None]
    assert (arms * rest).sum(axis=0) == pytest.approx(np.zeros((4, n)), abs=1e-13)
    rates = np.array([np.linalg.lstsq(*_system(arms[:, :, i], rest[:, :, i]), rcond=None)[0] for i in range(100)])
    assert np.sqrt((rates**2).sum(axis=1)) == pytest.approx(spin, rel=1e-11)
    # Links keep their lengths.
    for i, j in body.links:
        apart, relative = (x[:, i] - x[:, j] for x in (bodies.position, bodies.velocity))
        assert (apart * relative).sum(axis=0) == pytest.approx(np.zeros(n), abs=1e-13)


def _system(arms, velocities):
    """The linear equations w x r = v for w, of all points."""
    rows = [[[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]] for x, y, z in arms.T]
    return np.concatenate(rows), velocities.T.ravel()


def test_at_rest_if_nothing_is_asked_for():
    assert not swarm.place(CAVITY, TETRAHEDRON, 3).velocity.any()


def test_links_and_sides_keep_out_of_solids():
    """A ball that is smaller than the cube's edge would lie within it; its corners alone are outside of it."""
    scene = swarm.Scene([swarm.Box((0.8, 0.8, 0.8)), swarm.Sphere(0.2, side="outside")])
    rod = swarm.dumbbell(0.6, 1.0)
    bodies = swarm.place(scene, rod, 2000, seed=6)
    share = np.linspace(0.0, 1.0, 101)
    first, second = bodies.position[:, 0, :, None], bodies.position[:, 1, :, None]
    along = (first * (1.0 - share) + second * share).reshape(3, -1)
    # Between two of the 8 samples of a rod of 0.6 it may be deeper by the arrow of an arc over half their distance.
    arrow = 0.2 - math.sqrt(0.2**2 - (0.6 / 16.0) ** 2)
    assert scene.distances_outside(along).max() <= arrow + 1e-12
    # The rod does come near the ball.
    assert scene.distances_outside(along)[1].max() > -0.01


def test_the_seed_decides():
    first, same, other = (swarm.place(CAVITY, TETRAHEDRON, 50, speed=1.0, seed=seed) for seed in (7, 7, 8))
    assert (first.position == same.position).all()
    assert (first.velocity == same.velocity).all()
    assert not (first.position == other.position).any()


def test_a_cube_that_just_fits_is_found():
    """Its corners are on a sphere of radius sqrt(3)/2 times its edge."""
    scene = swarm.Scene([swarm.Sphere(0.95)])
    bodies = swarm.place(scene, swarm.rigid(CUBE, 1.0), 20)
    assert (scene.gaps(bodies.contact_points().reshape(3, -1)) <= 1e-15).all()


def test_bodies_without_contacts_are_within_too():
    body = swarm.Body(TETRAHEDRON.points, 1.0, contacts=[])
    assert (CAVITY.gaps(swarm.place(CAVITY, body, 500).position.reshape(3, -1)) <= 1e-15).all()


HANGING = swarm.Body([(0.0, 0.0, 0.0), (0.0, 0.0, -0.5)], 1.0, links=[(0, 1)], anchors={0: None})
BEAD = swarm.Body([(0.0, 0.0, 0.0)], 1.0, guides=[(0, swarm.Plane((0.0, 0.0, 1.0), 0.0))])
RATTLE = swarm.Body([(0.0, 0.0, 0.0), (0.0, 0.0, 0.1)], 1.0, cavities=[(swarm.Sphere(0.5), 0, 1)])


@pytest.mark.parametrize(
    ("scene", "body", "options", "parts"),
    [
        (CAVITY, HANGING, {}, ["place", "anchors", "swarm.Bodies(body, position, velocity)"]),
        (CAVITY, BEAD, {}, ["place", "guides", "swarm.Bodies"]),
        (CAVITY, RATTLE, {}, ["place", "cavities", "swarm.Bodies"]),
        (CAVITY, swarm.rigid(1.2 * CUBE, 1.0), {}, ["found 0", "2.08 m wide", "2 x 2 x 2 m"]),
        (swarm.Scene([swarm.Plane((0, 0, -1), 0.0)]), TETRAHEDRON, {}, ["bounded volume", "open", "swarm.Bodies"]),
        (CAVITY, CUBE, {}, ["body", "swarm.Body"]),
        (CAVITY, TETRAHEDRON, {"n": 0}, ["n must", "1 or more"]),
        (CAVITY, TETRAHEDRON, {"n": 10**15}, ["n must", "memory"]),
        (CAVITY, TETRAHEDRON, {"speed": -1.0}, ["speed", "0 or more"]),
        (CAVITY, TETRAHEDRON, {"spin": math.nan}, ["spin", "finite"]),
        (CAVITY, TETRAHEDRON, {"seed": -1}, ["seed", "0 or more"]),
    ],
)
def test_errors_name_the_argument(monkeypatch, scene, body, options, parts):
    monkeypatch.setattr(placing, "_TRIES", 10_000)
    with pytest.raises(swarm.SceneError) as caught:
        swarm.place(scene, body, **({"n": 2} | options))
    assert all(part in str(caught.value) for part in parts), str(caught.value)


def test_bodies_have_the_same_bits_by_the_blas_of_every_processor():
    """OpenBLAS can be set to one: all that makes a body, where copies are, and what follows, are sums term by term."""
    seen = {
        subprocess.run(
            [sys.executable, "-c", OF_PROCESSOR], env={**os.environ, "OPENBLAS_CORETYPE": processor},
            capture_output=True, check=True,
        ).stdout
        for processor in ("Haswell", "Prescott", "SkylakeX", "Zen")
    }  # fmt: skip
    assert len(seen) == 1
    assert b"True" in seen.pop()
