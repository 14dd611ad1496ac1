"""Coulomb's friction: blocks on inclines, impacts, floors and bowls, by closed forms; and the account of energy."""

import math

import numpy as np
import pytest
from physics.billiards import run
from physics.sliding_reference import along_wall, on_wall, slid

import swarm

pytestmark = pytest.mark.physics

G = 9.81
DOWN = (0.0, 0.0, -G)
THETA = 0.5
SINE, COSINE = math.sin(THETA), math.cos(THETA)
NORMAL = np.array([SINE, 0.0, COSINE])
DOWNHILL = np.array([COSINE, 0.0, -SINE])
# mu < tan(theta) = 0.546, and mu > tan(theta)
SLIPS, STICKS = 0.3, 0.7
MASS = 2.0
# Out of reach: scenes of planes have the same number of them, and so the same kernel.
FAR = swarm.Plane((0.0, 0.0, 1.0), 50.0, friction=0.1)


def incline(friction, restitution=1.0, gravity=DOWN):
    wall = swarm.Plane(tuple(-NORMAL), 0.0, friction=friction, restitution=restitution)
    return swarm.Scene([wall, FAR], gravity)


def floor(friction, restitution=1.0, gravity=DOWN):
    return swarm.Scene([swarm.Plane((0.0, 0.0, -1.0), 0.0, friction=friction, restitution=restitution), FAR], gravity)


def block(velocity, position=(0.0, 0.0, 0.0)):
    return swarm.Particles(position, velocity, MASS)


def account(result):
    """Largest change of total + dissipated energy, relative to the largest of either."""
    energies = [result.observables[name] for name in ("total_energy", "dissipated_energy", "kinetic_energy")]
    total = energies[0] + energies[1]
    return np.abs(total - total[0]).max() / max(np.abs(energy).max() for energy in energies)


# --- On an incline ----------------------------------------------------------------------------------------


def test_a_block_slides_down_an_incline():
    """With g (sin - mu cos), and friction takes mu m g cos a metre."""
    pull, until = G * (SINE - SLIPS * COSINE), 2.0
    result = run(incline(SLIPS), block([0.0] * 3), swarm.Impact(), until, 0.25)
    way = 0.5 * pull * until**2
    assert result.particles.position[:, 0] == pytest.approx(way * DOWNHILL, abs=1e-9 * way)
    assert result.particles.velocity[:, 0] == pytest.approx(pull * until * DOWNHILL, abs=1e-9 * pull * until)
    lost = 0.5 * SLIPS * MASS * G * COSINE * pull * result.observables["time"] ** 2
    assert result.observables["dissipated_energy"] == pytest.approx(lost, rel=1e-9)
    assert result.observables["sliding_time"][-1] == pytest.approx(until, rel=1e-12)
    assert result.observables["impacts"][-1] <= 1
    assert account(result) <= 1e-13


@pytest.mark.parametrize("friction", [STICKS, 1.001 * math.tan(THETA), 1e6])
def test_a_block_stays_on_an_incline(friction):
    """Not a bit of it moves, and it counts as sliding."""
    result = run(incline(friction), block([0.0] * 3), swarm.Impact(), 100.0, 10.0)
    assert (result.particles.position == 0.0).all()
    assert (result.particles.velocity == 0.0).all()
    assert result.observables["sliding"][-1] == 1
    assert result.observables["sliding_time"][-1] == pytest.approx(100.0, rel=1e-12)
    assert result.observables["dissipated_energy"][-1] == 0.0
    assert result.observables["impacts"][-1] <= 1
    # The wall carries the normal part of the weight.
    assert result.observables["impulse"][-1][0] == pytest.approx(MASS * G * COSINE * 100.0, rel=1e-12)


def test_a_little_less_friction_and_it_goes():
    """The cone's edge is sharp: mu = 0.999 tan(theta); to 1e-9 of either force, whose difference is left."""
    friction = 0.999 * math.tan(THETA)
    result = run(incline(friction), block([0.0] * 3), swarm.Impact(), 10.0)
    way = 0.5 * G * (SINE - friction * COSINE) * 100.0
    assert way > 0.2
    assert result.particles.position[:, 0] == pytest.approx(way * DOWNHILL, abs=1e-9 * 0.5 * G * SINE * 100.0)


