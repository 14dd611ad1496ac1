"""Balls in free space: no walls and no cell."""

import numpy as np
import pytest

import swarm
from swarm import scene_file

METHODS = {"impact": swarm.Impact(), "penalty": swarm.Penalty(dt=1e-3, penalty=1e3)}


def two():
    return swarm.Particles(
        [[-1.0, 1.0], [0.0, 0.05], [0.0, 0.0]], [[1.0, -0.5], [0.0, 0.0], [0.0, 0.0]],
        mass=[1.0, 2.0], radius=[0.1, 0.2],
    )  # fmt: skip


@pytest.mark.parametrize("scene", [{}, {"plane": "z"}, {"period": (None, None, 9.0)}], ids=["space", "plane", "slab"])
@pytest.mark.parametrize("method", METHODS)
def test_two_balls_keep_energy_and_momentum(method, scene, tmp_path):
    start, free, path = two(), swarm.Scene([], **scene), tmp_path / "free.h5"
    end = swarm.simulate(free, start, METHODS[method], until=2.0, trajectory=path, compile="never")
    assert end.observables["collisions"][-1] == 1
    assert end.observables["energy_error"].max() < 1e-13
    assert end.observables["escaped"][-1] == 0
    assert (np.isnan(end.observables["pressure"])).all()
    before, after = (start.mass * start.velocity).sum(axis=1), (start.mass * end.particles.velocity).sum(axis=1)
    np.testing.assert_allclose(after, before, atol=1e-13)
    with swarm.load(path) as trajectory:
        assert trajectory.scene == free
        trajectory.plot()


def test_balls_far_away_have_not_escaped():
    """There is nothing that they could have escaped from."""
    start = two()
    start.position[0] += 1e7
    end = swarm.simulate(swarm.Scene([]), start, swarm.Impact(), until=2.0, compile="never")
    assert end.observables["escaped"][-1] == 0
    assert end.observables["collisions"][-1] == 1


def test_points_are_refused_with_what_they_lack():
    point = swarm.Particles([0.0, 0.0, 0.0], [1.0, 0.0, 0.0])
    for method in (swarm.Impact(), swarm.Penalty(dt=1e-3, penalty=1e3)):
        with pytest.raises(swarm.SceneError, match=r"at least one surface.*give walls, or give the particles a rad"):
            swarm.simulate(swarm.Scene([]), point, method, until=1.0)
    with pytest.raises(swarm.SceneError, match="fill needs a bounded volume"):
        swarm.fill(swarm.Scene([]), 3, speed=1.0, radius=0.1)


def test_in_a_scene_file(tmp_path):
    (tmp_path / "start.csv").write_text("x,y,z,vx,vy,vz,mass,radius\n-1,0,0,1,0,0,1,0.1\n1,0,0,0,0,0,1,0.1\n")
    (tmp_path / "free.toml").write_text(
        '[particles]\nfrom = "start.csv"\n[method]\nkind = "impact"\n[run]\nuntil = 3.0\nevery = 1.0\n'
    )
    assert scene_file.read(tmp_path / "free.toml").scene == swarm.Scene([])
