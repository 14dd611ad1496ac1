"""Frames as .ply, walls as .obj, opened by trimesh, and as a sequence that is there as a whole or not at all."""

import os
import signal

import numpy as np
import pytest
import trimesh
from children import python

import swarm
from swarm.exports import obj
from swarm.files import replaced

CAVITY = swarm.Scene(surfaces=[swarm.Ellipsoid((0.3, 0.3, 0.6)), swarm.Sphere(0.1, (0.0, 0.0, 0.1), "outside")])
CELL = swarm.Scene(surfaces=[swarm.Sphere(0.2, side="outside"), swarm.Slab((0, 0, 1), 0.4)], period=(1.0, 1.0, None))
LEAKY = swarm.Scene(surfaces=[swarm.Sphere(0.5, openings=[swarm.Sphere(0.3, (0.0, 0.0, -0.5))])])
PLANE = swarm.Scene(surfaces=[swarm.Stadium(0.5, 1.0)], plane="z")
FAR = swarm.Scene(surfaces=[swarm.Sphere(0.5, center=(1e4, 0.0, -2e4))])
AROUND = swarm.Rotation((0, 0, 1), 2.0, (0.2, 0.0, 0.0))
SHAKEN = swarm.Scene(surfaces=[swarm.Box((0.5, 0.5, 0.5)), swarm.Sphere(0.1, side="outside", motion=AROUND)])
HEAVY = swarm.Scene(surfaces=[swarm.Box((0.5, 0.5, 0.5)), swarm.Sphere(0.1, side="outside", mass=0.5)])


def run(folder, scene, particles, **options):
    path = folder / "run.h5"
    method = swarm.Impact(dt=0.01) if isinstance(particles, swarm.Bodies) else swarm.Impact()
    swarm.simulate(
        scene, particles, method,
        **{"until": 0.5, "every": 0.1, "compile": "never", "trajectory": path, "seed": 1, **options},
    )  # fmt: skip
    return path


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    """A trajectory of each kind."""
    grains = swarm.fill(CAVITY, 4, speed=0.4, radius=[0.01, 0.02, 0.03, 0.04], seed=1)
    rods = swarm.place(CAVITY, swarm.dumbbell(0.05, 1.0), 3, speed=0.3, seed=2)
    dice = swarm.place(CAVITY, swarm.tetrahedron(0.05, 1.0), 4, speed=0.3, spin=2.0, seed=2)
    sticky = swarm.Scene([swarm.Sphere(0.5, laws=[swarm.Absorb(0.5)])])
    starts = {
        "cavity": (CAVITY, swarm.fill(CAVITY, 7, speed=0.4, mass=np.linspace(1.0, 2.0, 7), seed=1), {}),
        "cell": (CELL, swarm.fill(CELL, 6, speed=5.0, seed=1), {}),
        "leaky": (LEAKY, swarm.fill(LEAKY, 30, speed=2.0, seed=1), {}),
        "absorbing": (sticky, swarm.fill(sticky, 30, speed=2.0, seed=1), {}),
        "plane": (PLANE, swarm.fill(PLANE, 5, speed=1.0, seed=1), {}),
        "far": (FAR, swarm.fill(FAR, 5, speed=1.0, seed=1), {}),
        "shaken": (SHAKEN, swarm.fill(SHAKEN, 5, speed=0.4, seed=1), {}),
        "heavy": (HEAVY, swarm.fill(HEAVY, 5, speed=4.0, seed=1), {}),
        "grains": (CAVITY, grains, {}),
        "some": (CAVITY, swarm.fill(CAVITY, 9, speed=0.4, seed=1), {"frames": 2, "precision": "float32"}),
        "rods": (CAVITY, rods, {}),
        "dice": (CAVITY, dice, {}),
        "born": (CAVITY, None, {"sources": swarm.Source(0, times=(0.15, 0.35, 0.45), temperature=1.0)}),
        "none": (CAVITY, swarm.fill(CAVITY, 3, speed=0.4, seed=1), {"frames": "none"}),
    }
    return {
        name: run(tmp_path_factory.mktemp(name), scene, start, **more) for name, (scene, start, more) in starts.items()
    }


def elements(path):
    """What trimesh finds in a .ply: its elements by their names."""
    found = trimesh.load(path, process=False)
    raw = found.metadata["_ply_raw"]
    return {name: element["data"] for name, element in raw.items() if len(element["data"])}, found


