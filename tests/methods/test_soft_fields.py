"""Soft walls of points that are fields, outlines and meshes: one spring each, against walls listed one by one."""

import numpy as np
import pytest

import swarm

SOFT = swarm.Penalty(dt=5e-3, penalty=4e3)
SQUARE = [(-0.4, -0.45), (0.4, -0.45), (0.4, 0.45), (-0.4, 0.45)]
CORNERS = np.array([(x, y, z) for x in (-0.4, 0.4) for y in (-0.45, 0.45) for z in (-0.5, 0.5)])
QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
TRIANGLES = [three for a, b, c, d in QUADS for three in ((a, b, c), (a, c, d))]
START = swarm.Particles([(0.2,), (0.1,), (-0.1,)], [(0.9,), (0.31,), (-0.5,)])
BALLS = [(0.5, 0.1, 0.0), (-0.4, -0.1, 0.1), (0.45, 0.4, 0.0)], [0.3, 0.3, 0.2]


def run(walls, **scene):
    scene = swarm.Scene(walls, **scene)
    start = swarm.Particles(START.position, START.velocity)
    return swarm.simulate(scene, start, SOFT, until=1.0, every=0.25, compile="never")


@pytest.mark.parametrize(
    ("whole", "listed", "gravity", "bound"),
    [
        ([swarm.Mesh(CORNERS, TRIANGLES)], [swarm.Box((0.4, 0.45, 0.5))], (0.0, 0.0, -1.0), 1e-11),
        ([swarm.Prism(SQUARE, 1.0)], [swarm.Box((0.4, 0.45, 0.5))], None, 1e-11),
        # Where walls bend discrete gradients are of the second order each.
        (
            [swarm.Spheres(*BALLS)],
            [swarm.Sphere(r, c, side="outside") for c, r in zip(*BALLS, strict=True)],
            None,
            1e-4,
        ),
    ],
    ids=["mesh", "prism", "field"],
)
def test_a_field_as_one_wall_is_its_walls_one_by_one(whole, listed, gravity, bound):
    one, other = run(whole, gravity=gravity), run(listed, gravity=gravity)
    assert one.observables["impacts"][-1] > 0
    assert one.observables["energy_error"].max() < 1e-14
    assert np.abs(one.particles.position - other.particles.position).max() < bound


def test_a_sheet_and_groups_are_refused_in_a_sentence():
    sheet = swarm.Mesh(CORNERS[[0, 1, 2]], [(0, 1, 2)], open=True)
    with pytest.raises(swarm.SceneError, match="must not be an open mesh with Penalty"):
        run([sheet])
    with pytest.raises(swarm.SceneError, match=r"member_impacts must be False with Penalty at surfaces\[0\]"):
        swarm.simulate(swarm.Scene([swarm.Prism(SQUARE, 1.0)]), START, SOFT, until=1.0, member_impacts=True)
