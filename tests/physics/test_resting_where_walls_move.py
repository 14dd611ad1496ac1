"""What rests is struck by walls that come, at the instant and with the velocity that closed forms say."""

import math
import re

import numpy as np
import pytest
from energy_books import unbooked
from same_bits import require_same

import swarm

G = 9.81
DOWN = (0.0, 0.0, -G)
COMES = swarm.Translation((-0.5, 0.0, 0.0))
FRICTION = 0.3
STILL = swarm.Particles([0.5, 0.0, 0.0], [0.0, 0.0, 0.0], 2.0)


def floor(friction=FRICTION, motion=None):
    return swarm.Plane((0.0, 0.0, -1.0), friction=friction, restitution=0.0, motion=motion)


def run(walls, until, start=STILL, **options):
    options = {"every": 0.1, "compile": "never", **options}
    return swarm.simulate(swarm.Scene(walls, DOWN), start, swarm.Impact(), until=until, **options)


def require_booked(result):
    seen = result.observables
    assert unbooked(seen) <= 1e-15 * np.abs(seen["wall_work"].sum(axis=1)).max()
    assert seen["max_penetration"].max() <= 1e-15


def test_a_plate_strikes_what_rests_on_a_floor():
    """x = 1/2 until 1 s, then it slides from 1 m/s with mu g against it until the plate is there again."""
    result = run([floor(), swarm.Plane((1, 0, 0), 1.0, motion=COMES)], 1.2)
    assert result.particles.position[0, 0] == pytest.approx(0.5 - 0.2 + 0.5 * FRICTION * G * 0.04, abs=1e-9)
    assert result.particles.velocity[0, 0] == pytest.approx(-1.0 + FRICTION * G * 0.2, abs=1e-9)
    # 2 m (1 m/s) (1/2 m/s)
    assert result.observables["wall_work"][-1] == pytest.approx([0.0, 1.0], abs=1e-14)
    assert result.observables["impacts"][-1] == 1
    require_booked(result)


def test_a_plate_takes_along_what_rests_on_a_smooth_floor():
    result = run([floor(0.0), swarm.Plane((1, 0, 0), 1.0, restitution=0.0, motion=COMES)], 2.0)
    assert result.particles.position[:, 0] == pytest.approx((0.0, 0.0, 0.0), abs=1e-14)
    assert result.particles.velocity[:, 0].tolist() == [-0.5, 0.0, 0.0]
    seen = result.observables
    assert (seen["wall_work"][-1, 1], seen["dissipated_energy"][-1]) == (0.5, 0.25)
    require_booked(result)


@pytest.mark.parametrize("every", [0.1, 2.0])
@pytest.mark.parametrize("aside", [0.0, 0.07, 0.1 - 1e-9])
def test_a_ball_strikes_what_rests(aside, every):
    """Also where it sinks in by a billionth of a metre only, and comes and goes within a frame."""
    ball = swarm.Sphere(0.1, center=(1.0, aside, 0.0), side="outside", motion=COMES)
    way = math.sqrt(0.01 - aside**2)
    # While it is there, and a little longer: with friction what it has struck is struck again.
    until = 2.0 * (0.5 - way) + 0.01 if every < 1.0 else 1.05
    result = run([floor(), ball], until, every=min(every, until))
    # u.n = u way/R, and the ball gives twice that along n
    given = 2.0 * 2.0 * (0.5 * way / 0.1) ** 2
    assert result.observables["impacts"][-1] == 1
    assert result.observables["wall_work"][-1] == pytest.approx([0.0, given], rel=1e-5, abs=1e-15)
    require_booked(result)


@pytest.mark.parametrize("every", [0.1, 2.0])
def test_a_ball_passes_what_rests(every):
    ball = swarm.Sphere(0.1, center=(1.0, 0.1 + 1e-9, 0.0), side="outside", motion=COMES)
    result = run([floor(), ball], 2.0, every=every)
    assert result.particles.position[:, 0].tolist() == [0.5, 0.0, 0.0]
    assert result.observables["impacts"][-1] == 0
    assert not result.observables["wall_work"].any()


def test_a_block_that_swings_strikes_what_rests():
    """Its face is at 0.7 - a sin(w t): at the grain where the sine is 0.8, with -a w cos(w t) of it."""
    swing = swarm.Oscillation((-0.25, 0.0, 0.0), 0.7)
    block = swarm.Box((0.1, 0.1, 0.1), center=(0.8, 0.0, 0.05), side="outside", motion=swing)
    rate = 2.0 * math.pi * 0.7
    struck = math.asin(0.8) / rate
    speed = -2.0 * 0.25 * rate * 0.6
    result = run([floor(0.0), block], struck + 0.05)
    assert result.particles.velocity[0, 0] == pytest.approx(speed, rel=1e-12)
    assert result.particles.position[0, 0] == pytest.approx(0.5 + 0.05 * speed, rel=1e-12)
    assert result.observables["wall_work"][-1] == pytest.approx([0.0, 2.0 * 0.5 * speed**2], abs=1e-13)


