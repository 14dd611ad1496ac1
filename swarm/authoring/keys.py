"""The keys of scene and sweep files, from the declarations that read them: form, default and meaning of each.

A form is a JSON Schema. That of a key follows from the type of its field and from the check that the field declares; a
field of a class of its own, such as a motion, has its form here.
"""

import dataclasses
import functools
import operator
import types
import typing
from collections.abc import Mapping
from typing import Any, NamedTuple

from ..bodies import table as body_table
from ..bodies.body import Body
from ..bodies.copies import Bodies
from ..bodies.elastic import block, elastic
from ..bodies.placing import place
from ..common import checks
from ..methods import ALL_METHODS
from ..motion.wall import KINDS as ALL_MOTIONS
from ..pairs import Pairs
from ..placing.filling import fill
from ..run.options import RunOptions
from ..run.simulation import simulate
from ..scene import Scene
from ..scene_file import BodiesFile, ParticlesTable
from ..serialization.tables import kept_fields
from ..sources.source import Source
from ..surfaces import ALL_FIELDS, ALL_SURFACES
from ..surfaces.counter import Counter
from ..surfaces.laws import ALL_LAWS
from ..surfaces.presence.doors import Opening
from ..surfaces.surface import SIDES, Surface
from .docstrings import first_line, meanings_of

Form = dict[str, Any]

NUMBER: Form = {"type": "number"}
INTEGER: Form = {"type": "integer"}
TEXT: Form = {"type": "string"}
# Code of a user, named in a file.
CODE: Form = {"type": "string", "pattern": r"^[A-Za-z_][\w.]*:[A-Za-z_]\w*$"}
LENGTH: Form = {"type": "number", "minimum": checks.SMALLEST, "maximum": checks.LARGEST}
NOT_NEGATIVE: Form = {"type": "number", "minimum": 0}


def listed(form: Form, least: int = 0, most: int | None = None) -> Form:
    """Return the form of a list."""
    return {"type": "array", "items": form, "minItems": least} | ({} if most is None else {"maxItems": most})


def either(*forms: Form) -> Form:
    """Return the form of a value that has one of several forms."""
    return forms[0] if len(forms) == 1 else {"anyOf": list(forms)}


def named(name: str) -> Form:
    """Return a form by its name in the schema."""
    return {"$ref": f"#/$defs/{name}"}


VECTOR = listed(NUMBER, 3, 3)
ROWS = listed(VECTOR, 1)
NUMBERS = either(NUMBER, listed(NUMBER, 1))
PART: Form = NOT_NEGATIVE | {"maximum": 1}
COUNT: Form = {"type": "integer", "minimum": 1}
SPANS = listed(listed(NUMBER, 2, 2), 1)

