"""Scenes: which volumes they accept, their bounds and size."""

import itertools
import math

import numpy as np
import pytest
from conftest import SURFACES, scene_of

from swarm import Box, Cone, Ellipsoid, Plane, Scene, SceneError, Sphere, fill
from swarm.kernel.gravity import Gravity
from swarm.kernel.vector import vec
from swarm.surfaces import room


def cube(half=1.0):
    return [Plane(sign * np.eye(3)[axis], half) for axis in range(3) for sign in (1.0, -1.0)]


BALL = Sphere(1.0, side="outside")

VOLUMES = {
    "a cavity": [Sphere(1.0)],
    "around a solid": [BALL],
    "a half-space": [Plane((0, 0, 1), -5.0)],
    "a cube": cube(),
    "a slab": cube()[:2],
    "a slab of 1e-6": [Plane((0, 0, 1), 1e-6), Plane((0, 0, -1), 0.0)],
    "a cap": [Sphere(1.0), Plane((0, 0, 1), -0.999)],
    "a shell": [Sphere(1.0), Sphere(0.9, side="outside")],
    "a shell of 1e-6": [Sphere(1.0), Sphere(1.0 - 1e-6, side="outside")],
    "a shell next to one side": [Sphere(1.0), Sphere(0.9, (0.1, 0.0, 0.0), side="outside")],
    "a solid that cuts the wall": [Sphere(1.0), Sphere(1.0, (0.5, 0.0, 0.0), side="outside")],
    "an ellipsoidal shell of 1e-6": [Ellipsoid((1, 2, 3)), Ellipsoid((1 - 1e-6, 2 - 1e-6, 3 - 1e-6), side="outside")],
    "a lens of 1e-6": [Sphere(1.0), Sphere(1.0, (2.0 - 1e-6, 0.0, 0.0))],
    "a cap of 1e-6": [Sphere(1.0), Plane((0, 0, 1), 1e-6 - 1.0)],
    "a lens of 1e-12": [Sphere(1.0), Sphere(1.0, (2.0 - 1e-12, 0.0, 0.0))],
    "a cap of 1e-12 of an ellipsoid": [Ellipsoid((1.0, 2.0, 3.0)), Plane((1.0, 0.0, 0.0), 1e-12 - 1.0)],
    "a wedge far away": [Plane((0, 0, 1), 0.0), Plane((0.01, 0.0, -1.0), -1.0)],
    "a small cavity far away": [Sphere(1e-6, (1e3, -1e3, 1e3))],
    "a solid far away": [Sphere(1.0, (1e6, 0.0, 0.0), side="outside"), Plane((1.0, 0.0, 0.0), 0.0)],
    "large": [Sphere(1e6), Sphere(0.5e6, side="outside")],
    "between balls": [*cube(), *(Sphere(0.4, c, side="outside") for c in ((0, 0, 0), (0.9, 0.9, 0.9)))],
}
EMPTY = {
    "a plane beyond the sphere": [Sphere(1.0), Plane((0, 0, 1), -2.0)],
    "a solid larger than its cavity": [Sphere(1.0), Sphere(1.1, side="outside")],
    "a solid ellipsoid around a cavity": [Sphere(0.5), Ellipsoid((1, 2, 3), side="outside")],
    "planes back to back": [Plane((0, 0, 1), -1.0), Plane((0, 0, -1), -1.0)],
    "planes back to back, tilted": [Plane((1, 1, 1), -1e-3), Plane((-1, -1, -1), 0.0)],
    "two cavities apart": [Sphere(1.0), Sphere(1.0, (2.5, 0.0, 0.0))],
    "two cavities apart, their boxes not": [Sphere(1.0), Sphere(1.0, (1.3, 1.3, 1.3))],
    "a shell of less than nothing": [Sphere(1.0), Sphere(1.0 + 1e-9, side="outside")],
    "spheres that miss by 1e-9": [Sphere(1.0), Sphere(1.0, (2.0 + 1e-9, 0.0, 0.0))],
    "a plane that misses by 1e-9": [Ellipsoid((1.0, 2.0, 3.0)), Plane((1.0, 0.0, 0.0), -1.0 - 1e-9)],
    "a cube in a solid": [*cube(), Sphere(1.8, side="outside")],
}


@pytest.mark.parametrize("surfaces", VOLUMES.values(), ids=VOLUMES)
def test_a_volume_is_accepted(surfaces):
    assert Scene(surfaces).surfaces == tuple(surfaces)


@pytest.mark.parametrize("surfaces", EMPTY.values(), ids=EMPTY)
def test_no_volume_is_refused(surfaces):
    with pytest.raises(SceneError) as caught:
        Scene(surfaces)
    assert f"must leave a volume for particles, got {len(surfaces)} surfaces" in str(caught.value)
    assert "side" in str(caught.value)


