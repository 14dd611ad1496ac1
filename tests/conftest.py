"""Tables that the tests share: a new surface, method or law joins by one line."""

import contextlib
import functools
import gc
import itertools
import os
import resource
import signal
import sys
import types

# Level 0 of LLVM takes half of the time to compile and gives the same bits. Tests of what level 3 makes are marked.
os.environ.setdefault("NUMBA_OPT", "0")

import durations
import numba
import numpy as np
import pytest
from _pytest.doctest import DoctestModule
from hypothesis import HealthCheck, Phase, reject, settings
from hypothesis import strategies as st
from hypothesis.internal.conjecture import providers
from numba.core.config import _OptLevel

import swarm
from swarm.contact import reflection
from swarm.contact.regularisation import Hertz, Linear, regularisation
from swarm.kernel import machine_code
from swarm.kernel.jit import inlined
from swarm.kernel.vector import Vec, vec
from swarm.run import tiers
from swarm.surfaces.rotation import Rotated
from swarm.surfaces.walls import Walls

# Tests start Python a hundred times. Each start reads the bytecode that an earlier one kept, which saves 0.2 s of it.
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

# Hypothesis draws numbers that stand in the source of whatever modules are loaded: what a test draws would depend on
# the tests before it in its process, and on every other change of the package.
providers._get_local_constants = providers.Constants

settings.register_profile(
    "swarm",
    derandomize=True,
    max_examples=25,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much],
    phases=[Phase.explicit, Phase.generate, Phase.shrink],
)
settings.load_profile("swarm")

# What plain Python does sooner than a kernel is compiled is not worth compiling, also where others use the processor.
# At level 0 a kind takes 1 to 3 s of processor time, a particle that slides for ten crossings in plain Python 2 s.
tiers._PATIENCE = 4.0
# The tier of a test does not depend on the tests before it.
SPENT, tiers.spent = tiers.spent, lambda kinds: 0.0
EPSILON = float(np.finfo(np.float64).eps)


@pytest.fixture
def compiled_at_once(monkeypatch):
    """Runs are compiled from the start: those that plain Python would not end before it is out of patience."""
    monkeypatch.setattr(tiers, "_PATIENCE", 0.0)


@pytest.fixture
def optimized(monkeypatch):
    """Kernels that run for seconds at level 0 are compiled at level 1, where they take half of it."""
    monkeypatch.setattr(numba.config, "OPT", max(numba.config.OPT, _OptLevel(1)))


def pytest_ignore_collect(collection_path, config):
    """Files of the long ring take seconds to import: not where `-m` excludes it and no file is named.

    Nor are those imported where only tests marked `level3` run, and none in them is.
    """
    wanted = config.option.markexpr
    if collection_path.name == "long" and "not long" in wanted:
        return None if any("long" in argument for argument in config.args) else True
    if collection_path.suffix == ".py" and wanted.startswith("level3 and"):
        return None if "level3" in collection_path.read_text("utf-8") else True
    return None


@pytest.hookimpl(wrapper=True)
def pytest_collect_file(file_path):
    """The docstrings of a file of tests are searched for examples where it holds one."""
    collectors = yield
    is_without = file_path.suffix == ".py" and ">>> " not in file_path.read_text("utf-8")
    return [one for one in collectors if not (is_without and isinstance(one, DoctestModule))]


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config, items):
    """Slow tests are marked, and the files that take longest come first: no core waits for the last of them.

    The tests of a file stay together, for a fixture of a module is torn down where a test of another module follows.
    A test that is named by itself runs, however slow it is, and so does one that is marked as quick.
    """
    is_named = any("::" in argument for argument in config.args)
    seconds = {} if is_named else durations.known()[0]
    measured = (item.nodeid for item in items if not any(map(item.get_closest_marker, ("slow", "long", "quick"))))
    slow = set() if is_named else durations.slow_ones(measured)
    for item in items:
        if item.nodeid in slow:
            item.add_marker(pytest.mark.slow)
    items.sort(key=durations.order(items, seconds))
    if int(numba.config.OPT) != 3:
        others = [item for item in items if any(mark.kwargs for mark in item.iter_markers("level3"))]
        config.hook.pytest_deselected(items=others)
        items[:] = [item for item in items if item not in set(others)]


def pytest_collection_finish():
    """What is collected and imported stays to the end: no garbage collection looks at it again."""
    gc.freeze()


@contextlib.contextmanager
def row(*values):
    """A row of a table within one test: a failure says in which one."""
    try:
        yield
    except Exception as error:
        error.add_note(f"in the row {', '.join(map(str, values))}")
        raise


