"""Paths along walls of every kind against an independent integrator and closed forms; order, energy, momentum."""

import math
from typing import Any, NamedTuple

import mpmath
import numpy as np
import pytest
from physics.billiards import EPSILON, run
from physics.sliding_reference import along_wall, derivatives, on_wall, slid

import swarm

pytestmark = pytest.mark.physics

G = 9.81
DOWN = (0.0, 0.0, -G)
CROSSINGS = 10
# A start on the wall is a last place inside, and falls on it in some sqrt(EPSILON size/G) [s].
ARRIVES = 2e-8
TILT = 0.1
QUARTIC = "x**2/0.16 + y**2/0.25 + z**4 - 1"


class Case(NamedTuple):
    """A cavity, its phi, where particles start (near the wall), how fast, and the size of the cavity."""

    surface: Any
    phi: str
    near: tuple[float, float, float]
    velocity: tuple[float, float, float]
    size: float


# Each start is where gravity and curvature press the particle to the wall, all the way.
CASES = {
    "sphere": Case(swarm.Sphere(0.5), "x**2 + y**2 + z**2 - 0.25", (0.3, 0.1, -0.4), (0.3, 1.0, 0.2), 0.5),
    "ellipsoid": Case(
        swarm.Ellipsoid((0.5, 0.4, 0.3)),
        "x**2/0.25 + y**2/0.16 + z**2/0.09 - 1",
        (0.3, 0.2, -0.2),
        (0.7, -0.9, 0.2),
        0.3,
    ),
    "cylinder": Case(
        swarm.Cylinder(0.5, (math.cos(TILT), 0.0, math.sin(TILT))),
        f"y**2 + (z*{math.cos(TILT)!r} - x*{math.sin(TILT)!r})**2 - 0.25",
        (0.0, 0.3, -0.4),
        (0.4, 0.8, 0.3),
        0.5,
    ),
    "cone": Case(swarm.Cone(math.pi / 6.0), "x**2 + y**2 - z**2/3", (0.3, 0.0, 0.5), (0.0, 1.5, 0.4), 0.3),
    "paraboloid": Case(swarm.Paraboloid(0.25), "x**2 + y**2 - z", (0.4, 0.0, 0.2), (0.3, 1.2, 0.1), 0.5),
    "torus": Case(
        swarm.Torus(0.7, 0.3), "(sqrt(x**2 + y**2) - 0.7)**2 + z**2 - 0.09", (0.75, 0.0, -0.28), (0.4, 1.0, 0.0), 0.3
    ),
    "formula": Case(swarm.Formula(QUARTIC), QUARTIC, (0.2, 0.2, -0.8), (0.8, -0.5, 0.1), 0.4),
}
every_case = pytest.mark.parametrize("name", CASES)


def start_of(case, factor=1.0):
    """Position and velocity of the start."""
    r = on_wall(case.phi, case.near)
    return r, along_wall(case.phi, r, factor * np.array(case.velocity))


def crossings(case, number=CROSSINGS):
    """The time of so many crossings, with the speed that gravity gives in one."""
    return number * case.size / math.sqrt(np.square(case.velocity).sum() + G * case.size)


def slide(case, method, until, gravity=DOWN, every=None, compile="auto"):
    """A run of one particle that starts on the wall, along it."""
    return run(swarm.Scene([case.surface], gravity), swarm.Particles(*start_of(case)), method, until, every, compile)


def distance(result, r):
    return float(np.linalg.norm(result.particles.position[:, 0] - r))


# --- The reference itself ---------------------------------------------------------------------------------


@every_case
def test_the_reference_is_pressed_and_keeps_wall_and_energy(name):
    case = CASES[name]
    r, v = start_of(case)
    assert abs(v @ np.array(derivatives(case.phi)[1](*r))) <= 1e-14
    assert abs(case.surface.phi(r[:, None])[0]) <= 4.0 * EPSILON
    parallel = np.cross(case.surface.gradient(r[:, None])[:, 0], derivatives(case.phi)[1](*r))
    assert np.abs(parallel).max() <= 1e-13
    end, velocity, least = slid(case.phi, r, v, crossings(case), DOWN)
    assert least > 0.1 * G
    assert np.linalg.norm(end - r) > 0.1 * case.size
    assert abs(derivatives(case.phi)[0](*end)) <= 1e-11
    energies = [0.5 * speed @ speed + G * place[2] for place, speed in ((r, v), (end, velocity))]
    assert energies[1] == pytest.approx(energies[0], abs=1e-11)


def test_the_reference_of_a_pendulum():
    """In a sphere from rest: back after 4 sqrt(R/g) K(sin(angle/2))."""
    radius, angle = 0.5, 1.0
    period = 4.0 * math.sqrt(radius / G) * float(mpmath.ellipk(math.sin(0.5 * angle) ** 2))
    r = radius * np.array([math.sin(angle), 0.0, -math.cos(angle)])
    end, velocity, _ = slid("x**2 + y**2 + z**2 - 0.25", r, np.zeros(3), period, DOWN)
    assert end == pytest.approx(r, abs=1e-11)
    assert velocity == pytest.approx(np.zeros(3), abs=1e-10)


