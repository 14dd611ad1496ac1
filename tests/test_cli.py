"""The commands as a user types them."""

import contextlib
import io
import json
import os
import re
import signal
import subprocess
import sys
import time
from contextlib import redirect_stderr, redirect_stdout
from unittest import mock

import numba
import pytest
from children import python
from same_bits import require_same_observables
from test_scene_file import GOOD

import swarm
from swarm.commands import cli
from swarm.run import machine

compiled_only = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="NUMBA_DISABLE_JIT is set")
pytestmark = pytest.mark.physics  # processes are too slow for the unit ring


def process(*args, cwd, **more):
    """A command in a process of its own."""
    done = python("-m", "swarm", *args, cwd=cwd, **more)
    # Whether it compiles depends on what ran before.
    lines = done.stderr.splitlines(keepends=True)
    done.stderr = "".join(line for line in lines if not line.startswith("compiling"))
    return done


def command(*args, cwd):
    """The same without what a process takes to begin, a second: in this one."""
    handler = signal.getsignal(signal.SIGINT)
    out, err = io.StringIO(), io.StringIO()
    words = mock.patch.object(sys, "argv", ["swarm", *args])
    # A shell starts what is in its background with SIGINT ignored.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with contextlib.chdir(cwd), redirect_stdout(out), redirect_stderr(err), words, pytest.raises(SystemExit) as end:
            cli.main()
    finally:
        # `main` leaves a SIGINT to end the process.
        signal.signal(signal.SIGINT, handler)
    lines = err.getvalue().splitlines(keepends=True)
    errors = "".join(line for line in lines if not line.startswith("compiling"))
    return subprocess.CompletedProcess(args, end.value.code or 0, out.getvalue(), errors)


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "scene.toml").write_text(GOOD)
    return tmp_path


def test_run_and_info(folder):
    done = process("run", "scene.toml", cwd=folder)
    assert (done.returncode, done.stderr) == (0, "")
    for word in ("impacts", "energy", "✓ no particle was outside", "wall time", "scene.h5"):
        assert word in done.stdout
    with swarm.load(folder / "scene.h5") as trajectory:
        assert trajectory.scene_text == GOOD
    info = command("info", "scene.h5", cwd=folder)
    assert info.returncode == 0
    for word in ("3, 0 s to 1 s", "10", "a sphere of radius 0.5 m", "Impact"):
        assert word in info.stdout


def test_quiet_prints_nothing(folder):
    done = command("run", "scene.toml", "--quiet", "-o", "other.h5", cwd=folder)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert (folder / "other.h5").exists()


def test_record_view_plot_and_info(folder):
    assert command("run", "scene.toml", "--quiet", "--record", "run.rrd", cwd=folder).returncode == 0
    for words, line in (
        (["record", "scene.h5", "-o", "again.rrd"], "written to again.rrd"),
        (["info", "again.rrd"], "3, 0 s to 1 s"),
        (["info", "run.rrd"], "speed [m/s]"),
        (["view", "run.rrd", "-o", "sheet.png", "--times", "0,1", "--no-viewer"], "sheet.png; drawn by matplotlib"),
        (["plot", "scene.h5"], "written to scene.png"),
    ):
        done = command(*words, cwd=folder)
        assert (done.returncode, done.stderr) == (0, "")
        assert line in done.stdout
    for picture in ("sheet.png", "scene.png"):
        assert (folder / picture).read_bytes().startswith(b"\x89PNG")
    refused = command("record", "scene.h5", "-o", "scene.h5", "--overwrite", cwd=folder)
    assert (refused.returncode, "recording: scene.h5 is also the trajectory" in refused.stderr) == (2, True)
    refused = command("run", "scene.toml", "--resume", "--record", "more.rrd", cwd=folder)
    assert refused.returncode == 2
    assert "recording and live cannot continue a run that was stopped" in refused.stderr


