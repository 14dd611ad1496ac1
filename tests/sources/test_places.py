"""Births are uniform in the area, or the volume, of their source, and their velocities have the law that is said."""

import math

import numpy as np
import pytest
from scipy import stats

import swarm
from swarm.sources.births import times_of, with_births
from swarm.surfaces.area_samples import points_of

N = 20_000
RANDOM = np.random.default_rng


def births(scene, source, seed=1, until=1.0):
    return with_births(scene, None, (source,), seed, until)


def uniform(values, low, high):
    """The p-value that values are uniform between two."""
    return stats.kstest(values, "uniform", (low, high - low)).pvalue


def as_likely(counts, parts):
    """The p-value that counts are in these proportions."""
    return stats.chisquare(counts, np.sum(counts) * np.array(parts) / np.sum(parts)).pvalue


def on(surface, n=N, **more):
    """Births on a surface that is the only one of a scene, from a count."""
    return births(swarm.Scene([surface], **more), swarm.Source(0, count=n, stop=1.0, speed=1.0))


def test_on_a_sphere_each_coordinate_is_uniform():
    """Archimedes: the area between two planes is that of the cylinder around."""
    for side in ("inside", "outside"):
        r = on(swarm.Sphere(0.5, center=(1.0, 2.0, 3.0), side=side)).position
        assert all(uniform(r[k], k + 0.5, k + 1.5) > 1e-3 for k in range(3))
        np.testing.assert_allclose(np.hypot(np.hypot(*(r[:2] - [[1.0], [2.0]])), r[2] - 3.0), 0.5, rtol=1e-14)


def test_by_lines_a_sphere_is_as_by_itself():
    """Those of Crofton, as a quadric."""
    r = on(swarm.Ellipsoid((0.5, 0.5, 0.5))).position
    assert all(uniform(r[k], -0.5, 0.5) > 1e-3 for k in range(3))


def test_on_an_ellipsoid_of_revolution_by_the_area_of_its_zones():
    a, c = 0.3, 0.8
    r = on(swarm.Ellipsoid((a, a, c), rotation={"axis": (1, 0, 0), "angle": math.pi / 2})).position
    z = np.linspace(-c, c, 4001)
    # dA/dz = 2 pi a sqrt(1 + (a^2/c^2 - 1) z^2/c^2)
    density = np.sqrt(1.0 + (a * a / (c * c) - 1.0) * (z / c) ** 2)
    below = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]))])
    place = np.interp(r[1], z, below / below[-1])
    assert uniform(place, 0.0, 1.0) > 1e-3


def test_on_a_box_by_the_areas_of_its_faces():
    half = np.array([0.5, 1.0, 1.5])
    for side in ("inside", "outside"):
        r = on(swarm.Box(half, side=side, rotation={"axis": (1, 1, 1), "angle": 2.0 * math.pi / 3.0})).position
        r = r[[1, 2, 0]]  # turned back
        faces = np.abs(np.abs(r) - half[:, None]) < 1e-12
        counts = [np.count_nonzero(faces[k] & (np.sign(r[k]) == sign)) for k in range(3) for sign in (-1, 1)]
        assert as_likely(counts, np.repeat(half.prod() / half, 2)) > 1e-3
        assert uniform(r[1][faces[0]], -1.0, 1.0) > 1e-3
        assert uniform(r[2][faces[0]], -1.5, 1.5) > 1e-3


@pytest.mark.parametrize("side", ["inside", "outside"])
def test_on_a_capped_cylinder_by_the_areas_of_wall_and_caps(side):
    r = on(swarm.Cylinder(0.5, axis=(1.0, 0.0, 0.0), length=3.0, side=side)).position
    caps = np.abs(np.abs(r[0]) - 1.5) < 1e-12
    assert as_likely([caps.sum(), (~caps).sum()], [2.0 * 0.25, 3.0]) > 1e-3
    assert uniform(r[0][~caps], -1.5, 1.5) > 1e-3
    assert uniform((r[1][caps] ** 2 + r[2][caps] ** 2), 0.0, 0.25) > 1e-3


