"""Trajectories: HDF5 in the H5MD 1.1 layout (https://www.nongnu.org/h5md/h5md.html), read on demand.

particles/all/{position,velocity,impacts}/{step,time,value}, value (frames, N, 3), of impacts (frames, N), since the
start; where the scene repeats also particles/all/image, (frames, N, 3), and particles/all/box/edges, (frames, 3); where
walls have openings particles/all/escape_time, (frames, N) [s], NaN of those inside, and where they may absorb also
absorbed_time; of balls particles/all/radius (N,), particles/all/collisions (frames, N), and where they turn
particles/all/spin (frames, N, 3) [rad/s]; particles/all/{mass,id} (N,), and
of a run with sources particles/all/{birth_time,birth_source} (N,), where who comes later is at NaN;
observables/NAME/{step,time,value}; parameters/{scene,method,storage,scene_file} as TOML text, parameters/particles, the
number that were run, parameters/start, a digest of them at the start, parameters/seed, of thermal walls, and
parameters/observables, the names of those of one's own, if there are any; parameters/{until,threads}, and
parameters/wall_time (frames,) [s], the seconds that the run had taken, but of runs on clusters. Of bodies:
parameters/body, the table of one as TOML text, parameters/copies, their number n, and connectivity/bonds (B n, 2);
point p of copy i is particle p n + i. All elements share one step and one time dataset by hard links. writer.py
writes it.
"""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..catalog import may_be_nan
from ..errors import SceneError
from ..particles import Particles
from . import layout, provenance
from .kept import Kept
from .stored import finite, in_order, open_stored, whole

if TYPE_CHECKING:
    from ..bodies.state import Bodies


