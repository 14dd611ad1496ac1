"""Openings: volumes inside which a wall is not there, through which particles escape."""

import dataclasses
import math
from types import SimpleNamespace

import numpy as np
import pytest
from conftest import rarely
from test_sessions import require_resumed_is_whole

import swarm
from swarm.contact import absence
from swarm.contact.events import ARRIVED, CAREFUL
from swarm.kernel.vector import Vec
from swarm.lanes import careful
from swarm.run.engine import Run

HOLE = swarm.Sphere(0.05, center=(0.0, 0.0, 0.5))


def run(scene, particles, until=4.0, frames=8, **options):
    options = {"compile": "never", **options}
    method = options.pop("method", swarm.Impact())
    return swarm.simulate(scene, particles, method, until=until, every=until / frames, **options)


def thrown(position, velocity):
    return swarm.Particles(np.array(position, dtype=float).T, np.array(velocity, dtype=float).T)


# --- In flight -------------------------------------------------------------------------------------------


def test_one_particle_escapes_when_and_where_it_reaches_the_opening():
    scene = swarm.Scene([swarm.Sphere(0.5, openings=[swarm.Sphere(0.05, center=(0.0, 0.0, 0.5))])])
    # The second one passes beside the opening, and comes back along the diameter.
    found = run(scene, thrown([(0, 0, 0.1), (0.1, 0, 0)], [(0, 0, 0.8), (1.0, 0, 0)]))
    assert found.escape_time[0] == pytest.approx(0.4 / 0.8, rel=1e-15)
    assert math.isnan(found.escape_time[1])
    assert found.particles.position[:, 0].tolist() == pytest.approx([0.0, 0.0, 0.5], rel=1e-15)
    assert found.particles.velocity[:, 0].tolist() == [0.0, 0.0, 0.8]
    # The frame at the instant itself is that of the escape.
    assert found.observables["escaped"].tolist() == [0, 1, 1, 1, 1, 1, 1, 1, 1]
    assert found.impacts_per_particle.tolist() == [0, 4]
    assert found.observables["total_energy"].tolist() == [0.5 * (0.64 + 1.0)] * 9


def test_particles_escape_at_the_opening_alone():
    scene = swarm.Scene([swarm.Sphere(0.5, openings=[HOLE])])
    found = run(scene, swarm.fill(scene, 200, speed=1.0, seed=1), until=10.0)
    out, r = ~np.isnan(found.escape_time), found.particles.position
    assert 5 < out.sum() == found.observables["escaped"][-1] < 50
    assert np.abs(np.sqrt((r[:, out] ** 2).sum(axis=0)) - 0.5).max() < 1e-15
    assert (HOLE.phi(r[:, out]) <= 0.0).all()
    assert (r[:, out] * found.particles.velocity[:, out]).sum(axis=0).min() > 0.0
    assert found.observables["max_penetration"].max() < 1e-15
    assert found.observables["energy_error"].max() < 1e-14
    assert (np.diff(found.observables["escaped"]) >= 0).all()
    # Until then they fly as they would without: those that stay have the same bits.
    whole = run(swarm.Scene([swarm.Sphere(0.5)]), swarm.fill(scene, 200, speed=1.0, seed=1), until=10.0)
    for name in ("position", "velocity"):
        assert (getattr(found.particles, name)[:, ~out] == getattr(whole.particles, name)[:, ~out]).all()


# --- Along walls -----------------------------------------------------------------------------------------

VOLUMES = {
    "ball": swarm.Sphere(0.1, center=(0.5, 0.0, -0.5)),
    "balls": swarm.Spheres([(0.5, 0.0, -0.5), (1.5, 1.0, -0.5)], [0.1, 0.2]),
    "formula": swarm.Formula("x**2 + y**2 + z**2 - 0.01", center=(0.5, 0.0, -0.5), bounds=((-0.2,) * 3, (0.2,) * 3)),
}


@pytest.mark.parametrize("volume", VOLUMES.values(), ids=VOLUMES)
@pytest.mark.parametrize("tolerance", [1e-9, 1e-3])
def test_a_particle_that_slides_into_an_opening_leaves_at_its_edge(volume, tolerance):
    y = np.array([0.0, 0.05, 0.0999, 0.0999999, 0.1001, -0.02])
    start = np.array([0.0 * y - 0.3, y, 0.0 * y - 0.5]), np.array([0.0 * y + 1.0, 0.0 * y, 0.0 * y])
    scene = swarm.Scene([swarm.Box((2.0, 2.0, 0.5), openings=[volume])], gravity=(0.0, 0.0, -9.81))
    found = run(scene, swarm.Particles(*start), 1.5, 3, method=swarm.Impact(sliding_tolerance=tolerance))
    edge = np.where(np.abs(y) < 0.1, 0.8 - np.sqrt(np.maximum(0.01 - y**2, 0.0)), np.nan)
    # Where a way meets the edge at an angle, round-off moves the place by more.
    assert np.allclose(found.escape_time, edge, rtol=0.0, atol=1e-12, equal_nan=True)
    out = ~np.isnan(edge)
    assert np.allclose(found.particles.position[0, out], edge[out] - 0.3, rtol=0.0, atol=1e-12)
    assert (found.particles.position[2] == -0.5).all()
    assert found.observables["sliding"].tolist() == [0, 6, 1, 1]
    assert found.observables["energy_error"].max() < 1e-14


