"""The control flow of helpers in a trace, as in plain Python and as Numba has it."""

import math

import numpy as np
import pytest
from compared import Inner, Record, assert_the_same, bits, compiled_only, in_kernel

from swarm.kernel import record as records
from swarm.kernel.jit import inlined, outlined
from swarm.kernel.trace import calls
from swarm.kernel.trace.frame import UNROLLED

pytestmark = compiled_only
NUMBERS = (0.0, -0.0, 0.5, 1.5, 2.5, -3.0, math.inf, math.nan)
COUNTS = (-1, 0, 1, 2, 5, 12)


# --- Decisions -------------------------------------------------------------------------------------------


def ways(x, n):
    if x > 2.0:
        return x * 2.0
    elif x > 1.0:
        if n > 1:
            return -x
        x = x + 10.0
    elif n == 2:
        y = x
        x = y * 3.0
    else:
        x = 1.0 / x
        if x < 0.0:
            return 7.0
    return x + n


def first_assigned_in_a_branch(x, n):
    if x > 0.0:
        if n > 0:
            low, high = x, 2.0
        else:
            low, high = 1.0, x
        kind = 1
    else:
        low, high, kind = -1.0, x, n
    return low, high, kind


def records_of_ways(x, n):
    best = Record(x, n, Inner(0.0, False))
    pair = (x, 0.0)
    if x > 1.0:
        best = Record(best.x * 2.0, best.n, Inner(x, n > 1))
    elif n > 0:
        pair = pair[1], pair[0]
    if best.inner.flag:
        pair = (best.x, pair[0])
    return best, pair


def becomes_another_type(x, n):
    value = 0
    if x > 0.5:
        value = x
    if n > 1:
        value = value + 1
    return value * 1.0


def expressions(x, n):
    return (
        (1.0 if x > 0.0 else -1.0) + (x if n > 0 else 2.0 if n < 0 else 3.0), x > 0.0 and n > 0, x > 0.0 or n > 0,
        x > 0.0 and n > 0 and x < 2.0, not (x > 0.0 or n == 0), 0.0 < x < 2.0 < n, 0 < n <= 5 != 3, not x,
    )  # fmt: skip


def evaluated_on_their_way_only(x, n):
    numbers = (1.0, 2.0, 3.0)
    good = 0 <= n < 3 and numbers[n] > 1.5
    return good, numbers[n] if 0 <= n < 3 else x


def of_constants(x, n):
    zero = 0.0 if x > 0.5 else -0.0
    if n > 2:
        return zero, x, 1
    if n == 1:
        return zero, x, 1
    if n == 0:
        return -0.0, x, 1
    return 0.0, 2.0, 3


FUNCTIONS = [
    of_constants, ways, first_assigned_in_a_branch, records_of_ways, becomes_another_type, expressions,
    evaluated_on_their_way_only,
]  # fmt: skip


def cases():
    return [(x, n) for x in NUMBERS for n in COUNTS]


@pytest.mark.parametrize("is_outlined", [False, True], ids=["inlined", "outlined"])
@pytest.mark.parametrize("function", FUNCTIONS, ids=lambda one: one.__name__)
def test_decisions(function, is_outlined):
    loose = cases() if function is not becomes_another_type else [one for one in cases() if one[0] > 0.5]
    assert_the_same(function, *loose, outlined=is_outlined)


def is_written_on_its_way_only(x, n, seen):
    found = (x > 1.0 and written(seen, 0)) or (n > 1 and written(seen, 1))
    chosen = written(seen, 2) if x < 0.0 else False
    if n == 2:
        written(seen, 3)
    return found, chosen


@inlined
def written(seen, place):
    seen[place] += 1.0
    return True


def test_what_is_not_reached_is_not_done():
    assert_the_same(is_written_on_its_way_only, *[(x, n, np.zeros(4)) for x, n in cases()])


# --- Loops -----------------------------------------------------------------------------------------------


def leaves_early(x, n):
    for k in range(n):
        if k * x > 3.0:
            return k
        for j in range(k):
            if j + x == 2.5:
                return -j
            if j > 3:
                break
            if j == 1:
                continue
            x = x + 0.25
    return n + 100


def while_loops(x, n):
    rounds = 0
    while x < 100.0 and rounds < n:
        rounds += 1
        if rounds == 3:
            x = x * 3.0
            continue
        if x > 50.0:
            break
        inner = n
        while inner > 0:
            inner -= 2
            x = x + 1.0
    while True:
        rounds += 1
        if rounds > 7:
            break
    return x, rounds


