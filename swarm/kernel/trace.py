"""Helpers of kernels run once in plain Python on proxies of numbers; what they do is noted, and emitted by `emit.py`.

Numba takes 40 ms of its own Python for each helper that it compiles, however small: a cone with friction had 520 of
them. Here the operations of a helper are noted in the function that calls it. What Python decides while a helper is
traced (dispatch on classes, `if law is None`, loops over tuples) leaves no note. What a kernel decides is a branch or a
loop among the notes: `twins.py` writes a helper's `if`, `for`, `while`, `and`, `or`, `not` as calls of a `Frame`.

Types and instructions of an operation are Numba's own, so that a kernel computes what it would compute if Numba
compiled the helper. What cannot be traced is compiled by Numba.
"""

import builtins
import contextlib
import functools
import itertools
import math
import operator
import threading
import types as python_types
from collections.abc import Callable, Iterable, Iterator
from typing import Any

import numpy as np
from numba import typeof, types
from numba.core.datamodel import default_manager
from numba.core.dispatcher import Dispatcher
from numba.core.typing.templates import Signature

from .twins import NotTraceable, twin_of

# Rounds of a loop that are written out: a loop over the parts of a composition, the axes, the corners of a cell.
UNROLLED = 8

_now = threading.local()


# --- What is noted ---------------------------------------------------------------------------------------


class Call:
    """An operation that Numba types and lowers."""

    __slots__ = ("given", "signature", "symbol")

    def __init__(self, symbol: Any, signature: Signature, given: tuple[Any, ...]) -> None:
        self.symbol, self.signature, self.given = symbol, signature, given


class Attribute:
    """An attribute of a value, such as the shape of an array."""

    __slots__ = ("kind", "name", "of")

    def __init__(self, of: "Value", name: str, kind: Any) -> None:
        self.of, self.name, self.kind = of, name, kind


class Element:
    """The element of an array, read where `value` is None."""

    __slots__ = ("array", "place", "value")

    def __init__(self, array: "Value", place: tuple[Any, ...], value: Any = None) -> None:
        self.array, self.place, self.value = array, place, value


class Slot:
    """A variable of a kernel, where several ways meet."""

    __slots__ = ("kind",)

    def __init__(self, kind: Any) -> None:
        self.kind = kind


class Assign:
    """Values for slots, at the end of a way; filled in when the others are known."""

    __slots__ = ("pairs",)

    def __init__(self) -> None:
        self.pairs: list[tuple[Slot, Any]] = []


class Load:
    """The value of a slot."""

    __slots__ = ("slot",)

    def __init__(self, slot: Slot) -> None:
        self.slot = slot


class Label:
    """A place that a way can go to."""

    __slots__ = ()


class Jump:
    """The end of a way, which goes on at a label."""

    __slots__ = ("to",)

    def __init__(self, to: Label) -> None:
        self.to = to


class Branch:
    """The end of a way, which goes on at one of two labels."""

    __slots__ = ("condition", "first", "second")

    def __init__(self, condition: "Value", first: Label, second: Label) -> None:
        self.condition, self.first, self.second = condition, first, second


class Argument:
    """An argument of a part."""

    __slots__ = ("kind", "number")

    def __init__(self, kind: Any, number: int) -> None:
        self.kind, self.number = kind, number


_part_numbers = itertools.count()


class Part:
    """A function of a kernel: the notes of a helper, its arguments and its result, a number each."""

    def __init__(self, name: str, inlined: bool) -> None:
        self.name, self.inlined, self.number = name, inlined, next(_part_numbers)
        self.arguments: list[Argument] = []
        self.notes: list[Any] = []
        self.result: Any = None
        self.kind: Any = None
        self.numbers: list[Value] = []

    def take(self, given: Any) -> Any:
        """The same with an argument in the place of every number that is not a type of its own."""
        if isinstance(given, tuple):
            return made_of(given, map(self.take, given))
        if not _is_argument(given):
            return given
        self.arguments.append(Argument(kind_of(given), len(self.arguments)))
        return opened(self.arguments[-1].kind, self.arguments[-1])

    def give(self, result: Any) -> None:
        """Its result: a constant of it stays one for who calls it."""
        self.result, self.numbers = result, [one for one in leaves(result) if isinstance(one, Value)]
        if not _is_defined(result):
            raise NotTraceable("its result has values of several kinds")

    def called(self, given: Any) -> Any:
        """Note a call of it; what it gives."""
        note, numbers = add(PartCall(self, [one for one in leaves(given) if _is_argument(one)])), itertools.count()

        def again(result: Any) -> Any:
            if isinstance(result, tuple):
                return made_of(result, map(again, result))
            return opened(result.kind, note, (next(numbers),)) if isinstance(result, Value) else result

        return again(self.result)