def test_on_a_cone_and_a_paraboloid_by_the_area_of_rings():
    lid = swarm.Plane((0, 0, 1), 1.0)
    cone = births(swarm.Scene([swarm.Cone(0.5), lid]), swarm.Source(0, count=N, stop=1.0, speed=1.0)).position
    assert uniform(cone[2] ** 2, 0.0, 1.0) > 1e-3
    f = 0.25
    bowl = births(swarm.Scene([swarm.Paraboloid(f), lid]), swarm.Source(0, count=N, stop=1.0, speed=1.0)).position
    area = (1.0 + bowl[2] / f) ** 1.5 - 1.0
    assert uniform(area, 0.0, (1.0 + 1.0 / f) ** 1.5 - 1.0) > 1e-3


def test_on_a_torus_and_a_capsule():
    torus = on(swarm.Torus(1.0, 0.4, rotation={"axis": (1, 0, 0), "angle": math.pi / 2})).position
    rho, z = np.hypot(torus[0], torus[2]), torus[1]
    angle = np.arctan2(z, rho - 1.0)
    assert uniform(angle + 0.4 * np.sin(angle), -math.pi, math.pi) > 1e-3
    capsule = on(swarm.Capsule(0.5, length=2.0, axis=(0.0, 1.0, 0.0))).position
    assert uniform(capsule[1], -1.5, 1.5) > 1e-3  # Archimedes again


def test_on_a_mesh_by_the_areas_of_triangles():
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 2, 0], [0, 0, 3.0]])
    triangles = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    r = on(swarm.Mesh(corners, triangles)).position
    counts = [np.count_nonzero(np.abs(r[k]) < 1e-12) for k in (2, 1, 0)]
    slant = N - sum(counts)
    assert as_likely([*counts, slant], [1.0, 1.5, 3.0, 3.5]) > 1e-3


def test_on_an_outline_by_the_length_of_its_sides_and_on_lids_by_their_area():
    table = swarm.Stadium(radius=0.5, length=1.0)
    scene = swarm.Scene([table], plane="z")
    r = births(scene, swarm.Source(0, count=N, stop=1.0, speed=1.0)).position
    straight = np.abs(r[0]) < 0.5 - 1e-12
    assert as_likely([straight.sum(), (~straight).sum()], [2.0, math.pi]) > 1e-3
    np.testing.assert_array_equal(r[2], 0.0)
    prism = swarm.Prism([(0, 0), (1, 0), (0, 1)], height=2.0)
    r = on(prism).position
    lids = np.abs(np.abs(r[2]) - 1.0) < 1e-12
    assert as_likely([lids.sum(), (~lids).sum()], [1.0, 2.0 * (2.0 + math.sqrt(2.0))]) > 1e-3


def test_on_circles_in_a_plane_by_their_length():
    r = births(swarm.Scene([swarm.Sphere(0.5)], plane="y"), swarm.Source(0, count=N, stop=1.0, speed=1.0)).position
    assert uniform(np.arctan2(r[2], r[0]), -math.pi, math.pi) > 1e-3


def test_on_a_union_each_wall_once():
    """Two boxes that have a face, and parts of four others, in common: a box of twice the length."""
    left, right = (swarm.Box((0.75, 0.5, 0.5), center=(x, 0.0, 0.0)) for x in (-0.25, 0.25))
    r = on(swarm.Union([left, right])).position
    ends = np.abs(np.abs(r[0]) - 1.0) < 1e-12
    assert as_likely([ends.sum(), (~ends).sum()], [2.0, 8.0]) > 1e-3
    assert uniform(r[0][~ends], -1.0, 1.0) > 1e-3
    touching = [swarm.Box((0.5, 0.5, 0.5), center=(x, 0.0, 0.0)) for x in (-0.5, 0.5)]
    r = on(swarm.Union(touching)).position
    assert uniform(r[0][np.abs(r[0]) < 1.0 - 1e-9], -1.0, 1.0) > 1e-3


def test_no_place_is_on_a_face_that_two_parts_share():
    union = swarm.Union([swarm.Box((0.5, 0.5, 0.5), center=(x, 0.0, 0.0)) for x in (-0.5, 0.5)])
    r = on(union, 200).position
    assert np.max(np.abs(r) - [[1.0], [0.5], [0.5]], axis=0) == pytest.approx(np.zeros(200), abs=1e-12)


