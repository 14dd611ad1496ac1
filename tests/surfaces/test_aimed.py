"""First hits that a guess and two Taylor polynomials prove: those of safe steps, and to the last digits those of 50."""

import math

import mpmath
import numpy as np
import pytest

import swarm
from swarm.kernel.vector import dot, vec
from swarm.lanes import block
from swarm.lanes import flight as flights_of_lanes
from swarm.surfaces.in_motion.drive import Swing, Swings
from swarm.surfaces.in_motion.moving import Aimed, Moving
from swarm.surfaces.time_of_impact import aim, strides
from swarm.surfaces.time_of_impact.flights import COURSE
from swarm.surfaces.walls import Following

TURN = swarm.Rotation((1.0, 2.0, 3.0), rate=1.3, center=(0.1, 0.0, -0.05))
MOTIONS = {
    "swing": swarm.Oscillation((0.05, 0.03, 0.08), frequency=0.7, phase=0.4),
    "wide swing": swarm.Oscillation((0.3, -0.2, 0.25), frequency=0.5),
    "fast swing": swarm.Oscillation((0.004, 0.01, -0.006), frequency=5.0, phase=1.0),
    "turn": TURN,
    "sum": swarm.Translation((0.3, -0.2, 0.1)) + swarm.Oscillation((0.05, 0.03, 0.08), frequency=0.7) + TURN,
}
# More angles than a lane of one wall has rows for.
MOTIONS["many swings"] = sum(
    (swarm.Oscillation((0.03, 0.0, 0.02), frequency=frequency) for frequency in (0.3, 0.4, 0.5)), MOTIONS["swing"]
)
CAVITIES = {
    "sphere": lambda motion: swarm.Sphere(0.5, (0.1, -0.05, 0.02), motion=motion),
    "box": lambda motion: swarm.Box((0.5, 0.4, 0.3), rotation=(1.0, 0.3, -0.2, 0.5), motion=motion),
    "plane": lambda motion: swarm.Plane((0.0, 1.0, 1.0), 0.3, motion=motion),
    "ellipsoid": lambda motion: swarm.Ellipsoid((0.5, 0.6, 0.4), rotation=(1.0, 0.3, -0.2, 0.5), motion=motion),
}
START, SPAN, FLIGHTS = 0.6, 2.5, 24


def course_of(walls):
    return np.full((aim.WALLS + COURSE * len(walls.each), 1), math.nan)


def aimed_hit(walls, flight):
    """The hit that is proven, or None."""
    course = course_of(walls)
    with np.errstate(all="ignore"):
        aim.put_angles(walls, course, 0, flight[2])
        aim.put_waves(walls, course, 0, False)
        aim.start(walls, None, course, 0, *flight)
        if aim.lacks_passages(walls):
            aim.guess_by_levels(walls, None, course, 0, *flight)
        for _round in range(aim.AIMS):
            put_levels_at_guess(walls, course, flight, False)
            aim.improve(course, 0, flight[2])
        prove_at_guess(walls, course, flight)
        return None if aim.is_open(course, 0, flight[2]) else strides.met(course, 0)


def put_levels_at_guess(walls, course, flight, is_last):
    aim.put_angles_at_guess(walls, course, 0, flight[2])
    aim.put_waves(walls, course, 0, not is_last)
    aim.put_levels(walls, None, course, 0, *flight, is_last)


def prove_at_guess(walls, course, flight):
    put_levels_at_guess(walls, course, flight, True)
    aim.put_way(course, 0)
    aim.put_ends(walls, None, course, 0, *flight)
    aim.prove(walls, None, course, 0, *flight, False)
    if aim.is_open(course, 0, flight[2]) and aim.has_series(walls):
        aim.start_series(walls, None, course, 0, *flight)
        aim.prove(walls, None, course, 0, *flight, True)


def strode_hit(walls, flight):
    """The hit of safe steps alone."""
    course = course_of(walls)
    with np.errstate(all="ignore"):
        strides.start(walls, None, course, 0, *flight)
        for k in range(200):
            strides.stride(walls, None, course, 0, *flight, k == 0)
            if not aim.is_open(course, 0, flight[2]):
                break
        return strides.met(course, 0)


