"""Warnings before a run starts about properties that its user may not have meant: cavities, times, steps, gravity."""

import itertools
import logging
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...compiled_scene import CompiledScene
from ...kernel.limits import EPSILON
from ...methods import Impact
from ...scene import Scene
from ...surfaces.instant import are_there_together, box_of, gaps_of, side_of
from ...surfaces.presence.openings import least_distance
from ...surfaces.surface import LAWS, Surface, named
from ..options import Task
from . import softness, workload

_LOG = logging.getLogger("swarm")
# A run warns of a step, a contact and a round-off of times above these parts of the time between impacts.
_STEP, _CONTACT, _ROUND_OFF = 0.25, 0.5, 1e-4
# The time between impacts takes long to compute. It is needed only if a step, a contact or a round-off is longer than
# this fraction of its limit, with the time to cross the scene in place of the time between impacts.
_SURELY = 1e-2
# Explicit steps of a spring are stable up to this number over its angular frequency.
_STABLE = 2.0
# The number of particles in a sample.
_LOOKED_AT = 1000
# The points at which two cavities are compared. They cut one another if more than the part `_CUT` of each is outside of
# the other.
_POINTS, _CUT = 4096, 0.01
_IN_ONE_PLACE = (
    "%s and %s have faces in one place, with the same side: an impact there follows the "
    "laws of either; leave that face of one out (open = [...] of a box), or let one stand in front of the other"
)
_ONLY_TOUCH = (
    "%s and %s touch at a face but do not overlap: points that slide along one of them, "
    "or hit the edge of the face, may enter the gap of no width between them; let them overlap, as a post that goes on "
    "below its floor, or make one body of tiles in a row"
)


def give(task: Task) -> None:
    """Warn of properties of the run that its user may not have meant."""
    warn_of_overlap(task.scene)
    warn_of_walls_in_one_place(task.scene, task.bodies is not None or task.particles.radius is None)
    _warn_of_faces(task.scene)
    _warn_of_fall(task.compiled)
    _warn_of_counters(task)
    _warn_of_light(task)
    softness.warn_of_depths(task)
    if task.bodies is None and task.particles.radius is None and len(task.particles):
        # The speed of the fastest particle in a sample.
        some = task.particles.velocity[:, _some(len(task.particles))]
        fastest = float(np.sqrt(np.add.reduce(some**2).max()))
        # The speed after a fall through the scene.
        pull = math.hypot(*(task.scene.gravity or (0.0,)))
        speed = math.hypot(fastest, math.sqrt(2.0 * pull * task.scene.finite_size()))
        crossing = task.scene.finite_size() / speed if speed > 0.0 else math.inf
        if fastest == 0.0:
            _warn_of_rest(task)
        with np.errstate(all="ignore"):
            _warn_of_times(task, crossing)
            _warn_of_steps(task, speed, crossing)


