"""phi in its own coordinates and a box around its surface: checks of phi, and bounds of its second derivatives."""

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...common import checks
from ...common.checks import Vector
from ...errors import SceneError
from ...kernel.limits import EPSILON
from ...kernel.vector import Vec, vec
from ...state import Floats
from ..balls.by_foot import ByFoot
from ..balls.parallel import Parallel, foot_of, nearer, tightest_of
from ..curvature import matrices_of
from ..surface import UNBOUNDED, Box, farthest, rotated_box, shown, side_sign, slopes_of
from .numbers import Bend

# Central differences are most exact with steps of the cube root of round-off, relative to the length.
_DIFFERENCE = EPSILON ** (1.0 / 3.0)
# Where second derivatives are only sampled: the number of points, a factor for their range, and the part that they miss
_SAMPLES = 4096
_SAFETY = 2.0
_NOISE = 1e-6
# The room around a solid, relative to its box's smallest width, within which the bound of the second derivatives holds
_MARGIN = 0.25
# Where jumps of phi are sought: chords of the box, their equal parts, and the number of halvings of a part
_CHORDS, _PARTS, _HALVINGS = 256, 16, 30
# A given curvature is surely too small if differences of the gradient over a length and over twice the length both
# exceed it: by this part of it, and by this number of round-offs of a gradient.
_SURELY, _ROUND_OFF = 1e-3, 64.0
# The points of a check that are moved onto the surface, and the number of moves
_ONTO, _MOVES = 256, 60
# A gradient up to this length, relative to |phi|/size in the bounds, counts as 0. A gradient that differs from
# differences of phi by more than the second number is wrong.
_FLAT, _WRONG = 1e-8, 1e-4
# The number of steps of these differences; a wrong gradient differs in all of them.
_STEPS = 6

_STRAIGHT = Bend.of_magnitude(0.0)


class FormSurface(Parallel):
    """A surface with the numbers of a `Form`: the common part of `Formula` and `OwnSurface`."""

    # Fields of the subclasses; `bounds` and `size` are methods.
    box: Box | None
    length: float | None
    center: Vector
    side: str
    curvature: float | None
    _form: "Form"

    def _set(self, common: dict[str, Any], **given: Any) -> None:
        """Set the fields from the arguments of `__init__`."""
        # `dataclasses.replace` gives every field by its own name
        for one in fields(self):  # type: ignore[arg-type]
            given[one.name] = common.pop(one.name, given.get(one.name, one.default))
        for name in common:
            raise SceneError(f"{type(self).__name__} has no argument {name!r}{checks.closest(name, given)}")
        checks.assign(self, **given)
        self.__post_init__()

    def __post_init__(self) -> None:
        super().__post_init__()
        checks.assign(
            self,
            box=_box_of(self.box),
            length=None if self.length is None else checks.length("size", self.length),
            curvature=None if self.curvature is None else checks.at_least("curvature", self.curvature, 0.0),
        )
        checks.assign(self, _form=self._made())

    def _made(self) -> "Form":
        raise NotImplementedError

    def __getstate__(self) -> dict[str, Any]:
        """Return the fields: a process knows only the functions of a form that it made, so each makes its own."""
        return {one.name: getattr(self, one.name) for one in fields(self)}  # type: ignore[arg-type]

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        checks.assign(self, _form=self._made())

    def numbers(self) -> Any:
        return self._form.numbers(self.own_center())

    def own_tightest(self) -> tuple[float, Vector | None]:
        return self._form.tightest

    def by_foot(self, largest: float) -> ByFoot:
        form, center = self._form, np.array(self.own_center())
        low, high = (center + corner for corner in np.array(form.wall_box(largest)))
        box = tuple(low.tolist()), tuple(high.tolist())
        return foot_of(self.numbers(), form.bend.most, form.tightest[0], box)  # type: ignore[arg-type]

    def size(self) -> float:
        return self._form.size

    def bounds(self) -> Box:
        return self._form.bounds(self.center, self.rotation)

    def extent(self) -> float:
        return farthest(self.center) + self._form.reach()


