"""Particles among their walls: what solids hide, silhouettes, levels, and how much of a panel a vessel fills."""

import itertools
import math

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PathCollection
from matplotlib.text import Text

import swarm
from swarm.pictures import colours, drawing, film, flat, framed, plots, style, triad
from swarm.pictures.eye import eye_at, eye_for
from swarm.pictures.raster import Raster
from swarm.pictures.scenery import Scenery, silhouette
from swarm.triangles.shapes import cell_of, shapes_of
from swarm.words.amounts import amount

NOWHERE = np.zeros((3, 1))
RED = 0xFF0000FF
VESSELS = {
    "sphere": swarm.Scene([swarm.Sphere(0.5)]),
    "tray": swarm.Scene([swarm.Box((1.0, 0.8, 0.05))]),
    "silo": swarm.Scene([swarm.Cylinder(0.1, length=2.0)]),
    "board": swarm.Scene([swarm.Box((1.0, 0.02, 1.2))]),
    "tube that lies": swarm.Scene([swarm.Cylinder(1e-6, length=20e-6, axis=(1.0, 0.0, 0.0))]),
    "far away": swarm.Scene([swarm.Torus(500.0, 100.0, center=(1e6, 2e6, 0.0))]),
    "with a ball": swarm.Scene([swarm.Sphere(0.5), swarm.Sphere(0.2, side="outside")]),
}


def drawn(scene, points, figsize=(5.0, 4.0), **more):
    """The axes and the scenery of points, all in red."""
    with style.applied():
        figure = style.picture(*figsize)
        axes = figure.add_subplot()
        shapes = shapes_of(scene, np.asarray(points).T)
        scenery = drawing.frame(axes, np.asarray(points), np.full(len(points), RED, np.uint32), shapes, **more)
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
    return axes, scenery, np.asarray(canvas.buffer_rgba())[..., :3].astype(int)


def test_a_particle_behind_a_solid_is_hidden_and_one_before_it_is_seen():
    scene = VESSELS["with a ball"]
    shapes = shapes_of(scene, NOWHERE)
    eye = framed.eye_of(shapes, [shape.vertices for shape in shapes])
    for place, seen in ((0.3 * eye.near, True), (-0.3 * eye.near, False), (-0.3 * eye.near + 0.21 * eye.right, True)):
        _axes, _scenery, picture = drawn(scene, [place])
        reds = (picture[..., 0] > picture[..., 2] + 150) & (picture[..., 1] < 90)
        assert reds.any() == seen


@pytest.mark.parametrize("angles", [(0.0, 0.0), (-60.0, 20.0), (30.0, 80.0)])
def test_the_silhouette_of_a_sphere_is_a_circle(angles):
    (shape,) = shapes_of(swarm.Scene([swarm.Sphere(0.5, (1.0, 2.0, 3.0))]), NOWHERE)
    eye = eye_at(*angles)
    seen = eye.seen(np.vstack(silhouette(shape, eye))) - eye.seen(np.array([1.0, 2.0, 3.0]))
    assert np.hypot(*seen.T[:2]) == pytest.approx(0.5, rel=0.01)
    around = np.sort(np.arctan2(seen[:, 1], seen[:, 0]))
    assert np.diff(around, append=around[0] + 2.0 * math.pi).max() < 0.2


def test_of_a_faceted_mesh_it_is_where_facets_turn_away():
    (shape,) = shapes_of(swarm.Scene([swarm.Mesh(*cube())]), NOWHERE)
    eye = eye_at(-60.0, 20.0)
    length = sum(np.sqrt((np.diff(c, axis=0) ** 2).sum(axis=1)).sum() for c in silhouette(shape, eye))
    assert length == pytest.approx(6.0)  # of the twelve edges six


def cube():
    corners = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return corners, [three for a, b, c, d in quads for three in ((a, b, c), (a, c, d))]


