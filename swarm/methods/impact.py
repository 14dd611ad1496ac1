"""Impact: from impact to impact, with the converged multiplier of the conserving scheme."""

import math
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from ..common.validated import Count, NotNegative, Positive
from ..contact import sliding, touching
from ..contact.laws import NONE, Laws
from ..contact.reflection import CHORD_NEEDS, Energy, chord_end, chord_step, chord_turn, exact, restore, speed2_at
from ..errors import SceneError
from ..kernel.arrays import kept
from ..kernel.gravity import accelerated, displacement
from ..kernel.jit import select
from ..kernel.vector import square
from ..particles import Particles
from ..scene import Scene
from ..surfaces.time_of_impact import flights
from . import base, contract

# Bounds of the sliding tolerance: round-off, and steps that no longer follow the wall.
_FINEST, _COARSEST = 1e-13, 1e-3
# An impulse up to this part of the slow speed is round-off at a wall, and no impact: to count it would be chance.
# Impulses on particles that a wall lets go are 1e-16 to 1e-14 of the speed, the slow speed is 1e-4 of it.
_NO_IMPACT = 1e-8
# A time of at most this fraction of a crossing is no progress.
_INSTANT = 1e-9


@dataclass(frozen=True)
class Impact(base.Method):
    """Exact flight to the instant of impact, then the converged contact step, and so on: the default method.

    At the impact the particle is on the surface (State I), where the augmented Lagrangian scheme with g1 = 0 is
    a reflection about the discrete gradient D(r0, r1):  v1 = v0 - 2 (v0.n) n,  r1 = r0 + h (v0 + v1)/2.

    Args:
        contact_step: length h of the contact step [s], >= 0 and at most the crossing time size/|v|. 0 is the exact
            elastic reflection; h > 0 slides along a chord of the surface, as the paper's scheme does.
        shortest_flight: a particle that returns to the same wall sooner than this [s] (grazing, chattering, resting)
            slides along it instead. None: 1e-4 of its own crossing time. Every other flight is exact, however short, so
            that a wedge of 1e-4 rad takes its 31415 impacts.
        sliding_tolerance: relative error of a crossing by a sliding particle, from 1e-13 to 1e-3. The number of
            steps in a crossing follows from it: about 150 for 1e-9, and proportional to its power -1/4.
        dt: the step of bodies [s], above 0, which is cut at impacts and frames; None for particles.
        order: the order of the steps of bodies between impacts: 2, or 4 by Suzuki's composition of five steps.
        contact_start: where the contact step begins. "impact": at the impact, as in the paper. "centred": h/2 before
            it; contact_step must be above 0 then.

    A centred step takes the particle from r* - (h/2) v0 to r* + (h/2) v1, where r* is its place on the wall, and v1 is
    the same reflection about D(r0, r1) of these two ends. As n.(r1 - r0) = 0, it ends at the gap at which it begins.
    It is the reflection at r* with the normal of a point (h/2) v0.n inside. So it is exact on planes, and without
    gravity on spheres and cylinders; of second order in h where |grad phi| is the same all over the wall (a distance:
    torus, capsule); elsewhere of first order, with an error several times smaller than that of a step from the wall. It
    begins at the earliest where the frame begins or the contact before ends, and ends at the latest with the frame;
    both of its halves are then shorter by the same time. A step from r* with a wall in its way is replaced by the exact
    reflection; so is one along a face of a mesh, a side of an outline or a wall of a room that ends beyond it.

    A particle slides along one wall, or the edge of two, by the contact step of the scheme in Suzuki's composition of
    fourth order. It leaves a wall when the wall no longer presses on it, or when it meets another wall. Chattering
    (restitution e < 1) ends after the sum of its geometric series. At rest, or inside the friction cone, it costs
    nothing. A corner of three moving walls carries it in steps of their motion. An impulse of less than 1e-12 of the
    speed is no impact.

    Particles with a radius also meet at instants, and do not slide or rest. Where a contact would last they bounce, so
    high that a flight from a wall back to it takes t_c (`contact_duration` of `Pairs`; without losses about 1e-7 of a
    crossing). A ball that has met another ball in the last t_c loses no energy. The energy that such a bounce gives,
    m (a t_c)^2/8 with the acceleration a back to the wall, is a negative part of the dissipated energy, and the next
    impact takes it. So a lasting contact costs at least one impact in t_c: for grains that rest on each other for long
    use `Penalty`. Walls may move, have a mass, come and go, be open or hot, or have laws. A ball leaves where its point
    of contact is in an opening.

    Raises:
        SceneError: an argument is out of its range.

    Conserves: the energy, to round-off that does not grow, since the energy of each particle is kept; no particle is
    outside by more than round-off. With restitution, friction and thermal walls it conserves the energy plus the
    dissipated energy minus the heat of the walls.
    Order: exact for contact_step = 0, otherwise first order in h at an impact (`python -m bench order`); sliding is of
    fourth order, and of second order, without friction, where three walls or a cusp hold a particle.
    Cost: one square root and one division for a flight in a sphere; `python -m bench throughput`, `bench contacts`.
    Source: García Orden & Ortega 2007, eqs. (7), (8) in the limit V -> 0; Suzuki, Phys. Lett. A 146 (1990) 319.

    >>> Impact(contact_step=-1.0)
    Traceback (most recent call last):
    swarm.errors.SceneError: contact_step must be 0 or more, got -1
    """

    contact_step: NotNegative = 0.0
    shortest_flight: Positive | None = None
    sliding_tolerance: Positive = 1e-9
    dt: Positive | None = None
    order: Count = 2
    contact_start: base.ContactStart = field(default="impact", metadata=base.YOUNGER)

    def __post_init__(self) -> None:
        super().__post_init__()
        tolerance = self.sliding_tolerance
        if not _FINEST <= tolerance <= _COARSEST:
            raise SceneError(f"sliding_tolerance must be from {_FINEST:g} to {_COARSEST:g}, got {tolerance:g}")
        if self.order not in (2, 4):
            raise SceneError(f"order must be 2 or 4, got {self.order}")
        if self.contact_start == "centred" and self.contact_step == 0.0:
            raise SceneError(
                'contact_step must be above 0 with contact_start = "centred", got 0: an exact reflection takes no '
                "step; give contact_step, or leave contact_start out"
            )

    def check(self, scene: Scene, particles: Particles) -> None:
        base.check_crossing("contact_step", self.contact_step, scene, particles)
        base.check_crossing("shortest_flight", self.shortest_flight, scene, particles)
        base.check_bends(scene)

    def needs(self, scene: Scene) -> tuple[Any, ...]:
        chord = CHORD_NEEDS if self.contact_step > 0.0 else ()
        return *flights.of_flights(scene.gravity is not None), *sliding.NEEDS, *touching.NEEDS, *chord

    def numbers(self, scene: Scene) -> "Reflection":
        size = scene.finite_size()
        length = base.SHORTEST * size if self.shortest_flight is None else 0.0
        pull = 0.0 if scene.gravity is None else math.hypot(*scene.gravity)
        kind = Reflection
        if self.contact_step > 0.0:
            kind = Centred if self.contact_start == "centred" else Chord
        lasting = size, _bend(scene), pull * size, self.shortest_flight or 0.0, length, self.sliding_tolerance
        return kind(*lasting, scene.compiled(apart=self.apart()).laws or NONE, self.contact_step or None)

    def apart(self) -> str | None:
        return None

    def time_of_impact(self) -> float:
        # A centred step replaces a part of the flights before and after it.
        return 0.0 if self.contact_start == "centred" else self.contact_step

    def is_rigid(self) -> bool:
        return True

    def supports_period(self) -> bool:
        return self.contact_step == 0.0

    def may_slide(self) -> bool:
        return True


