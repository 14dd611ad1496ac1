"""Scene files: what they may contain, and the error sentence for everything else."""

import tomllib
from pathlib import Path

import numpy as np
import pytest
import tomli_w

import swarm
from swarm import scene_file
from swarm.bodies.elastic import block
from swarm.bodies.table import table_of
from swarm.serialization import tables

GOOD = """
[particles]
count = 10
speed = 0.5

[[surface]]
kind = "sphere"
radius = 0.5

[method]
kind = "impact"

[run]
until = 1.0
every = 0.5
"""


SPHERE = 'kind = "sphere"\nradius = 0.5'
FALLS = "{ kind = 'translation', velocity = [0, 0, -1] }"
BENDS = "{ kind = 'path', times = [0, 1, 3], positions = [[0, 0, 0], [0, 0, 1], [0, 1, 0]] }"
TURNS = "{ kind = 'rotation', axis = [0, 0, 2], rate = 3, center = [0, 0, 1] }"
SWINGS = "{ kind = 'oscillation', amplitude = [0, 0, 0.1], frequency = 2, phase = 0.5 }"
MOTIONS = {
    FALLS: swarm.Translation((0.0, 0.0, -1.0)),
    BENDS: swarm.Path((0.0, 1.0, 3.0), ((0, 0, 0), (0, 0, 1), (0, 1, 0))),
    TURNS: swarm.Rotation((0.0, 0.0, 2.0), 3.0, (0.0, 0.0, 1.0)),
    SWINGS: swarm.Oscillation((0.0, 0.0, 0.1), 2.0, 0.5),
    SWINGS.replace(", phase = 0.5", ""): swarm.Oscillation((0.0, 0.0, 0.1), 2.0),
    f"[{SWINGS}]": swarm.Oscillation((0.0, 0.0, 0.1), 2.0, 0.5),
    f"[{FALLS}, {SWINGS}, {TURNS}]": swarm.Translation((0.0, 0.0, -1.0))
    + swarm.Oscillation((0.0, 0.0, 0.1), 2.0, 0.5)
    + swarm.Rotation((0.0, 0.0, 2.0), 3.0, (0.0, 0.0, 1.0)),
}


def formula(phi):
    return f'kind = "formula"\nphi = "{phi}"'


def read(tmp_path, text):
    path = tmp_path / "scene.toml"
    path.write_text(text)
    return scene_file.read(path)


def test_a_job(tmp_path):
    job = read(tmp_path, GOOD)
    assert job.scene == swarm.Scene(surfaces=[swarm.Sphere(0.5)])
    assert job.method == swarm.Impact()
    assert (job.run.until, job.run.every) == (1.0, 0.5)
    assert job.text == GOOD
    np.testing.assert_array_equal(job.start().position, swarm.fill(job.scene, 10, speed=0.5).position)


def test_laws_of_walls_and_their_seed(tmp_path):
    laws = "friction = 0.25\ntemperature = 300\naccommodation = 0.5"
    job = read(tmp_path, GOOD.replace("radius = 0.5", f"radius = 0.5\n{laws}") + f"seed = {2**64 - 1}\n")
    assert job.scene.surfaces == (swarm.Sphere(0.5, friction=0.25, temperature=300.0, accommodation=0.5),)
    assert job.run.seed == 2**64 - 1
    assert read(tmp_path, GOOD).run.seed == 0


@pytest.mark.parametrize("text", MOTIONS)
def test_motions_of_walls(tmp_path, text):
    """And back into a file, from which the same scene is read."""
    job = read(tmp_path, GOOD.replace("radius = 0.5", f"radius = 0.5\nmotion = {text}"))
    (surface,) = job.scene.surfaces
    assert surface == swarm.Sphere(0.5, motion=MOTIONS[text])
    again = tomli_w.dumps({**tomllib.loads(GOOD), **tables.scene_table(job.scene)})
    assert read(tmp_path, again).scene == job.scene