def together(rows, names):
    return np.stack([rows[name] for name in names], axis=1)


@pytest.mark.parametrize("kind", ["cavity", "cell", "leaky", "absorbing", "plane", "shaken", "grains", "some"])
def test_trimesh_reads_the_particles_of_every_frame(stored, tmp_path, kind):
    with swarm.load(stored[kind]) as trajectory:
        files = trajectory.export(tmp_path / "out.ply")
        assert files == [tmp_path / f"out_{k:04}.ply" for k in range(6)]
        for k, path in enumerate(files):
            rows, cloud = elements(path)
            rows, expected = rows["vertex"], trajectory.columns(k)
            position, velocity = (expected[name].astype(np.float32) for name in ("position", "velocity"))
            np.testing.assert_array_equal(together(rows, "xyz"), position)
            np.testing.assert_array_equal(cloud.vertices, position)
            np.testing.assert_array_equal(together(rows, ("vx", "vy", "vz")), velocity)
            np.testing.assert_allclose(rows["speed"], np.sqrt((velocity**2).sum(axis=1)), rtol=1e-6)
            np.testing.assert_array_equal(rows["particle"], trajectory.ids)
            np.testing.assert_array_equal(rows["mass"], trajectory.frame(k).mass.astype(np.float32))
            assert ("radius" in rows.dtype.names) == (kind == "grains")
            if kind == "grains":
                np.testing.assert_array_equal(rows["radius"], trajectory.radius.astype(np.float32))
            # As in pictures: from slow to fast dark blue, red, orange.
            np.testing.assert_array_equal(cloud.colors[:, :3], together(rows, ("red", "green", "blue")))
            order = np.argsort(rows["speed"])
            assert (np.diff(rows["red"][order].astype(int)) >= 0).all()
            for flag, ends in (("escaped", "escape_time"), ("absorbed", "absorbed_time")):
                assert (flag in rows.dtype.names) == (ends in expected)
                if ends in expected:
                    np.testing.assert_array_equal(rows[flag] == 1, ~np.isnan(expected[ends]))
            if (kind, k) in (("leaky", 5), ("absorbing", 5)):
                assert 0 < rows["escaped" if kind == "leaky" else "absorbed"].sum() < 30
            assert f"comment swarm, frame {k}\n".encode() in path.read_bytes()
            assert f"comment time {trajectory.times[k].item()!r}\n".encode() in path.read_bytes()


def test_far_from_the_origin_positions_are_less_the_center(stored, tmp_path):
    with swarm.load(stored["far"]) as trajectory:
        (path,) = trajectory.export(tmp_path / "out.ply", frames=-1)
        (line,) = [line for line in path.read_bytes().splitlines() if line.startswith(b"comment center ")]
        center = np.array(line.split()[2:], float)
        np.testing.assert_allclose(
            together(elements(path)[0]["vertex"], "xyz") + center, trajectory.frame(-1).position.T, atol=1e-7
        )


def test_a_particle_that_comes_later_is_not_there_yet(stored, tmp_path):
    with swarm.load(stored["born"]) as trajectory:
        files = trajectory.export(tmp_path / "out.ply")
        counts = [len(trajectory.frame(k).born()) if k > 1 else 0 for k in range(6)]
        assert counts == [0, 0, 1, 1, 2, 3]
        for count, path in zip(counts, files, strict=True):
            assert f"element vertex {count}\n".encode() in path.read_bytes()
            if count:
                assert elements(path)[0]["vertex"]["particle"].tolist() == list(range(count))


