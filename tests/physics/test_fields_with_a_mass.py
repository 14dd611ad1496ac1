"""Walls with a mass that are fields or have parts, and such walls beside one with a mass: against boxes and balls."""

import numpy as np
import pytest

import swarm

HALF, UP = (0.4, 0.45, 0.5), (0.0, 0.0, 1.0)
RADII = [None, 0.04]


def mesh(**given):
    corners = np.array([(x, y, z) for x in (-0.4, 0.4) for y in (-0.45, 0.45) for z in (-0.5, 0.5)])
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return swarm.Mesh(corners, [three for a, b, c, d in quads for three in ((a, b, c), (a, c, d))], **given)


def prism(**given):
    return swarm.Prism([(-0.4, -0.45), (0.4, -0.45), (0.4, 0.45), (-0.4, 0.45)], 1.0, **given)


def slabs(**given):
    return swarm.Intersection([swarm.Slab(axis, half) for axis, half in zip(np.eye(3), HALF, strict=True)], **given)


KINDS = {"mesh": mesh, "prism": prism, "intersection": slabs}
# How impacts may move them.
WAYS = {
    "free": {"mass": 3.0}, "falling": {"mass": 3.0},
    "on a spring": {"mass": 3.0, "motion": swarm.Guide((1.0, 2.0, 2.0), stiffness=40.0)},
    "hinged": {"inertia": 0.7, "motion": swarm.Rotation(UP, 0.3, (0.1, 0.0, 0.0))},
    "pendulum": {"mass": 2.0, "inertia": 0.7, "motion": swarm.Rotation((0.0, 1.0, 0.0), 0.2, (0.0, 0.0, 0.6))},
}  # fmt: skip


def start(radius):
    random = np.random.default_rng(7)
    particles = swarm.Particles(random.uniform(-0.25, 0.25, (3, 6)), random.normal(size=(3, 6)), 1.0)
    if radius is not None:
        particles.position = 0.16 * np.array([(i, j, 0.0) for i in (-1, 1) for j in (-1, 0, 1)]).T
        particles.radius = np.full(6, radius)
    return particles


def run(surfaces, particles, until=1.5, **options):
    scene = swarm.Scene(surfaces, options.pop("gravity", None))
    return swarm.simulate(scene, particles, swarm.Impact(), until=until, every=until / 3, compile="never", **options)


@pytest.mark.parametrize("radius", RADII)
@pytest.mark.parametrize(
    # An intersection has no centre that the weight of a pendulum could be at.
    ("kind", "way"), [(kind, way) for kind in KINDS for way in WAYS if (kind, way) != ("intersection", "pendulum")],
)  # fmt: skip
def test_a_box_by_other_names(kind, way, radius):
    gravity = (0.1, 0.2, -1.0) if way in ("pendulum", "falling") else None
    walls = KINDS[kind](**WAYS[way]), swarm.Box(HALF, **WAYS[way])
    one, other = (run([wall], start(radius), gravity=gravity) for wall in walls)
    assert one.observables["impacts"][-1] == other.observables["impacts"][-1] > 5
    np.testing.assert_allclose(one.particles.position, other.particles.position, rtol=0.0, atol=1e-9)
    for name in ("wall_position", "wall_velocity", "wall_spin"):
        np.testing.assert_allclose(one.observables[name], other.observables[name], rtol=0.0, atol=1e-9)
    assert one.observables["energy_error"].max() <= 1e-12
    assert one.observables["max_penetration"].max() <= 1e-12
    if way == "free":
        whole = one.observables["momentum"] + 3.0 * one.observables["wall_velocity"][:, 0]
        np.testing.assert_allclose(whole, whole[:1].repeat(len(whole), 0), rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("radius", RADII)
def test_momentum_and_energy_of_a_cluster_of_balls(radius):
    """Three balls of one mass in a vessel: what the vessel takes is all that is missing of the momentum."""
    centers = [(-0.1, 0.0, 0.0), (0.15, 0.05, 0.0), (0.0, 0.1, 0.2)]
    cluster = swarm.Spheres(centers, [0.15, 0.1, 0.12], mass=2.0)
    particles = start(radius)
    particles.position = 0.6 * np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)], float).T
    particles.velocity = -0.8 * particles.position + 0.05 * particles.velocity
    result = run([cluster], particles, until=2.0)
    seen = result.observables
    assert seen["impacts"][-1] >= 4
    whole = seen["momentum"] + 2.0 * seen["wall_velocity"][:, 0]
    np.testing.assert_allclose(whole, whole[:1].repeat(len(whole), 0), rtol=0.0, atol=1e-12)
    assert seen["energy_error"].max() <= 1e-13
    assert seen["max_penetration"].max() <= 1e-13