HOLES = """
[[surface.openings]]
kind = "sphere"
radius = 0.1
center = [0.0, 0.0, 0.5]

[[surface.openings]]
kind = "spheres"
from = "holes.csv"
"""


def test_openings_of_walls(tmp_path):
    """And back into a file, without the one of bodies from a file."""
    (tmp_path / "holes.csv").write_text("x,y,z,radius\n0.5,0,0,0.1\n0,0.5,0,0.05\n")
    job = read(tmp_path, GOOD.replace("radius = 0.5\n", f"radius = 0.5\n{HOLES}"))
    first, second = job.scene.surfaces[0].openings
    assert first == swarm.Sphere(0.1, center=(0.0, 0.0, 0.5))
    assert (second.centers.tolist(), second.radii.tolist()) == ([[0.5, 0.0, 0.0], [0.0, 0.5, 0.0]], [0.1, 0.05])
    again = read(tmp_path, tomli_w.dumps({**tomllib.loads(GOOD), **tables.scene_table(job.scene)}))
    assert tables.scene_table(again.scene) == tables.scene_table(job.scene)
    assert again.scene.surfaces[0].openings[0] == first


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("radius = 0.1", "radius = -0.1", r"surface\[0\]\.openings\[0\]\.radius must be above 0, got -0\.1"),
        ("radius = 0.1", "radios = 0.1", r"surface\[0\]\.openings\[0\]\.radios: unknown key.*did you mean 'radius'"),
        ("radius = 0.1", "radius = 0.1\nfriction = 0.1", r"surface\[0\]\.openings\[0\]\.friction must be left out"),
        ('kind = "spheres"', 'kind = "sphres"', r"surface\[0\]\.openings\[1\]\.kind must be one of .* mean 'spheres'"),
        ("holes.csv", "hole.csv", r"surface\[0\]\.openings\[1\]\.from: cannot read .*hole\.csv"),
        ("0.0, 0.0, 0.5]", "0.0, 0.0, 0.9]", r"surfaces\[0\]\.openings\[0\] must reach the wall that it opens"),
        (HOLES, "openings = 3\n", r"surface\[0\]\.openings: expected \[\[surface\.openings\]\] tables, got 3"),
        (HOLES, "openings = [3]\n", r"surface\[0\]\.openings\[0\]: expected a table with a kind, got 3"),
    ],
)
def test_bad_openings_name_the_key(tmp_path, old, new, message):
    assert old in HOLES
    (tmp_path / "holes.csv").write_text("x,y,z,radius\n0.5,0,0,0.1\n")
    with pytest.raises(swarm.SceneError, match=message):
        read(tmp_path, GOOD.replace("radius = 0.5\n", f"radius = 0.5\n{HOLES.replace(old, new)}"))


