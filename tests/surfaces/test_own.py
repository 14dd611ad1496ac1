"""A user-defined phi: the same flights as the built-in surface, and never the code of another phi from the cache."""

import collections
import math
import os
import subprocess
import sys
import textwrap
from pathlib import Path
from typing import NamedTuple

import numba
import numpy as np
import pytest
from conftest import call, compiled

import swarm
from swarm.kernel import frozen
from swarm.kernel.vector import Vec
from swarm.lanes import block as blocks
from swarm.serialization import tables
from swarm.surfaces.formulas import code, numbers
from swarm.surfaces.surface import UNBOUNDED

compiled_only = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="NUMBA_DISABLE_JIT is set")


class Axes(NamedTuple):
    a: float
    b: float
    c: float


def phi(axes, x, y, z):
    return x * x / (axes.a * axes.a) + y * y / (axes.b * axes.b) + z * z / (axes.c * axes.c) - 1.0


def gradient(axes, x, y, z):
    return 2.0 * x / (axes.a * axes.a), 2.0 * y / (axes.b * axes.b), 2.0 * z / (axes.c * axes.c)


def ellipsoid(**keywords):
    keywords = {"size": 0.3, "bounds": ((-0.31, -0.41, -0.51), (0.31, 0.41, 0.51)), **keywords}
    return swarm.OwnSurface(Axes(0.3, 0.4, 0.5), phi, gradient, **keywords)


# --- The surface -----------------------------------------------------------------------------------------


def test_a_solid_in_a_cell_that_repeats_is_the_ellipsoid():
    """What the scene makes of a surface, such as its other side, is made of its fields."""
    ends = []
    for make in (ellipsoid, lambda **given: swarm.Ellipsoid((0.3, 0.4, 0.5), **given)):
        solid = make(center=(1.0, 1.0, 1.0), side="outside")
        scene = swarm.Scene([solid], period=(2.0, 2.0, 2.0))
        start = swarm.Particles([[0.3], [0.9], [1.1]], [[1.0], [0.1], [0.2]])
        result = swarm.simulate(scene, start, swarm.Impact(), until=3.0, compile="never")
        assert result.observables["impacts"][-1] > 0
        ends.append(result.particles.position)
    assert np.abs(ends[0] - ends[1]).max() < 1e-12


@pytest.mark.parametrize("missing", ["phi", "gradient", "size"])
def test_what_is_missing_is_reported(missing):
    given = {"phi": phi, "gradient": gradient, "size": 0.3}
    del given[missing]
    with pytest.raises(swarm.SceneError, match=f"needs the argument {missing}, got none"):
        swarm.OwnSurface(Axes(0.3, 0.4, 0.5), **given)


@pytest.mark.parametrize(
    "keywords", [{}, {"curvature": 2.0 / 0.09}, {"bounds": None, "curvature": 30.0}, {"center": (0.1, 0.2, -0.3)}]
)
def test_the_trajectory_is_that_of_the_ellipsoid(keywords):
    center = keywords.get("center", (0.0, 0.0, 0.0))
    scenes = [swarm.Scene([ellipsoid(**keywords)]), swarm.Scene([swarm.Ellipsoid((0.3, 0.4, 0.5), center)])]
    particles = swarm.fill(scenes[1], 5, speed=1.0, seed=1)
    ends = [swarm.simulate(scene, particles, swarm.Impact(), until=12.0, compile="never") for scene in scenes]
    assert ends[0].observables["impacts"][-1] == ends[1].observables["impacts"][-1] > 20 * 5
    assert np.abs(ends[0].particles.position - ends[1].particles.position).max() < 1e-10


@pytest.mark.parametrize("side", ["inside", "outside"])
@pytest.mark.parametrize("curvature", [None, 25.0])
def test_first_hits_are_those_of_the_ellipsoid(side, curvature):
    numbers = ellipsoid(side=side, curvature=curvature).numbers()
    reference = swarm.Ellipsoid((0.3, 0.4, 0.5), side=side).numbers()
    random = np.random.default_rng(2)
    compared = 0
    while compared < 200:
        point, velocity = random.uniform(-0.8, 0.8, 3), random.standard_normal(3)
        if reference.side * call(reference.phi, point) <= -1e-6:
            compared += 1
            time, found = call(numbers.first_hit, point, velocity)
            assert found
            assert time == pytest.approx(call(reference.first_hit, point, velocity)[0], rel=1e-9)


