"""The contract of a method: every function that the loops over lanes call, required or derived.

A method is a record for kernels, derived from `MethodNumbers`. A pass is a free flight followed by at most one contact.
Its parts are scalar, branch-free functions of one lane, and the lanes loop over each part separately: short loops keep
more lanes in the processor's window than one long loop (measured on Zen 3: 7.8 instead of 10.3 ns an impact in an
ellipsoid). Contacts that are rare and need loops and branches are left to `hard_pass`.

Required are
    constants and own       the numbers that a lane keeps of its particle for the whole frame,
    land or flight          the way to the next contact: `land` takes the first hit, `flight` finds the contact,
    contact                 the contact in lanes.
Some methods need others:
    hard_pass                       if `flight` or `contact` leaves contacts to it,
    guess, improve, most_sweeps     if a contact has an unknown,
    turn                            if one loop for the whole contact would be too long,
    first_multiplier, next_multiplier, multiplier_sweeps    if the contact has a multiplier.
examples/own_method.py is a complete method.
"""

from typing import Any, NamedTuple

from ..common.status import Status
from ..contact.impulse import LoopRecord
from ..contact.laws import NONE
from ..contact.reflection import ReflectedVelocity
from ..kernel.jit import outlined, select
from ..kernel.record import Record
from ..kernel.vector import ZERO, Vec

# A wall number of at most HARD leaves the contact to `hard_pass`: the wall is HARD - number.
HARD = -2.0
NOT_TURNED = ReflectedVelocity(ZERO, 0.0)


class Lane(NamedTuple):
    """A particle in its lane: the time `remaining` of the frame in the unit of the method, the `hits` in it, and `own`.

    `flown` is the duration of the flight before the contact, if the method `asks_flown`.
    """

    r: Vec
    v: Vec
    remaining: float
    hits: float
    own: Any
    flown: Any = None


class FlightEnd(NamedTuple):
    """The end of a flight. The wall is -1 if no contact follows; `HARD - wall` leaves the contact to `hard_pass`."""

    r: Vec
    v: Vec
    remaining: float
    wall: float


class Solution(NamedTuple):
    """The solve of a contact: its unknown, whether it is unsolved, and the velocity if the method has `turn`."""

    kappa: float
    unsolved: bool
    turned: ReflectedVelocity


NO_RECORD = LoopRecord(0.0, 0.0, 0.0)


class Sweep(NamedTuple):
    """A sweep of the loop: lambda, and the miss of the sweep."""

    multiplier: float
    miss: float


class Contact(NamedTuple):
    """The result of a contact of a lane, with the normal impulse per mass of the wall, and the new impacts.

    For walls with restitution or laws, `twice_energy` is twice the energy per mass after the contact. No observable
    counts the losses of a method itself: losses are for a `WallLaw`. In a method that `holds` particles, `lasts`
    is whether another kernel decides what follows at this wall. For moving walls, `work` is the work of this wall per
    mass.
    """

    r: Vec
    v: Vec
    remaining: float
    wall: float
    impulse: float
    hits: float
    twice_energy: float
    lasts: Any
    work: Any = 0.0


def wall_of(asked):
    """Return the wall at the end of a flight, also if its contact is left to `hard_pass`."""
    return select(asked <= HARD, HARD - asked, asked)


def refused(lane, status):
    """Return a contact that changes nothing and the status with the reason, as a result of `hard_pass`."""
    return Contact(lane.r, lane.v, lane.remaining, 0.0, 0.0, 0.0, 0.0, False), status