def every_pair(**axes):
    """Parametrize by a product. The long ring has all of it, others each pair of values at least once.

    Args:
        axes: the values of each argument, a list, or a dictionary by what tests are named after.
    """
    axes = {name: axis if isinstance(axis, dict) else {str(one): one for one in axis} for name, axis in axes.items()}
    cover = set(_cover([len(axis) for axis in axes.values()]))
    rows = [
        pytest.param(
            *(value for _label, value in row),
            marks=() if numbers in cover else pytest.mark.long,
            id="-".join(label for label, _value in row),
        )
        for numbers, row in zip(
            itertools.product(*(range(len(axis)) for axis in axes.values())),
            itertools.product(*(axis.items() for axis in axes.values())),
            strict=True,
        )
    ]
    return pytest.mark.parametrize(list(axes), rows)


def _cover(sizes):
    """Rows of numbers below these sizes in which each pair of two columns occurs.

    Each row begins with a pair that is left, and takes in every other column the number with the most new pairs.
    """
    left = {
        (i, a, j, b): None
        for i, j in itertools.combinations(range(len(sizes)), 2)
        for a, b in itertools.product(range(sizes[i]), range(sizes[j]))
    }
    while left:
        i, a, j, b = next(iter(left))
        chosen = {i: a, j: b}
        for k in range(len(sizes)):
            if k not in chosen:
                gains = [sum(_pair(k, c, m, d) in left for m, d in chosen.items()) for c in range(sizes[k])]
                chosen[k] = gains.index(max(gains))
        for one, other in itertools.combinations(chosen.items(), 2):
            left.pop(_pair(*one, *other), None)
        yield tuple(chosen[k] for k in range(len(sizes)))


def _pair(i, a, j, b):
    return (i, a, j, b) if i < j else (j, b, i, a)


def rarely(*values):
    """A case of a table whose kernels cost CI too much: it is in the long ring."""
    return pytest.param(*values, marks=pytest.mark.long)


TURN = {"axis": (1.0, -2.0, 3.0), "angle": 1.2}
_TILT = {"axis": (1.0, -2.0, 0.5), "angle": 0.9}
_CENTER = np.array([0.2, -0.3, 0.1])
# Every surface at every scale: `SURFACES[name](scale)`.
SURFACES = {
    "sphere": lambda s=1.0: swarm.Sphere(0.7 * s, (0.2 * s, -0.3 * s, 0.1 * s)),
    "ball": lambda s=1.0: swarm.Sphere(0.7 * s, (0.2 * s, -0.3 * s, 0.1 * s), side="outside"),
    "ellipsoid": lambda s=1.0: swarm.Ellipsoid((0.4 * s, 0.5 * s, 0.8 * s), (-0.1 * s, 0.2 * s, 0.3 * s)),
    "egg": lambda s=1.0: swarm.Ellipsoid((0.4 * s, 0.5 * s, 0.8 * s), (-0.1 * s, 0.2 * s, 0.3 * s), "outside"),
    "torus": lambda s=1.0: swarm.Torus(0.7 * s, 0.3 * s, (0.2 * s, -0.1 * s, 0.1 * s)),
    "ring": lambda s=1.0: swarm.Torus(0.7 * s, 0.3 * s, (0.2 * s, -0.1 * s, 0.1 * s), "outside"),
    "plane": lambda s=1.0: swarm.Plane((1.0, -2.0, 0.5), 0.3 * s),
    "capsule": lambda s=1.0: swarm.Capsule(0.5 * s, 0.6 * s, (1.0, 0.5, -1.0), (0.1 * s, 0.2 * s, -0.1 * s)),
    "rod": lambda s=1.0: swarm.Capsule(0.5 * s, 0.6 * s, center=(0.1 * s, 0.2 * s, -0.1 * s), side="outside"),
    "rotated ellipsoid": lambda s=1.0: swarm.Ellipsoid(
        (0.4 * s, 0.5 * s, 0.8 * s), (-0.1 * s, 0.2 * s, 0.3 * s), rotation=TURN
    ),
    "rotated egg": lambda s=1.0: swarm.Ellipsoid(
        (0.4 * s, 0.5 * s, 0.8 * s), (-0.1 * s, 0.2 * s, 0.3 * s), "outside", rotation=TURN
    ),
    "rotated torus": lambda s=1.0: swarm.Torus(0.7 * s, 0.3 * s, (0.2 * s, -0.1 * s, 0.1 * s), rotation=TURN),
    "formula": lambda s=1.0: swarm.Formula(
        "(x/s)**2/0.16 + (y/s)**2/0.25 + (z/s)**4 - 1", parameters={"s": s}, center=(0.2 * s, -0.1 * s, 0.1 * s)
    ),
}