def _widest(a: Floats, b: Floats, measure: Callable[[Any, Any], Any]) -> tuple[Floats, Floats]:
    """Return from several pairs (7, N, several) in each row the pair with the largest measure."""
    k = measure(a, b).argmax(axis=1)[None, :, None]
    return np.take_along_axis(a, k, axis=2)[:, :, 0], np.take_along_axis(b, k, axis=2)[:, :, 0]


def _box_of(bounds: Any) -> Box | None:
    """Return the argument `bounds`, checked."""
    if bounds is None:
        return None
    corners = checks.parts_of(bounds) or ()
    if len(corners) != 2:
        raise SceneError(f"bounds must be two corners ((x, y, z), (x, y, z)), got {checks.shown(bounds)}")
    low, high = (checks.vector(f"bounds[{i}]", corner) for i, corner in enumerate(corners))
    if not all(a < b for a, b in zip(low, high, strict=True)):
        raise SceneError(f"bounds must be a lower and an upper corner, got {low} and {high}")
    return low, high


@dataclass(frozen=True)
class Form:
    """phi in its own coordinates, its box, and the bounds of its second derivatives.

    A box may be endless along an axis on which phi does not depend.
    """

    kind: Any
    parameters: tuple[float, ...]
    box: Box | None
    size: float
    side: str
    bend: Bend = _STRAIGHT

    def numbers(self, center: Vector) -> Any:
        """Return the numbers that kernels take."""
        low, high = self.box or UNBOUNDED
        scale = self.size if math.isfinite(self.size) else 1.0
        narrowest = min(b - a for a, b in zip(low, high, strict=True))
        closed = 1.0 if self.box is not None and self.side == "outside" else 0.0
        return self.kind(
            Vec(*center), side_sign(self.side), _DIFFERENCE * scale, scale, self.bend, Vec(*low), Vec(*high), closed,
            _MARGIN * narrowest, self.parameters,
        )  # fmt: skip

    def reach(self) -> float:
        """The reach of the surface from its center."""
        if self.box is None:
            return self.size if math.isfinite(self.size) else 1.0
        return max(farthest(corner) for corner in self.corners.tolist())

    @functools.cached_property
    def corners(self) -> Floats:
        """The corners of the box, (2, 3); along an endless axis, where phi is constant, with the largest width."""
        corners = np.array(self.box)
        endless = np.isinf(corners[0])
        half = 0.5 * (corners[1] - corners[0])[~endless].max()
        corners[:, endless] = [[-half], [half]]
        return corners

    def domain(self) -> Box | None:
        """Return the box in which the bend must be known: a solid's box has the margin on each side."""
        if self.box is None:
            return None
        low, high = self.corners
        room = _MARGIN * (high - low).min() if self.side == "outside" else 0.0
        return tuple((low - room).tolist()), tuple((high + room).tolist())

    @functools.cached_property
    def endless(self) -> NDArray[np.bool_]:
        """Along which axes phi is constant, so that its surface is a cylinder: by its gradient at points of the box."""
        return np.asarray((self.slope(self.points(_SAMPLES)) == 0.0).all(axis=1))

    @functools.cached_property
    def encloses(self) -> bool:
        """Whether phi is not below 0 on the faces of the box, except those across the axis of a cylinder."""
        (low, high), s = self.corners, np.linspace(0.0, 1.0, 33)
        u, v = (grid.ravel() for grid in np.meshgrid(s, s))
        axes = np.flatnonzero(~self.endless).tolist()
        faces = [np.insert([u, v], axis, end, axis=0) for axis in axes for end in (0.0, 1.0)]
        return bool((self.value(low[:, None] + (high - low)[:, None] * np.hstack(faces)) >= 0.0).all())

    def bounds(self, center: Vector, rotation: Any) -> Box:
        """Return `Surface.bounds`."""
        if self.side == "outside" or self.box is None or not self.encloses:
            return UNBOUNDED
        low, high = np.where(self.endless, [[-math.inf], [math.inf]], self.box) + np.array(center)
        return rotated_box(rotation, (tuple(low.tolist()), tuple(high.tolist())), center)

    @functools.cached_property
    def tightest(self) -> tuple[float, Vector | None]:
        """The smallest radius of curvature that the bound of the bend makes certain, its place: None if infinite."""
        if self.bend.most <= 0.0:
            return math.inf, None
        points = self.points(_SAMPLES)
        near = self._onto(points[:, np.argsort(np.abs(self.value(points)))[: 4 * _ONTO]])
        return tightest_of(near, self.value, self.slope, self.bend.most)

    def wall_box(self, largest: float) -> Box:
        """A box around the surface that balls up to a radius meet: larger where it continues beyond its own box."""
        if self.box is None:
            return UNBOUNDED
        room = 0.0 if self.side == "outside" or self.encloses else largest
        low, high = np.where(self.endless, [[-math.inf], [math.inf]], np.array(self.box))
        return tuple((low - room).tolist()), tuple((high + room).tolist())

    def value(self, points: Floats) -> Floats:
        """Return phi at points (3, N) relative to the center."""
        with np.errstate(all="ignore"):
            return np.broadcast_to(self.numbers((0.0, 0.0, 0.0)).phi(vec(points)), points.shape[1:])

    def slope(self, points: Floats) -> Floats:
        """Return the gradient of phi at points (3, N)."""
        with np.errstate(all="ignore"):
            return slopes_of(self.numbers((0.0, 0.0, 0.0)), vec(points))

    def points(self, n: int) -> Floats:
        """Return random points of the box, or around the center if the form has no box."""
        box = np.array(((-self.reach(),) * 3, (self.reach(),) * 3)) if self.box is None else self.corners
        low, high = box[:, :, None]
        return np.asarray(low + (high - low) * np.random.default_rng(0).random((3, n)))

    # --- Checks ------------------------------------------------------------------------------------------

    def check_gradient(self) -> None:
        """Raise if the gradient is not that of phi."""
        points = self.points(_ONTO)
        given = self.slope(points)
        agrees, differs = np.zeros((2, _ONTO), np.bool_)
        # phi may bend within a length much shorter than its reach, down to the round-off of a place.
        for step in np.geomspace(_DIFFERENCE, _ROUND_OFF * EPSILON / _WRONG, _STEPS) * self.reach():
            measured, values = self._differences(points, step)
            scale = np.abs(given).max(axis=0) + np.abs(values).max(axis=(1, 2)) / self.reach()
            apart = np.abs(measured - given).max(axis=0)
            agrees |= apart <= _WRONG * scale
            differs |= apart > _WRONG * scale
        off = differs & ~agrees
        # At a few points phi itself may have a kink.
        if np.count_nonzero(off) > 0.1 * _ONTO:
            i = int(np.argmax(off))
            raise SceneError(
                f"gradient must be the gradient of phi, got {shown(given[:, i])} at {shown(points[:, i])}, where "
                f"differences of phi give {shown(measured[:, i])}"
            )

    def _differences(self, points: Floats, step: float) -> tuple[Floats, Floats]:
        """Return the gradient by central differences of phi (3, N), and phi at their ends (N, 3, 2)."""
        ends = points[:, :, None, None] + step * np.eye(3)[:, None, :, None] * np.array([1.0, -1.0])
        values = self.value(ends.reshape(3, -1)).reshape(-1, 3, 2)
        # A step is rounded where it is added to a place.
        apart = np.moveaxis(np.diagonal(ends[:, :, :, 0] - ends[:, :, :, 1], axis1=0, axis2=2), -1, 0)
        return (values[:, :, 0] - values[:, :, 1]).T / apart, values

    def check(self) -> None:
        """Raise unless phi is finite in the box, and has a surface there with a normal."""
        points = self.points(_SAMPLES)
        values = self.value(points)
        wrong = ~np.isfinite(values)
        if wrong.any():
            i = int(np.argmax(wrong))
            raise SceneError(f"phi must be a finite number in the bounds, got {values[i]} at {shown(points[:, i])}")
        closest = points[:, np.argsort(np.abs(values))[:_ONTO]]
        near = self._onto(closest)
        if not any((signs <= 0.0).any() and (signs >= 0.0).any() for signs in (values, self.value(near))):
            sign = "below" if values[0] < 0.0 else "above"
            raise SceneError(f"phi must be 0 somewhere in the bounds, got {sign} 0 everywhere in {self.box}")
        # Without a gradient no point is moved onto the surface.
        near = near if near.size else closest
        slopes = np.sqrt((self.slope(near) ** 2).sum(axis=0))
        flat = ~(slopes * self.size > _FLAT * np.abs(values).max())
        if flat.any():
            i = int(np.argmax(flat))
            raise SceneError(
                f"phi must have a gradient on its surface, got one of length {slopes[i]:.3g} at {shown(near[:, i])}"
            )

    def check_jumps(self) -> None:
        """Raise if phi surely jumps in the admissible part of its box."""
        ends, along = self.points(2 * _CHORDS), np.linspace(0.0, 1.0, _PARTS + 1)
        a, b = ends[:, :_CHORDS, None], ends[:, _CHORDS:, None]
        r = a + along * (b - a)
        flat = r.reshape(3, -1)
        rows = np.vstack([flat, self.value(flat), self.slope(flat)]).reshape(7, _CHORDS, -1)
        a, b = _widest(rows[:, :, :-1], rows[:, :, 1:], self._departure)
        for _ in range(_HALVINGS):
            middle = 0.5 * (a[:3] + b[:3])
            m = np.vstack([middle, self.value(middle), self.slope(middle)])
            a, b = _widest(np.stack([a, m], axis=2), np.stack([m, b], axis=2), self._departure)
        apart = np.sqrt(((b - a)[:3] ** 2).sum(axis=0))
        steepest = np.sqrt(np.maximum((a[4:] ** 2).sum(axis=0), (b[4:] ** 2).sum(axis=0)))
        # |phi(b) - phi(a)| <= |grad phi| d + |phi''| d^2/2, and round-off
        most = max(abs(self.bend.least), abs(self.bend.most))
        room = steepest * apart + most * apart**2 + _NOISE * np.abs(rows[3]).max()
        over = np.where(self._departure(a, b) > 0.0, np.abs(b[3] - a[3]) - room, 0.0)
        i = int(np.argmax(np.nan_to_num(over, nan=0.0)))
        if over[i] > 0.0:
            raise SceneError(
                f"phi must be twice differentiable in the bounds, got a jump from {a[3, i]:.6g} to {b[3, i]:.6g} at "
                f"{shown(a[:3, i])}; make it continuous, give closer bounds, or take several surfaces"
            )

    def _departure(self, a: Any, b: Any) -> Any:
        """Return how far differences of phi are from those of its gradient; 0 unless a point of the pair is admissible.

        Each point of the pair is (7, ...): its coordinates, phi and the gradient.
        """
        side = side_sign(self.side)
        with np.errstate(all="ignore"):
            by_gradient = 0.5 * ((a[4:] + b[4:]) * (b[:3] - a[:3])).sum(axis=0)
            off = np.abs(b[3] - a[3] - by_gradient)
        return np.where((side * a[3] <= 0.0) | (side * b[3] <= 0.0), np.nan_to_num(off, nan=0.0), 0.0)

    def check_curvature(self, curvature: float) -> None:
        """Raise if second derivatives at points of the admissible part of the box are surely above a given bound."""
        low, high = np.array(self.domain())[:, :, None]
        step = _DIFFERENCE * self.size
        inner = low + 2.0 * step, high - 2.0 * step
        points = inner[0] + (inner[1] - inner[0]) * np.random.default_rng(0).random((3, _SAMPLES))
        points = points[:, side_sign(self.side) * self.value(points) <= 0.0]
        found = self._sharpness(points, step)
        points = points[:, np.argsort(-np.nan_to_num(found, nan=0.0))[:_ONTO]]
        once, twice = self._sharpness(points, step), self._sharpness(points, 2.0 * step)
        # Where phi is smooth the two differ by four times the error of `once`; at a kink `twice` is half of `once`.
        least = np.minimum(once, twice) - 4.0 * np.abs(once - twice)
        room = _ROUND_OFF * EPSILON / step * np.abs(self.slope(points)).max(axis=0, initial=0.0)
        sure = np.nan_to_num(least - room, nan=0.0)
        if (sure > (1.0 + _SURELY) * curvature).any():
            i = int(np.argmax(sure))
            raise SceneError(
                f"curvature must not be below the second derivative of phi in any direction, got {curvature:g}, but "
                f"differences of the gradient give {once[i]:.6g} at {shown(points[:, i])}, the largest of {_SAMPLES} "
                "points; give a number above it, or leave curvature out"
            )

    def _sharpness(self, points: Floats, step: float) -> Floats:
        """The largest |second derivative| of phi in any direction at each point, by differences of the gradient."""
        entries = self._entries(points, step * np.eye(3)[:, :, None])
        matrices = matrices_of(np.nan_to_num(entries, nan=0.0, posinf=0.0, neginf=0.0))
        return np.asarray(2.0 * np.abs(np.linalg.eigvalsh(matrices)).max(axis=1))

    def _entries(self, points: Floats, step: Floats) -> Floats:
        """Return the entries of side H, H = grad grad phi/2, at points by differences of the gradient, (6, N)."""
        side = side_sign(self.side)
        rows = [0.125 * side / step.max() * (self.slope(points + one) - self.slope(points - one)) for one in step]
        return np.array([rows[i][j] + rows[j][i] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))])

    def _onto(self, points: Floats) -> Floats:
        """Return the points moved onto the surface along the gradient, without those that leave the box."""
        low, high = (np.array(UNBOUNDED) if self.box is None else np.array(self.box))[:, :, None]
        start = np.abs(self.value(points)).max()
        for _ in range(_MOVES):
            points = nearer(points, self.value, self.slope)
        inside = ((points >= low) & (points <= high)).all(axis=0)
        return points[:, inside & (np.abs(self.value(points)) <= 1e-6 * start)]

    def check_bend(self) -> None:
        """Raise if safe steps away from the wall may be as short as the round-off of a position."""
        largest, most = np.abs(self.value(self.points(_SAMPLES))).max(), self.bend.most
        if EPSILON * most * self.size**2 > largest:
            limit = 2.0 * largest / (EPSILON * self.size**2)
            raise SceneError(
                f"phi must not bend more sharply than round-off resolves: with a size of {self.size:.3g} its second "
                f"derivative must be below {limit:.3g}, got up to {2.0 * most:.3g}; where less is known, give curvature"
            )

    def sampled_bend(self) -> Bend:
        """Return the bend by differences of the gradient at some points, with its range doubled."""
        (low, high), points = self.corners, self.points(_SAMPLES)
        # For a solid, in a box that is larger by twice the margin
        points = points + (2.0 * _MARGIN if self.side == "outside" else 0.0) * (points - 0.5 * (low + high)[:, None])
        side = side_sign(self.side)
        # Flights are in the admissible part only.
        points = points[:, side * self.value(points) <= 0.0]
        entries = self._entries(points, _DIFFERENCE * self.size * np.eye(3)[:, :, None])
        if not entries.size or not np.isfinite(entries).all():
            raise SceneError("curvature must be given: the gradient is not finite everywhere in the bounds")
        least, most = entries.min(axis=1), entries.max(axis=1)
        noise = _NOISE * np.abs(entries).max()
        room = 0.5 * (_SAFETY - 1.0) * (most - least) + noise
        bend = Bend.of_entries((least - room)[:, None], (most + room)[:, None])
        # The eigenvalues at the points are closer together than those of any matrix with entries in these ranges.
        exact = Bend.of_entries(entries, entries)
        wider = 0.5 * (_SAFETY - 1.0) * (exact.most - exact.least) + noise
        return bend._replace(least=float(exact.least - wider), most=float(exact.most + wider))
