"""Laws of walls to and from plain tables."""

from collections.abc import Mapping
from typing import Any

from ..common.checks import closest, listed, one_of
from ..errors import SceneError
from ..surfaces.laws import ALL_LAWS
from ..surfaces.wall_law import WallLaw
from . import plugins


def with_laws(table: Any, where: str) -> Any:
    """The table of a surface with its laws, and those of groups of a mesh, as objects; of some a file has the name."""
    if not isinstance(table, Mapping):
        return table
    if isinstance(table.get("laws"), list):
        table = {**table, "laws": [_law_of(one, f"{where}.laws[{k}]") for k, one in enumerate(table["laws"])]}
    if isinstance(table.get("groups"), Mapping):
        groups = {name: with_laws(group, f"{where}.groups.{name}") for name, group in table["groups"].items()}
        table = {**table, "groups": groups}
    return table


def _law_of(table: Any, where: str) -> WallLaw | str:
    """A law of a wall from its table: of a kind, or of code that the caller allows."""
    if not isinstance(table, Mapping):
        return table if isinstance(table, str) else _no_law(where, table)
    if "law" in table and "kind" in table:
        raise SceneError(f"{where}: expected a kind or a law, got both; remove one of them")
    key = "law" if "law" in table else "kind"
    if key not in table:
        raise SceneError(f"{where}.kind: expected one of {listed(ALL_LAWS)}, or law, got nothing")
    if key == "law":
        cls = plugins.class_of(f"{where}.law", table["law"], WallLaw, "a law of a wall")
    else:
        cls = ALL_LAWS[one_of(f"{where}.kind", table["kind"], ALL_LAWS)]
    given, needed = {name: value for name, value in table.items() if name != key}, cls._fields
    for name in given:
        if name not in needed:
            expected = listed(needed) if needed else "none"
            raise SceneError(f"{where}.{name}: unknown key, expected {expected}{closest(name, needed)}")
    for name in needed:
        if name not in given and name not in cls._field_defaults:
            raise SceneError(f"{where}.{name}: expected a number, got nothing; add {name} = ...")
    made: WallLaw = cls(**given)
    return made


def _no_law(where: str, given: Any) -> Any:
    raise SceneError(f'{where}: expected a table such as {{ kind = "lambert" }}, got {given!r:.200}')


def table_of_law(law: Any) -> Any:
    """The table of a built-in law. Of a user-defined law it is the name, as a file cannot hold its code."""
    kinds = {cls: kind for kind, cls in ALL_LAWS.items()}
    if type(law) not in kinds:
        return law if isinstance(law, str) else repr(law)
    return {"kind": kinds[type(law)], **{name: value for name, value in law._asdict().items() if value is not None}}


def table_of_group(group: Mapping[str, Any]) -> dict[str, Any]:
    """The table of a group of a mesh."""
    laws = {"laws": [table_of_law(law) for law in group["laws"]]} if "laws" in group else {}
    return {**group, **laws}
