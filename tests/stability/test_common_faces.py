"""Unions of parts that have faces in common, at random, against vessels of the same shape whose parts overlap.

A failure prints its seed; `check(seed)` repeats it.
"""

import numpy as np
import pytest

import swarm
from swarm.surfaces.rotation import matrix

N = 24
DOWN = (0.3, -0.2, -1.0)


class Frame:
    """A random frame, in which parts are given: their places are rounded."""

    def __init__(self, random):
        turn = random.choice(3)
        axis = [(0.0, 0.0, 1.0), tuple(random.normal(size=3).tolist()), (1.0, 1.0, 0.0)][turn]
        self.rotation = None if turn == 0 else {"axis": axis, "angle": float(random.uniform(0.0, 3.0))}
        self.matrix = np.eye(3) if turn == 0 else matrix(swarm.Box((1, 1, 1), rotation=self.rotation).rotation)
        self.shift = random.uniform(-1.0, 1.0, 3) * random.choice([0.0, 1.0, 30.0])

    def at(self, *place):
        return tuple((self.matrix @ np.array(place, np.float64) + self.shift).tolist())

    def along(self, k):
        return tuple(self.matrix[:, k].tolist())

    def box(self, low, high):
        low, high = np.array(low, np.float64), np.array(high, np.float64)
        return swarm.Box(tuple((0.5 * (high - low)).tolist()), self.at(*(0.5 * (low + high))), rotation=self.rotation)

    def tube(self, radius, low, high, **more):
        return swarm.Cylinder(radius, self.along(2), high - low, self.at(0.0, 0.0, 0.5 * (low + high)), **more)

    def below(self, z):
        normal = self.along(2)
        return swarm.Plane(normal, float(np.dot(normal, self.at(0.0, 0.0, z))))

    def above(self, z):
        normal = tuple(-one for one in self.along(2))
        return swarm.Plane(normal, float(np.dot(normal, self.at(0.0, 0.0, z))))


def boxes_in_a_row(random, frame):
    """Of one width, or narrower ones: the reference is of boxes that reach into the one before."""
    parts, same, z, width = [], [], 0.0, np.array([1.0, 0.8])
    for k in range(random.integers(2, 5)):
        height = float(random.uniform(0.3, 1.0))
        into = 0.25 if k else 0.0
        parts.append(frame.box((*-width, z), (*width, z + height)))
        same.append(frame.box((*-width, z - into), (*width, z + height)))
        z, width = z + height, width * random.choice([1.0, 0.6])
    return parts, same


def boxes_that_are_offset(random, frame):
    """A part of the face of either is free: the reference has a third box, of what they have in common."""
    x, y = random.uniform(0.2, 1.2, 2) * random.choice([-1.0, 1.0], 2)
    low, high = np.array([-1.0, -0.8]), np.array([1.0, 0.8])
    move = np.array([x, y])
    parts = [frame.box((*low, -0.7), (*high, 0.0)), frame.box((*(low + move), 0.0), (*(high + move), 0.6))]
    bridge = frame.box((*np.maximum(low, low + move), -0.2), (*np.minimum(high, high + move), 0.2))
    return parts, [*parts, bridge]


def tubes(random, frame):
    radius = float(random.uniform(0.3, 1.0))
    return (
        [frame.tube(1.0, -0.8, 0.0), frame.tube(radius, 0.0, 0.7)],
        [frame.tube(1.0, -0.8, 0.0), frame.tube(radius, -0.3, 0.7)],
    )


def a_mushroom(random, frame):
    ball, floor = swarm.Sphere(1.0, frame.at(0.0, 0.0, 0.0)), frame.above(0.0)
    cap, half = swarm.Intersection([ball, floor]), float(random.uniform(0.2, 0.6))
    if random.random() < 0.5:
        stem, same = (frame.box((-half, -half, -0.8), (half, half, top)) for top in (0.0, 0.2))
    else:
        stem, same = (frame.tube(half, -0.8, top) for top in (0.0, 0.2))
    return [cap, stem], [cap, same]


def a_ball_and_a_shell(random, frame):
    """A round face, seen from both sides: the reference is the ball that both fill."""
    center, radius = frame.at(0.0, 0.0, 0.0), float(random.uniform(0.3, 0.8))
    inner = swarm.Sphere(radius, center)
    shell = swarm.Intersection([swarm.Sphere(1.0, center), swarm.Sphere(radius, center, side="outside")])
    return [inner, shell], [swarm.Sphere(1.0, center)]


def a_tube_and_its_sleeve(random, frame):
    radius = float(random.uniform(0.3, 0.8))
    core = frame.tube(radius, -0.6, 0.6)
    endless = swarm.Cylinder(radius, frame.along(2), None, frame.at(0.0, 0.0, 0.0), side="outside")
    sleeve = swarm.Intersection([frame.tube(1.0, -0.6, 0.6), endless])
    return [core, sleeve], [frame.tube(1.0, -0.6, 0.6)]


