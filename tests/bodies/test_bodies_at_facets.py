"""Bodies at meshes, outlines, unions and foams: one point is a particle, and a dumbbell flies as in a plain loop."""

import math

import numpy as np
import pytest

import swarm

# An L: its corner (1, 1) points into the room.
OUTLINE = [(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0)]
LIDS = [(0, 1, 2), (0, 2, 3), (0, 3, 5), (3, 4, 5)]
HALF, SPEED, SPIN = 0.12, (1.3, 0.7), 3.1


def mesh_of_outline():
    """The prism of the outline as triangles."""
    corners = [(x, y, z) for z in (-0.4, 0.4) for x, y in OUTLINE]
    faces = [(a, c, b) for a, b, c in LIDS] + [(a + 6, b + 6, c + 6) for a, b, c in LIDS]
    for a in range(6):
        b = (a + 1) % 6
        faces += [(a, b, b + 6), (a, b + 6, a + 6)]
    return swarm.Mesh(corners, faces)


def union_of(*spans):
    """Boxes as one room, each from and to these places in the plane."""
    boxes = [((x0, y0), (x1, y1)) for x0, y0, x1, y1 in spans]
    return swarm.Union([
        swarm.Box((*(0.5 * np.subtract(high, low)), 0.4), (*(0.5 * np.add(low, high)), 0.0)) for low, high in boxes
    ])  # fmt: skip


def foam_of_three():
    """Balls that overlap."""
    return swarm.Spheres([(0.5, 0.5, 0.0), (1.0, 0.6, 0.1), (0.4, 1.0, -0.1)], [0.5, 0.4, 0.45], side="inside")


ROOMS = {
    "union": lambda: union_of((0.0, 0.0, 2.0, 1.0), (0.0, 0.0, 1.0, 2.0)),
    "touching union": lambda: union_of((0.0, 0.0, 2.0, 1.0), (0.0, 1.0, 1.0, 2.0)),
    "foam": foam_of_three,
    "polygon": lambda **laws: swarm.Polygon(OUTLINE, **laws),
    "stadium": lambda **laws: swarm.Stadium(0.5, 0.8, center=(0.5, 0.5, 0.0), **laws),
    "prism": lambda **laws: swarm.Prism(OUTLINE, 0.8, **laws),
    "mesh": lambda **laws: mesh_of_outline(),
    "polygon that moves": lambda: swarm.Polygon(OUTLINE, motion=swarm.Oscillation((0.1, -0.05, 0.0), 1.3)),
    "polygon that turns": lambda: swarm.Polygon(OUTLINE, motion=swarm.Rotation((0.0, 0.0, 1.0), 0.7, (0.5, 0.5, 0.0))),
}


@pytest.mark.parametrize("gravity", [None, (0.2, -1.5, 0.1)])
@pytest.mark.parametrize("room", ROOMS)
def test_a_body_of_one_point_is_a_particle(room, gravity):
    scene, start, speed = swarm.Scene([ROOMS[room]()], gravity), (0.5, 0.45, 0.1), (1.1, 0.83, -0.37)
    body = swarm.Body([(0.0, 0.0, 0.0)], mass=[1.0])
    as_body = swarm.simulate(
        scene, swarm.Bodies(body, np.array(start)[:, None, None], np.array(speed)[:, None, None]),
        swarm.Impact(dt=0.05), until=3.0, every=1.0, compile="never",
    )  # fmt: skip
    particle = swarm.Particles(np.array(start)[:, None], np.array(speed)[:, None])
    as_point = swarm.simulate(scene, particle, swarm.Impact(), until=3.0, every=1.0, compile="never")
    assert as_body.observables["impacts"][-1] == as_point.observables["impacts"][-1] >= 3
    np.testing.assert_allclose(as_body.particles.position, as_point.particles.position, atol=1e-10)
    np.testing.assert_allclose(as_body.particles.velocity, as_point.particles.velocity, atol=1e-10)
    assert as_body.observables["energy_error"].max() < 1e-12


def is_inside(x, y):
    """Whether a place is in the L."""
    return 0.0 < x < 2.0 and 0.0 < y < 2.0 and not (x > 1.0 and y > 1.0)


def normal_at(x, y):
    """The outward normal of the side of the L that is nearest to a place at it."""
    sides = [((-1, 0), abs(x)), ((0, -1), abs(y)), ((1, 0), abs(x - 2.0)), ((0, 1), abs(y - 2.0))]
    sides += [((1, 0), abs(x - 1.0) if y > 1.0 - 1e-9 else 9.0), ((0, 1), abs(y - 1.0) if x > 1.0 - 1e-9 else 9.0)]
    return np.array(min(sides, key=lambda one: one[1])[0], float)