def _bend(scene: Scene) -> float:
    """Return the least length on which walls bend, or the size of a moving wall [m]; infinite for flat walls."""
    bent = [one for one in scene.surfaces if one.motion is not None or not all(wall.flat for wall in one.walls())]
    sizes = [surface.size() for surface in bent]
    least = min(sizes, default=math.inf)
    return least if math.isfinite(least) or not sizes else scene.finite_size()


# --- The form for kernels --------------------------------------------------------------------------------


class ContactEnergy(NamedTuple):
    """The energy of a lane, and twice the speed [m/s] away from a wall below which its contact may last."""

    energy: Energy
    slow: float


class Reflection(contract.MethodNumbers):
    """The method with the exact reflection. One of the two numbers of the shortest flight is 0."""

    size: float  # of the scene [m]
    bend: float  # the least length on which walls bend [m], infinite where all are flat
    fall2: float  # |G| size, the square of a speed
    shortest_flight: float  # [s]
    shortest_length: float  # of a flight [m]
    sliding_tolerance: float  # relative error of a crossing
    laws: Laws
    contact_step: Any  # h of a chord [s], or None

    # --- The numbers of a lane ---

    def constants(self, mass, energy, scale2):
        # Twice the energy per mass, 1/(2 |v|^2) if |v| is constant, and the slow speed. That does not follow from the
        # velocity at the start of the frame, as no contact may depend on the times of frames.
        twice_energy = 2.0 * energy
        moving = twice_energy > 0.0
        half_inverse = select(moving, 0.5 / select(moving, twice_energy, 1.0), 0.0)
        slow = (self.shortest_flight * scale2 + self.shortest_length * math.sqrt(scale2)) / self.size
        return twice_energy, half_inverse, slow

    def own(self, first, second, third):
        return ContactEnergy(Energy(first, second), third)

    holds = True

    def instant(self, v):
        speed2 = square(v) + self.fall2
        return _INSTANT * self.size / math.sqrt(select(speed2 > 0.0, speed2, np.inf))

    @property
    def dissipates(self):
        return self.laws.change_energy

    # --- Flight ---

    def land(self, walls, gravity, lane, hit):
        t = select(hit.time < lane.remaining, hit.time, lane.remaining)
        return contract.FlightEnd(
            lane.r + displacement(gravity, lane.v, t),
            accelerated(gravity, lane.v, t),
            lane.remaining - t,
            select((hit.time <= lane.remaining) & (hit.wall >= 0.0), hit.wall, -1.0),
        )

    # --- Contact ---

    def contact(self, walls, gravity, lane, wall, solution):
        bounce = exact(self.laws, walls, gravity, wall, lane.r, lane.v, lane.own.energy)
        hit, speed2 = wall >= 0.0, self.speed2_of(gravity, lane)
        impulse, away = select(hit, (bounce.impulse, bounce.twice_away), (0.0, 0.0))
        return contract.Contact(
            lane.r,
            select(hit, bounce.v, kept(lane.v)),
            lane.remaining,
            wall,
            impulse,
            select(self.is_within(lane, speed2, impulse, _NO_IMPACT), 0.0, 1.0),
            select(hit, bounce.twice_energy, kept(lane.own.energy.twice)),
            hit & self.is_within(lane, speed2, away, 1.0),
            select(hit, 0.5 * bounce.work, 0.0),
        )

    def speed2_of(self, gravity, lane):
        """Return |v|^2 with which a lane arrives."""
        if gravity is not None:
            return square(lane.v)
        # From the energy, which round-off may leave below 0.
        speed2 = lane.own.energy.twice
        return select(speed2 > 0.0, speed2, 0.0)

    def is_within(self, lane, speed2, speed, part):
        """Whether `speed` is at most `part` of `slow`: twice the speed away from a wall below which a contact may last.

        In the pull |v|^2/size + |G| a flight of duration T leaves the wall with the speed T/2 times the pull.
        """
        if not self.laws.change_energy:
            return speed <= part * lane.own.slow
        # From the |v|^2 on arrival, as such walls change it. One of by_time and by_length is 0.
        speed2, by_time, by_length = speed2 + self.fall2, self.shortest_flight, self.shortest_length
        part_of_size = 1.0 / (self.size * self.size)
        slow2 = speed2 * (by_time * by_time * part_of_size * speed2 + by_length * by_length * part_of_size)
        return speed * speed <= (part * part) * slow2


