"""Trajectories: HDF5 in the H5MD 1.1 layout (https://www.nongnu.org/h5md/h5md.html), read on demand.

particles/all/{position,velocity,impacts}/{step,time,value}, value (frames, N, 3), for impacts (frames, N) since the
start; in a periodic scene also particles/all/image, (frames, N, 3), and particles/all/box/edges, (frames, 3); where
walls have openings particles/all/escape_time, (frames, N) [s], NaN inside, and where walls may absorb also
absorbed_time; for balls particles/all/radius (N,), particles/all/collisions (frames, N), and where they turn
particles/all/spin (frames, N, 3) [rad/s]; particles/all/{mass,id} (N,), and
for a run with sources particles/all/{birth_time,birth_source} (N,); positions and velocities are NaN until the birth;
observables/NAME/{step,time,value}; parameters/{scene,method,storage,scene_file} as TOML text; parameters/particles,
their number in the run, parameters/start, their digest at the start, parameters/seed, of thermal walls, and
parameters/observables, the names of user-defined observables, if there are any; parameters/{until,threads}, and
parameters/wall_time (frames,) [s], the wall time of the run so far, except for runs on clusters. For bodies:
parameters/body, the table of a body as TOML text, parameters/copies, their number n, and connectivity/bonds (B n, 2);
point p of copy i is particle p n + i. All elements share one step and one time dataset by hard links. writer.py
writes it.
"""

import functools
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

from ..common import notebook
from ..common.catalog import Observables, may_be_nan
from ..common.columns import frame_of
from ..common.signature import explain_methods
from ..errors import SceneError
from ..particles import Particles
from ..views import view
from . import layout, provenance
from .stored import Stored, finite, in_order, open_stored, parsed, whole

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.figure import Figure

    from ..bodies.body import Body
    from ..bodies.copies import Bodies
    from ..exports.exported import Progress
    from ..pages.html import Page
    from ..pictures.shown_film import Film


