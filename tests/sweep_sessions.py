"""Sweeps by the command line that are killed and resumed, for the tests of sweeps."""

import csv
import json
import os
import signal
import subprocess
import sys
import time

import psutil
from scene_texts import in_a_sphere

import swarm

LINES = 'until = 2.0\nevery = 0.5\ncompile = "never"\n'
RUNNING = 120.0  # seconds after which a test gives up


def write(path, sweep, count=5, run=""):
    path.write_text(in_a_sphere(LINES + run, count, sweep=sweep))
    return path


def until_there_is(condition):
    end = time.monotonic() + RUNNING
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


def table_of(folder):
    """Every cell but the wall times, as text."""
    with open(folder / "results.csv", newline="") as file:
        return [{key: cell for key, cell in row.items() if key != "wall_time"} for row in csv.DictReader(file)]


class Session:
    """`swarm sweep` of the file beside a folder, in a process group of its own, as a shell starts it."""

    def __init__(self, folder, *words):
        self.folder, self.workers, self.began = folder, set(), time.time()
        self.process = subprocess.Popen(
            [sys.executable, "-m", "swarm", "sweep", str(folder.parent / "sweep.toml"), "-o", str(folder), *words],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
        )  # fmt: skip

    def ended_or_has(self, seen):
        until_there_is(lambda: self.process.poll() is not None or seen())

    def find_workers(self):
        try:
            self.workers.update(psutil.Process(self.process.pid).children())
        except psutil.NoSuchProcess:
            return False
        return bool(self.workers)

    def end(self):
        """Exit code, output and errors; no worker is left."""
        output, errors = self.process.communicate(timeout=RUNNING)
        _gone, alive = psutil.wait_procs(self.workers, timeout=RUNNING)
        assert not alive
        assert "Traceback" not in errors, errors
        return self.process.returncode, output, errors

    def killed_by(self, kind, wait):
        """The same after a signal, so many seconds after workers are there and write a trajectory: to all, or one."""
        self.ended_or_has(self.find_workers)
        self.ended_or_has(lambda: any(file.stat().st_mtime > self.began for file in self.folder.glob("*.h5")))
        time.sleep(wait)
        self.find_workers()
        if self.process.poll() is None:
            (os.kill if kind == signal.SIGKILL else os.killpg)(self.process.pid, kind)
        return self.end()


def assert_the_same_table(tmp_path, kinds, draw, longest, seeds=3):
    """A sweep that is ended by these signals, and then resumed to its end; how far each session comes is left open."""
    sweep = f'"particles.seed" = {{range = {seeds}}}\n"surface.0.restitution" = [1.0, 0.8]'
    path = write(tmp_path / "sweep.toml", sweep, count=30, run="checkpoint = 0.05\nthreads = 1")
    swarm.sweep(path, tmp_path / "whole", processes=1)
    folder = tmp_path / "out"
    for kind in kinds:
        code, output, errors = Session(folder, "--resume", "--processes", "2").killed_by(
            kind, draw.uniform(0.0, longest)
        )
        if kind == signal.SIGINT and code != 0:
            assert code == 130
            assert "--resume" in errors
            assert "waiting" in output
            assert {row["state"] for row in table_of(folder)} <= {"done", "waiting"}
    code, output, errors = Session(folder, "--resume", "--processes", "1", "--json").end()
    assert code == 0, errors
    assert json.loads(output)["done"] == 2 * seeds
    assert table_of(folder) == table_of(tmp_path / "whole")
    assert not list(folder.glob("*.checkpoint"))
