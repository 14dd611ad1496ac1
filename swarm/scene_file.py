"""Scene files: from TOML to a `Job`. A scene file is data: nothing in it is executed."""

import dataclasses
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .common.checks import known_keys, particles_fit
from .common.columns import read_columns, row_of
from .common.validated import Count, Flag, Magnitude, NotNegativeCount, Part, Positive, Validated
from .errors import SceneError
from .files import paths
from .files.sources import commands_for
from .methods import Impact, Method
from .particles import Particles
from .placing.filling import fill
from .run.options import RunOptions
from .scene import Scene
from .serialization import plugins, run_tables, tables
from .serialization.plugins import allowed
from .surfaces import ALL_FIELDS
from .surfaces.data.files import samples_of

if TYPE_CHECKING:
    from .bodies.copies import Bodies
    from .bodies.table import Made

_SCENE = ("gravity", "period", "plane", "pairs")
_TABLES = (*_SCENE, "particles", "body", "source", "counter", "surface", "method", "run")
SWEEP = "sweep"
_SAVED = {"checkpoint": 60.0}
# The keys of [run] that name a file to write -> the options of `swarm run` for the same file.
OUTPUTS = {"trajectory": "-o", "recording": "--record", "impacts": "--impacts"}


@dataclass(frozen=True)
class ParticlesTable(Validated):
    """[particles]: their number, speed and mass, or their file; `fill` and `pack` check the rest."""

    count: Count | None = None
    speed: Magnitude | None = None
    temperature: Magnitude | None = None
    mass: Positive | None = None
    seed: NotNegativeCount | None = None
    exact: Flag | None = None
    radius: float | list[float] | None = None
    fraction: Part | None = None
    within: Any = None
    source: str | None = dataclasses.field(default=None, metadata={"key": "from"})
    frame: int | None = None

    def filled(self, scene: Scene) -> Particles:
        """Return the particles of a table without a file."""
        if self.fraction is not None:
            return self._packed(scene)
        assert self.count is not None
        particles_fit("count", self.count)
        return fill(
            scene,
            self.count,
            speed=self.speed,
            temperature=self.temperature,
            mass=1.0 if self.mass is None else self.mass,
            seed=self.seed or 0,
            exact=bool(self.exact),
            radius=self.radius,
            within=self.within,
        )

    def _packed(self, scene: Scene) -> Particles:
        from .events.packing import pack  # which imports the engine

        if self.within is not None:
            raise SceneError("within must be left out with a fraction, which is of all the volume; use count")
        if self.exact:
            raise SceneError("exact must be left out with a fraction, got true: use temperature alone")
        return pack(
            scene, self.count, self.radius, self.fraction, self.seed or 0, speed=self.speed,
            temperature=self.temperature, mass=1.0 if self.mass is None else self.mass,
        )  # fmt: skip


@dataclass(frozen=True)
class BodiesFile:
    """[body]: the file of the bodies."""

    source: str = dataclasses.field(metadata={"key": "from"})
    frame: int | None = None


@dataclass(frozen=True)
class Job:
    """The checked run of a scene file; `text` is the text of the file, `named` the files that it names."""

    scene: Scene
    method: Method
    run: RunOptions
    text: str
    source: "ParticlesTable | BodiesFile | Made | None"
    path: Path
    named: tuple[Path, ...] = ()

    def inputs(self) -> dict[str, Path | None]:
        """Return the files that are read, by their roles; no output may be one of them."""
        files: dict[str, Path | None] = {"scene file": self.path, "file of the start": self.start_file()}
        files |= {f"file that the scene reads, {one.name}": one for one in self.named}
        return files | {f"module {name} of --plugins": file for name, file in plugins.files().items()}

    def require_within(self, names: Iterable[str]) -> None:
        """Raise a `SceneError` if one of these outputs of [run] is not in the folder of the file, links followed.

        A scene file may come from someone else, so that the outputs named only in it are written only beside it.
        """
        folder = self.path.parent.resolve()
        for name in names:
            file = getattr(self.run, name)
            if file is not None and not file.resolve().is_relative_to(folder):
                raise SceneError(
                    f"{self.path}: run.{name}: expected a file in the folder of the scene file, {folder}, got "
                    f"{file.resolve()}; to write there, name it on the command line: {OUTPUTS[name]} {file}"
                )

    def start_file(self) -> Path | None:
        """Return the file of the particles or bodies at the start, or None."""
        name = getattr(self.source, "source", None)
        return None if name is None else self.path.parent / name

    def located(self, error: SceneError) -> SceneError:
        """Return the error; if it is about a particle of a .csv file, with the row of the particle."""
        file = self.start_file()
        if error.particle is None or file is None or file.suffix.lower() != ".csv":
            return error
        return SceneError(f"{file}, row {row_of(file, error.particle)}: {error}")

    def start(self) -> "Particles | Bodies | None":
        """Return the particles or bodies at the start, made or read; None if all come from sources.

        Raises:
            SceneError: a value of [particles] or [body] is out of its range, or its file cannot be used.
        """
        source, file = self.source, self.start_file()
        if source is None:
            return None
        try:
            if isinstance(source, ParticlesTable) and file is None:
                return source.filled(self.scene)
            if isinstance(source, ParticlesTable | BodiesFile):
                assert file is not None
                return _read(file, source)
            return source.start(self.scene)
        except SceneError as error:
            table = "particles" if isinstance(source, ParticlesTable) else "body"
            raise SceneError(f"{self.path}, [{table}]: {error}") from None


