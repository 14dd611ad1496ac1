"""Exported files, opened by the programs they are for: VTK, ASE and GSD's own reader."""

import os
import sys
from decimal import Decimal

import ase.io
import gsd.hoomd
import numpy as np
import pytest
from conftest import edited
from test_cli import command
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOHDF import vtkHDFReader

import swarm

CAVITY = swarm.Scene(surfaces=[swarm.Ellipsoid((0.3, 0.3, 0.6)), swarm.Sphere(0.1, (0.0, 0.0, 0.1), "outside")])
CELL = swarm.Scene(surfaces=[swarm.Sphere(0.2, side="outside"), swarm.Slab((0, 0, 1), 0.4)], period=(1.0, 1.0, None))
AROUND = swarm.Rotation((0, 0, 1), 2.0, (0.2, 0.0, 0.0))
SHAKEN = swarm.Scene(surfaces=[swarm.Box((0.5, 0.5, 0.5)), swarm.Sphere(0.1, side="outside", motion=AROUND)])
LEAKY = swarm.Scene(surfaces=[swarm.Sphere(0.5, openings=[swarm.Sphere(0.3, (0.0, 0.0, -0.5))])])


def run(folder, scene, particles, **options):
    path = folder / "run.h5"
    method = swarm.Impact() if isinstance(particles, swarm.Particles) else swarm.Impact(dt=0.01)
    options = {"until": 0.5, "every": 0.1, "compile": "never", "trajectory": path, **options}
    swarm.simulate(scene, particles, method, **options)
    return path


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    """A trajectory of each kind of scene."""
    dice = swarm.place(CAVITY, swarm.tetrahedron(0.05, 1.0), 3, speed=0.3, spin=2.0, seed=2)
    starts = {
        "cavity": (CAVITY, swarm.fill(CAVITY, 7, speed=0.4, mass=np.linspace(1.0, 2.0, 7), seed=1), {}),
        "cell": (CELL, swarm.fill(CELL, 6, speed=5.0, seed=1), {}),
        "shaken": (SHAKEN, swarm.fill(SHAKEN, 5, speed=0.4, seed=1), {}),
        "leaky": (LEAKY, swarm.fill(LEAKY, 8, speed=2.0, seed=1), {}),
        "some": (CAVITY, swarm.fill(CAVITY, 9, speed=0.4, seed=1), {"frames": 2, "precision": "float32"}),
        "packed": (CAVITY, swarm.fill(CAVITY, 4, speed=0.4, seed=1), {"compression": "gzip"}),
        "bodies": (CAVITY, dice, {}),
    }
    return {
        name: run(tmp_path_factory.mktemp(name), scene, start, **more) for name, (scene, start, more) in starts.items()
    }


KINDS = ("cavity", "cell", "shaken", "leaky", "some", "packed", "bodies")


def steps_of(path):
    """Every step by VTK's reader: the time, the points, the data of points and cells, vertices, lines, triangles."""
    reader = vtkHDFReader()
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    for step in range(reader.GetNumberOfSteps()):
        reader.SetStep(step)
        reader.Update()
        data = reader.GetOutput()
        points, cells = (
            {part.GetArrayName(k): vtk_to_numpy(part.GetArray(k)).copy() for k in range(part.GetNumberOfArrays())}
            for part in (data.GetPointData(), data.GetCellData())
        )
        connected = [
            vtk_to_numpy(part.GetConnectivityArray()).copy()
            for part in (data.GetVerts(), data.GetLines(), data.GetPolys())
        ]
        yield reader.GetTimeValue(), vtk_to_numpy(data.GetPoints().GetData()).copy(), points, cells, connected


