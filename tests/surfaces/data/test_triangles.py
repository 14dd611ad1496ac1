"""Meshes that files hold: seams, triangles without an area or twice, parts, and what is refused with its place."""

import numpy as np
import pytest
import trimesh

import swarm
from swarm import scene_file
from swarm.surfaces.facets import triangles

BALL = trimesh.creation.icosphere(3, radius=0.5)
CORNERS, FACES = np.array(BALL.vertices), np.array(BALL.faces)
UPPER = CORNERS[FACES].mean(axis=1)[:, 2] > 0.0


def written(folder, vertices, faces, name="part.off"):
    """A file of just these corners and triangles, to the last bit."""
    points, cells = (" ".join(map(repr, map(float, row))) for row in vertices), (f"3 {a} {b} {c}" for a, b, c in faces)
    (folder / name).write_text("\n".join(["OFF", f"{len(vertices)} {len(faces)} 0", *points, *cells]) + "\n")
    return folder / name


def halves(gap, size=1.0):
    """Two halves of a ball whose corners differ along the seam."""
    moved = CORNERS + gap * np.random.default_rng(1).uniform(-1.0, 1.0, CORNERS.shape)
    return np.concatenate([size * CORNERS, size * moved]), np.concatenate([FACES[UPPER], FACES[~UPPER] + len(CORNERS)])


def with_corner(*faces, point=None):
    """The ball, with these triangles too, which may have one more corner, in the middle of the first edge."""
    point = 0.5 * CORNERS[FACES[0, :2]].sum(axis=0) if point is None else point
    return np.concatenate([CORNERS, [point]]), np.concatenate([FACES, faces])


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return swarm.from_mesh(written(tmp_path_factory.mktemp("whole"), CORNERS, FACES), 0.09)


# --- Seams -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("gap", [1e-12, 1e-9, 1e-7, 1e-6])
def test_a_seam_closes(tmp_path, whole, gap):
    surface = swarm.from_mesh(written(tmp_path, *halves(gap)), 0.09)
    assert 0.1 * gap < surface.mesh_weld < 2.0 * gap
    assert f"mesh_weld={surface.mesh_weld}" in repr(surface)
    assert np.abs(surface.phi(0.9 * CORNERS.T) - whole.phi(0.9 * CORNERS.T)).max() < 3.0 * gap
    assert whole.mesh_weld is None


@pytest.mark.parametrize("size", [1e-7, 1e6])
def test_what_is_joined_grows_with_the_mesh(tmp_path, size):
    corners, faces = halves(1e-6, size)
    assert 1e-7 < swarm.from_mesh(written(tmp_path, corners, faces), 0.1 * size).mesh_weld / size < 2e-6
    assert len(triangles.read_mesh(written(tmp_path, size * CORNERS, FACES), 1.0, None)[0].vertices) == len(CORNERS)


def test_no_edge_of_a_seam_vanishes(tmp_path):
    """Where the corners of a seam are nearer to each other than the halves, which belongs to which is not known."""
    ring = 1e-6 * np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)])
    corners = np.concatenate([CORNERS, CORNERS[FACES[0]].mean(axis=0) + ring])
    a, b, c, _d = range(len(CORNERS), len(corners))
    with pytest.raises(swarm.SceneError, match=r"closed .* within weld = 2.5e-07 m of each other are joined"):
        swarm.from_mesh(written(tmp_path, corners, np.concatenate([FACES, [(a, b, c)]])), 0.1)


