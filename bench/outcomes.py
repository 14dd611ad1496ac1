"""What a cell of the matrix of pairs does: it works, is refused, or does a third thing.

It works where its run shows the capability: the observable that tells of it is not 0, or the motion differs from that
of the run without it; where its books balance; where nothing is farther outside than the method allows; and, on a
cluster, where each bit is that of the same run in one process. It is refused where a `SceneError` says so before the
run. Everything else is a third outcome: another error, no end, a capability that is ignored, books that do not balance,
a particle outside, other bits.
"""

import contextlib
import functools
import logging
import math
import os
import tempfile
import warnings
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

import swarm
from swarm.surfaces.instant import side_of
from swarm.surfaces.presence.doors import is_there
from swarm.surfaces.presence.openings import are_open

from . import cells, shards
from .cells import Cell

# Books that balance to round-off: of the largest energy of a run.
ROUND_OFF = 1e-12
# Of the size of a scene, a place that is on a wall. Where the level of a wall is no distance it is one to first order.
OUTSIDE = 1e-12
# No cell takes a hundredth of it [s]: what is cut there has no end.
WALL_TIME = 300.0


class Outcome(NamedTuple):
    """What a cell does: "works", "refused" or "third", and what is said of it."""

    what: str
    said: str = ""


class Ran(NamedTuple):
    """A cell's run: what it was given, and its result, and how many impacts on walls its log has."""

    given: cells.Build
    result: swarm.Result
    rows: int


@contextlib.contextmanager
def quiet() -> Iterator[str]:
    """A folder for the files of a run, without the warnings of the run."""
    level = logging.getLogger("swarm").level
    logging.getLogger("swarm").setLevel(logging.CRITICAL)
    try:
        with warnings.catch_warnings(), tempfile.TemporaryDirectory() as folder:
            warnings.simplefilter("ignore")
            yield folder
    finally:
        logging.getLogger("swarm").setLevel(level)


def run(draft: cells.Draft, trajectory: str | None = None) -> Ran:
    """Carry out a run.

    Raises:
        SwarmError: it is refused, or fails.
    """
    with quiet() as folder:
        given = cells.build(draft)
        options = dict(given.options) | {"trajectory": trajectory, "walltime": WALL_TIME}
        if "impacts" in options:
            options["impacts"] = os.path.join(folder, options["impacts"])
        with contextlib.ExitStack() as stack:
            if "cluster" in options:
                # A kernel would be compiled, and kept on disk, with the sums of `of_single_particles`.
                assert options["compile"] == "never", options["compile"]
                options["trajectory"] = trajectory or os.path.join(folder, "run.h5")
                stack.enter_context(shards.here())
                stack.enter_context(shards.of_single_particles())
            result = swarm.simulate(given.scene, given.particles, given.method, **options)
        if "impacts" not in options:
            return Ran(given, result, 0)
        table = swarm.load_impacts(options["impacts"]).table()
        return Ran(given, result, int((table["surface"] >= 0).sum()))


@functools.lru_cache(maxsize=256)
def _without(cell: Cell) -> Any:
    """The end of the run of a cell without its capability, or None where that is refused."""
    try:
        return run(cells.draft_of(cell, with_capability=False)).result
    except swarm.SceneError:
        return None


def _alike(cell: Cell) -> Cell:
    """The first cell with the same run but for its capability. What a cluster changes `_other_bits` sees."""
    base = cells.CAPABILITIES[cell.capability].base
    first = next(name for name, one in cells.CAPABILITIES.items() if one.base == base)
    return Cell(cell.engine, "box" if cell.wall == cells.ON_A_CLUSTER else cell.wall, first)


def outcome(cell: Cell) -> Outcome:
    """Carry out the run of a cell and judge it."""
    try:
        done = run(cells.draft_of(cell))
    except swarm.SceneError as error:
        return Outcome("refused", str(error))
    except swarm.WallTimeError:
        return Outcome("third", f"no end within {WALL_TIME:g} s")
    except swarm.SwarmError as error:
        return Outcome("third", f"the run fails: {type(error).__name__}: {error}")
    except Exception as error:
        return Outcome("third", f"{type(error).__name__}: {error}")
    said = "; ".join(filter(None, (one(cell, done) for one in (_ignored, _unbalanced, _outside, _other_bits))))
    return Outcome("third", said) if said else Outcome("works")