@pytest.mark.parametrize("name", VESSELS)
def test_contours_are_level_and_lie_on_their_wall(name):
    for shape in shapes_of(VESSELS[name], NOWHERE):
        wide = np.ptp(shape.vertices, axis=0).max()
        assert len(shape.levels) >= 3
        for level in shape.levels:
            assert np.ptp(level[:, 2]) <= 1e-9 * wide + 1e-12 * np.abs(level).max()


@pytest.mark.parametrize("figsize", [(5.0, 4.0), (3.0, 7.0), (9.0, 3.0)])
@pytest.mark.parametrize("name", VESSELS)
def test_the_vessel_fills_its_panel_and_is_within_it(name, figsize):
    shapes = shapes_of(VESSELS[name], NOWHERE)
    middle = np.vstack([shape.vertices for shape in shapes]).mean(axis=0)
    axes, scenery, _picture = drawn(VESSELS[name], [middle], figsize)
    seen = scenery.eye.seen(np.vstack([shape.vertices for shape in shapes]))[:, :2]
    corners = axes.transData.transform(np.array([seen.min(axis=0), seen.max(axis=0)]))
    panel = axes.figure.bbox
    assert (corners[0] >= (panel.x0, panel.y0)).all()
    assert (corners[1] <= (panel.x1, panel.y1)).all()
    wide, tall = (corners[1] - corners[0]) / (panel.width, panel.height)
    assert max(wide, tall) >= 0.8


@pytest.mark.parametrize(
    ("extents", "across"), [((1.0, 0.05, 1.0), 1), ((0.05, 1.0, 1.0), 0), ((1.0, 1.0, 0.05), 2), ((9.0, 1.0, 0.5), 1)]
)
def test_the_eye_shows_what_is_wide(extents, across):
    """It looks along the direction in which there is least, more or less."""
    half = 0.5 * np.array(extents)
    eye = eye_for(-half, half)
    assert eye.near[2] > 0.0
    assert np.abs(eye.right) @ extents > 0.6 * max(extents[:2])
    if across != 2:
        assert np.abs(eye.near).argmax() == across
    frame = np.stack(eye)
    np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-15)


def test_a_far_particle_does_not_widen_the_picture_and_is_counted():
    scene = swarm.Scene([swarm.Sphere(0.5, openings=[swarm.Sphere(0.2, (0.0, 0.0, 0.5))])])
    axes, _scenery, _picture = drawn(scene, [[0.0, 0.0, 0.0], [0.0, 0.0, 100.0], [70.0, 0.0, 0.0]])
    assert np.ptp(axes.get_ylim()) < 2.0
    assert "2 are beyond this picture" in [text.get_text() for text in axes.texts]


def test_what_is_open_is_drawn_as_far_as_most_of_its_particles():
    points = np.random.default_rng(1).normal(size=(200, 3))
    points[7] = 1e4
    found = np.vstack(framed.around(points, []))
    assert len(found) == 2 * 199
    nobody = framed.around(np.full((3, 3), np.nan), [])
    low, high = framed.window(eye_at(0.0, 20.0), nobody)
    assert (high > low).all()


def test_a_triangle_is_where_it_is_and_the_nearest_one_is_seen():
    raster = Raster(np.zeros(2), np.ones(2), 100.0)
    seen = np.array([[0.1, 0.1, 1.0], [0.9, 0.1, 1.0], [0.1, 0.9, 5.0]])
    raster.triangles(seen, np.array([[0, 1, 2]]), np.eye(3))
    assert np.isfinite(raster.depth).sum() == pytest.approx(0.5 * 80**2, abs=60)
    assert raster.depth[49, 49] == pytest.approx(1.0 + 4.0 * (0.495 - 0.1) / 0.8)
    assert raster.colour[49, 49].sum() == pytest.approx(1.0)
    before = raster.depth.copy()
    raster.triangles(seen - (0.0, 0.0, 9.0), np.array([[2, 1, 0]]), np.zeros((3, 3)))
    np.testing.assert_array_equal(raster.depth, before)
    assert raster.hides(np.array([0.3, 0.3, 0.0]))
    assert not raster.hides(np.array([0.3, 0.3, 9.0]))
    assert not raster.hides(np.array([7.0, 0.3, 0.0]))
    assert not raster.hides(np.full(3, np.nan))


