"""Doors: openings that are open, and walls that are there, between some times only."""

import dataclasses
import math

import numpy as np
import pytest
from conftest import rarely
from test_openings import bits, run, thrown
from test_sessions import require_resumed_is_whole

import swarm
from swarm import scene_file
from swarm.contact.events import ARRIVED
from swarm.kernel.vector import Vec, norm
from swarm.pictures.film import _Film
from swarm.run.doors import DoorRun
from swarm.serialization.tables import scene_of, scene_table
from swarm.surfaces.presence.doors import instants_of, is_there, was_there
from swarm.triangles.shapes import shapes_of

HOLE = swarm.Sphere(0.2, center=(0.0, 0.0, 0.5))
DOWN = (0.0, 0.0, -1.0)


class Lambert(swarm.WallLaw):
    """As fast as it came, with a direction by Lambert's cosine law."""

    def leave(self, v, n, u, random, mass):
        aside = Vec(random.normal(0), random.normal(2), random.normal(4))
        away = n + aside / norm(aside)
        return (norm(v) / norm(away)) * away


def valve(*times, law=()):
    return swarm.Scene([swarm.Sphere(0.5, openings=[swarm.Opening(HOLE, times=times)], laws=law)])


def shelf(*times, **law):
    """A room with a shelf in it that is there for some times."""
    return swarm.Scene([swarm.Box((1.0, 1.0, 1.0), **law), swarm.Plane(DOWN, 0.0, present=times, **law)], gravity=DOWN)


# --- Times -----------------------------------------------------------------------------------------------


def test_a_span_has_its_begin_and_not_its_end():
    spans = ((0.0, 1.0), (1.0, 2.0), (3.0, math.inf))
    times = (0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 1e9)
    assert [is_there(spans, time) for time in times] == [True, True, True, True, False, False, True, True]
    # In the frame that ends then; the first one is at the start itself.
    assert [was_there(spans, time) for time in times] == [True, True, True, True, True, False, False, True]
    assert is_there(None, 5.0)
    assert was_there(None, 5.0)
    assert not was_there(((0.5, 1.0),), 0.0)
    wall = swarm.Sphere(1.0, present=spans, openings=[swarm.Opening(swarm.Sphere(0.1, (0, 0, 1)), [(0.5, 3.0)])])
    assert instants_of([spans, None, spans]) == (2.0, 3.0)
    assert swarm.Scene([wall, wall]).instants == (0.5, 2.0, 3.0)


# --- Openings --------------------------------------------------------------------------------------------


def test_particles_escape_while_the_opening_is_open():
    scene = valve((1.0, 2.0), (3.0, math.inf))
    found = run(scene, swarm.fill(scene, 200, speed=1.0, seed=1), until=4.0, frames=8)
    out = ~np.isnan(found.escape_time)
    times = found.escape_time[out]
    assert out.sum() > 10
    assert all(1.0 <= time <= 2.0 or time >= 3.0 for time in times)
    assert ((times < 2.0).sum(), (times > 3.0).sum()) > (3, 3)
    assert found.observables["escaped"].tolist() == [
        (times <= time).sum() for time in found.observables["time"].tolist()
    ]
    assert (HOLE.phi(found.particles.position[:, out]) <= 0.0).all()


@pytest.mark.physics
def test_the_storage_curve_falls_by_a_quarter_of_area_speed_over_volume_while_the_shutter_is_open():
    n, radius, speed, begin, end = 5_000, 0.05, 1.0, 20.0, 320.0
    hole = swarm.Sphere(radius, center=(0.0, 0.0, 0.5))
    scene = swarm.Scene([swarm.Sphere(0.5, openings=[swarm.Opening(hole, [(begin, end)])], laws=[Lambert()])])
    found = run(scene, swarm.fill(scene, n, speed=speed, seed=3), until=400.0, frames=40, compile="always", threads=2)
    # The cap within the chord: its area is pi radius^2 exactly.
    rate = math.pi * radius**2 * speed / (4.0 * (4.0 / 3.0 * math.pi * 0.5**3))
    time = found.observables["time"]
    # The end of a flight does not say where it began: impacts are those of a renewal process, whose chords have a mean
    # of 4 R/3 and a variance of 2 R^2/9. Of p = area/surface that leaves 0.44 p of the rate.
    part = math.pi * radius**2 / math.pi
    kept = np.exp(-rate * (1.0 + 0.4375 * part) * (np.clip(time, begin, end) - begin))
    stored = n - found.observables["escaped"]
    error = np.sqrt(n * kept * (1.0 - kept))
    assert 0.3 < kept[-1] < 0.7
    assert (np.abs(stored - n * kept) <= 3.0 * error).all()
    assert (stored[time <= begin] == n).all()
    assert len(set(stored[time >= end].tolist())) == 1


