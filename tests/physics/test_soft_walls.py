"""Penalty: second order towards the exact motion of the soft wall, energy at any step."""

import math

import numpy as np
import pytest
from conftest import rarely
from physics.billiards import AXES, run, scene_of, wall_bounce

import swarm

pytestmark = pytest.mark.physics

STIFFNESS, SPEED = 1e3, 0.5
FLOOR = swarm.Scene([swarm.Plane((1.0, 0.0, 0.0), 0.0)])
DISTANCES = np.linspace(0.05, 0.1, 16)


def _errors(steps, until, exponent, exact):
    """Root mean square error of position and velocity over particles that meet the wall at 16 phases of a step."""
    compile = "never" if exponent in (1.0, 1.5) else "always"  # there each step is an iteration of powers
    zeros = np.zeros_like(DISTANCES)
    start = swarm.Particles([-DISTANCES, zeros, zeros], [SPEED + zeros, zeros, zeros])
    found = [
        run(FLOOR, start, swarm.Penalty(until / n, STIFFNESS, exponent), until, compile=compile).particles
        for n in steps
    ]
    position, velocity = np.array([exact(distance) for distance in DISTANCES]).T
    return np.array(
        [
            [np.sqrt(np.mean((p.position[0] - position) ** 2)), np.sqrt(np.mean((p.velocity[0] - velocity) ** 2))]
            for p in found
        ]
    )


def _slopes(errors):
    return np.log2(errors[:-1] / errors[1:])


def test_half_period_of_the_linear_spring():
    """Inside the wall x = v/w sin w t, w^2 = alpha/m: both x and v converge with order 2."""
    frequency, until = math.sqrt(STIFFNESS), 0.24

    def exact(distance):
        angle = frequency * (until - distance / SPEED)
        assert 0.0 < angle < math.pi
        return SPEED / frequency * math.sin(angle), SPEED * math.cos(angle)

    # All phases of entry are inside the contact at the end: 0.1/0.5 s + 0.04 s.
    close = [distance for distance in DISTANCES if until - distance / SPEED < math.pi / frequency]
    assert len(close) > 8
    zeros = np.zeros(len(close))
    start = swarm.Particles([-np.array(close), zeros, zeros], [SPEED + zeros, zeros, zeros])
    position, velocity = np.array([exact(distance) for distance in close]).T
    errors = []
    for n in (120, 240, 480):
        end = run(FLOOR, start, swarm.Penalty(until / n, STIFFNESS), until, compile="never").particles
        errors.append(
            [np.sqrt(np.mean((end.position[0] - position) ** 2)), np.sqrt(np.mean((end.velocity[0] - velocity) ** 2))]
        )
    slopes = _slopes(np.array(errors))
    assert (slopes >= 1.8).all(), slopes
    assert (slopes <= 2.2).all(), slopes


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.3, 4.0])
def test_bounce_off_the_soft_wall(exponent):
    """After the bounce the time spent inside shows in the position: order 2; the speed is exact whatever the step."""
    until = 2.0
    errors = _errors((500, 1000, 2000), until, exponent, lambda d: wall_bounce(d, SPEED, until, STIFFNESS, exponent))
    slopes = _slopes(errors[:, 0])
    assert (slopes >= 1.8).all(), slopes
    assert (slopes <= 2.2).all(), slopes
    assert errors[:, 1].max() <= 1e-12


def test_hertz_against_runge_kutta():
    """The closed form above against x'' = -k x^1.5 in 10 000 steps of the classical fourth-order rule."""
    n, k = 10_000, STIFFNESS
    depth, speed = 0.0, SPEED
    h = 0.4 / n

    def force(x):
        return -k * max(x, 0.0) ** 1.5

    for _ in range(n):
        a1 = force(depth)
        a2 = force(depth + 0.5 * h * speed)
        a3 = force(depth + 0.5 * h * (speed + 0.5 * h * a1))
        a4 = force(depth + h * (speed + 0.5 * h * a2))
        depth, speed = (
            depth + h * speed + h * h * (a1 + a2 + a3) / 6.0,
            speed + h * (a1 + 2.0 * a2 + 2.0 * a3 + a4) / 6.0,
        )
    exact, _ = wall_bounce(0.0, SPEED, 0.4, k, 1.5)
    assert depth == pytest.approx(exact, abs=1e-9)
    start = swarm.Particles([0.0, 0.0, 0.0], [SPEED, 0.0, 0.0])
    end = run(FLOOR, start, swarm.Penalty(5e-5, k, 1.5), 0.4, compile="never").particles
    assert end.position[0, 0] == pytest.approx(depth, abs=1e-7)


