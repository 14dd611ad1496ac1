"""Contacts that are soft for the speed: how deep they are, what is said before the run, and what ends it."""

import copy
import math

import numpy as np
import pytest
from grains_runs import ran

import swarm
from swarm import RunError, SceneError
from swarm.commands.summary import numbers, of_file
from swarm.grains import contacts, step
from swarm.grains.grains_run import GrainsRun
from swarm.kernel.random import Seeding
from swarm.pictures.series import lines_of
from swarm.run.preflight import softness
from swarm.run.tally import Watched
from swarm.words.content import Content
from swarm.words.verdicts import judged

ROOM = swarm.Box((50.0, 50.0, 50.0))
# A plate of 5 mm, as a box and as a mesh.
HALF = np.array([0.0025, 0.25, 0.25])
CORNERS = HALF * np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
SIDES = [
    (0, 1, 3), (0, 3, 2), (4, 7, 5), (4, 6, 7), (0, 4, 5), (0, 5, 1),
    (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3),
]  # fmt: skip
RADIUS, MASS, SOFT = 0.01, 0.01, swarm.Penalty(dt=1e-4, penalty=1e3)


def plates(**laws):
    return {"Box": swarm.Box(HALF, side="outside", **laws), "Mesh": swarm.Mesh(CORNERS, SIDES, side="outside", **laws)}


def thrown(speed, gap=0.0175):
    """A ball that flies at the plate."""
    x = -0.0025 - RADIUS - gap
    return swarm.Particles([[x], [0.01], [0.02]], [[speed], [0.0], [0.0]], MASS, radius=RADIUS)


def two(speeds, masses=(MASS, MASS), offset=0.0, gap=1e-3):
    """Two balls that fly at one another."""
    x = [-RADIUS - 0.5 * gap, RADIUS + 0.5 * gap]
    return swarm.Particles([x, [0.0, offset], [0.0, 0.0]], [speeds, [0.0] * 2, [0.0] * 2], masses, radius=RADIUS)


def depth_of(law, mass, speed):
    """The overlap at which the energy of the approach is stored, by the definition of the law."""
    return (0.5 * mass * speed**2 * (law.exponent + 1.0) / law.penalty) ** (1.0 / (law.exponent + 1.0))


# --- How deep ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("exponent", [1.0, 1.5])
@pytest.mark.parametrize("masses", [(MASS, MASS), (MASS, 3.0 * MASS)])
def test_two_balls_overlap_by_what_their_energy_says(exponent, masses):
    """v sqrt(m/k) for the linear spring, with the reduced mass."""
    method, speeds = swarm.Penalty(1e-5, 1e4 if exponent == 1.0 else 2e5, exponent), (0.5, -0.3)
    start = two(speeds, masses, gap=1e-6)
    start = swarm.Particles(start.position + 0.5, start.velocity, start.mass, radius=RADIUS)
    seen = ran(swarm.Scene([], period=(1.0, 1.0, 1.0)), start, method, 0.005).observables
    reduced = masses[0] * masses[1] / sum(masses)
    wanted = depth_of(method, reduced, 0.8)
    if exponent == 1.0:
        assert wanted == pytest.approx(0.8 * math.sqrt(reduced / 1e4), rel=1e-15)
    # At the ends of steps, of which the nearest is up to half a step away from the turning point.
    assert seen["largest_overlap"].max() == pytest.approx(wanted, rel=1e-4)
    assert seen["largest_overlap"].max() <= wanted * (1.0 + 1e-12)
    assert seen["energy_error"].max() < 1e-13
    # Neither frame has a contact.
    assert seen["contact_energy"].tolist() == [0.0, 0.0]
    assert seen["collisions"].tolist() == [0, 1]


@pytest.mark.parametrize("kind", ["Box", "Mesh", "Plane", "Sphere"])
def test_a_wall_gives_way_by_what_the_energy_says(kind):
    other = {"Plane": swarm.Plane((1.0, 0.0, 0.0)), "Sphere": swarm.Sphere(0.2, (0.2, 0.01, 0.02), side="outside")}
    wall = {**plates(), **other}[kind]
    seen = ran(swarm.Scene([ROOM, wall]), thrown(1.0, 1e-3), swarm.Penalty(2e-5, 1e4), 0.008).observables
    assert seen["largest_overlap"][-1] == pytest.approx(1.0 * math.sqrt(MASS / 1e4), rel=1e-4)
    assert seen["energy_error"].max() < 1e-13
    assert seen["max_penetration"].tolist() == [0.0, 0.0]