def test_in_a_round_vessel_a_slide_ends_at_the_rim():
    """From rest at the height of the centre down a bowl, into a hole whose rim is at an angle of 0.2 at the bottom."""
    rim = 2.0 * 0.5 * math.sin(0.1)
    bowl = swarm.Sphere(0.5, openings=[swarm.Sphere(rim, center=(0.0, 0.0, -0.5))])
    scene = swarm.Scene([bowl], gravity=(0.0, 0.0, -9.81))
    found = run(scene, thrown([(0.5, 0.0, 0.0), (0.0, -0.5, 0.0)], [(0, 0, -1e-9), (0, 0, -1e-9)]), 1.0, 4)
    # A quarter of a turn less the angle: the pendulum's elliptic integral, F(asin(sin(a/2)/k), k)-like.
    angle = np.linspace(0.0, 0.5 * math.pi, 400_001)[1:]
    fall = (angle[1] - angle[0]) / np.sqrt(2.0 * 9.81 * np.sin(angle) / 0.5)
    # The first part, where sin a is about a, in closed form
    first = 2.0 * math.sqrt(angle[0] * 0.5 / (2.0 * 9.81))
    at_rim = np.searchsorted(angle, 0.5 * math.pi - 0.2)
    exact = first + (fall[: at_rim + 1].sum() - 0.5 * (fall[0] + fall[at_rim]))
    assert np.abs(found.escape_time - exact).max() < 2e-5
    depth = 0.5 * math.cos(0.2)
    assert np.abs(found.particles.position[2] + depth).max() < 1e-9
    assert np.abs(np.sqrt((found.particles.velocity**2).sum(axis=0)) - math.sqrt(2.0 * 9.81 * depth)).max() < 1e-9


def test_a_slide_ends_at_another_wall_where_that_is_open():
    side = swarm.Plane((1.0, 0.0, 0.0), 0.5, openings=[swarm.Sphere(0.1, center=(0.5, 0.0, 0.0))])
    scene = swarm.Scene([swarm.Plane((0.0, 0.0, -1.0)), side, swarm.Sphere(10.0)], gravity=(0.0, 0.0, -9.81))
    found = run(scene, thrown([(0.0, 0.05, 0.0), (0.0, 0.15, 0.0)], [(1.0, 0.0, 0.0), (1.0, 0.0, 0.0)]), 1.0, 4)
    assert found.escape_time[0] == pytest.approx(0.5, abs=1e-12)
    assert found.particles.position[:, 0] == pytest.approx([0.5, 0.05, 0.0], abs=1e-12)
    assert found.particles.velocity[:, 0] == pytest.approx([1.0, 0.0, 0.0], abs=1e-12)
    assert np.isnan(found.escape_time[1])
    assert found.particles.velocity[0, 1] == pytest.approx(-1.0)


def test_along_an_edge_the_opening_of_either_wall_lets_out():
    """A groove of two planes; the opening is only of the second one."""
    left = swarm.Plane((-1.0, 0.0, -1.0), 0.0)
    right = swarm.Plane((1.0, 0.0, -1.0), 0.0, openings=[swarm.Sphere(0.25, center=(0.0, 1.0, 0.0))])
    scene = swarm.Scene([left, right, swarm.Sphere(10.0)], gravity=(0.0, 0.0, -1.0))
    found = run(scene, thrown([(0.0, 0.0, 0.0), (0.0, 0.0, 0.0)], [(0, 1.0, 0), (0, -1.0, 0)]), 1.0, 2)
    assert found.escape_time[0] == pytest.approx(0.75, abs=1e-12)
    assert np.isnan(found.escape_time[1])
    assert found.observables["sliding"].tolist() == [0, 2, 1]


def test_what_several_walls_hold_leaves_where_one_of_them_is_open():
    """The careful way looks at the place where each of its short steps begins."""
    corner = swarm.Box((1.0, 1.0, 1.0), openings=[swarm.Sphere(0.1, center=(1.0, 1.0, -1.0))])
    scene = swarm.Scene([corner], gravity=(0.2, 0.2, -1.0))
    start = thrown([(1.0, 1.0, -1.0), (1.0, 0.5, -1.0)], [(0.0, 0.1, 0.0), (0.0, 0.1, 0.0)])
    with Run(scene.compiled(), start, swarm.Impact(), 1, None, "never") as held:
        held._moment = 3.0
        share = held._shared(1.0, held._drawing())
        share.phase[:] = CAREFUL
        held.state.contacts.remaining[:], held.state.contacts.met[:] = 0.75, 0.0
        with np.errstate(all="ignore"):
            for p in (0, 1):
                careful._step(held._numbers, held._walls, held._gravity, share, p)
        assert held.state.escape_time[0] == 2.25
        assert np.isnan(held.state.escape_time[1])
        assert share.phase[0] == ARRIVED
        # Its step is a short one, although it might glide on for as long as it likes.
        assert 0.5 < held.state.position[1, 1] < 0.501


