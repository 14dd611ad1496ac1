"""What becomes of results in Python: tables, figures, films, labelled arrays, and how objects show in notebooks."""

import os
import sys
import types

import imageio_ffmpeg
import numpy as np
import pytest
from matplotlib.collections import PathCollection
from matplotlib.text import Text
from PIL import Image

import swarm
from swarm.common import columns, notebook
from swarm.errors import FileError, SceneError
from swarm.exports import labelled
from swarm.pictures import film, framed
from swarm.recording import playback, recorded, widget
from swarm.recording import writer as recording
from swarm.triangles.shapes import shapes_of

RATE, FRAMES = 1.5, 5
SCENE = swarm.Scene(
    [
        swarm.Box((0.5, 0.4, 0.3)),
        swarm.Box(
            (0.3, 0.05, 0.1), side="outside", motion=swarm.Rotation((0.0, 0.0, 1.0), RATE, (0.0, 0.0, 0.0))
        ),
        swarm.Sphere(0.05, center=(0.0, 0.3, 0.2), side="outside"),
    ]
)  # fmt: skip


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    path = tmp_path_factory.mktemp("presented") / "<run>.h5"
    start = swarm.fill(SCENE, 20, speed=0.5, seed=1)
    result = swarm.simulate(
        SCENE, start, swarm.Impact(), until=1.0, every=1.0 / (FRAMES - 1), compile="never",
        trajectory=path, impacts=path.with_suffix(".log"),
    )  # fmt: skip
    with swarm.load(path) as trajectory:
        yield result, trajectory


# --- Tables --------------------------------------------------------------------------------------------------


