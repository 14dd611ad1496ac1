"""A cell that repeats: which images its surfaces have, what goes with it, and what is written of it."""

import h5py
import numpy as np
import pytest

import swarm
from swarm import scene_file
from swarm.commands import summary
from swarm.surfaces.periodic.images import images_of

BALL = swarm.Sphere(0.1, (0.5, 0.5, 0.5), side="outside")
FLOOR, CEILING = swarm.Plane((0.0, 0.0, -1.0), 0.0), swarm.Plane((0.0, 0.0, 1.0), 1.0)
CELL = (1.0, 1.0, 1.0)


def centers_of(surface, period=CELL):
    return sorted(tuple(np.round(image.center, 12).tolist()) for image in images_of(surface, period, "surfaces[0]"))


# --- Images ----------------------------------------------------------------------------------------------


def test_what_is_within_the_cell_has_no_image():
    assert centers_of(BALL) == [(0.5, 0.5, 0.5)]
    assert swarm.Scene([BALL], period=CELL).compiled().numbering.surfaces_of_rows == [0]


def test_what_reaches_over_faces_is_on_their_other_sides_too():
    assert centers_of(swarm.Sphere(0.1, (0.05, 0.5, 0.5), "outside")) == [(0.05, 0.5, 0.5), (1.05, 0.5, 0.5)]
    assert len(centers_of(swarm.Sphere(0.1, (0.05, 0.95, 0.5), "outside"))) == 4
    assert len(centers_of(swarm.Sphere(0.1, (0.0, 0.0, 0.0), "outside"))) == 8
    # Not where the cell does not repeat.
    assert len(centers_of(swarm.Sphere(0.1, (0.0, 0.0, 0.0), "outside"), (1.0, None, 1.0))) == 4


def test_what_touches_a_face_has_an_image():
    assert len(centers_of(swarm.Sphere(0.1, (0.1, 0.5, 0.5), "outside"))) == 2


def test_what_is_outside_the_cell_is_there_as_its_image():
    assert centers_of(swarm.Sphere(0.1, (3.5, -0.5, 0.5), "outside")) == [(0.5, 0.5, 0.5)]


@pytest.mark.parametrize(
    "surface",
    [
        swarm.Plane((0.0, 1.0, 2.0), 0.7),
        swarm.Cylinder(0.4, (1.0, 0.0, 0.0), center=(0.0, 0.5, 0.5)),
        swarm.Box((0.3, 0.4, 0.4), (0.5, 0.5, 0.5), open=["-x", "+x"]),
        swarm.Formula("y**2/0.04 + z**2/0.09 - 1", bounds=None, center=(0.0, 0.0, 0.0), curvature=60.0),
    ],
    ids=["plane", "pipe", "channel", "formula"],
)
def test_what_is_the_same_all_along_needs_none(surface):
    assert images_of(surface, (0.25, None, None), "surfaces[0]") == [surface]


def test_an_endless_rod_has_images_across_its_axis_only():
    rod = swarm.Cylinder(0.1, (1.0, 0.0, 0.0), center=(0.0, 0.0, 0.5), side="outside")
    assert centers_of(rod) == [(0.0, 0.0, 0.5), (0.0, 1.0, 0.5)]


def test_gaps_are_those_of_the_nearest_image():
    scene = swarm.Scene([swarm.Sphere(0.1, (0.0, 0.0, 0.0), "outside")], period=CELL)
    points = np.array([[0.05, 0.95, 0.5, 7.95], [0.0, 0.0, 0.5, -3.0], [0.0, 1.0, 0.5, 2.0]])
    np.testing.assert_allclose(scene.gaps(points)[0], [0.05, 0.05, 0.1 - np.sqrt(0.75), 0.05], atol=1e-14)
    np.testing.assert_allclose(scene.distances_outside(points)[0], scene.gaps(points)[0], atol=1e-14)


