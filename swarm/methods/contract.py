"""The contract of a method: every function that the loops over lanes ask of one, required or derived.

A method is a record for kernels, derived from `MethodNumbers`. A pass is a free flight followed by at
most one contact. Its parts are scalar, branch-free functions of one lane, and the lanes loop over each part separately:
short loops keep more lanes in the processor's window than one long loop (measured on Zen 3: 7.8 instead of 10.3 ns an
impact in an ellipsoid). What is rare and needs loops and branches is left to `hard_pass`.

Required are
    constants and own       what a lane keeps of its particle for the whole frame,
    land or flight          the way to the next contact: from the first hit, which is found before, or by itself,
    contact                 the contact in lanes.
A method has `hard_pass` too if its `flight` or `contact` leaves contacts to it; one with an unknown in its contact has
`guess`, `improve` and `most_sweeps`, one that is too long for a loop `turn`, and one with a multiplier the three
functions of Uzawa's loop. examples/own_method.py is a complete method.
"""

from typing import Any, NamedTuple

from ..common.status import Status
from ..contact.impulse import LoopRecord
from ..contact.laws import NONE
from ..contact.reflection import ReflectedVelocity
from ..kernel.jit import outlined, select
from ..kernel.record import Record
from ..kernel.vector import ZERO, Vec

# A wall's number this low asks for `hard_pass`: HARD - wall is the wall.
HARD = -2.0
NOT_TURNED = ReflectedVelocity(ZERO, 0.0)


class Lane(NamedTuple):
    """One particle under way: what is left of its frame in the method's unit, its impacts in it, what it keeps.

    `flown` is how long the flight was that ended at the contact, of a method that `asks_flown`.
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
    """Lambda, what its sweep missed by, of this sweep of the loop or of the one before."""

    multiplier: float
    miss: float


class Contact(NamedTuple):
    """The result of a contact of a lane, with the normal impulse per mass that the wall gave, and new impacts.

    Where walls have a restitution or laws, twice_energy is twice the energy per mass that is left. What a method itself
    loses is in no book: losses are for a `WallLaw`. Where a method `holds`
    particles on walls, `lasts` says that another kernel decides what follows, at this wall. Where walls move, `work` is
    what this wall gave by its motion, per mass.
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
    """A contact that is not taken, for this reason: a result of `hard_pass`."""
    return Contact(lane.r, lane.v, lane.remaining, 0.0, 0.0, 0.0, 0.0, False), status


