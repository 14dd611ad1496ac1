"""What other programs read of a run: formats x kinds of run x readers. `test_readers.py` reads every cell.

    python tests/output/readers.py            prints the table
    python tests/output/readers.py --write    writes it into the guide

A reader is what a user of that program would write. It yields what it has found of each frame. A cell says whether that
is in the trajectory too, bit by bit or in float32, or why it is not.
"""

import importlib
import sys
import textwrap
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

import swarm

# The longest line of text of the guide.
LINE = 120
GUIDE = Path(__file__).parents[2] / "examples" / "guide" / "readers.md"
BEGIN, END = "<!-- written by tests/output/readers.py -->", "<!-- to here -->"

# --- Kinds of run ----------------------------------------------------------------------------------------

CAVITY = swarm.Scene([swarm.Ellipsoid((0.3, 0.3, 0.6)), swarm.Sphere(0.1, (0.0, 0.0, 0.1), "outside")])
LEAKY = swarm.Scene([swarm.Sphere(0.5, openings=[swarm.Sphere(0.3, (0.0, 0.0, -0.5))])])
CELL = swarm.Scene([swarm.Sphere(0.2, side="outside"), swarm.Slab((0, 0, 1), 0.4)], period=(1.0, 1.0, None))
BOX = swarm.Scene([swarm.Box((0.5, 0.4, 0.3))])
AROUND = swarm.Rotation((0, 0, 1), 2.0, (0.2, 0.0, 0.0))
SHAKEN = swarm.Scene([swarm.Box((0.5, 0.5, 0.5)), swarm.Sphere(0.1, side="outside", motion=AROUND)])
PLANE = swarm.Scene([swarm.Stadium(0.5, 1.0)], plane="z")


def _balls():
    radii, masses = [0.01, 0.02, 0.03, 0.04], [1.0, 2.0, 3.0, 4.0]
    return BOX, swarm.fill(BOX, 4, speed=0.4, radius=radii, mass=masses, seed=1), {}


# (scene, start, options) of each.
KINDS = {
    "fixed numbers": lambda: (CAVITY, swarm.fill(CAVITY, 7, speed=0.4, mass=np.linspace(1.0, 2.0, 7), seed=1), {}),
    "sources": lambda: (LEAKY, None, {"sources": swarm.Source(0, times=(0.15, 0.35, 0.45), temperature=1.0)}),
    "escapes": lambda: (LEAKY, swarm.fill(LEAKY, 8, speed=2.0, seed=1), {}),
    "balls": _balls,
    "bodies": lambda: (BOX, swarm.place(BOX, swarm.dumbbell(0.05, 1.0), 3, speed=0.3, seed=2), {}),
    "moving walls": lambda: (SHAKEN, swarm.fill(SHAKEN, 5, speed=0.4, seed=1), {}),
    "plane": lambda: (PLANE, swarm.fill(PLANE, 5, speed=1.0, seed=1), {}),
    "period": lambda: (CELL, swarm.fill(CELL, 6, speed=5.0, seed=1), {}),
}
FORMATS = ("vtkhdf", "xyz", "gsd", "ply", "csv", "obj")


def written(kind, folder):
    """A run of this kind, and all files of it."""
    scene, start, options = KINDS[kind]()
    method = swarm.Impact(dt=0.01) if isinstance(start, swarm.Bodies) else swarm.Impact()
    path = folder / "run.h5"
    swarm.simulate(
        scene, start, method, until=0.5, every=0.1, compile="never", seed=1, trajectory=path,
        recording=folder / "run.rrd", **options,
    )  # fmt: skip
    with swarm.load(path) as trajectory:
        for form in FORMATS:
            trajectory.export(folder / f"out.{form}")
    return path


# --- Readers ---------------------------------------------------------------------------------------------


def by_h5py(folder):
    import h5py

    with h5py.File(folder / "run.h5") as file:
        held = file["particles/all"]
        mass = held["mass"]
        for k, time in enumerate(held["position/time"]):
            position, velocity = held["position/value"][k], held["velocity/value"][k]
            there = ~np.isnan(position[:, 0])
            masses = np.broadcast_to(mass["value"][0] if hasattr(mass, "keys") else mass[()], there.shape)
            ids = held["id"]["value"][0] if hasattr(held["id"], "keys") else held["id"][()]
            yield {
                "position": position[there], "velocity": velocity[there], "time": time, "id": ids[there],
                "mass": masses[there],
            }  # fmt: skip


