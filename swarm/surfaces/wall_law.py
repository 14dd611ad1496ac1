"""The law of a wall as users write it."""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from ..checks import shown
from ..errors import SceneError
from ..kernel.random import Stream
from ..kernel.record import Record
from ..kernel.vector import Vec, dot

# Impacts with which a law is tried before a run, and the speed into the wall that is none, as a part of that of these.
_TRIED, _ROUND_OFF = 64, 1e-15


class WallLaw(Record):
    """A law of a wall: the velocity with which a particle leaves it.

    Derive a record from it, whose fields are numbers, and give it as `laws=[...]` of a surface. Kernels call `leave`:
    numbers in, numbers out, no lists and no arrays. It takes the place of the elastic reflection at every impact, on a
    thermal wall of the particles that this does not accommodate. A particle that it leaves so slowly that it is back at
    once (`shortest_flight` of `Impact`) slides or rests, by the restitution and the friction of the surface. What it
    changes of the energy is heat that the wall gives.

    Raises:
        SceneError: by the surface: no `leave`, a field that is no finite number, a velocity into the wall in a trial.
        RunError: such a velocity during a run.

    Example:
        >>> import swarm
        >>> from swarm.kernel.vector import dot
        >>> class Damped(swarm.WallLaw):
        ...     e: float
        ...     def leave(self, v, n, u, random, mass):
        ...         return v - (1.0 + self.e) * dot(v - u, n) * n
        >>> swarm.Sphere(1.0, laws=[Damped(0.9)])
        Sphere(radius=1.0, laws=(Damped(e=0.9),))
    """

    def leave(self, v, n, u, random, mass):
        """The velocity after an impact [m/s], away from the wall.

        Args:
            v: the velocity before it [m/s].
            n: the unit normal of the wall, into the vessel: n.(v - u) < 0, and n.(what is returned - u) >= 0. In a
                scene with a plane all vectors are along that, and so must be what is returned.
            u: the velocity of the wall [m/s].
            random: random numbers of this impact: `random.uniform(k)` in (0, 1), `random.normal(k)`, which takes k and
                k + 1, and `random.exponential(k)`, for k = 0, 1, ...; the same for any threads and any resume.
            mass: of the particle [kg].
        """
        raise NotImplementedError


def checked_laws(given: Any) -> tuple[Any, ...]:
    """Laws as kernels take them, their fields as floats; a str is the name that a file has of a law."""
    if isinstance(given, (WallLaw, str)) or not isinstance(given, (tuple, list)):
        raise SceneError(f"laws must be a list of WallLaw, got {shown(given)}")
    return tuple(law if isinstance(law, str) else _checked(f"laws[{k}]", law) for k, law in enumerate(given))


def _checked(name: str, law: Any) -> Any:
    if not isinstance(law, WallLaw):
        raise SceneError(f"{name} must be a WallLaw, a record derived from swarm.WallLaw, got {shown(law)}")
    if type(law).leave is WallLaw.leave:
        raise SceneError(f"{name} must have a method leave(self, v, n, u, random, mass), {type(law).__name__} has none")
    numbers = []
    for field, value in zip(law._fields, law, strict=True):
        if isinstance(value, bool) or not isinstance(value, (int, float, np.number)) or not math.isfinite(value):
            raise SceneError(f"{name}.{field} must be a finite number, got {shown(value)}")
        numbers.append(float(value))
    law = type(law)(*numbers)
    _try(name, law)
    return law


def _try(name: str, law: Any) -> None:
    """Raise a `SceneError` where a law sends a particle into the wall, or gives no velocity."""
    for v, n, after in tries_of(law):
        is_finite = isinstance(after, tuple) and len(after) == 3 and all(map(math.isfinite, after))
        if not (is_finite and dot(after, n) >= -_ROUND_OFF * math.sqrt(dot(v, v))):
            raise SceneError(
                f"{name} must send particles away from the wall: n.v >= 0 of the velocity that leave returns; "
                f"{law} returned {shown(after)} for v = {_said(v)}, n = {_said(n)} and u = 0"
            )


def tries_of(law: Any, across: int | None = None) -> Iterator[tuple[Vec, Vec, Any]]:
    """Some trials of a law: (velocity before, normal into the vessel, what it returns); in a plane across an axis."""
    rng = np.random.default_rng(0)
    for k in range(_TRIED):
        rows = rng.normal(size=(2, 3))
        if across is not None:
            rows[:, across] = 0.0
        n, v = (Vec(*map(np.float64, row)) for row in rows)
        n = n / math.sqrt(dot(n, n))
        v = v - (dot(v, n) + abs(dot(v, n))) * n
        with np.errstate(all="ignore"):
            yield v, n, law.leave(v, n, Vec(*map(np.float64, np.zeros(3))), Stream(0, 0, k), np.float64(1.0))


def _said(vector: Vec) -> str:
    return f"({', '.join(f'{part:.3g}' for part in vector)})"
