"""Surfaces as users write them: what is refused, bounds, and that repr and table make the same surface again."""

import math
import tomllib

import numpy as np
import pytest
import tomli_w
from conftest import QUADRIC_WALLS, SAMPLED_WALLS, WALLS, directions, every_wall, numbers_of, side_of, surface_of
from hypothesis import given
from hypothesis import strategies as st

import swarm
from swarm.serialization import tables
from swarm.surfaces import ALL_FIELDS, ALL_SURFACES

# Made of several walls: test_bodies.py, test_union.py, test_outlines.py.
OUTLINED = {"polygon", "prism", "stadium"}
ELSEWHERE = {"box", "cone", "union", "intersection", "mesh", *OUTLINED}


def test_the_table_holds_every_surface():
    here = {type(make()) for make in WALLS.values()}
    assert here == {kind for name, kind in ALL_SURFACES.items() if name not in {*ELSEWHERE, *ALL_FIELDS}}


ONE = ((1, 0, 0), (0, 1, 0), (0, 0, 1))


@pytest.mark.parametrize(
    ("build", "parts"),
    [
        (lambda: swarm.Sphere(0.0), ["radius", "above 0", "got 0"]),
        (lambda: swarm.Sphere(-1.0), ["radius", "got -1"]),
        (lambda: swarm.Sphere(math.nan), ["radius", "finite", "nan"]),
        (lambda: swarm.Sphere(1e-200), ["radius", "between 1e-100 and 1e+100 m", "got 1e-200"]),
        (lambda: swarm.Ellipsoid((1e-170, 1.0, 1.0)), ["semi_axes[0]", "between 1e-100", "got 1e-170"]),
        (lambda: swarm.Sphere("big"), ["radius", "finite number", "'big'"]),
        (lambda: swarm.Sphere(1.0, center=(0.0, 0.0)), ["center", "three numbers", "got 2"]),
        (lambda: swarm.Sphere(1.0, center=(0.0, math.inf, 0.0)), ["center[1]", "finite", "inf"]),
        (lambda: swarm.Sphere(1.0, side="outsid"), ["side", "'inside' and 'outside'", "did you mean 'outside'?"]),
        (lambda: swarm.Ellipsoid((1.0, 0.0, 2.0)), ["semi_axes[1]", "above 0", "got 0"]),
        (lambda: swarm.Ellipsoid(1.0), ["semi_axes", "three numbers", "got 1.0"]),
        (lambda: swarm.Ellipsoid((1.0, 1.0, 1.0), side="in"), ["side", "did you mean 'inside'?"]),
        (lambda: swarm.Plane((0.0, 0.0, 0.0)), ["normal", "length 0"]),
        (lambda: swarm.Plane((0.0, 0.0, 1.0), offset=math.nan), ["offset", "finite", "nan"]),
        (lambda: swarm.Sphere(1.0).phi(np.zeros((2, 3))), ["points", "(3, N)", "(2, 3)"]),
        (lambda: swarm.Sphere(1.0).phi("abc"), ["points", "array of numbers", "got str"]),
        (lambda: swarm.Plane((0, 0, 1)).gradient(np.zeros((5, 3))), ["points", "(3, N)", "(5, 3)"]),
        (lambda: swarm.Torus(1.0, 1.0), ["minor_radius", "below major_radius = 1", "got 1"]),
        (lambda: swarm.Torus(0.0, 1.0), ["major_radius", "above 0", "got 0"]),
        (lambda: swarm.Torus(1.0, 0.5, side="in"), ["side", "did you mean 'inside'?"]),
        (
            lambda: swarm.Quadric(((1, 2, 0), (3, 1, 0), (0, 0, 1))),
            ["matrix must be symmetric", "matrix[0][1] = 2", "matrix[1][0] = 3"],
        ),
        (lambda: swarm.Quadric(((1, 0, 0), (0, 1, 0))), ["matrix", "three rows"]),
        (lambda: swarm.Quadric(1.0), ["matrix", "three rows", "1.0"]),
        (lambda: swarm.Quadric(((1, 0, 0), (0, math.nan, 0), (0, 0, 1))), ["matrix[1][1]", "finite", "nan"]),
        (lambda: swarm.Quadric(np.zeros((3, 3))), ["matrix", "all 0", "vector"]),
        (lambda: swarm.Quadric(ONE, vector=(0, math.inf, 0)), ["vector[1]", "finite"]),
        (lambda: swarm.Quadric(ONE, constant="x"), ["constant", "finite number"]),
        (lambda: swarm.Quadric(ONE, constant=1.0), ["constant", "same sign", "got 1"]),
        (lambda: swarm.Quadric(np.diag([1, 0, 0])), ["constant", "same sign", "got 0"]),
        (lambda: swarm.Quadric(ONE, constant=-1, side="in"), ["side", "did you mean 'inside'?"]),
        (lambda: swarm.Slab((0, 0, 0), 1.0), ["normal", "length 0"]),
        (lambda: swarm.Slab((0, 0, 1), -1.0), ["half_width", "above 0", "got -1"]),
        (lambda: swarm.Cylinder(0.0), ["radius", "above 0", "got 0"]),
        (lambda: swarm.Cylinder(1.0, length=0.0), ["length", "above 0", "got 0"]),
        (lambda: swarm.Cylinder(1.0, axis=(0, 0, 0)), ["axis", "length 0"]),
        (lambda: swarm.Cone(0.0), ["half_angle", "between 0 and pi/2", "got 0"]),
        (lambda: swarm.Cone(math.pi / 2), ["half_angle", "between 0 and pi/2", "got 1.5708"]),
        (lambda: swarm.Paraboloid(-0.5), ["focal_length", "above 0", "got -0.5"]),
        (lambda: swarm.Capsule(0.0, 1.0), ["radius", "above 0", "got 0"]),
        (lambda: swarm.Capsule(1.0, -1.0), ["length", "0 or more", "got -1"]),
        (lambda: swarm.Capsule(1.0, math.nan), ["length", "finite", "nan"]),
        (lambda: swarm.Capsule(1.0, 1.0, axis=(0, 0, 0)), ["axis", "length 0"]),
        (lambda: swarm.Capsule(1.0, 1.0, side="in"), ["side", "did you mean 'inside'?"]),
        (lambda: swarm.Box((1.0, 0.0, 1.0)), ["half_widths[1]", "above 0", "got 0"]),
        (lambda: swarm.Box((1.0, 1.0)), ["half_widths", "three numbers", "got 2"]),
        (lambda: swarm.Box((1, 1, 1), open=["+w"]), ["open[0]", "'+x'", "got '+w'"]),
        (lambda: swarm.Box((1, 1, 1), open=["+x", "-y", "+x"]), ["open", "'+x' twice"]),
        (lambda: swarm.Box((1, 1, 1), open="+x"), ["open", "list of faces", "'+x'"]),
        (lambda: swarm.Box((1, 1, 1), open=["-x", "+x", "-y", "+y", "-z", "+z"]), ["open", "all six"]),
        (lambda: swarm.Box((1, 1, 1), side="outside", open=["+x"]), ["open", "outside", "['+x']"]),
        (lambda: swarm.Sphere(1.0, friction=-0.1), ["friction must be 0 or more", "got -0.1"]),
        (lambda: swarm.Sphere(1.0, friction=math.inf), ["friction must be a finite number", "got inf"]),
        (lambda: swarm.Sphere(1.0, friction=None), ["friction must be a finite number", "got None"]),
        (lambda: swarm.Sphere(1.0, temperature=-1), ["temperature must be 0 or more", "got -1"]),
        (lambda: swarm.Sphere(1.0, temperature=math.nan), ["temperature must be a finite number", "got nan"]),
        (lambda: swarm.Sphere(1.0, temperature="hot"), ["temperature must be a finite number", "got 'hot'"]),
        (lambda: swarm.Sphere(1.0, temperature=300.0, accommodation=1.1), ["accommodation must be from 0 to 1", "1.1"]),
        (lambda: swarm.Sphere(1.0, temperature=300.0, accommodation=math.nan), ["accommodation", "0 to 1, got nan"]),
        (lambda: swarm.Sphere(1.0, accommodation=-0.5), ["accommodation must be from 0 to 1, got -0.5"]),
        (lambda: swarm.Sphere(1.0, accommodation=0.5), ["with a temperature, got 0.5 and none; give temperature="]),
    ],
)
def test_errors_name_the_argument(build, parts):
    with pytest.raises(swarm.SceneError) as caught:
        build()
    assert all(part in str(caught.value) for part in parts), str(caught.value)