def test_on_many_bodies_by_their_areas():
    spheres = swarm.Spheres([(-0.5, 0, 0), (0.5, 0, 0)], [0.1, 0.2])
    scene = swarm.Scene([swarm.Box((1, 1, 1)), spheres])
    r = births(scene, swarm.Source(1, count=N, stop=1.0, speed=1.0)).position
    assert as_likely([(r[0] < 0).sum(), (r[0] > 0).sum()], [1.0, 4.0]) > 1e-3


def test_in_a_part_of_a_wall_at_an_opening_and_around_it():
    opening = swarm.Sphere(0.3, center=(0.0, 0.0, 0.5))
    box = swarm.Box((0.5, 0.5, 0.5), openings=[opening])
    scene = swarm.Scene([box])
    inside = births(scene, swarm.Source(opening, count=N, stop=1.0, speed=1.0))
    r = inside.position
    assert uniform(r[0] ** 2 + r[1] ** 2, 0.0, 0.09) > 1e-3
    assert np.ptp(r[2]) == 0.0
    assert (inside.velocity[2] < 0.0).all()
    around = births(scene, swarm.Source(0, count=N, stop=1.0, speed=1.0)).position
    top = np.abs(around[2] - 0.5) < 1e-12
    assert (around[0][top] ** 2 + around[1][top] ** 2 >= 0.09).all()
    assert as_likely([top.sum(), (~top).sum()], [1.0 - 0.09 * math.pi, 5.0]) > 1e-3
    patch = births(scene, swarm.Source(0, within=swarm.Sphere(0.2, (0.5, 0, 0)), count=N, stop=1.0, speed=1.0)).position
    assert uniform(patch[1] ** 2 + patch[2] ** 2, 0.0, 0.04) > 1e-3


def test_only_what_of_a_wall_is_in_the_vessel():
    scene = swarm.Scene([swarm.Sphere(1.0), swarm.Plane((0, 0, -1), 0.5)])
    r = births(scene, swarm.Source(1, count=N, stop=1.0, speed=1.0)).position
    assert uniform(r[0] ** 2 + r[1] ** 2, 0.0, 0.75) > 1e-3
    r = births(scene, swarm.Source(0, count=N, stop=1.0, speed=1.0)).position
    assert uniform(r[2], -0.5, 1.0) > 1e-3


def test_in_a_cell_that_repeats():
    scene = swarm.Scene([swarm.Sphere(0.3, center=(0.0, 0.5, 0.5), side="outside")], period=(1.0, 1.0, 1.0))
    made = births(scene, swarm.Source(0, count=N, stop=1.0, speed=1.0))
    r = made.position
    assert ((r >= 0.0) & (r < 1.0)).all()
    x = np.where(r[0] > 0.5, r[0] - 1.0, r[0])
    assert uniform(x, -0.3, 0.3) > 1e-3
    assert ((made.velocity * (np.array([x, r[1] - 0.5, r[2] - 0.5]))).sum(axis=0) >= 0.0).all()


def test_in_a_volume():
    scene = swarm.Scene([swarm.Box((1, 1, 1))])
    r = births(scene, swarm.Source(swarm.Sphere(0.5), volume=True, count=N, stop=1.0, temperature=1.0)).position
    assert uniform((r**2).sum(axis=0) ** 1.5, 0.0, 0.125) > 1e-3
    r = births(scene, swarm.Source(0, volume=True, count=N, stop=1.0, temperature=1.0)).position
    assert all(uniform(r[k], -1.0, 1.0) > 1e-3 for k in range(3))


# --- Velocities ------------------------------------------------------------------------------------------


def test_effusive_velocities():
    """Flux-weighted: the square of the normal speed is exponential, the others are normal."""
    scene, mass, heat = swarm.Scene([swarm.Box((1, 1, 1))]), 2.0, 3.0
    floor = swarm.Box((1.0, 1.0, 0.1), center=(0.0, 0.0, -1.0))
    v = births(scene, swarm.Source(0, within=floor, count=N, stop=1.0, temperature=heat, mass=mass)).velocity
    sides = swarm.Box((0.99, 0.99, 0.1), center=(0.0, 0.0, -1.0))
    v = births(scene, swarm.Source(0, within=sides, count=N, stop=1.0, temperature=heat, mass=mass)).velocity
    assert (v[2] > 0.0).all()
    assert stats.kstest(v[2] ** 2 * mass / (2.0 * heat), "expon").pvalue > 1e-3
    assert all(stats.kstest(v[k] * math.sqrt(mass / heat), "norm").pvalue > 1e-3 for k in (0, 1))


