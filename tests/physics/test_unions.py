"""Unions: flights against brute force, mean free paths, energy, slides off their walls, laws and motions of parts."""

import math

import numpy as np
import pytest
from energy_books import unbooked

import swarm
from swarm.surfaces.instant import side_of

# Places of a flight that are looked at by brute force, and halvings down to its end.
PLACES, HALVINGS = 1000, 60


def a_part(random, center):
    """A cavity of any kind about a place, of the size of 1 m."""
    center, axis = tuple(center.tolist()), tuple(random.normal(size=3).tolist())
    turn = {"axis": axis, "angle": float(random.uniform(0.0, 3.0))}
    a, b, c = random.uniform(0.25, 0.6, 3).tolist()
    return [
        lambda: swarm.Sphere(a, center),
        lambda: swarm.Ellipsoid((a, b, c), center, rotation=turn),
        lambda: swarm.Box((a, b, c), center, rotation=turn),
        lambda: swarm.Box((a, b, c), center),
        lambda: swarm.Cylinder(a, axis, 2.0 * b, center),
        lambda: swarm.Capsule(0.7 * a, b, axis, center),
        lambda: swarm.Torus(0.5 + 0.3 * a, 0.2, center, rotation=turn),
        lambda: swarm.Intersection([swarm.Sphere(a + 0.1, center), swarm.Sphere(0.12, center, side="outside")]),
    ][random.integers(8)]()


def a_union(seed):
    """Two to five parts, each near one of before; some with a hole."""
    random = np.random.default_rng([42, seed])
    parts, places = [], [np.zeros(3)]
    for _part in range(random.integers(2, 6)):
        parts.append(a_part(random, places[-1]))
        places.append(places[random.integers(len(places))] + random.uniform(-0.5, 0.5, 3))
    union = swarm.Union(parts)
    if random.random() < 0.5:
        return swarm.Intersection([union, swarm.Cylinder(0.08, (0.3, 0.2, 1.0), center=(0.1, 0, 0), side="outside")])
    return union


def gap(union, points):
    return side_of(union) * union.phi(points)


def ends_of(union, r, v, longest):
    """When straight flights (3, N) leave a union, by looking at many places of each; infinite: not before the longest.

    The second array says of which that is sure: along the others the gap comes near 0 between two places.
    """
    step = longest / PLACES
    times = step * np.arange(1, PLACES + 1)
    count = r.shape[1]
    ends, sure, before = np.full(count, math.inf), np.zeros(count, bool), np.zeros(count)
    for i in range(count):
        gaps = gap(union, r[:, i : i + 1] + v[:, i : i + 1] * times)
        out = np.flatnonzero(gaps > 0.0)
        k = max(out[0], 1) if out.size else PLACES - 1
        peaks = np.flatnonzero((gaps[1:k] >= gaps[: k - 1]) & (gaps[1:k] >= gaps[2 : k + 1])) + 1
        # What is out for a place or two may have been out before, and an end at a grazing angle is round-off.
        out_for_long = (gaps[k : k + 2] > 0.0).all() and gaps[k] - gaps[k - 1] > 0.2 * step
        sure[i] = (gaps[peaks] < -4.0 * step).all() and gaps[0] < -4.0 * step and (out_for_long or not out.size)
        if out.size:
            ends[i], before[i] = times[k], times[k] - step
    met = ends < math.inf
    low, high = before[met], ends[met]
    for _half in range(HALVINGS):
        middle = 0.5 * (low + high)
        outside = gap(union, r[:, met] + v[:, met] * middle) > 0.0
        low, high = np.where(outside, low, middle), np.where(outside, middle, high)
    ends[met] = high
    return ends, sure


def first_impacts(scene, start, longest, folder, **options):
    """When each particle meets a wall for the first time; infinite where it does not."""
    path = folder / "impacts.h5"
    swarm.simulate(scene, start, swarm.Impact(), until=longest, every=longest, threads=1, impacts=path, **options)
    rows = swarm.load_impacts(path).table()
    found = np.full(start.mass.size, math.inf)
    np.minimum.at(found, rows["particle"], rows["time"])
    return found


def holds(seed, count, folder, **options):
    union = a_union(seed)
    scene = swarm.Scene([union])
    start = swarm.fill(scene, count, speed=1.0, seed=seed)
    ends, sure = ends_of(union, start.position, start.velocity, 2.0)
    found = first_impacts(scene, start, 2.0, folder, **options)
    assert sure.mean() > 0.6
    assert found[sure] == pytest.approx(ends[sure], abs=1e-11)


@pytest.mark.parametrize("seed", range(10))
def test_flights_end_where_brute_force_says(seed, tmp_path):
    """In ten random unions, with holes."""
    holds(seed, 30, tmp_path, compile="never")