def by_mdanalysis(folder):
    import MDAnalysis

    with swarm.load(folder / "run.h5") as trajectory:
        count, dt = len(trajectory.ids), trajectory.times[1]
    universe = MDAnalysis.Universe.empty(count, trajectory=True, velocities=True)
    universe.load_new(str(folder / "run.h5"), format="H5MD", convert_units=False, dt=dt)
    for moment in universe.trajectory:
        there = ~np.isnan(moment.positions[:, 0])
        yield {
            "position": moment.positions[there].copy(), "velocity": moment.velocities[there].copy(), "time": moment.time
        }  # fmt: skip


def by_xarray(folder):
    with swarm.load(folder / "run.h5") as trajectory:
        data = trajectory.to_xarray()
        for k in range(data.sizes["time"]):
            one = data.isel(time=k)
            position = one["position"].transpose("particle", "axis").values
            there = ~np.isnan(position[:, 0])
            yield {
                "position": position[there],
                "velocity": one["velocity"].transpose("particle", "axis").values[there],
                "time": float(one["time"]),
                "id": one["particle"].values[there],
                "mass": one["mass"].values[there],
            }


def _of_vtk(data, time):
    from vtkmodules.util.numpy_support import vtk_to_numpy

    points = data.GetPointData()
    kept = {name: points.GetArray(name) for name in ("velocity", "id", "mass")}
    found = {name: vtk_to_numpy(values).copy() for name, values in kept.items()}
    return {"position": vtk_to_numpy(data.GetPoints().GetData()).copy(), "time": time, **found}


def _steps(path):
    from vtkmodules.vtkIOHDF import vtkHDFReader

    reader = vtkHDFReader()
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    for step in range(reader.GetNumberOfSteps()):
        reader.SetStep(step)
        reader.Update()
        yield reader.GetOutput(), reader.GetTimeValue()


def by_vtk(folder):
    for data, time in _steps(folder / "out.vtkhdf"):
        yield _of_vtk(data, time)


def by_pyvista(folder):
    import pyvista

    reader = pyvista.get_reader(str(folder / "out.vtkhdf"))
    reader.reader.UpdateInformation()
    for step in range(reader.reader.GetNumberOfSteps()):
        reader.reader.SetStep(step)
        data = reader.read()
        found = {name: np.array(data.point_data[name]) for name in ("velocity", "id", "mass")}
        yield {"position": np.array(data.points), "time": reader.reader.GetTimeValue(), **found}


def walls_by_vtk(folder):
    from vtkmodules.util.numpy_support import vtk_to_numpy

    for data, time in _steps(folder / "out.surfaces.vtkhdf"):
        yield {"walls": vtk_to_numpy(data.GetPoints().GetData()).copy(), "time": time}


def by_ase(folder):
    import ase.io

    for atoms in ase.io.read(folder / "out.xyz", index=":"):
        yield {
            "position": atoms.positions, "velocity": atoms.arrays["velo"], "id": atoms.arrays["id"],
            "mass": atoms.get_masses(), "time": atoms.info["Time"],
        }  # fmt: skip


def _of_ovito(path, *names):
    from ovito.io import import_file

    pipeline = import_file(str(path))
    for k in range(pipeline.source.num_frames):
        data = pipeline.compute(k)
        particles = data.particles
        # Where all have one it is a number of the frame, in a GSD file 1 by default.
        masses = particles["Mass"] if "Mass" in particles else data.attributes.get("mass", 1.0)
        yield {
            "position": np.array(particles.positions), "velocity": np.array(particles["Velocity"]),
            "id": np.array(particles[names[0]]), "time": data.attributes[names[1]],
            "mass": np.broadcast_to(masses, particles.count),
        }  # fmt: skip


def xyz_by_ovito(folder):
    yield from _of_ovito(folder / "out.xyz", "Particle Identifier", "Time")


def xyz_by_mdanalysis(folder):
    import MDAnalysis

    for moment in MDAnalysis.Universe(str(folder / "out.xyz")).trajectory:
        yield {"position": moment.positions.copy()}


