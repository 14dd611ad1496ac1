"""Where a slide ends: leaving a wall, meeting another, edges, and the accumulation point of a chatter."""

import itertools
import math

import mpmath
import numpy as np
import pytest
from physics.billiards import EPSILON, run

import swarm

pytestmark = pytest.mark.physics

G = 9.81
DOWN = (0.0, 0.0, -G)
# Its square is exact: what starts at a distance R is on the wall, not a last place inside.
R = 0.5
# Out of reach: scenes of planes have the same number of them, and so the same kernel.
FAR = swarm.Plane((0.0, 0.0, 1.0), 50.0)


def planes(*walls):
    return swarm.Scene([*walls, FAR, FAR][:3], DOWN)


def slope(angle, **laws):
    """A plane through the origin that falls towards +x."""
    return swarm.Plane((-math.sin(angle), 0.0, -math.cos(angle)), 0.0, **laws)


def downhill(angle):
    return np.array([math.cos(angle), 0.0, -math.sin(angle)])


def account(result):
    """Largest change of total + dissipated energy, relative to the largest of either."""
    energies = [result.observables[name] for name in ("total_energy", "dissipated_energy", "kinetic_energy")]
    total = energies[0] + energies[1]
    return np.abs(total - total[0]).max() / max(np.abs(energy).max() for energy in energies)


# --- Leaving ----------------------------------------------------------------------------------------------


def flown(r, v, time):
    """Free flight."""
    return r + v * time + 0.5 * np.array(DOWN) * time**2, v + np.array(DOWN) * time


@pytest.mark.parametrize("push", [0.05, 0.5, 1.5])
def test_leaving_a_ball(push):
    """From the top with v0 it leaves at cos(theta) = 2/3 + v0^2/(3gR), where v^2 = g R cos(theta)."""
    cosine = 2.0 / 3.0 + push**2 / (3.0 * G * R)
    assert cosine < 1.0
    theta, speed = math.acos(cosine), math.sqrt(G * R * cosine)
    leaves = float(
        mpmath.quad(lambda a: R / mpmath.sqrt(push**2 + 2 * G * R * (1 - mpmath.cos(a))), [0, 0.05, 0.2, theta])
    )
    scene = swarm.Scene([swarm.Sphere(R, side="outside"), swarm.Plane((0.0, 0.0, -1.0), 5.0)], DOWN)
    start = swarm.Particles([0.0, 0.0, R], [push, 0.0, 0.0])
    until = leaves + 0.3
    result = run(scene, start, swarm.Impact(sliding_tolerance=1e-11), until)
    (x, _, z), (vx, _, vz) = result.particles.position[:, 0], result.particles.velocity[:, 0]
    # v_x = cos(theta) sqrt(g R cos(theta)) stays, and gravity alone changes v_z.
    found = (vx**2 / (G * R)) ** (1.0 / 3.0)
    assert found == pytest.approx(cosine, abs=1e-9)
    left = until - (-math.sqrt(G * R * found * (1.0 - found**2)) - vz) / G
    assert left == pytest.approx(leaves, abs=1e-9)
    # Traced back by that time it touches the ball at that angle.
    place, _ = flown(np.array([x, 0.0, z]), np.array([vx, 0.0, vz]), left - until)
    assert place == pytest.approx(R * np.array([math.sin(theta), 0.0, cosine]), abs=1e-9)
    slope_ = np.array([cosine, 0.0, -math.sin(theta)])
    end, velocity = flown(R * np.array([math.sin(theta), 0.0, cosine]), speed * slope_, until - leaves)
    assert result.particles.position[:, 0] == pytest.approx(end, abs=3e-9)
    assert result.particles.velocity[:, 0] == pytest.approx(velocity, abs=3e-9)
    # A start that is inside by the last place flies a hop first, of the root of that.
    assert result.observables["sliding_time"][-1] == pytest.approx(leaves, abs=1e-8)
    assert result.observables["sliding"][-1] == 0
    assert result.observables["impacts"][-1] <= 1
    assert result.observables["energy_error"].max() <= 1e-14


def test_too_fast_for_the_ball_it_never_slides():
    """v0^2 > gR: it flies off the top at once."""
    push = 1.1 * math.sqrt(G * R)
    scene = swarm.Scene([swarm.Sphere(R, side="outside"), swarm.Plane((0.0, 0.0, -1.0), 5.0)], DOWN)
    result = run(scene, swarm.Particles([0.0, 0.0, R], [push, 0.0, 0.0]), swarm.Impact(), 0.5)
    end, velocity = flown(np.array([0.0, 0.0, R]), np.array([push, 0.0, 0.0]), 0.5)
    assert result.particles.position[:, 0] == pytest.approx(end, abs=1e-12)
    assert result.particles.velocity[:, 0] == pytest.approx(velocity, abs=1e-12)
    assert result.observables["sliding_time"][-1] <= 1e-9


