"""Logs of impacts are written: rows are appended, and the number of complete frames comes last.

impacts/{time,particle,wall,position,velocity_before,velocity_after,impulse}, one entry an impact, with friction also
impacts/slip, in a periodic scene impacts/image, impacts/partner of balls, and impacts/{duration,largest_force,
friction_loss} of contacts of grains; frames/complete (2,), the number of complete frames, and frames/{time,rows}, their
times and the numbers of rows until their ends: later rows are not valid yet.
walls/{surface,member} tell the surface and member of each number in impacts/wall. parameters/{scene,method,kept} as
TOML text, parameters/particles, their number, parameters/start, their digest at the start, and parameters/seed.
"""

import json
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from ..common.frames import ROWS
from ..compiled_scene import CompiledScene
from ..methods import Method
from . import checksums
from .appended import AppendedFile, put
from .layout import ARRAYS
from .storage import Storage
from .writer import WriteFrames, Written, descriptions

# Rows of a chunk, a few for each particle, within these bounds: larger ones are written sooner (for 10^4 particles
# in half the time of chunks of 2^13 rows), and a log of a few rows is a small file.
_SMALLEST, _LARGEST = 1 << 10, 1 << 16
# Rows that are gathered before they are written: a call for each column takes as long as a few hundred of them.
_SOME = 1 << 12

Rows = dict[str, NDArray[Any]]


def about(compiled: CompiledScene, method: Method, kept: str, identity: dict[str, Any]) -> dict[str, Any]:
    """The description of a run in its log: group/name -> text, number or array."""
    surface, member = compiled.numbering.members
    arrays: dict[str, Any] = {}
    texts = {
        name: text
        for name, text in descriptions(compiled.scene, method, Storage(), arrays).items()
        if name != "storage"
    }
    return {
        **{f"parameters/{name}": value for name, value in {**texts, "kept": kept, **identity}.items()},
        **{f"parameters/{ARRAYS}/{name}": values for name, values in arrays.items()},
        "walls/surface": surface,
        "walls/member": member,
    }


