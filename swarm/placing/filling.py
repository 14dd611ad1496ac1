"""Random particles, uniform in the admissible volume of a scene."""

import contextlib
import functools
import itertools
import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..common import checks
from ..errors import SceneError
from ..particles import Particles, VolumeEstimate
from ..scene import Scene
from ..state import Floats
from ..surfaces.counter import require_bare
from ..surfaces.surface import Surface
from .fitting_shapes import require_shapes
from .sequential import VolumeBox, is_sparse, place_balls, require_packing, require_size

_BATCH = 1 << 18
# Trials for each requested point, before a whole batch is tested.
_TRIALS_A_POINT, _FEWEST_TRIALS = 8, 64
# The search ends if fewer than one in a million points is admissible: of this number, or earlier if the number found
# is below that by this number of standard deviations.
_LEAST, _TRIES, _CLEARLY = 1e-6, 20_000_000, 2.0
# The volume of balls is estimated from this number of admissible points, to 0.1 %.
_POINTS = 1 << 18
# The points that decide whether balls are few, if the answer is certain to this number of standard deviations, and the
# points that are tested together.
_SOME, _CERTAIN, _AT_ONCE = 1 << 15, 7.0, 1 << 14
_INSTEAD = "the particles as arrays, a CSV file or a source with a volume"


def fill(  # noqa: PLR0913  the keywords are the public interface
    scene: Scene,
    n: int,
    *,
    speed: float | None = None,
    temperature: float | None = None,
    mass: ArrayLike = 1.0,
    seed: int = 0,
    exact: bool = False,
    radius: ArrayLike | None = None,
    within: Surface | None = None,
) -> Particles:
    """Return n particles, uniform in the admissible volume, with isotropic or Maxwellian velocities.

    Args:
        scene: its volume must be bounded.
        n: number of particles, 1 or more.
        speed: |v| of every particle [m/s], from 0 to 1e100, in a direction uniform on the sphere; or
        temperature: k_B T [J], from 0 to 1e100: each component of v is normal with variance temperature/mass. The mean
            kinetic energy of n particles is 3/2 of it only in the mean, with a relative standard deviation of
            sqrt(2/(3 n)): 26 % of 10 particles, 0.8 % of 10 000. In a scene with a plane there are two components, the
            energy is k_B T, and its deviation sqrt(1/n).
        mass: one number or (n,) [kg], above 0.
        seed: the same seed gives the same particles.
        exact: True: the velocities are scaled together, so that the mean kinetic energy is 3/2 temperature (in a plane
            1 temperature) to round-off. Their mean momentum stays as it is drawn, of the order of
            sqrt(mass temperature/n): walls change it, and to take it out would leave fewer than 3 n degrees of freedom.
        radius: one number or (n,) [m], above 0: balls, at places where they overlap neither one another nor the walls,
            one after the other, the largest first; None: points, which do not meet one another.
        within: a volume, a surface as an opening is: particles start in the part of the scene within it, and only this
            part must be bounded; balls are wholly in it. None: in all of the scene.

    Returns:
        The particles; their `volume` is the admissible volume of points [m^3], or of its part with `within`; in a
        scene with a plane all of them are in the plane, and it is the admissible area [m^2]. It is a closed form if the
        scene is one cavity that has one, or a periodic cell, minus solids within that do not overlap; else it is
        estimated from the random points, and `volume_error` is the standard error.

    Raises:
        SceneError: an argument is out of its range, both or neither of speed and temperature are given, the
            volume is open, exact without a temperature, too thin for random points to find it, or too full: balls fill
            at most 0.35 of it at random places, discs in a plane 0.5; `pack` makes denser packings.

    >>> import swarm
    >>> cavity = swarm.Scene(surfaces=[swarm.Sphere(radius=0.5)])
    >>> swarm.fill(cavity, 10, speed=0.5, seed=1)
    Particles(10)
    """
    checks.of_class("scene", scene, Scene)
    if within is not None:
        require_bare("within", within, "it is no wall")
        scene = replace(scene, surfaces=(*scene.surfaces, within))
    n = checks.count("n", n)
    checks.particles_fit("n", n)
    seed = checks.count("seed", seed, least=0)
    speed, temperature = check_velocities("fill", speed, temperature, exact)
    random = np.random.default_rng(seed)
    # Checks the masses too; velocities follow, since a Maxwellian distribution needs the masses.
    if radius is None:
        points, volume = _few_points(scene, n, seed, random) or _points(scene, n, random)
        particles = Particles(points, np.zeros((3, n)), mass)
        particles.volume = volume
    else:
        particles = Particles(np.zeros((3, n)), np.zeros((3, n)), mass, None, radius)
        particles.volume = _place(scene, particles, random)
    particles.image = None if scene.period is None else np.zeros((3, n), np.int64)
    fill_velocities(scene, particles, speed, temperature, exact, random)
    return particles


