"""The names of surfaces, and of the parts of unions, in files and pictures."""

from typing import Any

from ..scene import Scene
from ..surfaces.union import Place, part_at


def name_of(scene: Scene, surface: int, place: Place = ()) -> str:
    """The name of a surface by its number and kind, and of a part of it by its place in it.

    >>> import swarm
    >>> scene = swarm.Scene([swarm.Union([swarm.Sphere(0.5), swarm.Box((0.5, 0.2, 0.2))])])
    >>> name_of(scene, 0), name_of(scene, 0, (1,))
    ('0_union', '0_union_1_box')
    """
    whole: Any = scene.surfaces[surface]
    name = f"{surface}_{_kind(whole)}"
    if not place:
        return name
    return "_".join([name, *map(str, place), _kind(part_at(whole, place))])


def names_of_parts(scene: Scene) -> list[str]:
    """The names of all parts of the unions of a scene."""
    return [name_of(scene, surface, place) for surface, place in scene.parts]


def _kind(surface: Any) -> str:
    return type(surface).__name__.lower()
