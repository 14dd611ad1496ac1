"""An estimate of the impacts of a run, from the flights of a few particles, in plain Python."""

import logging
import math
from collections import Counter
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...compiled_scene import CompiledScene
from ...errors import SceneError
from ...kernel.gravity import Gravity
from ...kernel.vector import vec
from ...methods.base import Method
from ...particles import Particles
from ...surfaces.surface import named
from ...surfaces.time_of_impact import flights

_LOG = logging.getLogger("swarm")
# At some 10 ns an impact, the first number takes minutes in one frame, and the second one days of a processor.
_MOST_A_FRAME, _MANY = 1e10, 1e13
# The particles with computed flights, of which the median counts, and the most parts of a fall before its hit.
_PARTICLES, _PARTS = 4, 8
# The chords of a walk through the volume, and the number of the last chords that count.
_CHORDS, _COUNTED = 60, 30

# The speed of light [m/s], and the text on a higher speed, which only a wrong unit can give, with k_B T at 300 K.
LIGHT = 299_792_458.0
BEYOND_LIGHT = (
    "which is above the speed of light: speeds are in m/s, masses in kg, and a temperature is k_B T in J, at 300 K "
    f"{300.0 * 1.380649e-23:.3g} J"
)


class Flights(NamedTuple):
    """The typical time from impact to impact [s], and the wall that is hit most often."""

    between: float
    wall: int


def require_few_impacts(
    compiled: CompiledScene, particles: Particles, method: Method, until: float, every: float
) -> None:
    """Raise a `SceneError` if a particle would have too many impacts in a frame; warn of a long run."""
    impact = method.time_of_impact()
    # If energy is lost, or given by heat or work, the first flights say nothing about later flights.
    if impact is None or compiled.laws is not None:
        return
    # Flights of at least this time [s] give few impacts.
    enough = max(every / _MOST_A_FRAME, len(particles) * until / _MANY)
    with np.errstate(all="ignore"):
        if _are_long(compiled, particles, impact, enough):
            return
        found = _of_particles(compiled, particles, impact)
        if found.between >= enough:
            return
        # Particles may start in a narrow corner and leave it. The volume around it then decides.
        found = max(found, _of_volume(compiled, particles, impact))
    if every > _MOST_A_FRAME * found.between:
        i, fastest = int(compiled.numbering.members[0, found.wall]), particles.fastest()
        raise SceneError(
            f"a particle must take at most {_MOST_A_FRAME:g} impacts a frame, got about {every / found.between:.2g}: "
            f"at its speed it flies {found.between:.2g} s from impact to impact, mostly at "
            f"{named(i, compiled.scene.surfaces[i])}, and a frame lasts {every:g} s; make that surface wider, "
            f"the particles slower, or every at most {_MOST_A_FRAME * found.between:.2g} s"
            + (f"; the fastest has {fastest:.2g} m/s, {BEYOND_LIGHT}" if fastest > LIGHT else "")
        )
    impacts = len(particles) * (until / found.between)
    if impacts > _MANY:
        _LOG.warning(
            "the run will take about %.1e impacts, %.1e of each particle, which flies %.1e s from impact to impact",
            impacts, until / found.between, found.between,
        )  # fmt: skip


def time_between(compiled: CompiledScene, particles: Particles) -> float:
    """Return the typical time of a flight from impact to impact at the start [s]."""
    with np.errstate(all="ignore"):
        return _of_particles(compiled, particles, 0.0).between


def _are_long(compiled: CompiledScene, particles: Particles, impact: float, enough: float) -> bool:
    """Whether half of the particles, and so their median, need at least `enough` seconds to the first hit."""
    walls, pull, chosen, long = compiled.walls(), compiled.scene.pull(), _chosen(particles), 0
    for i in chosen:
        until, _wall = _hit(walls, pull, particles.position[:, i], particles.velocity[:, i])
        long += until > 0.0 and impact + until >= enough
        if 2 * long >= len(chosen):
            return True
    return False


def _of_particles(compiled: CompiledScene, particles: Particles, impact: float) -> Flights:
    """Return the `Flights` of some particles at the start, each from the impact before to the impact after."""
    walls, pull, seen = compiled.walls(), compiled.scene.pull(), []
    for i in _chosen(particles):
        position, velocity = particles.position[:, i], particles.velocity[:, i]
        until, wall = _hit(walls, pull, position, velocity)
        since, _wall = _hit(walls, pull, position, -velocity)
        # The time is 0 for a particle that rests, or slides along its wall.
        if since + until > 0.0:
            seen.append(Flights(impact + since + until, wall))
    return _typical(seen)


def _of_volume(compiled: CompiledScene, particles: Particles, impact: float) -> Flights:
    """Return the `Flights` along chords of the volume around some particles, by a random walk from chord to chord.

    Between two chords the walk moves along the wall, which leads out of a narrow corner, but not out of a narrow slit.
    """
    walls, random, seen = compiled.walls(), np.random.default_rng(0), []
    axes, pull = compiled.scene.axes(), math.hypot(*(compiled.scene.gravity or (0.0,)))
    for i in _chosen(particles):
        point, velocity = particles.position[:, i], particles.velocity[:, i]
        for k in range(_CHORDS):
            way = np.zeros(3)
            way[axes] = random.standard_normal(len(axes))
            way = way / math.sqrt(way @ way)
            length, ahead, wall = _chord(walls, point, way)
            if not length < math.inf:
                return Flights(math.inf, -1)
            normal = np.array(walls.unit_normal(float(wall), vec(point + ahead * way)))
            point = point + (ahead - length * random.random()) * way
            speed = math.sqrt(velocity @ velocity + pull * length)
            if k >= _CHORDS - _COUNTED and length > 0.0 and speed > 0.0:
                seen.append(Flights(impact + length / speed, wall))
            way = way - (way @ normal) * normal
            length, ahead, _wall = _chord(walls, point, way)
            if length < math.inf:
                point = point + (ahead - length * random.random()) * way
    return _typical(seen)


def _chord(walls: Any, point: NDArray[np.float64], way: NDArray[np.float64]) -> tuple[float, float, int]:
    """Return the length of the chord through a point in units of `way`, the part ahead, and the wall at its end."""
    (ahead, wall), (behind, _wall) = _hit(walls, None, point, way), _hit(walls, None, point, -way)
    return ahead + behind, ahead, wall


def _chosen(particles: Particles) -> list[int]:
    return list(dict.fromkeys(round(k * (len(particles) - 1) / (_PARTICLES - 1)) for k in range(_PARTICLES)))


def _hit(
    walls: Any, pull: Gravity | None, position: NDArray[np.float64], velocity: NDArray[np.float64]
) -> tuple[float, int]:
    """Return the time to the first hit and its wall; infinite if no hit is found in a few parts."""
    total = 0.0
    gravity = np.zeros(3) if pull is None else np.array(pull)
    for _part in range(_PARTS):
        time, wall = flights.first_hit(walls, pull, vec(position), vec(velocity))
        total += float(time)
        if wall >= 0.0 or not time < math.inf:
            return total, int(wall)
        position = position + time * velocity + 0.5 * time * time * gravity
        velocity = velocity + time * gravity
    return math.inf, -1


def _typical(seen: list[Flights]) -> Flights:
    """Return the median of flights, and the wall of most of them."""
    if not seen:
        return Flights(math.inf, -1)
    between = sorted(one.between for one in seen)[len(seen) // 2]
    met = Counter(one.wall for one in seen if one.wall >= 0)
    return Flights(between, met.most_common(1)[0][0] if met else -1)
