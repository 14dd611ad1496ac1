"""Walls that move: the same physics in every frame, hits that none skips, work that is booked, contacts that last."""

import functools
import math
import re
from dataclasses import replace

import mpmath
import numpy as np
import pytest
from conftest import every_pair, gaps_along
from energy_books import unbooked
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import swarm
from examples import fermi
from swarm.kernel.vector import ZERO, Vec, vec
from swarm.lanes import block
from swarm.motion import pose
from swarm.surfaces.in_motion import moving
from swarm.surfaces.in_motion.drive import drive_of
from swarm.surfaces.time_of_impact import safe

G = 9.81
DOWN = (0.0, 0.0, -G)
VELOCITY = (0.3, -0.2, 0.1)
SWING = swarm.Oscillation((0.05, 0.03, 0.08), frequency=0.7, phase=0.4)
TURN = swarm.Rotation((1.0, 2.0, 3.0), rate=1.3, center=(0.1, 0.0, -0.05))
PATH = swarm.Path(
    times=tuple(np.linspace(0.0, 6.0, 13).tolist()),
    positions=tuple((0.04 * math.sin(k), 0.05 * math.cos(k) - 0.05, 0.03 * math.sin(2.0 * k)) for k in range(13)),
)
MOTIONS = {
    "oscillation": SWING,
    "rotation": TURN,
    "path": PATH,
    "sum": swarm.Translation(VELOCITY) + SWING + TURN,
}
CAVITIES = {
    "sphere": lambda motion: swarm.Sphere(0.5, motion=motion),
    "box": lambda motion: swarm.Box((0.5, 0.4, 0.3), rotation=(1.0, 0.3, -0.2, 0.5), motion=motion),
    "cylinder": lambda motion: swarm.Cylinder(0.4, axis=(1.0, 0.0, 1.0), length=0.9, motion=motion),
    "ellipsoid": lambda motion: swarm.Ellipsoid((0.5, 0.6, 0.4), motion=motion),
    "cone": lambda motion: swarm.Cone(0.6, center=(0.0, 0.0, -0.5), motion=motion),
    "paraboloid": lambda motion: swarm.Paraboloid(0.2, center=(0.0, 0.0, -0.4), motion=motion),
    "capsule": lambda motion: swarm.Capsule(0.3, 0.5, motion=motion),
    "torus": lambda motion: swarm.Torus(0.6, 0.3, motion=motion),
    "slab": lambda motion: swarm.Slab((1.0, 1.0, 0.0), 0.4, motion=motion),
    "plane": lambda motion: swarm.Plane((0.0, 1.0, 1.0), 0.3, motion=motion),
    "formula": lambda motion: swarm.Formula("x**2/0.25 + y**2/0.25 + z**4/0.0625 - 1", motion=motion),
}
SOLIDS = {
    "ball": lambda motion: swarm.Sphere(0.2, side="outside", motion=motion),
    "block": lambda motion: swarm.Box((0.2, 0.1, 0.15), side="outside", motion=motion),
    "rod": lambda motion: swarm.Cylinder(0.1, length=0.4, side="outside", motion=motion),
    "ring": lambda motion: swarm.Torus(0.3, 0.1, side="outside", motion=motion),
}


def run(scene, particles, until, frames=1, method=None, **options):
    method = method or swarm.Impact()
    options = {"compile": "never", **options}
    return swarm.simulate(scene, particles, method, until=until, every=until / frames, **options)


def imbalance(result):
    """What the energy, with what was lost and less the work, has changed by; relative."""
    seen = result.observables
    return unbooked(seen) / np.abs(seen["total_energy"]).max()


def test_the_bound_of_the_speed_of_a_path_is_near_its_largest_speed():
    rng = np.random.default_rng(5)
    for _case in range(30):
        times = np.sort(rng.uniform(0.0, 3.0, 9))
        drive = drive_of(swarm.Sphere(0.5, motion=swarm.Path(times, rng.normal(size=(9, 3)))), 0.0)
        speeds = [math.hypot(*drive.track.at(t)[1]) for t in np.linspace(times[0], times[-1], 4000).tolist()]
        assert max(speeds) <= (1.0 + 1e-12) * drive.fastest <= 1.25 * max(speeds)


@pytest.mark.parametrize("times", [np.linspace(0.0, 3.0, 11), np.array([0.0, 0.01, 0.02, 2.5, 3.0]), (0.0, 3.0)])
def test_the_piece_of_a_path_at_a_time(times):
    path = swarm.Path(times, np.random.default_rng(5).normal(size=(len(times), 3)))
    track = drive_of(swarm.Sphere(0.5, motion=path), 1.0).track
    knots = track.times
    asked = np.concatenate([knots, np.nextafter(knots, -np.inf), np.linspace(-1.0, 4.0, 500)])
    wanted = np.clip(np.searchsorted(knots, 1.0 + (asked - 1.0), side="right") - 1, 0, len(knots) - 2)
    assert [track.piece_at(t - 1.0) for t in asked.tolist()] == wanted.tolist()


# --- Uniform motion: the trajectory at rest, transformed -------------------------------------------------


