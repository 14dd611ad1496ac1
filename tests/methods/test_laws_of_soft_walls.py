"""Laws of walls with `Penalty` and `AugmentedLagrangian`: at the end of a contact they are those of `Impact`."""

import math

import numpy as np
import pytest
from cut_short import in_sessions
from energy_books import unbooked
from same_bits import require_same

import swarm
from swarm.contact import corner
from swarm.contact.discrete_gradient import Composite
from swarm.contact.impulse import Step
from swarm.contact.regularisation import Linear
from swarm.kernel.random import Seeding
from swarm.kernel.vector import Vec
from swarm.run.base import BaseRun
from swarm.run.doors import DoorRun
from swarm.run.engine import Run

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


def test_what_another_wall_stores_of_a_point_that_is_absorbed_is_lost():
    floor, side = swarm.Plane((0.0, 0.0, -1.0), 0.0, laws=[swarm.Absorb(1.0)]), swarm.Plane((1.0, 0.0, 0.0), 0.1)
    scene, method = swarm.Scene([floor, side]), swarm.Penalty(1e-3, ALPHA)
    end = ran(scene, swarm.Particles((0.0, 0.0, 0.1), (0.8, 0.0, -1.0)), method)
    seen, inside = end.observables, end.particles.position[0, 0] - 0.1
    assert inside > 5e-3
    assert seen["contact_energy"][-1] == 0.0
    assert seen["dissipated_energy"][-1] == pytest.approx(0.5 * ALPHA * inside**2, rel=1e-12)
    assert max(balanced(seen), seen["energy_error"].max()) < 1e-14


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


def rows_of(path):
    with swarm.load_impacts(path) as log:
        return log.table()


def test_a_wall_that_goes_leaves_the_contact_with_another_one(tmp_path):
    """That one is on its way out then, and has its losses and its row all the same; the other has what it has given."""
    goes = swarm.Plane((1.0, 0.0, 0.0), 0.5, present=[(0.0, 0.14)])
    scene = swarm.Scene([goes, swarm.Plane((0.0, 1.0, 0.0), 0.4, restitution=0.5)])
    start = swarm.Particles((0.38, 0.3, 0.0), (1.0, 1.0, 0.0))
    result = ran(scene, start, PENALTY, 0.19, 0.19, impacts=tmp_path / "log.h5")
    assert balanced(result.observables) < 1e-13
    assert result.particles.velocity[1, 0] == pytest.approx(-0.5, abs=1e-12)
    rows = rows_of(tmp_path / "log.h5")
    assert rows["surface"].tolist() == [0, 1]
    assert rows["impulse"] == pytest.approx(result.observables["impulse"][-1], rel=1e-12)
    assert rows["impulse"][1] == pytest.approx(1.5, abs=1e-12)
    assert rows["time"][0] == pytest.approx(0.14, abs=1e-12)
    assert np.array_equal(rows["velocity_before"][0], rows["velocity_after"][0])


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


# Loops of which some do not converge, and some leave a gap that a wide tolerance accepts.
COUNTED = {
    "exact": {"acceleration": "reflection"},
    "wide": {"tolerance": 1e-6},
    "few sweeps": {"adaptive": True, "max_sweeps": 4},
    "corners": {"on_unconverged": "impact"},
}
SWUNG = {"motion": swarm.Oscillation((0.05, 0.03, 0.04), 1.0)}
MET = {
    "edges": swarm.Scene([swarm.Box((0.5, 0.4, 0.6)), swarm.Sphere(0.1, side="outside")]),
    "a sphere": swarm.Scene([swarm.Sphere(0.5)]),
    "losses under gravity": swarm.Scene([swarm.Box((0.5, 0.4, 0.6), **LAWS["both"])], gravity=(0.2, 0.1, -9.0)),
    "heat": swarm.Scene([swarm.Box((0.5, 0.4, 0.6), laws=[swarm.Lambert()])]),
    "walls that move": swarm.Scene([swarm.Box((0.5, 0.4, 0.6), **SWUNG)], gravity=(0.3, -0.2, -1.0)),
    "a cell": swarm.Scene(
        [swarm.Sphere(0.2, (x, 0.4, 0.0), side="outside") for x in (0.1, 0.6)], period=(1.0, 1.0, 0.5)
    ),
    "an opening": swarm.Scene([swarm.Box((0.5, 0.4, 0.6), openings=[swarm.Sphere(0.3, (0.5, 0.4, 0.0))])]),
}