# The forms of checks, with the keywords of a partial one.
_CHECKED: dict[Any, Any] = {
    checks.number: lambda **_words: NUMBER,
    checks.positive: lambda: {"type": "number", "exclusiveMinimum": 0},
    checks.at_least: lambda bound: {"type": "number", "minimum": bound},
    checks.length: lambda: LENGTH,
    checks.magnitude: lambda: NOT_NEGATIVE | {"maximum": checks.LARGEST},
    checks.positive_magnitude: lambda: {"type": "number", "exclusiveMinimum": 0, "maximum": checks.LARGEST},
    checks.bounded: lambda: {"type": "number", "minimum": -checks.LARGEST, "maximum": checks.LARGEST},
    checks.part: lambda least=0.0: PART | {"minimum": least},
    checks.count: lambda least=1: {"type": "integer", "minimum": least},
    checks.seed: lambda: {"type": "integer", "minimum": 0, "exclusiveMaximum": 2**64},
    checks.flag: lambda: {"type": "boolean"},
    checks.vector: lambda: VECTOR,
    checks.three_lengths: lambda: listed(LENGTH, 3, 3),
    checks.one_of: lambda choices: {"enum": list(choices)},
}
_PLAIN: dict[Any, Form] = {float: NUMBER, int: INTEGER, str: TEXT, bool: {"type": "boolean"}}
# The forms of keys with a check of their own in their fields, or with values that are checked together.
_OF_KEYS: dict[str, Form] = {
    "side": {"enum": list(SIDES)},
    "rotation": either(
        listed(NUMBER, 4, 4),
        listed(listed(NUMBER, 3, 3), 3, 3),
        {"type": "object", "properties": {"axis": VECTOR, "angle": NUMBER}, "required": ["axis", "angle"],
         "additionalProperties": False},
    ),
    "motion": either(named("motion"), listed(named("motion"), 1)),
    "laws": listed(named("law")),
    "openings": listed(named("opening")),
    "part": listed(named("surface"), 1),
    "present": SPANS,
    "times": SPANS,
    "centers": ROWS,
    "radii": NUMBERS,
    "lengths": NUMBERS,
    "axes": either(VECTOR, ROWS),
    "rotations": either(
        listed(NUMBER, 4, 4),
        listed(listed(NUMBER, 4, 4), 1),
        listed(listed(NUMBER, 3, 3), 3, 3),
        listed(listed(listed(NUMBER, 3, 3), 3, 3), 1),
    ),
    "outline": listed(listed(NUMBER, 2, 3), 1),
    "values": either(listed(listed(listed(NUMBER, 1), 1), 1), TEXT),
    "triangles": listed(listed(INTEGER, 3, 3), 1),
    "groups": {"type": "object", "additionalProperties": named("group")},
    "group": listed(INTEGER),
    "names": listed(TEXT),
    "spacing": either(LENGTH, listed(LENGTH, 3, 3)),
    "size": LENGTH,
    "trajectory": TEXT,
    "recording": TEXT,
    "impacts": TEXT,
    "impact_particles": either({"const": "all"}, COUNT, listed({"type": "integer", "minimum": 0}, 1)),
    "beam": VECTOR,
    "spin": either(NOT_NEGATIVE, VECTOR),
    "radius": either(LENGTH, listed(LENGTH, 2, 2)),
    "within": either(named("opening"), named("opening_of_surface")),
    "where": either({"type": "integer", "minimum": 0}, named("opening"), named("opening_of_surface")),
    "strain": {"type": "object"},
    "anchors": listed({"type": "object", "required": ["point"]}),
    "guides": listed({"type": "object", "required": ["point", "surface"]}),
    "cavities": listed({"type": "object", "required": ["surface", "carrier", "point"]}),
}  # fmt: skip
# The forms of keys with another meaning in a class.
_OF_CLASS: dict[tuple[str, str], Form] = {
    ("Box", "open"): listed({"enum": [sign + axis for axis in "xyz" for sign in "+-"]}),
    ("Mesh", "open"): {"type": "boolean"},
    ("Mesh", "vertices"): listed(VECTOR, 4),
    ("Polygon", "vertices"): listed(listed(NUMBER, 2, 3), 1),
    ("Boxes", "half_widths"): either(VECTOR, ROWS),
    ("Ellipsoids", "semi_axes"): either(VECTOR, ROWS),
    ("RunOptions", "frames"): either({"enum": ["all", "none"]}, COUNT),
    ("Source", "mass"): LENGTH,
    ("Source", "density"): LENGTH,
    ("Source", "times"): listed(NUMBER, 1),
    ("ParticlesTable", "radius"): NUMBERS,
    ("ParticlesTable", "within"): named("place"),
    ("Path", "times"): listed(NUMBER, 2),
    ("Opening", "times"): SPANS,
    ("Counter", "surface"): named("place"),
    ("Counter", "inside"): named("place"),
    ("Absorb", "probability"): PART,
    ("Absorb", "loss"): PART,
    ("CercignaniLampis", "normal"): PART,
    ("CercignaniLampis", "tangential"): NOT_NEGATIVE | {"maximum": 2},
}
# The numbers of laws and bodies are checked together; these are never below 0.
_NOT_NEGATIVE = "barrier", "density", "edge", "length", "mass", "speed", "spin", "temperature", "time", "young"


