"""What `swarm sweep` prints, and its exit codes; Ctrl-C: test_sweep.py."""

import json
import shutil

import pytest
import typer
from sweep_sessions import write

import swarm
from swarm.commands.sweep import sweep


@pytest.fixture(scope="module")
def carried_out(tmp_path_factory):
    """Six runs that fail as soon as they begin."""
    folder = tmp_path_factory.mktemp("command")
    write(folder / "sweep.toml", '"particles.count" = {range = [1_000_000_000_000_000, 1_000_000_000_000_006]}')
    path = folder / "sweep.toml"
    path.write_text(path.read_text() + '"particles.speed" = [1.0]\n')
    with pytest.raises(typer.Exit) as end:
        sweep(path, folder / "out", processes=1, quiet=True)
    assert end.value.exit_code == 1
    return folder


def test_failures_are_told_with_their_sentences(carried_out, tmp_path, capsys):
    shutil.copytree(carried_out / "out", tmp_path / "out")
    with pytest.raises(typer.Exit) as end:
        sweep(carried_out / "sweep.toml", tmp_path / "out", processes=1, resume=True)
    assert end.value.exit_code == 1
    told = " ".join(capsys.readouterr().out.split())
    assert "runs 6 failed" in told
    assert '"particles.count" = 1000000000000000, "particles.speed" = 1.0: ' in told
    assert "and 1 more, in the table" in told
    assert "results.csv" in told.replace(" ", "")


def test_json_has_the_same_also_of_bad_input(carried_out, tmp_path, capsys):
    shutil.copytree(carried_out / "out", tmp_path / "out")
    with pytest.raises(typer.Exit):
        sweep(carried_out / "sweep.toml", tmp_path / "out", processes=1, resume=True, as_json=True)
    told = json.loads(capsys.readouterr().out)
    assert (told["status"], told["failed"], told["done"], told["waiting"]) == ("failed", 6, 0, 0)
    assert told["failures"][5]["parameters"]["particles.count"] == 10**15 + 5
    with pytest.raises(swarm.SceneError):
        sweep(carried_out / "sweep.toml", tmp_path / "out", as_json=True)
    assert "--resume" in json.loads(capsys.readouterr().out)["error"]


def test_runs_that_the_file_no_longer_has_are_named(carried_out, tmp_path, capsys):
    shutil.copytree(carried_out / "out", tmp_path / "out")
    (tmp_path / "out" / "0123456789ab.h5").touch()
    path = write(tmp_path / "sweep.toml", '"particles.count" = [1]')
    sweep(path, tmp_path / "out", processes=1, resume=True, written="csv")
    captured = capsys.readouterr()
    assert "also holds 1 run that" in captured.err
    assert "0123456789ab.h5" in captured.err
    assert "runs 1 done" in " ".join(captured.out.split())