@pytest.mark.parametrize("kind", KINDS)
def test_vtk_reads_every_step(stored, tmp_path, kind):
    with swarm.load(stored[kind]) as trajectory:
        assert trajectory.export(tmp_path / "out.vtkhdf", surfaces=False) == [tmp_path / "out.vtkhdf"]
        found = list(steps_of(tmp_path / "out.vtkhdf"))
        assert len(found) == len(trajectory) == 6
        for k, (time, position, points, _cells, (vertices, lines, triangles)) in enumerate(found):
            assert time == pytest.approx(trajectory.times[k], rel=1e-15)
            expected = trajectory.columns(k)
            assert position.dtype == expected["position"].dtype
            np.testing.assert_array_equal(position, expected.pop("position"))
            assert points.keys() == {*expected, "id", "mass"}
            for name, values in expected.items():
                np.testing.assert_array_equal(points[name], values)
            np.testing.assert_array_equal(points["id"], trajectory.ids)
            np.testing.assert_array_equal(points["mass"], trajectory.frame(k).mass)
            np.testing.assert_array_equal(vertices, np.arange(len(position)))
            np.testing.assert_array_equal(lines, trajectory.bonds.ravel())
            assert len(triangles) == 0


def test_the_steps_are_found_by_their_times(stored, tmp_path):
    """As ParaView asks for them, after the information."""
    with swarm.load(stored["cavity"]) as trajectory:
        trajectory.export(tmp_path / "out.vtkhdf", surfaces=False)
        reader = vtkHDFReader()
        reader.SetFileName(str(tmp_path / "out.vtkhdf"))
        reader.UpdateInformation()
        for k in (3, 0, 5):
            reader.UpdateTimeStep(trajectory.times[k])
            np.testing.assert_array_equal(
                vtk_to_numpy(reader.GetOutput().GetPoints().GetData()).T, trajectory.frame(k).position
            )


@pytest.mark.parametrize("every", ["0.1", "0.007", "1e-3"])
def test_the_steps_are_found_by_times_that_are_typed(tmp_path, every):
    """Of 0.30000000000000004, 3 times 0.1 in binary, 0.3 would be the step before."""
    first = swarm.Particles([0.0, 0.0, 0.0], [0.1, 0.0, 0.0])
    path = run(tmp_path, CAVITY, first, until=20 * float(every), every=float(every), compile="never")
    with swarm.load(path) as trajectory:
        assert len(trajectory) == 21
        trajectory.export(tmp_path / "out.vtkhdf", surfaces=False)
        reader = vtkHDFReader()
        reader.SetFileName(str(tmp_path / "out.vtkhdf"))
        reader.UpdateInformation()
        for k in range(21):
            reader.UpdateTimeStep(float(k * Decimal(every)))
            x = vtk_to_numpy(reader.GetOutput().GetPoints().GetData())[0, 0]
            assert x == trajectory.frame(k).position[0, 0]


def test_walls_are_triangles_where_they_are(stored, tmp_path):
    for kind, steps in (("cavity", 1), ("shaken", 6)):
        with swarm.load(stored[kind]) as trajectory:
            scene, times = trajectory.scene, trajectory.times
            assert trajectory.export(tmp_path / f"{kind}.vtkhdf")[1] == tmp_path / f"{kind}.surfaces.vtkhdf"
        found = list(steps_of(tmp_path / f"{kind}.surfaces.vtkhdf"))
        assert len(found) == steps
        for k, (time, position, _points, cells, (_vertices, _lines, triangles)) in enumerate(found):
            assert time == pytest.approx(times[k] if steps > 1 else 0.0, rel=1e-15)
            corners = position[triangles].reshape(-1, 3, 3)
            assert cells["solid"].tolist() == [int(scene.surfaces[i].is_solid()) for i in cells["surface"]]
            for i in range(2):
                gaps = scene.gaps(corners[cells["surface"] == i].reshape(-1, 3).T, times[k])[i]
                assert len(gaps) > 100
                # The grid is coarse: 48 points a side.
                assert abs(gaps).max() < 0.02


