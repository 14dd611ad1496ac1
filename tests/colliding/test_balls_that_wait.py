"""Balls that a wall holds for a time: obstacles at rest for the others, against an independent loop."""

import itertools
import math

import numpy as np
import pytest
from cut_short import in_sessions
from energy_books import booked

import swarm
from swarm.events.balls_run import CollidingRun
from swarm.surfaces.wall_law import mirrored

OPTIONS = {"compile": "never", "progress": False, "seed": 2}
HALF, RADIUS = 0.5, 0.1


class Stays(swarm.WallLaw):
    """Lets them wait, all as long."""

    time: float

    def leave(self, v, n, u, random, mass):
        return swarm.Leave(mirrored(v, n, u), wait=self.time)


def ran(scene, start, until, **options):
    return swarm.simulate(scene, start.copy(), swarm.Impact(), until=until, **{"every": until, **OPTIONS, **options})


def crowd(laws=(), n=6, seed=3, gravity=None, until=1.5, radius=0.17, **options):
    walls, pairs = options.pop("walls", {}), options.pop("pairs", None)
    scene = swarm.Scene([swarm.Box((HALF,) * 3, laws=laws, **walls)], gravity=gravity, pairs=pairs)
    return ran(scene, swarm.fill(scene, n, speed=1.0, mass=1.0, radius=radius, seed=seed), until, **options)


# --- An independent loop ---------------------------------------------------------------------------------


class Loop:
    """Balls in a box by the next root of all: numbers of particles, times and velocities in plain lists."""

    def __init__(self, start, wait, gravity=(0.0, 0.0, 0.0)):
        self.r, self.v = start.position.T.copy(), start.velocity.T.copy()
        self.wait, self.pull, self.m, self.radius = wait, np.array(gravity), start.mass, start.radius
        self.until = np.full(len(start), -1.0)  # when each is let go
        self.time, self.meetings, self.blows = 0.0, 0, 0.0

    def moving(self, i):
        """Its velocity and its acceleration."""
        held = self.until[i] > self.time
        return (np.zeros(3), np.zeros(3)) if held else (self.v[i], self.pull)

    def walls(self, i):
        v, a = self.moving(i)
        for axis, sign in itertools.product(range(3), (-1.0, 1.0)):
            gap = HALF - self.radius[i] - sign * self.r[i, axis]
            yield first_root([-0.5 * sign * a[axis], -sign * v[axis], gap]), ("wall", i, axis)

    def pair(self, i, j):
        (v, a), (w, b) = self.moving(i), self.moving(j)
        d, u, c = self.r[j] - self.r[i], w - v, 0.5 * (b - a)
        gap = d @ d - (self.radius[i] + self.radius[j]) ** 2
        return first_root([c @ c, 2.0 * u @ c, u @ u + 2.0 * d @ c, 2.0 * d @ u, gap]), ("pair", i, j)

    def run(self, until):
        n = len(self.m)
        while True:
            found = [one for i in range(n) for one in self.walls(i)]
            found += [self.pair(i, j) for i, j in itertools.combinations(range(n), 2)]
            found += [(t - self.time, ("go", i, 0)) for i, t in enumerate(self.until) if t > self.time]
            step, (kind, i, j) = min(found)
            last = not self.time + step < until
            self.fly(until - self.time if last else step)
            if last:
                return
            if kind == "go":
                self.time = max(self.time, self.until[i])
            elif kind == "wall":
                self.v[i, j] *= -1.0
                self.until[i] = self.time + self.wait
            else:
                self.meet(i, j)

    def fly(self, step):
        for i in range(len(self.m)):
            v, a = self.moving(i)
            self.r[i] += v * step + 0.5 * a * step * step
            if not self.until[i] > self.time:
                self.v[i] = v + a * step
        self.time += step

    def meet(self, i, j):
        n = self.r[j] - self.r[i]
        n /= np.linalg.norm(n)
        light = [0.0 if self.until[k] > self.time else 1.0 / self.m[k] for k in (i, j)]
        blow = -2.0 * n @ (self.moving(j)[0] - self.moving(i)[0]) / sum(light)
        self.v[i] -= light[0] * blow * n
        self.v[j] += light[1] * blow * n
        self.meetings, self.blows = self.meetings + 1, self.blows + (0.0 in light)


