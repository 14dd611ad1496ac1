"""The parts of a union or an intersection: checked, with the arguments of the whole, and on their other side."""

from dataclasses import fields, replace
from typing import Any

from ..common import checks
from ..errors import SceneError
from .shapes.plane import Plane
from .surface import Surface


def checked_parts(value: Any, name: str) -> tuple[Surface, ...]:
    """The argument `parts`, checked."""
    given = checks.list_of("parts", value, "surfaces such as swarm.Sphere", Surface)
    if not given:
        raise SceneError(f"parts must hold at least one surface of the {name}, got none")
    for k, part in enumerate(given):
        if not isinstance(part, Surface):
            came = f"{checks.shown(part)}{checks.brackets(part)}"
            raise SceneError(f"parts[{k}] must be a surface such as swarm.Sphere, got {came}")
    return given


def handed_down(whole: Surface, part: Surface) -> Surface:
    """Return a part with the arguments of the whole for those that it leaves at their defaults."""
    defaults = {one.name: one.default for one in fields(Surface)}
    given = {name: value for name, value in whole.common().items() if getattr(part, name) == defaults[name] != value}
    if part.temperature is not None:
        given.pop("accommodation", None)
    if whole.openings:
        given["openings"] = (*part.openings, *whole.openings)
    return replace(part, **given) if given else part


def other_side(surface: Surface) -> Surface:
    """Return the same wall, admissible on its other side."""
    if isinstance(surface, Plane):
        x, y, z = surface.normal
        return replace(surface, normal=(-x, -y, -z), offset=-surface.offset)
    if not hasattr(surface, "side"):
        raise SceneError(
            f'side must be "inside" for parts of which one has no other side, got "outside" and {surface!r:.200}'
        )
    try:
        return replace(surface, side="inside" if surface.is_solid() else "outside")  # type: ignore[call-arg]
    except SceneError as error:
        raise SceneError(
            f"parts must have an other side where the whole is turned, got {surface!r:.200}: {error}"
        ) from None
