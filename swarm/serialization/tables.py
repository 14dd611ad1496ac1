"""Surfaces, scenes and methods to and from plain tables, the form that scene files and trajectories hold.

Every error names the key by its full path, such as surface[1].radius.
"""

import dataclasses
import hashlib
import re
from collections.abc import Iterator, Mapping
from typing import Any, TypeVar

import msgspec
import numpy as np
from numpy.typing import NDArray

from ..common.checks import known_keys, listed, located, one_of, shown
from ..common.validated import bare, is_left_out
from ..errors import SceneError
from ..methods import ALL_METHODS, Method
from ..motion import table_of as motion_table
from ..pairs import Pairs
from ..scene import Scene
from ..surfaces import ALL_SURFACES, Surface
from ..surfaces.laws import ALL_LAWS
from ..surfaces.presence.doors import Opening
from ..surfaces.wall_law import WallLaw
from . import plugins

T = TypeVar("T")
# Keys of a surface's table with tables of surfaces.
NESTED = ("openings", "part")
# Keys of a document that name files.
FILES = ("from", "file")
# Types of msgspec in the words of TOML.
_WORDS = {
    "float": "a number", "int": "a whole number", "str": "a text", "bool": "true or false", "array": "a list",
    "object": "a table",
}  # fmt: skip
# Keys that belong to another table, and their place.
_ELSEWHERE = {
    **{key: f"; {key} belongs at the top, before the first table" for key in ("gravity", "period", "plane")},
    **dict.fromkeys(("position", "velocity"), '; places and velocities are in a file: from = "start.csv"'),
    "density": "; give the mass of each [kg] in its place",
    **{key: f"; {key} is a key of [method]" for key in ("dt", "penalty")},
}
# A longer array is not written as text: HDF5 loses texts of 100 MB, and a million balls take 10 s to write.
_LONG, _ARRAY = 1000, "sha256:"


def texts_in(document: Any) -> Iterator[tuple[str, str]]:
    """The texts of a document, and of all its tables and lists, each with its key or its index."""
    for key, value in document.items() if isinstance(document, dict) else enumerate(document):
        if isinstance(value, (dict, list)):
            yield from texts_in(value)
        elif isinstance(value, str):
            yield str(key), value


def files_in(document: Any) -> Iterator[str]:
    """The names of the files of a document, which are a part of its content."""
    return (text for key, text in texts_in(document) if key in FILES)


def scene_of(surfaces: Any, gravity: Any, period: Any = None, plane: Any = None, pairs: Any = None) -> Scene:
    """A scene from its tables: a list of surface tables; gravity, the period, the plane and the pairs, or None."""
    # A scene of balls needs no surface.
    surfaces = [] if surfaces is None else surfaces
    if not isinstance(surfaces, list):
        raise SceneError(
            "surface: expected [[surface]] tables, one for each surface, got "
            + ("a table [surface]; write it in double brackets" if isinstance(surfaces, Mapping) else shown(surfaces))
        )
    built = [surface_of(table, f"surface[{i}]") for i, table in enumerate(surfaces)]
    met = None if pairs is None else convert(pairs, Pairs, "pairs")
    return Scene(surfaces=built, gravity=gravity, period=period, plane=plane, pairs=met)


def surface_of(table: Any, where: str) -> Surface:
    """A surface from its table, which may have tables of its openings and parts."""
    for key in NESTED if isinstance(table, Mapping) else ():
        if key in table:
            given = table[key]
            if not isinstance(given, list):
                raise SceneError(f"{where}.{key}: expected [[surface.{key}]] tables, got {given!r:.200}")
            made = opening_of if key == "openings" else surface_of
            table = {**table, key: [made(one, f"{where}.{key}[{k}]") for k, one in enumerate(given)]}
    return of_kind(with_laws(table, where), where, ALL_SURFACES, Surface)


def opening_of(table: Any, where: str) -> Surface | Opening:
    """An opening from its table, which may have keys besides those of a surface."""
    mine = {key: table[key] for key in ("times", "between") if key in table} if isinstance(table, Mapping) else {}
    if not mine:
        return surface_of(table, where)
    surface = surface_of({key: value for key, value in table.items() if key not in mine}, where)
    try:
        return Opening(surface, **mine)
    except SceneError as error:
        raise SceneError(located(where, error)) from None


def method_of(table: Any) -> Method:
    """A method from its table."""
    return of_kind(table, "method", ALL_METHODS, Method)


class NamedMethod(Method):
    """A user-defined method as a file holds it, by name and numbers: its runs can be read without its code."""

    def numbers(self, scene: Scene) -> Any:
        """Raise a `SceneError`, since it cannot run."""
        name = type(self).__name__
        raise SceneError(f"method must be made by its class to run, got the name of a user-defined one, {name}")


