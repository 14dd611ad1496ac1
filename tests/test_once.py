"""A kernel is compiled by one process for all: locks beside the files of the cache."""

import os
import signal
import subprocess
import sys
import threading

import filelock
import numba
import pytest
from numba import types
from numba.core.errors import TypingError

from swarm.kernel import cache, machine_code, once

compiled_only = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="NUMBA_DISABLE_JIT is set: nothing compiles")

PROCESS = """
import sys, time
from numba.core import caching, event
from swarm.kernel import cache, machine_code

class Slowly(event.Listener):
    def on_start(self, compiled):
        time.sleep(1.0)
    def on_end(self, compiled):
        pass

save = caching.IndexDataCacheFile._save_index

def late(self, overloads):
    time.sleep(0.5)
    save(self, overloads)

caching.IndexDataCacheFile._save_index = late
sys.path.insert(0, sys.argv[1])
from twice import twice

kernel = machine_code.cached(twice, {})
argument = {"int": 3, "float": 1.5}[sys.argv[2]]
print("ready", flush=True)
sys.stdin.readline()
compiled = []
with event.install_listener("numba:compile", Slowly()), cache.kernels_compiled(compiled.append):
    assert kernel(argument) == 2 * argument
print(len(compiled))
"""
HOLDER = """
import sys, pathlib
from swarm.kernel.once import held
with held(pathlib.Path(sys.argv[1])):
    print("held", flush=True)
    sys.stdin.read()
"""


def is_held(path):
    """Whether another process, or another thread, holds the lock of a file."""
    lock = filelock.FileLock(path, blocking=False)
    try:
        lock.acquire()
    except filelock.Timeout:
        return True
    lock.release()
    path.unlink()
    return False


def twice(x):
    return 2 * x


def wrong(x):
    return x + "a"


@compiled_only
def test_of_processes_that_start_together_one_compiles(tmp_path, monkeypatch):
    """And two that save one kernel for different arguments at the same time keep both: Numba's index loses one."""
    (tmp_path / "twice.py").write_text("def twice(x):\n    return 2 * x\n")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    kinds = ("int", "float", "float")
    processes = [
        subprocess.Popen(
            [sys.executable, "-c", PROCESS, str(tmp_path), kind],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        )
        for kind in kinds
    ]  # fmt: skip
    for one in processes:
        assert one.stdout.readline() == "ready\n"
    for one in processes:
        one.stdin.write("\n")
        one.stdin.flush()
    counts = [int(one.communicate()[0]) for one in processes]
    assert [one.returncode for one in processes] == [0, 0, 0]
    assert counts[0] == 1
    assert sorted(counts[1:]) == [0, 1]
    # Both entries are there, each with its file, and no lock is left.
    monkeypatch.setattr(machine_code, "_folder", machine_code.cache_folder)
    monkeypatch.syspath_prepend(tmp_path)
    import twice as module

    kernel = machine_code.cached(module.twice, {})
    assert cache.is_compiled(kernel, (3,))
    assert cache.is_compiled(kernel, (1.5,))
    assert not cache.is_compiled(kernel, (1j,))
    assert len(list((tmp_path / "cache").rglob("*.nbc"))) == 2
    assert not list((tmp_path / "cache").rglob("*.lock"))


@compiled_only
def test_an_entry_without_its_file_is_not_compiled(tmp_path, monkeypatch):
    """A kill may come between the two."""
    monkeypatch.setattr(machine_code, "_folder", lambda: tmp_path)
    kernel = machine_code.cached(twice, {})
    assert kernel(3) == 6
    for path in tmp_path.rglob("*.nbc"):
        path.unlink()
    assert not cache.is_compiled(machine_code.cached(twice, {}), (3,))


@compiled_only
def test_a_compilation_that_fails_gives_its_lock_back(tmp_path, monkeypatch):
    monkeypatch.setattr(machine_code, "_folder", lambda: tmp_path)
    kernel = machine_code.cached(wrong, {})
    for _ in range(2):
        with pytest.raises(TypingError):
            kernel(3)
        assert not is_held(machine_code._lock_of(kernel, (types.int64,)))


@compiled_only
@pytest.mark.parametrize("failing", ["save_overload", "lock"])
def test_a_disk_that_takes_nothing_costs_time_alone(tmp_path, monkeypatch, failing):
    monkeypatch.setattr(machine_code, "_folder", lambda: tmp_path)
    kernel = machine_code.cached(twice, {})

    def full(*_args):
        raise OSError(28, "No space left on device")

    if failing == "lock":
        monkeypatch.setattr(machine_code, "_LOCK", "/no such folder/lock")
    else:
        monkeypatch.setattr(kernel._cache._cache_file, "save", full)
    assert kernel(3) == 6


def test_a_lock_is_seen_and_leaves_nothing(tmp_path):
    path = tmp_path / "kernel.lock"
    seen = []
    with once.held(path):
        other = threading.Thread(target=lambda: seen.append(is_held(path)))
        other.start()
        other.join()
    assert seen == [True]
    assert not is_held(path)
    assert not list(tmp_path.iterdir())


def test_threads_take_turns(tmp_path):
    inside, most = [], []

    def work():
        with once.held(tmp_path / "kernel.lock"):
            inside.append(1)
            most.append(len(inside))
            threading.Event().wait(0.02)
            inside.pop()

    threads = [threading.Thread(target=work) for _ in range(4)]
    for one in threads:
        one.start()
    for one in threads:
        one.join()
    assert most == [1, 1, 1, 1]


def test_the_lock_of_a_killed_process_is_free(tmp_path):
    path = tmp_path / "kernel.lock"
    holder = subprocess.Popen(
        [sys.executable, "-c", HOLDER, str(path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    with holder:
        assert holder.stdout.readline() == "held\n"
        assert is_held(path)
        os.kill(holder.pid, signal.SIGKILL)
    assert not is_held(path)
    with once.held(path):
        assert path.exists()


def test_a_lock_that_lasts_is_waited_for_so_long(tmp_path, monkeypatch):
    """On a disk without locks every one seems to be held."""
    monkeypatch.setattr(once, "_LONGEST", 0.1)
    path = tmp_path / "kernel.lock"
    done = []

    def compile_anyway():
        with once.held(path):
            done.append(True)

    with once.held(path):
        other = threading.Thread(target=compile_anyway)
        other.start()
        other.join(30.0)
        assert done == [True]
        assert is_held(path)
