"""Walls that send bodies off: with a temperature, or by laws; each impact is one impulse at the contact point."""

import itertools
import math

import numpy as np
import pytest
from energy_books import unbooked

import swarm
from swarm.kernel.random import uniforms
from swarm.kernel.vector import dot

EDGES = np.array([0.1, 0.06, 0.03])
BRICK = swarm.rigid(0.5 * EDGES * np.array(list(itertools.product((-1.0, 1.0), repeat=3))), 1e3)
MASS = 1e3 * EDGES.prod()
ENERGY = 0.01


class Damped(swarm.WallLaw):
    e: float
    book = "dissipated"

    def leave(self, v, n, u, random, mass):
        return v - (1.0 + self.e) * dot(v - u, n) * n


def run(until=0.6, count=3, gravity=None, seed=1, motion=None, **law):
    scene = swarm.Scene([swarm.Box((0.3, 0.25, 0.28), motion=motion, **law)], gravity)
    start = swarm.place(scene, BRICK, count, speed=0.4, spin=6.0, seed=2)
    return swarm.simulate(
        scene, start, swarm.Impact(dt=1e-2), until=until, every=0.2, compile="never", threads=1, seed=seed,
        progress=False,
    )  # fmt: skip


def test_a_law_along_the_normal_is_a_restitution():
    one, other = run(laws=[Damped(0.7)]), run(restitution=0.7)
    assert one.observables["impacts"][-1] == other.observables["impacts"][-1] > 5
    np.testing.assert_allclose(one.bodies.position, other.bodies.position, atol=1e-10)
    lost = [result.observables["dissipated_energy"] for result in (one, other)]
    np.testing.assert_allclose(*lost, rtol=1e-9)


@pytest.mark.parametrize(
    "law",
    [
        {"temperature": ENERGY},
        {"temperature": ENERGY, "accommodation": 0.5, "restitution": 0.8, "friction": 0.2},
        {"laws": [swarm.Lambert()]},
        {"laws": [swarm.CercignaniLampis(ENERGY, 0.5, 0.5)]},
        {"temperature": ENERGY, "motion": swarm.Translation((0.1, 0.05, 0.0))},
        {"laws": [Damped(0.8), swarm.Lambert()], "gravity": (0.0, 0.0, -1.0)},
    ],
    ids=["temperature", "accommodation", "Lambert", "CercignaniLampis", "moving", "two laws"],
)
def test_the_energy_is_balanced(law):
    seen = run(**law).observables
    assert seen["impacts"][-1] > 2
    assert seen["energy_error"].max() < 1e-12
    assert unbooked(seen) <= 1e-12 * seen["kinetic_energy"].max()


def test_lambert_keeps_the_energy_of_a_body():
    seen = run(laws=[swarm.Lambert()]).observables
    np.testing.assert_allclose(seen["total_energy"], seen["total_energy"][0], rtol=1e-13)
    np.testing.assert_allclose(seen["wall_heat"], 0.0, atol=1e-12 * seen["total_energy"][0])


def motion_of(bodies):
    """The centre, its velocity and the angular momentum about it, of the first body."""
    r, v, shares = bodies.position[..., 0], bodies.velocity[..., 0], bodies.body.mass_matrix
    centre, drift = (np.einsum("pq,xp->x", shares, part) / shares.sum() for part in (r, v))
    spin = np.cross(r - centre[:, None], np.einsum("pq,xq->xp", shares, v), axis=0).sum(axis=1)
    return centre, drift, spin


def test_an_impact_on_a_hot_wall_is_one_impulse_with_a_speed_of_its_distribution():
    # A brick flies with a corner first at a wall that it meets at the end of its first step.
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    r = turn @ BRICK.points.T
    corners = r @ BRICK.contacts.T
    k = int(np.argmax(corners[0]))
    v = np.full_like(r, 0.0) + np.array([0.5, 0.1, 0.2])[:, None]
    start = swarm.Bodies(
        BRICK, (r + np.array([1.0 - 2.5e-3 - corners[0, k], 0.0, 0.0])[:, None])[..., None], v[..., None]
    )
    scene = swarm.Scene([swarm.Box((1.0, 1.0, 1.0), temperature=ENERGY)])
    result = swarm.simulate(
        scene, start, swarm.Impact(dt=5e-3), until=6e-3, compile="never", threads=1, seed=5, progress=False
    )
    assert result.observables["impacts"][-1] == 1
    _centre, drift, spin = motion_of(start)
    _centre, after, turned = motion_of(result.bodies)
    impulse = MASS * (after - drift)
    # The arm at the instant of the impact, when the brick has not turned yet.
    arm = corners[:, k] - BRICK.mass_matrix.sum(axis=0) @ r.T / BRICK.mass_matrix.sum()
    np.testing.assert_allclose(turned - spin, np.cross(arm, impulse), atol=1e-12 * np.abs(turned).max())
    # Each step has the numbers of 16 contacts, and this is the second. K of a brick by its moments of inertia, and the
    # Maxwell distribution by the flux of a mass 1/(n K n).
    inertia = turn @ np.diag(MASS / 12.0 * ((EDGES**2).sum() - EDGES**2)) @ turn.T
    across = np.cross(np.eye(3), arm)
    inverse = np.eye(3) / MASS + across @ np.linalg.solve(inertia, across.T)
    corner = np.array([0.5, 0.1, 0.2]) + inverse @ impulse
    drawn = uniforms(5, 0, 16 * 2)
    assert corner[0] == pytest.approx(-math.sqrt(-2.0 * ENERGY * inverse[0, 0] * math.log(drawn.normal)), rel=1e-9)
    # u.K^-1 u/2 is the energy of the impact: its change is that of the body.
    was = np.array([0.5, 0.1, 0.2])
    heat = 0.5 * (corner @ np.linalg.solve(inverse, corner) - was @ np.linalg.solve(inverse, was))
    assert result.observables["wall_heat"][-1].sum() == pytest.approx(heat, rel=1e-9)
    # Of the whole velocity the part by K^-1 has two normal numbers across: their squares are of the second draw.
    whole = 0.5 * corner @ np.linalg.solve(inverse, corner)
    assert whole == pytest.approx(-ENERGY * (math.log(drawn.normal) + math.log(drawn.tangential)), rel=1e-9)


