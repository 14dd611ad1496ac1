"""What files of triangles do wrong, made and mended: seams, corners on edges, needles, turns. Holes, groups."""

import numpy as np
import pytest
import trimesh

import swarm
from swarm.surfaces.facets import mending, triangles
from swarm.surfaces.facets.mesh_files import Soup, read_soup

BOX = trimesh.creation.box((1.0, 1.0, 1.0))
CORNERS, FACES = np.array(BOX.vertices), np.array(BOX.faces)
# A lid in two, whose middle corner is on the edges of the sides.
TOP = np.flatnonzero((CORNERS[FACES][:, :, 2] == 0.5).all(axis=1))


def mesh_of(vertices, faces, weld=None):
    count = len(faces)
    soup = Soup(np.asarray(vertices, float), np.asarray(faces, np.int64), np.arange(count) % 3, ("a", "b", "c"))
    mesh, _moved = triangles.closed("part.stl", soup, weld)
    return mesh


def volume(mesh):
    a, b, c = np.moveaxis(mesh.vertices[mesh.triangles], 1, 0)
    return (a * np.cross(b, c)).sum() / 6.0


def soup_of_triangles():
    """Every triangle with corners of its own, as in an STL file."""
    return CORNERS[FACES].reshape(-1, 3), np.arange(36).reshape(-1, 3)


def seam(gap):
    corners, faces = soup_of_triangles()
    return corners + gap * np.random.default_rng(1).uniform(-1.0, 1.0, corners.shape), faces


def corner_on_an_edge(off=0.0):
    """The top is a fan around its edges' middles, which its neighbours do not have."""
    kept = np.delete(FACES, TOP, axis=0)
    rim = [(0.5, 0.5), (off, 0.5), (-0.5, 0.5), (-0.5, 0.1), (-0.5, -0.5), (0.5, -0.5)]
    points = np.array([[x, y, 0.5] for x, y in [*rim, (0.0, 0.0)]])
    fan = [(8 + 6, 8 + k, 8 + (k + 1) % 6) for k in range(6)]
    return np.concatenate([CORNERS, points]), np.concatenate([kept, fan])


def needle():
    """A triangle without area fills the gap between an edge and the two halves of it."""
    a, b = (int(i) for i in FACES[0, :2])
    c = int(FACES[0, 2])
    middle = 0.5 * (CORNERS[a] + CORNERS[b])
    faces = [(a, 8, c), (8, b, c), (a, b, 8), *FACES[1:]]
    return np.concatenate([CORNERS, [middle]]), np.array(faces)


MENDED = {
    "corners of their own": soup_of_triangles,
    "a seam": lambda: seam(1e-7),
    "corners on edges": corner_on_an_edge,
    "corners beside edges": lambda: (lambda v, f: (v + 1e-7 * np.sin(np.arange(v.size)).reshape(v.shape), f))(
        *corner_on_an_edge(0.2)
    ),
    "a needle": needle,
    "triangles twice": lambda: (CORNERS, np.concatenate([FACES, FACES[3:7]])),
    "triangles rolled": lambda: (CORNERS, np.concatenate([FACES, np.roll(FACES[3:7], 1, axis=1)])),
    "triangles of two corners": lambda: (CORNERS, np.concatenate([FACES, [(0, 0, 1), (2, 3, 3)]])),
    "one turned": lambda: (CORNERS, np.concatenate([FACES[:5], FACES[5:6, ::-1], FACES[6:]])),
    "half turned": lambda: (CORNERS, np.where(np.arange(12)[:, None] % 2 == 0, FACES, FACES[:, ::-1])),
    "inside out": lambda: (CORNERS, FACES[:, ::-1]),
    "corners of no triangle": lambda: (np.concatenate([CORNERS, [(9.0, 9.0, 9.0)]]), FACES),
}


@pytest.mark.parametrize("name", MENDED)
def test_a_cube_is_mended(name):
    mesh = mesh_of(*MENDED[name]())
    edges, counts = mending.edges_of(mesh.triangles)
    assert (counts == 2).all()
    assert len(mesh.vertices) - len(edges) + len(mesh.triangles) == 2
    assert volume(mesh) == pytest.approx(1.0, abs=1e-5)
    assert len(mesh.group) == len(mesh.triangles)


def test_a_hollow_cube_is_inside_out_within():
    corners, faces = np.concatenate([CORNERS, 0.5 * CORNERS]), np.concatenate([FACES, FACES + 8])
    mesh = mesh_of(corners, faces)
    assert volume(mesh) == pytest.approx(1.0 - 0.125, abs=1e-12)
    assert swarm.Mesh(corners, faces).volume() == pytest.approx(0.875, abs=1e-12)


def test_faces_whose_numbers_rise_have_sides_again():
    # openstl 4.0.1 sorts the numbers of each face, findings/openstl_faces_without_sides.sh.
    corners, faces = np.concatenate([CORNERS, 0.5 * CORNERS]), np.concatenate([FACES, FACES + 8])
    rising = np.sort(faces, axis=1)
    assert abs(np.linalg.det(corners[rising]).sum() / 6 - 0.875) > 0.1
    assert volume(mesh_of(corners, rising)) == pytest.approx(0.875, abs=1e-12)
    assert swarm.Mesh(corners, rising).volume() == pytest.approx(0.875, abs=1e-12)


def test_holes_are_listed_by_place_and_size():
    ball = trimesh.creation.icosphere(3)
    faces = np.delete(np.array(ball.faces), np.arange(0, 1280, 160), axis=0)
    with pytest.raises(swarm.SceneError) as caught:
        mesh_of(ball.vertices, faces)
    message = str(caught.value)
    assert "24 edges of one triangle" in message
    assert "and 7 more places; the largest hole is 0." in message
    assert message.count(" m at (") == 4
    assert "weld = " in message
    assert "\n" not in message