def first_root(polynomial):
    """The first time above round-off at which a gap that is 0 or more falls through 0."""
    times = np.roots(np.trim_zeros(polynomial, "f"))
    times = np.sort(times[np.abs(times.imag) < 1e-9].real)
    slope = np.polyder(np.array(polynomial))
    return next((t for t in times if t > 1e-9 and np.polyval(slope, t) < 0.0), math.inf)


@pytest.mark.parametrize("gravity", [None, (0.3, -0.2, -2.0)])
def test_it_is_the_run_of_an_independent_loop(gravity):
    until = 2.5
    scene = swarm.Scene([swarm.Box((HALF,) * 3, laws=[Stays(0.5)])], gravity=gravity)
    start = swarm.fill(scene, 5, speed=1.0, mass=1.0, radius=0.2, seed=3)
    start.mass[:] = 1.0, 2.0, 0.7, 1.3, 0.5
    start.radius[:] = 0.2, 0.17, 0.18, 0.15, 0.19
    own = Loop(start, 0.5, gravity or (0.0, 0.0, 0.0))
    own.run(until)
    result = ran(scene, start, until)
    assert own.blows >= 2
    assert result.observables["collisions"][-1] == own.meetings > own.blows
    assert result.particles.position == pytest.approx(own.r.T, abs=1e-9)
    assert result.particles.velocity == pytest.approx(own.v.T, abs=1e-9)


# --- How long --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("gravity", [None, (0.3, -0.2, -1.0)])
@pytest.mark.parametrize("laws", [[swarm.Sticky(0.2)], [swarm.Lambert(), swarm.Absorb(1e-3), swarm.Sticky(0.1)]])
def test_a_ball_waits_as_long_as_a_point_in_the_room_of_its_centre(laws, gravity):
    def in_room(size, radius):
        scene = swarm.Scene([swarm.Box((size,) * 3, laws=laws)], gravity=gravity)
        start = swarm.Particles((0.02, -0.1, 0.05), (1.0, 0.4, -0.7), 1.0, radius=radius)
        return ran(scene, start, 6.0, every=0.5, member_impacts=True)

    ball, point = in_room(HALF, RADIUS), in_room(HALF - RADIUS, None)
    assert ball.observables["impacts"][-1] == point.observables["impacts"][-1] > 5
    assert ball.particles.position == pytest.approx(point.particles.position, abs=1e-12)
    assert ball.particles.velocity == pytest.approx(point.particles.velocity, abs=1e-12)
    assert ball.member_residence[0] == pytest.approx(point.member_residence[0], abs=1e-6)
    assert ball.observables["energy_error"].max() < 1e-13


def test_the_share_that_is_held_is_that_of_its_times():
    """Of a flight L/v and a residence tau it is tau/(tau + L/v)."""
    sides = [swarm.Plane((sign, 0.0, 0.0), HALF, laws=[swarm.Sticky(0.25)]) for sign in (1.0, -1.0)]
    n, until, speed = 30, 10.0, 2.0
    lanes = np.array([np.zeros(n), np.arange(n) * 0.3, np.zeros(n)])
    start = swarm.Particles(lanes, lanes * 0.0 + np.array([[speed], [0.0], [0.0]]), radius=RADIUS)
    result = ran(swarm.Scene(sides), start, until)
    way, impacts = 2.0 * (HALF - RADIUS), int(result.observables["impacts"][-1])
    # Each has flown half the way, the way between impacts, and the way from the last wall.
    since = HALF - RADIUS + np.sign(result.particles.velocity[0]) * result.particles.position[0]
    held = until - (impacts * way - 0.5 * n * way + since.sum()) / (n * speed)
    assert held / until == pytest.approx(0.25 / (0.25 + way / speed), rel=0.05)


# --- Books -----------------------------------------------------------------------------------------------

RUBS = {"pairs": swarm.Pairs(restitution=0.9, friction=0.4), "walls": {"restitution": 0.9, "friction": 0.2}}


