"""Docstrings in sections: the meaning of each argument, the result, the errors, the example."""

import inspect
import re
import textwrap
from typing import Any

# Sections that begin on the line of their heading.
_LINES = ("Conserves", "Order", "Cost", "Source", "Reference")
_HEADING = re.compile(r"^([A-Z][A-Za-z ]*)(?:, [^:]*)?:(?: (.*))?$")
_ENTRY = re.compile(r"^([*\w., ]+?): (.*)$")
_EXAMPLE = ">>> "


def sections_of(value: Any) -> dict[str, str]:
    """The sections of a docstring in order; "" has the text before the first section, and paragraphs between sections.

    >>> list(sections_of(sections_of))
    ['', 'Example']
    """
    found: dict[str, list[str]] = {"": []}
    name = ""
    for line in (inspect.getdoc(value) or "").splitlines():
        heading = _HEADING.match(line)
        if heading and heading[2] is not None and heading[1] not in _LINES:
            heading = None  # a paragraph with a colon
        if line.startswith(_EXAMPLE):
            name = "Example"
        elif heading:
            name = heading[1]
            found.setdefault(name, []).extend([heading[2]] if heading[2] else [])
            continue
        elif name not in ("", "Example") and line and not line.startswith(" "):
            # A paragraph after a section, unless the section begins on the line of its heading.
            name = name if name in _LINES and found[name] and found[name][-1] else ""
        found.setdefault(name, []).append(line)
    return {name: "\n".join(lines).strip("\n") for name, lines in found.items() if any(lines)}


def entries_of(text: str) -> dict[str, str]:
    r"""The entries of a section: names, and the text of each in one line.

    >>> entries_of("    one, two: both of\n        them.\n    three: [m].")
    {'one': 'both of them.', 'two': 'both of them.', 'three': '[m].'}
    """
    found: dict[str, str] = {}
    names: list[str] = []
    for line in textwrap.dedent(text).splitlines():
        entry = None if line.startswith(" ") else _ENTRY.match(line)
        if entry:
            names = [name.strip(" *") for name in entry[1].split(",")]
            found |= dict.fromkeys(names, entry[2])
        else:
            found |= {name: f"{found[name]} {line.strip()}".strip() for name in names}
    return found


def meanings_of(value: Any) -> dict[str, str]:
    """The text on each argument of a function or a class, including those of its bases.

    >>> import swarm
    >>> meanings_of(swarm.Box)["restitution"].partition(":")[0]
    'e in [0, 1]'
    """
    found: dict[str, str] = {}
    for kind in reversed(value.__mro__) if isinstance(value, type) else [value]:
        if kind.__doc__:
            found |= entries_of(sections_of(kind).get("Args", ""))
    return found


def first_line(value: Any) -> str:
    """The first sentence of a docstring, of one line or more."""
    return " ".join((inspect.getdoc(value) or "").partition("\n\n")[0].split())
