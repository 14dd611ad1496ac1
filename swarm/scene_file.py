"""Scene files: TOML to a job. A scene file is data: nothing in it is executed."""

import dataclasses
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from . import tables
from .checks import closest, count, listed, particles_fit
from .errors import SceneError
from .filling import fill
from .methods import Method
from .particles import Particles
from .run.options import RunOptions
from .scene import Scene

_TABLES = ("gravity", "particles", "surface", "method", "run")
_SAVED = {"checkpoint": 60.0}


@dataclass(frozen=True)
class ParticlesTable:
    """[particles]: their number, speed and mass, or the file that holds them."""

    count: int | None = None
    speed: float | None = None
    temperature: float | None = None
    mass: float | None = None
    seed: int | None = None
    source: str | None = dataclasses.field(default=None, metadata={"key": "from"})
    frame: int | None = None


@dataclass(frozen=True)
class Job:
    """What a scene file describes, checked; `text` is the file itself."""

    scene: Scene
    method: Method
    run: RunOptions
    text: str
    source: ParticlesTable
    path: Path

    def start_file(self) -> Path | None:
        """The file that holds the particles, or None."""
        return None if self.source.source is None else self.path.parent / self.source.source

    def particles(self) -> Particles:
        """The particles at the start, filled or read.

        Raises:
            SceneError: a value of [particles] is out of its range, or the file it names cannot be used.
        """
        try:
            return self._particles()
        except SceneError as error:
            raise SceneError(f"{self.path}, [particles]: {error}") from None

    def _particles(self) -> Particles:
        table = self.source
        if table.source is None:
            assert table.count is not None
            particles_fit("count", table.count)
            return fill(
                self.scene,
                table.count,
                speed=table.speed,
                temperature=table.temperature,
                mass=1.0 if table.mass is None else table.mass,
                seed=table.seed or 0,
            )
        file = self.start_file()
        assert file is not None
        if file.suffix.lower() == ".csv":
            return Particles.from_csv(file)
        from .output.trajectory import load  # h5py only where it is used

        with load(file) as trajectory:
            return trajectory.frame(-1 if table.frame is None else table.frame)


def read(path: str | Path) -> Job:
    """The job of a scene file.

    Raises:
        SceneError: the file cannot be read, is not TOML, or a key is unknown, missing or out of its range.
    """
    path = Path(path)
    try:
        # Editors on Windows begin a file with a byte order mark.
        text = path.read_text(encoding="utf-8-sig")
        document = tomllib.loads(text)
    except RecursionError:
        raise SceneError(f"cannot read the scene file {path}: its arrays or tables are nested too deeply") from None
    except (OSError, ValueError) as error:  # among the second: not UTF-8, not TOML, a number of too many digits
        raise SceneError(f"cannot read the scene file {path}: {error}") from error
    try:
        return _job(document, text, path)
    except SceneError as error:
        raise SceneError(f"{path}: {error}") from None


def _job(document: dict[str, Any], text: str, path: Path) -> Job:
    for key in document:
        if key not in _TABLES:
            raise SceneError(f"{key}: unknown key, expected {listed(_TABLES)}{closest(key, _TABLES)}")
    for key in ("particles", "method", "run"):
        if key not in document:
            raise SceneError(f"{key}: expected a [{key}] table, got none")
    source = tables.convert(document["particles"], ParticlesTable, "particles")
    _check_source(source)
    return Job(
        scene=tables.scene_of(document.get("surface"), document.get("gravity")),
        method=tables.method_of(document["method"]),
        run=_run(document["run"]),
        text=text,
        source=source,
        path=path,
    )


def _run(table: Any) -> RunOptions:
    """[run]; a run from a file saves checkpoints even where it does not say so."""
    return tables.convert({**_SAVED, **table} if isinstance(table, dict) else table, RunOptions, "run")


def _check_source(table: ParticlesTable) -> None:
    filled = ("count", "speed", "temperature", "mass", "seed")
    if table.source is None:
        if table.frame is not None:
            raise SceneError('particles.frame: needs from = "FILE.h5"')
        if table.count is None:
            raise SceneError("particles.count: expected a whole number, got nothing; add count = ... or from = ...")
        count("particles.count", table.count)
        return
    both = [name for name in filled if getattr(table, name) is not None]
    if both:
        raise SceneError(f"particles.{both[0]}: cannot be combined with from = {table.source!r}; remove one of them")
    suffix = Path(table.source).suffix.lower()
    if suffix not in (".csv", ".h5"):
        raise SceneError(f"particles.from: expected a .csv or .h5 file, got {table.source!r}")
    if table.frame is not None and suffix != ".h5":
        raise SceneError('particles.frame: needs from = "FILE.h5"')