def test_lengths_are_round():
    assert [triad.round_length(x) for x in (0.28, 1.0, 4.99, 5.0, 7e-6)] == pytest.approx([0.2, 1.0, 2.0, 5.0, 5e-6])
    lengths = [amount(x, "m") for x in (0.2, 2.0, 0.02, 5e-3, 2e-6, 5e3, 1e-8)]
    assert lengths == ["0.2 m", "2 m", "20 mm", "5 mm", "2 µm", "5 km", "10 nm"]


def test_in_a_plane_what_closed_walls_enclose_is_filled():
    scene = swarm.Scene([swarm.Box((1.0, 0.5, 0.1)), swarm.Sphere(0.1, side="outside")], plane="z")
    figure = style.picture(4.0, 3.0)
    axes = figure.add_subplot()
    shapes = shapes_of(scene, NOWHERE)
    flat.flat(axes, 2, np.array([[0.3, 0.0, 0.0]]), "red", shapes)
    areas = [sum(area(loop) for loop in patch.get_path().to_polygons()) for patch in axes.patches]
    assert areas == pytest.approx([2.0, math.pi * 0.01], rel=0.01)


def area(loop):
    (x, y), (u, v) = loop[:-1].T, loop[1:].T
    return abs(0.5 * float((x * v - u * y).sum()))


def test_where_all_have_one_speed_there_are_words_and_no_bar_and_neither_where_none_is():
    with style.applied():
        for colours, bars in (([RED, RED], 1), ([RED, 0x0000FFFF], 2), ([0, 0], 1)):
            figure = style.picture(4.0, 4.0)
            axes = figure.add_subplot()
            drawing.colour_bar(figure, axes, "speed [m/s]", 0.0, 2.0, [np.array(colours, np.uint32)])
            assert len(figure.axes) == bars
            words = figure._supxlabel.get_text() if figure._supxlabel else ""
            assert words.startswith("all at a speed ") == (colours == [RED, RED])


def words_below(quantity, low, high, values=None, shown=()):
    """What stands where a colour bar would say nothing: about values, or about the colours of some."""
    scale = colours.Scale(quantity, low, high)
    packed = scale.colours(np.asarray(shown if values is None else values, np.float64))
    figure = style.picture(4.0, 4.0)
    axes = figure.add_subplot()
    drawing.colour_bar(figure, axes, quantity, low, high, [packed], None if values is None else np.array(values))
    assert len(figure.axes) == 1
    return figure.get_supxlabel()


def test_the_words_instead_of_a_bar_are_about_the_values_not_about_their_colour():
    speed = "speed [m/s]", 0.0, 6.7
    assert words_below(*speed, [0.0, 0.0, math.nan]) == "all at rest"
    assert words_below(*speed, [0.0, math.nan]) == "at rest"
    assert words_below(*speed, [0.5, math.nan]) == "speed 0.5 m/s"
    assert words_below(*speed, [0.5, 0.5, math.nan]) == "all at one speed, 0.5 m/s"
    assert words_below(*speed, [1e-3, 2e-2]) == "all at a speed from 0.001 to 0.02 m/s"
    assert words_below(*speed, [7.0, 9.0]) == "all at a speed from 7 to 9 m/s"


def test_a_colour_alone_says_between_which_values_they_are():
    """A step of 256 of the scale; beyond its ends there is one colour."""
    assert words_below("speed [m/s]", 0.0, 2.56, shown=[0.0, 9e-3]) == "all at a speed of at most 0.01 m/s"
    assert words_below("speed [m/s]", 0.0, 2.56, shown=[9.0, 2.5599]) == "all at a speed of at least 2.55 m/s"
    assert words_below("speed [m/s]", 0.0, 2.56, shown=[1.285]) == "all at a speed from 1.28 to 1.29 m/s"
    assert (
        words_below("log10 of the error", -16.0, -6.0, shown=[-16.0]) == "all at a log10 of the error of at most -15.96"
    )