def test_a_particle_and_a_ball_of_a_field_in_line():
    """Collisions in one dimension in closed form, and the rows of the log are those of the member that was struck."""
    cluster = swarm.Spheres([(0.0, 5.0, 0.0), (0.0, 0.0, 0.0)], 0.1, mass=3.0, motion=swarm.Guide((1.0, 0.0, 0.0)))
    particle = swarm.Particles([[-0.6], [0.0], [0.0]], [[1.0], [0.0], [0.0]], 1.0)
    result = run([cluster], particle, until=2.0, member_impacts=True)
    np.testing.assert_allclose(result.particles.velocity[:, 0], (-0.5, 0.0, 0.0), atol=1e-15)
    np.testing.assert_allclose(result.observables["wall_velocity"][-1, 0], (0.5, 0.0, 0.0), atol=1e-15)
    assert result.observables["member_impacts"][-1].tolist() == [0, 1]


@pytest.mark.parametrize(
    # Balls do not meet a union of rooms.
    ("kind", "radius"), [*((kind, radius) for kind in KINDS for radius in RADII), ("union", None)],
)  # fmt: skip
def test_beside_a_wall_with_a_mass(kind, radius):
    """A ball with a mass in a vessel that is a box by another name, or of two boxes with a face in common."""
    if kind == "union":
        halves = [swarm.Box((0.4, 0.45, 0.25), (0.0, 0.0, z)) for z in (-0.25, 0.25)]
        vessel = swarm.Union(halves)
    else:
        vessel = KINDS[kind]()
    particles = start(radius)
    particles.position = particles.position + np.array([[0.0], [0.0], [0.2]])
    ball = swarm.Sphere(0.08, (0.0, 0.0, -0.2), "outside", mass=4.0)
    one, other = (run([wall, ball], particles, 2.0, gravity=(0.0, 0.0, -1.0)) for wall in (vessel, swarm.Box(HALF)))
    assert one.observables["impacts"][-1] == other.observables["impacts"][-1] > 5
    assert one.observables["impulse"][-1, 1] > 0.0
    np.testing.assert_allclose(one.particles.position, other.particles.position, rtol=0.0, atol=1e-8)
    np.testing.assert_allclose(one.observables["impulse"], other.observables["impulse"], rtol=0.0, atol=1e-8)
    np.testing.assert_allclose(one.observables["wall_position"], other.observables["wall_position"], atol=1e-8)
    assert one.observables["energy_error"].max() <= 1e-12
    assert one.observables["max_penetration"].max() <= 1e-12


def test_groups_of_a_mesh_with_a_mass():
    made = mesh()
    names = {"group": np.zeros(12, int), "names": ("all",), "groups": {"all": {"restitution": 0.5}}}
    with pytest.raises(swarm.SceneError, match="groups must be None for a Mesh with a mass or an inertia, got"):
        swarm.Mesh(made.vertices, made.triangles, mass=1.0, **names)


@pytest.mark.parametrize("gravity", [None, (0.1, -0.3, -1.0)])
def test_rooms_with_a_door_between_them_beside_a_wall_with_a_mass(gravity):
    """As without that wall, which is far away; through a hole in the outer wall some escape."""
    hole, door = swarm.Sphere(0.4, (1.0, 0.0, 0.0)), swarm.Opening(swarm.Sphere(0.3), [(0.3, 3.0)], between=True)
    rooms = swarm.Union([swarm.Box((0.5, 0.4, 0.3), (x, 0.0, 0.0)) for x in (-0.5, 0.5)], openings=[hole, door])
    far = swarm.Plane((1.0, 0.0, 0.0), 50.0, mass=2.0, motion=swarm.Guide((1.0, 0.0, 0.0)))
    places = np.array([(-0.5, 0.0, 0.0), (0.5, 0.1, 0.05), (-0.5, 0.3, 0.2), (0.5, -0.2, 0.1)]).T
    particles = swarm.Particles(places, np.array([(1, 0, 0), (1, 0.1, 0), (1, 0.2, -0.3), (-1, 0.3, 0.2)]).T, 1.0)
    one, other = (run(walls, particles, until=2.0, gravity=gravity) for walls in ([rooms, far], [rooms]))
    assert 0 < other.observables["escaped"][-1] < 4
    assert (one.particles.position[0] * places[0] < 0.0).any()
    np.testing.assert_allclose(one.escape_time, other.escape_time, rtol=1e-9)
    np.testing.assert_allclose(one.particles.position, other.particles.position, rtol=0.0, atol=1e-8)
    assert one.observables["max_penetration"].max() <= 1e-12
    assert one.observables["energy_error"].max() <= 1e-12
