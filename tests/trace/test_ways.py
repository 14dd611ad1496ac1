"""Traces: control flow that a trace gets right, and what it does not know and leaves to Numba."""

import numba
import numpy as np
import pytest

from swarm.kernel import jit, machine_code
from swarm.kernel.arrays import scratch
from swarm.kernel.jit import inlined, outlined
from swarm.kernel.trace import helpers

pytestmark = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="NUMBA_DISABLE_JIT is set: nothing is traced")


@inlined
def rounds(first, last):
    return range(first, last)


@outlined
def halved(x, most):
    while x > most:
        x *= 0.5
        if x < 0.1:
            return most
    return x


def returns_in_a_loop_that_may_be_left(x, n):
    for one in (x[0], x[1]):
        if one > x[2]:
            break
        return one, n
    return -1.0, 0


def goes_on_in_a_loop_that_is_written_out(x, n):
    total = 0.0
    for one in (x[0], x[1], x[2]):
        if one < 0.0:
            continue
        total += one
    return total, n


def takes_values_of_and_and_or(x, n):
    return (x[0] and x[1]) + (x[2] or x[1]), n and 5


def compares_in_a_chain(x, n):
    return x[0] < halved(x[1] + x[2], 0.5) * (x[0] + x[1]) <= x[2], 1 < n < 7


def asks_a_range_of_another(x, n):
    total = 0.0
    for k in rounds(1, n):
        if k == 4:
            break
        for i in range(2, k % 3, -1):
            total += x[i] * k
    return total, len(x)


def asks_an_array(x, n):
    return max(x) + min(x), int(x.argmax())


def changes_its_type(x, n):
    total = 0
    for k in range(n):
        total = total + x[k % 3]
    return total + 0.0, n


def has_the_names_of_twins(x, n):
    _frame, _values = x[0], 0.0
    if _frame > 0.0:
        _values = _frame
    return _values, n


def in_scratch(x, k):
    room = scratch((64, 128), np.float64)
    room[k % 64, 0] += x[k % 3]
    return room[k % 64, 0]


scratch_in_a_loop = inlined(in_scratch)


def asks_for_scratch_in_each_round(x, n):
    total = 0.0
    for k in range(n * 1000):
        total += scratch_in_a_loop(x, k)
    return total, n


TRACED = (
    returns_in_a_loop_that_may_be_left,
    goes_on_in_a_loop_that_is_written_out,
    takes_values_of_and_and_or,
    compares_in_a_chain,
    asks_a_range_of_another,
    asks_an_array,
    changes_its_type,
    has_the_names_of_twins,
    asks_for_scratch_in_each_round,
)


def has_no_value_on_one_way(x, n):
    found = None
    if x[0] > 0.0:
        found = x[0]
    if found is None:
        return -1.0, n
    return 1.0, n


def asks_for_a_class(x, n):
    return 1.0 if isinstance(x[0], float) else 0.0, n


def has_an_else_of_a_loop(x, n):
    for k in range(n):
        if x[k % 3] > 2.0:
            break
    else:
        return 0.0, n
    return 1.0, k


LEFT = (has_no_value_on_one_way, asks_for_a_class, has_an_else_of_a_loop)


@pytest.mark.parametrize("function", [*TRACED, *LEFT], ids=lambda function: function.__name__)
def test_kernels_do_what_python_does(function, monkeypatch, tmp_path):
    monkeypatch.setattr(machine_code, "_folder", lambda: tmp_path)
    monkeypatch.setattr(helpers, "left_to_numba", {})
    kernel = jit.kernel(function)
    for x in ((0.5, 1.5, 2.5), (1.5, -0.5, 1.0), (-1.0, 2.0, 0.0), (0.0, -0.0, 3.0)):
        for n in (0, 3, 9):
            given = np.array(x)
            assert kernel(given, n) == function(given, n)
    assert bool(helpers.left_to_numba) == (function in LEFT), helpers.left_to_numba
