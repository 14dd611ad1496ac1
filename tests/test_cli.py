"""The commands as a user types them, in processes of their own."""

import json
import os
import resource
import signal
import subprocess
import sys
import time

import pytest
from test_scene_file import GOOD

import swarm

pytestmark = pytest.mark.physics  # processes are too slow for the unit ring


def command(*args, cwd):
    return subprocess.run([sys.executable, "-m", "swarm", *args], cwd=cwd, capture_output=True, text=True, timeout=300)


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "scene.toml").write_text(GOOD)
    return tmp_path


def test_run_and_info(folder):
    done = command("run", "scene.toml", cwd=folder)
    assert (done.returncode, done.stderr) == (0, "")
    for word in ("impacts", "energy drift", "largest penetration", "wall time", "scene.h5 (3 frames)"):
        assert word in done.stdout
    with swarm.load(folder / "scene.h5") as trajectory:
        assert trajectory.scene_text == GOOD
    told = command("info", "scene.h5", cwd=folder)
    assert told.returncode == 0
    for word in ("3, 0 s to 1 s", "10", "Sphere(radius=0.5", "Impact("):
        assert word in told.stdout


def test_quiet_prints_nothing(folder):
    done = command("run", "scene.toml", "--quiet", "-o", "other.h5", cwd=folder)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert (folder / "other.h5").exists()


def test_record_view_plot_and_info(folder):
    assert command("run", "scene.toml", "--quiet", "--record", "run.rrd", cwd=folder).returncode == 0
    for words, told in (
        (["record", "scene.h5", "-o", "again.rrd"], "written to again.rrd"),
        (["info", "again.rrd"], "3, 0 s to 1 s"),
        (["info", "run.rrd"], "speed [m/s]"),
        (["view", "run.rrd", "-o", "sheet.png", "--times", "0,1", "--no-viewer"], "sheet.png; drawn by matplotlib"),
        (["plot", "scene.h5"], "written to scene.png"),
    ):
        done = command(*words, cwd=folder)
        assert (done.returncode, done.stderr) == (0, "")
        assert told in done.stdout
    for picture in ("sheet.png", "scene.png"):
        assert (folder / picture).read_bytes().startswith(b"\x89PNG")
    refused = command("run", "scene.toml", "--resume", "--record", "more.rrd", cwd=folder)
    assert refused.returncode == 2
    assert "recording and live cannot go on with a run that was stopped" in refused.stderr


def test_what_cannot_be_read_is_one_line_and_exit_code_2(folder):
    assert command("run", "scene.toml", "--quiet", cwd=folder).returncode == 0
    whole = (folder / "scene.h5").read_bytes()
    (folder / "damaged.h5").write_bytes(whole[:100] + bytes(900) + whole[1000:])
    (folder / "empty.rrd").touch()
    for words, told in (
        (["info", "damaged.h5"], "damaged.h5 is damaged: its structure: "),
        (["plot", "damaged.h5"], "damaged.h5 is damaged: its structure: "),
        (["record", "damaged.h5"], "damaged.h5 is damaged: its structure: "),
        (["run", "scene.toml", "-o", "damaged.h5", "--resume"], "damaged.h5 is damaged: its structure: "),
        (["info", "absent.h5"], "there is no file absent.h5; expected a trajectory (.h5)"),
        (["info", "."], ". is a folder; expected a trajectory (.h5)"),
        (["plot", "scene.toml"], "scene.toml is not an HDF5 file"),
        (["record", "absent.h5"], "there is no file absent.h5; expected a trajectory (.h5)"),
        (["view", "absent.rrd"], "there is no file absent.rrd; expected a recording (.rrd)"),
        (["view", "scene.h5"], "scene.h5 is not a recording of swarm"),
        (["info", "empty.rrd"], "empty.rrd is empty; expected a recording (.rrd)"),
    ):
        done = command(*words, cwd=folder)
        assert (done.returncode, done.stdout) == (2, "")
        assert done.stderr.startswith(f"error: {told}")
        assert len(done.stderr.splitlines()) == 1


