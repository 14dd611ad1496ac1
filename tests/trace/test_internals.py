"""What kernels take from Numba that is not documented: each fails when Numba changes under this package."""

import ast
import functools
import inspect
import itertools
import math
import operator
import pkgutil
import sys
from pathlib import Path

import numba
import numpy as np
import pytest
from compared import Inner, Record, bits, compiled_only, in_kernel
from llvmlite import ir
from llvmlite.binding import Linkage
from numba import types
from numba.core import cgutils
from numba.core.datamodel.registry import default_manager
from numba.core.typing.templates import Signature
from numba_internals import ALL
from test_helpers import loop_with_else

import swarm
from swarm.kernel import compilers, jit, machine_code, trace

pytestmark = compiled_only
PACKAGE = Path(swarm.__file__).parent
DOCUMENTED = {"numba", "numba.extending"}


@functools.cache
def contexts():
    """Numba's context of types and that of what they are in a kernel."""
    target = numba.njit(lambda: None).targetdescr
    target.typing_context.refresh()
    target.target_context.refresh()
    return target.typing_context, target.target_context


# --- The list --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ALL)
def test_it_is_there_with_its_parameters(name):
    found = pkgutil.resolve_name(f"numba.{name}")
    if ALL[name] is not None:
        has = [str(one).split("=")[0] for one in inspect.signature(found).parameters.values()]
        wanted = ALL[name].split()
        assert [one for one in has if one in wanted] == wanted


def taken_from_numba():
    """What the package imports from modules of Numba that are not documented."""
    for path in PACKAGE.rglob("*.py"):
        text = path.read_text()
        for node in ast.walk(ast.parse(text)) if "numba" in text else ():
            module = getattr(node, "module", None) or ""
            if isinstance(node, ast.ImportFrom) and module.split(".")[0] == "numba" and module not in DOCUMENTED:
                yield from ((path, f"{module}.{one.name}") for one in node.names)


def test_the_list_is_complete():
    found = list(taken_from_numba())
    assert len(found) > 10
    for path, name in found:
        name = name.removeprefix("numba.")
        known = name in ALL or pkgutil.resolve_name(f"numba.{name}") is numba.np.linalg
        assert known, f"{path} takes {name}, which numba_internals.py does not have"


# --- Types -----------------------------------------------------------------------------------------------


def signature_of(symbol, *kinds):
    typing, _target = contexts()
    return typing.resolve_function_type(typing.resolve_value_type(symbol), kinds, {})


def test_an_operation_has_a_signature():
    found = signature_of(operator.add, types.float64, types.int64)
    assert (found.return_type, found.args, found.recvr) == (types.float64, (types.float64, types.float64), None)
    assert signature_of(np.sqrt, types.float64).return_type == types.float64
    assert Signature(types.none, (), recvr=None).return_type == types.none


def test_an_operation_that_there_is_not_is_an_error():
    with pytest.raises(numba.core.errors.TypingError):
        signature_of(operator.add, types.float64, types.none)


def test_attributes_have_types():
    typing, _target = contexts()
    row = types.Array(types.float64, 2, "C")
    assert typing.resolve_getattr(row, "ndim") == types.intp
    assert isinstance(typing.resolve_getattr(row, "sum"), types.BoundFunction)
    assert typing.resolve_getattr(row, "nothing") is None


def test_types_unify():
    typing, _target = contexts()
    assert typing.unify_types(types.int64, types.float64) == types.float64
    assert typing.unify_types(types.boolean, types.int64) == types.int64
    assert isinstance(typing.unify_types(types.none, types.float64), types.Optional)
    assert typing.unify_types(types.int64, types.Array(types.float64, 1, "C")) is None


def test_records_are_made_of_types():
    kinds = [types.float64, types.int64]
    assert types.BaseTuple.from_types(kinds, Record).instance_class is Record
    assert types.BaseTuple.from_types(kinds, None) == types.Tuple(kinds)
    assert types.unliteral(types.literal(3)) == types.int64


# --- Instructions ----------------------------------------------------------------------------------------


def builder_of(target, *kinds):
    """A function that is being built, of arguments of such types."""
    module = ir.Module()
    function = ir.Function(module, ir.FunctionType(ir.VoidType(), [target.get_value_type(kind) for kind in kinds]), "f")
    return ir.IRBuilder(function.append_basic_block()), function.args