@every_wall
def test_bounds_hold_the_admissible_side(name):
    """Random points, those of the admissible side all in the box; a solid and a plane bound nothing."""
    points = np.random.default_rng(2).uniform(-2.0, 2.0, (3, 4000))
    surface = surface_of(name)
    side = side_of(numbers_of(name))
    low, high = (np.array(corner)[:, None] for corner in surface.bounds())
    admissible = points[:, side * surface.phi(points) <= 0.0]
    assert admissible.shape[1] > 10
    assert ((admissible >= low) & (admissible <= high)).all()
    bounded = "egg" in name if name in QUADRIC_WALLS else side > 0.0 and name != "plane"
    assert np.isfinite(high - low).all() == bounded
    assert np.isfinite(surface.size()) == (name not in {"plane", "nappes", "wall"})
    assert np.isfinite(surface.extent())


def test_a_normal_of_any_length_is_scaled_to_one():
    for length in (1e-320, 1e-200, 1.0, 1.7e308):
        assert swarm.Plane((length, 0.0, -length)).normal == pytest.approx((0.5**0.5, 0.0, -(0.5**0.5)), rel=1e-3)


@pytest.mark.parametrize("size", [1e-300, 1e-3, 3.0, 1e300])
@given(direction=directions)
def test_a_normal_of_any_length_is_scaled_to_1_once(size, direction):
    """By the largest part first, then by the length of what is left."""
    given_ = tuple((size * direction).tolist())
    largest = max(map(abs, given_))
    scaled = [part / largest for part in given_]
    expected = tuple(part / math.hypot(*scaled) for part in scaled)
    normal = swarm.Plane(given_).normal
    assert normal == expected
    assert swarm.Plane(normal).normal == normal


