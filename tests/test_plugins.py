"""User-defined laws, sources, counters and numbers in scene files; code is named by files and allowed by callers."""

import tomllib
from dataclasses import replace

import numpy as np
import pytest
import tomli_w
from same_bits import require_same_observables
from test_cli import command

import swarm
from examples.own_law import Viscoelastic
from examples.own_method import Mirror
from examples.own_surface import Superellipsoid
from swarm import scene_file
from swarm.commands import summary
from swarm.run.simulation import carry_out
from swarm.serialization import plugins, run_tables, tables

LAW, SURFACE, METHOD = "examples.own_law", "examples.own_surface", "examples.own_method"
FILE = """
[particles]
count = 20
speed = 1.0
seed = 1

[[surface]]
kind = "sphere"
radius = 0.5
{surface}

[method]
kind = "impact"

[run]
until = 2.0
every = 0.5
compile = "never"
{run}
"""
# A module of a user, in the current folder.
MINE = """
import swarm
from swarm.kernel.vector import dot


class Damped(swarm.WallLaw):
    e: float = 0.5

    def leave(self, v, n, u, random, mass):
        return v - (1.0 + self.e) * dot(v - u, n) * n


def depth(frame):
    return frame.position[2].min()


number = 7
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The current folder, with a module of a name of its own: modules stay imported."""
    name = f"mine_{abs(hash(tmp_path)) % 10**9}"
    (tmp_path / f"{name}.py").write_text(MINE)
    monkeypatch.chdir(tmp_path)
    return name


def written(tmp_path, surface="", run="", more=""):
    path = tmp_path / "scene.toml"
    path.write_text(FILE.format(surface=surface, run=run) + more)
    return path


def run_of(path, allowed=(), **keywords):
    job = scene_file.read(path, allowed)
    return carry_out(job.scene, job.start(), job.method, replace(job.run, **{"checkpoint": None, **keywords}))


LAWS = [
    swarm.Lambert(0.5),
    swarm.Absorb(0.1),
    swarm.Absorb(barrier=0.3, loss=0.01),
    swarm.CercignaniLampis(1.0, 0.5, 0.9),
    swarm.Sticky(0.25),
]


@pytest.mark.parametrize("law", LAWS, ids=repr)
def test_laws_that_are_built_in_are_tables(law, tmp_path):
    """Written and read again they are the same; a trajectory gives them back."""
    scene = swarm.Scene([swarm.Sphere(0.5, laws=[law, swarm.Lambert()])])
    table = tomllib.loads(tomli_w.dumps(tables.scene_table(scene)))
    assert tables.scene_of(table["surface"], None) == scene
    path = tmp_path / "scene.toml"
    run, start = {"until": 1.0}, {"count": 1, "speed": 1.0}
    path.write_text(tomli_w.dumps(table | {"particles": start, "method": {"kind": "impact"}, "run": run}))
    assert scene_file.read(path).scene == scene


def test_groups_of_a_mesh_have_laws_in_tables():
    corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
    groups = {"pump": {"laws": [swarm.Absorb(0.3)], "restitution": 0.5}}
    mesh = swarm.Mesh(corners, faces, group=[0, 1, 1, 1], names=("pump", "rest"), groups=groups)
    table = tomllib.loads(tomli_w.dumps(tables.scene_table(swarm.Scene([mesh]))))
    (read,) = tables.scene_of(table["surface"], None).surfaces
    assert read.groups == groups


def test_a_file_runs_no_code_by_itself(tmp_path):
    path = written(tmp_path, 'laws = [{ law = "examples.own_law:Viscoelastic", slow = 2.0 }]')
    sentence = (
        r"surface\[0\].laws\[0\].law: examples.own_law:Viscoelastic is code of the module examples.own_law, which no "
        r'file runs by itself; allow it by its name: --plugins examples.own_law, or plugins=\["examples.own_law"\] in P'
    )
    for allowed in ((), ["examples"], ["examples.own_surface"]):
        with pytest.raises(swarm.SceneError, match=sentence):
            scene_file.read(path, allowed)
    job = scene_file.read(path, [LAW])
    assert job.scene.surfaces[0].laws == (Viscoelastic(2.0),)
    # Only as long as that file is read.
    with pytest.raises(swarm.SceneError, match=sentence):
        scene_file.read(path)