def test_what_cannot_be_read_is_one_line_and_exit_code_2(folder):
    assert command("run", "scene.toml", "--quiet", cwd=folder).returncode == 0
    whole = (folder / "scene.h5").read_bytes()
    (folder / "damaged.h5").write_bytes(whole[:100] + bytes(900) + whole[1000:])
    (folder / "empty.rrd").touch()
    (folder / "zeros.h5").write_bytes(bytes(1000))
    (folder / "runs").mkdir()
    (folder / "runs" / "results.csv").touch()
    for words, message in (
        (["info", "damaged.h5"], "damaged.h5 is damaged: its structure: "),
        (["plot", "damaged.h5"], "damaged.h5 is damaged: its structure: "),
        (["record", "damaged.h5"], "damaged.h5 is damaged: its structure: "),
        (["run", "scene.toml", "-o", "damaged.h5", "--resume"], "damaged.h5 is damaged: its structure: "),
        (["info", "absent.h5"], "there is no file absent.h5; expected a trajectory or a log of impacts (.h5)"),
        (["info", "."], ". is a folder; expected a trajectory or a log of impacts (.h5)"),
        (
            ["plot", "scene.toml"],
            "scene.toml is not an HDF5 file, or its beginning is damaged; expected a trajectory or a log "
            "of impacts, which are .h5 files; swarm check says what a scene file will do, and swarm run carries it out",
        ),
        (
            ["plot", "zeros.h5"],
            "zeros.h5 is not an HDF5 file, or its beginning is damaged; expected a trajectory or a log of "
            "impacts, which are .h5 files\n",
        ),
        (["run", "scene.h5"], "cannot read the scene file scene.h5: it is no text in UTF-8; swarm info says what"),
        (["record", "absent.h5"], "there is no file absent.h5; expected a trajectory (.h5)"),
        (["view", "absent.rrd"], "there is no file absent.rrd; expected a recording (.rrd)"),
        (["view", "scene.h5"], "scene.h5 is not a recording of swarm; swarm info says what a trajectory holds"),
        (["info", "runs"], "runs is a folder; expected a trajectory or a log of impacts (.h5); swarm report makes the"),
        (["info", "empty.rrd"], "empty.rrd is empty; expected a recording (.rrd)"),
    ):
        done = command(*words, cwd=folder)
        assert (done.returncode, done.stdout) == (2, "")
        assert done.stderr.startswith(f"error: {message}")
        assert len(done.stderr.splitlines()) == 1


def test_results_do_not_depend_on_threads(folder):
    for threads in ("1", "2"):
        assert command("run", "scene.toml", "--threads", threads, "-o", f"{threads}.h5", cwd=folder).returncode == 0
    with swarm.load(folder / "1.h5") as one, swarm.load(folder / "2.h5") as two:
        assert (one.frame(-1).position == two.frame(-1).position).all()


