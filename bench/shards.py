"""A run on a cluster with shards that are carried out here, one after the other: the same files, and no scheduler."""

import contextlib
import dataclasses
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np

import swarm
from swarm import observables
from swarm.bodies import body_run
from swarm.common.catalog import Observables
from swarm.events import walls_run
from swarm.fleet import jobs, joined, sharded_run, shards
from swarm.run.measures import Measures
from swarm.run.options import Task

# What a run of a few particles needs to have two shards, each of whole chunks.
OPTIONS: dict[str, Any] = {"cluster": "local:1", "shards": 2}
_CHUNK, _SAVED = 1, 60.0
# Arrays of a result.
_ARRAYS = ("impacts_per_particle", "escape_time", "absorbed_time", "birth_time", "collisions_per_particle")
_OF_PARTICLES = ("position", "velocity", "mass", "radius", "spin", "image")


def carry_out(task: Task, session: sharded_run.Sharded) -> swarm.Result:
    """Carry out a run that is checked, as `sharded_run.carry_out`.

    Raises:
        RunError: a shard failed.
    """
    target = Path(task.options.trajectory).absolute()
    task = dataclasses.replace(task, options=dataclasses.replace(task.options, trajectory=target, checkpoint=_SAVED))
    with session:
        session.prepare_shards(task)
        folder, bounds = session.begin(task, sharded_run.shards_of(task, 1))
        for k in range(len(bounds) - 1):
            outcome = jobs.carried_out(sharded_run.run_shard, (folder, k))
            if outcome["state"] != "done":
                raise swarm.RunError(f"shard {k} {outcome['state']}: {outcome.get('error')}")
        measures = Measures(task.options.observables, task.options.until)
        seen = joined.join(folder, task, bounds, session.identity, measures)
        end = shards.joined_end(folder, task, bounds)
        session.finish()
    return dataclasses.replace(end, observables=Observables(seen), wall_time=session.wall_time())


@contextlib.contextmanager
def here() -> Iterator[None]:
    """Within it runs on a cluster are carried out here."""
    with mock.patch.object(sharded_run, "carry_out", carry_out):
        yield


@contextlib.contextmanager
def of_single_particles() -> Iterator[None]:
    """Within it shards may begin at every particle, and sums over the particles of a run in plain Python are of one."""
    # A module that is imported for the first time within would keep the patched constant.
    assert {body_run.__name__, walls_run.__name__} <= sys.modules.keys()
    known = [one for name, one in sys.modules.items() if name.startswith("swarm.") and hasattr(one, "CHUNK")]
    with contextlib.ExitStack() as stack:
        for module in known:
            assert module.CHUNK == observables.CHUNK, module.__name__
        for module in known:
            stack.enter_context(mock.patch.object(module, "CHUNK", _CHUNK))
        yield


def difference(one: swarm.Result, other: swarm.Result) -> str:
    """What of two results has not the same type, shape and bits, or ""."""
    pairs = {name: (one.observables.get(name), other.observables.get(name)) for name in one.observables}
    pairs |= {name: (None, values) for name, values in other.observables.items() if name not in pairs}
    pairs |= {name: (getattr(one, name), getattr(other, name)) for name in _ARRAYS}
    pairs |= {name: (getattr(one.particles, name), getattr(other.particles, name)) for name in _OF_PARTICLES}
    return ", ".join(name for name, (a, b) in pairs.items() if not same(a, b))


def same(one: Any, other: Any) -> bool:
    """Whether both are None, or arrays of the same type, shape and bits."""
    if one is None or other is None:
        return one is other
    one, other = np.asarray(one), np.asarray(other)
    return bool(one.dtype == other.dtype and one.shape == other.shape and one.tobytes() == other.tobytes())
