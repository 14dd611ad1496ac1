"""The triangles of a file, or of arrays, unchanged, with the names of solids, objects or groups."""

import itertools
import re
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...common import checks
from ...common.extras import needed_by
from ...errors import SceneError
from ...state import Floats, Indices
from ..surface import shown

_NUMBER = r"\s+([-+.\deEnaifNAIF]+)"
_CORNER = re.compile(r"vertex" + 3 * _NUMBER, re.IGNORECASE)
_SOLID = re.compile(r"^[ \t]*solid\b[ \t]*(.*)$", re.IGNORECASE | re.MULTILINE)
# This number of bytes of a file tells text from binary data.
_HEAD = 4096


class Soup(NamedTuple):
    """Triangles, each of a group.

    Attributes:
        vertices: (V, 3) [m].
        triangles: (T, 3) their corners.
        group: (T,) the number of the group of each.
        names: the names of the groups; one empty name for a file without names.
    """

    vertices: Floats
    triangles: Indices
    group: Indices
    names: tuple[str, ...]

    def of(self, triangles: Indices, which: Indices) -> "Soup":
        """Return other triangles, each in the group of the triangle with this number."""
        return self._replace(triangles=triangles, group=self.group[which])


def read_soup(path: Path, scale: float) -> Soup:
    """Return the triangles in a file, which need not be connected.

    Args:
        path: path of the file.
        scale: length of a unit of the file in metres.

    Raises:
        SceneError: the file cannot be read, or holds no triangles, or some with corners that are not finite.
    """
    try:
        text = _text_of(path)
        read = {".stl": _stl, ".obj": _obj}.get(path.suffix.lower()) if text else None
        vertices, triangles, group, names = read(text) if read else _by_library(path)  # type: ignore[arg-type]
        vertices = scale * vertices
    except SceneError:
        raise
    except ModuleNotFoundError as error:
        # An error that trimesh raises again has no name.
        name = error.name or str(error).rpartition(" ")[2].strip("'")
        raise SceneError(
            f"cannot read the mesh {path}: a file {path.suffix} needs the package {name!r}, which is not installed: "
            f"pip install {name}, or write the mesh as STL"
        ) from error
    except Exception as error:  # readers of a dozen formats raise any error
        reason = getattr(error, "strerror", None) or str(error) or type(error).__name__
        raise SceneError(f"cannot read the mesh {path}: {reason}") from error
    if not len(triangles):
        raise SceneError(f"the mesh {path} must hold triangles, got none")
    wrong = np.argwhere(~np.isfinite(vertices[triangles]).all(axis=2))
    if len(wrong):
        which, corner = wrong[0]
        more = len(np.unique(wrong[:, 0])) - 1
        raise SceneError(
            f"the mesh {path} must hold triangles with finite corners, got {shown(vertices[triangles[which, corner]])} "
            f"as corner {corner} of triangle {which}, counted from 0, and {more} more like it; remove them and close "
            "the holes that they leave"
        )
    return Soup(vertices, np.ascontiguousarray(triangles), group, tuple(names))


def _text_of(path: Path) -> str:
    """Return the text of an STL or OBJ file; the empty string for any other file."""
    if path.suffix.lower() not in (".stl", ".obj"):
        return ""
    with path.open("rb") as file:
        head = file.read(_HEAD)
    is_text = b"\0" not in head and (path.suffix.lower() == ".obj" or b"facet" in head.lower())
    return path.read_text("utf-8", "replace") if is_text else ""


# --- Text, which names its solids and groups -------------------------------------------------------------


def _stl(text: str) -> tuple[Floats, Indices, Indices, list[str]]:
    """Return the solids of an STL file, each between `solid name` and `endsolid`."""
    _before, *parts = _SOLID.split(text)
    found, group, names = [], [], []  # type: ignore[var-annotated]
    for name, body in zip(parts[::2], parts[1::2], strict=True):
        corners = np.array(_CORNER.findall(body), np.float64).reshape(-1, 3, 3)
        if len(corners):
            found.append(corners)
            group.append(np.full(len(corners), _number_of(name.strip(), names)))
    if not found:
        return np.empty((0, 3)), np.empty((0, 3), np.int64), np.empty(0, np.int64), names
    vertices = np.concatenate(found).reshape(-1, 3)
    return vertices, np.arange(len(vertices)).reshape(-1, 3), np.concatenate(group), names


def _obj(text: str) -> tuple[Floats, Indices, Indices, list[str]]:
    """Return the faces of an OBJ file, as fans of triangles, each of the group or else the object above it."""
    vertices: list[list[float]] = []
    faces: list[tuple[int, int, int]] = []
    group: list[int] = []
    names: list[str] = []
    known = {"o": "", "g": ""}
    for line in text.replace("\\\n", " ").splitlines():
        kind, *parts = line.split() or [""]
        if kind == "v":
            vertices.append([float(part) for part in parts[:3]])
        elif kind in known:
            known[kind] = " ".join(parts)
            known = {"o": known["o"], "g": ""} if kind == "o" else known
        elif kind == "f":
            corners = [int(part.split("/")[0]) for part in parts]
            corners = [c - 1 if c > 0 else len(vertices) + c for c in corners]
            fan = [(corners[0], b, c) for b, c in itertools.pairwise(corners[1:])]
            faces += fan
            group += len(fan) * [_number_of(known["g"] or known["o"], names)]
    triangles = np.array(faces, np.int64).reshape(-1, 3)
    if len(triangles) and not 0 <= triangles.min() <= triangles.max() < len(vertices):
        raise SceneError(f"a face has a corner beyond the {len(vertices)} vertices of the file")
    return np.array(vertices, np.float64).reshape(-1, 3), triangles, np.array(group, np.int64), names


