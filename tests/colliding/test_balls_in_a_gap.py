"""A ball that comes into a gap of exactly its own width: the run ends with a sentence that says which gap it is."""

import pytest

import swarm

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