class TableKey(NamedTuple):
    """A key of a table.

    Attributes:
        name: its name in the file.
        form: its form, a JSON Schema.
        needed: whether the table needs the key.
        default: the value if it is left out.
        meaning: its meaning in words.
    """

    name: str
    form: Form
    needed: bool = False
    default: Any = None
    meaning: str = ""


class Table(NamedTuple):
    """A table of a scene file, or one of its kinds.

    Attributes:
        place: the table, such as "surface".
        kind: the value of its key kind, or "".
        meaning: its meaning in words.
        keys: its own keys, without the kind.
    """

    place: str
    kind: str
    meaning: str
    keys: tuple[TableKey, ...]


def form_of(kind: Any, owner: str, name: str) -> Form:
    """The form of a field of a class, from its annotation; that of any value if it has no other."""
    if (owner, name) in _OF_CLASS:
        return _OF_CLASS[owner, name]
    found = _form(kind)
    if found is None:
        return _OF_KEYS.get(name, {})
    return _OF_KEYS[name] if found == TEXT and name == "side" else found


def _form(kind: Any) -> Form | None:
    """The form of an annotation; None if it is too general."""
    if hasattr(kind, "__metadata__"):
        for check in filter(callable, kind.__metadata__):
            words = check.keywords if isinstance(check, functools.partial) else {}
            made = _CHECKED.get(getattr(check, "func", check))
            if made is not None:
                return dict(made(**words))
        return _form(kind.__origin__)
    origin, inner = typing.get_origin(kind), typing.get_args(kind)
    if origin in (types.UnionType, typing.Union):
        forms = [_form(one) for one in inner if one is not type(None)]
        return None if None in forms else either(*typing.cast("list[Form]", forms))
    if origin in (tuple, list):
        rest = inner[0] if origin is list or inner[-1] is Ellipsis else None
        if rest is not None:
            return None if (form := _form(rest)) is None else listed(form)
        parts = [_form(one) for one in inner]
        if all(part == parts[0] for part in parts):
            return None if parts[0] is None else listed(parts[0], len(parts), len(parts))
        return {"type": "array", "prefixItems": parts, "items": False, "minItems": len(parts)}
    if origin is dict:
        return {"type": "object", "additionalProperties": _form(inner[1]) or {}}
    return _PLAIN.get(kind)


def keys_of(cls: type[Any], meanings: Mapping[str, str] | None = None) -> tuple[TableKey, ...]:
    """The keys of a class for objects from tables, with their `meanings`, or those of its docstring."""
    known, found = meanings_of(cls) if meanings is None else meanings, []
    for field in kept_fields(cls):
        name = field.metadata.get("key", field.name)
        default = None if field.default is dataclasses.MISSING else field.default
        needed = field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING
        meaning = known.get(name, "") or known.get(field.name, "") or _MORE.get(name, "")
        found.append(TableKey(name, form_of(field.type, cls.__name__, name), needed, default, meaning))
    return tuple(found)


# The meanings of keys that only files have.
_MORE = {
    "count": "how many, 1 or more.",
    "from": "a file beside the scene file that holds them.",
    "frame": "of a trajectory: the number of the frame; -1 is the last one.",
    "fraction": "the part of the volume that balls fill, as of pack; without a count so many as fit.",
    "part": "the parts, surfaces.",
    "mesh_error": "written by from_mesh: how far the samples are off the mesh at most [m].",
    "mesh_weld": "written with a mesh: how far a corner was moved at most [m].",
}
_FILE = TableKey("file", TEXT, meaning="a file beside the scene file.")