def methods_of(scene):
    """The methods with a log that this scene can have."""
    at_rest = scene.gravity is None and not scene.moves()
    yield "Penalty", PENALTY
    for name, given in COUNTED.items():
        if at_rest or not {"adaptive", "on_unconverged"} & set(given):
            yield name, swarm.AugmentedLagrangian(**({**LOOP, "on_unconverged": "count", "max_sweeps": 9} | given))


@pytest.mark.parametrize("name", MET)
def test_each_contact_is_an_impact_and_has_a_row_in_the_end(tmp_path, monkeypatch, name):
    """Converged or not, at one wall or several, with a log or without; in sessions too. Of the others some last."""
    scene, runs = MET[name], []
    monkeypatch.setattr(Run, "__exit__", lambda run, *error: (runs.append(run), BaseRun.__exit__(run, *error))[1])
    start = swarm.fill(scene, 4, speed=1.0, mass=2.0, seed=3)
    for method_name, method in methods_of(scene):
        path = tmp_path / f"{method_name}.h5"
        logged = ran(scene, start, method, impacts=path)
        state, rows = runs[-1].state, rows_of(path)
        last = (state.pressed + state.rubbed > 0.0).sum(axis=0)
        found = np.bincount(rows["particle"][rows["impulse"] > 0.0], minlength=4)
        assert (found + last).tolist() == logged.impacts_per_particle.tolist(), method_name
        assert found.sum() > 1
        require_same(ran(scene, start, method), logged)


def test_no_two_contacts_in_an_edge_have_one_draw(monkeypatch):
    """One begins while the other lasts: both have ended after it, and each has a random number of its own."""
    scene, drawn, of_impact = edge(90.0, laws=[swarm.Lambert(0.7)])[0], [], Seeding.of_impact
    monkeypatch.setattr(
        Seeding,
        "of_impact",
        lambda seeding, p, k, laws: (drawn.append((p, int(k))), of_impact(seeding, p, k, laws))[1],
    )
    result = ran(scene, into_edge(90.0, np.linspace(-0.8, 0.8, 9)), PENALTY, 1.5)
    assert result.observables["contact_energy"][-1] == 0.0
    each = [sorted(k for p, k in drawn if p == particle) for particle in range(9)]
    assert each == [list(range(count)) for count in result.impacts_per_particle]
    assert max(map(len, each)) > 1


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


def edge(degrees, gravity=None, **laws):
    """The scene of two planes that meet along y at the origin, and their normals."""
    sine, cosine = math.sin(math.radians(degrees / 2.0)), math.cos(math.radians(degrees / 2.0))
    n = np.array([[-sine, 0.0, cosine], [-sine, 0.0, -cosine]])
    return swarm.Scene([swarm.Plane(tuple(one), 0.0, **laws) for one in n], gravity=gravity), n


def into_edge(degrees, parts, along=0.0):
    """Particles 0.1 m from the edge, at such parts of the way from its middle to a wall, that fly into it."""
    rest = np.zeros(len(parts))
    height = 0.1 * math.tan(math.radians(degrees / 2.0)) * np.array(parts)
    return swarm.Particles(np.array([rest + 0.1, rest, height]), np.array([rest - 1.0, rest + along, rest]))


@pytest.mark.parametrize("friction", [0.0, 0.3])
@pytest.mark.parametrize("degrees", [30.0, 60.0, 90.0, 120.0])
def test_a_contact_that_the_other_face_of_an_edge_prolongs_is_one(tmp_path, degrees, friction):
    """On its way out of one face the other pushes the particle into it again: the row has the impulse of both ways."""
    scene, n = edge(degrees, restitution=0.5, friction=friction)
    start, method = into_edge(degrees, (0.06, 0.17, 0.6), 0.3), swarm.Penalty(1e-3, ALPHA)
    seen = ran(scene, start, method, 1.0, impacts=tmp_path / "log.h5").observables
    rows = rows_of(tmp_path / "log.h5")
    assert np.bincount(rows["surface"], rows["impulse"]) == pytest.approx(seen["impulse"][-1], rel=1e-12)
    before, after = (np.sum(rows[f"velocity_{way}"] * n[rows["surface"]], 1) for way in ("before", "after"))
    assert after == pytest.approx(-0.5 * before, abs=1e-12)
    assert balanced(seen) < 1e-13


