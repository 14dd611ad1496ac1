"""What `swarm sweep` prints, and its exit codes; Ctrl-C: test_sweep.py."""

import json
import signal

import click
import pytest
from sweep_sessions import write

import swarm
from swarm.commands import sweep as module
from swarm.commands.sweep import sweep
from swarm.fleet import processes, sweeping
from swarm.run import progress


@pytest.fixture(scope="module")
def failed(tmp_path_factory):
    """The folder of six runs that fail as soon as they begin, and the outcome that the command reports."""
    folder = tmp_path_factory.mktemp("command")
    path = write(folder / "sweep.toml", '"particles.count" = {range = [1_000_000_000_000_000, 1_000_000_000_000_006]}')
    outcomes = []

    def kept(*arguments):
        outcomes.append(carry_out_sweep(*arguments))
        return outcomes[0]

    carry_out_sweep = sweeping.carry_out_sweep
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sweeping, "carry_out_sweep", kept)
        with pytest.raises(click.exceptions.Exit) as end:
            sweep(path, folder / "out", processes=1, quiet=True)
    assert end.value.exit_code == 1
    return folder, outcomes[0]


def test_failures_are_reported_with_their_sentences(failed, capsys):
    module._report(failed[1], False, False)
    output = " ".join(capsys.readouterr().out.split())
    assert "runs 6 failed" in output
    assert '"particles.count" = 1000000000000000: ' in output
    assert "and 1 more, in the table" in output
    assert "results.csv" in output.replace(" ", "")


def test_json_has_the_same_also_of_bad_input(failed, capsys):
    folder, outcome = failed
    module._report(outcome, False, True)
    summary = json.loads(capsys.readouterr().out)
    assert (summary["status"], summary["failed"], summary["done"], summary["waiting"]) == ("failed", 6, 0, 0)
    assert summary["failures"][5]["parameters"]["particles.count"] == 10**15 + 5
    with pytest.raises(swarm.SceneError):
        sweep(folder / "sweep.toml", folder / "out", as_json=True)
    assert "--resume" in json.loads(capsys.readouterr().out)["error"]


def test_runs_that_the_file_no_longer_has_are_named(failed, capsys):
    folder, outcome = failed
    (folder / "out" / "0123456789ab.h5").touch()
    module._report(outcome, True, False)
    output = capsys.readouterr()
    assert "also holds 1 run that" in output.err
    assert "0123456789ab.h5" in output.err
    assert output.out == ""


def test_the_wall_time_has_an_exit_code_of_its_own(tmp_path, capsys, monkeypatch):
    """75, "try again" of sysexits.h, by which a chain of jobs knows that another one is needed; no line is shown."""
    monkeypatch.setattr(progress, "_A_MINUTE", 0.0)
    path = write(tmp_path / "sweep.toml", '"run.until" = [1e7, 1e8]', run="frames = 1")
    path.write_text(path.read_text().replace("every = 0.5\n", ""))
    with pytest.raises(click.exceptions.Exit) as end:
        sweep(path, tmp_path / "out", processes=1, quiet=True, walltime="0.000000001s")
    assert end.value.exit_code == 75
    assert capsys.readouterr().err.startswith("the wall time limit is reached: 2 runs are left; resume with")


def test_a_process_starts_before_the_file_is_read_and_ends_with_its_error(tmp_path, monkeypatch):
    """Its imports run beside those of the command; a cluster has workers of its own."""
    calls = []
    monkeypatch.setattr(processes.Place, "start", lambda place: calls.append("start"))
    monkeypatch.setattr(processes.Place, "close", lambda place: calls.append("close"))
    with pytest.raises(swarm.SceneError, match=r"there is no file .*none\.toml"):
        sweep(tmp_path / "none.toml")
    assert calls == ["start", "close"]
    with pytest.raises(swarm.SceneError, match="there is no file"):
        sweep(tmp_path / "none.toml", cluster="local:1")
    assert calls == ["start", "close"]


def test_an_interrupt_of_the_imports_ends_the_process_that_has_started(tmp_path, monkeypatch, capsys):
    calls = []
    # Python leaves a signal ignored that the process which started it ignores.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    monkeypatch.setattr(processes.Place, "start", lambda place: signal.raise_signal(signal.SIGINT))
    monkeypatch.setattr(processes.Place, "close", lambda place: calls.append("close"))
    try:
        with pytest.raises(click.exceptions.Exit) as end:
            sweep(tmp_path / "none.toml")
    finally:
        signal.signal(signal.SIGINT, before)
    assert end.value.exit_code == 130
    assert calls == ["close"]
    assert "interrupted" in capsys.readouterr().err
