"""Laws of walls with `Penalty` and `AugmentedLagrangian`: at the end of a contact they are those of `Impact`."""

import math

import numpy as np
import pytest
from cut_short import in_sessions
from energy_books import unbooked
from same_bits import require_same

import swarm
from swarm.run.doors import DoorRun

ALPHA = 4e3
LOOP = {"dt": 5e-3, "penalty": ALPHA, "tolerance": 1e-20, "on_unconverged": "impact"}
PENALTY = swarm.Penalty(5e-3, ALPHA)
METHODS = {
    "Penalty": PENALTY,
    "Hertz": swarm.Penalty(2e-3, 1e5, exponent=1.5),
    "mean-value": swarm.Penalty(2e-3, 1e5, exponent=1.5, gradient="mean-value"),
    "cut": swarm.AugmentedLagrangian(**LOOP, adaptive=True, acceleration="reflection"),
    "centred": swarm.AugmentedLagrangian(**LOOP, adaptive=True, contact_start="centred"),
    "fixed": swarm.AugmentedLagrangian(**LOOP),
}
LAWS = {
    "restitution": {"restitution": 0.7},
    "friction": {"friction": 0.3},
    "both": {"restitution": 0.7, "friction": 0.3},
    "hot": {"temperature": 0.5, "accommodation": 0.6},
    "Lambert": {"laws": [swarm.Lambert(0.7)]},
    "CercignaniLampis": {"laws": [swarm.CercignaniLampis(0.5, 0.4, 0.6)]},
}


def ran(scene, particles, method, until=1.0, every=0.25, **options):
    return swarm.simulate(scene, particles, method, until=until, every=every, compile="never", seed=4, **options)


def balanced(seen):
    return unbooked(seen) / (seen["kinetic_energy"].max() + np.ptp(seen["potential_energy"]))


def one(velocity=(0.6, 0.0, -1.0)):
    return swarm.Particles((0.0, 0.0, 0.1), velocity)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("name", METHODS)
def test_an_impact_on_a_plane_is_that_of_a_rigid_one(name, law):
    scene = swarm.Scene([swarm.Plane((0.0, 0.0, -1.0), 0.0, **LAWS[law])], gravity=None)
    rigid, soft = (ran(scene, one(), method, 0.5) for method in (swarm.Impact(), METHODS[name]))
    assert soft.particles.velocity == pytest.approx(rigid.particles.velocity, abs=1e-9)
    for seen in ("dissipated_energy", "wall_heat", "impacts"):
        assert soft.observables[seen][-1] == pytest.approx(rigid.observables[seen][-1], abs=1e-9)
    assert soft.observables["impulse"][-1, 0] == pytest.approx(rigid.observables["impulse"][-1, 0], rel=1e-8)
    assert balanced(soft.observables) < 1e-13


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("name", ["Penalty", "cut", "fixed"])
def test_what_is_lost_or_given_is_booked(name, law):
    vessel = swarm.Intersection([swarm.Ellipsoid((0.5, 0.4, 0.6), **LAWS[law]), swarm.Plane((0.0, 0.0, 1.0), 0.2)])
    scene = swarm.Scene([vessel], gravity=None)
    seen = ran(scene, swarm.fill(scene, 4, speed=1.0, mass=2.0, seed=3), METHODS[name], 1.5).observables
    assert seen["impacts"][-1] > 3
    assert balanced(seen) < 1e-12
    assert seen["energy_error"].max() < 1e-12


def test_walls_that_move_and_gravity():
    motion = swarm.Oscillation((0.05, 0.03, 0.04), 1.0)
    for law in ("both", "hot"):
        scene = swarm.Scene([swarm.Box((0.5, 0.5, 0.5), motion=motion, **LAWS[law])], gravity=(0.3, -0.2, -1.0))
        seen = ran(scene, swarm.fill(scene, 4, speed=1.0, mass=2.0, seed=3), PENALTY, 1.5).observables
        assert seen["impacts"][-1] > 8
        assert balanced(seen) < 1e-12


@pytest.mark.parametrize("name", ["Penalty", "cut", "fixed"])
def test_points_are_absorbed_or_wait(name):
    scene = swarm.Scene([swarm.Plane((0.0, 0.0, -1.0), 0.0, laws=[swarm.Absorb(1.0)])], gravity=None)
    absorbed = ran(scene, one(), METHODS[name], 0.5)
    assert absorbed.observables["absorbed"][-1].tolist() == [1]
    assert absorbed.absorbed_time[0] == pytest.approx(0.1, abs=0.06)
    scene = swarm.Scene([swarm.Plane((0.0, 0.0, -1.0), 0.0, laws=[swarm.Sticky(0.3)])], gravity=None)
    held, free = (ran(one_scene, one(), METHODS[name], 1.0) for one_scene in (scene, swarm.Scene([swarm.Plane(
        (0.0, 0.0, -1.0), 0.0)], gravity=None)))  # fmt: skip
    assert held.particles.velocity[:, 0].tolist() == pytest.approx(free.particles.velocity[:, 0].tolist(), abs=1e-9)
    waited = (free.particles.position - held.particles.position)[2, 0] / free.particles.velocity[2, 0]
    assert waited > 0.0
    assert waited / 5e-3 == pytest.approx(round(waited / 5e-3), abs=1e-6) or name == "cut"