@pytest.mark.parametrize(
    ("degrees", "gravity", "laws"),
    [
        (45.0, None, {"restitution": 0.0}),
        (90.0, None, {"restitution": 0.0, "friction": 0.3, **LAWS["hot"]}),
        (120.0, (2.0, 0.0, 0.0), LAWS["Lambert"]),
        (150.0, None, {"friction": 0.3, **LAWS["CercignaniLampis"]}),
        (45.0, (-2.0, 0.0, 0.3), {"laws": [swarm.Absorb(0.5)]}),
    ],
)
def test_each_contact_in_an_edge_has_one_row_with_its_impulse(tmp_path, degrees, gravity, laws):
    """Also where the other wall gives more of the speed away than this one, or absorbs the particle."""
    scene, _n = edge(degrees, gravity, **laws)
    start = into_edge(degrees, (-0.8, -0.35, -0.1, 0.03, 0.2, 0.5), 0.3)
    seen = ran(scene, start, swarm.Penalty(1e-3, ALPHA), 1.5, impacts=tmp_path / "log.h5").observables
    rows = rows_of(tmp_path / "log.h5")
    assert seen["contact_energy"][-1] == 0.0
    assert np.bincount(rows["surface"], rows["impulse"]) == pytest.approx(seen["impulse"][-1], rel=1e-12)
    assert (rows["impulse"] > -1e-15).all()
    assert balanced(seen) < 1e-12


def test_a_wall_takes_no_more_of_the_speed_away_than_it_has_given(tmp_path):
    """What a stronger push of the other wall has given stays: w1.n = -(b - c) - e c, c the impulse of this wall."""
    e, found = 0.5, 0
    scene, n = edge(135.0, restitution=e, friction=0.3)
    start = into_edge(135.0, np.linspace(0.02, 0.4, 12), 0.3)
    seen = ran(scene, start, swarm.Penalty(1e-3, ALPHA), 1.0, impacts=tmp_path / "log.h5").observables
    for row in rows_of(tmp_path / "log.h5"):
        before, after = (row[f"velocity_{way}"] @ n[row["surface"]] for way in ("before", "after"))
        # w0.n = c - x and w1.n = -e c - x, at the contact's end
        c = (before - after) / (1.0 + e)
        x = c - before
        assert x >= -1e-12
        if x > 1e-9:
            # c is all that the wall has given, of which it takes (1 - e) c.
            assert row["impulse"] == pytest.approx(e * c, rel=1e-9)
            found += 1
    assert found > 0
    assert balanced(seen) < 1e-13


def test_a_particle_waits_at_both_walls_of_an_edge_one_after_the_other():
    """It arrives at both in one step; how frames cut the waits changes nothing."""
    scene, _n = edge(90.0, laws=[swarm.Sticky(0.3)])
    ends = [ran(scene, into_edge(90.0, (0.0,)), PENALTY, 2.0, every) for every in (2.0, 0.25)]
    assert ends[0].observables["impacts"][-1] == 2
    assert ends[1].particles.position == pytest.approx(ends[0].particles.position, abs=1e-12)


def test_reactions_that_all_but_cancel_are_solved_to_their_round_off():
    """In an acute edge they are larger than what they leave of the step."""
    walls = edge(30.0)[0].compiled(apart="fixed steps").walls().at(0.0)
    r, p = (
        Vec(-6.009289371619319e-6, 0.0, -1.666203725259684e-9),
        Vec(-7.18614933270012e-6, 0.0, -2.3170131893297707e-7),
    )
    free = Step(r, p, 3.514941291676031e-6)
    reactions = np.empty((2, 4))
    end = corner.hold(Composite(), Linear(2.501877216840645e6), None, walls, free, reactions)
    assert end.solved
    assert end.r == free.r + (free.p - corner.total(reactions))


def test_a_particle_comes_to_rest_in_an_acute_edge():
    """Its speed is round-off of its energy then, which a step restores without more of it."""
    scene, _n = edge(75.0, (-2.0, 0.0, 0.1), restitution=0.0, friction=0.3)
    start = swarm.Particles((0.16725548, 0.0, -0.10966131), (-0.8365939, 0.0, 0.54782385))
    dt = 2.3847857755914964e-3
    result = ran(scene, start, swarm.Penalty(dt, 3.93915451064637e5), 294 * dt, 294 * dt)
    assert balanced(result.observables) < 1e-13
    assert np.linalg.norm(result.particles.velocity) < 1e-6
