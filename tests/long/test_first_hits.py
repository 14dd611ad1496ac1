"""The first hit of 1e5 flights a surface, straight and falling, against the exact first root: none is missed.

What is compared. Every flight is asked as the lanes ask it: `first_hit` of all walls of the surface, again from where
the answer only said that it is free until then. The level along each leg is a polynomial of time, built from the same
doubles with 32 digits (see `roots`); its roots and turning points tell when the flight leaves. An answer is EXACT where
the time is that of the first exit to 1e-12 of itself or of the crossing time; TOUCHED where there is no exit (a double
root, a start on the wall) but the level is 0 to 1e-14 of the size of its terms, there and everywhere before; MISSED
where the flight was outside by more before, and EARLY where it is still inside: of both there must be none.
Of each surface 2000 flights more are judged with fractions, that is without any rounding.

The flights: sizes 1e-6 to 1e6 m, speeds 1e-6 to 1e6 m/s, falls from 1e-3 to 1e3 times as strong as one that crosses the
surface in its crossing time; a third from random places, a third from the wall or 1e-16 to 1e-3 sizes from it at angles
down to 1e-15, a third past a point that touches the wall, or misses it by 1e-15 to 1e-6 sizes.
"""

import itertools
import math
import time as clock
from concurrent.futures import ThreadPoolExecutor
from fractions import Fraction

import numpy as np
import pytest
from conftest import TURN, WALLS
from exact import EARLY, EXACT, MISSED, NEAR, TOUCH, TOUCHED, Course, Terms, exact_course, judge, levels
from roots import Courses, judge_all

import swarm
from swarm.kernel.gravity import Gravity
from swarm.kernel.jit import kernel
from swarm.kernel.vector import column, square, vec
from swarm.serialization import tables
from swarm.surfaces.time_of_impact.flights import first_hit
from swarm.surfaces.walls import all_walls

pytestmark = pytest.mark.long

FLIGHTS = 100_000
EXACTLY = 1000  # straight, and as many falling
SCALES = (1e-6, 1e-3, 1.0, 1e3, 1e6)
# Legs of a flight at most, and sizes from the surface within which it is followed.
LEGS, FAR = 100, 30.0

CENTER = np.array([0.2, -0.3, 0.1])
AXIS = (1.0, 0.5, -1.0)
# Those of the table that differ in more than their side, and what has several walls or stands along an axis.
BODIES = {
    **{name: WALLS[name] for name in ("sphere", "ellipsoid", "rotated ellipsoid", "slab", "pipe", "cylinder", "bowl")},
    **{name: WALLS[name] for name in ("shifted egg", "one sheet", "two sheets", "saddle", "torus", "rotated torus")},
    **{name: WALLS[name] for name in ("capsule", "rod", "formula")},
    "box": lambda s: swarm.Box((0.5 * s, 0.4 * s, 0.3 * s), CENTER * s),
    "rotated box": lambda s: swarm.Box((0.5 * s, 0.4 * s, 0.3 * s), CENTER * s, rotation=TURN),
    "can": lambda s: swarm.Cylinder(0.4 * s, AXIS, 0.9 * s, CENTER * s),
    "cone": lambda s: swarm.Cone(0.6, AXIS, CENTER * s),
    "rotated formula": lambda s: swarm.Formula(
        "(x/a)**2 + (y/b)**2 + (z/c)**4 - 1",
        parameters={"a": 0.5 * s, "b": 0.7 * s, "c": 0.6 * s},
        center=CENTER * s,
        rotation=TURN,
    ),
}
CASES = [("plane", "inside"), *itertools.product(BODIES, ("inside", "outside"))]


def surface_of(name, side, scale):
    """One surface of the table, of this size."""
    if name == "plane":
        return WALLS[name](scale)
    table = {**tables.table_of(BODIES[name](scale)), "side": side}
    return tables.scene_of([table], None).surfaces[0]


# --- Flights ---------------------------------------------------------------------------------------------


def _directions(random, n):
    normal = random.standard_normal((3, n))
    return normal / np.sqrt((normal**2).sum(axis=0))


def _distance(surface, points):
    """phi in lengths, to first order, of the wall farthest behind; above 0 outside of the admissible part."""
    sign, off = -1.0 if surface.is_solid() else 1.0, -math.inf
    with np.errstate(all="ignore"):
        for wall in surface.walls():
            slope = np.sqrt(square(wall.gradient(vec(points))))
            off = np.maximum(off, sign * wall.phi(vec(points)) / slope)
    return off


def _onto(surface, points):
    """Points moved onto the surface, and the unit normals out of the admissible part there."""
    with np.errstate(all="ignore"):
        for _ in range(30):
            slope = surface.gradient(points)
            points = points - surface.phi(points) / (slope**2).sum(axis=0) * slope
        normal = (-1.0 if surface.is_solid() else 1.0) * surface.gradient(points)
        return points, normal / np.sqrt((normal**2).sum(axis=0))


