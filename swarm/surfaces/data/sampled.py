"""A surface by samples of phi on a regular grid."""

import math
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from ...common import checks
from ...common.checks import Vector
from ...common.validated import Point
from ...errors import SceneError
from ...kernel.vector import vec
from ...state import Floats
from .. import rotation as rotations
from ..balls.by_foot import ByFoot
from ..balls.parallel import Parallel, foot_of, onto, tightest_of
from ..surface import UNBOUNDED, Box, Surface, farthest, rotated_box, shown, side_sign
from . import spline
from .arrays import read_samples
from .sample_cells import SampleCells, cells_of, eigenvalues, least_at_border, most_bent_within
from .sampled_numbers import SampledNumbers
from .spline import Spline

# A spline that changes its sign between two samples of the same sign has a feature that the samples do not resolve if
# it goes beyond 0 by more than this part of the largest change of phi in a cell; less, as next to an edge, is a ripple.
_RIPPLE = 0.1
# A sample nearer to 0 than this part of the largest change of phi in a cell is on the surface, for any sign of its
# round-off. The round-off of meshes in float32 is 1e-7 of their size.
_ON = 1e-4
# At first at most about this number of places are tested for the gradient on the surface.
_MOST_POINTS = 4096
# The width of a cell along an axis on which phi does not depend [m]: no particle leaves it.
_ENDLESS = 1e150


def _spacing(name: str, value: Any) -> Vector:
    if not isinstance(value, (list, tuple)) and getattr(value, "ndim", 0) == 0:
        one = checks.length(name, value)
        return one, one, one
    return checks.three_lengths(name, value)


@dataclass(frozen=True, repr=False, eq=False)
class Sampled(Parallel):
    """The surface where samples of phi on a regular grid are 0, joined by a tricubic spline (C2).

    In a scene file: kind = "sampled" and file = "phi.npy" or "phi.h5", relative to the scene file, for the values.

    Args:
        values: phi (nx, ny, nz), four or more along each axis, in any unit: below 0 inside, above 0 outside. Or the
            path of a .npy file, or of an HDF5 file with one such dataset.
        spacing: between samples [m], one number or three.
        origin: the place of values[0, 0, 0], three numbers [m].
        side: "inside" or "outside", the admissible part.
        rotation: about the middle of the grid.
        mesh_error: the distance of the surface from the mesh that it was made from [m]; None: it was made from none.
        mesh_weld: how far corners of that mesh were moved at most to close its seams [m]; None: none were moved.

    Where the surface reaches the border of the grid, other surfaces, or the plane of the scene, must keep particles in
    the grid. Samples that do not change along an axis are those of a cylinder, which has no normal along it.

    Raises:
        SceneError: an argument is out of its range, the file cannot be read, a sample is not finite, all have the same
            sign, or the grid is too coarse: the surface comes through an edge of a cell twice.

    Accuracy: of order 4 in the spacing where phi is smooth. First hits are those of the spline, none is skipped.

    >>> import numpy as np
    >>> x = np.linspace(-1.0, 1.0, 16)
    >>> values = x[:, None, None]**2 + x[:, None]**2 + x**2 - 0.64
    >>> Sampled(values, x[1] - x[0], (-1.0, -1.0, -1.0)).phi([[0.8], [0.0], [0.0]]).round(9)
    array([0.])
    """

    nouns = ("sampled cavity", "sampled solid") * 2
    values: Any
    spacing: Annotated[Any, _spacing]
    origin: Point
    side: str = "inside"
    mesh_error: float | None = field(default=None, kw_only=True)
    mesh_weld: float | None = field(default=None, kw_only=True)
    # The `Samples`, shared with copies that have another side or place.
    _made: Any = field(default=None, kw_only=True, compare=False, metadata={"in_file": False})

    def __post_init__(self) -> None:
        super().__post_init__()
        if self._made is None or self._made.values is not self.values or self._made.spacing != self.spacing:
            object.__setattr__(self, "values", _samples(self.values))
            if self.mesh_error is None:
                # Thin walls are searched in the mesh itself; next to its edges a spline has larger ripples.
                _require_resolved(self.values, np.array(self.spacing), np.array(self.origin))
            object.__setattr__(self, "_made", Samples(self.values, self.spacing))

    def __repr__(self) -> str:
        """Return the number of samples, and their place."""
        shape = " x ".join(map(str, self.values.shape))
        own = [one for one in fields(self) if one.name in ("spacing", "origin", "side", "mesh_error", "mesh_weld")]
        return self._call([f"<{shape}>"], [*own, *fields(Surface)])

    # --- For kernels -------------------------------------------------------------------------------------

    def numbers(self) -> SampledNumbers:
        made, sign = self._made, side_sign(self.side)
        return SampledNumbers(self._spline(), made.cells, sign, float(made.is_closed), made.most_bent[int(sign < 0.0)])

    def _spline(self) -> Spline:
        made: Samples = self._made
        return made.spline(np.array(rotations.turned_back(self.rotation, self.middle())) - 0.5 * made.widths)

    def own_tightest(self) -> tuple[float, Floats | None]:
        _most, _known, radius = self._made.roundness[self.side == "outside"]
        return radius, None if math.isinf(radius) else self._made.least_steep[1] - 0.5 * self._made.widths

    def by_foot(self, largest: float) -> ByFoot:
        made, numbers = self._made, self.numbers()
        most, known, radius = made.roundness[self.side == "outside"]
        first = np.array(numbers.spline.low)
        low, high = np.where(made.endless, [[-math.inf], [math.inf]], [first, first + made.widths]).tolist()
        return foot_of(numbers, most, radius, (tuple(low), tuple(high)), known)

    def middle(self) -> Vector:
        x, y, z = (np.array(self.origin) + 0.5 * self._made.widths).tolist()
        return x, y, z

    # --- For users ---------------------------------------------------------------------------------------

    def size(self) -> float:
        low, high = self._made.inner_box
        return 0.5 * float((high - low)[~self._made.endless].min())

    def bounds(self) -> Box:
        if self.side == "outside" or not self._made.is_closed:
            return UNBOUNDED
        endless = np.where(self._made.endless, math.inf, 0.0)
        low, high = self._made.inner_box
        return self._placed(low - endless, high + endless)

    def known_in(self) -> Box | None:
        """The box outside of which the surface is not known; None: there is no surface outside."""
        everywhere = self._made.is_closed and not self._made.endless.any()
        return None if everywhere else self._placed(np.zeros(3), self._made.widths)

    def _placed(self, low: Floats, high: Floats) -> Box:
        box = tuple(tuple((np.array(self.origin) + corner).tolist()) for corner in (low, high))
        return rotated_box(self.rotation, box, self.middle())  # type: ignore[arg-type]

    def extent(self) -> float:
        low, high = self._placed(np.zeros(3), self._made.widths)
        return max(farthest(low), farthest(high))

    def shifted(self, shift: Any) -> "Sampled":
        x, y, z = (a + b for a, b in zip(self.origin, shift, strict=True))
        return replace(self, origin=(x, y, z))

    def turned(self, turn: rotations.Quaternion) -> Surface:
        middle = self.middle()
        shift = np.array(rotations.turned(turn, middle)) - middle
        return Surface.turned(self.shifted(shift.tolist()), turn)