def test_a_wall_absorbs_bodies_which_count_and_stay():
    result = run(until=1.6, count=4, laws=[swarm.Absorb(0.5)])
    seen = result.observables
    np.testing.assert_array_equal(np.diff(seen["absorbed"][:, 0]) >= 0, True)
    assert seen["absorbed"][-1, 0] == 4
    np.testing.assert_allclose(seen["total_energy"], seen["total_energy"][0], rtol=1e-13)
    longer = run(until=1.8, count=4, laws=[swarm.Absorb(0.5)])
    np.testing.assert_array_equal(longer.bodies.position, result.bodies.position)
    assert longer.observables["impacts"][-1] == seen["impacts"][-1]


def test_a_body_that_rests_on_a_hot_floor_is_sent_off():
    scene = swarm.Scene([swarm.Box((0.3, 0.3, 0.3), temperature=ENERGY)], gravity=(0.0, 0.0, -1.0))
    r = BRICK.points.T + np.array([0.0, 0.0, 0.015 - 0.3])[:, None]
    start = swarm.Bodies(BRICK, r[..., None], np.zeros_like(r)[..., None])
    seen = swarm.simulate(
        scene, start, swarm.Impact(dt=5e-3), until=0.02, compile="never", threads=1, progress=False
    ).observables
    assert seen["kinetic_energy"][-1] > 1e-3 * ENERGY
    assert seen["wall_heat"][-1].sum() > 0.0
    assert seen["energy_error"].max() < 1e-12


def test_no_body_waits_at_a_wall():
    with pytest.raises(swarm.SceneError, match=r"surfaces\[0\].laws\[0\] must not let bodies wait"):
        run(laws=[swarm.Sticky(1.0)])


def test_groups_of_a_mesh_have_laws_of_their_own():
    """The floor, z = -0.3, keeps its own energy; all other faces stop the contact point."""
    corners = 0.3 * np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
    faces = [
        (0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4),
        (1, 5, 7), (1, 7, 3),
    ]  # fmt: skip
    group = [1 if all(corners[k][2] < 0.0 for k in face) else 0 for face in faces]
    mesh = swarm.Mesh(corners, faces, group=group, names=("rest", "floor"), groups={"floor": {"temperature": 0.0}})
    for down, hot in ((-1.0, True), (1.0, False)):
        r, v = BRICK.points.T + np.array([0.0, 0.0, 0.28 * down])[:, None], np.zeros((3, len(BRICK.points)))
        v[2] = down
        seen = swarm.simulate(
            swarm.Scene([mesh]), swarm.Bodies(BRICK, r[..., None], v[..., None]), swarm.Impact(dt=2e-3), until=0.01,
            compile="never", threads=1, progress=False,
        ).observables  # fmt: skip
        assert seen["impacts"][-1] > 0
        assert (seen["wall_heat"][-1].sum() < -0.1 * seen["total_energy"][0]) == hot
        assert seen["energy_error"].max() < 1e-12


@pytest.mark.slow
def test_laws_that_absorb_nothing_are_compiled():
    """As in plain Python: a kernel without a law that absorbs has no room for what is absorbed."""
    scene = swarm.Scene([swarm.Sphere(0.5, laws=[swarm.Lambert(0.5)])])
    start = swarm.place(scene, swarm.dumbbell(0.1, 1.0), 3, speed=1.0, seed=1)
    plain, compiled = (
        swarm.simulate(scene, start, swarm.Impact(dt=5e-3), until=1.0, seed=5, compile=when)
        for when in ("never", "always")
    )
    assert plain.observables["impacts"][-1] > 3
    np.testing.assert_array_equal(compiled.bodies.position, plain.bodies.position)
