"""Statements on a run: `swarm info`, pages, pictures, recordings and notebooks print one list of them."""

from collections.abc import Iterable
from typing import NamedTuple

_MARKS = {True: "✓", False: "✗", None: "·"}


class Statement(NamedTuple):
    """A statement on a run.

    Attributes:
        label: its subject, such as "energy".
        text: the statement, in words.
        verdict: whether the statement's condition holds; None: a fact without a limit.
    """

    label: str
    text: str
    verdict: bool | None = None


def rows_of(statements: Iterable[Statement]) -> dict[str, str]:
    """The texts of statements by their labels, verdicts with their marks: the rows of a table.

    >>> rows_of([Statement("energy", "kept", True), Statement("gravity", "none")])
    {'energy': '✓ kept', 'gravity': 'none'}
    """
    return {
        label: text if verdict is None else f"{_MARKS[verdict]} {text}" for label, text, verdict in statements
    }  # fmt: skip


def lines_of(statements: Iterable[Statement]) -> list[str]:
    """Statements as the lines of a picture.

    >>> lines_of([Statement("energy", "kept", True), Statement("walls", "springs gave way")])
    ['✓ energy: kept', '· walls: springs gave way']
    """
    return [f"{_MARKS[verdict]} {label}: {text}" for label, text, verdict in statements]
