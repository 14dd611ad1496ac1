"""The HDF5 file: its layout, what comes back from it, and what happens when it cannot be written."""

import importlib.util
import subprocess
import sys
import time

import h5py
import numpy as np
import pytest
from children import python
from same_bits import require_same_observables

import swarm

SCENE = swarm.Scene(
    surfaces=[swarm.Ellipsoid((0.3, 0.3, 0.6)), swarm.Sphere(0.1, (0.0, 0.0, 0.1), "outside")],
    gravity=(0.0, 0.0, -1.0),
)
METHOD = swarm.Penalty(dt=0.01, penalty=1e4, exponent=1.5)


@pytest.fixture
def run(tmp_path):
    particles = swarm.fill(SCENE, 30, speed=0.3, mass=np.linspace(1.0, 2.0, 30), seed=4)
    path = tmp_path / "run.h5"
    return path, particles, swarm.simulate(SCENE, particles, METHOD, until=0.5, every=0.2, trajectory=path)


def test_everything_comes_back(run):
    path, particles, result = run
    with swarm.load(path) as trajectory:
        assert len(trajectory) == 4
        np.testing.assert_array_equal(trajectory.times, [0.0, 0.2, 0.4, 0.5])
        assert trajectory.scene == SCENE
        assert trajectory.method == METHOD
        assert trajectory.scene_text is None
        np.testing.assert_array_equal(trajectory.frame(0).position, particles.position)
        np.testing.assert_array_equal(trajectory.frame(-1).position, result.particles.position)
        np.testing.assert_array_equal(trajectory.frame(3).velocity, result.particles.velocity)
        np.testing.assert_array_equal(trajectory.frame(1).mass, particles.mass)
        assert (trajectory.impacts(-1).dtype, trajectory.impacts(0).tolist()) == (np.int64, [0] * 30)
        np.testing.assert_array_equal(trajectory.impacts(-1), result.impacts_per_particle)
        assert [trajectory.impacts(k).sum() for k in range(4)] == result.observables["impacts"].tolist()
        require_same_observables(trajectory, result)
        with pytest.raises(swarm.SceneError, match=r"frame must lie between -4 and 3, got 4"):
            trajectory.frame(4)
        with pytest.raises(swarm.SceneError, match=r"frame must lie between -4 and 3, got -5"):
            trajectory.impacts(-5)


def test_the_seed_comes_back_and_older_files_have_none(tmp_path):
    particles, path = swarm.fill(SCENE, 3, speed=0.3), tmp_path / "run.h5"
    swarm.simulate(SCENE, particles, METHOD, until=0.1, trajectory=path, seed=2**64 - 1)
    with swarm.load(path) as trajectory:
        assert trajectory.seed == 2**64 - 1
    with h5py.File(path, "r+") as file:
        del file["parameters/seed"]
    with swarm.load(path) as trajectory:
        assert trajectory.seed == 0


def test_layout_is_h5md(run):
    """H5MD 1.1: version, creator, box without edges, and step, time, value of one length in every element."""
    path, _, _ = run
    with h5py.File(path) as file:
        assert file["h5md"].attrs["version"].tolist() == [1, 1]
        assert file["h5md/creator"].attrs["name"] == "swarm"
        box = file["particles/all/box"]
        assert box.attrs["dimension"] == 3
        assert list(box.attrs["boundary"]) == ["none"] * 3
        assert "edges" not in box
        parts = [file[f"particles/all/{name}"] for name in ("position", "velocity", "impacts")]
        elements = [*parts, *file["observables"].values()]
        for element in elements:
            assert {"step", "time", "value"} == set(element)
            assert element["value"].shape[0] == element["step"].shape[0] == element["time"].shape[0] == 4
        assert file["particles/all/position/value"].shape == (4, 30, 3)
        assert list(file["particles/all/position/value"].attrs) == ["swarm_unit"]


def wait_for(path, frames):
    """Return when a file that is being written holds so many frames."""
    for _ in range(60_000):
        if path.exists():
            with swarm.load(path) as trajectory:
                if len(trajectory) >= frames:
                    return
        time.sleep(0.01)
    pytest.fail(f"after ten minutes there are no {frames} frames")


