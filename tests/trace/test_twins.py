"""What a helper is written in: closures, defaults, lambdas, cells of notebooks, files that were edited."""

import ast
import linecache
import math
import subprocess
import sys
import textwrap
from pathlib import Path

import numpy as np
import pytest
from compared import assert_the_same, bits, compiled_only, copied, defined, in_kernel

import swarm
from swarm.kernel.jit import inlined
from swarm.kernel.trace import source
from swarm.surfaces.time_of_impact import flights

pytestmark = compiled_only
NUMBERS = (0.0, -0.0, 0.5, -3.0, math.inf, math.nan)
SCALE = 2.5


# --- Functions -------------------------------------------------------------------------------------------


def scaled(a):
    """Of a global, a default and a keyword."""
    return outer(a) * SCALE + with_defaults(a) + with_defaults(1.0, b=a) + with_defaults(a, more=3.0)


def outer(a):
    if a > 0.0:
        a = a + 1.0
    return a


def with_defaults(a, b=2.0, *, more=0.5):
    return (a if a > b else b) + more


def of_a_closure(power, offset):
    def raised(a):
        total = offset
        for _ in range(power):
            total = total * a
            if total > 100.0:
                return offset
        return total

    return raised


def functions_in_it(a, n):
    def larger(b):
        return a if a > b else b

    def counted(b, k=n):
        if k > 1:
            return b + k
        return b

    smaller = lambda b: a if a < b else b  # noqa: E731
    a = a + 0.25
    return larger(0.3), counted(a), counted(a, 5), smaller(0.3), (lambda b: b if b > a else -b)(0.7)


def takes_functions(a, n):
    total = 0.0
    for function in (outer, abs, math.fabs, np.negative, lambda b: b * 2.0 if b > 1.0 else b):
        total = total + function(a)
    return total, n


def many(*values, **named):
    total = 0.0
    for one in values:
        total = total + one
    return total - named["last"] if named["last"] > 1.0 else total


def of_many(a, n):
    pair = (a, 2.0)
    return many(*pair, n, last=a), many(last=1.5), max(*pair, 1.0)


class Scale:
    """A class with methods that a function finds at a constant object."""

    def __init__(self, by):
        self.by = by

    def times(self, a):
        return a * self.by if a > 0.0 else a

    def __call__(self, a):
        return a + self.by


OBJECT = Scale(3.0)


def of_an_object(a, n):
    return OBJECT.times(a) + OBJECT.by, n


FUNCTIONS = [functions_in_it, takes_functions, of_many, of_an_object]


@pytest.mark.parametrize("function", FUNCTIONS, ids=lambda one: one.__name__)
def test_functions_of_functions(function):
    assert_the_same(function, *[(x, n) for x in NUMBERS for n in (0, 3)], numba_has_it=False)


@pytest.mark.parametrize(
    "function", [scaled, of_a_closure(3, 1.5), of_a_closure(0, -1.0)], ids=["names", "three", "none"]
)
def test_names_mean_what_they_mean_there(function):
    assert_the_same(function, *[(x,) for x in NUMBERS], numba_has_it=False)


def test_a_helper_with_defaults_is_called_with_them():
    helper = inlined(copied(with_defaults))

    def calls(a):
        return helper(a), helper(a, 1.0), helper(a, more=2.0), helper(b=a, a=1.0)

    assert_the_same(calls, *[(x,) for x in NUMBERS], numba_has_it=False)


FIRST, SECOND = (lambda a: a + 1.0 if a > 1.0 else a), (lambda a: a * 5.0 if a > 1.0 else -a)
THIRD, FOURTH = (lambda a: a + 2.0), (lambda a: a + 3.0)


def of_lambdas(a):
    return FIRST(a), SECOND(a), THIRD(a), FOURTH(a)


def test_two_lambdas_on_a_line():
    assert_the_same(of_lambdas, *[(x,) for x in (*NUMBERS, 2.0)], numba_has_it=False)


def statements(a, n):
    """Statements of every kind that kernels have."""
    low: float = a
    high: float
    high = low + 1.0
    (first, second), third = (low, high), 2.0
    first += 1.0
    if n > 2:
        pass
    fourth = fifth = second
    return first, second, third, fourth, fifth


def test_statements():
    assert_the_same(statements, *[(x, n) for x in NUMBERS for n in (0, 3)])


# --- Sources ---------------------------------------------------------------------------------------------

