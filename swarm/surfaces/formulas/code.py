"""The code of a surface by functions: frozen copies of them, and a class of numbers that is named by their digest.

Kernels are compiled for a class and found in the cache by its name. What is compiled is the frozen copy, and the digest
covers all it refers to: after an edit anywhere, or when a global changes, the class is another one.
"""

import builtins
import collections
import contextlib
import dis
import hashlib
import operator
import os
import re
import sys
import types
from collections.abc import Callable, Iterator
from typing import Any

import numba
import numpy as np
from numba.extending import overload

from ... import checks
from ...errors import SceneError
from ...kernel.jit import _INLINE, inlined
from ...kernel.vector import Symmetric, Vec
from .. import contract
from .march import OwnNumbers

Function = Callable[..., Any]

_NAME = re.compile(r"Own_[0-9a-f]{16}\Z")
_registered: set[str] = set()


def __getattr__(name: str) -> Any:
    """The class of a code by its name.

    The index of the kernel cache names the classes of all processes that share it, and loading it asks for them here.
    """
    if not _NAME.match(name):
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    made = type(name, (OwnNumbers,), {"__module__": __name__, "__qualname__": name, "__slots__": ()})
    # Two threads that ask at the same time get the same class.
    return globals().setdefault(name, made)


def class_of(parameters: Any, phi: Function, gradient: Function, hessian: Function | None = None) -> Any:
    """The class of numbers whose kernels call these functions.

    Raises:
        SceneError: they are not functions of (parameters, x, y, z), or the parameters are no NamedTuple of numbers.
    """
    names = getattr(parameters, "_fields", None if parameters != () else ())
    if not isinstance(parameters, tuple) or names is None:
        raise SceneError(f"parameters must be a NamedTuple of numbers, got {parameters!r}")
    for name, value in zip(names, parameters, strict=True):
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
        _register(kind, names, *copies)
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
    kind: Any, names: tuple[str, ...], phi: Function, gradient: Function, hessian: Function | None = None
) -> None:
    value, slope = _taking_arrays(phi, 1), _taking_arrays(gradient, 3)
    # A class of the user's is not found by another process: the functions get their parameters in one that is.
    make = collections.namedtuple("Parameters", names)  # type: ignore[misc]
    of = inlined(lambda surface: make(*surface.parameters)) if names else inlined(lambda surface: surface.parameters)

    @contract.phi.register(kind)
    def _(surface, r):
        d = r - surface.center
        return value(of(surface), d.x, d.y, d.z)

    @contract.gradient.register(kind)
    def _(surface, r):
        d = r - surface.center
        gx, gy, gz = slope(of(surface), d.x, d.y, d.z)
        # A user may return whole numbers.
        return Vec(1.0 * gx, 1.0 * gy, 1.0 * gz)

    if hessian is not None:

        @contract.hessian.register(kind)
        def _(surface, r):
            d = r - surface.center
            return Symmetric(*hessian(of(surface), d.x, d.y, d.z))


# --- Arrays of points in plain Python --------------------------------------------------------------------


def _taking_arrays(function: Function, count: int) -> Function:
    """The function, of `count` results, which in plain Python takes arrays of points too, whatever it is made of."""
    takes_arrays: list[bool] = []

    def in_python(parameters, x, y, z):
        if np.ndim(x) == np.ndim(y) == np.ndim(z) == 0:
            return function(parameters, x, y, z)
        if not takes_arrays:
            takes_arrays.append(_takes_arrays(function, count, parameters, x, y, z))
        return function(parameters, x, y, z) if takes_arrays[0] else _one_by_one(function, count, parameters, x, y, z)

    def in_kernels(parameters, x, y, z):
        return function(parameters, x, y, z)

    # What a user writes may make arrays.
    options: Any = {**_INLINE, "_nrt": True}
    overload(in_python, jit_options=options)(lambda parameters, x, y, z: in_kernels)
    return in_python


def _one_by_one(function: Function, count: int, parameters: Any, *rows: Any) -> Any:
    """The function at one point at a time; NaN where it has no value."""
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
    """Whether the function computes with arrays what it computes with numbers, and leaves its arguments alone."""
    few = [np.resize(row, 3) for row in np.broadcast_arrays(*rows)]
    for row in few:
        row.flags.writeable = False
    try:
        with np.errstate(all="ignore"):
            whole = function(parameters, *few)
            together = np.broadcast_arrays(*(whole if count > 1 else (whole,)), few[0])[:count]
            return np.allclose(together, _one_by_one(function, count, parameters, *few), rtol=1e-9, equal_nan=True)
    except Exception:  # Whatever it was: one point at a time will say it.
        return False


# --- Frozen functions ------------------------------------------------------------------------------------

