"""Compilation: the same definitions in Python and in kernels, and a cache that notices edits."""

import ast
import functools
import math
import os
import re
import subprocess
import sys
import threading
from pathlib import Path
from types import SimpleNamespace
from typing import NamedTuple

import llvmlite.binding as llvm
import numba
import numpy as np
import pytest
from children import python
from conftest import LAWS, call, compiled, every_surface, numbers_of, rarely, scene_of
from numba.core.codegen import JITCodeLibrary
from numba.core.errors import TypingError

import swarm
from swarm.compiled_scene import MOST_WALLS
from swarm.kernel import arrays, cache, compiling, lines, machine_code
from swarm.kernel import jit as _jit
from swarm.kernel.arrays import kept
from swarm.kernel.compilers import _DEEPEST, _Kernel, deep, features_of
from swarm.kernel.gravity import Gravity, accelerated, displacement, potential
from swarm.kernel.jit import select
from swarm.kernel.record import Record
from swarm.kernel.vector import Vec, absolute, cross, dot, largest, moves, norm, square, times, total
from swarm.surfaces.time_of_impact import flights

PACKAGE = Path(swarm.__file__).parent
compiled_only = pytest.mark.skipif(
    bool(numba.config.DISABLE_JIT), reason="NUMBA_DISABLE_JIT is set: nothing is compiled that could be compared"
)


# --- The same in Python and in kernels -------------------------------------------------------------------


def every_function_of_a_surface(surface, r, v, pull, kappa):
    q0, q1 = surface.inner(r), surface.inner(v)
    return (
        surface.phi(r),
        surface.gradient(r),
        surface.first_hit(r, v),
        surface.first_hit(r, 0.0 * v),
        surface.safe_time(r, v, pull),
        surface.unit_normal(r),
        surface.chord_normal(r, 0.1 * v, kappa),
        (q0, q1, surface.gap_of(q0), surface.level_of(q1)),
        surface.gap_slope(q0, q1),
        surface.discrete_gradient(r, v),
        surface.push(r, v, kappa),
        surface.rise(r, v, kappa),
        surface.project(r),
    )


def every_function_of_a_chain(whole, r, v, pull, kappa):
    return (
        whole.length(),
        flights.first_hit(whole, None, r, v),
        flights.first_hit(whole, Gravity(pull.x, pull.y, pull.z), r, v),
        flights.hit_of(whole, None, 1.0, r, v),
        flights.other_hit(whole, 0.0, r, v),
        whole.unit_normal(2.0, r),
        whole.outside(1.0, r),
        whole.push(1.0, r, v, kappa),
        flights.free_time(None, whole, r, v),
        flights.free_time(Gravity(pull.x, pull.y, pull.z), whole, r, v),
        whole.touched(r, v),
    )


def every_function_of_gravity(pull, r, t):
    return displacement(pull, r, t), accelerated(pull, r, t), potential(pull, r)


def every_function_of_a_vector(a, b, k):
    return (
        (a + b, a - b, k * a, b * k, a / k, times(a, b), cross(a, b), absolute(a)),
        (dot(a, b), square(a), norm(a), total(a), largest(a), moves(a)),
        (select(k > 0.0, a, b), select(k < 0.0, a, b), kept(a)),
    )


@_jit.inlined
def _every_function_of_a_law(law, g0, g1):
    return (
        law.stored_energy(g0),
        law.stiffness(g1),
        law.energy_slope(g0, g1),
        law.energy_slope(g1, g1 * 1.001),
        law.energy_slope(-g1, g1),
    )


def every_function_of_a_law(law, g0, g1):
    return _every_function_of_a_law(law, g0, g1)


def flat(nested):
    return [part for one in nested for part in flat(one)] if isinstance(nested, tuple) else [float(nested)]


# A cavity and a solid have numbers of the same type.
_once = functools.cache(compiled)


def assert_the_same(function, first, *arguments):
    """Bit for bit: strict arithmetic has one answer."""
    in_kernel, in_python = _once(function)(first, *arguments), call(function, first, *arguments)
    assert flat(in_kernel) == flat(in_python)


NUMBERS = (Vec(0.3, -0.1, 0.4), Vec(0.5, -0.7, 0.2), Vec(0.1, -0.3, 0.9), 0.02)


@pytest.mark.level3
@compiled_only
@every_surface
def test_surfaces_are_the_same_compiled(name):
    assert_the_same(every_function_of_a_surface, numbers_of(name), *NUMBERS)


