"""Given motions: their common form against their definitions."""

import math

import numpy as np
import pytest
from scipy.interpolate import CubicSpline, PPoly

import swarm
from swarm.motion import led
from swarm.motion.given import Sum

START = np.array([0.3, -0.2, 0.7])
TIMES = np.linspace(0.0, 7.0, 101)
FIRST, SPIN = swarm.Translation((1.0, 2.0, -3.0)), swarm.Rotation((0.0, 0.0, 1.0), 1.0, (0.0, 0.0, 0.0))
ZEROS = ((0.0, 0.0, 0.0),) * 3
BENT = swarm.Path((0.0, 1.0), ZEROS[:2])


def test_translation():
    path = swarm.Translation((1.0, 2.0, -3.0)).harmonic(START)
    assert path.position(TIMES) == pytest.approx(START[:, None] + np.outer((1.0, 2.0, -3.0), TIMES), abs=1e-14)


@pytest.mark.parametrize("phase", [0.0, 0.4, -2.0])
def test_oscillation(phase):
    amplitude = np.array([0.1, -0.2, 0.3])
    path = swarm.Oscillation(amplitude, 1.5, phase).harmonic(START)
    wave = np.sin(3.0 * math.pi * TIMES + phase) - math.sin(phase)
    assert path.position(TIMES) == pytest.approx(START[:, None] + np.outer(amplitude, wave), abs=1e-14)


@pytest.mark.parametrize("length", [1e-200, 1.0, 1e99])
def test_rotation_is_right_handed_about_its_axis(length):
    """Rodrigues' formula, of an axis of any length."""
    axis, center = np.array([1.0, -2.0, 0.5]), np.array([0.1, 0.2, 0.3])
    unit, arm = axis / np.linalg.norm(axis), START - center
    path = swarm.Rotation(length * axis, 0.8, center).harmonic(START)
    for t in TIMES:
        c, s = math.cos(0.8 * t), math.sin(0.8 * t)
        turned = arm * c + np.cross(unit, arm) * s + unit * (unit @ arm) * (1.0 - c)
        assert path.position(t) == pytest.approx(center + turned, abs=1e-14)


def test_a_path_is_the_natural_cubic_spline_through_its_positions():
    times = (0.0, 0.4, 1.0, 1.5, 2.7)
    positions = np.random.default_rng(1).uniform(-1.0, 1.0, (len(times), 3))
    path, spline = swarm.Path(times, positions), CubicSpline(times, positions, bc_type="natural")
    for t in np.linspace(0.0, 2.7, 28):
        assert path.displacement(t) == pytest.approx(spline(t), abs=1e-14)


@pytest.mark.parametrize(
    ("times", "along"),
    [
        ((0.0, 1.0, 2.0), (0.0, 0.0, 1.0)),
        ((0.0, 0.9, 1.0, 2.5, 3.0), (0.0, 0.0, 0.0, 1.0, 1.0)),
        ((0.0, 0.5, 1.0, 2.0, 3.0, 4.5, 5.0), (0.3, 0.1, 1.0, 1.0, 0.4, 0.2, 0.2)),
        ((0.0, 1.0), (1.0, 1.0)),
    ],
)
def test_a_path_is_at_rest_between_two_equal_positions(times, along):
    path = swarm.Path(times, [(x, 1.0, -2.0 * x) for x in along])
    t = np.array(times)
    for k in np.flatnonzero(np.diff(along) == 0.0):
        for moment in np.linspace(t[k], t[k + 1], 9):
            assert path.displacement(moment).tolist() == list(path.positions[k])
    assert [path.displacement(moment)[2] for moment in times] == pytest.approx([-2.0 * x for x in along], abs=1e-14)
    spline = PPoly(np.moveaxis(path.cubics[::-1], 1, 2), path.knots)
    inner = path.knots[1:-1]
    for order in range(3):
        one = spline.derivative(order) if order else spline
        assert one(inner - 1e-9) == pytest.approx(one(inner + 1e-9), abs=1e-6)


def test_a_way_between_two_rests_stays_between_them():
    path = swarm.Path((0.0, 1.0, 2.0, 3.0), [(x, 0.0, 0.0) for x in (0.0, 0.0, 1.0, 1.0)])
    along = [path.displacement(moment)[0] for moment in np.linspace(0.0, 3.0, 301)]
    assert (np.diff(along) >= -1e-15).all()


def test_every_path_begins_at_its_start():
    motions = [
        swarm.Translation((1.0, 0.0, 0.0)),
        swarm.Oscillation((1.0, 0.0, 0.0), 1.0, 0.3),
        swarm.Rotation((0.0, 0.0, 1.0), 1.0, (5.0, 0.0, 0.0)),
        None,
    ]
    for motion in motions:
        assert (led(motion, START).position(0.0) == START).all()
    assert (led(None, START).position(1e6) == START).all()


def test_early_motion_has_all_digits():
    """The cosine's part of a slow start is t^2/2, far below the round-off of 1."""
    path = swarm.Oscillation((1.0, 0.0, 0.0), 1.0 / (2.0 * math.pi), math.pi / 2.0).harmonic((0.0, 0.0, 0.0))
    # sin(t + pi/2) - 1, without the round-off of cos(pi/2)
    moved = path.position(1e-9)[0] - path.sine[0] * 1e-9
    assert moved == pytest.approx(-5e-19, rel=1e-6, abs=0.0)


