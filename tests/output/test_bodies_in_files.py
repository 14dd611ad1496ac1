"""Bodies in files and pictures: what is written comes back, whole bodies are shown, and readers find their bonds."""

import importlib.util
import itertools

import h5py
import numpy as np
import pytest
import tomli_w
from children import python
from conftest import edited
from matplotlib.collections import LineCollection

import swarm
from swarm import observables, scene_file
from swarm.bodies.elastic import block
from swarm.bodies.table import table_of
from swarm.commands import summary
from swarm.files import checkpoint, writer
from swarm.files.storage import Storage
from swarm.pictures import colours, drawing, graphs, plots, series
from swarm.pictures.drawn import Drawn
from swarm.recording import playback, recorded, sheet
from swarm.recording import writer as recording
from swarm.state import State

BOX = swarm.Scene([swarm.Box((0.5, 0.5, 0.5))], gravity=(0.0, 0.0, -1.0))
METHOD = swarm.Impact()
FRAMES, COPIES = 4, 30
CUBE = swarm.rigid(np.array(list(itertools.product((-0.05, 0.05), repeat=3))), density=800.0)
BODIES = {"chain": swarm.chain(3, 0.2, 0.6), "cube": CUBE}


def moved(start, time):
    """The bodies after a time in straight flight: their links keep their lengths."""
    steady = np.broadcast_to(start.velocity.mean(axis=1, keepdims=True), start.velocity.shape)
    return swarm.Bodies(start.body, start.position + 0.1 * time * steady, start.velocity)


def observed(k):
    seen = dict.fromkeys(("kinetic_energy", "potential_energy", "total_energy"), 1.0)
    seen |= dict.fromkeys(("contact_energy", "dissipated_energy", "max_penetration", "sliding_time"), 0.0)
    seen |= {"energy_error": 1e-15, "impacts": 7 * k, "escaped": 0, "unconverged": 0, "sliding": 0}
    return seen | {"impulse": np.full(1, 2.0 * k), "wall_heat": np.zeros(1), "link_error": 3e-16 * k, "work": 0.0}


def write(path, frames, storage=None):
    """A trajectory of these frames, one a second."""
    n = len(frames[0]) * len(frames[0].body)
    nothing, counts = np.zeros(n), np.zeros(n, np.int64)
    with writer.TrajectoryWriter(path, storage or Storage(), BOX, METHOD, frames[0], None, {"seed": 0}) as put:
        for k, bodies in enumerate(frames):
            flat = bodies.position.reshape(3, -1), bodies.velocity.reshape(3, -1)
            put([(k, float(k), State(*flat, nothing, nothing, nothing, counts, nothing, nothing, None), observed(k))])


@pytest.fixture(params=BODIES)
def run(request, tmp_path):
    start = swarm.place(BOX, BODIES[request.param], COPIES, speed=0.3, spin=2.0, seed=3)
    frames = [moved(start, float(k)) for k in range(FRAMES)]
    write(tmp_path / "run.h5", frames)
    return tmp_path / "run.h5", frames


# --- Trajectories -----------------------------------------------------------------------------------------


def test_bodies_come_back(run):
    path, frames = run
    with swarm.load(path) as trajectory:
        assert trajectory.copies == COPIES
        assert trajectory.count == COPIES * len(frames[0].body)
        np.testing.assert_array_equal(trajectory.body.mass_matrix, frames[0].body.mass_matrix)
        for k in (0, 2, -1):
            found = trajectory.bodies(k)
            np.testing.assert_array_equal(found.position, frames[k].position)
            np.testing.assert_array_equal(found.velocity, frames[k].velocity)
        # Point p of copy i is particle p n + i.
        path_of_one = trajectory.particle(2 * COPIES + 5)[0]
        np.testing.assert_array_equal(path_of_one.T, [bodies.position[:, 2, 5] for bodies in frames])
        assert trajectory.frame(0).mass.sum() == pytest.approx(COPIES * frames[0].body.mass_matrix.sum())