@pytest.mark.long
@pytest.mark.parametrize("seed", range(10))
def test_ten_thousand_flights_end_where_brute_force_says(seed, tmp_path):
    holds(seed, 10_000, tmp_path)


@pytest.mark.physics
@pytest.mark.parametrize("seed", range(10))
def test_the_mean_free_path_is_four_volumes_an_area(seed):
    """Of balls and boxes at random, whose area is known by points on each that are in no other."""
    random = np.random.default_rng([43, seed])
    parts = []
    # A ball and a box, or two and three: two kinds.
    for is_ball in ((True, False), (True, False, False, True, False))[seed % 2]:
        center = tuple(random.uniform(-0.4, 0.4, 3).tolist())
        if is_ball:
            parts.append(swarm.Sphere(float(random.uniform(0.3, 0.5)), center))
        else:
            parts.append(swarm.Box(tuple(random.uniform(0.2, 0.5, 3).tolist()), center))
    hole = swarm.Sphere(0.1, parts[0].center, side="outside")
    union = swarm.Intersection([swarm.Union(parts), hole])
    scene = swarm.Scene([union])
    start = swarm.fill(scene, 2500, speed=1.0, seed=seed)
    until = 200.0
    result = swarm.simulate(scene, start, swarm.Impact(), until=until, every=until, threads=1)
    impacts = result.impacts_per_particle
    area, spread = _area(parts, hole, random)
    low, high = (np.array(corner)[:, None] for corner in union.bounds())
    points = low + (high - low) * random.random((3, 200_000))
    part = (union.phi(points) <= 0.0).mean()
    volume = np.prod(high - low) * part
    expected, found = area / (4.0 * volume), impacts.mean() / until
    error = math.hypot(
        impacts.std() / math.sqrt(impacts.size) / until,
        expected * math.hypot(spread / area, math.sqrt((1.0 - part) / part / points.shape[1])),
    )
    assert abs(found - expected) <= 3.0 * error
    assert error <= 0.01 * expected
    energy = result.observables["total_energy"]
    assert energy[-1] == pytest.approx(energy[0], rel=1e-13)
    assert result.observables["max_penetration"].max() <= 1e-13


def _area(parts, hole, random, n=100_000):
    """(area, its standard error) of the parts as far as they are in no other, and of the hole."""
    area, variance = 0.0, 0.0
    for one in (*parts, hole):
        if isinstance(one, swarm.Sphere):
            d = random.normal(size=(3, n))
            points = np.array(one.center)[:, None] + one.radius * d / np.sqrt((d**2).sum(axis=0))
            whole = 4.0 * math.pi * one.radius**2
        else:
            half = np.array(one.half_widths)
            faces = np.array([half[1] * half[2], half[2] * half[0], half[0] * half[1]])
            axis = random.choice(3, n, p=faces / faces.sum())
            points = half[:, None] * random.uniform(-1.0, 1.0, (3, n))
            points[axis, np.arange(n)] = half[axis] * random.choice([-1.0, 1.0], n)
            points += np.array(one.center)[:, None]
            whole = 8.0 * faces.sum()
        others = [other for other in parts if other is not one]
        covered = np.any([other.phi(points) < 0.0 for other in others], axis=0) if others else np.zeros(n, bool)
        free = covered if one is hole else ~covered & (hole.phi(points) > 0.0)
        area += whole * free.mean()
        variance += whole**2 * free.mean() * (1.0 - free.mean()) / n
    return area, math.sqrt(variance)


# --- Slides ----------------------------------------------------------------------------------------------


def frames_of(surfaces, position, velocity, until, every, folder, gravity=(0.0, 0.0, -9.81)):
    """(scene, result, positions, velocities) of a run, the last two (frames, 3, N)."""
    scene = swarm.Scene(surfaces, gravity)
    start = swarm.Particles(np.array(position, float).T, np.array(velocity, float).T)
    folder.mkdir(exist_ok=True)
    path = folder / "run.h5"
    result = swarm.simulate(scene, start, swarm.Impact(), until=until, every=every, trajectory=path, threads=1)
    with swarm.load(path) as run:
        frames = [run.frame(k) for k in range(len(run.times))]
        return scene, result, np.array([f.position for f in frames]), np.array([f.velocity for f in frames])


FLOOR = swarm.Box((1.0, 0.5, 0.5))


