"""Links of an HDF5 file to other files, which reading it would open unasked: only links to shards are allowed."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..errors import SceneError

# The suffix of the folder of the shards of a trajectory.
SHARDS = ".shards"
# The file of a shard, as the trajectory of all shards names it in the folder beside it.
_SHARD = re.compile(rf"[^/\\:]+{re.escape(SHARDS)}/\d{{4,}}\.h5")


def require_none(file: Any, path: Path, joined: Sequence[str] = ()) -> None:
    """Raise a SceneError if a part of a file is in another file.

    Args:
        file: the file, open.
        path: its path, for the message.
        joined: the datasets with values that may be in the shards of a trajectory.

    Raises:
        SceneError: the file has an external link, external storage, or a virtual dataset of another file.
    """
    import h5py

    found: list[str] = []

    def look_at_link(name: bytes, info: Any) -> bool | None:
        if info.type not in (h5py.h5l.TYPE_HARD, h5py.h5l.TYPE_SOFT):
            found.append(f"{name.decode(errors='replace')}, a link to another file")
        return True if found else None

    def look_at(name: bytes) -> bool | None:
        # Opening an object of h5py for each part would take most of the time.
        one = h5py.h5o.open(file.id, name)
        made = one.get_create_plist() if isinstance(one, h5py.h5d.DatasetID) else None
        if made is not None and (made.get_external_count() or made.get_layout() == h5py.h5d.VIRTUAL):
            found.extend(_elsewhere(h5py.Dataset(one), name.decode(errors="replace"), joined))
        return True if found else None

    file.id.links.visit(look_at_link, info=True)
    if not found:
        h5py.h5o.visit(file.id, look_at)
    if found:
        raise SceneError(
            f"{path} must hold its own data, got {found[0]}, which reading it would open; copy the values into the file"
        )


def _elsewhere(one: Any, name: str, joined: Sequence[str]) -> list[str]:
    """Describe a dataset with values in other files for the message, or return nothing."""
    if one.external is not None:
        return [f"{name}, its values are in {one.external[0][0]!r:.200}"]
    # Other files than this one; shards of this run are allowed.
    others = (source.file_name for source in one.virtual_sources() if source.file_name != ".")
    wrong = [file for file in others if name not in joined or not _SHARD.fullmatch(file)]
    return [f"{name}, its values are in {file!r:.200}" for file in wrong[:1]]
