"""Sentences about steps of soft balls that were refused."""

import math
from typing import Any

import numpy as np

from ..common.status import Status
from ..compiled_scene import CompiledScene
from ..kernel.limits import TINY
from ..kernel.vector import dot, norm, square, vector_at
from ..methods import Penalty
from ..methods.fixed_step import thinnest
from ..pairs import MOST_PRESSED
from ..surfaces.surface import named
from . import grain_arrays as col
from .contacts import apart
from .overlaps import BALL, OTHER, SIZE, WALL


def unsolved(moment: float, dt: float) -> str:
    """The sentence on impulses that did not converge in the step of the length dt [s] at a moment [s]."""
    return (
        f"the step at {moment:.9g} s failed: the impulses of its contacts did not converge; take a smaller "
        f"dt than {dt:g} s, or a softer penalty; if neither helps, look for a gap or an edge between walls that is "
        "narrower than a ball"
    )


def too_far(world: Any, most: float, largest: float, dt: float) -> str:
    """The sentence on a move by more than `most` radii of the largest ball [m], too far for lists."""
    found = (*_fastest(world.grains), "particle ")
    if world.heavy is not None:
        found = max((*_fastest(world.heavy), "surface "), found)
    _square, number, what = found
    return (
        f"a step failed at {what}{number}: it moves by more than {most:g} radii of the largest ball, "
        f"{largest:g} m, in a step of {dt:g} s; use a smaller dt"
    )


def _fastest(rows: Any) -> tuple[float, int]:
    """Return the largest sum of squared velocities at both ends of a step, infinite for NaN, and the row's number."""
    if not len(rows.number):
        return 0.0, -1
    speed = rows.speed
    squares = (speed[:, col.BEFORE : col.BEFORE + 3] ** 2 + speed[:, col.AFTER : col.AFTER + 3] ** 2).sum(axis=1)
    squares = np.where(np.isnan(squares), np.inf, squares)
    k = int(np.argmax(squares))
    return float(squares[k]), int(rows.number[k])


def sent_wrong(compiled: CompiledScene, world: Any, moment: float) -> str:
    """The sentence on a ball with an invalid velocity from a law of a wall, in the step that ends at a moment [s]."""
    grains, failed = world.grains, world.books.failed
    i, surface = int(failed[BALL]), compiled.numbering.surfaces_of_rows[int(failed[WALL])]
    return (
        f"the step at {moment:.9g} s failed at particle {grains.number[i]}: {Status.SENT_WRONG.sentence}, where it "
        f"left {named(surface, compiled.scene.surfaces[surface])}"
    )


def passed(compiled: CompiledScene, method: Penalty, matter: Any, world: Any, status: int, moment: float) -> str:
    """The sentence on a ball that passes the surface of another ball, or of a wall, in the step at a moment [s]."""
    grains, failed = world.grains, world.books.failed
    i, j, wall = (int(failed[k]) for k in (BALL, OTHER, WALL))
    size, where = float(failed[SIZE]), ", ".join(f"{x:.6g}" for x in grains.place[i, col.X : col.X + 3])
    met = f"particle {grains.number[j]}"
    if wall >= 0:
        surface = compiled.numbering.surfaces_of_rows[wall]
        met = named(surface, compiled.scene.surfaces[surface])
    begin = f"the step at {moment:.9g} s failed at particle {grains.number[i]}, at ({where}) m: it "
    radii = [grains.place[k, col.RADIUS] for k in (i, j)[: 1 + (wall < 0)]]
    if status == Status.TOO_FAST:
        reach = sum(radii)
        if wall >= 0:
            # The way of a moving solid is added.
            reach, _solid = thinnest(compiled.scene, method.dt, balls=True)
            size += reach - matter.limits.longest
        room = f"their radii are {reach:.3g} m in all" if wall < 0 else f"the thinnest solid is {reach:.3g} m thick"
        return (
            f"{begin}moves by {size:.3g} m against {met} in one step, and {room}, so that it can jump over it; use "
            f"dt < {reach / size * method.dt:.2g} s, a smaller speed, or Impact"
        )
    # How many balls share the energy of a wall with a mass is not known.
    presses = "" if world.heavy is None else ", and more where a wall with a mass squeezes it"
    wanted = _penalty(method, matter, grains, (i, j), size, MOST_PRESSED * min(radii))
    least = "the radius of the smaller one" if wall < 0 else "its radius"
    return (
        f"{begin}overlaps {met} by {size:.4g} m, more than {least}, {min(radii):g} m, and its further motion is wrong: "
        f"contacts are too soft for the speed; use a penalty of {wanted:.1e} or more{presses}, got {method.penalty:g}, "
        "with a dt that fits it, a smaller speed, or Impact"
    )


def _penalty(method: Penalty, matter: Any, grains: Any, ends: tuple[int, int], overlap: float, allowed: float) -> float:
    """The penalty with which a contact of its energy at the start of the step overlaps by `allowed` [m]."""
    i, j = ends
    place, speed = grains.place, grains.speed
    stored, v, ease = matter.law.stored_energy(overlap), vector_at(speed, i, col.BEFORE), place[i, col.LIGHTNESS]
    if j >= 0:
        s = apart(matter, place, i, j)
        stored = matter.law.stored_energy(place[i, col.RADIUS] + place[j, col.RADIUS] - norm(s))
        # Along the line of the centres.
        v = dot(v - vector_at(speed, j, col.BEFORE), s) / max(square(s), TINY) * s
        ease += place[j, col.LIGHTNESS]
    energy = stored + 0.5 * square(v) / ease
    return float((method.exponent + 1.0) * energy / math.pow(allowed, method.exponent + 1.0))