def a_box_in_its_hole(random, frame):
    """Six faces in common."""
    half = random.uniform(0.2, 0.45, 3)
    middle = frame.box(tuple(-half), tuple(half))
    around = swarm.Intersection([swarm.Sphere(1.0, frame.at(0, 0, 0)), swarm.Box(
        middle.half_widths, middle.center, side="outside", rotation=frame.rotation)])  # fmt: skip
    return [middle, around], [swarm.Sphere(1.0, frame.at(0, 0, 0))]


def two_halves(random, frame):
    ball = swarm.Sphere(1.0, frame.at(0.0, 0.0, 0.0))
    z = float(random.uniform(-0.6, 0.6))
    return [swarm.Intersection([ball, frame.below(z)]), swarm.Intersection([ball, frame.above(z)])], [ball]


VESSELS = (
    boxes_in_a_row, boxes_that_are_offset, tubes, a_mushroom, a_ball_and_a_shell, a_tube_and_its_sleeve,
    a_box_in_its_hole, two_halves,
)  # fmt: skip


def check(seed, gravity=None, n=N, until=4.0, **options):
    random = np.random.default_rng([8, seed])
    make = VESSELS[seed % len(VESSELS)]
    parts, same = make(random, Frame(random))
    order = random.permutation(len(parts))
    union, reference = swarm.Union([parts[k] for k in order]), swarm.Union(same)
    name = f"{make.__name__}, seed {seed}, gravity {gravity}"
    start = swarm.fill(swarm.Scene([reference]), n, speed=1.0, seed=seed)
    found, expected = (
        swarm.simulate(swarm.Scene([one], gravity), start, swarm.Impact(), until=until, every=until, **options)
        for one in (union, reference)
    )
    assert found.observables["energy_error"].max() < 1e-12, name
    assert found.observables["escaped"][-1] == 0, name
    assert found.observables["max_penetration"].max() < 1e-12 * (1.0 + union.extent()), name
    assert union.phi(found.particles.position).max() < 1e-12 * (1.0 + union.extent()), name
    off = np.abs(found.particles.position - expected.particles.position).max(axis=0)
    # Particles that come to an edge go another way, and round walls spread what is near.
    assert (off < 1e-6).mean() >= 0.9, f"{name}: {np.sort(off)[::-1][:5]}"
    # Every part has as many particles.
    for part in parts:
        inside = [(swarm.Union([part]).phi(one.particles.position) < 0.0).sum() for one in (found, expected)]
        assert abs(int(inside[0]) - int(inside[1])) <= 0.1 * n, name


@pytest.mark.parametrize("seed", range(8))
def test_parts_with_a_common_face_are_one_room(seed):
    check(seed, DOWN if seed % 3 == 2 else None, n=12, until=3.0, compile="never")


@pytest.mark.long
@pytest.mark.parametrize("gravity", [None, DOWN])
def test_forty_vessels_of_parts_with_common_faces(gravity):
    for seed in range(40):
        check(seed, gravity, n=100, until=6.0)


# --- What is one room, and what is not ---------------------------------------------------------------------


def test_the_share_in_the_stem_tends_to_its_share_of_the_area():
    """A mushroom in a plane, whose particles begin in the cap."""
    cap = swarm.Intersection([swarm.Sphere(1.0), swarm.Plane((0, -1, 0), 0.0)])
    stem = swarm.Box((0.3, 0.5, 9.0), center=(0, -0.5, 0))
    scene = swarm.Scene([swarm.Union([cap, stem])], plane="z")
    random = np.random.default_rng(3)
    angle, place = random.uniform(0.0, 2.0 * np.pi, 60), random.uniform(-0.6, 0.6, (2, 60))
    start = swarm.Particles([place[0], abs(place[1]) + 1e-3, 0.0 * angle], [np.cos(angle), np.sin(angle), 0.0 * angle])
    seen = {"stem": lambda frame: (frame.position[1] < 0.0).sum()}
    run = swarm.simulate(
        scene, start, swarm.Impact(), until=24.0, every=2.0, observables=seen, compile="never"
    ).observables  # fmt: skip
    share = 0.6 / (0.6 + 0.5 * np.pi)
    assert run["stem"][0] == 0
    # The mean of the later frames, of which each is far from independent of the one before it.
    assert abs(run["stem"][4:].mean() / 60.0 - share) < 3.0 * np.sqrt(share * (1.0 - share) / 60.0)
    assert run["escaped"][-1] == 0
    assert run["energy_error"].max() < 1e-14


def seams(*parts, **more):
    return len(swarm.Union(parts, **more).seams)