@pytest.mark.parametrize("path", sorted(Path(__file__).parents[1].glob("examples/scenes/*.toml")), ids=lambda p: p.stem)
def test_shipped_scenes_are_read(path):
    job = scene_file.read(path)
    start = job.start()
    if start is None:  # all come from sources
        assert job.run.sources
        return
    points = start.position if isinstance(start, swarm.Particles) else start.contact_points().reshape(3, -1)
    assert (job.scene.gaps(points) <= 0.0).all()


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("count = 10", "", r"particles\.count: expected a whole number, got nothing"),
        ("count = 10", "count = 0", r"particles\.count must be 1 or more, got 0"),
        ("count = 10", "count = 1.5", r"particles\.count: expected a whole number, got a number \(in count = 1\.5\)"),
        ("count = 10", "cuont = 10", r"particles\.cuont: unknown key.*did you mean 'count'"),
        ("speed = 0.5", "", r"fill needs one of speed and temperature, got neither"),
        ("speed = 0.5", "speed = 0.5\ntemperature = 1.0", r"got both"),
        ("speed = 0.5", "speed = nan", r"particles.speed must be a finite number, 0 or more, got nan"),
        ("speed = 0.5", "speed = 0.5\nmass = -1.0", r"particles.mass must be above 0, got -1"),
        ("[particles]", "[partikles]", r"partikles: unknown key.*did you mean 'particles'"),
        ('kind = "sphere"', 'kind = "sphree"', r"surface\[0\]\.kind must be one of .*'sphree'; did you mean 'sphere'"),
        ('kind = "sphere"', "", r"surface\[0\]\.kind: expected one of"),
        ("radius = 0.5", "radius = 0.0", r"surface\[0\]\.radius must be above 0, got 0"),
        ("radius = 0.5", "radius = inf", r"surface\[0\]\.radius must be a finite number above 0, got inf"),
        (
            "radius = 0.5",
            'radius = "50 cm"',
            r"surface\[0\]\.radius: expected a number, got a text \(in radius = '50 cm'\); numbers have no unit: len",
        ),
        (
            "radius = 0.5",
            'radius = 0.5\nlaws = ["lambert"]',
            r"surface\[0\]\.laws\[0\]: expected a table such as \{ kind =",
        ),
        (
            "speed = 0.5",
            "position = [[0, 0, 0]]",
            r"particles\.position: unknown key.*in a file: from = \"start\.csv\"",
        ),
        ("radius = 0.5", "radius = 0.5\ncenter = [0.0, 1.0]", r"surface\[0\]\.center: expected a list of length 3"),
        ("radius = 0.5", 'radius = 0.5\nside = "insde"', r"surface\[0\]\.side must be one of.*did you mean 'inside'"),
        ("radius = 0.5", "radius = 0.5\nradios = 1.0", r"surface\[0\]\.radios: unknown key.*did you mean 'radius'"),
        ("radius = 0.5", "", r"surface\[0\]\.radius: expected a number, got nothing"),
        (
            "[[surface]]",
            "[surface]",
            r"surface: expected \[\[surface\]\] tables.*got a table \[surface\]; write it in double",
        ),
        ('kind = "impact"', 'kind = "impakt"', r"method\.kind must be one of .* did you mean 'impact'"),
        ('kind = "impact"', 'kind = "penalty"\npenalty = 1.0\ndt = 0.0', r"method\.dt must be above 0, got 0"),
        ('kind = "impact"', 'kind = "penalty"\npenalty = 1.0', r"method\.dt: expected a number, got nothing"),
        (
            'kind = "impact"',
            'kind = "penalty"\npenalty = 1.0\ndt = 0.1\nexponent = 0.9',
            r"method\.exponent must be 1 or more, got 0\.9",
        ),
        ("until = 1.0", "", r"run\.until: expected a number, got nothing"),
        ("until = 1.0", "until = 1.0\ndt = 2", r"run\.dt: unknown key.*; dt is a key of \[method\]$"),
        ("speed = 0.5", "speed = 0.5\ndensity = 2", r"particles\.density: unknown key.*; give the mass of each \[kg\]"),
        ("until = 1.0", "until = 1.0\nevry = 2", r"run\.evry: unknown key.*did you mean 'every'"),
        ("every = 0.5", "every = 2.0", r"run\.every must be at most until = 1, got 2"),
        ("every = 0.5", "threads = 0", r"run\.threads must be 1 or more, got 0"),
        ("every = 0.5", 'frames = "some"', r'run\.frames must be "all", "none", or k .*, got \'some\''),
        ("every = 0.5", "checkpoint = 0.0", r"run\.checkpoint must be 0\.01 or more, got 0"),
        ("every = 0.5", 'compile = "nevr"', r"run\.compile must be one of .*'nevr'; did you mean 'never'"),
        ("every = 0.5", "trajectory = 5", r"run\.trajectory must be the path of a file, got 5"),
        ("every = 0.5", "resume = true", r"run\.resume: unknown key, expected 'until', 'every', .* and 'seed'"),
        ("every = 0.5", "seed = -1", r"run\.seed must be 0 or more, got -1"),
        ("every = 0.5", "seed = 1.5", r"run\.seed: expected a whole number, got a number \(in seed = 1\.5\)"),
        ("every = 0.5", "seed = 18446744073709551616", r"run\.seed must be below 2\*\*64, got 1\.84467e\+19"),
        ("every = 0.5", "gravity = [0, 0, -1]", r"run\.gravity: unknown key.*gravity belongs at the top"),
        ("[particles]", "gravity = [0, 0]\n[particles]", r"gravity must be three numbers, got 2"),
        ("[particles]", "[particles", r"cannot read the scene file .*scene\.toml"),
        (
            "radius = 0.5",
            'radius = 0.5\n[[surface]]\nkind = "plane"\nnormal = [1.0, 0.0, 0.0]\noffset = -2.0',
            r"surfaces must leave a volume",
        ),
        ("radius = 0.5", "radius = 0.5\nrotation = [0, 0, 0, 0]", r"surface\[0\]\.rotation must not be of length 0"),
        (
            "radius = 0.5",
            "radius = 0.5\nrotation = { axis = [0, 0, 0], angle = 1.0 }",
            r"surface\[0\]\.rotation\.axis must not be of length 0",
        ),
        (
            "radius = 0.5",
            'radius = 0.5\nmotion = { kind = "oscilation", amplitude = [0, 0, 1], frequency = 1.0 }',
            r"surface\[0\]\.motion\.kind must be one of .*; did you mean 'oscillation'",
        ),
        (
            "radius = 0.5",
            'radius = 0.5\nmotion = { kind = "oscillation", amplitude = [0, 0, 1] }',
            r"surface\[0\]\.motion\.frequency: expected a value where kind is 'oscillation', got nothing",
        ),
        (
            "radius = 0.5",
            'radius = 0.5\nmotion = { kind = "translation", velocity = [0, 0, 1], speed = 1.0 }',
            r"surface\[0\]\.motion\.speed: unknown key, expected 'velocity'$",
        ),
        (
            "radius = 0.5",
            'radius = 0.5\nmotion = { kind = "rotation", axis = [0, 0, 1], rate = 1, most = 2 }',
            r"surface\[0\]\.motion\.most: unknown key, expected 'axis', 'rate' and 'center'$",
        ),
        (
            "radius = 0.5",
            "radius = 0.5\nmotion = { velocity = [0, 0, 1] }",
            r"surface\[0\]\.motion\.kind: expected one of 'translation', .*, got nothing",
        ),
        (
            "radius = 0.5",
            'radius = 0.5\nmotion = { kind = "translation", velocity = [0, 0] }',
            r"surface\[0\]\.motion\.velocity must be three numbers, got 2",
        ),
        (
            "radius = 0.5",
            f"radius = 0.5\nmotion = [{FALLS}, {TURNS.replace('rate = 3', 'rate = inf')}]",
            r"surface\[0\]\.motion\[1\]\.rate must be a finite number, got inf",
        ),
        (
            "radius = 0.5",
            f"radius = 0.5\nmotion = [{BENDS}, {FALLS}, {BENDS}]",
            r"surface\[0\]\.motion: a sum of motions must have at most 1 Path, got 2",
        ),
        (
            "radius = 0.5",
            'radius = 0.5\nmotion = { kind = "path", times = [0, 1], positions = [[0, 0, 0]] }',
            r"surface\[0\]\.motion\.positions must be one for each of the 2 times, got 1",
        ),
        (
            "radius = 0.5",
            "radius = 0.5\nmotion = 3.0",
            r"surface\[0\]\.motion must be None, swarm.Translation.*got 3\.0",
        ),
        (
            "radius = 0.5",
            'radius = 0.5\nmotion = { kind = "oscillation", amplitude = [0, 0, 1], frequency = 1 }\nmass = 2.0',
            r"surface\[0\].*motion must be None, a Translation or a Guide where a mass is given",
        ),
        ("radius = 0.5", "radius = 0.5\nmass = -2.0", r"surface\[0\]\.mass must be above 0, got -2"),
        ("radius = 0.5", "radius = 0.5\nfriction = -1", r"surface\[0\]\.friction must be 0 or more, got -1"),
        (
            "radius = 0.5",
            "radius = 0.5\naccommodation = 0.5",
            r"surface\[0\]\.accommodation must go with a temperature",
        ),
        ("radius = 0.5", "radius = 0.5\nrestitution = 1.5", r"surface\[0\]\.restitution must be from 0 to 1, got 1\.5"),
        (
            SPHERE,
            'kind = "quadric"\nmatrix = [[1, 2, 0], [3, 1, 0], [0, 0, 1]]\nconstant = -1.0',
            r"surface\[0\]\.matrix must be symmetric, got matrix\[0\]\[1\] = 2",
        ),
        (SPHERE, formula("x**2 + y**2 + zz**2 - 1"), r"surface\[0\]\.phi has an unknown name 'zz'"),
        (SPHERE, formula("open(x) - 1"), r"surface\[0\]\.phi must call only sqrt"),
        ("speed = 0.5", "speed = 0.5\nradius = 0.0", r"\[particles\]: radius must be a finite number above 0, got 0"),
        ("speed = 0.5", "speed = 0.5\nradius = [0.1, 0.2]", r"\[particles\]: radius must be one number or have shape"),
        ("speed = 0.5", 'speed = 0.5\nradius = "wide"', r"particles\.radius: expected a number or a list, got a text"),
        ("speed = 0.5", "speed = 0.5\n[pairs]\nrestitution = 1.5", r"pairs\.restitution must be from 0 to 1, got 1\.5"),
        ("speed = 0.5", "speed = 0.5\n[pairs]\nbounce = 1", r"pairs\.bounce: unknown key, expected 'restitution'"),
        (
            "speed = 0.5",
            "speed = 0.5\n[pairs]\nfriction = true",
            r"pairs\.friction: expected a number, got true or false",
        ),
        ("speed = 0.5", "speed = 0.5\nexact = true", r"\[particles\]: exact must be False with speed"),
        ("speed = 0.5", "temperature = 0.5\nexact = 1", r"particles\.exact"),
        (SPHERE, formula("x.real - 1"), r"surface\[0\]\.phi must not have an attribute"),
        (SPHERE, formula("import os"), r"surface\[0\]\.phi is not a formula"),
        (SPHERE, formula("(x**2 + y**2 + z**2 - 0.25)**3"), r"surface\[0\]\.phi .* gradient"),
        (
            SPHERE,
            formula("log(x) + y**2") + "\nbounds = [[-1, -1, -1], [1, 1, 1]]",
            r"surface\[0\]\.phi must be a finite number",
        ),
    ],
)
def test_bad_input_names_the_key(tmp_path, old, new, message):
    assert old in GOOD
    with pytest.raises(swarm.SceneError, match=message):
        read(tmp_path, GOOD.replace(old, new)).start()