def _number_of(name: str, names: list[str]) -> int:
    """Return the number of a group by its name; a name that is not yet in `names` is appended."""
    if name not in names:
        names.append(name)
    return names.index(name)


# --- All other files -------------------------------------------------------------------------------------


def _by_library(path: Path) -> tuple[Floats, Indices, Indices, list[str]]:
    """Return the triangles that trimesh reads: a group for each object, or for each value of `group` of a PLY file."""
    with needed_by("a mesh", "mesh"):
        import trimesh
    read: Any = trimesh.load(str(path), process=False)
    if isinstance(read, trimesh.Scene):
        parts = [(node, *read.graph[node]) for node in read.graph.nodes_geometry]
        meshes = [
            (name if len(parts) > 1 or name != path.name else "", read.geometry[name], place)
            for _node, place, name in parts
        ]
    else:
        meshes = [("", read, np.eye(4))]
    for _name, mesh, _place in meshes:
        if not hasattr(mesh, "faces"):
            kind = "points" if isinstance(mesh, trimesh.PointCloud) else "curves"
            raise SceneError(
                f"the mesh {path} must hold triangles, got {kind} alone; make a closed mesh of them in the program "
                "that wrote it"
            )
    found, triangles, group, names, before = [], [], [], [], 0  # type: ignore[var-annotated]
    for name, mesh, place in meshes:
        vertices, faces = np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64)
        still = np.array_equal(place, np.eye(4))
        found.append(vertices if still else vertices @ place[:3, :3].T + place[:3, 3])
        triangles.append((faces if np.linalg.det(place[:3, :3]) > 0.0 else faces[:, ::-1]) + before)
        values = _values_of(mesh, len(faces)) if len(meshes) == 1 else None
        if values is None:
            group.append(np.full(len(faces), _number_of(str(name), names)))
        else:
            kinds, of = np.unique(values, return_inverse=True)
            group.append(np.array([_number_of(f"{kind:g}", names) for kind in kinds.tolist()])[of])
        before += len(vertices)
    return np.concatenate(found), np.concatenate(triangles), np.concatenate(group), names


def _values_of(mesh: Any, count: int) -> Any:
    """Return the property `group` of the faces of a PLY file, or None."""
    data = mesh.metadata.get("_ply_raw", {}).get("face", {}).get("data")
    names = () if data is None or getattr(data, "dtype", None) is None else data.dtype.names or ()
    if isinstance(data, dict):
        names = tuple(data)
    values = np.ravel(data["group"]) if "group" in names else None
    return values if values is not None and len(values) == count else None


# --- Arrays ----------------------------------------------------------------------------------------------


def given_arrays(vertices: Any, triangles: Any, group: Any, names: Any, scale: float) -> Soup:
    """Return the arguments that are arrays, checked."""
    if triangles is None:
        raise SceneError("triangles must be (T, 3) numbers of corners, got None; or give the path of a file alone")
    corners = checks.array("vertices", vertices)
    if corners.ndim != 2 or corners.shape[1] != 3 or not np.isfinite(corners).all():
        raise SceneError(
            f"vertices must be (V, 3) finite numbers, got shape {corners.shape}; or give the path of a file"
        )
    cells = _whole("triangles", triangles)
    if cells.ndim != 2 or cells.shape[1] != 3 or not len(cells) or cells.dtype.kind not in "iu":
        raise SceneError(f"triangles must be (T, 3) whole numbers, got shape {cells.shape} of {cells.dtype}")
    if cells.min() < 0 or cells.max() >= len(corners):
        wrong = int(np.argwhere((cells < 0) | (cells >= len(corners)))[0, 0])
        raise SceneError(
            f"triangles must be numbers from 0 to {len(corners) - 1}, of which each is a corner, got "
            f"{cells[wrong].tolist()} in row {wrong}"
        )
    of = np.zeros(len(cells), np.int64) if group is None else _whole("group", group).astype(np.int64)
    known = tuple(map(str, names)) or tuple(map(str, range(int(of.max()) + 1))) if group is not None else ("",)
    if of.shape != (len(cells),) or of.min() < 0 or of.max() >= len(known):
        raise SceneError(
            f"group must be (T,) numbers of {len(known)} names, one for each of the {len(cells)} triangles, got shape "
            f"{of.shape} from {of.min()} to {of.max()}"
        )
    return Soup(scale * corners, cells.astype(np.int64), of, known)


def _whole(name: str, values: Any) -> NDArray[Any]:
    """Return an argument as an array of whole numbers, at least one."""
    try:
        found = np.asarray(values)
    except Exception:  # rows of different lengths, or an object of others
        found = np.empty(0)
    if found.dtype.kind not in "iu" or not found.size:
        raise SceneError(f"{name} must be whole numbers, one or more, got {checks.shown(values)}")
    return found