class ImpactWriter(AppendedFile):
    """A context that creates the log, or reopens it, and returns the function that writes the rows of frames.

    Args:
        path: the file.
        columns: name -> array without rows.
        ends: frame -> number of rows until its end; written frames are removed.
        about: group/name -> text, number or array.
        start: the numbers of frames and rows of the file to continue; None: a new file.
    """

    def __init__(
        self, path: Path, columns: Rows, ends: dict[int, int], about: dict[str, Any], start: tuple[int, int] | None
    ) -> None:
        super().__init__(path, "log of impacts", start is not None)
        self._columns, self._ends, self._about = columns, ends, about
        self._frames, self._rows = start or (0, 0)
        self._few: list[Rows] = []
        # Checksums of the rows of the frame under way, by columns, and of complete frames; None in an older file.
        self._sums: checksums.RowSums | None = None
        self._running = dict.fromkeys(columns, 0)
        self._whole: list[dict[str, int]] = []

    def __enter__(self) -> WriteFrames:
        with self._beginning():
            if not self._following:
                self._create()
            self._find()
            if self._sums is not None:
                self._go_on_from_rows()
            # Rows of frames that are computed again are not cut off, which a kill may spoil, but overwritten. Several
            # threads write them in another order, so that these frames are not complete from now on.
            self._complete(self._frames)
        return self._write

    def _create(self) -> None:
        file, particles = self._file, int(self._about["parameters/particles"])
        chunk = min(_LARGEST, max(_SMALLEST, 1 << (4 * particles).bit_length()))
        for name, value in self._about.items():
            file[name] = value
        for name, column in self._columns.items():
            # A kernel gives every row; zeros before would be written for nothing.
            file.create_dataset(
                f"impacts/{name}", column.shape, column.dtype, maxshape=(None, *column.shape[1:]),
                chunks=(chunk, *column.shape[1:]), fill_time="never",
            )  # fmt: skip
        for name, dtype in (("time", np.float64), ("rows", np.int64)):
            file.create_dataset(f"frames/{name}", (0,), dtype, maxshape=(None,), chunks=(ROWS,))
        file["frames/complete"] = _counted(0)
        names = [*(f"impacts/{name}" for name in self._columns), "frames/time", "frames/rows"]
        checksums.RowSums.create(file, dict.fromkeys(names, (1, 0)), ["frames/complete"])

    def _go_on_from_rows(self) -> None:
        """Start the checksums with the rows of the frame under way that are in the file."""
        first = int(self._counts[self._frames - 1]) if self._frames else 0
        for begin in range(first, self._rows, _LARGEST):
            some = slice(begin, min(begin + _LARGEST, self._rows))
            for name, dataset in self._data.items():
                self._running[name] = checksums.checksum_of(dataset[some], self._running[name])

    def _find(self) -> None:
        self._sums = checksums.RowSums.of(self._file)
        self._data: dict[str, h5py.Dataset] = {name: self._file[f"impacts/{name}"] for name in self._columns}
        self._time, self._counts = self._file["frames/time"], self._file["frames/rows"]
        self._begin()

    def _complete(self, frames: int) -> None:
        """Write the number of complete frames, after these are in the file."""
        dataset = self._file["frames/complete"]
        put(dataset, 0, _counted(frames)[: len(dataset)])
        self._flush()

    def add(self, rows: Rows) -> None:
        """Add rows; their arrays may be changed after it returns."""
        if len(rows["time"]) < _SOME and sum(len(few["time"]) for few in self._few) < _SOME:
            self._few.append({name: array.copy() for name, array in rows.items()})
            return
        with self._writing("impacts"):
            self._add_few()
            self._put(rows)

    def _add_few(self) -> None:
        if self._few:
            self._put({name: np.concatenate([few[name] for few in self._few]) for name in self._columns})
            self._few = []

    def _put(self, rows: Rows) -> None:
        self._sum(rows)
        for name, dataset in self._data.items():
            put(dataset, self._rows, rows[name])
        self._rows += len(rows["time"])

    def _sum(self, rows: Rows) -> None:
        """Update the checksums with the next rows, up to the ends of frames among them."""
        if self._sums is None:
            return
        place, count = 0, len(rows["time"])
        for end in [end for _frame, end in sorted(self._ends.items())[len(self._whole) :]]:
            if end > self._rows + count:
                break
            self._add_sums(rows, place, end - self._rows)
            place = end - self._rows
            self._whole.append(self._running)
            self._running = dict.fromkeys(self._columns, 0)
        self._add_sums(rows, place, count)

    def _add_sums(self, rows: Rows, begin: int, end: int) -> None:
        if end > begin:
            for name, before in self._running.items():
                self._running[name] = checksums.checksum_of(rows[name][begin:end], before)

    def _write(self, frames: list[Written]) -> None:
        with self._writing(f"the impacts of frame {frames[0][0]}"):
            self._add_few()
            self._sum({name: column[:0] for name, column in self._columns.items()})
            first, times = frames[0][0], np.array([moment for _number, moment, *_ in frames])
            counts = np.array([self._ends.pop(number) for number, *_ in frames])
            if self._sums is not None:
                some, self._whole = self._whole[: len(frames)], self._whole[len(frames) :]
                self._sums.take({f"impacts/{name}": [one[name] or 1 for one in some] for name in self._columns})
                self._sums.add("frames/time", times)
                self._sums.add("frames/rows", counts)
                self._sums.write(first)
            put(self._counts, first, counts)
            put(self._time, first, times)
            self._file.flush()
            self._complete(frames[-1][0] + 1)
            if self._is_new():
                self._rename()

    def sums(self) -> str:
        """The checksums of the rows of the frame under way, by column, as text; "" if the file has no checksums."""
        return "" if self._sums is None else json.dumps(self._running)

    def sync(self) -> None:
        """Flush the written data to the disk."""
        with self._writing("impacts"):
            self._add_few()
            self._flush()
        super().sync()


def _counted(frames: int) -> NDArray[np.int64]:
    """The number of complete frames and its checksum, which are written at once."""
    return np.array([frames, checksums.checksum_of(np.int64(frames))])