def check_velocities(
    user: str, speed: float | None, temperature: float | None, exact: bool
) -> tuple[float | None, float | None]:
    """Return the speed and the temperature as numbers; raise a `SceneError` unless exactly one is given."""
    if (speed is None) == (temperature is None):
        came = "neither" if speed is None else "both"
        raise SceneError(f"{user} needs one of speed and temperature, got {came}")
    if speed is not None:
        speed = checks.magnitude("speed", speed)
    if temperature is not None:
        temperature = checks.magnitude("temperature", temperature)
    if checks.flag("exact", exact) and temperature is None:
        raise SceneError("exact must be False with speed, got True: it scales velocities to a temperature")
    return speed, temperature


def fill_velocities(
    scene: Scene, particles: Particles, speed: float | None, temperature: float | None, exact: bool,
    random: np.random.Generator,
) -> None:  # fmt: skip
    """Give particles random velocities."""
    n = len(particles)
    normal = np.zeros((3, n))
    normal[scene.axes()] = random.standard_normal((len(scene.axes()), n))
    if speed is not None:
        particles.velocity = normal * (speed / np.sqrt((normal**2).sum(axis=0)))
    elif temperature is not None:
        if exact:
            # Each component has sum(m v^2)/3n = T if the sum of the squares is 3 n; of two in a plane 2 n.
            normal *= np.sqrt(len(scene.axes()) * n / (normal**2).sum())
        particles.velocity = normal * np.sqrt(temperature / particles.mass)


def _place(scene: Scene, particles: Particles, random: np.random.Generator) -> Callable[[], VolumeEstimate]:
    """Put balls where they overlap nothing; return the function that measures the volume."""
    assert particles.radius is not None
    require_shapes(scene, particles.radius)
    require_size(scene, particles.radius)
    room = _roomy(scene, particles.radius, random)
    if room is None:
        room = room_of(scene, random, "fill")
        require_packing(scene, particles.radius, room)
    particles.position = place_balls(scene, particles.radius, room, random)
    return room.measured


def room_of(scene: Scene, random: np.random.Generator, user: str) -> VolumeBox:
    """Return the volume of a scene, from random points, for the `user` that a message names."""
    low, high = bounding_box(scene, user, _INSTEAD)
    axes = scene.axes()
    box, found, tried = float(np.prod((high - low)[axes])), 0, 0
    if _is_its_box(scene, low, high):
        random.bit_generator.advance(len(axes) * _BATCH)  # type: ignore[attr-defined]
        return VolumeBox(low, high, functools.partial(VolumeEstimate, box, 0.0))
    while found < _POINTS:
        found += _admitted(scene, low, high, random, _BATCH)
        random.bit_generator.advance(len(axes) * _BATCH)  # type: ignore[attr-defined]
        tried += _BATCH
        _require_share(scene, user, (low, high), found, tried)
    return VolumeBox(low, high, functools.partial(_content, scene, box, found, tried))


def _roomy(scene: Scene, radius: Floats, random: np.random.Generator) -> VolumeBox | None:
    """Return the result of `room_of`, with the volume for later, if some of its points show that balls fill little.

    Return None, with nothing drawn, if balls fill more, or if the number of points it would draw is not certain.
    """
    low, high = bounding_box(scene, "fill", _INSTEAD)
    if _is_its_box(scene, low, high):
        return None
    found = _admitted(scene, low, high, random, _SOME)
    share = found / _SOME
    off = _CERTAIN * math.sqrt(share * (1.0 - share) / _SOME) + _CERTAIN / _SOME
    least, most = (math.ceil(1.0 / max(share + way * off, 1e-6)) for way in (1.0, -1.0))
    sure = VolumeBox(
        low, high, lambda: VolumeEstimate(float(np.prod((high - low)[scene.axes()])) * (share - off), None)
    )
    if least != most or not is_sparse(scene, radius, sure):
        return None
    state = random.bit_generator.state
    random.bit_generator.advance(least * len(scene.axes()) * _BATCH)  # type: ignore[attr-defined]
    return VolumeBox(low, high, functools.partial(_measured, scene, state))


def _measured(scene: Scene, state: Any) -> VolumeEstimate:
    """Return the volume that `room_of` finds from a state of a generator."""
    if (exact := _exact(scene)) is not None:
        return exact
    random = np.random.default_rng(0)
    random.bit_generator.state = state
    return room_of(scene, random, "fill").measured()


def _exact(scene: Scene) -> VolumeEstimate | None:
    """Return the volume in closed form, or None."""
    from .closed_form import closed_form  # loaded only for volumes

    volume = closed_form(scene)
    return None if volume is None else VolumeEstimate(volume, 0.0)


def _content(scene: Scene, box: float, found: int, tried: int) -> VolumeEstimate:
    """Return the volume in closed form, else that of a box times the share of tried points that are admissible."""
    share = found / tried
    # The share of n points has the variance p (1 - p)/n.
    return _exact(scene) or VolumeEstimate(box * found / tried, box * math.sqrt(share * (1.0 - share) / tried))


def _is_its_box(scene: Scene, low: Floats, high: Floats) -> bool:
    """Whether the whole box is admissible: its corners are, and the cavities are convex."""
    if scene.period is not None or any(one.openings or one.may_be_passed() for one in scene.surfaces):
        return False
    corners = np.array(list(itertools.product(*np.hstack([low, high])))).T
    return bool(scene.admits(corners).all())