# --- Two walls at one place ------------------------------------------------------------------------------

RIM, OTHER_RIM = swarm.Sphere(0.3, center=(0.5, 0.0, 0.0)), swarm.Sphere(0.3, center=(0.5, 0.3, 0.0))
ROUND = swarm.Slab((0, 1, 0), 1.0), swarm.Slab((0, 0, 1), 1.0), swarm.Plane((-1, 0, 0), 1.0)


def two_planes(gap, *openings):
    return [swarm.Plane((1, 0, 0), 0.5 + at, openings=given) for at, given in zip((0.0, gap), openings, strict=True)]


def two_balls(gap, *openings):
    return [swarm.Sphere(0.5 + at, openings=given) for at, given in zip((0.0, gap), openings, strict=True)]


def box_and_plane(gap, *openings):
    return [swarm.Box((0.5, 1.0, 1.0), openings=openings[0]), swarm.Plane((1, 0, 0), 0.5 + gap, openings=openings[1])]


@pytest.mark.parametrize("gap", [0.0, 1e-16, -1e-16, 1e-12, -1e-12])
@pytest.mark.parametrize("pair", [two_planes, two_balls, box_and_plane])
def test_a_closed_wall_closes_the_opening_of_another_at_its_place(pair, gap):
    """Whichever comes first in the list; what both let out they let out at the same time."""
    random = np.random.default_rng(1)
    start = swarm.Particles(random.uniform(-0.25, 0.25, (3, 40)), random.normal(size=(3, 40)))
    cases = {"closed": ([RIM], []), "either": ([], [RIM]), "both": ([RIM], [RIM]), "partly": ([RIM], [OTHER_RIM])}
    times = {}
    for case, openings in cases.items():
        walls = pair(gap, *openings)
        found, turned = (run(swarm.Scene([*order, *ROUND]), start, 6.0, 1) for order in (walls, walls[::-1]))
        for name in ("position", "velocity"):
            one, other = getattr(found.particles, name), getattr(turned.particles, name)
            np.testing.assert_allclose(one, other, atol=1e-10, err_msg=case)
        np.testing.assert_allclose(found.escape_time, turned.escape_time, rtol=1e-11, err_msg=case)
        assert (found.impacts_per_particle == turned.impacts_per_particle).all()
        assert found.observables["max_penetration"].max() <= 1e-15
        times[case] = found.escape_time
        out = found.particles.position[:, ~np.isnan(found.escape_time)]
        for volumes in openings:
            assert all((volume.phi(out) <= 1e-11).all() for volume in volumes)
    assert np.isnan(times["closed"]).all()
    assert np.isnan(times["either"]).all()
    assert 0 < (~np.isnan(times["partly"])).sum() < (~np.isnan(times["both"])).sum()


def test_at_the_edge_of_an_open_and_a_closed_wall_order_does_not_count():
    """The way goes right into the edge: it bounces off the closed wall, and leaves through the open one."""
    walls = [swarm.Plane((1, 0, 0), 0.5, openings=[RIM]), swarm.Plane((0, 1, 0), 0.0)]
    start = thrown([(0.25, -0.25, 0.0)], [(1.0, 1.0, 0.0)])
    found = [run(swarm.Scene([*order, *ROUND]), start, 1.0, 1) for order in (walls, walls[::-1])]
    for one in found:
        assert one.escape_time[0] == 0.25
        assert one.particles.velocity[:, 0].tolist() == [1.0, -1.0, 0.0]
        assert one.impacts_per_particle.tolist() == [1]


@pytest.mark.parametrize("order", [1, -1])
def test_a_slide_goes_over_an_opening_that_another_wall_closes(order):
    """Along a floor of two walls with openings from x = 0.5 and from x = 0.6: it leaves where both are open."""
    floors = [
        swarm.Plane((0, 0, -1), 0.5, openings=[swarm.Sphere(0.5, center=(at + 0.5, 0.0, -0.5))]) for at in (0.5, 0.6)
    ]
    scene = swarm.Scene([*floors[::order], swarm.Sphere(10.0)], gravity=(0.0, 0.0, -1.0))
    found = run(scene, thrown([(0.0, 0.0, -0.5)], [(1.0, 0.0, 0.0)]), 1.0, 2)
    assert found.escape_time[0] == pytest.approx(0.6, abs=1e-10)
    assert found.particles.position[:, 0] == pytest.approx([0.6, 0.0, -0.5], abs=1e-10)


