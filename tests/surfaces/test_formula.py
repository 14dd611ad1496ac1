"""Formulas against the surfaces they describe, and the bounds that make their first hits sure."""

import dataclasses
import inspect
import math

import numpy as np
import pytest
import sympy
from conftest import call
from hypothesis import given
from hypothesis import strategies as st

import swarm
from swarm.serialization import tables
from swarm.surfaces.formulas import derivatives, numbers
from swarm.surfaces.formulas.interval import Interval, bounds_of

ELLIPSOID = "x**2/0.09 + y**2/0.16 + z**2/0.25 - 1"
PILL = "x**2/0.09 + y**2/0.09 + z**4/0.13 - 1"
TORUS = "(x**2 + y**2 + z**2 + 0.7**2 - 0.3**2)**2 - 4*0.7**2*(x**2 + y**2)"
GYROID = "sin(x)*cos(y) + sin(y)*cos(z) + sin(z)*cos(x)"
MANY = (
    "exp(x)*cosh(y)/(2 + tanh(z)) + log(3 + x)*sqrt(2 + y)**3 - tan(z/4)*sinh(x)*cos(y)**2 - x**-2 + (2 + z)**1.7 - 9"
)


# --- Derivatives -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("text", [ELLIPSOID, PILL, TORUS, GYROID, MANY])
def test_derivatives(text):
    """phi, its gradient and half its second derivatives against SymPy's in 40 digits."""
    numbers = swarm.Formula(text, bounds=((0.1, -1, -1), (1.5, 1, 1)), curvature=1.0)._form.numbers((0.0, 0.0, 0.0))
    point = np.array([0.37, -0.61, 0.23])
    axes = sympy.symbols("x y z")
    exact = sympy.sympify(text)
    at = {axis: sympy.Float(float(value), 40) for axis, value in zip(axes, point, strict=True)}
    value = lambda expression: float(expression.evalf(40, subs=at))  # noqa: E731
    assert call(numbers.phi, point) == pytest.approx(value(exact), rel=1e-13, abs=1e-14)
    gradient = [value(exact.diff(axis)) for axis in axes]
    assert call(numbers.gradient, point) == pytest.approx(gradient, rel=1e-13, abs=1e-13)
    x, y, z = axes
    seconds = [value(exact.diff(*pair)) / 2 for pair in ((x, x), (y, y), (z, z), (x, y), (y, z), (z, x))]
    assert call(numbers.hessian, point) == pytest.approx(seconds, rel=1e-12, abs=1e-13)


def test_small_powers_are_products():
    made = derivatives.derived("x**4 + y**3 + z**-2 + x**2.5 - 1", ())
    assert not any("**" in inspect.getsource(function) for function in made.functions)


# --- Against the surfaces with a closed form -------------------------------------------------------------


@pytest.mark.parametrize("side", ["inside", "outside"])
@pytest.mark.parametrize(
    ("text", "other"), [(ELLIPSOID, swarm.Ellipsoid((0.3, 0.4, 0.5))), (TORUS, swarm.Torus(0.7, 0.3))]
)
def test_first_hits_are_those_of_the_closed_form(text, other, side):
    center = (0.1, -0.2, 0.3)
    formula = swarm.Formula(text, side=side, center=center).numbers()
    other = dataclasses.replace(other, center=center, side=side).numbers()
    random = np.random.default_rng(1)
    compared = 0
    while compared < 200:
        point, velocity = np.array(center) + random.uniform(-1.2, 1.2, 3), random.standard_normal(3)
        if other.side * call(other.phi, point) > -1e-6:
            continue
        compared += 1
        (time, found), (expected, _) = (call(one.first_hit, point, velocity) for one in (formula, other))
        assert found
        # A flight that nearly touches may hit one and miss the other.
        if math.isfinite(time) and math.isfinite(expected):
            assert time == pytest.approx(expected, rel=1e-9, abs=1e-12)
        else:
            assert time == expected or _grazes(other, point, velocity, min(time, expected))


def _grazes(surface, point, velocity, time):
    place = point + time * velocity
    normal = np.array(call(surface.unit_normal, place))
    return abs(normal @ velocity) < 1e-6 * np.linalg.norm(velocity)