@pytest.mark.parametrize(
    ("build", "parts"),
    [
        (lambda: Scene([BALL, "ball"]), ["surfaces[1]", "surface", "'ball'"]),
        (lambda: Scene([BALL], gravity=9.81), ["gravity", "three numbers", "9.81"]),
        (lambda: Scene([BALL], gravity=(0, 0)), ["gravity", "three numbers", "got 2"]),
        (lambda: Scene([BALL], gravity=(0, 0, math.nan)), ["gravity[2]", "finite", "nan"]),
        (lambda: Scene([BALL], gravity=(0, 0, -1e300)), ["|gravity[2]|", "at most 1e+100", "1e+300"]),
    ],
)
def test_errors_name_the_argument(build, parts):
    with pytest.raises(SceneError) as caught:
        build()
    assert all(part in str(caught.value) for part in parts), str(caught.value)


def test_gravity_of_nothing_is_none():
    assert Scene([BALL], gravity=(0, 0, 0)).gravity is None
    assert Scene([BALL]).pull() is None
    assert Scene([BALL], gravity=(0, 0, -9.81)).pull() == Gravity(0.0, 0.0, -9.81)


def test_one_surface_need_not_be_a_list():
    assert Scene(BALL) == Scene([BALL])


def test_gaps_have_the_sign_of_each_side():
    points = np.random.default_rng(3).normal(size=(3, 50))
    gaps = scene_of("ball", "plane").gaps(points)
    assert gaps.shape == (2, 50)
    for row, name in zip(gaps, ("ball", "plane"), strict=True):
        (numbers,) = SURFACES[name]().walls()
        levels = numbers.level_of(np.array([numbers.inner(vec(point)) for point in points.T]))
        assert (np.sign(row) == np.sign(levels)).all()


INF = math.inf


@pytest.mark.parametrize(
    ("surfaces", "low", "high"),
    [
        ([Sphere(2.0, (1, 0, 0))], (-1, -2, -2), (3, 2, 2)),
        ([Ellipsoid((1, 2, 3)), Sphere(2.0, (1, 0, 0))], (-1, -2, -2), (1, 2, 2)),
        ([BALL], (-INF,) * 3, (INF,) * 3),
        (cube(0.5), (-0.5,) * 3, (0.5,) * 3),
        (cube()[:2], (-1, -INF, -INF), (1, INF, INF)),
        ([Sphere(1.0), Plane((0, 0, 1), 0.5)], (-1, -1, -1), (1, 1, 0.5)),
        # x + y + z <= 1 in the first octant
        ([Plane((1, 1, 1), 1 / math.sqrt(3)), *(Plane(-axis, 0.0) for axis in np.eye(3))], (0, 0, 0), (1, 1, 1)),
        # the wedge |x| <= -y is open along -y and z
        ([Plane((1, 1, 0)), Plane((-1, 1, 0))], (-INF, -INF, -INF), (INF, 0, INF)),
    ],
    ids=lambda part: None,
)
def test_bounds_by_hand(surfaces, low, high):
    for corner, expected in zip(Scene(surfaces).bounds(), (low, high), strict=True):
        assert corner == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(
    ("surfaces", "size"),
    [
        ([Sphere(2.0), Sphere(0.5, side="outside")], 0.5),
        ([Ellipsoid((1, 2, 3))], 1.0),
        (cube(0.25), 0.25),
        (cube()[:2], 1.0),
        ([Plane((0, 0, 1))], INF),
    ],
    ids=repr,
)
def test_size_by_hand(surfaces, size):
    assert Scene(surfaces).size() == pytest.approx(size)


def test_more_walls_than_can_be_compiled_are_refused():
    around = [Plane((math.cos(a), math.sin(a), 0.0), 0.4) for a in np.linspace(0.0, 6.0, 21)]
    assert len(Scene([Box((0.5, 0.5, 0.5)), *around]).compiled().numbering.surfaces_of_rows) == 24
    with pytest.raises(SceneError, match=r"at most 24 walls in all, got 45 of 43 surfaces: each wall is compiled"):
        Scene([Box((0.5, 0.5, 0.5)), *around, *around])


def test_any_number_of_solids_of_one_kind_are_a_scene():
    balls = [Sphere(0.01, (x, y, 0.0), side="outside") for x in (-0.2, 0.0, 0.2) for y in np.linspace(-0.3, 0.3, 9)]
    scene = Scene([Box((0.5, 0.5, 0.5)), *balls])
    assert len(scene.compiled().numbering.surfaces_of_rows) == 30
    with pytest.raises(SceneError, match=r"at most 24 walls in all with Verlet, got 30 of 28 surfaces"):
        scene.compiled(apart="Verlet")


# --- Laws of walls ---------------------------------------------------------------------------------------


