"""Friction, temperatures and laws of walls that impacts move: momentum, energy, an independent loop, equilibrium."""

import math

import numpy as np
import pytest

import swarm
from swarm.events.reacting.described import freedoms_of, scenery_of
from swarm.events.reacting.freedoms import Freedoms, ParticleFlight
from swarm.kernel.jit import select
from swarm.kernel.random import Seeding
from swarm.kernel.vector import ZERO, Vec, dot

UP = (0.0, 0.0, 1.0)
CENTER = (0.0, 0.0, 0.0)


class Back(swarm.WallLaw):
    """Sends some particles back where they came from, others off as a mirror does."""

    probability: float

    def leave(self, v, n, u, random, mass):
        """Its kernel."""
        return select(random.uniform(0) < self.probability, 2.0 * u - v, v - 2.0 * dot(v - u, n) * n)


WALLS = {
    "shell": lambda laws: swarm.Ellipsoid((0.5, 0.4, 0.3), mass=2.0, **laws),
    "guided": lambda laws: swarm.Ellipsoid((0.5, 0.4, 0.3), mass=2.0, motion=swarm.Guide((1.0, 2.0, 0.5)), **laws),
    "spring": lambda laws: swarm.Box((0.5, 0.4, 0.3), mass=2.0, motion=swarm.Guide(UP, stiffness=9.0), **laws),
    "drum": lambda laws: swarm.Box((0.5, 0.4, 0.3), inertia=0.3, motion=swarm.Rotation(UP, 0.5, CENTER), **laws),
    "pendulum": lambda laws: swarm.Sphere(
        0.5, (0.1, 0.0, 0.0), mass=2.0, inertia=0.5, motion=swarm.Rotation((0.0, 1.0, 0.0), 0.2, CENTER), **laws
    ),
}
LAWS = {
    "friction": {"friction": 0.3},
    "friction and restitution": {"friction": 0.3, "restitution": 0.8},
    "temperature": {"temperature": 0.5, "accommodation": 0.7, "friction": 0.2},
    "Lambert": {"laws": [swarm.Lambert(0.7)]},
    "Cercignani and Lampis": {"laws": [swarm.CercignaniLampis(0.5, 0.4, 0.6)]},
    "own": {"laws": [Back(0.5)]},
}


@pytest.mark.parametrize("radius", [None, 0.03])
@pytest.mark.parametrize(("wall", "law"), [
    *((wall, "friction") for wall in WALLS), *(("guided", law) for law in LAWS), *(("shell", law) for law in LAWS),
    ("pendulum", "temperature"), ("drum", "Lambert"),
])  # fmt: skip
def test_energy_of_all(wall, law, radius):
    gravity = (0.3, 0.0, -1.0) if wall == "pendulum" else None
    scene = swarm.Scene([WALLS[wall](LAWS[law])], gravity)
    balls = swarm.fill(scene, 6, speed=1.0, seed=3, radius=radius)
    if radius is not None:
        balls.spin = np.tile([[2.0], [-3.0], [4.0]], 6)
    momentum = (balls.mass * balls.velocity).sum(axis=1)
    result = swarm.simulate(scene, balls, swarm.Impact(), until=1.0, every=0.5, compile="never", seed=2)
    seen = result.observables
    assert seen["impacts"][-1] >= 6
    assert seen["energy_error"].max() <= 1e-12
    assert seen["max_penetration"].max() <= 1e-12
    assert (seen["dissipated_energy"][-1] > 0.0) == law.startswith(("friction", "temperature"))
    assert (seen["wall_heat"][-1, 0] != 0.0) == law.startswith(("temperature", "Cercignani"))
    if wall == "shell":
        momentum_now = (result.particles.mass * result.particles.velocity).sum(axis=1)
        np.testing.assert_allclose(momentum_now + 2.0 * seen["wall_velocity"][-1, 0], momentum, rtol=0, atol=1e-13)


