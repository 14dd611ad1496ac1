"""Surfaces from files that a scene file names."""

from dataclasses import fields
from pathlib import Path
from typing import Any

from ...common.checks import closest, listed, located
from ...errors import SceneError
from ..surface import Surface

_MESH = ("kind", "file", "spacing", "side", "scale", "weld", *(one.name for one in fields(Surface)))


def samples_of(table: Any, where: str, path: Path) -> Any:
    """Return the table of a surface, with samples read from its file or mesh, if it names one.

    A mesh without a spacing keeps its triangles.

    Args:
        table: the table in the scene file.
        where: its name in errors, such as "surface[0]".
        path: the path of the scene file.

    Raises:
        SceneError: a file cannot be read, or a key of a mesh is unknown or missing.
    """
    kind = table.get("kind") if isinstance(table, dict) else None
    if kind not in ("sampled", "mesh") or ("file" not in table and ("vertices" in table or kind == "sampled")):
        return table
    name = table.get("file")
    if not isinstance(name, str):
        came = 'nothing; add file = "part.stl"' if name is None else repr(name)
        raise SceneError(f"{where}.file: expected the name of a file, got {came}")
    from .arrays import read_samples  # loaded only where a file is used
    from .mesh import from_mesh

    given = {key: value for key, value in table.items() if key != "file"}
    try:
        if kind == "sampled":
            if "values" in table:
                raise SceneError(f"values: cannot be combined with file = {name!r}; remove one of them")
            return {**given, "values": read_samples(path.parent / name)}
        if "spacing" not in table:
            if "vertices" in table:
                raise SceneError(f"vertices: cannot be combined with file = {name!r}; remove one of them")
            return {**given, "vertices": str(path.parent / name)}
        for key in table:
            if key not in _MESH:
                raise SceneError(f"{key}: unknown key of a mesh, expected {listed(_MESH)}{closest(key, _MESH)}")
        made = from_mesh(
            path.parent / name,
            table["spacing"],
            table.get("side", "inside"),
            scale=table.get("scale", 1.0),
            weld=table.get("weld"),
        )
    except SceneError as error:
        raise SceneError(located(where, error)) from None
    samples = {name: getattr(made, name) for name in ("values", "spacing", "origin", "mesh_error", "mesh_weld")}
    return {
        **{key: value for key, value in given.items() if key not in ("scale", "weld")},
        "kind": "sampled",
        **samples,
    }