@pytest.mark.level3
@compiled_only
def test_chains_are_the_same_compiled():
    assert_the_same(every_function_of_a_chain, scene_of("sphere", "plane", "ellipsoid").compiled().walls(), *NUMBERS)


@pytest.mark.level3
@compiled_only
@pytest.mark.parametrize("pull", [None, Gravity(0.1, -0.2, 0.3)], ids=["none", "some"])
def test_gravity_is_the_same_compiled(pull):
    assert_the_same(every_function_of_gravity, pull, NUMBERS[0], 0.5)


@pytest.mark.level3
@compiled_only
def test_vectors_are_the_same_compiled():
    assert_the_same(every_function_of_a_vector, *NUMBERS[:2], 0.02)


@pytest.mark.level3
@compiled_only
@pytest.mark.parametrize("exponent", ["1.0", "1.5"])
def test_laws_are_the_same_compiled(exponent):
    assert_the_same(every_function_of_a_law, LAWS[exponent], -0.1, 0.3)


@pytest.mark.level3
@compiled_only
def test_the_power_law_is_nearly_the_same_compiled():
    """`pow` is the one function whose last bit may differ."""
    law = LAWS["12.0"]
    in_kernel = flat(compiled(every_function_of_a_law)(law, 0.1, 0.3))
    assert in_kernel == pytest.approx(flat(call(every_function_of_a_law, law, 0.1, 0.3)), rel=1e-13)


# --- Methods ---------------------------------------------------------------------------------------------


class Thing(Record):
    """The base of several classes."""

    def kind(self, number):
        return -1.0


class Heavy(Thing):
    x: float

    def kind(self, number):
        return self.x + number


class Heavier(Heavy):
    def kind(self, number):
        return 2.0 * super().kind(number)


def kind_of(thing, number):
    return 2.0 if thing is None else thing.kind(number)


THINGS = [(Heavy(4.0), 14.0), (Heavier(4.0), 28.0), (None, 2.0), (Thing(), -1.0)]


@pytest.mark.parametrize(("thing", "answer"), THINGS, ids=repr)
def test_methods_in_python(thing, answer):
    assert kind_of(thing, 10.0) == answer


@pytest.mark.level3
@compiled_only
@pytest.mark.parametrize(("thing", "answer"), THINGS, ids=repr)
def test_methods_in_kernels(thing, answer):
    assert _jit.kernel(kind_of)(thing, 10.0) == answer


def select_all(a, b):
    return _jit.select(a > b, a, b), _jit.select(a > b, 1.0, a / (b - b)), _jit.select((a > b) & (a > 0.0), -a, a)


@pytest.mark.level3
@pytest.mark.parametrize("first", [1.0, 3.0])
def test_select(first):
    """Both sides are evaluated, one is taken; an infinity on the other side has no effect."""
    expected = (max(first, 2.0), 1.0 if first > 2.0 else math.inf, -first if first > 2.0 else first)
    assert call(select_all, first, 2.0) == expected
    assert (
        compiled(select_all)(np.float64(first), np.float64(2.0)) == expected if not numba.config.DISABLE_JIT else True
    )


# --- What kernels are made of ----------------------------------------------------------------------------


@_jit.outlined
def used_up(i):
    numbers, flags = arrays.scratch((2, 3), np.float64), arrays.scratch(5, np.bool_)
    clean = numbers.shape == (2, 3) and flags.size == 5 and numbers.sum() == 0.0 and not flags.any()
    numbers[1, 2], flags[4] = i, True
    return clean and numbers[1].sum() == i and not flags[:4].any()


def used_up_often(rounds):
    clean = True
    for i in range(rounds):
        clean = clean and used_up(i)
    return clean


@pytest.mark.level3
def test_scratch_is_zero_each_time():
    """Far more of it than a stack holds, if it were not released."""
    assert used_up_often(10)
    assert compiled(used_up_often)(1_000_000 if not numba.config.DISABLE_JIT else 10)


class Tables(NamedTuple):
    """As `lanes.arrays.Lanes`: two tables, and an array of one row."""

    first: np.ndarray
    second: np.ndarray
    row: np.ndarray


def summed(tables):
    for i in range(tables.row.size):
        tables.second[1, i] = tables.first[2, i] + tables.row[i]


SPACED = arrays.spaced(24)


def summed_with_distances(tables):
    tables = SPACED(tables)
    for i in range(tables.row.size):
        tables.second[1, i] = tables.first[2, i] + tables.row[i]