def test_results_do_not_depend_on_threads(folder):
    for threads in ("1", "2"):
        assert command("run", "scene.toml", "--threads", threads, "-o", f"{threads}.h5", cwd=folder).returncode == 0
    with swarm.load(folder / "1.h5") as one, swarm.load(folder / "2.h5") as two:
        assert (one.frame(-1).position == two.frame(-1).position).all()


@pytest.mark.parametrize(
    ("old", "new", "args", "message"),
    [
        ("radius = 0.5", "radius = -1.0", [], "surface[0].radius must be above 0, got -1"),
        ("until = 1.0", "until = -1.0", [], "until must be after the start, 0 s, got -1"),
        ("every = 0.5", "every = 2.0", [], "every must be at most until = 1, got 2"),
        ("", "", ["-o", "nowhere/out.h5"], "the folder nowhere does not exist"),
        ("", "", ["--threads", "0"], "threads must be 1 or more, got 0"),
    ],
)
def test_bad_input_is_exit_code_2_and_touches_no_file(folder, old, new, args, message):
    (folder / "scene.toml").write_text(GOOD.replace(old, new))
    done = command("run", "scene.toml", *args, cwd=folder)
    assert done.returncode == 2
    assert message in done.stderr
    assert "Traceback" not in done.stderr
    assert [path.name for path in folder.iterdir()] == ["scene.toml"]


def test_existing_output_asks_for_overwrite(folder):
    (folder / "scene.h5").write_text("mine")
    done = command("run", "scene.toml", cwd=folder)
    assert done.returncode == 2
    assert "--overwrite" in done.stderr
    assert (folder / "scene.h5").read_text() == "mine"
    assert command("run", "scene.toml", "--overwrite", cwd=folder).returncode == 0


def test_version_and_help(folder):
    assert command("--version", cwd=folder).stdout == f"swarm {swarm.__version__}\n"
    told = command("--help", cwd=folder)
    assert told.returncode == 0
    assert "swarm run examples/scenes/cavity.toml" in told.stdout
    for name in ("run", "info", "record", "view", "plot"):
        assert "Example:" in command(name, "--help", cwd=folder).stdout


def test_help_does_not_import_the_engine(folder):
    """--help answers fast because neither Numba nor NumPy nor HDF5 is imported for it."""
    code = (
        "import sys, swarm.cli\n"
        "try: swarm.cli.app(['--help'])\n"
        "except SystemExit: pass\n"
        "print([name for name in ('numba', 'numpy', 'h5py', 'rich', 'msgspec') if name in sys.modules])"
    )
    told = subprocess.run([sys.executable, "-c", code], cwd=folder, capture_output=True, text=True, check=True)
    assert told.stdout.splitlines()[-1] == "[]"


def test_interrupt_keeps_finished_frames(folder, request):
    """SIGINT: exit code 130, and the file opens and holds whole frames."""
    (folder / "scene.toml").write_text(GOOD.replace("until = 1.0", "until = 1e7"))
    process = subprocess.Popen(
        [sys.executable, "-m", "swarm", "run", "scene.toml"],
        cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env={**os.environ, "PYTHONUNBUFFERED": "1"},
    )  # fmt: skip
    request.addfinalizer(process.kill)
    deadline = time.monotonic() + 200.0
    frames = 0
    while frames < 5 and time.monotonic() < deadline:
        time.sleep(0.2)
        if (folder / "scene.h5").exists():
            try:
                with swarm.load(folder / "scene.h5") as trajectory:
                    frames = len(trajectory)
            except swarm.SceneError:
                continue  # the very first moment, before the first flush
    process.send_signal(signal.SIGINT)
    _, told = process.communicate(timeout=60)
    assert process.returncode == 130
    assert b"interrupted" in told
    with swarm.load(folder / "scene.h5") as trajectory:
        assert len(trajectory) >= frames >= 5
        assert len(trajectory.frame(-1)) == 10