def test_bodies_are_meshes_or_edges(stored, tmp_path):
    with swarm.load(stored["dice"]) as trajectory:
        (path,) = trajectory.export(tmp_path / "dice.ply", frames=3, particles=2)
        rows, mesh = elements(path)
        points, body = trajectory.frame(3).position.reshape(3, 4, 4), trajectory.body
    assert "edge" not in rows
    assert rows["vertex"]["body"].tolist() == [0, 2] * 4
    assert rows["vertex"]["particle"].tolist() == [4 * point + i for point in range(4) for i in (0, 2)]
    one, other = sorted(mesh.split(), key=lambda part: part.centroid[0])
    expected = sorted((points[:, :, i].mean(axis=1) for i in (0, 2)), key=lambda point: point[0])
    for part, middle in zip((one, other), expected, strict=True):
        assert part.is_watertight
        assert part.volume == pytest.approx(0.05**3 / (6.0 * 2.0**0.5), rel=1e-4)
        np.testing.assert_allclose(part.centroid, middle, atol=1e-6)
    assert len(body.faces) == 4

    with swarm.load(stored["rods"]) as trajectory:
        (path,) = trajectory.export(tmp_path / "rods.ply", frames=3, particles=2)
        rows, _cloud = elements(path)
    assert rows["vertex"]["body"].tolist() == [0, 2, 0, 2]
    edges = together(rows["edge"], ("vertex1", "vertex2"))
    at = together(rows["vertex"], "xyz")
    assert edges.tolist() == [[0, 2], [1, 3]]
    np.testing.assert_allclose(np.sqrt(((at[edges[:, 0]] - at[edges[:, 1]]) ** 2).sum(axis=1)), 0.05, rtol=1e-5)


# --- A sequence is whole ---------------------------------------------------------------------------------


def test_frames_of_an_older_longer_sequence_do_not_stay(stored, tmp_path):
    (tmp_path / "out_20240101.ply").write_text("a file of mine")
    (tmp_path / "out_2.ply").write_text("another one")
    mine = {"out_20240101.ply", "out_2.ply"}
    with swarm.load(stored["cavity"]) as trajectory:
        trajectory.export(tmp_path / "out.ply")
        with pytest.raises(swarm.SceneError, match=r"out_0000\.ply exists; choose another name, or overwrite it"):
            trajectory.export(tmp_path / "out.ply", frames=slice(2))
        # Without the first ones, what is left of the older sequence would follow the new one.
        for k in range(2):
            (tmp_path / f"out_{k:04}.ply").unlink()
        with pytest.raises(swarm.SceneError, match=r"out_0002\.ply exists"):
            trajectory.export(tmp_path / "out.ply", frames=slice(2))
        trajectory.export(tmp_path / "out.ply", frames=slice(4, None), overwrite=True)
        assert {path.name for path in tmp_path.iterdir()} == {"out_0000.ply", "out_0001.ply", *mine}
        assert b"frame 5\n" in (tmp_path / "out_0001.ply").read_bytes()
        # One frame is another file.
        trajectory.export(tmp_path / "out.ply", frames=1)
        assert {path.name for path in tmp_path.iterdir()} == {"out_0000.ply", "out_0001.ply", "out.ply", *mine}
    assert (tmp_path / "out_20240101.ply").read_text() == "a file of mine"


def test_what_cannot_be_finished_leaves_the_older_sequence(stored, tmp_path, monkeypatch):
    def held():
        return {path.name: path.read_bytes() for path in tmp_path.iterdir()}

    def full(done, _total):
        if done == 4:
            raise OSError(28, "No space left on device")

    with swarm.load(stored["cavity"]) as trajectory:
        with pytest.raises(swarm.FileError, match=r"cannot write .*out\.ply: .*No space left on device"):
            trajectory.export(tmp_path / "out.ply", progress=full)
        assert held() == {}
        trajectory.export(tmp_path / "out.ply", frames=slice(5))
        before = held()
        with pytest.raises(swarm.FileError, match="No space left on device"):
            trajectory.export(tmp_path / "out.ply", frames=slice(1, None), overwrite=True, progress=full)
        assert held() == before
        # In the middle of the change of names.
        for error in (OSError(5, "Input/output error"), KeyboardInterrupt()):
            replace, calls = os.replace, []

            def failing(one, other, error=error, replace=replace, calls=calls):
                calls.append(one)
                if len(calls) == 8:
                    raise error
                replace(one, other)

            monkeypatch.setattr(replaced.os, "replace", failing)
            with pytest.raises((swarm.FileError, KeyboardInterrupt)):
                trajectory.export(tmp_path / "out.ply", frames=slice(1, None), overwrite=True)
            monkeypatch.undo()
            assert held() == before


KILLED = """
import os, signal, sys, swarm

def report(done, of):
    if done == 3:
        os.kill(os.getpid(), signal.SIGKILL)

with swarm.load(sys.argv[1]) as trajectory:
    trajectory.export(sys.argv[2], overwrite=True, progress=report)
"""


