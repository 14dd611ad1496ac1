"""Counters against closed forms: the fluxes of a gas, a ball that bounces, billiards."""

import math

import numpy as np
import pytest

import swarm

# Standard errors within which a mean is.
_ERRORS = 3.0


def run(scene, start, until, counters, **keywords):
    return swarm.simulate(scene, start, swarm.Impact(), until=until, counters=counters, **keywords)


@pytest.mark.physics
def test_fluxes_of_a_gas_through_planes_and_patches():
    """Each way through a place at rest: n v/4, the momentum n kT/2, the energy 2 kT a particle, the density."""
    kt, m, until, n = 2.0, 0.5, 2.0, 20_000
    box = swarm.Scene([swarm.Box((0.5, 0.4, 0.3))])
    start = swarm.fill(box, n, temperature=kt, mass=m, seed=3)
    plane = swarm.Plane((1.0, 0.0, 0.0), 0.1)
    disc = swarm.Counter(plane, inside=swarm.Cylinder(0.2, axis=(1.0, 0.0, 0.0)))
    ball = swarm.Sphere(0.2)
    areas = [0.8 * 0.6, math.pi * 0.04, 4.0 * math.pi * 0.04]
    result = run(box, start, until, [plane, disc, ball], compile="always")
    density, mean = n / (1.0 * 0.8 * 0.6), math.sqrt(8.0 * kt / (math.pi * m))
    seen = {name: result.observables[name][-1] for name in ("crossings", "crossed_energy", "crossed_momentum")}
    slowness = result.observables["crossed_slowness"][-1]
    for k, area in enumerate(areas):
        for sense in (0, 1):
            number = seen["crossings"][k, sense]
            expected = density * mean / 4.0 * area * until
            # Of a particle that comes again and again more than of a Poisson process: sigma of |v_x| over its mean.
            again = math.sqrt(expected) * math.sqrt(1.0 + expected / n)
            assert abs(number - expected) < _ERRORS * again
            # The energy of those that cross has the mean 2 kT and the deviation sqrt(2) kT.
            energy = seen["crossed_energy"][k, sense] / number
            assert abs(energy - 2.0 * kt) < _ERRORS * math.sqrt(2.0) * kt / math.sqrt(number) * again / math.sqrt(
                expected
            )
            assert abs(slowness[k, sense] / (area * until) - density / 2.0) < 0.05 * density
    for k in (0, 1):
        out, back = seen["crossed_momentum"][k]
        pressure = (out - back) / (areas[k] * until)
        # By the particles: each has m v_x^2 through the plane in the mean, of deviation sqrt(2) kT.
        number = seen["crossings"][k].sum()
        error = density * kt * math.sqrt(2.0) * (1.0 / math.sqrt(number) + 1.0 / math.sqrt(n))
        assert abs(pressure[0] - density * kt) < _ERRORS * error
        assert np.abs(pressure[1:]).max() < _ERRORS * error


@pytest.mark.parametrize("compile", ["never", pytest.param("always", marks=pytest.mark.physics)])
def test_a_ball_that_bounces_crosses_a_plane_at_known_instants(compile, tmp_path):
    """From 1 m under g = 2 m/s^2 it falls for 1 s; at 0.75 m it is after 0.5 s, and 1.5 s, 2.5 s, ..."""
    floor = swarm.Scene([swarm.Plane((0.0, 0.0, -1.0), 0.0)], gravity=(0.0, 0.0, -2.0))
    start = swarm.Particles([0.0, 0.0, 1.0], [0.0, 0.0, 0.0])
    counters = [swarm.Plane((0.0, 0.0, 1.0), 0.75), swarm.Plane((0.0, 0.0, 1.0), 1.0), swarm.Sphere(0.25)]
    path = tmp_path / "i.h5"
    result = run(floor, start, 40.0, counters, compile=compile, impacts=path, every=0.3)
    again = run(floor, start, 40.0, counters, compile=compile, every=0.3)
    assert result.observables["crossings"][-1].tolist() == again.observables["crossings"][-1].tolist()
    # It only comes up to 1 m: round-off decides whether it is above.
    above, top, ball = result.observables["crossings"][-1].tolist()
    assert above == [20, 20]
    assert top[0] == top[1]
    assert ball == [20, 20]
    with swarm.load_impacts(path) as log:
        rows = log.table()
    rows = rows[rows["counter"] == 0]
    np.testing.assert_allclose(rows["time"], 0.5 + np.arange(40.0), rtol=1e-12)
    assert rows["sense"].tolist() == [1, 0] * 20
    np.testing.assert_allclose(np.abs(rows["velocity_before"][:, 2]), 1.0, rtol=1e-11)


@pytest.mark.parametrize("distance", [0.0, 0.1, 0.19])
def test_a_chord_of_a_billiard_crosses_a_circle_within_at_known_instants(distance, tmp_path):
    """A chord at a distance from the centre is cut at half widths of both circles, again and again."""
    sphere, path = swarm.Scene([swarm.Sphere(0.5)]), tmp_path / "i.h5"
    half, within = math.sqrt(0.25 - distance**2), math.sqrt(0.04 - distance**2)
    start = swarm.Particles([-half, distance, 0.0], [1.0, 0.0, 0.0])
    result = run(sphere, start, 20.0, [swarm.Sphere(0.2)], compile="never", impacts=path)
    chords = 20.0 / (2.0 * half)
    whole, rest = int(chords), 20.0 - 2.0 * half * int(chords)
    expected = [whole + (rest > half + within), whole + (rest > half - within)]
    assert result.observables["crossings"][-1].tolist() == [expected]
    with swarm.load_impacts(path) as log:
        rows = log.table()
    rows = rows[rows["counter"] == 0]
    instants = [2.0 * half * k + half + sign * within for k in range(whole + 1) for sign in (-1.0, 1.0)]
    np.testing.assert_allclose(rows["time"], instants[: len(rows)], rtol=1e-11)


@pytest.mark.long
def test_ten_million_crossings_balance_to_the_last_one():
    scene = swarm.Scene([swarm.Sphere(0.5)])
    start = swarm.fill(scene, 20_000, temperature=1.0, seed=1)
    shapes = [swarm.Sphere(0.4), swarm.Plane((1.0, 0.0, 0.0), 0.05), swarm.Ellipsoid((0.2, 0.3, 0.4))]
    result = run(scene, start, 100.0, shapes, compile="always")
    crossings = result.observables["crossings"][-1]
    assert crossings.sum() > 1e7
    for shape, (out, back) in zip(shapes, crossings.tolist(), strict=True):
        outside = [(shape.phi(one.position) > 0.0).sum() for one in (start, result.particles)]
        assert out - back == outside[1] - outside[0]
