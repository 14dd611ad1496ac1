"""Scenes of two dimensions: starts, walls and pictures in a plane, and what would leave it."""

import math

import numpy as np
import pytest
import trimesh

import swarm
from swarm import scene_file
from swarm.kernel.random import flux_maxwellian, uniforms
from swarm.kernel.vector import Vec, cross, dot
from swarm.serialization import tables
from swarm.surfaces.shapes.slab import AXES
from swarm.triangles.shapes import shapes_of

ACROSS = {"x": 0, "y": 1, "z": 2}
CIRCLE = swarm.Sphere(0.5)


def run(scene, particles, until=4.0, **options):
    return swarm.simulate(scene, particles, swarm.Impact(), until=until, **{"compile": "never", **options})


# --- Starts ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("plane", ACROSS)
def test_fill_is_uniform_in_the_plane(plane):
    scene, across = swarm.Scene([CIRCLE], plane=plane), ACROSS[plane]
    start = swarm.fill(scene, 20_000, speed=2.0, seed=3)
    assert start.volume == pytest.approx(math.pi * 0.25, rel=5e-3)
    assert not start.position[across].any()
    assert not start.velocity[across].any()
    assert np.allclose(np.sqrt((start.velocity**2).sum(axis=0)), 2.0, rtol=1e-15)
    # Of a uniform disc the mean of r^2 is R^2/2, of a direction that of each square 1/2.
    assert (start.position**2).sum(axis=0).mean() == pytest.approx(0.125, rel=0.02)
    first = start.velocity[(across + 1) % 3] / 2.0
    assert (first**2).mean() == pytest.approx(0.5, rel=0.02)


def test_a_gas_in_the_plane_has_two_degrees_of_freedom():
    scene = swarm.Scene([CIRCLE], plane="z")
    mass = np.linspace(1.0, 3.0, 5000)
    start = swarm.fill(scene, 5000, temperature=2.0, mass=mass, seed=1, exact=True)
    assert 0.5 * (mass * (start.velocity**2).sum(axis=0)).mean() == pytest.approx(2.0, rel=1e-14)
    loose = swarm.fill(scene, 5000, temperature=2.0, mass=mass, seed=1)
    assert 0.5 * (mass * (loose.velocity**2).sum(axis=0)).mean() == pytest.approx(2.0, rel=4.0 / math.sqrt(5000.0))


def test_a_scene_without_a_plane_is_filled_as_before():
    first, again = (swarm.fill(swarm.Scene([CIRCLE], plane=None), 10, speed=1.0, seed=1) for _k in range(2))
    assert (first.position == again.position).all()
    assert first.position[2].any()


# --- What stays in the plane -----------------------------------------------------------------------------

TABLES = {
    "circle": [CIRCLE],
    "ellipse": [swarm.Ellipsoid((0.5, 0.3, 0.4), rotation={"axis": (0, 0, 1), "angle": 0.7})],
    "box and discs": [
        swarm.Box((0.6, 0.5, 0.1), rotation={"axis": (0, 0, 1), "angle": 0.3}),
        swarm.Spheres([(0.1, 0.1, 0.0), (-0.2, -0.1, 0.0)], [0.1, 0.15]),
    ],
    "capsule": [swarm.Capsule(0.3, 0.4, axis=(1, 2, 0)), swarm.Capsule(0.05, 0.1, axis=(3, 1, 0), side="outside")],
    "tube": [swarm.Cylinder(0.3, axis=(2, 1, 0), length=1.0)],
    "stadium": [swarm.Stadium(0.3, 0.4, rotation={"axis": (0, 0, 1), "angle": 0.4})],
}


@pytest.mark.parametrize("pull", [None, (0.1, -0.5, 0.0)], ids=["straight", "gravity"])
@pytest.mark.parametrize("name", TABLES)
def test_particles_stay_in_it_exactly(name, pull):
    scene = swarm.Scene(TABLES[name], gravity=pull, plane="z")
    start = swarm.fill(scene, 6, speed=1.0, seed=2)
    end = run(scene, start)
    assert end.observables["impacts"][-1] > 20
    assert not end.particles.position[2].any()
    assert not end.particles.velocity[2].any()
    assert end.observables["energy_error"].max() < 2e-15


