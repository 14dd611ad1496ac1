"""The runs of a sweep, from a scene file with a [sweep] table of lists; all are checked before the first one begins."""

import hashlib
import itertools
import json
import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from .. import scene_file
from ..common.checks import count, listed, number, one_of
from ..errors import SceneError
from ..scene import Scene
from ..serialization.plugins import allowed, checked_modules
from ..serialization.tables import files_in

# A sweep with more runs has a mistake in a list: their files alone would be a burden to a folder.
_MOST = 1_000_000
# Runs are found again by a digest of their inputs; these keys of [run] do not change the results.
_WITHOUT_EFFECT = ("threads", "checkpoint", "compile")
# Hexadecimal digits of that digest: among a million runs two have the same in one of 500 sweeps, which is detected.
_DIGITS = 12
STEM = re.compile(rf"[0-9a-f]{{{_DIGITS}}}")
COMBINE, WAYS = "combine", ("product", "zip")
# Keys of a document that define its scene.
_SCENE = ("surface", "gravity", "period", "plane", "pairs")

Document = dict[str, Any]


@dataclass(frozen=True)
class Variant:
    """One run of a sweep.

    Attributes:
        number: its index in the plan.
        parameters: the keys of the sweep and their values.
        stem: the stem of the names of its files.
        kind: the same for runs that differ in numbers alone, and so probably share their kernels.
        has_impacts: whether it writes a log of impacts.
    """

    number: int
    parameters: dict[str, Any]
    stem: str
    kind: str
    has_impacts: bool


@dataclass(frozen=True)
class Plan:
    """The file of a sweep, its tables without [sweep], its runs, modules of its plugins, and the files it names."""

    path: Path
    document: Document
    variants: list[Variant]
    plugins: tuple[str, ...] = ()
    named: tuple[Path, ...] = ()

    def text(self, variant: Variant) -> str:
        """Return the scene file of a run."""
        return f"# A run of {self.path.name}: {in_one_line(variant.parameters)}\n\n" + tomli_w.dumps(
            _with(self.document, variant.parameters)
        )


def in_one_line(parameters: Mapping[str, Any]) -> str:
    """Parameters as in a sweep file, in one line."""
    return ", ".join(f'"{key}" = {json.dumps(value, default=str):.200}' for key, value in parameters.items())


def read(path: Path, plugins: Iterable[str] = ()) -> Plan:
    """Read the plan of a sweep file.

    Raises:
        SceneError: the file cannot be read, its [sweep] table is invalid, or the scene of one of its runs is invalid;
            the message names the key of the sweep and the value.
    """
    document = scene_file.document_of(scene_file.text_of(path), path)
    try:
        if scene_file.SWEEP not in document:
            raise SceneError(
                'expected a [sweep] table with lists such as "particles.seed" = {range = 20}, got none; one run of a '
                f"scene file is carried out by swarm run {path}"
            )
        lists, way = _lists(document.pop(scene_file.SWEEP))
        with allowed(plugins):
            variants, named = _checked(path, document, list(_combined(lists, way)))
            return Plan(path, document, variants, checked_modules(plugins), named)
    except SceneError as error:
        raise SceneError(f"{path}: {error}") from None


def _lists(table: Any) -> tuple[dict[str, list[Any]], str]:
    """The values of every key, and the way in which they are combined."""
    if not isinstance(table, dict):
        raise SceneError(f"sweep: expected a [sweep] table, got {table!r:.200}")
    way = one_of(f"sweep.{COMBINE}", table.get(COMBINE, WAYS[0]), WAYS)
    given = dict(_flat({key: value for key, value in table.items() if key != COMBINE}))
    if not given:
        raise SceneError('sweep: expected at least one list, such as "particles.seed" = {range = 20}, got none')
    for one, other in itertools.permutations(given, 2):
        if other.startswith(f"{one}."):
            raise SceneError(f'sweep."{other}": lies within "{one}", which has a list of its own; remove one of them')
    return {key: _values(f'sweep."{key}"', value) for key, value in given.items()}, way