def test_a_flight_that_falls_meets_the_solid_again():
    """Out of the box that the bend is known in, and back."""
    numbers = ellipsoid(side="outside").numbers()
    reference = swarm.Ellipsoid((0.3, 0.4, 0.5), side="outside").numbers()
    random = np.random.default_rng(3)
    for _ in range(50):
        point = np.append(random.uniform(-0.2, 0.2, 2), 0.6)
        velocity = np.append(random.uniform(-0.2, 0.2, 2), random.uniform(0.0, 5.0))
        pull = np.array([0.0, 0.0, -9.8])
        time = sum_of_hits(numbers, point, velocity, pull)
        assert time == pytest.approx(sum_of_hits(reference, point, velocity, pull), rel=1e-9)


def sum_of_hits(surface, point, velocity, pull):
    """The time of the first hit, in as many parts as it takes; infinite far below."""
    total = 0.0
    while point[2] > -2.0:
        time, found = call(surface.falling_hit, point, velocity, pull)
        total += time
        if found:
            return total
        point, velocity = point + time * (velocity + 0.5 * time * pull), velocity + time * pull
    return math.inf


def test_second_derivatives_are_differences():
    xx, yy, zz, xy, yz, zx = call(ellipsoid().numbers().hessian, np.array([0.1, 0.2, 0.3]))
    assert (xx, yy, zz) == pytest.approx((1 / 0.09, 1 / 0.16, 1 / 0.25), rel=1e-8)
    assert (xy, yz, zx) == pytest.approx((0.0, 0.0, 0.0), abs=1e-8)


def test_a_trajectory_has_the_motion(tmp_path):
    scene = swarm.Scene([ellipsoid(motion=swarm.Translation((0.1, 0.0, 0.0)))])
    start = swarm.Particles([[0.0], [0.0], [0.1]], [[1.0], [0.2], [0.1]])
    path = tmp_path / "run.h5"
    swarm.simulate(scene, start, swarm.Impact(), until=1.0, trajectory=path, compile="never")
    assert tables.table_of(scene.surfaces[0])["motion"] == {"kind": "translation", "velocity": (0.1, 0.0, 0.0)}
    with swarm.load(path) as trajectory:
        assert trajectory.times[-1] == 1.0


def test_bounds_and_table():
    surface = ellipsoid(center=(1.0, 0.0, 0.0))
    assert surface.bounds() == ((0.69, -0.41, -0.51), (1.31, 0.41, 0.51))
    assert ellipsoid(side="outside").bounds() == UNBOUNDED
    assert ellipsoid(bounds=((-0.2, -0.2, -0.2), (0.4, 0.4, 0.4))).bounds() == UNBOUNDED
    table = tables.table_of(surface)
    assert table["kind"] == "own"
    assert table["parameters"] == {"a": 0.3, "b": 0.4, "c": 0.5}
    with pytest.raises(swarm.SceneError, match=r"surface\[0\].kind: 'own' is a phi in Python"):
        tables.scene_of([table], None)


def test_a_trajectory_is_written(tmp_path):
    scene, file = swarm.Scene([ellipsoid()]), tmp_path / "own.h5"
    start = swarm.fill(scene, 3, speed=1.0)
    swarm.simulate(scene, start, swarm.Impact(), until=0.1, trajectory=file, compile="never")
    with swarm.load(file) as trajectory:
        assert trajectory.frame(-1).position.shape == (3, 3)


# --- Functions of single numbers -------------------------------------------------------------------------


def scalar_phi(parameters, x, y, z):
    return math.sqrt(x * x + y * y + z * z) - 1.0 if x > -5.0 else 7.0


def scalar_gradient(parameters, x, y, z):
    r = math.hypot(math.hypot(x, y), z)
    return x / r, y / r, z / r


def changing_phi(parameters, x, y, z):
    x -= 0.5
    return x * x + y * y + z * z - 1.0


def changing_gradient(parameters, x, y, z):
    x -= 0.5
    return 2.0 * x, 2.0 * y, 2.0 * z


