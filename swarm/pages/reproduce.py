"""The ways to carry out a run again: by its scene file, or from its own first frame."""

import re
import shlex
import tomllib
from collections.abc import Iterator
from typing import Any, NamedTuple

import tomli_w

from ..errors import SceneError
from ..files.storage import Storage
from ..serialization.tables import FILES, NamedMethod, files_in, texts_in

# User code in a scene file, and the keys of files.
_CODE = re.compile(r"([A-Za-z_][\w.]*):[A-Za-z_]\w*")
# The text in place of a long array, which a scene file does not have.
_ARRAY = "sha256:"
_SAME = (
    "The result has the same bits with any number of threads; another version of swarm, or of what it computes with, "
    "may change the last digits, which chaos makes large after many impacts."
)


class Again(NamedTuple):
    """The ways to carry out a run again.

    Attributes:
        notes: sentences about them, in order.
        command: the command of a shell, or "".
        scene_file: the text of the scene file that the command runs, or "".
        file_name: the name of that file, or a description of it.
        python: the code that does this in Python, or "".
    """

    notes: list[str]
    command: str = ""
    scene_file: str = ""
    file_name: str = ""
    python: str = ""


def of_trajectory(trajectory: Any) -> Again:
    """The ways to carry out the run of a trajectory again."""
    given = trajectory.scene_text
    python = _python(trajectory)
    if given is not None:
        return _of_scene_file(trajectory, given)._replace(python=python)
    problem = _hindrance(trajectory)
    if problem:
        return Again([problem])
    name, rounded = trajectory.path.name, _is_rounded(trajectory)
    notes = ["It was run in Python, from particles that only this file holds: its first frame is the start."]
    if rounded:
        notes = [
            "It was run in Python, from particles that only this file holds, in float32, so a run from its first frame "
            "is another one after some impacts."
        ]
    text = _scene_file(trajectory)
    if text is None:
        notes.append("Its scene has long arrays, which are in the file too, and no scene file describes them.")
        return Again([*notes, _SAME], python=python)
    method = trajectory.method
    if isinstance(method, NamedMethod):
        notes.append(f"The method, {method}, is code, which no file holds.")
        if type(method).__module__ == "__main__":
            notes.append("Run these lines in the script that defines it.")
            return Again([*notes, _SAME], python=python)
    command = f"swarm run again.toml -o again.h5{plugins_of(tomllib.loads(text))}"
    file_name = f"again.toml, a scene file made of what {name} holds; it must be beside {name}"
    return Again([*notes, _SAME], command, text, file_name, python)


def _of_scene_file(trajectory: Any, text: str) -> Again:
    document = tomllib.loads(text)
    name = f"{trajectory.path.stem}.toml"
    notes = [f"It was run from a scene file, which this page holds. Save it as {name}, then"]
    if files := sorted(set(files_in(document))):
        notes.insert(0, f"The scene file reads other files, which must be beside it: {', '.join(files)}.")
    again = shlex.join(["swarm", "run", name, "-o", "again.h5"]) + plugins_of(document)
    if "--plugins" in again:
        notes.insert(0, "The scene file names code of your own, which must be importable where it is run.")
    return Again([_SAME, *notes], again, text, name)


def plugins_of(document: Any) -> str:
    """The options of a command for the code that a scene file names."""
    found = (_CODE.fullmatch(text) for key, text in texts_in(document) if key not in FILES)
    modules = sorted({code[1] for code in found if code and not code[0].startswith(_ARRAY)})
    return "".join(f" --plugins {shlex.quote(module)}" for module in modules)


# --- From the first frame --------------------------------------------------------------------------------


def _hindrance(trajectory: Any) -> str:
    """The reason why a run cannot start from the first frame of its trajectory, in a sentence; "" if it can."""
    kept, cannot = _storage(trajectory), "It cannot be reproduced from this file alone: "
    if kept.frames == "none":
        return f"{cannot}it was run in Python, and the file keeps no particles; keep the script that made it."
    if kept.frames != "all":
        return f"{cannot}it was run in Python, and the file keeps one particle in {kept.frames}; keep the script."
    if trajectory.has_births():
        return f"{cannot}it was run in Python, and the file does not keep its sources; keep the script that made it."
    if trajectory.body is not None and _is_rounded(trajectory):
        return f"{cannot}it was run in Python, and the file keeps its bodies in float32; keep the script that made it."
    tables = list(_tables_of(tomllib.loads(trajectory.descriptions["scene"])))
    if any(table.get("kind") == "own" for table in tables):
        return f"{cannot}it has a user-defined surface, which no file holds; keep the script that made it."
    if laws := [law for table in tables for law in table.get("laws", []) if isinstance(law, str)]:
        return f"{cannot}the law {laws[0]} is code, which no file holds; keep the script that made it."
    return ""


def _storage(trajectory: Any) -> Storage:
    table = tomllib.loads(trajectory.descriptions["storage"])
    return Storage(**{name: value for name, value in table.items() if name in ("frames", "precision", "compression")})


def _is_rounded(trajectory: Any) -> bool:
    return _storage(trajectory).precision != "float64"


def _tables_of(place: Any) -> Iterator[dict[str, Any]]:
    """All tables of a document."""
    if isinstance(place, dict):
        yield place
    for value in place.values() if isinstance(place, dict) else place:
        if isinstance(value, (dict, list)):
            yield from _tables_of(value)


def _span(trajectory: Any) -> dict[str, float]:
    """The end of the run and the time from frame to frame [s]."""
    times, until = trajectory.times, trajectory.until
    last = float(times[-1]) if until is None else until
    return {"until": last} if len(times) < 2 or times[1] >= last else {"until": last, "every": float(times[1])}


def _scene_file(trajectory: Any) -> str | None:
    """The text of a scene file that repeats the run from its first frame; None if the scene has long arrays."""
    document = tomllib.loads(trajectory.descriptions["scene"])
    if _ARRAY in trajectory.descriptions["scene"]:
        return None
    start = {"from": trajectory.path.name, "frame": 0}
    document["particles" if trajectory.body is None else "body"] = start
    document |= tomllib.loads(trajectory.counters_text)
    document["method"] = tomllib.loads(trajectory.descriptions["method"])
    document["run"] = {**_span(trajectory), **({"seed": trajectory.seed} if trajectory.seed else {})}
    return tomli_w.dumps(document)


def _python(trajectory: Any) -> str:
    """The lines of Python that carry out the run again, or ""."""
    if _hindrance(trajectory):
        return ""
    try:
        counters = len(trajectory.counters)
    except SceneError:
        return ""
    bodies = trajectory.body is not None
    more = [f"{name}={value!r}" for name, value in _span(trajectory).items()]
    more += [f"seed={trajectory.seed}"] * bool(trajectory.seed) + ["counters=run.counters"] * bool(counters)
    seen = trajectory.observables_of(slice(1))
    more += ["member_impacts=True"] * any(name.startswith("member_") for name in seen)
    name, method, home = trajectory.path.name, trajectory.method, type(trajectory.method).__module__
    named = isinstance(method, NamedMethod)
    given = f"{method if named else 'run.method'}, {', '.join(more)}"
    return "\n".join([
        "import swarm",
        *[f"from {home} import {type(method).__name__}"] * (named and home != "__main__"),
        "",
        f"with swarm.load({name!r}) as run:",
        f"    start = run.{'bodies' if bodies else 'frame'}(0)",
        f"    again = swarm.simulate(run.scene, start, {given}, trajectory='again.h5')",
    ])  # fmt: skip
