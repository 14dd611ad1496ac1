"""Surfaces of a scene that kernels take together: more than a few of one kind are one field."""

import functools
from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple, TypeVar

from ...motion import Placed
from ..facets.mesh import Mesh
from ..in_motion.moving import walls_of
from ..surface import LAWS, Surface
from .many import Many
from .members import alike, can_be_member, kind_of

# Up to this number of surfaces of one kind stay separate walls; their numbers are not looked up: an impact in a sphere
# with 6 balls takes 24 ns, and 31 as a field of a few. From 8 on LLVM no longer vectorises them: 112 and 38 ns.
_FEW = 6

# The surfaces that are fields.
_FIELDS = (Many, Mesh)

Thing = TypeVar("Thing")


# --- By kind ---------------------------------------------------------------------------------------------


def by_kind(things: Iterable[Thing], numbers: Callable[[Thing], Any]) -> list[Thing]:
    """Return things in the order of the types of their numbers; things of the same types stay in their order.

    Kernels are compiled for these types: one order serves for all orders in which a user may list the same things.
    """
    listed = list(things)
    # Computing the numbers of one thing may take long.
    return sorted(listed, key=lambda thing: _rank(numbers(thing))) if len(listed) > 1 else listed


def _rank(numbers: Any) -> tuple[int, str]:
    # Surfaces with the most numbers come first, so planes last. Any order would do, but of two walls that are met at
    # the same instant the first in the order is met first.
    text = _text(numbers)
    return -len(text), text


def _text(numbers: Any) -> str:
    """Return the types of nested numbers."""
    if type(numbers) is tuple:
        # As nested pairs: their text gives walls the order in which results of earlier versions were made.
        return functools.reduce(lambda rest, part: f"Chain({_text(part)},{rest})", reversed(numbers), "NoneType")
    parts = f"({','.join(map(_text, numbers))})" if isinstance(numbers, (tuple, list)) else ""
    return type(numbers).__name__ + parts


# --- The order of a scene --------------------------------------------------------------------------------


class Order(NamedTuple):
    """The surfaces of a scene, by their numbers, in the order of its walls: by their kinds, not as they are listed."""

    fields: tuple[int, ...]  # each many bodies
    groups: tuple[tuple[int, ...], ...]  # each taken as one field
    others: tuple[int, ...]
    # For each union its rooms, for each room its surfaces; their walls come last.
    unions: tuple[tuple[tuple[int, ...], ...], ...] = ()
    of_balls: bool = False

    def joined(self) -> tuple[int, ...]:
        """Return the surfaces of unions of several rooms."""
        return tuple(i for rooms in self.unions for room in rooms for i in room)

    def alone(self) -> tuple[int, ...]:
        """Return the surfaces that have walls of their own, in the order of these walls."""
        return *self.others, *self.joined()

    def rows(self, surfaces: Sequence[Surface], together: bool = False) -> list[tuple[int, int]]:
        """Return for each row of the scene its surface, and the number of its walls: the members of a field, else one.

        With groups `together` return runs of walls with the same laws: a group counts as its first surface.
        """
        fields = [(i, surfaces[i].wall_count(self.of_balls)) for i in self.fields]
        groups = [(group[0], len(group)) for group in self.groups]
        if not together:
            groups = [(i, 1) for group in self.groups for i in group]
        return [*fields, *groups, *((i, 1) for i in self.alone() for _wall in surfaces[i].walls())]


def order_of(
    surfaces: Sequence[Surface],
    together: bool = True,
    unions: Sequence[tuple[tuple[int, ...], ...]] = (),
    of_balls: bool = False,
) -> Order:
    """Return the order of the walls of a scene; if a surface moves, or not `together`, all are walls of their own.

    `unions` is as in `Order`; the walls are those for points, or `of_balls`.
    """
    joined = {i for rooms in unions for room in rooms for i in room}
    fields = [i for i, surface in enumerate(surfaces) if isinstance(surface, _FIELDS) and not surface.is_one_wall]
    rest = [i for i in range(len(surfaces)) if i not in fields and i not in joined]
    of_kind: dict[Any, list[int]] = defaultdict(list)
    together = together and all(surface.motion is None and not surface.reacts() for surface in surfaces)
    for i in rest if together and len(rest) > _FEW else ():
        if (
            surfaces[i].present is None
            and surfaces[i].is_solid()
            and len(surfaces[i].walls()) == 1
            and can_be_member(surfaces[i].walls()[0])
        ):
            laws = tuple(getattr(surfaces[i], name) for name in (*LAWS, "openings"))
            of_kind[kind_of(surfaces[i].walls()[0]), laws].append(i)
    groups = [tuple(group) for group in of_kind.values() if len(group) > _FEW]
    grouped = {i for group in groups for i in group}
    others = [i for i in rest if i not in grouped]

    def walls(i: int) -> Any:
        one = surfaces[i]
        # A surface that is only considered at rest has no motion that kernels know.
        return one.walls() if isinstance(one.motion, Placed) else walls_of(one, 0.0), one.motion, one.mass, one.inertia

    def volumes(i: int) -> Any:
        return [(volume.walls(), volume.present is None) for volume in surfaces[i].open_volumes()]

    def body(group: tuple[int, ...]) -> Any:
        return alike([surfaces[i].walls()[0] for i in group])[0]

    # Fields of few bodies may be of a kind of their own. Openings are last: the kind does not depend on them.
    fields.sort(key=lambda i: len(surfaces[i]))  # type: ignore[arg-type]
    groups.sort(key=len)
    fields, others = (by_kind(by_kind(some, volumes), walls) for some in (fields, others))
    return Order(tuple(fields), tuple(by_kind(groups, body)), tuple(others), tuple(unions), of_balls)