def test_the_volume_is_that_of_the_cell():
    scene = swarm.Scene([swarm.Sphere(0.3, (0.0, 0.0, 0.0), "outside")], period=CELL)
    assert scene.bounds() == ((0.0, 0.0, 0.0), CELL)
    assert not scene.is_open()
    particles = swarm.fill(scene, 1000, speed=1.0)
    assert particles.volume == pytest.approx(1.0 - 4.0 / 3.0 * np.pi * 0.3**3, rel=5e-3)
    assert (particles.image == 0).all()
    assert swarm.Scene([FLOOR], period=(1.0, 1.0, None)).is_open()
    assert not swarm.Scene([FLOOR, CEILING], period=(1.0, 1.0, None)).is_open()


# --- Bad input -------------------------------------------------------------------------------------------

ALONG = swarm.Translation((0.1, 0.0, 0.0))
TILTED = swarm.Plane((0.0, 1.0, -1.0))
CARRIED = swarm.Sphere(0.1, (0.5, 0.5, 0.5), "outside", motion=ALONG)
HEAVY = swarm.Sphere(0.1, (0.5, 0.5, 0.5), "outside", mass=1.0)
REFUSED = {
    "two lengths": ([BALL], (1.0, 1.0), r"period must be three lengths \(Lx, Ly, Lz\).*got 2"),
    "one number": ([BALL], 1.0, r"period must be three lengths, or None, got 1\.0"),
    "negative": ([BALL], (1.0, -1.0, None), r"period\[1\] must be above 0, got -1"),
    "infinite": ([BALL], (1.0, np.inf, None), r"period\[1\] must be a finite number above 0, got inf"),
    "true": ([BALL], (True, 1.0, 1.0), r"period\[0\] must be a finite number above 0, got True"),
    "too short": ([BALL], (0.15, 1.0, 1.0), r"period\[0\] must be as long as each solid.*got 0\.15.*0\.2 long"),
    "too short, of many": (
        [swarm.Spheres([[0.5, 0.5, 0.5], [0.2, 0.2, 0.2]], [0.1, 0.3])],
        (1.0, 0.5, 1.0),
        r"period\[1\] must be as long as each solid.*got 0\.5, shorter than body 1 of surfaces\[0\].*0\.6 long",
    ),
    "across a plane": ([FLOOR], CELL, r"surfaces\[0\] \(Plane\) must be bounded along z, or the same all along it"),
    "tilted plane": ([TILTED], (1.0, 1.0, None), r"surfaces\[0\] \(Plane\) must be bounded along y"),
    "cavity": ([swarm.Sphere(0.5)], CELL, r"surfaces\[0\] \(Sphere\) must be within the cell, from 0 to 1 along x"),
    "along it": ([CARRIED], CELL, r"surfaces\[0\]\.motion must leave the surface where it is along x"),
    "turntable": (
        [swarm.Plane((0.0, 0.0, -1.0), friction=0.2, motion=swarm.Rotation((0.0, 0.0, 1.0), 1.0))],
        (None, 1.0, None),
        r"surfaces\[0\]\.motion must not turn a surface that goes on over the faces of the cell along y",
    ),
    "heavy": ([HEAVY], CELL, r"surfaces\[0\]\.mass and inertia must be None"),
}


SLIDING = {
    "a belt": swarm.Plane((0.0, 0.0, -1.0), 0.0, friction=0.2, motion=swarm.Translation((0.5, 0.0, 0.0))),
    "to and fro": swarm.Plane((0, 0, -1), 0.0, friction=0.2, motion=swarm.Oscillation((0.2, 0.1, 0.0), 3.0)),
    "a path": swarm.Plane(
        (0, 0, -1), 0.0, friction=0.2, motion=swarm.Path((0, 1, 3), ((0, 0, 0), (1, 1, 0), (0, 0, 0)))
    ),
    "a rod": swarm.Cylinder(
        0.2, (1, 0, 0), center=(0.0, 0.5, 0.0), side="outside", friction=0.2, motion=swarm.Translation((0.5, 0.0, 0.0))
    ),
}