# --- What openings are of, and what covers them ----------------------------------------------------------


def reflected(gaps, hits, normals, r, v, until, opened):
    """Brute force: where and when one particle escapes, wall by wall; `opened` are (wall, whether a place is open)."""
    time = 0.0
    while True:
        ahead = [hit(r, v) for hit in hits]
        wall = int(np.argmin(ahead))
        if time + ahead[wall] > until:
            return math.nan, None
        time, r = time + ahead[wall], r + ahead[wall] * v
        if opened(wall, r):
            return time, r
        n = normals[wall](r)
        v = v - 2.0 * (v @ n) * n
        r = gaps[wall](r)


@pytest.mark.parametrize(("depth", "wall"), [(3e-4, 1.0), (2e-4, 2.0)])
def test_of_closed_walls_at_an_opening_the_first_on_the_way_is_hit(depth, wall):
    """One 5e-4 ahead, and one that is nearer, but 60 degrees off the way: it is reached after twice its distance."""
    opening, slanted = swarm.Sphere(1.0), (0.5, math.sqrt(0.75), 0.0)
    walls = [
        swarm.Plane((1.0, 0.0, 0.0), 0.5, openings=[opening]),
        swarm.Plane((1.0, 0.0, 0.0), 0.5 + 5e-4),
        swarm.Plane(slanted, 0.25 + depth),
    ]
    scene, rules = swarm.Scene(walls), SimpleNamespace(size=1.0, laws=SimpleNamespace(moving=None))
    motion = Vec(0.5, 0.0, 0.0), Vec(1.0, 0.0, 0.0)
    assert absence.hit_wall(scene.compiled().openings(), rules, scene.compiled().walls(), motion, 0.0, 1e-3) == wall


def test_a_wall_before_an_opening_covers_it():
    """A ball stands in the hole of a sphere; beside it the hole is open."""
    hole, ball = (np.array([0.0, 0.0, 0.5]), 0.3), (np.array([0.0, 0.0, 0.45]), 0.2)
    scene = swarm.Scene(
        [
            swarm.Sphere(0.5, openings=[swarm.Sphere(hole[1], center=tuple(hole[0]))]),
            swarm.Sphere(ball[1], center=tuple(ball[0]), side="outside"),
        ]
    )

    def to_sphere(r, v):
        b, c = r @ v, r @ r - 0.25
        return (-b + math.sqrt(b * b - (v @ v) * min(c, 0.0))) / (v @ v)

    def to_ball(r, v):
        d = r - ball[0]
        b, c = d @ v, d @ d - ball[1] ** 2
        root = b * b - (v @ v) * c
        return (-b - math.sqrt(root)) / (v @ v) if root > 0.0 and b < -1e-9 else math.inf

    start = swarm.fill(scene, 60, speed=1.0, seed=3)
    found = run(scene, start, until=3.0, frames=1)
    exact = [
        reflected(
            (lambda r: r * (0.5 / np.sqrt(r @ r)), lambda r: r),
            (to_sphere, to_ball),
            (lambda r: r / np.sqrt(r @ r), lambda r: (ball[0] - r) / ball[1]),
            start.position[:, i],
            start.velocity[:, i],
            3.0,
            lambda wall, r: wall == 0 and (r - hole[0]) @ (r - hole[0]) <= hole[1] ** 2,
        )
        for i in range(60)
    ]
    times = np.array([time for time, _place in exact])
    assert 10 < np.isfinite(times).sum() < 60
    assert np.allclose(found.escape_time, times, rtol=0.0, atol=1e-9, equal_nan=True)
    for i in np.flatnonzero(np.isfinite(times)):
        assert np.abs(found.particles.position[:, i] - exact[i][1]).max() < 1e-9


def along_x(until, n=200):
    """When a particle that flies along x in a box of half width 0.5 reaches the wall at +x, and a start of n."""
    rng = np.random.default_rng(4)
    r, speed = rng.uniform(-0.45, 0.45, (3, n)), rng.uniform(-1.0, 1.0, n)
    way = np.where(speed > 0.0, 0.5 - r[0], 1.5 + r[0])
    time = way / np.abs(speed)
    return np.where(time <= until, time, np.nan), swarm.Particles(r, [speed, 0.0 * speed, 0.0 * speed])


WHOLE = {
    "a slab": swarm.Slab((1.0, 0.0, 0.0), 0.1, center=(0.5, 0.0, 0.0)),
    "a half space": swarm.Plane((-1.0, 0.0, 0.0), -0.4),
    "outside of a ball": swarm.Sphere(0.89, side="outside", center=(-0.4, 0.0, 0.0)),
    "in a box, and outside of one": swarm.Box((0.1, 2.0, 2.0), center=(0.5, 0.0, 0.0)),
    "outside of a box": swarm.Box((0.99, 2.0, 2.0), center=(-0.5, 0.0, 0.0), side="outside"),
}


