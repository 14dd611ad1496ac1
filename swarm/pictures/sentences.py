"""Sentences below the plots of a picture."""

import textwrap
from typing import Any

from . import style

# The height of a line [inches], and the number of letters in an inch.
_LINE, _LETTERS = 0.17, 14.0


def in_lines(texts: list[str], width: float) -> list[str]:
    """Wrap sentences to this width [inches]; return a text with line breaks for each."""
    letters = max(30, round(width * _LETTERS))
    return [textwrap.fill(text, letters, subsequent_indent="    ") for text in texts]


def height_of_lines(lines: list[str]) -> float:
    """The height of these texts, with all their lines [inches]."""
    return _LINE * (1.0 + sum(text.count("\n") + 1 for text in lines))


def write_below(figure: Any, lines: list[str], high: float) -> None:
    """Write texts one below the other into a figure of this height [inches]; a failed verdict (✗) is red."""
    line = 0.3
    for text in lines:
        figure.text(0.02, 1.0 - line * _LINE / high, text, va="top", fontsize=8.5,
                    color=style.RED if text.startswith("✗") else style.ink())  # fmt: skip
        line += text.count("\n") + 1