def test_an_exact_temperature(tmp_path):
    particles = read(tmp_path, GOOD.replace("speed = 0.5", "temperature = 0.5\nexact = true")).start()
    assert 0.5 * (particles.velocity**2).sum() / 10 == pytest.approx(0.75, rel=1e-14)


def test_balls(tmp_path):
    text = GOOD.replace("speed = 0.5", "speed = 0.5\nradius = 0.01") + "\n[pairs]\nrestitution = 0.9\nfriction = 0.2\n"
    job = read(tmp_path, text)
    assert job.scene.pairs == swarm.Pairs(0.9, 0.2)
    assert job.start().radius.tolist() == [0.01] * 10
    radii = [0.001 * k for k in range(1, 11)]
    assert read(tmp_path, text.replace("= 0.01", f"= {radii}")).start().radius.tolist() == radii
    # Written back, as a trajectory has it.
    table = tables.scene_table(job.scene)
    assert table["pairs"] == {"restitution": 0.9, "friction": 0.2}
    assert tables.scene_of(table["surface"], None, pairs=table["pairs"]).pairs == job.scene.pairs


def test_packed_balls(tmp_path):
    text = GOOD.replace("speed = 0.5", "fraction = 0.202")
    packed = read(tmp_path, text).start()
    assert len(packed) == 10
    assert 10 * 4.0 / 3.0 * np.pi * packed.radius[0] ** 3 == pytest.approx(0.202 * packed.volume, rel=1e-9)
    assert not packed.velocity.any()
    many = read(tmp_path, text.replace("count = 10", "radius = 0.1\nspeed = 2.0")).start()
    assert len(many) == int(0.202 * many.volume / (4.0 / 3.0 * np.pi * 0.1**3))
    assert np.sqrt((many.velocity**2).sum(axis=0)) == pytest.approx(2.0)
    with pytest.raises(
        swarm.SceneError, match=r"\[particles\]: pack needs two of n, radius and fraction, got fraction = "
    ):
        read(tmp_path, text.replace("count = 10", "")).start()