def test_the_distance_of_what_is_joined_can_be_given(tmp_path):
    path = written(tmp_path, *halves(1e-3))
    with pytest.raises(swarm.SceneError, match=r"got \d+ edges of one triangle .* within weld = 1.73e-05 m of each"):
        swarm.from_mesh(path, 0.1)
    with pytest.raises(swarm.SceneError, match=r"within weld = 0\.0001 m of each"):
        swarm.from_mesh(path, 0.1, weld=1e-4)
    assert 1e-4 < swarm.from_mesh(path, 0.1, weld=2e-3).mesh_weld < 2e-3
    with pytest.raises(swarm.SceneError, match="closed"):
        swarm.from_mesh(written(tmp_path, *halves(1e-9)), 0.1, weld=0.0)
    for wrong, message in ((-1.0, "weld must be 0 or more, got -1"), ("wide", "weld must be a finite number")):
        with pytest.raises(swarm.SceneError, match=message):
            swarm.from_mesh(path, 0.1, weld=wrong)


def test_a_scene_file_joins_corners(tmp_path):
    written(tmp_path, *halves(1e-3))
    text = """
    particles = {count = 3, speed = 1.0}
    surface = [{kind = "mesh", file = "part.off", spacing = 0.1, weld = 2e-3}]
    method = {kind = "impact"}
    run = {until = 1.0}
    """
    (tmp_path / "scene.toml").write_text(text)
    assert scene_file.read(tmp_path / "scene.toml").scene.surfaces[0].mesh_weld < 2e-3
    (tmp_path / "scene.toml").write_text(text.replace("2e-3", "2e-4"))
    with pytest.raises(swarm.SceneError, match=r"surface\[0\]: the mesh .* within weld = 0.0002 m"):
        scene_file.read(tmp_path / "scene.toml")


# --- Triangles that do not count -------------------------------------------------------------------------

NEW, (A, B, C) = len(CORNERS), FACES[0]
HARMLESS = {
    "two equal corners": lambda: with_corner((A, A, B)),
    "no area along an edge": lambda: with_corner((A, B, NEW)),
    "no area that closes": lambda: (lambda v, f: (v, f[1:]))(*with_corner((A, NEW, C), (NEW, B, C), (A, B, NEW))),
    "one twice": lambda: with_corner((B, C, A)),
    "all twice": lambda: (CORNERS, np.concatenate([FACES, FACES])),
    "a corner without a triangle": lambda: with_corner((A, B, C), point=(np.nan, 1e9, 0.0)),
}


@pytest.mark.parametrize("name", HARMLESS)
def test_triangles_that_do_not_count(tmp_path, whole, name):
    surface = swarm.from_mesh(written(tmp_path, *HARMLESS[name]()), 0.09)
    assert (np.abs(surface.values - whole.values) < 1e-12).all()
    assert (surface.mesh_weld, surface.mesh_error) == (None, pytest.approx(whole.mesh_error, rel=1e-12))


# --- Parts -----------------------------------------------------------------------------------------------


def moved(x, radius=0.5, turned=False):
    ball = trimesh.creation.icosphere(2, radius=radius)
    ball.apply_translation((x, 0.0, 0.0))
    if turned:
        ball.invert()
    return ball


@pytest.mark.parametrize(
    "turned", [(False, False, False), (True, True, False), (False, True, True), (False, True, False)]
)
def test_parts_are_turned_by_where_they_are(tmp_path, turned):
    """A ball in a hole of a ball, and another one beside them."""
    places = ((0.0, 1.0), (0.0, 0.7), (0.0, 0.4), (2.0, 0.5))
    parts = [moved(*place, one) for place, one in zip(places, (*turned, turned[0]), strict=True)]
    mesh = trimesh.util.concatenate(parts)
    surface = swarm.from_mesh(written(tmp_path, mesh.vertices, mesh.faces), 0.09)
    # Next to each of the balls, inside and outside
    across = surface.phi([[0.0, 0.35, 0.45, 0.65, 0.75, 0.95, 1.05, 1.45, 1.55, 2.0], [0.0] * 10, [0.0] * 10])
    assert (np.sign(across) == [-1.0, -1.0, 1.0, 1.0, -1.0, -1.0, 1.0, 1.0, -1.0, -1.0]).all()


# --- What is refused -------------------------------------------------------------------------------------


def torn(*which):
    return CORNERS, np.delete(FACES, which, axis=0)