@functools.cache
def tables() -> tuple[Table, ...]:
    """All tables of a scene file, in the order of the guide; a table with kinds is there once for each kind."""
    placed = meanings_of(fill)
    runs = meanings_of(simulate)
    common = Table("surface", "", "keys of every surface.", keys_of(Surface))
    return (
        Table("", "", "keys at the top, before the first table.", _top()),
        Table("particles", "", "the particles of the start.", keys_of(ParticlesTable, placed)),
        Table("body", "", "the bodies of the start, from a file.", keys_of(BodiesFile, {})),
        *(_body(kind, cls) for kind, cls in body_table.KINDS.items()),
        common,
        *(_surface(kind, cls, common) for kind, cls in ALL_SURFACES.items()),
        *_kinds("surface.motion", ALL_MOTIONS),
        *(_law(kind, cls) for kind, cls in ALL_LAWS.items()),
        Table("surface.openings", "", "keys of an opening besides those of its surface.", keys_of(Opening)[1:]),
        Table("pairs", "", first_line(Pairs), keys_of(Pairs)),
        *_kinds("method", ALL_METHODS),
        Table("source", "", first_line(Source), keys_of(Source)),
        Table("counter", "", first_line(Counter), keys_of(Counter)),
        Table("run", "", "the length of the run, its files, and how it is carried out.", _run(runs)),
    )


def _kinds(place: str, kinds: Mapping[str, Any]) -> tuple[Table, ...]:
    return tuple(Table(place, kind, first_line(cls), keys_of(cls)) for kind, cls in kinds.items())


def _top() -> tuple[TableKey, ...]:
    known = meanings_of(Scene)
    lengths = {"anyOf": [{"type": "number", "exclusiveMinimum": 0}, {"const": False}]}
    return (
        TableKey("gravity", VECTOR, meaning=known["gravity"]),
        TableKey("period", listed(lengths, 3, 3), meaning=f"{known['period']} In a file false in place of None."),
        TableKey("plane", {"enum": ["x", "y", "z"]}, meaning=known["plane"]),
    )


def _run(known: Mapping[str, str]) -> tuple[TableKey, ...]:
    code = {"type": "object", "additionalProperties": CODE}
    own = TableKey("observables", code, meaning='user-defined observables by their names, "module:function".')
    return (*keys_of(RunOptions, known), own)


def _surface(kind: str, cls: type[Surface], common: Table) -> Table:
    mine = {key.name for key in common.keys}
    keys = [key for key in keys_of(cls) if key.name not in mine]
    if kind in ALL_FIELDS:
        keys.insert(
            0, TableKey("from", TEXT, meaning="a .csv file that holds them, a row each, in place of the arrays.")
        )
    if kind in ("sampled", "mesh"):
        keys.insert(0, _FILE)
    if kind == "mesh":
        keys.append(
            TableKey("spacing", _OF_KEYS["spacing"], meaning="of samples in place of triangles, see `from_mesh`.")
        )
    return Table("surface", kind, first_line(cls), tuple(keys))


def _body(kind: str, cls: type[Any]) -> Table:
    makers = _MAKERS.get(kind) or (cls.maker,)
    known = functools.reduce(operator.or_, map(meanings_of, (place, *makers)))
    keys = (key._replace(form=_bounded(key.name)) if key.form == NUMBER else key for key in keys_of(cls, known))
    return Table("body", kind, first_line(makers[-1]), tuple(keys))


# The functions with the arguments of kinds of [body] that have no single maker.
_MAKERS: dict[str, tuple[Any, ...]] = {"elastic": (block, elastic), "points": (Bodies, Body)}


def _bounded(name: str) -> Form:
    """Return the form of a number of a body or a law."""
    return NOT_NEGATIVE if name in _NOT_NEGATIVE else NUMBER


def _law(kind: str, cls: Any) -> Table:
    known = meanings_of(cls)
    keys = tuple(
        TableKey(
            name,
            _OF_CLASS.get((cls.__name__, name), _bounded(name)),
            name not in cls._field_defaults,
            cls._field_defaults.get(name),
            known.get(name, ""),
        )
        for name in cls._fields
    )
    return Table("surface.laws", kind, first_line(cls), keys)
