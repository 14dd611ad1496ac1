"""Exports as .csv, read by pandas, and as the start of another run."""

import numpy as np
import pandas
import pytest
from test_cli import command

import swarm

BALL = swarm.Scene([swarm.Sphere(0.5, openings=[swarm.Sphere(0.3, (0.0, 0.0, -0.5))])])
CELL = swarm.Scene([swarm.Sphere(0.2, side="outside"), swarm.Slab((0, 0, 1), 0.4)], period=(1.0, 1.0, None))
BOX = swarm.Scene([swarm.Box((0.5, 0.4, 0.3))], pairs=swarm.Pairs(restitution=0.9))


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    """A trajectory of each kind."""
    grains = swarm.fill(BOX, 4, speed=0.4, radius=[0.01, 0.02, 0.03, 0.04], mass=[1.0, 2.0, 3.0, 4.0], seed=1)
    rods = swarm.place(BOX, swarm.dumbbell(0.05, 1.0), 3, speed=0.3, seed=2)
    starts = {
        "leaky": (BALL, swarm.fill(BALL, 30, speed=2.0, seed=1), {}),
        "cell": (CELL, swarm.fill(CELL, 6, speed=5.0, seed=1), {}),
        "grains": (BOX, grains, {}),
        "some": (CELL, swarm.fill(CELL, 9, speed=0.4, seed=1), {"frames": 2, "precision": "float32"}),
        "rods": (swarm.Scene([swarm.Box((0.5, 0.4, 0.3))]), rods, {}),
        "born": (BALL, None, {"sources": swarm.Source(0, times=(0.15, 0.35, 0.45), temperature=1.0)}),
    }
    found = {}
    for name, (scene, start, more) in starts.items():
        found[name] = tmp_path_factory.mktemp(name) / "run.h5"
        method = swarm.Impact(dt=0.01) if name == "rods" else swarm.Impact()
        swarm.simulate(
            scene, start, method, until=0.5, every=0.1, compile="never", trajectory=found[name], seed=1, **more
        )  # fmt: skip
    return found


PARTS = {
    "x": ("position", 0), "y": ("position", 1), "z": ("position", 2),
    "vx": ("velocity", 0), "vy": ("velocity", 1), "vz": ("velocity", 2),
    "wx": ("spin", 0), "wy": ("spin", 1), "wz": ("spin", 2),
    "image_x": ("image", 0), "image_y": ("image", 1), "image_z": ("image", 2),
}  # fmt: skip


@pytest.mark.parametrize("kind", ["leaky", "cell", "grains", "some", "rods"])
def test_pandas_reads_every_bit(stored, tmp_path, kind):
    with swarm.load(stored[kind]) as trajectory:
        (path,) = trajectory.export(tmp_path / "out.csv")
        table = pandas.read_csv(path)
        n = len(trajectory.ids)
        assert len(table) == 6 * n
        assert table.columns[:10].tolist() == ["frame", "time", "id", "x", "y", "z", "vx", "vy", "vz", "mass"]
        for k in range(6):
            rows, expected = table[table.frame == k], trajectory.columns(k)
            assert (rows.time == trajectory.times[k]).all()
            np.testing.assert_array_equal(rows.id, trajectory.ids)
            np.testing.assert_array_equal(rows.mass, trajectory.frame(k).mass)
            held = {name: expected[whole][:, axis] for name, (whole, axis) in PARTS.items() if whole in expected}
            held |= {name: values for name, values in expected.items() if values.ndim == 1}
            held |= {"radius": trajectory.radius} if kind == "grains" else {}
            held |= {"body": trajectory.ids % 3} if kind == "rods" else {}
            assert set(table.columns) == {"frame", "time", "id", "mass", *held}
            for name, values in held.items():
                np.testing.assert_array_equal(rows[name].to_numpy(), values)
    # A spreadsheet shows a cell without a number, not a word.
    assert b"nan" not in path.read_bytes()
    if kind == "leaky":
        assert 0 < table.escape_time[-30:].isna().sum() < 30


def test_a_particle_that_comes_later_has_no_line_yet(stored, tmp_path):
    with swarm.load(stored["born"]) as trajectory:
        trajectory.export(tmp_path / "out.csv")
    table = pandas.read_csv(tmp_path / "out.csv")
    assert table.groupby("frame").size().to_dict() == {2: 1, 3: 1, 4: 2, 5: 3}


@pytest.mark.parametrize("kind", ["leaky", "cell", "grains", "some"])
def test_one_frame_is_a_start(stored, tmp_path, kind):
    with swarm.load(stored[kind]) as trajectory:
        trajectory.export(tmp_path / "start.csv", frames=-1)
        found, last = swarm.Particles.from_csv(tmp_path / "start.csv"), trajectory.frame(-1)
        for name in ("position", "velocity", "mass", "radius", "spin"):
            np.testing.assert_array_equal(getattr(found, name), getattr(last, name))
        trajectory.export(tmp_path / "all.csv")
    with pytest.raises(swarm.SceneError, match=r"all\.csv: expected particles at one time, got 6 frames; export one"):
        swarm.Particles.from_csv(tmp_path / "all.csv")


def test_points_of_bodies_are_no_start(stored, tmp_path):
    with swarm.load(stored["rods"]) as trajectory:
        trajectory.export(tmp_path / "start.csv", frames=-1)
    with pytest.raises(swarm.SceneError, match=r"columns are frame, .*body"):
        swarm.Particles.from_csv(tmp_path / "start.csv")


def test_the_command(stored, tmp_path):
    done = command("export", str(stored["cell"]), "-o", "out.csv", "--frames", "-1", "--particles", "2", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert pandas.read_csv(tmp_path / "out.csv").id.tolist() == [0, 2, 4]
    done = command("export", str(stored["cell"]), "-o", "out.ply", cwd=tmp_path)
    assert done.stdout.startswith("written to out_0000.ply to out_0005.ply (6 files, 0.0 MB)")
    done = command("export", str(stored["cell"]), "-o", "out.obj", "--particles", "2", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("error: export: an .obj has the walls, and no particles; leave out particles=2")