class Chord(Reflection):
    """The method with a contact step, a chord of the surface, for scenes without laws."""

    looks_around = True

    def step(self, lane):
        """Return the length of the contact step, which the end of the frame cuts."""
        return select(self.contact_step < lane.remaining, self.contact_step, lane.remaining)

    def start(self, gravity, lane):
        """Return the start r0 of the step."""
        return lane.r

    def way(self, gravity, lane):
        """Return its free displacement p."""
        return displacement(gravity, lane.v, self.step(lane))

    # --- The unknown of a contact ---

    def most_sweeps(self, walls):
        return walls.chord_sweeps()

    def guess(self, walls, gravity, lane, wall):
        kappa = walls.chord_guess(wall, self.start(gravity, lane), self.way(gravity, lane))
        return kappa, (wall >= 0.0) & (self.step(lane) > 0.0)

    def improve(self, walls, gravity, lane, wall, solution, multiplier):
        r, p = self.start(gravity, lane), self.way(gravity, lane)
        better, more = chord_step(walls, wall, r, p, solution.kappa)
        return select(solution.unsolved, better, solution.kappa), solution.unsolved & more, contract.NO_RECORD

    def turn(self, walls, gravity, lane, wall, kappa):
        return chord_turn(walls, gravity, wall, lane.r, lane.v, self.step(lane), kappa)

    # --- Contact ---

    def contact(self, walls, gravity, lane, wall, solution):
        h = self.step(lane)
        r, v, stays = chord_end(walls, gravity, wall, lane.r, lane.v, solution.turned.v, h, lane.own.energy)
        return self.ended(lane, wall, solution, (r, v, h), stays)

    def ended(self, lane, wall, solution, end, stays):
        """Return the `Contact` of a lane that takes its step to `end`, (r1, v1, time), if it stays inside, or waits."""
        (r, v, h), impulse, hit = end, solution.turned.impulse, wall >= 0.0
        step = hit & stays & (impulse > lane.own.slow) & (not solution.unsolved)
        return contract.Contact(
            select(step, r, kept(lane.r)),
            select(step, v, kept(lane.v)),
            lane.remaining - select(step, h, 0.0),
            wall,
            select(step, impulse, 0.0),
            select(step, 1.0, 0.0),
            lane.own.energy.twice,
            hit & (not step),
        )