def test_balls_in_a_cell_without_walls(tmp_path):
    text = "period = [1.0, 1.0, 1.0]\n" + GOOD.replace("speed = 0.5", "speed = 0.5\nradius = 0.01")
    job = read(tmp_path, text.replace('[[surface]]\nkind = "sphere"\nradius = 0.5\n', ""))
    assert job.scene == swarm.Scene([], period=(1.0, 1.0, 1.0))
    assert len(job.start()) == 10


def test_balls_from_a_file(tmp_path):
    (tmp_path / "start.csv").write_text("x,y,z,vx,vy,vz,radius,wx,wy,wz\n0.1,0,0,1,0,0,0.2,1,2,3\n")
    particles = read(tmp_path, GOOD.replace("count = 10\nspeed = 0.5", 'from = "start.csv"')).start()
    assert particles.radius.tolist() == [0.2]
    assert particles.spin.T.tolist() == [[1.0, 2.0, 3.0]]


WITHIN = 'within = { kind = "sphere", radius = 0.1, center = [0.2, 0.0, 0.0] }'


def test_particles_start_in_a_part(tmp_path):
    job = read(tmp_path, GOOD.replace("speed = 0.5", f"speed = 0.5\n{WITHIN}"))
    start = swarm.fill(job.scene, 10, speed=0.5, within=swarm.Sphere(0.1, (0.2, 0.0, 0.0)))
    np.testing.assert_array_equal(job.start().position, start.position)
    for given, sentence in (
        (f"count = 10\nspeed = 0.5\n{WITHIN.replace('sphere', 'ball')}", r"particles\.within\.kind must be .*'ball'"),
        (
            f"speed = 0.5\nfraction = 0.1\nradius = 0.1\n{WITHIN}",
            r"\[particles\]: within must be left out with a fraction",
        ),
        (f'from = "start.csv"\n{WITHIN}', r"particles\.within: cannot be combined with from = 'start\.csv'"),
    ):
        with pytest.raises(swarm.SceneError, match=sentence):
            read(tmp_path, GOOD.replace("count = 10\nspeed = 0.5", given)).start()