def flights(scene, walls, seed):
    """(a flight, its hit by safe steps): some that begin inside, each with those that follow after reflections."""
    rng = np.random.default_rng(seed)
    left, r, v, remaining = 0, None, None, 0.0
    for _flight in range(FLIGHTS):
        while left == 0:
            r, v, remaining = rng.uniform(-0.4, 0.4, 3), rng.standard_normal(3), SPAN
            left = 8 * bool((scene.gaps(r[:, None], START) < -1e-3).all())
            r, v = vec(r), vec(v)
        flight = r, v, remaining
        hit = strode_hit(walls, flight)
        yield flight, hit
        left -= 1
        if hit.wall < 0.0 or not hit.time < remaining:
            left = 0
            continue
        r, remaining = r + hit.time * v, remaining - hit.time
        now = walls.at(remaining)
        n = now.unit_normal(hit.wall, r)
        v = v - 2.0 * max(dot(v - now.velocity(hit.wall, r), n), 0.0) * n


@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("name", CAVITIES)
def test_what_is_proven_is_the_hit_of_safe_steps(name, motion):
    scene = swarm.Scene([CAVITIES[name](MOTIONS[motion])])
    walls = scene.compiled().walls(START + SPAN)
    if not isinstance(walls, Aimed):
        assert name in ("plane", "ellipsoid")
        assert motion in ("turn", "sum")
        return
    proven = 0
    for flight, wanted in flights(scene, walls, 7):
        found = aimed_hit(walls, flight)
        if found is not None:
            proven += 1
            assert found.wall == wanted.wall
            assert found.time == pytest.approx(wanted.time, rel=1e-11, abs=1e-13)
    assert proven >= FLIGHTS // 3


@pytest.mark.parametrize("motion", ["swing", "wide swing", "fast swing"])
def test_roots_are_those_of_fifty_digits(motion):
    """Of a plane: n.(r + v t - d(t)) = offset."""
    given, offset = MOTIONS[motion], 0.3
    scene = swarm.Scene([swarm.Plane((0.0, 0.6, 0.8), offset, motion=given)])
    walls, found = scene.compiled().walls(START + SPAN), 0
    for (r, v, remaining), _hit in flights(scene, walls, 11):
        hit = aimed_hit(walls, (r, v, remaining))
        if hit is None or hit.wall < 0.0 or not hit.time < remaining:
            continue
        found += 1
        with mpmath.workdps(50):
            at = mpmath.mpf(START + SPAN) - mpmath.mpf(remaining)
            level = _plane_in_digits(given, offset, r, v, at)
            root = mpmath.findroot(level, hit.time)
            slope = abs(mpmath.diff(level, root))
            late = float(abs(root - hit.time) * slope)
        assert late <= 4.0 * np.finfo(float).eps * (sum(map(abs, r)) + math.hypot(*v) * hit.time + 1.0)
    assert found >= 5


def test_a_sphere_that_goes_along_a_circle_is_met_as_in_fifty_digits():
    """|r + v t - c(t)|^2 = R^2, which has no root before."""
    center, radius = (0.1, -0.05, 0.02), 0.5
    scene = swarm.Scene([swarm.Sphere(radius, center, motion=TURN)])
    walls, found = scene.compiled().walls(START + SPAN), 0
    assert isinstance(walls, Aimed)
    for (r, v, remaining), _hit in flights(scene, walls, 13):
        hit = aimed_hit(walls, (r, v, remaining))
        if hit is None or hit.wall < 0.0 or not hit.time < remaining:
            continue
        found += 1
        with mpmath.workdps(50):
            level = _sphere_in_digits(TURN, center, radius, r, v, mpmath.mpf(START + SPAN) - mpmath.mpf(remaining))
            root = mpmath.findroot(level, hit.time)
            late = float(abs(root - hit.time) * abs(mpmath.diff(level, root))) / (2.0 * radius)
            before = max(level(hit.time * k / 50.0) for k in range(1, 50))
        assert late <= 4.0 * np.finfo(float).eps * (sum(map(abs, r)) + math.hypot(*v) * hit.time + 1.0)
        assert before < 0.0
    assert found >= FLIGHTS // 2


@pytest.mark.parametrize("speed", [0.6, 1.0, 4.0])
def test_a_flight_outwards_from_beyond_the_mean_planes_is_proven(speed):
    """The swing has carried one plane beyond the particle, which is above the mean place of it."""
    swing = swarm.Oscillation((0.08, 0.0, 0.0), frequency=0.5)
    walls = swarm.Scene([swarm.Slab((1.0, 0.0, 0.0), 0.3, motion=swing)]).compiled().walls(START + SPAN)
    # A quarter of a period after the start of the swing: half a second of the frame has passed
    flight = vec((0.33, 0.1, 0.0)), vec((speed, 0.2, 0.0)), START + SPAN - 0.5
    found, wanted = aimed_hit(walls, flight), strode_hit(walls, flight)
    assert wanted.wall == 0.0
    assert found is not None
    assert found.wall == wanted.wall
    assert found.time == pytest.approx(wanted.time, rel=1e-11, abs=1e-13)
    assert 0.0 < found.time < 0.06 / speed


