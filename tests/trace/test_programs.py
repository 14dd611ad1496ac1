"""Random functions of kernels: traced, compiled by Numba alone, and in plain Python, bit for bit the same."""

import itertools
import random
import warnings

import numba
import numpy as np
import pytest
from compared import FLOATS, Inner, Record, bits, compiled_only, defined, left_to_numba
from programs import ARGUMENTS, program

from swarm.kernel import jit
from swarm.kernel.trace import helpers

pytestmark = compiled_only
ROWS = 12
INTS = (0, 1, 2, 3, 5, -1, -4, 6, 11, 500, -500)
# Of what a program does with constants, which Python does while it is traced.
UNKNOWN = ("division by zero", "Numerical result out of range")


def cases(seed):
    """Arguments of programs, a row each."""
    chance = random.Random(seed)

    def drawn(choose, kind, *shape):
        return np.array([choose() for _ in range(ROWS * int(np.prod(shape)))], kind).reshape(ROWS, *shape)

    def f():
        return chance.choice((*FLOATS, chance.uniform(-5.0, 5.0), chance.uniform(-5.0, 5.0)))

    def i():
        return chance.choice(INTS)

    def b():
        return chance.random() < 0.5

    numbers = [drawn(f, float), drawn(f, float), drawn(i, np.int64), drawn(b, bool)]
    record = [drawn(f, float), drawn(i, np.int64), drawn(f, float), drawn(b, bool)]
    return numbers, record, drawn(f, float, 5), drawn(i, np.int64, 2, 3)


def kernel_of(count):
    """A kernel that calls each program for each row, and puts what it gives into tables."""
    lines = ["def whole(x, y, n, c, px, pn, py, pf, t, m, floats, ints, flags):", "    for row in range(x.size):"]
    lines += ["        p = Record(px[row], pn[row], Inner(py[row], pf[row]))"]
    for k in range(count):
        given = ARGUMENTS.replace(" p, t, m", "").replace(",", "[row],")
        lines += [
            f"        a, b, d, q = f{k}({given} p, t[{k}, row], m[{k}, row])",
            f"        floats[{k}, row, 0], floats[{k}, row, 1], floats[{k}, row, 2] = a, q.x, q.inner.y",
            f"        ints[{k}, row, 0], ints[{k}, row, 1] = b, q.n",
            f"        flags[{k}, row, 0], flags[{k}, row, 1] = d, q.inner.flag",
        ]
    return "\n".join(lines) + "\n"


def results(scope, count, given):
    """What the kernel of a batch does."""
    numbers, record, t, m = given
    tables = [np.array([one] * count) for one in (t, m)]
    tables += [np.zeros((count, ROWS, 3)), np.zeros((count, ROWS, 2), np.int64), np.zeros((count, ROWS, 2), bool)]
    numba.njit(error_model="numpy")(scope["whole"])(*numbers, *record, *tables)
    return tables


def in_python(function, given, row):
    """The same of one row in plain Python, or None where it has no result."""
    numbers, record, t, m = given
    px, pn, py, pf = (one[row] for one in record)
    t, m = t[row].copy(), m[row].copy()
    try:
        a, b, d, q = function(*(one[row] for one in numbers), Record(px, pn, Inner(py, pf)), t, m)
    except (ArithmeticError, ValueError):  # of constants
        return None
    numbers = [float(a), float(q.x), float(q.inner.y)]
    return [t.tolist(), m.tolist(), numbers, [int(b), int(q.n)], [bool(d), bool(q.inner.flag)]]


def check(seeds, with_numba):
    """Compare a batch; how many rows plain Python had a result for."""
    text = "".join(program(seed, f"f{k}") + "\n" for k, seed in enumerate(seeds)) + kernel_of(len(seeds))
    traced, numbas, plain = (defined(text, f"<programs {seeds[0]} {name}>") for name in ("traced", "numba", "plain"))
    helpers.left_to_numba.clear()
    for k in range(len(seeds)):
        (jit.inlined if k % 2 else jit.outlined)(traced[f"f{k}"])
        numbas[f"f{k}"] = left_to_numba(numbas[f"f{k}"])
    given, compared = cases(seeds[0]), 0
    got = results(traced, len(seeds), given)
    others = results(numbas, len(seeds), given) if with_numba else got
    for reason in helpers.left_to_numba.values():
        assert any(one in reason for one in UNKNOWN), reason
    for k, seed in enumerate(seeds):
        for row in range(ROWS):
            mine = [table[k, row] for table in got]
            assert bits(mine) == bits([table[k, row] for table in others]), (seed, row)
            with np.errstate(all="ignore"), warnings.catch_warnings():
                warnings.simplefilter("ignore")
                expected = in_python(plain[f"f{k}"], given, row)
            if expected is not None:
                compared += 1
                assert bits(mine) == bits(expected), (seed, row)
    return compared


BATCH = 20


@pytest.mark.parametrize("batch", range(5))
def test_random_programs(batch):
    """A hundred of them; of the first few also what Numba makes of them by itself."""
    first = batch * BATCH
    ends = (first, 6, first + BATCH) if batch == 0 else (first, first + BATCH)
    parts = [range(one, other) for one, other in itertools.pairwise(ends)]
    assert sum(check(seeds, with_numba=seeds[0] == 0) for seeds in parts) > 0.8 * BATCH * ROWS


@pytest.mark.long
@pytest.mark.parametrize("batch", range(100))
def test_many_random_programs(batch):
    seeds = range(1000 + batch * BATCH, 1000 + (batch + 1) * BATCH)
    assert check(seeds, with_numba=True) > 0.8 * BATCH * ROWS
