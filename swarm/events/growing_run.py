"""The run in which balls grow until they fill as much of a volume as is asked."""

import math

import numpy as np

from ..methods import Impact
from ..particles import Particles
from ..run.starting_state import Seeding
from ..run.tally import Watched
from ..scene import Scene
from ..state import Floats
from .balls_run import CollidingRun
from .colliding.clock import EVENTS, LENGTH
from .colliding.growing import Growth

# The radii grow by this part of the root of the mean square of the speed of balls: slowly, so that the balls spread.
_SLOW = 0.04
# By so much of the last radius at a time; then the balls, which gain energy, are as fast as before.
_STAGE = 0.02
# Events a ball of such a part after which the balls give way no more: at a packing of 0.6 there are 100.
_JAMMED = 2000
# A length that no epoch reaches [s].
_FOREVER = 1e100
# And so much they are wider at the end, so that they are apart by more than round-off.
_WIDER = 1e-9


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
