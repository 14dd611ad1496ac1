"""Surfaces in words: the noun, the size, the laws, and the motion of each."""

import math
from collections import Counter
from typing import Any

import numpy as np

from .. import motion as motions
from ..scene import Scene
from ..surfaces.facets.mesh import Mesh
from ..surfaces.presence.doors import Opening
from ..surfaces.surface import Surface
from ..surfaces.union import Place, part_at
from .amounts import amount, amounts, counted, counted_in_words, direction, listed, many, one, place, plain

# A plane within this angle of straight down or up is a floor or a lid [cosine].
_LEVEL = 1.0 - 1e-6
# The fields of a surface that are lengths, and their names.
_SIZES = {
    "radius": "radius", "radii": "radii", "semi_axes": "semi-axes", "half_widths": "half widths", "length": "length",
    "lengths": "lengths", "major_radius": "major radius", "minor_radius": "minor radius", "half_width": "half width",
    "height": "height", "focal_length": "focal length", "offset": "offset", "spacing": "spacing",
}  # fmt: skip


def noun_of(surface: Surface, scene: Scene | None = None) -> str:
    """The noun of a surface: a solid sphere is a ball, and a plane at the bottom a floor."""
    kind, solid = type(surface).__name__, surface.is_solid()
    flat = scene is not None and scene.plane is not None
    if kind == "Plane" and scene is not None and scene.gravity is not None:
        normal, pull = np.array(surface.normal), np.array(scene.gravity)  # type: ignore[attr-defined]
        down = float(normal @ pull / (np.linalg.norm(normal) * np.linalg.norm(pull)))
        return "floor" if down > _LEVEL else "lid" if down < -_LEVEL else "slope" if down > 1e-9 else "wall"
    if surface.nouns is not None:
        return surface.nouns[2 * flat + solid]
    # The name of a plugin's class.
    return "".join(f" {letter.lower()}" if letter.isupper() else letter for letter in kind).strip()


def number_of(surface: Surface) -> int:
    """The number of bodies in a surface, as its noun counts them."""
    return surface.body_count() or 1


def labels(scene: Scene) -> dict[tuple[int, Place], str]:
    """The name of each surface, and of each part of a union, in legends: its noun, with a number if it is not alone.

    >>> import swarm
    >>> labels(swarm.Scene([swarm.Sphere(1.0), swarm.Plane((1, 0, 0)), swarm.Plane((-1, 0, 0), 0.5)]))
    {(0, ()): 'sphere', (1, ()): 'plane 1', (2, ()): 'plane 2'}
    """
    places: list[tuple[int, Place]] = [(i, ()) for i in range(len(scene.surfaces))]
    places += [(i, where) for i, where in scene.parts]
    nouns: dict[tuple[int, Place], str] = {}
    for i, where in places:
        surface = part_at(scene.surfaces[i], where)
        number, noun = number_of(surface), noun_of(surface, scene)
        nouns[i, where] = noun if number == 1 else counted(number, noun)
    often, seen, names = Counter(nouns.values()), Counter[str](), {}
    for key, noun in nouns.items():
        seen[noun] += 1
        names[key] = noun if often[noun] == 1 else f"{noun} {seen[noun]}"
    return names


def moves_how(surface: Surface) -> str:
    """The motion of a surface, as the end of "a drum that ..."; "" for a surface at rest."""
    if surface.reacts():
        return "impacts swing" if surface.mass is None or surface.inertia is not None else "impacts push"
    kinds = {type(part).__name__ for part in getattr(surface.motion, "parts", (surface.motion,))}
    for kind, verb in (("Rotation", "turns"), ("Oscillation", "shakes"), ("Translation", "moves"), ("Path", "moves")):
        if kind in kinds:
            return verb
    return "" if surface.motion is None else "is moved"


def size_of(surface: Surface) -> str:
    """The size of a surface, such as "of radius 0.5 m"; "" if it has no length."""
    texts = []
    for name, noun in _SIZES.items():
        value = getattr(surface, name, None)
        if value is None or (name == "length" and type(surface).__name__ in ("Formula", "OwnSurface")):
            continue
        numbers = np.unique(np.asarray(value, np.float64).ravel()) if surface.is_field else np.ravel(value)
        if len(numbers) > 3 or (surface.body_count() and len(numbers) > 1):
            texts.append(f"{noun} from {amounts([numbers.min(), numbers.max()], 'm').replace(' and ', ' to ')}")
        elif name != "offset" or numbers[0]:
            texts.append(f"{noun} {amounts(numbers.tolist(), 'm')}")
    if hasattr(surface, "half_angle"):
        texts.append(f"half angle {math.degrees(surface.half_angle):.4g}°")
    if isinstance(surface, Mesh):
        volume = "" if surface.open else f", volume {amount(surface.volume(), 'm³')}"
        texts.append(f"{many(len(surface))} triangles{volume}")
    elif surface.face_noun:
        texts.append(f"{many(len(surface))} {surface.face_noun}s")  # type: ignore[arg-type]
    if hasattr(surface, "formula"):
        texts.append(f"{surface.formula} = 0".replace("**", "^"))
    if surface.parts:
        texts.append(f"of {listed([in_full(part) for part in surface.parts])}")
    return ", ".join(texts)