def test_no_guess_proves_what_is_no_root():
    """Next to the hit: the last step from there leaves the cube of its length."""
    walls = swarm.Scene([swarm.Sphere(0.5, motion=MOTIONS["fast swing"])]).compiled().walls(START + SPAN)
    flight, proven = (vec((0.0, 0.0, 0.0)), vec((1.5, 0.5, 0.0)), SPAN), 0
    hit = strode_hit(walls, flight)
    for off in np.linspace(-6e-5, 6e-5, 61):
        course = course_of(walls)
        with np.errstate(all="ignore"):
            aim.start(walls, None, course, 0, *flight)
            course[aim.GUESS, 0] = hit.time + off
            prove_at_guess(walls, course, flight)
        if course[strides.MET, 0] >= 0.0:
            proven += 1
            assert course[strides.TIME, 0] == pytest.approx(hit.time, rel=0.0, abs=1e-15)
    assert 0 < proven < 61


def test_lanes_without_a_proof_step_side_by_side_as_each_would_alone(monkeypatch):
    """Of a box that turns several are open in one pass, and some, in their order, have others between them."""
    scene, many = swarm.Scene([swarm.Box((0.5, 0.4, 0.3), motion=TURN)]), []
    step = flights_of_lanes._stride_open

    def counted(walls, gravity, lanes, some):
        many.append(lanes.order[:some].tolist())
        step(walls, gravity, lanes, some)

    monkeypatch.setattr(flights_of_lanes, "_stride_open", counted)
    start = swarm.fill(scene, 12, speed=0.5, seed=1)
    together = swarm.simulate(scene, start, swarm.Impact(), until=2.0, compile="never").particles
    assert any(len(open_lanes) > 2 and open_lanes != list(range(len(open_lanes))) for open_lanes in many)
    for i in range(12):
        one = swarm.Particles(start.position[:, [i]], start.velocity[:, [i]])
        alone = swarm.simulate(scene, one, swarm.Impact(), until=2.0, compile="never").particles
        assert alone.position[:, 0].tolist() == together.position[:, i].tolist()
        assert alone.velocity[:, 0].tolist() == together.velocity[:, i].tolist()


# The box turns so fast that half of its lanes step; the sphere at rest is met in closed form.
SCENES_AT_ONCE = {
    "sphere": [swarm.Sphere(0.5, motion=MOTIONS["swing"])],
    "box": [swarm.Box((0.5, 0.4, 0.3), motion=swarm.Rotation((1.0, 2.0, 3.0), rate=4.0, center=(0.1, 0.0, -0.05)))],
    "a sphere at rest in it": [swarm.Box((0.5, 0.4, 0.3), motion=MOTIONS["sum"]), swarm.Sphere(0.1, side="outside")],
}


@pytest.mark.parametrize("name", SCENES_AT_ONCE)
def test_contacts_have_the_waves_of_their_time(name, monkeypatch):
    """Of hits that are proven, and of those to which lanes step, at all walls that move."""
    scene, off, opened, make = swarm.Scene(SCENES_AT_ONCE[name]), [], [], block._make_contacts
    marked = flights_of_lanes._mark_open

    def counted(lanes, live):
        opened.append(marked(lanes, live))
        return opened[-1]

    def compared(method, walls, gravity, share, lanes, picked, live):
        for i in range(live):
            number, remaining = int(lanes.wall[i]), lanes.lane(i).remaining
            if number >= 0 and isinstance(walls.each[number], (Moving, Following)):
                drives = aim.with_waves(walls, lanes.course, i).drives()
                off.extend(np.abs(np.subtract(drive.waves, drive.waves_at(remaining))).max() for drive in drives)
        return make(method, walls, gravity, share, lanes, picked, live)

    monkeypatch.setattr(flights_of_lanes, "_mark_open", counted)
    monkeypatch.setattr(block, "_make_contacts", compared)
    swarm.simulate(scene, swarm.fill(scene, 12, speed=1.0, seed=1), swarm.Impact(), until=2.0, compile="never")
    assert len(off) >= 12
    assert sum(opened) > 0
    # Of the rounding of the time, too
    assert max(off) <= 4.0 * np.finfo(float).eps * (1.0 + 4.0 * 2.0)


