"""How a trajectory came to be: its end, its threads and its pace, and the versions of what made it."""

import datetime
import os
import platform
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from ..version import VERSION

_CPUS = Path("/proc/cpuinfo")


class Course(NamedTuple):
    """A run as it is carried out: its end [s], its threads, and the seconds that it has taken so far."""

    until: float
    threads: int
    clock: Callable[[], float]


def makers() -> dict[str, str]:
    """What makes a trajectory, and when, for the attributes of h5md/creator."""
    import h5py
    import numba
    import numpy

    return {
        "name": "swarm",
        "version": VERSION,
        "python": platform.python_version(),
        "numpy": numpy.__version__,
        "numba": numba.__version__,
        "hdf5": h5py.version.hdf5_version,
        "machine": f"{_processor()}, {os.cpu_count()} logical cores, {platform.system()}",
        "date": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
    }


def _processor() -> str:
    """The name of the processor, or of its kind."""
    try:
        told = [line.partition(":")[2].strip() for line in _CPUS.read_text().splitlines() if "model name" in line]
    except OSError:
        told = []
    return told[0] if told else platform.machine()


def creator_of(file: Any) -> dict[str, str]:
    """The attributes of h5md/creator that are texts; fewer of older versions."""
    return {name: value for name, value in file["h5md/creator"].attrs.items() if isinstance(value, str)}
