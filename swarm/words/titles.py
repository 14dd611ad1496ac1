"""A run and its scene in words, for the titles of pictures and for reports."""

from collections import Counter
from typing import Any

import numpy as np

from ..bodies.body import Body
from ..methods import Method
from ..scene import Scene
from ..surfaces.surface import Surface
from ..surfaces.union import part_at
from . import nouns
from .amounts import amount, amounts, counted, counted_in_words, listed, many, one

# The largest number of letters of a title.
LONGEST = 90
# The number of parts that are left out of a title that is too long, the least informative first.
_BREVITY = range(7)
_FEW = 3


def of_scene(scene: Scene, brief: int = 0) -> str:
    """A scene: the vessel, its content, gravity, and the effects of walls; shorter for a larger `brief`.

    >>> import swarm
    >>> ball = swarm.Sphere(0.2, side="outside")
    >>> of_scene(swarm.Scene([swarm.Ellipsoid((0.5, 0.5, 0.7)), ball], gravity=(0.0, 0.0, -9.81)))
    'in an ellipsoid with a ball in it, under gravity'
    """
    solids = [one for one in scene.surfaces if one.is_solid()]
    around = [one for one in scene.surfaces if not one.is_solid()]
    flat = scene.plane is not None
    text = _around(scene, around, brief)
    if solids:
        text += f" {'with' if around else 'among'} {_several(scene, solids, brief)}" + " in it" * bool(around)
    if flat and brief < 5:
        text = f"in a billiard of two dimensions: {text.strip().removeprefix('in ')}"
    if scene.period is not None:
        text = "in a cell that repeats" + f" {text}" * bool(text) * (brief < 5)
    leans = any(name in text for name in (" floor", " lid", " slope"))
    if scene.gravity is not None and brief < 6 and not (brief == 3 and leans):
        text += ", under gravity"
    return (text + _laws(scene) if brief < 1 else text).strip()


def _around(scene: Scene, around: list[Surface], brief: int) -> str:
    """The vessel: a closed one, then its floor, its lid, and other planes."""
    planes = [one for one in around if type(one).__name__ in ("Plane", "Slab")]
    vessels = [one for one in around if one not in planes]
    if vessels:
        inside = f"in {_several(scene, vessels, brief)}"
        if not planes:
            return inside
        names = _several(scene, planes, brief)
        joined = "cut by" if scene.gravity is None and all(one.motion is None for one in planes) else "with"
        return f"{inside} {joined} {names}"
    if len(planes) == 1 and type(planes[0]).__name__ == "Plane":
        named = _several(scene, planes, brief)
        return f"{'above' if 'floor' in named or 'slope' in named else 'beside'} {named}"
    return f"between {_several(scene, planes, brief)}" if planes else ""


def _several(scene: Scene, surfaces: list[Surface], brief: int) -> str:
    """Surfaces, grouped by name: "two balls, 78 pegs and a drum that turns"."""
    found: Counter[tuple[str, str]] = Counter()
    for surface in surfaces:
        moves = nouns.moves_how(surface) if brief < 4 else ""
        found[nouns.noun_of(surface, scene), moves] += nouns.number_of(surface)
    if brief >= 4 and len(found) > 1 and (brief >= 5 or len(found) > _FEW):
        return counted_in_words(sum(found.values()), "solid" if surfaces[0].is_solid() else "wall")
    texts = []
    for (noun, moves), count in found.items():
        named = counted_in_words(count, noun)
        if count == 1 and noun in ("vessel", "compound solid", "intersection") and not moves:
            named = _compound(scene, surfaces, noun)
        verb = moves[:-1] if count > 1 and moves.endswith("s") and not moves.startswith("i") else moves
        texts.append(f"{named} that {verb}" if moves else named)
    return listed(texts)


def _compound(scene: Scene, surfaces: list[Surface], noun: str) -> str:
    """A union or an intersection, by the names of its parts."""
    whole: Any = next(one for one in surfaces if nouns.noun_of(one, scene) == noun)
    if any(part.parts for part in whole.parts):
        return f"{one(noun)} of {len(whole.parts)} parts"
    parts = Counter(nouns.noun_of(part, scene) for part in whole.parts)
    return f"{one(noun)} of {listed([counted_in_words(count, kind) for kind, count in parts.items()])}"