@pytest.mark.parametrize("volume", WHOLE.values(), ids=WHOLE)
def test_a_whole_face_is_open(volume):
    exact, start = along_x(until=6.0)
    assert 20 < np.isnan(exact).sum() < 100
    found = run(swarm.Scene([swarm.Box((0.5, 0.5, 0.5), openings=[volume])]), start, until=6.0, frames=3)
    assert np.allclose(found.escape_time, exact, rtol=1e-14, atol=0.0, equal_nan=True)


def test_at_the_edge_of_a_box_both_walls_are_open():
    box = swarm.Box((0.5, 0.5, 0.5), openings=[swarm.Cylinder(0.1, axis=(0.0, 1.0, 0.0), center=(0.5, 0.0, 0.5))])
    start = thrown(
        [(0, 0, 0.45), (0.45, 0, 0), (0, 0, 0.35), (0, 0, -0.45)], [(1, 0, 0), (0, 0, 1), (1, 0, 0), (1, 0, 0)]
    )
    found = run(swarm.Scene([box]), start, until=3.0, frames=2)
    assert found.escape_time[:2] == pytest.approx([0.5, 0.5])
    assert np.isnan(found.escape_time[2:]).all()


def test_every_body_of_a_field_is_open():
    """Balls that take in what comes from above: the volume is the half space over their middles."""
    balls = swarm.Spheres(
        [(x, y, 0.0) for x in (-0.5, 0.0, 0.5) for y in (-0.5, 0.0, 0.5)],
        [0.2] * 9,
        openings=[swarm.Plane((0.0, 0.0, -1.0), 0.0)],
    )
    scene = swarm.Scene([swarm.Box((1.0, 1.0, 1.0)), balls])
    r = np.array([(x + 0.05, y, z) for x in (-0.5, 0.0, 0.5) for y in (-0.5, 0.0, 0.5) for z in (-0.9, 0.9)]).T
    v = np.array([0.0 * r[0], 0.0 * r[0], -np.sign(r[2])])
    found = run(scene, swarm.Particles(r, v), until=0.9, frames=2)
    above = 0.9 - math.sqrt(0.04 - 0.0025)
    assert np.allclose(found.escape_time, np.where(r[2] > 0.0, above, np.nan), rtol=1e-14, equal_nan=True)
    # As single balls, more than a few of which are one field, and as few that are no field.
    for some in (9, 3):
        single = [
            swarm.Sphere(0.2, center=tuple(c), side="outside", openings=balls.openings) for c in balls.centers[:some]
        ]
        apart = run(swarm.Scene([swarm.Box((1.0, 1.0, 1.0)), *single]), swarm.Particles(r, v), until=0.9, frames=2)
        assert np.array_equal(apart.escape_time[: 2 * some], found.escape_time[: 2 * some], equal_nan=True)
    # One field are those that have the same.
    mixed = [*single[:2], *(dataclasses.replace(single[0], center=tuple(c), openings=()) for c in balls.centers[2:])]
    assert len(mixed) == 9
    some = run(swarm.Scene([swarm.Box((1.0, 1.0, 1.0)), *mixed]), swarm.Particles(r, v), until=0.9, frames=2)
    assert np.array_equal(some.escape_time[:4], found.escape_time[:4], equal_nan=True)
    assert np.isnan(some.escape_time[4:]).all()


@pytest.mark.parametrize("times", [None, [(0.0, 0.6)]])
def test_many_openings_of_one_kind_are_as_one_of_many_bodies(times):
    """Nine boxes, of three walls each, are one field."""
    places = [(x, y, 1.0) for x in (-0.6, 0.0, 0.6) for y in (-0.6, 0.0, 0.6)]
    one_by_one = [swarm.Opening(swarm.Box((0.2, 0.2, 0.1), place), times=times) for place in places]
    many = [swarm.Opening(swarm.Boxes(places, [(0.2, 0.2, 0.1)] * 9), times=times)]
    scenes = [swarm.Scene([swarm.Box((1.0, 1.0, 1.0), openings=given)]) for given in (one_by_one, many)]
    start = swarm.fill(scenes[0], 20, speed=4.0, seed=1)
    one, other = (run(scene, start, 1.0, 1) for scene in scenes)
    assert 1 < (~np.isnan(one.escape_time)).sum() < 20
    assert np.array_equal(one.escape_time, other.escape_time, equal_nan=True)
    assert np.array_equal(one.particles.position, other.particles.position)


def test_an_opening_of_two_parts_is_compiled_once():
    boxes = [swarm.Box((0.1, 0.1, 0.1), (x, 0.0, 1.0)) for x in (-0.8, -0.6, -0.3, 0.0, 0.3, 0.6)]
    room = swarm.Union([swarm.Box((2.0, 1.0, 1.0)), swarm.Box((1.0, 2.0, 1.0))], openings=boxes)
    assert [len(opened.volumes) for opened in swarm.Scene([room]).compiled().openings()] == [6]