def test_wall_time_and_resume(folder):
    """Exit code 0 and how to go on; then the same frames as in one go, in all their bits."""
    text = GOOD.replace("until = 1.0", "until = 8e6").replace("every = 0.5", "every = 2e6")
    (folder / "scene.toml").write_text(text)
    first = command("run", "scene.toml", "--walltime", "0.2s", "--json", cwd=folder)
    assert first.returncode == 0
    assert "the wall time is over" in first.stderr
    told = json.loads(first.stdout)
    assert told["status"] == "walltime"
    assert told["resume"] == "swarm run scene.toml --walltime 0.2s --json --resume"
    assert (folder / "scene.h5.checkpoint").exists()
    assert command("run", "scene.toml", cwd=folder).returncode == 2
    second = command("run", "scene.toml", "--resume", "--json", cwd=folder)
    told = json.loads(second.stdout)
    assert (second.returncode, second.stderr) == (0, "")
    assert (told["status"], told["frames"], told["time"], told["particles"]) == ("complete", 5, 8e6, 10)
    assert told["impacts"] > 5e7
    assert told["energy_error"] < 1e-14
    assert sorted(path.name for path in folder.iterdir()) == ["scene.h5", "scene.toml"]
    third = command("run", "scene.toml", "--resume", cwd=folder)
    assert (third.returncode, third.stdout) == (0, "")
    assert "is complete" in third.stderr
    command("run", "scene.toml", "-o", "whole.h5", cwd=folder)
    with swarm.load(folder / "scene.h5") as one, swarm.load(folder / "whole.h5") as other:
        assert (one.frame(-1).position == other.frame(-1).position).all()
        for name, values in other.observables.items():
            assert (one.observables[name] == values).all()


def test_bad_wall_time_is_named(folder):
    done = command("run", "scene.toml", "--walltime", "soon", cwd=folder)
    assert done.returncode == 2
    assert """--walltime must be a time such as "2h", "1h30m" or "90s", got 'soon'""" in done.stderr


def test_a_full_disk_is_exit_code_1_and_the_run_goes_on_later(folder):
    """A limit of the size of files stands in for the disk."""
    text = GOOD.replace("count = 10", "count = 200").replace("until = 1.0", "until = 1e3")
    (folder / "scene.toml").write_text(text)
    # The kernels are not to be what is too large.
    whole = command("run", "scene.toml", "-o", "whole.h5", cwd=folder)
    assert (whole.returncode, whole.stderr) == (0, "")
    limit = 8_000_000
    done = subprocess.run(
        [sys.executable, "-m", "swarm", "run", "scene.toml"], cwd=folder, capture_output=True, text=True, timeout=100,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)),
    )  # fmt: skip
    assert done.returncode == 1
    assert done.stderr.startswith("error: cannot write frame ")
    assert len(done.stderr.splitlines()) == 1
    with swarm.load(folder / "scene.h5") as trajectory:
        assert 20 < len(trajectory) < 2001
    resumed = command("run", "scene.toml", "--resume", cwd=folder)
    assert (resumed.returncode, resumed.stderr) == (0, "")
    with swarm.load(folder / "scene.h5") as one, swarm.load(folder / "whole.h5") as other:
        assert len(one) == len(other) == 2001
        assert (one.frame(-1).position == other.frame(-1).position).all()


@pytest.mark.skipif(not os.path.isdir("/proc/self"), reason="a folder in which not even root can write")
def test_a_read_only_folder_is_exit_code_1(folder):
    done = command("run", "scene.toml", "-o", "/proc/self/scene.h5", cwd=folder)
    assert done.returncode == 1
    assert done.stderr.startswith("error: cannot write the trajectory /proc/self/scene.h5:")
    assert len(done.stderr.splitlines()) == 1
