"""Sums over blocks of 4 x 4 x 4 numbers of a table, four at a time, by vector instructions that LLVM does not find.

LLVM makes vectors of loops, not of expressions that are written out, and it first writes out a loop over four.
"""

from typing import Any, NamedTuple

import numpy as np


class Four(NamedTuple):
    """Four numbers, each for one of four others, such as weights."""

    a: Any
    b: Any
    c: Any
    d: Any


def sum_of(w, c):
    """Return the sum of the products."""
    return (w.a * c.a + w.b * c.b) + (w.c * c.c + w.d * c.d)


def over_block(table: Any, place: Any, x: Any, y: Any) -> Four:
    """Return, along the third axis, the sums over the first two with the weights x and y, of the block at a place.

    The place is a NamedTuple that begins with three indices; in plain Python these may be arrays.
    """
    i, j, k = place[0], place[1], place[2]
    if np.ndim(i) == 0:
        block = table[i : i + 4, j : j + 4, k : k + 4]
    else:
        a, b, c = np.indices((4, 4, 4)).reshape(3, 4, 4, 4, *[1] * np.ndim(i))
        block = table[i + a, j + b, k + c]
    return Four(*_weighted(x, _weighted(y, block.swapaxes(0, 1))))


def _weighted(w: Any, parts: Any) -> Any:
    return (w.a * parts[0] + w.b * parts[1]) + (w.c * parts[2] + w.d * parts[3])