def test_a_law_of_a_file_is_that_of_python(tmp_path):
    one = run_of(written(tmp_path, 'laws = [{ law = "examples.own_law:Viscoelastic", slow = 2.0 }]'), [LAW])
    scene = swarm.Scene([swarm.Sphere(0.5, laws=[Viscoelastic(2.0)])])
    other = swarm.simulate(
        scene, swarm.fill(scene, 20, speed=1.0, seed=1), swarm.Impact(), until=2.0, every=0.5, compile="never"
    )
    assert one.particles.position.tobytes() == other.particles.position.tobytes()
    assert one.observables["wall_heat"].tobytes() == other.observables["wall_heat"].tobytes()


def test_surfaces_methods_and_numbers_are_named_alike(tmp_path):
    text = FILE.format(surface="", run='observables = { r = "examples.own_law:dot", spread = "numpy:std" }')
    text = text.replace(
        'kind = "sphere"\nradius = 0.5', f'kind = "{SURFACE}:Superellipsoid"\nsemi_axes = [0.3, 0.4, 0.5]'
    )
    text = text.replace('kind = "impact"', f'kind = "{METHOD}:Mirror"')
    path = tmp_path / "scene.toml"
    path.write_text(text)
    job = scene_file.read(path, [f"{SURFACE},{METHOD}", LAW, "numpy"])
    assert job.scene.surfaces == (Superellipsoid((0.3, 0.4, 0.5)),)
    assert job.method == Mirror()
    assert job.run.observables["spread"] is np.std
    for missing, key in ((SURFACE, r"surface\[0\].kind"), (METHOD, "method.kind"), ("numpy", "run.observables.spread")):
        with pytest.raises(swarm.SceneError, match=f"{key}: .* is code of the module {missing}"):
            scene_file.read(path, [name for name in (SURFACE, METHOD, LAW, "numpy") if name != missing])


BAD = {
    "no kind": (
        "laws = [{ probability = 0.5 }]",
        "",
        r"laws\[0\].kind: expected one of 'absorb', .*, or law, got nothing",
    ),
    "a kind": ('laws = [{ kind = "lambrt" }]', "", r"laws\[0\].kind must be one of .*; did you mean 'lambert'"),
    "both": ('laws = [{ kind = "lambert", law = "a:B" }]', "", "expected a kind or a law, got both"),
    "a key": (
        'laws = [{ kind = "lambert", probabilty = 0.5 }]',
        "",
        r"laws\[0\].probabilty: unknown key, .* mean 'prob",
    ),
    "a number": ('laws = [{ kind = "lambert", probability = 1.5 }]', "", r"surface\[0\].laws\[0\].probability must"),
    "a text": ('laws = [{ kind = "lambert", probability = "high" }]', "", r"laws\[0\].probability must .* got 'high'"),
    "nothing": ('laws = [{ kind = "sticky" }]', "", r"laws\[0\].time: expected a number, got nothing; add time ="),
    "no table": ("laws = [0.5]", "", r"laws\[0\]: expected a table such as .*, got 0.5"),
    "no name": ('laws = [{ law = "Damped" }]', "", r'laws\[0\].law: expected a law of a wall as "module:Name", got'),
    "another name": ('laws = [{ law = "MINE:Dampd" }]', "", r"the module mine_\d+ has no Dampd; did you mean 'Damped'"),
    "no law": ('laws = [{ law = "MINE:depth" }]', "", "must be a law of a wall, derived from WallLaw"),
    "a function": ("", 'observables = { n = "MINE:number" }', r"run.observables\['n'\] must be a function of a frame"),
    "a taken name": ("", 'observables = { time = "MINE:depth" }', r"run.observables\['time'\] must have another name"),
    "no function": ("", 'observables = { n = "depth" }', 'run.observables.n: expected a function as "module:Name"'),
    "a list": ("", "observables = [1]", "run.observables: expected a table such as"),
}


