"""Balls in files, exports, pictures and recordings: as large as they are, with their collisions."""

import h5py
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

import swarm
from swarm.commands.summary import numbers
from swarm.common.snapshot import Snapshot
from swarm.files.background import Background
from swarm.files.layout import COLLISIONS, RADII
from swarm.files.storage import Storage
from swarm.files.writer import TrajectoryWriter
from swarm.pictures import drawing, framed, style
from swarm.pictures.balls import Discs
from swarm.pictures.drawn import Drawn
from swarm.pictures.raster import Raster
from swarm.recording.playback import Playback
from swarm.state import Balls as BallsOfState
from swarm.state import State
from swarm.triangles.shapes import shapes_of
from swarm.words import facts

N = 8
RADIUS = np.linspace(0.05, 0.12, N)
PAIRS = swarm.Pairs(restitution=0.9)
SCENES = {
    "box": swarm.Scene([swarm.Box((0.5, 0.4, 0.3))], pairs=PAIRS),
    "table": swarm.Scene([swarm.Box((0.5, 0.4, 0.3))], plane="z", pairs=PAIRS),
}


@pytest.fixture(scope="module", params=SCENES)
def run(request, tmp_path_factory):
    """A run of balls of different sizes, which its trajectory and its recording keep."""
    folder, scene = tmp_path_factory.mktemp("balls"), SCENES[request.param]
    start = swarm.fill(scene, N, speed=1.0, radius=RADIUS, seed=4)
    return swarm.simulate(
        scene, start, swarm.Impact(), until=0.8, every=0.2, trajectory=folder / "run.h5",
        recording=folder / "run.rrd", compile="never",
    )  # fmt: skip


def test_a_result_has_what_balls_have(run):
    assert run.particles.radius.tolist() == RADIUS.tolist()
    assert run.collisions_per_particle.sum() == 2 * run.observables["collisions"][-1] > 0
    assert f"{run.observables['collisions'][-1]} collisions" in repr(run)
    assert "collision_rate" in run.table()


def test_a_trajectory_keeps_them(run):
    with swarm.load(run.trajectory) as trajectory:
        frames = [trajectory.frame(k) for k in range(len(trajectory))]
        assert all(frame.radius.tolist() == RADIUS.tolist() for frame in frames)
        assert all(frame.spin is None for frame in frames)
        assert frames[0].volume == run.particles.volume
        assert trajectory.radius.tolist() == RADIUS.tolist()
        assert trajectory.collisions(0).tolist() == [0] * N
        assert trajectory.collisions(-1).tolist() == run.collisions_per_particle.tolist()
        assert trajectory.scene.pairs == PAIRS
        seen = trajectory.observables
        assert np.isnan(seen["pressure"][0])
        assert np.isnan(seen["collision_rate"][0])
        assert (seen["pressure"][1:] > 0.0).all()
        data = trajectory.to_xarray()
        assert data.collisions_per_particle.values[-1].tolist() == run.collisions_per_particle.tolist()
        assert data.radius.values.tolist() == RADIUS.tolist()
        assert data.pressure.attrs["units"] == "Pa"
    with h5py.File(run.trajectory) as file:
        assert file[f"particles/all/{RADII}"].shape == (N,)
        assert file[f"particles/all/{COLLISIONS}/value"].dtype == np.int64
    last = run.frames[-1]
    assert last.radius.tolist() == RADIUS.tolist()
    assert last.collisions.tolist() == run.collisions_per_particle.tolist()
    assert last.spin is None


def test_a_run_begins_where_one_has_ended(run, tmp_path):
    scene = run.scene
    with swarm.load(run.trajectory) as trajectory:
        half = trajectory.frame(2)
    again = swarm.simulate(scene, half, swarm.Impact(), until=0.4, compile="never")
    assert again.particles.radius.tolist() == RADIUS.tolist()
    assert again.particles.position == pytest.approx(run.particles.position, abs=1e-9)