def test_the_circle_keeps_the_angular_momentum_and_the_ellipse_the_product_of_those_about_its_foci():
    circle = swarm.Scene([CIRCLE], plane="z")
    start = swarm.fill(circle, 20, speed=1.0, seed=2)
    end = run(circle, start, until=20.0).particles

    def momentum(p, x=0.0):
        return (p.position[0] - x) * p.velocity[1] - p.position[1] * p.velocity[0]

    assert np.abs(momentum(end) - momentum(start)).max() < 1e-14
    ellipse = swarm.Scene([swarm.Ellipsoid((0.5, 0.3, 0.9))], plane="z")
    start = swarm.fill(ellipse, 20, speed=1.0, seed=2)
    end = run(ellipse, start, until=20.0).particles
    product = [momentum(p, 0.4) * momentum(p, -0.4) for p in (start, end)]
    assert np.abs(product[1] - product[0]).max() < 1e-14


# --- Walls that give heat --------------------------------------------------------------------------------


@pytest.mark.parametrize("axis", range(3))
def test_a_thermal_wall_sends_particles_off_along_the_plane_by_the_cosine_law(axis):
    normal = [0.0, 0.0, 0.0]
    normal[(axis + 1) % 3], normal[(axis + 2) % 3] = 0.6, -0.8
    n = Vec(*normal)
    sent = [flux_maxwellian(n, 1.5, uniforms(1, 0, k), AXES[axis](1.0)) for k in range(4000)]
    v = np.array(sent)
    assert not v[:, axis].any()
    away = -np.array([dot(n, one) for one in sent])
    assert (away > 0.0).all()
    # Rayleigh's and Gauss' laws, and the angles: their sines are uniform in (-1, 1).
    assert (away**2).mean() == pytest.approx(2.0 * 1.5, rel=0.06)
    along = np.sqrt((v**2).sum(axis=1) - away**2)
    assert (along**2).mean() == pytest.approx(1.5, rel=0.08)
    tangent = np.cross(np.eye(3)[axis], normal)
    sine = np.sort(v @ tangent / np.sqrt((v**2).sum(axis=1)))
    uniform = np.linspace(-1.0, 1.0, len(sine))
    assert np.abs(sine - uniform).max() < 2.0 * 1.63 / math.sqrt(len(sine))


def test_a_hot_wall_beside_one_with_a_mass_sends_particles_along_the_plane():
    scene = swarm.Scene([swarm.Cylinder(0.5, temperature=2.0), swarm.Plane((1, 0, 0), 0.3, mass=10.0)], plane="z")
    start = swarm.fill(scene, 3, speed=1.0, seed=1)
    end = swarm.simulate(scene, start, swarm.Impact(), until=2.0, compile="never").particles
    assert not end.position[2].any()
    assert not end.velocity[2].any()
    assert (end.velocity != start.velocity)[:2].all()


def test_a_gas_between_warm_walls_of_the_plane_takes_their_temperature():
    scene = swarm.Scene([swarm.Sphere(0.5, temperature=2.0)], plane="z")
    start = swarm.fill(scene, 400, speed=0.5, seed=1)
    end = swarm.simulate(scene, start, swarm.Impact(), until=20.0, seed=3).particles
    assert not end.velocity[2].any()
    # Two degrees of freedom
    assert 0.5 * (end.velocity**2).sum(axis=0).mean() == pytest.approx(2.0, rel=4.0 / math.sqrt(400.0))


class Upwards(swarm.WallLaw):
    """A law that leaves the plane."""

    part: float

    def leave(self, v, n, u, random, mass):
        return v - 2.0 * dot(v - u, n) * n + self.part * cross(n, v)


# --- What would leave it ---------------------------------------------------------------------------------