@explain_methods
class Trajectory(Stored):
    """A trajectory on disk, read on demand.

    Attributes:
        times: (frames,) the times of the frames [s].
        observables: name -> array, one entry a frame.
        scene, method: those of the run.
        scene_text: the text of the scene file, or None.
        body, copies: the body that was run in copies, and their number; None and 0 for particles.

    A file that a run is writing, or that a killed run left, can be read up to the frames that are complete when it is
    opened. Inconsistent content raises a SceneError that names the damaged part.

    >>> import swarm, tempfile
    >>> cavity = swarm.Scene(surfaces=[swarm.Sphere(radius=0.5)])
    >>> start = swarm.Particles([0.0, 0.0, 0.0], [1.0, 0.0, 0.0])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     run = swarm.simulate(cavity, start, swarm.Impact(), until=1.0, trajectory=folder + "/run.h5")
    ...     with swarm.load(folder + "/run.h5") as trajectory:
    ...         table, figure = trajectory.table(), trajectory.plot(figsize=(10.0, 6.0))
    ...         film = trajectory.animate(folder + "/run.gif", size=(320, 240))
    ...         dataset = trajectory.to_xarray().load()
    ...         written = trajectory.export(folder + "/run.xyz", frames=-1)
    ...     last = written[0].read_text().splitlines()[2]
    >>> table[["time", "impacts", "momentum_x"]]
       time  impacts  momentum_x
    0   0.0        0         1.0
    1   1.0        1        -1.0
    >>> film.name
    'run.gif'
    >>> dict(dataset.position.sizes), float(dataset.velocity.sel(axis="x", particle=0)[-1])
    ({'time': 2, 'particle': 1, 'axis': 3}, -1.0)
    >>> last
    'X 0.0 0.0 0.0 -1.0 0.0 0.0 -1.0 0.0 0.0 1.0 0 1'
    """

    def __init__(self, path: str | Path) -> None:
        super().__init__(path, "a trajectory (.h5)", "swarm.load")
        try:
            with self._reading("its structure") as file:
                foreign = layout.missing(file)
                self._frames = 0 if foreign else layout.frames(file, self.path)
                layout.require_shards(file, self._frames, self.path, open_stored)
                self._makers = provenance.creator_of(file)
            if foreign:
                raise SceneError(f"{self.path} is an HDF5 file, but not a trajectory of swarm: it has no {foreign}")
        except SceneError:
            self.close()
            raise

    def __len__(self) -> int:
        """Number of complete frames."""
        with self._reading("its frames"):
            return self._frames

    def __repr__(self) -> str:
        try:
            times = self.times
            span = f", {times[0]:g} s to {times[-1]:g} s" if len(times) else ""
            bodies = f"{self.copies} bodies of " if self.copies else ""
            text = f"{len(times)} frame{'s' * (len(times) != 1)}{span}, {bodies}{self.count} particles, {self.method!r}"
        except SceneError as error:
            text = str(error).removeprefix(f"{self.path} is ")
        return f"Trajectory({str(self.path)!r}, {text})"

    def _repr_html_(self) -> str:
        try:
            rows = view("facts").of_trajectory(self)
        except SceneError as error:
            rows = {"problem": str(error)}
        return notebook.table(f"Trajectory {self.path.name}", rows.items())

    # --- Frames ------------------------------------------------------------------------------------------

    @property
    def times(self) -> NDArray[np.float64]:
        """Times of the frames [s]."""
        with self._reading("its times"):
            return in_order(self._checked.rows("parameters/time", 0, self._frames))

    @property
    def observables(self) -> dict[str, NDArray[Any]]:
        """All observables, one entry a frame."""
        return Observables(time=self.times, **self.observables_of(slice(self._frames)))

    def observables_of(self, some: slice) -> dict[str, NDArray[Any]]:
        """The observables of a slice of frames, without their times."""
        seen, own = {}, self.own_observables
        with self._reading("its observables") as file:
            group = file.get("observables", {})
            for name in group:
                with self._reading(f"its observable {name}"):
                    read = self._checked.rows(f"observables/{name}/value", *some.indices(self._frames)[:2])
                    seen[name] = read if name in own or may_be_nan(name) else finite(read)
        return seen

    @property
    def own_observables(self) -> list[str]:
        """The names of the user-defined observables; their values may be NaN."""
        return self._text("observables").split(", ") if self._has("parameters/observables") else []

    def members(self, k: int = -1) -> dict[str, list[NDArray[Any]]]:
        """The sums of each member of each surface until frame k; {} for a run without member_impacts=True.

        "impacts", and where walls hold, heat or absorb particles "residence" [s], "heat" [J] and "absorbed": a list
        with an array for each surface, as in `Result.member_impacts`.
        """
        k = self._number_of(k)
        with self._reading("its members") as file:
            names = [name for name in file.get("observables", {}) if name.startswith("member_")]
            seen = {name: self._checked.row(f"observables/{name}/value", k) for name in names}
        return {
            name.removeprefix("member_"): self.scene.compiled().numbering.split(values) for name, values in seen.items()
        }

    def observed(self) -> dict[str, NDArray[Any]]:
        """The observables, after a check that those of every run are among them."""
        seen, scene = self.observables, self.scene
        with self._reading("its observables"):
            lengths = {"surface": len(scene.surfaces), "part": len(scene.parts), "counter": len(self.counters)}
            layout.require_observables(seen, self.own_observables, lengths)
        return seen

    def require_frames(self) -> None:
        """Raise a SceneError if the file has no frame."""
        if not len(self):
            raise SceneError(f"{self.path} holds no frame: its run ended before the first one was written")

    def require_index(self) -> None:
        """Raise a SceneError if an index of chunks is damaged: a writer would never return from it."""
        with self._reading("its index") as file:
            layout.require_index(file)

    def require_intact(self, frames: int | None = None) -> None:
        """Raise a SceneError that names a part that differs from its checksum, in all or the first `frames` frames."""
        with self._reading("its values"):
            self._checked.require_intact(self._frames if frames is None else frames)

    def frame(self, k: int) -> Particles:
        """The particles at frame k; negative k count from the end.

        Particles that are born later have NaN as positions and velocities: see `born`.
        """
        k = self._number(k)
        with self._reading(f"frame {k}") as file:
            everything = file["particles/all"]
            position, velocity = (self._of_frame(name, k).T for name in layout.PARTS)
            image, spin = (
                self._of_frame(name, k).T if name in everything else None for name in (layout.IMAGES, layout.SPINS)
            )
            there, mass = self._there(file, k), self._checked.constant("particles/all/mass")
            if there is not None:
                return Particles.of_frame(position, velocity, mass, image, there, self.radius, spin)
            found = Particles(position, velocity, mass, image, self.radius, spin)
            has_volume = "parameters/volume" in file
            found.volume = float(self._checked.constant("parameters/volume")) if has_volume else None
            return found

    def born(self, k: int) -> NDArray[np.bool_]:
        """Whether each particle of the file is born by frame k, (N,)."""
        k = self._number(k)
        with self._reading(f"frame {k}") as file:
            born = self._there(file, k)
            return np.ones(len(file["particles/all/mass"]), np.bool_) if born is None else born

    def columns(self, k: int) -> dict[str, NDArray[Any]]:
        """The columns of frame k in the file, a row a particle: "position", "velocity", "impacts", ..."""
        k = self._number(k)
        with self._reading(f"frame {k}") as file:
            everything = file["particles/all"]
            held = {name: self._of_frame(name, k) for name in layout.KEPT if name in everything}
            born = self._there(file, k)
            for name in layout.PARTS:
                finite(held[name] if born is None else held[name][born], "particle")
            return held

    def bodies(self, k: int) -> "Bodies":
        """The bodies at frame k that are born by then; negative k count from the end.

        Raises:
            SceneError: the file holds particles, or keeps too few digits: the links of bodies have exact lengths.
        """
        body = self.body
        if body is None:
            raise SceneError(f"{self.path} holds particles, not bodies; use frame({k})")
        points, shape = self.frame(k), (3, len(body), self.copies)
        with self._reading(f"frame {k}") as file:
            exact = file["particles/all/position/value"].dtype == np.float64
        if not exact:
            raise SceneError(
                f"{self.path} keeps bodies in float32, in which their links lose their lengths; use frame({k}) for the "
                'points, or run again with precision = "float64"'
            )
        with self._reading(f"frame {k}"):
            there = self.born(k).reshape(shape[1:])[0]
            position, velocity = (
                rows.reshape(shape)[..., there] for rows in (points.position, points.velocity)
            )  # fmt: skip
            bodies: Bodies = view("bodies").Bodies.of_run(body, position, velocity)
        return bodies

    def impacts(self, k: int) -> NDArray[np.int64]:
        """Number of impacts of each particle of frame k since the start, (N,)."""
        k, name = self._number(k), f"particles/all/{layout.COUNTS}"
        if not self._has(name):
            raise SceneError(f"{self.path} keeps no impacts of particles: an older version wrote it; run it again")
        return self._counts(k, layout.COUNTS)

    def collisions(self, k: int) -> NDArray[np.int64]:
        """Number of collisions of each ball of frame k with others since the start, (N,).

        Raises:
            SceneError: the particles have no radius.
        """
        k, name = self._number(k), f"particles/all/{layout.COLLISIONS}"
        if not self._has(name):
            raise SceneError(f"{self.path} keeps no collisions: its particles have no radius, and do not meet")
        return self._counts(k, layout.COLLISIONS)

    def _counts(self, k: int, kind: str) -> NDArray[np.int64]:
        with self._reading(f"the {kind} of frame {k}"):
            counts = self._of_frame(kind, k).astype(np.int64)
            if (counts < 0).any():
                raise ValueError(f"expected 0 or more, got {counts.min()} of particle {counts.argmin()}")
        return np.asarray(counts)

    def escape_times(self, k: int) -> NDArray[np.float64]:
        """Times at which the particles of frame k have passed an opening of a wall [s], (N,); NaN inside."""
        return self._ends(k, layout.ESCAPES)

    def absorbed_times(self, k: int) -> NDArray[np.float64]:
        """Times at which walls have absorbed the particles of frame k [s], (N,); NaN for the others."""
        return self._ends(k, layout.ABSORBED)

    def _ends(self, k: int, kind: str) -> NDArray[np.float64]:
        k, name = self._number(k), f"particles/all/{kind}"
        with self._reading(f"{kind} of frame {k}") as file:
            kept = len(file["particles/all/mass"])
            times = self._of_frame(kind, k).astype(np.float64) if name in file else np.full(kept, np.nan)
            if (times < 0.0).any():
                raise ValueError(f"expected 0 or later, got {np.nanmin(times)} of particle {np.nanargmin(times)}")
        return np.asarray(times)

    def _number(self, k: int) -> int:
        """The number, from 0 on, of a frame of a file with particles."""
        k = self._number_of(k)
        self._require_particles()
        return k

    def _number_of(self, k: int) -> int:
        """The number of a frame, from 0 on."""
        k, n = whole(f"{self.path}: frame", k), len(self)
        self.require_frames()
        if not -n <= k < n:
            raise SceneError(f"{self.path}: frame must lie between {-n} and {n - 1}, got {k}")
        return k % n

    def particle(self, i: int) -> tuple[NDArray[np.floating], NDArray[np.floating]]:
        """The path of particle i: its positions and velocities, (3, frames) each."""
        i, ids = whole(f"{self.path}: particle", i), self.ids
        column = int(np.searchsorted(ids, i))
        if column == len(ids) or ids[column] != i:
            raise SceneError(
                f"{self.path}: particle must be one of the {len(ids)} that the file keeps, from {ids[0]} to {ids[-1]}, "
                f"got {i}"
            )
        with self._reading(f"particle {i}") as file:
            position, velocity = (
                self._checked.path(f"particles/all/{name}/value", column, self._frames) for name in layout.PARTS
            )
            born = self._births(file)[column] if self._comes(file) else -math.inf
            there = self.times >= born
            if self._is_of_balls(file):
                there = np.isfinite(position[:, 0])
            for values in (position, velocity):
                finite(values[there])
        return position.T, velocity.T

    def _there(self, file: Any, k: int) -> NDArray[np.bool_] | None:
        """A mask of the particles that are born by frame k; None for a run without sources."""
        if not self._comes(file):
            return None
        if self._is_of_balls(file):
            return np.asarray(~np.isnan(self._of_frame(layout.BORN, k)))
        return np.asarray(self._births(file) <= float(self._checked.row("parameters/time", k)))

    def _of_frame(self, name: str, k: int) -> NDArray[Any]:
        """The values of the particles at frame k in the column `name`, after their checks."""
        return np.asarray(self._checked.row(f"particles/all/{name}/value", k))

    # --- What is the same in all frames ------------------------------------------------------------------

    @staticmethod
    def _comes(file: Any) -> bool:
        return f"particles/all/{layout.BIRTHS[1]}" in file

    @staticmethod
    def _is_of_balls(file: Any) -> bool:
        """Whether the file tells for each frame which balls are born by then."""
        return f"particles/all/{layout.BORN}" in file

    def _births(self, file: Any) -> NDArray[np.float64]:
        if self._is_of_balls(file):
            return self._of_frame(layout.BORN, len(self) - 1).astype(np.float64)
        return np.asarray(self._checked.constant(f"particles/all/{layout.BIRTHS[0]}"))

    def has_births(self) -> bool:
        """Whether the run has particles that come during it."""
        with self._reading("the births of its particles") as file:
            return self._comes(file)

    @property
    def radius(self) -> NDArray[np.float64] | None:
        """The radii of the particles in the file [m], (N,); None for points."""
        if not self._has(f"particles/all/{layout.RADII}"):
            return None
        with self._reading("the radii of its particles"):
            return finite(self._checked.constant(f"particles/all/{layout.RADII}"), "particle")

    @property
    def birth_time(self) -> NDArray[np.float64]:
        """The time at which each particle of the file comes [s], (N,); 0 for particles of the start.

        NaN for balls that were not born by the last frame.
        """
        with self._reading("the births of its particles") as file:
            if not self._comes(file):
                return np.zeros(len(file["particles/all/mass"]))
            born = self._births(file)
            return born if self._is_of_balls(file) else finite(born, "particle")

    @property
    def birth_source(self) -> NDArray[np.int64]:
        """The number of the source of each particle of the file, (N,); -1 for particles of the start."""
        with self._reading("the sources of its particles") as file:
            if not self._comes(file):
                return np.full(len(file["particles/all/mass"]), -1)
            return np.asarray(self._checked.constant(f"particles/all/{layout.BIRTHS[1]}").astype(np.int64))

    @property
    def ids(self) -> NDArray[np.int64]:
        """The numbers of the particles in the file, (N,)."""
        self._require_particles()
        with self._reading("the numbers of its particles"):
            ids = self._checked.constant("particles/all/id").astype(np.int64)
            if (np.diff(ids) <= 0).any() or ids[0] < 0 or ids[-1] >= self.count:
                raise ValueError(f"expected some of 0 to {self.count - 1}, each once and in order")
        return np.asarray(ids)

    @property
    def bonds(self) -> NDArray[np.int64]:
        """The pairs of points of bodies that are tied, (B, 2), as numbers of particles."""
        with self._reading("its bonds") as file:
            if "connectivity/bonds" not in file:
                return np.zeros((0, 2), np.int64)
            layout.dataset(file, "connectivity/bonds", "iu", (None, 2))
            bonds = self._checked.constant("connectivity/bonds").astype(np.int64)
            if len(bonds) and not (bonds.min() >= 0 and bonds.max() < self.count):
                raise ValueError(f"expected numbers from 0 to {self.count - 1}, got {bonds.min()} to {bonds.max()}")
        return np.asarray(bonds)

    def has_particles(self) -> bool:
        """Whether the file keeps particles."""
        return self._has("particles/all")

    def _require_particles(self) -> None:
        if not self.has_particles():
            raise SceneError(f'{self.path} keeps no particles: it was run with frames = "none"')

    @functools.cached_property
    def body(self) -> "Body | None":
        """The body that was run in copies; None for particles."""
        if not self._has("parameters/body"):
            return None
        with self._reading("its body"):
            body: Body = view("bodies").body_of(parsed(self._text("body")))
            if len(body) * self.copies != self.count:
                raise ValueError(f"{self.copies} of {len(body)} points are not {self.count}")
        return body

    @property
    def copies(self) -> int:
        """Number of bodies that were run; 0 for particles."""
        with self._reading("its number of bodies") as file:
            return int(self._checked.constant("parameters/copies")) if "parameters/body" in file else 0

    @property
    def descriptions(self) -> dict[str, str]:
        """The texts that identify a run: scene, method and storage."""
        return {name: self._text(name) for name in ("scene", "method", "storage")}

    @property
    def scene_text(self) -> str | None:
        """The scene file that was run."""
        return self._text("scene_file") if self._has("parameters/scene_file") else None

    @property
    def until(self) -> float | None:
        """The end time of the run [s]; None in files of older versions, and for runs on clusters."""
        found: float | None = self._constant("until", lambda end: float(finite(end)), None)
        return found

    @property
    def threads(self) -> int | None:
        """The threads of the last session of the run; None as for `until`."""
        found: int | None = self._constant("threads", int, None)
        return found

    @property
    def wall_times(self) -> NDArray[np.float64] | None:
        """The wall time of the run in all its sessions at the writing of each frame [s]; None as for `until`."""
        with self._reading("its wall times") as file:
            if "parameters/wall_time" not in file:
                return None
            return finite(self._checked.rows("parameters/wall_time", 0, len(file["parameters/time"])))

    @property
    def makers(self) -> dict[str, str]:
        """The software that made the file, and the date: name, version, python, numpy, numba, hdf5, machine, date."""
        with self._reading("what made it"):
            self._checked.require_attributes("h5md/creator")
            return dict(self._makers)

    # --- Views -------------------------------------------------------------------------------------------

    def table(self) -> "pandas.DataFrame":
        """The observables as a pandas frame: `time` first, a row for each frame.

        Vectors have a column for each component, momentum_x, and arrays over surfaces one for each surface, impulse_0
        and wall_position_0_x.

        Raises:
            SceneError: the trajectory is damaged, or pandas is not installed.
        """
        return frame_of(self.observables)

    def plot(self, *, particles: int = 5000, figsize: tuple[float, float] | None = None) -> "Figure":
        """Draw energies, errors, penetration, impacts, pressure, speeds and the particles or bodies at the end.

        Args:
            particles: the largest number of particles, or points of bodies, that are drawn, evenly chosen.
            figsize: width and height [inches], at 100 pixels an inch; None: as large as the plots need.

        Returns:
            A figure of matplotlib, which a notebook shows where it is the last line of a cell, and which can be
            changed and saved: `figure.axes`, `figure.savefig("run.pdf")`. It is not registered with pyplot:
            nothing keeps it alive, and no backend is chosen.

        Raises:
            SceneError: an argument is out of its range, the trajectory is damaged or holds no frame, or matplotlib or
                scikit-image is not installed.
        """
        return cast("Figure", view("plot").figure_of(view("content").content_of(self), figsize, particles))

    def animate(
        self,
        path: str | Path,
        *,
        frames: int = 200,
        fps: float = 25.0,
        size: tuple[int, int] = (960, 720),
        particles: int = 10_000,
        overwrite: bool = False,
    ) -> Path:
        """Write a film of the particles or bodies among their walls, coloured by speed.

        200 frames of 10 000 particles take 15 s of one core. Walls are drawn as they bound the volume at the start;
        moving walls move. The returned path shows nothing in a notebook: `film` does.

        Args:
            path: `.mp4`, by ffmpeg, or `.gif`, about ten times as large.
            frames: the largest number of frames, evenly chosen, with the first and the last.
            fps: frames a second, above 0; at most 50 for a GIF.
            size: width and height in pixels, 64 to 8192 each; an odd one is made even.
            particles: the largest number of particles, or points of bodies, that are drawn, evenly chosen.
            overwrite: replace an existing file.

        Returns:
            The path. The file has this name when it is complete.

        Raises:
            SceneError: an argument is out of its range, the file exists, the trajectory is damaged or keeps no
                particles, or matplotlib, scikit-image or ffmpeg is not installed.
            FileError: the file cannot be written.
        """
        return cast(Path, view("animation").animate(self, path, frames, fps, size, particles, overwrite))

    def film(
        self, *, frames: int = 100, fps: float = 25.0, size: tuple[int, int] = (640, 480), particles: int = 5000
    ) -> "Film":
        """A film of the particles or bodies among their walls, which a notebook shows.

        It is drawn as by `animate`, smaller and of fewer frames, since all of it is kept in the notebook: about 0.5 MB.
        It needs no kernel and no network to play when the notebook is opened again; if the notebook is not trusted it
        waits for its play button. `film.save("run.mp4")` writes it.

        Args:
            frames: the largest number of frames, evenly chosen, with the first and the last.
            fps: frames a second, above 0; at most 50 where ffmpeg is missing.
            size: width and height in pixels, 64 to 8192 each; an odd one is made even.
            particles: the largest number of particles, or points of bodies, that are drawn, evenly chosen.

        Returns:
            A `Film`: a video, or a GIF where ffmpeg is not installed. A film of more than 22 MB is not shown, and says
            so, since it would make the notebook hang.

        Raises:
            SceneError: an argument is out of its range, the trajectory is damaged or keeps no particles, or matplotlib
                or scikit-image is not installed.
        """
        return cast("Film", view("film").film_of(self, frames, fps, size, particles))

    def report(self, path: str | Path | None = None, *, overwrite: bool = False) -> "Page":
        """A page of the run: its scene, whether it went well, graphs, numbers, its speed, and how to reproduce it.

        One file in HTML, about 0.5 MB, for any browser: it needs no other file and no network, is light or dark as the
        reader's system, and prints well.

        Args:
            path: `.html`, where the page is written; None: the page is only returned.
            overwrite: replace an existing file.

        Returns:
            A `Page`, which a notebook shows, and which has `html`, the text, and `save(path)`.

        Raises:
            SceneError: the file exists or has another suffix, the trajectory is damaged or holds no frame, or jinja2,
                matplotlib or scikit-image is not installed.
            FileError: the file cannot be written.
        """
        return cast("Page", view("report").report(self, path, overwrite))

    def to_xarray(self) -> "xarray.Dataset":
        """The trajectory as a Dataset of xarray, with the dimensions time, particle, axis and surface.

        The columns of particles, `position`, `velocity`, `image`, `impacts_per_particle`, `escape_time` and
        `absorbed_time`, are read from the file when their values are used, and only the used part: a file larger than
        the memory is no problem, `dataset.position.sel(time=slice(2.0, 3.0)).mean("particle")` reads these frames.
        Data that are read are not kept; `dataset.load()` keeps all. Meanwhile the trajectory must stay open.
        Observables and masses are read at once. Units are in `attrs`, and so are the tables of the scene and
        the method.

        Raises:
            SceneError: the trajectory is damaged, or xarray is not installed.
        """
        return cast("xarray.Dataset", view("xarray").dataset_of(self))

    def show(self, *, particles: int = 5000, color: str = "speed", megabytes: float = 100.0) -> None:
        """Show the trajectory in a Rerun viewer: in a notebook below the cell, else in a window on this machine.

        The viewer of a notebook needs WebGL in the browser. The browser gets it (67 MB) from Rerun's server, or, where
        the kernel does not reach that, from the machine of the kernel, which must then be that of the browser. The
        environment variable RERUN_NOTEBOOK_ASSET, "serve-local" or a URL, changes this; "inline" does not work with
        Rerun 0.41. It lives as long as the kernel: a notebook that is opened again shows only a `film`.

        Args:
            particles: the largest number of particles, or points of bodies, that are shown, evenly chosen.
            color: the quantity of their colour, "speed" or "energy-error".
            megabytes: the largest size of the viewer's data, above 0; if all frames exceed it, every k-th is shown.

        Raises:
            SceneError: an argument is out of its range, the trajectory is damaged or keeps no particles, rerun-sdk
                (in a notebook rerun-sdk[notebook]) is not installed, or there is no screen.
        """
        view("notebook" if notebook.is_running() else "viewer").show(self, particles, color, megabytes)

    def export(
        self,
        path: str | Path,
        frames: slice | int | None = None,
        particles: int = 1,
        surfaces: bool = True,
        overwrite: bool = False,
        progress: "Progress | None" = None,
    ) -> list[Path]:
        """Write the trajectory to files of another format; units stay, and .xyz and .csv keep all digits.

        Args:
            path: its suffix is the format: `.vtkhdf` for ParaView, `.xyz` (extended XYZ) for OVITO and ASE, `.gsd`
                for HOOMD-blue and freud, with float32 numbers, `.ply` for Blender, MeshLab, Open3D and games, float32
                too, a file a frame: NAME_0000.ply and so on, `.csv` for spreadsheets and pandas, and `.obj`
                for the walls at a frame, an object a surface, in Blender, games and CAD.
            frames: a slice of the frames, such as slice(0, None, 10), or the number of one; None: all, for `.obj` the
                first.
            particles: k for every k-th particle, or body, beginning with the first.
            surfaces: for `.vtkhdf`, write also the walls, as triangles, to `NAME.surfaces.vtkhdf`. Fields of
                more than 2000 solids are points of `NAME.solids.vtkhdf`, a few numbers for each.
            overwrite: replace existing files; for `.ply` also all files of a longer sequence.
            progress: a function, called with the number of written frames and the number of all frames to write.

        Returns:
            The files. They get their names when they are complete; one frame at a time is in memory.

        Raises:
            SceneError: another suffix, an argument that is out of its range or not of the format, a library that
                is missing, or a file that exists.
            FileError: the file cannot be written.
        """
        return cast(list[Path], view("export").export(self, path, frames, particles, surfaces, overwrite, progress))


def load(path: str | Path) -> Trajectory:
    """Open a trajectory for reading; see `Trajectory`.

    Args:
        path: the file, HDF5, also while a run writes it.

    Returns:
        The `Trajectory`, which a `with` statement closes.

    Raises:
        SceneError: the file does not exist, or it is not a trajectory.

    >>> import swarm, tempfile
    >>> cavity = swarm.Scene(surfaces=[swarm.Sphere(radius=0.5)])
    >>> start = swarm.fill(cavity, 10, speed=1.0)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = folder + "/run.h5"
    ...     _ = swarm.simulate(cavity, start, swarm.Impact(), until=1.0, trajectory=file)
    ...     with swarm.load(file) as trajectory:
    ...         trajectory.times
    array([0., 1.])
    """
    return Trajectory(path)
