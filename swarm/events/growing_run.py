"""The run in which balls grow while they fly, all by the same factor, until they fill as much of a volume as is asked.

This is Lubachevsky and Stillinger's way to a dense packing. At a time t of the run the radius of each is
R (scale + rate t). Walls are those that balls of the radius R meet, from the start on: a centre keeps to where it may
be at the end.

B. D. Lubachevsky and F. H. Stillinger, J. Stat. Phys. 60 (1990) 561.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from ..kernel.jit import select
from ..kernel.record import Record
from ..kernel.vector import dot, square
from ..methods import Impact
from ..particles import Particles
from ..run.starting_state import Seeding
from ..run.tally import Watched
from ..scene import Scene
from ..state import Floats
from .balls_run import CollidingRun
from .colliding.clock import EVENTS, LENGTH

# The radii grow by this part of the root of the mean square of the speed of balls: slowly, so that the balls spread.
_SLOW = 0.04
# They grow by this part of the last radii at a time; then the balls, which gain energy, get their first speed again.
_STAGE = 0.02
# Balls are jammed after so many events a ball in one of these parts: at a packing of 0.6 there are 100.
_JAMMED = 2000
# The length of an epoch that does not end [s].
_FOREVER = 1e100
# At the end they are wider by this part, so that they are apart by more than round-off.
_WIDER = 1e-9


class GrowingSight(NamedTuple):
    """The `Sight` of balls that grow: b.u and |u|^2 are less by the terms of the growth of the contact distance."""

    closing: Any
    gap: Any
    discriminant: Any

    def meets(self):
        """Whether they will touch: always if they fly apart more slowly than they grow."""
        slow = (self.gap > 0.0) & (self.discriminant > self.closing * self.closing)
        return ((self.closing < 0.0) | slow) & (self.discriminant > 0.0)


class Growth(Record):
    """The growth of all balls."""

    scale: float  # at time 0, of the epoch
    rate: float  # [1/s]

    def at(self, now):
        """The scale at a time."""
        return self.scale + self.rate * now

    def sight(self, b, u, touching2, now):
        """The `GrowingSight` of a ball that is b away and moves by u, now."""
        scale = self.at(now)
        closing = dot(b, u) - touching2 * scale * self.rate
        gap = square(b) - touching2 * scale * scale
        faster = square(u) - touching2 * self.rate * self.rate
        # A ball sees itself too.
        return GrowingSight(closing, gap, select(square(b) > 0.0, closing * closing - faster * gap, -1.0))

    def turned(self, u, n, closing, distance2, now):
        """The relative velocity after a collision: their surfaces part as fast as they came."""
        return u - (2.0 * (closing / distance2 - self.rate / self.at(now))) * n


class GrowingRun(CollidingRun):
    """A part of the growth of balls given with their final radii."""

    def __init__(self, scene: Scene, particles: Particles, growth: Growth, seeding: Seeding) -> None:
        assert particles.radius is not None
        compiled = scene.compiled(float(particles.radius.max()))
        super().__init__(compiled, particles, Impact(), 1, None, "auto", seeding, Watched())
        self._box = self._box._replace(growth=growth)
        # One epoch: a scale counts from its start.
        self._clock[LENGTH] = _FOREVER

    def is_grown(self, span: float) -> bool:
        """Grow for a time [s]: whether the balls gave way until then."""
        while (left := _JAMMED * self.state.mass.size - int(self._clock[EVENTS])) > 0:
            self.halt(left)
            # It returns before where plain Python has no time left.
            if self.advance(span, span):
                return True
        return False


def grow(
    scene: Scene, places: Floats, radius: Floats, scale: float, random: np.random.Generator
) -> tuple[Floats, float]:
    """Places (3, N) of balls that have grown from a part of their radii to these: the places, and the part at the end.

    The part is 1 unless the balls jam before. They begin at places without overlaps, and are within the walls with
    their last radii.
    """
    axes, speed = scene.axes(), float(np.sqrt((radius**2).mean()))
    velocity = np.zeros_like(places)
    velocity[axes] = speed / math.sqrt(len(axes)) * random.standard_normal((len(axes), radius.size))
    while scale < 1.0:
        balls = Particles(places, velocity, 1.0, None, radius)
        # In a unit of time a ball flies as far as it is wide.
        rate, end = _SLOW, min(1.0 + _WIDER, scale + _STAGE)
        with GrowingRun(scene, balls, Growth(scale, rate), Seeding()) as run:
            run.observe()
            span = (end - scale) / rate
            if not run.is_grown(span):
                return places, scale
        places, velocity, scale = balls.position, balls.velocity, end
        velocity *= speed / math.sqrt(float((velocity**2).sum(axis=0).mean()))
    return places, 1.0
