"""The tables of the guide that are made of declarations: what engines support, and the observables.

python tests/reference/tables.py     writes them into their pages
"""

import re
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))
from swarm.common import catalog
from swarm.run.preflight import knows

GUIDE = Path(__file__).parents[2] / "examples" / "guide"
TABLES = {"limits.md": knows.markdown, "results.md": catalog.markdown}


def written(page: str, lines: list[str]) -> str:
    """The page with these lines in place of the table that begins with the first of them."""
    table = re.compile(rf"^{re.escape(lines[0])}\n(?:\|.*\n)+", re.MULTILINE)
    if not table.search(page):
        raise ValueError(f"expected a table that begins with {lines[0]!r}, got none")
    return table.sub(lambda _: "\n".join(lines) + "\n", page)


if __name__ == "__main__":
    for name, lines in TABLES.items():
        path = GUIDE / name
        path.write_text(written(path.read_text("utf-8"), list(lines())), "utf-8")