def _read(file: Path, table: ParticlesTable | BodiesFile) -> "Particles | Bodies":
    """Read the particles or bodies of a file."""
    if file.suffix.lower() == ".csv":
        return Particles.from_csv(file)
    from .files.trajectory import load  # h5py only where it is used

    frame = -1 if table.frame is None else table.frame
    with load(file) as trajectory:
        if isinstance(table, BodiesFile):
            return trajectory.bodies(frame)
        if trajectory.body is not None:
            raise SceneError(f"from: {file} holds bodies, which are not particles; write [body] in place of it")
        if not trajectory.has_births():
            return trajectory.frame(frame)
        born = trajectory.frame(frame).born()
        if not len(born):
            raise SceneError(
                f"from: no particle is in the scene at frame {frame} of {file}; choose a later one by frame ="
            )
        return born


def read(path: str | Path, plugins: Iterable[str] = ()) -> Job:
    """Return the job of a scene file.

    Args:
        path: the file.
        plugins: modules with laws, surfaces, methods and observables, which the file may name as "module:Name".

    Raises:
        SceneError: the file cannot be read, is not TOML, a key is unknown, missing or out of its range, or the file
            names code of another module.
    """
    with allowed(plugins):
        return _read_job(Path(path))


def _read_job(path: Path) -> Job:
    text = text_of(path)
    document = document_of(text, path)
    if SWEEP in document:
        raise SceneError(
            f"{path}: a file with a [{SWEEP}] table describes many runs, which swarm sweep {path} carries out, or "
            "swarm.sweep in Python"
        )
    try:
        return job_of(document, text, path)
    except SceneError as error:
        raise SceneError(f"{path}: {error}") from None


def text_of(path: Path) -> str:
    """Return the text of a scene file; raise a `SceneError` if it cannot be read."""
    try:
        # Editors on Windows may begin a file with a byte order mark.
        return path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise SceneError(f"there is no file {path}; expected a scene file (.toml)") from None
    except UnicodeDecodeError as error:
        raise SceneError(
            f"cannot read the scene file {path}: it is no text in UTF-8{commands_for(path, '.toml')}"
        ) from error
    except (OSError, ValueError) as error:
        raise SceneError(f"cannot read the scene file {path}: {error}") from error


def document_of(text: str, path: Path) -> dict[str, Any]:
    """Return the tables of a scene file; raise a `SceneError` if its text is not TOML."""
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise SceneError(f"cannot read the scene file {path}: its arrays or tables are nested too deeply") from None
    except ValueError as error:  # also for a number with too many digits
        raise SceneError(f"cannot read the scene file {path}: {error}") from error


def job_of(document: dict[str, Any], text: str, path: Path, scene: Scene | None = None) -> Job:
    """Return the job of the tables of a scene file.

    Args:
        document: the tables.
        text: the text of the file.
        path: the path of the file; the files that it names are relative to its folder.
        scene: the scene of the tables if it has been made before; None to make it.

    Raises:
        SceneError: a key is unknown, missing or out of its range; the sentence begins with the key.
    """
    known_keys("", document, _TABLES)
    if "run" not in document:
        raise SceneError("run: expected a [run] table, got none; add [run] and until = ... below it")
    if "particles" in document and "body" in document:
        raise SceneError("particles: expected a [particles] or a [body] table, got both")
    if not {"particles", "body", "source"} & set(document):
        raise SceneError("particles: expected a [particles] or a [body] table, or a [[source]], got neither")
    scene = scene or tables.scene_of(_with_bodies(document.get("surface"), path), *map(document.get, _SCENE))
    sources = run_tables.sources_of(document["source"], scene) if "source" in document else ()
    counters = run_tables.counters_of(document["counter"]) if "counter" in document else ()
    return Job(
        scene=scene,
        method=tables.method_of(document["method"]) if "method" in document else Impact(),
        run=dataclasses.replace(_run(document["run"], path), sources=sources, counters=counters),
        text=text,
        source=_start_of(document),
        path=path,
        named=tuple(_named_files(document, path)),
    )