@pytest.mark.parametrize("text", [ELLIPSOID, "x**2/a**2 + y**2/b**2 + z**2/0.25 - 1"])
def test_the_trajectory_is_that_of_the_ellipsoid(text):
    parameters = {"a": 0.3, "b": 0.4} if "a" in text else None
    ours = swarm.Scene([swarm.Formula(text, parameters=parameters)])
    reference = swarm.Scene([swarm.Ellipsoid((0.3, 0.4, 0.5))])
    particles = swarm.fill(reference, 20, speed=1.0, seed=1)
    ends = [swarm.simulate(scene, particles, swarm.Impact(), until=12.0) for scene in (ours, reference)]
    assert ends[0].observables["impacts"][-1] == ends[1].observables["impacts"][-1] > 20 * 20
    assert np.abs(ends[0].particles.position - ends[1].particles.position).max() < 1e-10
    assert ends[0].observables["energy_error"].max() < 1e-14


@pytest.mark.long
def test_turned_and_moved():
    rotation = (0.5, 0.1, -0.3, 0.7)
    place = {"center": (0.3, -0.1, 0.2), "rotation": rotation}
    scenes = [
        swarm.Scene([swarm.Formula(ELLIPSOID, **place)]),
        swarm.Scene([swarm.Ellipsoid((0.3, 0.4, 0.5), **place)]),
    ]
    particles = swarm.fill(scenes[1], 3, speed=1.0, seed=1)
    ends = [swarm.simulate(scene, particles, swarm.Impact(), until=3.0).particles.position for scene in scenes]
    assert np.abs(ends[0] - ends[1]).max() < 1e-12
    assert np.allclose(*(scene.bounds() for scene in scenes), atol=0.01)


@pytest.mark.long
def test_a_pill_keeps_energy_and_particles_with_gravity_and_soft_walls():
    scene = swarm.Scene([swarm.Formula(PILL)], gravity=(0.0, 0.0, -1.0))
    particles = swarm.fill(scene, 10, speed=0.5, seed=2)
    result = swarm.simulate(scene, particles, swarm.Penalty(dt=1e-3, penalty=1e3), until=2.0)
    assert result.observables["energy_error"].max() < 1e-11
    assert result.observables["impacts"][-1] > 10


# --- Bounds ----------------------------------------------------------------------------------------------

_ends = st.tuples(st.floats(-3.0, 3.0), st.floats(0.0, 2.0)).map(lambda pair: (pair[0], pair[0] + pair[1]))
X, Y = sympy.symbols("x y")
EXPRESSIONS = [
    X + Y, X * Y, X**2, X**3, X**4, X**-1, X**-2, sympy.sqrt(X), X ** sympy.Rational(-1, 3), X ** sympy.Rational(5, 2),
    sympy.exp(X), sympy.log(X), sympy.sin(X), sympy.cos(X), sympy.tan(X), sympy.sinh(X), sympy.cosh(X), sympy.tanh(X),
    (X**2 - Y) / (X - 2 * Y), sympy.sin(X * Y) * sympy.exp(-X),
]  # fmt: skip


@pytest.mark.parametrize("expression", EXPRESSIONS, ids=str)
@given(across=_ends, along=_ends)
def test_an_interval_holds_every_value(expression, across, along):
    found = bounds_of(expression, {X: Interval(*across), Y: Interval(*along)})
    value = sympy.lambdify((X, Y), expression, "numpy")
    points = np.meshgrid(np.linspace(*across, 9), np.linspace(*along, 9))
    with np.errstate(all="ignore"):
        values = np.broadcast_to(value(*points), points[0].shape)
    values = values[np.isfinite(values)]
    assert (found.low <= values).all()
    assert (values <= found.high).all()


@pytest.mark.parametrize("text", [ELLIPSOID, PILL, TORUS])
def test_the_box_is_found_and_tight(text):
    surface = swarm.Formula(text)
    half = {ELLIPSOID: (0.3, 0.4, 0.5), PILL: (0.3, 0.3, 0.13**0.25), TORUS: (1.0, 1.0, 0.3)}[text]
    for corner, sign in zip(surface.bounds(), (-1.0, 1.0), strict=True):
        assert all(h <= sign * c <= 1.2 * h for c, h in zip(corner, half, strict=True))
    assert surface.size() == pytest.approx(min(half), rel=0.2)


@pytest.mark.parametrize("scale", [1e-6, 1e-3, 1e3])
def test_the_box_is_found_at_every_scale(scale):
    surface = swarm.Formula("(x/s)**2 + (y/s)**2 + 4*(z/s)**4 - 1", parameters={"s": scale})
    assert np.allclose(surface.bounds()[1], scale * np.array([1.0, 1.0, 0.5**0.5]), rtol=0.05)