@pytest.mark.parametrize("restitution", [0.8, 0.3, math.exp(-2.0), 0.05])
def test_a_damper_takes_of_the_depth_what_is_predicted(restitution):
    wall = swarm.Plane((1.0, 0.0, 0.0), restitution=restitution)
    method = swarm.Penalty(1e-5, 1e4)
    seen = ran(swarm.Scene([ROOM, wall]), thrown(1.0, 0.0), method, 0.006).observables
    wanted = float(softness.depths_of(method, np.array(MASS), np.array(1.0), restitution))
    assert seen["largest_overlap"][-1] == pytest.approx(wanted, rel=0.01)


def test_an_overlap_is_that_since_the_frame_before():
    method = swarm.Penalty(1e-4, 1e4)
    start = two((0.5, -0.5), gap=-1.5e-3)
    seen = ran(swarm.Scene([ROOM]), start, method, 0.01, every=5e-4).observables
    found, start_overlap = seen["largest_overlap"], 1.5e-3
    assert found[0] == pytest.approx(start_overlap, rel=1e-12)
    assert found.max() == pytest.approx(found[1:4].max())
    assert (found[8:] == 0.0).all()
    whole = ran(swarm.Scene([ROOM]), start, method, 0.01).observables["largest_overlap"]
    assert whole.tolist() == [found[0], found[1:].max()]


# --- What ends a run --------------------------------------------------------------------------------------


@pytest.mark.parametrize("exponent", [1.0, 1.5])
def test_balls_that_pass_one_another_end_the_run(exponent):
    with pytest.raises(
        RunError, match=r"at 0\.\d+ s failed at particle 0, at \(.*overlaps particle 1 by 0\.01.* m, more"
    ):
        ran(swarm.Scene([ROOM]), two((10.0, -10.0)), swarm.Penalty(1e-4, 1e3, exponent), 0.01)


@pytest.mark.parametrize("speed", [3.3, 5.0, 20.0])
@pytest.mark.parametrize("restitution", [1.0, 0.5])
def test_a_box_and_its_mesh_hold_or_fail_alike(speed, restitution):
    """They end the run at the same step and the same place, or leave the ball in the same place."""
    outcomes = []
    for wall in plates(restitution=restitution).values():
        try:
            end = ran(swarm.Scene([ROOM, wall]), thrown(speed), SOFT, 0.05, every=1e-2).particles
            outcomes.append(tuple(end.position[:, 0].round(12)))
        except RunError as error:
            outcomes.append(str(error).partition(" by ")[0].replace("Mesh", "Box"))
    assert outcomes[0] == outcomes[1]
    holds = depth_of(SOFT, MASS, speed) < RADIUS or (restitution < 1.0 and speed < 5.0)
    assert isinstance(outcomes[0], tuple) == holds
    assert holds or "overlaps surfaces[1] (Box)" in outcomes[0]


def test_a_penalty_that_is_named_is_enough():
    """Of a pair and of a wall, with the step that it needs."""
    for scene, start in (
        (swarm.Scene([ROOM]), two((10.0, -10.0))),
        (swarm.Scene([ROOM, plates()["Mesh"]]), thrown(20.0)),
    ):
        with pytest.raises(RunError) as failed:
            ran(scene, start, SOFT, 0.01)
        named = float(str(failed.value).split("use a penalty of ")[1].split()[0])
        seen = ran(scene, start, swarm.Penalty(2e-5, named), 0.004).observables
        assert 0.1 * RADIUS < seen["largest_overlap"].max() <= 0.21 * RADIUS


def test_a_ball_that_gets_fast_does_not_jump_over_a_solid():
    """At the start its steps are short."""
    scene = swarm.Scene([swarm.Box((5.0, 5.0, 50.0)), swarm.Box((1.0, 1.0, 0.005), side="outside")], (0.0, 0.0, -1e5))
    start = swarm.Particles([[0.0], [0.0], [0.5]], [[0.0], [0.0], [0.0]], MASS, radius=RADIUS)
    with pytest.raises(RunError, match=r"moves by 0\.0\d+ m against surfaces\[1\] \(Box\) in one step.*0\.01 m thick"):
        ran(scene, start, swarm.Penalty(1e-4, 1e6), 0.01)


