"""`python -m examples.paper [-o FOLDER]`: every figure as PNG, and the table.

Those of the repository are made by `-o examples/paper/results`.
"""

import argparse
import importlib.util
import time
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType

from ..asked import OUT
from . import (
    beyond_adaptive,
    beyond_clearance,
    beyond_ellipsoid,
    beyond_swarm,
    beyond_torus,
    fig_03,
    fig_08_12,
    fig_13,
    fig_14_17,
    fig_19_22,
)
from .table import Row, markdown

REPRODUCED = (fig_03, fig_08_12, fig_13, fig_14_17, fig_19_22)
BEYOND = (beyond_ellipsoid, beyond_torus, beyond_adaptive, beyond_swarm, beyond_clearance)


def main() -> None:
    """Draw all figures, then print and write the table."""
    parser = argparse.ArgumentParser(prog="python -m examples.paper", description="The paper's figures, and beyond.")
    parser.add_argument("-o", metavar="FOLDER", type=Path, default=OUT / "paper", help="default: %(default)s")
    folder = parser.parse_args().o
    if importlib.util.find_spec("matplotlib") is None:
        raise SystemExit('python -m examples.paper needs matplotlib: pip install -e ".[plot]"')
    folder.mkdir(parents=True, exist_ok=True)

    reproduced = markdown("The paper, reproduced", _make(REPRODUCED, folder))
    beyond = markdown("Beyond the paper", _make(BEYOND, folder))
    text = f"{reproduced}\n{beyond}"
    (folder / "table.md").write_text(text, encoding="utf-8")
    print(f"\n{text}\nwritten to {folder}")


def _make(parts: Sequence[ModuleType], folder: Path) -> list[Row]:
    """Draw each part; the rows of all of them."""
    rows = []
    for part in parts:
        started = time.perf_counter()
        numbers = part.numbers()
        file = part.draw(numbers, folder)
        rows += part.rows(numbers)
        print(f"{file.name:34} {time.perf_counter() - started:5.1f} s", flush=True)
    return rows


if __name__ == "__main__":
    main()