class PartCall:
    """A call of a part."""

    __slots__ = ("given", "part")

    def __init__(self, part: Part, given: list[Any]) -> None:
        self.part, self.given = part, given


# --- Proxies ---------------------------------------------------------------------------------------------


class Value:
    """A number or an array of a kernel that is being traced: of a note, the part of its value at a path."""

    __slots__ = ("kind", "note", "path")
    __hash__ = None  # type: ignore[assignment]
    # Without it an operator of NumPy's numbers takes it for an array.
    __array_ufunc__ = None

    def __init__(self, kind: Any, note: Any, path: tuple[int, ...]) -> None:
        self.kind, self.note, self.path = kind, note, path

    def _unknown(self, *_: Any) -> Any:
        raise NotTraceable("it asks for a number that is known in the kernel only")

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
            # A part of what an array is in a kernel: there is nothing to note.
            number = _ARRAY.get_field_position(_FIELDS[name])
            kind = types.UniTuple(types.intp, self.kind.ndim) if name in ("shape", "strides") else types.intp
            return opened(kind, self.note, (*self.path, number))
        kind = None if name.startswith("__") else _now.context.resolve_getattr(self.kind, name)
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

    def __neg__(self) -> Any:
        return noted(operator.neg, self)

    def __pos__(self) -> Any:
        return noted(operator.pos, self)

    def __invert__(self) -> Any:
        return noted(operator.invert, self)

    def __abs__(self) -> Any:
        return noted(abs, self)


def _is_element(kind: Any, place: Any) -> bool:
    """Whether a place in an array is that of one number."""
    if not isinstance(kind, types.Array) or not isinstance(kind.dtype, (types.Number, types.Boolean)):
        return False
    places = place if isinstance(place, tuple) else (place,)
    return len(places) == kind.ndim and all(map(_is_index, places))


def _is_index(place: Any) -> bool:
    if isinstance(place, Value):
        return isinstance(place.kind, types.Integer)
    return isinstance(place, (int, np.integer)) and not isinstance(place, bool) and place >= 0


def _method(of: Value, kind: Any, *given: Any) -> Any:
    """Note the call of a method of an array."""
    return _result(Call(kind, _signature(kind, kind, tuple(map(kind_of, given))), (of, *given)))


class Real(Value):
    """A floating-point number: helpers are chosen by its class."""

    __slots__ = ()


_MOST_PRODUCTS = 64
_FIELDS = {"shape": "shape", "strides": "strides", "size": "nitems"}
_ARRAY = default_manager[types.Array(types.float64, 1, "C")]


def _product(base: Any, exponent: int) -> Any:
    """The power by a whole number, in the order in which Numba multiplies."""
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


def _comparison(name: str, symbol: Any) -> None:
    setattr(Value, f"__{name}__", lambda a, b: noted(symbol, a, b))


for _name in ("add", "sub", "mul", "truediv", "floordiv", "mod", "lshift", "rshift", "xor"):
    _two_sided(_name, getattr(operator, _name))
_two_sided("and", operator.and_)
_two_sided("or", operator.or_)
for _name in ("lt", "le", "gt", "ge", "eq", "ne"):
    _comparison(_name, getattr(operator, _name))


class _Undefined:
    """A variable without a value, or with values of several kinds."""

    def __repr__(self) -> str:
        return "a variable without one value"


UNDEFINED = _Undefined()


def is_number(value: Any) -> bool:
    """Whether it is a number of a kernel, known or not: what a slot can hold."""
    return isinstance(value, (Value, bool, int, float, np.generic))