def test_bonds_are_h5md_connectivity(run):
    """Rows of `id` whose particles are as far apart as the links are long."""
    path, frames = run
    body = frames[0].body
    with h5py.File(path) as file:
        bonds = file["connectivity/bonds"]
        assert file[bonds.attrs["particles_group"]] == file["particles/all"]
        assert bonds.shape == (COPIES * len(body.links), 2)
        assert bonds.dtype.kind == "i"
        assert file["particles/all/id"][()].tolist() == list(range(COPIES * len(body)))
        points = file["particles/all/position/value"][FRAMES - 1]
        one, other = bonds[()].T
    lengths = np.linalg.norm(points[one] - points[other], axis=1)
    i, j = body.links.T
    expected = np.linalg.norm(body.points[i] - body.points[j], axis=1)
    np.testing.assert_allclose(lengths, np.repeat(expected, COPIES), rtol=1e-12)
    # Each copy is a piece of its own.
    assert (one % COPIES == other % COPIES).all()
    assert np.bincount(one % COPIES).tolist() == [len(body.links)] * COPIES


MDANALYSIS = """
import sys, warnings
warnings.simplefilter("ignore")
import h5py, MDAnalysis
with h5py.File(sys.argv[1], locking=False) as file:
    bonds, points = file["connectivity/bonds"][()], len(file["particles/all/id"])
universe = MDAnalysis.Universe.empty(points, trajectory=True)
universe.load_new(sys.argv[1], format="H5MD", convert_units=False)
universe.add_TopologyAttr("bonds", [tuple(bond) for bond in bonds.tolist()])
universe.trajectory[-1]
lengths = universe.bonds.values()
print(len(universe.atoms.fragments), lengths.min(), lengths.max())
"""


@pytest.mark.physics
def test_mdanalysis_takes_the_bonds(tmp_path):
    if importlib.util.find_spec("MDAnalysis") is None:
        pytest.skip("MDAnalysis is not installed")
    start = swarm.place(BOX, BODIES["chain"], 5, speed=0.3, spin=2.0, seed=3)
    write(tmp_path / "run.h5", [start, moved(start, 1.0)])
    done = python("-c", MDANALYSIS, tmp_path / "run.h5")
    assert done.returncode == 0, done.stderr
    pieces, *lengths = done.stdout.split()
    assert int(pieces) == 5
    # Its positions are in single precision.
    assert [float(length) for length in lengths] == pytest.approx([0.1, 0.1], rel=1e-5)


def test_a_large_body_comes_back(tmp_path):
    """Its text is many times as long as those of other runs."""
    body = swarm.elastic(block((0.1, 0.1, 0.1), (3, 3, 3)), young=1e4, poisson=0.3, density=100.0)
    start = swarm.place(BOX, body, 2, seed=1)
    write(tmp_path / "run.h5", [start, moved(start, 1.0)])
    with swarm.load(tmp_path / "run.h5") as trajectory:
        np.testing.assert_array_equal(trajectory.body.strain.stiffness, body.strain.stiffness)
    with h5py.File(tmp_path / "run.h5") as file:
        assert file["connectivity/bonds"].shape == (2 * len(body.strain.edges), 2)


def test_what_is_kept_is_whole(tmp_path):
    start = swarm.place(BOX, CUBE, 2, seed=1)
    write(tmp_path / "none.h5", [start, start], Storage(frames="none"))
    with swarm.load(tmp_path / "none.h5") as trajectory:
        assert (trajectory.copies, len(trajectory.body)) == (2, 4)
        with pytest.raises(swarm.SceneError, match=r"none\.h5 keeps no particles"):
            trajectory.bodies(0)
    with h5py.File(tmp_path / "none.h5") as file:
        assert "connectivity" not in file
    write(tmp_path / "half.h5", [start, start], Storage(precision="float32"))
    with swarm.load(tmp_path / "half.h5") as trajectory:
        np.testing.assert_array_equal(trajectory.frame(1).position, start.position.reshape(3, -1).astype(np.float32))
        with pytest.raises(swarm.SceneError, match=r"half\.h5 keeps bodies in float32, .* use frame\(1\)"):
            trajectory.bodies(1)
    with pytest.raises(swarm.SceneError, match=r'frames must be "all" or "none" with bodies, got 2'):
        swarm.simulate(BOX, start, swarm.Impact(dt=0.01), until=1.0, frames=2)


