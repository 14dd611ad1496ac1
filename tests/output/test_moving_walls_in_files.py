"""Where walls that move are: in trajectories, in recordings, in pictures."""

import numpy as np
import pytest
from same_bits import require_same_observables

import swarm
from swarm.motion import pose
from swarm.pictures import drawing, plots
from swarm.recording import playback, sheet
from swarm.surfaces.rotation import matrix
from swarm.triangles.shapes import shapes_of

MOVING = swarm.Scene(
    [
        swarm.Box((0.5, 0.4, 0.3), motion=swarm.Oscillation((0.05, 0.0, 0.02), 0.7, phase=0.3)),
        swarm.Box((0.2, 0.05, 0.1), side="outside", motion=swarm.Rotation((0.0, 0.0, 1.0), 1.0, (0.05, 0.0, 0.0))),
        swarm.Sphere(2.0),
    ]
)
TURN = swarm.Rotation((0.0, 0.0, 1.0), rate=1.0, center=(0.0, 0.0, 0.0))
REACTING = swarm.Scene(
    [
        swarm.Box((0.5, 0.5, 1.0)),
        swarm.Slab((0.0, 0.0, 1.0), 0.02, side="outside", mass=3.0, motion=swarm.Guide((0.0, 0.0, 1.0), speed=0.1)),
        swarm.Sphere(
            0.1, center=(0.2, 0.0, 0.4), side="outside", inertia=0.1, motion=swarm.Rotation((0, 0, 1), 1, (0, 0, 0))
        ),
    ]
)
SCENES = {"moving": MOVING, "reacting": REACTING}


@pytest.fixture(scope="module", params=SCENES)
def run(request, tmp_path_factory):
    folder, scene = tmp_path_factory.mktemp("moving"), SCENES[request.param]
    result = swarm.simulate(
        scene, swarm.fill(scene, 40, speed=0.5, seed=1), swarm.Impact(), until=1.0, every=0.25, compile="never",
        trajectory=folder / "run.h5", recording=folder / "run.rrd",
    )  # fmt: skip
    return folder, scene, result


def test_the_trajectory_has_them(run):
    folder, scene, result = run
    with swarm.load(folder / "run.h5") as trajectory:
        seen = trajectory.observables
        assert trajectory.scene == scene
        assert seen["wall_position"].shape == (5, 3, 3)
        assert seen["wall_orientation"].shape == (5, 3, 4)
        assert seen["wall_work"].shape == (5, 3)
        require_same_observables(trajectory, result)


def test_a_given_motion_is_where_its_table_says():
    result = swarm.simulate(
        MOVING, swarm.fill(MOVING, 5, speed=0.5, seed=1), swarm.Impact(), until=1.0, every=0.25, compile="never"
    )
    for k, moment in enumerate(result.observables["time"]):
        for i, surface in enumerate(MOVING.surfaces):
            found = pose(surface.motion, moment)
            assert result.observables["wall_position"][k, i] == pytest.approx(found.position(), abs=1e-15)
            assert matrix(tuple(result.observables["wall_orientation"][k, i])) == pytest.approx(found.turn, abs=1e-15)


def test_particles_are_inside_the_walls_of_their_frame(run):
    folder, scene, result = run
    seen = result.observables
    with swarm.load(folder / "run.h5") as trajectory:
        for k, moment in enumerate(trajectory.times):
            still = scene.placed(seen["wall_position"][k], seen["wall_orientation"][k])
            distances = still.distances_outside(trajectory.frame(k).position, moment)
            assert distances.max() <= 1e-15
            if k:
                assert scene.placed(np.zeros((3, 3)), [[1, 0, 0, 0]] * 3) != still or not scene.reacts()


def test_the_recording_moves_them(run):
    folder, _scene, result = run
    held, seen = playback.Playback(folder / "run.rrd"), result.observables
    for k in range(5):
        for shape, then in zip(held.shapes_at(0), held.shapes_at(k), strict=True):
            i = int(shape.name.partition("_")[0])
            curves, moved = [shape.vertices, *shape.wires], [then.vertices, *then.wires]
            first, now = (matrix(tuple(seen["wall_orientation"][j, i])) for j in (0, k))
            places = seen["wall_position"][0, i], seen["wall_position"][k, i]
            for before, after in zip(curves, moved, strict=True):
                expected = (before - places[0]) @ (now @ first.T).T + places[1]
                assert after == pytest.approx(expected, abs=1e-6)
    assert np.abs(seen["wall_position"][-1] - seen["wall_position"][0]).max() > 0.01


def test_pictures_show_the_walls_of_their_time(run, tmp_path, monkeypatch):
    """The contact sheet of several frames, and the plot of the last one."""
    folder, scene, result = run
    seen, drawn, draw = result.observables, [], drawing.frame
    monkeypatch.setattr(
        drawing,
        "frame",
        lambda axes, points, packed, shapes, *rest: drawn.append(shapes) or draw(axes, points, packed, shapes, *rest),
    )
    held = playback.Playback(folder / "run.rrd")
    sheet.draw_sheet(held, tmp_path / "sheet.png", [0.0, 0.5, 1.0], False)
    for k, shapes in zip((0, 2, 4), drawn, strict=True):
        for held_one, shown in zip(held.shapes_at(k), shapes, strict=True):
            np.testing.assert_array_equal(shown.vertices, held_one.vertices)
            np.testing.assert_array_equal(np.vstack(shown.wires), np.vstack(held_one.wires))
    for first, last in zip(drawn[0], drawn[2], strict=True):
        i = int(first.name.partition("_")[0])
        way = np.abs(last.vertices - first.vertices).max()
        stays = (seen["wall_position"][0, i] == seen["wall_position"][-1, i]).all()
        stays &= (seen["wall_orientation"][0, i] == seen["wall_orientation"][-1, i]).all()
        assert (way == 0.0) == stays
    with swarm.load(folder / "run.h5") as trajectory:
        plots.draw_plot(trajectory, tmp_path / "run.png")
    still = scene.placed(seen["wall_position"][-1], seen["wall_orientation"][-1]) if scene.reacts() else scene
    for i, shape in enumerate(drawn[3]):
        if shape.wires:
            off = np.abs(still.distances_outside(np.vstack(shape.wires).T, 1.0)[i])
            assert np.median(off) <= 2e-3
    assert (tmp_path / "sheet.png").stat().st_size > 20_000
    assert (tmp_path / "run.png").stat().st_size > 20_000


def test_shapes_are_where_the_walls_are(run):
    """A slab and a box, drawn at the end: what is drawn is on the walls of that time."""
    _folder, scene, result = run
    seen, points = result.observables, result.particles.position
    still = scene.placed(seen["wall_position"][-1], seen["wall_orientation"][-1]) if scene.reacts() else scene
    for i, shape in enumerate(shapes_of(still, points, 1.0)):
        if len(shape.vertices):
            # Corners are cut.
            assert np.median(np.abs(still.distances_outside(shape.vertices.T, 1.0)[i])) <= 1e-4
