"""A surface of the user's own: phi and its gradient as Python functions, which become part of the kernels.

Every code has its own Numba type, whose name is a digest of that code: kernels are compiled for it and found again in
the cache of another process by it, and an edited phi is another type.
"""

import collections
import functools
import re
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields
from typing import Any

import numba
import numpy as np
from numba.core.errors import NumbaError, UnsupportedBytecodeError
from numba.extending import overload
from numpy.typing import ArrayLike

from ... import checks
from ...checks import Vector
from ...errors import SceneError
from ...kernel.jit import _INLINE, inlined, kernel
from .. import base, smooth
from .form import Form
from .frozen import Frozen
from .owned import Bend, OwnNumbers


@dataclass(frozen=True, repr=False, init=False)
class OwnSurface(base.Surface):
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
        curvature: a number that the second derivative of phi in any direction never exceeds, in the bounds (of a solid:
            a quarter larger) or, without bounds, wherever particles go. Then the first hit of a flight is never missed.
            None: the second derivatives are taken to be in twice the range in which differences of the gradient at 4096
            points of the bounds find them; features that are finer than these points may be missed.

    Raises:
        SceneError: an argument is out of its range, phi is not finite or does not change its sign in the bounds, or the
            gradient is not that of phi or vanishes on the surface.

    >>> Radius = collections.namedtuple("Radius", "r")
    >>> def phi(p, x, y, z):
    ...     return x * x + y * y + z * z - p.r * p.r
    >>> def gradient(p, x, y, z):
    ...     return 2.0 * x, 2.0 * y, 2.0 * z
    >>> OwnSurface(Radius(0.5), phi, gradient, size=0.5, curvature=2.0).phi([[0.5], [0.0], [0.0]])
    array([0.])
    """

    parameters: Any
    phi_function: Callable[..., Any]
    gradient_function: Callable[..., Any]
    size_: float
    bounds_: base.Box | None = None
    center: Vector = (0.0, 0.0, 0.0)
    side: str = "inside"
    curvature: float | None = None
    _form: Form = field(init=False, compare=False)

    def __init__(
        self,
        parameters: Any,
        phi: Callable[..., Any],
        gradient: Callable[..., Any],
        *,
        size: float,
        bounds: ArrayLike | None = None,
        center: Vector = (0.0, 0.0, 0.0),
        side: str = "inside",
        curvature: float | None = None,
        **common: Any,
    ) -> None:
        given = {"parameters": parameters, "phi_function": phi, "gradient_function": gradient}
        given |= {"size_": checks.length("size", size), "bounds_": box_of(bounds), "center": center, "side": side}
        given["curvature"] = None if curvature is None else checks.at_least("curvature", curvature, 0.0)
        for one in fields(base.Surface):
            given[one.name] = common.pop(one.name, one.default)
        if common:
            raise SceneError(f"OwnSurface has no argument {next(iter(common))!r}")
        for name, value in given.items():
            object.__setattr__(self, name, value)
        super().__post_init__()
        code = code_of(parameters, phi, gradient)
        object.__setattr__(
            self, "_form", Form(code, tuple(map(float, parameters)), self.bounds_, self.size_, self.side)
        )
        object.__setattr__(self, "_form", self._bounded())

    def __repr__(self) -> str:
        return f"OwnSurface({self.parameters!r}, phi={self.phi_function.__name__}, size={self.size_:g})"

    def _bounded(self) -> "Form":
        form = self._form
        if self.curvature is not None:
            form = form.bent(Bend.of_magnitude(self.curvature))
        elif form.box is None:
            raise SceneError(
                "curvature must be given where bounds are not, got neither; it bounds |phi''| in any direction"
            )
        form.check_gradient()
        if form.box is not None:
            form.check()
        return form if self.curvature is not None else form.bent(form.sampled_bend())

    def table(self) -> dict[str, Any]:
        """What a file says of it: enough to recognise it, not to make it again."""
        given = {"code": self._form.kind.__name__, "parameters": self.parameters._asdict(), "size": self.size_}
        given |= {"bounds": self.bounds_, "center": self.center, "side": self.side, "curvature": self.curvature}
        given |= {one.name: getattr(self, one.name) for one in fields(base.Surface)}
        return {"kind": "own", **{key: value for key, value in given.items() if value is not None}}

    def numbers(self) -> Any:
        return self._form.numbers(self.own_center())

    def size(self) -> float:
        return self.size_

    def bounds(self) -> base.Box:
        return self._form.bounds(self.center, self.rotation)

    def extent(self) -> float:
        return base.farthest(self.center) + self._form.reach()


def box_of(bounds: Any) -> base.Box | None:
    """The argument `bounds`, checked."""
    if bounds is None:
        return None
    if isinstance(bounds, (str, bytes)) or not hasattr(bounds, "__len__") or len(bounds) != 2:
        raise SceneError(f"bounds must be two corners ((x, y, z), (x, y, z)), got {bounds!r}")
    low, high = (checks.vector(f"bounds[{i}]", corner) for i, corner in enumerate(bounds))
    if not all(a < b for a, b in zip(low, high, strict=True)):
        raise SceneError(f"bounds must be a lower and an upper corner, got {low} and {high}")
    return low, high


# --- The code and its type -------------------------------------------------------------------------------

_NAME = re.compile(r"Own_[0-9a-f]{16}\Z")
_registered: set[str] = set()


def __getattr__(name: str) -> Any:
    """The class of a code by its name.

    The index of the kernel cache names the classes of all processes that share it, and loading it asks for them here.
    """
    if not _NAME.match(name):
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    made = type(name, (OwnNumbers,), {"__module__": __name__, "__qualname__": name, "__slots__": ()})
    # Of two threads that ask at once both get the first one's.
    return globals().setdefault(name, made)


def code_of(
    parameters: Any, phi: Callable[..., Any], gradient: Callable[..., Any], hessian: Callable[..., Any] | None = None
) -> Any:
    """The class of numbers whose kernels call these functions.

    Raises:
        SceneError: they are not functions of (parameters, x, y, z), or the parameters are no NamedTuple of numbers.
    """
    names = getattr(parameters, "_fields", None if parameters != () else ())
    if not isinstance(parameters, tuple) or names is None:
        raise SceneError(f"parameters must be a NamedTuple of numbers, got {parameters!r}")
    # Generated code takes its parameters by their index and names none.
    for name, value in zip(names, parameters, strict=False):
        checks.number(f"parameters.{name}", value)
    frozen = Frozen()
    frozen.value(names)
    copies = []
    for name, function in (("phi", phi), ("gradient", gradient), ("hessian", hessian)):
        if function is not None:
            _check_function(name, function)
            copies.append(frozen.function(function))
    name = f"Own_{frozen.digest()}"
    kind = getattr(sys.modules[__name__], name)
    if name not in _registered:
        _register(kind, collections.namedtuple("Parameters", names) if names else None, *copies)
        _registered.add(name)
    return kind


def _check_function(name: str, function: Any) -> None:
    code = getattr(getattr(function, "py_func", function), "__code__", None)
    if code is None:
        raise SceneError(f"{name} must be a Python function of (parameters, x, y, z), got {function!r}")
    if code.co_argcount != 4 or code.co_kwonlyargcount or code.co_flags & 0x0C:
        names = ", ".join(code.co_varnames[: code.co_argcount])
        raise SceneError(f"{name} must be a function of (parameters, x, y, z), got one of ({names})")


def _register(
    kind: Any,
    make: Any,
    phi: Callable[..., Any],
    gradient: Callable[..., Any],
    hessian: Callable[..., Any] | None = None,
) -> None:
    value, slope = _for_arrays(phi, 1), _for_arrays(gradient, 3)
    if make is None:

        @inlined
        def of(surface):
            return surface.parameters

    else:

        @inlined
        def of(surface):
            return make(*surface.parameters)

    @base.phi.register(kind)
    def _(surface, x, y, z):
        return value(of(surface), x - surface.cx, y - surface.cy, z - surface.cz)

    @base.gradient.register(kind)
    def _(surface, x, y, z):
        return slope(of(surface), x - surface.cx, y - surface.cy, z - surface.cz)

    if hessian is not None:

        @smooth.hessian.register(kind)
        def _(surface, x, y, z):
            return hessian(of(surface), x - surface.cx, y - surface.cy, z - surface.cz)


# --- Whether it compiles ---------------------------------------------------------------------------------

NUMBA_ERRORS = (NumbaError, UnsupportedBytecodeError)
# Lines of Numba's errors that say where it was, not what the matter is.
_WHERE = re.compile(
    r"\s*(>>>|There (are|is) |- |Overload |Intrinsic |With argument|Rejected|During|raised from|File |No match|"
    r"<source|Enable|$)|.*(Failed in nopython|No implementation of function)"
)


@kernel
def _compiled_phi(surface, x, y, z):
    return base.phi(surface, x, y, z) + 0.0


@kernel
def _compiled_gradient(surface, x, y, z):
    gx, gy, gz = base.gradient(surface, x, y, z)
    return gx + gy + gz


def require_compiled(surfaces: Sequence[base.Surface]) -> None:
    """Raise a `SceneError` where Numba cannot compile a function: in a moment, before half a minute of a kernel."""
    if numba.config.DISABLE_JIT:  # type: ignore[attr-defined]
        return
    for surface in surfaces:
        if isinstance(surface, OwnSurface):
            numbers: Any = surface.numbers()
            kinds = (numba.typeof(numbers), *(numba.float64,) * 3)
            for function, compiled in (
                (surface.phi_function, _compiled_phi),
                (surface.gradient_function, _compiled_gradient),
            ):
                try:
                    compiled.compile(kinds)  # type: ignore[attr-defined]
                except NUMBA_ERRORS as error:
                    raise not_compiled(function.__name__, error) from None


def not_compiled(name: str, error: Exception) -> SceneError:
    """The error about a function of that name, with the first line of Numba's that says what the matter is."""
    lines = [line.strip() for line in str(error).splitlines() if not _WHERE.match(line)]
    matter = lines[0] if lines else str(error).strip().splitlines()[0]
    if "NRT required" in matter or "Only accept returning of array" in matter:
        matter = "it makes a list or an array, for which kernels have no memory"
    return SceneError(f"{name} must be a function of numbers that Numba can compile, got one that it cannot: {matter}")