def with_number(value):
    corners, faces = with_corner((A, B, NEW), point=(0.1, value, 0.2))
    return corners, np.concatenate([faces, [(NEW, NEW, NEW)]])


def klein_bottle():
    """Triangles of which each edge has two, and no side is outside."""
    n = 12
    u, v = np.meshgrid(*2 * [2.0 * np.pi * np.arange(n) / n], indexing="ij")
    across = 2.0 + np.cos(0.5 * u) * np.sin(v) - np.sin(0.5 * u) * np.sin(2.0 * v)
    points = [across * np.cos(u), across * np.sin(u), np.sin(0.5 * u) * np.sin(v) + np.cos(0.5 * u) * np.sin(2.0 * v)]
    # Around u once v has become -v
    number = lambda i, j: (i % n) * n + (-j if i >= n else j) % n  # noqa: E731
    faces = [
        corners
        for i in range(n)
        for j in range(n)
        for corners in (
            (number(i, j), number(i + 1, j), number(i, j + 1)),
            (number(i + 1, j), number(i + 1, j + 1), number(i, j + 1)),
        )
    ]
    return np.stack(points, axis=-1).reshape(-1, 3), np.array(faces)


HIGHEST = np.argsort(CORNERS[FACES].mean(axis=1)[:, 2])
TOUCHING = trimesh.util.concatenate([moved(0.0), moved(0.6)])
WRONG = {
    "open": (
        lambda: torn(HIGHEST[-1]),
        r"3 edges of one triangle and 0 of more than two: open at \(.*, 0\.[45]\d*\); the hole is 0\.\d+ m across",
    ),
    "open at two": (
        lambda: torn(*HIGHEST[:2], HIGHEST[-1]), r"open at \(.*, -0\.[45]\d*\) and 1 more place; the largest hole is 0"
    ),
    "open at three": (lambda: torn(HIGHEST[0], HIGHEST[640], HIGHEST[-1]), r"open at .* and 2 more places;"),
    "a fin": (lambda: with_corner((A, B, NEW), point=(1.0, 1.0, 1.0)), r"1 of more than two: .*triangles meet at \("),
    "a membrane": (lambda: with_corner((C, B, A)), r"3 of more than two: three or more triangles meet at \("),
    "a Klein bottle": (klein_bottle, r"cannot all be turned the same way, .*Klein bottle: .* at \d+ edges, one at \("),
    "parts that intersect": (
        lambda: (TOUCHING.vertices, TOUCHING.faces), r"parts that do not intersect, got one with a corner at \(0\.\d"
    ),
    "not a number": (
        lambda: with_number(np.nan),
        r"finite corners, got \(0.1, nan, 0.2\) as corner 2 of triangle 1280, counted from 0, and 1 more",
    ),
    "infinite": (lambda: with_number(-np.inf), r"finite corners, got \(0.1, -inf, 0.2\) as corner 2 of triangle 1280"),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG)
def test_what_is_refused_has_a_place(tmp_path, name):
    make, message = WRONG[name]
    with pytest.raises(swarm.SceneError, match=message) as caught:
        swarm.from_mesh(written(tmp_path, *make()), 0.1)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("as_text", [False, True])
def test_an_stl_file_with_a_triangle_of_nan_beside_a_closed_cube(tmp_path, as_text):
    cube = trimesh.creation.box((0.4, 0.4, 0.4))
    corners = np.concatenate([cube.vertices, np.full((3, 3), np.nan)])
    mesh = trimesh.Trimesh(corners, np.concatenate([cube.faces, [(8, 9, 10)]]), process=False)
    mesh.export(tmp_path / "part.stl", file_type="stl_ascii" if as_text else "stl")
    with pytest.raises(swarm.SceneError, match=r"finite corners, got \(nan, nan, nan\) as corner 0 of triangle 12,"):
        swarm.from_mesh(tmp_path / "part.stl", 0.05)
