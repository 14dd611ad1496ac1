"""The progress display of a sweep."""

import time

from swarm.fleet.sweeping import _WINDOW, line_of
from swarm.run import progress
from swarm.run.progress import Pace


def test_lines_say_how_far_the_sweep_is(monkeypatch, capsys):
    now = [0.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    show, pace = progress.in_lines(60.0), Pace(_WINDOW)
    show.say("compiling the kernel of flights and impacts (1 of 2) for this kind of scene, once")
    show.put(*line_of(pace, 10, 0, 0, [0.0, 0.0]))
    now[0] = 30.0
    show.put(*line_of(pace, 10, 1, 0, [0.5, 0.0]))
    assert (
        capsys.readouterr().err == "compiling the kernel of flights and impacts (1 of 2) for this kind of scene, once\n"
    )
    now[0] = 100.0
    show.put(*line_of(pace, 10, 3, 1, [0.4, 0.6]))
    assert capsys.readouterr().err == "50.0%  4/10 runs  2 running  1 failed  ETA 0:01:40\n"


def test_without_a_terminal_there_are_lines(monkeypatch, capsys):
    monkeypatch.setattr(progress, "_A_MINUTE", 0.0)
    with progress.progress_listener(sentences_stay=True) as show:
        show.put(*line_of(Pace(_WINDOW), 10, 3, 0, [0.5, 0.5]))
    assert capsys.readouterr().err == "40.0%  3/10 runs  2 running\n"
