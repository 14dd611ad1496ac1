"""All births of a run, drawn before it from its seed: each source has its own streams."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import motion as motions
from ..common import checks
from ..errors import SceneError
from ..particles import Births, Particles
from ..scene import Scene
from ..state import Floats
from ..surfaces.area_samples import Random
from ..surfaces.instant import distances, side_of
from ..surfaces.plane import along
from ..surfaces.surface import named
from .places import PointBatches, SourcePlace, changes, place_of
from .source import Source

# The streams of a source.
_TIMES, PLACES, VELOCITIES, _SIZES, _SPINS = range(5)
# Bytes of a particle in a run, without its frames.
_PARTICLE = 500
# Memory is required for the expected number of births plus this number of standard deviations.
_SIGMAS = 6.0
# A birth outside of a moving wall by up to this part of the scene's extent counts as inside.
_OUTSIDE = 1e-9
# A birth within this number of roundings before the stop is at the stop.
_ROUND_OFF = 4.0
# The numbers of a Poisson process that are drawn at a time.
_BATCH = 4096


def with_births(
    scene: Scene,
    particles: Particles | None,
    sources: tuple[Source, ...],
    seed: int,
    until: float,
    times_taken: Callable[[Floats], Floats] = lambda times: times,
) -> Particles:
    """Return the particles of a run with sources: those of the start, then those that come, in order of time.

    `times_taken` returns the times at which a method starts particles that are born at given times.

    Raises:
        SceneError: a source does not fit the scene, too many particles come, or the run has no particles at all.
    """
    if particles is not None and not sources:
        return particles
    given = 0 if particles is None else len(particles)
    _require_room(sources, given, until)
    sources = tuple(_as_at_the_start(one, f"sources[{k}]", particles) for k, one in enumerate(sources))
    has_radius = sources[0].radius is not None if particles is None else particles.radius is not None
    for k, one in enumerate(sources):
        if (one.radius is not None) != has_radius:
            must, got = ("must be given", "have a radius") if has_radius else ("must be left out", "have none")
            raise SceneError(
                f"sources[{k}].radius {must} where the other particles of the run {got}, got {one.radius}: balls and "
                "points do not meet"
            )
        one.require_points(f"sources[{k}]")
    drawn = [_drawn(scene, one, f"sources[{k}]", k, seed, until, times_taken) for k, one in enumerate(sources)]
    times = np.concatenate([time for time, _r, _v in drawn])
    if not len(times) + given:
        raise SceneError(
            f"sources must give at least one particle where the start has no particles, got none until {until:g} s; "
            "give a higher rate, or a later until"
        )
    order = np.argsort(times, kind="stable")
    number = np.repeat(np.arange(len(sources), dtype=np.int32), [len(time) for time, _r, _v in drawn])[order]
    position, velocity = (np.concatenate([one[k] for one in drawn], axis=1)[:, order] for k in (1, 2))
    mass = np.array([one.mass or math.nan for one in sources])[number]
    radius, spin = _sizes(scene, sources, number, seed) if has_radius else (None, None)
    if radius is not None:
        density = np.array([one.density or math.nan for one in sources])[number]
        volume = math.pi * radius**2 if scene.plane else 4.0 / 3.0 * math.pi * radius**3
        mass = np.where(np.isnan(mass), density * volume, mass)
    image = None if scene.period is None else np.zeros((3, len(times)), np.int64)
    if particles is not None:
        position = np.concatenate([particles.position, position], axis=1)
        velocity = np.concatenate([particles.velocity, velocity], axis=1)
        mass = np.concatenate([particles.mass, mass])
        if radius is not None and particles.radius is not None:
            radius = np.concatenate([particles.radius, radius])
            before_spin = particles.spin
            if spin is not None or before_spin is not None:
                rows = [np.zeros((3, given)) if before_spin is None else before_spin]
                rows.append(np.zeros((3, len(times))) if spin is None else spin)
                spin = np.concatenate(rows, axis=1)
        if image is not None:
            before = np.zeros((3, given), np.int64) if particles.image is None else particles.image
            image = np.concatenate([before, image], axis=1)
    made = Particles(position, velocity, mass, image, radius, spin)
    made.volume = None if particles is None or radius is None else particles.volume
    number = np.append(np.full(given, -1, np.int32), number).astype(np.int32)
    made.births = Births(
        np.append(np.zeros(given), times[order]), number, len(sources), sources if has_radius else ()
    )  # fmt: skip
    return made


def _as_at_the_start(source: Source, name: str, particles: Particles | None) -> Source:
    """Return the source without missing arguments: balls have the radius and mass of those of the start, or 1 kg."""
    given: dict[str, Any] = {}
    if particles is not None and particles.radius is not None and source.radius is None:
        given["radius"] = _common(particles.radius, f"{name}.radius", "have radii", "m")
        if source.mass is None and source.density is None:
            given["mass"] = _common(particles.mass, f"{name}.mass", "have masses", "kg")
    elif source.mass is None and source.density is None:
        given["mass"] = 1.0
    return replace(source, **given)


def _common(values: Floats, name: str, have: str, unit: str) -> float:
    """Return the value that all particles of the start have."""
    low, high = float(values.min()), float(values.max())
    if low != high:
        raise SceneError(
            f"{name} must be given where the particles of the start {have} from {low:g} to {high:g} {unit}, got None"
        )
    return low


def _sizes(
    scene: Scene, sources: tuple[Source, ...], number: NDArray[np.int32], seed: int
) -> tuple[Floats, Floats | None]:
    """Return the radii (n,) and the spins (3, n), None if all are 0, of balls of sources with these numbers."""
    radius, spin = np.zeros(len(number)), np.zeros((3, len(number)))
    for k, one in enumerate(sources):
        own = np.flatnonzero(number == k)
        low, high = np.broadcast_to(np.array(one.radius, np.float64), 2)
        radius[own] = low + (high - low) * stream(seed, k, _SIZES).random(len(own))
        if isinstance(one.spin, tuple):
            spin[:, own] = np.array(one.spin)[:, None]
        elif one.spin > 0.0:
            axis = stream(seed, k, _SPINS).standard_normal((len(own), 3)).T
            if (across := scene.across()) is not None:
                axis[along(across), :] = 0.0
            spin[:, own] = one.spin * axis / np.sqrt((axis**2).sum(axis=0))
    return radius, spin if any(one.spin != 0.0 for one in sources) else None


def _require_room(sources: tuple[Source, ...], given: int, until: float) -> None:
    """Raise a `SceneError` if more particles come than fit in the memory of this machine."""
    most = float(given)
    for k, one in enumerate(sources):
        come, at_most = _most(one, until)
        most += at_most
        checks.require_memory(
            f"sources[{k}]", f" with all particles that come until {until:g} s, got {come:.6g}, which take",
            _PARTICLE * at_most,
        )  # fmt: skip
    checks.require_memory("sources", f" with all particles of the run, got {most:.6g}, which take", _PARTICLE * most)


def _most(source: Source, until: float) -> tuple[float, float]:
    """Return the expected number of births of a source, and the number for which memory is required."""
    if source.rate is None:
        number = float(source.count or 0) if source.times is None else float(len(source.times))
        return number, number
    mean = source.rate * max(0.0, _end(source, until) - source.start)
    most = mean + (0.0 if source.even else _SIGMAS * math.sqrt(mean))
    limit = math.inf if source.count is None else float(source.count)
    return min(mean, limit), min(most, limit)


def _end(source: Source, until: float) -> float:
    return until if source.stop is None else min(until, source.stop)


def stream(seed: int, k: int, *what: int) -> Random:
    """Return the random numbers of source k for one purpose."""
    return np.random.Generator(np.random.Philox(np.random.SeedSequence(seed, spawn_key=(k, *what))))


def _drawn(
    scene: Scene, source: Source, name: str, k: int, seed: int, until: float, times_taken: Callable[[Floats], Floats]
) -> tuple[Floats, Floats, Floats]:
    """Return times (n,), positions and velocities (3, n) of the births of a source."""
    times = times_of(source, stream(seed, k, _TIMES), until)
    if source.radius is not None:
        # The places of balls are known at their births: see ball_places.py.
        return times, *np.zeros((2, 3, len(times)))
    times = times_taken(times)
    place = place_of(scene, source, name)
    points, across = PointBatches(scene, place, name), scene.across()
    require_in_plane(scene, source, name)
    # A source without births is checked too.
    position, normals = points.draw(stream(seed, k, PLACES), max(1, len(times)))
    position, normals = position[:, : len(times)], normals[:, : len(times)]
    velocity = velocities_at(place, source, name, stream(seed, k, VELOCITIES), (position, normals), across)
    _require_free(scene, name, times, position)
    return times, position, velocity


def require_in_plane(scene: Scene, source: Source, name: str) -> None:
    """Raise a `SceneError` for a beam that leads out of the plane of a scene."""
    across = scene.across()
    if across is not None and source.beam is not None and source.beam[across] != 0.0:
        raise SceneError(
            f'{name}.beam[{across}] must be 0 where plane = "{scene.plane}", got {source.beam[across]:g} m/s: it would '
            "lead out of the plane"
        )


def _require_beam(source: Source, name: str, position: Floats, normals: Floats) -> None:
    """Raise a `SceneError` for a beam that leads out of the vessel from a surface with these normals."""
    if source.beam is None:
        return
    inwards = -(np.array(source.beam)[:, None] * normals).sum(axis=0)
    if not (inwards > 0.0).all():
        i = int(np.argmin(inwards > 0.0))
        raise SceneError(
            f"{name}.beam must lead from its surface to the admissible side, got {source.beam} at "
            f"{tuple(position[:, i].tolist())}, where the normal out of that side is "
            f"{tuple(normals[:, i].round(6).tolist())}; turn it, or give within= for a part of the surface"
        )


def times_of(source: Source, random: Random, until: float) -> Floats:
    """Return the times of the births of a source in a run, in order [s]: all up to and including its end.

    A longer run has the same first times: a frame has the births up to its time, whenever the run ends.
    """
    if source.times is not None:
        times = np.array(source.times)
    elif source.rate is None:
        assert source.stop is not None
        times = source.start + (source.stop - source.start) * np.sort(random.random(source.count or 0))
        times = np.minimum(times, max(source.start, float(np.nextafter(source.stop, -math.inf))))
    elif source.even:
        number = math.floor(max(0.0, _end(source, until) - source.start) * source.rate) + 2
        times = source.start + np.arange(min(number, _evenly_before_stop(source))) / source.rate
    else:
        parts, last = [np.empty(0)], source.start
        while last <= _end(source, until):
            parts.append(last + np.cumsum(random.standard_exponential(_BATCH)) / source.rate)
            last = float(parts[-1][-1])
        times = np.concatenate(parts)
        times = times if source.stop is None else times[times < source.stop]
    times = times[times <= until]
    return np.asarray(times if source.count is None else times[: source.count])


def _evenly_before_stop(source: Source) -> float:
    """Return the number of evenly spaced births before the stop, without one that is at the stop to round-off."""
    if source.stop is None:
        return math.inf
    rate = source.rate or 0.0
    slack = _ROUND_OFF * float(np.spacing(source.stop)) * rate
    return max(0.0, math.ceil((source.stop - source.start) * rate - slack))


def _require_free(scene: Scene, name: str, times: Floats, position: Floats) -> None:
    """Raise a `SceneError` if a wall that moves, or comes and goes, is at the place of a birth."""
    for i, surface in enumerate(scene.surfaces):
        if not changes(surface):
            continue
        depths = _outside_then(scene, i, times, position)
        if not (depths <= _OUTSIDE * scene.extent()).all():
            k = int(np.argmax(np.where(np.isnan(depths), np.inf, depths)))
            raise SceneError(
                f"{name} must be free when particles come, got a birth at {times[k]:g} s at "
                f"{tuple(position[:, k].tolist())}, {depths[k]:.3g} m inside {named(i, surface)} "
                "at this time; move the source, or give a start and a stop between which it is free"
            )


def _outside_then(scene: Scene, i: int, times: Floats, position: Floats) -> Floats:
    """Return the distance of each place outside of the admissible side of surface i at its own time [m]."""
    surface = scene.surfaces[i]
    if surface.motion is not None and scene.period is None:
        # In the frame in which the surface rests.
        rows = [motions.pose(surface.motion, t).given(position[:, [k]]) for k, t in enumerate(times.tolist())]
        depths = side_of(surface) * distances(surface.at_rest(), np.concatenate([position[:, :0], *rows], 1))
        return np.where([surface.is_there(t) for t in times.tolist()], depths, -np.inf)
    depths = np.empty(len(times))
    # Between instants surfaces at rest do not change.
    groups = np.searchsorted(scene.instants, times, side="right") if not scene.moves() else np.arange(len(times))
    for group in np.unique(groups):
        some = np.flatnonzero(groups == group)
        depths[some] = scene.distances_outside(position[:, some], float(times[some[0]]))[i]
    return depths


def velocities_at(
    place: SourcePlace, source: Source, name: str, random: Random, points: tuple[Floats, Floats], across: int | None
) -> Floats:
    """Return velocities (3, n) of births at points of a place with their normals; put both into the plane."""
    position, normals = points
    if place.volume:
        velocity = _from_volume(source, random, position.shape[1], across)
    else:
        _require_beam(source, name, position, normals)
        velocity = _from_surface(source, random, normals, across)
    if across is not None:
        position[across] = velocity[across] = 0.0
    return velocity


def _from_volume(source: Source, random: Random, n: int, across: int | None) -> Floats:
    """Return velocities (3, n) of particles that are born in a volume."""
    if source.beam is not None:
        return _beam(source, random, n, across)
    normal = np.ascontiguousarray(random.standard_normal((n, 3)).T)
    if across is not None:
        normal[across] = 0.0
    if source.temperature is not None:
        return np.asarray(_thermal(source) * normal)
    return np.asarray((source.speed or 0.0) * normal / np.sqrt((normal**2).sum(axis=0)))


def _from_surface(source: Source, random: Random, normals: Floats, across: int | None) -> Floats:
    """Return velocities (3, n) of particles that come from a surface, against these unit normals."""
    n = normals.shape[1]
    if source.beam is not None:
        return _into(source, random, normals, across)
    first, second = _tangents(normals, across)
    if source.temperature is not None:
        # The normal speed of particles that pass a plane in a gas at rest: w exp(-w^2/2).
        away = np.sqrt(2.0 * random.standard_exponential(n))
        u, w = random.spawn(1)[0].standard_normal((n, 2)).T
        return np.asarray(_thermal(source) * (u * first + w * second - away * normals))
    if across is not None:
        sine = 2.0 * random.random(n) - 1.0
        direction = sine * first
    else:
        part, turn = random.random((n, 2)).T
        sine, angle = np.sqrt(part), 2.0 * math.pi * turn
        direction = sine * (np.cos(angle) * first + np.sin(angle) * second)
    return np.asarray((source.speed or 0.0) * (direction - np.sqrt(1.0 - sine * sine) * normals))


def _thermal(source: Source) -> float:
    """Return sqrt(k_B T/m) of the gas that comes [m/s]."""
    assert source.temperature is not None
    assert source.mass is not None
    return math.sqrt(source.temperature / source.mass)


def _tangents(normals: Floats, across: int | None) -> tuple[Floats, Floats]:
    """Return unit vectors along surfaces with these normals; in a plane one, and 0."""
    if across is not None:
        i, j = along(across)
        first = np.zeros_like(normals)
        first[i], first[j] = -normals[j], normals[i]
        return first / np.sqrt((first**2).sum(axis=0)), np.zeros_like(normals)
    least = np.abs(normals).argmin(axis=0)
    first = np.cross(normals, np.eye(3)[least].T, axis=0)
    first /= np.sqrt((first**2).sum(axis=0))
    return first, np.cross(normals, first, axis=0)


def _beam(source: Source, random: Random, n: int, across: int | None) -> Floats:
    """Return velocities with directions uniform in a cone about the beam."""
    beam = np.array(source.beam)[:, None]
    if source.divergence == 0.0:
        return np.broadcast_to(beam, (3, n)).copy()
    speed = float(np.sqrt((beam**2).sum()))
    axes = np.broadcast_to(-beam / speed, (3, n))
    first, second = _tangents(axes, across)
    if across is not None:
        angle = source.divergence * (2.0 * random.random(n) - 1.0)
        return np.asarray(speed * (np.sin(angle) * first - np.cos(angle) * axes))
    part, turn = random.random((n, 2)).T
    cosine = 1.0 - (1.0 - math.cos(source.divergence)) * part
    sine, angle = np.sqrt(np.maximum(1.0 - cosine * cosine, 0.0)), 2.0 * math.pi * turn
    return np.asarray(speed * (sine * (np.cos(angle) * first + np.sin(angle) * second) - cosine * axes))


def _into(source: Source, random: Random, normals: Floats, across: int | None) -> Floats:
    """Return velocities of a beam that are not into the wall, as the axis of the beam is not."""
    n = normals.shape[1]
    velocity = _beam(source, random, n, across)
    while source.divergence > 0.0:
        wrong = np.flatnonzero((velocity * normals).sum(axis=0) >= 0.0)
        if not wrong.size:
            break
        # Each try has a stream with a row for every birth, so that no birth takes the numbers of another.
        velocity[:, wrong] = _beam(source, random.spawn(1)[0], n, across)[:, wrong]
    return velocity
