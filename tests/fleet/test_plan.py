"""The runs of a sweep file, and the errors about files that are no sweeps."""

import tomllib

import pytest
from scene_texts import in_a_sphere

import swarm
from swarm import scene_file
from swarm.fleet.plan import read

BASE = in_a_sphere("until = 1.0", before="gravity = [0.0, 0.0, -9.81]")


@pytest.fixture
def plan_of(tmp_path):
    def make(sweep, base=BASE):
        path = tmp_path / "sweep.toml"
        path.write_text(f"{base}\n[sweep]\n{sweep}\n")
        return read(path)

    return make


def parameters(plan):
    return [tuple(variant.parameters.values()) for variant in plan.variants]


@pytest.mark.parametrize(
    ("sweep", "expected"),
    [
        ('"particles.seed" = {range = 3}', [(0,), (1,), (2,)]),
        ('"particles.seed" = {range = [5, 8]}', [(5,), (6,), (7,)]),
        ('"particles.seed" = {range = [8, 5, -2]}', [(8,), (6,)]),
        ('"particles.speed" = {linspace = [1.0, 2.0, 3]}', [(1.0,), (1.5,), (2.0,)]),
        ('"particles.speed" = {geomspace = [1.0, 100.0, 3]}', [(1.0,), (10.0,), (100.0,)]),
        # Of a product the last key changes first, as written; so it does with keys that TOML makes tables of.
        ('"particles.seed" = [1, 2]\n"run.until" = [1.0, 2.0]', [(1, 1.0), (1, 2.0), (2, 1.0), (2, 2.0)]),
        ("particles.seed = [1, 2]\nrun.until = [1.0, 2.0]", [(1, 1.0), (1, 2.0), (2, 1.0), (2, 2.0)]),
        ('combine = "zip"\n"particles.seed" = [1, 2]\n"run.until" = [1.0, 2.0]', [(1, 1.0), (2, 2.0)]),
    ],
)
def test_the_runs_are_in_the_order_of_the_file(plan_of, sweep, expected):
    assert parameters(plan_of(sweep)) == expected


def test_a_run_is_an_ordinary_scene_file(plan_of, tmp_path):
    plan = plan_of(
        '"surface.0.restitution" = [0.5]\n"gravity.2" = [-1.62]\n"particles.seed" = [7]\n'
        '"method" = [{kind = "impact", sliding_tolerance = 1e-6}]\n"surface.0.motion" = [{kind = "translation", '
        "velocity = [0.0, 0.1, 0.0]}]"
    )
    (tmp_path / "one.toml").write_text(plan.text(plan.variants[0]))
    job = scene_file.read(tmp_path / "one.toml")
    assert job.scene.surfaces[0].restitution == 0.5
    assert tuple(job.scene.gravity) == (0.0, 0.0, -1.62)
    assert job.method.sliding_tolerance == 1e-6
    assert job.source.seed == 7
    # The file itself is not changed.
    assert "restitution" not in plan.document["surface"][0]


def test_numbers_survive_to_the_last_bit(plan_of):
    value = 0.1 + 0.2
    plan = plan_of(f'"particles.speed" = [{value!r}]')
    assert tomllib.loads(plan.text(plan.variants[0]))["particles"]["speed"] == value


def test_lists_can_become_longer(plan_of):
    """A run keeps its files: they are named by what it computes, not by how or by its place."""
    few = plan_of('"particles.seed" = [3, 4]')
    many = plan_of('"particles.seed" = {range = 6}', BASE + "threads = 2\ncheckpoint = 5.0\n")
    assert [variant.stem for variant in few.variants] == [many.variants[k].stem for k in (3, 4)]
    assert plan_of('"particles.seed" = [3]', BASE + "every = 0.5\n").variants[0].stem != few.variants[0].stem


def test_a_run_of_another_start_file_is_another_run(plan_of, tmp_path):
    base = BASE.replace("count = 10\nspeed = 1.0", 'from = "start.csv"')
    stems = set()
    for x in (0.0, 0.1):
        (tmp_path / "start.csv").write_text(f"x,y,z,vx,vy,vz\n{x},0,0,1,0,0\n")
        stems.add(plan_of('"run.until" = [1.0]', base).variants[0].stem)
    assert len(stems) == 2


def test_runs_that_differ_in_numbers_are_of_one_kind(plan_of):
    plan = plan_of('"particles.seed" = [1, 2]\n"surface.0" = [{kind = "sphere", radius = 1.0}, {kind = "slab", '
                   "normal = [1.0, 0.0, 0.0], half_width = 1.0}]")  # fmt: skip
    kinds = [variant.kind for variant in plan.variants]
    assert kinds[0] == kinds[2] != kinds[1] == kinds[3]


