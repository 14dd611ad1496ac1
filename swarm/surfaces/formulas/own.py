"""A surface by your own phi and its gradient: Python functions that become part of the kernels."""

import functools
import re
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from typing import Any

from numpy.typing import ArrayLike

from ...common.checks import Vector
from ...common.validated import is_left_out
from ...errors import SceneError
from ...kernel.cache import is_disabled
from ...kernel.jit import kernel
from ...kernel.vector import ZERO, total
from ..surface import Box, Surface
from .code import class_of
from .form import Form, FormSurface
from .numbers import Bend


@dataclass(frozen=True, repr=False, init=False)
class OwnSurface(FormSurface):
    """A surface given by your own phi and its gradient, plain Python functions that Numba can compile.

    Args:
        parameters: a NamedTuple of numbers, the functions' first argument; other values need no new compilation.
        phi: `phi(parameters, x, y, z)`, below 0 inside, 0 on the surface, above 0 outside; twice differentiable.
        gradient: `gradient(parameters, x, y, z)` returns (d phi/dx, d phi/dy, d phi/dz).
        size: a characteristic length of the surface [m].
        bounds: ((x, y, z), (x, y, z)), the lower and the upper corner of a box around the cavity or the solid, in the
            coordinates of phi. Where the cavity is open (phi < 0 on a face), the box that particles stay in.
        center: where the origin of phi's coordinates is [m].
        side: "inside" or "outside", the admissible part.
        curvature: a number that the size of the second derivative of phi in any direction never exceeds, in the bounds
            (of a solid: a quarter larger) or, without bounds, wherever particles go. Then the first hit of a flight is
            never missed. None: the second derivatives are taken to be in twice the range in which differences of the
            gradient at 4096 points of the bounds find them; features that are finer than these points may be missed.

    Raises:
        SceneError: an argument is out of its range, phi is not finite, jumps or does not change its sign in the bounds,
            the gradient is not that of phi or vanishes on the surface, or the second derivatives exceed `curvature`.

    >>> import collections
    >>> Radius = collections.namedtuple("Radius", "r")
    >>> def phi(p, x, y, z):
    ...     return x * x + y * y + z * z - p.r * p.r
    >>> def gradient(p, x, y, z):
    ...     return 2.0 * x, 2.0 * y, 2.0 * z
    >>> OwnSurface(Radius(0.5), phi, gradient, size=0.5, curvature=2.0).phi([[0.5], [0.0], [0.0]])
    array([0.])
    """

    nouns = ("cavity of its own kind", "solid of its own kind") * 2
    parameters: Any
    phi_function: Callable[..., Any]
    gradient_function: Callable[..., Any]
    length: float
    box: Box | None = None
    center: Vector = (0.0, 0.0, 0.0)
    side: str = "inside"
    curvature: float | None = None

    def __init__(
        self,
        parameters: Any,
        phi: Callable[..., Any] | None = None,
        gradient: Callable[..., Any] | None = None,
        *,
        size: float | None = None,
        bounds: ArrayLike | None = None,
        **common: Any,
    ) -> None:
        # The arguments have defaults since `dataclasses.replace` gives each by the name of its field.
        needed = {"phi": ("phi_function", phi), "gradient": ("gradient_function", gradient), "size": ("length", size)}
        for argument, (name, value) in needed.items():
            if common.setdefault(name, value) is None:
                raise SceneError(f"OwnSurface needs the argument {argument}, got none")
        self._set(common, parameters=parameters, box=bounds)

    def __repr__(self) -> str:
        return f"OwnSurface({self.parameters!r}, phi={self.phi_function.__name__}, size={self.length:g})"

    def _made(self) -> Form:
        kind = class_of(self.parameters, self.phi_function, self.gradient_function)
        values = tuple(map(float, self.parameters))
        return _form_of(kind, values, self.box, self.length, self.side, self.curvature)

    def require_compiled(self) -> None:
        if is_disabled():
            return
        import numba
        from numba.core.errors import NumbaError, UnsupportedBytecodeError

        kinds = (numba.typeof(self.numbers()), numba.typeof(ZERO))
        functions = (self.phi_function, _compiled_phi), (self.gradient_function, _compiled_gradient)
        for function, compiled in functions:
            try:
                compiled.compile(kinds)  # type: ignore[attr-defined]
            except (NumbaError, UnsupportedBytecodeError) as error:
                raise _not_compiled(function.__name__, str(error)) from None

    def unproved(self) -> str:
        return "a jump, a kink or a second derivative above `curvature`"

    def table(self) -> dict[str, Any]:
        """Return its table in a file: enough to recognise the surface, not to make it again."""
        given = {"code": self._form.kind.__name__, "parameters": self.parameters._asdict(), "size": self.length}
        given |= {"bounds": self.box, "center": self.center, "side": self.side, "curvature": self.curvature}
        given |= {one.name: getattr(self, one.name) for one in fields(Surface) if not is_left_out(self, one)}
        return {"kind": "own", **{key: value for key, value in given.items() if value is not None}}


# Every process, run and copy makes a scene again, and the checks take 0.2 s.
@functools.lru_cache(maxsize=64)
def _form_of(
    kind: Any, values: tuple[float, ...], box: Box | None, size: float, side: str, curvature: float | None
) -> Form:
    """Return the checked form of functions: of a class of numbers and the values of its parameters."""
    form = Form(kind, values, box, size, side)
    if curvature is None and box is None:
        raise SceneError(
            "curvature must be given where bounds are not, got neither; it bounds |phi''| in any direction"
        )
    form.check_gradient()
    if box is not None:
        form.check()
        if curvature is not None:
            form.check_curvature(curvature)
    form = replace(form, bend=form.sampled_bend() if curvature is None else Bend.of_magnitude(curvature))
    if box is not None:
        form.check_jumps()
    return form


# --- Does it compile? ---------------------------------------------------------------------------------

# Lines of Numba's errors that give the place, not the cause
_WHERE = re.compile(
    r"\s*(>>>|There (are|is) |- |Overload |Intrinsic |With argument|Rejected|During|raised from|File |No match|"
    r"<source|Enable|$)|.*(Failed in nopython|No implementation of function)"
)


@kernel
def _compiled_phi(surface, r):
    return surface.phi(r) + 0.0


@kernel
def _compiled_gradient(surface, r):
    return total(surface.gradient(r))


def _not_compiled(name: str, message: str) -> SceneError:
    """Return the error about a function with this name, with the first line of Numba's message that gives the cause."""
    lines = [line.strip() for line in message.splitlines() if not _WHERE.match(line)]
    cause = lines[0] if lines else message.strip().splitlines()[0]
    if "NRT required" in cause or "Only accept returning of array" in cause:
        cause = "it makes a list or an array, for which kernels have no memory"
    return SceneError(f"{name} must be a function of numbers that Numba can compile, got one that it cannot: {cause}")