def test_only_faces_seen_from_both_sides_are_common():
    box = swarm.Box((1.0, 1.0, 1.0))
    assert seams(box, swarm.Box((1.0, 1.0, 1.0), (2.0, 0.0, 0.0))) == 1
    # Flush walls: of boxes that overlap, of one in another one, and of one beside another one's edge.
    assert seams(box, swarm.Box((1.0, 1.0, 1.0), (1.0, 0.0, 0.0))) == 0
    assert seams(box, swarm.Box((0.5, 0.5, 0.5), (0.5, 0.0, 0.5))) == 0
    assert seams(box, swarm.Box((1.0, 1.0, 1.0), (2.0, 2.0, 0.0))) == 0
    assert seams(box, swarm.Box((1.0, 1.0, 1.0), (2.0, 2.0, 2.0))) == 0
    # What only touches, at a point or along a line.
    assert seams(box, swarm.Sphere(1.0, (2.0, 0.0, 0.0))) == 0
    assert seams(box, swarm.Cylinder(1.0, (0.0, 0.0, 1.0), 1.0, (2.0, 0.0, 0.0))) == 0
    # Open faces are no walls, and a plane ends where its room does.
    half = swarm.Intersection([swarm.Sphere(1.0, (3.0, 0.0, 0.0)), swarm.Plane((1.0, 0.0, 0.0), 3.0)])
    assert seams(half, swarm.Box((1.0, 1.0, 1.0), (4.0, 0.0, 0.0))) == 1
    assert seams(half, swarm.Box((1.0, 1.0, 1.0), (4.0, 1.5, 0.0))) == 1
    assert seams(half, swarm.Box((1.0, 1.0, 1.0), (4.0, 2.5, 0.0))) == 0
    assert seams(swarm.Slab((1.0, 0.0, 0.0), 0.5), swarm.Slab((1.0, 0.0, 0.0), 0.5, (1.0, 0.0, 0.0))) == 1


def test_faces_are_one_within_four_roundings():
    box, eps = swarm.Box((1.0, 1.0, 1.0)), 2.0**-52
    for apart, common in ((0.0, 1), (2.0 * eps, 1), (-2.0 * eps, 1), (-1e-13, 1), (1e-13, 0), (1e-9, 0)):
        assert seams(box, swarm.Box((1.0, 1.0, 1.0), (2.0 + apart, 0.0, 0.0))) == common, apart
    # 0.1 + 0.2 is not 0.3.
    assert seams(swarm.Box((0.3, 1, 1), (0.1, 0, 0)), swarm.Box((0.3, 1, 1), (0.1 + 0.2 + 0.4, 0, 0))) == 1


def test_doors_and_walls_that_come_and_go_keep_rooms_apart():
    box, other = swarm.Box((1.0, 1.0, 1.0)), swarm.Box((1.0, 1.0, 1.0), (2.0, 0.0, 0.0))
    hole, elsewhere = swarm.Sphere(0.01, (1.0, 0.3, 0.2)), swarm.Sphere(0.2, (-1.0, 0.0, 0.0))
    for door in (hole, swarm.Opening(hole, between=True), swarm.Opening(hole, times=[(1.0, 2.0)])):
        assert seams(box, other, openings=[door]) == 0
        assert seams(swarm.Box((1.0, 1.0, 1.0), openings=[door]), other) == 0
    assert seams(box, other, openings=[elsewhere]) == 1
    assert seams(swarm.Box((1.0, 1.0, 1.0), present=[(1.0, 2.0)]), other) == 0
    # Of three rooms in a row, with a door between two of them.
    third = swarm.Box((1.0, 1.0, 1.0), (4.0, 0.0, 0.0))
    (seam,) = swarm.Union([box, other, third], openings=[hole]).seams
    assert seam.rooms == (1, 2)


def test_a_face_that_cannot_be_opened_is_a_sentence():
    with pytest.raises(
        swarm.SceneError, match=r"parts must overlap, or have a flat or a round face in common, got Form"
    ):
        swarm.Scene(
            [
                swarm.Union(
                    [
                        swarm.Intersection([swarm.Formula("x + 0*y"), swarm.Sphere(1.0)]),
                        swarm.Intersection([swarm.Formula("-x + 0*y"), swarm.Sphere(1.0)]),
                    ]
                )
            ]
        )


def test_parts_that_touch_and_move_otherwise_are_reported(caplog):
    box = swarm.Box((1.0, 1.0, 1.0))
    moving = swarm.Box((1.0, 1.0, 1.0), (2.0, 0.0, 0.0), motion=swarm.Translation((1.0, 0.0, 0.0)))
    start = swarm.Particles([[0.0]] * 3, [[1.0]] * 3)
    swarm.simulate(swarm.Scene([swarm.Union([box, moving])]), start, swarm.Impact(), until=0.1, compile="never")
    assert "a face in common at the start that do not move as one" in caplog.text


def test_a_union_that_moves_as_a_whole_is_one_room():
    boxes = [swarm.Box((0.5, 0.5, 0.5), (x, 0.0, 0.0)) for x in (-0.5, 0.5)]
    motion = swarm.Oscillation((0.1, 0.0, 0.0), 0.5)
    start = swarm.fill(swarm.Scene([boxes[0]]), 20, speed=1.0, seed=1)
    found, expected = (
        swarm.simulate(swarm.Scene([one]), start, swarm.Impact(), until=2.0, compile="never").particles
        for one in (swarm.Union(boxes, motion=motion), swarm.Box((1.0, 0.5, 0.5), motion=motion))
    )
    assert found.position == pytest.approx(expected.position, abs=1e-8)
    assert (found.position[0] > 0.1).any()
