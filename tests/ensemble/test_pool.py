"""Which run is handed out when, and what a worker that does not start is."""

import sys

import pytest
from sweep_sessions import write

import swarm
from swarm.ensemble import pool, worker
from swarm.ensemble.plan import Variant, read
from swarm.ensemble.results import Results


def results_of(tmp_path, sweep, run=""):
    path = write(tmp_path / "sweep.toml", sweep, run=run)
    path.write_text(path.read_text().replace('compile = "never"\n', ""))
    return Results(read(path), tmp_path, "csv")


class Hands:
    """Workers that take no time: what they are sent."""

    def __init__(self, monkeypatch, seconds):
        self.told = told = []

        class Hand:
            def is_alive(self):
                return True

            def wait_until_ready(self):
                pass

            def close(self):
                pass

            def carry_out(self, order, tell):
                told.append(order)
                return {"state": "done", "error": None, "wall_time": seconds, "observables": {}}

        monkeypatch.setattr(pool, "Hand", Hand)


def test_the_first_of_each_kind_comes_first():
    variants = [Variant(k, {"a": k}, f"{k}", kind, False) for k, kind in enumerate("aabbac")]
    assert [one.number for one in pool._in_order(variants)] == [0, 2, 5, 1, 3, 4]


def test_what_a_file_says_of_compilation_holds(tmp_path, monkeypatch):
    hands = Hands(monkeypatch, seconds=1e3)
    pool.Pool(results_of(tmp_path, '"run.compile" = ["never"]\n"particles.seed" = [1, 2]'), 1, 1, False).run(
        0.01, lambda: None
    )
    assert ['compile = "never"' in order["text"] for order in hands.told] == [True, True]


def test_the_threads_of_a_run_are_those_of_its_file(tmp_path):
    results = results_of(tmp_path, '"particles.seed" = [1]', run="threads = 3")
    order = {"text": results.plan.text(results.plan.variants[0])}
    assert "threads = 3" in order["text"]


def test_workers_that_do_not_start_end_the_sweep_with_their_sentence(tmp_path, monkeypatch):
    path = write(tmp_path / "sweep.toml", '"particles.seed" = {range = 4}')
    monkeypatch.setenv("PYTHONHOME", str(tmp_path))
    with pytest.raises(
        swarm.RunError, match=r"a worker process did not start: .*exit code 1; the last that it printed"
    ):
        swarm.sweep(path, tmp_path / "out")
    monkeypatch.delenv("PYTHONHOME")
    monkeypatch.setattr(sys, "executable", str(tmp_path / "none"))
    with pytest.raises(swarm.RunError, match="a worker process cannot be started"):
        swarm.sweep(path, tmp_path / "out", resume=True)


def test_an_unexpected_error_fails_its_run(monkeypatch, capsys):
    def broken(order, line):
        raise KeyError("what")

    monkeypatch.setattr(worker, "_carried_out", broken)
    assert worker._outcome({}, None) == {"state": "failed", "error": "unexpected KeyError: 'what'"}
    assert "Traceback" in capsys.readouterr().err
