"""Pictures, sheets, films and tables of runs in which nothing differs from anything: no library warns of them."""

import itertools

import numpy as np
import pytest

import swarm
from swarm.recording import playback, recorded, sheet
from swarm.recording import writer as recording

WALL = swarm.Sphere(0.5)
FLOOR = swarm.Plane((0.0, 0.0, -1.0))
# Open on all sides: it has no curves to draw.
NOWHERE = swarm.Sphere(0.5, openings=[swarm.Plane((0.0, 0.0, 1.0), 5.0)])
CUBE = swarm.rigid(0.05 * np.array(list(itertools.product((-1.0, 1.0), repeat=3))), 1000.0)


def points(n, place=0.0, velocity=0.0):
    return swarm.Particles(np.full((3, n), place), np.full((3, n), velocity))


RUNS = {
    "one at rest": (swarm.Scene([WALL]), points(1), {"until": 1.0}),
    "three at one place": (swarm.Scene([WALL]), points(3, 0.1), {"until": 1.0, "every": 0.5}),
    "in a plane": (swarm.Scene([FLOOR]), points(3), {"until": 1.0}),
    "at rest on it": (swarm.Scene([FLOOR], gravity=(0.0, 0.0, -1.0)), points(1), {"until": 1.0}),
    "all escaped": (swarm.Scene([NOWHERE]), points(2, 0.0, 1.0), {"until": 3.0, "every": 1.0}),
    "far away": (swarm.Scene([swarm.Sphere(0.5, center=(1e6, 1e6, 1e6))]), points(2, 1e6), {"until": 1.0}),
    "tiny": (swarm.Scene([swarm.Sphere(1e-9)]), points(1, 0.0, 1e-9), {"until": 1.0}),
    "hardly moving": (swarm.Scene([WALL]), points(1, 0.0, 5e-324), {"until": 1.0}),
    "for ever": (swarm.Scene([WALL]), points(1), {"until": 1e300}),
    "for an instant": (swarm.Scene([WALL]), points(1, 0.0, 1.0), {"until": 1e-300}),
    "float32": (swarm.Scene([WALL]), points(1), {"until": 1.0, "precision": "float32"}),
    "one body": (swarm.Scene([WALL]), swarm.place(swarm.Scene([WALL]), CUBE, 1, seed=1), {"until": 0.02}),
}


@pytest.fixture(params=RUNS)
def run(request, tmp_path):
    scene, start, times = RUNS[request.param]
    method = swarm.Impact(dt=1e-2) if request.param == "one body" else swarm.Impact()
    result = swarm.simulate(scene, start, method, trajectory=tmp_path / "run.h5", compile="never", **times)
    with swarm.load(tmp_path / "run.h5") as trajectory:
        yield result, trajectory


def test_a_picture_a_film_and_tables_of_nothing_in_particular(run, tmp_path):
    """The figure of a result is that of its trajectory: it is drawn where there is more than one particle."""
    result, trajectory = run
    trajectory.plot().draw_without_rendering()
    if len(result.particles) > 1:
        result.plot().draw_without_rendering()
    assert trajectory.animate(tmp_path / "run.gif", size=(160, 120), frames=2).stat().st_size
    assert len(trajectory.table()) == len(trajectory)
    assert trajectory.to_xarray().load().sizes["time"] == len(trajectory)
    assert trajectory._repr_html_()


def test_a_recording_and_its_sheet(run, tmp_path):
    _result, trajectory = run
    recorded.record(trajectory, tmp_path / "run.rrd", recording.Settings())
    sheet.draw_sheet(playback.Playback(tmp_path / "run.rrd"), tmp_path / "sheet.png", None, False)
    assert (tmp_path / "sheet.png").stat().st_size


@pytest.mark.parametrize("frames", [1, 2])
def test_the_first_frames_of_a_run(frames, tmp_path):
    """As a run that was killed at its start leaves them."""

    def end(frame):
        if frame.number == frames - 1:
            raise KeyboardInterrupt

    path = tmp_path / "run.h5"
    with pytest.raises(KeyboardInterrupt):
        swarm.simulate(
            swarm.Scene([WALL]), points(2, 0.0, 1.0), swarm.Impact(), until=1.0, every=0.1, trajectory=path,
            progress=end, compile="never",
        )  # fmt: skip
    with swarm.load(path) as trajectory:
        assert len(trajectory) >= frames
        trajectory.plot().draw_without_rendering()
        trajectory.animate(tmp_path / "run.gif", size=(160, 120), frames=2)


@pytest.mark.parametrize("size", [(64, 64), (64, 480), (480, 64), (128, 96)])
def test_a_film_of_any_size_has_room_for_its_axes(size, tmp_path):
    from PIL import Image

    swarm.simulate(
        swarm.Scene([WALL]), points(2, 0.1, 1.0), swarm.Impact(), until=1.0, trajectory=tmp_path / "run.h5",
        compile="never",
    )  # fmt: skip
    with (
        swarm.load(tmp_path / "run.h5") as trajectory,
        Image.open(trajectory.animate(tmp_path / "run.gif", size=size)) as film,
    ):
        assert film.size == size