def test_a_picture_of_a_run_at_rest_names_no_speed(tmp_path):
    bowl = swarm.Scene([swarm.Box((1.0, 1.0, 1.0), restitution=0.2, friction=0.9)], gravity=(0.0, 0.0, -9.81))
    start = swarm.fill(bowl, 3, speed=1.0, seed=1)
    path = tmp_path / "rest.h5"
    swarm.simulate(bowl, start, swarm.Impact(), until=6.0, every=6.0, trajectory=path, compile="never")
    with swarm.load(path) as trajectory:
        assert not trajectory.frame(-1).velocity.any()
        texts = [text.get_text() for text in trajectory.plot().findobj(Text)]
    assert "all at rest" in texts
    assert not [text for text in texts if "speed" in text or "m/s" in text]


def test_a_scenery_without_walls():
    with style.applied():
        figure = style.picture(3.0, 3.0)
        axes = figure.add_subplot()
        assert isinstance(drawing.frame(axes, np.empty((0, 3)), np.empty(0, np.uint32), []), Scenery)


def test_the_cell_of_a_period_has_twelve_edges():
    (cell,) = cell_of(swarm.Scene([], period=(1.0, 2.0, 3.0)))
    assert len(cell.edges) == 12
    assert sum(np.sqrt((np.diff(edge, axis=0) ** 2).sum()) for edge in cell.edges) == pytest.approx(4.0 * 6.0)
    assert np.vstack(cell.edges).min() == 0.0
    assert np.vstack(cell.edges).max(axis=0).tolist() == [1.0, 2.0, 3.0]
    assert not cell_of(VESSELS["sphere"])


def a_channel(width, hole):
    """A polygon with a hole in its right side, and its area."""
    exits = [swarm.Box((0.1, 0.5 * hole, 1.0), center=(2.0, 0.5 * width, 0.0))]
    corners = [[0.0, 0.0], [2.0, 0.0], [2.0, width], [0.0, width]]
    return swarm.Scene([swarm.Polygon(corners, openings=exits)], plane="z"), 2.0 * width


@pytest.mark.parametrize(("width", "hole"), [(1.0, 0.2), (0.5, 0.3)])
def test_in_a_plane_it_is_filled_across_an_opening(width, hole):
    scene, inside = a_channel(width, hole)
    axes = style.picture(4.0, 3.0).add_subplot()
    flat.flat(axes, 2, np.array([[0.3, 0.1, 0.0]]), "red", shapes_of(scene, NOWHERE))
    (patch,) = axes.patches
    assert sum(area(loop) for loop in patch.get_path().to_polygons()) == pytest.approx(inside, rel=0.01)


def test_what_is_open_far_and_wide_is_not_filled():
    corner = [np.array([[1.0, 0.0], [0.0, 0.0]]), np.array([[0.0, 0.0], [0.0, 1.0]])]
    assert flat._loops(corner, 1e-3, 0.34) == []
    (loop,) = flat._loops([*corner, np.array([[0.0, 1.0], [1.0, 1.0], [1.0, 0.2]])], 1e-3, 0.34)
    assert area(loop) == pytest.approx(1.0)
    two_walls = [np.array([[0.0, 0.0], [3.0, 0.0]]), np.array([[0.0, 1.0], [3.0, 1.0]])]
    (loop,) = flat._loops(two_walls, 1e-3, 0.34)
    assert area(loop) == pytest.approx(3.0)


