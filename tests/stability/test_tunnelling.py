"""Thin solids: steps can jump over them, flights to the impact instant cannot."""

import numpy as np
import pytest

import swarm

pytestmark = pytest.mark.physics

STEPPING = (swarm.Penalty, swarm.Verlet, swarm.Midpoint, swarm.Trapezoidal)


def wall(thickness):
    """A box cut in two by a slab-like solid box in the middle."""
    thin = swarm.Box((0.5 * thickness, 2.0, 2.0), side="outside")
    return swarm.Scene([swarm.Box((1.0, 1.0, 1.0)), thin])


@pytest.mark.parametrize("thickness", [1e-2, 1e-6, 1e-12])
@pytest.mark.parametrize("speed", [1.0, 1e6])
def test_impact_never_passes(thickness, speed):
    """However thin the wall and fast the particle: a thousand impacts each, and every one is on its side."""
    scene = wall(thickness)
    random = np.random.default_rng(4)
    position = random.uniform(-0.9, 0.9, (3, 50))
    position[0] = random.choice([-1.0, 1.0], 50) * random.uniform(0.1, 0.9, 50)
    velocity = random.standard_normal((3, 50))
    velocity *= speed / np.linalg.norm(velocity, axis=0)
    start = swarm.Particles(position, velocity)
    end = swarm.simulate(scene, start, swarm.Impact(), until=1500.0 / speed, every=150.0 / speed)
    assert (np.sign(end.particles.position[0]) == np.sign(position[0])).all()
    assert end.observables["impacts"][-1] > 50 * 1000
    assert end.observables["max_penetration"].max() <= 4.0 * np.finfo(float).eps


@pytest.mark.parametrize("cls", STEPPING)
def test_a_step_longer_than_the_wall_is_refused(cls):
    scene = wall(1e-2)
    with pytest.raises(swarm.SceneError, match=r"no particle jumps over a solid in one step.*surfaces\[1\]"):
        swarm.simulate(scene, swarm.fill(scene, 5, speed=1.0), cls(dt=2e-2, penalty=1e4), until=1.0)


def test_what_the_refusal_prevents():
    """Without the check a step of 0.02 m passes a wall of 0.01 m: the particle is on the other side, unharmed."""
    scene = wall(1e-2)
    method = swarm.Penalty(dt=2e-2, penalty=1e4)
    object.__setattr__(method, "check", lambda scene, particles: None)
    particles = swarm.Particles([[-0.109], [0.0], [0.0]], [[1.0], [0.0], [0.0]])
    with pytest.raises(swarm.RunError, match="a step is longer than the thinnest solid"):
        swarm.simulate(scene, particles, method, until=0.4)