class MethodNumbers(Record):
    """A method as kernels take it."""

    @classmethod
    def gives(cls, name):
        """Whether a method has a definition of its own."""
        return getattr(cls, name) is not getattr(MethodNumbers, name)

    # --- What a lane keeps ---

    def constants(self, mass, energy, scale2):
        """Three numbers of one particle that hold for the whole run but for what walls do; `own` gives them names.

        `scale2` is the square of the speed that its energy scale is that of.
        """
        raise NotImplementedError

    def own(self, first, second, third):
        """These numbers as the method's own record."""
        raise NotImplementedError

    @property
    def dissipates(self):
        """Whether contacts change the energy: then the first constant is twice the energy per mass, and changes."""
        return False

    @property
    def holds(self):
        """Whether a particle may stay on a wall: its numbers are `Held`."""
        return False

    def instant(self, v):
        """A time [s] in which a particle of this velocity gets nowhere; 0 where the method does not say."""
        return 0.0

    # Whether a particle moves during a contact: then counters look at contacts too. A constant for the compiler.
    contacts_take_time = False

    def seconds(self, remaining):
        """A part of a frame [s], given in the method's unit."""
        return remaining

    @property
    def laws(self):
        """The `Laws` of its walls."""
        return NONE

    @property
    def laws_at_ends(self):
        """The `Laws` of its walls that act where a contact ends, of a method of contacts that take time; or None."""
        return

    @property
    def sliding_tolerance(self):
        """The relative error of a crossing, of a particle that slides."""
        return 0.0

    def walls_of(self, walls, remaining):
        """The walls of a scene as `contact` takes them, with so much of the frame left: those at this instant.

        A method of steps takes all there are, to ask them over its step.
        """
        return walls.at(remaining)

    @property
    def steps_into_walls(self):
        """Whether it finds its contacts by steps into walls: then it is decided before each which walls are open."""
        return False

    def touched(self, walls, gravity, lane):
        """The wall that the next step of such a method touches, as the `FlightEnd` has it."""
        return -1.0

    def at_start(self, walls, remaining):
        """The walls at the start of that step, with so much of the frame left in the method's unit."""
        return walls.at(remaining)

    # Whether `contact` asks other walls than the one that was met: a constant for the compiler.
    looks_around = False

    # --- Flight ---

    # Whether contacts ask how long the flight before them was: a constant for the compiler.
    asks_flown = False

    def flight(self, walls, gravity, lane, hit=None):
        """The `FlightEnd` to the next contact, or to the end, of a method that finds its contacts by itself.

        `hit` is its first hit, a `flights.Hit`, where it is known.
        """
        return FlightEnd(lane.r, lane.v, lane.remaining, -1.0)

    def land(self, walls, gravity, lane, hit):
        """The `FlightEnd` to the first hit, a `flights.Hit` that is found before, or to the end of the frame."""
        return FlightEnd(lane.r, lane.v, lane.remaining, -1.0)

    @property
    def lands(self):
        """Whether the method has a `land`."""
        return self.gives("land")

    def landed_on(self, walls):
        """The walls with the first hits that `land` takes; None where the method finds its contacts by itself."""
        return walls if self.lands else None

    # --- The unknown of a contact ---

    def guess(self, walls, gravity, lane, wall):
        """First guess of the contact's unknown kappa, and whether the lane has one to solve for."""
        return 0.0, False

    def improve(self, walls, gravity, lane, wall, solution, multiplier):
        """One sweep of the solve: (kappa, unsolved, LoopRecord). A lane that is solved stays as it is, bit by bit."""
        return solution.kappa, False, NO_RECORD

    def most_sweeps(self, walls):
        """The most sweeps of `improve` a contact may take: a constant for the compiler."""
        return 0

    @property
    def solves(self):
        """None where contacts have a closed form: then nothing that solves for an unknown is compiled."""
        return self if self.gives("guess") else None

    def turn(self, walls, gravity, lane, wall, kappa):
        """The `ReflectedVelocity`, for `contact`, where one loop of both would be too long."""
        return NOT_TURNED

    @property
    def turns(self):
        """Whether the method has a `turn`."""
        return self.gives("turn")

    # --- Uzawa's loop (8) around it ---

    def first_multiplier(self, walls, gravity, lane, wall, kappa):
        """The multiplier that the loop starts from, kappa for it, and the acceleration of the loop."""
        return 0.0, kappa, 0.0

    def next_multiplier(self, lane, acceleration, multiplier, record, before):
        """The multiplier after a sweep, its miss, and whether to go on; `before` is the last `Sweep`."""
        return 0.0, 0.0, False

    @property
    def multiplier_sweeps(self):
        """The most sweeps of the loop."""
        return 0

    # --- Contact ---

    def contact(self, walls, gravity, lane, wall, solution):
        """The `Contact` with this wall.

        A wall that is HARD already passes through and nothing else changes; to become hard, return `HARD - wall`. A
        solution that is unsolved was not found, or its multiplier did not converge.
        """
        raise NotImplementedError

    @outlined
    def hard_pass(self, walls, gravity, lane, wall, lanes, i):
        """The `Contact` that `flight` or `contact` left to this function, and its status.

        Adds to `lanes.impulse[wall, i]`, and writes the sweeps of a multiplier loop into `lanes.record[:, i]`.
        """
        return refused(lane, Status.STALLED.value)