def by_gsd(folder):
    import gsd.hoomd

    with gsd.hoomd.open(str(folder / "out.gsd")) as file:
        for frame in file:
            held = frame.particles
            yield {
                "position": held.position.reshape(-1, 3), "velocity": held.velocity.reshape(-1, 3), "mass": held.mass,
                "id": frame.log["particles/id"], "time": frame.log["time"][0],
            }  # fmt: skip


def by_freud(folder):
    import freud
    import gsd.hoomd

    with gsd.hoomd.open(str(folder / "out.gsd")) as file:
        for frame in file:
            yield {"position": freud.AABBQuery.from_system(frame).points.copy()}


def gsd_by_ovito(folder):
    yield from _of_ovito(folder / "out.gsd", "id", "time")


def gsd_by_mdanalysis(folder):
    import MDAnalysis

    universe = MDAnalysis.Universe(str(folder / "out.gsd"))
    for moment in universe.trajectory:
        yield {"position": moment.positions.copy(), "mass": universe.atoms.masses}


def by_pandas(folder):
    import pandas

    table = pandas.read_csv(folder / "out.csv")
    for _number, rows in table.groupby("frame"):
        yield {
            "position": rows[["x", "y", "z"]].to_numpy(), "velocity": rows[["vx", "vy", "vz"]].to_numpy(),
            "id": rows["id"].to_numpy(), "mass": rows["mass"].to_numpy(), "time": rows["time"].iloc[0],
        }  # fmt: skip


def by_trimesh(folder):
    import trimesh

    for path in sorted(folder.glob("out_*.ply")):
        held = trimesh.load(path, process=False).metadata["_ply_raw"]["vertex"]["data"]
        position, velocity = (np.stack([held[n] for n in names], axis=-1) for names in ("xyz", ("vx", "vy", "vz")))
        yield {
            "position": position.reshape(-1, 3), "velocity": velocity.reshape(-1, 3), "id": held["particle"].ravel(),
            "mass": held["mass"].ravel(),
        }  # fmt: skip


def ply_by_pyvista(folder):
    import pyvista

    for path in sorted(folder.glob("out_*.ply")):
        yield {"position": np.array(pyvista.read(path).points)}


def by_meshio(folder):
    import meshio

    for path in sorted(folder.glob("out_*.ply")):
        held = meshio.read(path)
        data = held.point_data
        velocity = np.stack([data[name] for name in ("vx", "vy", "vz")], axis=-1)
        yield {"position": held.points, "velocity": velocity, "id": data["particle"], "mass": data["mass"]}


def walls_by_trimesh(folder):
    import trimesh

    yield {"walls": np.array(trimesh.load(folder / "out.obj", force="mesh").vertices), "time": 0.0}


def walls_by_pyvista(folder):
    import pyvista

    yield {"walls": np.array(pyvista.read(folder / "out.obj").points, dtype=float), "time": 0.0}


def by_rerun(folder):
    from rerun.chunk import RrdReader

    fixed, frames = {}, {}
    for chunk in RrdReader(str(folder / "run.rrd")).stream().to_chunks():
        batch = chunk.to_record_batch()
        if chunk.entity_path == "/scene/particles":
            if "frame" in batch.schema.names:
                columns = (batch.column(name).to_pylist() for name in ("frame", "Points3D:positions"))
                frames |= dict(zip(*columns, strict=True))
            else:
                fixed |= batch.to_pylist()[0]
    for k in sorted(frames):
        position = np.array(frames[k], dtype=np.float32).reshape(-1, 3)
        there = ~np.isnan(position[:, 0])
        names = {"id": "Particles:number", "mass": "Particles:mass"}
        held = {name: np.array(fixed[key])[there] for name, key in names.items() if key in fixed}
        yield {"position": position[there], **held}


def by_catalog(folder):
    import rerun

    with rerun.server.Server(datasets={"run": [str(folder / "run.rrd")]}) as server:
        data = server.client().get_dataset("run").filter_contents(["/scene/particles"])
        table = data.reader(index="frame").to_pandas().sort_values("frame")
    for _k, row in table.iterrows():
        position = np.array([list(one) for one in row["/scene/particles:Points3D:positions"]], dtype=np.float32)
        yield {"position": position[~np.isnan(position[:, 0])]}


