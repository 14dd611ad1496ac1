"""The progress display of a sweep."""

from swarm.ensemble import shown
from swarm.ensemble.pool import Progress


def test_lines_say_how_far_the_sweep_is(monkeypatch, capsys):
    now = [0.0]
    monkeypatch.setattr(shown.time, "monotonic", lambda: now[0])
    show = shown.lines(60.0)
    show(Progress(10, 0, 0, 2, 0.0, "compiling kernels for this scene, once: advance_block"))
    now[0] = 30.0
    show(Progress(10, 1, 0, 2, 0.5, ""))
    assert capsys.readouterr().err == "compiling kernels for this scene, once: advance_block\n"
    now[0] = 100.0
    show(Progress(10, 3, 1, 2, 1.0, ""))
    assert capsys.readouterr().err == "50.0%  4/10 runs  2 running  1 failed  ETA 0:01:40\n"


def test_nothing_is_shown_without_progress(capsys):
    with shown.shown(False) as show:
        show(Progress(10, 3, 1, 2, 1.0, "compiling"))
    assert capsys.readouterr().err == ""
