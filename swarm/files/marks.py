"""Marks of the files that swarm writes: an output replaces a file only if its content is of the same kind."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ..common.checks import flag
from ..errors import SceneError
from ..version import VERSION
from . import paths
from .replaced import replaced

_ALLOW = "overwrite it (--overwrite, overwrite=True)"
# Bytes at the beginning of a file that contain its mark.
_HEAD = 4096
# The entry of the metadata of a picture that names the program that drew it, by the suffix.
_DRAWN_BY = {".png": "Software", ".pdf": "Creator", ".svg": "Creator"}
_PROGRAM, _HDF5 = "swarm", b"\x89HDF\r\n\x1a\n"
# The hint for a name with the suffix of another format: one of `_FORMATS`, or one that is not written.
_HDF5_FILES = {
    "trajectory": "it is HDF5; write other formats of it after the run: swarm export RUN.h5 -o RUN.csv (or .vtkhdf, "
    ".xyz, .gsd, .ply, .obj)",
    "impacts": "the log is HDF5, which swarm.load_impacts reads",
}
_OTHERS = (".npy", ".npz", ".vtk", ".vtp", ".vtu", ".pdb", ".lammpstrj", ".json", ".parquet", ".mat", ".stl", ".rrd")
_COLUMNS_OF_CSV = b"frame,time,id,x,y,z,vx,vy,vz,mass"
_COLUMNS_OF_TABLE = {"file", "state", "error", "wall_time"}


def of_picture(path: Path) -> dict[str, Any]:
    """The metadata that identify a picture, of a suffix that matplotlib writes, as one of swarm."""
    return {_DRAWN_BY[path.suffix.lower()]: f"{_PROGRAM} {VERSION}"}


def check_target(path: Path, overwrite: bool, what: str = "trajectory", allow: str = _ALLOW) -> None:
    """Raise a SceneError if `path` cannot become a new file, or replace the existing one.

    A file is replaced only by one of its own kind, which its content tells.

    Args:
        path: the file.
        overwrite: whether an existing file may be replaced.
        what: the output; its kind is one of `_KINDS` or, by its suffix, of `_FORMATS`.
        allow: the way to replace an existing file, for the sentence.
    """
    overwrite = flag("overwrite", overwrite)
    paths.check_place(path, what)
    if what in _HDF5_FILES and path.suffix.lower() in (*_FORMATS, *_OTHERS):
        raise SceneError(f"{what}: expected a name that ends in .h5, got {path}; {_HDF5_FILES[what]}")
    if path.exists() and not overwrite:
        stopped = what == "trajectory" and paths.checkpoint_of(path).exists()
        on = ", or go on with it, which was stopped (--resume, resume=True)" if stopped else ""
        raise SceneError(f"{what}: {path} exists; choose another name, or {allow}{on}")
    if path.exists():
        require_own(path, what)


def write(path: Path, content: bytes, what: str, overwrite: bool = False) -> Path:
    """Write a file, whole or not at all, in place of one of its own kind if that may be replaced; return its path.

    Raises:
        SceneError: it exists and may not be replaced, or its place is not possible.
        FileError: it cannot be written.
    """
    target = paths.target_of(what, path)
    check_target(target, overwrite, what)
    with replaced(target, what) as file:
        file.write(content)
    return target


def require_own(path: Path, what: str) -> None:
    """Raise a SceneError if the file at `path` is not of the kind that `what` replaces."""
    kind = why_not(path, what)
    if kind is not None:
        raise SceneError(
            f"{what}: {path} is not {kind}, and only such a file is overwritten; choose another name, or move that "
            "file away"
        )


def why_not(path: Path, what: str) -> str | None:
    """The kind of file that `what` replaces, such as "a trajectory of swarm"; None if `path` is of it, or is empty.

    A file that cannot be read counts as one of another kind.
    """
    suffix = path.suffix.lower()
    kind, is_one = _KINDS.get(what) or _FORMATS.get(suffix, ("a file of swarm", _never))
    try:
        return None if path.stat().st_size == 0 or is_one(path) else kind
    except OSError:
        return kind


def _never(_path: Path) -> bool:
    return False


def _head(path: Path) -> bytes:
    with open(path, "rb") as file:
        return file.read(_HEAD)


def _begins(*begin: bytes) -> Callable[[Path], bool]:
    return lambda path: _head(path).startswith(begin)


def _holds(pattern: bytes) -> Callable[[Path], bool]:
    return lambda path: re.search(pattern, _head(path)) is not None


def _is_trajectory(path: Path) -> bool:
    """Whether a file is a trajectory, by its structure and the attribute that names its maker."""
    from . import layout, provenance

    return _of_hdf5(path, lambda file: layout.missing(file) is None and provenance.is_own(file), b"h5md")


def _is_log(path: Path) -> bool:
    from . import impact_log

    return _of_hdf5(path, lambda file: impact_log.missing(file) is None and "h5md" not in file, b"impacts")


def _of_hdf5(path: Path, holds: Callable[[Any], bool], name: bytes) -> bool:
    """Whether `holds` is true of an HDF5 file; of a damaged file, whether its beginning has the names of its parts."""
    from .sources import DAMAGE, DamagedError
    from .stored import open_stored

    try:
        with open_stored(path) as file:
            return holds(file)
    except (DamagedError, *DAMAGE) as error:
        if isinstance(error, SceneError) and not isinstance(error, DamagedError):
            return False
        head = _head(path)
        return head.startswith(_HDF5) and name in head and b"parameters" in head


def _is_vtkhdf(path: Path) -> bool:
    import h5py

    if not h5py.is_hdf5(path):
        return False
    with h5py.File(path, "r", locking=False) as file:
        return "VTKHDF" in file and file.get("VTKHDF", getlink=True).__class__ is h5py.HardLink


def _is_pdf(path: Path) -> bool:
    """Whether the information of a PDF, which may be anywhere in it, names swarm as its creator."""
    content = path.read_bytes()
    return content.startswith(b"%PDF") and f"/Creator ({_PROGRAM} ".encode() in content


def is_table(path: Path) -> bool:
    """Whether a file is the table of a sweep."""
    head = _head(path)
    if path.suffix.lower() == ".parquet":
        return head.startswith(b"PAR1")
    return set(head.partition(b"\n")[0].decode("utf-8", "replace").split(",")) >= _COLUMNS_OF_TABLE


# Kinds by the name of the output; outputs that are not listed have kinds by suffix.
_KINDS: dict[str, tuple[str, Callable[[Path], bool]]] = {
    "trajectory": ("a trajectory of swarm", _is_trajectory),
    "impacts": ("a log of impacts of swarm", _is_log),
    "recording": ("a recording of Rerun", _begins(b"RRF")),
    "report": ("a report of swarm", _holds(rb'<meta name="generator" content="swarm ')),
    "table": ("the table of a sweep", is_table),
    "schema": ("a schema of swarm", _holds(rb'"title": "swarm \w+ file"')),
    "page of the reference": ("a page of swarm", _holds(rb'<meta name="generator" content="swarm |^// swarm ')),
    "scene file": ("one that is overwritten", _never),
}
_FORMATS: dict[str, tuple[str, Callable[[Path], bool]]] = {
    ".png": ("a picture of swarm", _holds(rb"^\x89PNG(?s:.)*tEXtSoftware\0swarm ")),
    ".pdf": ("a picture of swarm", _is_pdf),
    ".svg": ("a picture of swarm", _holds(rb"<cc:Agent>\s*<dc:title>swarm ")),
    ".mp4": ("a film", lambda path: _head(path)[4:8] == b"ftyp"),
    ".gif": ("a film", _begins(b"GIF87a", b"GIF89a")),
    ".vtkhdf": ("a file of VTKHDF", _is_vtkhdf),
    ".xyz": ("an extended XYZ file of swarm", _holds(rb"^\d+\n[^\n]*Properties=species:S:1:pos:R:3[^\n]* frame=\d+")),
    ".gsd": ("a GSD file", _begins(b"\xdf\x65\xdf\x65\xdf\x65\xdf\x65")),
    ".ply": ("a PLY file of swarm", _begins(b"ply\nformat binary_little_endian 1.0\ncomment swarm")),
    ".csv": ("a table of particles of swarm", _begins(_COLUMNS_OF_CSV)),
    ".obj": ("an OBJ file of swarm", _begins(b"# swarm: walls at frame ")),
    ".mtl": ("the materials of an OBJ file of swarm", _begins(b"newmtl cavity\nKd ")),
}