def has_value(given: Any) -> bool:
    """Whether there is a proxy in it."""
    if isinstance(given, (tuple, list)):
        return any(map(has_value, given))
    if isinstance(given, slice):
        return has_value((given.start, given.stop, given.step))
    return isinstance(given, Value)


# Of a whole number that has a sign, without it.
_BITS = 63


def kind_of(value: Any) -> Any:
    """The type in a kernel of a constant, a proxy, or a record of them."""
    if isinstance(value, Value):
        return value.kind
    if value is None:
        return types.none
    if isinstance(value, bool):
        return types.boolean
    if isinstance(value, int) and value.bit_length() < _BITS:
        return types.intp
    if type(value) is float:
        return types.float64
    if isinstance(value, tuple):
        made = None if type(value) is tuple else type(value)
        return types.BaseTuple.from_types([kind_of(part) for part in value], made)
    if isinstance(value, _Undefined):
        raise NotTraceable("a variable may be used before it has a value, or has values of several kinds")
    try:
        return types.unliteral(typeof(value))
    except Exception:
        raise NotTraceable(f"it uses {value!r:.60}, which no kernel has") from None


def leaves(value: Any) -> list[Any]:
    """What a record is made of, in its order."""
    return [leaf for part in value for leaf in leaves(part)] if isinstance(value, tuple) else [value]


def _is_argument(given: Any) -> bool:
    """Whether a part takes it as an argument: a whole number or a truth that is known makes another part."""
    return isinstance(given, (Value, float, np.generic))


def key_of(given: Any) -> Any:
    """What tells one part of a helper from another: the types of its arguments, and what is known of them."""
    if isinstance(given, tuple):
        return (type(given), *map(key_of, given))
    return ("a number", kind_of(given)) if _is_argument(given) else (type(given), given)


def made_of(value: Any, parts: Iterable[Any]) -> Any:
    """A tuple of the class of another."""
    return tuple(parts) if type(value) is tuple else tuple.__new__(type(value), parts)


def opened(kind: Any, note: Any, path: tuple[int, ...] = ()) -> Any:
    """A value of a kernel as a record of proxies."""
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


@contextlib.contextmanager
def noting(notes: list[Any], context: Any = None) -> Iterator[None]:
    """Let a thread note what it traces; without a context that of the trace around it."""
    before = getattr(_now, "notes", None), getattr(_now, "context", None)
    _now.notes, _now.context = notes, context or before[1]
    try:
        yield
    finally:
        _now.notes, _now.context = before


def notes() -> list[Any]:
    """The notes of the part that is being traced."""
    return _now.notes  # type: ignore[no-any-return]


def add(note: Any) -> Any:
    """Add a note."""
    _now.notes.append(note)
    return note


_signatures: dict[Any, tuple[Any, Any]] = {}


def noted(symbol: Any, *given: Any) -> Any:
    """Note an operation that Numba knows; its result as proxies."""
    given = tuple(map(_sliced, given))
    key = symbol, tuple(map(kind_of, given))
    if key not in _signatures:
        try:
            kind = _now.context.resolve_value_type(symbol)
        except Exception as error:
            raise NotTraceable(f"{_name_of(symbol)} is nothing that a kernel has") from error
        _signatures[key] = kind, _signature(symbol, kind, key[1])
    return _result(Call(*_signatures[key], given))


def _signature(symbol: Any, kind: Any, kinds: tuple[Any, ...]) -> Signature:
    try:
        signature = _now.context.resolve_function_type(kind, kinds, {})
    except Exception as error:
        raise NotTraceable(f"{_name_of(symbol)}: {str(error).strip().splitlines()[0]}") from error
    if signature is None:
        raise NotTraceable(f"there is no {_name_of(symbol)} of {', '.join(map(str, kinds))}")
    return signature


def _result(note: Call) -> Any:
    return opened(types.unliteral(note.signature.return_type), add(note))


def _sliced(given: Any) -> Any:
    """Slices as values of a kernel."""
    if isinstance(given, slice):
        parts = (given.start, given.stop) if given.step is None else (given.start, given.stop, given.step)
        return noted(slice, *parts)
    if isinstance(given, tuple) and any(isinstance(part, slice) for part in given):
        return tuple(map(_sliced, given))
    return given