@pytest.mark.parametrize(
    ("sweep", "sentences"),
    [
        ('"surface.0.restitutoin" = [0.5]', ['sweep."surface.0.restitutoin" = 0.5', "did you mean 'restitution'"]),
        ("surface.0.restitutoin = [0.5]", ['sweep."surface.0.restitutoin" = 0.5', "did you mean 'restitution'"]),
        ('"partcles.seed" = [1]', ['sweep."partcles.seed" = 1', "did you mean 'particles'"]),
        ('"particles.speed" = [1.0, -1.0]', ['sweep."particles.speed" = -1.0: particles.speed must be 0 or more']),
        ('"method.contact_stp" = [0.1]', ["did you mean 'contact_step'"]),
        ('"surface.3.restitution" = [0.5]', ['"surface.3.restitution"', "has one entry, number 0, got '3'"]),
        ('"gravity.x" = [0.5]', ['"gravity.x"', "entries 0 to 2, got 'x'"]),
        ('"particles.speed.x" = [0.5]', ["particles.speed is 1.0, which has no 'x'"]),
        ('"surface.0.restitution" = [0.5, 1.5]', ['"surface.0.restitution" = 1.5', "from 0 to 1"]),
        ('"surface.0.restitution" = [0.5, "x"]', ['"surface.0.restitution" = "x"', "expected a number"]),
        ('"run.until" = [-1.0]', ['"run.until" = -1.0', "must be above 0, got -1"]),
        ('"particles.temperature" = [1.0]\n"surface.0.radius" = [-1.0]', ['"surface.0.radius" = -1.0']),
        (
            'combine = "zip"\n"particles.seed" = [1, 2]\n"run.until" = [1.0, 2.0, 3.0]',
            ['2 values of "particles.seed" and 3 of "run.until"'],
        ),
        ('combine = "prodct"\n"particles.seed" = [1]', ["sweep.combine", "did you mean 'product'"]),
        ('"particles.seed" = 3', ['"particles.seed": expected a list of values', "got 3"]),
        ('"particles.seed" = []', ["at least one value"]),
        ('"particles.seed" = {}', ["an empty table"]),
        ("", ["at least one list"]),
        ('"particles.seed" = {range = 0}', ["at least one value"]),
        ('"particles.seed" = {range = 1.5}', ["0 to n - 1", "got 1.5"]),
        ('"particles.seed" = {range = [0, 5, 0]}', ["got [0, 5, 0]"]),
        ('"particles.seed" = {range = 100000000}', ["at most 1000000"]),
        ('"particles.seed" = {range = 10000}\n"particles.speed" = {linspace = [1, 2, 1000]}', ["10000 x 1000"]),
        ('"particles.speed" = {linspace = [1.0, 2.0]}', ["expected [first, last, how many]"]),
        ('"particles.speed" = {linspace = [1.0, inf, 3]}', ["linspace[1] must be a finite number"]),
        ('"particles.speed" = {geomspace = [0.0, 1.0, 3]}', ["one sign"]),
        ('"particles.speed" = [1.0, 1.0]', ["are the same"]),
        ('"run.threads" = [1, 2]', ["are the same", "makes no difference"]),
        ('"run.trajectory" = ["a.h5"]', ["run.trajectory", "remove the key"]),
        ('"run.recording" = ["a.rrd"]', ["run.recording", "swarm record"]),
        ('"method" = [{kind = "impact"}]\n"method.contact_step" = [0.1]', ['lies within "method"']),
        ('"particles" = [{from = "none.csv"}]', ["particles.from: there is no file"]),
    ],
)
def test_bad_input_is_a_sentence(plan_of, sweep, sentences):
    with pytest.raises(swarm.SceneError) as caught:
        plan_of(sweep)
    for sentence in ("sweep.toml: ", *sentences):
        assert sentence in str(caught.value)


def test_each_kind_of_file_says_what_it_is_for(tmp_path):
    path = tmp_path / "file.toml"
    path.write_text(BASE)
    with pytest.raises(swarm.SceneError, match=r"\[sweep\].*swarm run"):
        read(path)
    path.write_text(BASE + '[sweep]\n"particles.seed" = [1]\n')
    with pytest.raises(swarm.SceneError, match="swarm sweep"):
        scene_file.read(path)
    path.write_text(BASE + "sweep = 3\n")  # a key of [run]
    with pytest.raises(swarm.SceneError, match=r"run\.sweep"):
        scene_file.read(path)
    path.write_text("sweep = 3\n" + BASE)
    with pytest.raises(swarm.SceneError, match=r"expected a \[sweep\] table, got 3"):
        read(path)