@pytest.mark.parametrize("dt", [1e-3, 0.025])
def test_the_table_of_the_sphere(dt):
    """R = 0.5, |v| = 0.5, alpha = 1e4, m = 1: energy after 10 000 steps, worst particle, 5e-12."""
    start = swarm.fill(scene_of("sphere"), 200, speed=0.5, seed=9)
    result = run(scene_of("sphere"), start, swarm.Penalty(dt, 1e4), 10_000 * dt, 1000 * dt, "always")
    assert result.observables["impacts"][-1] > 1000
    assert result.observables["energy_error"].max() <= 5e-12


# |grad phi|: the gap of a sphere is a length, that of an ellipsoid a number.
_SLOPES = {"sphere": 1.0, "hemisphere": 1.0, "ellipsoid": 5.0, "ball in ellipsoid": 5.0}


def _worst_energy_error(name, gravity, exponent, omegas, steps):
    # In plain Python a thousand steps of a few particles take as long as the compiler.
    n, compile = (10, "always") if steps == _MANY else (3, "never")
    scene, worst = scene_of(name, gravity), {}
    for omega in omegas:
        for dt in (1e-3, 0.025):
            mass = np.random.default_rng(10).uniform(0.5, 2.0, n)
            start = swarm.fill(scene, n, speed=0.5, mass=mass, seed=10)
            # omega = dt sqrt(alpha/m) of the linear spring that is as strong at half the scene's size
            penalty = (omega / dt) ** 2 * (0.5 * scene.size()) ** (1.0 - exponent) / _SLOPES[name] ** (exponent + 1.0)
            result = run(scene, start, swarm.Penalty(dt, penalty, exponent), steps * dt, 0.1 * steps * dt, compile)
            worst[omega, dt] = float(result.observables["energy_error"].max())
    return worst


_MANY, _FEW = 10_000, 300
_PULL = (0.1, 0.0, -2.0)
_FALLING = [(name, _PULL) for name in ("sphere", "ellipsoid", "hemisphere", "ball in ellipsoid")]
_EXPONENTS = (1.0, 1.5, 2.3, 4.0)


@pytest.mark.parametrize(
    ("name", "gravity", "exponent", "steps"),
    [
        *(("sphere", None, exponent, _FEW) for exponent in _EXPONENTS),
        *((*shape, exponent, _FEW) for shape, exponent in zip(_FALLING, _EXPONENTS, strict=True)),
        *(rarely(*shape, exponent, _MANY) for shape in (("sphere", None), *_FALLING) for exponent in _EXPONENTS[1:]),
        *(rarely(*shape, 1.0, _MANY) for shape in (("sphere", None), *_FALLING)),
        *(rarely(*_FALLING[i], _EXPONENTS[k], _FEW) for i in range(4) for k in range(4) if i != k),
    ],
)
class TestPenaltyKeepsEnergy:
    """The discrete gradient keeps energy at any step: thousands of steps, worst particle, different masses."""

    def test_soft_to_stiff(self, name, gravity, exponent, steps):
        worst = _worst_energy_error(name, gravity, exponent, (1e-2, 1e-1, 1.0), steps)
        assert max(worst.values()) <= 5e-12, worst

    def test_very_stiff(self, name, gravity, exponent, steps):
        worst = _worst_energy_error(name, gravity, exponent, (10.0, 100.0), steps)
        assert max(worst.values()) <= 5e-12, worst


def test_stiff_walls_are_rigid():
    """With alpha -> infinity and dt -> 0 the soft bounce ends where the hard one does."""
    scene = scene_of("ellipsoid")
    start = swarm.fill(scene, 50, speed=0.5, seed=11)
    hard = run(scene, start, swarm.Impact(), 4.0).particles
    distances = []
    for k in (1, 2, 4):
        soft = run(scene, start, swarm.Penalty(1e-3 / k, 1e4 * k**2), 4.0).particles
        distances.append(np.median(np.linalg.norm(soft.position - hard.position, axis=0)))
    assert distances[0] > 1.5 * distances[1] > 1.5**2 * distances[2]
    assert distances[2] < 0.1 * min(AXES)


@pytest.mark.parametrize("gradient", ["composite", "mean-value"])
@pytest.mark.parametrize("direction", [(0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 1.0)], ids=str)
@pytest.mark.parametrize("make", [lambda: swarm.Box((0.3, 0.4, 0.5)), lambda: swarm.Sphere(0.4)], ids=["box", "sphere"])
def test_through_the_middle(make, direction, gradient):
    """In the middle of a slab or a sphere dg/dq has no bound; each sweep asks all walls of a box."""
    method = swarm.Penalty(1e-2, 1e3, exponent=1.5, gradient=gradient)
    start = swarm.Particles((0.0, 0.0, 0.0), direction)
    result = run(swarm.Scene([make()]), start, method, 1.0, compile="never")
    assert result.observables["energy_error"].max() <= 1e-12
    assert result.observables["impacts"][-1] >= 1
    assert (result.particles.position[np.array(direction) == 0.0] == 0.0).all()