@pytest.mark.parametrize("name", SLIDING)
def test_what_slides_in_itself_along_the_period_is_what_it_is(name):
    """It is accepted, and moves particles by its friction as without a period."""
    walls = [SLIDING[name], swarm.Plane((0, 0, -1), 0.01), CEILING, swarm.Slab((0, 1, 0), 0.5, (0.0, 0.5, 0.0))]
    start = swarm.Particles([[0.3, 0.9], [0.5, 0.45], [0.5, 0.6]], [[0.4, -0.3], [0.1, 0.02], [-1.5, -1.1]])
    found, whole = (
        swarm.simulate(swarm.Scene(walls, period=period), start, swarm.Impact(), until=3.0, compile="never")
        for period in ((1.0, None, None), None)
    )
    assert found.observables["impacts"][-1] > 4
    assert abs(found.particles.velocity[0] - start.velocity[0]).min() > 0.01
    unwrapped = found.particles.position + found.particles.image * np.array([[1.0], [0.0], [0.0]])
    np.testing.assert_allclose(unwrapped, whole.particles.position, atol=1e-12)


@pytest.mark.parametrize("name", REFUSED)
def test_what_does_not_go_with_a_period(name):
    surfaces, period, sentence = REFUSED[name]
    with pytest.raises(swarm.SceneError, match=sentence):
        swarm.Scene(surfaces, period=period)


def test_what_turns_over_a_face_is_refused():
    turns = swarm.Rotation((1.0, 0.0, 0.0), 1.0, (0.0, 0.5, 0.5))
    with pytest.raises(swarm.SceneError, match=r"surfaces\[0\]\.motion must not turn a surface that reaches over"):
        swarm.Scene([swarm.Sphere(0.1, (0.0, 0.5, 0.5), "outside", motion=turns)], period=(1.0, None, None))


def test_images_count_as_walls():
    rings = [swarm.Torus(0.02 * k, 0.01, (0.0, 0.0, 0.0), "outside") for k in range(1, 5)]
    with pytest.raises(swarm.SceneError, match="at most 24 walls in all, got 32 of 4 surfaces"):
        swarm.Scene(rings, period=CELL)


def test_a_contact_step_does_not_know_it():
    scene = swarm.Scene([BALL], period=CELL)
    with pytest.raises(swarm.SceneError, match=r"period must be None with .*use Impact"):
        swarm.simulate(scene, swarm.fill(scene, 3, speed=1.0), swarm.Impact(contact_step=1e-3), until=1.0)


def test_images_need_a_period():
    particles = swarm.Particles([0.0, 0.0, 0.0], [1.0, 0.0, 0.0], image=[1, 0, 0])
    with pytest.raises(swarm.SceneError, match=r"particles\.image must be None where the scene has no period"):
        swarm.simulate(swarm.Scene([swarm.Sphere(0.5)]), particles, swarm.Impact(), until=1.0)


@pytest.mark.parametrize("image", [[1.5, 0.0, 0.0], [1, 0], [np.nan, 0.0, 0.0]])
def test_images_are_whole_numbers(image):
    with pytest.raises(swarm.SceneError, match=r"image must be whole numbers of shape \(3, 1\)"):
        swarm.Particles([0.0, 0.0, 0.0], [1.0, 0.0, 0.0], image=image)


def test_bodies_at_soft_walls_are_refused():
    scene = swarm.Scene([FLOOR, CEILING], period=(1.0, 1.0, None))
    bodies = swarm.place(scene, swarm.dumbbell(0.05, 1.0), 2)
    with pytest.raises(swarm.SceneError, match="period must be None with bodies and Penalty"):
        swarm.simulate(scene, bodies, swarm.Penalty(dt=1e-2, penalty=1e3), until=1.0)


# --- Positions -------------------------------------------------------------------------------------------


def test_positions_come_into_the_cell():
    scene = swarm.Scene([BALL], period=(1.0, 0.7, 1.0))
    below = -np.finfo(np.float64).tiny
    points = np.array([[2.25, -0.25, below, 1.0], [0.1, 0.7, -0.7, np.nextafter(0.7, 0.0)], [0.1, 0.2, 1e9, -1e-17]])
    inside, image = scene.wrapped(points)
    lengths = np.array(scene.period)[:, None]
    assert (inside >= 0.0).all()
    assert (inside < lengths).all()
    assert image[0].tolist() == [2, -1, 0, 1]
    assert image[1].tolist() == [0, 1, -1, 0]
    # To the round-off of the cell.
    np.testing.assert_allclose(inside + image * lengths, points, rtol=1e-15, atol=0.5 * np.finfo(np.float64).eps)