@pytest.mark.parametrize("name", BAD)
def test_what_is_wrong_is_named_by_its_key(name, folder, tmp_path):
    surface, run, sentence = (part.replace("MINE", folder) for part in BAD[name])
    with pytest.raises(swarm.SceneError, match=sentence):
        scene_file.read(written(tmp_path, surface, run), [folder])


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        (["no_such_module"], "plugins: there is no module no_such_module, neither in the current folder"),
        (["my laws"], "plugins must be names of modules, such as mylaws, without .py, got 'my laws'"),
        (["../laws"], "plugins must be names of modules"),
        ("laws", "plugins must be a list of names of modules"),
        ([7], "plugins must be names of modules, .* got 7"),
    ],
    ids=str,
)
def test_names_of_modules_are_checked(given, sentence, tmp_path):
    with pytest.raises(swarm.SceneError, match=sentence):
        scene_file.read(written(tmp_path), given)


def test_a_module_that_fails_is_named(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "fails_at_once.py").write_text("1 / 0\n")
    (tmp_path / "needs_another.py").write_text("import there_is_none_of_it\n")
    with pytest.raises(swarm.SceneError, match="fails_at_once cannot be imported: ZeroDivisionError: division by zero"):
        scene_file.read(written(tmp_path), ["fails_at_once"])
    with pytest.raises(
        swarm.SceneError, match="needs_another cannot be imported: No module named 'there_is_none_of_it'"
    ):
        scene_file.read(written(tmp_path), ["needs_another"])


def test_a_trajectory_of_a_law_of_ones_own_is_shown_without_its_code(folder, tmp_path):
    """It holds the names; to run it again needs the code."""
    path = written(tmp_path, f'laws = [{{ law = "{folder}:Damped" }}, {{ kind = "lambert" }}]')
    run_of(path, [folder], trajectory=tmp_path / "run.h5")
    with swarm.load(tmp_path / "run.h5") as trajectory:
        scene = trajectory.scene
        assert scene.surfaces[0].laws == ("Damped(e=0.5)", swarm.Lambert())
        assert "the law Damped(e=0.5), diffuse" in summary.of_file(tmp_path / "run.h5")["surface 0, sphere"]
        assert trajectory.plot(figsize=(10.0, 6.0)).axes
        assert trajectory.export(tmp_path / "run.xyz")
        assert len(trajectory.to_xarray()["time"]) == 5
        start = trajectory.frame(0)
    with pytest.raises(swarm.SceneError, match=r"surfaces\[0\].laws: 'Damped\(e=0.5\)' is Python"):
        swarm.simulate(scene, start, swarm.Impact(), until=1.0)
    again = run_of(path, [folder], trajectory=tmp_path / "again.h5")
    with swarm.load(tmp_path / "run.h5") as trajectory:
        assert again.particles.position.tobytes() == trajectory.frame(-1).position.tobytes()


def test_a_trajectory_of_a_surface_of_ones_own_says_whose_code_it_needs(tmp_path):
    scene = swarm.Scene([Superellipsoid((0.3, 0.4, 0.5))])
    start = swarm.fill(scene, 5, speed=1.0, seed=1)
    swarm.simulate(scene, start, swarm.Impact(), until=0.5, trajectory=tmp_path / "run.h5", compile="never")
    with swarm.load(tmp_path / "run.h5") as trajectory:
        with pytest.raises(swarm.SceneError, match=r"examples.own_surface:Superellipsoid is code of the module"):
            _ = trajectory.scene
        with plugins.allowed([SURFACE]):
            assert trajectory.scene == scene


# --- Sources and counters --------------------------------------------------------------------------------