def test_balls_that_jump_over_one_another_are_refused():
    with pytest.raises(
        SceneError, match=r"no particle jumps over another one in a step, got dt = 0\.0001 s.*dt < 2e-05"
    ):
        ran(swarm.Scene([ROOM]), two((500.0, -500.0), gap=0.04), SOFT, 0.05)
    # Those that get so fast end the run where they meet.
    scene = swarm.Scene([swarm.Plane((0.0, 0.0, -1.0))], (0.0, 0.0, -1e5))
    start = swarm.Particles([[0.0] * 2, [0.0] * 2, [RADIUS, 0.5]], np.zeros((3, 2)), MASS, radius=RADIUS)
    with pytest.raises(RunError, match=r"against particle \d in one step, and their radii are 0\.02 m in all"):
        ran(scene, start, swarm.Penalty(1e-4, 1e6), 0.01)


def test_a_grazing_ball_goes_by():
    """Fast, over a solid and past a ball, which it does not touch: nothing is refused."""
    scene = swarm.Scene([ROOM, plates()["Box"]])
    start = swarm.Particles(
        [[-0.2, 0.0], [0.261, 0.2711], [0.0, 0.0805]], [[45.0, 0.0], [0.0] * 2, [0.0] * 2], MASS, radius=RADIUS
    )
    end = ran(scene, start, swarm.Penalty(1e-4, 1e7), 0.01).particles
    assert end.position[0, 0] == pytest.approx(-0.2 + 0.45)


# --- What is said -----------------------------------------------------------------------------------------


def warnings_of(caplog, scene, start, method):
    caplog.clear()
    try:
        ran(scene, start, method, method.dt)
    finally:
        messages = [record.getMessage() for record in caplog.records]
    return [one for one in messages if one.startswith("contacts are soft")]


def test_soft_contacts_are_reported_before_the_run(caplog):
    (pair,) = warnings_of(caplog, swarm.Scene([], period=(1.0, 1.0, 1.0)), two((10.0, -10.0)), SOFT)
    depth = depth_of(SOFT, 0.5 * MASS, 20.0)
    assert f"at 20 m/s against particle 0, may sink {depth:.2g} m into it, {depth / RADIUS:.2g} of its radius" in pair
    (wall,) = warnings_of(caplog, swarm.Scene([ROOM]), thrown(5.0), SOFT)
    assert "which may reach 5 m/s, may sink 0.016 m into a wall, 1.6 of its radius" in wall
    assert "use a penalty of 6.3e+04 or more (1000 here)" in wall
    assert warnings_of(caplog, swarm.Scene([ROOM]), thrown(5.0), swarm.Penalty(1e-5, 6.3e4)) == []


def test_a_mass_that_was_left_out_is_named(caplog):
    """Without a mass each ball has 1 kg: for a radius of a millimetre no penalty is the right mend."""
    start = swarm.Particles(np.zeros((3, 1)), [[5.0], [0.0], [0.0]], radius=1e-3)
    (wall,) = warnings_of(caplog, swarm.Scene([ROOM]), start, SOFT)
    assert wall.endswith(
        "; the mass of particle 0, 1 kg, is 2.4e+08 kg/m^3, above that of every metal: give the particles a mass"
    )
    assert "metal" not in warnings_of(caplog, swarm.Scene([ROOM]), thrown(5.0), SOFT)[0]


def test_what_a_fall_and_a_wall_that_moves_add_is_known(caplog):
    floor = swarm.Plane((0.0, 0.0, -1.0), 50.0)
    rest = swarm.Particles([[0.0], [0.0], [1.25 - 49.0]], [[0.0]] * 3, MASS, radius=RADIUS)
    (warning,) = warnings_of(caplog, swarm.Scene([floor], (0.0, 0.0, -10.0)), rest, SOFT)
    assert f"may reach {math.sqrt(2.0 * 10.0 * 2.25):.3g} m/s" in warning
    shaken = swarm.Box((1.0, 1.0, 50.0), motion=swarm.Oscillation((0.0, 0.0, 0.1), 10.0))
    (warning,) = warnings_of(caplog, swarm.Scene([shaken]), rest, SOFT)
    assert f"may reach {0.1 * 2.0 * math.pi * 10.0:.3g} m/s" in warning
    assert warnings_of(caplog, swarm.Scene([floor]), rest, SOFT) == []


