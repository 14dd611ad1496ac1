"""Frozen functions and classes: a copy with all that they refer to, and a digest of it.

The copy of a user's function is compiled, so the cache has under a digest exactly the code that was digested: after an
edit anywhere, or when a global changes, the digest differs. Functions of this package are digested, not copied.
"""

import builtins
import collections
import contextlib
import dis
import enum
import functools
import hashlib
import operator
import os
import sys
import types
from collections.abc import Callable, Iterator
from importlib.metadata import version
from typing import Any

import numpy as np

Function = Callable[..., Any]
_PLAIN = (bool, int, float, complex, str, bytes, type(None), type(...), range)
# Modules that are identified by their version; others are identified by the parts that the function uses.
_PYTHON = ".".join(map(str, sys.version_info[:3]))
_VERSIONS = {**dict.fromkeys(sys.stdlib_module_names, _PYTHON), "numpy": np.__version__}
_KNOWN = {*_VERSIONS, "numba"}
_PACKAGE, _TRACER = __name__.partition(".")[0], __name__.rpartition(".")[0]
_CODE = operator.attrgetter(
    "co_code", "co_exceptiontable", "co_flags", "co_names", "co_varnames", "co_freevars", "co_cellvars", "co_argcount",
    "co_kwonlyargcount", "co_posonlyargcount",
)  # fmt: skip
_CONSTANTS, _LOAD_GLOBAL, _LOAD_NAME = frozenset(dis.hasconst), dis.opmap["LOAD_GLOBAL"], dis.opmap["LOAD_NAME"]
# Other classes by which functions are chosen.
_DISPATCHED = (type(None), float, object)


# The attributes of a named tuple, and the modules that Python gives for its functions.
_NAMED_TUPLE = dir(collections.namedtuple("_NAMED_TUPLE", ()))
_NAMED_TUPLES = ("collections", "namedtuple_")
_ONE: Any = collections.namedtuple("_ONE", "field")
# The fields and slots of a class, which are in its `_fields`.
_DESCRIPTORS = (types.MemberDescriptorType, types.GetSetDescriptorType, type(_ONE.field))


def _version_of(root: str) -> str:
    """Return the version of a top module, or nothing for this package."""
    return version(root) if root == "numba" else _VERSIONS.get(root, "")