def _flat(table: Document, before: str = "") -> Iterator[tuple[str, Any]]:
    """The keys of a table and of the tables in it, as TOML makes them of keys with dots but no quotes."""
    for key, value in table.items():
        if isinstance(value, dict) and not (len(value) == 1 and set(value) <= set(MAKERS)):
            if not value:
                raise SceneError(f'sweep."{before}{key}": expected a list of values, got an empty table')
            yield from _flat(value, f"{before}{key}.")
        else:
            yield before + key, value


def _values(where: str, given: Any) -> list[Any]:
    """The values of a list, or of a table such as {range = 20}."""
    if not isinstance(given, (dict, list)):
        raise SceneError(f"{where}: expected a list of values, or one of {listed(MAKERS)} in a table, got {given!r}")
    values: Any = given
    if isinstance(given, dict):
        ((name, numbers),) = given.items()
        values = MAKERS[name](f"{where}.{name}", numbers)
    if not values:
        raise SceneError(f"{where}: expected at least one value, got none")
    return list(values)


def _range(where: str, given: Any) -> list[Any]:
    """The whole numbers of Python's range."""
    numbers = given if isinstance(given, list) else [given]
    whole = all(isinstance(one, int) and not isinstance(one, bool) for one in numbers)
    if not whole or len(numbers) not in (1, 2, 3) or numbers[2:] == [0]:
        raise SceneError(f"{where}: expected n for 0 to n - 1, [first, end] or [first, end, step], got {given!r}")
    made = range(*numbers)
    if len(made) > _MOST:
        raise SceneError(f"{where}: expected at most {_MOST} values, got {len(made)}")
    return list(made)


def _geometric(where: str, given: Any) -> list[Any]:
    first, last, n = _ends(where, given)
    if first * last <= 0.0:
        raise SceneError(f"{where}: expected a first and a last number of one sign, neither of them 0, got {given!r}")
    return list(map(float, np.geomspace(first, last, n)))


def _ends(where: str, given: Any) -> tuple[float, float, int]:
    if not isinstance(given, list) or len(given) != 3:
        raise SceneError(f"{where}: expected [first, last, how many], got {given!r}")
    n = count(f"{where}[2]", given[2])
    if n > _MOST:
        raise SceneError(f"{where}[2]: expected at most {_MOST} values, got {n}")
    return number(f"{where}[0]", given[0]), number(f"{where}[1]", given[1]), n


MAKERS: dict[str, Callable[[str, Any], list[Any]]] = {
    "range": _range,
    "linspace": lambda where, given: list(map(float, np.linspace(*_ends(where, given)))),
    "geomspace": _geometric,
}


def _combined(lists: dict[str, list[Any]], way: str) -> Iterator[dict[str, Any]]:
    """The parameters of every run; in a product the last key changes first."""
    lengths = {key: len(values) for key, values in lists.items()}
    if way == "zip":
        first, n = next(iter(lengths.items()))
        for key, length in lengths.items():
            if length != n:
                raise SceneError(
                    f'sweep: combine = "zip" needs lists of the same length, got {n} values of "{first}" and {length} '
                    f'of "{key}"'
                )
        rows: Iterator[tuple[Any, ...]] = zip(*lists.values(), strict=True)
    else:
        if math.prod(lengths.values()) > _MOST:
            numbers = " x ".join(map(str, lengths.values()))
            raise SceneError(f'sweep: expected at most {_MOST} runs, got {numbers}; shorten a list, or combine = "zip"')
        rows = itertools.product(*lists.values())
    return (dict(zip(lists, row, strict=True)) for row in rows)


