"""What got slower from one report to another, by more than the noise of both.

Times are compared in units of the bare loop in C of the same run, where both reports have one: so a processor that ran
at another clock is not taken for a change. The noise of a row is how far its median is from its best, in both reports
and in both of these loops.
"""

import csv
from dataclasses import dataclass
from pathlib import Path

# Of what is measured in these, more is better.
_MORE = ("x", "million/s")
# What is no speed: it either meets its bar or not.
_NOT_SPEED = ("relative", "ulp of the size", "m")
# What is not ours: yardsticks and limits of the machine.
_NOT_OURS = ("bare ", "plain ", "  plain ", "  two bare ", "limit: ")
_YARDSTICK = "bare loop in C, sphere"


@dataclass
class Change:
    """One row that both reports have: `slower` is the factor by which it got slower."""

    what: str
    old: float
    new: float
    unit: str
    slower: float
    noise: float

    def verdict(self) -> str:
        """In a word; empty within the noise."""
        if self.slower > 1.0 + self.noise:
            return "slower"
        return "faster" if self.slower < 1.0 / (1.0 + self.noise) else ""


def read(path: Path) -> dict[str, dict[str, str]]:
    """A report of `bench`, by what it measured."""
    with open(path, newline="") as file:
        table = csv.DictReader(file)
        missing = {"what", "min", "median", "unit"} - set(table.fieldnames or ())
        if missing:
            raise SystemExit(f"{path} is no report of bench: expected columns what, min, median, unit")
        return {row["what"]: row for row in table}


def _noise(row: dict[str, str]) -> float:
    """How far the median is from the best."""
    best, median = float(row["min"]), float(row["median"])
    return abs(median / best - 1.0) if best > 0.0 else 0.0


def changes(old: dict[str, dict[str, str]], new: dict[str, dict[str, str]]) -> list[Change]:
    """Every speed that both reports have."""
    clock, clock_noise = 1.0, 0.0
    if _YARDSTICK in old and _YARDSTICK in new:
        before, after = old[_YARDSTICK], new[_YARDSTICK]
        clock = float(after["min"]) / float(before["min"])
        clock_noise = max(_noise(before), _noise(after))
    found = []
    for what, before in old.items():
        after = new.get(what)
        if (
            after is None
            or before["unit"] in _NOT_SPEED
            or what.startswith(_NOT_OURS)
            or not float(before["min"]) > 0.0
        ):
            continue
        a, b, unit = float(before["min"]), float(after["min"]), before["unit"]
        timed = unit.startswith(("ns", "us", "ms", "s")) or unit in _MORE[1:]
        slower = a / b if unit in _MORE else b / a
        slower = slower / clock if timed else slower
        noise = _noise(before) + _noise(after) + (clock_noise if timed else 0.0)
        found.append(Change(what, a, b, unit, slower, noise))
    return found


def main(old: Path, new: Path) -> int:
    """Print the changes; 1 if anything got slower."""
    reports = read(old), read(new)
    rows = changes(*reports)
    print(f"{'':<66}{'old':>10}{'new':>10}  {'unit':<18}{'slower by':>10}{'noise':>8}")
    for row in rows:
        print(
            f"{row.what:<66}{row.old:>10.3g}{row.new:>10.3g}  {row.unit:<18}{row.slower:>9.2f}x{row.noise:>8.1%}"
            f"  {row.verdict()}"
        )
    for name, one, other in (("gone", *reports), ("new", *reversed(reports))):
        for what in one.keys() - other.keys():
            print(f"{what}: {name}")
    slower = [row.what for row in rows if row.verdict() == "slower"]
    print(f"{len(slower)} of {len(rows)} got slower by more than the noise" + "".join(f"\n  {what}" for what in slower))
    return 1 if slower else 0
