"""Objects in notebooks: small tables in HTML, in the colours of the notebook, without scripts."""

import html
import sys
from collections.abc import Iterable, Sequence
from typing import Any

# Notebooks align the cells of tables to the right.
_LEFT = ' style="text-align: left"'


def table(title: str, rows: Iterable[Sequence[str]], header: Sequence[str] = ()) -> str:
    """Return a table of texts; those of the header and of the first column are bold.

    >>> print(table("A <ball>", [["radius", "0.5 m"]]).replace(_LEFT, ""))
    <table><caption>A &lt;ball&gt;</caption>
    <tr><th>radius</th><td>0.5 m</td></tr></table>
    """
    lines = [f"<table><caption>{html.escape(title)}</caption>"]
    if header:
        lines.append("<tr>" + "".join(f"<th{_LEFT}>{html.escape(text)}</th>" for text in header) + "</tr>")
    for first, *others in rows:
        cells = "".join(f"<td{_LEFT}>{html.escape(text)}</td>" for text in others)
        lines.append(f"<tr><th{_LEFT}>{html.escape(first)}</th>{cells}</tr>")
    return "\n".join(lines) + "</table>"


def shortened(items: Sequence[Any], most: int = 8) -> list[str]:
    """Return the texts of some items, or of the first of them and the number of the others.

    >>> shortened(["a", "b", "c", "d"], most=3)
    ['a', 'b', '<2 more>']
    """
    shown = len(items) if len(items) <= most else most - 1
    return [*map(str, items[:shown]), *[f"<{len(items) - shown} more>"] * (shown < len(items))]


def is_running() -> bool:
    """Whether this is the kernel of a notebook."""
    shell = sys.modules.get("IPython")
    running = shell.get_ipython() if shell is not None else None
    # The IPython of a terminal has no kernel.
    return getattr(running, "kernel", None) is not None