def test_an_operation_is_an_instruction():
    _typing, target = contexts()
    builder, args = builder_of(target, types.float64, types.float64)
    found = signature_of(operator.add, types.float64, types.float64)
    with target.push_code_library(target.codegen().create_library("added")):
        assert target.get_function(operator.add, found)(builder, args).opname == "fadd"
    assert target.cast(builder, args[0], types.float64, types.int64).type == ir.IntType(64)
    assert target.get_constant_generic(builder, types.int64, 7).constant == 7
    assert target.get_constant(types.float64, 0.5).constant == 0.5


def test_a_universal_function_of_numbers_is_its_own_instructions():
    """Numba makes variables for its argument and its result, and a loop of one round; for arrays it has to."""
    typing, target = contexts()
    symbol = typing.resolve_value_type(np.sqrt)

    def names(emitted):
        builder, args = builder_of(target, types.float64)
        with target.push_code_library(target.codegen().create_library("root")):
            emitted(builder, args)
        return [one.opname for block in builder.function.blocks for one in block.instructions]

    found = signature_of(np.sqrt, types.float64)
    assert names(trace.emit._of_numbers(target, symbol, found)) == ["call"]
    assert {"alloca", "phi", "call"} < {*names(target.get_function(symbol, found))}
    row = types.Array(types.float64, 1, "C")
    assert trace.emit._of_numbers(target, symbol, signature_of(np.sqrt, row)) is None
    assert trace.emit._of_numbers(target, typing.resolve_value_type(operator.add), found) is None


def test_the_fields_of_an_array():
    _typing, target = contexts()
    kind = types.Array(types.float64, 2, "F")
    names = ("meminfo", "parent", "nitems", "itemsize", "data", "shape", "strides")
    assert [default_manager[kind].get_field_position(name) for name in names] == list(range(len(names)))
    fields = target.get_value_type(kind).elements
    assert fields[4] == ir.DoubleType().as_pointer()
    assert fields[5] == fields[6] == ir.ArrayType(ir.IntType(64), 2)
    assert default_manager[types.Array(types.float64, 1, "C")].get_field_position("nitems") == 2


@pytest.mark.parametrize("kind", [types.float64, types.boolean, types.int32])
def test_an_element_is_loaded_and_stored(kind):
    """A bool is a byte in memory and a bit in a kernel."""
    _typing, target = contexts()
    array = types.Array(kind, 1, "C")
    builder, (row,) = builder_of(target, array)
    place = builder.extract_value(row, default_manager[array].get_field_position("data"))
    value = numba.np.arrayobj.load_item(target, builder, array, place)
    assert value.type == target.get_value_type(kind)
    numba.np.arrayobj.store_item(target, builder, array, value, place)
    assert builder.block.instructions[-1].opname == "store"


def test_a_function_takes_the_places_of_its_result_and_of_an_error_first():
    _typing, target = contexts()
    kind = target.call_conv.get_function_type(types.none, (types.float64,))
    assert kind.return_type == ir.IntType(32)
    assert len(kind.args) == 3
    function = ir.Function(ir.Module(), kind, "f")
    assert target.call_conv._get_excinfo_argument(function) is function.args[1]
    assert all(isinstance(one, ir.PointerType) for one in kind.args[:2])


def test_a_variable_of_a_function_is_made_where_it_begins():
    _typing, target = contexts()
    builder, _args = builder_of(target)
    first = builder.block
    builder.position_at_end(builder.append_basic_block())
    made = cgutils.alloca_once(builder, ir.DoubleType())
    assert made in first.instructions


# --- Templates and passes --------------------------------------------------------------------------------


def doubled(x):
    return x * 2.0


def test_a_template_says_how_a_call_is_typed_and_found():
    typing, _target = contexts()
    base = numba.core.typing.templates.make_overload_template(doubled, lambda x: doubled, {}, False, "never")
    template = base(typing)
    assert template.context is typing
    found = template.generic((types.float64,), {})
    assert found.return_type == types.float64
    assert callable(template.get_impl_key(found))


def test_a_helper_has_as_many_arguments_as_it_likes():
    """One lowering for any number of them: `lower_builtin` with VarArg."""

    def none():
        return 1.5

    def many(a, b, c, d, e, f, g):
        return a + b + c + d + e + f + g

    assert in_kernel(none)() == 1.5
    assert in_kernel(many)(1, 2, 3, 4, 5, 6, 7.0) == 28.0


@jit.outlined
def part_of_it(x):
    return x + 1.0


def a_kernel(x):
    return part_of_it(x) * 2.0