@pytest.mark.parametrize("gravity", [None, (0.0, 0.0, -2.0)])
@pytest.mark.parametrize("lossy", [{}, RUBS], ids=["elastic", "lossy"])
def test_what_is_held_does_not_move_and_the_books_balance(gravity, lossy):
    frames = []
    result = crowd(
        [swarm.Sticky(0.3)],
        gravity=gravity,
        every=0.05,
        **lossy,
        progress=lambda f: frames.append((f.position.copy(), f.velocity.copy())),
    )
    seen = result.observables
    assert seen["collisions"][-1] > 3
    assert seen["energy_error"].max() < 1e-12
    assert np.ptp(booked(seen)) < 1e-13 * np.abs(booked(seen)).max()
    assert seen["max_penetration"].max() < 1e-15
    rests = np.all([before == after for (before, _v), (after, _w) in itertools.pairwise(frames)], axis=1)
    assert rests.sum() > 20
    speed = np.array([np.abs(v).max(axis=0) for _place, v in frames[1:]])
    assert (speed[rests] > 0.0).all()
    apart = [np.linalg.norm(r[:, i] - r[:, j]) for r, _v in frames for i, j in itertools.combinations(range(6), 2)]
    assert min(apart) > 2.0 * 0.17 - 1e-15


def test_a_wall_gets_the_momentum_of_what_hits_those_that_it_holds():
    """Along x two planes take all that the balls lose; each hit of a ball that is held is booked at its wall."""
    sides = [swarm.Plane((sign, 0.0, 0.0), HALF, laws=[swarm.Sticky(0.5)]) for sign in (1.0, -1.0)]
    scene = swarm.Scene(sides, period=(None, 1.0, 1.0))
    start = swarm.fill(scene, 8, speed=1.0, mass=1.0, radius=0.15, seed=1)
    result = ran(scene, start, 3.0)
    seen = result.observables
    assert seen["collisions"][-1] > 10
    lost = start.velocity[0].sum() - seen["momentum"][-1][0]
    one, other = seen["impulse"][-1]
    assert one - other == pytest.approx(lost, abs=1e-12)
    table = 2.0 * np.abs(result.particles.velocity[0]).sum()
    assert one + other > table


def test_a_held_ball_is_a_fixed_sphere_with_friction():
    """It keeps the spin with which it leaves, and is struck as a ball of a huge mass that does not turn."""
    places, speeds = np.array([(0.3, -0.6), (0.0, 0.03), (0.0, 0.02)]), np.array([(1.0, 1.5), (0.0, 0.0), (0.0, 0.0)])
    spins = np.array([(0.0, 1.0), (3.0, -2.0), (1.0, 4.0)])
    laws = swarm.Pairs(restitution=0.8, friction=0.3)
    scene = swarm.Scene([swarm.Plane((1.0, 0.0, 0.0), 0.5, laws=[Stays(100.0)])], pairs=laws)
    start = swarm.Particles(places, speeds, np.array([1.0, 2.0]), radius=np.array([0.1, 0.15]), spin=spins)
    result = ran(scene, start, 1.2)
    places[0, 0], speeds[:, 0], spins[:, 0] = 0.4, 0.0, 0.0
    fixed = swarm.Particles(places, speeds, np.array([1e15, 2.0]), radius=start.radius, spin=spins)
    alone = ran(swarm.Scene([], pairs=laws), fixed, 1.2)
    assert result.observables["collisions"][-1] == alone.observables["collisions"][-1] == 1
    for name in ("position", "velocity", "spin"):
        assert getattr(result.particles, name)[:, 1] == pytest.approx(getattr(alone.particles, name)[:, 1], abs=1e-12)
    assert result.particles.spin[:, 0].tolist() == [0.0, 3.0, 1.0]
    assert result.particles.velocity[:, 0].tolist() == [-1.0, 0.0, 0.0]
    lost, lost_alone = (one.observables["dissipated_energy"][-1] for one in (result, alone))
    assert lost == pytest.approx(lost_alone, rel=1e-9)


# --- Beside other capabilities ---------------------------------------------------------------------------


def test_the_log_has_each_blow_on_what_is_held(tmp_path):
    until = 1.5
    result = crowd([Stays(0.4)], impacts=tmp_path / "log.h5", until=until)
    table = swarm.load_impacts(tmp_path / "log.h5").table()
    at_walls, met = table[table["partner"] < 0], table[table["partner"] >= 0]
    assert len(met) == result.observables["collisions"][-1]
    assert len(at_walls) == result.observables["impacts"][-1]
    assert result.observables["impulse"][-1].sum() != pytest.approx(at_walls["impulse"].sum(), rel=1e-3)
    same = (met["velocity_before"] == met["velocity_after"]).all(axis=1)
    held = [is_held(at_walls, one) for one in met]
    assert same.tolist() == held
    assert 0 < same.sum() < len(met)
    assert (met["impulse"] > 0.0).all()


