"""A surface by a formula: its derivatives, and then a surface by functions.

The formula's text is never evaluated (see `expression`). The compiled text is the engine's own (see `derivatives`),
written from the tree of the derivatives.
"""

import collections
import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np

from ...common import checks
from ...common.checks import Vector
from ...errors import SceneError
from ..surface import Box
from .code import class_of
from .derivatives import derived
from .expression import COORDINATES, FUNCTIONS
from .form import Form, FormSurface
from .numbers import Bend
from .polynomial import base_of

# The number of points at which a formula is tested for bending upwards, and the size that counts as 0: round-off.
_SAMPLES, _FLAT = 1024, 1e-9


@dataclass(frozen=True, repr=False, init=False)
class Formula(FormSurface):
    """A surface by a formula for phi(x, y, z), with its derivatives; in a scene file the formula's key is phi.

    Args:
        formula: phi in x, y, z, numbers, pi, the parameters' names, + - * / **, parentheses and sqrt, exp, log, sin,
            cos, tan, sinh, cosh, tanh; constant exponents. Below 0 inside, 0 on the surface, above 0 outside.
        parameters: numbers by their names; other values of them need no new compilation.
        bounds: ((x, y, z), (x, y, z)), the lower and the upper corner of a box around the cavity or the solid, in the
            coordinates of the formula. None: found where the cavity or the solid is bounded. Where it is open, the box
            that particles stay in.
        size: a characteristic length [m]. None: half the smallest extent of the bounds.
        center: where the origin of the formula's coordinates is [m].
        side: "inside" or "outside", the admissible part.
        curvature: a number that the second derivative of phi in any direction never exceeds in the bounds or, without
            bounds, wherever particles go. None: found by interval arithmetic, which is a proof; then the first hit of a
            flight is never missed. It must be given where phi is no quadric and there are no bounds.

    Raises:
        SceneError: the formula holds anything else, an argument is out of its range, or phi is not finite, has no
            surface in the bounds, no gradient on it, or a corner or a pole where particles may be. Any root, fractional
            or negative power, log or quotient with an argument that may be 0 there counts, even if it cancels out.

    >>> Formula("x**2/0.25 + y**2/0.25 + z**4 - 1").phi([[1.0], [0.0], [0.0]])
    array([3.])
    """

    nouns = ("cavity of a formula", "solid of a formula", "curve of a formula", "solid of a formula")
    formula: str = field(metadata={"key": "phi"})
    parameters: dict[str, float] | None = None
    box: tuple[Vector, Vector] | None = field(default=None, metadata={"key": "bounds"})
    length: float | None = field(default=None, metadata={"key": "size"})
    center: Vector = (0.0, 0.0, 0.0)
    side: str = "inside"
    curvature: float | None = None

    def __init__(self, formula: str, *, bounds: Any = None, size: float | None = None, **common: Any) -> None:
        self._set(common, formula=formula, box=bounds, length=size)

    def __repr__(self) -> str:
        """Return the call that makes it, omitting defaults."""
        given = [f for f in fields(self) if f.name != "formula" and getattr(self, f.name) != f.default]
        rest = "".join(f", {f.metadata.get('key', f.name)}={getattr(self, f.name)!r}" for f in given)
        return f"Formula({self.formula!r}{rest})"

    def __hash__(self) -> int:
        parameters = None if self.parameters is None else frozenset(self.parameters.items())
        return hash((*(parameters if f.name == "parameters" else getattr(self, f.name) for f in fields(self)),))

    def unproved(self) -> str:
        return "" if self.curvature is None else "a second derivative above `curvature`"

    def _made(self) -> Form:
        checks.assign(self, parameters=_checked(self.parameters))
        if not isinstance(self.formula, str):
            raise SceneError(f"phi must be a formula in quotes, got {checks.shown(self.formula)}")
        parameters = tuple((self.parameters or {}).items())
        return _form_of(self.formula, parameters, self.box, self.length, self.side, self.curvature)


# Every process, run and copy makes a scene again, and bounds by intervals take 0.1 s.
@functools.lru_cache(maxsize=64)
def _form_of(
    formula: str, given: tuple[tuple[str, float], ...], box: Box | None, size: float | None, side: str,
    curvature: float | None,
) -> Form:  # fmt: skip
    """Return the form of a formula; the box, the size and the bend are computed if they are not given."""
    names, values = tuple(name for name, _value in given), tuple(value for _name, value in given)
    code = derived(formula, names)
    exact = code.with_values(values)
    box = box or exact.found_box()
    if size is None:
        size = math.inf if box is None else min(b - a for a, b in zip(*box, strict=True)) / 2.0
    make: Any = collections.namedtuple("Parameters", [f"p{i}" for i in range(len(values))])  # type: ignore[misc]
    phi, gradient, hessian = code.functions
    is_solid = side == "outside" and box is not None
    parameters = make(*values)
    is_convex = exact.is_convex(side)
    if code.along is not None and code.along.degree > 2:
        is_convex = _seems_convex(phi, hessian, parameters, box, side)
    base = base_of(code.along, is_solid, is_convex)
    kind = class_of(parameters, phi, gradient, hessian, (code.along, code.along_fall), base)
    kind.same_in_python = True
    if code.along_fall is not None and not is_solid:
        kind.fall_powers = code.along_fall.degree + 1
    form = Form(kind, values, box, size, side)
    if box is not None:
        form.check()
    exact.check(form, needs_box=curvature is None)
    form = replace(form, bend=exact.bend(form) if curvature is None else Bend.of_magnitude(curvature))
    if box is not None:
        form.check_bend()
    return form


def _seems_convex(phi: Any, hessian: Any, parameters: Any, box: Box | None, side: str) -> bool:
    """Whether a cavity with a polynomial of a higher degree bends upwards at points in its box.

    By the principal minors of its second derivatives: their arithmetic is the same on every processor.
    """
    if box is None or side != "inside" or not np.isfinite(box).all():
        return False
    low, high = np.array(box)[:, :, None]
    x, y, z = low + (high - low) * np.random.default_rng(0).random((3, _SAMPLES))
    a, b, c, ab, bc, ca, inside = np.broadcast_arrays(*hessian(parameters, x, y, z), phi(parameters, x, y, z) <= 0.0)
    two = (a * b - ab * ab, b * c - bc * bc, c * a - ca * ca)
    three = a * two[1] - ab * (ab * c - bc * ca) + ca * (ab * bc - b * ca)
    most = max(float(np.abs(one).max()) for one in (a, b, c, ab, bc, ca))
    minors = (*((one, most) for one in (a, b, c)), *((one, most**2) for one in two), (three, most**3))
    return all(bool((one[inside] >= -_FLAT * scale).all()) for one, scale in minors)


def _checked(parameters: Any) -> dict[str, float] | None:
    """Return the argument `parameters`, checked."""
    if parameters is None:
        return None
    if not isinstance(parameters, Mapping):
        raise SceneError(f"parameters must be numbers by their names, got {parameters!r}")
    taken = (*COORDINATES, "pi", *FUNCTIONS)
    for name in parameters:
        if not isinstance(name, str) or not name.isidentifier() or name in taken:
            raise SceneError(f"parameters must have names other than {', '.join(taken)}, got {name!r}")
    return {name: checks.number(f"parameters.{name}", value) for name, value in parameters.items()}