def test_a_file_being_written_can_be_read(tmp_path):
    """Every frame is flushed, so another process sees all frames so far."""
    path = tmp_path / "run.h5"
    code = "import swarm, sys\nfor line in sys.stdin: print(len(swarm.load(line.strip())), flush=True)"
    with subprocess.Popen([sys.executable, "-c", code], stdin=-1, stdout=-1, text=True, bufsize=1) as reader:
        seen = []

        def look(frame):
            if frame.number in (0, 3):
                wait_for(path, frame.number + 1)
                reader.stdin.write(f"{path}\n")
                seen.append(int(reader.stdout.readline()))

        particles = swarm.fill(SCENE, 5, speed=0.3)
        swarm.simulate(SCENE, particles, METHOD, until=0.04, every=0.01, trajectory=path, progress=look)
        reader.stdin.close()
    assert seen == [1, 4]


def test_refused_before_anything_is_touched(tmp_path):
    particles = swarm.fill(SCENE, 5, speed=0.3)
    present = tmp_path / "present.h5"
    present.write_bytes(b"mine")
    for path, message in (
        (present, r"present\.h5 exists.*--overwrite"),
        (tmp_path / "nowhere" / "run.h5", r"folder .*nowhere does not exist"),
        (tmp_path, r"expected a file name, got the folder"),
    ):
        with pytest.raises(swarm.SceneError, match=message):
            swarm.simulate(SCENE, particles, METHOD, until=0.1, trajectory=path)
    with pytest.raises(swarm.SceneError, match=r"^dt|until must be a whole number of steps"):
        swarm.simulate(SCENE, particles, METHOD, until=0.105, trajectory=present, overwrite=True)
    with pytest.raises(swarm.SceneError, match=r"present\.h5 is not a trajectory of swarm"):
        swarm.simulate(SCENE, particles, METHOD, until=0.1, trajectory=present, overwrite=True)
    assert present.read_bytes() == b"mine"
    present.write_bytes(b"")
    swarm.simulate(SCENE, particles, METHOD, until=0.1, trajectory=present, overwrite=True)
    with swarm.load(present) as trajectory:
        assert len(trajectory) == 2


def test_other_files_are_refused(tmp_path):
    text, other = tmp_path / "text.h5", tmp_path / "other.h5"
    text.write_text("no HDF5")
    with h5py.File(other, "w") as file:
        file["x"] = 1
    with pytest.raises(swarm.SceneError, match=r"text\.h5 is not an HDF5 file"):
        swarm.load(text)
    with pytest.raises(swarm.SceneError, match=r"not a trajectory of swarm"):
        swarm.load(other)
    with pytest.raises(swarm.SceneError, match=r"there is no file .*absent\.h5"):
        swarm.load(tmp_path / "absent.h5")


@pytest.mark.parametrize("compression", ["none", "gzip", "lzf"])
def test_every_kth_particle_in_half_the_precision(tmp_path, compression):
    particles = swarm.fill(SCENE, 30, speed=0.3, mass=np.linspace(1.0, 2.0, 30), seed=4)
    exact, small = tmp_path / "exact.h5", tmp_path / "small.h5"
    swarm.simulate(SCENE, particles, METHOD, until=0.4, every=0.1, trajectory=exact)
    storage = {"frames": 7, "precision": "float32", "compression": compression}
    swarm.simulate(SCENE, particles, METHOD, until=0.4, every=0.1, trajectory=small, **storage)
    with swarm.load(exact) as whole, swarm.load(small) as part:
        assert (len(part), part.count, len(part.frame(0))) == (5, 30, 5)
        for k in range(5):
            expected = whole.frame(k).position[:, ::7].astype(np.float32)
            np.testing.assert_array_equal(part.frame(k).position, expected)
        np.testing.assert_array_equal(part.frame(0).mass, particles.mass[::7])
        np.testing.assert_array_equal(part.impacts(-1), whole.impacts(-1)[::7])
        for mine, its in zip(part.particle(14), whole.particle(14), strict=True):
            assert mine.shape == (3, 5)
            np.testing.assert_array_equal(mine, its.astype(np.float32))
        require_same_observables(part, whole)
        with pytest.raises(swarm.SceneError, match="one of the 5 that the file keeps, from 0 to 28, got 15"):
            part.particle(15)
    with h5py.File(small) as file:
        value = file["particles/all/position/value"]
        assert (value.dtype, value.compression) == (np.float32, None if compression == "none" else compression)
        assert file["particles/all/id"][()].tolist() == [0, 7, 14, 21, 28]


