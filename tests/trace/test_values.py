"""Operations of kernels in a trace: numbers, records, arrays, bit for bit as in plain Python and as Numba has them."""

import itertools
import math

import numpy as np
import pytest
from compared import FLOATS, INTS, Inner, Record, assert_the_same, bits, by_numba, compiled_only, in_kernel

from swarm.kernel.jit import select
from swarm.kernel.vector import Vec, cross, dot, moves

pytestmark = compiled_only
PAIRS = {
    "floats": list(itertools.product(FLOATS, repeat=2)),
    "ints": list(itertools.product(INTS, repeat=2)),
    "int and float": list(itertools.product(INTS, FLOATS)),
}
each_pair = pytest.mark.parametrize("kind", PAIRS)


# --- Numbers ---------------------------------------------------------------------------------------------


def arithmetic(a, b):
    return a + b, a - b, a * b, a + 2, 2 - a, 3 * b, a + 0.5, 1.5 * b, -a, +a, abs(a), a / 3, a / 4.0


def comparisons(a, b):
    return (a < b, a <= b, a > b, a >= b, a == b, a != b, a < 1, b >= 0.0, (a < b) & (b < 3), (a < b) | (a > 2)), (
        (a < b) ^ (b > 0), not a, not a < b, a < b < 4, 0 < a != b, bool(a),
    )  # fmt: skip


def searches(a, b):
    return a in (0, 1, b), a not in (2, b), a in (b,)


def quotients(a, b):
    return a / b, a // b, a % b, a // 3, a % 3, a % -2


def choices(a, b):
    return max(a, b), min(a, b), max(a, b, -a), min(b, a, a), select(a < b, a, b), a if a < b else b


def whole_numbers(a, b):
    return (a & b, a | b, a ^ b, ~a, a << 3, b >> 2, a & 7, 1 | b), (a**2, b**3, a**0, a**1)


def conversions(a, b):
    return float(a), np.float64(b), float(a) + 1, int(b > 0) if b > 1 else 2


def of_floats(a, b):
    return (
        (np.sqrt(a), np.floor(a), np.ceil(a), np.trunc(b), np.fabs(b), np.copysign(a, b), np.isnan(a), np.isinf(b)),
        (np.isfinite(a), np.minimum(a, b + 3.0), np.maximum(3.0, b), np.signbit(a), math.isnan(a), math.isinf(b)),
        (math.isfinite(b), math.copysign(a, b), math.fabs(a), a**2, b**1, a**0),
    )


@each_pair
@pytest.mark.parametrize("function", [arithmetic, comparisons, conversions], ids=lambda one: one.__name__)
def test_operations(function, kind):
    assert_the_same(function, *PAIRS[kind])


@each_pair
def test_searches(kind):
    """Among tuples of several types, which Numba by itself does not search."""
    assert_the_same(searches, *PAIRS[kind], numba_has_it=False)


@pytest.mark.parametrize("kind", ["floats", "ints"])
def test_choices(kind):
    assert_the_same(choices, *PAIRS[kind])


def test_choices_between_an_int_and_a_float_are_floats():
    """Plain Python gives the one that it chooses."""
    traced, numbas = in_kernel(choices), by_numba(choices)
    for pair in PAIRS["int and float"]:
        assert bits(traced(*pair)) == bits(numbas(*pair)), pair


def test_operations_of_whole_numbers():
    assert_the_same(whole_numbers, *PAIRS["ints"])


def test_operations_of_floats():
    assert_the_same(of_floats, *PAIRS["floats"])


def has_one_quotient(a, b):
    """Where NumPy and Numba agree: what an infinity and a zero leave over is NumPy's own."""
    return b != 0 and math.isfinite(a) and math.isfinite(b) and abs(a) < 1e300 and (a, b) != (-(2**63), -1)


@each_pair
def test_quotients(kind):
    ordinary = [pair for pair in PAIRS[kind] if has_one_quotient(*pair) and abs(pair[0] / pair[1]) < 1e15]
    assert_the_same(quotients, *ordinary)


def numbas_own(a, b):
    return a / b, a // b, a % b, a * b, a**3, a**5


@each_pair
def test_zeros_and_overflows_are_as_numba_has_them(kind):
    traced, numbas = in_kernel(numbas_own), by_numba(numbas_own)
    for pair in PAIRS[kind]:
        if pair != (-(2**63), -1):  # a trap of the processor, without Numba too
            assert bits(traced(*pair)) == bits(numbas(*pair)), pair