@pytest.mark.parametrize(
    ("old", "new", "args", "message"),
    [
        (
            "count = 10",
            "count = 1_000_000_000_000",
            [],
            "count must fit in memory, got 1e+12 particles, which take 146 TB",
        ),
        (
            "count = 10",
            f"count = {10**19}",
            [],
            "count must fit in memory, got 1e+19 particles, which take 1.46e+03 EB",
        ),
        ("count = 10", f"count = {10**400}", [], "count"),
        ("count = 10", f"count = {'9' * 5000}", [], "cannot read the scene file scene.toml"),
        ("speed = 0.5", "speed = 1e300", [], "particles.speed must be at most 1e+100, got 1e+300"),
        (
            "every = 0.5",
            "every = 1e-12",
            [],
            "every must leave frames that fit, got 1e-12 s until 1 s: 1000000000001 frames",
        ),
        ("every = 0.5", 'every = 0.5\nrecording = ""', [], "recording must be the path of a file, got ''"),
        ("every = 0.5", 'every = 0.5\ntrajectory = ""', [], "trajectory must be the path of a file, got ''"),
        (
            "[particles]",
            f"deep = {'[' * 3000}{']' * 3000}\n[particles]",
            [],
            "scene.toml: its arrays or tables are nested too deeply",
        ),
        ("", "", ["-o", "scene.toml", "--overwrite"], "trajectory: scene.toml is also the scene file"),
        ("", "", ["--record", "./scene.toml", "--overwrite"], "recording: scene.toml is also the scene file"),
        ("", "", ["-o", "a.h5", "--record", "a.h5"], "recording: a.h5 is also the trajectory"),
        (
            "",
            "",
            ["-o", "/dev/null", "--overwrite"],
            "trajectory: expected a file name, got /dev/null, which is a device",
        ),
        ("radius = 0.5", "radius = -1.0", [], "surface[0].radius must be above 0, got -1"),
        ("until = 1.0", "until = -1.0", [], "until must be above 0, got -1"),
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


def test_the_file_of_the_start_is_no_output(folder):
    (folder / "start.csv").write_text("x,y,z,vx,vy,vz\n0,0,0,1,0,0\n")
    text = re.sub(r"(?s)\[particles\].*?\n\n", '[particles]\nfrom = "start.csv"\n\n', GOOD, count=1)
    (folder / "scene.toml").write_text(text)
    done = command("run", "scene.toml", "-o", "start.csv", "--overwrite", cwd=folder)
    assert (done.returncode, "start.csv is also the file of the start" in done.stderr) == (2, True), done.stderr


def test_a_scene_file_with_a_byte_order_mark(folder):
    (folder / "scene.toml").write_text(GOOD, encoding="utf-8-sig")
    assert command("run", "scene.toml", cwd=folder).returncode == 0
    with swarm.load(folder / "scene.h5") as trajectory:
        assert trajectory.scene_text == GOOD


def test_json_is_printed_at_every_end(folder):
    def run_again(*words, **more):
        run = process if more else command
        done = run("run", "scene.toml", "--json", *words, cwd=folder, **more)
        return done.returncode, json.loads(done.stdout)

    code, first = run_again()
    assert (code, first["status"], first["frames"], first["particles"]) == (0, "complete", 3, 10)
    code, again = run_again("--resume")
    assert 0.0 <= first["compile_time"] < first["wall_time"]
    del first["wall_time"], first["compile_time"]
    assert (code, again) == (0, first)
    code, refused = run_again()
    assert (code, refused["status"], "--overwrite" in refused["error"]) == (2, "failed", True)
    (folder / "other.toml").write_text(GOOD.replace("[run]", "[run"))
    done = command("run", "other.toml", "--json", cwd=folder)
    assert (done.returncode, json.loads(done.stdout)["status"]) == (2, "failed")
    # A limit of the size of files stands in for a full disk.
    code, failed = run_again("-o", "failed.h5", file_size=20_000)
    assert (code, failed["status"]) == (1, "failed")
    assert failed["error"].startswith("cannot write the trajectory failed.h5: ")


@pytest.mark.parametrize("options", [["--overwrite"], []])
def test_json_of_a_run_that_is_interrupted(folder, options):
    """By a signal at the first and at a later frame; of what was there before nothing is said."""
    if options:
        assert command("run", "scene.toml", cwd=folder).returncode == 0
    real = machine.Frame

    def frame(number, *more):
        if number == 1:
            signal.raise_signal(signal.SIGINT)
        return real(number, *more)

    with mock.patch.object(machine, "Frame", frame):
        done = command("run", "scene.toml", "--json", *options, cwd=folder)
    summary = json.loads(done.stdout)
    assert (done.returncode, summary["status"], summary["frames"]) == (130, "interrupted", 2)
    assert summary["resume"] == "swarm run scene.toml --json --resume"
    assert "resume with\n  swarm run scene.toml --json --resume" in done.stderr
    done = command(*summary["resume"].split()[1:], cwd=folder)
    assert (done.returncode, json.loads(done.stdout)["frames"]) == (0, 3)


@pytest.mark.parametrize("options", [[], ["--resume"], ["--overwrite"], ["--resume", "--overwrite"]])
def test_json_of_a_run_that_is_interrupted_before_its_first_frame(folder, options):
    """What was there before is not this run's, and there is nothing to resume from."""
    if "--overwrite" in options:
        # A complete run of the same scene would not be replaced with --resume.
        (folder / "scene.toml").write_text(GOOD.replace("speed = 0.5", "speed = 0.4"))
        assert command("run", "scene.toml", cwd=folder).returncode == 0
        (folder / "scene.toml").write_text(GOOD)
    before = {path.name: path.read_bytes() for path in folder.iterdir()}

    def interrupted(*about):
        signal.raise_signal(signal.SIGINT)
        raise KeyboardInterrupt

    with mock.patch.object(machine, "run_of", interrupted):
        done = command("run", "scene.toml", "--json", *options, cwd=folder)
    assert (done.returncode, json.loads(done.stdout)) == (130, {"status": "interrupted", "frames": 0, "resume": None})
    assert "no frame was finished, and nothing was written" in done.stderr
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


INTERRUPTED = """
import importlib.abc, signal, sys
class Finder(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path, target=None):
        if name == {name!r}:
            sys.meta_path.remove(self)
            signal.raise_signal(signal.SIGINT)
signal.signal(signal.SIGINT, signal.default_int_handler)
sys.meta_path.insert(0, Finder())
from swarm.__main__ import main
main()
"""


def interrupted(folder, name):
    """A run that is interrupted where it imports a module."""
    return subprocess.run(
        [sys.executable, "-c", INTERRUPTED.format(name=name), "run", "scene.toml", "--compile", "always"],
        cwd=folder, capture_output=True, text=True, timeout=600,
    )  # fmt: skip


@compiled_only
def test_an_interrupt_in_the_import_of_the_compiler_is_one_of_the_run(folder):
    done = interrupted(folder, "numba")
    assert (done.returncode, done.stdout) == (130, "")
    assert done.stderr.startswith("interrupted: scene.h5 holds the frames that were finished; resume with")
    assert command("run", "scene.toml", "--resume", "--quiet", cwd=folder).returncode == 0


@pytest.mark.parametrize("name", ["click", "numpy", "msgspec", "swarm.run.simulation"])
def test_an_interrupt_in_an_import_is_one_word(folder, name):
    done = interrupted(folder, name)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "interrupted\n")
    assert [path.name for path in folder.iterdir()] == ["scene.toml"]


def test_a_second_interrupt_ends_at_once_without_a_traceback(folder):
    """The first ends the run at its frame; the second comes while the last words are said."""
    code = INTERRUPTED.format(name="nothing").replace(
        "from swarm.__main__",
        """
from swarm.run import machine
real = machine.Frame
def frame(*about):
    signal.raise_signal(signal.SIGINT)
    return real(*about)
machine.Frame = frame
from swarm.commands import run
run._stopped = lambda *about: signal.raise_signal(signal.SIGINT)
from swarm.__main__""",
    )
    done = python("-c", code, "run", "scene.toml", cwd=folder)
    lines = [line for line in done.stderr.splitlines() if not line.startswith("compiling")]
    assert (done.returncode, lines) == (130, ["interrupted"])


@compiled_only
def test_what_compiles_is_reported(folder):
    """A short run compiles nothing; of those that compile the first says so, and the second finds its kernels."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(folder / "cache")}
    for words, expected in (([], False), (["--compile", "always"], True), (["--compile", "always"], False)):
        done = python("-m", "swarm", "run", "scene.toml", "--overwrite", *words, cwd=folder, env=environment)
        assert done.returncode == 0
        assert (
            "compiling the kernel of flights and impacts (1 of 2) for this kind of scene, once" in done.stderr
        ) == expected


def test_another_word_for_when_to_compile_is_refused(folder):
    done = command("run", "scene.toml", "--compile", "alwyas", cwd=folder)
    assert (done.returncode, done.stdout) == (2, "")
    assert "compile must be one of 'auto', 'always' and 'never', got 'alwyas'" in done.stderr
    assert [path.name for path in folder.iterdir()] == ["scene.toml"]


def test_existing_output_asks_for_overwrite(folder):
    (folder / "scene.h5").write_text("mine")
    done = command("run", "scene.toml", cwd=folder)
    assert done.returncode == 2
    assert "--overwrite" in done.stderr
    done = command("run", "scene.toml", "--overwrite", cwd=folder)
    assert (done.returncode, "scene.h5 is not a trajectory of swarm" in done.stderr) == (2, True)
    assert (folder / "scene.h5").read_text() == "mine"
    (folder / "scene.h5").unlink()
    for options in ([], ["--overwrite"]):
        assert command("run", "scene.toml", *options, cwd=folder).returncode == 0


def test_version_and_help(folder):
    assert command("--version", cwd=folder).stdout == f"swarm {swarm.__version__}\n"
    done = command("--help", cwd=folder)
    assert done.returncode == 0
    assert "swarm run examples/scenes/cavity.toml" in done.stdout
    for name in ("run", "info", "record", "view", "plot"):
        assert "Example:" in command(name, "--help", cwd=folder).stdout


def test_help_does_not_import_the_engine(folder):
    """--help answers fast because neither Numba nor NumPy nor HDF5 is imported for it."""
    code = (
        "import sys, swarm.commands.cli\n"
        "try: swarm.commands.cli.app(['--help'])\n"
        "except SystemExit: pass\n"
        "print([name for name in ('numba', 'numpy', 'h5py', 'rich', 'msgspec') if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=folder, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"


def test_interrupt_keeps_finished_frames(folder, request):
    """SIGINT: exit code 130, and the file opens and holds whole frames."""
    (folder / "scene.toml").write_text(GOOD.replace("until = 1.0", "until = 1e7"))
    process = subprocess.Popen(
        [sys.executable, "-m", "swarm", "run", "scene.toml"],
        cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env={**os.environ, "PYTHONUNBUFFERED": "1"},
        # A shell starts what is in its background with SIGINT ignored.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )  # fmt: skip
    request.addfinalizer(process.kill)
    deadline = time.monotonic() + 600.0
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
    _, errors = process.communicate(timeout=600)
    assert process.returncode == 130
    assert b"interrupted" in errors
    with swarm.load(folder / "scene.h5") as trajectory:
        assert len(trajectory) >= frames >= 5
        assert len(trajectory.frame(-1)) == 10


def test_wall_time_and_resume(folder):
    """Exit code 75 and how to resume; then the same frames as in one go, in all their bits. A nanosecond is over at the
    first frame."""
    text = GOOD.replace("until = 1.0", "until = 800.0").replace("every = 0.5", "every = 200.0")
    (folder / "scene.toml").write_text(text)
    limit = "0.000000001s"
    first = command("run", "scene.toml", "--walltime", limit, "--json", cwd=folder)
    assert first.returncode == 75
    assert "the wall time limit is reached" in first.stderr
    summary = json.loads(first.stdout)
    assert summary["status"] == "walltime"
    assert summary["resume"] == f"swarm run scene.toml --walltime {limit} --json --resume"
    with swarm.load(folder / "scene.h5") as begun:
        assert begun.times.tolist() == [0.0]
    assert (folder / "scene.h5.checkpoint").exists()
    assert command("run", "scene.toml", cwd=folder).returncode == 2
    second = command("run", "scene.toml", "--resume", "--json", cwd=folder)
    summary = json.loads(second.stdout)
    assert (second.returncode, second.stderr) == (0, "")
    assert (summary["status"], summary["frames"], summary["time"], summary["particles"]) == ("complete", 5, 800.0, 10)
    assert summary["impacts"] > 5e3
    assert summary["energy_error"] < 1e-14
    assert sorted(path.name for path in folder.iterdir()) == ["scene.h5", "scene.toml"]
    third = command("run", "scene.toml", "--resume", cwd=folder)
    assert (third.returncode, third.stdout) == (0, "")
    assert "is complete" in third.stderr
    command("run", "scene.toml", "-o", "whole.h5", cwd=folder)
    with swarm.load(folder / "scene.h5") as one, swarm.load(folder / "whole.h5") as other:
        assert (one.frame(-1).position == other.frame(-1).position).all()
        require_same_observables(one, other)


def test_bad_wall_time_is_named(folder):
    done = command("run", "scene.toml", "--walltime", "soon", cwd=folder)
    assert done.returncode == 2
    assert """--walltime must be a time such as "2h", "1h30m" or "90s", got 'soon'""" in done.stderr


def test_a_full_disk_is_exit_code_1_and_the_run_goes_on_later(folder):
    """A limit of the size of files stands in for the disk."""
    text = GOOD.replace("count = 10", "count = 200").replace("until = 1.0", "until = 250.0\ncheckpoint = 3600.0")
    (folder / "scene.toml").write_text(text)
    # The kernels are not to be what is too large.
    whole = command("run", "scene.toml", "-o", "whole.h5", "--quiet", "--compile", "always", cwd=folder)
    assert (whole.returncode, whole.stderr) == (0, "")
    # The frames that are written at once, up to a hundred, fit; all do not.
    # Without --quiet a run that takes long says how far it is, on a loaded machine.
    done = python("-m", "swarm", "run", "scene.toml", "--quiet", cwd=folder, file_size=2_000_000)
    assert done.returncode == 1
    assert done.stderr.startswith("error: cannot write frame ")
    assert len(done.stderr.splitlines()) == 1
    with swarm.load(folder / "scene.h5") as trajectory:
        assert 20 < len(trajectory) < 501
    # It made no checkpoint: what is there is not replaced unasked.
    refused = command("run", "scene.toml", "--resume", cwd=folder)
    assert (refused.returncode, "begin again at 0 s and replace" in refused.stderr) == (2, True)
    again = command("run", "scene.toml", "--resume", "--overwrite", "--quiet", cwd=folder)
    assert (again.returncode, again.stderr) == (0, "")
    with swarm.load(folder / "scene.h5") as one, swarm.load(folder / "whole.h5") as other:
        assert len(one) == len(other) == 501
        assert (one.frame(-1).position == other.frame(-1).position).all()


@pytest.mark.skipif(not os.path.isdir("/proc/self"), reason="a folder in which not even root can write")
def test_a_read_only_folder_is_exit_code_1(folder):
    done = command("run", "scene.toml", "-o", "/proc/self/scene.h5", cwd=folder)
    assert done.returncode == 1
    assert done.stderr.startswith("error: cannot write the trajectory /proc/self/scene.h5:")
    assert len(done.stderr.splitlines()) == 1