@pytest.mark.parametrize("friction", [SLIPS, STICKS])
def test_a_block_thrown_up_an_incline(friction):
    """It stops after v^2/(2g (sin + mu cos)); then it stays, or slides back with g (sin - mu cos)."""
    speed = 3.0
    brake, pull = G * (SINE + friction * COSINE), max(0.0, G * (SINE - friction * COSINE))
    stop, top = speed / brake, speed**2 / (2.0 * brake)
    scene, start = incline(friction), block(-speed * DOWNHILL)
    for time in (0.5 * stop, 0.999 * stop, 1.001 * stop, 2.0 * stop, 5.0 * stop):
        result = run(scene, start, swarm.Impact(), time)
        up, after = min(time, stop), max(time - stop, 0.0)
        way = speed * up - 0.5 * brake * up**2 - 0.5 * pull * after**2
        rate = speed - brake * up - pull * after
        assert result.particles.position[:, 0] == pytest.approx(-way * DOWNHILL, abs=1e-9 * top)
        assert result.particles.velocity[:, 0] == pytest.approx(-rate * DOWNHILL, abs=1e-9 * speed)
        lost = 0.5 * MASS * (speed**2 - rate**2) - MASS * G * way * SINE
        assert result.observables["dissipated_energy"][-1] == pytest.approx(lost, rel=1e-9)
        assert account(result) <= 1e-13
    if friction == STICKS:
        assert (result.particles.velocity == 0.0).all()
        assert result.particles.position[:, 0] == pytest.approx(-top * DOWNHILL, abs=1e-9 * top)


def test_a_block_thrown_across_an_incline():
    """Friction turns with the velocity: no closed form, but the reference."""
    until, velocity = 1.5, np.array([0.0, 2.0, 0.0])
    phi = f"-(x*{SINE!r} + z*{COSINE!r})"
    result = run(incline(SLIPS), block(velocity), swarm.Impact(sliding_tolerance=1e-10), until)
    r, v, least = slid(phi, np.zeros(3), velocity, until, DOWN, SLIPS)
    assert least == pytest.approx(G * COSINE, rel=1e-9)
    assert np.linalg.norm(result.particles.position[:, 0] - r) <= 1e-8 * np.linalg.norm(r)
    assert np.linalg.norm(result.particles.velocity[:, 0] - v) <= 1e-8 * np.linalg.norm(v)


# --- At impacts -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("e", [1.0, 0.6, 0.0])
@pytest.mark.parametrize("friction", [0.1, 0.4, 2.0])
def test_the_tangential_impulse(friction, e):
    """It opposes the slip s and is the lesser of mu (1 + e) v_n and s, a mass."""
    slip, down = np.array([0.6, -0.8, 0.0]), 1.5
    result = run(floor(friction, e, None), block([0.6, -0.8, -down], (0.0, 0.0, 0.75)), swarm.Impact(), 1.0)
    left = 1.0 - min(friction * (1.0 + e) * down, 1.0)
    assert result.observables["impacts"][-1] == 1
    expected = left * slip + [0.0, 0.0, e * down]
    assert result.particles.velocity[:, 0] == pytest.approx(expected, abs=1e-13)
    assert result.particles.position[:, 0] == pytest.approx(0.5 * slip + 0.5 * expected, abs=1e-13)
    lost = 0.5 * MASS * (1.0 + down**2 - left**2 - (e * down) ** 2)
    assert result.observables["dissipated_energy"][-1] == pytest.approx(lost, rel=1e-13)
    assert result.observables["impulse"][-1][0] == pytest.approx(MASS * (1.0 + e) * down, rel=1e-13)
    assert account(result) <= 1e-14


