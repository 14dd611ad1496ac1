"""Proxies of the values of a kernel: an operation on them is noted, and Numba gives the type of its result."""

import functools
import operator
from collections.abc import Iterable
from typing import Any

import numpy as np
from numba import typeof, types
from numba.core.datamodel.registry import default_manager
from numba.core.errors import NumbaError
from numba.core.typing.templates import Signature

from .notes import Attribute, Call, Element, add, context


class TraceError(Exception):
    """A helper has an operation without notes; the text names it."""


class Value:
    """A number or an array of a kernel that is being traced: the part at a path of the value of a note."""

    __slots__ = ("kind", "note", "path")
    __hash__ = None  # type: ignore[assignment]
    # Without it an operator of NumPy's numbers takes it for an array.
    __array_ufunc__ = None

    def __init__(self, kind: Any, note: Any, path: tuple[int, ...]) -> None:
        self.kind, self.note, self.path = kind, note, path

    def _unknown(self, *_: Any) -> Any:
        raise TraceError("it asks for a number that is known in the kernel only")

    __bool__ = __float__ = __int__ = __index__ = __iter__ = __len__ = _unknown

    def __getitem__(self, place: Any) -> Any:
        if not _is_element(self.kind, place):
            return noted(operator.getitem, self, place)
        return opened(self.kind.dtype, add(Element(self, place if isinstance(place, tuple) else (place,))))

    def __setitem__(self, place: Any, value: Any) -> None:
        if not _is_element(self.kind, place) or not is_number(value):
            noted(operator.setitem, self, place, value)
        else:
            add(Element(self, place if isinstance(place, tuple) else (place,), value))

    def __getattr__(self, name: str) -> Any:
        if name in _FIELDS and isinstance(self.kind, types.Array):
            # A part of the representation of an array in a kernel: there is nothing to note.
            number = _ARRAY.get_field_position(_FIELDS[name])
            kind: Any = types.UniTuple(types.intp, self.kind.ndim) if name in ("shape", "strides") else types.intp
            return opened(kind, self.note, (*self.path, number))
        kind = None if name.startswith("__") else context().resolve_getattr(self.kind, name)
        if kind is None:
            raise AttributeError(f"{self.kind} has no attribute {name}")
        if isinstance(kind, types.BoundFunction):
            return functools.partial(_method, self, kind)
        return opened(types.unliteral(kind), add(Attribute(self, name, kind)))

    def __pow__(self, exponent: Any) -> Any:
        if type(exponent) is int and 0 <= exponent <= _MOST_PRODUCTS:
            return _product(self, exponent)
        return noted(operator.pow, self, exponent)

    def __rpow__(self, base: Any) -> Any:
        return noted(operator.pow, base, self)


def _is_element(kind: Any, place: Any) -> bool:
    """Whether a place in an array is that of one number."""
    if not isinstance(kind, types.Array) or not isinstance(kind.dtype, (types.Number, types.Boolean)):
        return False
    places = place if isinstance(place, tuple) else (place,)
    return len(places) == kind.ndim and all(map(_is_index, places))


def _is_index(place: Any) -> bool:
    if isinstance(place, Value):
        return isinstance(place.kind, types.Integer)
    return isinstance(place, (int, np.integer)) and not isinstance(place, bool) and bool(place >= 0)


def _method(of: Value, kind: Any, *given: Any) -> Any:
    """Note the call of a method of an array; return its result."""
    return _result(Call(kind, _signature(kind, kind, tuple(map(kind_of, given))), (of, *given)))


class Real(Value):
    """A floating-point number: helpers are chosen by this class."""

    __slots__ = ()


_MOST_PRODUCTS = 64
_INTS = np.iinfo(np.int64)
_FIELDS = {"shape": "shape", "strides": "strides", "size": "nitems"}
_ARRAY = default_manager[types.Array(types.float64, 1, "C")]


def _product(base: Any, exponent: int) -> Any:
    """Return a power with an integer exponent, in the order in which Numba multiplies."""
    result, factor = 1.0 if isinstance(base.kind, types.Float) else 1, base
    while exponent:
        if exponent & 1:
            result = factor * result if isinstance(result, Value) else factor
        exponent >>= 1
        if exponent:
            factor = factor * factor
    return result


def _two_sided(name: str, symbol: Any) -> None:
    def forward(a: Any, b: Any) -> Any:
        return NotImplemented if isinstance(b, tuple) else noted(symbol, a, b)

    def reflected(a: Any, b: Any) -> Any:
        return noted(symbol, b, a)

    setattr(Value, f"__{name}__", forward)
    setattr(Value, f"__r{name}__", reflected)


def _one_sided(name: str, symbol: Any) -> None:
    setattr(Value, f"__{name}__", lambda *given: noted(symbol, *given))


for _name in ("add", "sub", "mul", "truediv", "floordiv", "mod", "lshift", "rshift", "xor", "and_", "or_"):
    _two_sided(_name.rstrip("_"), getattr(operator, _name))