@pytest.mark.parametrize("functions", [(scalar_phi, scalar_gradient), (changing_phi, changing_gradient)])
def test_functions_of_numbers_take_arrays(functions):
    surface = swarm.OwnSurface((), *functions, size=1.0, bounds=((-2, -2, -2), (2, 2, 2)))
    points = np.random.default_rng(1).uniform(-1.0, 1.0, (3, 50))
    before = points.copy()
    expected = [functions[0]((), *point) for point in points.T]
    assert np.allclose(surface.phi(points), expected, rtol=1e-14)
    assert np.allclose(surface.gradient(points).T, [functions[1]((), *point) for point in points.T], rtol=1e-14)
    assert surface.phi([0.5, 0.0, 0.0]).shape == ()
    assert (points == before).all()


# --- Errors ----------------------------------------------------------------------------------------------


def wrong_gradient(axes, x, y, z):
    return 2.0 * x / axes.a, 2.0 * y / (axes.b * axes.b), 2.0 * z / (axes.c * axes.c)


def nowhere(axes, x, y, z):
    return x * x + y * y + z * z + 1.0


def gradient_nowhere(axes, x, y, z):
    return 2.0 * x, 2.0 * y, 2.0 * z


def undefined(axes, x, y, z):
    return np.sqrt(x) + y


def gradient_undefined(axes, x, y, z):
    return 0.5 / np.sqrt(x), 1.0 + 0.0 * y, 0.0 * z


def indicator(axes, x, y, z):
    return -1.0 if x * x + y * y + z * z < axes.a * axes.a else 1.0


def no_gradient(axes, x, y, z):
    return 0.0, 0.0, 0.0


def with_a_step(axes, x, y, z):
    return x * x + y * y + z * z - (0.25 if x < 0.1 else 0.2)


def with_a_thin_step(axes, x, y, z):
    return phi(axes, x, y, z) + (0.5 if 0.1 < x < 0.12 else 0.0)


BOX = ((-1, -1, -1), (1, 1, 1))


@pytest.mark.parametrize(
    ("arguments", "keywords", "parts"),
    [
        ((3, phi, gradient), {}, ["parameters", "NamedTuple", "got 3"]),
        (((1.0, 2.0), phi, gradient), {}, ["parameters", "NamedTuple"]),
        ((Axes(0.3, math.nan, 0.5), phi, gradient), {}, ["parameters.b", "nan"]),
        ((Axes(0.3, 0.4, 0.5), "x", gradient), {}, ["phi must be a Python function", "got 'x'"]),
        ((Axes(0.3, 0.4, 0.5), phi, lambda x, y, z: 0.0), {}, ["gradient", "(parameters, x, y, z)", "(x, y, z)"]),
        ((Axes(0.3, 0.4, 0.5), phi, wrong_gradient), {}, ["gradient must be the gradient of phi", "differences"]),
        ((Axes(0.3, 0.4, 0.5), nowhere, gradient_nowhere), {}, ["0 somewhere in the bounds", "above 0"]),
        ((Axes(0.3, 0.4, 0.5), undefined, gradient_undefined), {}, ["phi must be a finite number", "nan"]),
        ((Axes(0.3, 0.4, 0.5), indicator, no_gradient), {}, ["a gradient on its surface", "got one of length 0 at ("]),
        (
            (Axes(0.3, 0.4, 0.5), with_a_step, gradient_nowhere),
            {},
            ["twice differentiable", "a jump from", "at (0.1, "],
        ),
        ((Axes(0.3, 0.4, 0.5), with_a_thin_step, gradient), {}, ["a jump from", "make it continuous"]),
        (
            (Axes(0.3, 0.4, 0.5), phi, gradient),
            {"curvature": 22.1},
            ["curvature", "got 22.1", "differences of the gradient give 22.2222 at (", "4096 points"],
        ),
        ((Axes(0.3, 0.4, 0.5), phi, gradient), {"curvature": 22.1, "side": "outside"}, ["22.2222 at ("]),
        ((Axes(0.3, 0.4, 0.5), phi, gradient), {"size": 0.0}, ["size", "above 0"]),
        ((Axes(0.3, 0.4, 0.5), phi, gradient), {"bounds": None}, ["curvature must be given where bounds are not"]),
        ((Axes(0.3, 0.4, 0.5), phi, gradient), {"bounds": [1, 2, 3]}, ["bounds", "two corners"]),
        ((Axes(0.3, 0.4, 0.5), phi, gradient), {"sides": "inside"}, ["no argument 'sides'"]),
        ((Axes(0.3, 0.4, 0.5), phi, gradient), {"restitution": 2.0}, ["restitution", "from 0 to 1"]),
    ],
)
def test_errors_name_the_argument(arguments, keywords, parts):
    with pytest.raises(swarm.SceneError) as caught:
        swarm.OwnSurface(*arguments, **{"size": 0.3, "bounds": BOX, **keywords})
    assert all(part in str(caught.value) for part in parts), str(caught.value)


