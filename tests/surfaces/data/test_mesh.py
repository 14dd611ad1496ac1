"""Surfaces from meshes: how far they are from them, and which meshes are refused."""

import sys

import numpy as np
import pytest
import trimesh

import swarm
from swarm import scene_file
from swarm.commands import summary
from swarm.words.amounts import amount


def written(folder, mesh, name="part.stl"):
    mesh.export(folder / name)
    return folder / name


def test_a_sphere_of_triangles(tmp_path):
    path = written(tmp_path, trimesh.creation.icosphere(4, radius=0.5))
    made = [swarm.from_mesh(path, spacing) for spacing in (0.1, 0.05)]
    for surface in made:
        # Between the triangles' corners, on the sphere, and their middles
        assert 0.0 < surface.mesh_error < 2e-3
        assert f"mesh_error={surface.mesh_error}" in repr(surface)
    points = np.random.default_rng(1).normal(size=(3, 200))
    points *= 0.5 / np.sqrt((points**2).sum(axis=0))
    assert np.abs(made[1].phi(points)).max() < 2e-3
    end = swarm.simulate(
        swarm.Scene([made[1]]), swarm.fill(swarm.Scene([made[1]]), 5, speed=1.0, seed=1), swarm.Impact(), until=2.0,
        compile="never",
    )  # fmt: skip
    assert end.observables["impacts"][-1] > 10
    assert end.observables["energy_error"].max() < 1e-14


def test_edges_become_round_within_a_cell(tmp_path):
    surface = swarm.from_mesh(
        written(tmp_path, trimesh.creation.box((1.0, 0.8, 0.6)), "box.off"), 0.043, side="outside"
    )
    assert 0.1 * 0.043 < surface.mesh_error < 0.043
    flat = surface.phi([[0.5, 0.0, 0.0], [0.0, 0.4, 0.0], [0.0, 0.0, -0.3]])
    assert np.abs(flat).max() < 1e-4


def test_millimetres_and_triangles_seen_from_inside(tmp_path):
    mesh = trimesh.creation.icosphere(3, radius=500.0)
    mesh.invert()
    surface = swarm.from_mesh(written(tmp_path, mesh), 0.1, scale=1e-3, friction=0.2)
    assert surface.phi([0.0, 0.0, 0.0]) == pytest.approx(-0.5, abs=0.05)
    assert surface.friction == 0.2


def test_a_vessel_with_a_wall_of_two_sides(tmp_path):
    outer, inner = trimesh.creation.icosphere(3, radius=0.6), trimesh.creation.icosphere(3, radius=0.4)
    inner.invert()
    surface = swarm.from_mesh(written(tmp_path, trimesh.util.concatenate([outer, inner])), 0.05)
    assert surface.phi([[0.5, 0.0, 0.8], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]) == pytest.approx([-0.1, 0.4, 0.2], abs=0.03)


@pytest.mark.parametrize("spacing", [0.01, 0.02, 0.023, 0.025, 0.04, 0.05])
def test_samples_on_the_surface_have_any_sign(tmp_path, spacing):
    """Of this cone, in float32, some samples are on the surface but for round-off: 7e-10 in place of 0."""
    cone = trimesh.creation.cone(0.2, 0.4, sections=48)
    cone.apply_translation((0.1, 0.1, 0.1))
    surface = swarm.from_mesh(written(tmp_path, cone), spacing)
    assert surface.mesh_error < spacing
    swarm.Sampled(surface.values, surface.spacing, surface.origin)


def test_a_summary_says_how_far_the_surface_is_from_its_mesh(tmp_path):
    halves = [trimesh.creation.box((0.4, 0.4, 0.2)) for _ in range(2)]
    for k, half in enumerate(halves):
        half.update_faces(half.face_normals[:, 2] < 0.5)  # without its top
        half.apply_transform(trimesh.transformations.rotation_matrix(k * np.pi, (1.0, 0.0, 0.0)))
        half.apply_translation((k * 1e-6, 0.0, (k - 0.5) * 0.2))
    box = swarm.from_mesh(written(tmp_path, trimesh.util.concatenate(halves)), 0.043)
    assert box.mesh_weld == pytest.approx(1e-6, rel=0.05)
    scene, file = swarm.Scene([swarm.Sphere(5.0), box]), tmp_path / "run.h5"
    start = swarm.Particles([0.1, 0.0, 0.0], [0.0, 0.0, 0.0])
    result = swarm.simulate(scene, start, swarm.Impact(), until=0.1, trajectory=file, compile="never")
    text = f"within {amount(box.mesh_error, 'm', 2)} of its mesh, corners moved by up to 1 µm to close seams"
    for rows in (summary.of_result(result, None), summary.of_file(file)):
        assert text in rows["surface 1, sampled cavity"]
    assert text in result._repr_html_()
    free = swarm.simulate(swarm.Scene([swarm.Sphere(1.0)]), start, swarm.Impact(), until=0.1, compile="never")
    assert "mesh" not in " ".join(summary.of_result(free, None).values())