def is_held(at_walls, one):
    since = one["time"] - at_walls["time"][at_walls["particle"] == one["particle"]]
    return bool(((since > 0.0) & (since < 0.4)).any())


def test_counters_see_one_flight_before_and_one_after_a_wait():
    """It flies to a wall, waits, and comes back: out once at 0.25 s, and back once it has waited."""
    wall = swarm.Plane((1.0, 0.0, 0.0), HALF, laws=[Stays(0.5)])
    counter = swarm.Plane((1.0, 0.0, 0.0), 0.25)
    start = swarm.Particles((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), radius=RADIUS)
    result = ran(swarm.Scene([wall]), start, 1.4, every=0.1, counters=[swarm.Counter(counter)])
    crossed = result.observables["crossings"][:, 0]
    assert crossed[:, 0].tolist() == [0] * 3 + [1] * 12
    assert crossed[:, 1].tolist() == [0] * 11 + [1] * 4


def test_a_source_and_an_opening():
    walls = [swarm.Box((HALF,) * 3, laws=[swarm.Sticky(0.2)], openings=[swarm.Sphere(0.3, (0.5, 0.0, 0.0))])]
    source = swarm.Source(swarm.Sphere(0.2), speed=1.0, rate=8.0, radius=0.08)
    result = swarm.simulate(swarm.Scene(walls), None, swarm.Impact(), until=3.0, every=0.5, sources=[source], **OPTIONS)
    seen = result.observables
    assert seen["born"][-1].sum() == len(result.particles) > 10
    assert seen["escaped"][-1] > 2
    assert seen["energy_error"].max() < 1e-13
    assert seen["max_penetration"].max() < 1e-15


def test_a_door_opens_beside_what_is_held():
    """Of a wall that goes its balls leave when they would, and fly on from there."""
    gone = swarm.Plane((1.0, 0.0, 0.0), HALF, laws=[Stays(0.5)], present=[(0.0, 0.6)])
    room = swarm.Plane((1.0, 0.0, 0.0), 5.0)
    start = swarm.Particles((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), radius=RADIUS)
    result = ran(swarm.Scene([gone, room]), start, 1.2, every=0.4)
    assert result.particles.position[0, 0] == pytest.approx(0.4 - 0.3, abs=1e-12)


def test_sessions_threads_and_frames(tmp_path, monkeypatch):
    laws = {"laws": [swarm.Lambert(), swarm.Sticky(0.3)], "gravity": (0.0, 0.0, -2.0), "until": 0.6, **RUBS}
    whole = crowd(**laws)
    again = crowd(**laws, every=0.1, threads=2)
    options = {"trajectory": tmp_path / "run.h5", "resume": True, "checkpoint": 1e3}
    resumed, sessions = in_sessions(monkeypatch, CollidingRun, 10, lambda: crowd(**laws, **options))
    assert sessions > 2
    for one in (again, resumed):
        for name in ("position", "velocity", "spin"):
            assert np.array_equal(getattr(one.particles, name), getattr(whole.particles, name))


def test_it_is_refused_beside_a_wall_with_a_mass():
    start = swarm.Particles((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), radius=0.1)
    piston = swarm.Plane((1.0, 0.0, 0.0), 0.5, mass=1.0)
    scene = swarm.Scene([swarm.Plane((-1.0, 0.0, 0.0), 0.5, laws=[swarm.Sticky(0.1)]), piston])
    with pytest.raises(swarm.SceneError, match=r"surfaces\[0\].laws\[0\] must not let particles with a radius wait"):
        ran(scene, start, 1.0)


def test_what_waits_in_no_trial_may_not_wait_in_a_run():
    scene = swarm.Scene([swarm.Box((1.0,) * 3, laws=[Fast(0.1)])])
    start = swarm.Particles((0.0, 0.0, 0.0), (1e6, 0.0, 0.0), radius=0.1)
    with pytest.raises(swarm.RunError, match="particle 0: one of the laws of a wall lets it wait there"):
        ran(scene, start, 1.0)


class Fast(swarm.WallLaw):
    """Lets those wait that are faster than any in a trial."""

    time: float

    def leave(self, v, n, u, random, mass):
        return swarm.Leave(mirrored(v, n, u), wait=self.time * (v.x * v.x > 1e6))