def test_particles_are_no_bodies(tmp_path):
    rest = swarm.Particles([0.0, 0.0, 0.0], [0.0, 0.0, 0.0])
    with writer.TrajectoryWriter(tmp_path / "run.h5", Storage(), BOX, METHOD, rest, None, {"seed": 0}) as put:
        nothing = np.zeros(1)
        state = State(rest.position, rest.velocity, nothing, nothing, nothing, np.zeros(1, int), nothing, nothing, None)
        put([(0, 0.0, state, observed(0))])
    with swarm.load(tmp_path / "run.h5") as trajectory:
        assert (trajectory.body, trajectory.copies) == (None, 0)
        with pytest.raises(swarm.SceneError, match=r"run\.h5 holds particles, not bodies; use frame\(0\)"):
            trajectory.bodies(0)
    assert summary.of_file(tmp_path / "run.h5")["what runs"].startswith("1 particle of ")


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("copies", 7, r"is damaged: its body: 7 of \d points are not \d+"),
        ("copies", 0.5, r"is damaged: its structure: parameters/copies must hold numbers, got float64"),
        ("body", "kind = 'points'", r"is damaged: its body: body\.points: expected a list, got nothing"),
        ("body", "kind = ", r"is damaged: its body: Invalid value"),
        ("body", 3, r"is damaged: its structure: parameters/body must be a text"),
    ],
)
def test_a_damaged_body_is_named(run, name, value, message):
    with edited(run[0]) as file:
        del file[f"parameters/{name}"]
        file[f"parameters/{name}"] = value
    with pytest.raises(swarm.SceneError, match=message), swarm.load(run[0]) as trajectory:
        trajectory.bodies(0)


def test_a_run_goes_on_from_a_file(run):
    path, frames = run
    text = 'surface = [{kind = "box", half_widths = [0.5, 0.5, 0.5]}]\nmethod.kind = "impact"\nrun.until = 1.0\n'
    (path.parent / "scene.toml").write_text(f'{text}body.from = "run.h5"\nbody.frame = 1')
    job = scene_file.read(path.parent / "scene.toml")
    assert job.start_file() == path
    np.testing.assert_array_equal(job.start().position, frames[1].position)
    (path.parent / "scene.toml").write_text(f'{text}particles.from = "run.h5"')
    with pytest.raises(swarm.SceneError, match=r"\[particles\]: from: .*run\.h5 holds bodies.*write \[body\]"):
        scene_file.read(path.parent / "scene.toml").start()


def test_the_digest_of_a_start_is_also_of_its_body():
    """The same points with other ties are another run."""
    one, other = (
        swarm.Body([(0.0, 0.0, 0.0), (0.1, 0.0, 0.0)], 1.0, springs=[(0, 1, stiffness, 0.1)])
        for stiffness in (1.0, 2.0)
    )
    points = swarm.Bodies(one, one.points.T, np.zeros((3, 2))).particles()
    digests = {checkpoint.digest_of(points, tomli_w.dumps(table_of(body))) for body in (one, other)}
    assert len(digests | {checkpoint.digest_of(points)}) == 3