class Frozen:
    """Copies of functions and of everything they refer to, and the digest of all of them together.

    Args:
        prepared: makes a copy callable in kernels, if needed.
        package: stands for objects of this package with an unknown value; None: all of this package is identified by
            its names.
    """

    def __init__(
        self, prepared: Callable[[Function], Function] = lambda copy: copy, package: str | None = None
    ) -> None:
        self._prepared, self._package = prepared, package
        self._hash = hashlib.sha256()
        self._copies: dict[Function, Function] = {}
        self._numbers: dict[Function, int] = {}
        self._classes: list[type] = []
        self.is_known = True

    def digest(self) -> str:
        """Return 16 hexadecimal digits for all that was frozen so far."""
        return self._hash.hexdigest()[:16]

    def function(self, function: Function) -> Function:
        """Return a copy of a function."""
        function = getattr(function, "py_func", function)
        assert isinstance(function, types.FunctionType)
        own = _is_own(function)
        if hasattr(function, "in_kernels"):
            self.function(function.in_kernels)
            return function
        if function in self._copies:
            self.add("again", self._numbers[function])
            return self._copies[function]
        self._numbers[function] = len(self._numbers)
        code = function.__code__
        # Numba looks up the module of a function by this name when it loads a kernel.
        scope: dict[str, Any] = {"__name__": __name__, "__builtins__": builtins}
        cells = tuple(types.CellType() for _ in code.co_freevars)
        copy = self._copies[function] = types.FunctionType(code, scope, function.__name__, None, cells or None)
        if own:
            self._copies[function] = function
        names, text = _text_of_code(code)
        self._hash.update(text)
        copy.__defaults__ = self.value(function.__defaults__, own=own)
        self.add(*sorted((function.__kwdefaults__ or {}).items()))
        copy.__kwdefaults__ = function.__kwdefaults__
        for cell, original in zip(cells, function.__closure__ or (), strict=True):
            # A cell is empty while the name has no value: its use fails as in the original.
            with contextlib.suppress(ValueError):
                cell.cell_contents = self.value(original.cell_contents, code, own)
        for name in names:
            self.add("global", name)
            if name in function.__globals__:
                scope[name] = self.value(function.__globals__[name], code, own)
        return function if own else self._prepared(copy)

    def value(self, value: Any, code: types.CodeType | None = None, own: bool = False) -> Any:
        """Return a copy of a value that a function refers to.

        Args:
            value: any object.
            code: the code with the names of a module that count; None: a module is unknown.
            own: whether code of this package refers to it.
        """
        if type(value) in _PLAIN or isinstance(value, np.generic):
            self.add(type(value).__name__, value)
        elif isinstance(value, tuple) and (type(value) is tuple or hasattr(value, "_fields")):
            self.add(type(value).__name__, len(value))
            if type(value) is not tuple:
                self._class(type(value))
            parts = [self.value(part, code, own) for part in value]
            return tuple(parts) if type(value) is tuple else type(value)(*parts)
        elif isinstance(value, np.ndarray) and not value.dtype.hasobject:
            self.add("array", value.dtype.str, value.shape, value.strides, value.tobytes())
            return value.copy(order="K")
        elif isinstance(value, type) and (issubclass(value, tuple) or value in _DISPATCHED):
            self._class(value)
        elif self._is_by_name(value):
            self.add("known", _root(value), getattr(value, "__name__", repr(value)), _version_of(_root(value)))
        elif isinstance(getattr(value, "py_func", value), types.FunctionType):
            return self.function(value)
        elif isinstance(value, types.ModuleType) and code is not None:
            return self._module(value, code, own)
        elif isinstance(value, enum.EnumType):
            members: Any = value.__members__
            self.add("enum", *(f"{name} {one.value!r}" for name, one in members.items()))
        else:
            self._object(value, code, own)
        return value

    def _object(self, value: Any, code: types.CodeType | None, own: bool) -> None:
        """Add any other object: code of this package refers to it by its class and its attributes."""
        if own and _is_own(type(value)) and hasattr(value, "__dict__"):
            self._class(type(value))
            self.value(tuple(sorted(vars(value).items())), code, own)
        elif own and self._package:
            self.add("package", self._package)
        else:
            # Nothing is known about it: the digest never repeats.
            self.add("unknown", os.urandom(16))
            self.is_known = False

    def _class(self, made: type) -> None:
        """Add a class: Numba takes its fields, and traces the definitions in it and its parents."""
        if made in self._classes:
            return self.add("class again", self._classes.index(made))
        self._classes.append(made)
        for parent in made.__mro__:
            self.add("class", parent.__module__, parent.__qualname__, getattr(parent, "_fields", None))
            self.value(tuple(getattr(parent, "_field_defaults", {}).values()), own=_is_own(parent))
            if not self._is_by_name(parent):
                for name, definition in sorted(vars(parent).items()):
                    self._member(parent, name, definition)
        return None

    def _is_by_name(self, value: Any) -> bool:
        """Whether a thing is identified by its name: by its version, or as code of this package that counts elsewhere.

        The name of the cache's folder follows from the code of the tracer and the versions of its tools.
        """
        if _root(value) in _KNOWN:
            return True
        return _root(value) == _PACKAGE and (self._package is None or _module_of(value).startswith(_TRACER))

    def _member(self, parent: type, name: str, definition: Any) -> None:
        """Add a method, property or constant of a class."""
        given = getattr(definition, "fget", None) or getattr(definition, "__func__", definition)
        is_own = _root(parent) == _PACKAGE
        is_function = isinstance(given, types.FunctionType)
        is_of_tuples = _module_of(given).startswith(_NAMED_TUPLES) if is_function else name in _NAMED_TUPLE
        # Python and tools write such data into a class, such as `copyreg` when an object of it is copied or pickled.
        is_for_tools = is_own and not is_function and name.startswith("__") and name.endswith("__")
        if is_of_tuples or is_for_tools:
            return
        if is_function or isinstance(given, _PLAIN):
            self.add("definition", name)
            self.value(given)
        elif is_own and not isinstance(given, _DESCRIPTORS):
            self.add("definition", name)
            self.value(given, own=True)

    def _module(self, module: types.ModuleType, code: types.CodeType, own: bool) -> types.ModuleType:
        copy = types.ModuleType(module.__name__)
        self.add("module", module.__name__)
        for name in sorted({name for part in _parts(code) for name in part.co_names}):
            if hasattr(module, name):
                self.add(name)
                setattr(copy, name, self.value(getattr(module, name), code, own))
        return copy

    def add(self, *parts: Any) -> None:
        """Add the printed form of parts."""
        for part in parts:
            self._hash.update(_text_of(part))


