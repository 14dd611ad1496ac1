"""Counters and sources of points whose contacts take steps: against the frames of every step."""

import numpy as np
import pytest

import swarm

STEP = 5e-3
PULL = (0.3, -0.2, -2.0)
SCENE = swarm.Scene([swarm.Ellipsoid((0.4, 0.5, 0.6))])
FALL = swarm.Scene([swarm.Ellipsoid((0.4, 0.5, 0.6))], PULL)
BOXED = swarm.Scene([swarm.Box((0.4, 0.5, 0.6))])
# The last one is beyond the walls: particles cross it in contact steps alone. Steps in corners are done one by one.
PLANES = [swarm.Plane((1.0, 0.0, 0.0), 0.1), swarm.Ellipsoid((0.41, 0.51, 0.61))]
SOFT = swarm.Penalty(dt=STEP, penalty=400.0)
LOOP = swarm.AugmentedLagrangian(dt=STEP, penalty=400.0, max_sweeps=3, on_unconverged="count")
CUT = swarm.AugmentedLagrangian(dt=STEP, penalty=4e3, adaptive=True, acceleration="reflection", on_unconverged="impact")
CASES = [(SCENE, SOFT), (BOXED, LOOP), (FALL, swarm.Verlet(STEP, 400.0)), (SCENE, CUT)]


def run(scene, method, start, until=0.5, **keywords):
    return swarm.simulate(
        scene, start, method, until=until, **{"every": 0.25, "compile": "never", "threads": 1, **keywords}
    )


@pytest.mark.parametrize(("scene", "method"), CASES)
def test_steps_cross_counters_as_often_as_their_ends_do(scene, method):
    start = swarm.fill(scene, 6, speed=2.0, mass=2.0, seed=3)
    ends = []
    of_steps = run(
        scene, method, start, every=STEP, progress=lambda frame: ends.append(frame.position.copy()), counters=PLANES
    )
    # A frame cuts the steps that begin at impacts.
    seen = (of_steps if method is CUT else run(scene, method, start, counters=PLANES)).observables
    ends = np.array(ends)
    for k, plane in enumerate(PLANES):
        out = plane.phi(ends.transpose(1, 0, 2).reshape(3, -1)).reshape(len(ends), -1) > 0.0
        expected = [int((out[1:] & ~out[:-1]).sum()), int((~out[1:] & out[:-1]).sum())]
        assert seen["crossings"][-1, k].tolist() == expected
    if method is SOFT:
        assert seen["crossings"][-1].min() > 0


@pytest.mark.parametrize(("scene", "method"), CASES[:2])
def test_counters_change_no_bit_of_steps(scene, method):
    start = swarm.fill(scene, 6, speed=2.0, mass=2.0, seed=4)
    one, other = run(scene, method, start), run(scene, method, start, counters=PLANES)
    assert np.array_equal(one.particles.position, other.particles.position)
    assert np.array_equal(one.particles.velocity, other.particles.velocity)
    assert np.array_equal(one.impacts_per_particle, other.impacts_per_particle)


@pytest.mark.parametrize("method", [SOFT, LOOP, CUT])
def test_sources_release_particles_at_the_ends_of_steps(method):
    inlet = swarm.Sphere(0.1)
    source = swarm.Source(inlet, volume=True, times=[0.0, 0.1, 0.1023, 0.4], speed=2.0, mass=2.0)
    result = run(FALL if method is SOFT else SCENE, method, None, sources=[source], seed=5)
    steps = result.birth_time / STEP
    expected = [0.0, 20.0, 20.46 if method is CUT else 21.0, 80.0]
    np.testing.assert_allclose(steps, expected, rtol=1e-12, atol=1e-12)
    seen = result.observables
    assert seen["born"][:, 0].tolist() == [1, 3, 4]
    error = seen["total_energy"] - seen["source_energy"]
    if method is not LOOP:
        np.testing.assert_allclose(error, error[0], rtol=0.0, atol=1e-12 * seen["kinetic_energy"].max())
        assert seen["impacts"][-1] > 0


def test_particles_from_a_source_fly_as_those_that_start_then():
    source = swarm.Source(swarm.Sphere(0.1), volume=True, times=[0.05], speed=2.0, mass=2.0)
    late = run(FALL, SOFT, None, sources=[source], seed=5)
    first = run(FALL, SOFT, None, sources=[source], seed=5, until=0.05, every=0.05)
    again = run(FALL, SOFT, first.particles, until=0.45, every=0.45)
    np.testing.assert_allclose(late.particles.position, again.particles.position, rtol=0.0, atol=1e-14)
    np.testing.assert_allclose(late.particles.velocity, again.particles.velocity, rtol=0.0, atol=1e-13)