def test_particles_from_files(tmp_path):
    csv = tmp_path / "start.csv"
    csv.write_text("x,y,z,vx,vy,vz,mass\n0.1,0,0,1,0,0,2\n")
    source = GOOD.replace("count = 10\nspeed = 0.5", 'from = "{}"')
    particles = read(tmp_path, source.format("start.csv")).start()
    assert (particles.position[0, 0], particles.mass[0]) == (0.1, 2.0)

    scene = swarm.Scene(surfaces=[swarm.Sphere(0.5)])
    result = swarm.simulate(scene, particles, swarm.Impact(), until=1.0, every=0.5, trajectory=tmp_path / "start.h5")
    last = read(tmp_path, source.format("start.h5")).start()
    np.testing.assert_array_equal(last.position, result.particles.position)
    first = read(tmp_path, source.format('start.h5"\nframe = 0 #')).start()
    np.testing.assert_array_equal(first.position, particles.position)

    for text, message in (
        ('start.csv"\nframe = 0 #', r"particles\.frame: needs from"),
        ('start.csv"\ncount = 3 #', r"particles\.count: cannot be combined with from = 'start\.csv'"),
        ("start.txt", r"particles\.from: expected a \.csv or \.h5 file, got 'start\.txt'"),
    ):
        with pytest.raises(swarm.SceneError, match=message):
            read(tmp_path, source.format(text))
    with pytest.raises(swarm.SceneError, match=r"cannot read .*absent\.csv"):
        read(tmp_path, source.format("absent.csv")).start()


