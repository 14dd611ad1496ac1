"""Speed x stiffness x thickness x solid: a soft ball stays on its side of a solid and of another ball, or the run ends.

So does a point at a soft solid. Whether it did is seen by the way of its centre from step to step alone.
"""

import numpy as np
import pytest

import swarm

RADIUS, MASS = 0.01, 0.01
# The last two fly far behind a side of a polygon in one step.
SEEDS = (*range(24), 1112, 1402)
ROOM = swarm.Box((50.0, 50.0, 50.0))
SIDES = np.array([
    (0, 1, 3), (0, 3, 2), (4, 7, 5), (4, 6, 7), (0, 4, 5), (0, 5, 1),
    (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3),
])  # fmt: skip
SIGNS = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
# What says that a contact was too much for the method.
SENTENCES = ("too soft for the speed", "jump", "did not converge", "radii of the largest ball", "were not solved")
# Points between two steps.
BETWEEN = np.linspace(0.0, 1.0, 3)


def bent(half):
    """An L, whose faces are no convex body, as a mesh; its one arm is `half` thick."""
    outline = np.array(
        [(-half, -0.1), (half, -0.1), (half, 0.1 - 2.0 * half), (0.1, 0.1 - 2.0 * half), (0.1, 0.1), (-half, 0.1)]
    )
    n = len(outline)
    points = np.concatenate([np.column_stack([outline, np.full(n, z)]) for z in (-0.1, 0.1)])
    lid = [(0, 1, 2), (0, 2, 5), (2, 3, 4), (2, 4, 5)]
    faces = [(a, c, b) for a, b, c in lid] + [(a + n, b + n, c + n) for a, b, c in lid]
    for i in range(n):
        j = (i + 1) % n
        faces += [(i, j, j + n), (i, j + n, i + n)]
    return swarm.Mesh(points, faces, side="outside")


# A solid of a half thickness along x.
SOLIDS = {
    "box": lambda half: swarm.Box((half, 0.1, 0.1), side="outside"),
    "mesh": lambda half: swarm.Mesh(SIGNS * (half, 0.1, 0.1), SIDES, side="outside"),
    "bent mesh": bent,
    "plate": lambda half: swarm.Slab((1.0, 0.0, 0.0), half, side="outside"),
    "cylinder": lambda half: swarm.Cylinder(half, side="outside"),
    "can": lambda half: swarm.Cylinder(0.1, axis=(1.0, 0.0, 0.0), length=2.0 * half, side="outside"),
    "sphere": lambda half: swarm.Sphere(half, side="outside"),
    "rod": lambda half: swarm.Capsule(half, 0.1, axis=(0.0, 0.0, 1.0), side="outside"),
    "polygon": lambda half: swarm.Polygon([(-half, -0.1), (half, -0.1), (half, 0.1), (-half, 0.1)], side="outside"),
    "boxes": lambda half: swarm.Boxes([(0.0, 0.0, 0.0), (0.5, 0.0, 0.0)], (half, 0.1, 0.1)),
}  # fmt: skip


def drawn(random):
    """A method and a speed: from contacts that are short and shallow to those that are passed in a step."""
    exponent = float(random.choice([1.0, 1.5, 2.0]))
    speed, relative_depth = 10.0 ** random.uniform(-1.0, 2.5), 10.0 ** random.uniform(-1.5, 1.0)
    penalty = 0.5 * (exponent + 1.0) * MASS * speed**2 / (relative_depth * RADIUS) ** (exponent + 1.0)
    # A contact takes about 3 depths over the speed.
    steps = 10.0 ** random.uniform(0.0, 1.5)
    return speed, swarm.Penalty(3.0 * min(relative_depth, 2.0) * RADIUS / speed / steps, penalty, exponent)


def flown(scene, start, method, steps):
    """The places of all after each step, (steps, 3, N), or None where the run ended with a sentence."""
    try:
        result = swarm.simulate(
            scene, start, method, until=steps * method.dt, every=method.dt, compile="never", progress=False,
            observables={"place": lambda frame: frame.position},
        )  # fmt: skip
    except swarm.SwarmError as error:
        message = str(error)
    else:
        if start.radius is not None:
            assert result.observables["largest_overlap"].max() <= start.radius.max(), start
        return result.observables["place"]
    assert any(sentence in message for sentence in SENTENCES), message
    return None


def between(places):
    """All places and those between them, (3, ...)."""
    ways = places[:-1, None] + BETWEEN[None, :, None, None] * (places[1:] - places[:-1])[:, None]
    return np.moveaxis(ways, 2, 0)


def against_a_solid(seed):
    random = np.random.default_rng([55, seed])
    speed, method = drawn(random)
    name, half = str(random.choice(sorted(SOLIDS))), RADIUS * 10.0 ** random.uniform(-1.0, 0.5)
    solid = SOLIDS[name](half)
    aim = random.uniform(-0.08, 0.08, 3) * (0.0, 1.0, 1.0) * (0.1 if name in ("sphere", "cylinder", "rod") else 1.0)
    way = np.array([1.0, *random.normal(0.0, 0.2, 2)])
    way /= np.linalg.norm(way)
    start = swarm.Particles(aim - (RADIUS + half + 0.01) * way, speed * way, MASS, radius=RADIUS)
    law = {"restitution": float(random.choice([1.0, 0.5]))}
    scene = swarm.Scene([ROOM, swarm.Box(solid.half_widths, side="outside", **law) if name == "box" else solid])
    steps = min(200, int(np.ceil(3.0 * (2.0 * RADIUS + 2.0 * half + 0.02) / speed / method.dt)))
    places = flown(scene, start, method, steps)
    if places is None:
        return "refused"
    inside = solid.phi(between(places).reshape(3, -1)) < -1e-12 * half
    assert not inside.any(), (
        f"seed {seed}: {name}, half = {half:g} m, {speed:g} m/s, {method}: {scene}, {start.velocity}"
    )
    return "held"


