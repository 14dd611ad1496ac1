"""A particle that settles in a corner of three walls goes with those that move, in closed form."""

import math

import numpy as np
import pytest
from energy_books import unbooked

import swarm

PULL = np.array([-5.0, -6.0, -9.81])
START = swarm.Particles((0.1, 0.1, 0.1), (0.0, 0.0, 0.0), 2.0)
LIFT = swarm.Translation((0.0, 0.0, 0.01))


def corner(motion=LIFT, friction=0.0, aside=None, tilt=0.0):
    """x >= 0, y >= 0, z >= 0, whose floor moves."""
    laws = {"friction": friction, "restitution": 0.5}
    walls = [
        swarm.Plane((-1.0, 0.0, tilt), 0.0, **laws),
        swarm.Plane((0.0, -1.0, -tilt), 0.0, motion=aside, **laws),
        swarm.Plane((0.0, 0.0, -1.0), 0.0, motion=motion, **laws),
    ]
    return swarm.Scene(walls, tuple(PULL))


def run(scene, until=2.0, **options):
    return swarm.simulate(scene, START, swarm.Impact(), until=until, **{"compile": "never", "every": 0.5, **options})


def require_booked(seen):
    assert unbooked(seen) <= 1e-14 * np.abs(seen["dissipated_energy"]).max()
    assert (np.diff(seen["dissipated_energy"]) >= -1e-15).all()
    assert seen["max_penetration"].max() <= 1e-15


@pytest.mark.parametrize("every", [0.05, 0.5, 2.0])
def test_a_floor_lifts_what_has_settled_in_a_corner(every):
    result = run(corner(), every=every)
    seen = result.observables
    assert result.particles.position[:, 0] == pytest.approx((0.0, 0.0, 0.02), abs=1e-16)
    assert result.particles.velocity[:, 0] == pytest.approx((0.0, 0.0, 0.01), abs=1e-16)
    assert seen["sliding"][-1] == 1
    if every < 2.0:
        # From 1 s on it is at rest on three walls: m |g_i| T, and m g v T of the floor.
        one, two = round(1.0 / every), round(2.0 / every)
        changes = {name: seen[name][two] - seen[name][one] for name in ("impulse", "wall_work", "impacts")}
        assert changes["impulse"] == pytest.approx(2.0 * -PULL, rel=1e-13)
        assert changes["wall_work"] == pytest.approx([0.0, 0.0, 2.0 * 9.81 * 0.01], rel=1e-12)
        assert seen["dissipated_energy"][two] == pytest.approx(seen["dissipated_energy"][one], rel=1e-15)
        assert changes["impacts"] == 0
    require_booked(seen)


def test_it_rubs_on_the_walls_that_stay():
    """Both press with m g_i against mu g_i each along the way: the floor lifts these too, and that is heat."""
    seen = run(corner(friction=0.3)).observables
    given, work = seen["impulse"][4] - seen["impulse"][2], seen["wall_work"][4] - seen["wall_work"][2]
    drag = 0.3 * 11.0
    assert given == pytest.approx(2.0 * np.array([5.0, 6.0, 9.81 + drag]), rel=1e-13)
    assert work == pytest.approx([0.0, 0.0, 2.0 * 0.01 * (9.81 + drag)], rel=1e-12, abs=1e-15)
    assert seen["dissipated_energy"][4] - seen["dissipated_energy"][2] == pytest.approx(2.0 * 0.01 * drag, rel=1e-12)
    require_booked(seen)


def test_a_floor_that_oscillates_carries_it():
    """As long as A w^2 < g: here a fifth of it."""
    result = run(corner(swarm.Oscillation((0.0, 0.0, 0.0125), 2.0)), until=2.1)
    seen, w = result.observables, 4.0 * math.pi
    assert result.particles.position[2, 0] == pytest.approx(0.0125 * math.sin(w * 2.1), abs=1e-15)
    assert result.particles.velocity[2, 0] == pytest.approx(0.0125 * w * math.cos(w * 2.1), abs=1e-14)
    # Of two whole periods the weight alone is left.
    assert seen["impulse"][4] - seen["impulse"][2] == pytest.approx(-2.0 * PULL, rel=1e-7)
    assert seen["impacts"][2] == seen["impacts"][-1]
    require_booked(seen)


def test_a_floor_that_falls_faster_lets_it_go():
    """A w^2 > g: it is thrown again and again, and the corner has it in between."""
    seen = run(corner(swarm.Oscillation((0.0, 0.0, 0.1), 2.0)), until=3.0).observables
    assert seen["impacts"][-1] > seen["impacts"][-3]
    require_booked(seen)


def test_a_corner_of_walls_that_lean_goes_where_they_meet():
    """z = w t, x = z tilt and y = v t - z tilt, with the speed v of the second wall along its normal's y."""
    result = run(corner(tilt=0.1, aside=swarm.Translation((0.0, 0.02, 0.0))))
    assert result.particles.position[:, 0] == pytest.approx((0.002, 0.038, 0.02), abs=1e-15)
    assert result.particles.velocity[:, 0] == pytest.approx((0.001, 0.019, 0.01), abs=1e-15)
    require_booked(result.observables)


def test_a_plate_strikes_what_is_carried():
    """From above at 1/2 m/s: the corner holds it against the plate, until the plate is past what it may be."""
    scene = corner()
    ball = swarm.Sphere(0.05, center=(0.6, 0.0, 0.02), side="outside", motion=swarm.Translation((-0.3, 0.0, 0.0)))
    with pytest.raises(swarm.RunError, match="particle 0"):
        swarm.simulate(
            swarm.Scene([*scene.surfaces, ball], tuple(PULL)), START, swarm.Impact(), until=3.0, compile="never"
        )


def test_compiled_it_is_carried_with_the_same_bits():
    """From the corner itself no kernel that slides is compiled: those of impacts and short steps take 20 s."""
    start = swarm.Particles((0.0, 0.0, 0.0), LIFT.velocity, 2.0)
    results = [
        swarm.simulate(corner(), start, swarm.Impact(), until=1.0, every=0.5, compile=choice)
        for choice in ("always", "never")
    ]
    for result in results:
        assert result.particles.position[:, 0] == pytest.approx((0.0, 0.0, 0.01), abs=1e-16)
    one, other = (result.observables for result in results)
    assert all((one[name] == other[name]).all() for name in one)