class MethodNumbers(Record):
    """A method in the form for kernels."""

    @classmethod
    def gives(cls, name):
        """Whether the class of a method overrides a method of `MethodNumbers`."""
        return getattr(cls, name) is not getattr(MethodNumbers, name)

    # --- The numbers of a lane ---

    def constants(self, mass, energy, scale2):
        """Return three numbers of one particle, which only walls change during a run; `own` gives them names.

        `energy` is its energy per mass, and `scale2` is twice its energy scale per mass, the square of a speed.
        """
        raise NotImplementedError

    def own(self, first, second, third):
        """Return these numbers as the method's own record."""
        raise NotImplementedError

    @property
    def dissipates(self):
        """Whether contacts change the energy; the first constant is then twice the energy per mass."""
        return False

    @property
    def holds(self):
        """Whether a particle may stay on a wall."""
        return False

    def instant(self, v):
        """Return a time [s] in which a particle with this velocity hardly moves; 0 if the method has none."""
        return 0.0

    # Whether a particle moves during a contact: then counters look at contacts too. A constant for the compiler.
    contacts_take_time = False

    def seconds(self, remaining):
        """Return a part of a frame in seconds, from one in the method's unit."""
        return remaining

    @property
    def laws(self):
        """The `Laws` of its walls."""
        return NONE

    @property
    def laws_at_ends(self):
        """The `Laws` that act where a contact ends, in a method with contacts that take time, else None."""
        return

    @property
    def sliding_tolerance(self):
        """The relative error of a crossing by a particle that slides."""
        return 0.0

    def walls_of(self, walls, remaining):
        """Return the walls that `contact` takes: those at the instant when `remaining` is left of the frame.

        A method with steps overrides it, and returns the walls over its step.
        """
        return walls.at(remaining)

    @property
    def steps_into_walls(self):
        """Whether it finds its contacts by steps into walls; the open walls are then decided before each step."""
        return False

    def touched(self, walls, gravity, lane):
        """Return the wall that the next step of such a method touches, as `FlightEnd.wall`."""
        return -1.0

    def at_start(self, walls, remaining):
        """Return the walls at the start of a step, when `remaining` is left of the frame in the method's unit."""
        return walls.at(remaining)

    # Whether `contact` depends on walls other than the one that was met: a constant for the compiler.
    looks_around = False

    # --- Flight ---

    # Whether contacts depend on the duration of the flight before them: a constant for the compiler.
    asks_flown = False

    def flight(self, walls, gravity, lane, hit=None):
        """Return the `FlightEnd` at the next contact or at the end of the frame, in a method that finds its contacts.

        `hit` is the first hit, a `flights.Hit`, if it is known.
        """
        return FlightEnd(lane.r, lane.v, lane.remaining, -1.0)

    def land(self, walls, gravity, lane, hit):
        """Return the `FlightEnd` at the first `hit`, a `flights.Hit`, or at the end of the frame."""
        return FlightEnd(lane.r, lane.v, lane.remaining, -1.0)

    @property
    def lands(self):
        """Whether the method has a `land`."""
        return self.gives("land")

    def landed_on(self, walls):
        """The walls of the first hits for `land`; None in a method that has `flight`."""
        return walls if self.lands else None

    # --- The unknown of a contact ---

    def guess(self, walls, gravity, lane, wall):
        """Return the first guess of the contact's unknown kappa, and whether the lane has one to solve for."""
        return 0.0, False

    def improve(self, walls, gravity, lane, wall, solution, multiplier):
        """Make one sweep of the solve; return (kappa, unsolved, LoopRecord). A solved lane keeps its bits."""
        return solution.kappa, False, NO_RECORD

    def most_sweeps(self, walls):
        """The most sweeps of `improve` a contact may take: a constant for the compiler."""
        return 0

    @property
    def solves(self):
        """The method itself if it has a `guess`, else None: contacts have a closed form, and no solver is compiled."""
        return self if self.gives("guess") else None

    def turn(self, walls, gravity, lane, wall, kappa):
        """Return the `ReflectedVelocity` for `contact`, if one loop for both would be too long."""
        return NOT_TURNED

    @property
    def turns(self):
        """Whether the method has a `turn`."""
        return self.gives("turn")

    # --- Uzawa's loop (8) around it ---

    def first_multiplier(self, walls, gravity, lane, wall, kappa):
        """Return (the first multiplier of the loop, its kappa, the acceleration of the loop)."""
        return 0.0, kappa, 0.0

    def next_multiplier(self, lane, acceleration, multiplier, record, before):
        """Return (the multiplier after a sweep, its miss, whether the loop goes on); `before` is the last `Sweep`."""
        return 0.0, 0.0, False

    @property
    def multiplier_sweeps(self):
        """The most sweeps of the loop."""
        return 0

    # --- Contact ---

    def contact(self, walls, gravity, lane, wall, solution):
        """Return the `Contact` with this wall.

        Return a wall that is HARD already as it is, and change nothing else. To leave the contact to `hard_pass`,
        return `HARD - wall`. An unsolved solution was not found, or its multiplier did not converge.
        """
        raise NotImplementedError

    @outlined
    def hard_pass(self, walls, gravity, lane, wall, lanes, i):
        """Return the `Contact` that `flight` or `contact` left to this function, and its status.

        Add to `lanes.impulse[wall, i]`, and write the sweeps of a multiplier loop to `lanes.record[:, i]`. In a
        method with steps into walls it has no new impacts: these are counted from the impulses of all walls.
        """
        return refused(lane, Status.STALLED.value)