@pytest.mark.parametrize("gravity", [None, (0.0, 0.0, -1.0)], ids=["straight", "falling"])
@pytest.mark.parametrize("name", ["sphere", "box", "ellipsoid", "torus"])
def test_a_vessel_in_uniform_motion_is_one_at_rest(name, gravity):
    rest, moving = (swarm.Scene([CAVITIES[name](motion)], gravity) for motion in (None, swarm.Translation(VELOCITY)))
    start = swarm.fill(rest, 4, speed=1.0, seed=3)
    shift = np.array(VELOCITY)[:, None]
    carried = swarm.Particles(start.position, start.velocity + shift, start.mass)
    until = 8.0
    here, there = run(rest, start, until), run(moving, carried, until)
    assert here.observables["impacts"][-1] >= 4 * 9
    moved = there.particles.position - until * shift
    # An orbit in a torus or an ellipsoid takes errors along that grow from impact to impact.
    assert np.abs(moved - here.particles.position).max() <= (1e-12 if name in ("sphere", "box") else 1e-10)
    assert imbalance(there) <= 1e-14
    assert there.observables["energy_error"].max() <= 1e-14


def test_a_ball_in_uniform_motion_after_fifty_impacts():
    """A ball in the middle of a sphere: an orbit that does not take errors along."""
    velocity, until = (0.11, 0.05, -0.07), 25.0
    scenes = [
        swarm.Scene([swarm.Sphere(0.5, motion=m), swarm.Sphere(0.15, side="outside", motion=m)])
        for m in (None, swarm.Translation(velocity))
    ]
    start = swarm.Particles([0.3, 0.1, 0.05], [1.0, 0.0, 0.0], 1.0)
    carried = swarm.Particles(start.position, start.velocity + np.array(velocity)[:, None], 1.0)
    here, there = (run(scene, p, until) for scene, p in zip(scenes, (start, carried), strict=True))
    assert here.observables["impacts"][-1] == there.observables["impacts"][-1] >= 50
    assert (here.observables["impulse"][-1] > 0.0).all()
    moved = there.particles.position[:, 0] - until * np.array(velocity)
    assert np.abs(moved - here.particles.position[:, 0]).max() <= 1e-12


@pytest.mark.parametrize(
    "motion",
    [swarm.Oscillation((0.0, 0.0, 0.0), 1.3), swarm.Rotation((0.0, 1.0, 0.0), 0.0, (0.1, 0.0, 0.0))],
    ids=["oscillation", "rotation"],
)
@pytest.mark.parametrize("gravity", [None, (0.0, 0.0, -1.0)], ids=["straight", "falling"])
@pytest.mark.parametrize("name", ["box", "cylinder", "ellipsoid", "sphere"])
def test_a_motion_that_moves_nothing_is_rest(name, gravity, motion):
    """Also from frames in mid-air, and along planes of symmetry: the same walls are met."""
    rest, moving = (swarm.Scene([CAVITIES[name](one)], gravity) for one in (None, motion))
    start = swarm.fill(rest, 4, speed=1.0, seed=3)
    start.position[0, 0] = start.velocity[1, 0] = start.velocity[0, 1] = start.velocity[2, 2] = 0.0
    here, there = (run(scene, start, 1.0, frames=7) for scene in (rest, moving))
    assert here.observables["impacts"].tolist() == there.observables["impacts"].tolist()
    assert np.abs(there.particles.position - here.particles.position).max() <= 1e-11


# --- Hits: none is skipped, to round-off of the time -----------------------------------------------------


def first_hit_by_scan(scene, rest, r, v, pull, start, times, poses):
    """The first time at which a gap rises through 0, from many samples; infinite if it never rises.

    Args:
        rest: the scene whose walls do not move.
        poses: those of the wall at these times after `start`.
    """

    def place(t):
        return r[:, None] + v[:, None] * t + 0.5 * t * t * np.array(pull)[:, None]

    inside = gaps_along(rest, poses, place(times)).max(axis=0) <= 0.0
    rises = np.flatnonzero(inside[:-1] & ~inside[1:])
    if not rises.size:
        return math.inf
    low, high = times[rises[0]], times[rises[0] + 1]
    return brentq(lambda t: scene.gaps(place(t), start + t).max(), low, high, xtol=1e-15, rtol=9e-16)


def moments(span):
    return np.linspace(0.0, span, 500)


@functools.cache
def poses_of(motion, start, span):
    """The poses of a motion at the moments after a start."""
    return [pose(MOTIONS[motion], start + t) for t in moments(span).tolist()]


@every_pair(
    name=[*CAVITIES, *SOLIDS],
    motion=list(MOTIONS),
    pull={"straight": (0.0, 0.0, 0.0), "falling": (0.3, 0.0, -2.0)},
)
def test_the_first_hit_is_found(name, motion, pull):
    made, still = ((CAVITIES | SOLIDS)[name](one) for one in (MOTIONS[motion], None))
    scene, rest = swarm.Scene([made]), swarm.Scene([still])
    rng, found, start, span = np.random.default_rng(5), 0, 0.6, 2.5
    walls, times = scene.compiled().walls(start + span), moments(span)
    poses, gravity = poses_of(motion, start, span), swarm.Scene([made], pull).pull()
    for _ in range(60):
        r, v = rng.uniform(-0.6, 0.6, 3), rng.standard_normal(3)
        if name in SOLIDS:
            v = 0.2 * v - rng.uniform(0.5, 2.0) * r
        if not (scene.gaps(r[:, None], start) < -1e-3).all():
            continue
        with np.errstate(all="ignore"):
            hit = safe.first_hit_moving(walls, gravity, vec(r), vec(v), span)
        wanted = first_hit_by_scan(scene, rest, r, v, pull, start, times, poses)
        if not hit.time < span:
            # Not within the span, or still under way: never past the hit.
            assert hit.time <= wanted or wanted == math.inf
            continue
        found += 1
        # Where the scan is too coarse for a flight that only touches, it finds a later hit.
        assert hit.time <= wanted + 1e-12
        place = r + v * hit.time + 0.5 * hit.time**2 * np.array(pull)
        assert abs(scene.distances_outside(place[:, None], start + hit.time)).min() <= 1e-14
        if found >= 4:
            break
    assert found >= 2