def test_the_reference_of_friction():
    """On a plane: s = v t - mu g t^2/2."""
    end, velocity, _ = slid("-z", np.zeros(3), np.array([3.0, 4.0, 0.0]), 0.5, DOWN, 0.3)
    assert end == pytest.approx((2.5 - 0.5 * 0.3 * G * 0.25) * np.array([0.6, 0.8, 0.0]), abs=1e-13)
    assert velocity == pytest.approx((5.0 - 0.3 * G * 0.5) * np.array([0.6, 0.8, 0.0]), abs=1e-13)


# --- Against it -------------------------------------------------------------------------------------------


@every_case
def test_ten_crossings(name):
    """Without an impact, to 1e-8 of the size, at exact energy."""
    case = CASES[name]
    until = crossings(case)
    result = slide(case, swarm.Impact(), until)
    r, v, _ = slid(case.phi, *start_of(case), until, DOWN)
    assert distance(result, r) <= 1e-8 * case.size
    assert np.linalg.norm(result.particles.velocity[:, 0] - v) <= 1e-7 * np.linalg.norm(v)
    assert result.observables["impacts"][-1] <= 1
    assert result.observables["sliding"][-1] == 1
    assert result.observables["sliding_time"][-1] == pytest.approx(until, abs=ARRIVES)
    assert result.observables["energy_error"].max() <= 1e-14
    assert result.observables["max_penetration"].max() <= 4.0 * np.spacing(case.size)


@every_case
def test_the_error_follows_the_tolerance(name):
    """Proportional to it: error ~ h^4 with h ~ tolerance^(1/4)."""
    case = CASES[name]
    until = crossings(case, 3)
    r, _, _ = slid(case.phi, *start_of(case), until, DOWN)
    tolerances = np.array([1e-4, 1e-6, 1e-8])
    errors = [distance(slide(case, swarm.Impact(sliding_tolerance=each), until), r) for each in tolerances]
    assert min(errors) > 1e-13
    slope = np.polyfit(np.log(tolerances), np.log(errors), 1)[0]
    assert 0.75 <= slope <= 1.25, (errors, slope)
    # Three crossings, and the estimate of a step's error is one to a factor.
    assert (np.array(errors) <= 10.0 * tolerances * case.size).all(), errors


@pytest.mark.parametrize("name", ["sphere", "ellipsoid"])
@pytest.mark.parametrize("number", [100, pytest.param(10_000, marks=pytest.mark.long)])
def test_a_long_slide_keeps_its_energy(name, number):
    """Some 100 steps a crossing; from the particles themselves, not from the observable."""
    case = CASES[name]
    result = slide(case, swarm.Impact(), crossings(case, number), compile="always")
    r, v = start_of(case)
    end, velocity = result.particles.position[:, 0], result.particles.velocity[:, 0]
    scale = 0.5 * v @ v + G * case.size
    assert abs(0.5 * velocity @ velocity + G * end[2] - (0.5 * v @ v + G * r[2])) <= 1e-13 * scale
    assert abs(derivatives(case.phi)[0](*end)) <= 1e-14
    assert result.observables["impacts"][-1] <= 1
    assert result.observables["sliding_time"][-1] == pytest.approx(crossings(case, number), abs=ARRIVES)


def test_angular_momentum_about_the_vertical():
    """D(r0, r1) goes through the axis, so steps keep it; what makes a velocity tangent errs as the step does."""
    case = CASES["sphere"]
    r, v = start_of(case)
    for tolerance in (1e-4, 1e-9):
        method = swarm.Impact(sliding_tolerance=tolerance)
        particles = slide(case, method, crossings(case, 20)).particles
        spin = particles.position[0] * particles.velocity[1] - particles.position[1] * particles.velocity[0]
        assert spin == pytest.approx(r[0] * v[1] - r[1] * v[0], rel=20 * tolerance)


# --- Closed forms without gravity -------------------------------------------------------------------------


def test_a_great_circle():
    """To 1e-9 of the size after ten crossings."""
    case = CASES["sphere"]
    r, v = start_of(case)
    speed = np.linalg.norm(v)
    until = CROSSINGS * 0.5 / speed
    result = slide(case, swarm.Impact(sliding_tolerance=1e-11), until, gravity=None)
    angle = speed * until / 0.5
    assert distance(result, r * math.cos(angle) + v * (0.5 * math.sin(angle) / speed)) <= 1e-9 * 0.5
    turned = v * math.cos(angle) - r * (speed * math.sin(angle) / 0.5)
    assert result.particles.velocity[:, 0] == pytest.approx(turned, abs=2e-9 * speed)
    assert result.observables["impacts"][-1] <= 1


def test_a_helix():
    """Uniform along the axis, uniform about it."""
    case = CASES["cylinder"]
    r, v = start_of(case)
    axis = np.array([math.cos(TILT), 0.0, math.sin(TILT)])
    rise, height = v @ axis, r @ axis
    across, round_ = r - height * axis, v - rise * axis
    speed = np.linalg.norm(round_)
    until = CROSSINGS * 0.5 / np.linalg.norm(v)
    result = slide(case, swarm.Impact(sliding_tolerance=1e-11), until, gravity=None)
    angle = speed * until / 0.5
    expected = across * math.cos(angle) + round_ * (0.5 * math.sin(angle) / speed) + (height + rise * until) * axis
    assert angle > 2.0
    assert distance(result, expected) <= 1e-9 * 0.5
    assert result.particles.velocity[:, 0] @ axis == pytest.approx(rise, rel=1e-12)
    assert result.observables["impacts"][-1] <= 1