_PLAIN = (bool, int, float, complex, str, bytes, type(None), type(...), range)
# Modules that are known by their version; any other is known by what the function takes from it. The cache folder is
# named by a hash of this package.
_VERSIONS = {"math": "", "cmath": "", "builtins": "", "numpy": np.__version__, "numba": numba.__version__, "swarm": ""}
_CODE = operator.attrgetter(
    "co_code", "co_exceptiontable", "co_flags", "co_names", "co_varnames", "co_freevars", "co_cellvars", "co_argcount",
    "co_kwonlyargcount", "co_posonlyargcount",
)  # fmt: skip


class Frozen:
    """Copies of functions and of everything they refer to, and the digest of all of them together."""

    def __init__(self) -> None:
        self._hash = hashlib.sha256()
        self._copies: dict[Function, Function] = {}

    def digest(self) -> str:
        """16 hexadecimal digits of what was frozen so far."""
        return self._hash.hexdigest()[:16]

    def function(self, function: Function) -> Function:
        """A copy of a function, which kernels can call."""
        function = getattr(function, "py_func", function)
        assert isinstance(function, types.FunctionType)
        if function in self._copies:
            self._add("again", list(self._copies).index(function))
            return self._copies[function]
        code = function.__code__
        # Numba finds the module of a function again by this name when it loads a kernel.
        scope: dict[str, Any] = {"__name__": __name__, "__builtins__": builtins}
        cells = tuple(types.CellType() for _ in code.co_freevars)
        copy = self._copies[function] = types.FunctionType(code, scope, function.__name__, None, cells or None)
        for part in _parts(code):
            constants = [one for one in part.co_consts if not isinstance(one, types.CodeType)]
            self._add(*_CODE(part))
            self._add(*(sorted(map(repr, one)) if isinstance(one, frozenset) else one for one in constants))
        copy.__defaults__ = self.value(function.__defaults__)
        self._add(*sorted((function.__kwdefaults__ or {}).items()))
        copy.__kwdefaults__ = function.__kwdefaults__
        for cell, original in zip(cells, function.__closure__ or (), strict=True):
            # A cell is empty where the name has no value yet: its use fails as it would have.
            with contextlib.suppress(ValueError):
                cell.cell_contents = self.value(original.cell_contents, code)
        # The names in the code alone are those of attributes too.
        instructions = (one for part in _parts(code) for one in dis.get_instructions(part))
        for name in sorted({one.argval for one in instructions if one.opname in ("LOAD_GLOBAL", "LOAD_NAME")}):
            self._add("global", name)
            if name in function.__globals__:
                scope[name] = self.value(function.__globals__[name], code)
        return inlined(copy)

    def value(self, value: Any, code: types.CodeType | None = None) -> Any:
        """A copy of what a function refers to; `code` says which of a module's names it takes."""
        if type(value) in _PLAIN or isinstance(value, np.generic):
            self._add(type(value).__name__, value)
        elif isinstance(value, tuple) and (type(value) is tuple or hasattr(value, "_fields")):
            self._add(type(value).__name__, getattr(value, "_fields", None), len(value))
            parts = [self.value(part, code) for part in value]
            return tuple(parts) if type(value) is tuple else type(value)(*parts)
        elif isinstance(value, np.ndarray) and not value.dtype.hasobject:
            self._add("array", value.dtype.str, value.shape, value.strides, value.tobytes())
            return value.copy(order="K")
        elif _root(value) in _VERSIONS:
            self._add("known", _root(value), getattr(value, "__name__", repr(value)), _VERSIONS[_root(value)])
        elif isinstance(getattr(value, "py_func", value), types.FunctionType):
            return self.function(value)
        elif isinstance(value, types.ModuleType) and code is not None:
            return self._module(value, code)
        else:
            # Nothing is known of what it does: never the same again.
            self._add("unknown", os.urandom(16))
        return value

    def _module(self, module: types.ModuleType, code: types.CodeType) -> types.ModuleType:
        copy = types.ModuleType(module.__name__)
        self._add("module", module.__name__)
        for name in sorted({name for part in _parts(code) for name in part.co_names}):
            if hasattr(module, name):
                self._add(name)
                setattr(copy, name, self.value(getattr(module, name), code))
        return copy

    def _add(self, *parts: Any) -> None:
        # The length of each, so that two parts are never taken for one.
        for part in parts:
            text = repr(part).encode()
            self._hash.update(b"%d:" % len(text) + text)


def _parts(code: types.CodeType) -> Iterator[types.CodeType]:
    """The code and that of the functions inside it."""
    yield code
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            yield from _parts(constant)


def _root(value: Any) -> str:
    """The top module that something comes from."""
    if isinstance(value, np.ufunc) and getattr(np, value.__name__, None) is value:
        return "numpy"
    if isinstance(value, types.ModuleType):
        return value.__name__.split(".")[0]
    # Where an instance comes from says nothing about its value; NumPy's functions have a class of their own.
    named = isinstance(value, (type, types.FunctionType, types.BuiltinFunctionType))
    named = named or (callable(value) and type(value).__module__.split(".")[0] == "numpy")
    return str(getattr(value, "__module__", "")).split(".")[0] if named else ""