def test_a_run_begins_in_the_cell_and_counts_on():
    """Positions outside, and images that they have already, are the same start."""
    scene = swarm.Scene([swarm.Plane((0.0, 0.0, -1.0), 0.0)], period=(1.0, None, None))
    v = [0.3, 0.0, 1.0]
    starts = (
        swarm.Particles([2.25, 0.0, 1.0], v), swarm.Particles([0.25, 0.0, 1.0], v, image=[2, 0, 0]),
        swarm.Particles([-0.75, 0.0, 1.0], v, image=[3, 0, 0]),
    )  # fmt: skip
    for start in starts:
        end = swarm.simulate(scene, start, swarm.Impact(), until=10.0, compile="never").particles
        assert end.image.ravel().tolist() == [5, 0, 0]
        np.testing.assert_allclose(scene.unwrapped(end).ravel(), [5.25, 0.0, 11.0], rtol=1e-14)
    assert starts[0].image is None


# --- Files -----------------------------------------------------------------------------------------------

TEXT = """
gravity = [0.5, 0.0, -1.0]
period = [0.5, 0.8, false]
[particles]
count = 20
speed = 1.0
[[surface]]
kind = "plane"
normal = [0, 0, -1]
[[surface]]
kind = "plane"
normal = [0, 0, 1]
offset = 1.0
[method]
kind = "impact"
[run]
until = 4.0
every = 0.5
"""


@pytest.fixture
def job(tmp_path):
    (tmp_path / "scene.toml").write_text(TEXT)
    return scene_file.read(tmp_path / "scene.toml")


def test_a_scene_file_says_it(job):
    assert job.scene.period == (0.5, 0.8, None)


def test_a_period_below_a_table_is_an_error(tmp_path):
    (tmp_path / "scene.toml").write_text(
        TEXT.replace("period = [0.5, 0.8, false]\n", "") + "period = [1.0, 1.0, 1.0]\n"
    )
    with pytest.raises(swarm.SceneError, match=r"run\.period: unknown key.*period belongs at the top"):
        scene_file.read(tmp_path / "scene.toml")


def test_a_trajectory_keeps_images_and_the_cell(job, tmp_path):
    path = tmp_path / "run.h5"
    result = swarm.simulate(job.scene, job.start(), job.method, until=4.0, every=0.5, trajectory=path, compile="never")
    with swarm.load(path) as trajectory:
        assert trajectory.scene == job.scene
        end = trajectory.frame(-1)
        np.testing.assert_array_equal(end.image, result.particles.image)
        np.testing.assert_array_equal(end.position, result.particles.position)
        assert np.abs(end.image).max() > 3
        for k in range(len(trajectory)):
            position = trajectory.frame(k).position
            assert (position[:2] >= 0.0).all()
            assert (position[:2] < [[0.5], [0.8]]).all()
        # A run goes on from there.
        swarm.simulate(trajectory.scene, end, job.method, until=0.1, compile="never")
    assert summary.of_file(path)["period"] == "a cell that repeats after 0.5 m along x and 0.8 m along y"
    with h5py.File(path) as file:
        box = file["particles/all/box"]
        assert list(box.attrs["boundary"]) == ["periodic", "periodic", "none"]
        assert box["edges/value"][()].tolist() == [[0.5, 0.8, 1.0]] * 9
        assert box["edges/time"][()].tolist() == file["particles/all/position/time"][()].tolist()
        assert file["particles/all/image/value"].dtype == np.int64


def test_without_a_period_nothing_of_it_is_written(tmp_path):
    scene = swarm.Scene([swarm.Sphere(0.5)])
    path = tmp_path / "run.h5"
    swarm.simulate(scene, swarm.fill(scene, 2, speed=1.0), swarm.Impact(), until=1.0, trajectory=path, compile="never")
    with h5py.File(path) as file:
        assert list(file["particles/all/box"]) == []
        assert "image" not in file["particles/all"]
        assert "period" not in file["parameters/scene"].asstr()[()]