def test_a_rotor_sweeps_a_grain_along_a_table_that_rises():
    """The grain goes up with the table, and is struck by a blade that turns above it."""
    blade = swarm.Box((0.6, 0.02, 0.3), side="outside", motion=swarm.Rotation((0.0, 0.0, 1.0), 1.0, (0.0, 0.0, 0.0)))
    start = swarm.Particles([0.4, 0.3, 0.0], [0.0, 0.0, 0.02], 1.0)
    table = floor(0.5, swarm.Translation((0.0, 0.0, 0.02)))
    # Where the blade's face is at the grain: R sin(angle - t) = 0.02
    struck = math.atan2(0.3, 0.4) - math.asin(0.02 / 0.5)
    before, after = (run([swarm.Box((1, 1, 1)), table, blade], t, start) for t in (struck - 1e-3, struck + 1e-3))
    assert before.particles.position[:, 0] == pytest.approx((0.4, 0.3, 0.02 * (struck - 1e-3)), abs=1e-14)
    assert before.observables["sliding"][-1] == 1
    # Across the blade its point has sqrt(R^2 - 0.02^2) rad/s, and the grain twice that.
    across = 2.0 * math.sqrt(0.25 - 4e-4)
    assert math.hypot(*after.particles.velocity[:2, 0]) == pytest.approx(across - 0.5 * G * 1e-3, abs=1e-4)
    assert after.particles.velocity[2, 0] == 0.02
    require_booked(after)


def test_a_ceiling_that_closes_on_what_rests_is_reported(tmp_path):
    """It does not pass it: the run ends with where and when."""
    lid = swarm.Plane((0.0, 0.0, 1.0), 0.25, restitution=0.0, motion=swarm.Translation((0.0, 0.0, -0.5)))
    with pytest.raises(swarm.RunError) as caught:
        run([floor(), lid], 1.0, every=0.2, trajectory=tmp_path / "run.h5")
    place = r"it is at \(0\.5, 0, (\S+)\) m, .* at ([\d.]+) s: walls that move"
    reported = re.search(place, str(caught.value))
    assert reported is not None, str(caught.value)
    # It is seen after the short step in which it happens: there the lid has pressed it down by its way since.
    height, instant = (float(number) for number in reported.groups())
    assert instant == pytest.approx(0.5, abs=1e-4)
    assert 0.25 - 0.5 * instant <= height <= 0.0
    with swarm.load(tmp_path / "run.h5") as trajectory:
        assert trajectory.times[-1] == pytest.approx(0.4)


@pytest.mark.physics
@pytest.mark.parametrize("friction", [0.0, 0.3])
@pytest.mark.parametrize(
    "motion",
    [
        swarm.Translation((0.0, 0.0, 0.1)),
        swarm.Oscillation((0.0, 0.0, 0.01), 1.0),
        swarm.Rotation((0, 1, 0), 0.3, (0, 0, 0)),
    ],
    ids=lambda motion: type(motion).__name__,
)
def test_the_speed_across_a_floor_that_is_kept_on_it_is_work_of_the_floor(motion, friction):
    """An elastic floor gives it back, at another speed of its own: in the frame of the floor it is the same."""
    scene = swarm.Scene([swarm.Box((1, 1, 1), (0, 0, 1), motion=motion, friction=friction)], (0.3, 0.0, -9.81))
    floor = motion.velocity[2] if isinstance(motion, swarm.Translation) else 0.0
    floor = 0.01 * 2.0 * math.pi if isinstance(motion, swarm.Oscillation) else floor
    start = swarm.Particles((0.0, 0.0, 1e-9), (1.0, 0.0, floor - 1e-5))
    seen = swarm.simulate(scene, start, swarm.Impact(), until=0.2, every=0.02, compile="never").observables
    assert seen["sliding"][1:].all()
    assert unbooked(seen) <= 1e-14 * abs(seen["total_energy"][0])


def test_threads_change_no_bit():
    """Sixty grains on a floor, and a ball that goes through them."""
    places = np.random.default_rng(3).uniform(-0.4, 0.4, (3, 60))
    places[2] = 0.0
    ball = swarm.Sphere(0.1, center=(1.0, 0.0, 0.0), side="outside", motion=COMES)
    results = [
        run([floor(), ball], 4.0, swarm.Particles(places, np.zeros((3, 60))), threads=n, compile="always")
        for n in (1, 2)
    ]
    assert results[0].observables["impacts"][-1] > 10
    require_same(*results)
    require_booked(results[0])