@pytest.mark.parametrize(
    ("build", "parts"),
    [
        (lambda: swarm.Translation((1.0, 2.0)), ["velocity", "three numbers", "2"]),
        (lambda: swarm.Translation((math.nan, 0.0, 0.0)), ["velocity[0]", "finite", "nan"]),
        (lambda: swarm.Translation((0.0, -1e200, 0.0)), ["|velocity[1]|", "at most 1e+100"]),
        (lambda: swarm.Oscillation(0.1, 1.0), ["amplitude", "three numbers"]),
        (lambda: swarm.Oscillation((0.1, 0.0, 0.0), 0.0), ["frequency", "above 0"]),
        (lambda: swarm.Oscillation((0.1, 0.0, 0.0), 1.0, math.inf), ["phase", "finite"]),
        (
            lambda: swarm.Oscillation((0.1, 0.0, 0.0), 1.0, -1e300),
            ["phase must be from -1e+09 to 1e+09 rad", "got -1e+300", "take it modulo 2 pi"],
        ),
        (lambda: swarm.Rotation((0.0, 0.0, 0.0), 1.0, (0.0, 0.0, 0.0)), ["axis", "direction"]),
        (lambda: swarm.Rotation((0.0, 0.0, 1.0), "fast", (0.0, 0.0, 0.0)), ["rate", "'fast'"]),
        (lambda: swarm.Rotation((0.0, 0.0, 1.0), 1.0, None), ["center", "three numbers"]),
        (lambda: swarm.Rotation((0.0, 0.0, 1.0), -1e200, (0.0, 0.0, 0.0)), ["|rate|", "at most 1e+100", "got 1e+200"]),
        (lambda: swarm.Path((0.0, 2.0, 1.0), ZEROS), ["times must ascend", "times[1] = 2 before times[2] = 1"]),
        (lambda: swarm.Path((0.0, 1.0, 1.0), ZEROS), ["times must ascend", "times[1] = 1 before times[2] = 1"]),
        (lambda: swarm.Path((0.0,), ZEROS[:1]), ["times", "at least two numbers", "got 1"]),
        (lambda: swarm.Path(0.0, ZEROS), ["times", "at least two numbers", "an array of shape ()"]),
        (lambda: swarm.Path("012", ZEROS), ["times must be an array of numbers", "got str"]),
        (lambda: swarm.Path((0.0, math.nan, 1.0), ZEROS), ["times[1] must be a finite number", "got nan"]),
        (lambda: swarm.Path((0.0, 1.0, 1e200), ZEROS), ["|times[2]|", "at most 1e+100", "got 1e+200"]),
        (lambda: swarm.Path((0.0, 1.0), ZEROS), ["positions must be one for each of the 2 times", "got 3"]),
        (lambda: swarm.Path((0.0, 1.0), 5.0), ["positions must be three numbers for each", "got 5.0"]),
        (lambda: swarm.Path((0.0, 1.0), ((0, 0, 0), (0, 0))), ["positions[1] must be three numbers", "got 2"]),
        (lambda: swarm.Path((0.0, 1.0), ((0, 0, 0), (0, math.inf, 0))), ["positions[1][1]", "finite", "got inf"]),
        (lambda: swarm.Path((0.0, 1e-90), ((0, 0, 0), (1e20, 0, 0))), ["times must be so far apart", "1e-90 s at"]),
        (lambda: Sum(()), ["at least one", "got ()"]),
        (lambda: Sum((FIRST, 3.0)), ["a sum must have motions as its parts", "3.0"]),
        (lambda: FIRST + swarm.Guide((1.0, 0.0, 0.0)), ["at most 0 Guide, got 1", "give it alone"]),
        (lambda: Sum((FIRST + SPIN, SPIN)), ["at most 1 Rotation, got 2", "about one axis their rates add up"]),
        (lambda: sum([BENT, FIRST, BENT]), ["at most 1 Path, got 2", "their displacements add up"]),
        (lambda: swarm.Sphere(1.0, motion=[BENT, BENT]), ["motion: a sum of motions", "at most 1 Path, got 2"]),
        (lambda: swarm.Sphere(1.0, motion=[]), ["motion must be None, swarm.Translation", "got []"]),
        (lambda: swarm.Sphere(1.0, motion="translation"), ["motion must be None", "got 'translation'"]),
        (
            lambda: swarm.Body([(0, 0, 0), (1, 0, 0)], 1.0, guides=[(0, swarm.Plane((0, 0, 1), motion=FIRST))]),
            ["guides[0][1] must have no motion", "anchors lead points"],
        ),
        (
            lambda: swarm.Body([(0, 0, 0), (1, 0, 0)], 1.0, cavities=[(swarm.Sphere(2.0, mass=1.0), 0, 1)]),
            ["cavities[0][0] must have no motion", "moves with its carrier"],
        ),
    ],
)
def test_errors_name_the_argument(build, parts):
    with pytest.raises(swarm.SceneError) as caught:
        build()
    assert all(part in str(caught.value) for part in parts), str(caught.value)


def test_a_rotation_without_a_center_is_about_the_origin():
    assert swarm.Rotation((0.0, 0.0, 1.0), 2.0) == swarm.Rotation((0.0, 0.0, 1.0), 2.0, (0.0, 0.0, 0.0))