def test_what_rests_where_an_opening_opens_escapes_at_that_instant():
    hatch = swarm.Opening(swarm.Sphere(0.2, center=(0.0, 0.0, -1.0)), [(0.4, 0.5), (0.9, 1.2)])
    scene = swarm.Scene([swarm.Box((1, 1, 1), openings=[hatch], restitution=0.5, friction=0.5)], gravity=DOWN)
    # At rest beside it, on it, in a corner; and one that slides past it.
    start = thrown([(0, 0.3, -1), (0, 0, -1), (-1, -1, -1), (-0.3, 0.3, -1)], [(0, 0, 0)] * 3 + [(0.9, 0, 0)])
    found = run(scene, start, until=1.5, frames=3)
    assert found.escape_time.tolist() == pytest.approx([np.nan, 0.4, np.nan, np.nan], nan_ok=True)
    assert found.escape_time[1] == 0.4
    assert found.observables["escaped"].tolist() == [0, 1, 1, 1]
    # What rests weighs on the floor as long as it does.
    assert found.observables["impulse"][-1, 0] == pytest.approx(3 * 1.5 + 0.4, rel=1e-9)


def test_what_slides_escapes_where_and_when_it_is_in_an_opening_that_opens():
    hatch = swarm.Opening(swarm.Sphere(0.2, center=(0.0, 0.0, -1.0)), [(0.4, 0.7)])
    scene = swarm.Scene([swarm.Box((1, 1, 1), openings=[hatch])], gravity=DOWN)
    # In it at 0.4 s; into it at 0.6 s; past it before; into it when it is shut again.
    start = thrown([(-0.5, 0, -1), (-0.8, 0, -1), (-0.1, 0, -1), (-0.95, 0, -1)], [(1, 0, 0)] * 4)
    found = run(scene, start, until=1.0, frames=1)
    assert found.escape_time.tolist() == pytest.approx([0.4, 0.6, np.nan, np.nan], rel=1e-9, nan_ok=True)
    assert found.particles.position[0].tolist() == pytest.approx([-0.1, -0.2, 0.9, 0.05], abs=1e-9)


# --- Walls -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("law", [{}, {"friction": 0.5}, {"restitution": 0.5}, {"restitution": 0.9, "friction": 0.2}])
def test_what_rests_or_slides_on_a_wall_that_goes_falls_from_that_instant(law):
    start = thrown([(0, 0, 0), (0, 0.3, 0), (-1, -1, 0)], [(0.5, 0, 0), (0, 0, 0), (0, 0, 0)])
    found = run(shelf((0.0, 0.83), **law), start, until=1.0, frames=4)
    assert found.particles.position[2] == pytest.approx(-0.5 * 0.17**2, rel=1e-12)
    assert found.particles.velocity[2] == pytest.approx(-0.17, rel=1e-12)
    assert found.observables["sliding"].tolist() == [0, 3, 3, 3, 0]
    assert found.observables["impulse"][-1, 1] == pytest.approx(3 * 0.83, rel=1e-9)
    assert found.observables["energy_error"].max() < 1e-15


def test_an_edge_of_which_one_wall_goes_lets_go():
    wall = swarm.Plane((0.0, -1.0, 0.0), 0.0, present=[(0.0, 0.5)])
    scene = swarm.Scene([swarm.Box((2, 2, 1)), wall], gravity=(0.0, -1.0, -1.0))
    found = run(scene, thrown([(0, 0, -1)], [(1, 0, 0)]), until=1.0, frames=2)
    assert found.particles.position[:, 0].tolist() == pytest.approx([1.0, -0.125, -1.0], abs=1e-9)