class Waves(NamedTuple):
    k: float
    scale: float
    offset: float


def waves(p, x, y, z):
    return p.scale * (np.sin(p.k * (x - p.offset)) + np.cos(p.k * y) + 0.3 * np.sin(p.k * z))


def gradient_of_waves(p, x, y, z):
    k = p.scale * p.k
    return k * np.cos(p.k * (x - p.offset)), -k * np.sin(p.k * y), 0.3 * k * np.cos(p.k * z)


@pytest.mark.parametrize(("k", "offset"), [(1.0, 0.0), (60.0, 0.0), (1.0, 1e3)])
@pytest.mark.parametrize("scale", [1e-8, 1e8])
def test_a_curvature_that_is_true_is_never_refused(k, scale, offset):
    """Up to the round-off of differences: far from the origin, of any scale, and for waves finer than the box."""
    box = ((offset - 1.0, -1.0, -0.7), (offset + 1.0, 1.0, 0.7))
    numbers = Waves(k, scale, offset)
    for size in (1e-3, 0.5, 10.0):
        swarm.OwnSurface(numbers, waves, gradient_of_waves, size=size, bounds=box, curvature=k * k * scale)


def wrong_gradient_of_waves(p, x, y, z):
    a, b, c = gradient_of_waves(p, x, y, z)
    return 1.001 * a, 1.001 * b, 1.001 * c


@pytest.mark.parametrize(("k", "offset"), [(1e4, 0.0), (1e6, 0.0), (1.0, 1e6), (10.0, 1e6)])
def test_a_gradient_of_fine_or_far_waves_is_refused_only_where_it_is_wrong(k, offset):
    """Its differences are over 6e-6 m and less of 1 m, and over 6 m and less where places are 1e6 m from the origin."""
    box, numbers = ((offset - 1.0, -1.0, -0.7), (offset + 1.0, 1.0, 0.7)), Waves(k, 1.0, offset)
    given = {"size": 0.5, "bounds": box, "curvature": 2.0 * k * k}
    swarm.OwnSurface(numbers, waves, gradient_of_waves, **given)
    with pytest.raises(swarm.SceneError, match="gradient must be the gradient of phi"):
        swarm.OwnSurface(numbers, waves, wrong_gradient_of_waves, **given)


@pytest.mark.parametrize(
    ("curvature", "words"),
    [(None, "or give `curvature`, or closer `bounds`, by which"), (23.0, "or a smaller `curvature` where that is")],
)
def test_a_ball_that_is_too_large_names_what_may_make_a_larger_one_certain(curvature, words):
    scene = swarm.Scene([ellipsoid(curvature=curvature)])
    with pytest.raises(swarm.SceneError, match="use smaller balls, or a rounder surface, " + words):
        swarm.fill(scene, 2, speed=1.0, radius=0.25)


def flat(p, x, y, z):
    return x + 0.0 * y


def gradient_of_flat(p, x, y, z):
    return 1.0 + 0.0 * x, 0.0 * y, 0.0 * z


def test_a_curvature_of_zero_is_true_of_a_plane():
    assert swarm.OwnSurface((), flat, gradient_of_flat, size=1.0, bounds=BOX, curvature=0.0).curvature == 0.0


def test_a_jump_where_no_particle_comes_is_none():
    """In the solid, and for a kink: distances to a body have one in its middle."""

    def steps(p, x, y, z):
        return np.where(x * x + y * y + z * z < 0.1, -1.0, x * x + y * y + z * z - 0.25)

    def distance(p, x, y, z):
        return np.sqrt(x * x + y * y + z * z) - 0.5

    def away(p, x, y, z):
        r = np.sqrt(x * x + y * y + z * z)
        return x / r, y / r, z / r

    swarm.OwnSurface((), steps, gradient_nowhere, size=0.5, bounds=BOX, side="outside")
    swarm.OwnSurface((), distance, away, size=0.5, bounds=BOX)


