"""Particles that come during a run in files, pictures and exports: not yet there, they are nowhere."""

import numpy as np
import pytest
from conftest import edited

import swarm
from swarm.commands.summary import numbers
from swarm.scene_file import read
from swarm.words import facts, titles
from swarm.words.content import content_of

BOX = swarm.Scene([swarm.Box((0.5, 0.5, 0.5))])
# One more at each frame.
TIMES = (0.2, 0.45, 0.7, 0.8)


@pytest.fixture(scope="module", params=["none", "some"])
def path(request, tmp_path_factory):
    """A run with no particle at the start, or two."""
    target = tmp_path_factory.mktemp("run") / "run.h5"
    start = None if request.param == "none" else swarm.fill(BOX, 2, speed=1.0, seed=1)
    source = swarm.Source(0, times=TIMES, temperature=1.0)
    recording = {"recording": target.with_suffix(".rrd"), "record_color": "energy-error"}
    if request.param == "none":
        recording = {}
    swarm.simulate(
        BOX,
        start,
        swarm.Impact(),
        until=1.0,
        every=0.25,
        trajectory=target,
        sources=source,
        compile="never",
        **recording,
    )
    return target


def given(path):
    return 0 if "energy" not in path.name and not path.with_suffix(".rrd").exists() else 2


def test_frames(path):
    n = given(path)
    with swarm.load(path) as trajectory:
        np.testing.assert_array_equal(trajectory.birth_time, [0.0] * n + list(TIMES))
        np.testing.assert_array_equal(trajectory.birth_source, [-1] * n + [0] * 4)
        for k, there in enumerate([0, 1, 2, 3, 4]):
            frame = trajectory.frame(k)
            lacks = np.arange(n + 4) >= n + there
            for rows in (frame.position, frame.velocity):
                np.testing.assert_array_equal(np.isnan(rows), np.broadcast_to(lacks, rows.shape))
            np.testing.assert_array_equal(trajectory.columns(k)["position"].T, frame.position)
            born = frame.born()
            assert (len(born), born.velocity.shape) == (n + there, (3, n + there))
            assert np.isfinite(born.position).all()
        position, _velocity = trajectory.particle(n + 1)
        assert np.isnan(position).sum(axis=1).tolist() == [2, 2, 2]
        seen = trajectory.observables
        np.testing.assert_array_equal(seen["born"][:, 0], [0, 1, 2, 3, 4])
        assert seen["kinetic_energy"][0] == pytest.approx(0.5 * n)


def test_damage_is_still_found(path, tmp_path):

    copy = tmp_path / "copy.h5"
    copy.write_bytes(path.read_bytes())
    with edited(copy) as file:
        file["particles/all/position/value"][4, -1, 1] = np.nan
    with swarm.load(copy) as trajectory:
        trajectory.frame(3)
        for read_it in (
            lambda: trajectory.frame(4),
            lambda: trajectory.columns(4),
            lambda: trajectory.particle(given(path) + 3),
        ):
            with pytest.raises(swarm.SceneError, match="damaged"):
                read_it()


def test_a_start_from_a_frame_has_those_that_are_there(path, tmp_path):
    text = f"""
        [particles]
        from = "{path}"
        frame = 2
        [[surface]]
        kind = "box"
        half_widths = [0.5, 0.5, 0.5]
        [method]
        kind = "impact"
        [run]
        until = 1.0
    """
    (tmp_path / "scene.toml").write_text(text)
    assert len(read(tmp_path / "scene.toml").start()) == given(path) + 2


def test_a_start_from_a_frame_in_which_nobody_is(path, tmp_path):
    with swarm.load(path) as trajectory:
        text = repr(trajectory.frame(0).born())
        assert text == f"Particles({given(path)})"
        assert trajectory.frame(0).born()._repr_html_().count("0 particles") == (given(path) == 0)
    if given(path):
        return
    (tmp_path / "scene.toml").write_text(
        f'particles = {{from = "{path}", frame = 0}}\nsurface = [{{kind = "sphere", radius = 9.0}}]\n'
        'method.kind = "impact"\nrun.until = 1.0\n'
    )
    with pytest.raises(
        swarm.SceneError, match=r"no particle is in the scene at frame 0 of .*run\.h5; choose a later one"
    ):
        read(tmp_path / "scene.toml").start()


def test_tables_and_arrays(path):
    n = given(path)
    with swarm.load(path) as trajectory:
        assert trajectory.table()["born_0"].tolist() == [0, 1, 2, 3, 4]
        dataset = trajectory.to_xarray()
        assert np.isnan(dataset.position.values).sum() == 3 * (4 + 3 + 2 + 1)
        np.testing.assert_array_equal(dataset.birth_time.values[n:], TIMES)
        assert dataset.born.dims == ("time", "source")
        statements = facts.of_trajectory(trajectory)
    assert statements["born"] == "source 0: 4"
    assert statements["source 0"] == "4 particles of 1 kg, from 0.2 to 0.8 s, 5 a second"
    assert "4 of them from sources" in statements["particles"]
    found = numbers(path)
    assert found["born"] == [4]
    assert found["source_energy"] > 0.0
    assert found["energy_drift"] < 1e-14