def test_a_wall_that_comes_holds_what_falls_on_it():
    board = swarm.Box((2, 2, 0.02), center=(0, 0, -0.02), side="outside", restitution=0.0, present=[(0.3, 0.6)])
    scene = swarm.Scene([swarm.Box((1, 1, 1)), board], gravity=DOWN)
    found = run(scene, thrown([(0, 0, 0.1), (0, 0, -0.1)], [(0, 0, 0), (0, 0, 0)]), until=1.0, frames=10)
    fall = math.sqrt(0.2)
    assert 0.3 < fall < 0.6
    assert found.particles.position[2, 0] == pytest.approx(-0.5 * 0.4**2, rel=1e-9)
    assert found.particles.position[2, 1] == pytest.approx(-0.1 - 0.5, rel=1e-12)
    assert found.impacts_per_particle.tolist() == [1, 0]


@pytest.mark.parametrize("compile", ["never", rarely("always")])
@pytest.mark.parametrize("gravity", [None, (0.0, -0.3, -0.2)])
def test_gas_in_half_a_box_expands_when_the_shutter_goes(gravity, compile):
    shutter = swarm.Plane((1.0, 0.0, 0.0), 0.0, present=[(0.0, 0.7)])
    scene = swarm.Scene([swarm.Box((0.5, 0.4, 0.3)), shutter], gravity)
    start = swarm.fill(scene, 300, temperature=1.0, seed=2)
    assert start.position[0].max() <= 0.0
    assert start.volume == pytest.approx(0.5 * 0.8 * 0.6, rel=0.1)
    found = run(scene, start, until=2.0, frames=5, compile=compile)

    def folded(x, length):
        """The place between walls at 0 and at `length`."""
        x = np.mod(x, 2.0 * length)
        return np.where(x > length, 2.0 * length - x, x), x > length

    x, v = start.position[0] + 0.5, start.velocity[0]
    there, turned = folded(x + 0.7 * v, 0.5)
    at_end, _turned = folded(there + 1.3 * np.where(turned, -v, v), 1.0)
    assert found.particles.position[0] + 0.5 == pytest.approx(at_end, abs=1e-12)
    assert (found.particles.position[0] > 0.0).mean() == pytest.approx(0.5, abs=3.0 * math.sqrt(0.25 / 300))


def test_a_wall_must_come_where_nobody_is():
    scene = swarm.Scene([swarm.Box((1.0, 1.0, 1.0)), swarm.Plane((0.0, 0.0, 1.0), 0.5, present=[(0.5, 0.8)])])
    start = thrown([(0, 0, 0), (0, 0, 0.9)], [(0, 0, 0.5), (0.0, 0.0, -0.2)])
    sentence = (
        r"surfaces\[1\] \(Plane\) must come where no particle is: at 0.5 s particle 1 is 0.3 m inside, at \(0, 0, 0.8\)"
    )
    with pytest.raises(swarm.RunError, match=sentence):
        run(scene, start, until=1.0, frames=1)
    # No frame sees it come as the run ends; and particles that escaped are not in the way.
    assert run(scene, start, until=0.5, frames=1).observables["time"][-1] == 0.5
    leak = swarm.Box((1, 1, 1), openings=[swarm.Box((2.0, 2.0, 0.1), center=(0, 0, 1))])
    away = swarm.Scene([leak, scene.surfaces[1]])
    assert run(away, thrown([(0, 0, 0.9)], [(0, 0, 1.0)]), until=1.0, frames=1).escape_time[0] == pytest.approx(0.1)
    with pytest.raises(swarm.SceneError, match="particles must start inside their walls"):
        run(swarm.Scene([scene.surfaces[0], dataclasses.replace(scene.surfaces[1], present=[(0.0, 1.0)])]), start)


