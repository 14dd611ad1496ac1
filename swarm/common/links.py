"""Links of an HDF5 file to other files, which reading it would open unasked: only links to shards are allowed."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..errors import SceneError

# Of the folder of the shards of a trajectory.
SHARDS = ".shards"
# The file of a shard as the trajectory of all names it, in the folder beside it.
_SHARD = re.compile(rf"[^/\\:]+{re.escape(SHARDS)}/\d{{4,}}\.h5")


def require_none(file: Any, path: Path, joined: Sequence[str] = ()) -> None:
    """Raise a SceneError if a part of a file is in another file.

    Args:
        file: the file, open.
        path: its path, for the sentence.
        joined: the datasets with values that may be in the shards of a trajectory.

    Raises:
        SceneError: it has an external link, external storage, or a virtual dataset of another file.
    """
    import h5py

    found: list[str] = []

    def look_at_link(name: bytes, info: Any) -> bool | None:
        if info.type not in (h5py.h5l.TYPE_HARD, h5py.h5l.TYPE_SOFT):
            found.append(f"{name.decode(errors='replace')}, a link to another file")
        return True if found else None

    def look_at(name: str, one: Any) -> bool | None:
        if isinstance(one, h5py.Dataset):
            if one.external is not None:
                found.append(f"{name}, its values are in {one.external[0][0]!r:.200}")
            elif one.is_virtual:
                wrong = (source.file_name for source in one.virtual_sources() if not _is_within(source, name in joined))
                found.extend(f"{name}, its values are in {source!r:.200}" for source in list(wrong)[:1])
        return True if found else None

    file.id.links.visit(look_at_link, info=True)
    if not found:
        file.visititems(look_at)
    if found:
        raise SceneError(
            f"{path} must hold its own data, got {found[0]}, which reading it would open; copy the values into the file"
        )


def _is_within(source: Any, of_shards: bool) -> bool:
    """Whether a source of a virtual dataset is in the same file, or one of our shards."""
    return source.file_name == "." or (of_shards and _SHARD.fullmatch(source.file_name) is not None)