def of_truths(a, b):
    return a & b, a | b, a ^ b, not a, a == b, a != b, a and b, a or b, select(a, 1.0, 2.0), 3 if a else 4, bool(a)


def test_truths():
    assert_the_same(of_truths, *itertools.product((True, False), repeat=2))


def functions_of_the_library(a):
    return (
        math.sqrt(a), math.floor(a), math.ceil(a), math.hypot(a, 2.0), int(a), round(a), np.float64(3), np.int64(a),
        np.uint64(a), np.rint(a), np.sign(a),
    )  # fmt: skip


def test_functions_of_numbers():
    assert_the_same(functions_of_the_library, *[(one,) for one in (0.0, 0.5, 1.5, 2.5, 2.7, 1e9, 7.0)])


def transcendental(a):
    return (
        (np.sin(a), np.cos(a), np.tan(a), np.exp(a), np.log(a), np.arctan2(a, 0.5), np.hypot(a, 2.0), np.cbrt(a)),
        (math.sin(a), math.cos(a), math.exp(a), math.log(a), math.atan2(a, 2.0), math.pow(a, 1.5), a**1.5, 2.0**a),
        (math.acos(a / 9), math.asin(a / 9), math.atan(a), math.sinh(a), math.tanh(a), math.log1p(a), math.expm1(a)),
    )


def test_transcendental_functions_are_numbas_and_nearly_pythons():
    traced, numbas = in_kernel(transcendental), by_numba(transcendental)
    for one in (0.1, 0.7, 1.0, 3.3, 8.9):
        assert bits(traced(one)) == bits(numbas(one))
        np.testing.assert_allclose(np.concatenate(traced(one)), np.concatenate(transcendental(one)), rtol=1e-15)


def of_bits(a):
    word = np.uint64(a)
    word = (word ^ (word >> np.uint64(7))) * np.uint64(0xBF58476D1CE4E5B9)
    return word, word >> np.uint64(60), np.int64(word & np.uint64(0xFF)), word % np.uint64(10), word < np.uint64(2**63)


def test_words_of_64_bits():
    assert_the_same(of_bits, *[(np.uint64(one),) for one in (0, 1, 2**63, 2**64 - 1)])


# --- Records ---------------------------------------------------------------------------------------------


def of_records(p, k):
    q = p._replace(x=p.x + k)
    made = Record(k, p.n + 1, Inner(p.x, not p.inner.flag))
    x, n, (y, flag) = q
    chosen = select(k > 0.0, p, q) if flag else made
    return q, made, x * y, n, chosen, p.inner, len(p), p[0], p[-1].y, p[1:], (k, *p.inner)


def test_records():
    records = [Record(a, 3, Inner(b, c)) for a, b in [(1.0, -0.0), (math.nan, 2.0)] for c in (True, False)]
    assert_the_same(of_records, *itertools.product(records, (0.5, -0.0, -3.0)), numba_has_it=False)


def of_vectors(a, b, k):
    total = sum((a.x, a.y, a.z)) if moves(b) else 0.0 * a.x
    return a + b, a - b, k * a, b * k, a / k, dot(a, b), cross(a, b), total, a.y + 1.0, a[1], k in a


@pytest.mark.parametrize("k", [2.0, 0.0, math.nan])
def test_vectors(k):
    assert_the_same(of_vectors, (Vec(1.0, -0.0, 3.5), Vec(0.25, 1e300, -2.0), k), numba_has_it=False)


def of_nothing(a, other):
    if a is None:
        return other
    return a.x + other


@pytest.mark.parametrize("a", [None, Record(2.0, 1, Inner(0.0, True))], ids=["none", "some"])
def test_what_may_be_none(a):
    assert_the_same(of_nothing, (a, 1.5))


def of_tuples(pair, k):
    nested = (pair, (k, None))
    first, *others = (*pair, k)
    return nested[0][1], first, others[0], nested[1][1], len(nested), pair + pair, pair[::-1], tuple(pair), max(pair)


def test_tuples():
    assert_the_same(of_tuples, ((1.0, -2.0), 3.0), ((math.nan, 0.0), -0.0), numba_has_it=False)


def at_a_place_of_the_kernel(numbers, k):
    return numbers[k], numbers[k - 1] + numbers[-1]