def test_a_kill_leaves_the_older_sequence_and_the_next_one_tidies(stored, tmp_path):
    with swarm.load(stored["cavity"]) as trajectory:
        files = trajectory.export(tmp_path / "out.ply", frames=slice(2))
        before = [path.read_bytes() for path in files]
        assert python("-c", KILLED, stored["cavity"], tmp_path / "out.ply").returncode == -signal.SIGKILL
        assert [path.read_bytes() for path in files] == before
        assert sorted(tmp_path.glob("out*")) == files
        assert len(list(tmp_path.iterdir())) == 3
        files = trajectory.export(tmp_path / "out.ply", overwrite=True)
        assert sorted(tmp_path.iterdir()) == files


# --- Walls -----------------------------------------------------------------------------------------------


def objects(path):
    """The objects of an .obj by their names."""
    scene = trimesh.load(path, split_objects=True, group_material=False)
    return dict(scene.geometry) if hasattr(scene, "geometry") else {"": scene}


def test_walls_are_objects_that_face_outwards(stored, tmp_path):
    with swarm.load(stored["cavity"]) as trajectory:
        assert trajectory.export(tmp_path / "walls.obj") == [tmp_path / "walls.obj", tmp_path / "walls.mtl"]
    found = objects(tmp_path / "walls.obj")
    assert set(found) == {"0_ellipsoid", "1_sphere"}
    sizes = {"0_ellipsoid": 4.0 / 3.0 * np.pi * 0.3 * 0.3 * 0.6, "1_sphere": 4.0 / 3.0 * np.pi * 0.1**3}
    for name, mesh in found.items():
        assert mesh.is_watertight
        assert mesh.is_winding_consistent
        # The grid is coarse: 48 points a side.
        assert mesh.volume == pytest.approx(sizes[name], rel=5e-3)
        assert mesh.visual.material.name == ("cavity" if name[0] == "0" else "solid")
    assert found["1_sphere"].area == pytest.approx(4.0 * np.pi * 0.1**2, rel=5e-3)


def test_a_vessel_of_several_surfaces_is_closed_and_outward(tmp_path):
    scene = swarm.Scene(
        [swarm.Sphere(0.5), swarm.Plane((0.0, 0.0, 1.0), 0.1), swarm.Box((0.1, 0.1, 0.1), side="outside")]
    )
    with swarm.load(run(tmp_path, scene, swarm.fill(scene, 3, speed=0.4, seed=1))) as trajectory:
        trajectory.export(tmp_path / "walls.obj")
    found = objects(tmp_path / "walls.obj")
    cap = np.pi * 0.6**2 * (1.5 - 0.6) / 3.0
    # A part alone is not closed: trimesh has no volume of it.
    corners = np.concatenate([mesh.triangles for name, mesh in found.items() if "box" not in name])
    volume = np.linalg.det(corners).sum() / 6.0
    assert volume == pytest.approx(cap, rel=0.03)
    # The box stands through the plane: what of it is no wall is not there.
    assert found["2_box"].area == pytest.approx(0.2**2 + 4.0 * 0.2 * 0.2, rel=0.03)


@pytest.mark.parametrize("kind", ["union", "fields"])
def test_every_kind_of_solid_faces_the_particles_and_every_cavity_away_from_them(tmp_path, kind):
    union = swarm.Union([swarm.Sphere(0.5), swarm.Cylinder(0.3, length=1.6)])
    balls = swarm.Spheres([[0.0, 0.0, 0.0], [0.2, 0.1, 0.1]], 0.06)
    boxes = swarm.Boxes([[0.0, 0.0, -0.3]], (0.05, 0.06, 0.07), rotations=[[1.0, 0.2, 0.3, 0.1]])
    scene = swarm.Scene([union] if kind == "union" else [balls, boxes])
    start = swarm.Particles([0.0, 0.3, 0.0], [0.1, 0.0, 0.0])
    with swarm.load(run(tmp_path, scene, start)) as trajectory:
        trajectory.export(tmp_path / "walls.obj")
        shapes = obj.walls_at(trajectory, 0, 0.0)
    for shape in shapes:
        a, b, c = (shape.vertices[shape.triangles[:, k]] for k in range(3))
        normals = np.cross(b - a, c - a)
        size = np.sqrt((normals**2).sum(axis=1))
        normals, middles = (rows[size > 1e-2 * size.max()] for rows in (normals, (a + b + c) / 3.0))
        steps = 2e-4 * normals / np.sqrt((normals**2).sum(axis=1, keepdims=True))
        surface = scene.surfaces[shape.surface]
        ahead, behind = (surface.phi((middles + way).T) * (-1.0 if shape.solid else 1.0) for way in (steps, -steps))
        assert ((ahead < behind) if shape.solid else (ahead > behind)).all(), shape.name
    found = objects(tmp_path / "walls.obj")
    assert set(found) == {"union": {"0_union_0_sphere", "0_union_1_cylinder"}, "fields": {"0_spheres", "1_boxes"}}[kind]
    if kind == "fields":
        assert found["1_boxes"].volume == pytest.approx(8.0 * 0.05 * 0.06 * 0.07, rel=0.05)


