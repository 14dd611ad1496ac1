"""A file is replaced only by one of its own kind, and only where the command line or the caller names it."""

import os
import shutil
import sys
from importlib.metadata import version

import h5py
import pytest
from click.testing import CliRunner

import swarm
from swarm.commands.cli import app
from swarm.files import marks, paths, provenance
from swarm.fleet import shards
from swarm.serialization import plugins

SPHERE = swarm.Scene([swarm.Sphere(0.5)])
START = swarm.fill(SPHERE, 3, speed=1.0, seed=1)
NOT_OURS = "must be|is not .*, and only such a file is overwritten; choose another name, or move that file away$"
SCENE = """
surface = [{kind = "sphere", radius = 0.5}]
method.kind = "impact"
particles = {count = 3, speed = 1.0}
run = {until = 1.0, every = 0.5, compile = "never", MORE}
"""


def simulate(path, **keywords):
    how = {"until": 1.0, "every": 0.5, "threads": 1, "compile": "never", **keywords}
    return swarm.simulate(SPHERE, START, swarm.Impact(), trajectory=path, **how)


def command(*words):
    """Exit code, and what the command says on standard error or raises."""
    done = CliRunner().invoke(app, [str(word) for word in words])
    return done.exit_code, f"{done.stderr}{done.exception or ''}"