def test_one_speed_from_a_wall_has_the_cosine_law():
    made = on(swarm.Sphere(0.5))
    n = made.position / 0.5
    cosine = -(n * made.velocity).sum(axis=0)
    assert (cosine > 0.0).all()
    assert uniform(cosine**2, 0.0, 1.0) > 1e-3
    np.testing.assert_allclose((made.velocity**2).sum(axis=0), 1.0, rtol=1e-13)


def test_in_a_plane_the_cosine_law_and_effusion_are_of_two_dimensions():
    scene = swarm.Scene([swarm.Sphere(0.5)], plane="z")
    made = births(scene, swarm.Source(0, count=N, stop=1.0, speed=1.0))
    n = made.position / 0.5
    along = n[0] * made.velocity[1] - n[1] * made.velocity[0]
    assert uniform(along, -1.0, 1.0) > 1e-3
    assert (made.velocity[2] == 0.0).all()
    hot = births(scene, swarm.Source(0, count=N, stop=1.0, temperature=1.0))
    away = -(hot.position / 0.5 * hot.velocity).sum(axis=0)
    assert stats.kstest(away**2 / 2.0, "expon").pvalue > 1e-3


def test_from_a_volume_velocities_are_isotropic_or_maxwellian():
    scene = swarm.Scene([swarm.Sphere(0.5)])
    v = births(scene, swarm.Source(0, volume=True, count=N, stop=1.0, speed=2.0)).velocity
    assert all(uniform(v[k], -2.0, 2.0) > 1e-3 for k in range(3))
    v = births(scene, swarm.Source(0, volume=True, count=N, stop=1.0, temperature=4.0)).velocity
    assert all(stats.kstest(v[k] / 2.0, "norm").pvalue > 1e-3 for k in range(3))


def test_beams():
    scene = swarm.Scene([swarm.Sphere(0.5)])
    beam = np.array([0.0, 3.0, 4.0])
    v = births(scene, swarm.Source(0, volume=True, count=N, stop=1.0, beam=beam)).velocity
    np.testing.assert_array_equal(v, np.broadcast_to(beam[:, None], v.shape))
    v = births(scene, swarm.Source(0, volume=True, count=N, stop=1.0, beam=beam, divergence=0.3)).velocity
    assert uniform(beam @ v / 25.0, math.cos(0.3), 1.0) > 1e-3
    half = swarm.Sphere(0.4, (0.0, 0.0, -0.5))
    v = births(scene, swarm.Source(0, within=half, count=N, stop=1.0, beam=(0, 0, 1.0), divergence=1.5)).velocity
    np.testing.assert_allclose((v**2).sum(axis=0), 1.0, rtol=1e-13)


# --- Times -----------------------------------------------------------------------------------------------


def test_a_rate_is_a_poisson_process():
    source = swarm.Source(0, rate=2e4, speed=1.0, start=0.5, stop=1.5)
    times = times_of(source, RANDOM(1), 2.0)
    assert times[0] >= 0.5
    assert times[-1] < 1.5
    assert abs(len(times) - 2e4) < 5.0 * math.sqrt(2e4)
    assert stats.kstest(np.diff(times) * 2e4, "expon").pvalue > 1e-3
    # A longer run has the same first births.
    longer = times_of(swarm.Source(0, rate=2e4, speed=1.0, start=0.5), RANDOM(1), 3.0)
    np.testing.assert_array_equal(longer[: len(times)], times)