def with_body(keys):
    return GOOD.replace("[particles]\ncount = 10\nspeed = 0.5", f"[body]\n{keys}")


CUBE = [(x, y, z) for x in (0.0, 0.1) for y in (0.0, 0.1) for z in (0.0, 0.1)]
ROD = "points = [[0, 0, 0], [0.1, 0, 0]]\nmass = 0.5\nlinks = [[0, 1]]"


@pytest.mark.parametrize(
    ("keys", "body"),
    [
        ('kind = "dumbbell"\nlength = 0.1\nmass = 0.5', lambda: swarm.dumbbell(0.1, 0.5)),
        ('kind = "tetrahedron"\nedge = 0.1\nmass = 0.5', lambda: swarm.tetrahedron(0.1, 0.5)),
        ('kind = "chain"\nn = 3\nlength = 0.1\nmass = 0.5', lambda: swarm.chain(3, 0.1, 0.5)),
        (f'kind = "rigid"\ndensity = 500\nvertices = {[list(v) for v in CUBE]}', lambda: swarm.rigid(CUBE, 500.0)),
        (
            f'kind = "rigid"\ndensity = 500\nvertices = {[list(v) for v in CUBE]}\ncontacts = 0.04',
            lambda: swarm.rigid(CUBE, 500.0, contacts=0.04),
        ),
        (
            f'kind = "rigid"\ndensity = 500\nvertices = {[list(v) for v in CUBE]}\ncontacts = [[0.05, 0.05, 0.0]]',
            lambda: swarm.rigid(CUBE, 500.0, contacts=[(0.05, 0.05, 0.0)]),
        ),
        (
            'kind = "elastic"\nlengths = [0.1, 0.1, 0.2]\ncells = [1, 1, 2]\nyoung = 1e5\npoisson = 0.3\n'
            'density = 500\nmass = "consistent"',
            lambda: swarm.elastic(block((0.1, 0.1, 0.2), (1, 1, 2)), 1e5, 0.3, 500.0, mass="consistent"),
        ),
        (f'kind = "points"\n{ROD}', lambda: swarm.Body([(0, 0, 0), (0.1, 0, 0)], 0.5, [(0, 1)])),
    ],
    ids=lambda value: value.split('"')[1] if isinstance(value, str) else "",
)
def test_bodies_are_those_of_the_functions(tmp_path, keys, body):
    job = read(tmp_path, with_body(f"{keys}\ncount = 3\nspeed = 0.5\nspin = 2.0\nseed = 7"))
    start, expected = job.start(), swarm.place(job.scene, body(), 3, speed=0.5, spin=2.0, seed=7)
    np.testing.assert_array_equal(start.position, expected.position)
    np.testing.assert_array_equal(start.velocity, expected.velocity)
    assert table_of(start.body) == table_of(expected.body)
    assert job.start_file() is None