SHUTTERS = {
    "a ball": swarm.Sphere(0.3, side="outside", present=[(0.0, 0.45)]),
    "balls": swarm.Spheres([(0.0, 0.0, 0.0), (0.4, 0.4, 0.4)], [0.3, 0.1], present=[(0.0, 0.45)]),
    "a torus": swarm.Torus(0.3, 0.1, side="outside", present=[(0.0, 0.45)]),
    "a block that swings": swarm.Box(
        (0.2, 0.5, 0.3), side="outside", present=[(0.0, 0.45)], motion=swarm.Oscillation((0.1, 0.0, 0.0), 1.0)
    ),
    "a ball that drifts": swarm.Sphere(
        0.3, side="outside", present=[(0.0, 0.45)], motion=swarm.Translation((0.1, 0.0, 0.0))
    ),
    "balls that turn": swarm.Spheres(
        [(0.3, 0.0, 0.0), (-0.3, 0.0, 0.0)], [0.2, 0.1], present=[(0.0, 0.45)],
        motion=swarm.Rotation((0, 0, 1), 1.0, (0, 0, 0)),
    ),
    "a formula": swarm.Formula(
        "x**2 + 2*y**2 + z**2 - 0.09", side="outside", bounds=((-0.4,) * 3, (0.4,) * 3), present=[(0.0, 0.45)]
    ),
    "a prism in which they are": swarm.Prism([(-0.5, -0.4), (0.5, -0.4), (0.0, 0.5)], 0.8, present=[(0.0, 0.45)]),
    "a pillar": swarm.Polygon([(-0.2, -0.2), (0.2, -0.2), (0, 0.3)], side="outside", present=[(0.0, 0.45)]),
    "many sides": swarm.Polygon(
        [(0.5 * np.cos(a), 0.4 * np.sin(a)) for a in np.linspace(0.0, 6.1, 26)], present=[(0.0, 0.45)]
    ),
    "a mesh": swarm.Mesh(
        [(-0.5, -0.5, -0.5), (0.5, -0.5, -0.5), (-0.5, 0.5, -0.5), (-0.5, -0.5, 0.5)],
        [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)], present=[(0.0, 0.45)],
    ),
    "a union": swarm.Union([swarm.Sphere(0.4), swarm.Cylinder(0.2, length=1.1)], present=[(0.0, 0.45)]),
}  # fmt: skip


@pytest.mark.parametrize("gravity", [None, DOWN])
@pytest.mark.parametrize("name", SHUTTERS)
def test_until_a_wall_goes_all_is_as_with_it_and_then_as_without(name, gravity):
    wall, room = SHUTTERS[name], swarm.Box((0.6, 0.6, 0.6))
    scene = swarm.Scene([room, wall], gravity)
    start = swarm.fill(scene, 40, speed=1.0, seed=4)
    found = run(scene, start, until=1.0, frames=1)
    lasting = swarm.Scene([room, dataclasses.replace(wall, present=None)], gravity)
    before = run(lasting, start, until=0.45, frames=1)
    moved = swarm.Particles(before.particles.position, before.particles.velocity)
    after = run(swarm.Scene([room], gravity), moved, until=1.0 - 0.45, frames=1)
    assert found.particles.position == pytest.approx(after.particles.position, abs=1e-11)
    assert (found.impacts_per_particle == before.impacts_per_particle + after.impacts_per_particle).all()
    pushed = found.observables["impulse"][-1, 1]
    assert before.observables["impulse"][-1, 1] == pytest.approx(pushed, rel=1e-9)
    assert pushed > 0.0
    # No particle is outside of a wall that left.
    assert found.observables["max_penetration"].max() < 1e-15