@pytest.mark.parametrize("exponent", [1.0, 1.5])
def test_points_and_thin_solids(exponent, caplog):
    scene = swarm.Scene([swarm.Box((1.0, 1.0, 1.0)), swarm.Slab((1.0, 0.0, 0.0), 0.005, side="outside")])
    start = swarm.Particles([-0.1, 0.0, 0.0], [1.0, 0.0, 0.0], MASS)
    needed = (exponent + 1.0) * 0.5 * MASS / 0.002 ** (exponent + 1.0)
    (warning,) = warnings_of(caplog, scene, start, swarm.Penalty(1e-4, 0.9 * needed, exponent))
    assert "surfaces[1] (Slab) is 0.01 m thick" in warning
    assert warnings_of(caplog, scene, start, swarm.Penalty(1e-4, 1.1 * needed, exponent)) == []


# --- Points -----------------------------------------------------------------------------------------------

THICK = 0.005
THIN = {
    "Slab": swarm.Slab((1.0, 0.0, 0.0), 0.5 * THICK, side="outside"),
    "Box": plates()["Box"],
    "Cylinder": swarm.Cylinder(0.1, axis=(1.0, 0.0, 0.0), length=THICK, side="outside"),
    "Sphere": swarm.Sphere(0.5 * THICK, side="outside"),
    "Capsule": swarm.Capsule(0.5 * THICK, 0.1, axis=(0.0, 0.0, 1.0), side="outside"),
    "Ellipsoid": swarm.Ellipsoid((0.5 * THICK, 0.1, 0.1), side="outside"),
    # A wall between two rooms of one cavity, and a grid of samples
    "Formula": None,  # takes a third of a second to make: thin("Formula")
    "Sampled": swarm.Sampled(
        np.abs(np.arange(-20.0, 21.0))[:, None, None] * np.ones((41, 9, 9)) * 1e-3 - 0.5 * THICK,
        (1e-3, 0.02, 0.02), (-0.02, -0.08, -0.08), side="outside",
    ),
}  # fmt: skip


def thin(name):
    """A surface of the table."""
    return THIN[name] or swarm.Formula("0.00125 - 200 * x**2", bounds=((-1.0,) * 3, (1.0,) * 3))


# The gap of an ellipsoid is a number.
SOFTER = {"Ellipsoid": swarm.Penalty(1e-4, 0.1)}
CELL = swarm.Box((0.018, 0.07, 0.07))


def point(speed, y=3e-4):
    return swarm.Particles([[-0.5 * THICK - speed * 3.3e-4], [y], [2e-4]], [[speed], [0.0], [0.0]], MASS)


@pytest.mark.parametrize("method", [swarm.Penalty, swarm.Verlet, swarm.Midpoint, swarm.Trapezoidal])
@pytest.mark.parametrize("name", ["Slab", "Sphere"])
def test_a_point_that_passes_the_middle_of_a_solid_ends_the_run(name, method):
    for speed in (5.0, 20.0):
        with pytest.raises(
            RunError, match=rf"goes through the middle of surfaces\[1\] \({name}\), which is 0\.005 m thick"
        ):
            ran(swarm.Scene([ROOM, thin(name)]), point(speed), method(1e-4, 1e3), 0.01)


@pytest.mark.parametrize("name", THIN)
def test_the_penalty_that_is_named_for_a_point_is_enough(name):
    scene, start = swarm.Scene([CELL, thin(name)]), point(5.0)
    with pytest.raises(RunError, match=rf"the middle of surfaces\[1\] \({name}\).*too soft") as failed:
        ran(scene, start, SOFTER.get(name, SOFT), 0.01)
    named = float(str(failed.value).split("use a penalty of ")[1].split()[0])
    end = ran(scene, start, swarm.Penalty(5e-6, named), 0.002).particles
    assert end.position[0, 0] < -0.5 * THICK
    assert end.velocity[0, 0] < 0.0


