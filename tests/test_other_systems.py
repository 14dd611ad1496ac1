"""What only some systems have is hidden, and what only some refuse is refused: runs, recordings, kills and resumes."""

import sys
import textwrap
import tomllib
from pathlib import Path

import h5py
import numpy as np
import pytest
from children import python

import swarm

pytestmark = pytest.mark.physics  # processes are too slow for the unit ring

# As on Windows: no fcntl, no pread and pwrite, no affinity; a trajectory that is open is neither renamed nor removed.
OTHER = """
    import os, signal, sys, warnings
    sys.modules["fcntl"] = None
    assert "filelock" not in sys.modules
    warnings.filterwarnings("ignore", "only soft file lock")  # filelock says that it has the locks of no system
    for name in ("pread", "pwrite", "preadv", "pwritev", "sched_getaffinity", "sched_setaffinity", "fork"):
        delattr(os, name)
    os.O_BINARY = 0

    def is_open(path):
        held = []
        for number in os.listdir("/proc/self/fd"):
            try:
                held.append(os.readlink(f"/proc/self/fd/{number}"))
            except OSError:
                pass  # the one that listed them
        return os.path.realpath(path) in held

    def refusing(function):
        def wrapped(path, *more, **others):
            if str(path).endswith(".h5") and is_open(path):
                raise PermissionError(13, "The process cannot access the file because it is being used", str(path))
            return function(path, *more, **others)
        return wrapped

    os.replace, os.rename, os.unlink, os.remove = map(refusing, (os.replace, os.rename, os.unlink, os.remove))
    import swarm
    scene = swarm.Scene([swarm.Sphere(0.5)])
    start = swarm.fill(scene, 20, speed=1.0, seed=1)

    def run(path, at=None, number=None, **more):
        def progress(frame):
            if frame.number == at:
                os.kill(os.getpid(), number)
        return swarm.simulate(scene, start, swarm.Impact(), until=4.0, every=0.5, trajectory=path, checkpoint=60.0,
                              progress=progress, **more)
"""


def elsewhere(folder, code):
    program = textwrap.dedent(OTHER) + textwrap.dedent(code)
    return python("-c", program, cwd=folder, bare=True)


@pytest.mark.skipif(not Path("/proc/self/fd").is_dir(), reason="what is open is looked up in /proc")
def test_a_run_is_recorded_killed_and_resumed(tmp_path):
    stopped = elsewhere(tmp_path, "run('run.h5', 2, signal.SIGTERM)")
    assert "KeyboardInterrupt" in stopped.stderr
    assert (tmp_path / "run.h5.checkpoint").exists()
    killed = elsewhere(tmp_path, "run('run.h5', 5, signal.SIGKILL, resume=True)")
    assert (killed.returncode, killed.stderr) == (-9, "")
    whole = "run('whole.h5', recording='whole.rrd')\nprint(swarm.load('whole.h5').times[-1])"
    resumed = elsewhere(tmp_path, f"run('run.h5', resume=True)\n{whole}")
    assert (resumed.returncode, resumed.stdout, resumed.stderr) == (0, "4.0\n", "")
    assert sorted(file.name for file in tmp_path.iterdir()) == ["run.h5", "whole.h5", "whole.rrd"]
    with swarm.load(tmp_path / "run.h5") as one, swarm.load(tmp_path / "whole.h5") as other:
        assert one.times.tolist() == other.times.tolist() == [0.5 * k for k in range(9)]
        assert np.array_equal(one.frame(-1).position, other.frame(-1).position)
    overwritten = elsewhere(tmp_path, "run('run.h5', overwrite=True)")
    assert (overwritten.returncode, overwritten.stderr) == (0, "")
    assert sorted(file.name for file in tmp_path.iterdir()) == ["run.h5", "whole.h5", "whole.rrd"]


@pytest.mark.skipif(not Path("/proc/self/fd").is_dir(), reason="what is open is looked up in /proc")
def test_no_second_run_writes_the_same_file(tmp_path):
    code = """
        def meddle(frame):
            try:
                run("run.h5", overwrite=True)
            except swarm.FileError as error:
                print(error)
        swarm.simulate(scene, start, swarm.Impact(), until=1.0, trajectory="run.h5", progress=meddle)
    """
    done = elsewhere(tmp_path, code)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.count("run.h5 is being written by another run") == 2
    with h5py.File(tmp_path / "run.h5") as file:
        assert file["parameters/time"].shape == (2,)


def test_the_version_that_runs_is_declared():
    project = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text())["project"]
    versions = [name.rpartition(" ")[2] for name in project["classifiers"] if "Python :: 3." in name]
    assert f"{sys.version_info.major}.{sys.version_info.minor}" in versions
    assert project["requires-python"] == f">={versions[0]}"
