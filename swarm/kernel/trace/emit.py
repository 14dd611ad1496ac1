"""Parts of a kernel: helpers as functions of their own for given types of arguments, and notes as instructions.

Each operation is emitted by Numba's own lowering.
"""

import functools
import itertools
from collections.abc import Iterator
from typing import Any, ClassVar

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.datamodel.registry import default_manager
from numba.core.typing.templates import signature
from numba.np.arrayobj import load_item, store_item
from numba.np.numpy_support import ufunc_find_matching_loop

from .notes import Argument, Assign, Attribute, Branch, Call, Element, Jump, Label, Load, PartCall, Slot, add
from .values import TraceError, Value, is_defined, kind_of, leaves, made_of, opened

_part_numbers = itertools.count()


class FunctionPart:
    """A function of a kernel: the notes of a helper, its arguments and its result, and its number."""

    def __init__(self, name: str, inlined: bool) -> None:
        self.name, self.inlined, self.number = name, inlined, next(_part_numbers)
        self.arguments: list[Argument] = []
        self.notes: list[Any] = []
        self.result: Any = None
        self.kind: Any = None
        self.numbers: list[Value] = []

    def take(self, given: Any) -> Any:
        """Return the given value with an argument in the place of every number that is not a type of its own."""
        if isinstance(given, tuple):
            return made_of(given, map(self.take, given))
        if not _is_argument(given):
            return given
        self.arguments.append(Argument(kind_of(given), len(self.arguments)))
        return opened(self.arguments[-1].kind, self.arguments[-1])

    def give(self, result: Any) -> None:
        """Set the result of the function. A constant in it stays a constant for the caller."""
        self.result, self.numbers = result, [one for one in leaves(result) if isinstance(one, Value)]
        if not is_defined(result):
            raise TraceError("its result has values of several kinds")

    def called(self, given: Any) -> Any:
        """Note a call of the function; return its result."""
        note, numbers = add(PartCall(self, [one for one in leaves(given) if _is_argument(one)])), itertools.count()

        def again(result: Any) -> Any:
            if isinstance(result, tuple):
                return made_of(result, map(again, result))
            return opened(result.kind, note, (next(numbers),)) if isinstance(result, Value) else result

        return again(self.result)

    @functools.cached_property
    def taken(self) -> list[tuple[Argument, tuple[int, ...]]]:
        """The parts of its arguments that it uses, each as the argument and a path: of an array the numbers it reads.

        A call passes each of these numbers, and the arrays of balls in a union of two boxes have 400.
        """
        found = dict.fromkeys(_taken_by(self))
        return [(one, path) for one, path in found if not any((one, path[:k]) in found for k in range(len(path)))]


def _taken_by(part: FunctionPart) -> Iterator[tuple[Argument, tuple[int, ...]]]:
    """Yield the parts of arguments that the notes of a part use, each as the argument and a path."""

    def of(given: Any, path: tuple[int, ...] = ()) -> Iterator[tuple[Argument, tuple[int, ...]]]:
        values = (one for one in leaves(given) if isinstance(one, Value) and isinstance(one.note, Argument))
        return ((one.note, (*one.path, *path)) for one in values)

    yield from of(tuple(part.numbers))
    for note in part.notes:
        if isinstance(note, PartCall):
            for one, path in note.part.taken:
                yield from of(note.given[one.number], path)
        elif isinstance(note, Element):
            yield from of((*note.place, note.value))
            for path in _address_of(note):
                yield from of(note.array, path)
        elif isinstance(note, Assign):
            yield from of(tuple(value for _slot, value in note.pairs))
        elif isinstance(note, (Call, Attribute, Branch)):
            yield from of(note.given if isinstance(note, Call) else getattr(note, "of", None))
            yield from of(getattr(note, "condition", None))


def _address_of(note: Element) -> Iterator[tuple[int, ...]]:
    """Yield the paths of the numbers of an array from which the address of an element follows."""
    kind, axes = note.array.kind, range(len(note.place))
    field = default_manager[kind].get_field_position
    yield (field("data"),)
    others = {"A": axes[:0], "C": axes[1:], "F": axes[:-1]}[kind.layout]
    signed = [k for k, one in enumerate(note.place) if isinstance(one, Value) and one.kind.signed]
    yield from ((field("shape"), k) for k in (*others, *signed))
    yield from ((field("strides"), k) for k in axes if kind.layout == "A")


def _is_argument(given: Any) -> bool:
    """Whether a part takes it as an argument: a known integer or boolean makes another part."""
    return isinstance(given, (Value, float, np.generic))


def key_of(given: Any) -> Any:
    """Return the key of a part of a helper: the types of its arguments, and their known values."""
    if isinstance(given, tuple):
        return (type(given), *map(key_of, given))
    return ("a number", kind_of(given)) if _is_argument(given) else (type(given), given)


# --- Instructions ----------------------------------------------------------------------------------------


def emit(context: Any, builder: Any, part: FunctionPart, given: Any) -> Any:
    """Return the result of a part that is written out where the builder is."""
    writer = _Emission(context, builder, {(one, ()): value for one, value in zip(part.arguments, given, strict=True)})
    writer.emit(part.notes)
    return writer.value(part.result)


