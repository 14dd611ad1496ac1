"""Rows of eight numbers, a line of the cache each, in eight lanes: four of their columns at a time, by vectors.

One number after another takes a load and a store for each, some 500 of the 1400 instructions of eight contacts in a
sweep of grains with friction.
"""

from typing import Any

# How many lanes there are, how many columns a row has, and how many of them go into lanes at a time.
LANES = COLUMNS = 8
FOUR = 4


def into_lanes(tile: Any, q: Any, table: Any, column: Any, ends: Any, e: Any) -> None:
    """tile[q + c, lane] = table[ends[e, lane], column + c], c = 0 … 3, of all lanes."""
    tile[q : q + FOUR] = table[ends[e], column : column + FOUR].T


def add_from_lanes(table: Any, column: Any, ends: Any, e: Any, tile: Any, q: Any, lanes: Any) -> None:
    """table[ends[e + n, lane], column + c] += tile[q + 4 n + c, lane], of one of the lanes after another, n = 0 and 1.

    `lanes` says of which, as bits. The rows may be the same ones.
    """
    for lane in range(LANES):
        if (lanes >> lane) & 1:
            for n in range(2):
                more = tile[q + n * FOUR : q + (n + 1) * FOUR, lane]
                table[ends[e + n, lane], column : column + FOUR] += more