class Thing:
    radius = 0.4


THING = Thing()


def of_a_list(axes, x, y, z):
    parts = [x / axes.a, y / axes.b, z / axes.c]
    return parts[0] * parts[0] + parts[1] * parts[1] + parts[2] * parts[2] - 1.0


def of_an_array(axes, x, y, z):
    parts = np.array([x / axes.a, y / axes.b, z / axes.c])
    return (parts * parts).sum() - 1.0


def of_an_object(axes, x, y, z):
    return phi(axes, x, y, z) + 0.0 * THING.radius


def of_another_name(axes, x, y, z):
    return phi(axes, x, y, z) if x < 100.0 else axes.d


def a_list(axes, x, y, z):
    gx, gy, gz = gradient(axes, x, y, z)
    return [gx, gy, gz]


@compiled_only
@pytest.mark.parametrize(
    ("functions", "parts"),
    [
        ((of_a_list, gradient), ["of_a_list", "list or an array"]),
        ((of_an_array, gradient), ["of_an_array", "list or an array"]),
        ((of_an_object, gradient), ["of_an_object", "THING", "Thing"]),
        ((of_another_name, gradient), ["of_another_name", "Unknown attribute 'd'"]),
        ((phi, a_list), ["a_list", "list or an array"]),
    ],
    ids=lambda value: value[0].__name__ if callable(value[0]) else "",
)
def test_what_numba_cannot_compile_is_one_sentence(functions, parts, tmp_path):
    """Found before a kernel is compiled or a file is written."""
    before = len(blocks.advance_block.signatures)

    def run():
        scene = swarm.Scene([swarm.OwnSurface(Axes(0.3, 0.4, 0.5), *functions, size=0.3, bounds=BOX)])
        particles = swarm.fill(scene, 1, speed=1.0)
        swarm.simulate(scene, particles, swarm.Impact(), until=0.1, trajectory=tmp_path / "own.h5")

    with pytest.raises(swarm.SceneError) as caught:
        run()
    message = str(caught.value)
    assert "\n" not in message
    assert len(message) < 250
    assert all(part in message for part in (*parts, "Numba can compile")), message
    assert len(blocks.advance_block.signatures) == before
    assert not list(tmp_path.iterdir())


# --- The digest ------------------------------------------------------------------------------------------


def digest(function):
    found = frozen.Frozen()
    found.function(function)
    return found.digest()


def made(source, **scope):
    exec(textwrap.dedent(source), scope)
    return scope["f"]


PLAIN = "def f(x): return x + C"


def test_the_same_code_has_the_same_digest():
    assert digest(made(PLAIN, C=1.0)) == digest(made("\n\n" + PLAIN, C=1.0, other=5))


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (made(PLAIN, C=1.0), made(PLAIN, C=2.0)),
        (made(PLAIN, C=1.0), made(PLAIN, C=1)),
        (made(PLAIN, C=0.0), made(PLAIN, C=-0.0)),
        (made(PLAIN, C=(1.0, 2.0)), made(PLAIN, C=(1.0, 3.0))),
        (made(PLAIN, C=np.array([1.0])), made(PLAIN, C=np.array([2.0]))),
        (made(PLAIN, C=1.0), made("def f(x): return x - C", C=1.0)),
        (made(PLAIN, C=1.0), made("def f(x): return x + D", D=1.0)),
        (made("def f(x, y=1.0): return x"), made("def f(x, y=2.0): return x")),
        (made("def f(x, *, y=1.0): return x"), made("def f(x, *, y=2.0): return x")),
        (made("def f(x): return g(x)", g=made(PLAIN, C=1.0)), made("def f(x): return g(x)", g=made(PLAIN, C=2.0))),
        (made("def f(x):\n def g(y): return y + C\n return g(x)", C=1.0),
         made("def f(x):\n def g(y): return y + C\n return g(x)", C=2.0)),
        ((lambda c: lambda x: x + c)(1.0), (lambda c: lambda x: x + c)(2.0)),
        (made("def f(x): return g(x)", g=math.sin), made("def f(x): return g(x)", g=math.cos)),
        (made("def f(x): return g(x)", g=np.sin), made("def f(x): return g(x)", g=np.cos)),
    ],
)  # fmt: skip
def test_what_makes_another_digest(one, other):
    assert digest(one) != digest(other)
    assert digest(one) == digest(one)


