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
    links: int  # the number of rigid rows
    springs: int  # the number of springs, and of links that multipliers hold
    relaxed: int  # the number of these links, which come after the springs
    rest: Any  # (L,) |y|^2 of a link and of an edge without stress, the rest length of a spring
    stiffness: Any  # (L,) the stiffness of springs
    give: Any  # (L,) 8 l^2/alpha of relaxed links
    compliance: Any  # (E, E) 2/K of the edges
    start: Any  # (L + G,) the first column of each row of the system that is not 0; guides come after the ties
    inverse_mass: Any  # (P, P) W = 1/M, without rows and columns of fixed points
    mass: Any  # (P, P) M
    is_diagonal: bool
    is_free: Any  # (P,) whether a point can move
    led: Any  # (P,) the row of its path, -1 for a point that is not led
    couplings: Any  # (L + K + G + C, L + K + G + C) b W b of ties, with b = +1 at a and -1 at b, then of contact points


class Touching(NamedTuple):
    """The points that may touch walls, and the restitution, friction and laws of the walls.

    First come K contact points, which meet every wall of the scene, then G guided points, and C points in cavities that
    a point carries. The surfaces of guides and cavities are walls with numbers after those of the scene.
    """

    coefficients: Any  # (K + G + C, P) b of c = sum b_p r_p; in a cavity relative to its carrier
    plain: Any  # (K + G + C,) the number of the base point, -1 for a combination of several
    reach: Any  # (K + G + C, P) W b
    points: int  # K
    walls: int  # the number of walls of the scene
    guides: int  # G
    restitution: Any  # (walls + G + C,)
    friction: Any  # (walls + G + C,)
    is_dissipative: bool  # whether any wall takes energy
    laws: Any = None  # the `Laws` of the walls of the scene if one sends bodies off
    seeding: Any = None  # the `Seeding` of these laws

    def place(self, r, k, i):
        """The place of contact point k of a lane, or its velocity if r has velocities."""
        q = self.plain[k]
        if q >= 0:
            return column(r, 3 * q, i)
        c = ZERO
        for p in range(self.coefficients.shape[1]):
            c = c + self.coefficients[k, p] * column(r, 3 * p, i)
        return c

    def span(self, k):
        """The walls that a contact point can meet: from `first` to before `last`."""
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
        """The number of directions of each contact: 1, the normal, or 3, with tangents, if there is friction."""
        rough = False
        for a in range(found):
            rough = rough or self.friction[name[a, 1]] > 0.0
        return 3 if rough else 1


class StepRule(NamedTuple):
    """The rule of a step."""

    dt: float
    stages: Any  # (S,) lengths of the stages of a composed step, in units of the step
    gravity: Any  # (3,)
    end: float  # the end of the frame [s]
    room: float  # round-off of a position on a wall [m]
    noise: float  # relative round-off of |y|^2 of the shortest tie
    lanes: int  # the number of bodies in lanes
    walls: Any  # None for rigid walls, else `Soft`
    most: int  # the most contacts of a body at a time
    loop: bool  # whether multipliers are found by Uzawa's loop
    strict: bool  # whether a loop that does not converge ends the run
    period: Any = None  # `Period` of the cell, or None


class BodyState(NamedTuple):
    """The state of all copies."""

    position: Any  # (3, P, n)
    velocity: Any  # (3, P, n)
    remaining: Any  # (n,) the rest of the frame [s]
    guess: Any  # (3, L + G, n) multipliers of the last three steps, NaN until the first step after a blow
    path: Any  # (A, 13, n) the paths of led points: start, velocity, cosine, sine, rate
    short: Any  # (n,) consecutive short steps between impacts
    lasting: Any  # (n,) int8, whether a contact lasts
    impacts: Any  # (n,)
    impulse: Any  # (walls, n) [N s]
    dissipated: Any  # (n,) [J]
    work: Any  # (n,) of led points on the body, and of moving walls [J]
    sliding: Any  # (n,) [s]
    steps: Any  # (n,)
    sweeps: Any  # (n,) of Uzawa's loop
    unconverged: Any  # (n,) steps with a loop that did not converge
    energy: Any  # (n,) at the start of the run [J]
    free: Any = None  # (K, n) int8, whether a contact point has passed an opening; None without openings
    escape_time: Any = None  # (n,) when the last contact point of a body had passed [s], NaN of bodies inside
    wall_work: Any = None  # (walls, n) the work of each wall [J], a part of `work`; None if no wall moves
    heat: Any = None  # (walls, n) the heat given by laws [J], a part of `work`; None if no law gives heat
    absorbed_time: Any = None  # (n,) when a wall absorbed each body [s], NaN of others; None if no wall absorbs
    absorbed_wall: Any = None  # (n,) int32, the number of this wall, -1 of other bodies
    # The observers of impacts and steps, and the arrays of counters:
    watchers: Any = Watchers()  # of the thread
    mass: Any = None  # (n,) the mass of each body [kg]
    crossed: Any = None  # `Crossed`, or None without counters
    image: Any = None  # (3, n) the cell of each body, or None

    def count_impact(self, number, wall):
        """Count an impact of a body on a soft wall."""
        self.impacts[number] += 1
        if self.watchers.counts is not None:
            self.watchers.counts.add(wall, 1)


