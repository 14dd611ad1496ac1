"""The result of a run: its end, its observables, and the views of it."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

from ..common import notebook
from ..common.columns import frame_of
from ..common.signature import explain_methods
from ..errors import SceneError
from ..methods.base import Method
from ..particles import Particles
from ..scene import Scene
from ..state import Multipliers
from ..views import view

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

    from ..bodies.copies import Bodies
    from ..pages.html import Page
    from ..pictures.shown_film import Film
    from ..words.content import Content
    from .sequence import Frames


@explain_methods
@dataclass(frozen=True, repr=False)
class Result:
    """The end of a run.

    Attributes:
        particles: the particles at `until`.
        observables: name -> array with one entry a frame: "time" [s]; "kinetic_energy", "potential_energy",
            "contact_energy" and their sum, "total_energy" [J]; "dissipated_energy", what contacts have lost so far [J];
            counts since 0 s, "impacts", "escaped", "unconverged" and "sweeps"; how many are "sliding", and how long
            all have been, "sliding_time" [s]; the worst particle's "energy_error", relative to its energy at the start,
            and "max_penetration" into a wall [m]; "momentum" and "angular_momentum" (frames, 3), "impulse" and
            "wall_heat" (frames, surfaces). Where a surface is a union or an intersection also "part_impulse" and
            "part_heat" (frames, parts), of each of `scene.parts`. Where walls move also "wall_work" (frames, surfaces)
            [J] and, except in runs of bodies, "wall_position" (frames, surfaces, 3) [m] and "wall_orientation" (frames,
            surfaces, 4), quaternions (w, x, y, z): the point xi of the surface as given is at position + orientation
            xi. Where walls react also "wall_energy" (frames, surfaces) [J], which "total_energy" includes,
            "wall_velocity" [m/s] and "wall_spin" [rad/s] (frames, surfaces, 3). Of bodies also "link_error", the "work"
            of anchors that move [J], and "cavity_impulse" (frames, cavities) on the cavities that points carry [N s].
            With member_impacts=True "member_impacts" (frames, members) of all members of surface 0, then of surface 1,
            and so on. Where particles may slide also "member_residence" [s], the time for which they slid, rested or,
            by a law, waited there; at an edge it counts for the wall that they were on before, and a wait counts as a
            whole when it begins. Where walls heat or absorb particles also "member_heat" [J] and "member_absorbed".
            Where laws of walls return a `Leave` also "absorbed" (frames, surfaces), how many each has absorbed so far.
            With counters "crossings" (frames, counters, 2), how many have crossed each since 0 s, out of its admissible
            side and back; what they carried, "crossed_momentum" (frames, counters, 2, 3) [kg m/s] and "crossed_energy"
            (frames, counters, 2) [J]; and "crossed_slowness", the sum of 1/|v_n| [s/m]. A flux is a difference between
            frames over their time; see `Counter`.
            Of particles with a radius also "collisions", the number of pairs that met since 0 s. Two are means since
            the frame before: "collision_rate", the pairs that met per second [1/s], and "pressure" [Pa, in a plane
            N/m], by the virial, (2 K + sum r_ij . J_ij/dt)/(d V). The pressure is NaN at the start and where no volume
            is known: V is `particles.volume`, or the cell of a scene without surfaces. Where particles have a spin also
            "rotational_energy" [J]; "total_energy" includes it, and "angular_momentum" includes the spins. With Penalty
            also "largest_overlap" [m], the largest overlap of two balls, or of a ball and a wall, at any end of a step
            since the frame before.
            With sources "born" (frames, sources), the number of particles born so far, and "source_energy" [J], the
            energy that they brought in. No observable counts particles that are born later. Of balls also "blocked"
            (frames, sources), the number of births that found no free place at their time.
        wall_time: seconds the run took in all its sessions, compilation included.
        trajectory: the file that was written, or None.
        multipliers: for a method with multipliers, the statistics of their loops, per particle; else None.
        impacts_per_particle: (N,) how many impacts each has had.
        escape_time: (N,) when each passed an opening of a wall [s], where it stays from then on; NaN of those inside.
        absorbed_time: (N,) when a law of a wall absorbed each [s], where it stays from then on; NaN of the others.
        bodies: the bodies at `until`, or None; then `particles` are all their points.
        scene, method: the arguments of the run.
        birth_time: (N,) when each came [s], 0 of those of the start, NaN of balls that were never born, which are at
            NaN in `particles`: `particles.born()` are the others.
        collisions_per_particle: (N,) how often each has met another one; None for points, which do not meet.
        compile_time: seconds of the wall time in which the last session compiled kernels; 0 on a cluster.
    """

    particles: Particles
    observables: dict[str, NDArray[Any]]
    wall_time: float
    trajectory: Path | None
    multipliers: Multipliers | None
    impacts_per_particle: NDArray[np.int64]
    escape_time: NDArray[np.float64]
    absorbed_time: NDArray[np.float64]
    bodies: "Bodies | None" = None
    scene: Scene | None = None
    method: Method | None = None
    birth_time: NDArray[np.float64] | None = None
    collisions_per_particle: NDArray[np.int64] | None = None
    compile_time: float = 0.0

    def __repr__(self) -> str:
        seen, frames = self.observables, len(self.observables["time"])
        parts = [
            f"{len(self.particles)} particles" if self.bodies is None else repr(self.bodies),
            f"{frames} frame{'s' * (frames != 1)} to {seen['time'][-1]:g} s",
            f"{int(seen['impacts'][-1])} impacts",
            *([f"{int(seen['collisions'][-1])} collisions"] if "collisions" in seen else []),
            f"energy error {seen['energy_error'].max():.1e}",
            f"penetration {seen['max_penetration'].max():.1e} m",
            f"{self.wall_time:.2f} s",
            *([] if self.trajectory is None else [repr(str(self.trajectory))]),
        ]
        return f"Result({', '.join(parts)})"

    def _repr_html_(self) -> str:
        try:
            rows = view("facts").of_result(self)
        except SceneError as error:
            rows = {"problem": str(error)}
        return notebook.table("Result", rows.items())

    def table(self) -> "pandas.DataFrame":
        """The observables as a pandas frame: `time` first, a row for each frame; see `Trajectory.table`.

        Raises:
            SceneError: pandas is not installed.
        """
        return frame_of(self.observables)

    @property
    def times(self) -> NDArray[np.float64]:
        """The times of the frames [s], as `Trajectory.times`: the observable "time"."""
        times: NDArray[np.float64] = self.observables["time"]
        return times

    @property
    def member_impacts(self) -> list[NDArray[np.int64]] | None:
        """The impacts on each member of each surface since 0 s, in all sessions; None without member_impacts=True.

        A list with an array for each surface: (members,) for a field such as `Spheres`, for the facets of a `Mesh` and
        for the parts of a union, and (1,) for any other surface. In a cell that repeats all images of a solid are one
        member.
        """
        return self._of_members("member_impacts")

    @property
    def member_residence(self) -> list[NDArray[np.float64]] | None:
        """How long particles have slid, rested or waited on each member [s], as `member_impacts`; None if none may.

        A wait, of `Sticky`, counts as a whole when it begins.
        """
        return self._of_members("member_residence")

    @property
    def member_heat(self) -> list[NDArray[np.float64]] | None:
        """The heat that each member has given [J], as `member_impacts`; None where no wall gives any."""
        return self._of_members("member_heat")

    @property
    def member_absorbed(self) -> list[NDArray[np.int64]] | None:
        """The particles that each member has absorbed, as `member_impacts`; None where no wall absorbs."""
        return self._of_members("member_absorbed")

    def _of_members(self, name: str) -> list[NDArray[Any]] | None:
        if name not in self.observables or self.scene is None:
            return None
        return self.scene.compiled().numbering.split(self.observables[name][-1])

    @property
    def frames(self) -> "Frames":
        """The frames of the trajectory: a sequence of `Frame`, each with its particles read when they are asked for.

        Raises:
            SceneError: the run has no trajectory, or it is gone or damaged.
        """
        path = self._written("frames are", ", or take what is needed of each frame by progress= or observables=")
        from ..files.trajectory import load
        from .sequence import Frames

        return Frames(load(path))

    def _written(self, what: str, otherwise: str = "") -> Path:
        """The path of the trajectory; the error without one begins with `what`, such as "frames are"."""
        if self.trajectory is None:
            raise SceneError(
                f"{what} those of the trajectory, and this run has written none; give trajectory={otherwise}"
            )
        return self.trajectory

    def film(
        self, *, frames: int = 100, fps: float = 25.0, size: tuple[int, int] = (640, 480), particles: int = 5000
    ) -> "Film":
        """A film of the trajectory, which a notebook shows; see `Trajectory.film`.

        Raises:
            SceneError: the run has no trajectory, or it is gone or damaged or keeps no particles, an argument is out of
                its range, or matplotlib or scikit-image is not installed.
        """
        path = self._written("the frames of a film are")
        from ..files.trajectory import load

        with load(path) as written:
            return written.film(frames=frames, fps=fps, size=size, particles=particles)

    def plot(self, *, particles: int = 5000, figsize: tuple[float, float] | None = None) -> "Figure":
        """Draw the run in one picture; see `Trajectory.plot`.

        Without a trajectory, or where that keeps no particles, the speeds at the start are left out, and colours are
        relative to the particles at the end.

        Raises:
            SceneError: an argument is out of its range, or matplotlib or scikit-image is not installed.

        >>> import swarm
        >>> cavity = swarm.Scene(surfaces=[swarm.Sphere(radius=0.5)])
        >>> result = swarm.simulate(cavity, swarm.fill(cavity, 10, speed=1.0), swarm.Impact(), until=2.0, every=0.5)
        >>> result.plot().get_suptitle()
        '10 particles in a sphere: Impact, 2 s'
        """
        return cast("Figure", view("plot").figure_of(self.content("plot"), figsize, particles))

    def report(self, path: str | Path | None = None, *, overwrite: bool = False) -> "Page":
        """A page of the run, one file in HTML, which a notebook shows; see `Trajectory.report`.

        Without a trajectory it does not say how to reproduce the run.

        Args:
            path: `.html`, where the page is written; None: it is only returned.
            overwrite: replace an existing file.

        Raises:
            SceneError: the file exists or has another suffix, the trajectory is damaged, or jinja2, matplotlib or
                scikit-image is not installed.
            FileError: the file cannot be written.

        >>> import swarm
        >>> cavity = swarm.Scene(surfaces=[swarm.Sphere(radius=0.5)])
        >>> result = swarm.simulate(cavity, swarm.fill(cavity, 10, speed=1.0), swarm.Impact(), until=2.0, every=0.5)
        >>> page = result.report()
        >>> page.title, page.html[:15]
        ('10 particles in a sphere: Impact, 2 s', '<!DOCTYPE html>')
        """
        if self.trajectory is not None and self.trajectory.is_file():
            from ..files.trajectory import load

            with load(self.trajectory) as written:
                return written.report(path, overwrite=overwrite)
        pages = view("report")
        return cast("Page", pages.report_of_content(self.content("report"), self.wall_time, path, overwrite))

    def content(self, what: str) -> "Content":
        """What pictures and verdicts are made of; `what` is the view that needs it, for the sentence of an error."""
        return cast("Content", view("content").content_of_result(self, what))
