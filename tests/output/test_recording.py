"""Recordings, read back by Rerun's own reader: what is in them, how large they are, and what a crash leaves."""

import os
import subprocess
import sys

import numpy as np
import pytest
import rerun as rr
from children import python
from rerun.chunk import RrdReader

import swarm
from swarm.pictures import colours, graphs, plots
from swarm.recording import playback, recorded, sheet, viewer
from swarm.recording import writer as recording

SCENE = swarm.Scene(surfaces=[swarm.Sphere(radius=0.5)])
METHOD = swarm.Impact()
DRIFT = swarm.Translation((0.1, 0.0, 0.0))
FRAMES = 41


@pytest.fixture(scope="module", autouse=True)
def _patient():
    """On a busy machine Rerun may take long."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(recording, "_LONGEST", 600.0)
        patch.setattr(viewer, "_PATIENCE", 600.0)
        yield


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("recording")
    particles = swarm.fill(SCENE, 300, speed=0.5, seed=4)
    result = swarm.simulate(
        SCENE, particles, METHOD, until=20.0, every=0.5,
        trajectory=folder / "run.h5", recording=folder / "run.rrd", record_particles=100,
    )  # fmt: skip
    return folder, result


def test_an_energy_has_one_colour_in_every_picture(tmp_path, monkeypatch):
    """The order of the curves of a plot, whatever that of the file is."""
    scene = swarm.Scene([swarm.Sphere(0.5, restitution=0.9), *(swarm.Plane((1.0, k, 0.0), 0.4) for k in range(1, 12))])
    scene = swarm.Scene(scene.surfaces, (0.0, 0.0, -9.81))
    start = swarm.fill(scene, 3, speed=1.0, seed=1)
    swarm.simulate(
        scene, start, METHOD, until=1.0, every=0.5, trajectory=tmp_path / "run.h5", recording=tmp_path / "run.rrd"
    )
    drawn, draw = {}, graphs.lines
    monkeypatch.setattr(
        graphs,
        "lines",
        lambda axes, graph, curves, **more: (
            draw(axes, graph, curves, **more) or drawn.update({graph.name: list(curves)})
        ),
    )
    held = playback.Playback(tmp_path / "run.rrd")
    held.series = dict(sorted(held.series.items()))
    sheet.draw_sheet(held, tmp_path / "sheet.png", [0.0], False)
    in_sheet = drawn.copy()
    drawn.clear()
    with swarm.load(tmp_path / "run.h5") as trajectory:
        plots.draw_plot(trajectory, tmp_path / "plot.png")
    # A penetration of 0 in all frames is a sentence there, and no plot.
    assert drawn == {name: curves for name, curves in in_sheet.items() if name in drawn}
    assert set(in_sheet) - set(drawn) <= {"largest penetration [m]", "worst relative energy error"}
    assert drawn["energy [J]"] == ["total", "kinetic", "potential", "dissipated"]


def test_frames_come_back(run):
    folder, result = run
    held = playback.Playback(folder / "run.rrd")
    assert playback.is_whole(held.path)
    assert held.numbers == list(range(FRAMES))
    np.testing.assert_array_equal(held.times, result.observables["time"])
    assert (held.about["particles"], held.about["shown"], held.about["stride"]) == (300, 100, 1)
    with swarm.load(folder / "run.h5") as trajectory:
        for number in (0, 17, 40):
            positions, packed = held.frame(number)
            frame = trajectory.frame(number)
            np.testing.assert_array_equal(positions, frame.position[:, ::3].T.astype(np.float32))
            speeds = np.sqrt((frame.velocity[:, ::3] ** 2).sum(axis=0))
            scale = colours.Scale(held.about["quantity"], held.about["low"], held.about["high"])
            np.testing.assert_array_equal(packed, scale.colours(speeds))
    assert held.about["low"] <= 0.5 <= held.about["high"]


def particles_of(path):
    """Mass and number of the particles of a recording."""
    found = {}
    for chunk in RrdReader(path).stream().to_chunks():
        if chunk.entity_path == playback.PARTICLES:
            batch = chunk.to_record_batch()
            found |= dict(zip(batch.schema.names, batch.columns, strict=True))
    return [np.array(found[f"Particles:{name}"].drop_null()[0].as_py()) for name in ("mass", "number")]


def test_a_recording_has_masses_and_numbers(tmp_path):
    """Of those that are shown, where the trajectory keeps a part of the particles too."""
    rng = np.random.default_rng(5)
    start = swarm.Particles(rng.uniform(-0.2, 0.2, (3, 50)), rng.normal(size=(3, 50)), rng.uniform(1.0, 2.0, 50))
    swarm.simulate(
        SCENE, start, METHOD, until=1.0, every=0.5, trajectory=tmp_path / "run.h5", frames=3,
        recording=tmp_path / "run.rrd", record_particles=25, compile="never",
    )  # fmt: skip
    mass, number = particles_of(tmp_path / "run.rrd")
    np.testing.assert_array_equal(number, np.arange(50)[::2])
    np.testing.assert_array_equal(mass, start.mass[::2])
    with swarm.load(tmp_path / "run.h5") as trajectory:
        recorded.record(trajectory, tmp_path / "later.rrd", recording.Settings(particles=9))
    mass, number = particles_of(tmp_path / "later.rrd")
    np.testing.assert_array_equal(number, np.arange(50)[::3][::2])
    np.testing.assert_array_equal(mass, start.mass[::3][::2])


def test_series_are_the_observables(run):
    folder, result = run
    held, seen = playback.Playback(folder / "run.rrd"), result.observables
    times, energy = held.series["/energy/total"]
    np.testing.assert_array_equal(times, seen["time"])
    np.testing.assert_array_equal(energy, seen["total_energy"])
    errors = np.maximum(seen["energy_error"], 1e-18)
    np.testing.assert_allclose(held.series["/energy_error"][1], np.log10(errors))
    times, rate = held.series["/impacts"]
    np.testing.assert_allclose(rate, np.diff(seen["impacts"]) / 0.5)
    # What has no line: gravity, soft walls, losses.
    assert {name for name in held.series if name.startswith("/energy/")} == {"/energy/total", "/energy/kinetic"}
    # p V = 2/3 of the kinetic energy
    pressure = held.series["/pressure/0_sphere"][1].mean()
    assert pressure == pytest.approx(2.0 / 3.0 * energy[0] / (np.pi / 6.0), rel=0.05)


def test_walls_are_mesh_and_wires(run):
    held = playback.Playback(run[0] / "run.rrd")
    assert {"/scene/surfaces/0_sphere/mesh", "/scene/surfaces/0_sphere/levels"} <= set(held.entities)
    (shape,) = held.shapes_at(0)
    assert not shape.solid
    np.testing.assert_allclose(np.linalg.norm(np.vstack(shape.levels), axis=1), 0.5, rtol=2e-3)
    np.testing.assert_allclose(np.linalg.norm(shape.vertices, axis=1), 0.5, rtol=1e-6)
    np.testing.assert_allclose(shape.normals, -2.0 * shape.vertices, atol=1e-6)


def test_the_blueprint_is_in_it_and_pauses_at_the_start(run):
    reader = rr.chunk.RrdReader(run[0] / "run.rrd")
    (blueprint,) = reader.blueprints()
    columns = {}
    for chunk in reader.stream(store=blueprint).to_chunks():
        batch = chunk.to_record_batch()
        columns |= {name: batch.column(name)[0].as_py() for name in batch.schema.names if ":" in name}
    # Of a time panel: 1 is paused.
    assert columns["TimePanelBlueprint:play_state"] == [1]
    assert columns["TimePanelBlueprint:timeline"] == ["frame"]
    assert "ViewBlueprint:class_identifier" in columns


def test_a_recording_of_the_trajectory_is_the_same(run, tmp_path):
    folder, _ = run
    with swarm.load(folder / "run.h5") as trajectory:
        recorded.record(trajectory, tmp_path / "later.rrd", recording.Settings(particles=100))
    one, other = playback.Playback(folder / "run.rrd"), playback.Playback(tmp_path / "later.rrd")
    assert one.numbers == other.numbers
    assert one.about == other.about
    assert one.series.keys() == other.series.keys()
    for path, (times, values) in one.series.items():
        np.testing.assert_array_equal(times, other.series[path][0])
        np.testing.assert_array_equal(values, other.series[path][1])
    for number in one.numbers:
        for mine, theirs in zip(one.frame(number), other.frame(number), strict=True):
            np.testing.assert_array_equal(mine, theirs)


@pytest.mark.parametrize("megabytes", [0.7, 1.5])
def test_the_size_is_bounded_and_the_last_frame_is_there(tmp_path, megabytes):
    """Of few particles, of which the time series are most, and of a hundred times as many."""
    path, many = tmp_path / "run.rrd", tmp_path / "many.rrd"
    result = swarm.simulate(
        SCENE, swarm.fill(SCENE, 20, speed=0.5, seed=1), METHOD, until=1.0, every=0.005, compile="never",
        trajectory=tmp_path / "run.h5", recording=path, record_megabytes=megabytes,
    )  # fmt: skip
    seen = result.observables
    with swarm.load(tmp_path / "run.h5") as trajectory:
        frames = [
            swarm.Particles(np.tile(frame.position, 100), np.tile(frame.velocity, 100))
            for frame in map(trajectory.frame, range(201))
        ]
    settings = recording.Settings(megabytes=megabytes)
    with recording.RecordingWriter(many, False, SCENE, METHOD, frames[0], 201, settings) as write:
        for k, frame in enumerate(frames):
            write([(k, seen["time"][k], frame, {name: values[k] for name, values in seen.items()})])
    for file, count in ((path, 20), (many, 2000)):
        assert file.stat().st_size <= megabytes * 1e6
        held = playback.Playback(file)
        assert held.about["particles"] == count
        assert held.about["stride"] > 1
        assert held.numbers == [*range(0, 200, held.about["stride"]), 200]
        # Rates are per second whatever the stride.
        times, impacts = (seen[name][held.numbers] for name in ("time", "impacts"))
        np.testing.assert_allclose(held.series["/impacts"][1], np.diff(impacts) / np.diff(times))


def test_energy_errors_as_colours(tmp_path):
    soft = swarm.Penalty(dt=0.01, penalty=1e4, exponent=1.5)
    scene = swarm.Scene(SCENE.surfaces, gravity=(0.0, 0.0, -1.0))
    start = swarm.fill(scene, 50, speed=1.0, seed=2)
    scale, values = colours.colouring("energy-error", scene, soft, start)
    assert (values(start.position, start.velocity) == -16.0).all()
    # In the wall: V = alpha g^(a + 1)/(a + 1); faster: half the square of the speed.
    deep = np.array([[0.0], [0.0], [0.51]]) + np.zeros((3, 50))
    before = 0.5 - (-1.0) * start.position[2]
    after = 0.5 * 1.1**2 + 0.51 + 1e4 * 0.01**2.5 / 2.5
    text = values(deep, 1.1 * start.velocity)
    np.testing.assert_allclose(10.0**text, np.abs(after - before) / (0.5 + 0.5), rtol=1e-9)
    assert (scale.low, scale.high) == (-16.0, -6.0)
    for law in ({"restitution": 0.9}, {"friction": 0.1}, {"temperature": 300.0}, {"motion": DRIFT}, {"mass": 1.0}):
        with pytest.raises(swarm.SceneError, match="record_color must be 'speed'"):
            colours.colouring("energy-error", swarm.Scene([swarm.Sphere(0.5, **law)]), METHOD, start)


@pytest.mark.parametrize("lost", [20_000, 10])
def test_a_truncated_recording_is_repaired(run, tmp_path, lost):
    whole = (run[0] / "run.rrd").read_bytes()
    cut = tmp_path / "cut.rrd"
    cut.write_bytes(whole[:-lost])
    if lost > 1000:  # more than the footer
        with pytest.raises(swarm.SceneError, match=r"cut\.rrd.*--repair"):
            playback.Playback(cut)
    held, is_whole = playback.described(cut)
    assert not is_whole
    repaired = playback.repair(cut)
    assert playback.is_whole(cut)
    assert repaired.numbers == held.numbers == list(range(len(held.numbers)))
    assert len(repaired.numbers) > 5
    for mine, theirs in zip(repaired.frame(3), playback.Playback(run[0] / "run.rrd").frame(3), strict=True):
        np.testing.assert_array_equal(mine, theirs)


@pytest.mark.physics
def test_kill_9_while_recording(tmp_path, request):
    """What is left is repaired, and its frames are unchanged. After frame 400 the run waits for the kill."""
    code = (
        "import signal, swarm\n"
        "def tell(frame):\n"
        "    print(frame.number, flush=True)\n"
        "    if frame.number == 400:\n"
        "        signal.pause()\n"
        "scene = swarm.Scene([swarm.Sphere(0.5)])\n"
        "particles = swarm.fill(scene, 2000, speed=0.5, seed=4)\n"
        "swarm.simulate(scene, particles, swarm.Impact(), until=2e3, every=0.5, trajectory='run.h5',\n"
        "    recording='run.rrd', record_particles=100, progress=tell)\n"
    )
    process = subprocess.Popen([sys.executable, "-c", code], cwd=tmp_path, stdout=subprocess.PIPE, text=True)
    request.addfinalizer(process.kill)
    for line in process.stdout:
        if int(line) >= 300:  # no more than 200 frames are on their way
            break
    process.kill()
    process.communicate()
    assert not playback.is_whole(tmp_path / "run.rrd")
    repaired = playback.repair(tmp_path / "run.rrd")
    assert playback.is_whole(tmp_path / "run.rrd")
    assert repaired.numbers == list(range(len(repaired.numbers)))
    assert len(repaired.numbers) > 100
    with swarm.load(tmp_path / "run.h5") as trajectory:
        for number in (0, 50, 100):
            kept = trajectory.frame(number).position[:, ::20].T.astype(np.float32)
            np.testing.assert_array_equal(repaired.frame(number)[0], kept)


def test_other_files_are_refused(tmp_path):
    (tmp_path / "text.rrd").write_text("no recording")
    with pytest.raises(swarm.SceneError, match=r"text\.rrd is not a recording of swarm"):
        playback.described(tmp_path / "text.rrd")
    with pytest.raises(swarm.SceneError, match=r"there is no file .*absent\.rrd"):
        playback.described(tmp_path / "absent.rrd")
    assert (tmp_path / "text.rrd").read_text() == "no recording"


def test_refused_before_anything_is_touched(tmp_path):
    particles = swarm.fill(SCENE, 5, speed=0.3)
    present = tmp_path / "present.rrd"
    present.write_bytes(b"mine")
    for path, keywords, message in (
        (present, {}, r"recording: .*present\.rrd exists.*--overwrite"),
        (tmp_path / "nowhere" / "run.rrd", {}, r"recording: the folder .*nowhere does not exist"),
        (tmp_path / "new.rrd", {"record_particles": 0}, "record_particles must be 1 or more, got 0"),
        (tmp_path / "new.rrd", {"record_color": "mass"}, "record_color must be one of 'speed' and 'energy-error'"),
        (tmp_path / "new.rrd", {"record_megabytes": 0.0}, "record_megabytes must be above 0"),
    ):
        with pytest.raises(swarm.SceneError, match=message):
            swarm.simulate(SCENE, particles, METHOD, until=1.0, recording=path, **keywords)
    assert present.read_bytes() == b"mine"
    assert list(tmp_path.iterdir()) == [present]


@pytest.mark.physics
def test_a_full_disk_ends_the_run(tmp_path):
    """A limit on the size of files replaces a full disk."""
    code = (
        "import resource, signal, swarm\n"
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "scene = swarm.Scene([swarm.Sphere(0.5)])\n"
        "particles = swarm.fill(scene, 100, speed=0.5)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (800_000, 800_000))\n"
        "try:\n"
        "    swarm.simulate(scene, particles, swarm.Impact(), until=50.0, every=0.1, recording='run.rrd',\n"
        "        compile='never')\n"
        "except swarm.FileError as error:\n"
        "    print(error)\n"
    )
    done = python("-c", code, cwd=tmp_path)
    assert "recording run.rrd" in done.stdout, done.stderr


def test_without_rerun_one_sentence_says_what_to_install(monkeypatch, tmp_path):
    monkeypatch.delitem(sys.modules, "swarm.recording.writer")
    monkeypatch.setitem(sys.modules, "rerun", None)
    with pytest.raises(swarm.SceneError, match=r"a recording needs the package 'rerun'.*pip install rerun-sdk"):
        swarm.simulate(SCENE, swarm.fill(SCENE, 5, speed=0.3), METHOD, until=1.0, recording=tmp_path / "run.rrd")


def test_live_without_a_screen(monkeypatch):
    monkeypatch.setattr(sys, "platform", "linux")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(viewer, "_listens", lambda port: False)
    with pytest.raises(swarm.SceneError, match=r"live needs a screen.*swarm view"):
        viewer.live_url(True)


@pytest.mark.physics
def test_live_reaches_a_viewer(tmp_path, request):
    """A server without a window that saves what it is sent."""
    target, port = tmp_path / "heard.rrd", 19_876
    server = viewer._Viewer("--port", str(port), "--save", str(target))
    request.addfinalizer(server.end)
    server.wait_for(port)
    particles = swarm.fill(SCENE, 50, speed=0.5)
    url = f"rerun+http://127.0.0.1:{port}/proxy"
    swarm.simulate(SCENE, particles, METHOD, until=2.0, every=0.5, live=url, recording=tmp_path / "run.rrd")
    held = playback.Playback(tmp_path / "run.rrd")
    assert held.numbers == [0, 1, 2, 3, 4]

    def has_heard_all():
        try:
            return playback.described(target)[0].numbers == held.numbers
        except swarm.SwarmError:
            return False  # not much has come yet

    server.wait_until(has_heard_all, "hear all")


def test_a_sheet_says_what_drew_it(run, tmp_path, monkeypatch):
    held = playback.Playback(run[0] / "run.rrd")
    monkeypatch.setenv("VK_DRIVER_FILES", str(tmp_path / "none.json"))
    drawn = sheet.draw_sheet(held, tmp_path / "sheet.png", [0.0, 3.1], None)
    assert "matplotlib" in drawn
    assert ("Vulkan" in drawn) == (sys.platform == "linux")
    assert (tmp_path / "sheet.png").stat().st_size > 20_000
    assert sheet._chosen(held, [0.0, 3.1]) == [0, 6]
    assert sheet._chosen(held, None) == [0, 20, 40]
    with pytest.raises(swarm.SceneError, match="times must lie between 0 and 20 s, got 21"):
        sheet.draw_sheet(held, tmp_path / "sheet.png", [21.0], None)
    if sys.platform == "linux":
        with pytest.raises(swarm.RunError, match="the Rerun viewer cannot draw here: there is no Vulkan driver"):
            sheet.draw_sheet(held, tmp_path / "sheet.png", None, True)


@pytest.mark.physics
@pytest.mark.skipif(viewer.no_driver() is not None, reason="no Vulkan driver")
def test_the_viewer_draws(run, tmp_path):
    held = playback.Playback(run[0] / "run.rrd")
    assert sheet.draw_sheet(held, tmp_path / "sheet.png", None, True) == "the Rerun viewer"
    assert os.stat(tmp_path / "sheet.png").st_size > 20_000


def test_walls_that_come_and_go_are_recorded_from_each_instant_on(tmp_path):
    """A post that is there for a while, and a hole that is open for a while."""
    hole = swarm.Opening(swarm.Sphere(0.2, (0.0, 0.0, 0.5)), times=[(0.15, 0.45)])
    post = swarm.Sphere(0.1, side="outside", present=[(0.25, 0.35)])
    scene = swarm.Scene([swarm.Sphere(0.5, openings=[hole]), post])
    start = swarm.Particles([[0.3], [0.0], [0.0]], [[0.0], [0.1], [0.0]])
    path = tmp_path / "doors.rrd"
    swarm.simulate(scene, start, swarm.Impact(), until=0.5, every=0.1, recording=path)
    held = playback.Playback(path)
    seen = [
        [[*shape.wires, shape.vertices] if len(shape.vertices) else [] for shape in held.shapes_at(n)] for n in range(6)
    ]
    assert [len(ball) > 0 for ball, _post in map(sorted_by_size, seen)] == 6 * [True]
    assert [len(of_post) > 0 for _ball, of_post in map(sorted_by_size, seen)] == [k == 3 for k in range(6)]
    for number, walls in enumerate(seen):
        points = np.vstack(sorted_by_size(walls)[0])
        in_hole = np.sqrt(((points - [0.0, 0.0, 0.5]) ** 2).sum(axis=1)) < 0.19
        assert in_hole.any() == (number not in (2, 3, 4))


def sorted_by_size(walls):
    """The curves of the ball, whose points are farther out, and those of the post."""
    return sorted(walls, key=lambda curves: max((np.abs(curve).max() for curve in curves), default=0.0))[::-1]