class BodyLanes(NamedTuple):
    """The lanes of a thread, one body each: arrays with three rows for each point, and for each tie and guide."""

    r: Any  # (3 P, B) at the start of the step
    v: Any
    ra: Any  # at the start of the stage
    va: Any
    p: Any  # the end of the stage without ties
    r1: Any  # at the end of the stage
    v1: Any
    force: Any  # (3 P, B) deceleration by the ties
    y0: Any  # (3 M, B) of every tie and guide, M = L + G, at the start of the stage
    y1: Any  # at its end
    d: Any  # discrete gradient: y0 + y1 of |y|^2, a unit vector of a guide
    a: Any  # (M, M, B) system of the multipliers, factored
    f: Any  # (M, B) the right side of the system
    soft: Any  # (M, B) the diagonal of springs and relaxed links
    multiplier: Any  # (M, B)
    recent: Any  # (M, B) multipliers of the last step
    before: Any  # (M, B) multipliers of the last step but one
    older: Any  # (M, B) multipliers of the last step but two; NaN if there was no step since the last blow
    offset: Any  # (M or 0, B) 4 l lambda/alpha of relaxed links


def shapes_of_lanes(points, rows, offsets, count):
    """The shape of each array of `BodyLanes`."""
    tied = (3 * rows, count)
    return (*8 * ((3 * points, count),), tied, tied, tied, (rows, rows, count), *6 * ((rows, count),), (offsets, count))


class LaneNumbers(NamedTuple):
    """The numbers of each lane, (B,)."""

    remaining: Floats  # the rest of the frame [s]
    step: Floats  # the step that is tried [s]
    h: Floats  # the length of the stage [s]
    begun: Floats  # the part of the step before the stage [s]
    error: Floats  # the largest error of a tie
    lag: Floats  # the sum of squares of the last change of D [m^2]
    previous: Floats  # the error before the last correction
    rate: Floats  # the estimate by which a correction shrinks the error
    residue: Floats  # the error of the equations of ties and guides, in units of round-off
    unsettled: Floats  # the error of the equations of ties, guides and contacts, in the same units
    trial: Floats  # the length to try [s]; 0: a whole step
    low: Floats  # the lower end of the bracket of the time of impact [s]
    high: Floats  # its upper end [s]
    inside: Floats  # the largest gap of a contact at the lower end of the bracket [m], below 0
    outside: Floats  # the largest gap at its upper end [m]
    done: Flags  # whether the ties of this stage are solved, or put off
    last: Flags  # whether the ties of this stage are solved after this correction
    solved: Flags  # whether the ties of all stages are solved
    out: Flags  # whether a point is outside
    body: Counts  # the number of the body, -1 for none
    point: Counts  # the point of the impact, -1 for none
    wall: Counts  # the wall of the impact, -1 for none
    stuck: Counts  # the trials since the last step
    action: Counts  # the action after the trial, see impact_time.py
    lasts: Flags  # whether a contact lasts
    active: Counts  # the number of lasting contacts
    fresh: Flags  # whether the step begins
    whole: Flags  # whether the step is one stage
    work: Floats  # the work of led points and of moving walls in the step [J]
    waits: Counts  # how often the solution of this step was put off to the next pass
    turns: Counts  # the sweeps of Uzawa's loop in this step
    ease: Floats  # the inverse penalty relative to that of a whole step, as a short step needs a stiffer penalty
    loops: Flags  # whether the loop goes on
    loose: Flags  # whether the loop ended above its tolerance
    brief: Flags  # whether no force acts in this step, see sticking.py


# The type of each array of `LaneNumbers`.
PACES = tuple(
    {Floats: np.float64, Flags: np.bool_, Counts: np.int64}[kind] for kind in LaneNumbers.__annotations__.values()
)


class HeldContacts(NamedTuple):
    """The lasting contacts of each lane, at most C of them; with soft walls all contacts."""

    name: Counts  # (B, C, 2) point and wall
    frame: Floats  # (B, 2 C, 3, 3) normal and two tangents, then those with which every trial of a step begins
    press: Floats  # (B, 6 C) force along each direction [N], in the same order; more arrays take 1.4 times as long
    before: Floats  # (B, 3 C) forces of the step before, NaN if that step had other contacts
    impulse: Floats  # (B, C) impulse of the step [N s]
    work: Floats  # (B, C) work of the wall in the step [J]
    stages: Counts  # (B, C) the number of stages of the step in which the contact pushes
    lost: Floats  # (B,) energy lost to friction in the step [J]
    multiplier: Floats  # (B, C) lambda of soft walls


def arrays_of_held(lanes, most):
    """The shape and the type of each array of `HeldContacts`."""
    whole, real, some = np.int64, np.float64, (lanes, most)
    return (
        ((lanes, most, 2), whole), ((lanes, 2 * most, 3, 3), real), ((lanes, 6 * most), real),
        ((lanes, 3 * most), real), (some, real), (some, real), (some, whole), (lanes, real), (some, real),
    )  # fmt: skip