OUT = {
    "plane": (lambda: swarm.Scene([CIRCLE], plane="w"), ["plane", "'x', 'y' and 'z'", "got 'w'"]),
    "gravity": (lambda: swarm.Scene([CIRCLE], gravity=(0, 0, -1), plane="z"), ["gravity[2] must be 0", "got -1"]),
    "a ball beside it": (
        lambda: swarm.Scene([swarm.Sphere(0.5, center=(0, 0, 0.1))], plane="z"),
        ["surfaces[0] must stand upright on the plane z = 0", "11.5 degrees", "center with z = 0, got 0.1"],
    ),
    "a wall that leans": (
        lambda: swarm.Scene([CIRCLE, swarm.Plane((0, 1, 1), 0.1)], plane="z"),
        ["surfaces[1] must stand upright", "Plane", "45 degrees"],
    ),
    "the plane itself": (
        lambda: swarm.Scene([CIRCLE, swarm.Plane((0, 0, 1), 0.0)], plane="z"),
        ["surfaces[1] must stand upright", "90 degrees"],
    ),
    "a box that is tilted": (
        lambda: swarm.Scene([swarm.Box((1, 1, 1), rotation={"axis": (1, 0, 0), "angle": 0.1})], plane="z"),
        ["surfaces[0] must stand upright", "5.73 degrees"],
    ),
    "balls beside it": (
        lambda: swarm.Scene([CIRCLE, swarm.Spheres([(0.1, 0, 0), (-0.2, 0, 0.02)], 0.05)], plane="z"),
        ["surfaces[1] must stand upright", "all its bodies"],
    ),
    "an outline that lies": (
        lambda: swarm.Scene([swarm.Stadium(1.0, 1.0, axis=(1, 0, 0))], plane="z"),
        ["surfaces[0] must stand upright", "Stadium with its axis along (1, 0, 0)", "axis = (0.0, 0.0, 1.0)"],
    ),
    "a motion": (
        lambda: swarm.Scene([swarm.Sphere(0.5, motion=swarm.Translation((0, 0, 1.0)))], plane="z"),
        ["surfaces[0].motion must stay in the plane", "velocity[2] = 1"],
    ),
    "a turn": (
        lambda: swarm.Scene([swarm.Sphere(0.5, motion=swarm.Rotation((0, 1, 1), 1.0, (0, 0, 0)))], plane="z"),
        ["surfaces[0].motion must stay in the plane", "Rotation about the axis"],
    ),
    "a law": (
        lambda: swarm.Scene([swarm.Sphere(0.5, laws=[Upwards(0.1)])], plane="z"),
        ["surfaces[0].laws[0] must send particles along the plane"],
    ),
    "a start": (
        lambda: run(swarm.Scene([CIRCLE], plane="z"), swarm.Particles([[0, 0.1], [0, 0], [0, 0.02]], np.eye(3)[:, :2])),
        ["1 of 2 out of it", "particle 1, by 0.02 m", "particles.position[2]"],
    ),
    "a velocity": (
        lambda: run(swarm.Scene([CIRCLE], plane="x"), swarm.Particles([0, 0, 0.1], [-0.5, 1, 0])),
        ["velocity out of it", "particle 0, by -0.5 m/s", "particles.velocity[0]"],
    ),
    "bodies": (
        lambda: swarm.simulate(
            swarm.Scene([CIRCLE], plane="z"),
            swarm.place(swarm.Scene([CIRCLE]), swarm.dumbbell(0.1, 1.0), 1),
            swarm.Impact(dt=0.1),
            until=1.0,
        ),
        ["must be in the plane z = 0", "all points of a body must lie, and move, in it"],
    ),
    "bodies at soft walls": (
        lambda: swarm.simulate(
            swarm.Scene([CIRCLE], plane="z"),
            swarm.place(swarm.Scene([CIRCLE]), swarm.dumbbell(0.1, 1.0), 1),
            swarm.Penalty(dt=0.1, penalty=1e3),
            until=1.0,
        ),
        ["plane must be None with bodies and Penalty"],
    ),
}


@pytest.mark.parametrize("case", OUT)
def test_what_would_leave_it_is_refused_in_a_sentence(case):
    make, parts = OUT[case]
    with pytest.raises(swarm.SceneError) as caught:
        make()
    assert all(part in str(caught.value) for part in parts), str(caught.value)


def test_a_mesh_is_refused_in_a_sentence(tmp_path):
    trimesh.creation.box((1.0, 1.0, 1.0)).export(tmp_path / "box.stl")
    with pytest.raises(swarm.SceneError, match=r"surfaces\[0\] must stand upright .* got a Mesh.*swarm.Polygon"):
        swarm.Scene([swarm.Mesh(tmp_path / "box.stl")], plane="z")


