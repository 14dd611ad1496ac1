"""The arrays of kernels of bodies: the body, the rule of a step, the state of all copies, and the lanes."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...kernel.vector import ZERO, column
from ...lanes.watching.watchers import Watchers
from ...state import Floats

Flags = NDArray[np.bool_]
Counts = NDArray[np.int64]


class Ties(NamedTuple):
    """The ties between the points of a body: rows of links, then of springs, then of edges of the elastic strain.

    The vector of a row is y = r_a - r_b.
    """

    ends: Any  # (L, 2) the points a, b
    links: int  # how many of the rows are rigid
    springs: int  # how many are springs, or links that multipliers hold
    relaxed: int  # how many of these are such links, which come after the springs
    rest: Any  # (L,) |y|^2 of a link and of an edge without stress, the rest length of a spring
    stiffness: Any  # (L,) of springs
    give: Any  # (L,) 8 l^2/alpha of relaxed links
    compliance: Any  # (E, E) 2/K of the edges
    start: Any  # (L + G,) the first column of each row of the system that is not 0; guides come after the ties
    inverse_mass: Any  # (P, P) W = 1/M, without rows and columns of points that are fixed
    mass: Any  # (P, P) M
    is_diagonal: bool
    is_free: Any  # (P,) whether a point can move
    led: Any  # (P,) the row of its path, -1 for a point that is not led
    couplings: Any  # (L + K + G + C, the same) b W b of ties, where b is +1 at a and -1 at b, then of contact points


class Touching(NamedTuple):
    """The points that may touch walls, and what walls do to them.

    First K contact points, which meet every wall of the scene; then G points in guides and C in cavities that a point
    carries, each at a surface of its own, the walls after those of the scene.
    """

    coefficients: Any  # (K + G + C, P) b of c = sum b_p r_p; of a cavity relative to its carrier
    plain: Any  # (K + G + C,) the base point that it is, -1 for a combination of several
    reach: Any  # (K + G + C, P) W b
    points: int  # K
    walls: int  # of the scene
    guides: int  # G
    restitution: Any  # (walls + G + C,)
    friction: Any  # (walls + G + C,)
    is_dissipative: bool  # whether any wall is
    laws: Any = None  # `Laws` of the walls of the scene where one sends bodies off
    random: Any = None  # and `RandomSource` of these

    def place(self, r, k, i):
        """The place of contact point k of a lane, or with velocities its velocity."""
        q = self.plain[k]
        if q >= 0:
            return column(r, 3 * q, i)
        c = ZERO
        for p in range(self.coefficients.shape[1]):
            c = c + self.coefficients[k, p] * column(r, 3 * p, i)
        return c

    def span(self, k):
        """The walls that a contact point can meet: from the first to the one before the last."""
        own = k - self.points
        first = 0 if own < 0 else self.walls + own
        last = self.walls if own < 0 else first + (1 if own >= self.guides else 0)
        return first, last

    def dissipates(self, wall):
        """Whether a wall takes energy: one with friction, or with a restitution below 1."""
        return self.friction[wall] > 0.0 or self.restitution[wall] < 1.0

    def dissipate(self, name, found):
        """Whether any of these contacts is at a wall that takes energy."""
        takes = False
        for a in range(found):
            takes = takes or self.dissipates(name[a, 1])
        return takes

    def width(self, name, found):
        """The number of directions of each contact: the normal, or the tangents too, where there is friction."""
        rough = False
        for a in range(found):
            rough = rough or self.friction[name[a, 1]] > 0.0
        return 3 if rough else 1


class StepRule(NamedTuple):
    """The rule of a step."""

    dt: float
    stages: Any  # (S,) lengths of the stages of a composed step, in units of the step
    gravity: Any  # (3,)
    end: float  # of the frame [s]
    room: float  # round-off of a position on a wall [m]
    noise: float  # round-off of |y|^2 of the shortest tie, relative
    lanes: int  # how many bodies at once
    walls: Any  # None: they are rigid and strike; `Soft`: they are springs
    most: int  # contacts of a body at once
    loop: bool  # whether multipliers are found by Uzawa's loop
    strict: bool  # whether one that does not converge ends the run
    period: Any = None  # `Period` of the cell, where the scene repeats


class BodyState(NamedTuple):
    """All copies."""

    position: Any  # (3, P, n)
    velocity: Any  # (3, P, n)
    remaining: Any  # (n,) of the frame [s]
    guess: Any  # (3, L + G, n) multipliers of the last three steps, NaN until the first step after a blow
    path: Any  # (A, 13, n) of led points: start, velocity, cosine, sine, rate
    short: Any  # (n,) short steps between impacts, one after the other
    lasting: Any  # (n,) int8, whether a contact lasts
    impacts: Any  # (n,)
    impulse: Any  # (walls, n) [N s]
    dissipated: Any  # (n,) [J]
    work: Any  # (n,) of led points on what is tied to them, and of walls that move [J]
    sliding: Any  # (n,) [s]
    steps: Any  # (n,)
    sweeps: Any  # (n,) of Uzawa's loop
    unconverged: Any  # (n,) steps with a loop that did not
    energy: Any  # (n,) at the start of the run [J]
    free: Any = None  # (K, n) int8, whether a contact point has passed an opening; None without openings
    escape_time: Any = None  # (n,) when the last one of a body has [s], NaN of bodies that are inside
    wall_work: Any = None  # (walls, n) of each wall [J], a part of `work`; None where none moves
    heat: Any = None  # (walls, n) that each wall gave by its laws [J], a part of `work`; None where none gives any
    absorbed_time: Any = None  # (n,) when a wall absorbed each body [s], NaN of the others; None where none does
    absorbed_wall: Any = None  # (n,) int32, the number of that wall, -1 of the others
    # What observes impacts and steps, and what counters write to:
    watchers: Any = Watchers()  # of the thread
    mass: Any = None  # (n,) of each body [kg]
    crossed: Any = None  # `Crossed`, where there are counters
    image: Any = None  # (3, n) how many cells away each body is, where the scene repeats

    def count_impact(self, number, wall):
        """Count an impact of a body on a wall that is a spring."""
        self.impacts[number] += 1
        if self.watchers.counts is not None:
            self.watchers.counts.add(wall, 1)


class BodyLanes(NamedTuple):
    """The bodies that a thread advances at once: three rows for each point, and for each tie and guide."""

    r: Any  # (3 P, B) at the start of the step
    v: Any
    ra: Any  # at the start of the stage
    va: Any
    p: Any  # where the stage would end without ties
    r1: Any  # at its end
    v1: Any
    force: Any  # (3 P, B) deceleration by the ties
    y0: Any  # (3 M, B) of every tie and guide, M = L + G, at the start of the stage
    y1: Any
    d: Any  # discrete gradient: y0 + y1 of |y|^2, a unit vector of a guide
    a: Any  # (M, M, B) system of the multipliers, factored
    f: Any  # (M, B) its right side
    soft: Any  # (M, B) of springs and relaxed links: its diagonal
    multiplier: Any  # (M, B)
    recent: Any  # (M, B) multipliers of the last step
    before: Any  # (M, B) of the one before
    older: Any  # (M, B) and before that; NaN: no step since the last blow
    offset: Any  # (M or 0, B) 4 l lambda/alpha of relaxed links


def shapes_of_lanes(points, rows, offsets, count):
    """The shape of each array of `BodyLanes`."""
    tied = (3 * rows, count)
    return (*8 * ((3 * points, count),), tied, tied, tied, (rows, rows, count), *6 * ((rows, count),), (offsets, count))


class LaneNumbers(NamedTuple):
    """Numbers of each lane, (B,)."""

    remaining: Floats  # of the frame [s]
    step: Floats  # the step that is tried [s]
    h: Floats  # of the stage [s]
    begun: Floats  # of the step, before the stage [s]
    error: Floats
    lag: Floats  # by how much D changed when it followed last: the sum of squares [m^2]
    previous: Floats  # error
    rate: Floats
    residue: Floats  # of the equations of ties and guides, in units of round-off
    unsettled: Floats  # of those of contacts too
    trial: Floats  # length to try [s]; 0: a whole step
    low: Floats  # bracket of the time of impact [s]
    high: Floats
    inside: Floats  # gap of the bracket's lower end [m], by how much the worst contact is inside
    outside: Floats  # and of its upper end
    done: Flags  # the ties of this stage are solved, or put off
    last: Flags  # after this correction
    solved: Flags  # of all stages
    out: Flags  # a point is outside
    body: Counts  # number of the body, -1 for none
    point: Counts  # the point of the impact, -1 for none
    wall: Counts
    stuck: Counts  # trials since the last step
    action: Counts
    lasts: Flags  # a contact lasts
    active: Counts  # contacts that do
    fresh: Flags  # the step begins
    whole: Flags  # the step is one stage
    work: Floats  # of led points and of walls that move in the step [J]
    waits: Counts  # how often the solution of this step was put off to the next pass
    turns: Counts  # sweeps of Uzawa's loop in this step
    ease: Floats  # by how much its penalty is softer than that of this step: a short one needs a stiffer one
    loops: Flags  # it goes on
    loose: Flags  # it ended above its tolerance
    brief: Flags  # no force acts in this step, see sticking.py


# The type of each array of `LaneNumbers`.
PACES = tuple(
    {Floats: np.float64, Flags: np.bool_, Counts: np.int64}[kind] for kind in LaneNumbers.__annotations__.values()
)


class HeldContacts(NamedTuple):
    """The contacts of each lane that last, at most C of them; of walls that are springs all."""

    name: Counts  # (B, C, 2) point and wall
    frame: Floats  # (B, 2 C, 3, 3) normal and two tangents; behind them those with which every trial of a step begins
    press: Floats  # (B, 6 C) force along each [N], and likewise; more arrays make a step 1.4 times as long
    before: Floats  # (B, 3 C) and in the step before, NaN if that step had other contacts
    impulse: Floats  # (B, C) of the step [N s]
    work: Floats  # (B, C) of its wall in the step [J]
    stages: Counts  # (B, C) in how many stages of the step it pushes
    lost: Floats  # (B,) to friction in the step [J]
    multiplier: Floats  # (B, C) lambda of walls that are springs


def arrays_of_held(lanes, most):
    """The shape and the type of each array of `HeldContacts`."""
    whole, real, some = np.int64, np.float64, (lanes, most)
    return (
        ((lanes, most, 2), whole), ((lanes, 2 * most, 3, 3), real), ((lanes, 6 * most), real),
        ((lanes, 3 * most), real), (some, real), (some, real), (some, whole), (lanes, real), (some, real),
    )  # fmt: skip