def test_what_slides_on_one_floor_slides_on_on_that_of_the_next_room(tmp_path):
    """Two boxes with one floor: no edge is felt between them, and friction is that of each."""
    rough = swarm.Box((1.0, 0.3, 0.7), (1.5, 0.0, 0.2), friction=0.1)
    _scene, result, x, v = frames_of(
        [swarm.Union([FLOOR, rough])], [[-0.5, 0.0, -0.5]], [[1.0, 0.0, 0.0]], 2.5, 0.1, tmp_path
    )
    t = np.arange(26) * 0.1
    # At x = 1 the first floor ends: from there on the second one brakes.
    braked = np.clip(t - 1.5, 0.0, None)
    speed = np.clip(1.0 - 0.981 * braked, 0.0, None)
    assert v[:, 0, 0] == pytest.approx(speed, abs=1e-9)
    assert x[:, 2, 0] == pytest.approx(-0.5, abs=1e-12)
    assert result.observables["impacts"][-1] == 0


def test_what_slides_over_an_edge_falls(tmp_path):
    """A step down from one box into a deeper one: a parabola from the edge on."""
    deep = swarm.Box((1.0, 0.3, 1.5), (1.5, 0.0, 0.0))
    _scene, result, x, _v = frames_of(
        [swarm.Union([FLOOR, deep])], [[-0.5, 0.0, -0.5]], [[1.0, 0.0, 0.0]], 1.4, 0.1, tmp_path
    )
    t = np.arange(15) * 0.1
    fallen = np.clip(t - 1.0, 0.0, None)
    assert x[:, 0, 0] == pytest.approx(-0.5 + t, abs=1e-11)
    assert x[:, 2, 0] == pytest.approx(-0.5 - 0.5 * 9.81 * fallen**2, abs=1e-11)
    assert result.observables["sliding_time"][-1] == pytest.approx(1.0, abs=1e-10)


def test_what_slides_against_the_wall_of_its_room_stops_there(tmp_path):
    """The next room begins above the floor: its opening is no way for what slides below."""
    high = swarm.Box((1.0, 0.3, 0.3), (1.5, 0.0, 0.1))
    _scene, result, x, v = frames_of(
        [swarm.Union([FLOOR, high])], [[0.5, 0.0, -0.5]], [[1.0, 0.0, 0.0]], 1.0, 0.1, tmp_path
    )
    assert x[:, 0, 0].max() <= 1.0 + 1e-12
    assert v[-1, 0, 0] == pytest.approx(-1.0, abs=1e-12)
    assert result.observables["impacts"][-1] == 1


def test_rooms_with_a_common_face_are_one(tmp_path):
    """For what flies and for what slides; a door in the face, here one that is shut, keeps them apart."""
    next_one = swarm.Box((1.0, 0.5, 0.5), (2.0, 0.0, 0.0))
    rows = [[0.5, 0.0, -0.5], [0.5, 0.1, 0.1], [1.5, 0.1, 0.1], [1.5, 0.0, -0.5]]
    pace = [[1.0, 0.0, 0.0], [1.0, 0.1, 0.2], [-1.0, 0.1, 0.2], [-1.0, 0.0, 0.0]]
    _scene, _result, x, _v = frames_of([swarm.Union([FLOOR, next_one])], rows, pace, 5.0, 0.1, tmp_path)
    _scene, _result, whole, _v = frames_of(
        [swarm.Box((2.0, 0.5, 0.5), (1.0, 0.0, 0.0))], rows, pace, 5.0, 0.1, tmp_path / "whole"
    )
    assert x[..., [0, 3]] == pytest.approx(whole[..., [0, 3]], abs=1e-9)
    assert x[:20] == pytest.approx(whole[:20], abs=1e-9)
    door = swarm.Opening(swarm.Box((0.1, 0.1, 0.1), (1.0, 0.0, 0.0)), times=[(9.0, 10.0)], between=True)
    _scene, _result, x, v = frames_of(
        [swarm.Union([FLOOR, next_one], openings=[door])], rows, pace, 5.0, 0.1, tmp_path / "apart"
    )
    assert (x[:, 0, :2] <= 1.0 + 1e-12).all()
    assert (x[:, 0, 2:] >= 1.0 - 1e-12).all()
    assert (v[:, 0, 0] < 0.0).any()
    assert (v[:, 0, 3] > 0.0).any()


def test_a_hopper_empties_and_what_was_in_it_rests(tmp_path):
    """A ball with a tube at its bottom, friction and restitution: everything ends at the bottom of the tube."""
    law = {"friction": 0.05, "restitution": 0.5}
    hopper = swarm.Union([swarm.Sphere(0.5), swarm.Cylinder(0.1, (0.0, 0.0, 1.0), 1.0, (0.0, 0.0, -0.8))], **law)
    scene = swarm.Scene([hopper], (0.0, 0.0, -9.81))
    start = swarm.fill(scene, 5, speed=1.0, seed=3)
    path = tmp_path / "run.h5"
    result = swarm.simulate(
        scene, start, swarm.Impact(), until=30.0, every=5.0, trajectory=path, threads=1, compile="never"
    )
    assert result.particles.position[2] == pytest.approx(-1.3, abs=1e-9)
    assert np.abs(result.particles.velocity).max() <= 1e-9
    seen = result.observables
    assert unbooked(seen) <= 1e-10 * abs(seen["total_energy"][0])
    assert seen["max_penetration"].max() <= 1e-12


