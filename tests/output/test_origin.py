"""Scenes far from the origin, as maps have them: files in float32 keep particles apart, or are refused."""

import gsd.hoomd
import h5py
import numpy as np
import pytest

import swarm
from swarm.files import origin
from swarm.recording import playback, recorded, sheet
from swarm.recording import writer as recording

# East and north of a map [m], and a height.
PLACE = (7e5, 5.2e6, 120.0)
FRAMES = 5


def vessel(place=PLACE, **options):
    x, y, z = place
    ball = swarm.Sphere(0.1, place, "outside", **options)
    return swarm.Scene([swarm.Box((0.5, 0.4, 0.3), (x, y, z)), ball])


def run(scene, folder, **options):
    start = swarm.fill(scene, 40, speed=1.0, seed=1)
    return swarm.simulate(
        scene, start, swarm.Impact(), until=1.0, every=0.25, compile="never", trajectory=folder / "run.h5", **options
    )


MOVING = {
    "still": {},
    "to and fro": {"motion": swarm.Oscillation((0.0, 0.0, 0.1), 1.0)},
    "turns": {"motion": swarm.Rotation((0.0, 0.0, 1.0), 2.0, (PLACE[0] + 0.1, *PLACE[1:]))},
}


@pytest.mark.parametrize("name", MOVING)
def test_a_recording_keeps_the_centre(tmp_path, name):
    """Positions come back to the round-off of float32 near the origin, as walls do, also those that move."""
    scene = vessel(**MOVING[name])
    run(scene, tmp_path, recording=tmp_path / "run.rrd")
    held = playback.Playback(tmp_path / "run.rrd")
    np.testing.assert_array_equal(held.center, PLACE)
    with swarm.load(tmp_path / "run.h5") as trajectory:
        recorded.record(trajectory, tmp_path / "later.rrd", recording.Settings())
        later = playback.Playback(tmp_path / "later.rrd")
        for k in range(FRAMES):
            for one in (held, later):
                position = trajectory.frame(k).position
                np.testing.assert_allclose(one.frame(k)[0], position.T, rtol=0.0, atol=1e-7)
                assert len(np.unique(one.frame(k)[0][:, 1])) == 40
                balls = np.vstack(
                    [part for shape in one.shapes_at(k) if shape.solid for part in (shape.vertices, *shape.wires)]
                )
                at = trajectory.times[k]
                gaps = scene.gaps(balls.T, float(at))[1]
                assert np.abs(gaps).max() < 2e-3
    assert sheet.draw_sheet(held, tmp_path / "sheet.png", [0.0, 1.0], False).startswith("matplotlib")


def test_a_recording_near_the_origin_is_what_it_was(tmp_path):
    scene = vessel((3.0, -2.0, 0.5))
    result = run(scene, tmp_path, recording=tmp_path / "run.rrd")
    held = playback.Playback(tmp_path / "run.rrd")
    assert not held.center.any()
    np.testing.assert_array_equal(held.frame(FRAMES - 1)[0], result.particles.position.T.astype(np.float32))


def test_bodies_are_recorded_there_too(tmp_path):
    scene = swarm.Scene([swarm.Sphere(0.5, (5e4, -3e4, 0.0))])
    bodies = swarm.place(scene, swarm.dumbbell(0.1, 1.0), 6, speed=0.5, seed=2)
    result = swarm.simulate(
        scene, bodies, swarm.Impact(dt=0.05), until=0.2, recording=tmp_path / "run.rrd", compile="never"
    )
    lines = playback.Playback(tmp_path / "run.rrd").lines(1)[0]
    lengths = np.sqrt(((lines[:, 0] - lines[:, 1]) ** 2).sum(axis=1))
    np.testing.assert_allclose(lengths, 0.1, atol=1e-6)
    np.testing.assert_allclose(lines[:, 0].T, result.bodies.position[:, 0], rtol=0.0, atol=1e-7)


def test_gsd_keeps_the_center(tmp_path):
    scene = vessel()
    run(scene, tmp_path)
    with swarm.load(tmp_path / "run.h5") as trajectory:
        trajectory.export(tmp_path / "run.gsd")
        with gsd.hoomd.open(str(tmp_path / "run.gsd")) as file:
            for k, frame in enumerate(file):
                assert (frame.log["center"] == PLACE).all()
                found = frame.particles.position + frame.log["center"]
                np.testing.assert_allclose(found, trajectory.frame(k).position.T, rtol=0.0, atol=1e-7)
                np.testing.assert_allclose(frame.configuration.box[:3], (1.0, 0.8, 0.6), rtol=1e-6)


def test_exports_in_float64_keep_what_there_is(tmp_path):
    scene = vessel()
    result = run(scene, tmp_path)
    with swarm.load(tmp_path / "run.h5") as trajectory:
        trajectory.export(tmp_path / "run.vtkhdf", surfaces=False)
    with h5py.File(tmp_path / "run.vtkhdf") as file:
        np.testing.assert_array_equal(file["VTKHDF/Points"][-40:], result.particles.position.T)


@pytest.mark.parametrize("file", ["trajectory", "impacts"])
def test_float32_is_refused_there(tmp_path, file):
    scene = vessel()
    start = swarm.fill(scene, 4, speed=1.0)
    options = {file: tmp_path / "run.h5", "precision": "float32", "compile": "never"}
    with pytest.raises(swarm.SceneError, match=r'precision must be "float64" where .* are rounded to 0\.5 m'):
        swarm.simulate(scene, start, swarm.Impact(), until=1.0, **options)
    assert not (tmp_path / "run.h5").exists()
    near = vessel((30.0, 10.0, 0.0))
    swarm.simulate(near, swarm.fill(near, 4, speed=1.0), swarm.Impact(), until=1.0, **options)


def test_gsd_refuses_images_that_it_cannot_hold(tmp_path):
    walls = swarm.Plane((0.0, 0.0, -1.0), 0.0), swarm.Plane((0.0, 0.0, 1.0), 1.0)
    scene = swarm.Scene(walls, period=(1.0, 1.0, None))
    start = swarm.Particles([0.25, 0.5, 0.5], [-1e3, 0.0, 0.0])
    swarm.simulate(
        scene, start, swarm.Impact(), until=4e6, every=1e6, compile="never", trajectory=tmp_path / "run.h5"
    )  # fmt: skip
    with swarm.load(tmp_path / "run.h5") as trajectory:
        assert trajectory.frame(-1).image[0, 0] == -4_000_000_000
        with pytest.raises(swarm.SceneError, match=r"images within 2\*\*31 - 1, got 3000000000 in frame 3"):
            trajectory.export(tmp_path / "run.gsd")
        assert not (tmp_path / "run.gsd").exists()
        trajectory.export(tmp_path / "run.gsd", frames=slice(0, 3))


def test_where_the_origin_is():
    """The centre of what is bounded, else that of the particles; 0 within a few dozen widths of it."""
    assert (origin.origin_of(vessel(), swarm.fill(vessel(), 5, speed=1.0)) == PLACE).all()
    near = vessel((20.0, 20.0, 20.0))
    assert not origin.origin_of(near, swarm.fill(near, 5, speed=1.0)).any()
    floor = swarm.Scene([swarm.Plane((0.0, 0.0, -1.0), 0.0)])
    start = swarm.Particles([[7e5, 7e5 + 2.0], [5e6, 5e6], [0.0, 1.0]], np.zeros((3, 2)))
    assert origin.origin_of(floor, start).tolist() == [7e5 + 1.0, 5e6, 0.5]