def test_other_times():
    even = swarm.Source(0, rate=4.0, even=True, speed=1.0, start=1.0)
    np.testing.assert_array_equal(times_of(even, RANDOM(1), 2.0), [1.0, 1.25, 1.5, 1.75, 2.0])
    ends = swarm.Source(0, rate=4.0, even=True, speed=1.0, start=1.0, stop=2.0)
    np.testing.assert_array_equal(times_of(ends, RANDOM(1), 2.0), [1.0, 1.25, 1.5, 1.75])
    np.testing.assert_array_equal(times_of(swarm.Source(0, times=[3, 1, 2], speed=1.0), RANDOM(1), 2.0), [1.0, 2.0])
    pulse = times_of(swarm.Source(0, count=N, start=1.0, stop=2.0, speed=1.0), RANDOM(1), 5.0)
    assert len(pulse) == N
    assert uniform(pulse, 1.0, 2.0) > 1e-3
    most = times_of(swarm.Source(0, rate=1e3, count=5, speed=1.0), RANDOM(1), 5.0)
    assert len(most) == 5
    at_once = times_of(swarm.Source(0, count=7, start=0.5, stop=0.5, speed=1.0), RANDOM(1), 5.0)
    np.testing.assert_array_equal(at_once, np.full(7, 0.5))


def test_evenly_spaced_births_fill_a_half_open_interval():
    """As many as rate times its length, however its ends are rounded; and none is of two intervals that meet."""
    for begin in range(30):
        for end in range(begin, 30):
            source = swarm.Source(0, rate=10.0, even=True, speed=1.0, start=begin / 10.0, stop=end / 10.0)
            assert len(times_of(source, RANDOM(1), 5.0)) == end - begin
    whole = swarm.Source(0, rate=300.0, even=True, speed=1.0, start=0.25)
    parts = [swarm.Source(0, rate=300.0, even=True, speed=1.0, start=a, stop=a + 0.25) for a in (0.25, 0.5, 0.75)]
    times = [times_of(one, RANDOM(1), 1.0) for one in parts]
    assert len(times_of(whole, RANDOM(1), 1.0)) == sum(map(len, times)) + 1 == 226


@pytest.mark.parametrize("start", [0.0, 1.0, 1e9])
def test_a_count_comes_before_its_stop(start):
    source = swarm.Source(0, count=10_000, start=start, stop=start + 1e-6, speed=1.0)
    times = times_of(source, RANDOM(1), 2e9)
    assert start <= times[0] <= times[-1] < source.stop


def test_each_source_has_streams_of_its_own_and_the_seed_decides():
    scene = swarm.Scene([swarm.Sphere(0.5)])
    source = swarm.Source(0, rate=100.0, temperature=1.0)
    one, two = (with_births(scene, None, (source,) * k, 1, 1.0) for k in (1, 2))
    mine = two.births.source == 0
    np.testing.assert_array_equal(one.position, two.position[:, mine])
    np.testing.assert_array_equal(one.births.time, two.births.time[mine])
    other = with_births(scene, None, (source,), 2, 1.0)
    assert len(other) != len(one) or (other.position != one.position).any()
    assert (np.diff(two.births.time) >= 0.0).all()


def test_samples_of_two_kinds_in_proportion():
    """A prism's sides and lids, drawn as they are, and a plane by lines, in one list."""
    bounds = np.full(3, -0.5), np.full(3, 0.5)
    flat = swarm.Plane((0, 0, 1), 0.0).area_samples(bounds, None)
    ball = swarm.Sphere(0.25, (0, 0, 0.3)).area_samples(bounds, None)
    points = points_of([*flat, *ball], RANDOM(1), 100_000)
    on_plane = (np.abs(points[2]) < 1e-12) & (np.abs(points[:2]) < 0.3).all(axis=0)
    on_ball = np.abs(np.sqrt((points[:2] ** 2).sum(axis=0) + (points[2] - 0.3) ** 2) - 0.25) < 1e-12
    assert as_likely([on_plane.sum(), on_ball.sum()], [0.36, math.pi / 4.0]) > 1e-3


@pytest.mark.parametrize("side", ["inside", "outside"])
def test_on_a_mesh_where_it_is_in_the_scene(side):
    """Not where its file has it."""
    corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    turn = {"axis": (1.0, 2.0, 3.0), "angle": 1.0}
    mesh = swarm.Mesh(corners, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], side, (3.0, -4.0, 5.0), rotation=turn)
    scene = swarm.Scene([mesh, swarm.Sphere(20.0)])
    r = births(scene, swarm.Source(0, count=200, stop=1.0, speed=1.0)).position
    assert np.abs(mesh.phi(r)).max() < 1e-13
