"""The contract of a method: every function that the loops over lanes call, required or derived.

A method is a record for kernels, derived from `MethodNumbers`. A pass is a free flight followed by at most one contact.
Its parts are scalar, branch-free functions of one lane, and the lanes loop over each part separately: short loops keep
more lanes in the processor's window than one long loop (measured on Zen 3: 7.8 instead of 10.3 ns an impact in an
ellipsoid). Contacts that are rare and need loops and branches are left to `hard_pass`.

Required are
    constants and own       what a lane keeps of its particle for the whole frame,
    land or flight          the way to the next contact: `land` is given the first hit, `flight` finds the contact,
    contact                 the contact in lanes.
Others are needed by some methods:
    hard_pass                       if `flight` or `contact` leaves contacts to it,
    guess, improve, most_sweeps     if a contact has an unknown,
    turn                            if one loop for all of a contact would be too long,
    first_multiplier, next_multiplier, multiplier_sweeps    if it has a multiplier.
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

# The number of a wall up to this one leaves the contact to `hard_pass`: the wall is HARD - number.
HARD = -2.0
NOT_TURNED = ReflectedVelocity(ZERO, 0.0)


class Lane(NamedTuple):
    """One particle under way: `remaining` of the frame in the method's unit, the `hits` in it, the record `own`.

    `flown` is the duration of the flight before the contact, in a method that `asks_flown`.
    """

    r: Vec
    v: Vec
    remaining: float
    hits: float
    own: Any
    flown: Any = None


class FlightEnd(NamedTuple):
    """The end of a flight. The wall is -1 where no contact follows; `HARD - wall` leaves the contact to `hard_pass`."""

    r: Vec
    v: Vec
    remaining: float
    wall: float


class Solution(NamedTuple):
    """The solve of a contact: its unknown, whether it is unsolved, and the velocity where the method has `turn`."""

    kappa: float
    unsolved: bool
    turned: ReflectedVelocity


NO_RECORD = LoopRecord(0.0, 0.0, 0.0)


class Sweep(NamedTuple):
    """A sweep of the loop: lambda, and by how much the sweep missed."""

    multiplier: float
    miss: float


class Contact(NamedTuple):
    """The result of a contact of a lane, with the normal impulse per mass that the wall gave, and new impacts.

    Where walls have a restitution or laws, `twice_energy` is twice the energy per mass that is left. No observable
    counts what a method itself loses: losses are for a `WallLaw`. In a method that `holds` particles on walls, `lasts`
    is whether another kernel decides what follows at this wall. Where walls move, `work` is the work of this wall per
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
    """The wall of the end of a flight, also where its contact is left to `hard_pass`."""
    return select(asked <= HARD, HARD - asked, asked)


def refused(lane, status):
    """(a contact that changes nothing, the status that says why): a result of `hard_pass`."""
    return Contact(lane.r, lane.v, lane.remaining, 0.0, 0.0, 0.0, 0.0, False), status