def _quadric(diagonal, linear=(0.0, 0.0, 0.0), constant=0.0, side="inside", rotation=_TILT):
    """At scale s lengths are s times as long and phi has the same values."""

    def make(s=1.0):
        matrix, vector = np.diag(diagonal) / s**2, np.array(linear) / s
        return swarm.Quadric(matrix, vector, constant, _CENTER * s, side, rotation=rotation)

    return make


def _both_sides(name, make):
    return {name: lambda s=1.0: make(s, "inside"), name + " solid": lambda s=1.0: make(s, "outside")}


# Quadrics of every kind, some of them rotated, for the tests of surfaces alone.
QUADRIC_WALLS = {
    **_both_sides("slab", lambda s, side: swarm.Slab((1.0, 2.0, -2.0), 0.4 * s, _CENTER * s, side, rotation=_TILT)),
    **_both_sides("cylinder", lambda s, side: swarm.Cylinder(0.6 * s, (1.0, 0.5, 2.0), None, _CENTER * s, side)),
    **_both_sides("pipe", lambda s, side: swarm.Cylinder(0.6 * s, center=_CENTER * s, side=side)),
    **_both_sides("bowl", lambda s, side: swarm.Paraboloid(0.3 * s, (0, 1, -1), _CENTER * s, side, rotation=_TILT)),
    "one sheet": _quadric((1.0, 2.0, -1.5), constant=-0.5),
    "one sheet solid": _quadric((1.0, 2.0, -1.5), constant=-0.5, side="outside"),
    "two sheets": _quadric((1.0, 2.0, -1.5), constant=0.5),
    "two sheets solid": _quadric((1.0, 2.0, -1.5), constant=0.5, side="outside"),
    "nappes": _quadric((1.0, 2.0, -1.5)),
    "saddle": _quadric((1.0, -2.0, 0.0), (0.0, 0.0, -1.0)),
    "gutter": _quadric((1.0, 0.0, 0.0), (0.0, 1.0, -1.0), 0.25, rotation=None),
    "shifted egg": _quadric((1.0, 2.0, 3.0), (0.5, -0.3, 0.7), -0.5),
    "everted egg": _quadric((-1.0, -2.0, -3.0), (0.5, -0.3, 0.7), 0.5, side="outside"),
    "long egg": _quadric((1.0, 2.0, 1e-8), (0.5, -0.3, 0.7), -0.5),
    "wall": _quadric((0.0, 0.0, 0.0), (1.0, -0.5, 0.25), 0.3),
}


def _sampled(side="inside", rotation=None):
    """An egg with a flat top, in a grid that reaches around all points of the tests."""
    axis = np.linspace(-1.3, 1.3, 12)
    x, y, z = axis[:, None, None] - 0.1, axis[:, None] + 0.05, axis
    values = x**2 / 0.25 + y**2 / 0.36 + 0.5 * z**2 + z**4 + 0.3 * np.sin(x + 2.0 * y) - 1.0

    def make(s=1.0):
        return swarm.Sampled(values, s * (axis[1] - axis[0]), (axis[0] * s,) * 3, side, rotation=rotation)

    return make


# Surfaces from data, whose kernels are as large for any samples, for the tests of surfaces alone.
SAMPLED_WALLS = {"sampled": _sampled(), "sampled solid": _sampled("outside", _TILT)}
# Those whose push has no closed form: it is found by iteration.
ITERATED = ("torus", "ring", "rotated torus", "capsule", "rod", "formula", *SAMPLED_WALLS)
QUADRICS = [name for name in SURFACES if name not in ITERATED]
WALLS = {**SURFACES, **QUADRIC_WALLS, **SAMPLED_WALLS}
METHODS = {
    "impact": swarm.Impact(),
    "impact, chord": swarm.Impact(contact_step=1e-3),
    "penalty": swarm.Penalty(dt=1e-3, penalty=1e4),
    "augmented Lagrangian": swarm.AugmentedLagrangian(
        dt=1e-3, penalty=1e4, adaptive=True, acceleration="reflection", on_unconverged="impact"
    ),
    "verlet": swarm.Verlet(dt=1e-3, penalty=1e4),
    "midpoint": swarm.Midpoint(dt=1e-3, penalty=1e4),
    "trapezoidal": swarm.Trapezoidal(dt=1e-3, penalty=1e4),
}
LAWS = {str(a): regularisation(1e3, a) for a in (1.0, 1.25, 1.5, 2.0, 4.0, 12.0)}

