"""Operations of kernels beyond Python, on arrays and their elements: arrays of their own, rows, indices, tickets.

Each is an operation of the compiler, by `emission.py`, with the same definition in plain Python.
"""

import threading
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .deferred import defer


def spaced(stride: int) -> Callable[[Any], Any]:
    """A function that tells the compiler how far apart rows of the 2-D arrays in a NamedTuple are: `stride` numbers.

    It gives the tuple back. Where distances are known at run time only, a lane loop computes addresses, and before it
    checks every row against every other for an overlap: 5.9 instead of 5.4 ns an impact in a sphere, 13.7 instead of
    6.5 ns with a contact step.
    """

    def known(tables: Any) -> Any:
        return tables

    defer(lambda machine_code: machine_code.emit_spaced(known, stride))
    return known


def scratch(shape: Any, dtype: Any) -> Any:
    """An array of zeros for the function of a kernel that asks for it: it is gone when that returns.

    What is asked for in a loop has a shape that is known before the kernel runs, or is in an outlined helper.
    On the stack: kernels count no references, so they cannot make arrays that would have to be freed. With arrays of
    Numba's, and references counted, an impact in a sphere costs 67 instead of 5.4 ns, and kernels a quarter more to
    compile.
    """
    return np.zeros(shape, dtype)


def unwritten(shape: Any, dtype: Any) -> Any:
    """`scratch` that holds anything, for what is written first: zeros in 20 rows of lanes cost a lane 1 ns a pass."""
    return np.zeros(shape, dtype)


def copy_row(target: Any, i: Any, source: Any, m: Any, count: Any) -> None:
    """target[i, :count] = source[m, :count], of tables in C order.

    In a loop over lanes one by one, each a load and a store or two: of assignments of numbers LLVM makes gathers, which
    take AMD processors some 20 cycles each.
    """
    target[int(i), :count] = source[int(m), :count]


_TAKING = threading.Lock()


def next_of(ticket: Any) -> int:
    """ticket[0], which becomes one more: of several threads no two get the same."""
    with _TAKING:
        ticket[0] += 1
        return int(ticket[0]) - 1


def fetch(row: Any, i: Any) -> None:
    """Ask for the line of the cache that holds row[i], which is needed soon; the index may be of any place."""


def aligned_copy(values: NDArray[Any]) -> NDArray[Any]:
    """A copy that begins with a line of the cache."""
    made = aligned(-(-values.nbytes // 8)).view(values.dtype)[: values.size].reshape(values.shape)
    made[...] = values
    return made


def aligned(size: int) -> NDArray[np.float64]:
    """An array of zeros that begins with a line of the cache."""
    # Of zeros NumPy asks the system for no large pages.
    made = np.empty(size + 8)
    made.fill(0.0)
    first = -(made.ctypes.data // 8) % 8
    return made[first : first + size]


def index(value: Any) -> Any:
    """A number from an array as an index, which is not negative.

    Of a signed one a kernel asks at each use whether it counts from the end: half of the instructions of a lane that is
    given back, a third of one that is loaded. A function that is given both kinds is compiled twice.
    A loop over lanes runs up to such an index. LLVM does not always see that a signed one is never negative, and what
    may count from the end it does not vectorise (in a box that is carried along 29 instead of 9.5 ns an impact).
    """
    return value


def kept(value):
    """A value from an array that a select may write back unchanged to its place.

    Of such a select LLVM makes a masked store, which costs AMD processors some ten times an ordinary one (measured: 18
    instead of 12 ns an impact with a contact step). An addition of 0 hides the origin of the value.
    """
    if isinstance(value, tuple):
        return type(value)(*tuple(kept(one) for one in value))
    return value + 0.0