def test_a_compiled_helper_counts_by_its_code():
    helpers = [numba.njit(made(PLAIN, C=c)) for c in (1.0, 2.0, 1.0)]
    first, second, third = (digest(made("def f(x): return g(x)", g=helper)) for helper in helpers)
    assert first == third != second


def test_a_module_counts_by_what_is_taken_from_it():
    def module(**names):
        made_ = type(os)("shapes")
        made_.__dict__.update(names)
        return made_

    source = "def f(x): return shapes.radius + shapes.deep.depth"
    digests = [
        digest(made(source, shapes=module(radius=r, deep=module(depth=d), other=o)))
        for r, d, o in ((1.0, 2.0, 3.0), (1.0, 2.0, 4.0), (1.5, 2.0, 3.0), (1.0, 2.5, 3.0))
    ]
    assert digests[0] == digests[1]
    assert len(set(digests)) == 3


def test_what_is_not_known_is_never_the_same():
    function = made(PLAIN, C=object())
    assert digest(function) != digest(function)


def test_a_function_that_calls_itself():
    assert digest(made("def f(x): return f(x - 1.0) if x > 0.0 else x")) == digest(
        made("def f(x): return f(x - 1.0) if x > 0.0 else x")
    )


def test_a_constant_that_changes_is_another_surface():
    """In one process: what is compiled is a copy with the values of its time."""
    scope = {"C": 1.0}
    exec("def phi(p, x, y, z): return x*x + y*y + z*z - C\ndef gradient(p, x, y, z): return 2*x, 2*y, 2*z", scope)
    build = lambda: swarm.OwnSurface((), scope["phi"], scope["gradient"], size=1.0, curvature=2.0)  # noqa: E731
    one = build()
    scope["C"] = 4.0
    two = build()
    assert type(one.numbers()) is not type(two.numbers())
    flights = [first_hit_of(surface.numbers(), Vec(0.0, 0.0, 0.0), Vec(1.0, 0.0, 0.0))[0] for surface in (one, two)]
    assert flights == [1.0, 2.0]


@compiled
def first_hit_of(surface, r, v):
    return surface.first_hit(r, v)


def test_the_class_is_named_by_the_code():
    """Kernels of another process are found by this name: `kernel/entries.py`."""
    one, other = (type(ellipsoid(side=side).numbers()) for side in ("inside", "outside"))
    assert one is other is code._classes[one.__name__]
    assert (one.__module__, one.__qualname__) == ("swarm.surfaces.formulas.code", one.__name__)
    assert issubclass(one, numbers.OwnNumbers)


# --- The cache, with real processes ----------------------------------------------------------------------

MAIN = """
import sys
from typing import NamedTuple
import kernel, shapes, swarm
from shapes import halved
from swarm.kernel.vector import Vec

class Parameters(NamedTuple):
    r: float

FACTOR = {factor}

def phi(p, x, y, z):
    return {body}

def gradient(p, x, y, z):
    return {slope}

surface = swarm.OwnSurface(Parameters(0.5), phi, gradient, size=0.5, curvature=100.0)
{extra}
total = kernel.total(surface.numbers(), Vec(0.1, 0.2, 0.05), Vec(0.3, -0.2, 0.1))
stats = kernel.total.stats
print(total, sum(stats.cache_hits.values()), sum(stats.cache_misses.values()))
"""
SHAPES = """
POWER = 1.0
def squared(x): return x * x
def halved(x): return {halved}
"""
# A kernel of the package's kind that compiles in seconds.
KERNEL = """
from swarm.kernel.jit import kernel
from swarm.kernel.vector import dot

@kernel
def total(surface, r, v):
    sum = 0.0
    for i in range(5):
        t, found = surface.first_hit(r, v)
        r = r + t * v
        n = surface.unit_normal(r)
        v = v - (2.0 * dot(v, n)) * n
        sum += t
    return sum
"""
USUAL = {
    "factor": "1.0",
    "body": "FACTOR * (2.0 * halved(x * x) + shapes.squared(y) + z * z - p.r * p.r)",
    "slope": "FACTOR * 4.0 * halved(x), FACTOR * 2.0 * y, FACTOR * 2.0 * z",
    "halved": "0.5 * x",
    "extra": "",
}
Answer = collections.namedtuple("Answer", "total hits misses")