HOLE = swarm.Sphere(0.1, (0.0, 0.0, 0.5))
BOTTLE = swarm.Scene([swarm.Sphere(0.5, openings=[HOLE]), swarm.Sphere(0.1, side="outside")])
SOURCES = [
    swarm.Source(1, rate=20.0, temperature=1.0),
    swarm.Source(HOLE, count=5, speed=2.0, start=0.25, stop=0.5, mass=2.0),
    swarm.Source(swarm.Sphere(0.3), volume=True, times=[0.1, 0.2], speed=1.0),
    swarm.Source(
        0, rate=5.0, even=True, beam=(0.0, 0.0, 1.0), divergence=0.1, within=swarm.Sphere(0.2, (0.0, 0.0, -0.5))
    ),
]
TABLES_OF_SOURCES = [
    {"where": 1, "rate": 20.0, "temperature": 1.0},
    {"where": {"surface": 0, "opening": 0}, "count": 5, "speed": 2.0, "start": 0.25, "stop": 0.5, "mass": 2.0},
    {"where": {"kind": "sphere", "radius": 0.3}, "volume": True, "times": [0.1, 0.2], "speed": 1.0},
    {
        "where": 0, "rate": 5.0, "even": True, "beam": [0.0, 0.0, 1.0], "divergence": 0.1,
        "within": {"kind": "sphere", "radius": 0.2, "center": [0.0, 0.0, -0.5]},
    },
]  # fmt: skip
COUNTERS = [
    swarm.Counter(swarm.Plane((1.0, 0.0, 0.0), 0.1)),
    swarm.Counter(swarm.Plane((0.0, 0.0, 1.0)), inside=swarm.Sphere(0.2)),
]


def test_sources_of_tables_and_counters_that_are_written_are_read_as_they_are(tmp_path):
    scene = tables.scene_table(BOTTLE)
    document = scene | {
        "source": TABLES_OF_SOURCES,
        "counter": [run_tables.counter_table(one) for one in COUNTERS],
        "method": {"kind": "impact"},
        "run": {"until": 1.0, "every": 0.5, "compile": "never", "seed": 3},
    }
    path = tmp_path / "scene.toml"
    path.write_text(tomli_w.dumps(document))
    job = scene_file.read(path)
    assert job.run.counters == tuple(COUNTERS)
    for one, other in zip(job.run.sources, SOURCES, strict=True):
        assert repr(one) == repr(other)
    # An opening is that of the scene, not one like it.
    assert job.run.sources[1].where is job.scene.surfaces[0].openings[0]
    assert job.start() is None
    one = carry_out(job.scene, job.start(), job.method, replace(job.run, checkpoint=None))
    other = swarm.simulate(
        BOTTLE, None, swarm.Impact(), until=1.0, every=0.5, compile="never", seed=3, sources=SOURCES, counters=COUNTERS
    )
    assert len(one.particles) > 20
    require_same_observables(one, other)