def test_a_run_writes_its_bodies(tmp_path):
    """The trajectory ends where the run does, and a recording of the trajectory is that of the run."""
    start = swarm.place(BOX, CUBE, 3, speed=1.0, spin=5.0, seed=2)
    files = {"trajectory": tmp_path / "run.h5", "recording": tmp_path / "run.rrd"}
    result = swarm.simulate(BOX, start, swarm.Impact(dt=0.02), until=0.2, every=0.1, compile="never", **files)
    with swarm.load(files["trajectory"]) as trajectory:
        np.testing.assert_array_equal(trajectory.bodies(0).position, start.position)
        np.testing.assert_array_equal(trajectory.bodies(-1).position, result.bodies.position)
        np.testing.assert_array_equal(trajectory.bodies(-1).velocity, result.bodies.velocity)
        np.testing.assert_array_equal(trajectory.observables["link_error"], result.observables["link_error"])
        recorded.record(trajectory, tmp_path / "later.rrd", recording.Settings())
    one, other = (playback.Playback(tmp_path / name) for name in ("run.rrd", "later.rrd"))
    assert one.about == other.about
    for number in (0, 1, 2):
        for mine, theirs in zip(
            one.frame(number) + one.faces(number), other.frame(number) + other.faces(number), strict=True
        ):
            np.testing.assert_array_equal(mine, theirs)
    np.testing.assert_array_equal(one.series["/link_error"], other.series["/link_error"])


def test_another_body_is_another_run(tmp_path):
    points = [(0.0, 0.0, 0.0), (0.1, 0.0, 0.0)]
    soft, hard = (swarm.Body(points, 1.0, springs=[(0, 1, stiffness, 0.1)]) for stiffness in (1.0, 2.0))
    options = {"until": 0.1, "every": 0.1, "compile": "never", "trajectory": tmp_path / "run.h5"}
    for body in (soft, hard):
        start = swarm.Bodies(body, body.points.T, np.zeros((3, 2)))
        if body is soft:
            swarm.simulate(BOX, start, swarm.Impact(dt=0.05), **options)
        else:
            with pytest.raises(swarm.SceneError, match=r"run\.h5 is of another run: its particles at the start"):
                swarm.simulate(BOX, start, swarm.Impact(dt=0.05), **options, resume=True)


# --- Recordings and pictures ------------------------------------------------------------------------------


def test_whole_bodies_are_recorded(run, tmp_path):
    path, frames = run
    body = frames[0].body
    most = 9 * len(body.contacts)  # of 30 bodies every 4th, which are 8
    with swarm.load(path) as trajectory:
        recorded.record(trajectory, tmp_path / "run.rrd", recording.Settings(particles=most))
    held = playback.Playback(tmp_path / "run.rrd")
    assert playback.is_whole(held.path)
    assert (held.about["noun"], held.about["particles"], held.about["shown"]) == ("bodies", COPIES, 8)
    assert len(held.shapes_at(0)) == 1
    for number in (0, FRAMES - 1):
        shown = frames[number].contact_points()[:, :, ::4].astype(np.float32)
        positions, packed = held.frame(number)
        np.testing.assert_allclose(positions, shown.reshape(3, -1).T, rtol=0.0, atol=1e-7)
        (strips, tints), (corners, paint) = held.lines(number), held.faces(number)
        if body is CUBE:
            assert len(strips) == 0
            assert corners.shape == (8 * 12, 3, 3)
            areas = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
            np.testing.assert_allclose(areas, 0.005, rtol=1e-5)
            assert set(paint.ravel()) == set(packed)
        else:
            assert len(corners) == 0
            np.testing.assert_allclose(np.linalg.norm(strips[:, 1] - strips[:, 0], axis=1), 0.1, rtol=1e-5)
            ends = {tuple(end) for end in strips.reshape(-1, 3)}
            assert ends == {tuple(point) for point in positions}
            scale = colours.Scale(held.about["quantity"], held.about["low"], held.about["high"])
            v = frames[number].velocity[:, :, ::4]
            middles = np.linalg.norm(0.5 * (v[:, :-1] + v[:, 1:]), axis=0)
            np.testing.assert_array_equal(tints, scale.colours(middles).ravel())


