"""The same job in other programs: one adapter each, left out with a sentence where the program is not installed."""

import importlib
from collections.abc import Iterable
from dataclasses import dataclass
from types import ModuleType
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Job:
    """Points of mass 1 in a sphere about the origin: its wall pushes back with alpha times the depth."""

    position: Floats  # (n, 3) [m]
    velocity: Floats  # (n, 3) [m/s]
    radius: float  # [m]
    alpha: float  # [N/m]
    dt: float  # [s]
    steps: int


class Peer(Protocol):
    """An adapter is a module of this package."""

    # How to get the program.
    INSTALL: str

    def version(self) -> str:
        """Name and version; raises ImportError or OSError where the program cannot be loaded."""

    def settings(self) -> str:
        """What is not the program's default, in a line."""

    def run(self, job: Job) -> tuple[Floats, float]:
        """Positions at the end, and the seconds of the steps alone, on one thread."""


def loaded(names: Iterable[str]) -> tuple[dict[str, tuple[ModuleType, str]], list[str]]:
    """The adapters with these names and the versions of their programs, and a sentence for each that is left out."""
    found, missing = {}, []
    for name in names:
        peer = importlib.import_module(f"{__package__}.{name}")
        try:
            found[name] = peer, peer.version()
        except (ImportError, OSError) as error:
            missing.append(f"{name} is left out: {error}; {peer.INSTALL} installs it.")
    return found, missing