def _sphere_in_digits(turn, center, radius, r, v, at):
    """The level at a time after `at`."""
    k = mpmath.matrix(turn.axis) / mpmath.norm(mpmath.matrix(turn.axis))
    arm = mpmath.matrix(center) - mpmath.matrix(turn.center)
    r, v, along = mpmath.matrix(r), mpmath.matrix(v), mpmath.fdot(k, arm) * k
    across = mpmath.matrix(
        [k[1] * arm[2] - k[2] * arm[1], k[2] * arm[0] - k[0] * arm[2], k[0] * arm[1] - k[1] * arm[0]]
    )

    def level(t):
        angle = turn.rate * (at + t)
        middle = mpmath.matrix(turn.center) + along + mpmath.cos(angle) * (arm - along) + mpmath.sin(angle) * across
        return mpmath.norm(r + v * t - middle) ** 2 - mpmath.mpf(radius) ** 2

    return level


def _plane_in_digits(given, offset, r, v, at):
    """The level at a time after `at`."""
    n = mpmath.matrix([0.0, 0.6, 0.8]) / mpmath.norm(mpmath.matrix([0.0, 0.6, 0.8]))
    r, v = mpmath.matrix(r), mpmath.matrix(v)
    amplitude, rate = mpmath.matrix(given.amplitude), 2 * mpmath.pi * given.frequency

    def level(t):
        wave = mpmath.sin(rate * (at + t) + given.phase) - mpmath.sin(given.phase)
        return mpmath.fdot(n, r + v * t - amplitude * wave) - offset

    return level


def _levels(surface, swings, r, v, times):
    """phi along a flight at some times, in the frame of the middle of swings."""
    places = np.array(r)[:, None] + np.array(v)[:, None] * times
    for swing in swings:
        c, s = np.array(swing.cosine)[:, None], np.array(swing.sine)[:, None]
        places = places - c * np.cos(swing.rate * times) - s * np.sin(swing.rate * times)
    return surface.phi(places)


FLIGHTS_ONCE = 120
BODIES = {
    "sphere": swarm.Sphere(0.5, (0.1, -0.05, 0.02)),
    "ellipsoid": swarm.Ellipsoid((0.5, 0.6, 0.4)),
    "slab": swarm.Slab((0.6, 0.0, 0.8), 0.3),
    "plane": swarm.Plane((0.0, 0.6, 0.8), 0.3),
}


@pytest.mark.parametrize("name", BODIES)
def test_a_passage_that_meets_its_wall_once_does(name):
    """Each flight is as slow as one may be of which that is said."""
    rng, proven, surface = np.random.default_rng(5), 0, BODIES[name]
    (body,) = surface.walls()
    for _flight in range(FLIGHTS_ONCE):
        strength, rate = rng.choice([0.02, 0.1]), rng.uniform(1.0, 12.0)
        cosine, sine = rng.normal(0.0, strength, 3), rng.normal(0.0, strength, 3)
        # Along a line, or an ellipse
        sine = 2.0 * cosine if rng.random() < 0.5 else sine
        each = (Swing(vec(cosine), vec(sine), rate),)
        if rng.random() < 0.3:
            each = (*each, Swing(vec(rng.normal(0.0, 0.02, 3)), vec(rng.normal(0.0, 0.02, 3)), 2.3 * rate))
        swings, r, way = Swings(each), rng.uniform(-0.6, 0.6, 3), rng.standard_normal(3)
        if _levels(surface, each, r, way, np.zeros(1)) > 0.0:
            continue

        def is_once(speed, swings=swings, r=r, way=way):
            return body.passage(vec(r), vec(speed * way), swings).once

        low, high = 0.0, 64.0
        if not is_once(high):
            continue
        for _half in range(30):
            middle = 0.5 * (low + high)
            low, high = (low, middle) if is_once(middle) else (middle, high)
        v, proven = high * way, proven + 1
        level = _levels(surface, each, r, v, np.linspace(0.0, 3.0 / math.hypot(*v), 1000))
        assert ((level[:-1] <= 0.0) & (level[1:] > 0.0)).sum() <= 1
    assert proven >= FLIGHTS_ONCE // 8