@pytest.mark.level3(only=True)
@compiled_only
@pytest.mark.parametrize(("function", "known"), [(summed, False), (summed_with_distances, True)])
def test_distances_of_rows_are_known_to_the_compiler(function, known):
    """The distance of two rows of 24 numbers, 384 bytes, is in the text of the kernel, and what it does is the same."""
    tables = Tables(np.arange(72.0).reshape(3, 24), np.zeros((2, 24)), np.arange(5.0))
    kernel = compiled(function)
    kernel(tables)
    assert tables.second[1, :5].tolist() == [48.0, 50.0, 52.0, 54.0, 56.0]
    assert tables.second.sum() == 260.0
    (text,) = kernel.inspect_llvm().values()
    assert ("i64 384" in text) == known


@pytest.mark.level3(only=True)
@compiled_only
def test_kernels_count_no_references_and_are_vectors(tmp_path):
    """The compiled text of a sphere's kernel: no call that counts, and the square root of a hit for several lanes."""
    code = """
import re, swarm
from swarm.lanes import block as blocks
scene = swarm.Scene([swarm.Sphere(0.5)])
swarm.simulate(scene, swarm.fill(scene, 9, speed=1.0, seed=1), swarm.Impact(), until=1.0, compile="always")
(kernel,) = (blocks.advance_block.inspect_llvm(signature) for signature in blocks.advance_block.signatures)
assert not re.search(r"call[^\\n]*NRT_", kernel)
assert re.search(r"<[248] x double> @llvm.sqrt", kernel)
"""
    python("-c", code, env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}).check_returncode()


# Those that `compilers.py` takes vectors of 512 bits for, unless the user says what the processor has.
IN_WIDE_VECTORS = "avx512vbmi2" in (name for name, has in llvm.get_host_cpu_features().items() if has)
wide_only = pytest.mark.skipif(
    not IN_WIDE_VECTORS or numba.config.CPU_FEATURES is not None,
    reason="the processor is not one on which vectors of 512 bits pay, or $NUMBA_CPU_FEATURES says what it has",
)


def roots(rows):
    for i in range(rows.shape[1]):
        rows[1, i] = math.sqrt(rows[0, i])


@pytest.mark.level3(only=True)
@compiled_only
@wide_only
@pytest.mark.parametrize(
    ("decorator", "is_wide"), [(_jit.kernel, True), (_jit.long_kernel, None), (_jit.wide_long_kernel, True)]
)
def test_kernels_of_flights_take_vectors_of_512_bits(decorator, is_wide, monkeypatch, tmp_path):
    """The square roots of eight lanes at once; of many short loops as many as LLVM takes by itself: of Intel's four."""
    monkeypatch.setattr(machine_code, "_folder", lambda: tmp_path)
    rows, kernel = np.arange(528.0).reshape(2, 264), decorator(roots)
    kernel(rows)
    assert rows[1].tolist() == np.sqrt(rows[0]).tolist()
    by_itself = numba.njit(roots)
    by_itself(rows)
    (text,), (other,) = (list(one.inspect_asm().values()) for one in (kernel, by_itself))
    wide = r"vsqrtpd.*%zmm"
    assert bool(re.search(wide, text)) == (bool(re.search(wide, other)) if is_wide is None else is_wide)


@compiled_only
def test_the_features_that_a_user_names_are_taken_as_they_are(monkeypatch, tmp_path):
    """And a kernel that was compiled for others is not found: they are in its key."""
    monkeypatch.setattr(machine_code, "_folder", lambda: tmp_path)
    kernel = _jit.kernel(roots).compiled
    codegen, keys = kernel.targetctx.codegen(), []
    for named in (None, codegen._tm_features):
        monkeypatch.setattr(numba.config, "CPU_FEATURES", named)
        keys.append(kernel._cache._asked((), codegen)[2])
        is_wide = IN_WIDE_VECTORS and named is None
        assert (features_of(codegen) != codegen._tm_features) == is_wide
    assert (keys[0] != keys[1]) == IN_WIDE_VECTORS


def through_lanes(table, ends, tile, lanes):
    lines.into_lanes(tile, 1, table, 3, ends, 2)
    for c in range(4):
        for lane in range(8):
            tile[5 + c, lane] = tile[1 + c, lane] * tile[1 + c, lane]
    lines.add_from_lanes(table, 4, ends, 2, tile, 1, lanes)


def columns_of(ends):
    """Four columns of the rows for the first ends, by one number after another."""
    table = np.random.default_rng(0).normal(size=(6, 8))
    return [[table[ends[2, lane], 3 + c] for lane in range(8)] for c in range(4)]