def flights(surface, scale, n, falls, seed):
    """Positions, velocities and accelerations (3, n)."""
    random = np.random.default_rng(seed)
    chosen, have = [], 0
    small = [0.0, 1e-15, -1e-15, 1e-12, -1e-12, 1e-9, -1e-9, 1e-6, -1e-6]
    while have < n:
        points = (CENTER[:, None] + 1.5 * random.uniform(-1.0, 1.0, (3, n)) * 10.0 ** random.uniform(-1, 1, n)) * scale
        speed = 10.0 ** random.uniform(-6.0, 6.0, n)
        along = _directions(random, n)
        pull = np.zeros((3, n))
        if falls:
            pull = _directions(random, n) * speed**2 / scale * 10.0 ** random.uniform(-3.0, 3.0, n)
        kind = random.integers(0, 3, n)
        places, normal = _onto(surface, points)
        tangent = np.cross(normal.T, along.T).T
        tangent /= np.maximum(np.sqrt((tangent**2).sum(axis=0)), 1e-3)
        depth = random.choice([0.0, 0.0, 1e-16, -1e-16, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3], n)
        lean = np.where(random.random(n) < 0.3, random.uniform(-1.0, 1.0, n), random.choice([*small, 1.0, -1.0], n))
        slanted = lean * normal + np.sqrt(1.0 - lean**2) * tangent
        back = scale / speed * 10.0 ** random.uniform(-3.0, 0.3, n)
        aside = places + random.choice(small, n) * scale * normal
        graze = speed * (tangent + random.choice([0.0, 0.0, *small], n) * normal)
        position = np.where(kind == 0, points, places - depth * scale * normal)
        position = np.where(kind == 2, aside - back * graze + 0.5 * back**2 * pull, position)
        velocity = np.where(kind == 0, speed * along, np.where(kind == 1, speed * slanted, graze - back * pull))
        off = _distance(surface, position)
        good = np.isfinite(position).all(axis=0) & np.isfinite(velocity).all(axis=0) & (off <= 4e-16 * scale)
        # The wall itself must have been found, and not an edge.
        good &= (kind == 0) | (np.abs(_distance(surface, places)) <= 1e-13 * scale)
        chosen.append(np.array([position, velocity, pull])[:, :, good])
        have += np.count_nonzero(good)
    return np.concatenate(chosen, axis=2)[:, :, :n]


@kernel
def straight_hits(walls, position, velocity, pull, times, index):
    """`first_hit` of every straight flight."""
    for i in range(times.size):
        times[i], index[i] = first_hit(walls, None, column(position, 0, i), column(velocity, 0, i))


@kernel
def falling_hits(walls, position, velocity, pull, times, index):
    """`first_hit` of every falling flight, each with an acceleration of its own."""
    for i in range(times.size):
        gravity = Gravity(pull[0, i], pull[1, i], pull[2, i])
        times[i], index[i] = first_hit(walls, gravity, column(position, 0, i), column(velocity, 0, i))


# --- Judgement -------------------------------------------------------------------------------------------


def units(scale, velocity, pull):
    """The crossing time of every flight, as a power of 2."""
    speed, fall = np.sqrt((velocity**2).sum(axis=0)), np.sqrt((pull**2).sum(axis=0))
    with np.errstate(divide="ignore"):
        return 2.0 ** np.round(np.log2(np.minimum(scale / speed, np.sqrt(scale / fall))))


def _table(courses, part):
    """One array (flights, polynomials, degree + 1)."""
    degree = max(len(course.parts) for course in courses)
    n = max(np.size(part(one)) for one in courses[0].parts)
    table = np.zeros((n, len(courses), degree))
    for k, course in enumerate(courses):
        for j, one in enumerate(course.parts):
            table[:, k, j] = part(one)
    return table


class Tally:
    """What came of the flights of one surface."""

    def __init__(self):
        self.counts, self.error, self.residual, self.legs, self.aloft = np.zeros(4, np.int64), 0.0, 0.0, 0, 0
        self.unfinished = 0
        self.exactly, self.examples = 0, []
        self.too_early, self.depth, self.late = 0.0, 0.0, 0.0

    def add(self, verdicts, errors, residuals):
        self.counts += np.bincount(verdicts, minlength=4)
        self.error = max(self.error, errors[verdicts == EXACT].max(initial=0.0))
        self.residual = max(self.residual, residuals[verdicts <= TOUCHED].max(initial=0.0))
        self.too_early = max(self.too_early, errors[verdicts == EARLY].max(initial=0.0))
        self.depth = max(self.depth, residuals[verdicts == EARLY].max(initial=0.0))
        self.late = max(self.late, residuals[verdicts == MISSED].max(initial=0.0))


