"""The writers of the files of a run: its trajectory, its recording, its log of impacts."""

from typing import TYPE_CHECKING

from ..errors import SceneError
from ..views import view
from .impacts import Impacts
from .options import Task
from .session import Session

if TYPE_CHECKING:
    from ..files.background import Background, Writer


def recorder_of(task: Task) -> "Writer | None":
    """Return the writer of the recording, or None."""
    options = task.options
    if options.recording is None and not options.live:
        return None
    if options.resume:
        raise SceneError(
            "recording and live cannot continue a run that was stopped; leave them out, and make the recording from "
            "the trajectory: swarm record RUN.h5 -o OUT.rrd"
        )
    recording = view("recording")  # rerun takes half a second
    settings = recording.Settings(
        options.record_particles, options.record_color, options.record_megabytes, options.live
    )
    body = None if task.bodies is None else task.bodies.body
    made: Writer = recording.RecordingWriter(
        options.recording, options.overwrite, task.scene, task.method, task.particles, options.times.count, settings,
        body,
    )  # fmt: skip
    return made


def writer_of(task: Task, session: Session, recorder: "Writer | None", log: Impacts | None) -> "Background | None":
    """Return a context with the function that writes a frame in a background thread, or None without files."""
    # The impacts of a frame are on the disk before the frame, so that readers of the frame find them.
    outputs = [
        (_impacts(task, session, log), slice(0)),
        (_trajectory(task, session), task.options.storage.kept(task.first)),
        (recorder, slice(None)),
    ]
    used = [(one, kept) for one, kept in outputs if one is not None]
    if not used:
        return None
    from ..files.background import Background, Several

    n = len(task.particles)
    births = task.particles.births
    born = None if births is None or births.balls else births.time
    writer, kept = used[0] if len(used) == 1 else (Several(used), slice(None))
    made = Background(writer, n, kept, born)
    if log is not None:
        log.queue = made.do
    return made


def _impacts(task: Task, session: Session, log: Impacts | None) -> "Writer | None":
    if log is None:
        return None
    from ..files.impacts import ImpactWriter, about

    texts = about(task.compiled, task.method, log.kept, {"particles": task.count, **session.identity})
    start = (session.first, log.total) if session.first > 0 else None
    writer = ImpactWriter(task.options.impacts, log.columns(), log.ends, texts, start)
    log.write, log.sums = writer.add, writer.sums
    return writer


def _trajectory(task: Task, session: Session) -> "Writer | None":
    options = task.options
    if options.trajectory is None:
        return None
    from ..files.provenance import Course
    from ..files.writer import TrajectoryWriter  # h5py takes 0.2 s to import

    writer = TrajectoryWriter(
        options.trajectory, options.storage, task.scene, task.method, task.bodies or task.particles,
        options.scene_text, session.identity, session.first > 0,
    )  # fmt: skip
    if not task.is_shard:
        writer.course = Course(options.until, options.thread_count(), session.wall_time)
    return writer