# --- The table -------------------------------------------------------------------------------------------


class Declared(NamedTuple):
    """A cell that is not as the trajectory, and why; what the reader raises, if it does."""

    reason: str
    raises: tuple[type[BaseException], ...] = ()
    match: str = ""


EVERY = ("position", "velocity", "mass", "id", "time")
BITS, LAST, SINGLE = "every bit", "but the last bit", "float32"


class Reader(NamedTuple):
    """A program, the package that it is in, and the format; what it gives, and how exactly; the cells that differ."""

    form: str
    name: str
    package: str
    read: Callable[[Path], Iterator[dict[str, Any]]]
    gives: tuple[str, ...] = EVERY
    digits: str = BITS
    cells: Mapping[str, Declared] = MappingProxyType({})


PLACES, MOVING = ("position",), ("position", "velocity", "time")
SAME = "refused unless all frames have as many particles; export frames that have (`frames=`)"
SOME = "refused where a frame has no particle; export frames that have some (`frames=`)"
EDGES = "refused: meshio reads no edges, and ends the process; without bonds it is read"
BARE = "places alone"
LESS = "less the centre of the cell, `log/center`: GSD has it around the origin"
LINES = "a frame without a particle has no line"
FIRST = "where the walls are at the start; `--frames K` for others"
FROM_CENTRE, AT_START = {"period": Declared(LESS)}, {"moving walls": Declared(FIRST)}
REFUSED = {"sources": Declared(SAME, (ValueError, EOFError), "variable topology|could not broadcast")}
EMPTY = {"sources": Declared(SOME, (ValueError,), "0 particles")}

READERS = (
    Reader(".h5", "h5py", "h5py", by_h5py),
    Reader(".h5", "MDAnalysis", "MDAnalysis", by_mdanalysis, MOVING, SINGLE),
    Reader(".h5", "xarray", "xarray", by_xarray),
    Reader(".vtkhdf", "VTK", "vtkmodules", by_vtk),
    Reader(".vtkhdf", "PyVista", "pyvista", by_pyvista),
    Reader(".surfaces.vtkhdf", "VTK", "vtkmodules", walls_by_vtk, ("walls", "time")),
    Reader(".xyz", "ASE", "ase", by_ase),
    Reader(".xyz", "OVITO", "ovito", xyz_by_ovito, EVERY, LAST),
    Reader(".xyz", "MDAnalysis", "MDAnalysis", xyz_by_mdanalysis, PLACES, SINGLE, REFUSED),
    Reader(".gsd", "gsd", "gsd", by_gsd, EVERY, SINGLE, FROM_CENTRE),
    Reader(".gsd", "freud", "freud", by_freud, PLACES, SINGLE, FROM_CENTRE | EMPTY),
    Reader(".gsd", "OVITO", "ovito", gsd_by_ovito, EVERY, SINGLE, FROM_CENTRE),
    Reader(".gsd", "MDAnalysis", "MDAnalysis", gsd_by_mdanalysis, ("position", "mass"), SINGLE, FROM_CENTRE | REFUSED),
    Reader(".csv", "pandas", "pandas", by_pandas, cells={"sources": Declared(LINES)}),
    Reader(".ply", "trimesh", "trimesh", by_trimesh, ("position", "velocity", "mass", "id"), SINGLE),
    Reader(".ply", "PyVista", "pyvista", ply_by_pyvista, PLACES, SINGLE),
    Reader(".ply", "meshio", "meshio", by_meshio, ("position", "velocity", "mass", "id"), SINGLE,
           {"bodies": Declared(EDGES, (SystemExit,))}),
    Reader(".obj", "trimesh", "trimesh", walls_by_trimesh, ("walls",), BITS, AT_START),
    Reader(".obj", "PyVista", "pyvista", walls_by_pyvista, ("walls",), SINGLE, AT_START),
    Reader(".rrd", "Rerun's `RrdReader`", "rerun", by_rerun, ("position", "mass", "id"), SINGLE,
           {"bodies": Declared(BARE)}),
    Reader(".rrd", "Rerun's catalog", "datafusion", by_catalog, PLACES, SINGLE),
)  # fmt: skip
# Those with which every cell was read when the table was written.
VERSIONS = (
    "h5py 3.16, MDAnalysis 2.11, xarray 2026.9, VTK 9.7, PyVista 0.49, ASE 3.29, OVITO 3.17, gsd 5.0, freud 3.4, "
    "pandas 3.1, trimesh 5.2, meshio 5.3, Rerun 0.41"
)


