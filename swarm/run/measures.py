"""User-defined observables: functions of a frame, called when the frame is complete."""

import re
import traceback
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common.catalog import NAMES
from ..common.checks import is_masked, shown
from ..common.frames import Frame
from ..common.snapshot import Snapshot
from ..errors import RunError, SceneError

Function = Callable[[Frame], Any]
# The most axes of an observable: files have numbers, vectors, matrices, and tables of these.
_MOST_AXES = 3
# The end of the name of a column of a table, which names a part of an observable.
_COLUMN = re.compile("(_([0-9]+|[wxyz]))+$")


class _NotYet(dict[str, Any]):
    """The observables of a frame while functions are called for it: none of them is available yet."""

    def __missing__(self, name: str) -> Any:
        raise KeyError(
            f"{name}: functions of observables are called with the particles alone; take it from result.observables"
        )


def checked(argument: str, given: Any) -> dict[str, Function]:
    """Return the argument `observables` of a run, checked: functions by their names.

    Raises:
        SceneError: the argument is no dict of functions, or a name cannot be that of an observable.
    """
    if given is None:
        return {}
    if not isinstance(given, Mapping):
        raise SceneError(f"{argument} must be a dict of functions of a frame by their names, got {shown(given)}")
    for name, function in given.items():
        if not (isinstance(name, str) and name.isidentifier()):
            raise SceneError(f"{argument} must have names such as mean_radius, got {shown(name)}")
        column = _COLUMN.sub("", name)
        if name in NAMES or (column != name and (column in NAMES or column in given)):
            raise SceneError(f"{argument}[{name!r}] must have another name: {name} is that of another observable")
        if not callable(function):
            raise SceneError(f"{argument}[{name!r}] must be a function of a frame, got {shown(function)}")
    return dict(given)


class Measures:
    """The functions of a run, and the shapes of their values.

    Args:
        functions: the functions by their names, checked.
        until: the end of the run [s].
    """

    def __init__(self, functions: Mapping[str, Function], until: float) -> None:
        self._functions, self._until = functions, until
        self._shapes: dict[str, tuple[int, ...]] = {}
        self._first: tuple[int, dict[str, Any]] = -1, {}

    def __bool__(self) -> bool:
        return bool(self._functions)

    def expect(self, shapes: Mapping[str, tuple[int, ...]]) -> None:
        """Take the shapes of earlier frames of a resumed run."""
        self._shapes |= {name: shapes[name] for name in self._functions if name in shapes}

    def size(self) -> int:
        """Return the bytes of the values of a frame, as far as their shapes are known."""
        return sum(8 * int(np.prod(shape)) for shape in self._shapes.values())

    def begin(self, number: int, time: float, arrays: Snapshot) -> None:
        """Call all functions for a frame before kernels are compiled, and keep their values for this frame.

        Raises:
            SceneError: a function fails.
        """
        self._first = number, self._called(number, time, arrays, SceneError)

    def of(self, number: int, time: float, arrays: Snapshot) -> dict[str, Any]:
        """Return the values of the functions for a frame.

        Raises:
            RunError: a function fails.
        """
        known, seen = self._first
        return seen.copy() if known == number else self._called(number, time, arrays, RunError)

    def _called(
        self, number: int, time: float, arrays: Snapshot, failure: type[SceneError | RunError]
    ) -> dict[str, Any]:
        frame, seen = Frame(number, time, self._until, _NotYet(), arrays=arrays), {}
        for name, function in self._functions.items():
            try:
                given = function(frame)
            except Exception as error:
                raise failure(
                    f"observables[{name!r}] failed at frame {number}, {time:g} s: {type(error).__name__}: "
                    f"{' '.join(str(error).split())}{_place_of(error)}"
                ) from error
            try:
                value = _numbers(given)
                if value.shape != (before := self._shapes.setdefault(name, value.shape)):
                    raise ValueError(f"the same shape at every frame, {before} as at those before, got {value.shape}")
            except ValueError as error:
                raise failure(f"observables[{name!r}] must return {error}, at frame {number}, {time:g} s") from None
            seen[name] = value if value.ndim else value.item()
        arrays.end()
        return seen


# The measures of a run without user-defined observables.
NONE = Measures({}, 0.0)


def _numbers(given: Any) -> NDArray[np.float64]:
    """Return the value of a function as a float64 copy; a ValueError says what was expected and what came."""
    expected = "a number or an array of numbers"
    if is_masked(given):
        raise ValueError(f"{expected}, got a masked array; fill it")
    try:
        array = np.asarray(given)
    except (TypeError, ValueError):
        raise ValueError(f"{expected}, got {shown(given)}") from None
    if array.dtype.kind not in "biuf" or array.size == 0:
        came = f"an array of {array.dtype}" if array.ndim and array.size else shown(given)
        raise ValueError(f"{expected}, got {came}")
    if array.ndim > _MOST_AXES:
        raise ValueError(f"{expected} with at most {_MOST_AXES} axes, got the shape {array.shape}")
    return np.array(array, np.float64)


def _place_of(error: Exception) -> str:
    """The file and the line in which an error was raised, if they are known."""
    calls = [call for call in traceback.extract_tb(error.__traceback__) if call.filename != __file__]
    return f" ({calls[-1].filename}, line {calls[-1].lineno})" if calls else ""