def ranges(x, n):
    a = b = c = d = e = 0.0
    last = -7
    for k in range(n, -2, -1):
        a = a * 2.0 + k
    for k in range(-1, n, 2):
        b = b + x * k
    for k in range(n):
        c = c + k
        last = k
    for k in range(3, n):
        d = d - k
    for k in range(10, n, -3):
        e = e + k * x
    return a, b, c, d, e, last


def known_ranges(x, n):
    total, few, stop = 0.0, 0.0, 0
    for k in range(5, 0, -2):
        few = few * x + k
    for k in range(40):
        total = total + x * k
        if total > 1e3:
            stop = k
            break
    for k in range(3):
        if k == n:
            continue
        few = few + k
    for _ in range(0):
        few = math.nan
    for k in range(n, n):
        few = few + k
    return total, few, stop


def the_counter_is_assigned(x, n):
    total = 0
    for k in range(n):
        k = k * 2
        total = total + k
    return total, x


def carries(x, n):
    total, is_odd, pair, best = 0, False, (x, 1.0), Record(x, 0, Inner(0.0, False))
    for k in range(n):
        total = total + 0.5 * k
        is_odd = not is_odd
        pair = pair[1], pair[0] + 1.0
        if pair[0] > best.x:
            best = Record(pair[0], k, Inner(best.x, is_odd))
    return total * 1.0, is_odd, pair, best


def swaps(x, n):
    a, b, c = x, 1.0, n
    for _ in range(n):
        a, b = b, a + b
        c = c - 1 if c > 0 else c
    return a, b, c


def over_tuples(x, n):
    total, place = 0.0, -1
    for one in (x, 2.0, n):
        if one > 2:
            total = total + one
    for k, (one, other) in enumerate(zip((x, 1.0, n), (2.0, x, 3.0), strict=True)):
        if one == other:
            place = k
            break
        total = total * 2.0 + one
    for one in reversed((x, 2.0)):
        if one > 2.0:
            continue
        total = one - total
    for record in (Record(x, n, Inner(1.0, True)), Record(1.0, 2, Inner(x, False))):
        if record.inner.flag:
            total = total + record.x
        if total > 8.0:
            return total, record.n
    return total, place


def new_in_a_loop(x, n):
    for k in range(n + 2):
        step = x + k
        if step > 3.0:
            found = step
            break
    else_there_is = 0.0
    for _ in range(3):
        found = x
        else_there_is = else_there_is + found
    return else_there_is


LOOPS = [
    leaves_early, while_loops, ranges, known_ranges, the_counter_is_assigned, carries, swaps, over_tuples,
    new_in_a_loop,
]  # fmt: skip


@pytest.mark.parametrize("is_outlined", [False, True], ids=["inlined", "outlined"])
@pytest.mark.parametrize("function", LOOPS, ids=lambda one: one.__name__)
def test_loops(function, is_outlined):
    some = [one for one in cases() if function is not carries or one[1] > 0]
    assert_the_same(function, *some, outlined=is_outlined, numba_has_it=function is not over_tuples)


def around_the_limit(x, n):
    few = more = 0.0
    for k in range(UNROLLED):
        few = few * x + k
    for k in range(UNROLLED + 1):
        more = more * x + k
    return few, more, n


def test_loops_that_are_written_out_and_those_that_are_not():
    assert_the_same(around_the_limit, *[(x, 1) for x in NUMBERS])


def of_unsigned_bounds(n):
    total = np.uint64(0)
    for k in range(np.uint64(2), n):
        total = total + k * k
    for k in range(n):
        total = total + k
    return total


def test_bounds_that_are_unsigned():
    traced = in_kernel(of_unsigned_bounds)
    for n in (0, 2, 3, 9):
        assert traced(np.uint64(n)) == sum(k * k for k in range(2, n)) + sum(range(n))


def writes_in_loops(table, n):
    for i in range(table.shape[0]):
        row = table[i]
        for j in range(row.size):
            row[j] = row[j] + i * n
            if row[j] > 9.0:
                break
    return table[-1, -1]


def test_arrays_in_loops():
    assert_the_same(writes_in_loops, *[(np.arange(12.0).reshape(3, 4), n) for n in (0, 3)])


def takes_the_rows_in_turn(first, second, n):
    """A loop that carries arrays."""
    for _ in range(n):
        first, second = second, first
        first[0] += 1.0
    return first[0], second[0]


def test_a_loop_may_carry_arrays():
    assert_the_same(takes_the_rows_in_turn, *[(np.zeros(2), np.ones(2), n) for n in (0, 1, 4)])


# --- Nested helpers --------------------------------------------------------------------------------------


@outlined
def lowered(x, n):
    if n > 2:
        return x - 1.0, n
    for _ in range(n):
        x = x * 0.5
    return x, 0


@inlined
def twice(x, n):
    x, n = lowered(x, n)
    if x < 0.0:
        return x
    x, n = lowered(x, n + 3)
    return x + n