@pytest.fixture
def run(tmp_path):
    """Run a script in a process of its own; all share one cache folder."""
    (tmp_path / "kernel.py").write_text(KERNEL)
    root = str(Path(swarm.__file__).parents[1])

    def one(**changes):
        texts = {**USUAL, **changes}
        (tmp_path / "shapes.py").write_text(SHAPES.format(**texts))
        (tmp_path / "main.py").write_text(MAIN.format(**texts))
        environment = {
            **os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PYTHONPATH": root, "PYTHONDONTWRITEBYTECODE": "1"
        }  # fmt: skip
        done = subprocess.run(
            [sys.executable, "main.py"], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stderr
        total, hits, misses = done.stdout.split()
        return Answer(float(total), int(hits), int(misses))

    return one


@compiled_only
def test_an_edited_phi_never_gives_an_old_answer(run):
    first = run()
    assert first.misses == 1
    # Unedited in another process: nothing is compiled.
    assert run() == first._replace(hits=1, misses=0)
    # Only a scale of phi: the same flights, but another code.
    scaled = run(factor="2.0")
    assert scaled.misses == 1
    assert scaled.total == pytest.approx(first.total, rel=1e-12)
    edited = {
        "phi": {"body": USUAL["body"].replace("p.r * p.r", "1.1 * p.r * p.r")},
        "a helper": {"halved": "0.6 * x"},
        "phi and gradient": {"body": USUAL["body"].replace("z * z", "2.0 * z * z"),
                             "slope": USUAL["slope"].replace("2.0 * z", "4.0 * z")},
    }  # fmt: skip
    totals = {first.total}
    for what, changes in edited.items():
        answer = run(**changes)
        assert (answer.hits, answer.misses) == (0, 1), what
        totals.add(answer.total)
    assert len(totals) == 4
    # And the first one is still there, beside all the others.
    assert run() == first._replace(hits=1, misses=0)


@compiled_only
@pytest.mark.long
def test_processes_that_share_a_cache_do_not_break_one_another(run):
    sphere = "surface = swarm.Sphere(0.5)"
    formula = 'surface = swarm.Formula("x**2 + y**2 + z**2 - r**2", parameters={"r": 0.5})'
    first = [run(), run(extra=sphere), run(extra=formula)]
    assert [answer.misses for answer in first] == [1, 1, 1]
    again = [run(extra=formula), run(extra=sphere), run()]
    assert [answer.hits for answer in again] == [1, 1, 1]
    assert [answer.total for answer in again] == [answer.total for answer in reversed(first)]
    assert first[0].total == pytest.approx(first[1].total, rel=1e-12)
    # Another value of a parameter is no other code.
    other = run(extra=formula.replace("0.5}", "0.6}"))
    assert (other.hits, other.misses) == (1, 0)
    assert other.total != first[2].total


SIMULATE = """
particles = swarm.Particles([[0.1], [0.2], [0.05]], [[0.3], [-0.2], [0.1]])
result = swarm.simulate(swarm.Scene([surface]), particles, swarm.Impact(), until=20.0)
from swarm.lanes import block as blocks
stats = blocks.advance_block.stats
print(result.particles.position[0, 0], sum(stats.cache_hits.values()), sum(stats.cache_misses.values()))
sys.exit()
"""


@compiled_only
@pytest.mark.physics
@pytest.mark.long
def test_a_trajectory_is_never_an_old_one(run):
    first = run(extra=SIMULATE)
    assert (first.hits, first.misses) == (0, 1)
    edited = run(extra=SIMULATE, body=USUAL["body"].replace("p.r * p.r", "1.1 * p.r * p.r"))
    assert (edited.hits, edited.misses) == (0, 1)
    assert edited.total != first.total
    assert run(extra=SIMULATE) == first._replace(hits=1, misses=0)


def test_sympy_is_loaded_only_for_a_formula():
    code = "import sys, swarm; swarm.OwnSurface, swarm.Sphere(1.0); assert 'sympy' not in sys.modules"
    environment = {**os.environ, "PYTHONPATH": str(Path(swarm.__file__).parents[1])}
    subprocess.run([sys.executable, "-c", code], env=environment, check=True)
