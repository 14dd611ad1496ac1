"""The run of a scene file from Python: `swarm.run`, a package that may be called."""

import importlib
import inspect

import numpy as np
import pytest
from test_scene_file import GOOD

import swarm
from swarm.authoring.file_run import run
from swarm.commands.run import run as command

WITHOUT_METHOD = GOOD.replace('[method]\nkind = "impact"\n', "")


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(WITHOUT_METHOD)
    return path


def test_a_file_without_a_method_is_a_run_with_impact(scene):
    """And no file is written that nothing names."""
    result = swarm.run(scene, until=0.5)
    assert result.method == swarm.Impact()
    assert result.observables["time"].tolist() == [0.0, 0.5]
    assert [path.name for path in scene.parent.iterdir()] == ["scene.toml"]


def test_it_is_the_run_of_simulate(scene):
    seen = []
    result = swarm.run(scene, scene.with_suffix(".h5"), progress=lambda frame: seen.append(frame.time))
    cavity = swarm.Scene([swarm.Sphere(0.5)])
    other = swarm.simulate(cavity, swarm.fill(cavity, 10, speed=0.5), swarm.Impact(), until=1.0, every=0.5)
    np.testing.assert_array_equal(result.particles.position, other.particles.position)
    assert seen == [0.0, 0.5, 1.0]
    with swarm.load(scene.with_suffix(".h5")) as trajectory:
        assert trajectory.scene_text == WITHOUT_METHOD
        np.testing.assert_array_equal(trajectory.frame(-1).position, result.particles.position)


@pytest.mark.parametrize(
    ("more", "given", "message"),
    [
        ("", {"untill": 2.0}, "untill: unknown option, expected .* did you mean 'until'"),
        ("", {"trajectory": "a.h5"}, "trajectory: unknown option, .*; the trajectory is the argument output"),
        ("", {"until": -1.0}, "until must be above 0, got -1"),
        ("", {"output": "scene.toml", "overwrite": True}, "trajectory: .*scene.toml is also the scene file"),
        ("", {"output": "old.h5"}, "trajectory: .*old.h5 exists; choose another name, or"),
        ('trajectory = "old.h5"', {"overwrite": True}, "by naming it in Python: output='.*old.h5', overwrite=True"),
        ('trajectory = "../new.h5"', {}, "run.trajectory: expected a file in the folder of the scene file"),
    ],
)
def test_bad_input_touches_no_file(scene, monkeypatch, more, given, message):
    monkeypatch.chdir(scene.parent)
    scene.write_text(GOOD + more)
    (scene.parent / "old.h5").write_text("mine")
    with pytest.raises(swarm.SceneError, match=message):
        swarm.run(scene, **given)
    assert {path.name: path.read_text() for path in scene.parent.iterdir()} == {
        "scene.toml": GOOD + more,
        "old.h5": "mine",
    }


def test_the_package_of_runs_is_called():
    """In whatever order modules are imported, and with the arguments of the function."""
    assert swarm.run is importlib.import_module("swarm.run")
    names = [list(inspect.signature(one).parameters) for one in (swarm.run, run)]
    assert names[0] == names[1]
    assert {"scene_file", "output", "plugins"} <= set(inspect.signature(command).parameters)
    assert all(f"`{name}`" in swarm.run.__doc__ for name in names[1])