@pytest.mark.parametrize("gravity", [None, DOWN])
@pytest.mark.parametrize("law", [{}, {"restitution": 0.5, "friction": 0.3}])
def test_a_foam_that_goes_lets_all_fly(gravity, law):
    """It is alone in its scene, so they fly freely; and it comes back only where no particle is."""
    foam = swarm.Spheres([(0.0, 0.0, 0.0), (0.7, 0.0, 0.0)], [0.5, 0.4], side="inside", **law)
    start = swarm.fill(swarm.Scene([foam], gravity), 20, speed=0.5, seed=1)

    def gone(*times):
        return run(swarm.Scene([dataclasses.replace(foam, present=times)], gravity), start, until=2.0, frames=4)

    found, before = gone((0.0, 1.0)), run(swarm.Scene([foam], gravity), start, until=1.0, frames=2).particles
    fall = np.zeros((3, 1)) if gravity is None else np.array(gravity)[:, None]
    assert found.particles.position == pytest.approx(before.position + before.velocity + 0.5 * fall, abs=1e-13)
    assert found.observables["impacts"][2:].tolist() == [found.observables["impacts"][2]] * 3
    assert found.observables["max_penetration"].max() < 1e-15
    with pytest.raises(swarm.RunError, match=r"surfaces\[0\] \(Spheres\) must come where no particle is: at 1\.9 s"):
        gone((0.0, 0.5), (1.9, 3.0))


def test_where_a_scene_repeats_a_wall_goes_in_every_cell():
    ball = swarm.Sphere(0.3, center=(0.0, 0.5, 0.5), side="outside", present=[(0.0, 0.5)])
    scene = swarm.Scene([ball], period=(1.0, 1.0, 1.0))
    start = thrown([(0.5, 0.5, 0.5)], [(1.0, 0.0, 0.0)])
    found = run(scene, start, until=2.5, frames=5)
    # Once against the image, at 0.7 m, and back through the place of the ball.
    assert found.impacts_per_particle.tolist() == [1]
    assert scene.unwrapped(found.particles)[0, 0] == pytest.approx(0.7 - 2.3, rel=1e-12)


# --- Bits ------------------------------------------------------------------------------------------------


def busy(gravity=(0.2, 0.1, -1.0)):
    """A vessel with a valve and a shutter in it, in which particles slide."""
    hatch = swarm.Opening(swarm.Sphere(0.2, center=(0.3, 0.0, -0.5)), [(0.25, 0.5), (1.0, math.inf)])
    room = swarm.Box((0.6, 0.5, 0.5), restitution=0.6, friction=0.02, openings=[hatch])
    shutter = swarm.Plane((-1.0, 0.0, -2.0), 0.0, restitution=0.7, present=[(0.0, 0.75)])
    return swarm.Scene([room, shutter], gravity)


@pytest.mark.parametrize("gravity", [None, (0.2, 0.1, -1.0)])
def test_the_same_bits_where_frames_are_at_other_times(gravity):
    scene = busy(gravity)
    start = swarm.fill(scene, 60, speed=0.5, seed=1)
    # It changes at 0.25, 0.5, 0.75 and 1 s: frames at these cut flights where they are cut anyway.
    one, two, four = (run(scene, start, until=1.0, frames=frames) for frames in (1, 2, 4))
    assert bits_at_the_end(one) == bits_at_the_end(two) == bits_at_the_end(four)
    # Others cut them elsewhere, to round-off.
    three = run(scene, start, until=1.0, frames=3)
    assert (np.isnan(three.escape_time) == np.isnan(one.escape_time)).all()
    assert one.particles.position == pytest.approx(three.particles.position, abs=1e-7)
    assert run(scene, start, until=3.0, frames=1).observables["escaped"][-1] > 0


def bits_at_the_end(found):
    arrays = found.particles.position, found.particles.velocity, found.escape_time, found.impacts_per_particle
    return [array.tobytes() for array in arrays]


@pytest.mark.level3
@pytest.mark.physics
def test_the_same_bits_compiled_and_for_threads_and_blocks():
    scene = busy()
    start = swarm.fill(scene, 600, speed=0.5, seed=1)
    expected = run(scene, start, until=3.0, frames=4)
    assert expected.observables["escaped"][-1] > 50
    assert expected.observables["sliding"].max() > 10
    for options in ({"threads": 2, "compile": "always"}, {"threads": 2, "block_size": 256, "compile": "always"}):
        assert bits(run(scene, start, until=3.0, frames=4, **options)) == bits(expected)