def test_lines_are_bonds_or_the_edges_of_faces(run):
    """Of a cube the twelve edges, without the diagonals; of an elastic one all, since its faces bend."""
    body = run[1][0].body
    drawn = Drawn(COPIES * len(body), body, 10**6)
    assert drawn.shown == COPIES
    points = drawn.points(run[1][2].position.reshape(3, -1))
    i, j = drawn.lines.T
    lengths = np.linalg.norm(points[:, i] - points[:, j], axis=0)
    assert len(lengths) == COPIES * (12 if body is CUBE else 2)
    np.testing.assert_allclose(lengths, 0.1, rtol=1e-12)
    np.testing.assert_allclose(drawn.middles(points), 0.5 * (points[:, i] + points[:, j]))
    soft = swarm.elastic(block((0.1, 0.1, 0.1), (1, 1, 1)), young=1e4, poisson=0.3, density=100.0)
    assert len(Drawn(8, soft, 8).lines) == 18


def test_one_body_is_shown_however_large():
    drawn = Drawn(2 * 4, CUBE, 3)
    assert (drawn.count, drawn.shown, len(drawn.triangles)) == (2, 1, 12)


@pytest.mark.parametrize("megabytes", [1.0, 3.0])
def test_the_size_is_bounded(run, tmp_path, megabytes):
    body, many = run[1][0].body, 400
    start = swarm.place(BOX, body, 200, speed=0.3, seed=3)
    states = [moved(start, 1e-3 * k) for k in range(many)]
    settings = recording.Settings(megabytes=megabytes)
    target = tmp_path / "run.rrd"
    points = start.particles()
    with recording.RecordingWriter(target, True, BOX, METHOD, points, many, settings, body) as put:
        for k, bodies in enumerate(states):
            state = swarm.Particles(bodies.position.reshape(3, -1), bodies.velocity.reshape(3, -1))
            put([(k, float(k), state, observed(k))])
    assert target.stat().st_size <= megabytes * 1e6
    held = playback.Playback(target)
    assert 1 < held.about["stride"] < many
    assert held.numbers[-1] == many - 1


def test_energy_errors_of_points_are_no_colours(run, tmp_path):
    with swarm.load(run[0]) as trajectory, pytest.raises(swarm.SceneError, match="must be 'speed' for bodies, got 'en"):
        recorded.record(trajectory, tmp_path / "run.rrd", recording.Settings(color="energy-error"))


def test_pictures_show_bodies_and_the_error_of_links(run, tmp_path, monkeypatch):
    path, frames = run
    body, drawn = frames[0].body, {}
    names = {graph: name for name, graph in series.GRAPHS.items()}
    monkeypatch.setattr(graphs, "lines", lambda axes, graph, curves, limit=0: drawn.update({names[graph]: curves}))
    cells, ties, draw = [], [], drawing.frame
    monkeypatch.setattr(drawing, "frame", lambda *given: ties.append(given[4:6]) or draw(*given))
    monkeypatch.setattr(drawing, "colour_bar", lambda picture, axes, *meaning: cells.append(axes))
    with swarm.load(path) as trajectory:
        recorded.record(trajectory, tmp_path / "run.rrd", recording.Settings())
        plots.draw_plot(trajectory, tmp_path / "plot.png")
    by_plot, _ = dict(drawn), drawn.clear()
    sheet.draw_sheet(playback.Playback(tmp_path / "run.rrd"), tmp_path / "sheet.png", [float(FRAMES - 1)], False)
    for found in (by_plot, dict(drawn)):
        times, errors = found["link_error"]["of a link"]
        np.testing.assert_array_equal(times, np.arange(FRAMES))
        np.testing.assert_allclose(10.0**errors, [1e-18, 3e-16, 6e-16, 9e-16])
        assert list(found["impacts"]) == ["all bodies"]
        assert "work of anchors" not in found["energy"]
    count = 12 * COPIES if body is CUBE else 2 * COPIES
    for axes, (lines, faces) in zip((cells[0], cells[1][0]), ties, strict=True):
        places = np.asarray((faces if body is CUBE else lines)[0])
        assert len(places) == count
        expected = frames[-1].contact_points()
        assert places.min() == pytest.approx(expected.min(), abs=1e-6)
        assert places.max() == pytest.approx(expected.max(), abs=1e-6)
        if body is CUBE:
            assert any(np.asarray(image.get_array())[..., 3].any() for image in axes.get_images())
        else:
            (bonds,) = (one for one in axes.collections if one.get_zorder() == 2.0 and isinstance(one, LineCollection))
            assert len(bonds.get_segments()) == count