def test_exports(path, tmp_path):
    import h5py

    n = given(path)
    counts = [n, n + 1, n + 2, n + 3, n + 4]
    with swarm.load(path) as trajectory:
        (xyz,) = trajectory.export(tmp_path / "run.xyz")
        vtk = trajectory.export(tmp_path / "run.vtkhdf")[0]
        (gsd_file,) = trajectory.export(tmp_path / "run.gsd")
        last = trajectory.frame(-1)
    lines = xyz.read_text().splitlines()
    for count in counts:
        assert int(lines[0]) == count
        assert not any("nan" in line.split()[1:7] for line in lines[2 : 2 + count])
        lines = lines[2 + count :]
    assert not lines
    gsd = pytest.importorskip("gsd.hoomd")
    with gsd.open(str(gsd_file)) as file:
        assert [frame.particles.N for frame in file] == counts
        np.testing.assert_array_equal(file[2].log["particles/id"], np.arange(n + 2))
        np.testing.assert_allclose(file[-1].particles.velocity, last.velocity.T, rtol=1e-6)
    with h5py.File(vtk) as file:
        assert file["VTKHDF/NumberOfPoints"][()].tolist() == counts
        assert np.isfinite(file["VTKHDF/Points"][()]).all()


def test_pictures(path, tmp_path):
    with swarm.load(path) as trajectory:
        figure = trajectory.plot()
        figure.savefig(tmp_path / "run.png")
        assert trajectory.animate(tmp_path / "run.gif", size=(160, 120)).stat().st_size > 1000


def test_recordings(path, tmp_path):
    pytest.importorskip("rerun")
    from swarm.recording.playback import Playback
    from swarm.recording.recorded import record
    from swarm.recording.writer import Settings

    n = given(path)
    with swarm.load(path) as trajectory:
        record(trajectory, tmp_path / "later.rrd", Settings())
        with pytest.raises(swarm.SceneError, match="its first frame lacks the energy"):
            record(trajectory, tmp_path / "errors.rrd", Settings(color="energy-error"))
    held = [tmp_path / "later.rrd", *([path.with_suffix(".rrd")] if n else [])]
    for file in held:
        played = Playback(file)
        positions, _colours = played.frame(2)
        assert np.isnan(positions[:, 0]).tolist() == [False] * (n + 2) + [True] * 2
    # Where all particles are born during the run the scale is of those born so far.
    with swarm.load(path) as trajectory:
        speeds = np.linalg.norm(trajectory.frame(-1).velocity, axis=0)
        assert 1.3 < Playback(held[0]).about["high"] / np.sqrt((speeds**2).mean()) < 1.7 or n


def test_a_part_of_the_particles_is_kept(tmp_path):
    source = swarm.Source(0, rate=40.0, temperature=1.0)
    start = swarm.fill(BOX, 5, speed=1.0, seed=1)
    more = {"until": 1.0, "every": 0.5, "sources": source, "compile": "never", "seed": 3}
    result = swarm.simulate(BOX, start, swarm.Impact(), trajectory=tmp_path / "run.h5", frames=3, **more)
    with swarm.load(tmp_path / "run.h5") as trajectory:
        np.testing.assert_array_equal(trajectory.birth_time, result.birth_time[::3])
        late = np.isnan(trajectory.frame(1).position[0])
        np.testing.assert_array_equal(late, trajectory.birth_time > 0.5)


def test_a_log_of_impacts_has_those_of_births(tmp_path):
    """Each after its birth; the first of one that is born on a wall is at another place."""
    source = swarm.Source(0, rate=200.0, temperature=1.0)
    result = swarm.simulate(
        BOX,
        None,
        swarm.Impact(),
        until=1.0,
        every=0.25,
        impacts=tmp_path / "impacts.h5",
        sources=source,
        compile="never",
    )
    with swarm.load_impacts(tmp_path / "impacts.h5") as log:
        table = log.table()
    assert len(table) == result.observables["impacts"][-1] > 100
    assert (table["time"] > result.birth_time[table["particle"]]).all()


def test_frames_of_a_result_are_of_those_that_are_there(tmp_path):
    """As those of a run under way."""
    counts = []
    source = swarm.Source(0, rate=200.0, temperature=1.0)
    result = swarm.simulate(
        BOX, None, swarm.Impact(), until=1.0, every=0.25, trajectory=tmp_path / "run.h5", sources=source,
        compile="never", progress=lambda frame: counts.append(frame.position.shape[1]),
    )  # fmt: skip
    assert counts == [frame.position.shape[1] for frame in result.frames]
    assert counts == result.observables["born"][:, 0].tolist()
    assert not any(np.isnan(frame.velocity).any() for frame in result.frames)


def test_titles_count_the_balls_that_have_come(tmp_path):
    """A ball that stays in the place of the others keeps them from coming."""
    source = swarm.Source(
        swarm.Box((0.01, 0.01, 0.01)), volume=True, times=TIMES, speed=1e-3, radius=0.1, density=1.0, blocked="wait"
    )
    seen = swarm.simulate(
        BOX, None, swarm.Impact(), until=1.0, every=0.5, trajectory=tmp_path / "run.h5", sources=source, compile="never"
    ).observables
    assert seen["born"][-1, 0] == 1
    with swarm.load(tmp_path / "run.h5") as trajectory:
        assert trajectory.count == len(TIMES)
        assert titles.title(content_of(trajectory)).startswith("1 ball of 0.1 m radius from sources")