@pytest.mark.parametrize("side", ["inside", "outside"])
@pytest.mark.parametrize("text", [ELLIPSOID, PILL, TORUS, GYROID])
def test_the_bend_bounds_second_derivatives(text, side):
    surface = swarm.Formula(text, side=side, bounds=((-3, -3, -3), (3, 3, 3)) if text == GYROID else None)
    form, random = surface._form, np.random.default_rng(1)
    numbers = form.numbers((0.0, 0.0, 0.0))
    low, high = np.array(form.box)
    for point in random.uniform(low, high, (200, 3)):
        if numbers.side * call(numbers.phi, point) > 0.0:
            continue
        xx, yy, zz, xy, yz, zx = (numbers.side * part for part in call(numbers.hessian, point))
        matrix = np.array([[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]])
        values = np.linalg.eigvalsh(matrix)
        assert form.bend.least <= values[0] + 1e-12
        assert values[-1] <= form.bend.most + 1e-12
        entries = np.array([xx, yy, zz, xy, yz, zx])
        assert (np.array(form.bend.low) <= entries + 1e-12).all()
        assert (entries <= np.array(form.bend.high) + 1e-12).all()


@pytest.mark.long
def test_an_open_volume_is_open():
    tube = swarm.Formula("x**2 + y**2 - 0.25")
    low, high = np.array(tube.bounds())
    assert (low[2], high[2]) == (-np.inf, np.inf)
    # Across its axis they are around the tube, to the width of the cells in which they are searched.
    assert (high[:2] >= 0.5).all()
    assert np.allclose([low[:2], high[:2]], [[-0.5] * 2, [0.5] * 2], atol=0.01)
    scene = swarm.Scene([tube, swarm.Plane((0, 0, 1), 0.5), swarm.Plane((0, 0, -1), 0.5)])
    start = swarm.Particles([[0.1], [0.0], [0.0]], [[1.0], [0.0], [0.5]])
    result = swarm.simulate(scene, start, swarm.Impact(), until=1.0)
    expected = swarm.simulate(scene_of_cylinder(), start, swarm.Impact(), until=1.0)
    assert np.allclose(result.particles.position, expected.particles.position, atol=1e-13)


def scene_of_cylinder():
    planes = [swarm.Plane((0, 0, 1), 0.5), swarm.Plane((0, 0, -1), 0.5)]
    return swarm.Scene([swarm.Cylinder(0.5), *planes])


# --- Errors and tables -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "keywords", "parts"),
    [
        ("x + wall", {}, ["unknown name 'wall'"]),
        ("x**2 + 1", {}, ["0 somewhere", "above 0 everywhere"]),
        ("x**2 + 1", {"bounds": ((-1, -1, -1), (1, 1, 1))}, ["0 somewhere in the bounds", "above 0"]),
        ("x**3 - 50", {"bounds": ((-1, -1, -1), (1, 1, 1))}, ["0 somewhere in the bounds", "below 0"]),
        ("log(x) + y**2", {"bounds": ((-1, -1, -1), (1, 1, 1))}, ["phi must be a finite number", "nan"]),
        ("(x**2 + y**2 + z**2 - 1)**3", {}, ["a gradient on its surface"]),
        ("sqrt(x**2 + y**2) + z**2 - 1", {}, ["smooth", "'sqrt(x**2 + y**2)' at column 1", "near (0, 0, "]),
        ("(sqrt(x**2 + y**2) - 0.31)**2 + z**2 - 0.09", {}, ["curvature must be given", "not bounded"]),
        ("x**2 + y**2 + z**2/p - 1", {"parameters": {"p": 0.0}}, ["smooth", "'z**2/p' at column 15", "divide by 0"]),
        ("sqrt(x**2 + 1e-140) + y**2 + z**2 - 1", {}, ["second derivative must be below", "give curvature"]),
        (GYROID, {}, ["bounds must be given", "curvature"]),
        (PILL, {"bounds": (1, 2)}, ["bounds[0]", "three numbers"]),
        (PILL, {"bounds": ((0, 0, 0), (1, 0, 1))}, ["a lower and an upper corner"]),
        (PILL, {"bounds": 3}, ["two corners", "got 3"]),
        (PILL, {"size": -1.0}, ["size", "above 0"]),
        (PILL, {"curvature": -1.0}, ["curvature", "0 or more"]),
        (PILL, {"side": "in"}, ["side", "did you mean 'inside'?"]),
        (PILL, {"centre": (0, 0, 0)}, ["no argument 'centre'", "'center'"]),
        (PILL, {"parameters": {"x": 1.0}}, ["parameters", "names other than x", "got 'x'"]),
        (PILL, {"parameters": {"a": "b"}}, ["parameters.a", "got 'b'"]),
        (PILL, {"parameters": [1.0]}, ["by their names"]),
        ("*".join(f"(x-{i}-y*z)" for i in range(30)), {}, ["operations", "shorten it"]),
    ],
)
def test_errors_name_the_argument(text, keywords, parts):
    with pytest.raises(swarm.SceneError) as caught:
        swarm.Formula(text, **keywords)
    assert all(part in str(caught.value) for part in parts), str(caught.value)


