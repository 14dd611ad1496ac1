"""The command line of the examples that draw: what they ask for, where they write, and which packages they need."""

import argparse
import importlib.util
from pathlib import Path
from typing import Any

# What examples write goes here by default: Git ignores it.
OUT = Path("out")
# What the extras of pyproject.toml hold of what examples import.
_MODULES = {"plot": ("matplotlib",), "mesh": ("trimesh", "igl"), "table": ("pandas",)}


class Asked(argparse.ArgumentParser):
    """Arguments of an example, with `-o`, its picture.

    Args:
        doc: of the module; its first line is shown.
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
        needed = [name for extra in self._extras for name in _MODULES[extra]]
        missing = [name for name in needed if importlib.util.find_spec(name) is None]
        if missing:
            self.exit(1, f'{self.prog} needs {", ".join(missing)}: pip install ".[{",".join(self._extras)}]"\n')
        asked.output.parent.mkdir(parents=True, exist_ok=True)
        return asked
