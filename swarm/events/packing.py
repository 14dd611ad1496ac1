"""Dense random packings of balls, which random places alone cannot reach."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..ball_numbers import balls_volume
from ..common import checks
from ..errors import SceneError
from ..motion import pose
from ..particles import Particles
from ..placing.filling import check_velocities, fill_velocities, room_of
from ..placing.fitting_shapes import require_shapes
from ..placing.sequential import VolumeBox, packing_of, place_balls, require_size
from ..scene import Scene
from ..state import Floats
from ..surfaces.surface import Surface
from .growing_run import grow

# The largest packings that are grown, of balls and of discs; and known limits of packings, with their sentences.
_MOST = {3: 0.6, 2: 0.8}
_EVER, _RANDOM = "no arrangement of equal ones fills", "none at random fill"
_LIMITS = {
    3: ((math.pi / math.sqrt(18.0), _EVER), (0.64, _RANDOM)),
    2: ((math.pi / math.sqrt(12.0), _EVER), (0.84, _RANDOM)),
}
# Growth begins at random places at a packing of `_BEGIN`. Where none are found, the radii are reduced by the factor
# `_LESS`, in at most `_TRIES` tries.
_BEGIN, _LESS, _TRIES = {3: 0.2, 2: 0.3}, 0.7, 6
# The relative round-off of a number of balls, and of a packing.
_CLOSE = 1e-9


def pack(
    scene: Scene,
    n: int | None = None,
    radius: ArrayLike | None = None,
    fraction: float | None = None,
    seed: int = 0,
    *,
    speed: float | None = None,
    temperature: float | None = None,
    mass: ArrayLike = 1.0,
) -> Particles:
    """Return balls that fill a part of the admissible volume of a scene, up to 0.6 of it, in a plane 0.8.

    The balls begin smaller at random places, as in `fill`. They grow while they fly and collide within the walls at
    0 s (the method of Lubachevsky and Stillinger). Their places are random but not in equilibrium: let the balls fly
    for some collisions where that matters.

    Args:
        scene: its volume must be bounded.
        n: number of balls, 1 or more; None: the largest number of balls of the radius within the fraction.
        radius: one number or (n,) [m], above 0; None: the radius of n equal balls that fill the fraction.
        fraction: the part of the admissible volume that the balls fill, from 0 to 0.6, in a plane of the area from 0
            to 0.8; None: the part that n balls of the radius fill. With n and a fraction, radii of each ball are
            relative: they are scaled to the fraction.
        seed: the same seed gives the same balls.
        speed: |v| of every ball [m/s], as in `fill`; without a speed and a temperature the balls are at rest.
        temperature: k_B T [J], as in `fill`.
        mass: one number or (n,) [kg], above 0.

    Returns:
        The particles, with their `radius`, and their `volume`, as `fill` gives it.

    Raises:
        SceneError: fewer than two of n, radius and fraction are given, or all three with one number as the radius; an
            argument is out of its range; the balls are too large for the vessel, or jam before they have grown.

    >>> import swarm
    >>> box = swarm.Scene(surfaces=[swarm.Box((0.5, 0.5, 0.5))])
    >>> balls = swarm.pack(box, 5, fraction=0.21, seed=1)
    >>> round(float(balls.radius[0]), 4)
    0.2156
    """
    checks.of_class("scene", scene, Scene)
    seed = checks.count("seed", seed, least=0)
    moves = speed is not None or temperature is not None
    if moves:
        speed, temperature = check_velocities("pack", speed, temperature, False)
    still, random = _at_rest(scene), np.random.default_rng(seed)
    room = room_of(still, random, "pack")
    radii = _radii(still, n, radius, fraction, room)
    made = Particles(np.zeros((3, radii.size)), np.zeros((3, radii.size)), mass, None, radii)
    require_shapes(still, radii)
    require_size(still, radii)
    packing = balls_volume(still, radii) / room.volume
    _require_below("the packing", packing, len(still.axes()), f" of {packing_of(still, radii, room)}")
    made.position, made.volume = _places(still, radii, room, random), room.measured
    made.image = None if scene.period is None else np.zeros((3, radii.size), np.int64)
    if moves:
        fill_velocities(scene, made, speed, temperature, False, random)
    return made


def _radii(scene: Scene, n: int | None, radius: ArrayLike | None, fraction: float | None, room: VolumeBox) -> Floats:
    """Return the radii (N,) [m], from two of n, radius and fraction, or from all."""
    given = {"n": n, "radius": radius, "fraction": fraction}
    came = [f"{name} = {value!r:.100}" for name, value in given.items() if value is not None]
    if len(came) < 2:
        raise SceneError(f"pack needs two of n, radius and fraction, got {came[0] if came else 'none'}")
    if radius is not None and len(came) == 3 and np.ndim(radius) == 0:
        raise SceneError(
            f"pack needs two of n, radius and fraction, got all: {', '.join(came)}; leave one out (a list of radii is "
            "scaled to the fraction)"
        )
    if fraction is not None:
        fraction = checks.positive("fraction", fraction)
        _require_below("fraction", fraction, len(scene.axes()), "")
    if n is None:
        assert fraction is not None
        return _as_many_as_fit(scene, checks.positive("radius", radius), fraction, room)
    n = checks.count("n", n)
    checks.particles_fit("n", n)
    sizes = Particles(np.zeros((3, n)), np.zeros((3, n)), 1.0, None, 1.0 if radius is None else radius).radius
    assert sizes is not None
    if fraction is None:
        return sizes
    # Radii are relative to the first one, so that sums of cubes neither overflow nor vanish.
    sizes = sizes / sizes[0]
    part = balls_volume(scene, sizes) / (fraction * room.volume)
    return np.asarray(sizes * part ** (-1.0 / len(scene.axes())))


def _as_many_as_fit(scene: Scene, radius: float, fraction: float, room: VolumeBox) -> Floats:
    """Return the radii of the largest number of balls of a radius within a fraction."""
    one = balls_volume(scene, np.array([radius])) / room.volume
    count = int(min(fraction / one, 1e15) + _CLOSE)
    if count == 0:
        raise SceneError(
            f"fraction must be at least {one:.4g}, that of one ball of the radius {radius:g} m, got {fraction:g}; give "
            "a smaller radius, or a larger fraction"
        )
    checks.particles_fit("radius", count)
    return np.full(count, radius)


def _require_below(name: str, packing: float, axes: int, detail: str) -> None:
    """Raise a `SceneError` for a packing above the largest one that is grown."""
    if packing > _MOST[axes] * (1.0 + _CLOSE):
        why = next((f"; {why} more than {most:.4g}" for most, why in _LIMITS[axes] if packing > most), "")
        raise SceneError(f"{name} must be at most {_MOST[axes]:g}, got {packing:.4g}{detail}{why}")


def _places(scene: Scene, radius: Floats, room: VolumeBox, random: np.random.Generator) -> Floats:
    """Return places (3, N) [m] of balls that have grown to these radii."""
    axes = len(scene.axes())
    packing = balls_volume(scene, radius) / room.volume
    scale = min(1.0, (_BEGIN[axes] / packing) ** (1.0 / axes))
    for _ in range(_TRIES):
        try:
            places = place_balls(scene, scale * radius, room, random, radius)
            break
        except SceneError:
            # Within the walls that final radii meet there is less room.
            scale *= _LESS
    else:
        raise SceneError(
            f"pack found no places to begin with within the walls, got {packing_of(scene, radius, room)}; use fewer or "
            "smaller balls, or a larger vessel"
        )
    found, reached = grow(scene, places, radius, scale, random) if scale < 1.0 else (places, 1.0)
    if reached < 1.0:
        raise SceneError(
            f"pack reached a packing of {packing * reached**axes:.4g} before the balls jammed, got "
            f"{packing_of(scene, radius, room)}; ask for less, or give another seed"
        )
    return found


def _at_rest(scene: Scene) -> Scene:
    """The scene without gravity, with smooth walls that stay where they are at 0 s."""
    surfaces = []
    for i, one in enumerate(scene.surfaces):
        for piece in one.surfaces():
            if piece.motion is not None and not _stays(piece):
                raise SceneError(
                    f"surfaces[{i}].motion must leave the wall at its given place at 0 s, got {piece.motion!r:.200}; "
                    "pack a scene without the motion, with the wall where it is then"
                )
        if one.is_there(0.0):
            surfaces.append(_smooth(one))
    return Scene(surfaces, None, scene.period, scene.plane)


def _smooth(surface: Surface) -> Surface:
    """A surface, and its parts, as walls without laws or motion."""
    parts: dict[str, Any] = {}
    if surface.parts:
        parts["parts"] = tuple(replace(_smooth(part), present=part.present) for part in surface.parts)
    return replace(
        surface, motion=None, mass=None, inertia=None, restitution=1.0, friction=0.0, temperature=None,
        accommodation=1.0, laws=(), openings=(), present=None, **parts,
    )  # fmt: skip


def _stays(surface: Surface) -> bool:
    """Whether a moving surface is at its given place at 0 s."""
    found = pose(surface.motion, 0.0)
    return bool(np.array_equal(found.turn, np.eye(3)) and not np.any(found.position()))