def test_a_bouncing_ball_loses_its_slip():
    """Impact k takes mu (1 + e) e^k v from it: 2 mu v/(1 - e) (1 + e)/2 in all, and it glides on to a stop."""
    friction, e, down, slip = 0.1, 0.5, 2.0, 1.5
    scene, start = floor(friction, e), block([slip, 0.0, down])
    rest = 2.0 * down / (G * (1.0 - e))
    # The flights, of 2 v e^k/g, and the slip that the impacts before them leave.
    impacts = friction * (1.0 + e) * down * np.cumsum(e ** np.arange(60))
    slips = slip - np.concatenate(([0.0], impacts))
    way = float((2.0 * down / G * e ** np.arange(61) * slips).sum())
    left = slips[-1]
    assert left > 0.5
    stop = left / (friction * G)
    for after in (0.5 * stop, 2.0 * stop):
        result = run(scene, start, swarm.Impact(), rest + after)
        gliding = min(after, stop)
        end = way + left * gliding - 0.5 * friction * G * gliding**2
        assert result.particles.position[:, 0] == pytest.approx([end, 0.0, 0.0], abs=1e-9)
        assert result.particles.velocity[0, 0] == pytest.approx(left - friction * G * gliding, abs=1e-9)
        assert result.observables["sliding_time"][-1] == pytest.approx(after, rel=1e-8)
        assert account(result) <= 1e-13
    assert (result.particles.velocity == 0.0).all()


def test_nothing_moves_without_slip():
    """A ball dropped on a floor with friction falls back where it came from."""
    result = run(floor(1.0, 0.5), block([0.0] * 3, (0.2, -0.3, 0.4)), swarm.Impact(), 10.0)
    assert result.particles.position[:, 0].tolist() == pytest.approx([0.2, -0.3, 0.0], abs=1e-15)
    assert (result.particles.velocity == 0.0).all()
    assert result.observables["dissipated_energy"][-1] == pytest.approx(MASS * G * 0.4, rel=1e-13)


# --- On floors and in bowls -------------------------------------------------------------------------------


def test_gliding_to_a_stop_between_the_sides_of_a_box():
    """The way v^2/(2 mu g), folded; the sides, hit at right angles, take no slip."""
    friction, speed, half = 0.02, 0.9, 0.4
    scene = swarm.Scene([swarm.Box((half, 0.5, 0.25), friction=friction)], DOWN)
    stop, way = speed / (friction * G), speed**2 / (2.0 * friction * G)
    start = block([speed, 0.0, 0.0], (0.1, 0.0, -0.25))
    result = run(scene, start, swarm.Impact(), 1.5 * stop, 0.5 * stop)
    # 0.1 + 2.06: past the side at 0.4 and at 1.2, and back.
    turned = (0.1 + way + half) % (4.0 * half)
    x = turned - half if turned < 2.0 * half else 3.0 * half - turned
    assert result.particles.position[:, 0] == pytest.approx([x, 0.0, -0.25], abs=1e-9)
    assert (result.particles.velocity == 0.0).all()
    sides = math.floor((0.1 + way + half) / (2.0 * half))
    assert sides >= 2
    assert sides <= result.observables["impacts"][-1] <= sides + 1
    assert result.observables["dissipated_energy"][-1] == pytest.approx(0.5 * MASS * speed**2, rel=1e-13)
    assert result.observables["kinetic_energy"][2] == 0.0, "at the instant it stops, to round-off"
    assert account(result) <= 1e-13


RADIUS = 0.5
SPHERE = "x**2 + y**2 + z**2 - 0.25"


def bowl(friction):
    return swarm.Scene([swarm.Sphere(RADIUS, friction=friction)], DOWN)


def in_bowl(velocity):
    r = on_wall(SPHERE, (0.3, 0.1, -0.4))
    return r, along_wall(SPHERE, r, np.array(velocity))


