"""A call with wrong arguments says which there are, for every public name that is called."""

import inspect
import pickle

import pytest

import swarm
from swarm.common.signature import explain_calls


def arguments(name):
    return list(inspect.signature(getattr(swarm, name)).parameters.values())


# `swarm.run` is a package that is called and names its options itself; WallLaw has no fields; errors take one text.
CALLED = [
    name
    for name in swarm.__all__
    if callable(getattr(swarm, name)) and name not in ("run", "WallLaw") and not name.endswith("Error")
]


@pytest.mark.parametrize("name", CALLED)
def test_a_misspelt_argument_names_the_nearest(name):
    last = next(one for one in reversed(arguments(name)) if not one.name.startswith("_"))
    if last.kind == last.VAR_KEYWORD:  # arguments of every surface: the class checks them
        sentence = rf"{name}\(\) missing \d required positional argument.*\. Its arguments: "
    else:
        wrong = f"got an unexpected keyword argument '{last.name}x'; did you mean '{last.name}'"
        sentence = rf"{name}\(\) {wrong}\? Its arguments: "
    with pytest.raises(TypeError, match=f"^{sentence}"):
        getattr(swarm, name)(**{f"{last.name}x": 1})


@pytest.mark.parametrize(("kind", "method"), [(swarm.Trajectory, "export"), (swarm.Result, "plot")])
def test_a_misspelt_argument_of_a_method_names_the_nearest(kind, method):
    parameters = [one.name for one in list(inspect.signature(getattr(kind, method)).parameters.values())[1:]]
    last = parameters[-1]
    sentence = rf"^{kind.__name__}\.{method}\(\) .*; did you mean '{last}'\? Its arguments: {', '.join(parameters)}$"
    with pytest.raises(TypeError, match=sentence):
        getattr(kind, method)(None, **{f"{last}x": 1})


def test_an_error_within_a_call_stays_as_it_is():
    def inner(radius):
        return radius

    def outer(radius):
        return inner(radios=radius)

    with pytest.raises(TypeError, match=r"inner\(\) got an unexpected keyword argument 'radios'(\. Did you.*)?$"):
        explain_calls(outer)(1.0)


def test_a_public_function_is_pickled_by_its_name():
    assert pickle.loads(pickle.dumps(swarm.simulate)) is swarm.simulate


@pytest.mark.parametrize("name", ["Sphere", "Union", "Mesh", "Boxes", "OwnSurface"])
def test_help_says_where_the_arguments_of_every_surface_are(name):
    described = getattr(swarm, name).__doc__
    assert "those of every surface, see\nhelp(swarm.surfaces.surface.Surface)." in described
    assert "accommodation: in [0, 1]" in swarm.surfaces.surface.Surface.__doc__
    assert max(map(len, swarm.surfaces.surface.Surface.__doc__.splitlines())) <= 76


def test_paragraphs_of_help_are_as_wide_as_a_terminal():
    """All but examples and formulas, which are indented."""
    for name in CALLED:
        lines = (getattr(swarm, name).__doc__ or "").partition(">>>")[0].splitlines()
        assert [line for line in lines if len(line) > 76 and not line.startswith("    ")] == [], name
    columns = swarm.ImpactLog.table.__doc__
    assert "act there: `time` is the end of the step" in " ".join(columns.split())
    assert "\n    its row where it ends, as laws of walls act there: `time` is the end\n" in columns


def test_an_observable_that_a_run_has_not_says_which_there_are(tmp_path):
    scene = swarm.Scene([swarm.Sphere(0.5)])
    frames = []
    start = swarm.fill(scene, 2, speed=1.0, seed=1)
    path = tmp_path / "run.h5"
    run = swarm.simulate(scene, start, swarm.Impact(), until=1.0, trajectory=path, progress=frames.append)
    with swarm.load(path) as trajectory:
        for seen in (run.observables, trajectory.observables, frames[-1].observables, run.frames[0].observables):
            with pytest.raises(KeyError, match=r"no observable 'impact'; did you mean 'impacts'\? It has time, "):
                seen["impact"]
            with pytest.raises(KeyError, match=r"no observable 'pressure', .*; of points it is .*\. It has time, "):
                seen["pressure"]
            assert "pressure" not in seen
            assert seen.get("pressure") is None
