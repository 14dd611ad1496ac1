"""The code of a surface by functions: frozen copies of them, and a class of numbers with their digest as its name.

Kernels are compiled for a class and found in the cache by its name. The frozen copy is compiled, and the digest covers
all it refers to: after an edit anywhere, or when a global changes, the class is another one.
"""

import collections
from collections.abc import Callable
from typing import Any

import numpy as np

from ...common import checks
from ...errors import SceneError
from ...kernel.frozen import Frozen
from ...kernel.jit import allocating, inlined
from ...kernel.vector import Symmetric, Vec
from .numbers import OwnNumbers

Function = Callable[..., Any]

_classes: dict[str, Any] = {}


def class_of(
    parameters: Any,
    phi: Function,
    gradient: Function,
    hessian: Function | None = None,
    along: tuple[Function | None, ...] = (),
    base: Any = OwnNumbers,
) -> Any:
    """The class of numbers by which kernels call these functions; `along` are the coefficients of phi along flights.

    The first of `along` is for straight flights, the second for falls.

    Raises:
        SceneError: they are not functions of (parameters, x, y, z), or the parameters are no NamedTuple of numbers.
    """
    names = getattr(parameters, "_fields", None if parameters != () else ())
    if not isinstance(parameters, tuple) or names is None:
        raise SceneError(f"parameters must be a NamedTuple of numbers, got {parameters!r}")
    for name, value in zip(names, parameters, strict=True):
        checks.number(f"parameters.{name}", value)
    frozen = Frozen(inlined)
    frozen.value(names)
    copies: list[Function | None] = []
    for name, function in (("phi", phi), ("gradient", gradient), ("hessian", hessian)):
        if function is not None:
            _check_function(name, function)
            copies.append(frozen.function(function))
    frozen.value(base.__name__)
    copies += [None if function is None else frozen.function(function) for function in along]
    name = f"Own_{frozen.digest()}"
    if name not in _classes:
        made: Any = type(OwnNumbers)(  # type: ignore[misc]
            name, (base,), {"__module__": __name__, **_methods(names, *copies)}
        )
        # Two threads that ask at the same time get the same class.
        _classes.setdefault(name, made)
    return _classes[name]


def _check_function(name: str, function: Any) -> None:
    code = getattr(getattr(function, "py_func", function), "__code__", None)
    if code is None:
        raise SceneError(f"{name} must be a Python function of (parameters, x, y, z), got {function!r}")
    if code.co_argcount != 4 or code.co_kwonlyargcount or code.co_flags & 0x0C:
        names = ", ".join(code.co_varnames[: code.co_argcount])
        raise SceneError(f"{name} must be a function of (parameters, x, y, z), got one of ({names})")


def _methods(
    names: tuple[str, ...],
    phi: Any,
    gradient: Any,
    hessian: Function | None = None,
    along: Function | None = None,
    along_fall: Function | None = None,
) -> dict[str, Function]:
    """Return the methods of the class of numbers."""
    value, slope = _taking_arrays(phi, 1), _taking_arrays(gradient, 3)
    # Another process does not find a user's own class: the functions get their parameters as a class that it finds.
    make = collections.namedtuple("Parameters", names)  # type: ignore[misc]

    def own(surface):
        return make(*surface.parameters) if names else surface.parameters

    def phi_of(self, r):
        d = r - self.center
        return value(own(self), d.x, d.y, d.z)

    def gradient_of(self, r):
        d = r - self.center
        gx, gy, gz = slope(own(self), d.x, d.y, d.z)
        # A user may return whole numbers.
        return Vec(1.0 * gx, 1.0 * gy, 1.0 * gz)

    def hessian_of(self, r):
        d = r - self.center
        return Symmetric(*hessian(own(self), d.x, d.y, d.z))  # type: ignore[misc]

    def along_of(self, r, v):
        d = r - self.center
        return along(own(self), d.x, d.y, d.z, v.x, v.y, v.z)  # type: ignore[misc]

    def along_fall_of(self, r, v, half_pull):
        d, a = r - self.center, half_pull
        return along_fall(own(self), d.x, d.y, d.z, v.x, v.y, v.z, a.x, a.y, a.z)  # type: ignore[misc]

    methods: dict[str, Function] = {"phi": phi_of, "gradient": gradient_of}
    methods |= {} if hessian is None else {"hessian": hessian_of}
    methods |= {} if along is None else {"along": along_of}
    return methods if along_fall is None else {**methods, "along_fall": along_fall_of}


# --- Arrays of points in plain Python --------------------------------------------------------------------


def _taking_arrays(function: Function, count: int) -> Function:
    """Return the function, of `count` results, which in plain Python takes arrays of points too, however written."""
    takes_arrays: list[bool] = []

    def in_python(parameters, x, y, z):
        if np.ndim(x) == np.ndim(y) == np.ndim(z) == 0:
            return function(parameters, x, y, z)
        if not takes_arrays:
            takes_arrays.append(_takes_arrays(function, count, parameters, x, y, z))
        return function(parameters, x, y, z) if takes_arrays[0] else _one_by_one(function, count, parameters, x, y, z)

    def in_kernels(parameters, x, y, z):
        return function(parameters, x, y, z)

    return allocating(in_python, in_kernels)


def _one_by_one(function: Function, count: int, parameters: Any, *rows: Any) -> Any:
    """Call the function at one point at a time; NaN where it has no value."""
    nothing = np.nan if count == 1 else (np.nan,) * count

    def at(*point: Any) -> Any:
        try:
            return function(parameters, *point)
        except (ArithmeticError, ValueError):
            return nothing

    rows = np.broadcast_arrays(*rows)
    values = np.array([at(*point) for point in zip(*(row.flat for row in rows), strict=True)], dtype=np.float64)
    values = values.reshape(-1, count).T.reshape(count, *rows[0].shape)
    return values[0] if count == 1 else tuple(values)


def _takes_arrays(function: Function, count: int, parameters: Any, *rows: Any) -> bool:
    """Whether the function computes the same with arrays as with numbers, and leaves its arguments unchanged."""
    few = [np.resize(row, 3) for row in np.broadcast_arrays(*rows)]
    for row in few:
        row.flags.writeable = False
    try:
        with np.errstate(all="ignore"):
            whole = function(parameters, *few)
            together = np.broadcast_arrays(*(whole if count > 1 else (whole,)), few[0])[:count]
            return np.allclose(together, _one_by_one(function, count, parameters, *few), rtol=1e-9, equal_nan=True)
    except Exception:  # Any error: a call at one point at a time reports it.
        return False
