"""Contact sheets in words, and where the eye of Rerun's viewer is."""

import math

import numpy as np
import pytest

import swarm
from swarm.pictures import graphs, plots, series
from swarm.pictures.eye import Eye
from swarm.recording import looks, playback, sheet
from swarm.recording.recorded import record
from swarm.recording.writer import Settings
from swarm.triangles.shapes import shapes_of
from swarm.words import titles as words
from swarm.words import verdicts

SCENE = swarm.Scene([swarm.Ellipsoid((0.3, 0.3, 0.6)), swarm.Sphere(0.1, side="outside")], (0.0, 0.0, -9.81))


def recorded(folder, scene=SCENE, method=None, n=60, shown=5000):
    """The recording of a run, and what plots show of it."""
    method = method or swarm.Impact()
    swarm.simulate(
        scene, swarm.fill(scene, n, speed=1.0, seed=2), method, until=1.0, every=0.25, compile="never",
        trajectory=folder / "run.h5", recording=folder / "run.rrd", record_particles=shown,
    )  # fmt: skip
    with swarm.load(folder / "run.h5") as trajectory:
        return playback.Playback(folder / "run.rrd"), plots.content_of(trajectory)


@pytest.fixture
def older(monkeypatch):
    """Recordings are as those of versions that did not say how a run ended."""
    monkeypatch.setattr(looks, "log_outcome", lambda *_: None)


def texts(held, monkeypatch, folder):
    """All words of a sheet, and its graphs."""
    found, drawn, draw = [], [], graphs.lines
    monkeypatch.setattr(
        graphs, "lines", lambda axes, graph, *rest: drawn.append(graph.name) or draw(axes, graph, *rest)
    )
    save = sheet.style.picture

    def kept(*size):
        found.append(save(*size))
        return found[-1]

    monkeypatch.setattr(sheet.style, "picture", kept)
    sheet.draw_sheet(held, folder / "sheet.png", [0.0, 1.0], False)
    below = [text.get_text() for part in found[0].subfigs for text in part.texts]
    return found[0].get_suptitle(), below, drawn


def test_a_recording_has_the_words_of_plots(tmp_path, monkeypatch):
    held, content = recorded(tmp_path)
    assert held.about["title"] == words.title(content)
    assert held.about["title"] == "60 particles in an ellipsoid with a ball in it, under gravity: Impact, 1 s"
    assert held.verdicts == verdicts.marked(content)
    assert any("no particle was outside a rigid wall" in text for text in held.verdicts)
    title, below, drawn = texts(held, monkeypatch, tmp_path)
    assert title == held.about["title"]
    assert below == held.verdicts
    # No particle was outside: a sentence, no graph.
    assert "largest penetration [m]" not in drawn


def test_what_is_bad_is_reported(tmp_path):
    held, content = recorded(tmp_path, swarm.Scene([swarm.Sphere(0.5)]), swarm.Verlet(5e-3, 1e4))
    assert held.verdicts == verdicts.marked(content)
    assert any(text.startswith("✗ energy: not kept, Verlet does not conserve it") for text in held.verdicts)


def test_of_more_particles_than_are_drawn_the_number_is_reported(tmp_path):
    held, _content = recorded(tmp_path, shown=20)
    assert sheet.title_of_sheet(held).endswith("Impact, 1 s\n20 of 60 particles are drawn")
    held.about |= {"shown": 10_000, "particles": 20_000}
    assert sheet.title_of_sheet(held).endswith("10 000 of 20 000 particles are drawn")


def test_only_those_that_came_are_counted(tmp_path):
    source = swarm.Source(0, volume=True, rate=1e4, even=True, speed=0.1, radius=0.1, mass=1.0, blocked="wait")
    swarm.simulate(
        swarm.Scene([swarm.Box((0.3, 0.3, 0.3))]), None, swarm.Penalty(dt=1e-3, penalty=1e4), sources=source,
        until=4e-3, every=2e-3, compile="never", trajectory=tmp_path / "run.h5", recording=tmp_path / "run.rrd",
    )  # fmt: skip
    with swarm.load(tmp_path / "run.h5") as trajectory:
        record(trajectory, tmp_path / "later.rrd", Settings())
        born, count = trajectory.observables["born"][-1].sum(), trajectory.count
    assert 1 < born < count
    for name in ("run.rrd", "later.rrd"):
        title = playback.Playback(tmp_path / name).about["title"]
        assert title.startswith(f"{born} balls of 0.1 m radius from sources in a box")


