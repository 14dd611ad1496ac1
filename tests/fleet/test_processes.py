"""Which run is handed out when, and what a worker that does not start is."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import loky
import pytest
from sweep_sessions import write

import swarm
from swarm.fleet import jobs, sweeping
from swarm.fleet.plan import Variant, read
from swarm.fleet.processes import _ORPHANED, Place, Processes


def test_the_first_of_each_kind_comes_first():
    variants = [Variant(k, {"a": k}, f"{k}", kind, False) for k, kind in enumerate("aabbac")]
    assert [one.number for one in sweeping._in_order(variants)] == [0, 2, 5, 1, 3, 4]


def test_what_a_file_says_of_compilation_holds(tmp_path):
    path = write(tmp_path / "sweep.toml", '"run.compile" = ["never"]\n"particles.seed" = [1, 2]')
    path.write_text(path.read_text().replace('compile = "never"\n', ""))
    plan = read(path)
    assert ['compile = "never"' in plan.text(variant) for variant in plan.variants] == [True, True]


def test_the_threads_of_a_run_are_those_of_its_file(tmp_path):
    plan = read(write(tmp_path / "sweep.toml", '"particles.seed" = [1]', run="threads = 3"))
    assert "threads = 3" in plan.text(plan.variants[0])


def die(reporter):
    print("the last words", flush=True)
    signal.raise_signal(signal.SIGKILL)


def fail(reporter):
    raise KeyError("what")


def report(reporter):
    reporter.tell({"share": 0.25})
    reporter.tell({"compiling": "a kernel"})
    return {"said": "all"}


def test_a_process_that_dies_or_fails_fails_its_job_alone():
    """The next ones are carried out, by another process or by the same; what it printed last is told."""
    works = {0: report, 1: die, 2: fail, 3: report}
    ended, seen = {}, []
    with Processes(jobs.Stop(), 1) as fleet:
        made = (jobs.FleetJob(k, work, ()) for k, work in works.items())
        fleet.run(made, ended.__setitem__, lambda: seen.append(dict(fleet.shares)))
        assert fleet.new_sentences() == ["a kernel"] * 2
    assert ended[0] == ended[3] == {"state": "done", "said": "all"}
    assert "was ended by SIGKILL" in ended[1]["error"]
    assert "the last that it printed: the last words" in ended[1]["error"]
    assert ended[2] == {"state": "failed", "error": "unexpected KeyError: 'what'", "lost": True}


def number(reporter):
    return {"process": os.getpid()}


def test_a_process_that_has_started_takes_the_first_job():
    """One that has died by then fails it, and the next job gets another process."""
    ended, first = {}, Place()
    first.start()
    (process,) = first.executor._processes
    with Processes(jobs.Stop(), 1, first) as fleet:
        fleet.run([jobs.FleetJob(0, number, ())], ended.__setitem__, lambda: None)
        os.kill(process, signal.SIGKILL)
        while first.executor._flags.broken is None:
            time.sleep(0.01)
        fleet.run((jobs.FleetJob(k, number, ()) for k in (1, 2)), ended.__setitem__, lambda: None)
    assert ended[0] == {"state": "done", "process": process}
    assert "was ended by SIGKILL" in ended[1]["error"]
    assert ended[2]["process"] != process
    assert first.executor is None
    assert not first._printed.exists()


def test_the_file_of_a_process_ends_with_its_parent():
    """Also where that is killed, and can remove nothing."""
    code = """if True:
        import os, signal
        from swarm.fleet.processes import Place
        place = Place()
        place.start()
        while not place.ready:
            list(place.messages())
        print(place._printed, flush=True)
        os.kill(os.getpid(), signal.SIGKILL)
    """
    done = subprocess.run([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    assert done.returncode == -signal.SIGKILL
    printed, latest = Path(done.stdout.strip()), time.monotonic() + 60.0
    assert printed.name.startswith("swarm-")
    while printed.exists():
        assert time.monotonic() < latest
        time.sleep(0.02)


def test_a_process_that_begins_after_its_parent_has_ended_ends_too(tmp_path):
    code = """if True:
        import multiprocessing, pathlib, sys, time
        from swarm.fleet import processes
        here, there = multiprocessing.Pipe()
        there.close()
        processes._begin(here, pathlib.Path(sys.argv[1]))
        time.sleep(60.0)
    """
    done = subprocess.run([sys.executable, "-c", code, tmp_path / "printed"])
    assert done.returncode == _ORPHANED
    assert list(tmp_path.iterdir()) == []


def test_processes_end_with_their_fleet():
    with Processes(jobs.Stop(), 2) as fleet:
        fleet.run((jobs.FleetJob(k, report, ()) for k in range(2)), lambda *ended: None, lambda: None)
        executors = [place.executor for place in fleet._places]
        assert all(isinstance(one, loky.ProcessPoolExecutor) for one in executors)
        processes = [process for one in executors for process in one._processes.values()]
        assert len(processes) == 2
    assert [process.is_alive() for process in processes] == [False, False]


def test_workers_that_do_not_start_end_the_sweep_with_their_sentence(tmp_path, monkeypatch):
    path = write(tmp_path / "sweep.toml", '"particles.seed" = {range = 4}')
    with Processes(jobs.Stop(), 1) as fleet:  # processes that loky starts once
        fleet.run([jobs.FleetJob(0, report, ())], lambda *ended: None, lambda: None)
    monkeypatch.setattr(sys, "executable", str(tmp_path / "none"))
    with pytest.raises(swarm.RunError, match=r"a worker process did not start: .*exit code 255"):
        swarm.sweep(path, tmp_path / "out")
