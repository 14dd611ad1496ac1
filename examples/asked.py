"""The command line of the examples that draw: what they ask for, where they write, and which packages they need."""

import argparse
import importlib.util
from pathlib import Path
from typing import Any

# What examples write goes here unless they are told otherwise: Git ignores it.
OUT = Path("out")
# One module of each extra of pyproject.toml says whether it is installed.
_MODULES = {"plot": "matplotlib", "mesh": "trimesh", "table": "pandas"}


class Asked(argparse.ArgumentParser):
    """Arguments of an example, with `-o`, its picture.

    Args:
        doc: of the module, whose first line is shown.
        name: of the picture.
        extras: of pyproject.toml, which it needs.
    """

    def __init__(self, doc: str | None, name: str, *extras: str) -> None:
        super().__init__(description=(doc or "").split("\n")[0])
        self._extras = extras
        self.add_argument(
            "-o", "--output", type=Path, default=OUT / name, metavar="FILE", help="the picture [default: %(default)s]"
        )

    def parse_args(self, *given: Any, **more: Any) -> Any:
        """The arguments; what is missing is a sentence before anything runs."""
        asked = super().parse_args(*given, **more)
        missing = [extra for extra in self._extras if importlib.util.find_spec(_MODULES[extra]) is None]
        if missing:
            names = ", ".join(_MODULES[extra] for extra in missing)
            self.exit(1, f'{self.prog} needs {names}: pip install ".[{",".join(self._extras)}]"\n')
        asked.output.parent.mkdir(parents=True, exist_ok=True)
        return asked