def shaft(height):
    """A narrow one between blocks, open at both ends, of solids so high across its plane."""
    blocks = [swarm.Box((0.05, 0.01, height), center=(x, -0.01, 0.0), side="outside") for x in (-0.07, 0.07)]
    return swarm.Scene([swarm.Box((0.1, 0.3, height), center=(0, 0.3, 0), open=["+y", "-y"]), *blocks], plane="z")


def test_heights_across_its_plane_do_not_widen_a_picture():
    low, high = (np.concatenate([c for one in shapes_of(shaft(h), NOWHERE) for c in one.edges]) for h in (0.01, 5.0))
    assert np.array_equal(low, high)
    assert abs(low[:, 1]).max() < 1.3 * 0.6


@pytest.mark.parametrize("size", [(2.0, 6.0), (2.0, 3.0)])
def test_labels_below_a_narrow_picture_are_beside_one_another(size):
    figure = style.picture(*size)
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    flat.flat(axes, 2, np.array([[0.0, 0.1, 0.0]]), "red", shapes_of(shaft(1.0), NOWHERE))
    figure.canvas.draw()
    for axis, side in ((axes.xaxis, "x"), (axes.yaxis, "y")):
        boxes = [label.get_window_extent() for label in axis.get_ticklabels() if label.get_visible()]
        ends = sorted((getattr(one, f"{side}0"), getattr(one, f"{side}1")) for one in boxes)
        assert len(ends) >= (2 if side == "y" else 1)
        assert all(a[1] < b[0] for a, b in itertools.pairwise(ends))


def test_in_an_open_plane_a_far_particle_is_counted():
    points = np.random.default_rng(1).normal(size=(200, 3))
    points[:3] *= 1e4
    axes = style.picture(4.0, 3.0).add_subplot()
    flat.flat(axes, 2, points, "red", shapes_of(swarm.Scene([swarm.Sphere(0.5, side="outside")], plane="z"), NOWHERE))
    assert np.ptp(axes.get_xlim()) < 20.0
    assert "3 are beyond this picture" in [text.get_text() for text in axes.texts]


def a_leak(folder):
    """A run of which particle 0 escapes at once, and 1 stays."""
    scene, _inside = a_channel(1.0, 0.2)
    start = swarm.Particles([[1.0, 1.0], [0.5, 0.2], [0.0, 0.0]], [[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]])
    swarm.simulate(scene, start, swarm.Impact(), until=2.0, every=1.0, trajectory=folder / "leak.h5")
    return swarm.load(folder / "leak.h5")


def test_an_escaped_particle_is_not_drawn_and_is_counted(tmp_path):
    with a_leak(tmp_path) as trajectory:
        content = plots.content_of(trajectory)
        assert np.isnan(content.inside("end").position[0]).tolist() == [True, False]
        assert not np.isnan(content.frames["end"].position).any()
        figure = trajectory.plot()
        captions = [one.get_text() for one in figure.findobj(Text) if "inside, t" in one.get_text()]
        assert captions == ["1 particle inside, t = 2 s,\neach with 1 m/s\n1 escaped, not drawn"]
        (dots,) = [one for axes in figure.findobj(Axes) for one in axes.collections if isinstance(one, PathCollection)]
        assert (~np.ma.getmaskarray(dots.get_offsets())).all(axis=1).sum() == 1


@pytest.mark.parametrize("name", ["tray", "tube that lies", "board"])
def test_title_vessel_and_bar_are_together_in_the_middle_of_a_panel(name, tmp_path):
    scene = VESSELS[name]
    start = swarm.fill(scene, 50, speed=1e-3, seed=1)
    start.velocity[:, 0] *= 2.0
    swarm.simulate(scene, start, swarm.Impact(), until=1e-4, trajectory=tmp_path / "run.h5")
    with swarm.load(tmp_path / "run.h5") as trajectory:
        figure = trajectory.plot(figsize=(12.0, 9.0))
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    (title,) = [one for one in figure.findobj(Text) if "50 particles, t" in one.get_text()]
    (bar,) = [one for one in figure.findobj(Text) if one.get_text().startswith("speed [") and one.get_fontsize() == 8.5]
    top, bottom = (one.get_window_extent() for one in (title, bar))
    assert 0.5 * (top.y1 + bottom.y0) == pytest.approx(0.5 * figure.bbox.height, abs=0.08 * figure.bbox.height)
    (walls,) = [axes for axes in figure.axes if axes.images]
    box = walls.get_window_extent()
    assert 0.0 < top.y0 - box.y1 < 0.1 * figure.bbox.height
    assert 0.0 < box.y0 - bottom.y1 < 0.1 * figure.bbox.height