def flown(until):
    """A dumbbell in the L in a loop of small steps and bisections: its centre, its angle, and how often it hits."""
    centre, v, angle, spin, time, hits = np.array([0.5, 0.5]), np.array(SPEED), 0.4, SPIN, 0.0, 0

    def arms(t):
        out = HALF * np.array([math.cos(angle + spin * t), math.sin(angle + spin * t)])
        return out, -out

    def has_left(t):
        return [not is_inside(*(centre + t * v + arm)) for arm in arms(t)]

    while time < until:
        step = 0.0
        while not any(has_left(step)) and time + step < until:
            step = min(step + 1e-3, until - time) if step else 1e-9
        low, high = max(step - 1e-3, 0.0), step
        if not any(has_left(step)):
            return centre + step * v, angle + step * spin, hits
        for _half in range(60):
            middle = 0.5 * (low + high)
            low, high = (low, middle) if any(has_left(middle)) else (middle, high)
        arm = arms(low)[has_left(high).index(True)]
        centre, angle, time = centre + low * v, angle + low * spin, time + low
        n = normal_at(*(centre + arm))
        # Mass 1: two halves at the ends of the rod.
        lever = arm[0] * n[1] - arm[1] * n[0]
        rate = n @ v + spin * lever
        impulse = 2.0 * rate / (1.0 + lever**2 / HALF**2)
        v, spin, hits = v - impulse * n, spin - impulse * lever / HALF**2, hits + 1
    return centre, angle, hits


@pytest.mark.parametrize("room", ["polygon", "prism", "mesh", "union", "touching union"])
def test_a_dumbbell_flies_as_in_a_plain_loop(room):
    out = HALF * np.array([math.cos(0.4), math.sin(0.4), 0.0])
    across = np.array([-out[1], out[0], 0.0])
    position = np.array([(0.5, 0.5, 0.0) + sign * out for sign in (1.0, -1.0)]).T
    velocity = np.array([(*SPEED, 0.0) + sign * SPIN * across for sign in (1.0, -1.0)]).T
    body = swarm.dumbbell(length=2.0 * HALF, mass=1.0)
    until = 4.0
    done = swarm.simulate(
        swarm.Scene([ROOMS[room]()]), swarm.Bodies(body, position[..., None], velocity[..., None]),
        swarm.Impact(dt=0.02, order=4), until=until, every=1.0, compile="never",
    )  # fmt: skip
    centre, angle, hits = flown(until)
    assert done.observables["impacts"][-1] == hits >= 5
    places = done.particles.position
    np.testing.assert_allclose(places.mean(axis=1)[:2], centre, atol=2e-4)
    np.testing.assert_allclose(
        (places[:2, 0] - places[:2, 1]) / (2.0 * HALF), (math.cos(angle), math.sin(angle)), atol=1e-3
    )
    assert done.observables["energy_error"].max() < 1e-12


def test_a_step_far_longer_than_a_cell_passes_no_facet():
    """A step of a body is several times longer than the room is wide."""
    scene = swarm.Scene([mesh_of_outline()])
    body = swarm.Body([(0.0, 0.0, 0.0)], mass=[1.0])
    start = np.array([[1.5, 0.5], [0.5, 1.5], [0.1, -0.2]])[:, None]
    speed = np.array([[40.0, -30.0], [7.0, 50.0], [-3.0, 11.0]])[:, None]
    done = swarm.simulate(
        scene, swarm.Bodies(body, start, speed), swarm.Impact(dt=0.1), until=0.4, every=0.2, compile="never"
    )
    assert done.observables["impacts"][-1] > 20
    assert done.observables["max_penetration"].max() < 1e-12
    assert done.observables["energy_error"].max() < 1e-12


def box_of_triangles(**laws):
    """The box of the polygon below as a mesh."""
    corners = [(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)]
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return swarm.Mesh(corners, [three for a, b, c, d in quads for three in ((a, b, c), (a, c, d))], **laws)


SQUARE = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]


def test_rods_pass_an_opening_and_come_back_as_at_a_box():
    """Some rods go out with one end and come in again, since the other end meets the wall beside the opening."""
    gate = swarm.Box((0.3, 0.2, 2.0), (1.0, 0.0, 0.0))
    rng = np.random.default_rng(5)
    n, body = 6, swarm.dumbbell(length=0.5, mass=1.0)
    centre = np.array([np.full(n, 0.6), rng.uniform(-0.4, 0.4, n), rng.uniform(-0.3, 0.3, n)])
    angle, spin = rng.uniform(0.0, math.pi, n), rng.uniform(4.0, 9.0, n)
    arm = 0.25 * np.array([np.cos(angle), np.sin(angle), 0.0 * angle])
    turn = spin * np.array([-arm[1], arm[0], 0.0 * angle])
    speed = np.array([[0.6], [0.05], [0.1]]) * np.ones(n)
    start = np.stack([centre + arm, centre - arm], axis=1), np.stack([speed + turn, speed - turn], axis=1)
    rooms = [
        swarm.Box((1.0, 1.0, 1.0), openings=[gate]), swarm.Prism(SQUARE, 2.0, openings=[gate]),
        box_of_triangles(openings=[gate]),
    ]  # fmt: skip
    done = [
        swarm.simulate(
            swarm.Scene([room]), swarm.Bodies(body, *start), swarm.Impact(dt=0.02), until=1.2, every=0.1,
            compile="never", observables={"out": lambda frame: (frame.position[0] > 1.0).sum()},
        )
        for room in rooms
    ]  # fmt: skip
    box = done[0]
    assert (np.diff(box.observables["out"]) < 0).any()
    for other in done[1:]:
        np.testing.assert_allclose(other.particles.position, box.particles.position, atol=1e-9)
        np.testing.assert_array_equal(other.observables["escaped"], box.observables["escaped"])
        assert other.observables["energy_error"].max() < 1e-12
    assert 0 < box.observables["escaped"][-1] < n


