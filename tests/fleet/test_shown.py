"""The progress display of a sweep."""

import time

from swarm.fleet import shown
from swarm.fleet.shown import Progress
from swarm.run import progress


def test_lines_say_how_far_the_sweep_is(monkeypatch, capsys):
    now = [0.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    show = shown.show_by(progress.in_lines(60.0))
    show(
        Progress(10, 0, 0, 2, 0.0, "compiling the kernel of flights and impacts (1 of 2) for this kind of scene, once")
    )
    now[0] = 30.0
    show(Progress(10, 1, 0, 2, 0.5, ""))
    assert (
        capsys.readouterr().err == "compiling the kernel of flights and impacts (1 of 2) for this kind of scene, once\n"
    )
    now[0] = 100.0
    show(Progress(10, 3, 1, 2, 1.0, ""))
    assert capsys.readouterr().err == "50.0%  4/10 runs  2 running  1 failed  ETA 0:01:40\n"


def test_nothing_is_shown_without_progress(capsys):
    with shown.shown(False) as show:
        show(Progress(10, 3, 1, 2, 1.0, "compiling"))
    assert capsys.readouterr().err == ""


def test_without_a_terminal_there_are_lines(monkeypatch, capsys):
    monkeypatch.setattr(progress, "_A_MINUTE", 0.0)
    with shown.shown(True) as show:
        show(Progress(10, 3, 0, 2, 1.0, ""))
    assert capsys.readouterr().err == "40.0%  3/10 runs  2 running\n"