# --- Is the capability there? ----------------------------------------------------------------------------


def _ignored(cell: Cell, done: Ran) -> str:
    capability, seen = cells.CAPABILITIES[cell.capability], done.result.observables
    # A wall with a mass has the velocity of a translation at the start, and nothing does work on it.
    shown = "" if "mass" in cells.ENGINES[cell.engine].laws and cell.capability == "translation" else capability.shown
    if shown and shown not in seen:
        return f"ignored: there is no observable {shown}"
    if shown and not np.any(seen[shown][1:]):
        return f"ignored: {shown} is 0"
    # A contact that lasts has its row at its end, and with a second wall at the same time it is one impact of two rows.
    lasting = len(done.result.particles) if cells.ENGINES[cell.engine].method is swarm.Penalty else 0
    if cell.capability == "log" and abs(done.rows - int(seen["impacts"][-1])) > lasting:
        return f"ignored: the log has {done.rows} of {int(seen['impacts'][-1])} impacts"
    if cell.capability == "member impacts" and seen["member_impacts"][-1].sum() != seen["impacts"][-1]:
        return f"members have {seen['member_impacts'][-1].sum()} of {int(seen['impacts'][-1])} impacts"
    # A particle that escaped has passed through the capability.
    if not seen["impacts"][-1] and not seen.get("collisions", [0])[-1] and shown != "escaped":
        return "ignored: there is no impact"
    if cell.capability in ("plain", "counters", "log", "member impacts", "cluster"):
        return ""
    # The capability is that of the other run too where the first surface of both is the same.
    if shown and capability.base is cells.nothing and cell.capability not in cells.STATIC:
        return ""
    without = _without(_alike(cell))
    return "" if without is None or _differs(done.result, without) else "ignored: the run is the same without it"


def _differs(one: swarm.Result, other: swarm.Result) -> bool:
    if len(one.particles) != len(other.particles):
        return True
    names = ("position", "velocity", "spin")
    pairs = [(getattr(one.particles, name), getattr(other.particles, name)) for name in names]
    return any((a is None) != (b is None) or (a is not None and not np.array_equal(a, b)) for a, b in pairs)


# --- Do the books balance? -------------------------------------------------------------------------------


def _unbalanced(cell: Cell, done: Ran) -> str:
    seen = done.result.observables
    names = [name for name, values in seen.items() if values.dtype.kind == "f" and name not in _MAY_BE_NAN]
    unknown = [name for name in names if not np.isfinite(seen[name]).all()]
    if unknown:
        return f"{', '.join(unknown)} are not finite"
    kept = seen["total_energy"] + seen["dissipated_energy"]
    for name in ("wall_heat", "wall_work", "source_energy", "work"):
        kept = kept - _total(seen, name)
    scale = np.abs(kept).max() + seen["kinetic_energy"].max() + np.abs(seen["potential_energy"]).max()
    scale += seen["dissipated_energy"].max() + sum(np.abs(_total(seen, n)).max() for n in ("wall_heat", "wall_work"))
    error = float(np.abs(kept - kept[0]).max() / scale)
    if error > _declared(cell, done):
        return f"the energy is off by {error:.2g}"
    if float(seen["energy_error"].max()) > _declared(cell, done):
        return f"energy_error is {seen['energy_error'].max():.2g}"
    return _miscounted(done)


_MAY_BE_NAN = {"pressure", "collision_rate"}


def _total(seen: Any, name: str) -> Any:
    values = seen.get(name)
    return np.zeros(len(seen["time"])) if values is None else values.reshape(len(values), -1).sum(axis=1)


def _declared(cell: Cell, done: Ran) -> float:
    """How far off the energy may be, as a part of it."""
    # Uzawa's loop in steps that are not cut at the wall has no limit: the method says so, and counts its contacts.
    if done.result.observables["unconverged"][-1] and not done.given.method.adaptive:
        return math.inf
    return ROUND_OFF


