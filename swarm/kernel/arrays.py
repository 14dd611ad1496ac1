"""Operations on arrays and their elements that kernels have beyond Python: scratch arrays, rows, indices, tickets.

Each is an operation of the compiler, from `emission.py`, with the same definition in plain Python.
"""

import threading
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .deferred import defer


def spaced(stride: int) -> Callable[[Any], Any]:
    """Return a function that gives the compiler the distance of rows of the 2-D arrays in a NamedTuple: `stride`.

    The function returns the tuple. With distances known only at run time, a lane loop computes addresses, and first
    checks every row against every other for an overlap: 5.9 instead of 5.4 ns an impact in a sphere, 13.7 instead of
    6.5 ns with a contact step.
    """

    def known(tables: Any) -> Any:
        return tables

    defer(lambda machine_code: machine_code.emit_spaced(known, stride))
    return known


def scratch(shape: Any, dtype: Any) -> Any:
    """Return an array of zeros for the calling function of a kernel: it is gone when the function returns.

    In a loop its shape must be known before the kernel runs, unless the call is in an outlined helper.
    On the stack: kernels count no references, so they cannot make arrays that would have to be freed. With Numba's
    arrays, and references counted, an impact in a sphere costs 67 instead of 5.4 ns, and kernels a quarter more to
    compile.
    """
    return np.zeros(shape, dtype)


def unwritten(shape: Any, dtype: Any) -> Any:
    """`scratch` without zeros, for arrays that are written first: zeros in 20 rows of lanes cost a lane 1 ns a pass."""
    return np.zeros(shape, dtype)


def copy_row(target: Any, i: Any, source: Any, m: Any, count: Any) -> None:
    """Set target[i, :count] = source[m, :count], for tables in C order.

    In a loop over lanes one by one, each a load and a store or two: of assignments LLVM makes gathers, which
    take AMD processors about 20 cycles each.
    """
    target[int(i), :count] = source[int(m), :count]


_TAKING = threading.Lock()


def next_of(ticket: Any) -> int:
    """Return ticket[0] and increase it by one: no two threads get the same number."""
    with _TAKING:
        ticket[0] += 1
        return int(ticket[0]) - 1


def fetch(row: Any, i: Any) -> None:
    """Fetch the cache line of row[i], which is needed soon; the index may be out of range."""


def aligned_copy(values: NDArray[Any]) -> NDArray[Any]:
    """Return a copy that begins with a cache line."""
    made = aligned(-(-values.nbytes // 8)).view(values.dtype)[: values.size].reshape(values.shape)
    made[...] = values
    return made


def aligned(size: int) -> NDArray[np.float64]:
    """Return an array of zeros that begins with a cache line."""
    # For zeros NumPy does not ask the system for large pages.
    made = np.empty(size + 8)
    made.fill(0.0)
    first = -(made.ctypes.data // 8) % 8
    return made[first : first + size]


def index(value: Any) -> Any:
    """Return a number from an array as an index, which is not negative.

    For a signed number a kernel tests at each use whether it counts from the end: half of the instructions of a lane
    that retires, a third of one that is loaded. A function with arguments of both kinds is compiled twice.
    A loop over lanes runs up to such an index. LLVM does not always see that a signed one is never negative, and it
    does not vectorise one that may count from the end (in a box that is carried along 29 instead of 9.5 ns an impact).
    """
    return value


def kept(value):
    """Return a value from an array that a select may write back unchanged to its place.

    Such a select becomes a masked store, which costs AMD processors about ten times an ordinary one (measured: 18
    instead of 12 ns an impact with a contact step). An addition of 0 hides the origin of the value.
    """
    if isinstance(value, tuple):
        return type(value)(*tuple(kept(one) for one in value))
    return value + 0.0
