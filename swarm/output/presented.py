"""Views of a trajectory in Python: pictures, films, a viewer, tables, labelled arrays, and other formats."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from .. import checks, notebook
from ..columns import frame_of
from ..errors import SceneError
from ..extras import needed_by
from . import facts
from .stored import Stored

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.figure import Figure

    from .exported import Progress
    from .page.html import Page
    from .shown_film import Film


class Presented(Stored):
    """The methods of a `Trajectory` that need other libraries, each of which is imported where it is used.

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

    def __repr__(self: Any) -> str:
        try:
            times = self.times
            span = f", {times[0]:g} s to {times[-1]:g} s" if len(times) else ""
            bodies = f"{self.copies} bodies of " if self.copies else ""
            told = f"{len(times)} frame{'s' * (len(times) != 1)}{span}, {bodies}{self.count} particles, {self.method!r}"
        except SceneError as error:
            told = str(error).removeprefix(f"{self.path} is ")
        return f"Trajectory({str(self.path)!r}, {told})"

    def _repr_html_(self: Any) -> str:
        try:
            rows = facts.of_trajectory(self)
        except SceneError as error:
            rows = {"problem": str(error)}
        return notebook.table(f"Trajectory {self.path.name}", rows.items())

    def table(self: Any) -> "pandas.DataFrame":
        """The observables as a pandas frame: `time` first, a row for each frame.

        Vectors have a column for each component, momentum_x, and what each surface has one for each surface, impulse_0
        and wall_position_0_x.

        Raises:
            SceneError: the trajectory is damaged, or pandas is not installed.
        """
        return frame_of(self.observables)

    def plot(self, *, particles: int = 5000, figsize: tuple[float, float] | None = None) -> "Figure":
        """Draw energies, errors, penetration, impacts, pressure, speeds and the particles or bodies at the end.

        Args:
            particles: the most particles that are drawn, evenly chosen, or points of bodies.
            figsize: width and height [inches], at 100 pixels an inch; None: as large as the plots need.

        Returns:
            A figure of matplotlib, which a notebook shows where it is the last line of a cell, and which can be
            changed and saved: `figure.axes`, `figure.savefig("run.pdf")`. It is none of pyplot's, so nothing keeps it
            and no backend is chosen.

        Raises:
            SceneError: an argument is out of its range, the trajectory is damaged or holds no frame, or matplotlib or
                scikit-image is not installed.
        """
        with needed_by("a plot", "plot"):
            from . import plots
            from .content import content_of
        return plots.figure_of(content_of(self), figsize, particles)  # type: ignore[arg-type]

    def animate(
        self: Any,
        path: str | Path,
        *,
        frames: int = 200,
        fps: float = 25.0,
        size: tuple[int, int] = (960, 720),
        particles: int = 10_000,
        overwrite: bool = False,
    ) -> Path:
        """Write a film of the particles or bodies among their walls, coloured by speed.

        200 frames of 10 000 particles take 15 s of one core. Walls are drawn as they bound the volume at the start, and
        moved where they move. The path that it returns shows nothing in a notebook: `film` does.

        Args:
            path: `.mp4`, by ffmpeg, or `.gif`, which is some ten times as large.
            frames: the most that are drawn, evenly chosen, with the first and the last.
            fps: frames a second, above 0; of a GIF at most 50.
            size: width and height in pixels, 64 to 8192 each; an odd one is made even.
            particles: the most that are drawn, evenly chosen, or points of bodies.
            overwrite: replace an existing file.

        Returns:
            The path. The file has this name when it is complete.

        Raises:
            SceneError: an argument is out of its range, the file exists, the trajectory is damaged or keeps no
                particles, or matplotlib, scikit-image or ffmpeg is not installed.
            FileError: the file cannot be written.
        """
        with needed_by("a film", "animation"):
            from . import film
        return film.animate(self, path, frames, fps, size, particles, overwrite)

    def film(
        self: Any,
        *,
        frames: int = 100,
        fps: float = 25.0,
        size: tuple[int, int] = (640, 480),
        particles: int = 5000,
    ) -> "Film":
        """A film of the particles or bodies among their walls, which a notebook shows.

        It is drawn as by `animate`, smaller and of fewer frames: all of it is kept in the notebook, some 0.5 MB. It
        needs no kernel and no network to play when the notebook is opened again; in one that is not trusted it waits
        for its play button. `film.save("run.mp4")` writes it.

        Args:
            frames: the most that are drawn, evenly chosen, with the first and the last.
            fps: frames a second, above 0; where ffmpeg is missing at most 50.
            size: width and height in pixels, 64 to 8192 each; an odd one is made even.
            particles: the most that are drawn, evenly chosen, or points of bodies.

        Returns:
            A `Film`: a video, or a GIF where ffmpeg is not installed. One of more than 22 MB is not shown, since it
            would make the notebook hang, and says so.

        Raises:
            SceneError: an argument is out of its range, the trajectory is damaged or keeps no particles, or matplotlib
                or scikit-image is not installed.
        """
        with needed_by("a film", "animation"):
            from . import shown_film
        return shown_film.film_of(self, frames, fps, size, particles)

    def report(self: Any, path: str | Path | None = None, *, overwrite: bool = False) -> "Page":
        """A page of the run: its scene, whether it went well, graphs, numbers, its speed, and how to reproduce it.

        One file in HTML, some 0.5 MB, for any browser: it needs no other file and no network, is light or dark as the
        reader's system, and prints well.

        Args:
            path: `.html`, where the page is written; None: it is only returned.
            overwrite: replace an existing file.

        Returns:
            A `Page`, which a notebook shows, and which has `html`, the text, and `save(path)`.

        Raises:
            SceneError: the file exists or has another suffix, the trajectory is damaged or holds no frame, or jinja2,
                matplotlib or scikit-image is not installed.
            FileError: the file cannot be written.
        """
        with needed_by("a report", "report"):
            from .page import html, run
        checks.flag("overwrite", overwrite)
        if path is not None:
            html.checked_target(path, overwrite, (self.path,))
        page = run.of_trajectory(self)
        if path is not None:
            page.save(path, overwrite=overwrite)
        return page

    def to_xarray(self: Any) -> "xarray.Dataset":
        """The trajectory as a Dataset of xarray, with the dimensions time, particle, axis and surface.

        What is kept of particles, `position`, `velocity`, `image`, `impacts_per_particle`, `escape_time` and
        `absorbed_time`, is read from the file when its values are used, and only the part that is: a file larger than
        the memory is no problem, `dataset.position.sel(time=slice(2.0, 3.0)).mean("particle")` reads these frames.
        Nothing that is read is kept; `dataset.load()` keeps all. As long as it is read, the trajectory must not be
        closed. Observables and masses are read at once. Units are in `attrs`, and so are the tables of the scene and
        the method.

        Raises:
            SceneError: the trajectory is damaged, or xarray is not installed.
        """
        with needed_by("a Dataset", "xarray"):
            from . import labelled
        return labelled.dataset_of(self)

    def show(self: Any, *, particles: int = 5000, color: str = "speed", megabytes: float = 100.0) -> None:
        """Show the trajectory in a Rerun viewer: in a notebook below the cell, else in a window on this machine.

        The viewer of a notebook needs WebGL in the browser. The browser gets it (67 MB) from Rerun's server, or, where
        the kernel does not reach that, from the machine of the kernel, which must be that of the browser then. The
        environment variable RERUN_NOTEBOOK_ASSET, "serve-local" or a URL, says otherwise; "inline" does not work with
        Rerun 0.41. It lives as long as the kernel: a notebook that is opened again shows nothing there, but a `film`.

        Args:
            particles: the most particles that are shown, evenly chosen, or points of bodies.
            color: what their colour shows, "speed" or "energy-error".
            megabytes: the largest size of what the viewer gets, above 0; of too many frames every k-th is shown.

        Raises:
            SceneError: an argument is out of its range, the trajectory is damaged or keeps no particles, rerun-sdk
                (in a notebook rerun-sdk[notebook]) is not installed, or there is no screen.
        """
        in_notebook = notebook.is_running()
        with needed_by("a viewer", "notebook" if in_notebook else "record"):
            if in_notebook:
                from . import widget

                widget.bring_widget()
            from . import recorded, recording
        recorded.show(self, recording.Settings(particles, color, megabytes, live=not in_notebook))

    def export(
        self: Any,
        path: str | Path,
        frames: slice | int | None = None,
        particles: int = 1,
        surfaces: bool = True,
        overwrite: bool = False,
        progress: "Progress | None" = None,
    ) -> list[Path]:
        """Write the trajectory to files of another format; units are as they are, and so are digits of .xyz and .csv.

        Args:
            path: its suffix says the format: `.vtkhdf` for ParaView, `.xyz` (extended XYZ) for OVITO and ASE, `.gsd`
                for HOOMD-blue and freud, in which numbers are float32, `.ply` for Blender, MeshLab, Open3D and games,
                float32 too, a file a frame: NAME_0000.ply and so on, `.csv` for spreadsheets and pandas, and `.obj`
                for the walls at a frame, an object a surface, in Blender, games and CAD.
            frames: a slice of the frames, such as slice(0, None, 10), or the number of one; None: all, of `.obj` the
                first.
            particles: k is every k-th particle, or body, beginning with the first.
            surfaces: of `.vtkhdf`, write also the walls, as triangles, to `NAME.surfaces.vtkhdf`. Fields of
                more than 2000 solids are points of `NAME.solids.vtkhdf`, a few numbers for each.
            overwrite: replace existing files; of a longer sequence of `.ply` all of them.
            progress: is called with how many frames are written, and how many there are to write.

        Returns:
            The files. They have their names when they are whole; one frame at a time is in memory.

        Raises:
            SceneError: another suffix, an argument out of its range or that is not one of the format, a library that
                is missing, or a file that exists.
            FileError: the file cannot be written.
        """
        from .export import export

        return export(self, path, frames, particles, surfaces, overwrite, progress)