def _name_of(symbol: Any) -> str:
    return getattr(symbol, "__name__", str(symbol))


# --- Where ways meet -------------------------------------------------------------------------------------


def _is_same(a: Any, b: Any) -> bool:
    if a is b:
        return True
    if isinstance(a, Value) or isinstance(b, Value):
        return isinstance(a, Value) and isinstance(b, Value) and a.note is b.note and a.path == b.path
    if type(a) is not type(b):
        return False
    if isinstance(a, tuple):
        return len(a) == len(b) and all(map(_is_same, a, b))
    if isinstance(a, float):
        return a == b and math.copysign(1.0, a) == math.copysign(1.0, b)
    try:
        return bool(a == b)
    except (ValueError, TypeError):
        return False


def unified(kinds: list[Any]) -> Any:
    kind = kinds[0] if all(k == kinds[0] for k in kinds) else _now.context.unify_types(*kinds)
    if kind is None or isinstance(kind, types.Optional):
        raise NotTraceable(f"a variable is {' or '.join(map(str, kinds))}")
    return types.unliteral(kind)


def _merged(ways: list[tuple[Assign, Any]]) -> Any:
    """One value for several, each known on its way."""
    first = ways[0][1]
    if all(_is_same(value, first) for _, value in ways):
        return first
    values = [value for _, value in ways]
    if all(isinstance(value, tuple) and type(value) is type(first) and len(value) == len(first) for value in values):
        columns = [[(assign, value[k]) for assign, value in ways] for k in range(len(first))]
        return made_of(first, map(_merged, columns))
    if not all(map(is_number, values)):
        return UNDEFINED
    slot = Slot(unified(list(map(kind_of, values))))
    for assign, value in ways:
        assign.pairs.append((slot, value))
    return opened(slot.kind, add(Load(slot)))


def _is_defined(value: Any) -> bool:
    if isinstance(value, tuple):
        return all(map(_is_defined, value))
    return not isinstance(value, _Undefined)


# --- The control flow of one function --------------------------------------------------------------------

# How a block of statements ends: at the next statement, or elsewhere.
NEXT, DONE = True, False

Get = Callable[[], tuple[Any, ...]]
Put = Callable[[tuple[Any, ...]], None]


class _Loop:
    """A loop that is being traced."""

    def __init__(self, get: Get) -> None:
        self.get = get
        self.advance: Get = get
        self.head, self.end = Label(), Label()
        self.exits: list[tuple[Assign, Any]] = []
        self.nexts: list[tuple[Assign, Any]] = []


