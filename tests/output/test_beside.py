"""Files that others have open in the same process, before, while and after they are written and read."""

import signal
import threading

import h5py
import MDAnalysis
import numpy as np
import pytest

import swarm
from swarm.files import driver, stored, writer

SCENE = swarm.Scene(surfaces=[swarm.Sphere(0.5)])
START = swarm.fill(SCENE, 4, speed=0.5, seed=1)


def run(path, **options):
    options = {"until": 0.5, "every": 0.1, "compile": "never", "trajectory": path, **options}
    return swarm.simulate(SCENE, START, swarm.Impact(), **options)


def universe(path):
    universe = MDAnalysis.Universe.empty(4, trajectory=True, velocities=True)
    universe.load_new(str(path), format="H5MD", convert_units=False)
    return universe.trajectory


READERS = {
    "load": swarm.load,
    "h5py": h5py.File,
    "h5py, locks": lambda path: h5py.File(path, locking=True),
    "h5py, no locks": lambda path: h5py.File(path, locking=False),
    "h5py, SWMR": lambda path: h5py.File(path, swmr=True),
    "MDAnalysis": universe,
}


def frames_of(opened):
    if isinstance(opened, swarm.Trajectory):
        assert np.isfinite(opened.frame(-1).position).all()
    return len(opened["parameters/time"] if isinstance(opened, h5py.File) else opened)


@pytest.fixture
def written(monkeypatch):
    """Set when three frames are on file."""
    event, write = threading.Event(), writer.TrajectoryWriter._write

    def noted(self, frames):
        write(self, frames)
        if frames[-1][0] >= 2:
            event.set()

    monkeypatch.setattr(writer.TrajectoryWriter, "_write", noted)
    return event


@pytest.mark.parametrize("name", READERS)
def test_every_reader_reads_what_this_process_writes(tmp_path, name, written):
    path, seen = tmp_path / "run.h5", []

    def look(frame):
        if frame.number == 3:
            assert written.wait(600.0)
            with swarm.load(path) as first:
                opened = READERS[name](path)
                with swarm.load(path) as last:
                    seen.extend([frames_of(first), frames_of(opened), frames_of(last)])
                opened.close()

    run(path, progress=look)
    assert len(seen) == 3
    assert min(seen) >= 3
    assert not driver.has_open(path)
    with swarm.load(path) as trajectory:
        assert frames_of(trajectory) == 6


@pytest.mark.parametrize("name", READERS)
def test_a_run_is_resumed_while_its_file_is_open(tmp_path, name):
    path = tmp_path / "run.h5"

    def stop(frame):
        if frame.number == 3:
            signal.raise_signal(signal.SIGTERM)

    with pytest.raises(KeyboardInterrupt):
        run(path, progress=stop, checkpoint=600.0)
    opened = READERS[name](path)
    result = run(path, resume=True)
    opened.close()
    assert len(result.observables["time"]) == 6
    with swarm.load(path) as trajectory:
        np.testing.assert_array_equal(trajectory.frame(-1).position, result.particles.position)


def test_a_trajectory_that_is_opened_again_has_what_was_written_since(tmp_path):
    path = tmp_path / "run.h5"
    test_a_run_is_resumed_while_its_file_is_open(tmp_path, "h5py")
    whole = path.read_bytes()
    with h5py.File(path, "r+") as file:
        for name in ("frame", "time"):
            file[f"parameters/{name}"].resize((3,))
    with swarm.load(path) as old:
        path.write_bytes(whole)  # the same file, as another process writes it
        with swarm.load(path) as new:
            assert (len(old), len(new)) == (3, 6)
            np.testing.assert_array_equal(old.frame(2).position, new.frame(2).position)


@pytest.mark.parametrize("name", READERS)
def test_a_run_replaces_a_file_that_is_open(tmp_path, name):
    path = tmp_path / "run.h5"
    run(path, until=0.2)
    opened = READERS[name](path)
    run(path, overwrite=True)
    assert frames_of(opened) == 3
    opened.close()
    with swarm.load(path) as trajectory:
        assert len(trajectory) == 6


@pytest.mark.parametrize("name", READERS)
def test_virtual_datasets_are_read_beside_their_sources(tmp_path, name):
    """As of a joined trajectory: the sources are opened by the driver of the file that names them."""
    path, joined = tmp_path / "x.shards" / "0000.h5", tmp_path / "joined.h5"
    path.parent.mkdir()
    result = run(path)
    value = "particles/all/position/value"
    layout = h5py.VirtualLayout((6, 4, 3), "f8")
    layout[:] = h5py.VirtualSource("x.shards/0000.h5", value, shape=(6, 4, 3))
    with h5py.File(joined, "w", libver="latest") as file:
        file.create_virtual_dataset(value, layout, fillvalue=np.nan)
    options = {"driver": driver.NAME, "locking": False, "rdcc_nbytes": 0}
    before = READERS[name](path)
    with h5py.File(joined, "r", **options) as file:
        np.testing.assert_array_equal(file[value][-1].T, result.particles.position)
        after = READERS[name](path)
        np.testing.assert_array_equal(file[value][-1].T, result.particles.position)
        # What joins files is not opened as a Python object, of which HDF5 makes no path.
        with stored.open_stored(joined) as again:
            np.testing.assert_array_equal(again[value][-1].T, result.particles.position)
    assert frames_of(before) == frames_of(after) == 6
    before.close()
    after.close()


def test_mdanalysis_reads_a_cell_float32_and_bodies(tmp_path):
    cell = swarm.Scene(surfaces=[swarm.Sphere(0.2, side="outside")], period=(1.0, 1.0, 1.0))
    gas = swarm.fill(cell, 4, speed=0.5, seed=1)
    path = tmp_path / "cell.h5"
    swarm.simulate(
        cell, gas, swarm.Impact(), until=0.2, every=0.1, compile="never", trajectory=path, precision="float32"
    )
    found = universe(path)
    with swarm.load(path) as trajectory:
        for k, moment in enumerate(found):
            assert moment.time == trajectory.times[k]
            np.testing.assert_array_equal(moment.positions.T, trajectory.frame(k).position)
            np.testing.assert_array_equal(moment.velocities.T, trajectory.frame(k).velocity)
            assert moment.dimensions.tolist() == [1.0, 1.0, 1.0, 90.0, 90.0, 90.0]
    found.close()


def test_mdanalysis_finds_nothing_where_no_particles_are_kept(tmp_path):
    path = tmp_path / "none.h5"
    run(path, frames="none")
    with pytest.raises(Exception, match="particles"):
        universe(path)