@pytest.mark.parametrize("radius", [0.0, 0.1])
@pytest.mark.parametrize("friction", [0.05, 0.4])
def test_friction_of_a_free_shell_against_a_plain_loop(radius, friction):
    """A particle in a sphere that impacts move, in the frame of its centre; a ball is a point that turns."""
    mass, shell, until = 1.5, 2.5, 4.0
    scene = swarm.Scene([swarm.Sphere(0.5, mass=shell, friction=friction)])
    start = swarm.Particles([0.1, -0.05, 0.2], [0.9, 0.5, -0.3], mass, radius=radius or None)
    if radius:
        start.spin = np.array([[3.0], [-2.0], [1.0]])
    result = swarm.simulate(scene, start, swarm.Impact(), until=until, compile="never")
    r, v, spin = start.position[:, 0].copy(), start.velocity[:, 0].copy(), np.array([3.0, -2.0, 1.0])
    center, u, left, reach, impacts = np.zeros(3), np.zeros(3), until, 0.5 - radius, 0
    while True:
        x, w = r - center, v - u
        half = x @ w
        time = (-half + math.sqrt(half * half + (w @ w) * (reach * reach - x @ x))) / (w @ w)
        step = min(time, left)
        r, center, left = r + step * v, center + step * u, left - step
        if left == 0.0:
            break
        impacts += 1
        n = (r - center) / np.linalg.norm(r - center)
        both = 1.0 / mass + 1.0 / shell
        push = 2.0 * (n @ w) / both
        slip = w - (n @ w) * n + (radius * np.cross(spin, n) if radius else 0.0)
        speed = np.linalg.norm(slip)
        rub = min(friction * push, speed / (both + (2.5 / mass if radius else 0.0)))
        whole = push * n + rub * slip / speed
        v, u = v - whole / mass, u + whole / shell
        if radius:
            spin = spin - np.cross(radius * n, rub * slip / speed) / (0.4 * mass * radius**2)
    assert impacts == result.observables["impacts"][-1] > 3
    np.testing.assert_allclose(result.particles.velocity[:, 0], v, rtol=0, atol=1e-12)
    np.testing.assert_allclose(result.particles.position[:, 0], r, rtol=0, atol=1e-12)
    np.testing.assert_allclose(result.observables["wall_velocity"][-1, 0], u, rtol=0, atol=1e-12)
    if radius:
        np.testing.assert_allclose(result.particles.spin[:, 0], spin, rtol=0, atol=1e-11)


@pytest.mark.parametrize("law", ["friction", "temperature", "Lambert", "own"])
def test_a_wall_of_an_endless_mass_is_one_at_rest(law):
    """The same random numbers send particles off at both."""
    ends = []
    for mass in (None, 1e15):
        scene = swarm.Scene([swarm.Ellipsoid((0.5, 0.4, 0.3), mass=mass, **LAWS[law])])
        start = swarm.fill(scene, 3, speed=1.0, seed=3)
        ends.append(swarm.simulate(scene, start, swarm.Impact(), until=1.0, compile="never", seed=2).particles.velocity)
    np.testing.assert_allclose(ends[0], ends[1], rtol=0, atol=1e-9)


@pytest.mark.parametrize("of_heavy", [False, True])
def test_absorbed_points_stay_where_they_are(of_heavy):
    laws = {"laws": [swarm.Absorb(0.3)]}
    box = swarm.Box((0.5, 0.5, 0.5), **({} if of_heavy else laws))
    wall = swarm.Sphere(0.2, side="outside", mass=2.0, **(laws if of_heavy else {}))
    start = swarm.fill(scene := swarm.Scene([box, wall]), 20, speed=1.0, seed=3)
    options = {"until": 2.0, "every": 0.25, "compile": "never", "seed": 3}
    result = swarm.simulate(
        scene, start, swarm.Impact(), observables={"places": lambda frame: frame.position}, **options
    )
    gone, seen = np.flatnonzero(~np.isnan(result.absorbed_time)), result.observables
    assert seen["absorbed"][-1, int(of_heavy)] == len(gone) > 2
    assert seen["energy_error"].max() <= 1e-12
    for i in gone:
        later = seen["places"][seen["time"] > result.absorbed_time[i], :, i]
        assert (later == result.particles.position[:, i]).all()
    if not of_heavy:
        depth = np.abs(result.particles.position[:, gone]).max(axis=0)
        np.testing.assert_allclose(depth, 0.5, rtol=0, atol=1e-12)
        return
    # Of what is absorbed the wall has the normal momentum: with the first one, it moves along the normal there.
    first = gone[np.argmin(result.absorbed_time[gone])]
    assert np.isfinite(result.absorbed_time[first])
    assert seen["wall_heat"][-1, 1] != 0.0