def is_installed(reader):
    try:
        importlib.import_module(reader.package)
    except ImportError:
        return False
    return True


def expected(trajectory, k):
    """The particles that are there in a frame."""
    frame = trajectory.frame(k)
    there = ~np.isnan(frame.position[0])
    return {
        "position": frame.position.T[there], "velocity": frame.velocity.T[there], "mass": frame.mass[there],
        "id": trajectory.ids[there], "time": trajectory.times[k],
    }  # fmt: skip


def compare(reader, kind, folder):
    """Read a cell, and raise where anything of it is not as in the trajectory."""
    cell = reader.cells.get(kind)
    reason = "" if cell is None else cell.reason
    with swarm.load(folder / "run.h5") as trajectory:
        found = list(reader.read(folder))
        if "walls" in reader.gives:
            _compare_walls(found, trajectory, reason == FIRST, kind == "period")
            return
        known = [expected(trajectory, k) for k in range(len(trajectory))]
        known = [one for one in known if len(one["id"]) or reason != LINES]
        gives = PLACES if reason == BARE else reader.gives
        assert len(found) == len(known)
        for one, right in zip(found, known, strict=True):
            assert set(one) == set(gives)
            if reason == LESS:
                right["position"] = right["position"] - [0.5, 0.5, 0.0]
            for name in gives:
                value, true = np.asarray(one[name], dtype=float), np.asarray(right[name], dtype=float)
                assert value.shape == true.shape, name
                if name == "time":
                    # Of .vtkhdf they are the times that a user types: 0.3 and not 3 times 0.1.
                    np.testing.assert_allclose(value, true, rtol=1e-15)
                elif reader.digits == SINGLE:
                    np.testing.assert_array_equal(value.astype(np.float32), true.astype(np.float32), name)
                else:
                    np.testing.assert_allclose(value, true, rtol=0.0 if reader.digits == BITS else 3e-16, err_msg=name)


def _compare_walls(found, trajectory, is_first, repeats):
    scene = trajectory.scene
    assert len(found) == (len(trajectory) if scene.moves() and not is_first else 1)
    for one in found:
        gaps = np.abs(scene.gaps(one["walls"].T, one.get("time", 0.0))).min(axis=0)
        # Of a cell walls are drawn beyond it too, where gaps are those to the walls within.
        inside = np.abs(one["walls"]).max(axis=1) < 0.45 if repeats else np.isfinite(gaps)
        assert inside.sum() > 100
        # They are drawn on a grid of 48 points a side.
        assert gaps[inside].max() < 0.02


WORDS = {
    "position": "places", "velocity": "velocities", "mass": "masses", "id": "numbers", "time": "times", "walls": "walls"
}  # fmt: skip


def markdown():
    """The lines of the table."""
    notes: dict[str, int] = {}
    lines = ["| file | reader | gives | digits | " + " | ".join(KINDS) + " |"]
    lines.append("| --- | --- | --- | --- |" + " :-: |" * len(KINDS))
    for reader in READERS:
        cells = []
        for kind in KINDS:
            cell = reader.cells.get(kind)
            cells.append("yes" if cell is None else f"({notes.setdefault(cell.reason, len(notes) + 1)})")
        gives = "all" if reader.gives == EVERY else ", ".join(WORDS[name] for name in reader.gives)
        lines.append(f"| `{reader.form}` | {reader.name} | {gives} | {reader.digits} | " + " | ".join(cells) + " |")
    reasons = (f"{number}. {reason}" for reason, number in notes.items())
    return "\n".join([*lines, "", *reasons, "", *textwrap.wrap(f"Read with {VERSIONS}.", LINE)])


def main():
    text = markdown()
    print(text)
    if "--write" in sys.argv:
        before, rest = GUIDE.read_text("utf-8").split(BEGIN)
        GUIDE.write_text(f"{before}{BEGIN}\n\n{text}\n\n{END}{rest.split(END)[1]}", "utf-8")


if __name__ == "__main__":
    main()