# A turned cylinder's wall is a last place off, and the fall on it gives 1e-7 m/s, which e = 1 would keep.
LOOPS = {"sphere": swarm.Sphere(R), "cylinder": swarm.Cylinder(R, (0.0, 1.0, 0.0), restitution=0.0)}


@pytest.mark.parametrize("name", LOOPS)
@pytest.mark.parametrize("part", [2.5, 4.0])
def test_leaving_a_loop(name, part):
    """From the bottom with v0^2 = part g R, 2 < part < 5, it leaves at cos(angle) = (2 - part)/3."""
    push, cosine = math.sqrt(part * G * R), (2.0 - part) / 3.0
    angle, speed = math.acos(cosine), math.sqrt(-G * R * cosine)
    leaves = float(mpmath.quad(lambda a: R / mpmath.sqrt(push**2 - 2 * G * R * (1 - mpmath.cos(a))), [0, 1, angle]))
    until = leaves + 0.2 * math.sqrt(R / G)
    start = swarm.Particles([0.0, 0.0, -R], [push, 0.0, 0.0])
    result = run(swarm.Scene([LOOPS[name]], DOWN), start, swarm.Impact(sliding_tolerance=1e-11), until)
    place = R * np.array([math.sin(angle), 0.0, -cosine])
    end, velocity = flown(place, speed * np.array([cosine, 0.0, math.sin(angle)]), until - leaves)
    assert math.hypot(end[0], end[2]) < R * (1.0 - 1e-4), "it flies"
    assert result.particles.position[:, 0] == pytest.approx(end, abs=3e-9)
    assert result.particles.velocity[:, 0] == pytest.approx(velocity, abs=1e-8)
    # A start that is inside by the last place flies a hop first, of the root of that.
    assert result.observables["sliding_time"][-1] == pytest.approx(leaves, abs=1e-8)
    assert result.observables["sliding"][-1] == 0
    assert result.observables["impacts"][-1] <= 2


@pytest.mark.parametrize("name", LOOPS)
def test_through_a_loop(name):
    """With v0^2 = 6gR it goes all the way round, and is at the bottom again after a period."""
    push = math.sqrt(6.0 * G * R)
    rate = lambda a: R / mpmath.sqrt(push**2 - 2 * G * R * (1 - mpmath.cos(a)))  # noqa: E731
    period = float(mpmath.quad(rate, [0, 1, 2, 3, 4, 5, 2 * mpmath.pi]))
    start = swarm.Particles([0.0, 0.0, -R], [push, 0.0, 0.0])
    result = run(swarm.Scene([LOOPS[name]], DOWN), start, swarm.Impact(sliding_tolerance=1e-11), period)
    assert result.particles.position[:, 0] == pytest.approx([0.0, 0.0, -R], abs=1e-9)
    assert result.particles.velocity[:, 0] == pytest.approx([push, 0.0, 0.0], abs=1e-8)
    assert result.observables["sliding_time"][-1] == pytest.approx(period, abs=1e-8)
    assert result.observables["impacts"][-1] <= 1


# --- Meeting another wall ---------------------------------------------------------------------------------


@pytest.mark.parametrize("e", [0.0, 0.5])
def test_down_an_incline_onto_a_floor(e):
    """The floor takes what is normal to it, in the end all; the rest glides on."""
    angle, way = 0.6, 1.5
    reach = way * downhill(angle)
    scene = planes(slope(angle, restitution=e), swarm.Plane((0.0, 0.0, -1.0), -reach[2], restitution=e))
    meets = math.sqrt(2.0 * way / (G * math.sin(angle)))
    speed = G * math.sin(angle) * meets
    along, down = speed * math.cos(angle), speed * math.sin(angle)
    bounces = 2.0 * e * down / (G * (1.0 - e))
    until = meets + bounces + 0.3
    result = run(scene, swarm.Particles([0.0] * 3, [0.0] * 3), swarm.Impact(), until, 0.1)
    expected = [reach[0] + along * (until - meets), 0.0, reach[2]]
    assert result.particles.position[:, 0] == pytest.approx(expected, abs=1e-9)
    assert result.particles.velocity[:, 0] == pytest.approx([along, 0.0, 0.0], abs=1e-9)
    assert result.observables["dissipated_energy"][-1] == pytest.approx(0.5 * down**2, rel=1e-9)
    assert result.observables["sliding_time"][-1] == pytest.approx(until - bounces, rel=1e-9)
    assert result.observables["sliding"][-1] == 1
    assert account(result) <= 1e-13