class Samples:
    """The samples of a surface and all that is derived from them, once."""

    def __init__(self, values: Floats, spacing: Vector) -> None:
        self.values, self.spacing = values, spacing
        width = np.array(spacing)
        self.widths = (np.array(values.shape) - 1.0) * width
        self.coefficients = spline.coefficients(values)
        self.steepness = float(max(np.abs(np.diff(values, axis=k)).max() / width[k] for k in range(3)))

    def spline(self, low: Floats) -> Spline:
        """Return the spline with its first sample at a place."""
        # Along an axis on which phi does not depend, all points are at the first sample of one cell.
        width, cells = np.where(self.endless, _ENDLESS, self.spacing), np.array(self.values.shape) - 1.0
        first, wide, inverse, shape = (
            vec(row.tolist()) for row in (low, width, np.where(self.endless, 0.0, 1.0 / width), cells)
        )
        return Spline(first, wide, inverse, shape, self.steepness, self.coefficients)

    @cached_property
    def least_steep(self) -> tuple[float, Floats]:
        """The least |grad phi| on the surface, and its place relative to the first sample."""
        spline = self.spline(np.zeros(3))
        places = np.argwhere(self.cells.clear == 0)
        points = ((places[:: 1 + len(places) // _MOST_POINTS] + 0.5) * np.array(self.spacing)).T

        def value(points: Floats) -> Floats:
            return np.asarray(spline.value(vec(points)))

        def slope(points: Floats) -> Floats:
            return np.array(spline.value_and_slope(vec(points))[1])

        half, where = tightest_of(onto(points, value, slope), value, slope, 1.0)
        return 2.0 * half, np.array(where)

    @cached_property
    def roundness(self) -> list[tuple[float, float, float]]:
        """The results of `most_bent_within` for a cavity and for a solid."""
        width, (steepness, _where) = np.array(self.spacing), self.least_steep
        return [most_bent_within(self.coefficients, width, self.cells, side, steepness) for side in (1.0, -1.0)]

    @cached_property
    def cells(self) -> SampleCells:
        """The cells that the surface is in, and its distance from all other cells."""
        return cells_of(self.coefficients, np.array(self.spacing))

    @cached_property
    def most_bent(self) -> tuple[float, float]:
        """Lower bounds of the least eigenvalue of H, and of -H, anywhere on the surface."""
        least, most = eigenvalues(self.cells)
        return least, -most

    @cached_property
    def endless(self) -> NDArray[np.bool_]:
        """The axes along which all samples are the same, so that the surface is a cylinder."""
        return np.array([not np.diff(self.values, axis=k).any() for k in range(3)])

    @cached_property
    def is_closed(self) -> bool:
        """Whether phi is above 0 all over the border of the grid, except at the ends of a cylinder."""
        across = np.flatnonzero(~self.endless).tolist()
        return all(least_at_border(self.coefficients, k, end) > 0.0 for k in across for end in (0, -1))

    @cached_property
    def inner_box(self) -> tuple[Floats, Floats]:
        """Corners of a box around all points where phi is below 0, relative to the first sample."""
        inside = self.cells.clear == 0
        for corner in np.ndindex(2, 2, 2):
            part = tuple(slice(k, n - 1 + k) for k, n in zip(corner, self.values.shape, strict=True))
            inside = inside | (self.values[part] < 0.0)
        places = np.argwhere(inside)
        width = np.array(self.spacing)
        return places.min(axis=0) * width, (places.max(axis=0) + 1.0) * width


# --- Checks ----------------------------------------------------------------------------------------------


def _samples(values: Any) -> Floats:
    """Return the argument `values`, checked: an array or a path."""
    if isinstance(values, str | Path):
        values = read_samples(values)
    found = checks.array("values", values)
    if found.ndim != 3 or min(found.shape) < spline.LEAST:
        raise SceneError(
            f"values must have the shape (nx, ny, nz), {spline.LEAST} samples or more along each axis, got "
            f"{found.shape}"
        )
    found = np.ascontiguousarray(found)
    wrong = ~np.isfinite(found)
    if wrong.any():
        i, j, k = np.argwhere(wrong)[0]
        raise SceneError(
            f"values must be finite, got {found[i, j, k]} at values[{i}, {j}, {k}] and {np.count_nonzero(wrong) - 1} "
            "more that are not"
        )
    if not found.min() < 0.0 < found.max():
        sign = "below" if found.max() <= 0.0 else "above"
        raise SceneError(
            f"values must be below 0 inside the surface and above 0 outside, got {sign} 0 everywhere, from "
            f"{found.min():.4g} to {found.max():.4g}: there is no surface in the grid"
        )
    return found if found is not values else found.copy()


def _require_resolved(values: Floats, width: Floats, origin: Floats) -> None:
    """Raise if the spline changes its sign twice along an edge of a cell, between samples of the same sign."""
    for axis in range(3):
        f = np.moveaxis(values, axis, 0)
        c = spline.along(f, 0)
        first, last = f[:-1], f[1:]
        # The Bernstein coefficients of an edge, which bound a cubic
        second, third = (4.0 * c[1:-2] + 2.0 * c[2:-1]) / 6.0, (2.0 * c[1:-2] + 4.0 * c[2:-1]) / 6.0
        most = np.abs(np.diff(f, axis=0)).max()
        ripple, on = _RIPPLE * most, _ON * most
        sign = np.where(first > 0.0, 1.0, -1.0)
        turned = np.minimum(sign * second, sign * third) < -ripple
        for place in np.argwhere((sign * last > on) & (np.abs(first) > on) & turned):
            at = tuple(place)
            s = np.linspace(0.0, 1.0, 65)[1:-1]
            r = 1.0 - s
            seen = r**3 * first[at] + 3 * r * r * s * second[at] + 3 * r * s * s * third[at] + s**3 * last[at]
            if (sign[at] * seen).min() < -ripple:
                ends = np.array([at, at])
                ends[1, 0] += 1
                start, end = np.moveaxis(ends[:, [*range(1, axis + 1), 0, *range(axis + 1, 3)]], 0, 0)
                where = shown(origin + width * 0.5 * (start + end))
                raise SceneError(
                    f"values must resolve the surface, got a grid that is too coarse: between values{start.tolist()} = "
                    f"{first[at]:.4g} and values{end.tolist()} = {last[at]:.4g}, at {where}, phi changes its sign "
                    "twice; sample it with a smaller spacing"
                )
