"""Whatever is given to a public function or class: it works, or a sentence says what was expected."""

import contextlib
import inspect
import itertools
import math
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest

import swarm
from swarm.pages.html import Page
from swarm.pictures.shown_film import Film

SCENE = swarm.Scene([swarm.Sphere(0.5)])
START = swarm.fill(SCENE, 3, speed=1.0, seed=1)
PAIR = [swarm.Sphere(1.0), swarm.Sphere(1.0, center=(1, 0, 0))]
CORNERS, TRIANGLES = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
SQUARES = np.arange(-2, 3) ** 2
ITSELF: list = []
ITSELF.append(ITSELF)


class Unspeakable:
    def __repr__(self):
        raise ValueError("no words")


class Odd:
    def __iter__(self):
        raise RuntimeError("no parts")

    def __float__(self):
        raise RuntimeError("no number")


HOSTILE = [
    None, 5, -1, 0, "x", "", b"x", math.nan, math.inf, 1j, True, [], (), {}, [1], [None], ["a"], {"a": 1},
    np.array(5.0), np.array([]), np.array("x"), np.zeros((2, 2, 2)), np.array([1, None], object), np.ma.masked,
    Decimal("0.5"), Fraction(1, 2), Decimal("nan"), Decimal("sNaN"), swarm.Sphere, SCENE, START, object(), ITSELF,
    range(3), "a" * 3000, "\0", Unspeakable(), Odd(), 10**400, np.datetime64("2020"), [[1, 2], [3]], {1, 2},
    slice(3), Ellipsis, [swarm.Translation((1, 0, 0)), ITSELF],
]  # fmt: skip

CALLS = {
    "Scene": {"surfaces": [swarm.Sphere(0.5)]},
    "fill": {"scene": SCENE, "n": 3, "speed": 1.0},
    "Particles": {"position": [0, 0, 0], "velocity": [1, 0, 0]},
    "Pairs": {},
    "Impact": {},
    **{name: {"dt": 1e-3, "penalty": 1e3} for name in ("Penalty", "AugmentedLagrangian", "Verlet")},
    "Sphere": {"radius": 0.5},
    "Box": {"half_widths": (1, 1, 1)},
    "Plane": {"normal": (0, 0, 1), "offset": 0.0},
    "Quadric": {"matrix": np.eye(3), "vector": (0, 0, 0), "constant": -1.0},
    "Formula": {"formula": "x**2 + y**2 + z**2 - 1"},
    "Spheres": {"centers": [(0, 0, 0)], "radii": [0.1]},
    "Union": {"parts": PAIR},
    "Intersection": {"parts": PAIR},
    "Mesh": {"vertices": CORNERS, "triangles": TRIANGLES},
    "Polygon": {"vertices": [(0, 0), (1, 0), (0, 1)]},
    "Sampled": {
        "values": np.add.outer(np.add.outer(SQUARES, SQUARES), SQUARES) - 2.0, "spacing": 1.0, "origin": (0, 0, 0)
    },
    "Translation": {"velocity": (1, 0, 0)},
    "Oscillation": {"amplitude": (1, 0, 0), "frequency": 1.0},
    "Rotation": {"axis": (0, 0, 1), "rate": 1.0},
    "Path": {"times": [0, 1], "positions": [(0, 0, 0), (1, 0, 0)]},
    "Source": {"where": swarm.Sphere(0.5), "rate": 10.0, "speed": 1.0},
    "Counter": {"surface": swarm.Sphere(0.3)},
    "Opening": {"surface": swarm.Sphere(0.3)},
    "Body": {"points": [(0, 0, 0), (1, 0, 0)], "mass": [1, 1], "links": [(0, 1)]},
    "place": {"scene": SCENE, "body": swarm.dumbbell(0.1, 1.0), "n": 2},
    "CercignaniLampis": {"temperature": 1.0, "normal": 0.5, "tangential": 0.5},
    **{name: {"path": "none"} for name in ("load", "load_impacts", "report", "sweep")},
    "from_mesh": {"path": "none.stl", "spacing": 0.1},
    "contact_history": {
        "scene": SCENE, "position": (0.5, 0, 0), "velocity": (1, 0, 0), "mass": 1.0,
        "method": swarm.AugmentedLagrangian(1e-3, 1e3),
    },
    "simulate": {
        "scene": SCENE, "particles": START, "method": swarm.Impact(), "until": 1.0, "compile": "never", "threads": 1,
    },
}  # fmt: skip
# A file of such a name would be written; a bar, a viewer and a cluster are not begun.
_LEFT_OUT = {"trajectory": ("x",), "recording": ("x",), "impacts": ("x",), "live": HOSTILE, "cluster": HOSTILE}


