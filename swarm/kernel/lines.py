"""Rows of eight numbers, one cache line each, in eight lanes: four of their columns at a time, by vectors.

Numbers one by one take a load and a store each, about 500 of the 1400 instructions of eight contacts in a
sweep of grains with friction.
"""

from typing import Any

# The number of lanes, of columns of a row, and of the columns that go into lanes at a time.
LANES = COLUMNS = 8
FOUR = 4


def into_lanes(tile: Any, q: Any, table: Any, column: Any, ends: Any, e: Any) -> None:
    """Set tile[q + c, lane] = table[ends[e, lane], column + c], c = 0 … 3, for all lanes."""
    tile[q : q + FOUR] = table[ends[e], column : column + FOUR].T


def add_from_lanes(table: Any, column: Any, ends: Any, e: Any, tile: Any, q: Any, lanes: Any) -> None:
    """Add tile[q + 4 n + c, lane] to table[ends[e + n, lane], column + c], lane by lane, for n = 0 and 1.

    `lanes` are the lanes to add, as bits. The rows of several lanes may be the same.
    """
    for lane in range(LANES):
        if (lanes >> lane) & 1:
            for n in range(2):
                more = tile[q + n * FOUR : q + (n + 1) * FOUR, lane]
                table[ends[e + n, lane], column : column + FOUR] += more