def test_observables_alone(tmp_path):
    particles = swarm.fill(SCENE, 30, speed=0.3, seed=4)
    result = swarm.simulate(
        SCENE, particles, METHOD, until=0.4, every=0.1, trajectory=tmp_path / "run.h5", frames="none"
    )
    with swarm.load(tmp_path / "run.h5") as trajectory:
        assert (len(trajectory), trajectory.count) == (5, 30)
        np.testing.assert_array_equal(trajectory.observables["total_energy"], result.observables["total_energy"])
        with pytest.raises(swarm.SceneError, match='keeps no particles: it was run with frames = "none"'):
            trajectory.frame(0)
        with pytest.raises(swarm.SceneError, match='keeps no particles: it was run with frames = "none"'):
            trajectory.impacts(0)


@pytest.mark.parametrize(
    ("storage", "message"),
    [
        ({"frames": "some"}, 'frames must be "all", "none", or k for every k-th particle, got \'some\''),
        ({"frames": 0}, "frames must be 1 or more, got 0"),
        ({"precision": "float16"}, "precision must be one of 'float32' and 'float64', got 'float16'"),
        ({"compression": "zip"}, "compression must be one of .* got 'zip'; did you mean 'gzip'"),
    ],
)
def test_bad_storage_is_named(tmp_path, storage, message):
    particles = swarm.fill(SCENE, 5, speed=0.3)
    with pytest.raises(swarm.SceneError, match=message):
        swarm.simulate(SCENE, particles, METHOD, until=0.1, trajectory=tmp_path / "run.h5", **storage)
    assert list(tmp_path.iterdir()) == []


OTHERS = """
import sys, warnings
import h5py
with h5py.File(sys.argv[1], locking=False) as file:
    print(len(file["particles/all/position/value"]), file["observables/total_energy/value"][0] > 0.0)
if len(sys.argv) > 2:
    warnings.simplefilter("ignore")
    import MDAnalysis
    universe = MDAnalysis.Universe.empty(30, trajectory=False)
    universe.load_new(sys.argv[1], format="H5MD", convert_units=False)
    print(universe.trajectory.n_frames, universe.trajectory[1].positions.shape, universe.trajectory[1].has_velocities)
"""


@pytest.mark.physics
def test_other_programs_read_it_while_the_run_goes_on(tmp_path):
    """h5py, and MDAnalysis where it is installed, in processes of their own, with nothing swarm has to tell them."""
    path, messages = tmp_path / "run.h5", []
    with_mdanalysis = [] if importlib.util.find_spec("MDAnalysis") is None else ["MDAnalysis"]

    def look(frame):
        if frame.number == 3:
            wait_for(path, 4)
            messages.append(python("-c", OTHERS, path, *with_mdanalysis))

    particles = swarm.fill(SCENE, 30, speed=0.3)
    swarm.simulate(SCENE, particles, METHOD, until=0.05, every=0.01, trajectory=path, progress=look)
    assert (messages[0].returncode, messages[0].stderr) == (0, "")
    assert messages[0].stdout.splitlines() == ["4 True", *(["4 (30, 3) True"] if with_mdanalysis else [])]


def test_places_velocities_masses_and_times_say_their_unit(tmp_path):
    """By a name of our own: of H5MD's `unit` MDAnalysis takes no metres."""
    scene = swarm.Scene([swarm.Sphere(0.5)])
    swarm.simulate(scene, swarm.fill(scene, 3, speed=1.0), swarm.Impact(), until=0.2, trajectory=tmp_path / "run.h5")
    with h5py.File(tmp_path / "run.h5") as file:
        group = file["particles/all"]
        of = {"position/value": b"m", "velocity/value": b"m/s", "mass": b"kg", "position/time": b"s"}
        assert {name: group[name].attrs["swarm_unit"] for name in of} == of
