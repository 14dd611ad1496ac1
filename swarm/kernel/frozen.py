"""A user's function, frozen: a copy of it and of all it refers to, and a digest of them; likewise a class.

The copy is compiled, so what the cache has under a digest is the code that was digested: after an edit anywhere, or
when a global changes, the digest differs.
"""

import builtins
import collections
import contextlib
import dis
import hashlib
import operator
import os
import types
from collections.abc import Callable, Iterator
from typing import Any

import numba
import numpy as np

Function = Callable[..., Any]
_PLAIN = (bool, int, float, complex, str, bytes, type(None), type(...), range)
# Modules that are known by their version; any other is known by what the function takes from it. The cache folder is
# named by the code of this package's kernels.
_VERSIONS = {"math": "", "cmath": "", "builtins": "", "numpy": np.__version__, "numba": numba.__version__, "swarm": ""}
_CODE = operator.attrgetter(
    "co_code", "co_exceptiontable", "co_flags", "co_names", "co_varnames", "co_freevars", "co_cellvars", "co_argcount",
    "co_kwonlyargcount", "co_posonlyargcount",
)  # fmt: skip
# Other classes that functions are chosen by.
_DISPATCHED = (type(None), float, object)


_NAMED_TUPLE = dir(collections.namedtuple("_NAMED_TUPLE", ()))


class Frozen:
    """Copies of functions and of everything they refer to, and the digest of all of them together.

    Args:
        prepared: makes a copy callable in kernels, if needed.
    """

    def __init__(self, prepared: Callable[[Function], Function] = lambda copy: copy) -> None:
        self._prepared = prepared
        self._hash = hashlib.sha256()
        self._copies: dict[Function, Function] = {}
        self._classes: list[type] = []
        self.is_known = True

    def digest(self) -> str:
        """16 hexadecimal digits of what was frozen so far."""
        return self._hash.hexdigest()[:16]

    def function(self, function: Function) -> Function:
        """A copy of a function."""
        function = getattr(function, "py_func", function)
        assert isinstance(function, types.FunctionType)
        if function in self._copies:
            self.add("again", list(self._copies).index(function))
            return self._copies[function]
        code = function.__code__
        # Numba looks up the module of a function by this name when it loads a kernel.
        scope: dict[str, Any] = {"__name__": __name__, "__builtins__": builtins}
        cells = tuple(types.CellType() for _ in code.co_freevars)
        copy = self._copies[function] = types.FunctionType(code, scope, function.__name__, None, cells or None)
        for part in _parts(code):
            constants = [one for one in part.co_consts if not isinstance(one, types.CodeType)]
            self.add(*_CODE(part))
            self.add(*(sorted(map(repr, one)) if isinstance(one, frozenset) else one for one in constants))
        copy.__defaults__ = self.value(function.__defaults__)
        self.add(*sorted((function.__kwdefaults__ or {}).items()))
        copy.__kwdefaults__ = function.__kwdefaults__
        for cell, original in zip(cells, function.__closure__ or (), strict=True):
            # A cell is empty while the name has no value: its use fails as in the original.
            with contextlib.suppress(ValueError):
                cell.cell_contents = self.value(original.cell_contents, code)
        # co_names has the names of attributes too.
        instructions = (one for part in _parts(code) for one in dis.get_instructions(part))
        for name in sorted({one.argval for one in instructions if one.opname in ("LOAD_GLOBAL", "LOAD_NAME")}):
            self.add("global", name)
            if name in function.__globals__:
                scope[name] = self.value(function.__globals__[name], code)
        return self._prepared(copy)

    def value(self, value: Any, code: types.CodeType | None = None) -> Any:
        """A copy of what a function refers to; `code` says which of a module's names it takes."""
        if type(value) in _PLAIN or isinstance(value, np.generic):
            self.add(type(value).__name__, value)
        elif isinstance(value, tuple) and (type(value) is tuple or hasattr(value, "_fields")):
            self.add(type(value).__name__, getattr(value, "_fields", None), len(value))
            parts = [self.value(part, code) for part in value]
            return tuple(parts) if type(value) is tuple else type(value)(*parts)
        elif isinstance(value, np.ndarray) and not value.dtype.hasobject:
            self.add("array", value.dtype.str, value.shape, value.strides, value.tobytes())
            return value.copy(order="K")
        elif isinstance(value, type) and (issubclass(value, tuple) or value in _DISPATCHED):
            self._class(value)
        elif _root(value) in _VERSIONS:
            self.add("known", _root(value), getattr(value, "__name__", repr(value)), _VERSIONS[_root(value)])
        elif isinstance(getattr(value, "py_func", value), types.FunctionType):
            return self.function(value)
        elif isinstance(value, types.ModuleType) and code is not None:
            return self._module(value, code)
        else:
            # Nothing is known about it: a digest that never repeats.
            self.add("unknown", os.urandom(16))
            self.is_known = False
        return value

    def _class(self, made: type) -> None:
        """Of a class Numba takes the fields, and traces what is defined in it and its parents."""
        if made in self._classes:
            return self.add("class again", self._classes.index(made))
        self._classes.append(made)
        for parent in made.__mro__:
            self.add("class", parent.__module__, parent.__qualname__, getattr(parent, "_fields", None))
            self.value(tuple(getattr(parent, "_field_defaults", {}).values()))
            # Those of this package are in its code.
            if _root(parent) not in _VERSIONS:
                for name, definition in sorted(vars(parent).items()):
                    self._member(name, definition)
        return None

    def _member(self, name: str, definition: Any) -> None:
        """A method, property or constant of a class."""
        given = getattr(definition, "fget", None) or getattr(definition, "__func__", definition)
        if name not in _NAMED_TUPLE and isinstance(given, (types.FunctionType, *_PLAIN)):
            self.add("definition", name)
            self.value(given)

    def _module(self, module: types.ModuleType, code: types.CodeType) -> types.ModuleType:
        copy = types.ModuleType(module.__name__)
        self.add("module", module.__name__)
        for name in sorted({name for part in _parts(code) for name in part.co_names}):
            if hasattr(module, name):
                self.add(name)
                setattr(copy, name, self.value(getattr(module, name), code))
        return copy

    def add(self, *parts: Any) -> None:
        """Add parts by what they print."""
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