@compiled_only
@pytest.mark.parametrize("lanes", [0b11111111, 0b01101001, 0])
def test_rows_go_into_lanes_and_back(lanes, monkeypatch, tmp_path):
    """The same numbers as in plain Python, also where lanes, or both ends of one, are of the same row."""
    monkeypatch.setattr(machine_code, "_folder", lambda: tmp_path)
    rng, ends = np.random.default_rng(0), np.zeros((4, 8), np.int32)
    ends[2:] = [[4, 0, 2, 2, 1, 5, 3, 3], [1, 0, 3, 2, 4, 2, 5, 3]]
    table, tile = rng.normal(size=(6, 8)), np.zeros((9, 8))
    found = table.copy(), tile.copy()
    through_lanes(table, ends, tile, lanes)
    _jit.kernel(through_lanes)(found[0], ends, found[1], lanes)
    assert (found[0] == table).all()
    assert (found[1] == tile).all()
    assert tile[1:5].tolist() == columns_of(ends)


@_jit.outlined
def halved(x):
    return x / 2.0


@_jit.inlined
def quartered(x):
    return halved(halved(x))


@pytest.mark.level3
@compiled_only
def test_only_kernels_become_machine_code(monkeypatch, tmp_path):
    made = []
    optimize, finalize = "_optimize_final_module", "_finalize_specific"
    for library, step in ((JITCodeLibrary, optimize), (_Kernel, optimize), (JITCodeLibrary, finalize)):
        known = getattr(library, step)
        monkeypatch.setattr(library, step, lambda self, known=known: made.append(self.name) or known(self))
    monkeypatch.setattr(machine_code, "_folder", lambda: tmp_path)
    assert _jit.kernel(one_more_quarter)(1.0) == 1.25
    assert made == ["one_more_quarter"] * 2


def one_more_quarter(x):
    return x + quartered(x)


@_jit.outlined
def in_object_mode(x):
    with numba.objmode(y="float64"):
        y = sum([x])
    return y + 1.0


def calls_python(x):
    return in_object_mode(x)


@pytest.mark.level3(only=True)
@compiled_only
@pytest.mark.filterwarnings("ignore:Code running in object mode:numba.core.errors.NumbaWarning")
def test_a_helper_may_call_python(monkeypatch, tmp_path):
    """Numba looks for the objects of a helper beside its machine code, which it has in the kernel only."""
    monkeypatch.setattr(machine_code, "_folder", lambda: tmp_path)
    assert _jit.kernel(calls_python)(1.0) == 2.0


# --- How deep a kernel may be ------------------------------------------------------------------------------


def in_all_directions(n, **laws):
    """Planes in n random directions, 0.5 m away from the origin."""
    normals = np.random.default_rng(0).normal(size=(n, 3))
    return [swarm.Plane(tuple(normal), 0.5, **laws) for normal in normals]


def takes_steps(walls, r):
    return walls.in_steps() or walls.outside(-1.0, r)


@pytest.fixture
def limit_of_a_script():
    before = sys.getrecursionlimit()
    sys.setrecursionlimit(1000)
    yield
    assert sys.getrecursionlimit() == 1000
    sys.setrecursionlimit(before)


@pytest.mark.level3
@compiled_only
def test_the_deepest_fold_of_the_most_walls_compiles(limit_of_a_script, monkeypatch, tmp_path):
    """24 walls nest 1500 frames of the compiler; a script has 1000."""
    monkeypatch.setattr(machine_code, "_folder", lambda: tmp_path)
    walls = swarm.Scene(in_all_directions(MOST_WALLS)).compiled().walls()
    assert not _jit.kernel(takes_steps)(walls, Vec(0.0, 0.0, 0.0))


@compiled_only
def test_a_compilation_that_fails_gives_the_limit_back(limit_of_a_script, monkeypatch, tmp_path):
    monkeypatch.setattr(machine_code, "_folder", lambda: tmp_path)
    with pytest.raises(TypingError):
        _jit.kernel(cannot_be_compiled)(1.0)


def cannot_be_compiled(x):
    return x + "a"