def test_a_tuple_at_a_place_that_only_the_kernel_knows():
    assert_the_same(at_a_place_of_the_kernel, *[((1.0, 2.0, 4.0), k) for k in (0, 1, 2)])


# --- Arrays ----------------------------------------------------------------------------------------------


def layouts(kind, *shape):
    """The same numbers in C order, in Fortran's and with gaps."""
    numbers = (np.arange(math.prod(shape)) % 5 - 1).astype(kind).reshape(shape)
    wide = np.zeros([2 * one for one in shape], kind)
    gaps = wide[(slice(None, None, 2),) * len(shape)]
    gaps[...] = numbers
    return {"C": numbers, "F": np.asfortranarray(numbers), "strided": gaps, "reversed": numbers[::-1].copy()[::-1]}


KINDS = (np.float64, np.int64, np.int32, np.bool_, np.uint64)


def of_a_row(a, i):
    read = a[0], a[i], a[-1], a[i - 3], a[np.uint64(i)]
    a[i], a[-2] = a[1], a[i - 1]
    a[2] = a[-1]
    return read, a.size, a.shape, a.shape[0], a.ndim, len(a), a[i]


def of_a_table(a, i, j):
    read = a[0, 0], a[i, j], a[-1, j], a[i, -1], a[i - 2, j - 3], a[np.uint64(i), j], a[1][j]
    a[i, j] = a[j - 1, i]
    a[-1, -1] = a[i, 0]
    return read, a.shape, a.size, a.ndim, a.shape[1], len(a)


def of_a_block(a, i):
    read = a[i, 1, -1], a[-1, i, i - 2], a[0, 0, 0]
    a[i, -1, 1] = a[0, i, -1]
    return read, a.shape, a.ndim, a[i, 0, i]


@pytest.mark.parametrize("layout", ["C", "F", "strided", "reversed"])
@pytest.mark.parametrize(
    ("function", "shape", "places"),
    [(of_a_row, (4,), [(1,), (3,)]), (of_a_table, (3, 4), [(1, 2), (2, 1)]), (of_a_block, (2, 3, 4), [(1,), (0,)])],
    ids=["row", "table", "block"],
)
def test_elements(function, shape, places, layout):
    # Of all kinds of numbers where the layout is the simplest, which has the same way to its elements.
    for kind in KINDS if len(shape) == 1 and layout == "C" else KINDS[:1]:
        assert_the_same(function, *[(layouts(kind, *shape)[layout], *place) for place in places])


def slices(a, b, i):
    a[1:3, 0] = b[:2]
    part = a[:, 1]
    part[i] = 7.0
    b[i:] = part[i:]
    return part[0], part.size, a[1, :].shape, a[i][2], a[1:, i].size, b[::2].size, a[..., 0].size


@pytest.mark.parametrize("layout", ["C", "F", "strided"])
def test_slices(layout):
    # An assignment to a slice takes Numba seconds to compile: once.
    case = layouts(float, 3, 4)[layout], layouts(float, 3)[layout], 1
    assert_the_same(slices, case, numba_has_it=layout == "C")


def goes_through(a, table):
    total = a[0] * 0
    for one in a:
        total += one
    for row in table:
        for one in row:
            total = total * 2 + one
        row[0] = total
    return total


@pytest.mark.parametrize("kind", [np.float64, np.int64])
def test_iteration_over_arrays(kind):
    assert_the_same(goes_through, (layouts(kind, 11)["C"], layouts(kind, 3, 2)["C"]))


def sums(a):
    return a.sum(), a.any(), a.argmax(), a.mean()


def test_methods_of_arrays():
    assert bits(in_kernel(sums)(np.arange(4.0))) == bits(by_numba(sums)(np.arange(4.0))) == bits((6.0, True, 3, 1.5))


TABLE = np.arange(6.0).reshape(2, 3)


def of_a_constant(i):
    return TABLE[1, 2], TABLE[i, 0], TABLE[i, i] + TABLE[0, 1], TABLE.shape, TABLE.size


def test_arrays_that_are_known():
    assert_the_same(of_a_constant, (0,), (1,))


def increments(a, i):
    a[i] += 1
    a[i,] -= 3
    a[0] *= a[i]
    a[-1] /= 2


def test_increments():
    assert_the_same(increments, (np.arange(3.0), 1), (np.array([math.inf, math.nan, -0.0]), 2))
