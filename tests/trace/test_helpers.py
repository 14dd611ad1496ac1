"""What is left to Numba: it works, and `left_to_numba` says why; no helper of the package is among it."""

import contextlib
import warnings

import numba
import numpy as np
import pytest
from compared import FLAGS, Inner, Record, bits, compiled_only, copied
from conftest import METHODS, every_surface, scene_of
from numba.core.errors import TypingError

import swarm
from swarm.kernel import jit, machine_code
from swarm.kernel.compilers import deep
from swarm.kernel.trace import helpers
from swarm.run.engine import Run
from swarm.run.machine import run_of
from swarm.run.options import RunOptions
from swarm.run.preflight.admission import task_of

pytestmark = compiled_only


@pytest.fixture(autouse=True)
def left():
    helpers.left_to_numba.clear()
    yield helpers.left_to_numba
    helpers.left_to_numba.clear()


# --- What has no notes -----------------------------------------------------------------------------------


def tries(a):
    try:
        b = a + 1.0
    except Exception:
        b = 0.0
    return b


def loop_with_else(a):
    for k in range(3):
        if k > a:
            break
    else:
        return -1.0
    return a + k


def while_with_else(a):
    k = 0
    while k < 3:
        k += 1
    else:
        a = a + 1.0
    return a + k


def with_a_step(a):
    total = 0.0
    for k in range(0, 9, int(a)):
        total += k
    return total


def divides_what_is_known(a):
    zero = 0.0
    return a + 1.0 / zero


def overflows_what_is_known(a):
    big = 1e300
    return a + big**2


def compares_records(a):
    return Record(a, 1, Inner(a, True)) == Record(2.0, 1, Inner(2.0, True))


def of_two_kinds(a):
    """Numba keeps what may be None or a number, a trace does not."""
    best = None
    for k in range(3):
        if k + 0.5 > a:
            best = k
            break
    return -1 if best is None else best


LEFT = {
    tries: "`try`",
    loop_with_else: "an `else` of a loop",
    while_with_else: "an `else` of a loop",
    with_a_step: "the step of a range must be known before the kernel runs",
    divides_what_is_known: "float division by zero",
    overflows_what_is_known: "Numerical result out of range",
    of_two_kinds: "",
    compares_records: "it asks for a number that is known in the kernel only",
}


@pytest.mark.parametrize("decorator", [jit.inlined, jit.outlined], ids=["inlined", "outlined"])
@pytest.mark.parametrize("function", LEFT, ids=lambda one: one.__name__)
def test_what_cannot_be_traced_is_compiled_by_numba(function, decorator, left):
    helper = decorator(copied(function))

    def calls(a):
        return helper(a)

    direct = numba.njit(**FLAGS)(machine_code.calling(jit.inlined(calls)))
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        assert bits(direct(2.0)) == bits(expected(function))
    reason = left[f"{__name__}.{function.__name__}"]
    first = function.__code__.co_firstlineno
    assert LEFT[function] in reason
    assert any(f"{__file__}, line {line}" in reason for line in range(first, first + 12)), reason
    assert "\n" not in reason


def expected(function):
    with contextlib.suppress(ArithmeticError):
        return function(2.0)
    return float("inf")


def test_nothing_stays_of_a_trace_that_was_given_up(left):
    """What was noted before is taken back: an element would be written twice."""

    def writes_and_gives_up(row):
        row[0] += 1.0
        return 2.0 if (row[0], 1.0) == (1.0, 1.0) else 3.0

    inner = jit.inlined(writes_and_gives_up)

    def calls(row):
        row[1] += 1.0
        return inner(row)

    row = np.zeros(2)
    assert numba.njit(**FLAGS)(machine_code.calling(jit.inlined(calls)))(row) == 2.0
    assert row.tolist() == [1.0, 1.0]
    assert f"{__name__}.writes_and_gives_up" in left


def asks_a_stranger(a):
    return a + open


def is_given_text(a):
    return a + "text"


NEITHER = [
    (asks_a_stranger, "it uses <built-in function open>, which no kernel has"),
    (is_given_text, "there is no add of float64, unicode_type"),
]


@pytest.mark.parametrize(("function", "sentence"), NEITHER)
def test_what_neither_can_do_is_reported_in_one_sentence(function, sentence, left):
    helper = jit.inlined(copied(function))
    with pytest.raises(TypingError):
        numba.njit(**FLAGS)(machine_code.calling(helper))(1.0)
    (reason,) = left.values()
    assert "\n" not in reason
    assert sentence in reason
    assert f"{__file__}, line {function.__code__.co_firstlineno + 1}" in reason