def _some(count: int) -> slice:
    """Return the sample of `count` particles."""
    return slice(0, None, max(1, count // _LOOKED_AT))


def _takes_energy(compiled: CompiledScene) -> bool:
    """Whether impacts on walls, or of pairs, may take the energy that gravity gives."""
    pairs, laws = compiled.scene.pairs, compiled.laws
    walls_may = laws is not None and (compiled.scene.moves() or not laws.keep_speed())
    return (pairs is not None and pairs.restitution < 1.0) or walls_may


def _warn_of_fall(compiled: CompiledScene) -> None:
    """Warn if gravity pulls along a period, and nothing ends the fall."""
    scene = compiled.scene
    pulls = scene.gravity or (0.0, 0.0, 0.0)
    for k, (length, pull) in enumerate(zip(scene.period or (), pulls, strict=False)):
        if length is not None and pull and not _takes_energy(compiled):
            _LOG.warning(
                "gravity[%d] = %g m/s^2 pulls along period[%d] = %g m, and no impact takes energy: each cell gives "
                "%.3g J for a kg, and particles get faster without end; give walls a restitution, a friction or a "
                "temperature, or close that direction",
                k, pull, k, length, abs(pull) * length,
            )  # fmt: skip
            return


def _warn_of_faces(scene: Scene) -> None:
    """Warn if parts of a union with a common face at the start move differently: there is a wall between them."""
    for i, surface in enumerate(scene.surfaces):
        for one, other in surface.moving_apart() if len(surface.rooms) > 1 else ():
            _LOG.warning(
                "surfaces[%d] has parts with a face in common at the start that do not move as one, %.100r and %.100r: "
                "there is a wall between them while they only touch; let them overlap where they are to be one room",
                i, one, other,
            )  # fmt: skip


def _warn_of_counters(task: Task) -> None:
    """Warn if balls leave through an opening before their centres have come to a counter there."""
    scene, counters = task.scene, task.options.counters
    radii = [source.largest() for source in task.options.sources]
    radii += [] if task.particles.radius is None else [float(task.particles.radius.max(initial=0.0))]
    radius = max(radii, default=0.0)
    if radius == 0.0:
        return
    for i, surface in enumerate(scene.surfaces):
        for k, volume in enumerate(surface.open_volumes()):
            for j, counter in enumerate(counters):
                volumes = (volume,) if counter.inside is None else (volume, counter.inside)
                if least_distance(surface, volumes, counter.surface) < radius:
                    _LOG.warning(
                        "counters[%d] is nearer to surfaces[%d].openings[%d] than the largest radius, %g m: a ball "
                        "leaves as soon as the point of it that touches the wall is in the opening, before its centre "
                        "is at the counter, which misses it; take the observable 'escaped', or a counter that is "
                        "farther inside",
                        j, i, k, radius,
                    )  # fmt: skip
                    return


def _warn_of_light(task: Task) -> None:
    """Warn if a temperature in kelvin, or a speed in another unit, makes particles faster than light."""
    particles = task.particles
    heat = max((one.temperature or 0.0 for one in task.scene.surfaces), default=0.0)
    hot, fastest = math.sqrt(heat / float(particles.mass.min())) if len(particles) else 0.0, particles.fastest()
    if fastest > workload.LIGHT:
        _LOG.warning("a particle has %.2g m/s, %s", fastest, workload.BEYOND_LIGHT)
    elif hot > workload.LIGHT:
        _LOG.warning("a wall of the temperature %g J gives %.2g m/s, %s", heat, hot, workload.BEYOND_LIGHT)


def _warn_of_rest(task: Task) -> None:
    """Warn if no particle will move."""
    scene = task.scene
    is_moved = scene.gravity is not None or scene.moves() or scene.has_doors() or bool(task.options.sources)
    if not is_moved and task.particles.fastest() == 0.0:
        _LOG.warning(
            "all %d particles are at rest, and nothing pulls or pushes them: nothing will move; give them a speed or a "
            "temperature, or the scene gravity",
            len(task.particles),
        )  # fmt: skip


def _warn_of_times(task: Task, crossing: float) -> None:
    """Warn if a run is so long that float64 does not resolve the times of its last impacts."""
    scene, until = task.scene, task.options.until
    every = task.options.times.every
    assert every is not None
    kept = float(np.spacing(until))
    if scene.moves() or kept < _SURELY * _ROUND_OFF * crossing:
        return
    between = workload.time_between(task.compiled, task.particles)
    if kept > _ROUND_OFF * between:
        # Times within a frame are counted from its end.
        inside = float(np.spacing(every)) > _ROUND_OFF * between
        flights = "flights too, in frames this long" if inside else "flights are not: each frame counts from its end"
        _LOG.warning(
            "the time between impacts is about T = %.2g s; until = %g s is kept to %.1e s, %.1e of it: the instants of "
            "a log of impacts, of doors, births, escapes and absorptions are that coarse (%s); use until <= %.1g s, or "
            "begin another run from the last frame",
            between, until, kept, kept / between, flights, _ROUND_OFF * between / EPSILON,
        )  # fmt: skip


def _warn_of_steps(task: Task, speed: float, crossing: float) -> None:
    """Warn if a step, or a contact with a soft wall, is a large part of the time between impacts."""
    scene, particles, method = task.scene, task.particles, task.method
    name = "contact_step" if isinstance(method, Impact) else "dt"
    step, law = getattr(method, name, None), method.law()
    if not step or scene.moves():
        return
    contact, depth = (0.0, 0.0) if law is None or method.is_rigid() else _contact(task, speed)
    if max(step / _STEP, contact / _CONTACT) < _SURELY * crossing:
        return
    between = workload.time_between(task.compiled, particles)
    period = f"the time between impacts is about T = {between:.2g} s; "
    if step > _STEP * between:
        _LOG.warning(
            "%s%s = %g s is %.2g of it: steps are as long as flights, and impacts come late or not at all; use %s <= "
            "%.1g s, or Impact() alone",
            period, name, step, step / between, name, 0.1 * _STEP * between,
        )  # fmt: skip
    elif contact > _CONTACT * between and not method.has_multipliers():
        _LOG.warning(
            "%sa contact lasts %.2g s, %.2g of it, and the fastest particle sinks %.2g m into its wall, which is "
            "too soft to be one; use a larger penalty (%g here), or Impact",
            period, contact, contact / between, depth, method.penalty,  # type: ignore[attr-defined]
        )  # fmt: skip
    if method.is_explicit() and step * math.pi > _STABLE * contact:
        _LOG.warning(
            "%sdt = %g s is %.2g of a contact, which lasts %.2g s: beyond %.2g of it Verlet is unstable, its energy "
            "grows; use dt <= %.1g s, or Penalty, which keeps the energy at any step",
            period, step, step / contact, contact, _STABLE / math.pi, 0.1 * contact,
        )  # fmt: skip


def _contact(task: Task, speed: float) -> tuple[float, float]:
    """Return the duration of the shortest contact with a soft wall [s], and the depth of the fastest particle [m].

    The gap g obeys m g'' = -alpha s^2 g^a, with the slope s of phi: see `_contact_time` of grains.
    """
    scene, particles, method = task.scene, task.particles, task.method
    mass, p = particles.mass[_some(len(particles))].min(), 1.0 / (method.exponent + 1.0)  # type: ignore[attr-defined]
    if speed == 0.0:
        return 0.0, 0.0
    some = particles.position[:, _some(len(particles))]
    slopes = [np.sqrt((one.gradient(some) ** 2).sum(axis=0)) for one in scene.surfaces]
    nearest = np.argmax(scene.gaps(some), axis=0)
    slope = float(np.median(np.array(slopes)[nearest, np.arange(some.shape[1])]))
    if not 0.0 < slope < math.inf:
        return 0.0, 0.0
    depth = float(softness.depths_of(method, mass, speed)) / slope
    return 2.0 * math.sqrt(math.pi) * math.gamma(1.0 + p) / math.gamma(0.5 + p) * depth / speed, depth


def warn_of_overlap(scene: Scene) -> None:
    """Warn of the first two bounded cavities that overlap only in part."""
    boxes = np.array([box_of(one, 0.0) for one in scene.surfaces]).reshape(-1, 2, 3)
    if (across := scene.across()) is not None:
        boxes[:, :, across] = 0.0
    cavities = [(i, one) for i, one in enumerate(scene.surfaces) if not one.is_solid() and side_of(one) > 0.0]
    bounded = [(i, one) for i, one in cavities if np.isfinite(boxes[i]).all()]
    for (i, one), (j, other) in itertools.combinations(bounded, 2):
        if are_there_together(one, other) and _cut_one_another(one, other, boxes[[i, j]]):
            _LOG.warning(
                "surfaces[%d] (%s) and surfaces[%d] (%s) overlap only in part: particles stay in their common "
                'part; a vessel of both is one surface, swarm.Union([...]), in a scene file kind = "union"',
                i, type(one).__name__, j, type(other).__name__,
            )  # fmt: skip
            return


def warn_of_walls_in_one_place(scene: Scene, of_points: bool) -> None:
    """Warn of the first two flat faces in one place with different laws, or with a gap of no width between them.

    Args:
        scene: the scene.
        of_points: whether points meet its walls. Balls do not fit into a gap of no width.
    """
    if len(scene.surfaces) < 2 and not any(one.body_count() for one in scene.surfaces):
        return
    from ...surfaces.presence import flush  # loaded where there are two walls

    bodies = flush.first_bodies(scene.surfaces)
    surfaces, size, across = [one.body for one in bodies], scene.extent() or 1.0, scene.across()

    def matters(one: Surface, other: Surface, are_back_to_back: bool) -> bool:
        return of_points and (one.is_solid() or other.is_solid()) if are_back_to_back else _differ(one, other)

    # The bodies that reach into the surface on which they stand.
    reaching = [k for k, one in enumerate(bodies) if flush.may_reach(one, scene.surfaces)] if of_points else []
    closed = {(reaching[i], face) for i, face in flush.flush_faces([surfaces[k] for k in reaching])}
    for pair in flush.pairs_in_one_place(surfaces, size, matters):
        ends = list(zip(pair.surfaces, pair.faces, strict=True))
        plane = flush.face_of(surfaces[pair.surfaces[0]], pair.faces[0]).plane
        # No particle meets the lids of boxes in a scene of two dimensions.
        is_lid = across is not None and plane is not None and abs(plane[0][across]) > 0.5
        if not is_lid and not any(end in closed for end in ends):
            words = _ONLY_TOUCH if pair.are_back_to_back else _IN_ONE_PLACE
            _LOG.warning(words, *(_named(scene.surfaces, *bodies[k][:2]) for k in pair.surfaces))
            return


def _named(surfaces: Sequence[Surface], number: int, row: int | None) -> str:
    whole = named(number, surfaces[number])
    return whole if row is None else f"body {row} of {whole}"


def _differ(one: Surface, other: Surface) -> bool:
    """Whether impacts on two surfaces differ."""
    return any(getattr(one, name, None) != getattr(other, name, None) for name in (*LAWS, "mass", "inertia"))


def _cut_one_another(one: Surface, other: Surface, boxes: NDArray[np.float64]) -> bool:
    """Whether a part of each of two cavities, with these bounds, is outside of the other one at 0 s."""
    low, high = boxes[:, 0].min(axis=0)[:, None], boxes[:, 1].max(axis=0)[:, None]
    points = low + (high - low) * np.random.default_rng(0).random((3, _POINTS))
    with np.errstate(all="ignore"):
        inside, inside_other = (gaps_of((surface,), points, 0.0)[0] <= 0.0 for surface in (one, other))
    mine, theirs = int((inside & ~inside_other).sum()), int((inside_other & ~inside).sum())
    return bool(mine > _CUT * inside.sum() and theirs > _CUT * inside_other.sum())