def in_a_sphere_that_swings(radius, swing, r, v, until):
    """(its place and velocity then, the number of its impacts) of a particle, in thirty digits."""
    amplitude, rate, phase = mpmath.matrix(swing.amplitude), 2 * mpmath.pi * swing.frequency, swing.phase
    r, v, now, impacts = mpmath.matrix(r), mpmath.matrix(v), mpmath.mpf(0), 0

    def off(t):
        return r + v * (t - now) - amplitude * (mpmath.sin(rate * t + phase) - mpmath.sin(phase))

    def gap(t):
        return mpmath.norm(off(t)) - radius

    def gaps(t):
        wave = np.sin(float(rate) * t + phase) - math.sin(phase)
        at = [float(r[k]) + float(v[k]) * (t - float(now)) - float(amplitude[k]) * wave for k in range(3)]
        return np.sqrt(sum(x * x for x in at)) - radius

    while True:
        moments = np.linspace(float(now), until, 4001)[1:]
        outside = np.flatnonzero(gaps(moments) > 0.0)
        if not outside.size:
            return r + v * (until - now), v, impacts
        last = moments[outside[0]]
        hit = mpmath.findroot(gap, (last - (moments[1] - moments[0]), last), solver="anderson", tol=1e-50)
        normal = off(hit) / radius
        approach = mpmath.fdot(v - amplitude * rate * mpmath.cos(rate * hit + phase), normal)
        r, v, now, impacts = r + v * (hit - now), v - 2 * approach * normal, hit, impacts + 1


@pytest.mark.parametrize("amplitude", [0.02, 0.15, 0.7])
def test_impacts_in_a_sphere_that_swings(amplitude):
    """Also where it leaves no place that it never comes to."""
    swing = swarm.Oscillation((amplitude, 0.3 * amplitude, 0.5 * amplitude), frequency=0.7, phase=0.4)
    scene = swarm.Scene([swarm.Sphere(0.5, motion=swing)])
    start, until = swarm.fill(scene, 4, speed=1.0, seed=6), 2.5
    result = run(scene, start, until)
    with mpmath.workdps(30):
        for k in range(4):
            r, v = start.position[:, k].tolist(), start.velocity[:, k].tolist()
            r, v, impacts = in_a_sphere_that_swings(0.5, swing, r, v, until)
            assert result.impacts_per_particle[k] == impacts >= 2
            assert np.abs(result.particles.position[:, k] - np.array(r.tolist(), float)[:, 0]).max() <= 1e-12
            assert np.abs(result.particles.velocity[:, k] - np.array(v.tolist(), float)[:, 0]).max() <= 1e-11
    assert result.observables["max_penetration"].max() <= 4.0 * np.finfo(float).eps


def test_a_flight_that_meets_a_swinging_sphere_shortly_before_the_end_of_a_frame():
    """The guess of its hit, far before the end, has a parabola that does not rise: it says nothing of the end."""
    swing = swarm.Oscillation(
        (-0.003087541204373585, -0.01702616347965316, 0.018383069471157365), 5.518599487061708, 3.000632198286409
    )
    start, speed = np.array([0.09397534, -0.40219669, 0.18057715]), np.array([0.03310402, 0.28129611, -0.52388501])
    until, turn, wide = 1.7225642320962407, 2.0 * math.pi * swing.frequency, np.array(swing.amplitude)

    def center(t):
        return wide * (math.sin(turn * t + swing.phase) - math.sin(swing.phase))

    def gap(t):
        return np.linalg.norm(start + speed * t - center(t)) - 0.5

    # It is 3 mm outside at 1.29 s, where a frame ends.
    assert max(gap(t) for t in np.linspace(0.0, 1.228, 20_001)) < 0.0
    hit = brentq(gap, 1.228, 1.23, xtol=1e-15)
    normal = (start + speed * hit - center(hit)) / 0.5
    off = speed - turn * wide * math.cos(turn * hit + swing.phase)
    after = speed - 2.0 * (off @ normal) * normal
    particle = swarm.Particles(start, speed)
    scene = swarm.Scene([swarm.Sphere(0.5, motion=swing)])
    run = swarm.simulate(scene, particle, swarm.Impact(), until=until, every=until / 4, compile="never")
    assert run.observables["impacts"][-1] == 1
    exact = start + speed * hit + after * (until - hit)
    np.testing.assert_allclose(run.particles.position[:, 0], exact, rtol=0.0, atol=1e-13)