@pytest.mark.parametrize("motion", [None, swarm.Translation((0.1, 0.0, 0.0))], ids=["at rest", "moving"])
def test_walls_that_come_and_go_are_in_the_steps_in_which_they_are_there(tmp_path, motion):
    """By VTK's reader, each step on its own and in any order."""
    walls = [
        swarm.Box((1.0, 1.0, 1.0)),
        swarm.Box((0.2, 0.1, 0.1), (0.5, 0.0, 0.0), "outside", present=[(0.0, 0.4)]),
        swarm.Box((0.1, 0.2, 0.1), (-0.5, 0.0, 0.0), "outside", present=[(0.4, 0.7)], motion=motion),
    ]
    start = swarm.Particles([0.0, 0.5, 0.0], [0.1, 0.0, 0.0])
    path = run(tmp_path, swarm.Scene(walls), start, until=1.0, every=0.25, compile="never")
    with swarm.load(path) as trajectory:
        trajectory.export(tmp_path / "out.vtkhdf")
    found = list(steps_of(tmp_path / "out.surfaces.vtkhdf"))
    assert [set(cells["surface"].tolist()) for *_before, cells, _connected in found] == [
        {0, 1}, {0, 1}, {0, 2}, {0}, {0},
    ]  # fmt: skip
    for time, position, _points, cells, (_vertices, _lines, triangles) in found:
        for i in set(cells["surface"].tolist()):
            corners = position[triangles.reshape(-1, 3)[cells["surface"] == i]].reshape(-1, 3)
            shift = 0.0 if i < 2 or motion is None else 0.1 * time
            middle, half = 0.5 * (corners.max(axis=0) + corners.min(axis=0)), 0.5 * np.ptp(corners, axis=0)
            np.testing.assert_allclose(middle, np.add(walls[i].center, (shift, 0.0, 0.0)), atol=1e-12)
            np.testing.assert_allclose(half, walls[i].half_widths, rtol=1e-12)
            assert cells["solid"][cells["surface"] == i].tolist() == [int(i > 0)] * (len(corners) // 3)


CORNERS = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)])
FACES = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)]
HOLE = swarm.Sphere(0.15, (0.3, 0.3, 0.0))


def counted_on(folder, surfaces):
    """A run that counts the impacts of members, its log, and the steps of its walls by VTK's reader."""
    scene = swarm.Scene(surfaces)
    gas = swarm.fill(scene, 50, speed=1.0, seed=1)
    path = run(folder, scene, gas, member_impacts=True, impacts=folder / "log.h5")
    with swarm.load(path) as trajectory, swarm.load_impacts(folder / "log.h5") as log:
        trajectory.export(folder / "out.vtkhdf")
        table = log.table()
    return trajectory, table, list(steps_of(folder / "out.surfaces.vtkhdf"))


@pytest.mark.parametrize(
    "given", [{}, {"openings": [HOLE]}, {"motion": swarm.Translation((0.05, 0.0, 0.0))}], ids=["whole", "cut", "moving"]
)
def test_the_wear_of_a_mesh_is_on_its_triangles(tmp_path, given):
    """The impacts of a triangle are those of the log in its plane, also where an opening cuts triangles into parts."""
    _trajectory, table, steps = counted_on(tmp_path, [swarm.Mesh(CORNERS, FACES, **given)])
    assert [time for time, *_rest in steps] == pytest.approx(0.1 * np.arange(6))
    velocity = np.array([0.05 if "motion" in given else 0.0, 0.0, 0.0])
    for time, position, _points, cells, (_vertices, _lines, triangles) in steps:
        hits = table[table["time"] <= time]
        places = hits["position"] - hits["time"][:, None] * velocity
        a, b, c = np.moveaxis(position[triangles].reshape(-1, 3, 3) - time * velocity, 1, 0)
        normal = np.cross(b - a, c - a)
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        off = np.einsum("ck,chk->ch", normal, places[None] - a[:, None])
        assert (np.abs(off) < 1e-9).sum(axis=1).tolist() == cells["impacts"].tolist()
    assert cells["impacts"].min() > 5