def by_surface(scene, given):
    """What is given of each wall with the surface of each, in the order of the surfaces."""
    return sorted(zip(scene.compiled().numbering.surfaces_of_rows, given, strict=True))


def test_a_scene_without_a_law_has_none():
    assert Scene([Box((1, 1, 1)), BALL]).compiled().laws is None
    assert Scene([Sphere(1.0, restitution=1, friction=0, accommodation=1)]).compiled().laws is None


def test_every_wall_has_the_laws_of_its_surface():
    """A box has three walls; what no surface has is None, and is compiled to nothing."""
    box = {"half_widths": (1.0, 1.0, 1.0)}
    lossy = Scene([Sphere(0.5, side="outside"), Box(**box, restitution=0.5)])
    assert by_surface(lossy, lossy.compiled().laws.restitution) == [(0, 1.0), *3 * [(1, 0.5)]]
    assert lossy.compiled().laws[1:] == (None, None, None, None, None)
    rough = Scene([Box(**box, friction=0.3), Sphere(0.5, side="outside", friction=0.1)])
    assert by_surface(rough, rough.compiled().laws.friction) == [*3 * [(0, 0.3)], (1, 0.1)]
    assert (rough.compiled().laws.restitution, rough.compiled().laws.thermal) == (None, None)
    hot = Scene([Plane((0, 0, 1), 1.0), Box(**box, temperature=300.0, accommodation=0.25), Sphere(9.0, temperature=0)])
    assert hot.compiled().laws[:2] == (None, None)
    assert by_surface(hot, hot.compiled().laws.thermal) == [(0, (0.0, 0.0)), *3 * [(1, (300.0, 0.25))], (2, (0.0, 1.0))]


# --- Far corners -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("axis", [(0.0, 0.0, 1.0), (1.0, 2.0, 3.0)], ids=["along z", "oblique"])
@pytest.mark.parametrize("short_of_flat", [1e-3, 2e-6, 1e-6, 5e-7, 1e-7, 1e-9, 1e-12])
def test_a_flat_cone_that_a_plane_closes_is_not_open(axis, short_of_flat):
    """Its rim is 1/tan(short_of_flat) away: bounds that hold it, not much larger, and the plane's and the apex'."""
    cone = Cone(0.5 * math.pi - short_of_flat, axis=axis)
    normal = np.array(axis) / np.linalg.norm(axis)
    scene = Scene([cone, Plane(tuple(normal), 1.0)])
    assert not scene.is_open()
    rim = math.tan(cone.half_angle) * np.sqrt(1.0 - normal**2)
    low, high = np.array(scene.bounds())
    wide = rim > 1.0
    assert (high >= (rim + np.maximum(normal, 0.0)) * (1.0 - 1e-9))[wide].all()
    assert (low <= -(rim - np.maximum(-normal, 0.0)) * (1.0 - 1e-9))[wide].all()
    assert (high - low <= 2.4 * (rim + 1.0)).all()
    if axis == (0.0, 0.0, 1.0):
        assert (low[2], high[2]) == pytest.approx((0.0, 1.0), abs=0.02)
        particles = fill(scene, 100, speed=1.0)
        assert (particles.position[2] > 0.0).all()
    # Without the plane, or with it on the other side, it is open.
    assert Scene([cone]).is_open()
    assert Scene([cone, Plane(tuple(-normal), -1.0)]).is_open()


def test_a_cone_that_is_a_plane_to_round_off_is_refused():
    with pytest.raises(SceneError, match=r"half_angle must be at most pi/2 - 1e-12 rad, got .*use Plane"):
        Cone(0.5 * math.pi - 1e-13)


def test_many_planes_have_the_bounds_of_their_corners(monkeypatch):
    """More triples of planes than are intersected at once, against one corner after the other."""
    monkeypatch.setattr(room, "_TRIPLES", 100)
    normals = np.random.default_rng(2).normal(size=(24, 3))
    normals /= np.sqrt((normals**2).sum(axis=1))[:, None]
    corners = [np.linalg.solve(normals[list(three)], np.ones(3)) for three in itertools.combinations(range(24), 3)]
    corners = np.array([corner for corner in corners if (normals @ corner <= 1.0 + 1e-9).all()])
    bounds = Scene([Plane(tuple(normal), 1.0) for normal in normals]).bounds()
    assert bounds == (pytest.approx(corners.min(axis=0)), pytest.approx(corners.max(axis=0)))


def test_planes_that_are_parallel_but_for_a_subnormal_number_have_bounds():
    """Where they meet has no finite coordinates; filterwarnings makes a warning an error."""
    walls = [Plane((1.0, 2.2250738585072014e-308, 0.0), 0.3), Plane((-1.0, 0.0, 0.0), 0.3)]
    bounds = Scene(walls).bounds()
    assert bounds == ((-0.3, -math.inf, -math.inf), (0.3, math.inf, math.inf))
