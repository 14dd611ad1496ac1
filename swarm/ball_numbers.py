"""Observables of balls: their collision rate, the pressure by the virial, the energy of their spins."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .particles import Particles
from .scene import Scene
from .state import Floats, State

# The moment of inertia of a ball, as a part of m R^2; in a plane too.
INERTIA = 0.4
# The numbers that are kept of the last frame.
_LAST = "time", "collisions", "virial", "kinetic", "action", "collision_rate", "pressure"


def inertias(mass: Floats, radius: Floats) -> Floats:
    """The moments of inertia of balls (N,) [kg m^2]."""
    return np.asarray(INERTIA * mass * radius * radius)


def rotational_energy(mass: Floats, radius: Floats, spin: Floats | None) -> float:
    """The energy of the spins of balls [J]; 0 without spins."""
    return 0.0 if spin is None else float(0.5 * (inertias(mass, radius) * (spin * spin).sum(axis=0)).sum())


def balls_volume(scene: Scene, radius: Floats) -> float:
    """The volume of all balls [m^3], in a scene with a plane the area of the discs [m^2]."""
    if scene.plane is not None:
        return float(math.pi * (radius * radius).sum())
    return float(4.0 / 3.0 * math.pi * (radius**3).sum())


def volume_of(scene: Scene, particles: Particles) -> float:
    """The volume of particles [m^3], in a plane the area [m^2]: what `fill` filled with them, else the cell.

    It is NaN if neither is known.
    """
    if particles.volume is not None:
        return particles.volume
    lengths = [None if scene.period is None else scene.period[k] for k in scene.axes()]
    # Surfaces take a part of the cell, which only `fill` computes.
    if not scene.surfaces and None not in lengths:
        return math.prod(length for length in lengths if length is not None)
    return math.nan


class BallNumbers:
    """The observables of balls from frame to frame; an engine calls `frame` once for each frame that is done.

    Args:
        scene: the scene of the balls, in three or two dimensions.
        particles: the balls at the start.

    >>> import swarm
    >>> from swarm.state import Balls, State
    >>> scene = swarm.Scene([swarm.Sphere(1.0)])
    >>> one = swarm.Particles((0.0, 0.0, 0.0), (3.0, 0.0, 0.0), radius=0.1)
    >>> one.volume = 4.0
    >>> none, balls = np.zeros(1), Balls(one.radius, np.zeros(1, np.int64), np.zeros(1))
    >>> state = State(one.position, one.velocity, one.mass, none, none, balls.collisions, none, none, None, balls=balls)
    >>> numbers = BallNumbers(scene, one)
    >>> numbers.frame(state, 0.0, 4.5)
    >>> numbers.frame(state, 2.0, 4.5)
    >>> numbers.seen(state)
    {'collisions': 0, 'collision_rate': 0.0, 'pressure': 0.75}
    """

    def __init__(self, scene: Scene, particles: Particles) -> None:
        self._dimensions, self._room = len(scene.axes()), volume_of(scene, particles)
        self._last = np.zeros(len(_LAST))

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return the arrays that a resumed run needs, for `BaseRun.arrays`."""
        return {"ball_numbers": self._last}

    def frame(self, state: State, moment: float, kinetic: float, action: float | None = None) -> None:
        """Take a frame that is done.

        Args:
            state: the state at the frame.
            moment: the time of the frame [s]; 0 is the start.
            kinetic: the energy of the translation of the moving balls at the frame [J]; held balls press on nothing.
            action: the integral of this energy since the start [J s]; None: by the trapezoidal rule over frames, which
                is exact for a constant energy.
        """
        balls = state.balls
        assert balls is not None
        last = dict(zip(_LAST, self._last.tolist(), strict=True))
        collisions, virial = _collisions(state), float(balls.virial[0])
        span = moment - last["time"]
        rate = pressure = math.nan
        if moment > 0.0:
            if action is None:
                action = last["action"] + 0.5 * span * (last["kinetic"] + kinetic)
            rate = (collisions - last["collisions"]) / span
            given = 2.0 * (action - last["action"]) + virial - last["virial"]
            pressure = given / (span * self._dimensions * self._room)
        self._last[:] = moment, collisions, virial, kinetic, action or 0.0, rate, pressure

    def seen(self, state: State) -> dict[str, Any]:
        """Return the observables of the last frame that only balls have."""
        balls = state.balls
        assert balls is not None
        found = {"collisions": _collisions(state), "collision_rate": float(self._last[-2])}
        found |= {"pressure": float(self._last[-1])}
        if balls.spin is not None:
            found["rotational_energy"] = rotational_energy(state.mass, balls.radius, balls.spin)
        return found

    def added(self, seen: dict[str, Any], state: State) -> dict[str, Any]:
        """Return the observables of a frame with those of balls, from `seen` of points; sums include spins."""
        mine, balls = self.seen(state), state.balls
        if balls is None or balls.spin is None:
            return {**seen, **mine}
        turning = (inertias(state.mass, balls.radius) * balls.spin).sum(axis=1)
        return {
            **seen, **mine, "total_energy": seen["total_energy"] + mine["rotational_energy"],
            "angular_momentum": seen["angular_momentum"] + turning,
        }  # fmt: skip


def _collisions(state: State) -> int:
    """The number of collisions since the start, each of which both balls have counted."""
    assert state.balls is not None
    return state.balls.sum_of_collisions(state.mass.size) // 2