def test_what_does_not_reach_the_plane_may_lean():
    far = swarm.Sphere(0.1, center=(0.0, 0.0, 3.0), side="outside")
    assert swarm.Scene([CIRCLE, far, swarm.Slab((0, 0, 1), 0.2)], plane="z").size() == 0.1


# --- Its size, files and pictures ------------------------------------------------------------------------


def test_sizes_are_of_the_plane():
    scene = swarm.Scene([swarm.Plane((s, 0, 0), 2.0) for s in (1, -1)] + [swarm.Slab((0, 1, 0), 3.0)], plane="z")
    assert scene.bounds() == ((-2.0, -3.0, 0.0), (2.0, 3.0, 0.0))
    assert swarm.Scene([swarm.Plane((s, 0, 0), 2.0) for s in (1, -1)], plane="y").is_open()
    closed = swarm.Scene([swarm.Cylinder(1.0)], plane="z")
    assert not closed.is_open()
    assert closed.size() == 1.0


def test_files_and_tables_carry_the_plane(tmp_path):
    scene = swarm.Scene([CIRCLE], plane="y")
    assert repr(scene) == "Scene([Sphere(radius=0.5)], plane='y')"
    table = tables.scene_table(scene)
    assert table["plane"] == "y"
    assert tables.scene_of(table["surface"], None, plane="y") == scene
    run(scene, swarm.fill(scene, 3, speed=1.0), every=1.0, trajectory=tmp_path / "run.h5")
    with swarm.load(tmp_path / "run.h5") as trajectory:
        assert trajectory.scene == scene
        assert not trajectory.frame(-1).position[1].any()
    file = tmp_path / "scene.toml"
    file.write_text(
        'plane = "z"\n[particles]\ncount = 5\nspeed = 1.0\n[[surface]]\nkind = "stadium"\nradius = 1.0\nlength = 2.0\n'
        '[method]\nkind = "impact"\n[run]\nuntil = 1.0\nevery = 1.0\n'
    )
    job = scene_file.read(file)
    assert job.scene == swarm.Scene([swarm.Stadium(1.0, 2.0)], plane="z")
    assert not job.start().position[2].any()


@pytest.mark.parametrize("plane", ACROSS)
def test_shapes_are_curves_in_the_plane_whose_area_is_their_length(plane):
    scene = swarm.Scene([CIRCLE, swarm.Sphere(0.1, side="outside")], plane=plane)
    shapes = shapes_of(scene, np.zeros((3, 1)))
    assert [shape.area() for shape in shapes] == pytest.approx([math.pi, 0.2 * math.pi], rel=2e-3)
    assert all(not curve[:, ACROSS[plane]].any() for shape in shapes for curve in shape.wires)
    stadium = shapes_of(swarm.Scene([swarm.Stadium(1.0, 2.0)], plane="z"), np.zeros((3, 1)))[0]
    assert stadium.area() == pytest.approx(4.0 + 2.0 * math.pi, rel=1e-3)


def test_pictures_are_seen_from_above(tmp_path):
    scene = swarm.Scene([swarm.Box((1.0, 0.5, 0.3)), swarm.Spheres([(0.3, 0.1, 0.0)], 0.2)], plane="z")
    run(scene, swarm.fill(scene, 20, speed=1.0), every=1.0, trajectory=tmp_path / "run.h5")
    with swarm.load(tmp_path / "run.h5") as trajectory:
        figure = trajectory.plot(figsize=(8.0, 5.0))
        axes = figure.axes[0]
        assert (axes.get_xlabel(), axes.get_ylabel()) == ("x [m]", "y [m]")
        assert axes.get_xlim() == pytest.approx((-1.04, 1.04), rel=0.02)
        assert axes.get_ylim() == pytest.approx((-0.54, 0.54), rel=0.02)
        titles = {one.get_title(): one.get_ylabel() for one in figure.axes}
        assert titles["Pressure on the walls"] == "pressure [N/m]"
        film = trajectory.animate(tmp_path / "run.gif", size=(320, 240))
        assert film.is_file()
