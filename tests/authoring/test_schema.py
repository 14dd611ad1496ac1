"""The JSON Schema of scene and sweep files: what the reader takes fits, what it refuses for its keys does not."""

import json
import tomllib
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from conftest import row
from test_cli import command
from test_scene_file import GOOD, MOTIONS

from swarm import scene_file
from swarm.authoring.keys import tables
from swarm.authoring.schema import schema_of
from swarm.errors import SceneError

EXAMPLES = Path(__file__).parent.parent.parent / "examples"
SCENE, SWEEP = (jsonschema.Draft202012Validator(schema_of(sweep)) for sweep in (False, True))

FITS = [
    ("radius = 0.5", f"radius = 0.5\nmotion = {motion}") for motion in MOTIONS
] + [
    ('[method]\nkind = "impact"', ""),
    ("[particles]", 'gravity = [0, 0, -9.81]\nperiod = [1, 2.5, false]\nplane = "z"\n[particles]'),
    ("radius = 0.5", 'radius = 0.5\nlaws = [{kind = "lambert"}, {law = "mine:Law", depth = 2.0}]'),
    ('kind = "sphere"', 'kind = "mine:Surface"\nanything = "else"'),
    ('kind = "impact"', 'kind = "mine:Method"\nanything = "else"'),
    ('kind = "sphere"\nradius = 0.5', 'kind = "spheres"\nfrom = "balls.csv"'),
    ("count = 10\nspeed = 0.5", 'from = "start.h5"\nframe = 3'),
    ("every = 0.5", 'every = 0.5\nframes = 10\nimpact_particles = [0, 5]\nobservables = {spread = "mine:spread"}'),
    ("[run]", '[[source]]\nwhere = {surface = 0, opening = 0}\nrate = 10\ntemperature = 1\n[run]'),
    ("[run]", '[[counter]]\nsurface = {kind = "plane", normal = [0, 0, 1]}\n[run]'),
    ("[run]", '[[surface.openings]]\nkind = "sphere"\nradius = 0.1\ntimes = [[0.0, inf]]\n[run]'),
]  # fmt: skip
WRONG = [
    ("count = 10", "cuont = 10"),
    ("count = 10", "count = 0"),
    ("count = 10", 'count = "ten"'),
    ("count = 10", ""),
    ("count = 10", 'count = 10\nfrom = "start.csv"'),
    ("count = 10", "count = 10\nframe = 3"),
    ("speed = 0.5", "speed = -0.5"),
    ("[particles]", "gravty = [0, 0, 1]\n[particles]"),
    ("[particles]", "gravity = [0, 1]\n[particles]"),
    ("[particles]", "gravity = 9.81\n[particles]"),
    ("[particles]", "period = [1.0, true, false]\n[particles]"),
    ("[particles]", 'plane = "w"\n[particles]'),
    ("[particles]", "[body]\nkind = 'dumbbell'\nlength = 1\nmass = 1\ncount = 1\n[particles]"),
    ('kind = "sphere"', 'kind = "sphre"'),
    ('kind = "sphere"\n', ""),
    ("radius = 0.5", "radius = 0.0"),
    ("radius = 0.5", "radios = 0.5"),
    ("radius = 0.5", "radius = 0.5\nrestitution = 1.5"),
    ("radius = 0.5", "radius = 0.5\nfriction = -0.1"),
    ("radius = 0.5", "radius = 0.5\nside = 'within'"),
    ("radius = 0.5", "radius = 0.5\ncenter = [0, 0]"),
    ("radius = 0.5", "radius = 0.5\nhalf_widths = [1, 1, 1]"),
    ("radius = 0.5", "radius = 0.5\nrotation = {axis = [0, 0, 1]}"),
    ("radius = 0.5", 'radius = 0.5\nlaws = [{kind = "lambertian"}]'),
    ("radius = 0.5", 'radius = 0.5\nlaws = [{kind = "absorb", probability = 1.5}]'),
    ("radius = 0.5", 'radius = 0.5\nmotion = {kind = "rotation", rate = 1.0}'),
    ("[run]", '[[surface.openings]]\nkind = "sphere"\nradius = 0.1\nfriction = 0.1\n[run]'),
    ("[run]", "[[source]]\nwhere = 0\ntemperature = 1\n[run]"),
    ("[run]", "[[counter]]\ninside = {kind = 'sphere', radius = 1}\n[run]"),
    ('kind = "impact"', 'kind = "impact"\nsliding_tolerence = 1e-9'),
    ('kind = "impact"', 'kind = "penalty"\ndt = 1e-3'),
    ('kind = "impact"', 'kind = "penalty"\ndt = 0.0\npenalty = 1.0'),
    ('kind = "impact"', 'kind = "penalty"\ndt = 1.0\npenalty = 1.0\ngradient = "simple"'),
    ("until = 1.0", "until = -1.0"),
    ("until = 1.0", ""),
    ("every = 0.5", "evry = 0.5"),
    ("every = 0.5", 'precision = "float16"'),
    ("every = 0.5", 'frames = "some"'),
    ("[run]\nuntil = 1.0\nevery = 0.5", ""),
]