def test_frames_during_a_run_have_them():
    rows = []
    scene = SCENES["box"]
    start = swarm.fill(scene, N, speed=1.0, radius=RADIUS, seed=4)
    swarm.simulate(
        scene, start, swarm.Impact(), until=0.2, compile="never",
        progress=lambda frame: rows.append((frame.radius.tolist(), int(frame.collisions.sum()), frame.spin)),
        observables={"wide": lambda frame: float(frame.radius.sum())},
    )  # fmt: skip
    assert [radius for radius, _count, _spin in rows] == [RADIUS.tolist()] * 2
    assert rows[0][1:] == (0, None)


def test_points_have_none_of_it(tmp_path):
    scene = swarm.Scene([swarm.Sphere(1.0)])
    points = swarm.fill(scene, 3, speed=1.0)
    run = swarm.simulate(scene, points, swarm.Impact(), until=0.1, compile="never", trajectory=tmp_path / "run.h5")
    assert run.collisions_per_particle is None
    assert run.frames[0].radius is run.frames[0].collisions is run.frames[0].spin is None
    assert not {"collisions", "pressure"} & set(run.observables)
    with h5py.File(run.trajectory) as file:
        assert not {"radius", "collisions", "spin"} & set(file["particles/all"])
        assert "volume" not in file["parameters"]
    with swarm.load(run.trajectory) as trajectory, pytest.raises(swarm.SceneError, match="keeps no collisions: its"):
        trajectory.collisions(0)


# --- Spins, from a state that is made by hand ---


@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_spins_and_some_particles_only(precision, tmp_path):
    start = swarm.Particles(np.zeros((3, N)), np.ones((3, N)), radius=RADIUS, spin=np.zeros((3, N)))
    nothing, counts = np.zeros(N), np.arange(N)
    spin = np.arange(3.0 * N).reshape(3, N)
    state = State(start.position, start.velocity, start.mass, nothing, nothing, counts, nothing, nothing, None,
                  balls=BallsOfState(RADIUS, 2 * counts, np.zeros(1), spin))  # fmt: skip
    storage = Storage(frames=3, precision=precision)
    writer = TrajectoryWriter(tmp_path / "run.h5", storage, SCENES["box"], swarm.Impact(), start, None, {})
    with Background(writer, N, storage.kept()) as write:
        for k in range(2):
            write(k, float(k), state, {"time": float(k), "impacts": k})
            spin += 1.0
    with swarm.load(tmp_path / "run.h5") as trajectory:
        found = trajectory.frame(1)
        assert found.spin.tolist() == (spin - 1.0)[:, ::3].tolist()
        assert found.radius.tolist() == RADIUS[::3].tolist()
        assert trajectory.collisions(1).tolist() == [0, 6, 12]
        assert trajectory.to_xarray().spin.attrs["units"] == "rad s-1"


def test_the_digest_of_a_start_has_radii(tmp_path):
    from swarm.files.checkpoint import digest_of

    one = swarm.Particles(np.zeros((3, 2)), np.zeros((3, 2)), radius=0.1)
    assert digest_of(one) != digest_of(swarm.Particles(one.position, one.velocity, radius=0.2))
    assert digest_of(one) != digest_of(swarm.Particles(one.position, one.velocity))


def test_a_snapshot_of_points_has_no_radius():
    assert Snapshot({"mass": np.ones(2)}.get).read("radius", "frame 0") is None


# --- Exports ---


def test_exports_have_the_radii(run, tmp_path):
    with swarm.load(run.trajectory) as trajectory:
        text = trajectory.export(tmp_path / "run.xyz", frames=-1, particles=3)[0].read_text().splitlines()
        trajectory.export(tmp_path / "run.vtkhdf", surfaces=False)
        trajectory.export(tmp_path / "run.gsd", particles=2)
    assert text[1].split()[3].endswith(":collisions:I:1:radius:R:1")
    assert [float(line.split()[-1]) for line in text[2:]] == RADIUS[::3].tolist()
    with h5py.File(tmp_path / "run.vtkhdf") as file:
        points = file["VTKHDF/PointData"]
        assert points["radius"][:].tolist() == RADIUS.tolist()
        assert points["collisions"][-N:].tolist() == run.collisions_per_particle.tolist()
        assert file["VTKHDF/Steps/PointDataOffsets/radius"][:].tolist() == [0] * 5
    import gsd.hoomd

    with gsd.hoomd.open(str(tmp_path / "run.gsd")) as file:
        assert file[0].particles.diameter == pytest.approx(2.0 * RADIUS[::2], rel=1e-6)