@pytest.mark.usefixtures("older")
def test_a_recording_of_an_older_version_still_draws(tmp_path, monkeypatch):
    held, _content = recorded(tmp_path)
    assert "title" not in held.about
    assert held.verdicts is None
    title, below, drawn = texts(held, monkeypatch, tmp_path)
    assert title == "run.rrd: 60 particles, 5 frames"
    assert below == ["no particle was outside a wall in any frame"]
    assert "largest penetration [m]" not in drawn


def test_walls_have_the_names_of_plots(tmp_path):
    held, _content = recorded(tmp_path)
    assert [held.names[f"/pressure/{wall}"] for wall in ("0_ellipsoid", "1_sphere")] == ["ellipsoid", "ball"]


# --- The viewer ------------------------------------------------------------------------------------------


def seen_from(place, target, up, points):
    """Points as the viewer's camera has them: to the right and up, as parts of half a panel's height."""
    ahead = (target - place) / np.linalg.norm(target - place)
    right = np.cross(ahead, up)
    right /= np.linalg.norm(right)
    depth = (points - place) @ ahead
    assert (depth > 0.0).all()
    return np.array([(points - place) @ right, (points - place) @ np.cross(right, ahead)]) / depth / math.tan(
        0.5 * looks.ANGLE
    )  # fmt: skip


@pytest.mark.parametrize(
    ("scene", "plane"),
    [
        (swarm.Scene([swarm.Ellipsoid((0.3, 0.3, 0.6))]), None),
        (swarm.Scene([swarm.Sphere(0.5, center=(3.0, -2.0, 1.0))]), None),
        (swarm.Scene([swarm.Box((2.0, 1.0, 0.05))]), None),
        (swarm.Scene([swarm.Box((2.0, 0.05, 1.0))]), None),
        (swarm.Scene([swarm.Capsule(0.05, 1.0)]), None),
        (swarm.Scene([swarm.Torus(1.0, 0.2)]), None),
        (swarm.Scene([swarm.Box((2.0, 1.0, 1.0))], plane="z"), "z"),
        (swarm.Scene([swarm.Box((1.0, 1.0, 2.0))], plane="y"), "y"),
    ],
    ids=["tall", "far", "flat", "board", "tube", "torus", "plane_z", "plane_y"],
)
def test_the_eye_sees_all_corners_of_the_box_and_no_more_than_it_must(scene, plane):
    center = np.array([3.0, -2.0, 1.0])
    shapes = shapes_of(scene, np.zeros((3, 1)))
    controls = looks.eye_controls(plane, shapes, np.full((2, 3), np.nan), center)
    view = (controls.position, controls.look_target, controls.eye_up)
    place, target, up = (np.array(part.as_arrow_array().to_pylist()[0]) for part in view)
    every = np.concatenate([curve for shape in shapes for curve in (*shape.wires, shape.vertices) if len(curve)])
    low, high = every.min(axis=0) - center, every.max(axis=0) - center
    np.testing.assert_allclose(target, 0.5 * (low + high), atol=1e-6)
    corners = np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, -1).T
    x, y = np.abs(seen_from(place, target, up, corners))
    filled = max(x.max() / looks.NARROWEST, y.max())
    assert filled == pytest.approx(0.97, abs=1e-3)
    assert up[2] == 1.0 or plane is not None


def test_a_lone_point_has_the_eye_of_the_viewer():
    assert looks.eye_controls(None, [], np.zeros((1, 3)), np.zeros(3)) is None
    assert looks.distance(Eye(*np.eye(3)), np.ones(3)) > 1.0


def test_four_graphs_are_seen_and_the_others_are_in_a_tab():
    shapes = shapes_of(SCENE, np.zeros((3, 1)))
    lines = series.lines_of(SCENE, swarm.Impact(), shapes)
    parts = looks.blueprint(lines, "particles").root_container.contents
    seen, rest = parts[1].contents
    assert [view.name for view in seen.contents] == [
        "energy [J]", "impacts [1/s]", "pressure [Pa]", "worst relative energy error, log10"
    ]  # fmt: skip
    assert len(rest.contents) == len(series.views_of(lines)) - 4