def test_numba_asks_a_kernel_to_optimise_its_functions(monkeypatch, tmp_path):
    """And each of the hooks of `compilers.py` is called."""
    monkeypatch.setattr(machine_code, "_folder", lambda: tmp_path)
    asked = []
    ours = compilers._Kernel._optimize_functions

    def seen(self, module):
        asked.append(sum(not function.is_declaration for function in module.functions))
        ours(self, module)

    monkeypatch.setattr(compilers._Kernel, "_optimize_functions", seen)
    kernel = jit.kernel(a_kernel)
    assert kernel(1.0) == 4.0
    assert asked
    assert min(asked) > 0


def test_python_alone_calls_the_machine_code_of_a_kernel(monkeypatch, tmp_path):
    """Its one function is the wrapper, in this process and in one that loads it."""
    monkeypatch.setattr(machine_code, "_folder", lambda: tmp_path)
    for _process in range(2):
        kernel = jit.kernel(a_kernel)
        assert kernel(1.0) == 4.0
        (made,) = kernel.overloads.values()
        (alone,) = [one for one in _functions(made.library) if one.linkage == Linkage.external]
        assert alone.name == made.fndesc.llvm_cpython_wrapper_name
    assert sum(kernel.stats.cache_hits.values()) == 1


@jit.kernel
def inner_kernel(x):
    return x * 2.0


def outer_kernel(x):
    return inner_kernel(x) + 1.0


def test_a_kernel_that_another_calls_is_traced(monkeypatch, tmp_path):
    monkeypatch.setattr(machine_code, "_folder", lambda: tmp_path)
    assert jit.kernel(outer_kernel)(1.0) == 3.0
    assert not inner_kernel.overloads


def first_of(numbers):
    return numbers[0]


@pytest.mark.parametrize(("arguments", "alone"), [(4, False), (401, True)])
def test_a_long_kernel_of_many_arguments_is_in_its_wrapper_too(monkeypatch, tmp_path, arguments, alone):
    monkeypatch.setattr(machine_code, "_folder", lambda: tmp_path)
    kernel = jit.long_kernel(first_of)
    assert kernel(tuple(map(float, range(arguments)))) == 0.0
    (made,) = kernel.overloads.values()
    assert (len(_functions(made.library)) == 1) is alone


def _functions(library):
    return [one for one in library._get_module_for_linking().functions if not one.is_declaration]


def of_arguments(x, n, record, tables, nothing, flag):
    plain, turned, spaced, narrow, counts, point = tables
    numbers = x + record.x, n + record.n, record.inner.y, record.inner.flag, flag, nothing is None
    sizes = plain.shape[0], turned.shape[0], turned.shape[1], spaced.shape[0], point.ndim
    return *numbers, *sizes, plain[-1], turned[1, 2], spaced[1], spaced[-1], narrow[1], counts[2], counts.size


def test_a_kernel_reads_its_arguments_from_where_python_has_them(monkeypatch, tmp_path):
    """The fields of floats, tuples and arrays are not documented; none of them is taken, or given back twice."""
    monkeypatch.setattr(machine_code, "_folder", lambda: tmp_path)
    kernel = jit.kernel(of_arguments)
    turned = np.asfortranarray(np.arange(12.0).reshape(3, 4))
    arrays = np.arange(3.0), turned, turned[::2, 1], np.arange(4, dtype=np.float32), np.arange(5)[::-1], np.array(7.0)
    arrays[0].flags.writeable = False
    for float_, int_ in itertools.product((0.1, np.float64(-0.0), math.nan), (3, np.int64(-(2**62)), True + 0)):
        given = float_, int_, Record(float_, int_, Inner(2.5, True)), arrays, None, np.False_
        before = [*map(sys.getrefcount, arrays), sys.getrefcount(given[2])]
        assert bits(kernel(*given)) == bits(of_arguments(*given))
        assert [*map(sys.getrefcount, arrays), sys.getrefcount(given[2])] == before
    assert len(kernel.signatures) == 1


def test_what_numba_compiles_of_a_helper_is_no_machine_code(monkeypatch, tmp_path):
    monkeypatch.setattr(machine_code, "_folder", lambda: tmp_path)
    made = []
    for step in ("_optimize_final_module", "_finalize_final_module", "get_pointer_to_function"):
        ours = getattr(compilers._Part, step)
        monkeypatch.setattr(
            compilers._Part, step, lambda self, *given, ours=ours, step=step: made.append(step) or ours(self, *given)
        )
    helper = jit.inlined(loop_with_else)
    assert jit.kernel(calls_it)(1.0) == 3.0
    assert helper is loop_with_else
    assert set(made) == {"_optimize_final_module", "_finalize_final_module", "get_pointer_to_function"}


def calls_it(x):
    return loop_with_else(x)
