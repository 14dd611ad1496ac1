"""The run in which balls grow while they fly, all by the same factor, until they fill a fraction of a volume.

This is the method of Lubachevsky and Stillinger for dense packings. At a time t of the run the radius of each ball is
R (scale + rate t). From the start on, balls meet the walls as balls of the radius R do, so that all centres stay where
they may be at the end.

B. D. Lubachevsky and F. H. Stillinger, J. Stat. Phys. 60 (1990) 561.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from ..kernel.jit import select
from ..kernel.random import Seeding
from ..kernel.record import Record
from ..kernel.vector import dot, square
from ..methods import Impact
from ..particles import Particles
from ..run.tally import Watched
from ..scene import Scene
from ..state import Floats
from .balls_run import CollidingRun
from .colliding.clock import EVENTS, LENGTH

# The rate of growth relative to the root mean square speed of the balls: slow, so that the balls spread.
_SLOW = 0.04
# A stage of growth, as a part of the last radii. After it the balls, which gain energy, get their first speed again.
_STAGE = 0.02
# Balls are jammed after this number of events a ball in a stage: at a packing of 0.6 a stage has 100.
_JAMMED = 2000
# The length of an epoch that does not end [s].
_FOREVER = 1e100
# At the end balls have grown further by this part, so that they are apart by more than round-off.
_WIDER = 1e-9


class GrowingSight(NamedTuple):
    """The `Sight` of growing balls: b.u and |u|^2 are reduced by the terms of the growth of the contact distance."""

    closing: Any
    gap: Any
    discriminant: Any

    def meets(self):
        """Whether the balls will touch: always if they fly apart more slowly than they grow."""
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
        """Return the `GrowingSight` of a ball at the distance vector b with the relative velocity u, now."""
        scale = self.at(now)
        closing = dot(b, u) - touching2 * scale * self.rate
        gap = square(b) - touching2 * scale * scale
        faster = square(u) - touching2 * self.rate * self.rate
        # A ball is also tested against itself.
        return GrowingSight(closing, gap, select(square(b) > 0.0, closing * closing - faster * gap, -1.0))

    def turned(self, u, n, closing, distance2, now):
        """The relative velocity after a collision: the surfaces part as fast as they approached."""
        return u - (2.0 * (closing / distance2 - self.rate / self.at(now))) * n


class GrowingRun(CollidingRun):
    """A stage of the growth of balls, which are given with their final radii."""

    def __init__(self, scene: Scene, particles: Particles, growth: Growth, seeding: Seeding) -> None:
        assert particles.radius is not None
        compiled = scene.compiled(float(particles.radius.max()))
        super().__init__(compiled, particles, Impact(), 1, None, "auto", seeding, Watched())
        self._box = self._box._replace(growth=growth)
        # There is only one epoch: the time of `Growth` counts from its start.
        self._clock[LENGTH] = _FOREVER

    def is_grown(self, span: float) -> bool:
        """Grow for a time [s]; return whether the balls have not jammed before."""
        while (left := _JAMMED * self.state.mass.size - int(self._clock[EVENTS])) > 0:
            self.halt(left)
            # `advance` returns earlier where plain Python has no time left.
            if self.advance(span, span):
                return True
        return False


def grow(
    scene: Scene, places: Floats, radius: Floats, scale: float, random: np.random.Generator
) -> tuple[Floats, float]:
    """Grow balls from the part `scale` of their radii; return their places (3, N), and the part at the end.

    The part is 1 unless the balls jam before. At the start the balls do not overlap, and are within the walls with
    their final radii.
    """
    axes, speed = scene.axes(), float(np.sqrt((radius**2).mean()))
    velocity = np.zeros_like(places)
    velocity[axes] = speed / math.sqrt(len(axes)) * random.standard_normal((len(axes), radius.size))
    while scale < 1.0:
        balls = Particles(places, velocity, 1.0, None, radius)
        # The unit of time is that in which a ball flies its radius.
        rate, end = _SLOW, min(1.0 + _WIDER, scale + _STAGE)
        with GrowingRun(scene, balls, Growth(scale, rate), Seeding()) as run:
            run.observe()
            span = (end - scale) / rate
            if not run.is_grown(span):
                return places, scale
        places, velocity, scale = balls.position, balls.velocity, end
        velocity *= speed / math.sqrt(float((velocity**2).sum(axis=0).mean()))
    return places, 1.0