@pytest.mark.parametrize("name", CALLS)
def test_it_works_or_says_why_not(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    called, given = getattr(swarm, name), CALLS[name]
    arguments = [one for one in inspect.signature(called).parameters if not one.startswith("_")]
    for argument, value in itertools.product(arguments, HOSTILE):
        left_out = _LEFT_OUT.get(argument, ())
        if left_out is HOSTILE or (isinstance(value, str) and value in left_out):
            continue
        with contextlib.suppress(swarm.SwarmError):  # a sentence; what else is raised fails
            called(**{**given, argument: value})


# --- Sentences -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("value", [None, 5, np.array(5.0), Odd()])
def test_surfaces_that_are_no_list(value):
    with pytest.raises(
        swarm.SceneError, match=r"^surfaces must be a list of surfaces such as swarm\.Sphere\(radius=0\.5"
    ):
        swarm.Scene(value)


@pytest.mark.parametrize("given", [swarm.Sphere, [swarm.Sphere]])
def test_forgotten_brackets_are_reported(given):
    with pytest.raises(swarm.SceneError, match=r"to make one of the class, call it: Sphere\(\.\.\.\)$"):
        swarm.Scene(given)


@pytest.mark.parametrize(
    ("given", "name"),
    [
        (lambda: swarm.simulate(SCENE, START, swarm.Impact, until=1.0), "Impact"),
        (lambda: swarm.Scene([swarm.Sphere(0.5)], pairs=swarm.Pairs), "Pairs"),
        (lambda: swarm.Sphere(0.5, laws=[swarm.Lambert]), "Lambert"),
        (lambda: swarm.simulate(SCENE, START, until=1.0, sources=[swarm.Source]), "Source"),
    ],
)
def test_forgotten_brackets_of_other_arguments(given, name):
    with pytest.raises(swarm.SceneError, match=rf"to make one of the class, call it: {name}\(\.\.\.\)$"):
        given()


def test_numbers_of_the_standard_library_are_numbers():
    exact = swarm.Scene([swarm.Sphere(Decimal("0.5"))], gravity=(0, 0, Fraction(-1, 2)))
    assert exact == swarm.Scene([swarm.Sphere(0.5)], gravity=(0, 0, -0.5))
    start = swarm.fill(exact, 3, speed=Decimal("0.5"), seed=1)
    assert (start.velocity == swarm.fill(exact, 3, speed=0.5, seed=1).velocity).all()
    hot = swarm.fill(exact, 3, temperature=Fraction(1, 4), seed=1)
    assert (hot.velocity == swarm.fill(exact, 3, temperature=0.25, seed=1).velocity).all()
    packed = [swarm.pack(SCENE, 3, 0.05, speed=speed, seed=1).velocity for speed in (Decimal("0.5"), 0.5)]
    assert (packed[0] == packed[1]).all()


def test_a_motion_within_itself_is_reported():
    both = [swarm.Translation((1, 0, 0))]
    both.append(both)
    for motion in (ITSELF, both):
        with pytest.raises(swarm.SceneError, match="must not contain itself"):
            swarm.Sphere(0.1, side="outside", motion=motion)


def test_names_that_are_too_long_for_the_system(tmp_path):
    name = str(tmp_path / ("a" * 3000))
    for argument in ("trajectory", "recording", "impacts"):
        with pytest.raises(swarm.SceneError, match=rf"{argument} must be the path of a file, got one of .* too long"):
            swarm.simulate(**CALLS["simulate"], **{argument: name})
    for read in (swarm.load, swarm.load_impacts, swarm.report, swarm.sweep):
        with pytest.raises(swarm.SceneError, match=r"path must be the path of a file, got one of .* too long"):
            read(name)


@pytest.mark.parametrize(
    "read",
    [
        swarm.Mesh, lambda name: swarm.from_mesh(name, 0.1), swarm.Particles.from_csv,
        lambda name: swarm.Sampled(name, 0.1, (0.0, 0.0, 0.0)),
    ],
)  # fmt: skip
@pytest.mark.parametrize("suffix", [".stl", ".csv", ".npy", ""])
def test_names_of_inputs_that_are_too_long_are_cut(read, suffix):
    with pytest.raises(swarm.SceneError) as failed:
        read("a" * 3000 + suffix)
    assert len(str(failed.value)) < 400


def test_every_kth_particle_by_an_array_of_one_number(tmp_path):
    swarm.simulate(**CALLS["simulate"], impacts=tmp_path / "log.h5", impact_particles=np.array(2))
    with swarm.load_impacts(tmp_path / "log.h5") as log:
        assert log.kept == 2


# --- Booleans --------------------------------------------------------------------------------------------

NO_BOOLEAN = ["no", "false", "", math.nan, 0, 1, 1.0, None, [], {}, object(), np.array(True), np.array([True])]
RESULT = swarm.simulate(**CALLS["simulate"])
FLAGS = {
    "Mesh.open": lambda value: swarm.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [[0, 1, 2]], open=value),
    "AugmentedLagrangian.adaptive": lambda value: swarm.AugmentedLagrangian(1e-3, 1e3, adaptive=value),
    "Bodies.project": lambda value: swarm.Bodies(
        swarm.dumbbell(1.0, 1.0),
        np.array([[[0.0], [1.0]], [[0.0]] * 2, [[0.0]] * 2]),
        np.zeros((3, 2, 1)),
        project=value,
    ),
    "Opening.between": lambda value: swarm.Opening(swarm.Sphere(0.1), between=value),
    "Source.volume": lambda value: swarm.Source(swarm.Sphere(0.5), rate=1.0, speed=1.0, volume=value),
    "Source.even": lambda value: swarm.Source(swarm.Sphere(0.5), rate=1.0, speed=1.0, even=value),
    "fill.exact": lambda value: swarm.fill(SCENE, 3, temperature=1.0, exact=value),
    **{
        f"simulate.{name}": lambda value, name=name: swarm.simulate(**CALLS["simulate"], **{name: value})
        for name in ("member_impacts", "live", "progress", "overwrite", "resume")
    },
    **{
        f"sweep.{name}": lambda value, name=name: swarm.sweep("none.toml", **{name: value})
        for name in ("resume", "overwrite", "progress")
    },
    "report.overwrite": lambda value: swarm.report("none.h5", overwrite=value),
    "Result.report": lambda value: RESULT.report(overwrite=value),
    "Page.save": lambda value: Page("a", "b").save("none.html", overwrite=value),
    "Film.save": lambda value: Film(b"", ".gif", 1, 1.0, (64, 64), "a").save("none.gif", overwrite=value),
}
OF_TRAJECTORIES = {
    "animate.overwrite": lambda run, value: run.animate("none.gif", overwrite=value),
    "export.overwrite": lambda run, value: run.export("none.csv", overwrite=value),
    "export.surfaces": lambda run, value: run.export("none.csv", surfaces=value),
    "report.overwrite": lambda run, value: run.report(overwrite=value),
}