def test_a_hit_of_a_wall_that_comes_and_goes():
    """A floor that swings just up to a particle which stands still, or just not."""
    amplitude, rest = 0.25, Vec(0.0, 0.0, 0.0)
    for gap, hits in ((1.0 - 1e-9, True), (1.0 + 1e-9, False)):
        floor = swarm.Plane((0, 0, -1), offset=gap * amplitude, motion=swarm.Oscillation((0, 0, amplitude), 1.0))
        walls = swarm.Scene([floor]).compiled().walls(0.6)
        with np.errstate(all="ignore"):
            found = safe.first_hit_moving(walls, None, rest, ZERO, 0.6)
        assert (found.time < 0.6) == hits
        if hits:
            # amplitude sin(2 pi t) = gap amplitude, a little before the top
            assert found.time == pytest.approx(math.asin(gap) / (2.0 * math.pi), rel=1e-9)


# --- Work ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("name", ["sphere", "box", "cylinder", "formula"])
def test_work_is_booked(name, motion):
    scene = swarm.Scene([CAVITIES[name](MOTIONS[motion])], gravity=(0.0, 0.0, -1.0))
    result = run(scene, swarm.fill(scene, 4, speed=1.0, seed=2), 4.0, frames=4)
    assert imbalance(result) <= 1e-14
    assert result.observables["dissipated_energy"][-1] == 0.0
    assert result.observables["energy_error"].max() <= 1e-13
    assert result.observables["max_penetration"].max() <= 1e-14


def test_a_rotating_sphere_does_nothing_and_a_rotating_box_heats():
    spin = swarm.Rotation((1.0, 0.5, 0.0), rate=3.0, center=(0.0, 0.0, 0.0))
    rest, turning = (swarm.Scene([swarm.Sphere(0.5, motion=motion)]) for motion in (None, spin))
    start = swarm.fill(rest, 5, speed=1.0, seed=4)
    here, there = run(rest, start, 10.0), run(turning, start, 10.0)
    assert np.abs(here.particles.position - there.particles.position).max() <= 1e-13
    assert abs(there.observables["wall_work"][-1]).max() <= 1e-14
    box = swarm.Scene([swarm.Box((0.5, 0.5, 0.5), motion=spin)])
    result = run(box, swarm.fill(box, 8, speed=0.2, seed=4), 20.0)
    seen = result.observables
    assert seen["total_energy"][-1] > 4.0 * seen["total_energy"][0]
    assert imbalance(result) <= 1e-14


@pytest.mark.parametrize("name", ["sphere", "cylinder along the axis"])
@pytest.mark.parametrize("motion", ["rotation", "sum"])
def test_a_rotation_that_carries_a_round_surface_along_a_circle_is_a_swing(name, motion):
    center = (0.2, -0.1, 0.3)
    if name == "sphere":
        surface = swarm.Sphere(0.5, center, motion=MOTIONS[motion])
    else:
        surface = swarm.Cylinder(0.4, axis=TURN.axis, length=0.9, center=center, motion=MOTIONS[motion])
    moment, remaining = 2.3, 0.9
    drive, at = drive_of(surface, moment), moment - remaining
    assert drive.turn is None
    points = np.random.default_rng(5).uniform(-1.0, 1.0, (3, 20))
    now = swarm.Scene([surface]).compiled().walls(moment).at(remaining)
    rest = swarm.Scene([replace(surface, motion=None)]).compiled().walls(moment)
    placed, spin = pose(MOTIONS[motion], at), 1.3 * np.array(TURN.axis) / math.sqrt(14.0)
    middle = np.array(TURN.center) + placed.shift
    moving = [part for part in getattr(MOTIONS[motion], "parts", ()) if not isinstance(part, swarm.Rotation)]
    steady = sum((part.harmonic((0.0, 0.0, 0.0)).velocity_at(at) for part in moving), np.zeros(3))
    for r in points.T:
        own = np.array(TURN.center) + placed.turn.T @ (r - middle)
        for k in range(len(now.each)):
            assert now.distance(float(k), vec(r)) == pytest.approx(rest.distance(float(k), vec(own)), abs=1e-15)
            assert np.array(now.velocity(float(k), vec(r))) == pytest.approx(
                steady + np.cross(spin, r - middle), abs=1e-15
            )
    # The circle is as far from the axis as the centre is, and its bounds are those of uniform motion along it.
    arm = np.linalg.norm(np.cross(np.array(center) - TURN.center, TURN.axis)) / math.sqrt(14.0)
    assert drive.swings[-1].amplitude() == pytest.approx(arm, rel=1e-14)


def test_the_laws_act_on_the_relative_velocity():
    """A ball that meets a bat: v1 = u + e (u - v) across it, and friction along it."""
    e, mu, u = 0.6, 0.1, np.array([0.4, 0.0, 0.7])
    bat = swarm.Plane((0, 0, -1), restitution=e, friction=mu, motion=swarm.Translation(tuple(u)))
    v = np.array([1.5, 0.0, -2.0])
    result = run(swarm.Scene([bat]), swarm.Particles([0.0, 0.0, 1.0], v, 2.0), 1.0)
    normal = (1.0 + e) * (u[2] - v[2])
    wanted = np.array([v[0] - mu * normal, 0.0, v[2] + normal])
    assert result.particles.velocity[:, 0] == pytest.approx(wanted, rel=1e-14, abs=1e-15)
    seen = result.observables
    # The impulse on the ball does work at the bat's velocity; what is lost is in the bat's frame.
    assert seen["wall_work"][-1][0] == pytest.approx(2.0 * u @ (wanted - v), rel=1e-14)
    lost = ((v - u) ** 2).sum() - ((wanted - u) ** 2).sum()
    assert seen["dissipated_energy"][-1] == pytest.approx(lost, rel=1e-14)


