"""The committed list of the matrix of pairs: what each cell of `bench.cells` does.

    python tests/reference/pairs.py --write           writes pairs.json
    python tests/reference/pairs.py --write union     writes the cells whose names have this word

pairs.json has, for each engine and wall, one letter a capability: "w" works, "r" is refused, "!" is a third outcome,
and "-" is no cell.
"""

import json
import multiprocessing
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))
from bench import cells, outcomes
from bench.cells import Cell

FILE = Path(__file__).parent / "pairs.json"
LETTERS = {"works": "w", "refused": "r", "third": "!"}
WORDS = {letter: word for word, letter in LETTERS.items()}
TABLE = json.loads(FILE.read_text())
KNOWN = {
    str(Cell(engine, wall, capability)): WORDS[letter]
    for engine, rows in TABLE["cells"].items()
    for wall, row in rows.items()
    for capability, letter in zip(TABLE["capabilities"].split(", "), row.split(), strict=True)
    if letter != "-"
}


def soon():
    """The quick ring: for each engine and capability one cell, and of points the plain one of each wall.

    One that works says more than one that is refused, and scenes of a formula, a spline or triangles take seconds.
    """
    chosen, walls = {}, [name for name in cells.SHAPES if name not in ("formula", "sampled", "mesh")]
    for e, engine in enumerate(cells.ENGINES):
        for c, capability in enumerate(cells.CAPABILITIES):
            first = (7 * e + c) % len(walls)
            turn = [Cell(engine, wall, capability) for wall in (*walls[first:], *walls[:first])]
            known = [cell for cell in turn if str(cell) in KNOWN]
            chosen |= dict.fromkeys(sorted(known, key=lambda cell: KNOWN[str(cell)] != "works")[:1])
    chosen |= dict.fromkeys(Cell("points, Impact", wall, "plain") for wall in cells.WALLS)
    chosen |= dict.fromkeys(Cell("points, Impact", cells.ON_A_CLUSTER, one) for one in ("temperature", "source"))
    return list(chosen)


def outcome_of(name):
    """What a cell does now."""
    return outcomes.outcome(Cell(*name.split(" / ")))


def main():
    """Write the list, and name the third outcomes."""
    names = [str(cell) for cell in cells.CELLS]
    words = [word for word in sys.argv[1:] if word != "--write"]
    wanted = [name for name in names if all(word in name for word in words)]
    with multiprocessing.get_context("spawn").Pool() as pool:
        done = dict(zip(wanted, pool.map(outcome_of, wanted, 20), strict=True))
    for name, outcome in done.items():
        if outcome.what == "third":
            print(f"{name}: {outcome.said}")
    if "--write" in sys.argv:
        write({name: outcome.what for name, outcome in done.items()})


def write(done):
    """Write the list, in which these cells do what is said of them."""
    known = {str(cell) for cell in cells.CELLS}
    found = {name: LETTERS[word] for name, word in (KNOWN | done).items() if name in known}
    KNOWN.update(done)
    table = {"capabilities": ", ".join(cells.CAPABILITIES), "cells": {}}
    for engine in cells.ENGINES:
        rows = table["cells"][engine] = {}
        for wall in cells.WALLS:
            rows[wall] = " ".join(found.get(str(Cell(engine, wall, one)), "-") for one in cells.CAPABILITIES)
    FILE.write_text(json.dumps(table, indent=1) + "\n")


if __name__ == "__main__":
    main()
