"""Errors of the compiler about user-defined laws, surfaces and methods, as sentences."""

import contextlib
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ...errors import SceneError
from ..options import Task

# What Numba says of the line that it could not compile, and of why.
_PLACE = re.compile(r"at (\S+\.py) \((\d+)\)")
_REASON = re.compile(r"TypingError: (?!Failed in nopython)(.+)")
# What such code may use.
_ADVICE = (
    "compiled code may use numbers, `if`, `math` and swarm.kernel.vector (dot, norm, cross), no arrays or lists, "
    "and returns one kind of value from every branch, such as a velocity or a Leave"
)


@contextlib.contextmanager
def explained(task: Task) -> Iterator[None]:
    """Raise a SceneError that names user-defined code where the compiler refuses it."""
    try:
        yield
    except Exception as error:
        named = dict(_of_users(task)) if type(error).__module__.startswith("numba.") else {}
        if not named:
            raise
        raise SceneError(_sentence(str(error), named)) from error


def _sentence(text: str, named: dict[str, type]) -> str:
    for place, line in reversed(_PLACE.findall(text)):
        for name, kind in named.items():
            file = getattr(sys.modules.get(kind.__module__), "__file__", None)
            if file is not None and Path(file).name == Path(place).name:
                return f"{name} ({kind.__name__}) cannot be compiled, by line {line} of {file}; {_ADVICE}"
    reason = _REASON.findall(text)
    names = " or ".join(f"{name} ({kind.__name__})" for name, kind in named.items())
    return f"{names} cannot be compiled{f': {reason[-1]}' if reason else ''}; {_ADVICE}"


def _of_users(task: Task) -> Iterator[tuple[str, type]]:
    """The laws, surfaces and methods of a run that are not of this package, by their names in the scene."""
    candidates: list[tuple[str, Any]] = [("method", task.method)]
    for i, surface in enumerate(task.scene.surfaces):
        candidates.append((f"surfaces[{i}]", getattr(surface, "parameters", surface)))
        candidates += [(f"surfaces[{i}].laws[{k}]", law) for k, law in enumerate(surface.laws)]
    for name, one in candidates:
        if type(one).__module__.partition(".")[0] not in (__name__.partition(".")[0], "builtins"):
            yield name, type(one)
