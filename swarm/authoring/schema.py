"""A JSON Schema of scene files, and of sweep files, made from their keys, for editors that complete and check files."""

from typing import Any

from ..fleet.plan import COMBINE, MAKERS, WAYS
from ..scene_file import SWEEP
from ..surfaces import ALL_FIELDS, ALL_SURFACES
from ..surfaces.facets.mesh import LAWS_OF_GROUPS
from .keys import CODE, INTEGER, Form, Table, either, listed, named, tables

# JSON Schema, draft 2020-12.
DIALECT = "https://json-schema.org/draft/2020-12/schema"
# Tables of which user code may replace the kind.
_OWN_KINDS = ("surface", "method")
# Keys of [particles] that go with a file.
_OF_FILES = ("from", "frame")


def schema_of(sweep: bool = False) -> Form:
    """The schema of scene files; in that of sweep files, [sweep] may give keys that other tables lack.

    >>> sorted(schema_of()["required"]), sorted(schema_of(sweep=True)["required"])
    (['run'], ['sweep'])
    """
    known = {(table.place, table.kind): table for table in tables()}
    definitions = _definitions(known)
    what = "sweep" if sweep else "scene"
    made: Form = {
        "$schema": DIALECT,
        "title": f"swarm {what} file",
        "description": f"A {what} file of swarm, in TOML. SI units; nothing is converted.",
        "type": "object",
        "properties": {
            **_properties(known["", ""]),
            "pairs": _object(known["pairs", ""]),
            "particles": named("particles"),
            "body": named("body"),
            "source": listed(named("source"), 1),
            "counter": listed(named("counter"), 1),
            "surface": listed(named("surface")),
            "method": named("method"),
            "run": _object(known["run", ""]),
        },
        "required": ["run"],
        "anyOf": [{"required": [name]} for name in ("particles", "body", "source")],
        "not": {"required": ["particles", "body"]},
        "additionalProperties": False,
        "$defs": definitions,
    }
    if not sweep:
        return made
    loose: Form = _without_needs(made)
    loose["properties"][SWEEP] = _sweep()
    loose["required"] = [SWEEP]
    loose["$defs"]["sweep_values"] = _sweep_values()
    return loose


def _definitions(known: dict[tuple[str, str], Table]) -> Form:
    common = known["surface", ""]
    # A surface that is no wall has the default values of these keys; its rotation is that of its place.
    bare: Form = {
        key.name: {"const": key.default} if isinstance(key.default, float) else False
        for key in common.keys if key.name != "rotation"
    }  # fmt: skip
    group = {key.name: key.form for key in common.keys if key.name in LAWS_OF_GROUPS}
    made: Form = {
        "surface_keys": {"properties": _properties(common)},
        "surface": _one_of(known, "surface") | {"unevaluatedProperties": False},
        "place": _one_of(known, "surface") | {"properties": bare, "unevaluatedProperties": False},
        "opening": _one_of(known, "surface")
        | {"properties": bare | _properties(known["surface.openings", ""]), "unevaluatedProperties": False},
        "opening_of_surface": _only(
            {"surface": INTEGER, "part": either(INTEGER, listed(INTEGER)), "opening": INTEGER}, "surface", "opening"
        ),
        "group": _only(group),
        "motion": _one_of(known, "surface.motion"),
        "law": _one_of(known, "surface.laws")
        | {"oneOf": [*_one_of(known, "surface.laws")["oneOf"], _own("law")]},
        "method": _one_of(known, "method"),
        "particles": _particles(known["particles", ""]),
        "body": _one_of(known, "body") | {"oneOf": [*_one_of(known, "body")["oneOf"], _object(known["body", ""])]},
        "source": _object(known["source", ""])
        | {"anyOf": [{"required": [name]} for name in ("rate", "times", "count")]},
        "counter": _object(known["counter", ""]),
    }  # fmt: skip
    for (place, kind), table in known.items():
        if kind:
            made[f"{place}.{kind}"] = _surface(kind, table) if place == "surface" else _object(table)
    return made