def test_a_hot_piston_gives_heat_and_work():
    piston = swarm.Plane((0, 0, 1), 0.5, temperature=0.2, motion=swarm.Translation((0.0, 0.0, -0.05)))
    scene = swarm.Scene([swarm.Cylinder(0.4), swarm.Plane((0, 0, -1), 0.5), piston])
    result = run(scene, swarm.fill(scene, 20, temperature=0.1, seed=6), 3.0, frames=3)
    assert imbalance(result) <= 1e-14
    seen = result.observables
    assert seen["wall_work"][-1][2] > 0.0
    assert seen["wall_work"][-1][:2].tolist() == [0.0, 0.0]
    assert seen["wall_heat"][-1][2] != 0.0


# --- Against closed forms --------------------------------------------------------------------------------


def test_a_piston_compresses_by_the_law_of_one_dimension():
    """Between a wall at 0 and a piston at L - u t, from impact to impact: v -> v + 2 u at the piston."""
    length, u, until = 1.0, 0.01, 60.0
    scene = swarm.Scene(
        [swarm.Plane((-1, 0, 0), 0.0), swarm.Plane((1, 0, 0), length, motion=swarm.Translation((-u, 0.0, 0.0)))]
    )
    result = run(scene, swarm.Particles([0.25, 0.0, 0.0], [1.0, 0.0, 0.0], 1.0), until)
    x, v, t = mpmath.mpf(1) / 4, mpmath.mpf(1), mpmath.mpf(0)
    with mpmath.workdps(40):
        piston = mpmath.mpf(-u)
        while True:
            wait = (length + piston * t - x) / (v - piston) if v > 0 else -x / v
            if t + wait > until:
                break
            x, t = x + v * wait, t + wait
            v = -v + 2 * piston if v > 0 else -v
        x += v * (until - t)
    assert result.particles.position[0, 0] == pytest.approx(float(x), abs=1e-11)
    assert result.particles.velocity[0, 0] == pytest.approx(float(v), rel=1e-12)
    # The adiabatic invariant of one degree of freedom: |v| L
    assert abs(float(v)) * (length - u * until) == pytest.approx(length, rel=0.03)


def test_the_fermi_ulam_trajectory_where_it_is_not_chaotic():
    amplitude, length, v = 0.01, 1.0, 8.0
    impacts = 500
    until, wanted = fermi.in_fifty_digits(v, amplitude, impacts)
    wall = swarm.Plane(
        (1, 0, 0), length, motion=swarm.Oscillation((amplitude, 0.0, 0.0), frequency=0.5 / math.pi, phase=0.0)
    )
    scene = swarm.Scene([swarm.Plane((-1, 0, 0), 0.0), wall])
    result = run(scene, swarm.Particles([0.0, 0.0, 0.0], [v, 0.0, 0.0], 1.0), until - 1e-3, frames=7)
    assert result.observables["impacts"][-1] == 2 * impacts - 1
    assert -result.particles.velocity[0, 0] == pytest.approx(wanted, rel=1e-9)


# --- Contacts that last ----------------------------------------------------------------------------------


@pytest.mark.parametrize("friction", [0.0, 0.2])
def test_sliding_in_a_bowl_in_uniform_motion(friction):
    law = {"friction": friction, "restitution": 0.0 if friction else 1.0}
    rest, moving = (
        swarm.Scene([swarm.Sphere(0.5, motion=motion, **law)], DOWN) for motion in (None, swarm.Translation(VELOCITY))
    )
    angle = np.array([0.4, 0.9])
    places = 0.5 * (1.0 - 1e-15) * np.array([np.sin(angle), 0.0 * angle, -np.cos(angle)])
    speeds = np.array([0.0 * angle, 0.3 + 0.0 * angle, 0.0 * angle])
    shift = np.array(VELOCITY)[:, None]
    until = 0.8
    here = run(rest, swarm.Particles(places, speeds, [1.0, 1.0]), until)
    there = run(moving, swarm.Particles(places, speeds + shift, [1.0, 1.0]), until)
    assert here.observables["sliding"][-1] == there.observables["sliding"][-1] == 2
    assert np.abs(there.particles.position - until * shift - here.particles.position).max() <= 1e-8
    assert imbalance(there) <= 1e-14
    lost = here.observables["dissipated_energy"][-1]
    assert there.observables["dissipated_energy"][-1] == pytest.approx(lost, abs=1e-7)