def _text_of(part: Any) -> bytes:
    """Return the printed form of a part, with its length, so that two parts are never taken for one."""
    text = repr(part).encode()
    return b"%d:%b" % (len(text), text)


@functools.cache
def _text_of_code(code: types.CodeType) -> tuple[list[str], bytes]:
    """Return the names of globals of a function in order, and the text of its code: once in each process."""
    names, text = set[str](), b""
    for part in _parts(code):
        taken = _taken(part, names)
        shown = (sorted(map(repr, one)) if isinstance(one, frozenset) else one for one in taken)
        text += b"".join(map(_text_of, (*_CODE(part), *shown)))
    return sorted(names), text


def _taken(code: types.CodeType, names: set[str]) -> list[Any]:
    """Return the constants that instructions use, which exclude docstrings; add the names of globals to `names`.

    `co_names` also has the names of attributes. Reading the bytes takes a tenth of the time of `dis`.
    """
    constants, extended, raw = set[int](), 0, code.co_code
    for operation, last in zip(raw[::2], raw[1::2], strict=True):
        argument = last | extended
        extended = argument << 8 if operation == dis.EXTENDED_ARG else 0
        if operation in _CONSTANTS:
            constants.add(argument)
        elif operation == _LOAD_GLOBAL:
            names.add(code.co_names[argument >> 1])  # the last bit is about the stack
        elif operation == _LOAD_NAME:
            names.add(code.co_names[argument])
    taken = (code.co_consts[k] for k in sorted(constants))
    return [one for one in taken if not isinstance(one, types.CodeType)]


def _parts(code: types.CodeType) -> Iterator[types.CodeType]:
    """Yield the code and that of the functions inside it."""
    yield code
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            yield from _parts(constant)


def _is_own(value: Any) -> bool:
    return _root(value) == _PACKAGE


def _root(value: Any) -> str:
    """Return the top module of a value."""
    return _module_of(value).partition(".")[0]


def _module_of(value: Any) -> str:
    """Return the module that identifies a value, or nothing if its module does not."""
    if isinstance(value, (type, types.FunctionType)):  # the usual case
        return str(getattr(value, "__module__", ""))
    if isinstance(value, np.ufunc) and getattr(np, value.__name__, None) is value:
        return "numpy"
    if isinstance(value, types.ModuleType):
        return value.__name__
    if isinstance(value, types.BuiltinFunctionType) and isinstance(value.__self__, type):
        return value.__self__.__module__  # `tuple.__new__`
    # The module of an instance does not describe its value; NumPy's functions have a class of their own.
    named = isinstance(value, types.BuiltinFunctionType)
    named = named or (callable(value) and type(value).__module__.split(".")[0] == "numpy")
    return str(getattr(value, "__module__", "")) if named else ""
