"""The run of a scene file: `swarm.run`, and the checks of outputs that the command line shares."""

import dataclasses
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..common.checks import closest, listed, path_of
from ..errors import SceneError
from ..files import marks, paths
from ..run.options import RunOptions
from ..run.result import Result
from ..run.simulation import carry_out
from ..scene_file import OUTPUTS, Job, read

# Keywords of `simulate` that are tables of a scene file instead of keys of [run].
_TABLES = ("sources", "counters")
# The arguments of outputs in Python, for sentences.
_IN_PYTHON = {"trajectory": "output={!r}", "recording": "recording={!r}", "impacts": "impacts={!r}"}


def run(
    path: str | os.PathLike[str],
    output: str | os.PathLike[str] | None = None,
    *,
    plugins: Sequence[str] = (),
    **options: Any,
) -> Result:
    """Carry out the run of a scene file, as `swarm run` does.

    Args:
        path: the scene file, TOML.
        output: the trajectory to write; None: the one in [run] of the file, if any.
        plugins: modules with laws, surfaces, methods and observables, which the file may name as "module:Name".
        options: keywords of `simulate`, such as until, every, threads or progress, in place of the keys of [run].

    Returns:
        A `Result`.

    Raises:
        SceneError: the file cannot be read, a key or an option is unknown or out of its range; nothing has run.
        FileError, RunError, KeyboardInterrupt, WallTimeError: as for `simulate`.

    Conserves: the same as the method of the file, by default `Impact`.

    >>> import pathlib, swarm, tempfile
    >>> text = '''
    ... [particles]
    ... count = 10
    ... speed = 1.0
    ... [[surface]]
    ... kind = "sphere"
    ... radius = 0.5
    ... [run]
    ... until = 1.0
    ... every = 0.5
    ... '''
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = pathlib.Path(folder) / "scene.toml"
    ...     _ = file.write_text(text)
    ...     result = swarm.run(file, until=2.0)
    >>> result.observables["time"]
    array([0. , 0.5, 1. , 1.5, 2. ])
    """
    known = [one.name for one in dataclasses.fields(RunOptions) if one.name not in (*_TABLES, "trajectory")]
    for name in options:
        if name not in known:
            more = "; the trajectory is the argument output" * (name == "trajectory")
            raise SceneError(f"{name}: unknown option, expected {listed(known)}{more or closest(name, known)}")
    job = read(path_of("path", path), plugins)
    given: dict[str, Any] = {"scene_text": job.text, **options}
    if output is not None:
        given["trajectory"] = paths.target_of("trajectory", output)
    elif job.run.trajectory is None and not given.get("resume"):
        # Without a trajectory there is nothing to resume.
        given.setdefault("checkpoint", None)
    chosen = dataclasses.replace(job.run, **given)
    alone = named_alone(job, trajectory=output, recording=options.get("recording"), impacts=options.get("impacts"))
    check_outputs(job, chosen, alone, "overwrite it by naming it in Python: {}, overwrite=True", _IN_PYTHON)
    try:
        return carry_out(job.scene, job.start(), job.method, chosen)
    except SceneError as error:
        raise job.located(error) from None


def named_alone(job: Job, **given: Any) -> list[str]:
    """Return the outputs that the scene file names and the caller does not; they must be in the file's folder."""
    alone = [name for name, file in given.items() if file is None and getattr(job.run, name) is not None]
    job.require_within(alone)
    return alone


def check_outputs(job: Job, options: RunOptions, alone: list[str], allow: str, named: dict[str, str]) -> None:
    """Raise a SceneError if an output cannot be written, or may not be replaced.

    An output that only the scene file names is never overwritten, since the option to overwrite is for outputs that the
    caller names.

    Args:
        job: the scene file.
        options: the options of the run.
        alone: the names of the outputs that only the scene file names.
        allow: for the sentence of the error, how to overwrite an output; {} is the output as the caller gives it.
        named: name of an output -> the argument of the caller for it; {} is its path.
    """
    paths.check_distinct({**options.files(), "recording": options.recording}, job.inputs())
    going_on = options.trajectory is not None and paths.checkpoint_of(options.trajectory).exists()
    begins = not options.resume or (options.overwrite and not going_on)
    for name in OUTPUTS:
        file: Path | None = getattr(options, name)
        if file is None:
            continue
        if not begins and name != "recording":
            paths.check_place(file, name)  # the session reads the existing file
        elif name in alone:
            marks.check_target(file, False, name, allow.format(named[name].format(str(file))))
        else:
            marks.check_target(file, options.overwrite, name)