def test_a_box_and_its_samples_agree_on_points():
    messages = []
    for name in ("Box", "Sampled", "Slab"):
        with pytest.raises(RunError) as failed:
            ran(swarm.Scene([CELL, thin(name)]), point(5.0), SOFT, 0.01)
        messages.append(str(failed.value).replace(name, "Slab"))
    assert messages[0] == messages[2]
    # The spline through the samples is round in the middle.
    places = [float(one.split("at (")[1].split(",")[0]) for one in messages]
    assert places[1] == pytest.approx(places[0], abs=1e-6)


def test_a_point_that_a_moving_solid_passes_ends_the_run():
    wall = swarm.Slab((1.0, 0.0, 0.0), 0.5 * THICK, side="outside", motion=swarm.Translation((-5.0, 0.0, 0.0)))
    rest = swarm.Particles([[-0.02], [0.0], [0.0]], np.zeros((3, 1)), MASS)
    with pytest.raises(RunError, match=r"the middle of surfaces\[1\] \(Slab\)"):
        ran(swarm.Scene([ROOM, wall]), rest, SOFT, 0.01)
    named = 3e5
    end = ran(swarm.Scene([ROOM, wall]), rest, swarm.Penalty(5e-6, named), 0.01).particles
    assert end.velocity[0, 0] == pytest.approx(-10.0, rel=1e-9)


def test_a_point_that_turns_round_in_a_solid_goes_on():
    """At the edge of a box, deep in it, on a chord through a sphere near its surface, and along a solid."""
    scene = swarm.Scene(
        [ROOM, swarm.Box((0.1, 0.1, 0.1), side="outside"), swarm.Sphere(0.1, (1, 0, 0), side="outside")]
    )
    start = swarm.Particles(
        [[-0.11, -0.105, 0.88, 0.9], [0.0, -0.101, 0.0, 0.0995], [0.0] * 4],
        [[3.0, 4.0, 3.0, 5.0], [0.0, 4.0, 0.0, 0.0], [0.0] * 4], MASS,
    )  # fmt: skip
    seen = ran(scene, start, SOFT, 0.05, every=1e-3)
    assert seen.observables["max_penetration"].max() > 8e-3
    assert seen.observables["energy_error"].max() < 1e-12
    assert seen.particles.velocity[0, [0, 2]] == pytest.approx([-3.0, -3.0])


def test_an_overlap_is_in_files_and_in_verdicts(tmp_path):
    scene, start = swarm.Scene([ROOM]), two((1.0, -1.0))
    path = tmp_path / "run.h5"
    result = ran(scene, start, SOFT, 0.02, every=1e-3, trajectory=path)
    deepest = float(result.observables["largest_overlap"].max())
    assert 0.2 * RADIUS < deepest < RADIUS
    with swarm.load(path) as trajectory:
        assert (trajectory.observables["largest_overlap"] == result.observables["largest_overlap"]).all()
        assert trajectory.to_xarray().largest_overlap.attrs["units"] == "m"
        assert "largest_overlap" in trajectory.table()
    assert numbers(path)["largest_overlap"] == deepest
    drawn = {line.path: line.observable for line in lines_of(scene, SOFT, [], None, result.observables)}
    assert drawn["/overlap"] == "largest_overlap"
    percent = f"{100.0 * deepest / RADIUS:.2g} %"
    assert of_file(path)["contacts"].startswith(f"✗ balls overlapped by at most {1e3 * deepest:.2g} mm, {percent}")
    content = Content("", scene, SOFT, None, 2, dict(result.observables), {"end": result.particles})
    (statement,) = [one for one in judged(content) if one.label == "contacts"]
    assert statement.verdict is False
    assert f"balls overlapped by at most {1e3 * deepest:.2g} mm, {percent} of their radius" in statement.text
    content.seen["largest_overlap"] = 0.4 * content.seen["largest_overlap"]
    (statement,) = [one for one in judged(content) if one.label == "contacts"]
    assert statement.verdict is True


# --- Everywhere -------------------------------------------------------------------------------------------