def method_by_name(table: dict[str, Any]) -> Method:
    """A method from its table; a `NamedMethod`, which cannot run, for a user-defined one that is not allowed."""
    module, colon, name = str(table.get("kind")).partition(":")
    if not colon or plugins.is_allowed(module):
        return method_of(table)
    given = {key: value for key, value in table.items() if key != "kind"}
    # The name of a class in a function is `function.<locals>.Name`.
    named = dataclasses.make_dataclass(
        name.rpartition(".")[2], given, bases=(NamedMethod,), namespace={"__module__": module}, frozen=True
    )
    made: Method = named(**given)
    return made


def table_of(described: Surface | Method, arrays: dict[str, Any] | None = None) -> dict[str, Any]:
    """The table of a surface or a method: its kind, and every argument that is not None.

    For a long array it has a digest as name, under which `arrays` get it; with None, it has the numbers.
    """
    if own := getattr(described, "table", None):  # of an OwnSurface
        return _with_nested(own(), described, arrays)
    given = _given(described).items()
    table = {key: _written(value, arrays) if isinstance(value, np.ndarray) else value for key, value in given}
    mine = type(described)
    kind = ALL_SURFACES.kind_of(mine) or ALL_METHODS.kind_of(mine) or f"{mine.__module__}:{mine.__qualname__}"
    return _with_nested({"kind": kind, **table}, described, arrays)


def _given(described: Any) -> dict[str, Any]:
    """The fields of a dataclass that files have, by their keys; TOML has no None."""
    fields = [field for field in kept_fields(type(described)) if not is_left_out(described, field)]
    given = {field.metadata.get("key", field.name): getattr(described, field.name) for field in fields}
    return {key: value for key, value in given.items() if value is not None}


def _with_nested(table: dict[str, Any], described: Surface | Method, arrays: dict[str, Any] | None) -> dict[str, Any]:
    """The table of a surface, with the tables of its motion, openings and parts, and the names of user-defined laws."""
    if isinstance(described, Surface):
        del table["openings"], table["laws"]
        if described.motion is not None:
            table["motion"] = motion_table(described.motion)
        if described.laws:
            table["laws"] = [table_of_law(law) for law in described.laws]
        if isinstance(table.get("groups"), Mapping):
            table["groups"] = {name: table_of_group(group) for name, group in table["groups"].items()}
        if described.openings:
            table["openings"] = [table_of_opening(opening, arrays) for opening in described.openings]
        if "part" in table:
            table["part"] = [table_of(part, arrays) for part in table["part"]]
    return table


def table_of_opening(opening: Surface | Opening, arrays: dict[str, Any] | None) -> dict[str, Any]:
    """The table of an opening."""
    if isinstance(opening, Surface):
        return table_of(opening, arrays)
    mine = {"times": opening.times, "between": opening.between or None}
    return {**table_of(opening.surface, arrays), **{key: value for key, value in mine.items() if value is not None}}


def _written(values: NDArray[Any], arrays: dict[str, Any] | None) -> Any:
    if arrays is None or values.size <= _LONG:
        return values.tolist()
    name = _ARRAY + hashlib.sha256(repr((values.shape, values.dtype.str)).encode() + values.tobytes()).hexdigest()
    arrays[name] = values
    return name


def with_arrays(table: dict[str, Any], arrays: Mapping[str, Any]) -> dict[str, Any]:
    """A surface's table with the long arrays that it names.

    Raises:
        SceneError: it names a file, as no trajectory does: reading it could open any file of the machine.
    """
    named = {key for key, value in table.items() if isinstance(value, str) and value.startswith(_ARRAY)}
    held = {key: np.asarray(arrays[value]) if key in named else value for key, value in table.items()}
    for key, what in (("values", "the samples"), ("vertices", "the corners")):
        if isinstance(held.get(key), str):
            raise SceneError(f"surface.{key}: expected {what}, got {held[key]!r:.80}; a trajectory names no file")
    for key in NESTED:
        if key in held:
            held[key] = [with_arrays(one, arrays) for one in held[key]]
    return held


def scene_table(scene: Scene, arrays: dict[str, Any] | None = None) -> dict[str, Any]:
    """The tables of a scene; `arrays` as for `table_of`."""
    gravity = {} if scene.gravity is None else {"gravity": scene.gravity}
    period = {} if scene.period is None else {"period": [length or False for length in scene.period]}
    plane = {} if scene.plane is None else {"plane": scene.plane}
    pairs = {} if scene.pairs is None else {"pairs": _given(scene.pairs)}
    return {**gravity, **period, **plane, **pairs, "surface": [table_of(surface, arrays) for surface in scene.surfaces]}


def kept_fields(cls: type[Any]) -> list[dataclasses.Field[Any]]:
    """The fields of a dataclass that files have: neither options of a session nor computed fields."""
    return [field for field in dataclasses.fields(cls) if field.metadata.get("in_file", True)]