class _Emission:
    """The state of an emission: the values and the places that are known at this point."""

    def __init__(self, context: Any, builder: Any, taken: dict[Any, Any]) -> None:
        self._context, self._builder = context, builder
        self._values: dict[Any, Any] = {}
        self._parts: dict[Any, Any] = {}  # of tuples, in this block
        self._taken = taken  # arguments and parts of them, where the notes begin
        self._start = builder.block
        self._blocks: dict[Label, Any] = {}
        self._slots: dict[Slot, Any] = {}
        self._functions: dict[Any, Any] = {}

    def emit(self, notes: list[Any]) -> None:
        """Emit notes in order; skip those behind the end of a way."""
        for note in notes:
            if isinstance(note, Label):
                self._enter(note)
            elif not self._builder.block.is_terminated:
                self._WAYS[type(note)](self, note)

    def value(self, given: Any) -> Any:
        """Return the value in LLVM of a constant, a proxy, or a record of them."""
        if isinstance(given, Value):
            return self._part(given.note, given.path)
        if given is None:
            return self._context.get_dummy_value()
        kind = kind_of(given)
        if isinstance(kind, types.BaseTuple):
            parts = [self.cast(*pair) for pair in zip(given, kind.types, strict=True)]  # type: ignore[attr-defined]
            return self._context.make_tuple(self._builder, kind, parts)
        if isinstance(kind, (types.NumberClass, types.Function, types.Dispatcher)):
            return self._context.get_dummy_value()
        constant = given.item() if isinstance(kind, (types.Number, types.Boolean)) and hasattr(given, "item") else given
        return self._context.get_constant_generic(self._builder, kind, constant)

    def cast(self, given: Any, kind: Any) -> Any:
        """Return a value as another type."""
        have = kind_of(given)
        return self.value(given) if have == kind else self._context.cast(self._builder, self.value(given), have, kind)

    def _part(self, note: Any, path: tuple[int, ...]) -> Any:
        if isinstance(note, Argument):
            if (note, path) not in self._taken:
                of = self._part(note, path[:-1])
                with self._builder.goto_block(self._start):
                    self._taken[note, path] = self._builder.extract_value(of, path[-1])
            return self._taken[note, path]
        if not path:
            return self._values[note]
        if (note, path) not in self._parts:
            self._parts[note, path] = self._builder.extract_value(self._part(note, path[:-1]), path[-1])
        return self._parts[note, path]

    # --- Notes ---

    def _enter(self, label: Label) -> None:
        block = self._block(label)
        if not self._builder.block.is_terminated:
            self._builder.branch(block)
        self._builder.position_at_end(block)
        # A part that was taken from a tuple on one way is not known on another way.
        self._parts = {}

    def _block(self, label: Label) -> Any:
        if label not in self._blocks:
            self._blocks[label] = self._builder.append_basic_block("way")
        return self._blocks[label]

    def _slot(self, slot: Slot) -> Any:
        if slot not in self._slots:
            kind = self._context.get_value_type(slot.kind)
            self._slots[slot] = cgutils.alloca_once(self._builder, kind)
        return self._slots[slot]

    def _call(self, note: Call) -> None:
        found, given = note.signature, note.given
        key = note.symbol, found
        if key not in self._functions:
            of_numbers = _of_numbers(self._context, note.symbol, found)
            self._functions[key] = of_numbers or self._context.get_function(note.symbol, found)
        kinds = list(found.args if found.recvr is None else (found.recvr, *found.args))
        if kinds and isinstance(kinds[-1], (types.StarArgTuple, types.StarArgUniTuple)):
            fixed = len(kinds) - 1
            given = (*given[:fixed], given[fixed:])
        values = [self.cast(*pair) for pair in zip(given, kinds, strict=False)]
        # Arguments with defaults
        rest = kinds[len(values) :]
        values += [self._context.get_constant_generic(self._builder, kind, kind.value) for kind in rest]
        self._values[note] = self._functions[key](self._builder, values)

    def _attribute(self, note: Attribute) -> None:
        get = self._context.get_getattr(note.of.kind, note.name)
        self._values[note] = get(self._context, self._builder, note.of.kind, self.value(note.of), note.name)

    def _element(self, note: Element) -> None:
        kind = note.array.kind
        place = self._address(note.array, note.place)
        if note.value is None:
            self._values[note] = load_item(self._context, self._builder, kind, place)
        else:
            store_item(self._context, self._builder, kind, self.cast(note.value, kind.dtype), place)

    def _address(self, array: Value, place: tuple[Any, ...]) -> Any:
        """Return the address of an element. A negative index counts from the end, as in Numba."""
        builder, model = self._builder, default_manager[array.kind]

        def field(name: str, *path: int) -> Any:
            return self._part(array.note, (*array.path, model.get_field_position(name), *path))

        steps = [self._index(one, functools.partial(field, "shape", k)) for k, one in enumerate(place)]
        if array.kind.layout == "A":
            offsets = [builder.mul(step, field("strides", k)) for k, step in enumerate(steps)]
            return cgutils.pointer_add(builder, field("data"), functools.reduce(builder.add, offsets))
        axes = range(len(steps)) if array.kind.layout == "C" else range(len(steps) - 1, -1, -1)
        first, *others = axes
        offset = steps[first]
        for k in others:
            offset = builder.add(builder.mul(offset, field("shape", k)), steps[k])
        return builder.gep(field("data"), [offset])

    def _index(self, given: Any, length: Any) -> Any:
        kind = kind_of(given)
        if not isinstance(given, Value):
            return self._context.get_constant(types.intp, int(given))
        if not kind.signed:
            return self.cast(given, types.uintp)
        value = self.cast(given, types.intp)
        negative = self._builder.icmp_signed("<", value, value.type(0))
        return self._builder.select(negative, self._builder.add(value, length()), value)

    def _assign(self, note: Assign) -> None:
        # All values before all stores: a value may be another variable's.
        for place, value in [(self._slot(slot), self.cast(value, slot.kind)) for slot, value in note.pairs]:
            self._builder.store(value, place)

    def _load(self, note: Load) -> None:
        self._values[note] = self._builder.load(self._slot(note.slot))

    def _jump(self, note: Jump) -> None:
        self._builder.branch(self._block(note.to))

    def _branch(self, note: Branch) -> None:
        self._builder.cbranch(self.value(note.condition), self._block(note.first), self._block(note.second))

    def _call_part(self, note: PartCall) -> None:
        part, builder, context = note.part, self._builder, self._context
        function, kind = _function_of(context, builder.module, part)
        place = cgutils.alloca_once(builder, kind)
        given = [self._given(note.given[one.number], path) for one, path in part.taken]
        status = builder.call(function, [place, context.call_conv._get_excinfo_argument(builder.function), *given])
        failed = builder.icmp_unsigned("!=", status, ir.Constant(status.type, 0))
        with cgutils.if_unlikely(builder, failed):
            builder.ret(status)
        self._parts = {}
        self._values[note] = builder.load(place)

    def _given(self, given: Any, path: tuple[int, ...]) -> Any:
        return self._part(given.note, (*given.path, *path)) if isinstance(given, Value) else self.value(given)

    _WAYS: ClassVar[dict[Any, Any]] = {
        Call: _call,
        Attribute: _attribute,
        Element: _element,
        Assign: _assign,
        Load: _load,
        Jump: _jump,
        Branch: _branch,
        PartCall: _call_part,
    }


