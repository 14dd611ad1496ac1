"""A surface by a formula: what is derived from it, then a surface of one's own.

The formula's text is never evaluated (see `expression`). What is compiled is text of our own (see `generated`), written
from the tree of the derivatives.
"""

import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any

from ... import checks
from ...checks import Vector
from ...errors import SceneError
from .. import base
from . import own
from .derivatives import derived
from .expression import COORDINATES, FUNCTIONS
from .form import Form
from .owned import Bend


@dataclass(frozen=True, repr=False, init=False)
class Formula(base.Surface):
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
            or negative power, log or quotient counts whose argument may be 0 there, even if it cancels out.

    >>> Formula("x**2/0.25 + y**2/0.25 + z**4 - 1").phi([[1.0], [0.0], [0.0]])
    array([3.])
    """

    formula: str = field(metadata={"key": "phi"})
    parameters: dict[str, float] | None = None
    # A surface has methods of these names.
    box: tuple[Vector, Vector] | None = field(default=None, metadata={"key": "bounds"})
    length: float | None = field(default=None, metadata={"key": "size"})
    center: Vector = (0.0, 0.0, 0.0)
    side: str = "inside"
    curvature: float | None = None

    def __init__(
        self,
        formula: str,
        *,
        parameters: Mapping[str, float] | None = None,
        bounds: Any = None,
        size: float | None = None,
        **common: Any,
    ) -> None:
        given = {"formula": formula, "parameters": parameters, "box": bounds, "length": size}
        for one in fields(self):
            if one.name not in given:
                given[one.name] = common.pop(one.name, one.default)
        if common:
            raise SceneError(
                f"Formula has no argument {next(iter(common))!r}{checks.closest(next(iter(common)), given)}"
            )
        for name, value in given.items():
            object.__setattr__(self, name, value)
        self.__post_init__()

    def __post_init__(self) -> None:
        super().__post_init__()
        set_ = functools.partial(object.__setattr__, self)
        set_("box", own.box_of(self.box))
        set_("length", None if self.length is None else checks.length("size", self.length))
        set_("curvature", None if self.curvature is None else checks.at_least("curvature", self.curvature, 0.0))
        set_("parameters", _parameters(self.parameters))
        set_("_found", self._shaped())

    def __repr__(self) -> str:
        """The call that makes it, without what is as it is by default."""
        said = [f for f in fields(self) if f.name != "formula" and getattr(self, f.name) != f.default]
        rest = "".join(f", {f.metadata.get('key', f.name)}={getattr(self, f.name)!r}" for f in said)
        return f"Formula({self.formula!r}{rest})"

    def _shaped(self) -> Form:
        names = tuple(self.parameters or ())
        values = tuple((self.parameters or {}).values())
        code = derived(self.formula, names)
        exact = code.with_values(values)
        box = self.box or exact.found_box()
        size = self.length
        if size is None:
            size = math.inf if box is None else min(b - a for a, b in zip(*box, strict=True)) / 2.0
        kind = own.code_of(_Flat(values), code.phi, code.gradient, code.hessian)
        kind.same_in_python = all(part.same_in_python for part in (code.phi, code.gradient, code.hessian))
        form = Form(kind, values, box, size, self.side)
        if box is not None:
            form.check()
        if self.curvature is None:
            exact.check_box(form)
        exact.check_smooth(form)
        form = form.bent(exact.bend(form) if self.curvature is None else Bend.of_magnitude(self.curvature))
        if box is not None:
            form.check_bend()
        return form

    def __hash__(self) -> int:
        parameters = None if self.parameters is None else frozenset(self.parameters.items())
        return hash((*(parameters if f.name == "parameters" else getattr(self, f.name) for f in fields(self)),))

    @property
    def _form(self) -> Form:
        found: Form = self.__dict__["_found"]
        return found

    def numbers(self) -> Any:
        return self._form.numbers(self.own_center())

    def size(self) -> float:
        return self._form.size

    def bounds(self) -> base.Box:
        return self._form.bounds(self.center, self.rotation)

    def extent(self) -> float:
        return base.farthest(self.center) + self._form.reach()


class _Flat(tuple[float, ...]):
    """Parameters of generated code, which takes them by their index."""

    _fields = ()


def _parameters(parameters: Any) -> dict[str, float] | None:
    if parameters is None:
        return None
    if not isinstance(parameters, Mapping):
        raise SceneError(f"parameters must be numbers by their names, got {parameters!r}")
    for name in parameters:
        taken = (*COORDINATES, "pi", *FUNCTIONS)
        if not isinstance(name, str) or not name.isidentifier() or name in taken:
            raise SceneError(f"parameters must have names other than {', '.join(taken)}, got {name!r}")
    return {name: checks.number(f"parameters.{name}", value) for name, value in parameters.items()}