def convert(table: Any, cls: type[T], where: str) -> T:
    """A dataclass from a table: no unknown key, no missing one, every value of its type."""
    if not isinstance(table, Mapping):
        raise SceneError(f"{where}: expected a table, got {table!r}")
    names = {field.metadata.get("key", field.name): field for field in kept_fields(cls)}
    known_keys(f"{where}.", table, names, _ELSEWHERE)
    for key, field in names.items():
        if field.default is dataclasses.MISSING and key not in table:
            raise SceneError(f"{where}.{key}: expected {_type_name(field.type)}, got nothing; add {key} = ...")
    try:
        return msgspec.convert({names[key].name: value for key, value in table.items()}, cls)
    except msgspec.ValidationError as error:
        raise SceneError(
            _sentence(str(error), where, table, {field.name: key for key, field in names.items()})
        ) from None


def of_kind(table: Any, where: str, kinds: Mapping[str, type[T]], base: type[Any] | None = None) -> T:
    """A dataclass from a table with a kind: one of `kinds`, or code derived from `base`."""
    if not isinstance(table, Mapping):
        raise SceneError(f"{where}: expected a table with a kind, got {table!r}")
    if "kind" not in table:
        raise SceneError(f"{where}.kind: expected one of {listed(kinds)}, got nothing")
    if table["kind"] == "own":
        raise SceneError(
            f"{where}.kind: 'own' is a phi in Python, which no file holds; build the scene in Python, as the run's "
            "script does"
        )
    if base is not None and plugins.is_named(table["kind"]):
        cls = plugins.class_of(f"{where}.kind", table["kind"], base, f"a {base.__name__.lower()}")
    else:
        cls = kinds[one_of(f"{where}.kind", table["kind"], kinds)]
    made: T = convert({key: value for key, value in table.items() if key != "kind"}, cls, where)
    return made


def _type_name(kind: Any) -> str:
    kind = bare(kind)
    if "..." in str(kind):
        return "a list"
    return {"float": "a number", "int": "a whole number", "Vector": "three numbers"}.get(
        getattr(kind, "__name__", str(kind)), "three numbers" if "tuple" in str(kind) else "a value"
    )


def _sentence(message: str, where: str, table: Mapping[str, Any], keys: Mapping[str, str]) -> str:
    """A message of msgspec, "Expected `float`, got `str` - at `$.radius`", with the key first, and the value."""
    match = re.fullmatch(r"(.*?)(?: - at `\$\.?(.*)`)?", message)
    assert match is not None
    reason, path = match.groups()
    if not path:
        # From our own checks, which begin with the argument's name.
        return located(where, reason)
    name = re.split(r"[.\[]", path)[0]
    key = keys.get(name, name)
    path = key + path.removeprefix(name)
    value = f" (in {key} = {table[key]!r})" if key in table else ""
    reason = re.sub(r"`([^`]*)`", lambda types: _in_words(types[1]), reason)
    unit = isinstance(table.get(key), str) and reason.startswith("Expected a number, got a text")
    hint = "; numbers have no unit: lengths are in m, times in s, masses in kg, energies in J" if unit else ""
    return f"{where}.{path}: {reason[0].lower()}{reason[1:]}{value}{hint}"


def _in_words(types: str) -> str:
    """A type in words: `float | array | null` is "a number or a list"; other words stay."""
    return " or ".join(_WORDS.get(one, one) for one in types.split(" | ") if one != "null") or "nothing"


def with_laws(table: Any, where: str) -> Any:
    """The table of a surface with its laws, and those of groups of a mesh, as objects or, if user-defined, names."""
    if not isinstance(table, Mapping):
        return table
    if isinstance(table.get("laws"), list):
        table = {**table, "laws": [_law_of(one, f"{where}.laws[{k}]") for k, one in enumerate(table["laws"])]}
    if isinstance(table.get("groups"), Mapping):
        groups = {name: with_laws(group, f"{where}.groups.{name}") for name, group in table["groups"].items()}
        table = {**table, "groups": groups}
    return table


def _law_of(table: Any, where: str) -> WallLaw | str:
    """A law of a wall from its table: of a built-in kind, or of code that the caller allows."""
    if isinstance(table, str) and "(" in table:
        return table  # a trajectory has the text of an object of user-defined code
    if not isinstance(table, Mapping):
        raise SceneError(f'{where}: expected a table such as {{ kind = "lambert" }}, got {table!r:.200}')
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
    known_keys(f"{where}.", given, needed)
    for name in needed:
        if name not in given and name not in cls._field_defaults:
            raise SceneError(f"{where}.{name}: expected a number, got nothing; add {name} = ...")
    made: WallLaw = cls(**given)
    return made


def table_of_law(law: Any) -> Any:
    """The table of a built-in law; the name of a user-defined law, since a file cannot hold its code."""
    kind = ALL_LAWS.kind_of(type(law))
    if kind is None:
        return law if isinstance(law, str) else repr(law)
    return {"kind": kind, **{name: value for name, value in law._asdict().items() if value is not None}}


def table_of_group(group: Mapping[str, Any]) -> dict[str, Any]:
    """The table of a group of a mesh."""
    laws = {"laws": [table_of_law(law) for law in group["laws"]]} if "laws" in group else {}
    return {**group, **laws}