@pytest.mark.physics
@pytest.mark.parametrize("gravity", [None, rarely((0.2, 0.1, -1.0))])
def test_halts_and_sessions_leave_the_bits(tmp_path, gravity):
    require_resumed_is_whole(tmp_path, busy(gravity), swarm.Impact(), n=100, every=3.0, kind=DoorRun)


def test_a_log_has_impacts_and_escapes_at_their_times(tmp_path):
    scene, path = busy(), tmp_path / "impacts.h5"
    found = run(scene, swarm.fill(scene, 40, speed=0.5, seed=1), until=1.5, frames=2, impacts=path)
    table = swarm.load_impacts(path).table()
    assert (table["time"] <= 1.5).all()
    struck = table[table["surface"] == 1]
    assert struck["time"].max() <= 0.75
    assert len(struck) > 10
    for i in np.flatnonzero(~np.isnan(found.escape_time)):
        assert found.escape_time[i] in table["time"][table["particle"] == i]
    for i in range(40):
        assert (np.diff(table["time"][table["particle"] == i]) >= 0.0).all()


# --- Files and pictures ----------------------------------------------------------------------------------

TEXT = """
gravity = [0.0, 0.0, -1.0]
[particles]
count = 10
speed = 1.0
[[surface]]
kind = "box"
half_widths = [1.0, 1.0, 1.0]
[[surface.openings]]
kind = "sphere"
radius = 0.2
center = [0.0, 0.0, 1.0]
times = [[0.0, 0.5], [1.0, inf]]
[[surface]]
kind = "plane"
normal = [0.0, 0.0, -1.0]
offset = 0.0
present = [[0, 0.8]]
[method]
kind = "impact"
[run]
until = 1.0
every = 0.5
"""


def test_a_scene_file_says_when(tmp_path):
    path = tmp_path / "doors.toml"
    path.write_text(TEXT)
    job = scene_file.read(path)
    assert job.scene.surfaces[0].openings[0].times == ((0.0, 0.5), (1.0, math.inf))
    assert job.scene.surfaces[1].present == ((0.0, 0.8),)
    table = scene_table(job.scene)
    assert scene_of(table["surface"], table["gravity"]) == job.scene
    assert eval(repr(job.scene), {**vars(swarm), **{n: getattr(swarm, n) for n in swarm.__all__}, "inf": math.inf}) == (
        job.scene
    )
    run(job.scene, job.start(), until=1.0, frames=2, trajectory=tmp_path / "run.h5")
    with swarm.load(tmp_path / "run.h5") as trajectory:
        assert trajectory.scene == job.scene
    for bad, sentence in (
        (
            "times = [[0.5, 0.1]]",
            r"surface\[0\].openings\[0\].times\[0\] must be from a time of 0 s or more to a later",
        ),
        ("times = 3", r"surface\[0\].openings\[0\].times must be a list of pairs"),
        ("present = [[1.0, 2.0], [0.0, 0.5]]", r"surface\[1\].*present.*"),
    ):
        key = bad.partition(" ")[0]
        lines = [bad if line.startswith(key) else line for line in TEXT.splitlines()]
        path.write_text("\n".join(lines))
        with pytest.raises(swarm.SceneError, match=sentence):
            scene_file.read(path)


def test_pictures_draw_what_is_there():
    scene = swarm.Scene(
        [
            swarm.Box((1, 1, 1), openings=[swarm.Opening(swarm.Box((2, 2, 0.1), center=(0, 0, 1)), [(1.0, 2.0)])]),
            swarm.Sphere(0.3, side="outside", present=[(0.5, 1.5)]),
            swarm.Spheres([(0.7, 0.7, 0.7)], [0.1], present=[(0.5, 1.5)]),
        ]
    )
    areas = [[shape.area() for shape in shapes_of(scene, np.zeros((3, 1)), time)] for time in (0.0, 0.7, 1.2, 1.7, 2.0)]
    assert [area[0] for area in areas] == pytest.approx([24.0, 24.0, 20.0, 20.0, 24.0], rel=0.05)
    for k, area in ((1, 4.0 * math.pi * 0.09), (2, 4.0 * math.pi * 0.01)):
        assert [one[k] for one in areas] == pytest.approx([0.0, area, area, 0.0, 0.0], rel=0.1)


