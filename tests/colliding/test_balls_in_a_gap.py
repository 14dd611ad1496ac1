"""A ball that comes into a gap of exactly its own width: the run ends with a sentence that says which gap it is."""

import pytest

import swarm
from swarm.events.colliding import events

WALLS = {
    "at rest": {"motion": None, "time": 0.5},
    "together": {"motion": swarm.Translation((-0.5, 0.0, 0.0)), "time": 1.0 / 3.0},
}


@pytest.mark.parametrize("name", WALLS)
def test_the_run_says_which_walls_it_is_between(name):
    motion, time = WALLS[name].values()
    jaws = [swarm.Box((0.5, 0.5, 0.1), center=(1.0, 0.0, z), side="outside", motion=motion) for z in (0.2, -0.2)]
    ball = swarm.Particles([[0.0], [0.0], [0.0]], [[1.0], [0.0], [1e-17]], radius=0.1)
    with pytest.raises(swarm.RunError) as caught:
        swarm.simulate(swarm.Scene([swarm.Sphere(9.0), *jaws]), ball, until=2.0, frames=2, compile="never")
    sentence = str(caught.value)
    assert "no time passes" in sentence
    assert f"m at {time:.9g} s, where it touches surfaces[1] (Box) and surfaces[2] (Box) at once" in sentence
    assert "a gap as wide as the ball, 0.2 m" in sentence
    assert "make the gap wider" in sentence
    assert "report" not in sentence


@pytest.mark.parametrize("way", [0.1, 0.12])
def test_walls_that_close_on_a_ball_say_where_and_when(way, monkeypatch):
    """To exactly its width, or to less: it is hit without end, each time sooner."""
    monkeypatch.setattr(events, "MOST_HITS", 200)
    closes = swarm.Path([0.0, 1.0, 2.0], [(0.0, 0.0, 0.0), (0.0, 0.0, -way), (0.0, 0.0, -way)])
    walls = [swarm.Plane((0.0, 0.0, -1.0), 0.0), swarm.Plane((0.0, 0.0, 1.0), 0.3, motion=closes)]
    ball = swarm.Particles([[0.0], [0.0], [0.15]], [[0.1], [0.0], [0.3]], radius=0.1)
    run = {"until": 2.0, "frames": 4, "compile": "never", "walltime": 60.0}
    with pytest.raises(swarm.RunError, match=r"particle 0: .* m at 0\.\d+ s: walls that move have closed on it; end"):
        swarm.simulate(swarm.Scene(walls), ball, swarm.Impact(), **run)


def test_impacts_are_counted_from_frame_to_frame(monkeypatch):
    monkeypatch.setattr(events, "MOST_HITS", 12)
    shakes = swarm.Oscillation((0.0, 0.0, 0.01), 1.0)
    walls = [swarm.Slab((1.0, 0.0, 0.0), 0.5), swarm.Plane((0.0, 0.0, -1.0), 0.5, motion=shakes)]
    ball = swarm.Particles([[0.0], [0.0], [0.0]], [[8.0], [0.0], [0.0]], radius=0.1)
    run = {"until": 2.0, "compile": "never"}
    whole = swarm.simulate(swarm.Scene(walls), ball, swarm.Impact(), every=1.0, **run)
    assert whole.observables["impacts"].tolist() == [0, 10, 20]
    with pytest.raises(swarm.RunError, match="use more frames"):
        swarm.simulate(swarm.Scene(walls), ball, swarm.Impact(), every=2.0, **run)
