"""The matrix of pairs: what works of each kind of wall, capability and engine, and the share of it for each engine."""

import csv
import multiprocessing
from pathlib import Path

import numpy as np

from . import cells, figure, report
from .cells import Cell
from .outcomes import outcome

# Of each engine the first walls and capabilities, to see that it runs.
_FEW = 1, 2
# Cells that a process takes at a time.
_AT_ONCE = 20
_MARKS = {"works": "x", "refused": ".", "third": "!"}
# What each outcome is called in the picture.
_WORDS = {
    "works": "works: a run shows it, and its energy balances",
    "refused": "not supported: an error says what to use instead",
    "third": "a defect",
}
_TITLES = {
    "points, Impact": "points with Impact",
    "balls, Impact": "balls with Impact",
    "bodies, Impact": "bodies with Impact",
    "points, Penalty": "points with Penalty",
    "grains, Penalty": "balls with Penalty",
    "points, AugmentedLagrangian": "points with AugmentedLagrangian",
    "points, heavy wall": "points with Impact, wall with a mass",
    "balls, heavy wall": "balls with Impact, wall with a mass",
}

# Of the grey of what is refused.
_OPACITY = 0.32

Found = dict[Cell, str]  # works, refused or third


def main(quick: bool) -> None:
    """Carry out the cells, print the matrix, and write the table and the picture."""
    wanted = list(cells.CELLS)
    if quick:
        few = list(cells.WALLS)[: _FEW[0]], list(cells.CAPABILITIES)[: _FEW[1]]
        wanted = [cell for cell in wanted if cell.wall in few[0] and cell.capability in few[1]]
        outcomes = [outcome(cell) for cell in wanted]
    else:
        with multiprocessing.get_context("spawn").Pool() as pool:
            outcomes = pool.map(outcome, wanted, _AT_ONCE)
    found = {cell: one.what for cell, one in zip(wanted, outcomes, strict=True)}
    for engine in cells.ENGINES:
        _show(engine, found)
    print(f"{'engine':<28}{'works':>7}{'refused':>9}{'third':>7}{'share':>8}")
    for engine in cells.ENGINES:
        works, refused, third = counts = _counts(engine, found)
        print(f"{engine:<28}{works:>7}{refused:>9}{third:>7}{works / sum(counts):>8.0%}")
    for cell, one in zip(wanted, outcomes, strict=True):
        if one.what == "third":
            print(f"{cell}: {one.said}")
    if not quick:
        _write(found)
        draw(found)


def _counts(engine: str, found: Found) -> list[int]:
    return [sum(cell.engine == engine and what == one for cell, one in found.items()) for what in _MARKS]


def _names(found: Found) -> tuple[list[str], list[str]]:
    """The walls and the capabilities that cells have."""
    walls, capabilities = {cell.wall for cell in found}, {cell.capability for cell in found}
    return [one for one in cells.WALLS if one in walls], [one for one in cells.CAPABILITIES if one in capabilities]


def _show(engine: str, found: Found) -> None:
    """The matrix of an engine: x works, . is refused, ! does a third thing, and what is blank is no cell."""
    walls, capabilities = _names(found)
    print(engine)
    width = max(map(len, capabilities)) + 2
    print(f"{'':<{width}}{' '.join(wall[:5].ljust(5) for wall in walls)}")
    for capability in capabilities:
        marks = [_MARKS[found[cell]] if (cell := Cell(engine, w, capability)) in found else " " for w in walls]
        print(f"{capability:<{width}}{' '.join(f'{mark:<5}' for mark in marks)}".rstrip())
    print()


def _write(found: Found) -> None:
    """One line an engine and capability, one column a wall."""
    path = report.file_of("pairs.csv")
    with open(path, "w", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["engine", "capability", *cells.WALLS])
        for engine in cells.ENGINES:
            for one in cells.CAPABILITIES:
                table.writerow([engine, one, *(found.get(Cell(engine, wall, one), "") for wall in cells.WALLS)])
    print(f"written to {path}")


def read(path: Path) -> Found:
    """The cells of such a table."""
    with open(path, newline="") as file:
        return {
            Cell(row["engine"], wall, row["capability"]): what
            for row in csv.DictReader(file)
            for wall, what in row.items()
            if what in _MARKS
        }


def draw(found: Found) -> None:
    """One panel an engine: a column a capability, a line a wall."""
    from matplotlib.colors import ListedColormap, to_rgb
    from matplotlib.patches import Patch

    from swarm.pictures import style

    walls, capabilities = _names(found)
    picture, panels = figure.subplots(len(_TITLES), 10.0, 14.5, rows=len(_TITLES) // 2, sharex=True, sharey=True)
    colours = {"works": figure.colours()[0], "refused": (*to_rgb(style.GREY), _OPACITY), "third": "red"}
    for k, (axes, engine) in enumerate(zip(panels.flat, _TITLES, strict=True)):
        rows = [[found.get(Cell(engine, wall, one), "") for one in capabilities] for wall in walls]
        numbers = [[list(colours).index(what) if what else np.nan for what in row] for row in rows]
        axes.pcolormesh(
            range(len(capabilities)), range(len(walls)), numbers, cmap=ListedColormap(list(colours.values())),
            vmin=-0.5, vmax=len(colours) - 0.5, edgecolors=style.backdrop()[0], linewidth=0.8,
        )  # fmt: skip
        axes.set(xlim=(-0.5, len(capabilities) - 0.5), ylim=(len(walls) - 0.5, -0.5))
        works, *others = _counts(engine, found)
        total = works + sum(others)
        axes.set_title(f"{_TITLES[engine]}: {works} of {total} work, {works / total:.0%}", fontsize=9.0)
        axes.set_xticks(range(len(capabilities)), capabilities, rotation=90, fontsize=7.5)
        axes.set_yticks(range(len(walls)), walls, fontsize=7.5)
        # The names of capabilities are below every second line of panels.
        axes.tick_params(length=0.0, labelbottom=k // 2 % 2 == 1)
        axes.grid(visible=False)
        axes.spines[:].set_visible(False)
    handles = [Patch(color=colours[what], label=_WORDS[what]) for what in colours if what in found.values()]
    handles += [Patch(facecolor="none", edgecolor=style.GREY, label="no such run")]
    picture.legend(handles=handles, loc="outside lower center", ncols=len(handles), fontsize=8.0)
    picture.suptitle("What goes with what: a line for each kind of wall, a column for each capability")
    figure.save(picture, report.file_of("pairs.png"))