@pytest.mark.parametrize("motion", [None, swarm.Oscillation((0.1, 0.0, 0.0), 1.0)])
def test_a_film_draws_what_is_there(tmp_path, motion):
    ball = swarm.Sphere(0.3, side="outside", present=[(0.5, 1.0)], motion=motion)
    scene = swarm.Scene([swarm.Sphere(0.9), ball])
    start = thrown([(0, 0, 0.8)], [(0, 0, 0)])
    run(scene, start, until=1.5, frames=3, trajectory=tmp_path / "run.h5")
    with swarm.load(tmp_path / "run.h5") as trajectory:
        film = _Film(trajectory, [0, 1, 2, 3], (320, 240), 10)
        counts = [[len(shape.wires) for shape in film._walls_at(k)] for k in range(4)]
        assert [one[1] > 0 for one in counts] == [False, True, False, False]
        assert all(one[0] > 0 for one in counts)
        assert trajectory.animate(tmp_path / "run.gif", size=(160, 120)).stat().st_size > 0


# --- What is refused -------------------------------------------------------------------------------------

TIMES = {
    r" must be a list of pairs \(t0, t1\) of seconds, got 3": 3,
    r" must be a list of pairs \(t0, t1\) of seconds, got 'now'": "now",
    r" must be a list of pairs \(t0, t1\) of seconds, got none; leave": [],
    r"\[0\] must be a pair \(t0, t1\) of seconds, got \(1.0,\)": [(1.0,)],
    r"\[0\] must be a pair \(t0, t1\) of seconds, got 2.5": [2.5],
    r"\[0\] must be a pair \(t0, t1\) of seconds, got \('a', 1\)": [("a", 1)],
    r"\[0\] must be from a time of 0 s or more to a later one, got \(1, 1\)": [(1.0, 1.0)],
    r"\[0\] must be from a time of 0 s or more to a later one, got \(2, 1\)": [(2.0, 1.0)],
    r"\[0\] must be from a time of 0 s or more to a later one, got \(-1, 1\)": [(-1.0, 1.0)],
    r"\[1\] must be from a time of 0 s or more to a later one, got \(inf, inf\)": [(0.0, 1.0), (math.inf, math.inf)],
    r"\[0\] must be from a time of 0 s or more to a later one, got \(nan, 1\)": [(math.nan, 1.0)],
    r"\[0\] must be from a time of 0 s or more to a later one, got \(0, nan\)": [(0.0, math.nan)],
    r" must ascend, each pair after the one before it, got \(1.0, 2.0\) and then \(0.0, 0.5\)": [
        (1.0, 2.0),
        (0.0, 0.5),
    ],
    r" must ascend, each pair after the one before it, got \(0.0, 2.0\) and then \(1.0, 3.0\)": [
        (0.0, 2.0),
        (1.0, 3.0),
    ],
    r" must ascend, each pair after the one before it, got \(0.0, inf\) and": [(0.0, math.inf), (1.0, 3.0)],
}


@pytest.mark.parametrize("message", TIMES)
def test_bad_times(message):
    with pytest.raises(swarm.SceneError, match="times" + message):
        swarm.Opening(HOLE, TIMES[message])
    with pytest.raises(swarm.SceneError, match="present" + message):
        swarm.Sphere(0.5, present=TIMES[message])


def test_what_is_no_opening_is_refused():
    always = [(0.0, 1.0)]
    with pytest.raises(
        swarm.SceneError, match=r"openings\[0\].present must be left out, an opening is no wall.*Opening"
    ):
        swarm.Sphere(0.5, openings=[dataclasses.replace(HOLE, present=always)])
    with pytest.raises(swarm.SceneError, match=r"openings\[0\].present must be left out"):
        swarm.Sphere(0.5, openings=[swarm.Opening(dataclasses.replace(HOLE, present=always), always)])
    with pytest.raises(swarm.SceneError, match=r"openings\[0\] must be a surface such as swarm.Sphere, got 3"):
        swarm.Sphere(0.5, openings=[swarm.Opening(3, always)])
    with pytest.raises(swarm.SceneError, match="openings must be a list of surfaces"):
        swarm.Sphere(0.5, openings=swarm.Opening(HOLE, always))
    with pytest.raises(swarm.SceneError, match="openings must be of a wall at rest"):
        swarm.Sphere(0.5, openings=[swarm.Opening(HOLE, always)], motion=swarm.Translation((1.0, 0.0, 0.0)))