WRONG = {
    "a list": ("source = 1", "source: expected \\[\\[source\\]\\] tables, got 1"),
    "no place": ("[[source]]\nrate = 1.0\nspeed = 1.0", r"source\[0\].where: expected a value, got nothing"),
    "a key": ("[[source]]\nwhere = 0\nrat = 1.0\nspeed = 1.0", r"source\[0\].rat: unknown key, .* mean 'rate'"),
    "no speed": ("[[source]]\nwhere = 0\nrate = 1.0", r"source\[0\].*one of temperature, speed and beam, got none"),
    "an opening": (
        "[[source]]\nwhere = { surface = 0, opening = 2 }\nrate = 1.0\nspeed = 1.0",
        r"source\[0\].where.opening: expected no value, for there is nothing to choose from, got 2",
    ),
    "a surface": (
        "[[source]]\nwhere = { surface = 7, opening = 0 }\nrate = 1.0\nspeed = 1.0",
        r"source\[0\].where.surface: expected a number from 0 to 0, got 7",
    ),
    "a kind": (
        '[[source]]\nwhere = { kind = "spher" }\nrate = 1.0\nspeed = 1.0',
        r"source\[0\].where.kind must be one of",
    ),
    "no counter": (
        "[[counter]]\ninside = { kind = 'sphere', radius = 1.0 }",
        r"counter\[0\].surface: expected the table",
    ),
    "a counter's key": (
        "[[counter]]\nsurface = { kind = 'sphere', radius = 1.0 }\nwithin = 1",
        r"counter\[0\].within: unknown key, expected 'surface' and 'inside'",
    ),
    "a counter with a law": (
        "[[counter]]\nsurface = { kind = 'sphere', radius = 1.0, restitution = 0.5 }",
        r"counter\[0\].surface.restitution must be left out",
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_is_wrong_with_a_source_or_a_counter_is_named_by_its_key(name, tmp_path):
    more, sentence = WRONG[name]
    path = tmp_path / "scene.toml"
    text = FILE.format(surface="", run="")
    path.write_text(f"{more}\n{text}" if more.startswith("source =") else f"{text}\n{more}\n")
    with pytest.raises(swarm.SceneError, match=sentence):
        scene_file.read(path)


def test_a_file_without_any_particle_is_refused(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(FILE.format(surface="", run="").replace("[particles]\ncount = 20\nspeed = 1.0\nseed = 1\n", ""))
    with pytest.raises(
        swarm.SceneError, match=r"expected a \[particles\] or a \[body\] table, or a \[\[source\]\], got"
    ):
        scene_file.read(path)


# --- Commands --------------------------------------------------------------------------------------------


def test_commands_allow_modules_of_the_current_folder(folder, tmp_path):
    path = written(
        tmp_path, f'laws = [{{ law = "{folder}:Damped", e = 0.9 }}]', f'observables = {{ depth = "{folder}:depth" }}'
    )
    refused = command("run", str(path), "--quiet", cwd=tmp_path)
    assert refused.returncode == 2
    assert f"allow it by its name: --plugins {folder}" in refused.stderr
    done = command("run", str(path), "--quiet", "--plugins", folder, cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    with swarm.load(tmp_path / "scene.h5") as trajectory:
        assert trajectory.observables["depth"].shape == (5,)
    info = command("info", "scene.h5", cwd=tmp_path)
    assert "Damped(e=0.9)" in info.stdout


@pytest.mark.physics
def test_a_sweep_goes_over_the_numbers_of_laws(folder, tmp_path):
    laws = f'laws = [{{ kind = "absorb", probability = 0.0 }}, {{ law = "{folder}:Damped" }}]'
    more = '\n[sweep]\n"surface.0.laws.0.probability" = [0.0, 0.5, 1.0]\n'
    path = written(tmp_path, laws, f'observables = {{ depth = "{folder}:depth" }}', more)
    with pytest.raises(swarm.SceneError, match=rf"run 1 of 3, .*{folder}:Damped is code of the module {folder}"):
        swarm.sweep(path, tmp_path / "out")
    found = swarm.sweep(path, tmp_path / "out", plugins=[folder], processes=1)
    assert found["state"].tolist() == ["done"] * 3
    absorbed = found["absorbed_0"].tolist()
    assert absorbed[0] == 0 < absorbed[1] <= absorbed[2] == 20
    assert found["depth"].notna().all()


def test_a_trajectory_of_a_user_defined_method_is_read_without_its_code(tmp_path):
    """By its name: it says what was run, and is asked for nothing that kernels need."""
    scene = swarm.Scene([swarm.Sphere(0.5)])
    path = tmp_path / "run.h5"
    swarm.simulate(
        scene, swarm.fill(scene, 5, speed=1.0, seed=1), Mirror(), until=1.0, trajectory=path, compile="never"
    )
    with swarm.load(path) as trajectory:
        assert type(trajectory.method).__name__ == "Mirror"
        assert not isinstance(trajectory.method, Mirror)
        assert trajectory.report().html
    shown = command("info", str(path), cwd=tmp_path)
    assert (shown.returncode, "Mirror" in shown.stdout) == (0, True)
    with plugins.allowed([METHOD]), swarm.load(path) as trajectory:
        assert trajectory.method == Mirror()


def test_a_user_defined_method_may_say_by_the_earlier_name_that_it_supports_a_period():
    with pytest.warns(DeprecationWarning, match="Wrapped.knows_period is now supports_period"):

        class Wrapped(Mirror):
            def knows_period(self):
                return True

    assert Wrapped().supports_period()
    assert not Mirror().supports_period()
