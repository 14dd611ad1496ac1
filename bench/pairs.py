"""The matrix of pairs: what works of each kind of wall, capability and engine, and the share of it for each engine."""

import csv
from typing import Any

from . import cells, figure, report
from .cells import Cell
from .outcomes import Outcome, outcome

# Of each engine the first walls and capabilities, to see that it runs.
_FEW = 1, 2
_MARKS = {"works": "x", "refused": ".", "third": "!"}


def main(quick: bool) -> None:
    """Carry out the cells, print the matrix, and write the table and the picture."""
    walls, capabilities = list(cells.WALLS), list(cells.CAPABILITIES)
    if quick:
        walls, capabilities = walls[: _FEW[0]], capabilities[: _FEW[1]]
    wanted = [cell for cell in cells.CELLS if cell.wall in walls and cell.capability in capabilities]
    found = {cell: outcome(cell) for cell in wanted}
    for engine in cells.ENGINES:
        _show(engine, walls, capabilities, found)
    print(f"{'engine':<28}{'works':>7}{'refused':>9}{'third':>7}{'share':>8}")
    for engine in cells.ENGINES:
        works, refused, third = counts = _counts(engine, found)
        print(f"{engine:<28}{works:>7}{refused:>9}{third:>7}{works / sum(counts):>8.0%}")
    for cell, one in found.items():
        if one.what == "third":
            print(f"{cell}: {one.said}")
    if not quick:
        _write(found)
        _draw(walls, capabilities, found)


def _counts(engine: str, found: dict[Cell, Outcome]) -> list[int]:
    return [sum(cell.engine == engine and one.what == what for cell, one in found.items()) for what in _MARKS]


def _show(engine: str, walls: list[str], capabilities: list[str], found: dict[Cell, Outcome]) -> None:
    """The matrix of an engine: x works, . is refused, ! does a third thing, and what is blank is no cell."""
    print(engine)
    width = max(map(len, capabilities)) + 2
    print(f"{'':<{width}}{' '.join(wall[:5].ljust(5) for wall in walls)}")
    for capability in capabilities:
        marks = [_MARKS[found[cell].what] if (cell := Cell(engine, w, capability)) in found else " " for w in walls]
        print(f"{capability:<{width}}{' '.join(f'{mark:<5}' for mark in marks)}".rstrip())
    print()


def _write(found: dict[Cell, Outcome]) -> None:
    path = report.file_of("pairs.csv")
    with open(path, "w", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow([*Cell._fields, "outcome", "said"])
        table.writerows([*cell, one.what, one.said] for cell, one in found.items())
    print(f"written to {path}")


def _draw(walls: list[str], capabilities: list[str], found: dict[Cell, Outcome]) -> None:
    """One panel an engine: filled works, pale is refused, and a cross is a third outcome."""
    from swarm.output import style

    rows = 2
    picture, panels = figure.subplots(len(cells.ENGINES), 20.0, 14.0, rows=rows, sharex=True, sharey=True)
    colours: dict[str, Any] = {"works": figure.colours()[0], "refused": style.GREY, "third": "red"}
    for axes, engine in zip(panels.flat, cells.ENGINES, strict=True):
        for what, colour in colours.items():
            points = [
                (walls.index(cell.wall), capabilities.index(cell.capability))
                for cell, one in found.items()
                if (cell.engine, one.what) == (engine, what)
            ]
            size = 34 if what == "works" else 5
            axes.scatter([x for x, _y in points], [y for _x, y in points], s=size, color=colour, marker="s", label=what)
        works, *others = _counts(engine, found)
        axes.set_title(f"{engine}: {works} of {works + sum(others)} work")
        axes.set_xticks(range(len(walls)), walls, rotation=90)
        axes.set_yticks(range(len(capabilities)), capabilities)
        axes.set_ylim(len(capabilities) - 0.5, -0.5)
    picture.suptitle("Walls and capabilities with each engine (a large square works, a small one is refused)")
    figure.save(picture, report.file_of("pairs.png"))
