"""The committed list of the matrix of pairs: what each cell of `bench.cells` does.

    python tests/reference/pairs.py --write            writes pairs.json and refusals.json
    python tests/reference/pairs.py --write union      writes the cells whose names have this word
    python tests/reference/pairs.py --write refused    writes the cells that were refused, and new ones: minutes
    python tests/reference/pairs.py --write declared   writes what `knows` declares, and runs nothing

pairs.json has, for each engine and wall, one letter a capability: "w" works, "r" is refused, "!" is a third outcome,
and "-" is no cell.

refusals.json has digests of sentences: "declared", for each engine and capability of `knows`, those with their fields
in braces; and "cells", in rows as those of pairs.json, those with which a cell is refused.
"""

import hashlib
import json
import multiprocessing
import re
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))
from bench import cells, outcomes
from bench.cells import Cell
from swarm.run.preflight import knows

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

REFUSALS_FILE = Path(__file__).parent / "refusals.json"
_DIGESTS = json.loads(REFUSALS_FILE.read_text()) if REFUSALS_FILE.exists() else {"declared": {}, "cells": {}}
DECLARED = _DIGESTS["declared"]
REFUSALS = {
    str(Cell(engine, wall, capability)): one
    for engine, rows in _DIGESTS["cells"].items()
    for wall, row in rows.items()
    for capability, one in zip(cells.CAPABILITIES, row.split(), strict=True)
    if one != "-"
}


def digest_of(sentence):
    """Eight digits of a sentence, in which a log of impacts has no folder."""
    plain = re.sub(r"[^ ]*[/\\\\](impacts\.h5)", r"\1", sentence)
    return hashlib.sha256(plain.encode()).hexdigest()[:8]


def declared():
    """The digests of the sentences that `knows` has, by the names of engines and capabilities."""
    return {
        engine: {one.name: digest_of(text) for one in knows.CAPABILITIES if (text := one.sentence(engine)) is not None}
        for engine in sorted({name for one in knows.CAPABILITIES for group in one.refused for name in group})
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
    """Write the lists, and name the third outcomes."""
    names = [str(cell) for cell in cells.CELLS]
    words = [word for word in sys.argv[1:] if word != "--write"]
    groups = {"declared": [], "refused": [name for name in names if KNOWN.get(name, "refused") == "refused"]}
    wanted = (
        groups[words[0]]
        if words[:1] and words[0] in groups
        else [name for name in names if all(word in name for word in words)]
    )
    with multiprocessing.get_context("spawn").Pool() as pool:
        done = dict(zip(wanted, pool.map(outcome_of, wanted, 20), strict=True))
    for name, outcome in done.items():
        if outcome.what == "third":
            print(f"{name}: {outcome.said}")
    if "--write" in sys.argv:
        write({name: outcome.what for name, outcome in done.items()})
        refused = {name: outcome.said for name, outcome in done.items() if outcome.what == "refused"}
        write_refusals({name: digest_of(sentence) for name, sentence in refused.items()})


def write(done):
    """Write the list, in which these cells do what is said of them."""
    KNOWN.update(done)
    found = {name: LETTERS[word] for name, word in KNOWN.items()}
    FILE.write_text(_text({"capabilities": ", ".join(cells.CAPABILITIES), "cells": _rows(found)}))


def write_refusals(done):
    """Write the digests of what is refused, of which these are new."""
    found = {name: one for name, one in (REFUSALS | done).items() if KNOWN.get(name) == "refused"}
    REFUSALS_FILE.write_text(_text({"declared": declared(), "cells": _rows(found)}))


def _rows(found):
    """What is known of cells, a row of words for each engine and wall."""
    known = {str(cell) for cell in cells.CELLS}

    def word(*cell):
        return found.get(str(Cell(*cell)), "-") if str(Cell(*cell)) in known else "-"

    return {
        engine: {wall: " ".join(word(engine, wall, one) for one in cells.CAPABILITIES) for wall in cells.WALLS}
        for engine in cells.ENGINES
    }


def _text(table):
    return json.dumps(table, indent=1) + "\n"


if __name__ == "__main__":
    main()