@pytest.mark.parametrize(
    "surfaces",
    [
        [swarm.Union([swarm.Sphere(0.5), swarm.Box((0.3, 0.3, 0.3), (0.5, 0.0, 0.0))])],
        [swarm.Box((0.6, 0.6, 0.6)), swarm.Spheres([[0.4, 0.0, 0.0], [-0.3, 0.0, 0.0]], [0.1, 0.2])],
        [swarm.Box((0.6, 0.6, 0.6)), swarm.Boxes([[0.4, 0.0, 0.0], [-0.3, 0.0, 0.0]], (0.1, 0.2, 0.2))],
        [swarm.Sphere(0.5), swarm.Sphere(0.2, side="outside", present=[(0.0, 0.25)])],
    ],
    ids=["parts", "spheres", "boxes", "a wall that goes"],
)
def test_impacts_of_parts_and_solids_are_on_their_triangles(tmp_path, surfaces):
    trajectory, _table, steps = counted_on(tmp_path, surfaces)
    with swarm.load(trajectory.path) as trajectory:
        parts = trajectory.scene.parts
        for k, (_time, position, _points, cells, (_vertices, _lines, triangles)) in enumerate(steps):
            middles = position[triangles].reshape(-1, 3, 3).mean(axis=1)
            for i, values in enumerate(trajectory.members(k)["impacts"]):
                here = cells["surface"] == i
                found = cells["impacts"][here]
                if parts:
                    expected = values[cells["part"][here]]
                elif len(values) == 2:
                    expected = values[(middles[here, 0] < 0.0).astype(int)]
                else:
                    expected = np.full(here.sum(), values[0])
                assert found.tolist() == expected.tolist()
    assert len(set(cells["impacts"].tolist())) > 1 or len(surfaces) == 2


def test_walls_without_counts_have_no_data_of_members(stored, tmp_path):
    with swarm.load(stored["cavity"]) as trajectory:
        trajectory.export(tmp_path / "out.vtkhdf")
    (*_rest, cells, _connected), = steps_of(tmp_path / "out.surfaces.vtkhdf")  # fmt: skip
    assert set(cells) == {"surface", "solid"}


@pytest.mark.parametrize("kind", KINDS)
def test_ase_reads_every_bit(stored, tmp_path, kind):
    with swarm.load(stored[kind]) as trajectory:
        (path,) = trajectory.export(tmp_path / "out.xyz")
        found = ase.io.read(path, index=":")
        assert len(found) == len(trajectory)
        for k, atoms in enumerate(found):
            expected = trajectory.columns(k)
            np.testing.assert_array_equal(atoms.positions, expected.pop("position"))
            np.testing.assert_array_equal(atoms.arrays["velo"], expected.pop("velocity"))
            np.testing.assert_array_equal(atoms.arrays["id"], trajectory.ids)
            for name, values in expected.items():
                np.testing.assert_array_equal(atoms.arrays[name], values)
            assert set(atoms.symbols) == {"X"}
            assert (atoms.info["Time"], atoms.info["frame"]) == (trajectory.times[k], k)
            np.testing.assert_array_equal(atoms.get_masses(), trajectory.frame(k).mass)
            moved = atoms.get_velocities(), trajectory.frame(k).velocity.T
            np.testing.assert_allclose(*moved, rtol=1e-15, atol=1e-300)
            mass = atoms.arrays["mass"] if "mass" in atoms.arrays else np.full(len(atoms), atoms.info["mass"])
            np.testing.assert_array_equal(mass, trajectory.frame(k).mass)
            repeats = kind == "cell"
            assert atoms.pbc.tolist() == [repeats, repeats, False]
            assert atoms.cell.lengths().tolist() == ([1.0, 1.0, 0.8] if repeats else [0.0, 0.0, 0.0])


@pytest.mark.parametrize("kind", KINDS)
def test_gsd_reads_float32(stored, tmp_path, kind):
    with swarm.load(stored[kind]) as trajectory:
        (path,) = trajectory.export(tmp_path / "out.gsd")
        with gsd.hoomd.open(str(path)) as found:
            assert len(found) == len(trajectory)
            for k, frame in enumerate(found):
                expected = trajectory.columns(k)
                center = [0.5, 0.5, 0.0] if kind == "cell" else [0.0, 0.0, 0.0]
                shifted = (expected["position"] - center).astype(np.float32)
                np.testing.assert_array_equal(frame.particles.position, shifted)
                np.testing.assert_array_equal(frame.particles.velocity, expected["velocity"].astype(np.float32))
                np.testing.assert_array_equal(frame.particles.mass, trajectory.frame(k).mass.astype(np.float32))
                assert frame.configuration.step == k
                assert frame.log["time"] == trajectory.times[k]
                np.testing.assert_array_equal(frame.log["particles/id"], trajectory.ids)
                np.testing.assert_array_equal(frame.log["particles/impacts"], expected["impacts"])
                edges = frame.configuration.box[:3]
                assert (abs(frame.particles.position) <= 0.5 * edges).all()
                np.testing.assert_array_equal(frame.bonds.group, trajectory.bonds)
                if kind == "cell":
                    np.testing.assert_allclose(edges, [1.0, 1.0, 0.8], rtol=1e-6)
                    np.testing.assert_array_equal(frame.particles.image, expected["image"])
                    assert frame.log["center"].tolist() == center