WALLS = " + y**2 + z**2 - 1"
BOUNDS = ((-1.1, -1.1, -1.1), (1.1, 1.1, 1.1))


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("sqrt(x**2)", "'sqrt(x**2)' at column 1,"),
        ("(x**2)**0.5", "'(x**2)**0.5' at column 1,"),
        ("exp(log(x**2)/2)", "'log(x**2)' at column 5,"),
        ("(x**4)**(1/4)", "'(x**4)**(1/4)' at column 1,"),
        ("sqrt((x - y)**2)", "'sqrt((x - y)**2)' at column 1,"),
        ("sqrt(x**2 - 2*x*y + y**2)", "'sqrt(x**2 - 2*x*y + y**2)' at column 1,"),
        ("sqrt(sqrt(x**4))", "'sqrt(x**4)' at column 6,"),
        ("sqrt(x**2)**2", "'sqrt(x**2)' at column 1,"),
        ("sqrt(x**2)*sqrt(x**2)", "'sqrt(x**2)' at column 1,"),
        ("x**2 + 0*sqrt(x**2)", "'sqrt(x**2)' at column 10,"),
        ("x**2 + sqrt(x**2) - sqrt(x**2)", "'sqrt(x**2)' at column 8,"),
        ("x*sqrt(x**2)/x", "'sqrt(x**2)' at column 3,"),
        ("sqrt(1 - cos(x)**2)", "'sqrt(1 - cos(x)**2)' at column 1,"),
        ("cosh(sqrt(x**2)) - 1", "'sqrt(x**2)' at column 6,"),
        # The power's derivative is written as 5 (x**2)**(5/4)/(2 x), which is 0/0 there.
        ("(x**2)**1.25", "'(x**2)**1.25' at column 1,"),
        ("x**2/x*x", "'x**2/x' at column 1,"),
        ("x**3*x**-1", "'x**-1' at column 6,"),
        ("x**2 - 1e-6/x**2", "'1e-6/x**2' at column 8,"),
        ("x**2 + sqrt(x**2 + 0)", "'sqrt(x**2 + 0)' at column 8,"),
    ],
)
def test_a_corner_or_a_pole_is_an_error_that_shows_where(text, place):
    with pytest.raises(swarm.SceneError) as caught:
        swarm.Formula(text + WALLS, bounds=BOUNDS)
    message = str(caught.value)
    assert message.startswith("phi must be smooth wherever particles go, got " + place), message
    assert "give bounds" in message


@pytest.mark.parametrize(
    ("text", "keywords", "place"),
    [
        ("sqrt(x**2)" + WALLS, {}, "near (0, "),
        ("sqrt(x**2)" + WALLS, {"bounds": BOUNDS, "curvature": 2.0}, "near (0, 0, 0)"),
        ("sqrt(x**2 + p)" + WALLS, {"parameters": {"p": 0.0}}, "'sqrt(x**2 + p)'"),
        ("sqrt((x - p)**2)" + WALLS, {"parameters": {"p": 0.123}}, "near (0.1"),
        ("x**2 + 0.001*tan(3*x)" + WALLS, {"bounds": BOUNDS, "curvature": 2.0}, "'tan(3*x)' at column 14"),
        ("sqrt(x + 1.1)" + WALLS, {"bounds": BOUNDS, "curvature": 2.0}, "'sqrt(x + 1.1)'"),
        ("sqrt(x**2 + y**2) - 0.5", {"curvature": 2.0}, "'sqrt(x**2 + y**2)'"),
        ("sqrt(x**2)" + WALLS, {"side": "outside"}, "'sqrt(x**2)'"),
        ("sqrt(x**2) + y**2 - 1", {}, "'sqrt(x**2)'"),
    ],
)
def test_a_corner_is_found_with_any_arguments(text, keywords, place):
    with pytest.raises(swarm.SceneError, match="phi must be smooth wherever particles go") as caught:
        swarm.Formula(text, **keywords)
    assert place in str(caught.value)