every_surface = pytest.mark.parametrize("name", SURFACES)
# Steps of surfaces from data are slow in plain Python. And those of AugmentedLagrangian end on them to 2e-14 of phi,
# whose terms are 10 here, not to the 1e-14 of contact/test_uzawa.py.
every_level = pytest.mark.parametrize("name", [*SURFACES, *map(rarely, SAMPLED_WALLS)])
every_wall = pytest.mark.parametrize("name", WALLS)
# Those whose level along a flight is a polynomial. Flights to a spline, which is another one in each cell, are held
# against a dense search: surfaces/data/test_sampled_flights.py.
every_polynomial_wall = pytest.mark.parametrize("name", [name for name in WALLS if name not in SAMPLED_WALLS])
every_quadric_wall = pytest.mark.parametrize("name", QUADRIC_WALLS)
every_quadric = pytest.mark.parametrize("name", QUADRICS)
every_law = pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)

_unit = st.floats(-1.0, 1.0, allow_subnormal=False)
vectors = st.tuples(_unit, _unit, _unit).map(np.array)
directions = vectors.filter(lambda v: np.linalg.norm(v) > 0.05)
scales = st.sampled_from([1e-6, 1e-3, 1.0, 1e3, 1e6])


@functools.cache
def surface_of(name, scale=1.0):
    """A surface of the table. A formula takes a third of a second to make, so each is made once."""
    return WALLS[name](scale)


@functools.cache
def numbers_of(name, scale=1.0):
    """The tuple of numbers of a surface of the table, as kernels take it."""
    (wall,) = surface_of(name, scale).walls()
    return wall


def body_of(surface):
    """The numbers of a surface in its own frame."""
    return surface.body if isinstance(surface, Rotated) else surface


def side_of(surface):
    """+1 for a cavity, -1 for a solid."""
    return getattr(body_of(surface), "side", 1.0)


def chord_of(surface, point, free):
    """kappa of the step from a point on the surface that ends on it."""
    return call(reflection.chord, Walls((surface,)), 0.0, point, free)


def exponent_of(law):
    """The exponent a of a law."""
    return {Linear: 1.0, Hertz: 1.5}.get(type(law)) or law.a


def call(function, *arguments):
    """A kernel's scalar function in plain Python, in the arithmetic of kernels: 1/0 is infinite and no error."""
    with np.errstate(all="ignore"):
        return function(*map(_as_kernels_take_it, arguments))


def _as_kernels_take_it(value):
    if isinstance(value, np.ndarray) and value.shape == (3,):
        return vec(map(np.float64, value))
    if isinstance(value, Vec):
        return type(value)(*map(np.float64, value))
    return np.float64(value) if isinstance(value, (float, int)) and not isinstance(value, bool) else value


def wall_point(surface, point):
    """A point of the surface, by Newton's method along the gradient."""
    for _ in range(30):
        gradient = np.array(call(surface.gradient, point))
        if not gradient.any():
            reject()  # an example of Hypothesis from which there is no way to the wall
        step = call(surface.phi, point) / (gradient @ gradient) * gradient
        point = point - step
        if (abs(step) <= EPSILON * abs(point).max()).all():
            break
    return np.array(call(surface.project, point))


def gap(surface, point):
    """The signed gap at a point."""
    return float(call(surface.gap_of, call(surface.inner, point)))


def gaps_along(still, poses, places):
    """Gaps to walls that move together, each place (3, N) at the time of its pose: those at rest, in their frame."""
    middle, shifts = poses[0].center[:, None], np.transpose([one.shift for one in poses])
    turns = np.array([one.turn for one in poses])
    return still.gaps(middle + np.einsum("kji,jk->ik", turns, places - shifts - middle))


def scene_of(*names, **keywords):
    """A scene of surfaces from the table."""
    return swarm.Scene([surface_of(name) for name in names], **keywords)


@contextlib.contextmanager
def files_limited_to(size):
    """A write beyond this size of a file fails as on a full disk, in the middle of others."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        signal.signal(signal.SIGXFSZ, handler)


@contextlib.contextmanager
def edited(path):
    """An HDF5 file, open to be changed: without checksums, as one of an older version."""
    import h5py

    with h5py.File(path, "r+") as file:
        if "parameters/checksums" in file:
            del file["parameters/checksums"]
        if "frames/complete" in file:
            frames = file["frames/complete"][:1]
            del file["frames/complete"]
            file["frames/complete"] = frames
        yield file


def compiled(function):
    """A function as a kernel of its own, which is kept in no cache."""
    helper = types.FunctionType(function.__code__, function.__globals__, function.__name__, None, function.__closure__)
    return numba.njit(error_model="numpy")(machine_code.calling(inlined(helper)))