def test_the_limit_stays_until_the_last_thread_is_out(limit_of_a_script):
    entered, may_leave, seen = threading.Event(), threading.Event(), []

    def compile_slowly():
        with deep():
            entered.set()
            may_leave.wait()

    other = threading.Thread(target=compile_slowly)
    with deep():
        other.start()
        entered.wait()
        seen.append(sys.getrecursionlimit())
    seen.append(sys.getrecursionlimit())
    may_leave.set()
    other.join()
    seen.append(sys.getrecursionlimit())
    assert seen == [_DEEPEST, _DEEPEST, 1000]
    # One that is larger, or that is set meanwhile, is left alone.
    for before, within in ((20_000, None), (1000, 5000)):
        sys.setrecursionlimit(before)
        with deep():
            assert sys.getrecursionlimit() == max(before, _DEEPEST)
            sys.setrecursionlimit(within or sys.getrecursionlimit())
        assert sys.getrecursionlimit() == (within or before)
    sys.setrecursionlimit(1000)


MANY_PLANES = """
import sys
sys.path.insert(0, {tests!r})
import swarm
from test_jit import in_all_directions
assert sys.getrecursionlimit() == 1000
scene = swarm.Scene(in_all_directions(24, **{laws!r}), gravity={gravity!r})
start = swarm.Particles((0.0, 0.0, 0.0), (1.0, 0.2, 0.4))
ends = [swarm.simulate(scene, start, swarm.Impact(), until=2.0, compile=tier) for tier in ("always", "never")]
assert ends[0].observables["impacts"][-1] == ends[1].observables["impacts"][-1] > 2
assert (ends[0].particles.position == ends[1].particles.position).all()
assert sys.getrecursionlimit() == 1000
"""


@compiled_only
@pytest.mark.parametrize(
    ("laws", "gravity"),
    [
        pytest.param({}, None, marks=pytest.mark.physics, id="elastic"),  # 12 s
        rarely({"friction": 0.3, "restitution": 0.5}, (0.3, -0.2, -9.81)),  # comes to rest in a corner: a minute
    ],
)
def test_a_script_runs_in_the_most_walls(laws, gravity, tmp_path):
    code = MANY_PLANES.format(tests=str(Path(__file__).parent), laws=laws, gravity=gravity)
    python("-c", code, env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}).check_returncode()


# --- The start -------------------------------------------------------------------------------------------


def one_more(x):
    return x + 1.0


def test_every_kernel_that_a_run_compiles_has_a_name_in_words():
    """What `calls` of the engines yield is named on the terminal while it is compiled."""
    named = set()
    texts = [path.read_text(encoding="utf-8") for path in PACKAGE.rglob("*.py")]
    for text in texts:
        for function in ast.walk(ast.parse(text if "def calls(" in text else "")):
            if isinstance(function, ast.FunctionDef) and function.name == "calls":
                given = [one.value for one in ast.walk(function) if isinstance(one, ast.Yield)]
                named |= {ast.unparse(one.elts[0]).rpartition(".")[2] for one in given if isinstance(one, ast.Tuple)}
    assert len(named) > 15
    assert {name for name in named if compiling.sentence_of(SimpleNamespace(__name__=name)).split()[3] != "of"} == set()


@compiled_only
def test_compilations_are_reported_and_cached_kernels_are_not(tmp_path, monkeypatch, caplog):
    monkeypatch.setattr(machine_code, "_folder", lambda: tmp_path)
    sentences = []
    with caplog.at_level("INFO", "swarm"), cache.kernels_compiled(sentences.append) as spent:
        first = _jit.kernel(one_more)
        assert first(1.0) == first(1.0) == 2.0
        numba.njit(lambda x: x)(1.0)  # no kernel of swarm's
    sentence = "compiling a kernel, once: one_more"
    assert sentences == caplog.messages == [sentence]
    assert spent.seconds > 0.0
    caplog.clear()
    with caplog.at_level("INFO", "swarm"):
        first(1)  # outside of a run, as `pack`
    assert caplog.messages == ["compiling the kernel one_more for this kind of scene, once"]
    with cache.kernels_compiled(sentences.append) as spent:
        assert _jit.kernel(one_more)(1.0) == 2.0  # as another process does
    assert sentences == [sentence]
    assert spent.seconds == 0.0


@compiled_only
def test_no_kernel_waits_for_scipy():
    """Numba imports it before its first kernel, for products of matrices; a kernel that has them finds it still."""
    code = """
import sys, numba, numpy as np
from swarm.kernel import machine_code
assert "scipy.linalg" not in sys.modules
numba.njit(lambda x: x + 1.0)(1.0)
assert "scipy.linalg" not in sys.modules
a = np.array([[1.0, 2.0], [3.0, 4.0]])
product = numba.njit(lambda a: np.dot(a, a))
assert (product(a) == a @ a).all()
assert "scipy.linalg" in sys.modules
"""
    subprocess.run([sys.executable, "-c", code], check=True)