def _start_of(document: dict[str, Any]) -> "ParticlesTable | BodiesFile | Made | None":
    if "body" in document:
        return _body(document["body"])
    return _particles(document["particles"]) if "particles" in document else None


def _with_bodies(surfaces: Any, path: Path) -> Any:
    """Return the tables of the surfaces, with the arrays of fields that read their solids from a file."""
    if not isinstance(surfaces, list):
        return surfaces
    return [_bodies_of(table, f"surface[{i}]", path) for i, table in enumerate(surfaces)]


def _bodies_of(table: Any, where: str, path: Path) -> Any:
    table = samples_of(table, where, path)
    for key in tables.NESTED if isinstance(table, dict) else ():
        if isinstance(table.get(key), list):
            nested = [_bodies_of(one, f"{where}.{key}[{k}]", path) for k, one in enumerate(table[key])]
            table = {**table, key: nested}
    if not isinstance(table, dict) or "from" not in table or table.get("kind") not in ALL_FIELDS:
        return table
    kind, name = ALL_FIELDS[table["kind"]], table["from"]
    if not isinstance(name, str) or Path(name).suffix.lower() != ".csv":
        raise SceneError(f"{where}.from: expected a .csv file, got {name!r}")
    columns = kind.columns()
    both = [argument for argument in columns if argument in table]
    if both:
        raise SceneError(f"{where}.{both[0]}: cannot be combined with from = {name!r}; remove one of them")
    needed = [column for argument in kind.needed() for column in columns[argument]]
    optional = [column for argument, names in columns.items() if argument not in kind.needed() for column in names]
    try:
        read = read_columns(path.parent / name, needed, optional, "body")
    except SceneError as error:
        raise SceneError(f"{where}.from: {error}") from None
    given = {
        argument: np.column_stack([read[column] for column in names]) if len(names) > 1 else read[names[0]]
        for argument, names in columns.items()
        if set(names) <= set(read)
    }
    return {**{key: value for key, value in table.items() if key != "from"}, **given}


def _named_files(document: dict[str, Any], path: Path) -> Iterator[Path]:
    """Yield the existing files that texts of the document name, except outputs, and the shards of trajectories."""
    run = document.get("run")
    read = {key: value for key, value in run.items() if key not in OUTPUTS} if isinstance(run, dict) else {}
    for _key, text in tables.texts_in({**document, "run": read}):
        if paths.is_file(file := path.parent / text):
            yield file
            yield from paths.shards_of(file).glob("*.h5")


def _run(table: Any, path: Path) -> RunOptions:
    """Return the options of [run], with checkpoints by default, and files relative to the folder of the scene file."""
    if not isinstance(table, dict):
        return tables.convert(table, RunOptions, "run")
    table, own = {**_SAVED, **table}, table.get("observables")
    table |= {key: str(path.parent / table[key]) for key in OUTPUTS if isinstance(table.get(key), str) and table[key]}
    table.pop("observables", None)
    options = tables.convert(table, RunOptions, "run")
    if own is None:
        return options
    if not isinstance(own, dict):
        raise SceneError(f'run.observables: expected a table such as {{ name = "module:function" }}, got {own!r:.200}')
    found = {name: plugins.named(f"run.observables.{name}", text, "a function") for name, text in own.items()}
    try:
        return dataclasses.replace(options, observables=found)
    except SceneError as error:
        raise SceneError(f"run.{error}") from None


def _body(table: Any) -> "BodiesFile | Made":
    if not isinstance(table, dict) or "from" not in table:
        from .bodies.table import KINDS

        return tables.of_kind(table, "body", KINDS)
    found = tables.convert(table, BodiesFile, "body")
    if Path(found.source).suffix.lower() != ".h5":
        raise SceneError(f"body.from: expected a .h5 file, a trajectory of bodies, got {found.source!r}")
    return found


def _particles(given: Any) -> ParticlesTable:
    if isinstance(given, Mapping) and "within" in given:
        given = {**given, "within": tables.surface_of(given["within"], "particles.within")}
    table = tables.convert(given, ParticlesTable, "particles")
    suffix = "" if table.source is None else Path(table.source).suffix.lower()
    filled = ("count", "speed", "temperature", "mass", "seed", "exact", "radius", "fraction", "within")
    both = [name for name in filled if getattr(table, name) is not None]
    if table.source is not None and both:
        raise SceneError(f"particles.{both[0]}: cannot be combined with from = {table.source!r}; remove one of them")
    if table.source is not None and suffix not in (".csv", ".h5"):
        raise SceneError(f"particles.from: expected a .csv or .h5 file, got {table.source!r}")
    if table.frame is not None and suffix != ".h5":
        raise SceneError('particles.frame: needs from = "FILE.h5"')
    if table.source is None and table.count is None and table.fraction is None:
        raise SceneError("particles.count: expected a whole number, got nothing; add count = ... or from = ...")
    return table