def test_the_table_has_a_column_for_each_number(run):
    """Three surfaces are no axes, and three axes are no surfaces."""
    result, trajectory = run
    table, seen = trajectory.table(), trajectory.observables
    assert table.columns[0] == "time"
    assert table.shape == (FRAMES, sum(np.size(values) // FRAMES for values in seen.values()))
    for name, values in {
        "momentum_z": seen["momentum"][:, 2],
        "impulse_2": seen["impulse"][:, 2],
        "wall_position_1_y": seen["wall_position"][:, 1, 1],
        "wall_orientation_1_z": seen["wall_orientation"][:, 1, 3],
        "impacts": seen["impacts"],
    }.items():
        np.testing.assert_array_equal(table[name], values)
    assert table["impacts"].dtype == np.int64
    assert result.table().equals(table)


def test_a_table_without_pandas_is_a_sentence(run, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(SceneError, match=r"a table needs the package 'pandas'.*pip install pandas"):
        run[0].table()


def test_quaternions_and_cavities():
    named = columns.flattened({"cavity_impulse": np.zeros((1, 2)), "wall_orientation": np.zeros((1, 1, 4))})
    assert list(named) == ["cavity_impulse_0", "cavity_impulse_1", *(f"wall_orientation_0_{part}" for part in "wxyz")]


# --- Figures -------------------------------------------------------------------------------------------------


def curve(figure, title, label):
    (cell,) = (axes for axes in figure.axes if axes.get_ylabel() == title)
    return next(line for line in cell.lines if line.get_label() == label).get_ydata()


def test_a_figure_shows_the_run_and_can_be_changed(run, tmp_path):
    result, trajectory = run
    for figure in (trajectory.plot(), result.plot(figsize=(8.0, 5.0))):
        np.testing.assert_array_equal(
            curve(figure, "energy [J]", "total, all kinetic"), result.observables["kinetic_energy"]
        )
        assert figure.get_suptitle() == "20 particles in a box with a block that turns and a ball in it: Impact, 1 s"
        figure.axes[0].set_title("changed")
        figure.savefig(tmp_path / "figure.svg")
        assert "changed" in (tmp_path / "figure.svg").read_text()
    assert tuple(figure.get_size_inches()) == (8.0, 5.0)


def test_a_figure_of_a_result_without_a_trajectory():
    """With all particles at the end; one speed is no histogram."""
    cavity = swarm.Scene([swarm.Sphere(0.5)])
    start = swarm.Particles([0.0, 0.0, 0.0], [1.0, 0.0, 0.0])
    result = swarm.simulate(cavity, start, swarm.Impact(), until=1.0, compile="never")
    figure = result.plot()
    dots = next(one for axes in figure.axes for one in axes.collections if isinstance(one, PathCollection))
    shapes = shapes_of(cavity, result.particles.position)
    eye = framed.eye_of(shapes, framed.around(result.particles.position.T, shapes))
    np.testing.assert_allclose(dots.get_offsets(), eye.seen(result.particles.position.T)[:, :2])
    assert not [axes for axes in figure.axes if axes.get_title().startswith("Speeds")]
    for wrong in ({"particles": 0}, {"figsize": 3.0}, {"figsize": (1.0, -1.0)}):
        with pytest.raises(SceneError, match=next(iter(wrong))):
            result.plot(**wrong)


def test_the_legend_of_the_speeds_is_above_them(tmp_path):
    """Also in the lowest panel that there is: of a run with counters, with three rows, in a vessel of two parts."""
    vessel = swarm.Scene([swarm.Union([swarm.Sphere(0.5, temperature=1.0), swarm.Sphere(0.5, (0.6, 0, 0))])])
    swarm.simulate(
        vessel, swarm.fill(vessel, 300, temperature=1.0, seed=1), until=0.1, every=0.05,
        counters=[swarm.Plane((1.0, 0.0, 0.0))], trajectory=tmp_path / "gas.h5", compile="never",
    )  # fmt: skip
    with swarm.load(tmp_path / "gas.h5") as trajectory:
        figure = trajectory.plot()
    figure.canvas.draw()
    (axes,) = (one for one in figure.axes if one.get_title() == "Speeds")
    assert len(axes.get_legend().get_texts()) == 3
    assert axes.get_legend().get_window_extent().y0 > max(bars.get_window_extent().y1 for bars in axes.patches)


@pytest.mark.parametrize("frames", ["none", 3])
def test_a_figure_of_a_file_without_all_particles(frames, tmp_path):
    """It says how many of how many particles are drawn; without any there are the time series."""
    cavity, path = swarm.Scene([swarm.Sphere(0.5)]), tmp_path / "run.h5"
    start = swarm.fill(cavity, 30, speed=1.0, seed=1)
    result = swarm.simulate(cavity, start, swarm.Impact(), until=1.0, trajectory=path, frames=frames, compile="never")
    with swarm.load(path) as trajectory:
        figure = trajectory.plot()
    titles = [text.get_text() for text in figure.findobj(Text) if "of 30 particles" in text.get_text()]
    assert titles == ([] if frames == "none" else ["10 of 30 particles, t = 1 s,\neach with 1 m/s"])
    texts = [text.get_text() for text in result.plot().findobj(Text)]
    assert "30 particles, t = 1 s,\neach with 1 m/s" in texts


# --- Films ---------------------------------------------------------------------------------------------------


def test_a_gif_has_the_frames_and_is_not_replaced_unasked(run, tmp_path):
    path = tmp_path / "run.gif"
    assert run[1].animate(path, size=(161, 120), fps=20) == path
    with Image.open(path) as image:
        assert (image.n_frames, image.size, image.info["duration"]) == (FRAMES, (160, 120), 50)
    with pytest.raises(SceneError, match=r"run\.gif exists"):
        run[1].animate(path)
    run[1].animate(str(path), frames=2, size=(160, 120), overwrite=True)
    with Image.open(path) as image:
        assert image.n_frames == 2
    assert list(tmp_path.iterdir()) == [path]


def test_a_video_has_the_frames(run, tmp_path):
    run[1].animate(tmp_path / "run.mp4", size=(162, 122), fps=10)
    assert imageio_ffmpeg.count_frames_and_secs(tmp_path / "run.mp4") == (FRAMES, pytest.approx(FRAMES / 10))


def test_a_frame_is_what_matplotlib_draws(run):
    """Though what does not change is drawn once; and walls that turn have turned."""
    made = film._Film(run[1], list(range(FRAMES)), (200, 160), 100)
    pictures = []
    for k in (0, 3):
        made.show(k)
        pictures.append(np.array(made.picture.canvas.buffer_rgba()))
    # As a picture of its own, of what the last frame shows
    scenery = made._scenery
    position, packed, tints = made._drawn.coloured(run[1].frame(3), made._scale, made._values)
    scenery.matter(position.T, packed, *made._drawn.ties(position.T, packed, tints))
    for artist in (*scenery.still, *scenery.front, made._title):
        artist.set_animated(False)
    made.picture.canvas.draw()
    start, end = ((one != np.array(made.picture.canvas.buffer_rgba())).any(axis=2).mean() for one in pictures)
    assert end < 0.001
    assert start > 0.01
    angle = RATE * 0.75
    x, y, _z = made._shapes[1].vertices.T
    turned = made._walls_at(3)[1].vertices[:, :2].T
    np.testing.assert_allclose(
        turned, [np.cos(angle) * x - np.sin(angle) * y, np.sin(angle) * x + np.cos(angle) * y], atol=1e-12
    )
    np.testing.assert_array_equal(made._walls_at(3)[0].vertices, made._shapes[0].vertices)


def test_what_a_film_refuses(run, tmp_path, monkeypatch):
    trajectory = run[1]
    for name, options, sentence in (
        ("run.avi", {}, "ends in .mp4 or .gif"),
        ("none/run.gif", {}, "does not exist"),
        ("run.gif", {"fps": 60}, "fps must be at most 50"),
        ("run.gif", {"frames": 0}, "frames must be"),
        ("run.gif", {"size": (10, 10)}, "size must be"),
        ("run.gif", {"size": 100}, "size must be width and height in pixels"),
    ):
        with pytest.raises(SceneError, match=sentence):
            trajectory.animate(tmp_path / name, **options)
    monkeypatch.setattr(film, "_ffmpeg", lambda: "false")
    with pytest.raises(FileError, match="cannot write the film"):
        trajectory.animate(tmp_path / "run.mp4")
    monkeypatch.undo()
    monkeypatch.setattr(film.shutil, "which", lambda _name: None)
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(SceneError, match=r"pip install imageio-ffmpeg, or write a \.gif"):
        trajectory.animate(tmp_path / "run.mp4")
    assert not list(tmp_path.iterdir())


# --- Labelled arrays -----------------------------------------------------------------------------------------


def test_a_dataset_has_all_frames(run):
    _result, trajectory = run
    data = trajectory.to_xarray()
    for k in range(FRAMES):
        np.testing.assert_array_equal(data.position[k].T, trajectory.frame(k).position)
        np.testing.assert_array_equal(data.velocity.isel(time=k).T, trajectory.frame(k).velocity)
        np.testing.assert_array_equal(data.impacts_per_particle[k], trajectory.impacts(k))
    for name, values in trajectory.observables.items():
        np.testing.assert_array_equal(data[name], values)
    assert data.impulse.dims == ("time", "surface")
    assert data.wall_position.sel(surface="1_box").dims == ("time", "axis")
    assert data.wall_orientation.dims == ("time", "surface", "quaternion")
    units = {
        name: data[name].attrs["units"] for name in ("position", "velocity", "impulse", "energy_error", "momentum")
    }
    assert list(units.values()) == ["m", "m s-1", "N s", "1", "kg m s-1"]


def test_a_dataset_reads_what_is_used(run, monkeypatch):
    """Any rows, in any order."""
    read, reads = labelled._Column._read, []

    def counted(column, key):
        reads.append(np.shape(part := read(column, key)))
        return part

    monkeypatch.setattr(labelled._Column, "_read", counted)
    data = run[1].to_xarray()
    assert "position" in repr(data)
    assert reads == []
    some = data.position.isel(time=slice(3, None), particle=[7, 2, 2], axis=0)
    np.testing.assert_array_equal(some, [run[1].frame(k).position[0, [7, 2, 2]] for k in (3, 4)])
    assert sum(map(np.prod, reads)) <= 2 * 3
    np.testing.assert_array_equal(data.position[::-2, 5], [run[1].frame(k).position[:, 5] for k in (4, 2, 0)])


def test_a_dataset_of_a_closed_file_says_so(run):
    with swarm.load(run[1].path) as trajectory:
        data = trajectory.to_xarray()
    with pytest.raises(SceneError, match="closed; open it again"):
        data.position.load()


# --- How objects show ----------------------------------------------------------------------------------------


def test_a_scene_of_many_solids_is_a_line():
    places = np.stack(np.meshgrid(*3 * [np.arange(0.1, 1.0, 0.1)]), axis=-1).reshape(-1, 3)
    many = swarm.Scene([swarm.Spheres(places, np.full(len(places), 0.01))], period=(1.0, 1.0, 1.0))
    assert repr(many) == "Scene([Spheres(<729>)], period=(1.0, 1.0, 1.0))"
    listed = swarm.Scene([swarm.Sphere(0.1, center=(k, 0, 0), side="outside") for k in range(20)])
    assert repr(listed).endswith("<13 more>])")
    assert len(listed._repr_html_()) < 2000
    assert eval(repr(SCENE), vars(swarm)) == SCENE
    times = np.arange(1000.0)
    way = swarm.Path(times, np.outer(times, [1.0, 0.0, 0.0]))
    assert repr(way) == "Path(<1000 times from 0 to 999 s>)"
    with pytest.raises(SceneError) as caught:
        swarm.Sphere(1.0, mass=1.0, motion=way + swarm.Rotation((0, 0, 1), 1.0))
    assert len(str(caught.value)) < 300
    assert eval(repr(short := swarm.Path(times[:3], np.eye(3))), vars(swarm)) == short


def test_objects_tell_what_they_are(run):
    result, trajectory = run
    for one, words in (
        (result, ("20 particles", "5 frames to 1 s", "impacts", "energy error", "<run>.h5")),
        (trajectory, ("<run>.h5", "5 frames", "0 s to 1 s", "20 particles", "Impact(")),
        (SCENE, ("Box(", "Rotation(", "Sphere(")),
        (result.particles, ("Particles(20)",)),
    ):
        assert all(word in repr(one) for word in words)
        shown = one._repr_html_()
        assert "<run>" not in shown
        assert "<script" not in shown
        assert shown.startswith("<table>")
    assert "&lt;run&gt;.h5" in trajectory._repr_html_()
    with swarm.load_impacts(trajectory.path.with_suffix(".log")) as log:
        assert "&lt;run&gt;.log" in log._repr_html_()


def test_a_closed_or_damaged_file_shows(run, tmp_path):
    path = tmp_path / "run.h5"
    whole = run[1].path.read_bytes()
    path.write_bytes(whole)
    with swarm.load(path) as trajectory:
        pass
    assert repr(trajectory) == f"Trajectory({str(path)!r}, closed; open it again with swarm.load)"
    assert "closed; open it again" in trajectory._repr_html_()
    place = whole.index(b"semi_axes" if b"semi_axes" in whole else b"half_widths")
    path.write_bytes(whole[:place] + b"!" * 40 + whole[place + 40 :])
    with swarm.load(path) as trajectory:
        assert "damaged" in trajectory._repr_html_()
        assert repr(trajectory).startswith("Trajectory(")


# --- The viewer ----------------------------------------------------------------------------------------------


def test_a_notebook_shows_the_recording(run, tmp_path, monkeypatch):
    import rerun.notebook

    shown, asked, hidden = [], [], []
    monkeypatch.delenv("RERUN_NOTEBOOK_ASSET", raising=False)
    monkeypatch.setattr(widget, "_is_reached", lambda: asked.append("server"))
    monkeypatch.setattr(widget, "_shown", [])
    monkeypatch.setattr(notebook, "is_running", lambda: True)
    monkeypatch.setitem(sys.modules, "rerun_notebook", None)
    with pytest.raises(SceneError, match=r"pip install 'rerun-sdk\[notebook\]"):
        run[1].show()
    monkeypatch.setitem(sys.modules, "rerun_notebook", types.ModuleType("rerun_notebook"))
    monkeypatch.setattr(
        rerun.notebook,
        "Viewer",
        lambda recording, **_size: types.SimpleNamespace(
            display=lambda: shown.append(recording), update_panels=lambda **panels: hidden.append(panels)
        ),
    )
    run[1].show(particles=10)
    assert "RERUN_NOTEBOOK_ASSET" not in os.environ
    monkeypatch.setenv("RERUN_NOTEBOOK_ASSET", "serve-local")
    widget.bring_widget()
    assert (asked, hidden, len(widget._shown)) == (["server", "server"], [{"top": "hidden"}], 1)
    shown[0].save(tmp_path / "run.rrd")
    shown[0].flush()
    shown[0].disconnect()
    held = playback.Playback(tmp_path / "run.rrd")
    np.testing.assert_array_equal(held.times, run[1].times)
    assert (held.about["shown"], held.about["particles"]) == (10, 20)


def test_elsewhere_the_viewer_is_a_window(run, monkeypatch):
    settings = []
    monkeypatch.setattr(recorded, "record", lambda _trajectory, _path, chosen: settings.append(chosen))
    run[1].show(color="speed")
    assert settings == [recording.Settings(5000, "speed", 100.0, live=True)]