def test_what_repeats_has_its_openings_in_every_cell():
    """A ball over a face of the cell is open around a point of that face, seen from both sides."""
    ball = swarm.Sphere(
        0.2, center=(0.0, 0.5, 0.5), side="outside", openings=[swarm.Sphere(0.1, center=(0.0, 0.5, 0.7))]
    )
    floor = swarm.Slab((0.0, 0.0, 1.0), 0.5, center=(0.0, 0.0, 0.5))
    scene = swarm.Scene([ball, floor], period=(1.0, 1.0, None))
    start = thrown([(0.05, 0.5, 0.9), (0.95, 0.5, 0.9), (0.15, 0.5, 0.9)], [(0, 0, -1.0), (0, 0, -1.0), (0, 0, -1.0)])
    found = run(scene, start, until=1.0, frames=2)
    reach = 0.9 - 0.5 - math.sqrt(0.04 - 0.0025)
    assert found.escape_time[:2] == pytest.approx([reach, reach])
    assert np.isnan(found.escape_time[2])


def test_open_faces_and_openings_add_up():
    trough = swarm.Box((0.5, 0.5, 0.5), open=["+z"], openings=[swarm.Sphere(0.1, center=(0.0, 0.0, -0.5))])
    start = thrown([(0, 0, 0), (0, 0, 0), (0.3, 0, 0.2), (0.3, 0, 0)], [(0, 0, 1), (0, 0, -1), (0, 0, -1), (1, 0, 0)])
    found = run(swarm.Scene([trough]), start, until=3.0, frames=6)
    assert found.observables["escaped"].tolist() == [1, 2, 3, 3, 3, 3, 3]
    assert np.isfinite(found.escape_time).tolist() == [False, True, False, False]


def test_a_particle_above_a_floor_beyond_an_open_face_has_not_escaped():
    """It comes back: no count of particles that have left may fall again."""
    trough = swarm.Box((0.5, 0.5, 0.5), open=["-z"])
    floor = swarm.Box((2.0, 2.0, 0.1), center=(0.0, 0.0, -1.1), side="outside")
    scene = swarm.Scene([trough, floor], gravity=(0.0, 0.0, -10.0))
    found = run(scene, thrown([(0, 0, 0), (0.1, 0, 0.3)], [(0, 0, 0), (0, 0, 0)]), until=2.0, frames=20)
    assert found.observables["impacts"][-1] >= 4
    assert not found.observables["escaped"].any()
    assert scene.open_faces().tolist() == [[0.0, 0.0, -1.0, pytest.approx(1.2)]]


SHAFT = swarm.Box((0.5, 0.5, 2.0), open=("+z",))


@pytest.mark.parametrize(
    ("other", "end"),
    [
        (swarm.Sphere(0.3, center=(0.0, 0.0, 5.0), side="outside"), 5.3),
        (swarm.Spheres([[0.0, 0.0, 5.0], [0.0, 0.0, 3.0]], 0.3), 5.3),
        (swarm.Boxes([[0.0, 0.0, 5.0], [0.0, 0.0, 3.0]], (0.1, 0.2, 0.3)), 5.3),
        (swarm.Sphere(9.0), 9.0),
        (swarm.Plane((0.0, 0.0, 1.0), 7.0), 7.0),
        (swarm.Sphere(0.3, side="outside"), 2.0),
        (swarm.Cylinder(0.2, side="outside"), 2.0),
        (swarm.Sphere(0.3, center=(0.0, 0.0, 5.0), side="outside", present=[(0.0, 1.0)]), 2.0),
        (swarm.Sphere(0.3, center=(0, 0, 5), side="outside", motion=swarm.Translation((0, 0, 1.0))), 7.3),
    ],
    ids=[
        "a ball",
        "balls",
        "boxes",
        "a cavity",
        "a lid",
        "a ball inside",
        "an axle",
        "a ball that went",
        "one that moves",
    ],
)
def test_an_open_face_ends_beyond_what_sends_particles_back(other, end):
    assert swarm.Scene([SHAFT, other]).open_faces(2.0).tolist() == [[0.0, 0.0, 1.0, pytest.approx(end)]]


def test_other_walls_may_move_over_what_has_escaped():
    piston = swarm.Plane((1.0, 0.0, 0.0), 0.5, motion=swarm.Translation((-0.2, 0.0, 0.0)))
    vessel = swarm.Box((0.5, 0.5, 0.5), openings=[swarm.Sphere(0.3, center=(0.2, 0.0, 0.5))])
    scene = swarm.Scene([vessel, piston])
    found = run(scene, swarm.fill(scene, 100, speed=1.0, seed=2), until=4.0, frames=4)
    out = ~np.isnan(found.escape_time)
    assert 5 < out.sum() < 100
    assert found.particles.position[0, out].max() > 0.0 > -0.3 >= found.particles.position[0, ~out].max() - 1e-14
    seen = found.observables
    assert seen["max_penetration"].max() < 1e-14
    assert np.abs(seen["total_energy"] - seen["wall_work"].sum(axis=1) - seen["total_energy"][0]).max() < 1e-11