# --- Laws, motions, openings of parts --------------------------------------------------------------------


def test_every_part_has_its_law(tmp_path):
    """A law is that of the part whose wall it is; the log says which."""
    left, right = swarm.Box((1.0, 0.5, 0.5), restitution=0.5), swarm.Box((1.0, 0.3, 0.3), (1.5, 0.0, 0.0))
    _scene, _result, _x, v = frames_of(
        [swarm.Union([left, right])], [[0.0, 0.0, 0.0]], [[1.0, 0.0, 0.0]], 8.0, 1.0, tmp_path, gravity=None
    )
    # At 2.5 s the far wall of the right one, at 6 s that of the left one.
    assert v[:, 0, 0] == pytest.approx([1, 1, 1, -1, -1, -1, 0.5, 0.5, 0.5], abs=1e-12)


def test_a_piston_in_a_part(tmp_path):
    """Only a part moves: what it hits has its speed."""
    moving = swarm.Intersection(
        [
            swarm.Cylinder(0.2, (1, 0, 0), 2.0, (1, 0, 0)),
            swarm.Plane((1, 0, 0), 1.8, motion=swarm.Translation((-0.1, 0, 0))),
        ]
    )
    _scene, _result, x, v = frames_of(
        [swarm.Union([swarm.Sphere(0.5), moving])],
        [[0.0, 0.0, 0.0]],
        [[1.0, 0.0, 0.0]],
        3.0,
        0.5,
        tmp_path,
        gravity=None,
    )
    met = 1.8 / 1.1
    assert v[-1, 0, 0] == pytest.approx(-1.2, abs=1e-12)
    t = np.arange(7) * 0.5
    assert x[:4, 0, 0] == pytest.approx(t[:4], abs=1e-12)
    assert x[4, 0, 0] == pytest.approx(met - 1.2 * (2.0 - met), abs=1e-11)


@pytest.mark.parametrize("motion", [swarm.Translation((0.3, 0.1, 0.0)), swarm.Oscillation((0.2, 0.0, 0.0), 0.5)])
def test_a_union_moves_as_a_whole(motion):
    union = swarm.Union([swarm.Sphere(0.5), swarm.Cylinder(0.2, (1.0, 0.0, 0.0), 2.0, (1.0, 0.0, 0.0))], motion=motion)
    scene = swarm.Scene([union])
    start = swarm.fill(scene, 20, speed=1.0, seed=1)
    result = swarm.simulate(scene, start, swarm.Impact(), until=3.0, every=3.0, threads=1, compile="never")
    assert gap_at(union, result.particles.position, 3.0).max() <= 1e-12
    assert result.observables["impacts"][-1] > 20


def gap_at(union, points, time):
    return side_of(union) * union.phi(points, time)


def test_an_opening_is_in_the_wall_of_a_part():
    hole = swarm.Sphere(0.2, (2.0, 0.0, 0.0))
    tube = swarm.Cylinder(0.2, (1.0, 0.0, 0.0), 2.0, (1.0, 0.0, 0.0), openings=[hole])
    scene = swarm.Scene([swarm.Union([swarm.Sphere(0.5), tube])])
    start = swarm.fill(scene, 100, speed=1.0, seed=1)
    result = swarm.simulate(scene, start, swarm.Impact(), until=200.0, every=200.0, threads=1, compile="always")
    gone = ~np.isnan(result.escape_time)
    assert gone.sum() > 30
    assert result.particles.position[0, gone] == pytest.approx(2.0, abs=0.03)


def test_other_methods_say_that_they_know_no_unions():
    scene = swarm.Scene([swarm.Union([swarm.Sphere(0.5), swarm.Sphere(0.5, (0.5, 0.0, 0.0))])])
    start = swarm.fill(scene, 2, speed=1.0)
    with pytest.raises(swarm.SceneError, match=r"surfaces\[0\] must not be a Union of several rooms with"):
        swarm.simulate(scene, start, swarm.Verlet(1e-3, 1e6), until=1.0, every=1.0)
    with pytest.raises(swarm.SceneError, match=r"surfaces\[0\] must be one wall for a single"):
        swarm.contact_history(scene, (0.1, 0.1, 0.0), (0.3, 0.4, 0.0), 1.0, swarm.Impact(contact_step=1e-3))
