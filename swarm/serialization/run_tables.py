"""Counters to and from plain tables, and sources from them."""

import tomllib
from collections.abc import Iterable, Mapping
from typing import Any

import tomli_w

from ..common.checks import known_keys, located
from ..errors import SceneError
from ..scene import Scene
from ..sources.source import Source
from ..surfaces.counter import Counter
from .tables import convert, opening_of, surface_of, table_of


def counters_text(counters: Iterable[Counter]) -> str:
    """Counters as TOML text; "" without counters."""
    made = [counter_table(one) for one in counters]
    return tomli_w.dumps({"counter": made}) if made else ""


def counter_table(counter: Counter) -> dict[str, Any]:
    """The table of a counter."""
    inside = {} if counter.inside is None else {"inside": table_of(counter.inside)}
    return {"surface": table_of(counter.surface), **inside}


def counters_of(given: Any) -> tuple[Counter, ...]:
    """The counters of a text of `counters_text`, or of [[counter]] tables."""
    given = tomllib.loads(given).get("counter", []) if isinstance(given, str) else given
    return tuple(_counter_of(table, f"counter[{k}]") for k, table in enumerate(_tables("counter", given)))


def _counter_of(table: Any, where: str) -> Counter:
    keys = "surface", "inside"
    if not isinstance(table, Mapping) or "surface" not in table:
        raise SceneError(
            f"{where}.surface: expected the table of a surface, got nothing; add surface = {{ kind = ... }}"
        )
    known_keys(f"{where}.", table, keys)
    made = {key: surface_of(table[key], f"{where}.{key}") for key in keys if key in table}
    try:
        return Counter(**made)
    except SceneError as error:
        raise SceneError(located(where, error)) from None


def sources_of(given: Any, scene: Scene) -> tuple[Source, ...]:
    """The sources of [[source]] tables in a scene."""
    return tuple(_source_of(table, f"source[{k}]", scene) for k, table in enumerate(_tables("source", given)))


def _source_of(table: Any, where: str, scene: Scene) -> Source:
    if isinstance(table, Mapping):
        places = {key: _place_of(table[key], f"{where}.{key}", scene) for key in ("where", "within") if key in table}
        table = {**table, **places}
    return convert(table, Source, where)


def _place_of(given: Any, where: str, scene: Scene) -> Any:
    """A surface, from its table or its number in a scene, or an opening of a surface or a part by their numbers."""
    if not isinstance(given, Mapping):
        return given
    if "opening" not in given or "kind" in given:
        return opening_of(given, where)
    known_keys(f"{where}.", given, ("surface", "part", "opening"))
    if "surface" not in given:
        raise SceneError(f"{where}.surface: expected the number of a surface of the scene, got nothing")
    surface = _numbered(f"{where}.surface", given["surface"], scene.surfaces)
    places = given.get("part", [])
    for k in places if isinstance(places, list) else [places]:
        surface = _numbered(f"{where}.part", k, getattr(surface, "parts", ()))
    return _numbered(f"{where}.opening", given["opening"], surface.openings)


def _numbered(where: str, number: Any, known: Any) -> Any:
    if isinstance(number, bool) or not isinstance(number, int) or not 0 <= number < len(known):
        there = f"a number from 0 to {len(known) - 1}" if known else "no value, for there is nothing to choose from"
        raise SceneError(f"{where}: expected {there}, got {number!r:.200}")
    return known[number]


def _tables(key: str, given: Any) -> list[Any]:
    if not isinstance(given, list):
        raise SceneError(f"{key}: expected [[{key}]] tables, got {given!r:.200}")
    return given
