"""The origin of a trajectory: its end, its threads and its pace, and the versions of the software."""

import datetime
import functools
import importlib.machinery
import os
import platform
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from ..common.checks import shown
from ..version import VERSION

_NAME = "swarm"
_CREATOR = "h5md/creator"
_CPUS = Path("/proc/cpuinfo")


class Course(NamedTuple):
    """A run as it is carried out: its end [s], its threads, and a clock of the seconds so far."""

    until: float
    threads: int
    clock: Callable[[], float]


def makers() -> dict[str, str]:
    """The software that makes a trajectory, and the date, for the attributes of h5md/creator."""
    import h5py
    import numpy

    return {
        "name": _NAME,
        "version": VERSION,
        "python": platform.python_version(),
        "numpy": numpy.__version__,
        "numba": _numba(),
        "hdf5": h5py.version.hdf5_version,
        "machine": f"{_processor(_CPUS)}, {os.cpu_count()} logical cores, {platform.system()}",
        "date": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
    }


@functools.cache
def _numba() -> str:
    """The version of Numba, without its import: from the name of the folder beside it.

    `importlib.metadata` imports a parser of mails, which takes 20 ms.
    """
    found = importlib.machinery.PathFinder.find_spec("numba")
    beside = Path(str(found.origin)).parents[1].glob("numba-*.dist-info") if found else iter(())
    names = [folder.name.removeprefix("numba-").removesuffix(".dist-info") for folder in beside]
    if len(names) == 1:
        return names[0]
    from importlib.metadata import version  # installed in another way

    return version("numba")


@functools.cache
def _processor(file: Path) -> str:
    """The name of the processor in a file of the system, or the kind of machine."""
    try:
        models = [line.partition(":")[2].strip() for line in file.read_text().splitlines() if "model name" in line]
    except OSError:
        models = []
    return models[0] if models else platform.machine()


def is_own(file: Any) -> bool:
    """Whether the attributes of a file say that swarm made it."""
    return _CREATOR in file and file[_CREATOR].attrs.get("name") == _NAME


def creator_of(file: Any) -> dict[str, str]:
    """The attributes of h5md/creator, which are texts; files of older versions have fewer.

    Raises:
        ValueError: one is not a text in one line, or the date is invalid.
    """
    found = dict(file[_CREATOR].attrs) if _CREATOR in file else {}
    for name, value in found.items():
        if not isinstance(value, str) or not value.isprintable():
            raise ValueError(f"{name} of {_CREATOR} must be a text in one line, got {shown(value)}")
    if "date" in found:
        try:
            datetime.datetime.fromisoformat(found["date"])
        except ValueError:
            raise ValueError(f"date of {_CREATOR} must be a date of ISO 8601, got {shown(found['date'])}") from None
    return found