@pytest.mark.parametrize("friction", [0.05, 0.3])
def test_a_bowl_with_friction(friction):
    """Against the reference, while it moves."""
    r, v = in_bowl((0.3, 1.5, 0.2))
    until = 0.6
    end, velocity, least = slid(SPHERE, r, v, until, DOWN, friction)
    assert least > 0.0
    assert np.linalg.norm(velocity) > 0.3
    result = run(bowl(friction), block(v, r), swarm.Impact(sliding_tolerance=1e-10), until, 0.1)
    assert np.linalg.norm(result.particles.position[:, 0] - end) <= 1e-8 * RADIUS
    assert np.linalg.norm(result.particles.velocity[:, 0] - velocity) <= 1e-7 * np.linalg.norm(v)
    lost = MASS * (0.5 * v @ v + G * r[2] - 0.5 * velocity @ velocity - G * end[2])
    assert result.observables["dissipated_energy"][-1] == pytest.approx(lost, rel=1e-8)
    assert (np.diff(result.observables["dissipated_energy"]) > 0.0).all()
    assert account(result) <= 1e-13
    assert result.observables["impacts"][-1] <= 1


@pytest.mark.parametrize("friction", [0.05, 0.3, 1.0])
def test_it_comes_to_rest_in_a_bowl(friction):
    """Inside the friction cone: at most atan(mu) from the bottom; what it had above it is lost."""
    r, v = in_bowl((0.3, 1.5, 0.2))
    result = run(bowl(friction), block(v, r), swarm.Impact(), 40.0, 20.0)
    end = result.particles.position[:, 0]
    assert (result.particles.velocity == 0.0).all()
    assert math.hypot(end[0], end[1]) <= friction * -end[2] * (1.0 + 1e-9)
    assert result.observables["sliding"].tolist()[1:] == [1, 1]
    assert np.diff(result.observables["potential_energy"])[-1] == 0.0
    lost = MASS * (0.5 * v @ v + G * (r[2] - end[2]))
    assert result.observables["dissipated_energy"][-1] == pytest.approx(lost, rel=1e-12)
    assert account(result) <= 1e-13
    assert result.observables["max_penetration"].max() <= 4.0 * np.spacing(RADIUS)


def swing(friction, angle, speed2):
    """v^2 over the angle a, which grows, in a horizontal cylinder: d(v^2)/da = -2 g R (sin + mu cos) - 2 mu v^2.

    v^2 = A cos(a) + B sin(a) + C exp(-2 mu a), A (1 + 4 mu^2) = 2 g R (1 - 2 mu^2), B (1 + 4 mu^2) = -6 mu g R.
    """
    scale = G * RADIUS / (1.0 + 4.0 * friction**2)
    even, odd = 2.0 * scale * (1.0 - 2.0 * friction**2), -6.0 * friction * scale
    rest = (speed2 - even * math.cos(angle) - odd * math.sin(angle)) * math.exp(2.0 * friction * angle)
    return lambda a: even * math.cos(a) + odd * math.sin(a) + rest * math.exp(-2.0 * friction * a)


def test_to_and_fro_in_a_cylinder():
    """Friction turns with the velocity: from where it turns, it slides back by the same law."""
    friction, angle, speed = 0.2, -0.9, 1.0
    there = swing(friction, angle, speed**2)
    low, high = 0.0, 1.2
    assert there(low) > 0.0 > there(high)
    for _ in range(80):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if there(middle) > 0.0 else (low, middle)
    assert math.tan(low) > friction, "it does not stay there"
    back = swing(friction, -low, 0.0)
    scene = swarm.Scene([swarm.Cylinder(RADIUS, (0.0, 1.0, 0.0), friction=friction)], DOWN)
    start = block(
        speed * np.array([math.cos(angle), 0.0, math.sin(angle)]),
        RADIUS * np.array([math.sin(angle), 0.0, -math.cos(angle)]),
    )
    seen = []
    result = swarm.simulate(
        scene, start, swarm.Impact(sliding_tolerance=1e-10), until=0.85, every=0.05, threads=1,
        progress=lambda frame: seen.append((frame.position[:, 0].copy(), frame.velocity[:, 0].copy())),
    )  # fmt: skip
    for time, forward in ((0.1, True), (0.25, True), (0.45, True), (0.75, False), (0.85, False)):
        (x, _, z), (vx, _, vz) = seen[round(time / 0.05)]
        now = math.atan2(x, -z)
        assert (vx > 0.0) == forward
        assert vx**2 + vz**2 == pytest.approx(there(now) if forward else back(-now), abs=1e-8)
    assert account(result) <= 1e-13