def nests(x, n):
    total = 0.0
    for k in range(n):
        total = total + twice(x, k)
        if total > 9.0:
            return twice(total, n)
    return total


@pytest.mark.parametrize("is_outlined", [False, True], ids=["inlined", "outlined"])
def test_helpers_in_loops_of_helpers(is_outlined):
    traced = in_kernel(nests, is_outlined)
    for case in cases():
        assert bits(traced(*case)) == bits(nests(*case)), case


class Weight(records.Record):
    """What a helper asks of things of several classes."""

    is_light = False

    def of(self, x):
        return x

    def weighed(self, x, n):
        return self.of(x)


class Half(Weight):
    is_light = True

    def of(self, x):
        return 0.5


class Product(Weight):
    factor: float
    flag: bool

    @property
    def twice(self):
        return 2.0 * self.factor

    def of(self, x):
        if self.flag:
            return self.twice
        return x * self.factor

    def weighed(self, x, n):
        if n > 1:
            return super().weighed(x, n) + 1.0
        return Weight.weighed(self, x, n)


class Larger(Product):
    def of(self, x):
        return super().of(x) if x > 0.0 else 1.0 + super().of(-x)


def weighed(chain, x, n):
    for one in chain:
        if one is None or one.is_light:
            continue
        x = one.weighed(x, n)
        if x > 100.0:
            return -1.0
    return x


CHAIN = (Product(3.0, True), None, Half(), Weight(), Larger(3.0, False), Larger(0.5, True))


def over_a_chain(chain, x, n):
    return weighed(chain, x, n)


@pytest.mark.parametrize("is_outlined", [False, True], ids=["inlined", "outlined"])
def test_methods_of_records_over_a_tuple(is_outlined):
    traced = in_kernel(over_a_chain, is_outlined)
    for case in cases():
        assert bits(traced(CHAIN, *case)) == bits(over_a_chain(CHAIN, *case)), case


def is_one_thing(thing, x):
    if thing is None:
        return x
    if isinstance(thing, Record):
        return thing.x + x
    return thing * x


@pytest.mark.parametrize("thing", [None, Record(3.0, 2, Inner(0.0, True)), 2.5], ids=["none", "record", "number"])
def test_decisions_that_are_known_leave_one_way(thing):
    traced = in_kernel(is_one_thing)
    for x in NUMBERS:
        assert bits(traced(thing, x)) == bits(is_one_thing(thing, x))


def nothing_comes_back(row, x):
    if x > 1.0:
        row[0] = x
        return
    row[1] = x


def of_known_ints(x):
    return lowered(x, 1), lowered(x, 3), lowered(x, 0), lowered(x, True)


def test_a_part_is_made_for_each_int_that_is_known():
    traced = in_kernel(of_known_ints)
    for x in NUMBERS:
        assert bits(traced(x)) == bits(of_known_ints(x))


def test_a_function_that_gives_nothing():
    assert_the_same(nothing_comes_back, *[(np.zeros(2), x) for x in NUMBERS])
    assert_the_same(nothing_comes_back, *[(np.zeros(2), x) for x in NUMBERS], outlined=True)


# --- Arguments of a part ---------------------------------------------------------------------------------


@outlined
def of_two_tables(values, table, k):
    return values[k] + table[1, k]


def through_parts(values, table, columns, sparse, k):
    sparse[k, 1] = of_two_tables(values, table, k) * columns[k, 1] + columns[1, k]
    for row in range(sparse.shape[0]):
        if row > k:
            values[row] = sparse[row, k - 1] + values.size
    return of_two_tables(values[1:], table, k), sparse.shape[0] * table.size, values, columns[k]


@outlined
def in_one_part(values, table, k):
    return values[k] + table[1, k]


def through_one_part(values, table, k):
    return in_one_part(values, table, k)


def test_arrays_of_each_layout_go_through_parts():
    numbers = np.arange(12.0).reshape(3, 4)
    tables = numbers, np.asfortranarray(numbers), np.arange(24.0).reshape(3, 8)[:, ::2]
    cases = ((np.arange(5.0), *(one.copy("K") for one in tables[:2]), tables[2], k) for k in (0, 1, -1))
    assert_the_same(through_parts, *cases, outlined=True, numba_has_it=False)


def test_a_part_takes_of_an_array_what_it_uses():
    """The place of its numbers, and the length that an index from the end needs; not the seven numbers of an array."""
    assert in_kernel(through_one_part)(np.arange(3.0), np.ones((2, 3)), 1) == 2.0
    (part,) = calls.REPLACED[in_one_part].__self__._parts.values()
    assert sorted(one.number for one, _path in part.taken) == [0, 0, 1, 1, 2]