@pytest.mark.parametrize("friction", [0.0, 0.1])
def test_sliding_in_a_bowl_that_swings(friction):
    amplitude, frequency, phase, radius = np.array([0.02, 0.0, 0.03]), 1.5, 0.4, 0.5
    rate = 2.0 * math.pi * frequency

    def course(t, y):
        angle, turn = y
        a = -amplitude * rate**2 * math.sin(rate * t + phase)
        down = G + a[2]
        press = radius * turn**2 + down * math.cos(angle) - a[0] * math.sin(angle)
        drag = friction * press * np.sign(turn)
        return [turn, -(down * math.sin(angle) + a[0] * math.cos(angle) + drag) / radius]

    until = 0.25 if friction else 0.5
    angle, turn = 0.6, 0.5
    end = solve_ivp(course, (0.0, until), [angle, turn], method="DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
    swing = swarm.Oscillation(tuple(amplitude), frequency, phase)
    bowl = swarm.Sphere(radius, friction=friction, restitution=0.5 if friction else 1.0, motion=swing)
    across, along = (
        np.array([math.sin(angle), 0.0, -math.cos(angle)]),
        np.array([math.cos(angle), 0.0, math.sin(angle)]),
    )
    speed = amplitude * rate * math.cos(phase) + radius * turn * along
    start = swarm.Particles(radius * (1.0 - 1e-15) * across, speed, 1.0)
    result = run(swarm.Scene([bowl], DOWN), start, until)
    wanted = pose(swing, until).shift + radius * np.array([math.sin(end[0]), 0.0, -math.cos(end[0])])
    assert result.observables["sliding"][-1] == 1
    assert np.abs(result.particles.position[:, 0] - wanted).max() <= 3e-9
    assert imbalance(result) <= 1e-14


def test_sliding_on_a_plane_that_turns():
    """s'' = w^2 s - g sin(w t) along it: centrifugal force, and no word of Coriolis' across it."""
    rate, until, s, ds = 0.7, 0.9, 0.3, 0.1
    end = solve_ivp(
        lambda t, y: [y[1], rate**2 * y[0] - G * math.sin(rate * t)],
        (0.0, until), [s, ds], method="DOP853", rtol=1e-13, atol=1e-14,
    ).y[0, -1]  # fmt: skip
    plane = swarm.Plane((0, 0, -1), motion=swarm.Rotation((0.0, -1.0, 0.0), rate, (0.0, 0.0, 0.0)))
    result = run(swarm.Scene([plane], DOWN), swarm.Particles([s, 0.0, 0.0], [ds, 0.0, s * rate], 1.0), until)
    wanted = end * np.array([math.cos(rate * until), 0.0, math.sin(rate * until)])
    assert np.abs(result.particles.position[:, 0] - wanted).max() <= 3e-9


@pytest.mark.parametrize("strength", [0.5, 2.0], ids=["it stays", "it is thrown"])
def test_a_grain_on_a_floor_that_shakes(strength):
    """Below g it comes to rest on the floor and follows it; above, it leaves where the floor falls faster than g."""
    frequency = 5.0
    rate = 2.0 * math.pi * frequency
    amplitude = strength * G / rate**2
    floor = swarm.Plane((0, 0, -1), restitution=0.0, motion=swarm.Oscillation((0, 0, amplitude), frequency))
    scene = swarm.Scene([floor], DOWN)
    leaves = math.asin(min(1.0, 1.0 / strength)) / rate
    result = run(scene, swarm.Particles([0.0, 0.0, 0.0], [0.0, 0.0, amplitude * rate], 1.0), leaves + 0.03)
    z, t = result.particles.position[2, 0], leaves + 0.03
    if strength < 1.0:
        assert z == pytest.approx(amplitude * math.sin(rate * t), abs=1e-14)
        assert result.observables["sliding"][-1] == 1
    else:
        flight = (
            amplitude * math.sin(rate * leaves) + amplitude * rate * math.cos(rate * leaves) * 0.03 - 0.5 * G * 9e-4
        )
        assert z == pytest.approx(flight, abs=1e-12)
        assert result.observables["sliding"][-1] == 0
    assert imbalance(result) <= 1e-13


def test_a_drum_lifts_a_grain_to_the_angle_of_friction():
    friction, rate, radius = 0.5, 0.2, 0.5
    drum = swarm.Cylinder(
        radius, axis=(0, 1, 0), friction=friction, restitution=0.0,
        motion=swarm.Rotation((0.0, -1.0, 0.0), rate, (0.0, 0.0, 0.0)),
    )  # fmt: skip
    scene = swarm.Scene([drum], DOWN)
    start = swarm.Particles([0.0, 0.0, -radius], [radius * rate, 0.0, 0.0], 1.0)
    slips = math.atan(friction)
    before = run(scene, start, 0.9 * slips / rate)
    x, _y, z = before.particles.position[:, 0]
    # It rests on the drum, and turns with it.
    assert math.atan2(x, -z) == pytest.approx(0.9 * slips, rel=1e-12)
    assert before.observables["dissipated_energy"][-1] == 0.0
    after = run(scene, start, 1.8 * slips / rate, frames=18)
    x, _y, z = after.particles.position[:, 0]
    assert abs(math.atan2(x, -z) - slips) <= 1.1 * rate * math.sqrt(radius / G)
    assert after.observables["dissipated_energy"][-1] > 0.0
    assert imbalance(after) <= 1e-13


# --- The same bits ---------------------------------------------------------------------------------------


def test_frames_cut_nothing():
    """Frames that end within a flight change no more than round-off."""
    scene = swarm.Scene([CAVITIES["box"](MOTIONS["sum"])])
    start = swarm.fill(scene, 3, speed=1.0, seed=8)
    one, many = run(scene, start, 3.0), run(scene, start, 3.0, frames=17)
    assert np.abs(one.particles.position - many.particles.position).max() <= 1e-11


def test_threads_and_blocks_change_no_bit():
    """Where walls swing and turn at once: one kind."""
    scene = swarm.Scene([CAVITIES["box"](MOTIONS["sum"])], gravity=(0.0, 0.0, -1.0))
    start = swarm.fill(scene, 600, speed=1.0, seed=8)
    results = [
        run(scene, start, 2.0, 2, compile="always", threads=threads, block_size=size)
        for threads, size in ((1, None), (2, 256))
    ]
    assert np.array_equal(results[0].particles.position, results[1].particles.position)
    assert np.array_equal(results[0].observables["wall_work"], results[1].observables["wall_work"])
    few = swarm.Particles(start.position[:, :12], start.velocity[:, :12], start.mass[:12])
    plain = run(scene, few, 2.0, frames=2)
    assert np.abs(plain.particles.position - results[0].particles.position[:, :12]).max() <= 1e-9


def test_the_walls_of_a_chain_at_an_instant():
    scene = swarm.Scene([CAVITIES["sphere"](None)])
    assert scene.compiled().walls().at(0.3) == scene.compiled().walls()


# --- Bad input, and walls that close ---------------------------------------------------------------------

WEST = swarm.Particles([-0.3, 0.0, 0.0], [0.0, 0.0, 0.0])
INSIDE = swarm.Particles([0.0, 0.0, 0.2], [0.1, 0.0, 0.0])
UP = (0.0, 0.0, 1.0)


def started(motion, method=None, particles=INSIDE, **options):
    return swarm.simulate(
        swarm.Scene([swarm.Sphere(0.5, motion=motion)]), particles, method or swarm.Impact(),
        **{"until": 1.0, "compile": "never", **options},
    )  # fmt: skip


WRONG = {
    "velocity": (lambda: swarm.Translation((math.inf, 0.0, 0.0)), "velocity"),
    "amplitude": (lambda: swarm.Oscillation((0.0, math.nan, 0.0), 1.0), "amplitude"),
    "frequency": (lambda: swarm.Oscillation(UP, 0.0), "frequency must be above 0, got 0"),
    "phase": (lambda: swarm.Oscillation(UP, 1.0, phase=math.inf), "phase must be a finite number, got inf"),
    "rate": (lambda: swarm.Rotation(UP, math.nan, (0.0, 0.0, 0.0)), "rate must be a finite number, got nan"),
    "axis": (lambda: swarm.Rotation((0.0, 0.0, 0.0), 1.0, (0.0, 0.0, 0.0)), "axis must have a direction"),
    "two rotations": (lambda: TURN + TURN, "at most 1 Rotation, got 2; about one axis their rates add up"),
    "two paths": (lambda: PATH + PATH, "at most 1 Path, got 2; their displacements add up"),
    "not a motion": (lambda: swarm.Sphere(0.5, motion=3.0), "motion must be None, swarm.Translation"),
    "ends early": (
        lambda: started(swarm.Path((0.0, 0.5), ((0, 0, 0), UP))),
        r"surfaces\[0\].motion.times must cover the run from 0 to 1 s, got 0 to 0.5",
    ),
    "starts late": (lambda: started(swarm.Path((0.1, 2.0), ((0, 0, 0), UP))), "must cover the run from 0 to 1 s"),
    "starts long ago": (
        lambda: started(swarm.Path((-1e17, 1e17), ((0, 0, 0), UP))),
        r"surfaces\[0\].motion.times must have one at 0 s or at most 1e\+12 times .*, got -1e\+17 s; add the time 0",
    ),
    "swings too often": (
        lambda: started(swarm.Oscillation(UP, 2e8) + TURN),
        r"surfaces\[0\].motion.frequency must be such .* at most 1e\+09 rad .*, got 2e\+08 1/s and thus 1.26e\+09",
    ),
    "turns too often": (
        lambda: started(swarm.Rotation(UP, -1e8, (0.0, 0.0, 0.0)), until=20.0),
        r"surfaces\[0\].motion.rate must be .* apart, got -1e\+08 rad/s and thus 2e\+09 rad at 20 s",
    ),
    "a point is led too often": (
        lambda: swarm.simulate(
            swarm.Scene([swarm.Sphere(5.0)]),
            swarm.Bodies(
                swarm.Body([(0, 0, 0), (1, 0, 0)], 1.0, [(0, 1)], anchors={0: swarm.Rotation(UP, 1e10, (0, 0, 0))}),
                [[0.0, 1.0], [0.0, 0.0], [0.0, 0.0]], np.zeros((3, 2)),
            ),
            swarm.Impact(dt=1e-3), until=1.0, compile="never",
        ),
        r"anchors\[0\].rate must be such that",
    ),
    "multipliers": (
        lambda: started(SWING, swarm.AugmentedLagrangian(dt=1e-3, penalty=1e4, adaptive=True)), r"surfaces\[0\].motion"
    ),
    "contact step": (lambda: started(SWING, swarm.Impact(contact_step=1e-3)), "contact_step must be 0 where .* motion"),
    "bodies": (
        lambda: started(
            SWING, swarm.Penalty(dt=1e-3, penalty=1e4),
            swarm.place(swarm.Scene([swarm.Sphere(0.5)]), swarm.dumbbell(0.1, 1.0), 2, speed=0.1, spin=0.0, seed=1),
        ),
        r"surfaces\[0\].motion must be None with bodies and soft walls",
    ),
    "one step": (
        lambda: swarm.contact_history(
            swarm.Scene([swarm.Sphere(0.5, motion=SWING)]), (0.4, 0.3, 0.0), (0.3, 0.4, 0.0), 1.0,
            swarm.AugmentedLagrangian(dt=0.025, penalty=1e4),
        ),
        r"surfaces\[0\] must be at rest, .*, got Sphere.*; use simulate",
    ),
    "outside": (
        lambda: started(swarm.Path((0.0, 2.0), ((0.4, 0.0, 0.0), UP)), particles=WEST),
        r"must start inside their walls, got 1 of 1 outside; the first is particle 0 .* \(Sphere\), as it is at 0 s",
    ),
    "swept before the start": (
        lambda: swarm.simulate(
            swarm.Scene([swarm.Sphere(0.5), swarm.Sphere(0.1, side="outside", motion=swarm.Translation(UP))]),
            swarm.Particles([0.0, 0.0, 0.05], [0.0, 0.0, 0.0]), swarm.Impact(), until=1.0, compile="never",
        ),
        r"0\.05 m inside surfaces\[1\] \(Sphere\), as it is at 0 s",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG)
def test_bad_input(name):
    call, sentence = WRONG[name]
    with pytest.raises(swarm.SceneError, match=sentence):
        call()


def test_walls_that_close_say_where_and_when(tmp_path, monkeypatch):
    """The volume vanishes at 1 s; the frames before are kept."""
    monkeypatch.setattr(block, "MOST_HITS", 1000.0)
    walls = [swarm.Plane((-1, 0, 0), 0.0), swarm.Plane((1, 0, 0), 0.5, motion=swarm.Translation((-0.5, 0.0, 0.0)))]
    start = swarm.Particles([[0.2, 0.3], [0.0, 0.0], [0.0, 0.0]], [[1.0, -0.7], [0.0, 0.1], [0.0, 0.0]])
    file = tmp_path / "run.h5"
    message = r"at particle [01]: .* it is at .* s: walls that move have closed on it; end the run before"
    with pytest.raises(swarm.RunError, match=message) as caught:
        run(swarm.Scene(walls), start, 2.0, frames=20, trajectory=file)
    moment = float(re.search(r" at ([\d.]+) s: walls that move", str(caught.value)).group(1))
    assert moment == pytest.approx(1.0, abs=1e-2)
    with swarm.load(file) as trajectory:
        assert trajectory.times[-1] == pytest.approx(0.9)


def test_a_hit_of_a_wall_at_rest_at_once_is_none_of_one_that_moves():
    """A particle at a wall at rest, and a floor that shakes far below it."""
    floor = swarm.Plane((0.0, 0.0, -1.0), 0.0, motion=swarm.Oscillation((0.0, 0.0, 0.05), 2.0))
    scene = swarm.Scene([swarm.Slab((0.0, 1.0, 0.0), 0.5), floor], DOWN)
    walls = scene.compiled().walls(1.0)
    gravity = swarm.Scene([floor], DOWN).pull()
    for left in (0.0, 0.5):
        with np.errstate(all="ignore"):
            hit = safe.first_hit_moving(
                walls, gravity, *map(vec, np.array([(0.1, -0.5, 1.6), (0.2, -0.1, -0.4)])), left
            )
        assert hit.time == 0.0
        assert scene.compiled().numbering.surfaces_of_rows[int(hit.wall)] == 0


def test_surfaces_that_move_together_are_one_motion(monkeypatch):
    """The second one follows the first, in kernels too, and not one bit is another."""
    turns, falls = swarm.Rotation((0.0, 1.0, 0.0), 2.0), swarm.Translation((0.0, 0.0, -0.1))
    how = {"side": "outside", "restitution": 0.9, "friction": 0.1}
    floor = swarm.Box((0.06, 0.06, 0.01), center=(0.0, 0.0, -0.06), motion=turns, **how)
    sides = [swarm.Box((0.01, 0.06, 0.06), center=(x, 0.0, 0.0), motion=turns, **how) for x in (-0.05, 0.05)]
    other = swarm.Box((0.01, 0.01, 0.01), center=(0.2, 0.0, 0.0), motion=falls, **how)
    walls = moving.carried([], [floor, *sides, other], 0.3).each
    assert [type(wall) for wall in walls] == [moving.TurningWall, *2 * [moving.Following], moving.Translated]
    scene = swarm.Scene([swarm.Box((0.4, 0.4, 0.4)), floor, *sides, other], (0.0, 0.0, -9.81))
    start = swarm.Particles([[0.0, 0.03], [0.0, 0.01], [-0.04, 0.0]], [[0.5, 0.8], [0.05, 0.0], [-1.0, 0.5]])

    def end():
        result = swarm.simulate(scene, start, swarm.Impact(), until=0.1, compile="never")
        assert result.observables["impacts"][-1] > 0
        return [result.particles.position.tolist(), result.observables["wall_work"].tolist()]

    together = end()
    monkeypatch.setattr(moving, "_led_together", lambda _surfaces, of_surfaces: of_surfaces)
    assert together == end()