@pytest.mark.parametrize("name", ["Verlet", "Midpoint", "Trapezoidal"])
def test_methods_that_know_no_doors(name):
    scene = swarm.Scene([swarm.Sphere(0.5, present=[(0.0, 1.0)])])
    with pytest.raises(swarm.SceneError, match=rf"surfaces\[0\].present must be None with {name}"):
        run(scene, swarm.fill(scene, 2, speed=1.0, seed=1), method=getattr(swarm, name)(dt=0.01, penalty=1e4))


@pytest.mark.parametrize("scene", [valve((0.0, 1.0)), shelf((0.0, 1.0))])
def test_contact_steps_know_no_doors(scene):
    with pytest.raises(swarm.SceneError, match="contact_step must be 0 where a wall is present"):
        run(scene, swarm.fill(scene, 2, speed=1.0, seed=1), method=swarm.Impact(contact_step=0.01))


def test_a_vessel_that_goes_beside_a_wall_with_a_mass():
    vessel = swarm.Sphere(0.5, present=[(0.0, 1.0)])
    scene = swarm.Scene([vessel, swarm.Sphere(0.1, side="outside", mass=1.0)])
    result = run(scene, swarm.fill(scene, 2, speed=1.0, seed=1), until=4.0)
    assert np.sqrt((result.particles.position**2).sum(axis=0)).min() > 1.0
    assert result.observables["impacts"][-1] > 0
    assert result.observables["energy_error"].max() < 1e-13
    with pytest.raises(swarm.SceneError, match=r"cavities\[0\]\[0\] must have no motion, mass, .* always be present"):
        swarm.Body([(0, 0, 0), (0, 0, 0.1)], [1.0, 1.0], cavities=[(vessel, 0, 1)])


def test_what_rests_is_not_woken_for_nothing(monkeypatch):
    """A wall that goes elsewhere leaves what rests alone."""
    lid = swarm.Plane((0.0, 0.0, 1.0), 0.9, present=[(0.0, 0.5)])
    scene = swarm.Scene([swarm.Box((1, 1, 1), restitution=0.5), lid], gravity=DOWN)
    seen = []
    switch = DoorRun._switch

    def watched(self, instant):
        switch(self, instant)
        seen.append((instant, self.state.contacts.phase.tolist()))

    monkeypatch.setattr(DoorRun, "_switch", watched)
    run(scene, thrown([(0, 0, -1)], [(0, 0, 0)]), until=1.0, frames=1)
    assert seen[-1] == (0.5, [ARRIVED])


@pytest.mark.parametrize("kind", ["balls", "heavy", "grains"])
def test_a_door_between_rooms_is_none_for_balls_in_one_room(kind, tmp_path):
    method = swarm.Penalty(dt=1e-3, penalty=1e5) if kind == "grains" else swarm.Impact()
    ends = []
    for between in (True, False):
        door = swarm.Opening(swarm.Plane((-1.0, 0.0, 0.0), 0.0), between=between)
        vessel = swarm.Sphere(0.5, openings=[door], mass=5.0 if kind == "heavy" else None)
        ball = swarm.Particles((0.0, 0.0, 0.0), (1.0, 0.2, 0.0), radius=0.05)
        done = swarm.simulate(
            swarm.Scene([vessel]), ball, method, until=1.0, every=1.0, compile="never", progress=False,
            trajectory=tmp_path / f"{between}.h5",
        )  # fmt: skip
        ends.append(done.particles.position[0, 0])
        if between:
            assert done.observables["impacts"][-1] > 0
    # It comes back from the wall, where an opening has let it out.
    assert ends[0] < 0.3 < 0.4 < ends[1]