def _laws(scene: Scene) -> str:
    """The effects of walls on the energy or the number of particles, as the end of a title."""
    pieces = [*scene.surfaces, *(part_at(scene.surfaces[i], where) for i, where in scene.parts)]
    kinds = {type(law).__name__ for piece in pieces for law in piece.laws}
    adjectives = ["warm"] * (any(piece.temperature is not None for piece in pieces) or "CercignaniLampis" in kinds)
    for kind, adjective in (("Lambert", "diffuse"), ("Absorb", "absorbing"), ("Sticky", "sticky")):
        adjectives += [adjective] * (kind in kinds)
    lossy = any(piece.restitution < 1.0 or piece.friction for piece in pieces)
    adjectives += ["lossy"] * lossy
    doors = ", with doors" * any("door" in " ".join(nouns.changes_of(piece)) for piece in pieces)
    return (f", {' and '.join(adjectives)} walls" if adjectives else "") + doors


# --- Particles -------------------------------------------------------------------------------------------


def of_particles(content: Any) -> str:
    """The number of particles, balls or bodies, with their noun.

    `content` is the `Content` of a run.
    """
    count, body, frame = count_of(content), content.body, content.frames.get("start", content.frames.get("end"))
    radius = None if frame is None else frame.radius
    if body is not None:
        return counted(count // len(body), noun_of_body(body))
    text = counted(count, "particle" if radius is None else "ball" if content.scene.plane is None else "disc")
    if radius is not None and len(radius):
        low, high = float(np.nanmin(radius)), float(np.nanmax(radius))
        size = amount(low, "m") if low == high else amounts([low, high], "m").replace(" and ", " to ")
        text += f" of {size} radius"
    return text


def count_of(content: Any) -> int:
    """The number of particles, or points of bodies, in a run; from sources only those that have come."""
    end = content.frames.get("end")
    if "born" in content.seen and end is not None and len(end.mass) == content.count:
        return int(np.count_nonzero(~np.isnan(end.position[0])))
    return int(content.count)


def noun_of_body(body: Body) -> str:
    """The noun of a body, by its points and ties.

    >>> import swarm
    >>> noun_of_body(swarm.dumbbell(0.1, 1.0))
    'dumbbell'
    """
    points, links, corners = len(body), len(body.links), len(body.contacts)
    if body.strain is not None:
        return f"elastic body of {many(points)} points"
    if (points, links) == (2, 1):
        return "dumbbell"
    if points == 4 and links == 6:
        return "tetrahedron" if corners == 4 else f"rigid body of {many(corners)} corners"
    if links == points - 1 > 1 and all(j == i + 1 for i, j in body.links):
        return f"chain of {many(points)} points"
    tied = "linkage" if len(body.anchors) or len(body.guides) else "body"
    return f"{tied} of {counted_in_words(points, 'point')}" if points > 1 else "tied point"


def of_method(method: Method) -> str:
    """A method in a title: its name and its step.

    >>> import swarm
    >>> of_method(swarm.Impact()), of_method(swarm.AugmentedLagrangian(dt=1e-3, penalty=1e4))
    ('Impact', 'Augmented Lagrangian, steps of 1 ms')
    """
    kind = type(method).__name__
    name = "".join(f" {c}" if c.isupper() and k else c for k, c in enumerate(kind))
    step = getattr(method, "dt", None)
    return name if step is None else f"{name}, steps of {amount(float(step), 's')}"


def title(content: Any) -> str:
    """A run in fewer than 90 letters: its particles, its scene, its method and its end."""
    what, end = of_particles(content), amount(float(content.seen["time"][-1]), "s")
    came = " from sources" * ("born" in content.seen)
    step, name = of_method(content.method), of_method(content.method).split(",")[0]
    for brief in _BREVITY:
        method = step if brief < 2 else name
        text = f"{what}{came} {of_scene(content.scene, brief)}: {method}, {end}"
        if len(text) < LONGEST:
            return text
    return f"{what}: {name}, {end}"
