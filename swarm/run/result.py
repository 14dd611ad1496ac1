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
        observables: name -> array with one entry for each frame: "time" [s]; "kinetic_energy", "potential_energy",
            "contact_energy" and their sum, "total_energy" [J]; "dissipated_energy", the energy lost in contacts so far
            [J]; counts since 0 s, "impacts", "escaped", "unconverged" and "sweeps"; the number of particles that are
            "sliding", and "sliding_time", the time that all have slid [s]; "energy_error" of the worst particle,
            relative to its energy at the start, and "max_penetration" into a wall [m]; "momentum" and
            "angular_momentum" (frames, 3), "impulse" and "wall_heat" (frames, surfaces). If a surface is a union or an
            intersection also "part_impulse" and "part_heat" (frames, parts), of each of `scene.parts`. If walls move
            also "wall_work" (frames, surfaces) [J] and, except in runs of bodies, "wall_position" (frames, surfaces,
            3) [m] and "wall_orientation" (frames, surfaces, 4), quaternions (w, x, y, z): the point xi of the surface
            as given is at position + orientation xi. If walls react also "wall_energy" (frames, surfaces) [J], which
            "total_energy" includes, "wall_velocity" [m/s] and "wall_spin" [rad/s] (frames, surfaces, 3). For bodies
            also "link_error", the "work" of anchors that move [J], and "cavity_impulse" (frames, cavities) on the
            cavities that points carry [N s].
            With member_impacts=True "member_impacts" (frames, members) of all members of surface 0, then of surface 1,
            and so on. If particles may slide also "member_residence" [s], the time that they slid, rested or, by a
            law, waited there; at an edge it counts for the wall that they were on before, and a wait counts as a whole
            when it begins. If walls heat or absorb particles also "member_heat" [J] and "member_absorbed".
            If laws of walls return a `Leave` also "absorbed" (frames, surfaces), the number of particles that each
            surface has absorbed so far.
            With counters "crossings" (frames, counters, 2), the number of crossings of each counter since 0 s, out of
            its admissible side and back; "crossed_momentum" (frames, counters, 2, 3) [kg m/s] and "crossed_energy"
            (frames, counters, 2) [J] of the particles that crossed; and "crossed_slowness", the sum of 1/|v_n| [s/m].
            A flux is a difference between frames over their time; see `Counter`.
            For particles with a radius also "collisions", the number of pairs that met since 0 s. Two observables are
            means since the frame before: "collision_rate", the pairs that met per second [1/s], and "pressure" [Pa, in
            a plane N/m], by the virial, (2 K + sum r_ij . J_ij/dt)/(d V). The pressure is NaN at the start and if no
            volume is known: V is `particles.volume`, or the cell of a scene without surfaces. If particles have a spin
            also "rotational_energy" [J]; "total_energy" includes it, and "angular_momentum" includes the spins. With
            Penalty also "largest_overlap" [m], the largest overlap of two balls, or of a ball and a wall, at any end
            of a step since the frame before.
            With sources "born" (frames, sources), the number of particles born so far, and "source_energy" [J], the
            energy that they brought in. No observable counts particles that are born later. For balls also "blocked"
            (frames, sources), the number of births that found no free place at their time.
        wall_time: the time that the run took in all its sessions, with compilation [s].
        trajectory: the file that was written, or None.
        multipliers: the statistics of the loops of each particle for a method with multipliers; else None.
        impacts_per_particle: (N,) the number of impacts of each particle.
        escape_time: (N,) the time at which each particle passed an opening of a wall [s], where it stays from then on;
            NaN for particles inside.
        absorbed_time: (N,) the time at which a law of a wall absorbed each particle [s], where it stays from then on;
            NaN for other particles.
        bodies: the bodies at `until`, or None; with bodies, `particles` are all their points.
        scene, method: the arguments of the run.
        birth_time: (N,) the time of birth of each particle [s], 0 for particles of the start, NaN for balls that were
            not born, which are at NaN in `particles`: `particles.born()` are the others.
        collisions_per_particle: (N,) the number of collisions of each ball; None for points, which do not meet.
        compile_time: the part of the wall time in which the last session compiled kernels [s]; 0 on a cluster.
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
        """Return the observables as a pandas frame, `time` first, a row for each frame; see `Trajectory.table`.

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
        for the parts of a union, and (1,) for any other surface. In a periodic cell all images of a solid are one
        member.
        """
        return self._of_members("member_impacts")

    @property
    def member_residence(self) -> list[NDArray[np.float64]] | None:
        """The time that particles slid, rested or waited on each member [s], as `member_impacts`; None if not possible.

        A wait, of `Sticky`, counts as a whole when it begins.
        """
        return self._of_members("member_residence")

    @property
    def member_heat(self) -> list[NDArray[np.float64]] | None:
        """The heat that each member has given [J], as `member_impacts`; None if no wall gives heat."""
        return self._of_members("member_heat")

    @property
    def member_absorbed(self) -> list[NDArray[np.int64]] | None:
        """The number of particles absorbed by each member, as `member_impacts`; None if no wall absorbs particles."""
        return self._of_members("member_absorbed")

    def _of_members(self, name: str) -> list[NDArray[Any]] | None:
        if name not in self.observables or self.scene is None:
            return None
        return self.scene.compiled().numbering.split(self.observables[name][-1])

    @property
    def frames(self) -> "Frames":
        """The frames of the trajectory: a sequence of `Frame`; the particles of each are read when they are used.

        Raises:
            SceneError: the run has no trajectory, or its file is missing or damaged.
        """
        path = self._written("frames are", ", or take the needed arrays of each frame by progress= or observables=")
        from ..files.trajectory import load
        from .sequence import Frames

        return Frames(load(path))

    def _written(self, what: str, otherwise: str = "") -> Path:
        """Return the path of the trajectory; the error without one begins with `what`, such as "frames are"."""
        if self.trajectory is None:
            raise SceneError(
                f"{what} those of the trajectory, and this run has written none; give trajectory={otherwise}"
            )
        return self.trajectory

    def film(
        self, *, frames: int = 100, fps: float = 25.0, size: tuple[int, int] = (640, 480), particles: int = 5000
    ) -> "Film":
        """Return a film of the trajectory, which a notebook shows; see `Trajectory.film`.

        Raises:
            SceneError: the run has no trajectory, its file is missing or damaged or keeps no particles, an argument is
                out of its range, or matplotlib or scikit-image is not installed.
        """
        path = self._written("the frames of a film are")
        from ..files.trajectory import load

        with load(path) as written:
            return written.film(frames=frames, fps=fps, size=size, particles=particles)

    def plot(self, *, particles: int = 5000, figsize: tuple[float, float] | None = None) -> "Figure":
        """Draw the run in one picture; see `Trajectory.plot`.

        Without a trajectory, or if it keeps no particles, the speeds at the start are left out, and colours are
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
        """Return a page of the run, one file in HTML, which a notebook shows; see `Trajectory.report`.

        Without a trajectory the page does not say how to reproduce the run.

        Args:
            path: the file (.html) to write; None: the page is only returned.
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
        """Return the content of pictures and verdicts; `what` is the view that needs it, for an error."""
        return cast("Content", view("content").content_of_result(self, what))