def judged(surface, scale, position, velocity, pull, times, found, tally, seed):
    """Verdicts of the answers to these flights; some of them once more in exact arithmetic."""
    unit = units(scale, velocity, pull)
    moved, half_pull = velocity * unit, 0.5 * pull * unit**2 if pull.any() else None
    walls = surface.walls()
    kind, courses = levels(walls, Courses, position, moved, half_pull)
    _, sizes = levels(walls, Terms, *(None if row is None else np.abs(row) for row in (position, moved, half_pull)))
    high = _table(courses, lambda one: Courses.number(one).high)
    low = _table(courses, lambda one: Courses.number(one).low)
    terms, scaled = _table(sizes, lambda one: one), times / unit
    verdicts, errors, residuals = np.zeros(times.size, np.int64), np.zeros(times.size), np.zeros(times.size)

    def half(part):
        judge_all(
            kind, high[part], low[part], terms[part], scaled[part], found[part], NEAR, TOUCH,
            verdicts[part], errors[part], residuals[part],
        )  # fmt: skip

    middle = times.size // 2
    with ThreadPoolExecutor(2) as pool:
        list(pool.map(half, (slice(0, middle), slice(middle, times.size))))
    tally.add(verdicts, errors, residuals)
    for i in np.flatnonzero(verdicts > TOUCHED)[:3]:
        words = {MISSED: "missed", EARLY: "early"}[int(verdicts[i])]
        tally.examples.append(
            f"{surface!r}: {words}, r={position[:, i].tolist()} v={velocity[:, i].tolist()} g={pull[:, i].tolist()}"
            f" t={times[i]!r} found={bool(found[i])} residual={residuals[i]:.2g}"
        )
    some = np.random.default_rng(seed).permutation(np.flatnonzero(found & np.isfinite(times)))
    for i in some[: EXACTLY // len(SCALES) if times.size > EXACTLY else 0]:
        _judge_exactly(surface, position[:, i], moved[:, i], None if half_pull is None else half_pull[:, i], scaled[i],
                       terms[i], tally)  # fmt: skip


def _judge_exactly(surface, position, velocity, half_pull, time, terms, tally):
    rows = [None if row is None else [Fraction(float(one)) for one in row] for row in (position, velocity, half_pull)]
    kind, courses = levels(surface.walls(), Course, *rows)
    course = exact_course(kind, [course.parts for course in courses], terms, float(time))
    verdict, _error, _residual = judge(*course, float(time), True, NEAR, TOUCH)
    tally.exactly += 1
    if verdict > TOUCHED:
        tally.examples.append(f"exactly: {surface!r} {position} {velocity} {half_pull} {time}")


@pytest.mark.parametrize("falls", [False, True], ids=["straight", "falling"])
@pytest.mark.parametrize(("name", "side"), CASES, ids=lambda part: part)
def test_no_first_hit_is_missed(name, side, falls, capsys):
    began = clock.perf_counter()
    tally = Tally()
    for seed, scale in enumerate(SCALES):
        surface = surface_of(name, side, scale)
        walls = all_walls([surface])
        position, velocity, pull = flights(surface, scale, FLIGHTS // len(SCALES), falls, seed)
        for leg in range(LEGS):
            times, index = np.empty(position.shape[1]), np.empty(position.shape[1])
            (falling_hits if falls else straight_hits)(walls, position, velocity, pull, times, index)
            found = index >= 0.0
            judged(surface, scale, position, velocity, pull, times, found, tally, seed)
            on = ~found & np.isfinite(times)
            tally.legs = max(tally.legs, leg + 1)
            position, velocity, pull, times = position[:, on], velocity[:, on], pull[:, on], times[on]
            position, velocity = position + (velocity + 0.5 * pull * times) * times, velocity + pull * times
            if not times.size:
                break
            # What falls away from a solid is followed to here only.
            near = (abs(position - CENTER[:, None] * scale) < FAR * scale).all(axis=0)
            position, velocity, pull = position[:, near], velocity[:, near], pull[:, near]
            tally.aloft += np.count_nonzero(~near)
        tally.unfinished += position.shape[1]
    exact, touched, missed, early = tally.counts
    with capsys.disabled():
        print(
            f"\n{name + ', ' + side + (', falling' if falls else ''):36}"
            f" {FLIGHTS} flights, {exact:6} exact to {tally.error:.1e}, {touched:5} touched to {tally.residual:.1e},"
            f" {missed} missed ({tally.late:.0e}), {early} early (t {tally.too_early:.0e}, level {tally.depth:.0e});"
            f" {tally.exactly} by fractions, {tally.legs:2} legs, {tally.aloft} fell away,"
            f" {tally.unfinished} unfinished, {clock.perf_counter() - began:.1f} s",
            end="",
        )
    assert not tally.examples, "\n".join(tally.examples)
    assert exact + touched >= FLIGHTS
    assert math.isfinite(tally.error)