def _for_arrays(function: Callable[..., Any], count: int) -> Callable[..., Any]:
    """The function, which in Python takes arrays of points too, whatever it is made of."""
    plain: list[bool] = []

    @functools.cache
    def loop() -> Any:
        def over(parameters, x, y, z, out):
            for i in range(x.size):
                out[i] = function(parameters, x[i], y[i], z[i])

        return numba.njit(error_model="numpy")(over)

    def in_python(parameters, x, y, z):
        if np.ndim(x) == 0 and np.ndim(y) == 0 and np.ndim(z) == 0:
            return function(parameters, x, y, z)
        if not plain:
            plain.append(_takes_arrays(function, parameters, x, y, z))
        if plain[0]:
            return function(parameters, x, y, z)
        rows = [np.ascontiguousarray(row, dtype=np.float64).ravel() for row in np.broadcast_arrays(x, y, z)]
        out = np.empty((rows[0].size, count)) if count > 1 else np.empty(rows[0].size)
        with np.errstate(all="ignore"):
            try:
                loop()(parameters, *rows, out)
            except NUMBA_ERRORS as error:
                raise not_compiled(function.__name__, error) from None
        shape = np.broadcast(x, y, z).shape
        return tuple(column.reshape(shape) for column in out.T) if count > 1 else out.reshape(shape)

    def in_kernels(parameters, x, y, z):
        return function(parameters, x, y, z)

    # What a user writes may make arrays.
    options: Any = {**_INLINE, "_nrt": True}
    overload(in_python, jit_options=options)(lambda parameters, x, y, z: in_kernels)
    return in_python


def _takes_arrays(function: Callable[..., Any], parameters: Any, *rows: Any) -> bool:
    """Whether the function computes with arrays what it computes with numbers, and leaves its arguments alone."""
    few = [np.array(row.ravel()[:3] if row.size > 2 else np.resize(row, 3)) for row in np.broadcast_arrays(*rows)]
    for row in few:
        row.flags.writeable = False
    try:
        with np.errstate(all="ignore"):
            whole = function(parameters, *few)
            each = [function(parameters, *point) for point in zip(*few, strict=True)]
            together = [
                np.broadcast_arrays(part, few[0])[0] for part in (whole if isinstance(whole, tuple) else (whole,))
            ]
            return np.allclose(np.array(together).T.ravel(), np.array(each).ravel(), rtol=1e-9, equal_nan=True)
    except Exception:  # Whatever it was: the loop will say it with one point at a time.
        return False