for _name in ("lt", "le", "gt", "ge", "eq", "ne", "neg", "pos", "invert"):
    _one_sided(_name, getattr(operator, _name))
_one_sided("abs", abs)


class _Undefined:
    """A variable without a value, or with values of several kinds."""

    def __repr__(self) -> str:
        return "a variable without one value"

    def _used(self, *_: Any) -> Any:
        raise TraceError("a variable may be used before it has a value, or has values of several kinds")

    __bool__ = __eq__ = _used  # type: ignore[assignment]
    __hash__ = None  # type: ignore[assignment]


UNDEFINED = _Undefined()


def is_number(value: Any) -> bool:
    """Whether a value is a number of a kernel, known or not, which a slot can hold."""
    return isinstance(value, (Value, bool, int, float, np.generic))


def has_value(given: Any) -> bool:
    """Whether it contains a proxy."""
    if isinstance(given, (tuple, list)):
        return any(map(has_value, given))
    if isinstance(given, slice):
        return has_value((given.start, given.stop, given.step))
    return isinstance(given, Value)


def kind_of(value: Any) -> Any:
    """Return the type in a kernel of a constant, a proxy, or a record of them."""
    if isinstance(value, Value):
        return value.kind
    if value is None:
        return types.none
    if isinstance(value, bool):
        return types.boolean
    if isinstance(value, int):
        if not _INTS.min <= value <= _INTS.max:
            raise TraceError("an int that is known has more than 64 bits")
        return types.intp
    if type(value) is float:
        return types.float64
    if isinstance(value, tuple):
        made = None if type(value) is tuple else type(value)
        return types.BaseTuple.from_types([kind_of(part) for part in value], made)
    if isinstance(value, _Undefined):
        raise TraceError("a variable may be used before it has a value, or has values of several kinds")
    try:
        return types.unliteral(typeof(value))
    except (ValueError, NumbaError):
        raise TraceError(f"it uses {value!r:.60}, which no kernel has") from None


def is_defined(value: Any) -> bool:
    """Whether every part of a value has one value."""
    if isinstance(value, tuple):
        return all(map(is_defined, value))
    return not isinstance(value, _Undefined)


def leaves(value: Any) -> list[Any]:
    """Return the parts of a record, in order."""
    return [leaf for part in value for leaf in leaves(part)] if isinstance(value, tuple) else [value]


def made_of(value: Any, parts: Iterable[Any]) -> Any:
    """Return a tuple of the class of another."""
    return tuple(parts) if type(value) is tuple else tuple.__new__(type(value), parts)


def opened(kind: Any, note: Any, path: tuple[int, ...] = ()) -> Any:
    """Return a value of a kernel as a record of proxies."""
    if isinstance(kind, types.NoneType):
        return None
    if isinstance(kind, types.BaseTuple):
        parts = [opened(part, note, (*path, k)) for k, part in enumerate(kind.types)]  # type: ignore[attr-defined]
        made = getattr(kind, "instance_class", tuple)
        return tuple(parts) if made is tuple else tuple.__new__(made, parts)
    if isinstance(kind, types.NumberClass):
        return np.dtype(str(kind.dtype)).type
    kind = types.unliteral(kind)
    return (Real if isinstance(kind, types.Float) else Value)(kind, note, path)


# --- Noting ----------------------------------------------------------------------------------------------


_signatures: dict[Any, tuple[Any, Any]] = {}


def noted(symbol: Any, *given: Any) -> Any:
    """Note an operation that Numba knows; return its result as proxies."""
    given = tuple(map(_sliced, given))
    key = symbol, tuple(map(kind_of, given))
    if key not in _signatures:
        try:
            kind = context().resolve_value_type(symbol)
        except Exception as error:
            raise TraceError(f"{name_of(symbol)} is nothing that a kernel has") from error
        _signatures[key] = kind, _signature(symbol, kind, key[1])
    return _result(Call(*_signatures[key], given))


def _signature(symbol: Any, kind: Any, kinds: tuple[Any, ...]) -> Signature:
    try:
        signature, cause = context().resolve_function_type(kind, kinds, {}), None
    except Exception as error:
        signature, cause = None, error
    if signature is None:
        raise TraceError(f"there is no {name_of(symbol)} of {', '.join(map(str, kinds))}") from cause
    return signature  # type: ignore[no-any-return]


def _result(note: Call) -> Any:
    return opened(types.unliteral(note.signature.return_type), add(note))


def _sliced(given: Any) -> Any:
    """Return slices as values of a kernel."""
    if isinstance(given, slice):
        parts = (given.start, given.stop) if given.step is None else (given.start, given.stop, given.step)
        return noted(slice, *parts)
    if isinstance(given, tuple) and any(isinstance(part, slice) for part in given):
        return tuple(map(_sliced, given))
    return given


def name_of(symbol: Any) -> str:
    """Return the name of an operation, for a message."""
    return getattr(symbol, "__name__", str(symbol))