def changed(old, new):
    assert old in GOOD
    return GOOD.replace(old, new)


def test_they_are_schemas_of_the_dialect():
    for validator in (SCENE, SWEEP):
        jsonschema.Draft202012Validator.check_schema(validator.schema)


def test_every_example_fits():
    scenes, sweeps = (sorted((EXAMPLES / name).glob("*.toml")) for name in ("scenes", "sweeps"))
    assert len(scenes) > 20
    for paths, validator in ((scenes, SCENE), (sweeps, SWEEP)):
        for path in paths:
            with row(path.name):
                assert [error.message[:200] for error in validator.iter_errors(tomllib.loads(path.read_text()))] == []


@pytest.mark.parametrize(("old", "new"), FITS)
def test_what_fits(old, new):
    assert [error.message[:200] for error in SCENE.iter_errors(tomllib.loads(changed(old, new)))] == []


def test_every_form_of_a_rotation_fits_and_is_read(tmp_path):
    """A quaternion, an axis with an angle, and the rows of a matrix; of bodies one for all, and one for each."""
    one = "[0.0, 0.0, 0.0, 1.0]", "{axis = [0, 0, 1], angle = 3.141592653589793}", "[[-1, 0, 0], [0, -1, 0], [0, 0, 1]]"
    turned = [('kind = "box"\nhalf_widths = [1, 2, 3]', "rotation", form) for form in one]
    solid = "centers = [[0, 0, 0]]\nhalf_widths = [0.1, 0.2, 0.3]"
    boxes = f'kind = "sphere"\nradius = 9\n[[surface]]\nkind = "boxes"\n{solid}'
    turned += [(boxes, "rotations", form) for of_all in (one[0], one[2]) for form in (of_all, f"[{of_all}]")]
    for i, (kind, key, form) in enumerate(turned):
        path, text = tmp_path / f"{i}.toml", changed('kind = "sphere"\nradius = 0.5', f"{kind}\n{key} = {form}")
        path.write_text(text)
        with row(form):
            assert [error.message[:200] for error in SCENE.iter_errors(tomllib.loads(text))] == []
            turn = getattr(scene_file.read(path).scene.surfaces[-1], key)
            assert np.abs(np.ravel(turn)) == pytest.approx([0.0, 0.0, 0.0, 1.0], abs=1e-15)


@pytest.mark.parametrize(("old", "new"), WRONG)
def test_what_the_reader_refuses_does_not_fit(old, new, tmp_path):
    text, path = changed(old, new), tmp_path / "scene.toml"
    path.write_text(text)
    assert not SCENE.is_valid(tomllib.loads(text))
    with pytest.raises(SceneError):
        scene_file.read(path).start()


def test_sweeps():
    """Lists in place of what the tables lack; a file of one run does not fit."""
    text = GOOD.replace("count = 10\n", "").replace("radius = 0.5", "")
    lists = '[sweep]\ncombine = "zip"\n"particles.count" = {range = 3}\nsurface.0.radius = [0.1, 0.2, 0.3]\n'
    assert SWEEP.is_valid(tomllib.loads(text + lists))
    assert not SWEEP.is_valid(tomllib.loads(text))
    for wrong in ("{rnage = 3.5}", "{linspace = [0.0, 1.0]}", "3", "[]", "{range = 3, linspace = [0, 1, 2]}"):
        with row(wrong):
            assert not SWEEP.is_valid(tomllib.loads(text + lists.replace("{range = 3}", wrong)))
    assert not SWEEP.is_valid(tomllib.loads(text.replace("speed", "sped") + lists))


def test_every_key_has_a_meaning():
    """Of every key of every table, and each table is of the reader."""
    for table in tables():
        with row(f"{table.place} {table.kind}"):
            assert table.meaning
            assert [key.name for key in table.keys if not key.meaning] == []
            assert [key.name for key in table.keys if not key.form] == [], "name a form in authoring/keys.py"
            assert len({key.name for key in table.keys}) == len(table.keys)


def test_the_command_writes_it_and_editors_find_it(tmp_path):
    """By a line that is a comment of TOML."""
    printed = json.loads(command("schema", cwd=tmp_path).stdout)
    assert printed == schema_of()
    assert command("schema", "--sweep", "-o", "swarm.schema.json", cwd=tmp_path).returncode == 0
    assert json.loads((tmp_path / "swarm.schema.json").read_text()) == schema_of(sweep=True)
    assert command("schema", "-o", "swarm.schema.json", cwd=tmp_path).returncode == 2
    assert command("schema", "-o", "swarm.schema.json", "--overwrite", cwd=tmp_path).returncode == 0
    (tmp_path / "mine.json").write_text('{"title": "mine"}')
    assert command("schema", "-o", "mine.json", "--overwrite", cwd=tmp_path).returncode == 2
    (tmp_path / "scene.toml").write_text(f"#:schema ./swarm.schema.json\n{GOOD}")
    assert scene_file.read(tmp_path / "scene.toml").run.until == 1.0