def test_bad_meshes_are_one_sentence(tmp_path):
    sphere = trimesh.creation.icosphere(2)
    whole = written(tmp_path, sphere)
    open_mesh = trimesh.Trimesh(sphere.vertices, sphere.faces[1:])
    (tmp_path / "text.stl").write_text("no mesh")
    (tmp_path / "part.foo").write_text("no mesh")
    cases = [
        (lambda: swarm.from_mesh(tmp_path / "no.stl", 0.1), "cannot read the mesh .*no.stl"),
        (lambda: swarm.from_mesh(tmp_path / "part.foo", 0.1), "cannot read the mesh .*part.foo"),
        (lambda: swarm.from_mesh(tmp_path / "text.stl", 0.1), "mesh .*text.stl"),
        (
            lambda: swarm.from_mesh(written(tmp_path, open_mesh, "open.stl"), 0.1),
            "closed .*got 3 edges of one triangle",
        ),
        (lambda: swarm.from_mesh(whole, 0.0), "spacing must be above 0"),
        (lambda: swarm.from_mesh(whole, 1e-6), "samples fit in memory, got 1e-06 m .* take"),
        (lambda: swarm.from_mesh(whole, 3.0), "spacing must resolve the mesh .*got 3 m"),
        (lambda: swarm.from_mesh(whole, 0.1, "in"), "side must be one of"),
        (lambda: swarm.from_mesh(whole, 0.1, scale=-1.0), "scale must be above 0"),
    ]
    for make, message in cases:
        with pytest.raises(swarm.SceneError, match=message) as caught:
            make()
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["trimesh", "igl"])
def test_a_missing_library_is_reported(tmp_path, monkeypatch, name):
    path = written(tmp_path, trimesh.creation.icosphere(2))
    monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(
        swarm.SceneError, match=f"(from_mesh|a mesh) needs the package '{name}'.*pip install trimesh libigl"
    ):
        swarm.from_mesh(path, 0.2)


TEXT = """
[particles]
count = 3
speed = 1.0
[[surface]]
kind = "mesh"
{more}
[method]
kind = "impact"
[run]
until = 1.0
every = 0.5
"""


def test_a_mesh_in_a_scene_file(tmp_path):
    (tmp_path / "parts").mkdir()
    written(tmp_path / "parts", trimesh.creation.icosphere(2, radius=0.5))

    def read(more):
        (tmp_path / "scene.toml").write_text(TEXT.format(more=more))
        return scene_file.read(tmp_path / "scene.toml").scene.surfaces[0]

    surface = read('file = "parts/part.stl"\nspacing = 0.1\nrestitution = 0.9')
    assert (surface.restitution, surface.mesh_error > 0.0, surface.spacing) == (0.9, True, (0.1, 0.1, 0.1))
    for more, message in {
        'file = "part.stl"\nspacing = 0.1': r"surface\[0\]: cannot read the mesh .*part.stl",
        "spacing = 0.1": r"surface\[0\].file: expected the name of a file, got nothing",
        'file = "parts/part.stl"\nspacing = "a"': r"surface\[0\].spacing must be",
        'file = "parts/part.stl"\nspacing = 0.1\norigin = [0, 0, 0]': r"surface\[0\].origin: unknown key of a mesh",
    }.items():
        with pytest.raises(swarm.SceneError, match=message):
            read(more)


def test_3mf_is_read_with_what_the_extra_has(tmp_path):
    """By lxml and networkx; the objects are groups."""
    parts = {"box": trimesh.creation.box((1.0, 1.0, 1.0)), "ball": trimesh.creation.icosphere(1, 0.2)}
    parts["ball"].apply_translation((3.0, 0.0, 0.0))
    path = written(tmp_path, trimesh.Scene(parts), "two.3mf")
    mesh = swarm.Mesh(path, side="outside", groups={"ball": {"restitution": 0.5}})
    assert sorted(mesh.names) == ["ball", "box"]
    assert len(mesh.triangles) == 12 + 80
    assert mesh.phi([[0.0, 3.0], [0.0, 0.0], [0.0, 0.6]]) == pytest.approx([-0.5, 0.4], abs=0.02)


POINTS = trimesh.PointCloud([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])
CURVES = trimesh.load_path([[(0.0, 0.0), (1.0, 0.0)], [(1.0, 0.0), (0.0, 1.0)]])


@pytest.mark.parametrize(
    ("name", "kind", "what"),
    [
        ("points.ply", "points", POINTS),
        ("points.glb", "points", trimesh.Scene([trimesh.creation.box(), POINTS])),
        ("curves.dxf", "curves", CURVES),
    ],
)
def test_what_is_no_triangle_is_one_sentence(name, kind, what, tmp_path):
    path, data = tmp_path / name, what.export(file_type=name[-3:])
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    for read in (swarm.Mesh, lambda file: swarm.from_mesh(file, 0.1)):
        with pytest.raises(swarm.SceneError, match=rf"the mesh .*{name} must hold triangles, got {kind} alone; make"):
            read(path)


def test_a_format_whose_package_is_missing_names_it(tmp_path, monkeypatch):
    """As trimesh raises it again, without the name of the module."""

    def load(*_given, **_named):
        raise ModuleNotFoundError("No module named 'cascadio'")

    path = written(tmp_path, trimesh.creation.box(), "part.ply")
    monkeypatch.setattr(trimesh, "load", load)
    with pytest.raises(
        swarm.SceneError, match=r"a file \.ply needs the package 'cascadio'.*: pip install cascadio, or"
    ):
        swarm.Mesh(path)