MOVING = swarm.Box((0.1, 0.1, 0.1), side="outside", motion=swarm.Translation((-5.0, 0.0, 0.0)))
INSIDE = swarm.Mesh(2.0 * CORNERS / HALF, SIDES)
SOFT_WALLS = {
    "a wall that moves": (swarm.Scene([ROOM, MOVING]), (-0.2, 0.0, 0.0), (0.0, 0.0, 0.0), r"surfaces\[1\] \(Box\)"),
    "a vessel from a mesh": (swarm.Scene([INSIDE]), (-1.9, 0.3, 0.2), (-5.0, 0.0, 0.0), r"surfaces\[0\] \(Mesh\)"),
    "a plane": (
        swarm.Scene([ROOM, swarm.Box((1.0, 1.0, 1.0))], plane="z"), (0.95, 0.0, 0.0), (5.0, 0.0, 0.0), r"surfaces\[1\]"
    ),
    "a cell that repeats": (
        swarm.Scene([swarm.Slab((1.0, 0.0, 0.0), 1.0)], period=(None, 1.0, 1.0)), (0.95, 0.5, 0.5), (5.0, 0.0, 0.0),
        r"surfaces\[0\] \(Slab\)",
    ),
    "a floor under gravity": (
        swarm.Scene([swarm.Plane((0.0, 0.0, -1.0))], (0.0, 0.0, -1000.0)), (0.0, 0.0, 0.05), (0.0, 0.0, 0.0),
        r"surfaces\[0\] \(Plane\)",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", SOFT_WALLS)
def test_no_wall_is_passed(name):
    scene, place, velocity, wall = SOFT_WALLS[name]
    start = swarm.Particles(np.array([place]).T, np.array([velocity]).T, MASS, radius=RADIUS)
    with pytest.raises(RunError, match=rf"it overlaps {wall}.* m, more than its radius, 0\.01 m"):
        ran(scene, start, SOFT, 0.05, every=1e-3)


def test_balls_meet_across_the_faces_of_a_cell():
    scene = swarm.Scene([], period=(1.0, 1.0, 1.0))
    start = swarm.Particles(
        [[0.02, 0.98], [0.5, 0.5], [0.5, 0.5]], [[-10.0, 10.0], [0.0] * 2, [0.0] * 2], MASS, radius=RADIUS
    )
    with pytest.raises(RunError, match="it overlaps particle"):
        ran(scene, start, SOFT, 0.01)


def heap(of_walls, of_pairs, **moved):
    """Eight balls that are about to fall on the floor of a box, with friction."""
    box = swarm.Box((0.0106, 0.0106, 0.1), (0.0, 0.0, 0.1), restitution=0.3, friction=of_walls, **moved)
    scene = swarm.Scene([box], gravity=(0.0, 0.0, -9.81), pairs=swarm.Pairs(restitution=0.3, friction=of_pairs))
    k, wobble = np.arange(8), np.random.default_rng(0).uniform(-1.5e-4, 1.5e-4, (3, 8))
    places = 0.0103 * np.array([k % 2 - 0.5, k // 2 % 2 - 0.5, k // 4 + 0.55]) + wobble
    start = swarm.Particles(places, np.zeros((3, 8)), 1.3e-3, radius=0.005)
    return scene, start


def rubbing(tolerance):
    """The method of a heap with friction to a tolerance."""
    return swarm.Penalty(2e-4, 1600.0, 1.0, friction_tolerance=tolerance)


@pytest.mark.parametrize(("friction", "off"), [(0.0, 1e-10), (0.5, 1e-7)])
def test_overlaps_where_dampers_act_are_those_of_sweeps_to_round_off(friction, off, monkeypatch):
    """There sweeps end early, as energy is booked by what dampers did: overlaps stay the same to a part of a radius.

    Friction is solved to fewer digits, and more sweeps of it lead to another slip.
    """
    scene, start = heap(friction, friction)

    def overlaps():
        run = swarm.simulate(scene, start, swarm.Penalty(2e-4, 1600.0, 1.0), until=0.02, every=2e-3, compile="never")
        return run.observables["largest_overlap"]

    found = overlaps()
    monkeypatch.setattr(contacts, "_DAMPED", 1.0)
    assert found.max() > 5e-5
    np.testing.assert_allclose(found, overlaps(), rtol=0.0, atol=off * 0.005)


def test_a_heap_that_is_carried_along_comes_to_rest_as_one_at_rest():
    """Galilei: what friction leaves of a slip follows from relative velocities."""
    carried, until = np.array([[12.0], [-10.0], [4.0]]), 0.02
    (scene, start), moving = heap(0.5, 0.5), heap(0.5, 0.5, motion=swarm.Translation(carried.ravel()))[0]
    thrown_along = swarm.Particles(start.position, start.velocity + carried, start.mass, radius=start.radius)
    here, there = (
        ran(one, balls, swarm.Penalty(2e-4, 1600.0, 1.0), until).particles
        for one, balls in ((scene, start), (moving, thrown_along))
    )
    assert np.abs(here.spin).max() > 0.1
    np.testing.assert_allclose(there.velocity - carried, here.velocity, rtol=0.0, atol=1e-10)
    np.testing.assert_allclose(there.position - carried * until, here.position, rtol=0.0, atol=1e-13)


def test_round_off_of_fast_balls_that_rest_on_one_another_is_not_solved():
    """Three that touch and fly together: what they have of relative velocities are last bits."""
    x = np.array([0.0, 1.0, 2.0]) * (2.0 * RADIUS - 1e-12)
    start = swarm.Particles(
        [x, [0.2] * 3, [0.1] * 3], np.tile([[300.0], [200.0], [-50.0]], (1, 3)), MASS, radius=RADIUS
    )
    with GrainsRun(
        swarm.Scene([ROOM]).compiled(), start, swarm.Penalty(1e-4, 1e4), 1, None, "never", Seeding(), Watched()
    ) as run:
        run.observe()
        assert run.advance(20.0, 0.002)
        assert int(run._world.books.sweeps[0]) < 3 * 20


@pytest.mark.parametrize(("of_walls", "of_pairs"), [(0.5, 0.0), (0.0, 0.5)], ids=["walls", "pairs"])
def test_where_some_contacts_alone_have_friction_no_sweep_skips_a_contact(of_walls, of_pairs, monkeypatch):
    """The same bits whatever counts as solved, and the error of friction as where all contacts have it."""
    scene, start = heap(of_walls, of_pairs)
    monkeypatch.setattr(step, "_CHEAP", 0)

    def ends(tolerance, stirring):
        monkeypatch.setattr(step, "_STIRRING", stirring)
        run = ran(scene, start, rubbing(tolerance), 0.02)
        assert np.abs(run.particles.spin).max() > 0.1
        return run.particles.position

    found = ends(0.02, step._STIRRING)
    assert (found == ends(0.02, 1e3)).all()
    np.testing.assert_allclose(found, ends(1e-9, 0.0), rtol=0.0, atol=1e-6 * 0.005)


def test_friction_is_as_exact_as_its_tolerance_says(monkeypatch):
    """Against friction to round-off: places to 1e-4 of a radius by themselves, and to 1e-10 where that is asked for."""
    scene, start = heap(0.5, 0.5)

    def ends(tolerance):
        run = ran(scene, start, rubbing(tolerance), 0.02)
        assert run.observables["unconverged"][-1] == 0
        return run.particles.position / 0.005

    whole = ends(0.02)
    monkeypatch.setattr(step, "_CHEAP", 0)
    exact = ends(1e-10)
    found = {tolerance: np.abs(ends(tolerance) - exact).max() for tolerance in (0.02, 1e-3, 3e-8)}
    assert 1e-10 < found[1e-3] < found[0.02] < 1e-4
    assert found[3e-8] < 1e-10
    # So few grains are solved to more digits as long as a step has few contacts.
    assert np.abs(whole - exact).max() < 0.5 * found[0.02]


def test_a_few_grains_roll_in_a_mesh_as_in_the_box_that_it_is_of():
    """Into its corners too, where friction at one wall depends on that at another, and walls come in another order."""
    laws, half = {"restitution": 0.5, "friction": 0.5, "rolling": 0.02}, 0.02
    box, mesh = swarm.Box((half, half, half), **laws), swarm.Mesh(half * CORNERS / HALF, SIDES, **laws)
    place, velocity = (
        [[0.008, -0.008], [0.002, 0.006], [-half + RADIUS / 2] * 2],
        [[0.3, -0.3], [0.2, -0.1], [0.0, 0.0]],
    )
    start = swarm.Particles(place, velocity, 1.3e-3, radius=0.005, spin=np.zeros((3, 2)))
    one, other = (
        ran(swarm.Scene([wall], gravity=(0.0, 0.0, -9.81), pairs=swarm.Pairs(**laws)), start, rubbing(0.02), 0.05)
        for wall in (box, mesh)
    )
    assert one.observables["impacts"][-1] == other.observables["impacts"][-1] > 3
    for name in ("position", "velocity", "spin"):
        here, there = (getattr(run.particles, name) for run in (one, other))
        np.testing.assert_allclose(here, there, rtol=0.0, atol=1e-12 * max(1.0, np.abs(here).max()))


def test_a_step_that_lags_is_counted_once(monkeypatch):
    """Also one that is solved again for contacts that it has led to: with no sweeps for friction every one lags."""
    (scene, start), solve, dt, solved = heap(0.5, 0.5), step._solve, 8e-4, []
    monkeypatch.setattr(step, "_RUBS_A_DIGIT", 0)
    monkeypatch.setattr(step, "_solve", lambda *given: solved.append(0) or solve(*given))
    run = ran(scene, start, swarm.Penalty(dt, 1600.0, 1.0), 25 * dt)
    assert len(solved) > 25
    assert run.observables["unconverged"].tolist() == [0, 25]
    content = Content("", scene, SOFT, None, 8, dict(run.observables), {"end": run.particles})
    assert [one.text for one in judged(content) if one.label == "friction"] == [
        "25 steps met friction, or a damper, to fewer digits than others"
    ]


def test_beside_friction_sweeps_end_where_they_would_not_make_the_end_more_exact(monkeypatch):
    """Normal impulses to a thousandth of friction's tolerance change ends by less than a hundredth of its error."""
    (scene, start), found = heap(0.5, 0.5), {}
    monkeypatch.setattr(step, "_CHEAP", 0)
    tolerances = {
        "exact": (1e-10, step._SOLVED),
        "to round-off": (0.02, step._SOLVED),
        "as it is": (0.02, step._BESIDE_FRICTION),
    }
    for name, (tolerance, beside) in tolerances.items():
        monkeypatch.setattr(step, "_BESIDE_FRICTION", beside)
        with GrainsRun(
            scene.compiled(), start.copy(), rubbing(tolerance), 1, None, "never", Seeding(), Watched()
        ) as run:
            run.observe()
            assert run.advance(100.0, 0.02)
            found[name] = run.state.position.copy(), int(run._world.books.sweeps[0])
    (exact, _), (whole, many), (short, few) = found.values()
    assert abs(short - whole).max() < 1e-2 * abs(whole - exact).max()
    assert few < 0.9 * many


@pytest.mark.parametrize("dt", [4e-4, 8e-4])
def test_a_step_that_counts_as_solved_would_change_by_no_more_than_its_tolerance(dt, monkeypatch):
    """The next sweep, which is not made, does no more than is counted on: so none of these steps is unconverged."""
    (scene, start), solve, left = heap(0.5, 0.5), step._solve, []

    def solve_and_look(matter, walls, world):
        assert solve(matter, walls, world) == (True, 0)
        left.append(step._sweep(matter, walls, copy.deepcopy(world), 1.0))
        return True, 0

    monkeypatch.setattr(step, "_solve", solve_and_look)
    swarm.simulate(scene, start, swarm.Penalty(dt, 1600.0, 1.0), until=0.02, compile="never")
    assert len(left) >= round(0.02 / dt)
    assert max(left) < step._BESIDE_FRICTION


def test_a_pile_at_rest_takes_one_sweep_a_step():
    """Where friction changes next to nothing, what its sweep did to normal impulses is enough: none is after it."""
    (scene, _start), places = heap(0.5, 0.5), [[0.0, 0.0], [0.0, 0.0], [0.005, 0.0149]]
    start = swarm.Particles(places, np.zeros((3, 2)), 1.3e-3, radius=0.005)
    with GrainsRun(
        scene.compiled(), start, swarm.Penalty(2e-4, 1600.0, 1.0), 1, None, "never", Seeding(), Watched()
    ) as run:
        run.observe()
        books = run._world.books
        assert run.advance(100.0, 0.02)
        assert books.sweeps[0] > 1.5 * 100  # before the ball on top has come to rest
        assert run.advance(300.0, 0.08)
        before = int(books.sweeps[0])
        assert run.advance(50.0, 0.09)
        assert int(books.sweeps[0]) - before == 50
        assert np.abs(run.state.velocity).max() < 1e-6
        assert books.overlap[0] > 1e-6