def test_what_slides_under_its_weight_is_rubbed():
    # v = v0 - mu g t, to rest at v0/(mu g), by contacts that last 2 pi/sqrt(alpha/m) each.
    floor = swarm.Plane((0.0, 0.0, -1.0), 0.0, friction=0.2)
    scene = swarm.Scene([floor], gravity=(0.0, 0.0, -10.0))
    result = ran(scene, swarm.Particles((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)), swarm.Penalty(1e-3, 1e5), 0.75, 0.125)
    seen = result.observables
    assert seen["dissipated_energy"][-1] == pytest.approx(0.5, rel=1e-3)
    assert seen["dissipated_energy"][1] == pytest.approx(0.5 * (1.0 - 0.75**2), rel=0.08)
    assert abs(result.particles.velocity[0, 0]) < 1e-9
    assert balanced(seen) < 1e-12


def test_a_particle_that_has_bounced_to_rest_presses_by_its_weight():
    scene = swarm.Scene([swarm.Plane((0.0, 0.0, -1.0), 0.0, restitution=0.5)], gravity=(0.0, 0.0, -10.0))
    result = ran(scene, one((0.0, 0.0, 0.0)), swarm.Penalty(1e-3, 1e5), 1.5, 0.25)
    seen = result.observables
    assert balanced(seen) < 1e-12
    assert (seen["impulse"][-1, 0] - seen["impulse"][-2, 0]) == pytest.approx(10.0 * 0.25, rel=0.05)
    # It swings between the wall and twice the depth m g/alpha.
    assert -2.2e-4 < result.particles.position[2, 0] < 1e-6
    assert math.isclose(seen["dissipated_energy"][-1], 1.0, rel_tol=1e-3)


def test_a_wall_that_goes_leaves_the_contact_with_another_one(tmp_path):
    """That one is on its way out then, and has its losses and its row all the same."""
    goes = swarm.Plane((1.0, 0.0, 0.0), 0.5, present=[(0.0, 0.14)])
    scene = swarm.Scene([goes, swarm.Plane((0.0, 1.0, 0.0), 0.4, restitution=0.5)])
    start = swarm.Particles((0.38, 0.3, 0.0), (1.0, 1.0, 0.0))
    result = ran(scene, start, PENALTY, 0.19, 0.19, impacts=tmp_path / "log.h5")
    assert balanced(result.observables) < 1e-13
    assert result.particles.velocity[1, 0] == pytest.approx(-0.5, abs=1e-12)
    with swarm.load_impacts(tmp_path / "log.h5") as log:
        assert log.table()["impulse"] == pytest.approx([1.5], abs=1e-12)


def test_what_friction_stops_in_an_edge_ends_its_contact_at_both_faces(tmp_path):
    """Where the first contact ends, friction stops the particle along the second face, whose spring then pushes it."""
    n, drift = 12, np.array([[0.3], [-0.3], [0.0]])
    turns, later = np.linspace(0.4, 1.2, n), np.linspace(-0.03, 0.03, n)[np.arange(n) * 7 % n]
    along, rest = np.array([np.cos(turns), np.sin(turns), 0.0 * turns]), np.zeros(n)
    place = np.array([0.5 - 0.05 * along[0], 0.4 - (0.05 + later) * along[1], rest])
    box = swarm.Box((0.5, 0.4, 0.3), restitution=0.6, friction=1.0, motion=swarm.Translation(drift[:, 0]))
    start = swarm.Particles(place, along + drift)
    seen = ran(swarm.Scene([box]), start, PENALTY, 0.2, 0.1, impacts=tmp_path / "log.h5").observables
    assert balanced(seen) < 1e-12
    with swarm.load_impacts(tmp_path / "log.h5") as log:
        assert (np.bincount(log.table()["particle"], minlength=n) == 2).all()