def test_down_an_incline_onto_an_elastic_floor():
    """It leaves both walls: the velocity is mirrored in the floor, up to the next impact."""
    angle, way = 0.6, 1.5
    reach = way * downhill(angle)
    scene = planes(slope(angle), swarm.Plane((0.0, 0.0, -1.0), -reach[2]))
    meets = math.sqrt(2.0 * way / (G * math.sin(angle)))
    mirrored = G * math.sin(angle) * meets * np.array([math.cos(angle), 0.0, math.sin(angle)])
    later = mirrored[2] / G
    result = run(scene, swarm.Particles([0.0] * 3, [0.0] * 3), swarm.Impact(), meets + later)
    end, velocity = flown(reach, mirrored, later)
    assert result.particles.position[:, 0] == pytest.approx(end, abs=1e-9)
    assert result.particles.velocity[:, 0] == pytest.approx(velocity, abs=1e-9)
    assert result.observables["sliding_time"][-1] == pytest.approx(meets, rel=1e-9)
    assert 1 <= result.observables["impacts"][-1] <= 2


def test_gliding_to_and_fro_on_the_floor_of_a_box():
    """The sides reflect it, and it glides on: a triangle wave, exactly, for as many impacts as sides are met."""
    half, speed, periods = 0.4, 0.3, 25
    scene = swarm.Scene([swarm.Box((half, 0.5, 0.25))], DOWN)
    start = swarm.Particles([0.1, -0.2, -0.25], [speed, 0.0, 0.0])
    period = 4.0 * half / speed
    result = run(scene, start, swarm.Impact(), periods * period)
    assert result.particles.position[:, 0] == pytest.approx([0.1, -0.2, -0.25], abs=1e-12)
    assert result.particles.velocity[:, 0] == pytest.approx([speed, 0.0, 0.0], abs=1e-14)
    assert 2 * periods <= result.observables["impacts"][-1] <= 2 * periods + 1
    assert result.observables["sliding_time"][-1] == pytest.approx(periods * period, rel=1e-12)
    quarter = run(scene, start, swarm.Impact(), (half - 0.1) / speed + 0.5)
    assert quarter.particles.position[:, 0] == pytest.approx([half - 0.5 * speed, -0.2, -0.25], abs=1e-13)
    assert quarter.particles.velocity[0, 0] == pytest.approx(-speed, rel=1e-14)
    assert quarter.observables["sliding"][-1] == 1


# --- Edges ------------------------------------------------------------------------------------------------


def test_down_a_groove():
    """Along the edge of two planes with g sin(slope), a closed form."""
    one, two = np.array([1.0, 0.1, -1.0]), np.array([-1.0, 0.1, -1.0])
    edge = np.cross(one, two) / np.linalg.norm(np.cross(one, two))
    pull = edge @ DOWN
    scene = planes(swarm.Plane(tuple(one), 0.0), swarm.Plane(tuple(two), 0.0))
    assert abs(pull) > 0.5
    result = run(scene, swarm.Particles([0.0] * 3, 0.3 * edge), swarm.Impact(), 5.0)
    way = 0.3 * 5.0 + 0.5 * pull * 25.0
    assert result.particles.position[:, 0] == pytest.approx(way * edge, abs=1e-12 * abs(way))
    assert result.particles.velocity[:, 0] == pytest.approx((0.3 + 5.0 * pull) * edge, abs=1e-11)
    assert result.observables["impacts"][-1] <= 4
    assert result.observables["sliding_time"][-1] == pytest.approx(5.0, rel=1e-12)
    assert result.observables["energy_error"].max() <= 1e-14


@pytest.mark.parametrize("e", [1.0, 0.5])
def test_along_the_circle_where_a_floor_meets_a_cylinder(e):
    """At constant speed; both walls carry."""
    scene = swarm.Scene([swarm.Cylinder(R, length=2.0, restitution=e)], DOWN)
    speed, until = 1.3, 10.0 * R / 1.3
    method = swarm.Impact(sliding_tolerance=1e-11)
    result = run(scene, swarm.Particles([R, 0.0, -1.0], [0.0, speed, 0.0]), method, until)
    angle = speed * until / R
    turned = np.array([math.cos(angle), math.sin(angle)])
    assert result.particles.position[:, 0] == pytest.approx([*(R * turned), -1.0], abs=1e-9)
    # The normal velocity that a last place is worth, which e = 1 keeps, is sqrt(2 EPSILON v^2).
    expected = [-speed * turned[1], speed * turned[0], 0.0]
    assert result.particles.velocity[:, 0] == pytest.approx(expected, abs=1e-7)
    assert result.observables["impacts"][-1] <= 2
    assert result.observables["sliding_time"][-1] == pytest.approx(until, rel=1e-12)
    assert result.observables["dissipated_energy"][-1] <= 1e-12


def chatter(e, inward, along):
    """(angle, time) of the chords between impacts on a circle, e < 1, from the first impact to the last."""
    radial = [e**k * inward for k in range(1, int(math.log(1e-25) / math.log(e)))]
    return (
        math.fsum(2.0 * math.atan2(v, along) for v in radial),
        math.fsum(2.0 * R * v / (v**2 + along**2) for v in radial),
    )