@pytest.mark.parametrize(
    ("text", "keywords"),
    [
        ("sqrt(x**2 + y**2 + 0.01) + z**2 - 1", {}),
        ("sqrt(x*x + 1e-4)" + WALLS, {}),
        # A coordinate occurs twice: bounds of the slopes are needed.
        ("sqrt(x**2 - 2*x*y + y**2 + 0.01)" + WALLS, {"bounds": BOUNDS, "curvature": 20.0}),
        # Singular on the axis, which is no admissible place.
        ("(sqrt(x**2 + y**2) - 0.7)**2 + z**2 - 0.09", {}),
        ("(sqrt(x**2 + y**2) - 0.35)**2 + z**2 - 0.09", {"curvature": 14.0}),
        ("1/(1.2 - x) + 1/(1.2 + x) + y**2 + z**2 - 2", {"bounds": BOUNDS}),
        ("sqrt(x**2 + y**2 + 1) - z - 1.5", {"curvature": 1.0}),
    ],
)
def test_a_smooth_root_or_quotient_keeps_particles_in(text, keywords):
    surface = swarm.Formula(text, **keywords)
    start = np.random.default_rng(1).uniform(-1.0, 1.0, (3, 2000))
    start = start[:, surface.phi(start) < -0.05][:, :5]
    for point, velocity in zip(start.T, start.T[::-1] + 0.1, strict=True):
        (numbers,) = surface.walls()
        for _ in range(5):
            time, found = call(numbers.first_hit, point, velocity)
            if time == math.inf:
                break
            along = point[:, None] + velocity[:, None] * time * np.linspace(0.0, 1.0, 50)
            assert (surface.phi(along) < 1e-12).all()
            if not found:
                point = along[:, -1]
                continue
            point = call(numbers.project, along[:, -1])
            normal = np.array(call(numbers.unit_normal, np.array(point)))
            point, velocity = np.array(point), velocity - 2.0 * (normal @ velocity) * normal


def test_a_formula_with_parameters_has_a_hash():
    text = "x**2/a**2 + y**2/b**2 + z**2 - 1"
    one, same, other = (
        swarm.Formula(text, parameters=values)
        for values in ({"a": 0.5, "b": 1.0}, {"b": 1, "a": 0.5}, {"a": 0.5, "b": 2.0})
    )
    assert one == same != other
    assert hash(one) == hash(same)
    assert len({one, same, other}) == 2


def test_one_argument_is_replaced():
    one = swarm.Formula("x**2 + y**2 + z**2 - r**2", parameters={"r": 0.5}, bounds=((-1, -1, -1), (1, 1, 1)))
    other = dataclasses.replace(one, side="outside")
    assert (other.side, other.formula, other.parameters, other.box) == ("outside", one.formula, one.parameters, one.box)


def test_its_table_and_back():
    surface = swarm.Formula(
        "x**2/a**2 + y**2 + z**2 - 1", parameters={"a": 0.5}, bounds=((-1, -2, -2), (1, 2, 2)), size=0.5
    )
    table = tables.table_of(surface)
    assert table["kind"] == "formula"
    assert table["phi"] == surface.formula
    assert {"bounds", "size", "parameters"} <= set(table)
    assert tables.scene_of([table], None).surfaces == (surface,)
    assert eval(repr(surface), {"Formula": swarm.Formula}) == surface


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({}, r"surface\[0\].phi: expected"),
        ({"phi": 3}, r"surface\[0\].phi: expected a text, got a whole number \(in phi = 3\)"),
        ({"phi": "x + q"}, r"surface\[0\].phi has an unknown name 'q'"),
        ({"formula": "x"}, r"surface\[0\].formula: unknown key"),
        ({"phi": PILL, "size": "big"}, r"surface\[0\].size: expected a number"),
        ({"phi": PILL, "bounds": [1, 2]}, r"surface\[0\].bounds"),
        ({"phi": "__import__('os').system('touch /tmp/owned')"}, r"surface\[0\].phi must call only"),
    ],
)
def test_a_scene_file_names_its_key(table, message):
    with pytest.raises(swarm.SceneError, match=message):
        tables.scene_of([{"kind": "formula", **table}], None)


def test_other_values_of_parameters_are_the_same_code():
    kinds = {swarm.Formula("x**2 + y**2 + z**2 - r**2", parameters={"r": r})._form.kind for r in (0.1, 2.0)}
    assert len(kinds) == 1
    assert issubclass(kinds.pop(), numbers.OwnNumbers)