def test_a_thermal_wall_exchanges_no_heat_where_it_is_open():
    hot = swarm.Sphere(0.5, temperature=1.0, openings=[swarm.Plane((0.0, 0.0, -1.0), 0.0)])
    found = run(swarm.Scene([hot]), thrown([(0, 0, 0), (0.1, 0, 0)], [(0, 0, 1.0), (0, 0, -1.0)]), until=0.5, frames=1)
    assert found.escape_time.tolist()[0] == 0.5
    assert found.observables["impacts"].tolist() == [0, 1]
    assert found.particles.velocity[:, 0].tolist() == [0.0, 0.0, 1.0]


# --- The same bits ---------------------------------------------------------------------------------------


def bits(result):
    arrays = result.particles.position, result.particles.velocity, result.escape_time, result.impacts_per_particle
    return [array.tobytes() for array in (*arrays, *(result.observables[name] for name in ("impacts", "escaped")))]


@pytest.mark.level3
@pytest.mark.parametrize("step", [0.0, rarely(0.01)])
def test_the_same_bits_compiled_and_for_threads_and_blocks(step):
    scene = swarm.Scene([swarm.Sphere(0.5, openings=[HOLE])])
    start, method = swarm.fill(scene, 600, speed=1.0, seed=1), swarm.Impact(contact_step=step)
    expected = run(scene, start, method=method)
    assert expected.observables["escaped"][-1] > 4
    for options in ({"threads": 2, "compile": "always"}, {"threads": 2, "block_size": 256, "compile": "always"}):
        assert bits(run(scene, start, method=method, **options)) == bits(expected)


def test_halts_and_sessions_leave_the_bits(tmp_path):
    require_resumed_is_whole(tmp_path, swarm.Scene([swarm.Sphere(0.5, openings=[HOLE])]), swarm.Impact(), every=8.0)


@pytest.mark.long
def test_halts_and_sessions_leave_the_bits_of_slides(tmp_path):
    floor = swarm.Cylinder(
        0.5, length=1.0, restitution=0.7, friction=0.02, openings=[VOLUMES["ball"], VOLUMES["balls"]]
    )
    require_resumed_is_whole(tmp_path, swarm.Scene([floor], (0.3, 0.1, -2.0)), swarm.Impact(), n=100, every=3.0)


def test_a_trajectory_keeps_the_times(tmp_path):
    scene = swarm.Scene([swarm.Sphere(0.5, openings=[HOLE])])
    start, path = swarm.fill(scene, 300, speed=1.0, seed=1), tmp_path / "run.h5"
    found = run(scene, start, trajectory=path, frames=4)
    with swarm.load(path) as trajectory:
        assert np.array_equal(trajectory.escape_times(-1), found.escape_time, equal_nan=True)
        early = np.where(found.escape_time <= 1.0, found.escape_time, np.nan)
        assert np.array_equal(trajectory.escape_times(1), early, equal_nan=True)
        assert trajectory.scene == scene
    run(swarm.Scene([swarm.Sphere(0.5)]), start, trajectory=tmp_path / "closed.h5", frames=4)
    with swarm.load(tmp_path / "closed.h5") as closed:
        assert np.isnan(closed.escape_times(2)).all()


# --- What is refused -------------------------------------------------------------------------------------

LAWS = {"restitution": 0.5, "friction": 0.1, "temperature": 1.0, "motion": swarm.Translation((1.0, 0.0, 0.0))}


@pytest.mark.parametrize("law", LAWS)
def test_an_opening_has_no_laws(law):
    with pytest.raises(swarm.SceneError, match=rf"openings\[0\]\.{law} must be left out, an opening is no wall, got "):
        swarm.Sphere(0.5, openings=[swarm.Sphere(0.1, center=(0.5, 0.0, 0.0), **{law: LAWS[law]})])


def nested():
    return swarm.Sphere(0.5, openings=[swarm.Sphere(0.5, openings=[HOLE])])