class Frame:
    """One call of a function while it is traced: what `twins.py` makes of its statements calls this.

    The statements inside of `if` and loops are functions of no arguments that return NEXT, or DONE where the end is not
    reached; `get` and `put` are the variables that they assign.
    """

    UNDEFINED = UNDEFINED
    NEXT = NEXT

    def __init__(self) -> None:
        self._depth = 0
        self._gives: list[tuple[Assign, Any]] = []
        self._exit = Label()
        self._loops: list[_Loop] = []
        self._only: Any = None

    # --- The end ---

    def give(self, value: Any) -> bool:
        """`return value`"""
        if self._depth == 0 and not self._gives:
            self._only = value
            return DONE
        self._gives.append((self._ends_at(self._exit), value))
        return DONE

    def result(self) -> Any:
        """What the function returns."""
        if not self._gives:
            return self._only
        return self._met(self._exit, self._gives)

    @staticmethod
    def _ends_at(label: Label) -> Assign:
        assign: Assign = add(Assign())
        add(Jump(label))
        return assign

    @staticmethod
    def _met(label: Label, ways: list[tuple[Assign, Any]]) -> Any:
        add(label)
        return _merged(ways)

    # --- Decisions ---

    def test(self, value: Any) -> Any:
        """A condition: True or False where Python knows it."""
        if not isinstance(value, Value):
            return bool(value)
        return value if isinstance(value.kind, types.Boolean) else noted(bool, value)

    def branch(
        self, condition: Any, first: Callable[[], bool], second: Callable[[], bool], get: Get, put: Put
    ) -> bool:
        """`if condition: first() else: second()`"""
        condition = self.test(condition)
        if not isinstance(condition, Value):
            return first() if condition else second()
        before, label, ways = get(), Label(), list[tuple[Assign, Any]]()
        places = (Label(), Label())
        add(Branch(condition, *places))
        self._depth += 1
        for place, way in zip(places, (first, second), strict=True):
            put(before)
            add(place)
            if way() is NEXT:
                ways.append((self._ends_at(label), get()))
        self._depth -= 1
        if not ways:
            return DONE
        put(self._met(label, ways))
        return NEXT

    def choose(self, condition: Any, first: Callable[[], Any], second: Callable[[], Any]) -> Any:
        """`first() if condition else second()`"""
        condition = self.test(condition)
        if not isinstance(condition, Value):
            return first() if condition else second()
        label, places, ways = Label(), (Label(), Label()), []
        add(Branch(condition, *places))
        for place, way in zip(places, (first, second), strict=True):
            add(place)
            value = way()
            ways.append((self._ends_at(label), value))
        result = self._met(label, ways)
        if not _is_defined(result):
            raise NotTraceable("an expression has values of several kinds")
        return result

    def both(self, first: Any, second: Callable[[], Any]) -> Any:
        """`first and second()`"""
        if not isinstance(first, Value):
            return first and second()
        return self.choose(first, lambda: self.test(second()), lambda: False)

    def either(self, first: Any, second: Callable[[], Any]) -> Any:
        """`first or second()`"""
        if not isinstance(first, Value):
            return first or second()
        return self.choose(first, lambda: True, lambda: self.test(second()))

    def negate(self, value: Any) -> Any:
        """`not value`"""
        return noted(operator.not_, value) if isinstance(value, Value) else not value

    def contains(self, values: Any, value: Any) -> Any:
        """`value in values`"""
        if not has_value((value, values)):
            return value in values
        found: Any = False
        for one in values:
            found = found | (one == value)
        return found

    # --- Loops ---

    def leave(self) -> bool:
        """`break`"""
        loop = self._loops[-1]
        values = loop.get()
        loop.exits.append((self._ends_at(loop.end), values))
        return DONE

    def again(self) -> bool:
        """`continue`"""
        loop = self._loops[-1]
        values = loop.advance()
        loop.nexts.append((self._ends_at(loop.head), values))
        return DONE

    def repeat(self, test: Callable[[], Any], body: Callable[[], bool], get: Get, put: Put) -> bool:
        """`while test(): body()`"""
        return self._rounds(test, body, get, put, get)

    def each(
        self, values: Any, take: Callable[[Any], None], body: Callable[[], bool], get: Get, put: Put, leaves: bool
    ) -> bool:
        """`for value in values: body()`; the values of a `range` may be known in the kernel only."""
        if isinstance(values, Value):
            whole = values
            return self.each(Range(whole.shape[0]), lambda k: take(whole[k]), body, get, put, leaves)
        if not isinstance(values, Range):
            return self._written_out(values, take, body, get, put)
        known = values.known()
        if known is not None and len(known) <= UNROLLED and not leaves:
            return self._written_out(known, take, body, get, put)
        start, stop, step = values.numbers()
        counter = [start]

        def test() -> Any:
            return counter[0] > stop if step < 0 else counter[0] < stop

        def take_and_go() -> bool:
            take(counter[0])
            return body()

        def both() -> tuple[Any, ...]:
            return (*get(), counter[0])

        def set_both(state: tuple[Any, ...]) -> None:
            put(state[:-1])
            counter[0] = state[-1]

        return self._rounds(test, take_and_go, both, set_both, lambda: (*get(), counter[0] + step))

    def _written_out(
        self, values: Any, take: Callable[[Any], None], body: Callable[[], bool], get: Get, put: Put
    ) -> bool:
        loop = _Loop(get)
        self._loops.append(loop)
        reached = NEXT
        for value in values:
            loop.head, loop.nexts = Label(), []
            take(value)
            reached = body()
            if loop.nexts:
                if reached is NEXT:
                    loop.nexts.append((self._ends_at(loop.head), get()))
                put(self._met(loop.head, loop.nexts))
                reached = NEXT
            if reached is DONE:
                break
        self._loops.pop()
        if not loop.exits:
            return reached
        if reached is NEXT:
            loop.exits.append((self._ends_at(loop.end), get()))
        put(self._met(loop.end, loop.exits))
        return NEXT

    def _rounds(self, test: Callable[[], Any], body: Callable[[], bool], get: Get, put: Put, advance: Get) -> bool:
        noted_so_far, before, gives = notes(), get(), len(self._gives)
        mark, wider = len(noted_so_far), dict[tuple[int, ...], Any]()
        while True:
            loop = _Loop(get)
            loop.advance = advance
            entry = self._ends_at(loop.head)
            add(loop.head)
            slots: dict[tuple[int, ...], Slot] = {}
            put(_carried(before, entry, slots, wider, ()))
            going = self.test(test())
            if going is False:
                del noted_so_far[mark:]
                put(before)
                return NEXT
            if isinstance(going, Value):
                inside, out = Label(), Label()
                add(Branch(going, inside, out))
                add(out)
                loop.exits.append((self._ends_at(loop.end), get()))
                add(inside)
            self._loops.append(loop)
            self._depth += 1
            reached = body()
            self._depth -= 1
            self._loops.pop()
            if reached is NEXT:
                values = advance()
                loop.nexts.append((self._ends_at(loop.head), values))
            if all([_goes_round(before, slots, wider, assign, value, ()) for assign, value in loop.nexts]):
                break
            # A variable changes its type in the loop: once more with that which holds both.
            del noted_so_far[mark:]
            del self._gives[gives:]
            put(before)
        if not loop.exits:
            return DONE
        put(self._met(loop.end, loop.exits))
        return NEXT

    # --- Expressions ---

    def item(self, of: Any, place: Any) -> Any:
        """`of[place]`"""
        if isinstance(of, (tuple, np.ndarray)) and has_value(place):
            return noted(operator.getitem, of, place)
        return of[place]

    def call(self, function: Any, /, *given: Any, **named: Any) -> Any:
        """`function(...)`"""
        return called(function, given, named)