@pytest.mark.parametrize("drift", [0.0, 0.25])
def test_a_contact_that_a_loop_leaves_outside_ends_a_step_later(tmp_path, drift):
    """That step pushes the particle once more: the row has this impulse too, and friction is Coulomb's with it."""
    motion = None if drift == 0.0 else swarm.Translation((0.0, 0.0, -drift))
    scene = swarm.Scene([swarm.Plane((0.0, 0.0, -1.0), 0.0, motion=motion, friction=0.3)], gravity=None)
    method = swarm.AugmentedLagrangian(**(LOOP | {"on_unconverged": "count"}), acceleration="reflection")
    start = swarm.Particles((0.0, 0.0, 0.047), (0.6, 0.0, -0.5 - drift))
    seen = ran(scene, start, method, impacts=tmp_path / "log.h5").observables
    assert seen["unconverged"][-1] > 0
    with swarm.load_impacts(tmp_path / "log.h5") as log:
        rows = log.table()
    assert rows["impulse"] == pytest.approx([seen["impulse"][-1, 0]], rel=1e-12)
    rubbed = (rows["velocity_before"] - rows["velocity_after"])[0, 0]
    assert rubbed == pytest.approx(0.3 * rows["impulse"][0], rel=1e-12)


@pytest.mark.parametrize("law", ["plain", "both", "hot"])
@pytest.mark.parametrize("name", ["Penalty", "cut", "fixed"])
def test_the_log_has_a_row_where_a_contact_ends(tmp_path, name, law):
    scene = swarm.Scene([swarm.Box((0.5, 0.4, 0.6), **({"plain": {}} | LAWS)[law])], gravity=None)
    start = swarm.fill(scene, 3, speed=1.0, mass=2.0, seed=3)
    soft = ran(scene, start, METHODS[name], impacts=tmp_path / "soft.h5")
    ran(scene, start, swarm.Impact(), impacts=tmp_path / "rigid.h5")
    assert soft.observables["energy_error"].max() < 1e-12
    tables = []
    for kind in ("soft", "rigid"):
        with swarm.load_impacts(tmp_path / f"{kind}.h5") as log:
            tables.append(log.table())
    for particle in range(3):
        mine, theirs = (rows[rows["particle"] == particle] for rows in tables)
        assert 1 <= len(mine) <= len(theirs)
        assert mine["surface"][0] == theirs["surface"][0]
        # A contact lasts for pi/sqrt(alpha/m) = 0.07 s.
        assert 0.0 < mine["time"][0] - theirs["time"][0] < 0.08
        for key in ("velocity_before", "velocity_after", "impulse"):
            assert mine[key][0] == pytest.approx(theirs[key][0], abs=1e-8)
    unlogged = ran(scene, start, METHODS[name])
    assert np.array_equal(unlogged.particles.velocity, soft.particles.velocity)


def test_a_run_in_many_sessions_has_the_same_bits(tmp_path, monkeypatch):
    hole = swarm.Opening(swarm.Sphere(0.3, (0.5, 0.0, 0.0)), times=[(0.1, 0.6)])
    walls = swarm.Box((0.5, 0.4, 0.6), openings=[hole], restitution=0.8, friction=0.3, laws=[swarm.Absorb(0.1)])
    scene = swarm.Scene([walls, swarm.Sphere(0.1, side="outside", present=[(0.0, 0.5)])], gravity=None)
    start = swarm.fill(scene, 4, speed=1.0, mass=2.0, seed=3)
    whole = ran(scene, start, PENALTY, 0.8, 0.2)
    path = tmp_path / "run.h5"

    def go():
        return ran(scene, start, PENALTY, 0.8, 0.2, trajectory=path, resume=True, checkpoint=1e3)

    parts, ended = in_sessions(monkeypatch, DoorRun, 8, go)
    assert ended > 4
    require_same(parts, whole)


@pytest.mark.parametrize("friction", [0.0, 0.3])
@pytest.mark.parametrize("degrees", [30.0, 60.0, 90.0, 120.0])
def test_a_contact_that_the_other_face_of_an_edge_prolongs_is_one(tmp_path, degrees, friction):
    """On its way out of one face the other pushes the particle into it again: the row has the impulse of both ways."""
    sine, cosine = math.sin(math.radians(degrees / 2.0)), math.cos(math.radians(degrees / 2.0))
    n = np.array([[-sine, 0.0, cosine], [-sine, 0.0, -cosine]])
    walls = [swarm.Plane(tuple(one), 0.0, restitution=0.5, friction=friction) for one in n]
    height = np.array([0.06, 0.17, 0.6]) * 0.1 * sine / cosine
    rest = np.zeros(height.size)
    start = swarm.Particles(np.array([rest + 0.1, rest, height]), np.array([rest - 1.0, rest + 0.3, rest]))
    method = swarm.Penalty(1e-3, ALPHA)
    seen = ran(swarm.Scene(walls, gravity=None), start, method, 1.0, impacts=tmp_path / "log.h5").observables
    with swarm.load_impacts(tmp_path / "log.h5") as log:
        rows = log.table()
    assert np.bincount(rows["surface"], rows["impulse"]) == pytest.approx(seen["impulse"][-1], rel=1e-12)
    before, after = (np.sum(rows[f"velocity_{way}"] * n[rows["surface"]], 1) for way in ("before", "after"))
    assert after == pytest.approx(-0.5 * before, abs=1e-12)
    assert balanced(seen) < 1e-13