REFUSED = {
    r"openings must be a list of surfaces such as swarm.Sphere, got Sphere": lambda: swarm.Sphere(0.5, openings=HOLE),
    r"openings\[1\] must be a surface such as swarm.Sphere, got 3": lambda: swarm.Sphere(0.5, openings=[HOLE, 3]),
    r"openings\[0\].openings must be left out": nested,
    r"openings must be of a wall at rest, or of one with a mass, got 1 of a Sphere": lambda: swarm.Sphere(
        0.5, openings=[HOLE], motion=swarm.Translation((1.0, 0.0, 0.0))
    ),
    r"openings must be of a wall at rest, or of one with a mass, got 1 of a Plane": lambda: swarm.Plane(
        (0, 0, 1), openings=[HOLE], motion=swarm.Translation((1.0, 0.0, 0.0))
    ),
    r"surfaces\[0\].openings\[1\] must reach the wall that it opens, got Sphere\(radius=0.1\), in which": lambda: (
        swarm.Scene([swarm.Sphere(0.5, openings=[HOLE, swarm.Sphere(0.1)])])
    ),
    r"surfaces\[0\].openings\[0\] must reach the wall": lambda: swarm.Scene(
        [swarm.Sphere(0.5, openings=[swarm.Sphere(0.1, center=(0.0, 0.0, 0.6001))])]
    ),
    r"openings must have at most 24 walls in all, got 25, of 25 volumes of 1 rows of walls: each is": lambda: (
        swarm.Scene([swarm.Sphere(0.5, openings=[swarm.Plane((0.0, 0.0, -1.0), -0.01 * k) for k in range(25)])])
    ),
    r'surfaces\[0\].openings\[0\].side must be "inside" where the scene has a period': lambda: swarm.Scene(
        [swarm.Slab((0, 0, 1), 0.5, openings=[swarm.Sphere(0.3, side="outside")])], period=(1.0, 1.0, None)
    ),
}


@pytest.mark.parametrize("message", REFUSED)
def test_bad_openings(message):
    with pytest.raises(swarm.SceneError, match=message):
        REFUSED[message]()


@pytest.mark.parametrize("name", ["Verlet", "Midpoint"])
def test_methods_that_know_no_openings(name):
    scene = swarm.Scene([swarm.Sphere(0.5, openings=[HOLE])])
    with pytest.raises(
        swarm.SceneError, match=rf"surfaces\[0\].openings must be left out with {name}, got 1; use Impact"
    ):
        run(scene, swarm.fill(scene, 2, speed=1.0, seed=1), method=getattr(swarm, name)(dt=0.01, penalty=1e4))


def test_an_opening_of_a_vessel_beside_a_wall_with_a_mass():
    vessel = swarm.Sphere(0.5, openings=[swarm.Plane((0.0, 0.0, -1.0), 0.0)])
    scene = swarm.Scene([vessel, swarm.Sphere(0.1, side="outside", mass=1.0)])
    result = run(scene, swarm.fill(scene, 20, speed=1.0, seed=1), until=20.0)
    np.testing.assert_allclose(np.sqrt((result.particles.position**2).sum(axis=0)), 0.5, rtol=1e-14)
    assert np.isfinite(result.escape_time).all()
    assert result.particles.position[2].min() >= 0.0
    with pytest.raises(swarm.SceneError, match=r"cavities\[0\]\[0\] must have no motion, mass, inertia or openings"):
        swarm.Body([(0, 0, 0), (0, 0, 0.1)], [1.0, 1.0], cavities=[(vessel, 0, 1)])


def test_the_smallest_rim_and_a_flat_volume_reach_the_wall():
    for volume in (
        swarm.Sphere(0.1, center=(0.0, 0.0, 0.5999)),
        swarm.Sphere(1e-6, center=(0.0, 0.0, 0.5)),
        swarm.Box((0.1, 0.1, 1e-9), center=(0.0, 0.0, 0.5)),
        swarm.Torus(0.3, 0.1, center=(0.0, 0.0, 0.5)),
        swarm.Spheres([(0.0, 0.0, 0.5), (0.0, 0.0, 0.0)], [0.1, 0.1]),
    ):
        assert swarm.Scene([swarm.Sphere(0.5, openings=[volume])]).pieces.volumes == ((volume,),)


@pytest.mark.parametrize("radius", [0.9, 1.2, 3.0])
def test_an_opening_of_one_wall_leaves_the_common_face_of_two_rooms_open(radius):
    """It reaches the face x = 0, which is that of other walls of the rooms: particles fly through as in one tube."""
    tube, ends = swarm.Cylinder(1.0, axis=(1.0, 0.0, 0.0)), [(sign, 0.0, 0.0) for sign in (-1.0, 1.0)]
    rooms = [
        swarm.Intersection([
            tube,
            swarm.Plane(end, 1.0, openings=[swarm.Sphere(radius, end)]),
            swarm.Plane(tuple(-x for x in end), 0.0),
        ])
        for end in ends
    ]  # fmt: skip
    start = swarm.Particles(
        [[-0.5, -0.6, 0.7], [0.0, 0.7, 0.0], [0.3, 0.0, -0.6]], [[1.0, 1.0, -1.0], [0.0] * 3, [0.0] * 3]
    )
    seen = swarm.simulate(
        swarm.Scene([swarm.Union(rooms)]), start, swarm.Impact(), until=3.0, compile="never"
    ).observables
    assert (seen["impacts"][-1], seen["escaped"][-1]) == (0, 3)
