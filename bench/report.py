"""Measuring in turn and in processes, the machine's name, and the tables on the screen and in the folder of `-o`."""

import csv
import os
import platform
import resource
import statistics
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
# Where tables and pictures are written unless `-o` says otherwise: Git ignores it.
OUT = Path("out") / "bench"
_folder = OUT
# A quick report shows that it runs: nothing is compiled, and nothing is measured twice.
_is_quick = False


def be_quick() -> None:
    """The reports of this process are quick ones."""
    global _is_quick
    _is_quick = True


def tier() -> str:
    """`compile` of the runs of a report."""
    return "never" if _is_quick else "always"


@dataclass
class Row:
    """One line of the report."""

    what: str
    best: float
    median: float
    unit: str
    bar: str = ""
    ratio: float | None = None


def repeated(measure: Callable[[], float], repeats: int) -> tuple[float, float]:
    """Minimum and median."""
    values = [measure() for _ in range(repeats)]
    return min(values), statistics.median(values)


def in_turn(measures: dict[str, Callable[[], float]], rounds: int) -> dict[str, tuple[float, float]]:
    """Minimum and median of each, measured in turn: a shared machine is slower for seconds at a time.

    Before that each is called once, to warm up. Of a quick report each is called once in all.
    """
    if _is_quick:
        rounds = 1
    else:
        for measure in measures.values():
            measure()
    values = [{name: measure() for name, measure in measures.items()} for _ in range(rounds)]
    return {name: (min(v), statistics.median(v)) for name in measures for v in [[one[name] for one in values]]}


def child(code: str, *args: str, **environment: str) -> str:
    """What Python code prints in a process of its own, with this in its environment.

    Raises:
        CalledProcessError: the process failed.
    """
    paths = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH")]))
    done = subprocess.run(
        [sys.executable, "-c", code, *args],
        check=True,
        capture_output=True,
        text=True,
        env={**as_usual(), "PYTHONPATH": paths, **environment},
    )
    return done.stdout


def as_usual() -> dict[str, str]:
    """The environment, but Python keeps its bytecode, as it does by default: else a start takes 0.2 s."""
    return {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}


def machine() -> str:
    """The processor and its widest vectors."""
    try:
        text = Path("/proc/cpuinfo").read_text()
    except OSError:
        return platform.processor() or platform.machine()
    model = next((line.split(":")[1].strip() for line in text.splitlines() if line.startswith("model name")), "")
    vectors = "AVX-512" if "avx512f" in text else "AVX2" if "avx2" in text else "SSE"
    return f"{model}, {vectors}, {len(os.sched_getaffinity(0))} cores"


def name_of_machine() -> str:
    """The same as part of a file's name."""
    return "-".join("".join(c if c.isalnum() else " " for c in machine().lower()).split())


def commit() -> str:
    """The commit that is measured, and whether files differ from it."""
    command = ["git", "describe", "--always", "--dirty", "--abbrev=7"]
    try:
        return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return "unknown"


def stolen() -> tuple[int, int]:
    """What other guests of the machine took from this one since it started, and all of its time but that it idled."""
    try:
        user, nice, system, _idle, _wait, irq, soft, steal = map(int, Path("/proc/stat").read_text().split()[1:9])
    except OSError:
        return 0, 0
    return steal, user + nice + system + irq + soft + steal


def told_of_others(before: tuple[int, int]) -> str:
    """How much of what this machine wanted to compute since then others took: the median's enemy."""
    taken, busy = (after - then for after, then in zip(stolen(), before, strict=True))
    share = f"{100.0 * taken / busy:.0f} %" if busy > 0 else "an unknown part"
    return f"other guests of this machine took {share} of the time that its processors had work"


def show(rows: list[Row]) -> None:
    """The report on the screen."""
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"{machine()}; commit {commit()}; peak memory of this process {memory:.0f} MB")
    width = max((len(row.what) for row in rows), default=0) + 2
    print(f"{'':<{width}}{'min':>10}{'median':>10}  {'unit':<18}{'bar':>8}{'ratio':>8}")
    for row in rows:
        ratio = "" if row.ratio is None else f"{row.ratio:.2f}"
        best, median = (f"{one:.0f}" if one >= 1000.0 else f"{one:.3g}" for one in (row.best, row.median))
        print(f"{row.what:<{width}}{best:>10}{median:>10}  {row.unit:<18}{row.bar:>8}{ratio:>8}")


def write_to(folder: Path) -> None:
    """Make the folder that this process writes its tables and pictures to."""
    global _folder
    folder.mkdir(parents=True, exist_ok=True)
    _folder = folder


def file_of(name: str) -> Path:
    """A file in that folder."""
    return _folder / name


def write(rows: list[Row], report: str) -> None:
    """The report as CSV, one file a kind of machine."""
    path = file_of(f"{report}-{name_of_machine()}.csv")
    with open(path, "w", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["what", "min", "median", "unit", "bar", "ratio"])
        for row in rows:
            ratio = "" if row.ratio is None else f"{row.ratio:.3g}"
            table.writerow([row.what, f"{row.best:.4g}", f"{row.median:.4g}", row.unit, row.bar, ratio])
    print(f"written to {path}")