def in_full(surface: Surface, scene: Scene | None = None) -> str:
    """A surface in full: its noun, its size, its place, its laws, its openings and its motion."""
    number, noun = number_of(surface), noun_of(surface, scene)
    texts = [counted_in_words(number, noun) if number > 1 else one(noun)]
    if size := size_of(surface):
        texts[0] += f" {size}" if size.startswith("of ") else f" of {size}"
    if hasattr(surface, "normal"):
        texts.append(f"normal along {direction(surface.normal)}")
    axis = getattr(surface, "axis", None)
    if axis is not None and scene is not None and scene.plane is None:
        texts.append(f"axis along {direction(axis)}")
    center = getattr(surface, "center", None)
    if center is not None and any(center):
        texts.append(f"centre at {place(center)}")
    if surface.rotation is not None:
        texts.append(f"turned by {math.degrees(2.0 * math.acos(min(1.0, abs(surface.rotation[0])))):.4g}°")
    return ", ".join(texts + _of_mesh(surface) + laws_of(surface) + changes_of(surface))


def _of_mesh(surface: Any) -> list[str]:
    """The distance of a surface from its mesh, and the largest move of a corner to close seams."""
    error, moved = getattr(surface, "mesh_error", None), getattr(surface, "mesh_weld", None)
    texts = [] if error is None else [f"within {amount(error, 'm', 2)} of its mesh"]
    return texts + ([f"corners moved by up to {amount(moved, 'm', 2)} to close seams"] if moved else [])


def laws_of(surface: Surface) -> list[str]:
    """The laws of the wall of a surface; empty for a wall that keeps the energy."""
    texts = []
    if surface.restitution < 1.0:
        texts.append(f"restitution {plain(surface.restitution)}")
    if surface.friction:
        texts.append(f"friction {plain(surface.friction)}")
    if surface.rolling:
        texts.append(f"rolling {plain(surface.rolling)}")
    if surface.temperature is not None:
        part = "" if surface.accommodation == 1.0 else f" for {plain(100.0 * surface.accommodation)} % of the impacts"
        texts.append(f"warm, k_B T = {amount(surface.temperature, 'J')}{part}")
    return texts + [law_of(law) for law in surface.laws]


def law_of(law: Any) -> str:
    """A law of a wall in words."""
    kind, numbers = type(law).__name__, law._asdict() if hasattr(law, "_asdict") else {}
    if kind == "Absorb":
        if numbers.get("barrier") is not None:
            return f"absorbs above {amount(float(law.barrier), 'J')}"
        chance = float(law.probability)
        return "absorbs" if chance == 1.0 else f"absorbs {plain(100.0 * chance)} %"
    named = {"CercignaniLampis": "Cercignani and Lampis' law", "Lambert": "diffuse by Lambert's law"}
    text = named.get(kind, {"Sticky": "holds particles for a time"}.get(kind, f"the law {law}"))
    if kind == "CercignaniLampis":
        text += f" at k_B T = {amount(float(law.temperature), 'J')}"
    return text


def changes_of(surface: Surface) -> list[str]:
    """The changes of a surface with time: openings, doors, motion, and the effects of impacts."""
    texts = []
    doors = [one for one in surface.openings if isinstance(one, Opening) and one.times is not None]
    if doors:
        texts.append(counted_in_words(len(doors), "door"))
    if holes := len(surface.openings) - len(doors):
        texts.append(counted_in_words(holes, "opening"))
    if faces := () if isinstance(surface, Mesh) else getattr(surface, "open", ()):
        texts.append(f"open at {listed(list(map(str, faces)))}")
    if surface.present is not None:
        spans = [
            f"from {amount(begin, 's')}" + ("" if math.isinf(end) else f" to {amount(end, 's')}")
            for begin, end in surface.present
        ]
        texts.append(f"there {listed(spans)}")
    texts += [motion_of(part) for part in getattr(surface.motion, "parts", (surface.motion,)) if part is not None]
    if surface.mass is not None:
        texts.append(f"mass {amount(surface.mass, 'kg')}, moved by impacts")
    if surface.inertia is not None:
        texts.append(f"inertia {plain(surface.inertia)} kg m², turned by impacts")
    return texts


def motion_of(motion: Any) -> str:
    """A motion in words."""
    if isinstance(motion, motions.Rotation):
        return f"turns about {direction(motion.axis)} with {plain(motion.rate)} rad/s"
    if isinstance(motion, motions.Oscillation):
        return f"shakes by {place(motion.amplitude)} at {amount(motion.frequency, 'Hz')}"
    if isinstance(motion, motions.Translation):
        return f"moves with {amount(math.dist(motion.velocity, (0, 0, 0)), 'm/s')} along {direction(motion.velocity)}"
    if isinstance(motion, motions.Guide):
        spring = f", on a spring of {amount(motion.stiffness, 'N/m')}" if motion.stiffness else ""
        return f"guided along {direction(motion.axis)}{spring}"
    return {"Path": "moves along a path", "Placed": "held where it is"}.get(type(motion).__name__, "moves")