def against_a_ball(seed):
    random = np.random.default_rng([56, seed])
    speed, method = drawn(random)
    radius = RADIUS * np.array([1.0, random.choice([1.0, 0.3, 3.0])])
    mass = MASS * np.array([1.0, random.choice([1.0, 0.1, 10.0])])
    way = random.normal(size=3)
    way /= np.linalg.norm(way)
    offset = np.cross(way, random.normal(size=3)) * 0.3 * radius.sum()
    start = swarm.Particles(
        np.array([-1.1 * radius.sum() * way, offset]).T,
        np.array([speed * way, -0.5 * speed * way]).T,
        mass,
        radius=radius,
    )
    steps = min(200, int(np.ceil(3.0 * radius.sum() / speed / method.dt)))
    places = flown(swarm.Scene([ROOM]), start, method, steps)
    if places is None:
        return "refused"
    ways = between(places)
    apart = np.sqrt(((ways[..., 0] - ways[..., 1]) ** 2).sum(axis=0))
    assert apart.min() >= radius.max() * (1.0 - 1e-12), f"seed {seed}: {speed:g} m/s, {method}, {radius}, {mass}"
    return "held"


# Of points: thin solids, and what is round.
PLATES, ROUND = ("box", "plate", "can"), ("sphere", "cylinder", "rod", "ellipsoid", "tilted box")
MORE = {
    "ellipsoid": lambda half: swarm.Ellipsoid((half, 2.0 * half, 1.5 * half), side="outside"),
    "tilted box": lambda half: swarm.Box(
        (half, 0.1, 0.1), side="outside", rotation={"axis": (0.0, 1.0, 1.0), "angle": 0.3}
    ),
}
METHODS = (swarm.Penalty, swarm.Penalty, swarm.Verlet, swarm.Midpoint, swarm.Trapezoidal)


def point_at_a_solid(seed):
    """A point leaves a plate on the side that it came from, and what is round not opposite to where it came in."""
    random = np.random.default_rng([57, seed])
    half, speed = RADIUS * 10.0 ** random.uniform(-1.0, 0.5), 10.0 ** random.uniform(-1.0, 2.5)
    exponent, relative_depth = float(random.choice([1.0, 1.5, 2.0])), 10.0 ** random.uniform(-1.5, 1.0)
    name = str(random.choice(PLATES + ROUND))
    solid = {**SOLIDS, **MORE}[name](half)
    # Of a depth in m
    slope = float(np.sqrt((solid.gradient([[-1.001 * half], [0.0], [0.0]]) ** 2).sum()))
    penalty = 0.5 * (exponent + 1.0) * MASS * speed**2 / (relative_depth * half * slope) ** (exponent + 1.0)
    steps = 10.0 ** random.uniform(0.0, 1.5)
    dt = min(3.0 * min(relative_depth, 2.0) / steps, 1.9) * half / speed
    kind = METHODS[random.integers(len(METHODS))]
    # The midpoint rule feels nothing where its middle is outside.
    method = kind(0.25 * dt if kind is swarm.Midpoint else dt, penalty, exponent)
    dt = method.dt
    way = np.array([1.0, *random.normal(0.0, 0.2, 2)])
    way /= np.linalg.norm(way)
    flat = name in (*PLATES, "tilted box")
    aim = random.uniform(-0.03, 0.03, 3) * (0.0, 1.0, 1.0) if flat else half * random.uniform(-0.9, 0.9, 3)
    start = swarm.Particles(aim - (2.5 + 5.0 * random.uniform()) * half * way - 0.02 * flat * way, speed * way, MASS)
    count = min(400, int(np.ceil((14.0 * half + 0.04 * flat) / speed / dt)))
    case = f"seed {seed}: {name}, half = {half:g} m, {speed:g} m/s, {method}, {start.position}, {start.velocity}"
    places = flown(swarm.Scene([ROOM, solid]), start, method, count)
    if places is None:
        return "refused"
    places = places[:, :, 0].T
    depth = -solid.phi(places)
    inside = np.flatnonzero(depth > 0.0)
    if not len(inside) or inside[-1] + 1 >= places.shape[1]:
        return "missed"
    ends = solid.gradient(places[:, [max(inside[0] - 1, 0), inside[-1] + 1]])
    cosine = float(ends[:, 0] @ ends[:, 1] / np.linalg.norm(ends, axis=0).prod())
    assert cosine > (0.0 if flat else -0.8), (case, cosine)
    return "held"


@pytest.mark.parametrize("kind", [against_a_solid, against_a_ball])
def test_a_ball_stays_on_its_side_or_the_run_ends(kind):
    found = [kind(seed) for seed in SEEDS]
    assert {"held", "refused"} == set(found)


@pytest.mark.long
@pytest.mark.parametrize("kind", [against_a_solid, against_a_ball])
@pytest.mark.parametrize("first", range(1000, 3000, 100))
def test_many_balls_stay_on_their_sides_or_their_runs_end(kind, first):
    found = [kind(seed) for seed in range(first, first + 100)]
    assert {"held", "refused"} == set(found)


def test_a_point_stays_on_its_side_or_the_run_ends():
    found = [point_at_a_solid(seed) for seed in range(12)]
    assert {"held", "refused"} <= set(found)


@pytest.mark.long
@pytest.mark.parametrize("first", range(1000, 4000, 100))
def test_many_points_stay_on_their_sides_or_their_runs_end(first):
    found = [point_at_a_solid(seed) for seed in range(first, first + 100)]
    assert {"held", "refused"} <= set(found)