def test_an_edge_is_not_split_beyond_the_distance():
    with pytest.raises(swarm.SceneError, match="open at"):
        mesh_of(*MENDED["corners beside edges"](), weld=1e-9)


# --- Files -----------------------------------------------------------------------------------------------


def ascii_stl(path, parts):
    lines = []
    for name, vertices, faces in parts:
        lines.append(f"solid {name}")
        for face in faces:
            lines += ["facet normal 0 0 0", "outer loop"]
            lines += ["vertex " + " ".join(map(repr, map(float, vertices[k]))) for k in face]
            lines += ["endloop", "endfacet"]
        lines.append(f"endsolid {name}")
    path.write_text("\n".join(lines) + "\n")
    return path


def test_named_solids_of_an_stl_file(tmp_path):
    rest = np.setdiff1d(np.arange(12), TOP)
    path = ascii_stl(tmp_path / "part.stl", [("the walls", CORNERS, FACES[rest]), ("shutter", CORNERS, FACES[TOP])])
    soup = read_soup(path, 1e-3)
    assert soup.names == ("the walls", "shutter")
    assert np.bincount(soup.group).tolist() == [10, 2]
    assert np.abs(soup.vertices).max() == 5e-4
    mesh = swarm.Mesh(path, scale=2.0, groups={"shutter": {"restitution": 0.5, "temperature": 2.0}})
    assert mesh.names == ("the walls", "shutter")
    assert mesh.volume() == pytest.approx(8.0)
    runs = mesh.runs()
    assert [(one.restitution, one.temperature, count) for one, count in runs] == [(1.0, None, 10), (0.5, 2.0, 2)]


def test_groups_and_objects_of_an_obj_file(tmp_path):
    lines = [f"v {x} {y} {z}" for x, y, z in CORNERS]
    lines += ["o body", *(f"f {a + 1} {b + 1}//1 {c + 1}/1/1" for a, b, c in FACES[:6])]
    lines += ["g lid", *(f"f {a - 8} {b - 8} {c - 8}" for a, b, c in FACES[6:])]
    (tmp_path / "part.obj").write_text("\n".join(lines))
    soup = read_soup(tmp_path / "part.obj", 1.0)
    assert soup.names == ("body", "lid")
    assert soup.group.tolist() == [0] * 6 + [1] * 6
    assert np.array_equal(soup.triangles, FACES)


def test_faces_of_four_corners(tmp_path):
    quads = ["f 1 2 4 3", "f 5 7 8 6", "f 1 5 6 2", "f 3 4 8 7", "f 1 3 7 5", "f 2 6 8 4"]
    lines = [f"v {i} {j} {k}" for i in (0, 1) for j in (0, 1) for k in (0, 1)]
    (tmp_path / "part.obj").write_text("\n".join(lines + quads))
    assert swarm.Mesh(tmp_path / "part.obj").volume() == pytest.approx(1.0)


def test_the_property_group_of_a_ply_file(tmp_path):
    head = ["ply", "format ascii 1.0", "element vertex 8", *(f"property float {x}" for x in "xyz")]
    head += ["element face 12", "property list uchar int vertex_indices", "property int group", "end_header"]
    rows = [" ".join(map(str, corner)) for corner in CORNERS]
    rows += [f"3 {a} {b} {c} {7 if k in TOP else 2}" for k, (a, b, c) in enumerate(FACES)]
    (tmp_path / "part.ply").write_text("\n".join(head + rows) + "\n")
    mesh = swarm.Mesh(tmp_path / "part.ply", groups={"7": {"friction": 0.1}})
    assert mesh.names == ("2", "7")
    assert np.bincount(mesh.group).tolist() == [10, 2]


WRONG = {
    "an unknown group": (lambda p: swarm.Mesh(p, groups={"lid": {}}), r"got 'lid'; there are 'walls', 'shutter'"),
    "an unknown law": (lambda p: swarm.Mesh(p, groups={"walls": {"colour": 1}}), r"groups\['walls'\] must be one of"),
    "no table": (lambda p: swarm.Mesh(p, groups={"walls": 3}), r"groups\['walls'\] must be a table of laws, got 3"),
    "a mass": (lambda p: swarm.Mesh(p, open=True, mass=1.0), r"mass must be None for a Mesh with open=True"),
    "no file": (lambda p: swarm.Mesh(p.parent / "no.stl"), r"cannot read the mesh .*no.stl"),
    "both": (lambda p: swarm.Mesh(p, FACES), r"triangles must be None with the path of a file"),
    "no triangles": (lambda p: swarm.Mesh(CORNERS), r"triangles must be \(T, 3\) numbers of corners, got None"),
    "a corner beyond": (lambda p: swarm.Mesh(CORNERS, FACES + 1), r"numbers from 0 to 7, .* got \[.*\] in row"),
    "fractions": (lambda p: swarm.Mesh(CORNERS, FACES + 0.5), r"triangles must be whole numbers, one or more, got"),
    "a scale": (lambda p: swarm.Mesh(p, scale=0.0), r"scale must be above 0"),
    "open": (lambda p: swarm.Mesh(CORNERS, FACES[1:]), r"closed .*3 edges of one triangle"),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG)
def test_what_is_refused_in_one_sentence(tmp_path, name):
    rest = np.setdiff1d(np.arange(12), TOP)
    path = ascii_stl(tmp_path / "part.stl", [("walls", CORNERS, FACES[rest]), ("shutter", CORNERS, FACES[TOP])])
    make, message = WRONG[name]
    with pytest.raises(swarm.SceneError, match=message) as caught:
        make(path)
    assert "\n" not in str(caught.value)