def _checked(path: Path, document: Document, rows: list[dict[str, Any]]) -> tuple[list[Variant], tuple[Path, ...]]:
    """The checked runs, and the files that they name."""
    contents: dict[Path, str] = {}
    # A formula or a mesh takes long, and the scenes of many meshes much memory: each is made once, and only the last
    # one is kept; `right` has the digests of the valid scenes.
    right: set[str] = set()
    last: Scene | None = None
    variants: dict[str, Variant] = {}
    for parameters in rows:
        own = _with(document, parameters)
        try:
            # The files with particles are not opened yet.
            scene = _digest_of([own.get(name) for name in _SCENE])
            job = scene_file.job_of(own, "", path, last if scene in right else None)
            right.add(scene)
            last = job.scene
            start = job.start_file()
            if start is not None and not start.is_file():
                raise SceneError(f"{'particles' if 'particles' in own else 'body'}.from: there is no file {start}")
        except SceneError as error:
            raise SceneError(_attributed(str(error), parameters, len(variants), len(rows))) from None
        for name, value in (("trajectory", job.run.trajectory), ("recording", job.run.recording)):
            if value is not None:
                raise SceneError(
                    f"run.{name}: the files of the runs of a sweep are named by it, got {str(value)!r}; remove the key"
                    + ("; swarm record makes a recording of a trajectory" if name == "recording" else "")
                )
        job.require_within(["impacts"])
        stem = _digest(own, path, contents)
        kind = _digest_of(_unnumbered(own))
        made = Variant(len(variants), parameters, stem, kind, job.run.impacts is not None)
        if stem in variants:
            raise SceneError(
                f"sweep: the runs with {in_one_line(variants[stem].parameters)} and with "
                f"{in_one_line(parameters)} are the same; remove the value that comes twice or makes no difference"
            )
        variants[stem] = made
    return list(variants.values()), tuple(file.absolute() for file, content in contents.items() if content)


def _with(document: Document, parameters: Mapping[str, Any]) -> Document:
    """A copy of the tables of a scene with these parameters."""
    for key, value in parameters.items():
        document = _put(document, key.split("."), value, key)
    return document


def _put(place: Any, steps: list[str], value: Any, key: str) -> Any:
    """A copy of a table or list with one other value; the rest is shared."""
    step, *rest = steps
    if isinstance(place, dict):
        return {**place, step: _put(place.get(step, {}), rest, value, key) if rest else value}
    passed = ".".join(key.split(".")[: -len(steps)])
    if not isinstance(place, list):
        raise SceneError(f'sweep."{key}": {passed} is {place!r:.100}, which has no {step!r}')
    if not (step.isascii() and step.isdecimal() and int(step) < len(place)):
        there = {0: "is empty", 1: "has one entry, number 0"}.get(len(place), f"has the entries 0 to {len(place) - 1}")
        raise SceneError(f'sweep."{key}": {passed} {there}, got {step!r}')
    changed = list(place)
    changed[int(step)] = _put(place[int(step)], rest, value, key) if rest else value
    return changed


def _attributed(sentence: str, parameters: Mapping[str, Any], k: int, n: int) -> str:
    """The message about an invalid scene, with the key of the sweep that caused the error."""
    match = re.match(r"[\w.\[\]-]+", sentence)
    named = match.group().rstrip(".") if match else ""
    owners = {}
    for key, value in parameters.items():
        # Messages about scenes call surface.0.radius surface[0].radius.
        mine = re.sub(r"\.(\d+)", r"[\1]", key)
        if mine == named or mine.startswith((f"{named}.", f"{named}[")) or named.startswith((f"{mine}.", f"{mine}[")):
            owners[key] = value
    if len(owners) == 1:
        ((key, value),) = owners.items()
        return f'sweep."{key}" = {json.dumps(value, default=str):.200}: {sentence}'
    return f"run {k + 1} of {n}, with {in_one_line(parameters)}: {sentence}"


def _digest(document: Document, path: Path, contents: dict[Path, str]) -> str:
    """The digest of a run: of its tables, and of the contents of the files that they name."""
    what = {**document, "run": {key: value for key, value in document["run"].items() if key not in _WITHOUT_EFFECT}}
    files = []
    for name in files_in(document):
        file = path.parent / name
        if file not in contents:
            contents[file] = hashlib.sha256(file.read_bytes()).hexdigest() if file.is_file() else ""
        files.append(contents[file])
    return _digest_of([what, files])[:_DIGITS]


def _digest_of(tables: Any) -> str:
    return hashlib.sha256(json.dumps(tables, sort_keys=True, default=str).encode()).hexdigest()


def _unnumbered(value: Any) -> Any:
    """A copy of a table, or of a value in it, without numbers."""
    if isinstance(value, dict):
        return {key: _unnumbered(one) for key, one in value.items()}
    if isinstance(value, list):
        # Long lists are arrays of numbers.
        return [_unnumbered(one) for one in value] if len(value) <= 3 or isinstance(value[0], dict) else []
    return value if isinstance(value, (str, bool)) else None
