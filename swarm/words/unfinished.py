"""Notes on the run of a trajectory that is not complete, and how to resume it."""

import contextlib
import itertools
from pathlib import Path
from typing import Any, NamedTuple

from ..files import paths
from ..files.lock import is_written
from .amounts import amount

# The relative round-off of the time of the last frame.
_ROUND_OFF = 1e-9
# The largest number of scene files in a folder that are compared with that of the run.
_LOOKED_AT = 1000


class Note(NamedTuple):
    """A sentence on a run, and a command that goes with it, or ""."""

    text: str
    command: str = ""


def unfinished(trajectory: Any) -> Note | None:
    """A note on a run that is going on or was cut off; None: it is complete, as far as the file tells."""
    times, until = trajectory.times, trajectory.until
    last = float(times[-1]) if len(times) else 0.0
    if until is None and trajectory.scene_text is not None:
        until = _until_of(trajectory.scene_text)
    if is_written(trajectory.path):
        end = "" if until is None else f" of {amount(until, 's')}"
        return Note(f"A run writes this file now: it holds the first {amount(last, 's')}{end}.")
    saved = paths.checkpoint_of(trajectory.path)
    if until is not None and last < until * (1.0 - _ROUND_OFF):
        text = f"This run is not complete: it was stopped at {amount(last, 's')} of {amount(until, 's')}."
    elif saved.exists():
        text = f"This run may not be complete: there is the checkpoint {saved.name}, from which it can go on."
    else:
        return None
    if not saved.exists():
        return Note(f"{text} There is no checkpoint beside it to go on from.")
    if trajectory.scene_text is None:
        return Note(f"{text} Go on with it by the script that began it, with resume=True.")
    scene = _scene_file_beside(trajectory.path, trajectory.scene_text)
    by = "" if scene else " by its scene file"
    return Note(f"{text} Go on with it{by}:", f"swarm run {scene or 'SCENE.toml'} -o {trajectory.path.name} --resume")


def _scene_file_beside(path: Path, text: str) -> str | None:
    """The name of the scene file with this text in the folder of a trajectory."""
    for one in itertools.islice(sorted(path.parent.glob("*.toml"), key=lambda one: one.stem != path.stem), _LOOKED_AT):
        with contextlib.suppress(OSError):
            if one.read_text(encoding="utf-8-sig", errors="replace") == text:
                return one.name
    return None


def _until_of(text: str) -> float | None:
    """The end of the run of a scene file [s]."""
    import tomllib

    until = tomllib.loads(text).get("run", {}).get("until")
    return float(until) if isinstance(until, (int, float)) else None
