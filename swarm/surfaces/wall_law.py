"""The law of a wall as users write it."""

import math
import traceback
from collections.abc import Iterator
from typing import Any

import numpy as np

from ..common.checks import brackets, shown
from ..errors import SceneError
from ..kernel.random import Stream
from ..kernel.record import Record
from ..kernel.vector import ZERO, Vec, dot

# The number of impacts with which a law is tried before a run, and the speed into the wall that counts as 0, relative
# to the speeds of an impact.
_TRIED, _ROUND_OFF = 64, 1e-15
# The observables that may count the energy that a law takes or gives.
BOOKS = ("heat", "dissipated")


class Leave(Record):
    """How a particle leaves a wall, for a law that returns more than a velocity.

    A particle that does not stay is absorbed: it ends where it is, and gives the wall its normal momentum. One that
    waits stays on the wall, and then leaves with this velocity, which it has in all files from the impact on.

    Args:
        v: the velocity after the impact [m/s].
        stays: whether the particle stays in the run; else it is absorbed.
        wait: how long it stays on the wall [s], 0 or more.

    Example:
        >>> import swarm
        >>> from swarm.surfaces.wall_law import mirrored
        >>> class Gate(swarm.WallLaw):
        ...     probability: float
        ...     def leave(self, v, n, u, random, mass):
        ...         return swarm.Leave(mirrored(v, n, u), stays=random.uniform(0) >= self.probability)
        >>> swarm.Sphere(1.0, laws=[Gate(0.1)])
        Sphere(radius=1.0, laws=(Gate(probability=0.1),))
    """

    v: Any
    stays: Any = True
    wait: Any = 0.0


class WallLaw(Record):
    """A law of a wall: the velocity with which a particle leaves it, or whether it is absorbed there, or waits.

    Derive a record of numbers from it, and give it as `laws=[...]` of a surface. Kernels call `leave`:
    numbers in, numbers out, no lists and no arrays; without branches (`swarm.kernel.jit.select` in their place) it
    costs least. Laws take the place of the elastic reflection at every impact; on a thermal wall, at impacts of the
    particles that the wall does not accommodate. Several laws act in their order: each law gets the velocity that a
    mirror would turn into the velocity after the law before. A particle that leaves so slowly that it is back at once
    (`shortest_flight` of `Impact`) slides or rests, by the restitution and the friction of the surface, and meets no
    law of this wall meanwhile.

    A change of the energy by a law is heat that the wall gives, in the observable "wall_heat"; with `book =
    "dissipated"` in the class it is lost, in "dissipated_energy". A law that changes the square of the speed relative
    to the wall by less than 1e-12 of it keeps the speed to the last digit.

    Raises:
        SceneError: by the surface: no `leave`, a field that is no finite number, a velocity into the wall in a trial.
        RunError: such a velocity during a run.

    Example:
        >>> import swarm
        >>> from swarm.kernel.vector import dot
        >>> class Damped(swarm.WallLaw):
        ...     e: float
        ...     book = "dissipated"
        ...     def leave(self, v, n, u, random, mass):
        ...         return v - (1.0 + self.e) * dot(v - u, n) * n
        >>> swarm.Sphere(1.0, laws=[Damped(0.9)])
        Sphere(radius=1.0, laws=(Damped(e=0.9),))
    """

    book = "heat"

    def leave(self, v, n, u, random, mass):
        """Return the velocity after an impact [m/s], away from the wall, or a `Leave`.

        Args:
            v: the velocity before it [m/s].
            n: the unit normal of the wall, into the vessel: n.(v - u) < 0, and n.(w - u) >= 0 of the returned w.
                In a scene with a plane all vectors are along the plane, and the returned one must be too.
            u: the velocity of the wall [m/s].
            random: random numbers of this impact and law: `random.uniform(k)` in (0, 1), `random.normal(k)`, which
                takes k and k + 1, and `random.exponential(k)`, for k = 0, 1, ...; the same for any threads and any
                resume. 2 k and 2 k + 1 together cost as much as one. `random.diffuse(n, random.uniform(k), k + 1)` is
                a unit vector of the cosine law, `random.across` the axis across the plane of the scene, or None.
            mass: of the particle [kg]. Of a body it is the effective mass at its contact point along the normal,
                1/(n K n) with the inverse mass K there; v is such across the normal that mass |v - u|^2/2 is the energy
                that an impulse at this point can change.
        """
        raise NotImplementedError

    def check(self, name: str) -> None:
        """Raise a `SceneError` if a field of this law, which is `name` of its surface, is out of its range."""


def mirrored(v, n, u):
    """Return the velocity with which a particle leaves an elastic wall."""
    return v - 2.0 * dot(v - u, n) * n


def leave_of(given):
    """Return the result of a law as a `Leave`."""
    return given if isinstance(given, Leave) else Leave(given)