# --- The same surface again ------------------------------------------------------------------------------

TURNED = {
    "plane": lambda n, **turn: swarm.Plane(n, 0.3, **turn),
    "slab": lambda n, **turn: swarm.Slab(n, 0.3, n, **turn),
    "cylinder": lambda n, **turn: swarm.Cylinder(0.3, n, 0.7, **turn),
    "cone": lambda n, **turn: swarm.Cone(0.3, n, friction=0.4, **turn),
    "paraboloid": lambda n, **turn: swarm.Paraboloid(0.3, n, **turn),
    "capsule": lambda n, **turn: swarm.Capsule(0.3, 0.4, n, side="outside", **turn),
    "box": lambda n, **turn: swarm.Box((0.3, 0.4, 0.5), n, restitution=0.5, **turn),
    "quadric": lambda n, **turn: swarm.Quadric(np.diag((1.0, 2.0, -1.0)), n, -0.25, **turn),
    "formula": lambda n, **turn: swarm.Formula(
        "(x/a)**2 + y**2 + z**4 - b", parameters={"a": 0.5, "b": 1.5}, bounds=((-2,) * 3, (2,) * 3), center=n, **turn
    ),
    "sphere": lambda n, **turn: swarm.Sphere(0.3, n, temperature=0, accommodation=0.5, **turn),
    "ellipsoid": lambda n, **turn: swarm.Ellipsoid((0.3, 0.4, 0.5), n, **turn),
    "torus": lambda n, **turn: swarm.Torus(0.7, 0.3, n, **turn),
}


def is_made_again(surface):
    table = tomllib.loads(tomli_w.dumps(tables.table_of(surface)))
    for again in (eval(repr(surface), vars(swarm)), tables.of_kind(table, "surface", ALL_SURFACES)):
        assert again == surface
        assert hash(again) == hash(surface)
        assert [wall[1:] for wall in again.walls()] == [wall[1:] for wall in surface.walls()]


@pytest.mark.parametrize("name", [name for name in WALLS if name not in SAMPLED_WALLS])
def test_a_surface_is_made_again_by_its_repr_and_by_its_table(name):
    is_made_again(surface_of(name))


@pytest.mark.parametrize("name", TURNED)
@given(direction=directions, axis=directions, angle=st.floats(-7.0, 7.0))
def test_a_turned_surface_is_made_again(name, direction, axis, angle):
    direction, axis = (tuple(part.tolist()) for part in (direction, axis))
    is_made_again(TURNED[name](direction, rotation={"axis": axis, "angle": angle}))
    is_made_again(TURNED[name](direction, rotation=(angle, *axis)))
    is_made_again(TURNED[name](direction))


def test_every_kind_is_made_again():
    # Whose repr leaves out long arrays: test_fields.py, data/test_sampled.py, test_facets.py; others:
    # test_union.py, test_outlines.py.
    assert set(TURNED) == set(ALL_SURFACES) - {*ALL_FIELDS, "sampled", "mesh", "union", "intersection", *OUTLINED}