def test_a_kernel_that_cannot_be_traced_is_compiled(tmp_path, monkeypatch, left):
    monkeypatch.setattr(machine_code, "_folder", lambda: tmp_path)
    assert jit.kernel(loop_with_else)(1.0) == 3.0
    assert f"{__name__}.loop_with_else" in left


def test_an_integer_that_no_kernel_holds(left):
    helper = jit.inlined(copied(of_large_numbers))
    assert numba.njit(**FLAGS)(machine_code.calling(helper))(np.uint64(3)) == 3
    assert "more than 64 bits" in left[f"{__name__}.of_large_numbers"]


def of_large_numbers(a):
    large = 2**62
    if large * 2 * 2 > 0:
        return a & (2**64 - 1)
    return a


def test_no_warning_while_a_trace_does_what_is_known(left):
    """A square root of -1 warns in plain Python, and nothing in a kernel."""

    @jit.inlined
    def of_constants(a):
        return a + np.sqrt(-1.0) + np.float64(1.0) / np.float64(0.0)

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert np.isnan(numba.njit(**FLAGS)(machine_code.calling(of_constants))(1.0))
    assert left == {}


def test_threads_trace_at_the_same_time():
    """Each has its own notes."""
    import threading

    def made(number):
        @jit.inlined
        def counted(a):
            total = a
            for k in range(number + 9):
                total = total + k
            return total

        return numba.njit(**FLAGS)(machine_code.calling(counted))

    compiled, results = [made(k) for k in range(4)], {}
    threads = [
        threading.Thread(target=lambda k=k: results.update({k: compiled[k](0.0)})) for k in range(len(compiled))
    ]  # fmt: skip
    for one in threads:
        one.start()
    for one in threads:
        one.join()
    assert results == {k: sum(range(k + 9)) for k in range(4)}


# --- The package -----------------------------------------------------------------------------------------


def trace_kernels(made):
    """Trace the kernels of a run, without LLVM."""
    count = 0
    for kernel, arguments in made.calls():
        helper = helpers.Helper(kernel.py_func, kernel.py_func, outlined=False)
        context = kernel.targetdescr.typing_context
        context.refresh()
        with deep():
            assert helper.whole(context, tuple(map(numba.typeof, arguments))) is not None, helpers.left_to_numba
        count += 1
    return count


@pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)
def test_no_helper_of_a_method_is_left_to_numba(method, left):
    scene = scene_of("sphere", "plane")
    start = swarm.Particles(np.zeros(3), np.zeros(3))
    assert trace_kernels(Run(scene.compiled(), start, method, 1, None, "never")) > 0
    assert left == {}


@every_surface
def test_no_helper_of_a_surface_is_left_to_numba(name, left):
    scene = scene_of(name, gravity=(0.1, 0.2, -9.81))
    start = swarm.Particles(np.zeros(3), np.zeros(3))
    assert trace_kernels(Run(scene.compiled(), start, swarm.Impact(), 1, None, "never")) > 0
    assert left == {}


@pytest.mark.parametrize("run", ["laws", "bodies", "reacting"])
def test_no_helper_of_a_kind_of_run_is_left_to_numba(run, left):
    mass, law = (1.0, {}) if run == "reacting" else (None, {})
    if run == "laws":
        law = {"friction": 0.3, "restitution": 0.5}
    gravity = None if run == "reacting" else (0.0, 0.0, -9.81)
    scene = swarm.Scene([swarm.Plane((0.0, 0.0, -1.0), 0.0, mass=mass), swarm.Sphere(0.5, **law)], gravity)
    start, method = swarm.Particles((0.0, 0.0, 0.1), (1.0, 0.0, 0.0)), swarm.Impact()
    if run == "bodies":
        start, method = swarm.place(scene, swarm.dumbbell(0.1, 1.0), 1), swarm.Impact(dt=1e-2)
    with run_of(task_of(scene, start, method, RunOptions(until=1.0, compile="never"))) as made:
        if run == "laws":
            made._kinds = {1, 2, 4, 5}  # also the kernels of sliding and of corners
        assert trace_kernels(made) > 0
    assert left == {}