@pytest.mark.parametrize("name", FLAGS)
def test_a_boolean_is_true_or_false(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for value in NO_BOOLEAN:
        if name == "simulate.live" and isinstance(value, str):
            continue  # the address of a viewer
        with pytest.raises(swarm.SceneError, match=r"^\w+ must be true or false, got "):
            FLAGS[name](value)
    assert list(tmp_path.iterdir()) == []


def test_booleans_of_a_trajectory(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    swarm.simulate(**CALLS["simulate"], trajectory="run.h5")
    with swarm.load("run.h5") as trajectory:
        for (name, call), value in itertools.product(OF_TRAJECTORIES.items(), NO_BOOLEAN):
            with pytest.raises(swarm.SceneError, match=rf"^{name.split('.')[1]} must be true or false, got "):
                call(trajectory, value)
    assert [path.name for path in tmp_path.iterdir()] == ["run.h5"]


def test_every_boolean_is_among_these():
    """Of public functions, and of the methods of public classes that write."""
    known = {name.partition(".")[0] for name in FLAGS} | {"Leave", "ContactHistory"}
    for name in swarm.__all__:
        one = getattr(swarm, name)
        if callable(one) and not (isinstance(one, type) and issubclass(one, Exception)):
            parameters = inspect.signature(one).parameters.values()
            flags = [each.name for each in parameters if isinstance(each.default, bool)]
            assert not flags or name in known, (name, flags)
            if name in known & {"simulate", "sweep", "Source", "report", "fill"}:
                assert {f"{name}.{flag}" for flag in flags} <= set(FLAGS)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("record_color", "red", "record_color must be one of 'speed' and 'energy-error', got 'red'"),
        ("record_color", None, "record_color must be one of"),
        ("record_particles", "x", "record_particles must be a whole number, 1 or more, got 'x'"),
        ("record_particles", 0, "record_particles must be 1 or more, got 0"),
        ("record_megabytes", -1.0, "record_megabytes must be above 0, got -1"),
        ("record_megabytes", math.nan, "record_megabytes must be"),
        ("scene_text", 5, "scene_text must be a text, or None, got 5"),
    ],
)
def test_what_is_not_used_is_checked_too(name, value, message):
    with pytest.raises(swarm.SceneError, match=message):
        swarm.simulate(**CALLS["simulate"], **{name: value})