@pytest.mark.skipif(os.name != "posix", reason="permissions are those of POSIX")
@pytest.mark.parametrize("suffix", [".gsd", ".xyz"])
def test_a_new_file_has_the_permissions_of_every_new_file(stored, tmp_path, suffix):
    """The gsd library makes files that only the owner and the group may read."""
    (tmp_path / "new").touch()
    path = tmp_path / f"gas{suffix}"
    with swarm.load(stored["cavity"]) as trajectory:
        trajectory.export(path)
    assert path.stat().st_mode == (tmp_path / "new").stat().st_mode


def test_images_say_where_particles_have_come(stored, tmp_path):
    """In GSD as in the scene: position + image times the cell."""
    with swarm.load(stored["cell"]) as trajectory:
        trajectory.export(tmp_path / "out.gsd", frames=-1)
        last, scene = trajectory.frame(-1), trajectory.scene
    with gsd.hoomd.open(str(tmp_path / "out.gsd")) as found:
        frame = found[0]
    assert abs(frame.particles.image).max() > 0
    unwrapped = frame.particles.position + frame.particles.image * frame.configuration.box[:3] * [1.0, 1.0, 0.0]
    np.testing.assert_allclose((unwrapped + frame.log["center"]).T, scene.unwrapped(last), atol=1e-6)


def test_some_frames_and_particles(stored, tmp_path):
    with swarm.load(stored["some"]) as trajectory:
        trajectory.export(tmp_path / "out.xyz", frames=slice(None, None, -2), particles=2)
        found = ase.io.read(tmp_path / "out.xyz", index=":")
        assert [atoms.info["frame"] for atoms in found] == [1, 3, 5]
        assert found[0].arrays["id"].tolist() == [0, 4, 8]
        np.testing.assert_array_equal(found[1].positions.T, trajectory.frame(3).position[:, ::2])
    with swarm.load(stored["bodies"]) as trajectory:
        trajectory.export(tmp_path / "out.gsd", particles=2, frames=slice(4, None))
        with gsd.hoomd.open(str(tmp_path / "out.gsd")) as found:
            ids, bonds = found[0].log["particles/id"], found[1].bonds.group
        assert ids.tolist() == [0, 2, 3, 5, 6, 8, 9, 11]
        assert len(bonds) == 12
        assert (ids[bonds] % 3 == ids[bonds[:, :1]] % 3).all()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"path": "out.pdb"},
            r"expected a file name that ends in \.vtkhdf, \.xyz, \.gsd, \.ply, \.csv, \.obj, got .*out\.pdb",
        ),
        ({"frames": 6}, r"frames must lie between -6 and 5, got 6"),
        ({"frames": 1.5}, r"frames must be a whole number, got 1\.5"),
        ({"frames": slice(7, 9)}, r"frames must hold one of the frames 0 to 5, got 7:9$"),
        ({"frames": slice(0, 5, 0)}, r"a step other than 0"),
        ({"particles": 0}, r"particles must be 1 or more, got 0"),
        ({"surfaces": 1}, r"surfaces must be true or false, got 1"),
        ({"path": "there.xyz"}, r"there\.xyz exists; choose another name, or overwrite it"),
        ({"path": "nowhere/out.xyz"}, r"the folder .*nowhere does not exist"),
    ],
)
def test_bad_input_writes_nothing(stored, tmp_path, change, message):
    (tmp_path / "there.xyz").write_text("mine")
    with swarm.load(stored["cavity"]) as trajectory, pytest.raises(swarm.SceneError, match=message):
        trajectory.export(
            **{
                "path": tmp_path / "out.xyz",
                **change,
                **({"path": tmp_path / change["path"]} if "path" in change else {}),
            }
        )
    assert [path.name for path in tmp_path.iterdir()] == ["there.xyz"]
    assert (tmp_path / "there.xyz").read_text() == "mine"