def checked_laws(name: str, given: Any) -> tuple[Any, ...]:
    """Return laws with their fields as floats; a str is the name of a law in a file."""
    if isinstance(given, (WallLaw, str)) or not isinstance(given, (tuple, list)):
        raise SceneError(
            f"{name} must be a list of WallLaw, such as [swarm.Lambert()], in a scene file {name.rpartition('.')[2]} = "
            f'[{{kind = "lambert"}}], got {shown(given)}'
        )
    return tuple(law if isinstance(law, str) else _checked(f"{name}[{k}]", law) for k, law in enumerate(given))


def _checked(name: str, law: Any) -> Any:
    if not isinstance(law, WallLaw):
        raise SceneError(
            f"{name} must be a WallLaw, a record derived from swarm.WallLaw, got {shown(law)}{brackets(law)}"
        )
    if type(law).leave is WallLaw.leave:
        raise SceneError(f"{name} must have a method leave(self, v, n, u, random, mass), {type(law).__name__} has none")
    if law.book not in BOOKS:
        raise SceneError(
            f'{name} must have book = "heat" or "dissipated" in its class, {type(law).__name__} has {shown(law.book)}'
        )
    numbers: list[float | None] = []
    for field, value in zip(law._fields, law, strict=True):
        if value is None and type(law)._field_defaults.get(field, 0.0) is None:
            numbers.append(None)
            continue
        if isinstance(value, bool) or not isinstance(value, (int, float, np.number)) or not math.isfinite(value):
            raise SceneError(f"{name}.{field} must be a finite number, got {shown(value)}")
        numbers.append(float(value))
    law = type(law)(*numbers)
    law.check(name)
    _try(name, law)
    return law


def _try(name: str, law: Any) -> None:
    """Raise a `SceneError` if a law sends a particle into the wall, or returns no velocity."""
    try:
        tries = list(tries_of(law))
    except Exception as error:
        file = type(law).leave.__code__.co_filename
        lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == file]
        raise SceneError(
            f"{name} must return a velocity for any other, and {type(law).__name__}.leave raised "
            f"{type(error).__name__}: {error}{f', line {lines[-1]} of {file}' if lines else ''}; vectors have +, - and "
            "products with numbers, and dot, norm and cross of swarm.kernel.vector"
        ) from error
    for v, n, given in tries:
        if wrong := why_wrong(given, v, n, ZERO):
            raise SceneError(f"{name} {wrong}; {sentence_of(law, given, v, n, ZERO)}")


def why_wrong(given: Any, v: Vec, n: Vec, u: Vec, moves: bool = False) -> str:
    """Return the error in the result of a law, as the end of a sentence; "" if it is right."""
    after, stays, wait = leave_of(given)
    is_known = isinstance(stays, (bool, np.bool_)) and not wait < 0.0 and not math.isnan(wait)
    if not is_known:
        return "must return a Leave with stays True or False and a wait of 0 or more [s]"
    if moves and stays and wait > 0.0:
        return "must not let particles wait where a wall moves"
    is_finite = isinstance(after, tuple) and len(after) == 3 and all(map(math.isfinite, after))
    if stays and not is_finite:
        return "must return a velocity, three finite numbers, or a swarm.Leave"
    own, before = Vec(*after) - u if stays else v - u, v - u
    if stays and not dot(own, n) >= -_ROUND_OFF * (math.sqrt(dot(before, before)) + math.sqrt(dot(own, own))):
        return "must send particles away from the wall: n.(v - u) >= 0 of the velocity that leave returns"
    return ""


def tries_of(law: Any, across: int | None = None, axis: Any = None) -> Iterator[tuple[Vec, Vec, Any]]:
    """Yield trials of a law: (velocity before, normal into the vessel, its result); in a plane across an axis."""
    rng = np.random.default_rng(0)
    for k in range(_TRIED):
        rows = rng.normal(size=(2, 3))
        if across is not None:
            rows[:, across] = 0.0
        n, v = (Vec(*map(np.float64, row)) for row in rows)
        n = n / math.sqrt(dot(n, n))
        v = v - (dot(v, n) + abs(dot(v, n))) * n
        stream = Stream(0, 0, k, across=axis)
        with np.errstate(all="ignore"):
            yield v, n, law.leave(v, n, Vec(*map(np.float64, np.zeros(3))), stream, np.float64(1.0))


def lets_wait(law: Any) -> bool:
    """Whether a law lets particles wait in a trial."""
    return any(leave_of(given).stays and leave_of(given).wait > 0.0 for _v, _n, given in tries_of(law))


def may_end(law: Any) -> bool:
    """Whether a law returns a `Leave`: then it may absorb particles, or let them wait."""
    return isinstance(next(tries_of(law))[2], Leave)


def sentence_of(law: Any, given: Any, v: Vec, n: Vec, u: Vec) -> str:
    """Return the sentence that names the result of a law and its arguments."""
    return f"{law} returned {_shown(given)} for v = {_as_text(v)}, n = {_as_text(n)} and u = {_as_text(u)}"


def _shown(given: Any) -> str:
    if isinstance(given, Leave):
        return f"Leave({_shown(given.v)}, stays={given.stays}, wait={given.wait})"
    try:
        return _as_text(given)
    except (TypeError, ValueError):
        return shown(given)


def _as_text(vector: Vec) -> str:
    return f"({', '.join(f'{part:.3g}' for part in vector)})"
