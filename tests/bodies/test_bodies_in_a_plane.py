"""Bodies in a plane: they stay in it exactly, and turn about its normal."""

import numpy as np
import pytest

import swarm

CIRCLE = swarm.Sphere(0.5)


def triangle():
    points = 0.1 * np.array([(np.cos(a), np.sin(a), 0.0) for a in 2.0 * np.pi / 3.0 * np.arange(3)])
    return swarm.Body(points, [1.0, 2.0, 3.0], links=[(0, 1), (1, 2), (2, 0)])


def start(body):
    arms = (body.points - body.mass_matrix.sum(axis=0) @ body.points / 6.0).T
    velocity = np.array([(0.7, 0.4, 0.0), (-0.3, 0.8, 0.0)]).T[:, None]
    position = np.array([(0.1, 0.05, 0.0), (-0.1, 0.2, 0.0)]).T[:, None] + arms[:, :, None]
    return swarm.Bodies(body, position, velocity + 4.0 * np.array((-arms[1], arms[0], 0.0 * arms[0]))[:, :, None])


def run(walls, body, **options):
    scene = swarm.Scene(walls, plane="z", gravity=options.pop("gravity", None))
    return swarm.simulate(scene, start(body), swarm.Impact(dt=0.02), until=1.2, compile="never", **options)


def test_the_angular_momentum_about_a_smooth_circle_is_kept():
    body = triangle()
    seen = (result := run([CIRCLE], body)).observables
    assert seen["impacts"][-1] > 1
    assert seen["angular_momentum"][-1] == pytest.approx(seen["angular_momentum"][0], abs=1e-12)
    assert seen["energy_error"].max() < 1e-12
    assert (result.bodies.position[2] == 0.0).all()
    assert (result.bodies.velocity[2] == 0.0).all()


def test_rough_walls_and_births_keep_bodies_in_the_plane():
    body = triangle()
    walls = [swarm.Polygon([(-0.5, -0.4), (0.5, -0.45), (0.4, 0.5), (-0.4, 0.5)], restitution=0.8, friction=0.3)]
    source = swarm.Source(swarm.Sphere(0.05), volume=True, times=[0.1, 0.2], speed=0.5, spin=3.0)
    result = run(walls, body, gravity=(0.1, -1.0, 0.0), sources=[source])
    seen = result.observables
    assert seen["born"][-1].tolist() == [2]
    assert seen["dissipated_energy"][-1] > 0.0
    assert seen["energy_error"].max() < 1e-12
    assert (result.bodies.position[2] == 0.0).all()
    assert (result.bodies.velocity[2] == 0.0).all()
    turned = result.bodies.position - result.bodies.centers()[:, None]
    assert np.abs(turned[..., 2] - turned[..., 3]).max() > 0.01


def test_what_does_not_stay_in_the_plane_by_itself_is_refused():
    body = swarm.tetrahedron(edge=0.1, mass=6.0)
    with pytest.raises(swarm.SceneError, match="all points of a body must lie, and move, in it"):
        run([CIRCLE], body)
    slider = swarm.Body([(0.1, 0.0, 0.0), (0.2, 0.0, 0.0)], 1.0, links=[(0, 1)], guides=[(0, swarm.Sphere(0.1))])
    held = swarm.Bodies(slider, np.array([[0.1, 0.2], [0.0, 0.0], [0.0, 0.0]])[:, :, None], np.zeros((3, 2, 1)))
    with pytest.raises(swarm.SceneError, match="plane must be None with a body that has guides, cavities or anchors"):
        swarm.simulate(swarm.Scene([CIRCLE], plane="z"), held, swarm.Impact(dt=0.02), until=1.0)