class Centred(Chord):
    """The method with a contact step that has its middle at the impact, where the lane is, on the wall."""

    asks_flown = True

    def half(self, lane):
        """Return half the length of the contact step, which the flight before it and the end of the frame cut."""
        return base.centred_half(self.contact_step, lane)

    def step(self, lane):
        return 2.0 * self.half(lane)

    def start(self, gravity, lane):
        return lane.r + displacement(gravity, lane.v, -self.half(lane))

    def way(self, gravity, lane):
        # p = h v0 + h^2 G/2: the velocity at its middle is that of the impact.
        return self.step(lane) * lane.v

    def turn(self, walls, gravity, lane, wall, kappa):
        # Gravity turns the velocities at the ends into those at the impact, which are reflected.
        return chord_turn(walls, None, wall, self.start(gravity, lane), lane.v, self.step(lane), kappa)

    def contact(self, walls, gravity, lane, wall, solution):
        half = self.half(lane)
        speed2, half_inverse = speed2_at(gravity, lane.r, lane.own.energy)
        w = restore(solution.turned.v, speed2, half_inverse, gravity is not None)
        free = flights.is_free(walls, lane.r, accelerated(gravity, w, 0.5 * half), half)
        end = lane.r + displacement(gravity, w, half), accelerated(gravity, w, half), half
        return self.ended(lane, wall, solution, end, free)