def shown_film(trajectory):
    """A film of all frames, of which the last is shown."""
    numbers = list(range(len(trajectory)))
    with style.applied():
        picture = film._Film(trajectory, numbers, (320, 240), 100)
    picture.show(numbers[-1])
    return picture


def test_a_film_tells_how_many_are_inside(tmp_path):
    with a_leak(tmp_path) as trajectory:
        picture = shown_film(trajectory)
    assert picture._title.get_text() == "t = 2 s,  1 of 2 particles"
    assert np.isnan(picture._dots.get_offsets()).any(axis=1).sum() == 1


def test_a_film_between_planes_shows_also_the_last_frame(tmp_path):
    scene = swarm.Scene([swarm.Plane((0.0, 0.0, 1.0), 0.5), swarm.Plane((0.0, 0.0, -1.0), 0.5)])
    points = np.random.default_rng(1).uniform(-0.1, 0.1, (3, 50))
    start = swarm.Particles(points, 50.0 * points)
    swarm.simulate(scene, start, swarm.Impact(), until=1.0, every=0.5, trajectory=tmp_path / "run.h5")
    with swarm.load(tmp_path / "run.h5") as trajectory:
        scenery = shown_film(trajectory)._scenery
        seen = scenery.eye.seen(trajectory.frame(-1).position.T)[:, :2]
    assert (seen >= scenery.low).all()
    assert (seen <= scenery.high).all()


def test_ends_of_very_many_points_are_looked_for_among_some():
    points = np.random.default_rng(1).uniform(-1.0, 1.0, (3 * framed._ENOUGH, 3))
    found = np.vstack(framed.ends([points]))
    assert len(found) <= 128
    assert np.ptp(found @ np.array([0.0, 0.0, 1.0])) > 1.9


def test_balls_of_a_film_are_called_so(tmp_path):
    scene = swarm.Scene([swarm.Sphere(0.5)], pairs=swarm.Pairs())
    start = swarm.Particles([0.0, 0.0, 0.0], [1.0, 0.0, 0.0], radius=0.1)
    swarm.simulate(scene, start, swarm.Impact(), until=0.1, trajectory=tmp_path / "run.h5")
    with swarm.load(tmp_path / "run.h5") as trajectory:
        assert shown_film(trajectory)._title.get_text() == "t = 0.1 s,  1 ball"


@pytest.mark.parametrize("plane", ["z", None])
def test_where_all_have_gone_there_are_only_walls(plane, tmp_path):
    exits = [swarm.Box((0.1, 0.2, 1.0), center=(1.0, 0.0, 0.0))]
    scene = swarm.Scene([swarm.Box((1.0, 0.5, 0.5), openings=exits)], plane=plane)
    start = swarm.Particles([[0.0, 0.1], [0.0, 0.1], [0.0, 0.0]], [[1.0, 2.0], [0.0, 0.0], [0.0, 0.0]])
    swarm.simulate(scene, start, swarm.Impact(), until=3.0, every=1.5, trajectory=tmp_path / "run.h5")
    with swarm.load(tmp_path / "run.h5") as trajectory:
        texts = [one.get_text() for one in trajectory.plot().findobj(Text)]
        assert shown_film(trajectory)._title.get_text() == "t = 3 s,  0 of 2 particles"
    assert any(one.endswith("\n2 escaped, not drawn") and one.startswith("0 particles inside") for one in texts)