class Range:
    """The `range` of a loop of which a bound may be known in the kernel only."""

    def __init__(self, *given: Any) -> None:
        start, stop, step = (0, *given, 1) if len(given) == 1 else (*given, 1)[:3]
        self._given = start, stop, step

    def known(self) -> range | None:
        """What it is in Python."""
        return None if has_value(self._given) else range(*map(int, self._given))

    def __iter__(self) -> Iterator[int]:
        known = self.known()
        if known is None:
            raise NotTraceable("it asks for the numbers of a range that is known in the kernel only")
        return iter(known)

    def numbers(self) -> tuple[Any, Any, Any]:
        """Start, stop and step, of one type; the step is known."""
        start, stop, step = self._given
        if isinstance(step, Value):
            raise NotTraceable("the step of a range must be known before the kernel runs")
        kinds = [kind_of(one) for one in (start, stop) if isinstance(one, Value)]
        unsigned = bool(kinds) and all(not kind.signed for kind in kinds)
        number = np.uint64 if unsigned else np.int64
        return *(noted(number, one) if isinstance(one, Value) else number(one) for one in (start, stop)), number(step)


def _carried(value: Any, entry: Assign, slots: Any, wider: Any, path: tuple[int, ...]) -> Any:
    """The variables of a loop at the start of a round: every number is in a slot."""
    if isinstance(value, tuple):
        return made_of(value, [_carried(one, entry, slots, wider, (*path, k)) for k, one in enumerate(value)])
    if not is_number(value):
        return value
    slots[path] = slot = Slot(wider.get(path) or kind_of(value))
    entry.pairs.append((slot, value))
    return opened(slot.kind, add(Load(slot)))