def _one_of(known: dict[tuple[str, str], Table], place: str) -> Form:
    """The form of a table of a kind of `place`, or of user code."""
    kinds = [named(f"{place}.{kind}") for at, kind in known if at == place and kind]
    return {"type": "object", "oneOf": [*kinds, *([_own("kind")] if place in _OWN_KINDS else [])]}


def _own(key: str) -> Form:
    return {"type": "object", "properties": {key: CODE}, "required": [key], "unevaluatedProperties": True}


def _properties(table: Table) -> Form:
    """The forms of keys, with their meanings."""
    kinds = {"kind": {"const": table.kind, "description": table.meaning}} if table.kind else {}
    meanings = {key.name: {**key.form, **({"description": key.meaning} if key.meaning else {})} for key in table.keys}
    return kinds | meanings


def _object(table: Table) -> Form:
    needed = [*(["kind"] if table.kind else []), *(key.name for key in table.keys if key.needed)]
    return _only(_properties(table), *needed)


def _only(properties: Form, *needed: str) -> Form:
    made = {"type": "object", "properties": properties, "additionalProperties": False}
    return made | ({"required": list(needed)} if needed else {})


def _surface(kind: str, table: Table) -> Form:
    """A kind of surface: its own keys and the common ones; a key that may come from a file is not needed with one."""
    cls = ALL_SURFACES[kind]
    needed = [key.name for key in table.keys if key.needed]
    needs: Form = {"required": ["kind", *needed]}
    if kind in ALL_FIELDS:
        needs = {"required": ["kind"], "anyOf": [{"required": ["from"]}, {"required": needed}]}
    elif kind == "mesh":
        needs = {"required": ["kind"], "oneOf": [{"required": ["file"]}, {"required": ["vertices"]}]}
    elif kind == "sampled":
        rest = [name for name in needed if name != "values"]
        needs = {"required": ["kind", *rest], "oneOf": [{"required": ["file"]}, {"required": ["values"]}]}
    refused = dict.fromkeys(cls.refused, False)
    return {"type": "object", "$ref": "#/$defs/surface_keys", "properties": _properties(table) | refused, **needs}


def _particles(table: Table) -> Form:
    others = [key.name for key in table.keys if key.name not in _OF_FILES]
    return _object(table) | {
        "anyOf": [{"required": [name]} for name in ("count", "fraction", "from")],
        "dependentSchemas": {"from": {"properties": dict.fromkeys(others, False)}, "frame": {"required": ["from"]}},
    }


# --- Sweeps ----------------------------------------------------------------------------------------------


def _sweep() -> Form:
    """The form of [sweep]: lists by keys of the file, which may be nested tables."""
    return {
        "type": "object",
        "description": 'Lists of values by keys of the file, such as "particles.seed" = {range = 20}.',
        "properties": {COMBINE: {"enum": list(WAYS)}},
        "additionalProperties": named("sweep_values"),
        "minProperties": 1,
    }


def _sweep_values() -> Form:
    makers = {name: either(INTEGER, listed(INTEGER, 1, 3)) if name == "range" else _ENDS for name in MAKERS}
    one = [_only({name: form}, name) for name, form in makers.items()]
    nested: Form = {
        "type": "object",
        "minProperties": 1,
        "additionalProperties": named("sweep_values"),
        "not": {"anyOf": [{"required": [name]} for name in makers]},
    }
    return {"anyOf": [{"type": "array", "minItems": 1}, *one, nested]}


_ENDS: Form = {"type": "array", "prefixItems": [{"type": "number"}, {"type": "number"}, {"type": "integer"}],
               "minItems": 3, "items": False}  # fmt: skip


def _without_needs(form: Any) -> Any:
    """A form that needs no key: of several kinds the first that fits is enough."""
    if isinstance(form, list):
        return [_without_needs(one) for one in form]
    if not isinstance(form, dict):
        return form
    loose = {}
    for key, value in form.items():
        if (key == "required" and isinstance(value, list)) or (key == "not" and set(value) == {"required"}):
            continue
        alternatives = key in ("anyOf", "oneOf")
        if alternatives and all(set(one) == {"required"} for one in value):
            continue
        loose["anyOf" if alternatives else key] = _without_needs(value)
    return loose