def _of_numbers(context: Any, symbol: Any, found: Any) -> Any:
    """Return the emitter of a universal function of numbers, or None.

    Numba writes a loop of one round around it, with variables for arguments and results: a third of all instructions
    for grains in a silo, and a quarter of the time to compile them.
    """
    ufunc = getattr(symbol, "typing_key", None)
    if not isinstance(ufunc, np.ufunc) or ufunc.nout != 1:
        return None
    kinds = (*found.args, found.return_type)
    if not all(isinstance(kind, (types.Integer, types.Float, types.Boolean)) for kind in kinds):
        return None
    loop: Any = ufunc_find_matching_loop(ufunc, kinds)
    (result,), inner = loop.outputs, signature(*loop.outputs, *loop.inputs)
    emitted = context.get_ufunc_info(ufunc)[loop.ufunc_sig]

    def emit_it(builder: Any, values: list[Any]) -> Any:
        given = [context.cast(builder, *one) for one in zip(values, found.args, loop.inputs, strict=True)]
        made = default_manager[result].from_return(builder, emitted(context, builder, inner, given))
        return context.cast(builder, made, result, found.return_type)

    return emit_it


def _function_of(context: Any, module: Any, part: FunctionPart) -> tuple[Any, Any]:
    """Return the function of a part in a module, and the type of its result.

    Its first arguments are the places of its result and of an error, as in Numba's functions, so that it may call
    functions compiled by Numba.
    """
    name = f"traced.{part.name}.{part.number}"
    result = ir.LiteralStructType([context.get_value_type(one.kind) for one in part.numbers])
    function = module.globals.get(name)
    if function is not None:
        return function, result
    numbas = context.call_conv.get_function_type(types.none, ())
    status, error = numbas.return_type, numbas.args[1]
    kinds = [
        functools.reduce(lambda kind, k: kind.elements[k], path, context.get_value_type(one.kind))
        for one, path in part.taken
    ]
    function = ir.Function(module, ir.FunctionType(status, [result.as_pointer(), error, *kinds]), name)
    function.linkage = "internal"
    function.attributes.add("alwaysinline" if part.inlined else "noinline")
    builder = ir.IRBuilder(function.append_basic_block("entry"))
    writer = _Emission(context, builder, dict(zip(part.taken, function.args[2:], strict=True)))
    writer.emit(part.notes)
    for k, one in enumerate(part.numbers):
        builder.store(writer.value(one), cgutils.gep_inbounds(builder, function.args[0], 0, k))
    builder.ret(ir.Constant(status, 0))
    return function, result