def _goes_round(before: Any, slots: Any, wider: Any, assign: Assign, value: Any, path: tuple[int, ...]) -> bool:
    """Put the variables at the end of a round into their slots; whether the types of these hold them."""
    if isinstance(before, _Undefined):
        return True  # a round does not see what an earlier one has left in it
    if isinstance(before, tuple) and type(value) is type(before) and len(value) == len(before):
        pairs = enumerate(zip(before, value, strict=True))
        return all([_goes_round(old, slots, wider, assign, new, (*path, k)) for k, (old, new) in pairs])
    slot = slots.get(path)
    if slot is None and _is_same(before, value):
        return True
    if slot is None or not is_number(value):
        raise NotTraceable("a variable of a loop is something else in the first round than later")
    assign.pairs.append((slot, value))
    kind = unified([slot.kind, kind_of(value)])
    if kind == slot.kind:
        return True
    wider[path] = kind
    return False


# --- Calls -----------------------------------------------------------------------------------------------

# Functions that are operations of a kernel, see `noted`, by themselves where all that they are given is known.
OPERATIONS: set[Any] = {
    *(getattr(math, name) for name in (
        "acos", "acosh", "asin", "asinh", "atan", "atan2", "atanh", "ceil", "copysign", "cos", "cosh", "degrees", "erf",
        "erfc", "exp", "expm1", "fabs", "floor", "fmod", "frexp", "gamma", "hypot", "isfinite", "isinf", "isnan",
        "ldexp", "lgamma", "log", "log10", "log1p", "log2", "pow", "radians", "sin", "sinh", "sqrt", "tan", "tanh",
        "trunc",
    )),
    builtins.abs, builtins.bool, builtins.divmod, builtins.float, builtins.int,
    builtins.pow, builtins.round,
    *(function for function in vars(operator).values() if isinstance(function, python_types.BuiltinFunctionType)),
}  # fmt: skip
# Functions that only a kernel can do.
INTRINSIC: set[Any] = set()
# What is called in place of a function while it is traced.
REPLACED: dict[Any, Callable[..., Any]] = {
    range: Range,
    len: lambda values: values.shape[0] if isinstance(values, Value) else len(values),
}
# Of NumPy: `np.array`, `np.sum` and others that are no ufuncs.
_ARRAY_FUNCTION = type(np.sum)
_IN_PLACE = (list, dict, set)


def cast(value: Any, kind: Any) -> Any:
    """A number as one of another type."""
    number = np.dtype(str(kind)).type
    return noted(number, value) if isinstance(value, Value) else number(value)


def operation(function: Any) -> Any:
    """Of a function that has a type and a lowering of its own for Numba: traces note it."""
    OPERATIONS.add(function)
    return function


def called(function: Any, given: tuple[Any, ...], named: dict[str, Any]) -> Any:
    """A call while a helper is traced."""
    try:
        replaced, is_operation = REPLACED.get(function), function in OPERATIONS
    except TypeError:  # not hashable: a method of a proxy
        return function(*given, **named)
    if replaced is not None:
        return replaced(*given, **named)
    if function in INTRINSIC:
        return noted(function, *given)
    if is_operation or _is_operation(function):
        if not has_value(given):
            return function(*given, **named)
        if named:
            raise NotTraceable(f"{_name_of(function)} is called by the names of its arguments")
        if function is int:
            return given[0] if isinstance(given[0].kind, types.Integer) else noted(np.int64, *given)
        return noted(function, *given)
    if isinstance(function, python_types.FunctionType):
        return _plain(function, given, named)
    if isinstance(function, python_types.MethodType) and isinstance(function.__func__, python_types.FunctionType):
        return _plain(function.__func__, (function.__self__, *given), named)
    is_python = getattr(function, "__module__", None) == "builtins"
    if function in _IN_PLACE or (is_python and any(isinstance(one, Value) for one in given)):
        raise NotTraceable(f"it asks {_name_of(function)} about a number that is known in the kernel only")
    return function(*given, **named)


def _is_operation(function: Any) -> bool:
    if isinstance(function, (np.ufunc, _ARRAY_FUNCTION, Dispatcher)) or function is np.array:
        return True
    return isinstance(function, type) and issubclass(function, np.generic)


def _plain(function: Any, given: tuple[Any, ...], named: dict[str, Any]) -> Any:
    """A Python function that nobody has prepared for kernels."""
    frame = Frame()
    twin_of(function, frame)(*given, **named)
    return frame.result()