class Trajectory(Kept):
    """A trajectory on disk, read on demand.

    Attributes:
        times: (frames,) [s].
        observables: name -> array, one entry a frame.
        scene, method: as they were run.
        scene_text: the scene file's text, or None.
        body, copies: the body whose copies were run, and their number; None and 0 for particles.

    A file that is being written, or that a killed run left, can be read: the frames that are complete when it is
    opened. Inconsistent content raises a SceneError that names the damaged part.
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

    @property
    def times(self) -> NDArray[np.float64]:
        """Times of the frames [s]."""
        with self._reading("its times"):
            return in_order(self._checked.rows("parameters/time", 0, self._frames))

    @property
    def observables(self) -> dict[str, NDArray[Any]]:
        """All observables, one entry a frame."""
        return {"time": self.times, **self.observables_of(slice(self._frames))}

    def observables_of(self, some: slice) -> dict[str, NDArray[Any]]:
        """All observables of some frames but their times."""
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
        """The names of the observables of one's own; these may be NaN."""
        return self._text("observables").split(", ") if self._has("parameters/observables") else []

    def members(self, k: int = -1) -> dict[str, list[NDArray[Any]]]:
        """Of a run with member_impacts=True what each member of each surface has had until frame k; else nothing.

        "impacts", and "residence" [s], "heat" [J] and "absorbed" where walls hold, heat or absorb particles: a list
        with an array for each surface, as `Result.member_impacts`.
        """
        k = self._number_of(k)
        with self._reading("its members") as file:
            names = [name for name in file.get("observables", {}) if name.startswith("member_")]
            seen = {name: self._checked.row(f"observables/{name}/value", k) for name in names}
        return {name.removeprefix("member_"): self.scene.split_by_members(values) for name, values in seen.items()}

    def observed(self) -> dict[str, NDArray[Any]]:
        """The observables, checked to include those of every run."""
        seen, scene = self.observables, self.scene
        with self._reading("its observables"):
            lengths = {"surface": len(scene.surfaces), "part": len(scene.parts), "counter": len(self.counters)}
            layout.require_observables(seen, self.own_observables, lengths)
        return seen

    def require_frames(self) -> None:
        """Raise a SceneError if there is no frame."""
        if not len(self):
            raise SceneError(f"{self.path} holds no frame: its run ended before the first one was written")

    def require_index(self) -> None:
        """Raise a SceneError if an index of chunks is damaged: a writer would never return from it."""
        with self._reading("its index") as file:
            layout.require_index(file)

    def require_intact(self, frames: int | None = None) -> None:
        """Raise a SceneError that names what does not match its checksum, of all, or of so many frames."""
        with self._reading("its values"):
            self._checked.require_intact(self._frames if frames is None else frames)

    def frame(self, k: int) -> Particles:
        """The particles at frame k; negative k count from the end. Who comes later is at NaN: see `born`."""
        k = self._number(k)
        with self._reading(f"frame {k}") as file:
            everything = file["particles/all"]
            position, velocity = (self._of_frame(name, k).T for name in layout.PARTS)
            image, spin = (
                self._of_frame(name, k).T if name in everything else None for name in (layout.IMAGES, layout.SPINS)
            )
            there, mass = self._there(file, k), self._checked.constant("particles/all/mass")
            if there is not None:
                return Particles.of_frame(position, velocity, mass, image, there)
            found = Particles(position, velocity, mass, image, self.radius, spin)
            has_volume = "parameters/volume" in file
            found.volume = float(self._checked.constant("parameters/volume")) if has_volume else None
            return found

    def columns(self, k: int) -> dict[str, NDArray[Any]]:
        """The columns of frame k as they are on file, a row a particle: "position", "velocity", "impacts", ..."""
        k = self._number(k)
        with self._reading(f"frame {k}") as file:
            everything = file["particles/all"]
            held = {name: self._of_frame(name, k) for name in layout.KEPT if name in everything}
            there = self._there(file, k)
            for name in layout.PARTS:
                finite(held[name] if there is None else held[name][there], "particle")
            return held

    def bodies(self, k: int) -> "Bodies":
        """The bodies at frame k; negative k count from the end.

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
        from ..bodies.state import Bodies

        with self._reading(f"frame {k}"):
            return Bodies.of_run(body, points.position.reshape(shape), points.velocity.reshape(shape))

    def impacts(self, k: int) -> NDArray[np.int64]:
        """Number of impacts of each of the particles of frame k since the start, (N,)."""
        k, name = self._number(k), f"particles/all/{layout.COUNTS}"
        if not self._has(name):
            raise SceneError(f"{self.path} keeps no impacts of particles: an older version wrote it; run it again")
        with self._reading(f"the impacts of frame {k}"):
            counts = self._of_frame(layout.COUNTS, k).astype(np.int64)
            if (counts < 0).any():
                raise ValueError(f"expected 0 or more, got {counts.min()} of particle {counts.argmin()}")
        return np.asarray(counts)

    def collisions(self, k: int) -> NDArray[np.int64]:
        """How often each of the balls of frame k has met another one since the start, (N,).

        Raises:
            SceneError: the particles have no radius.
        """
        k, name = self._number(k), f"particles/all/{layout.COLLISIONS}"
        if not self._has(name):
            raise SceneError(f"{self.path} keeps no collisions: its particles have no radius, and do not meet")
        with self._reading(f"the collisions of frame {k}"):
            return np.asarray(self._of_frame(layout.COLLISIONS, k).astype(np.int64))

    def escape_times(self, k: int) -> NDArray[np.float64]:
        """Times at which the particles of frame k have passed an opening of a wall [s], (N,); NaN of those inside."""
        return self._ends(k, layout.ESCAPES)

    def absorbed_times(self, k: int) -> NDArray[np.float64]:
        """Times at which walls have absorbed the particles of frame k [s], (N,); NaN of those that are not."""
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
        """The number of a frame whose particles are kept, from 0 on."""
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
            born = self._births()[column] if self._comes(file) else -math.inf
            there = self.times >= born
            for values in (position, velocity):
                finite(values[there])
        return position.T, velocity.T

    def _there(self, file: Any, k: int) -> NDArray[np.bool_] | None:
        """Who is there at frame k; None where no one comes."""
        if not self._comes(file):
            return None
        return np.asarray(self._births() <= float(self._checked.row("parameters/time", k)))

    def _of_frame(self, name: str, k: int) -> NDArray[Any]:
        """What is kept of the particles at frame k by a name, checked."""
        return np.asarray(self._checked.row(f"particles/all/{name}/value", k))


def load(path: str | Path) -> Trajectory:
    """Open a trajectory for reading; see `Trajectory`."""
    return Trajectory(path)