# --- Texts ---


def test_texts_say_how_large_and_how_full(run):
    with swarm.load(run.trajectory) as trajectory:
        statements = facts.of_trajectory(trajectory)
        assert statements["impacts of two"].startswith("restitution 0.9, ")
        assert "Pairs(" in trajectory.scene._repr_html_()
    assert (
        " of 50 to 120 mm radius" in statements["what runs"] or " of 0.05 to 0.12 m radius" in statements["what runs"]
    )
    unit = "m³" if run.scene.plane is None else "m²"
    volume = 0.48 if run.scene.plane is None else 0.8
    filled = 4.0 / 3.0 * np.pi * (RADIUS**3).sum() if run.scene.plane is None else np.pi * (RADIUS**2).sum()
    assert statements["packing"] == f"{100.0 * filled / volume:.4g} % of {volume:.4g} {unit}"
    assert statements["collisions"] == str(run.observables["collisions"][-1])
    assert numbers(run.trajectory)["collisions"] == run.observables["collisions"][-1]
    assert "radius" in run.particles._repr_html_()


# --- Pictures ---


def test_discs_and_balls_are_as_large_as_they_are(run):
    figure = run.plot(figsize=(12.0, 6.0))
    if run.scene.plane is not None:
        (drawn,) = (one for axes in figure.axes for one in axes.collections if isinstance(one, Discs))
        assert drawn.get_widths().tolist() == (2.0 * RADIUS).tolist()
        return
    raster = Raster(np.array([-1.0, -1.0]), np.array([1.0, 1.0]), 400.0)
    raster.balls(np.array([[0.1, 0.2, 0.3], [-0.5, 0.0, 0.0]]), np.array([0.25, 0.1]), np.zeros((2, 3)))
    there = np.isfinite(raster.depth)
    assert there.sum() / 400.0**2 == pytest.approx(np.pi * (0.25**2 + 0.1**2), rel=3e-3)
    assert raster.depth.max() == pytest.approx(0.3 + 0.25, abs=1e-4)


def test_a_near_ball_hides_a_far_one():
    figure = style.picture(4.0, 4.0)
    axes = figure.add_subplot()
    room = shapes_of(swarm.Scene([swarm.Sphere(1.0)]), np.zeros((3, 1)))
    eye = framed.eye_of(room, [room[0].vertices]).near
    points, radius = np.array([0.5 * eye, -0.5 * eye]), np.array([0.2, 0.2])
    colours = np.array([0xFF0000FF, 0x0000FFFF], np.uint32)
    drawing.frame(axes, points, colours, room, radius=radius)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    seen = np.asarray(canvas.buffer_rgba())[..., :3].astype(int)
    reds = (seen[..., 0] > seen[..., 2] + 60).sum()
    blues = (seen[..., 2] > seen[..., 0] + 60).sum()
    assert reds > 1000
    assert blues < 0.05 * reds


def test_a_recording_has_the_radii(run):
    playback = Playback(run.trajectory.with_suffix(".rrd"))
    assert playback.radius == pytest.approx(RADIUS, rel=1e-6)
    assert {"/impacts/collisions", "/pressure/virial", "/energy/dissipated"} <= set(playback.series)


def test_some_of_them_are_shown():
    assert Drawn(N, None, 4, RADIUS).radius.tolist() == RADIUS[::2].tolist()
    assert Drawn(N, None, 4).radius is None


def test_a_film_shows_them(run, tmp_path):
    with swarm.load(run.trajectory) as trajectory:
        film = trajectory.animate(tmp_path / "run.gif", frames=2, size=(320, 240))
    assert film.stat().st_size > 1000
