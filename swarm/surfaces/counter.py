"""Counters, as users describe them: surfaces that stop no particle and count crossings."""

from dataclasses import dataclass, fields
from typing import Any

from ..common.checks import list_of, shown
from ..errors import SceneError
from .surface import Surface


@dataclass(frozen=True)
class Counter:
    """A surface that stops no particle and counts crossings; an entry of the argument `counters` of `simulate`.

    Crossings have two senses: 0 is out of the admissible side of the surface (along the normal of a plane, out of a
    sphere), 1 is back. A surface alone is a counter as well; a `Counter` limits the places where crossings count.

    Args:
        surface: any surface at rest without laws, openings and `present`, but no `Mesh` and no `Prism`.
        inside: a volume, described by a surface as an opening is: only crossings within it count, as at the mouth of a
            tube. None: all crossings count.

    Raises:
        SceneError: an argument is no such surface.

    >>> import swarm
    >>> cavity = swarm.Scene([swarm.Sphere(radius=0.5)])
    >>> start = swarm.Particles([-0.5, 0.0, 0.0], [1.0, 0.0, 0.0])
    >>> mouth = Counter(swarm.Plane((1.0, 0.0, 0.0)), inside=swarm.Sphere(0.1))
    >>> run = swarm.simulate(cavity, start, swarm.Impact(), until=2.0, counters=[mouth, swarm.Sphere(0.2)])
    >>> run.observables["crossings"][-1].tolist()
    [[1, 1], [2, 2]]
    """

    surface: Any
    inside: Any = None

    def __post_init__(self) -> None:
        require_bare("surface", self.surface, "a counter stops no particle")
        if self.inside is not None:
            require_bare("inside", self.inside, "it is no wall")


def require_bare(name: str, given: Any, why: str) -> None:
    """Raise a `SceneError` unless `given` is a surface with arguments for its shape and place only."""
    if not isinstance(given, Surface):
        raise SceneError(f"{name} must be a surface such as swarm.Plane, got {shown(given)}")
    for law in fields(Surface):
        came = getattr(given, law.name)
        if law.name != "rotation" and came != law.default:
            raise SceneError(f"{name}.{law.name} must be left out, {why}, got {came!r:.200}")


def checked_counters(name: str, value: Any) -> tuple[Counter, ...]:
    """Return the argument `counters`, checked, each as a `Counter`."""
    given = list_of(name, value, "surfaces such as swarm.Plane", Surface, Counter)
    found = []
    for k, one in enumerate(given):
        if not isinstance(one, Counter):
            require_bare(f"{name}[{k}]", one, "a counter stops no particle")
        found.append(one if isinstance(one, Counter) else Counter(one))
    return tuple(found)
