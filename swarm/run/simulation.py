"""The function `simulate`: from a scene to frames, on this machine or on a cluster."""

import os
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from ..common.frames import Frame
from ..methods.base import Method
from ..methods.impact import Impact
from ..particles import Particles
from ..scene import Scene
from ..sources.source import Source
from ..surfaces.counter import Counter
from ..surfaces.surface import Surface
from . import engines, machine
from .options import RunOptions
from .preflight.admission import task_of
from .result import Result
from .session import Session

if TYPE_CHECKING:
    from ..bodies.copies import Bodies


def simulate(  # noqa: PLR0913  the keywords are the public interface
    scene: Scene,
    particles: "Particles | Bodies | None",
    method: Method | None = None,
    *,
    until: float,
    every: float | None = None,
    trajectory: str | os.PathLike[str] | None = None,
    recording: str | os.PathLike[str] | None = None,
    impacts: str | os.PathLike[str] | None = None,
    impact_particles: str | int | Sequence[int] = "all",
    member_impacts: bool = False,
    observables: Mapping[str, Callable[[Frame], Any]] | None = None,
    counters: Sequence[Surface | Counter] = (),
    record_particles: int = 5000,
    record_color: str = "speed",
    record_megabytes: float = 100.0,
    live: bool | str = False,
    threads: int | None = None,
    progress: bool | Callable[[Frame], None] = False,
    overwrite: bool = False,
    scene_text: str | None = None,
    block_size: int | None = None,
    frames: str | int = "all",
    precision: str = "float64",
    compression: str = "none",
    checkpoint: float | None = None,
    resume: bool = False,
    walltime: float | None = None,
    compile: str = "auto",
    seed: int = 0,
    cluster: Any = None,
    shards: int | None = None,
    sources: Sequence[Source] | None = None,
) -> Result:
    """Advance particles in a scene and observe them at frames.

        check everything
        for each frame: 0, every, 2 every, ..., until
            advance all blocks to the frame   (not for the first)
            observe; fail if a number is not finite, or a particle outside
            copy the frame; a background thread writes and flushes it
            update the progress display
            save a checkpoint if one is due (within a long frame too)

    Args:
        scene: the walls and gravity.
        particles: the particles or bodies at the start, which are not changed. None: all come from `sources`.
        method: the method that advances them; None: `Impact()`. Bodies need Impact with a dt, Penalty, or
            AugmentedLagrangian with adaptive=True.
        until: end of the run [s], above 0.
        every: time between frames [s], at most `until`; None: only the first and the last frame.
        trajectory: HDF5 file to write; its folder must exist.
        recording: Rerun file to write; its folder must exist. It needs the packages of the extra "record".
        impacts: HDF5 file for a log of every impact, not with the baselines; see `load_impacts`. Its folder must
            exist.
        impact_particles: the particles with impacts in this log: "all", k for every k-th one, or a list of numbers.
        member_impacts: True to count the impacts on each member of each surface, and the time that particles stay
            there; see `Result`.
        observables: user-defined observables, functions by their names. Each is called with every `Frame` and returns a
            number, or an array of the same shape at every frame. The values are kept in float64, with the other
            observables; NaN means no value. The functions are called at the start, before anything is compiled. They
            get all particles, also on a cluster, where the client calls them when the shards have ended.
        counters: surfaces that count the particles that cross them, and do not stop them; not with a contact_step. Each
            is a surface at rest or a `Counter`. The motion has the same bits without counters. With fixed steps a
            particle crosses a counter that is between the two ends of a step. A body crosses with its centre of mass.
            See `Result.observables`.
        record_particles: the most particles recorded, evenly chosen.
        record_color: the quantity that the colour of a recorded particle shows, "speed" or "energy-error".
        record_megabytes: largest size of the recording [MB], above 0; if all frames take more, every k-th is recorded.
        live: True to show the run in a Rerun viewer on this machine, or the URL of a viewer.
        threads: number of threads; None: all cores that this process may use. Results have the same bits for any
            number.
        progress: True for a progress bar, or a function that is called with every `Frame`, which has the particles.
        overwrite: replace an existing recording, and an existing trajectory as soon as the first frame is complete.
        scene_text: the text of the scene file, kept in the trajectory; None: it is written from the objects.
        block_size: number of particles that a thread takes at a time. Results do not depend on it.
        frames: the particles that the trajectory keeps: "all", "none", or k for every k-th one.
        precision: "float64", or "float32" for frames and rows of the log of impacts of half the size; observables,
            checkpoints and the times of impacts stay exact. Far from the origin "float32" is refused.
        compression: the compression of the frames, "none", "gzip" or "lzf".
        checkpoint: wall time from one checkpoint to the next [s], above 0; None for no checkpoints. The checkpoint is
            the file TRAJECTORY.checkpoint, until the run is complete.
        resume: continue from that checkpoint, with the same bits as without the stop; start a new run if there is
            neither a checkpoint nor a trajectory.
        walltime: wall time after which the run stops [s]. It stops early enough to write the frames in its queue, and
            a checkpoint if it makes checkpoints. A compilation under way ends first.
        compile: "auto" uses kernels that an earlier run compiled. With up to 2000 particles the other kernels run in
            plain Python, with the same bits, until the runs of this process have spent about a second there; then
            they are compiled. With more particles they are compiled at once. "always" compiles all kernels from the
            start, and "never" uses plain Python only.
        seed: seed of the random numbers of walls and sources, from 0 to 2**64 - 1: the same seed gives the same bits.
        cluster: the cluster of the run: None for this machine; "local:N" for N worker processes on it; the address of a
            scheduler of Dask, such as "tcp://10.0.0.1:8786"; or a `distributed.Client`. It needs a trajectory, and the
            packages of the extra "cluster". The particles are split into shards, with files in the folder
            TRAJECTORY.shards, which the trajectory needs; results have the same bits as without a cluster. A worker
            that dies is replaced, and its shard goes on from its checkpoint, by default one every 60 s.
        shards: number of shards on a cluster; None: one for each thread of its workers. A run of particles that meet,
            or that move a wall, is one shard.
        sources: the `Source`s of particles that are born during the run, not with a contact_step; None for no births.
            Births are drawn from `seed`.

    Returns:
        A `Result`.

    Raises:
        SceneError: bad input, or a checkpoint of another run; nothing has been run or written.
        FileError: an output cannot be written, or another run is writing it.
        RunError: a step failed; the frames before it are in the trajectory.
        KeyboardInterrupt: SIGINT or SIGTERM came; the frames before it are in the trajectory.
        WallTimeError: the wall time limit is reached; the frames before it are in the trajectory.

    >>> import swarm
    >>> cavity = swarm.Scene(surfaces=[swarm.Sphere(radius=0.5)])
    >>> start = swarm.fill(cavity, 10, speed=1.0)
    >>> impact = swarm.Impact()
    >>> result = swarm.simulate(cavity, start, impact, until=2.0, every=0.5)
    >>> result.observables["time"]
    array([0. , 0.5, 1. , 1.5, 2. ])
    """
    options = RunOptions(
        until=until, every=every, trajectory=trajectory, recording=recording, impacts=impacts,
        impact_particles=impact_particles, member_impacts=member_impacts, observables=observables, counters=counters,
        record_particles=record_particles, record_color=record_color, record_megabytes=record_megabytes, live=live,
        threads=threads, progress=progress, overwrite=overwrite, scene_text=scene_text, block_size=block_size,
        frames=frames, precision=precision, compression=compression, checkpoint=checkpoint, resume=resume,
        walltime=walltime, compile=compile, seed=seed, cluster=cluster, shards=shards, sources=sources,
    )  # fmt: skip
    return carry_out(scene, particles, Impact() if method is None else method, options)


def carry_out(
    scene: Scene,
    particles: "Particles | Bodies | None",
    method: Method,
    options: RunOptions,
    counted_from: float | None = None,
) -> Result:
    """Carry out `simulate` with `RunOptions`; the wall time counts from `counted_from` [s], or from now."""
    if options.cluster is None:
        session = Session(options, counted_from)
        return machine.carry_out_task(task_of(scene, particles, method, options), session)
    cluster = engines.wing("fleet.sharded_run")  # `distributed` takes half a second to import
    sharded = cluster.Sharded(options, counted_from)
    result: Result = cluster.carry_out(task_of(scene, particles, method, options), sharded)
    return result