def scene_in(folder, more="seed = 0"):
    folder.mkdir(exist_ok=True)
    (folder / "scene.toml").write_text(SCENE.replace("MORE", more))
    return folder / "scene.toml"


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A trajectory, its log of impacts, and exports."""
    folder = tmp_path_factory.mktemp("whole")
    simulate(folder / "run.h5", impacts=folder / "log.h5")
    with swarm.load(folder / "run.h5") as trajectory:
        for name in ("a.csv", "a.xyz", "a.vtkhdf", "a.obj", "a.ply"):
            trajectory.export(folder / name, frames=0, surfaces=name != "a.vtkhdf")
    return folder


# Writers by the name of the file that each writes: called with a trajectory and the file.
WRITERS = {
    "out.h5": lambda _run, path: simulate(path, overwrite=True),
    "log.h5": lambda _run, path: simulate(None, impacts=path, overwrite=True),
    **{
        name: lambda run, path: run.export(path, frames=0, overwrite=True)
        for name in ("out.csv", "out.xyz", "out.vtkhdf", "out.obj", "out.ply", "out.gsd")
    },
    "out.gif": lambda run, path: run.animate(path, frames=1, size=(64, 64), overwrite=True),
    "out.html": lambda run, path: run.report(path, overwrite=True),
}


@pytest.mark.parametrize("name", WRITERS)
@pytest.mark.parametrize("content", [b"my thesis\n", b"\x89HDF\r\n\x1a\n", b"x,y,z,vx,vy,vz\n0,0,0,1,0,0\n"])
def test_a_file_of_another_kind_stays(whole, tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    with swarm.load(whole / "run.h5") as trajectory, pytest.raises(swarm.SceneError, match=NOT_OURS):
        WRITERS[name](trajectory, tmp_path / name)
    assert (tmp_path / name).read_bytes() == content
    assert os.listdir(tmp_path) == [name]


@pytest.mark.parametrize("name", ["out.h5", "log.h5", "out.csv", "out.xyz", "out.vtkhdf", "out.obj", "out.ply"])
def test_a_file_of_the_same_kind_and_an_empty_one_are_replaced(whole, tmp_path, name):
    with swarm.load(whole / "run.h5") as trajectory:
        (tmp_path / name).touch()
        for _ in range(2):
            before = (tmp_path / name).stat().st_ino
            WRITERS[name](trajectory, tmp_path / name)
            assert (tmp_path / name).stat().st_ino != before


def test_no_kind_is_taken_for_another(whole):
    """Of each output by every writer: its own kind, and no other."""
    kinds = {"run.h5": "trajectory", "log.h5": "impacts", "a.mtl": "export"}
    files = {path.name: kinds.get(path.name, "export") for path in whole.iterdir()}
    assert len(files) == 8
    for name, what in files.items():
        assert marks.why_not(whole / name, what) is None, name
        for other in {"trajectory", "impacts", "recording", "report", "table"} - {what}:
            assert marks.why_not(whole / name, other) is not None, (name, other)
    for suffix in (".csv", ".xyz", ".vtkhdf", ".obj", ".mtl", ".ply", ".gsd", ".png", ".pdf", ".svg", ".mp4", ".gif"):
        for name in files:
            if not name.endswith(suffix):
                copy = shutil.copy(whole / name, whole.parent / f"copy{suffix}")
                assert marks.why_not(whole.parent / copy, "export") is not None, (name, suffix)


@pytest.mark.parametrize("suffix", [".png", ".pdf", ".svg"])
def test_a_picture_replaces_pictures_of_swarm_alone(tmp_path, suffix):
    from matplotlib.figure import Figure

    mine, drawn = tmp_path / f"mine{suffix}", tmp_path / f"drawn{suffix}"
    figure = Figure((1.0, 1.0))
    figure.savefig(mine)
    figure.savefig(drawn, metadata=marks.of_picture(drawn))
    assert marks.why_not(mine, "picture") == "a picture of swarm"
    assert marks.why_not(drawn, "picture") is None


def test_plot_keeps_a_picture_of_others(whole, tmp_path):
    (tmp_path / "photo.png").write_bytes(b"\x89PNG\r\n\x1a\n and a holiday")
    code, output = command("plot", whole / "run.h5", "-o", tmp_path / "photo.png", "--overwrite")
    assert (code, (tmp_path / "photo.png").read_bytes()) == (1, b"\x89PNG\r\n\x1a\n and a holiday")
    assert "photo.png is not a picture of swarm, and only such a file is overwritten" in output


def test_plot_replaces_a_picture_only_if_asked(whole, tmp_path):
    words = "plot", whole / "run.h5", "-o", tmp_path / "plot.png"
    assert command(*words)[0] == 0
    code, output = command(*words)
    assert (code, "picture: " in output, "overwrite it (--overwrite" in output) == (1, True, True)
    assert command(*words, "--overwrite")[0] == 0


def test_record_keeps_a_file_of_others(whole, tmp_path):
    (tmp_path / "out.rrd").write_text("mine")
    for target in (tmp_path / "out.rrd", whole / "log.h5"):
        before = target.read_bytes()
        _code, output = command("record", whole / "run.h5", "-o", target, "--overwrite")
        assert "is not a recording of Rerun" in output
        assert target.read_bytes() == before


def test_a_damaged_trajectory_can_be_replaced(whole, tmp_path):
    """It is known by its beginning: a new run takes its place."""
    data = (whole / "run.h5").read_bytes()
    for cut in (len(data) // 2, 6000):
        (tmp_path / "run.h5").write_bytes(data[:cut])
        with pytest.raises(swarm.SceneError, match=r"damaged"):
            swarm.load(tmp_path / "run.h5")
        simulate(tmp_path / "run.h5", overwrite=True)
        swarm.load(tmp_path / "run.h5").close()


# --- Scene files -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("key", ["trajectory", "recording", "impacts"])
@pytest.mark.parametrize(
    "name", ["../thesis.txt", "ABSOLUTE", "link.h5", "linked/thesis.txt", "inner/../../thesis.txt"]
)
@pytest.mark.parametrize("overwrite", [[], ["--overwrite"]])
def test_a_scene_file_writes_in_its_folder_alone(tmp_path, monkeypatch, key, name, overwrite):
    (tmp_path / "thesis.txt").write_text("my thesis")
    scene = scene_in(tmp_path / "scenes", f"{key} = '{name.replace('ABSOLUTE', str(tmp_path / 'thesis.txt'))}'")
    (tmp_path / "scenes" / "inner").mkdir()
    (tmp_path / "scenes" / "link.h5").symlink_to(tmp_path / "thesis.txt")
    (tmp_path / "scenes" / "linked").symlink_to(tmp_path)
    for here in (tmp_path, tmp_path / "scenes"):
        monkeypatch.chdir(here)
        code, output = command("run", scene, "--quiet", *overwrite)
        assert code == 1
        assert f"scene.toml: run.{key}: expected a file in the folder of the scene file" in output
        assert (tmp_path / "thesis.txt").read_text() == "my thesis"
        assert not (here / "scene.h5").exists()


def test_the_command_line_may_name_any_place(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    scene = scene_in(tmp_path / "scenes", 'trajectory = "../out.h5", impacts = "../log.h5"')
    words = ["-o", tmp_path / "out.h5", "--impacts", "log.h5"]
    assert command("run", scene, "--quiet", *words) == (0, "")
    assert command("run", scene, "--quiet", "--overwrite", *words) == (0, "")
    assert sorted(os.listdir()) == ["log.h5", "out.h5", "scenes"]


def test_outputs_of_a_scene_file_are_beside_it_and_never_overwritten(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    scene = scene_in(tmp_path / "scenes", 'impacts = "log.h5"')
    assert command("run", scene, "--quiet") == (0, "")
    log = tmp_path / "scenes" / "log.h5"
    before = log.read_bytes()
    assert (tmp_path / "scene.h5").is_file()
    for words in (["--overwrite"], ["--overwrite", "-o", "other.h5"], ["--resume", "--overwrite"]):
        code, output = command("run", scene, "--quiet", *words)
        assert code == 1
        assert f"overwrite it by naming it on the command line: --impacts {log} --overwrite" in output
        assert log.read_bytes() == before
    assert command("run", scene, "--quiet", "--overwrite", "--impacts", log) == (0, "")


READ = {
    "start.csv": 'particles = {from = "start.csv"}',
    "start.h5": 'particles = {from = "start.h5", frame = 0}',
    "walls.csv": '[[surface]]\nkind = "spheres"\nside = "outside"\nfrom = "walls.csv"',
    "part.stl": '[[surface]]\nkind = "mesh"\nside = "outside"\nfile = "part.stl"',
    "scene.toml": "",
}


@pytest.mark.parametrize("name", READ)
@pytest.mark.parametrize("option", ["-o", "--record", "--impacts"])
def test_an_output_is_no_file_that_the_scene_reads(whole, tmp_path, name, option):
    shutil.copy(whole / "run.h5", tmp_path / "start.h5")
    (tmp_path / "start.csv").write_text("x,y,z,vx,vy,vz\n0,0,0,1,0,0\n")
    (tmp_path / "walls.csv").write_text("x,y,z,radius\n0.3,0,0,0.05\n")
    corners = "outer loop\nvertex 0 0 .3\nvertex .1 0 .3\nvertex 0 .1 .3\nendloop"
    (tmp_path / "part.stl").write_text(f"solid a\nfacet normal 0 0 1\n{corners}\nendfacet\nendsolid a\n")
    particles = "" if "particles" in READ[name] else "particles = {count = 3, speed = 1.0}\n"
    table = READ[name].replace("particles", "\nparticles") if "particles" in READ[name] else READ[name]
    top = f'{particles}method.kind = "impact"\nrun = {{until = 1.0, compile = "never"}}\n'
    first = '[[surface]]\nkind = "sphere"\nradius = 0.5\n'
    text = top + (table + "\n" + first if "particles" in READ[name] else first + table)
    (tmp_path / "scene.toml").write_text(text)
    os.symlink(tmp_path / name, tmp_path / "link")
    before = (tmp_path / name).read_bytes()
    for target in (tmp_path / name, tmp_path / "link"):
        code, output = command("run", tmp_path / "scene.toml", "--quiet", "--overwrite", option, target)
        assert code == 1
        if name != "part.stl":  # which is no closed mesh, and is refused before
            assert f"{name} is also the " in output
        assert (tmp_path / name).read_bytes() == before


def test_an_output_is_no_plugin(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code = "import swarm\ndef one(frame):\n    return 1.0\n"
    (tmp_path / "numbers_for_a_run.py").write_text(code)
    scene = scene_in(tmp_path, 'observables = {one = "numbers_for_a_run:one"}')
    try:
        output = command(
            "run", scene, "--plugins", "numbers_for_a_run", "-o", "numbers_for_a_run.py", "--overwrite", "--quiet"
        )[1]
    finally:
        sys.modules.pop("numbers_for_a_run", None)
        plugins.imported.discard("numbers_for_a_run")
    assert "is also the module numbers_for_a_run of --plugins" in output
    assert (tmp_path / "numbers_for_a_run.py").read_text() == code


# --- Sweeps and clusters ---------------------------------------------------------------------------------


@pytest.fixture
def sweep(tmp_path):
    (tmp_path / "many.toml").write_text(
        SCENE.replace("MORE", "seed = 0") + '\n[sweep]\n"particles.seed" = {range = 2}\n'
    )
    return tmp_path / "many.toml"


@pytest.mark.parametrize("name", ["sweep.toml", "results.csv"])
@pytest.mark.parametrize("how", [{}, {"resume": True}, {"overwrite": True}])
def test_a_sweep_keeps_files_of_others_in_its_folder(sweep, tmp_path, name, how):
    folder = tmp_path / "folder"
    folder.mkdir()
    (folder / name).write_text("mine, and not yours\n")
    with pytest.raises(swarm.SceneError, match=f"{name}|holds the runs"):
        swarm.sweep(sweep, folder, **how)
    assert (folder / name).read_text() == "mine, and not yours\n"
    assert os.listdir(folder) == [name]


def test_a_sweep_keeps_what_has_the_name_of_a_run(sweep, tmp_path):
    from swarm.fleet.plan import read

    folder = tmp_path / "folder"
    folder.mkdir()
    stem = read(sweep).variants[0].stem
    for name in (f"{stem}.h5", f"{stem}.json"):
        (folder / name).write_text("mine")
        for how in ({"resume": True}, {"overwrite": True}):
            with pytest.raises(swarm.SceneError, match=f"{name} is not .*and only such a file is overwritten"):
                swarm.sweep(sweep, folder, **how)
        assert (folder / name).read_text() == "mine"
        (folder / name).unlink()


def test_a_sweep_file_names_no_file_outside_its_folder(sweep, tmp_path):
    sweep.write_text(sweep.read_text().replace("seed = 0", 'impacts = "../thesis.txt"'))
    with pytest.raises(swarm.SceneError, match=r"run\.impacts: expected a file in the folder of the scene file"):
        swarm.sweep(sweep, tmp_path / "folder")
    assert not (tmp_path / "folder").exists()


@pytest.mark.parametrize("name", [".bashrc", "0000.h5", "0000.txt", "position.txt", "whole.txt"])
def test_the_folder_of_shards_is_cleared_of_shards_alone(whole, tmp_path, name):
    folder = paths.shards_of(tmp_path / "run.h5")
    folder.mkdir()
    (folder / name).write_text("mine")
    shutil.copy(whole / "run.h5", folder / "0001.h5")
    with pytest.raises(swarm.SceneError, match="must hold the shards of a run or not be there"):
        shards.clear(folder)
    assert (folder / name).read_text() == "mine"
    (folder / name).unlink()
    (folder / ".0000.h5.swarm-lock").touch()
    shards.clear(folder)
    assert os.listdir(folder) == []


# --- Links of HDF5 files ---------------------------------------------------------------------------------

VALUE = "particles/all/position/value"


def external_link(file, _folder):
    del file[VALUE]
    file[VALUE] = h5py.ExternalLink("other.h5", VALUE)


def external_group(file, _folder):
    file["observables/more"] = h5py.ExternalLink("other.h5", "observables/impacts")


def external_storage(file, _folder):
    del file[VALUE]
    file["particles/all/position"].create_dataset("value", (3, 3, 3), "f8", external=[("secret.bin", 0, 216)])


def virtual(file, name="other.h5", where="observables/total_energy"):
    shape = file[f"{where}/value"].shape
    del file[f"{where}/value"]
    # As the trajectory of all shards names them.
    endless = (None, *shape[1:])
    layout = h5py.VirtualLayout(shape, "f8", maxshape=endless)
    layout[...] = h5py.VirtualSource(name, f"{where}/value", shape, "f8", endless)[: shape[0]]
    file[where].create_virtual_dataset("value", layout)


LINKS = {
    "a link": external_link,
    "a link that no reader asks for": external_group,
    "storage": external_storage,
    "a virtual observable": lambda file, _folder: virtual(file),
    "virtual particles": lambda file, _folder: virtual(file, where="particles/all/position"),
    "shards elsewhere": lambda file, folder: virtual(file, f"{folder}/x.shards/0000.h5", "particles/all/position"),
    "shards above": lambda file, _folder: virtual(file, "../x.shards/0000.h5", "particles/all/position"),
    "an observable of a shard": lambda file, _folder: virtual(file, "x.shards/0000.h5"),
}


@pytest.mark.parametrize("name", LINKS)
def test_a_trajectory_opens_no_other_file(whole, tmp_path, name):
    for one in ("other.h5", "run.h5"):
        shutil.copy(whole / "run.h5", tmp_path / one)
    (tmp_path / "x.shards").mkdir()
    shutil.copy(whole / "run.h5", tmp_path / "x.shards" / "0000.h5")
    (tmp_path / "secret.bin").write_bytes(bytes(216))
    with h5py.File(tmp_path / "run.h5", "r+") as file:
        LINKS[name](file, tmp_path)
    with pytest.raises(
        swarm.SceneError, match=r"run\.h5 must hold its own data, got .*; copy the values into the file"
    ):
        swarm.load(tmp_path / "run.h5")
    with pytest.raises(swarm.SceneError, match="must hold its own data"):
        swarm.load_impacts(tmp_path / "run.h5")
    (tmp_path / "scene.toml").write_text(
        'surface = [{kind = "sphere", radius = 0.5}]\nparticles = {from = "run.h5"}\nmethod.kind = "impact"\n'
        'run = {until = 1.0, compile = "never"}\n'
    )
    assert "must hold its own data" in command("run", tmp_path / "scene.toml", "-o", tmp_path / "out.h5")[1]


def test_the_shards_of_a_trajectory_are_read(whole, tmp_path):
    shutil.copy(whole / "run.h5", tmp_path / "run.h5")
    (tmp_path / "x.shards").mkdir()
    shutil.copy(whole / "run.h5", tmp_path / "x.shards" / "0000.h5")
    with h5py.File(tmp_path / "run.h5", "r+") as file:
        virtual(file, "x.shards/0000.h5", "particles/all/position")
    with swarm.load(tmp_path / "run.h5") as joined, swarm.load(whole / "run.h5") as alone:
        assert (joined.frame(-1).position == alone.frame(-1).position).all()
    with h5py.File(tmp_path / "x.shards" / "0000.h5", "r+") as file:
        external_link(file, tmp_path)
    with pytest.raises(swarm.SceneError, match=r"0000\.h5 must hold its own data"):
        swarm.load(tmp_path / "run.h5")


def test_samples_are_in_their_file(tmp_path):
    (tmp_path / "secret.bin").write_bytes(bytes(8 * 1000))
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.create_dataset("values", (10, 10, 10), "f8", external=[("secret.bin", 0, 8000)])
    (tmp_path / "scene.toml").write_text(
        'particles = {count = 1, speed = 1.0}\nmethod.kind = "impact"\nrun.until = 1.0\n[[surface]]\nkind = "sampled"\n'
        'file = "a.h5"\nspacing = 1.0\norigin = [0, 0, 0]\n'
    )
    with pytest.raises(swarm.SceneError, match=r"a\.h5 must hold its own data, got values, its values are in 'secret"):
        swarm.scene_file.read(tmp_path / "scene.toml")


# --- Attributes ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("value", ["yesterday", "", 5, [1.0, 2.0], "2026-13-01", "2026-01-01\n<b>"])
def test_a_date_that_is_none_is_damage(whole, tmp_path, value):
    shutil.copy(whole / "run.h5", tmp_path / "run.h5")
    with h5py.File(tmp_path / "run.h5", "r+") as file:
        file["h5md/creator"].attrs["date"] = value
    with pytest.raises(swarm.SceneError, match=r"run\.h5 is damaged: its structure: date of h5md/creator must be a"):
        swarm.load(tmp_path / "run.h5")
    for name in ("report", "info"):
        assert "date of h5md/creator must be a" in command(name, tmp_path / "run.h5")[1]


def test_the_version_of_numba_is_that_of_its_package():
    assert provenance.makers()["numba"] == version("numba")


def test_an_attribute_of_another_type_is_damage_and_one_that_is_not_there_is_not(whole, tmp_path):
    for name in ("name", "version", "python", "numpy", "numba", "hdf5", "machine"):
        shutil.copy(whole / "run.h5", tmp_path / "run.h5")
        with h5py.File(tmp_path / "run.h5", "r+") as file:
            del file["parameters/checksums"]  # as in files of older versions, which may have fewer attributes
            del file["h5md/creator"].attrs[name]
        with swarm.load(tmp_path / "run.h5") as trajectory:
            assert name not in trajectory.makers
        with h5py.File(tmp_path / "run.h5", "r+") as file:
            file["h5md/creator"].attrs[name] = 5
        with pytest.raises(swarm.SceneError, match=f"{name} of h5md/creator must be a text in one line, got"):
            swarm.load(tmp_path / "run.h5")
