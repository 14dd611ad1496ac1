"""`python -m bench.redraw FOLDER`: the pictures of reports, drawn again from their tables, without a measurement."""

import argparse
import csv
import re
from pathlib import Path
from typing import Any

from . import accuracy, figure, pairs, report, throughput
from .stability import MAPS

# Names of makers and families that are written in capitals.
_CAPITALS = ("amd", "epyc", "cpu")


def machine_of(name: str) -> str:
    """The machine in words, by its part of a file's name."""
    parts = re.fullmatch(r"(.+)-(avx-512|avx2|sse)-(\d+)-cores", name)
    if parts is None:
        return name
    # A file's name has the letter of "(R)" as a word.
    words = [word for word in parts[1].split("-") if word != "r"]
    model = " ".join(word.upper() if word in _CAPITALS else word.capitalize() for word in words)
    return f"{model}, {parts[2].upper()}, {parts[3]} cores"


def rows(path: Path) -> list[dict[str, str]]:
    """The lines of a table, by its columns."""
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def number(text: str) -> Any:
    """An int or a float; what is neither stays a word."""
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            pass
    return text


def scene_of(path: Path) -> str:
    """The scene of a table of `python -m bench accuracy`."""
    return max((s for s in accuracy.scenes() if path.stem.startswith(f"accuracy-{s.replace(' ', '-')}-")), key=len)


def redraw_accuracy(path: Path) -> None:
    """One scene of `python -m bench accuracy`."""
    name = scene_of(path)
    where = machine_of(path.stem.removeprefix(f"accuracy-{name.replace(' ', '-')}-"))
    found = []
    for row in rows(path):
        method, setting, *numbers = row.values()
        seconds, *errors, energy, depth = map(float, numbers)
        found.append(accuracy.Point(name, method, setting, seconds, tuple(errors), energy, depth))
    told = accuracy.advice(name, found)
    figure.accuracy(name, found, accuracy.front(found, -1), told, where, path.stem)


def redraw_throughput(path: Path) -> None:
    """`python -m bench throughput` of a machine."""
    found: figure.Found = {}
    limits: figure.Limits = {}
    methods, scenes = ("|".join(map(re.escape, names)) for names in (throughput.METHODS, throughput.SCENES))
    wanted = re.compile(rf"({methods}), ({scenes}), (\de\d), (\d) thr, (.+)")
    for row in rows(path):
        values = [float(row["min"]), float(row["median"])]
        case = wanted.fullmatch(row["what"])
        if case is None:
            limits[row["what"]] = values
        else:
            method, scene, count, threads, output = case.groups()
            found[throughput.Case(method, scene, int(float(count)), int(threads), output)] = values
    fixed = [name for name, way in throughput.METHODS.items() if way.step]
    figure.throughput(found, limits, fixed, machine_of(path.stem.removeprefix("throughput-")), path.stem)


def main() -> None:
    """Every table of the folder that has a picture."""
    parser = argparse.ArgumentParser(prog="python -m bench.redraw", description="Pictures of reports, drawn again.")
    parser.add_argument("folder", type=Path, help="of the tables, .csv; pictures are written beside them")
    folder = parser.parse_args().folder
    if not folder.is_dir():
        parser.error(f"{folder} is no folder")
    report.write_to(folder)
    for path in sorted(folder.glob("accuracy-*.csv")):
        redraw_accuracy(path)
    for path in sorted(folder.glob("throughput-*.csv")):
        redraw_throughput(path)
    for name, one in MAPS.items():
        path = folder / f"stability-{name}.csv"
        if path.exists():
            one.draw([{key: number(text) for key, text in row.items()} for row in rows(path)])
    if (path := folder / "pairs.csv").exists():
        pairs.draw(pairs.read(path))


if __name__ == "__main__":
    main()