class MethodNumbers(Record):
    """A method as kernels take it."""

    @classmethod
    def gives(cls, name):
        """Whether the class of a method overrides a method of `MethodNumbers`."""
        return getattr(cls, name) is not getattr(MethodNumbers, name)

    # --- What a lane keeps ---

    def constants(self, mass, energy, scale2):
        """Three numbers of one particle, which only walls change during a run; `own` gives them names.

        `energy` is its energy per mass, and `scale2` twice its energy scale per mass, the square of a speed.
        """
        raise NotImplementedError

    def own(self, first, second, third):
        """These numbers as the method's own record."""
        raise NotImplementedError

    @property
    def dissipates(self):
        """Whether contacts change the energy; the first constant is then twice the energy per mass."""
        return False

    @property
    def holds(self):
        """Whether a particle may stay on a wall: its numbers are `Held`."""
        return False

    def instant(self, v):
        """A time [s] in which a particle with this velocity hardly moves; 0 if the method does not say."""
        return 0.0

    # Whether a particle moves during a contact: then counters look at contacts too. A constant for the compiler.
    contacts_take_time = False

    def seconds(self, remaining):
        """A part of a frame in seconds, from one in the method's unit."""
        return remaining

    @property
    def laws(self):
        """The `Laws` of its walls."""
        return NONE

    @property
    def laws_at_ends(self):
        """The `Laws` that act where a contact ends, in a method with contacts that take time; else None."""
        return

    @property
    def sliding_tolerance(self):
        """The relative error of a crossing by a particle that slides."""
        return 0.0

    def walls_of(self, walls, remaining):
        """The walls that `contact` takes: those at the instant with so much of the frame left.

        A method with steps overrides it, and takes the walls over its step.
        """
        return walls.at(remaining)

    @property
    def steps_into_walls(self):
        """Whether it finds its contacts by steps into walls; before each step it is decided which walls are open."""
        return False

    def touched(self, walls, gravity, lane):
        """The wall that the next step of such a method touches, as `FlightEnd.wall`."""
        return -1.0

    def at_start(self, walls, remaining):
        """The walls at the start of that step, with so much of the frame left in the method's unit."""
        return walls.at(remaining)

    # Whether `contact` depends on other walls than the one that was met: a constant for the compiler.
    looks_around = False

    # --- Flight ---

    # Whether contacts depend on the duration of the flight before them: a constant for the compiler.
    asks_flown = False

    def flight(self, walls, gravity, lane, hit=None):
        """The `FlightEnd` at the next contact, or at the end of the frame, in a method that finds its contacts.

        `hit` is the first hit, a `flights.Hit`, where that is known.
        """
        return FlightEnd(lane.r, lane.v, lane.remaining, -1.0)

    def land(self, walls, gravity, lane, hit):
        """The `FlightEnd` at the first `hit`, a `flights.Hit`, or at the end of the frame."""
        return FlightEnd(lane.r, lane.v, lane.remaining, -1.0)

    @property
    def lands(self):
        """Whether the method has a `land`."""
        return self.gives("land")

    def landed_on(self, walls):
        """The walls with the first hits for `land`; None in a method that has `flight`."""
        return walls if self.lands else None

    # --- The unknown of a contact ---

    def guess(self, walls, gravity, lane, wall):
        """First guess of the contact's unknown kappa, and whether the lane has one to solve for."""
        return 0.0, False

    def improve(self, walls, gravity, lane, wall, solution, multiplier):
        """One sweep of the solve: (kappa, unsolved, LoopRecord). A lane that is solved keeps its bits."""
        return solution.kappa, False, NO_RECORD

    def most_sweeps(self, walls):
        """The most sweeps of `improve` a contact may take: a constant for the compiler."""
        return 0

    @property
    def solves(self):
        """The method itself if it has a `guess`, else None: contacts have a closed form, and no solver is compiled."""
        return self if self.gives("guess") else None

    def turn(self, walls, gravity, lane, wall, kappa):
        """The `ReflectedVelocity` that `contact` is given, where one loop for both would be too long."""
        return NOT_TURNED

    @property
    def turns(self):
        """Whether the method has a `turn`."""
        return self.gives("turn")

    # --- Uzawa's loop (8) around it ---

    def first_multiplier(self, walls, gravity, lane, wall, kappa):
        """(the multiplier that the loop starts from, its kappa, the acceleration of the loop)."""
        return 0.0, kappa, 0.0

    def next_multiplier(self, lane, acceleration, multiplier, record, before):
        """(the multiplier after a sweep, its miss, whether the loop goes on); `before` is the last `Sweep`."""
        return 0.0, 0.0, False

    @property
    def multiplier_sweeps(self):
        """The most sweeps of the loop."""
        return 0

    # --- Contact ---

    def contact(self, walls, gravity, lane, wall, solution):
        """The `Contact` with this wall.

        A wall that is HARD already is returned as it is, and nothing else changes. To leave the contact to `hard_pass`,
        return `HARD - wall`. A solution that is unsolved was not found, or its multiplier did not converge.
        """
        raise NotImplementedError

    @outlined
    def hard_pass(self, walls, gravity, lane, wall, lanes, i):
        """The `Contact` that `flight` or `contact` left to this function, and its status.

        Adds to `lanes.impulse[wall, i]`, and writes the sweeps of a multiplier loop into `lanes.record[:, i]`. In a
        method of steps into walls it has no new impacts: these are counted from the impulses of all walls.
        """
        return refused(lane, Status.STALLED.value)
