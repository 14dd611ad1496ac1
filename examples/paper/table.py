"""What the paper says against what we get: rows, and their Markdown."""

from collections.abc import Sequence
from typing import NamedTuple

import swarm


class Row(NamedTuple):
    """One line of the table; "-" where the paper says nothing."""

    quantity: str
    paper: str
    swarm: str


HEAD = Row("quantity", "paper", "swarm")


def markdown(title: str, rows: Sequence[Row]) -> str:
    """A Markdown table with aligned columns, so that a terminal can show it too."""
    lines = [HEAD, *rows]
    widths = [max(len(line[column]) for line in lines) for column in range(len(HEAD))]
    lines.insert(1, Row(*("-" * width for width in widths)))
    texts = ["| " + " | ".join(map(str.ljust, line, widths)) + " |" for line in lines]
    return "\n".join([f"## {title}", "", *texts, ""])


def convergence(history: swarm.ContactHistory) -> str:
    """How a loop ended, in words."""
    last = f"V = {history.stored_energy[-1]:.2g} J"
    return f"yes, {len(history)} sweeps" if history.converged else f"no: {last} after {len(history)} sweeps"