TEXT = """
def found(a):
    if a > 1.0:
        return a * {by}
    return -a
"""


def tried(function, by):
    traced = in_kernel(function)
    assert [traced(a) for a in (2.0, 1.0)] == [2.0 * by, -1.0]


def test_a_cell_of_a_notebook():
    """Two cells of one number of a line."""
    for number, by in enumerate((2.0, 3.0)):
        tried(defined(TEXT.format(by=by), f"<ipython-input-{number}>")["found"], by)


def test_a_file_that_was_edited_is_compiled_as_it_was(tmp_path):
    """Its text is no longer that of the function: Numba compiles what Python runs."""
    file = tmp_path / "edited.py"
    file.write_text(TEXT.format(by=2.0))
    scope = {}
    exec(compile(file.read_text(), str(file), "exec"), scope)
    file.write_text(TEXT.format(by=7.0))
    linecache.checkcache(str(file))
    assert source.node_of(scope["found"].__code__) is None
    helper = inlined(scope["found"])

    def calls(a):
        return helper(a)

    from compared import by_numba

    assert by_numba(calls)(2.0) == 4.0


FUNCTIONS = '''
class Shape:
    @decorated(
        1.0,
    )
    def first(
        self, a
    ):
        """Text."""
        b = [
            a,
# A remark, which ends nothing.
        ]

        def inside(c): return c
        return inside(b)

    @property
    def second(self): return 2
    # The end

def unusual(a):
    text = """
of a line that is indented no more"""
    return a + \\
0.0
@decorated
def last(a):
    return a
'''


def test_a_function_is_parsed_without_the_rest_of_its_file():
    """The same syntax, with the same places; where a line of a string looks like the end of a function, not at all."""
    of_package = Path(flights.__file__).read_text()
    for text, unusual in ((FUNCTIONS, ["unusual"]), (of_package, [])):
        lines, failed = text.splitlines(keepends=True), []
        for whole in source._definitions(text):
            alone = source._definition_alone(lines, source._first_line(whole))
            if alone is None:
                failed.append(whole.name)
            else:
                assert ast.dump(alone, include_attributes=True) == ast.dump(whole, include_attributes=True)
        assert failed == unusual


def test_a_function_without_source():
    """As of `python -c` and of an interactive session."""
    code = textwrap.dedent("""
        import numba
        from swarm.kernel import machine_code
        from swarm.kernel.jit import inlined
        from swarm.kernel.trace import helpers
        @inlined
        def found(a):
            if a > 1.0:
                return a * 2.0
            return -a
        @inlined
        def straight(a):
            return a * 3.0
        calls = numba.njit(lambda a: (found(a), straight(a)))
        assert calls(2.0) == (4.0, 6.0) and calls(1.0) == (-1.0, 3.0)
        assert helpers.left_to_numba.keys() == {"__main__.found", "__main__.straight"}
        assert "the source of found is not known" in helpers.left_to_numba["__main__.found"]
    """)
    subprocess.run([sys.executable, "-c", code], check=True)


def documented(a):
    """An example.

    >>> @inlined
    ... def found(a):
    ...     if a > 1.0:
    ...         return a * 2.0
    ...     return -a
    >>> in_kernel(found)(3.0)
    6.0
    """


def test_a_function_of_a_doctest():
    import doctest

    (test,) = doctest.DocTestFinder().find(documented, "documented", globs={"inlined": inlined, "in_kernel": in_kernel})
    assert doctest.DocTestRunner().run(test) == (0, 2)


def test_the_lines_of_a_twin_are_those_of_the_function():
    """An error in a trace names the line of the user's file."""
    from swarm.kernel.trace.frame import CallFrame
    from swarm.kernel.trace.twins import twin_of

    twin = twin_of(of_a_line, CallFrame(lambda function, *given: function(*given)))
    with pytest.raises(ZeroDivisionError) as raised:
        twin(0)
    lines = {entry.lineno for entry in raised.traceback if str(entry.path) == __file__}
    assert of_a_line.__code__.co_firstlineno + 2 - 1 in lines


def of_a_line(a):
    if a == 0:
        return 1 / a
    return a


def test_a_method_of_the_package_is_found_whatever_its_file_imports():
    assert source.node_of(swarm.kernel.vector.dot.__code__) is not None
    assert bits(in_kernel(swarm.kernel.vector.norm)(swarm.kernel.vector.Vec(3.0, 4.0, 0.0))) == bits(5.0)