def test_rooms_that_touch_at_a_wall_are_refused():
    gate = swarm.Opening(swarm.Box((0.2, 0.2, 0.2), (0.5, 1.0, 0.0)), between=True)
    boxes = [swarm.Box((1.0, 0.5, 0.4), (1.0, 0.5, 0.0)), swarm.Box((0.5, 0.5, 0.4), (0.5, 1.5, 0.0), openings=[gate])]
    body = swarm.Body([(0.0, 0.0, 0.0)], mass=[1.0])
    start = swarm.Bodies(body, np.full((3, 1, 1), 0.3), np.ones((3, 1, 1)))
    with pytest.raises(swarm.SceneError, match="must not have rooms that touch at a wall between them with bodies"):
        swarm.simulate(swarm.Scene([swarm.Union(boxes)]), start, swarm.Impact(dt=0.1), until=1.0)


def test_a_union_beside_a_cavity_of_the_body_is_refused():
    body = swarm.Body(
        [(0.0, 0.0, 0.0), (0.02, 0.0, 0.0)], mass=[1.0, 0.5], contacts=[0], cavities=[(swarm.Sphere(0.05), 0, 1)]
    )
    start = swarm.Bodies(body, np.array([[0.3, 0.32], [0.3, 0.3], [0.0, 0.0]])[..., None], np.zeros((3, 2, 1)))
    with pytest.raises(swarm.SceneError, match="with a body that has guides or cavities"):
        swarm.simulate(swarm.Scene([ROOMS["union"]()]), start, swarm.Impact(dt=0.1), until=1.0)


@pytest.mark.parametrize("kind", [swarm.Union, swarm.Intersection])
def test_each_part_has_its_own_restitution(kind):
    """A point meets the part that loses energy, and that which does not."""
    parts = [swarm.Sphere(1.0, (x, 0.0, 0.0), restitution=e) for x, e in ((-0.2, 0.5), (0.2, 1.0))]
    body = swarm.Body([(0.0, 0.0, 0.0)], mass=[2.0])
    lost = []
    for way in (-1.0, 1.0):
        start = swarm.Bodies(body, np.zeros((3, 1, 1)), np.array([way, 0.0, 0.0])[:, None, None])
        done = swarm.simulate(
            swarm.Scene([kind(parts)]), start, swarm.Impact(dt=0.1), until=1.4, every=0.7, compile="never"
        )
        assert done.observables["impacts"][-1] == 1
        lost.append(done.observables["dissipated_energy"][-1])
    np.testing.assert_allclose(sorted(lost), [0.0, 0.75], atol=1e-12)


@pytest.mark.slow
def test_dice_come_to_rest_in_a_mesh():
    # The forces of a short step were left out where a die fell through a facet: behind one its distance is negative.
    die = swarm.rigid([(x, y, z) for x in (-0.1, 0.1) for y in (-0.1, 0.1) for z in (-0.1, 0.1)], density=1000.0)
    random, places = np.random.default_rng(0), []
    for _ in range(50):
        turned = die.points @ np.linalg.qr(np.eye(3) + 0.05 * random.normal(size=(3, 3)))[0]
        places.append((turned - (0.0, 0.0, 0.999 + (np.asarray(die.contacts) @ turned)[:, 2].min())).T)
    dice = np.stack(places, axis=-1)
    thrown = swarm.Bodies(die, dice, np.broadcast_to(np.array([0.3, 0.1, 0.0])[:, None, None], dice.shape))
    vessel = swarm.Scene([box_of_triangles(restitution=0.7, friction=0.3)], gravity=(0.0, 0.0, -9.81))
    done = swarm.simulate(vessel, thrown, swarm.Impact(dt=2e-3), until=1.0)
    assert done.observables["energy_error"].max() < 1e-12
    np.testing.assert_allclose(done.observables["total_energy"][-1], -50 * 8.0 * 9.81 * 0.9, rtol=1e-9)