@pytest.mark.parametrize("kind", ["shaken", "heavy"])
def test_walls_that_move_are_where_they_are_at_the_frame(stored, tmp_path, kind):
    with swarm.load(stored[kind]) as trajectory:
        for k in (0, -1):
            trajectory.export(tmp_path / f"{k}.obj", frames=k)
            places = trajectory.observables["wall_position"][k]
            (ball,) = (mesh for name, mesh in objects(tmp_path / f"{k}.obj").items() if "sphere" in name)
            np.testing.assert_allclose(ball.center_mass, places[1], atol=2e-4)
        assert abs(places[1]).max() > 0.01 or kind == "shaken"


def test_walls_are_there_without_particles_and_where_doors_have_shut(stored, tmp_path):
    with swarm.load(stored["none"]) as trajectory:
        trajectory.export(tmp_path / "none.obj", frames=2)
    assert set(objects(tmp_path / "none.obj")) == {"0_ellipsoid", "1_sphere"}
    scene = swarm.Scene([swarm.Sphere(0.5), swarm.Sphere(0.1, side="outside", present=[(0.0, 0.25)])])
    with swarm.load(run(tmp_path, scene, swarm.fill(scene, 3, speed=0.4, seed=1))) as trajectory:
        trajectory.export(tmp_path / "doors.obj", frames=2)
        trajectory.export(tmp_path / "doors_later.obj", frames=3)
    assert len(objects(tmp_path / "doors.obj")) == 2
    assert len(objects(tmp_path / "doors_later.obj")) == 1


def test_a_wall_in_a_plane_is_a_ribbon(stored, tmp_path):
    with swarm.load(stored["plane"]) as trajectory:
        trajectory.export(tmp_path / "walls.obj")
    (ribbon,) = objects(tmp_path / "walls.obj").values()
    height = np.ptp(ribbon.vertices[:, 2])
    assert ribbon.area == pytest.approx(height * (2.0 + 2.0 * np.pi * 0.5), rel=1e-3)


def test_a_vessel_comes_back_as_a_mesh(stored, tmp_path):
    with swarm.load(stored["cavity"]) as trajectory:
        trajectory.export(tmp_path / "walls.obj")
    mesh = (
        swarm.Mesh(tmp_path / "walls.obj", name="0_ellipsoid")
        if False
        else objects(tmp_path / "walls.obj")["0_ellipsoid"]
    )
    mesh.export(tmp_path / "vessel.stl")
    back = swarm.Mesh(tmp_path / "vessel.stl")
    assert back.volume() == pytest.approx(4.0 / 3.0 * np.pi * 0.3 * 0.3 * 0.6, rel=5e-3)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"particles": 2}, r"an \.obj has the walls, and no particles; leave out particles=2, or write another format"),
        ({"surfaces": False}, r"leave out surfaces=False \(--no-surfaces\)"),
        ({"frames": slice(0, 1)}, r"an \.obj has the walls at one frame; frames must be its number, got slice\(0, 1"),
        ({"frames": 6}, r"frames must lie between -6 and 5, got 6"),
    ],
)
def test_what_no_obj_has_is_a_sentence(stored, tmp_path, change, message):
    with swarm.load(stored["cavity"]) as trajectory, pytest.raises(swarm.SceneError, match=message):
        trajectory.export(tmp_path / "walls.obj", **change)
    assert list(tmp_path.iterdir()) == []