@pytest.mark.parametrize("e", [0.3, 0.8])
def test_gliding_on_a_floor_into_a_cylinder(e):
    """Impact after impact keeps the tangential speed and e of the normal one, up to the slide along the edge."""
    scene = swarm.Scene([swarm.Cylinder(R, length=2.0, restitution=e)], DOWN)
    inward, along = 0.6, 0.8
    # Straight to (R, 0, -1).
    start = swarm.Particles([R - inward * 0.5, -along * 0.5, -1.0], [inward, along, 0.0])
    angle, time = chatter(e, inward, along)
    until = 0.5 + time + 1.0
    result = run(scene, start, swarm.Impact(sliding_tolerance=1e-11), until)
    angle += along / R
    turned = np.array([math.cos(angle), math.sin(angle)])
    assert result.particles.position[:, 0] == pytest.approx([*(R * turned), -1.0], abs=1e-8)
    assert result.particles.velocity[:, 0] == pytest.approx([-along * turned[1], along * turned[0], 0.0], abs=1e-8)
    assert result.observables["dissipated_energy"][-1] == pytest.approx(0.5 * inward**2, rel=1e-9)
    assert result.observables["sliding_time"][-1] == pytest.approx(until, rel=1e-12)
    assert 5 <= result.observables["impacts"][-1] <= 1000


# --- The accumulation point of a chatter ------------------------------------------------------------------


@pytest.mark.parametrize("e", [0.0, 0.5, 0.9, 0.99])
def test_a_bouncing_ball_comes_to_rest(e):
    """At sqrt(2h/g) (1 + e)/(1 - e); from then on it rests, and all of its energy is lost."""
    height, mass = 0.4, 2.0
    rest = math.sqrt(2.0 * height / G) * (1.0 + e) / (1.0 - e)
    floor = planes(swarm.Plane((0.0, 0.0, -1.0), 0.3, restitution=e))
    start = swarm.Particles([0.2, -0.1, height - 0.3], [0.0] * 3, mass)
    result = run(floor, start, swarm.Impact(), 2.0 * rest, rest)
    assert 2.0 * rest - result.observables["sliding_time"][-1] == pytest.approx(rest, rel=1e-9)
    assert result.observables["sliding"][[0, -1]].tolist() == [0, 1]
    assert result.particles.position[:, 0] == pytest.approx([0.2, -0.1, -0.3], abs=EPSILON)
    assert (result.particles.velocity == 0.0).all()
    assert result.observables["dissipated_energy"][-1] == pytest.approx(mass * G * height, rel=1e-13)
    assert result.observables["impacts"][-1] <= 1 + (math.log(1e-16) / math.log(e) if e > 0.0 else 1)
    assert account(result) <= 1e-13


@pytest.mark.parametrize("e", [0.5, 0.9])
def test_bouncing_down_an_incline(e):
    """Along it with g sin(angle), whatever the bounces; they end at v_n 2/(g cos(angle)) (1 + e + e^2 + ...)."""
    angle, speed = 0.5, 0.7
    normal = np.array([math.sin(angle), 0.0, math.cos(angle)])
    rest = 2.0 * speed / (G * math.cos(angle)) / (1.0 - e)
    until = 1.5 * rest
    scene = planes(slope(angle, restitution=e))
    result = run(scene, swarm.Particles([0.0] * 3, speed * normal), swarm.Impact(), until)
    way = 0.5 * G * math.sin(angle) * until**2
    assert result.particles.position[:, 0] == pytest.approx(way * downhill(angle), abs=1e-9 * way)
    expected = G * math.sin(angle) * until * downhill(angle)
    assert result.particles.velocity[:, 0] == pytest.approx(expected, abs=1e-9)
    assert until - result.observables["sliding_time"][-1] == pytest.approx(rest, rel=1e-9)
    assert result.observables["dissipated_energy"][-1] == pytest.approx(0.5 * speed**2, rel=1e-9)


def test_the_closed_forms_agree_with_sums():
    """Of the chatter on a circle, term by term: the chords are those of the exact billiard."""
    e, inward, along = 0.8, 0.6, 0.8
    position, velocity, total = np.array([R, 0.0]), np.array([-e * inward, along]), 0.0
    for _ in itertools.repeat(None, 120):
        time = -2.0 * (position @ velocity) / (velocity @ velocity)
        position, total = position + velocity * time, total + time
        normal = position / np.linalg.norm(position)
        velocity = velocity - (1.0 + e) * (velocity @ normal) * normal
    angle, end = chatter(e, inward, along)
    assert position == pytest.approx([R * math.cos(angle), R * math.sin(angle)], abs=1e-10)
    assert total == pytest.approx(end, rel=1e-10)