def test_what_a_wall_absorbs_gives_it_its_normal_momentum():
    scene = swarm.Scene([swarm.Plane(UP, 1.0, mass=3.0, laws=[swarm.Absorb(1.0)])])
    start = swarm.Particles([0.0, 0.0, 0.0], [0.5, 0.0, 2.0], 1.5)
    result = swarm.simulate(scene, start, swarm.Impact(), until=1.0, compile="never")
    # At rest along the normal relative to each other: 3 = (1.5 + 3) u.
    np.testing.assert_allclose(result.observables["wall_velocity"][-1, 0], (0.0, 0.0, 2.0 / 3.0), rtol=0, atol=1e-15)
    assert result.absorbed_time[0] == 0.5
    assert result.particles.position[:, 0].tolist() == [0.25, 0.0, 1.0]
    assert result.particles.velocity[:, 0].tolist() == [0.5, 0.0, 2.0]
    assert result.observables["wall_heat"][-1, 0] == pytest.approx(0.5 * 3.0 * 4.0 / 9.0, rel=1e-15)
    assert result.observables["energy_error"].max() <= 1e-15


@pytest.mark.parametrize("wall", WALLS)
def test_a_law_that_is_a_mirror_is_an_elastic_impact(wall):
    ends = []
    for laws in ({}, {"laws": [Back(0.0)]}):
        scene = swarm.Scene([WALLS[wall](laws)], (0.3, 0.0, -1.0) if wall == "pendulum" else None)
        start = swarm.fill(scene, 3, speed=1.0, seed=3)
        ends.append(swarm.simulate(scene, start, swarm.Impact(), until=1.0, compile="never", seed=2).particles.velocity)
    np.testing.assert_allclose(ends[0], ends[1], rtol=0, atol=1e-11)


@pytest.mark.parametrize("guided", [False, True])
@pytest.mark.parametrize("laws", [{"temperature": 0.5}, {"laws": [swarm.CercignaniLampis(0.5, 0.4, 0.6)]}])
def test_a_gas_in_equilibrium_with_its_wall_stays_so(laws, guided):
    """Of strikes with velocities of one temperature the mean of the heat is 0, as of the change of a wall's energy."""
    mass, wall_mass, energy, count = 1.0, 1.5, 0.5, 1500
    # The face leans to the guide, so that this couples what is along it and across it.
    guide = {"motion": swarm.Guide((0.0, 0.6, 0.8))} if guided else {}
    scene = swarm.Scene([swarm.Plane(UP, 0.0, mass=wall_mass, **guide, **laws)])
    compiled, rng = scene.compiled(), np.random.default_rng(5)
    first = freedoms_of(compiled, np.ones((3, 1)))
    (wall,) = scenery_of(compiled, 0.0).reacting
    source, changes = Seeding(np.int64(7), 0), []
    while len(changes) < count:
        u = rng.normal(size=3) * math.sqrt(energy / wall_mass)
        if guided:
            u = np.array([0.0, 0.6, 0.8]) * u[0]
        v = rng.normal(size=3) * math.sqrt(energy / mass)
        # As many strike as the speed along the normal says.
        if rng.uniform() * 5.0 > v[2] - u[2]:
            continue
        freedoms = Freedoms(*(array.copy() for array in first))
        freedoms.velocity[:, 0] = u
        random = source.of_impact(len(changes), 0, wall.laws)
        blow = wall.strike(freedoms, ParticleFlight(Vec(0.0, 0.0, 0.0), Vec(*v), ZERO, 0.0, 0.0), mass, random)
        given = 0.5 * wall_mass * (freedoms.velocity[:, 0] @ freedoms.velocity[:, 0] - u @ u)
        assert blow.given == pytest.approx(given, abs=1e-13)
        changes.append((blow.heat, given))
    heat = np.array(changes)
    assert np.all(np.abs(heat.mean(axis=0)) < 4.0 * heat.std(axis=0) / math.sqrt(count))