@pytest.mark.parametrize(
    ("name", "missing", "message"),
    [
        ("out.gsd", "gsd", r"an export as \.gsd needs the package 'gsd.*: pip install gsd"),
        ("out.vtkhdf", "skimage", r"an export with surfaces, which --no-surfaces .* needs the package 'skimage"),
    ],
)
def test_missing_libraries_are_named_before_anything_is_written(stored, tmp_path, monkeypatch, name, missing, message):
    for module in {missing, *(found for found in sys.modules if found.split(".")[0] == missing)}:
        monkeypatch.setitem(sys.modules, module, None)
    for module in ("exports.gsd", "exports.walls", "triangles.shapes", "triangles.gridded"):
        monkeypatch.delitem(sys.modules, f"swarm.{module}", raising=False)
        monkeypatch.delattr(f"swarm.{module}", raising=False)
    with swarm.load(stored["cavity"]) as trajectory, pytest.raises(swarm.SceneError, match=message):
        trajectory.export(tmp_path / name)
    assert list(tmp_path.iterdir()) == []


def test_what_cannot_be_finished_leaves_the_old_file(stored, tmp_path):
    """The source is damaged in the middle, or the disk is full."""
    with swarm.load(stored["cavity"]) as trajectory:
        trajectory.export(tmp_path / "out.xyz", frames=0)
    older = (tmp_path / "out.xyz").read_text()
    broken = tmp_path / "broken.h5"
    broken.write_bytes(stored["cavity"].read_bytes())
    with edited(broken) as file:
        file["particles/all/position/value"][3, 2, 1] = np.nan
    with swarm.load(broken) as trajectory:
        for name in ("out.xyz", "out.gsd", "out.vtkhdf"):
            with pytest.raises(swarm.SceneError, match=r"broken\.h5 is damaged: frame 3: expected finite numbers"):
                trajectory.export(tmp_path / name, overwrite=True)
        assert sorted(path.name for path in tmp_path.iterdir()) == ["broken.h5", "out.xyz"]
        assert (tmp_path / "out.xyz").read_text() == older

        def full(_done, _total):
            raise OSError(28, "No space left on device")

        with pytest.raises(swarm.FileError, match=r"cannot write .*out\.xyz: .*No space left on device"):
            trajectory.export(tmp_path / "out.xyz", frames=0, overwrite=True, progress=full)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["broken.h5", "out.xyz"]


def test_without_particles_there_is_nothing_to_export(tmp_path):
    path = run(tmp_path, CAVITY, swarm.fill(CAVITY, 3, speed=0.4), frames="none")
    with swarm.load(path) as trajectory, pytest.raises(swarm.SceneError, match=r'it was run with frames = "none"'):
        trajectory.export(tmp_path / "out.xyz")


def test_the_command(stored, tmp_path):
    done = command(
        "export", str(stored["cell"]), "-o", "out.vtkhdf", "--frames", "::2", "--particles", "3", cwd=tmp_path
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert [line.split(" (")[0] for line in done.stdout.splitlines()] == [
        "written to out.vtkhdf", "written to out.surfaces.vtkhdf",
    ]  # fmt: skip
    assert [
        points["id"].tolist() for _time, _position, points, _cells, _connected in steps_of(tmp_path / "out.vtkhdf")
    ] == 3 * [[0, 3]]
    for words, message in (
        (("-o", "out.vtkhdf"), "out.vtkhdf exists"),
        (("-o", "out.pdb"), "ends in .vtkhdf, .xyz, .gsd, .ply, .csv, .obj"),
        (("-o", "out.xyz", "--frames", "a:b"), "--frames must be a number, or A:B or A:B:K"),
    ):
        done = command("export", str(stored["cell"]), *words, cwd=tmp_path)
        assert done.returncode == 2
        assert done.stderr.startswith("error: ")
        assert message in done.stderr