# --- Summaries --------------------------------------------------------------------------------------------


def test_the_summary_says_what_they_are(run, tmp_path):
    path, frames = run
    rows, summed = summary.of_file(path), summary.numbers(path)
    assert rows["body"] == ("4 points, 6 links" if frames[0].body is CUBE else "3 points, 2 links")
    assert rows["what runs"].startswith(f"{COPIES} ")
    assert rows["links"] == "✓ they keep their lengths: the worst is off by 9·10⁻¹⁶ of it"
    assert "work of anchors" not in " ".join(rows.values())
    assert (summed["bodies"], summed["link_error"], summed["work"]) == (COPIES, 9e-16, 0.0)
    with swarm.load(path) as trajectory:
        recorded.record(trajectory, tmp_path / "run.rrd", recording.Settings())
    assert summary.of_recording(tmp_path / "run.rrd", False)["bodies"] == f"{COPIES} of {COPIES}"


def test_work_of_anchors_is_no_drift(tmp_path):
    """Work of led anchors is energy of the bodies; the verdict has both."""
    motion = swarm.Oscillation(amplitude=(0.0, 0.0, 0.01), frequency=1.0)
    led = swarm.Body([(0.0, 0.0, 0.0), (0.0, 0.0, -0.1)], 1.0, springs=[(0, 1, 50.0, 0.1)], anchors={0: motion})
    start = swarm.Bodies(led, led.points.T, np.zeros((3, 2)))
    write(tmp_path / "run.h5", [start, start])
    with edited(tmp_path / "run.h5") as file:
        file["observables/work/value"][:] = [0.0, 0.25]
        file["observables/total_energy/value"][:] = [1.0, 1.25]
    rows = summary.of_file(tmp_path / "run.h5")
    assert rows["body"] == "2 points, 1 spring, 1 anchor"
    assert "work of anchors 0.25 J" in rows["balance of energy"]
    with swarm.load(tmp_path / "run.h5") as trajectory:
        assert observables.drift(trajectory.observables) == 0.0
        lines = {line.path: line for line in series.lines_of(BOX, METHOD, [], trajectory.body)}
    assert lines["/energy/work"].values(np.array([1.0]), {"work": np.array([0.25])}) == [0.25]
    assert "/link_error" not in lines


def test_the_words_have_the_mass_of_a_body_and_the_speed_of_its_centre(tmp_path):
    body = swarm.Body([(0.0, 0.0, 0.0), (0.2, 0.0, 0.0)], mass=[3.0, 1.0], links=[(0, 1)])
    spins = np.array([[[0.0], [0.0]], [[-0.5], [1.5]], [[1.0], [1.0]]])
    start = swarm.Bodies(body, np.array(body.points).T[:, :, None], spins)
    scene = swarm.Scene([swarm.Sphere(2.0)])
    swarm.simulate(scene, start, swarm.Impact(dt=1e-3), until=2e-3, trajectory=tmp_path / "run.h5", compile="never")
    stated = summary.of_file(tmp_path / "run.h5")["what runs"]
    assert stated.endswith("of 4 kg, at the start with 1 m/s")