def _admitted(scene: Scene, low: Floats, high: Floats, random: np.random.Generator, count: int) -> int:
    """Return the number of admissible points among the first of the next batch; the generator draws none of them.

    Points are made in parts that fit in the cache.
    """
    draws, found = [], 0
    for k in range(len(scene.axes())):
        bits = np.random.PCG64()
        bits.state = random.bit_generator.state  # type: ignore[assignment]
        draws.append(np.random.Generator(bits.advance(k * _BATCH)))
    for _ in range(count // _AT_ONCE):
        trial = np.zeros((3, _AT_ONCE))
        for axis, draw in zip(scene.axes(), draws, strict=True):
            trial[axis] = low[axis] + (high - low)[axis] * draw.random(_AT_ONCE)
        found += int(scene.admits(trial).sum())
    return found


def bounding_box(scene: Scene, user: str, instead: str) -> tuple[Floats, Floats]:
    """Return the lower and upper corner (3, 1) of a box around the admissible volume, or raise a SceneError if open."""
    low, high = (np.array(corner)[:, None] for corner in scene.bounds())
    if not np.isfinite(high - low).all():
        raise SceneError(
            f"{user} needs a bounded volume, got a scene that is open to infinity; add a surface that closes it, or "
            f"give {instead}{_other_sign(scene)}"
        )
    return low, high


def _other_sign(scene: Scene) -> str:
    """Return the advice if a formula has the sign opposite to that of a cavity, else ""."""
    from ..surfaces import Formula  # a wing, which few scenes load

    for i, one in enumerate(scene.surfaces):
        if isinstance(one, Formula):
            given = f"-({one.formula})"
            with contextlib.suppress(SceneError):  # where the bounds of that one are not found, there is no advice
                negated = Formula(given, parameters=one.parameters, center=one.center, rotation=one.rotation)
                if np.isfinite(negated.bounds()).all():
                    return (
                        f'; surfaces[{i}] (Formula) is a cavity as "{given:.100}" with side = "inside": particles are '
                        "where phi is below 0"
                    )
    return ""


def _few_points(
    scene: Scene, n: int, seed: int, random: np.random.Generator
) -> tuple[Floats, Callable[[], VolumeEstimate]] | None:
    """Return the result of `_points`, from the first trials of its batch, with the volume for later.

    Return None, with nothing drawn, if n admissible points are not among these trials.
    """
    trials = max(_FEWEST_TRIALS, _TRIALS_A_POINT * n)
    if trials >= _BATCH:
        return None
    low, high = bounding_box(scene, "fill", _INSTEAD)
    bits = np.random.PCG64()
    bits.state = random.bit_generator.state  # type: ignore[assignment]
    trial = np.zeros((3, trials))
    for axis in scene.axes():
        trial[axis] = low[axis] + (high - low)[axis] * np.random.Generator(bits).random(trials)
        bits.advance(_BATCH - trials)
    inside = trial[:, scene.admits(trial)]
    if inside.shape[1] < n:
        return None
    random.bit_generator.state = bits.state
    return inside[:, :n], functools.partial(_volume_of, scene, seed)


def _volume_of(scene: Scene, seed: int) -> VolumeEstimate:
    """Return the volume in closed form, else from the first batch of random points of a seed."""
    return _exact(scene) or _points(scene, 1, np.random.default_rng(seed))[1]()


def _points(scene: Scene, n: int, random: np.random.Generator) -> tuple[Floats, Callable[[], VolumeEstimate]]:
    """Return admissible points, and the volume from their share of the random points of the bounding box."""
    low, high = bounding_box(scene, "fill", _INSTEAD)
    points, found, tried, admissible = np.empty((3, n)), 0, 0, 0
    axes = scene.axes()
    box = float(np.prod((high - low)[axes]))
    while found < n:
        trial = np.zeros((3, _BATCH))
        trial[axes] = low[axes] + (high - low)[axes] * random.random((len(axes), _BATCH))
        inside = trial[:, scene.admits(trial)]
        admissible += inside.shape[1]
        inside = inside[:, : n - found]
        points[:, found : found + inside.shape[1]] = inside
        found += inside.shape[1]
        tried += _BATCH
        _require_share(scene, "fill", (low, high), found, tried)
    return points, functools.partial(_content, scene, box, admissible, tried)


def _require_share(scene: Scene, user: str, corners: tuple[Floats, Floats], found: int, tried: int) -> None:
    """Raise a `SceneError` if next to none of the random points between two corners are admissible."""
    least = _LEAST * tried
    # Poisson statistics: the variance is the mean.
    if found < least and (tried >= _TRIES or least - found > _CLEARLY * math.sqrt(least)):
        (low, high), axes = corners, scene.axes()
        raise SceneError(
            f"{user} found {found} admissible points in {tried} tries: the admissible part of the box {low.ravel()} to "
            f"{high.ravel()} is below {_LEAST:g} of it, {_LEAST * float(np.prod((high - low)[axes])):.2g} "
            f"m^{len(axes)}; give {_INSTEAD}"
        )