def _miscounted(done: Ran) -> str:
    seen, result = done.result.observables, done.result
    # Those of a body are of each of its points.
    points = 1 if result.bodies is None else len(result.bodies.body)
    escaped = int(np.isfinite(result.escape_time).sum()) // points
    if int(seen["escaped"][-1]) < escaped:
        return f"escaped is {seen['escaped'][-1]}, and {escaped} have a time of it"
    if "absorbed" in seen and int(seen["absorbed"][-1].sum()) != int(np.isfinite(result.absorbed_time).sum()) // points:
        return f"absorbed is {seen['absorbed'][-1].sum()}, and another number of particles have a time of it"
    sources = done.given.options.get("sources", ())
    if sources and int(seen["born"][-1].sum()) != sum(len(one.times) for one in sources):
        return f"born is {seen['born'][-1].sum()} of {sum(len(one.times) for one in sources)}"
    if int(result.impacts_per_particle.sum()) != points * int(seen["impacts"][-1]):
        return f"particles have {result.impacts_per_particle.sum()} of {int(seen['impacts'][-1])} impacts"
    return ""


# --- Is anything outside? --------------------------------------------------------------------------------


def _outside(cell: Cell, done: Ran) -> str:
    """A particle that is farther outside at the end than the method allows, by the walls as they are given."""
    result, scene = done.result, done.given.scene
    seen, until = result.observables, done.given.options["until"]
    inside = ~np.isfinite(result.escape_time)
    if scene.reacts():
        # What is absorbed stays where it was, whatever impacts have made of the wall since.
        inside &= ~np.isfinite(result.absorbed_time)
    position, radius = result.particles.position[:, inside], result.particles.radius
    if cell.engine == "bodies, Impact":
        there = inside.reshape(len(result.bodies.body), -1)[0]
        position = result.bodies.contact_points()[:, :, there].reshape(3, -1)
        # Some points of a body that is inside may have passed an opening.
        passed = are_open([one for surface in scene.pieces.volumes for one in surface], position, until)
        position = position[:, ~passed]
    if scene.reacts():
        scene = scene.placed(seen["wall_position"][-1], seen["wall_orientation"][-1])
    there = [k for k, one in enumerate(scene.surfaces) if is_there(one.present, until)]
    if (
        isinstance(done.given.method, swarm.Impact)
        or radius is not None
        or getattr(done.given.method, "adaptive", False)
    ):
        distances = scene.distances_outside(position, until, None if radius is None else radius[inside])
        deepest = float(seen["max_penetration"].max())
    else:
        # A spring is that of the gap, which need not be a distance.
        distances = np.array([side_of(one) * one.phi(position, until) for one in scene.surfaces])
        deepest = 0.0
    deepest = max(deepest, float(distances[there].max()) if there and position.size else 0.0)
    allowed = _allowed(done)
    return f"a particle is {deepest:.3g} outside, {allowed:.3g} are allowed" if deepest > allowed else ""


def _allowed(done: Ran) -> float:
    method, seen = done.given.method, done.result.observables
    if isinstance(method, swarm.Impact):
        return OUTSIDE
    # The energy of a spring is at most that of the particle, which meets as many springs as walls.
    energy = float((seen["kinetic_energy"] + seen["contact_energy"] + np.ptp(seen["potential_energy"])).max())
    energy += float(np.abs(_total(seen, "wall_work")).max())
    if isinstance(method, swarm.Penalty) or not method.adaptive:
        return math.sqrt(2.0 * energy / method.penalty)
    return OUTSIDE


# --- Has a run on a cluster the same bits? ---------------------------------------------------------------


def _other_bits(cell: Cell, done: Ran) -> str:
    """What of a run in shards is not as in one process."""
    if "cluster" not in done.given.options:
        return ""
    draft = cells.draft_of(cell)
    for name in shards.OPTIONS:
        draft.options.pop(name, None)
    with shards.of_single_particles():
        alone = run(draft).result
    other = shards.difference(done.result, alone)
    return f"on a cluster {other} differ" if other else ""