def test_one_body_where_its_points_are(tmp_path):
    velocity = "velocity = [[0, 0, 0], [0, 0, 1.5]]\nanchors = [{ point = 0 }]"
    start = read(tmp_path, with_body(f'kind = "points"\n{ROD}\n{velocity}')).start()
    assert start.position[:, :, 0].T.tolist() == [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]]
    assert start.velocity[:, :, 0].T.tolist() == [[0.0, 0.0, 0.0], [0.0, 0.0, 1.5]]
    assert start.body.anchors == {0: None}
    across = "velocity = [[0, 0, 0], [0.5, 0, 1.5]]\nanchors = [{ point = 0 }]"
    with pytest.raises(swarm.SceneError, match=r"\[body\]: velocity must agree .* 0\.5 m/s along links\[0\]"):
        read(tmp_path, with_body(f'kind = "points"\n{ROD}\n{across}')).start()
    nearest = read(tmp_path, with_body(f'kind = "points"\n{ROD}\n{across}\nproject = true')).start()
    assert nearest.velocity[:, :, 0].T.tolist() == [[0.0, 0.0, 0.0], [0.0, 0.0, 1.5]]
    still = read(tmp_path, with_body(f'kind = "points"\n{ROD}')).start()
    assert len(still) == 1
    assert not still.velocity.any()


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ('kind = "dumbell"', r"body\.kind must be one of 'dumbbell', .*'dumbell'; did you mean 'dumbbell'"),
        ("length = 0.1", r"body\.kind: expected one of"),
        ('kind = "dumbbell"\nlength = 0.1', r"body\.mass: expected a number, got nothing"),
        ('kind = "dumbbell"\nlength = 0.1\nmass = 1\nedge = 2', r"body\.edge: unknown key, expected 'count', 'speed'"),
        ('kind = "dumbbell"\nlength = 0.1\nmass = 1', r"\[body\]: count: expected a whole number, got nothing"),
        ('kind = "dumbbell"\nlength = 0.1\nmass = 1\ncount = 0', r"body\.count must be 1 or more, got 0"),
        (
            'kind = "dumbbell"\nlength = 0.1\nmass = 1\ncount = 1e3',
            r"body\.count: expected a whole number, got a number",
        ),
        ('kind = "dumbbell"\nlength = -1\nmass = 1\ncount = 1', r"body.length must be above 0, got -1"),
        (
            'kind = "chain"\nn = 2\nlength = 0.1\nmass = 1\ncount = 10_000_000_000_000',
            r"\[body\]: count must fit in mem",
        ),
        (f'kind = "points"\n{ROD}\nspin = 1.0', r"\[body\]: spin: is of copies at random; add count = \.\.\."),
        (f'kind = "points"\n{ROD}\ncount = 2\nvelocity = [[0, 0, 0], [0, 0, 0]]', r"velocity: must go without count"),
        (f'kind = "points"\n{ROD}\nvelocity = [[0, 0, 0]]', r"\[body\]: velocity must have shape \(3, 2, n\)"),
        ('from = "start.csv"', r"body\.from: expected a \.h5 file, a trajectory of bodies, got 'start\.csv'"),
        ('from = "start.h5"\ncount = 2', r"body\.count: unknown key, expected 'from' and 'frame'"),
        ('from = "absent.h5"', r"\[body\]: there is no file .*absent\.h5"),
        ("[particles]\ncount = 1\nspeed = 0.5", r"particles: expected a \[particles\] or a \[body\] table, got both"),
        ("[body]", "cannot read the scene file"),
    ],
)
def test_bad_bodies_name_the_key(tmp_path, keys, message):
    with pytest.raises(swarm.SceneError, match=message):
        read(tmp_path, with_body(keys)).start()


def test_neither_particles_nor_bodies(tmp_path):
    with pytest.raises(swarm.SceneError, match=r"particles: expected a .*, or a \[\[source\]\], got neither"):
        read(tmp_path, GOOD.replace("[particles]\ncount = 10\nspeed = 0.5", ""))
