"""Runs and scenes in words: of every surface, law, motion and method, and never the text of Python."""

import dataclasses
import re
import types

import numpy as np
import pytest
from conftest import METHODS, WALLS, row, surface_of

import swarm
from swarm.bodies.elastic import block
from swarm.words import facts, nouns
from swarm.words import titles as words

SOFT = swarm.elastic(block((0.1, 0.1, 0.1), (2, 2, 2)), young=1e4, poisson=0.3, density=100.0)
DOWN = (0.0, 0.0, -9.81)
LAWS = {
    "plain": {},
    "lossy": {"restitution": 0.5, "friction": 0.3},
    "warm": {"temperature": 4.1e-21, "accommodation": 0.5},
    "diffuse": {"laws": [swarm.Lambert(), swarm.Absorb(0.1)]},
    "cold": {"laws": [swarm.CercignaniLampis(1.0, 0.5, 0.5)]},
    "barred": {"laws": [swarm.Absorb(barrier=1e-26, loss=1e-4)]},
    "sticky": {"laws": [swarm.Sticky(1e-6)]},
    "moved": {"motion": swarm.Oscillation((0.0, 0.0, 1e-3), 20.0)},
    "flown": {"motion": swarm.Translation((1e-3, 0.0, 0.0))},
    "led": {"motion": swarm.Path((0.0, 1.0), ((0, 0, 0), (0, 0, 1)))},
    "pushed": {"mass": 1e-3},
    "guided": {"mass": 2.0, "motion": swarm.Guide((0.0, 0.0, 1.0), stiffness=40.0)},
    "open": {"openings": [swarm.Sphere(1.0, (0, 0, 1)), swarm.Opening(swarm.Sphere(1.0), times=[(1.0, np.inf)])]},
    "passing": {"present": [(0.0, 1.0), (2.0, np.inf)]},
}
PYTHON = re.compile(r"swarm\.|\w\(\w+=|[\[\]{}<>]|None|True|False|array|\bnan\b|  |e[-+]\d\d|\d_\w")


def content(scene, method=None, count=1000, body=None, radius=None, until=1.0, **seen):
    """The part of a run that a title needs."""
    frame = swarm.Particles(np.zeros((3, 2)), np.ones((3, 2)) * 1e-3, 1e-4, radius=radius)
    seen = {"time": np.array([0.0, until]), **{name: np.asarray(values) for name, values in seen.items()}}
    given = {"scene": scene, "method": method or swarm.Impact(), "count": count, "body": body, "seen": seen}
    return types.SimpleNamespace(name="", frames={"start": frame, "end": frame}, counters=(), births=None, **given)


def every_text(run):
    return [words.of_scene(run.scene), words.title(run), *(text for one in facts.of_setting(run) for text in one[:2])]


@pytest.mark.parametrize("law", LAWS)
def test_every_surface_is_reported(law):
    """A sphere around it makes it a scene."""
    for name in WALLS:
        with row(name):
            bare = surface_of(name)
            given = {f.name: getattr(bare, f.name) for f in dataclasses.fields(bare) if f.name[0] != "_"}
            surface = type(bare)(**given | LAWS[law])
            scene = swarm.Scene([surface, swarm.Sphere(50.0)], DOWN)
            run = content(scene)
            formula = f"{getattr(surface, 'formula', '')} = 0".replace("**", "^")
            for text in every_text(run):
                assert not PYTHON.search(text.replace(formula, "")), text
            assert len(words.title(run)) < words.LONGEST
            if law != "plain":
                statement = next(one.text for one in facts.of_setting(run) if one.label.startswith("surface 0"))
                assert len(statement) > len(nouns.in_full(bare, scene))


@pytest.mark.parametrize("name", METHODS)
def test_every_method_is_reported(name):
    run = content(swarm.Scene([swarm.Sphere(1.0)]), METHODS[name])
    assert words.title(run).startswith("1000 particles in a sphere: ")
    assert not any(PYTHON.search(text) for text in every_text(run))


PLACES = np.random.default_rng(1).uniform(-4.0, 4.0, (78, 3))
VESSEL = swarm.Ellipsoid((0.5, 0.5, 0.7))
BALL = swarm.Sphere(0.2, (0.0, 0.0, -0.1), side="outside")
TITLES = {
    "10 000 particles in an ellipsoid with a ball in it, under gravity: Impact, 1 s": content(
        swarm.Scene([VESSEL, BALL], DOWN), count=10_000
    ),
    "900 balls of 5 mm radius in a box: Penalty, steps of 50 µs, 1 s": content(
        swarm.Scene([swarm.Box((0.1, 0.1, 0.1))]), swarm.Penalty(5e-5, 1e5), 900, radius=0.005
    ),
    "1000 balls of 40 mm radius in a cell that repeats: Impact, 1 s": content(
        swarm.Scene([], period=(1.0, 1.0, 1.0)), radius=0.04
    ),
    "1000 particles in a billiard of two dimensions: a stadium: Impact, 1 s": content(
        swarm.Scene([swarm.Stadium(0.5, 1.0)], plane="z")
    ),
    "200 tetrahedra in a sphere: Impact, 20 ms": content(
        swarm.Scene([swarm.Sphere(0.5)]), count=800, body=swarm.tetrahedron(0.1, 0.2), until=0.02
    ),
    "1000 particles in a sphere with 78 balls in it: Impact, 1 s": content(
        swarm.Scene([swarm.Sphere(9.0), swarm.Spheres(PLACES, np.full(78, 0.1))])
    ),
    "1000 particles in a cylinder that turns, lossy walls: Impact, 1 s": content(
        swarm.Scene([swarm.Cylinder(1.0, length=1.0, friction=0.5, motion=swarm.Rotation((0, 0, 1), 3.0, (0, 0, 0)))])
    ),
    "1000 particles from sources in a sphere, warm and absorbing walls: Impact, 1 s": content(
        swarm.Scene([swarm.Sphere(1.0, laws=[swarm.Absorb(0.1), swarm.CercignaniLampis(1.0, 1.0, 1.0)])]),
        born=[[0], [1]],
    ),
    "1000 particles between 13 planes: Impact, 1 s": content(
        swarm.Scene([swarm.Plane((np.cos(a), np.sin(a), 0.1), 0.5) for a in np.arange(13.0)])
    ),
}  # fmt: skip


@pytest.mark.parametrize("title", TITLES)
def test_a_title_says_what_runs(title):
    assert words.title(TITLES[title]) == title


def test_a_long_title_is_shortened_with_grace():
    """Laws, then steps, then how walls move are left out; at the end the number of surfaces is said."""
    kinds = (BALL, swarm.Torus(0.3, 0.05, side="outside"), swarm.Box((0.1, 0.1, 0.1), side="outside"),
             swarm.Capsule(0.1, 0.2, side="outside"), swarm.Ellipsoid((0.1, 0.2, 0.3), side="outside"))  # fmt: skip
    for n in range(len(kinds) + 1):
        shaking = swarm.Sphere(5.0, restitution=0.9, motion=swarm.Oscillation((0.0, 0.0, 0.1), 1.0))
        run = content(swarm.Scene([shaking, *kinds[:n]], DOWN), swarm.AugmentedLagrangian(1e-3, 1e4))
        title = words.title(run)
        assert len(title) < words.LONGEST
        assert title.startswith("1000 particles in a sphere")
        assert title.endswith("1 s")
    assert "with five solids in it" in title


@pytest.mark.parametrize(
    ("body", "noun"),
    [
        (swarm.dumbbell(0.1, 1.0), "dumbbell"),
        (swarm.tetrahedron(0.1, 1.0), "tetrahedron"),
        (swarm.chain(5, 0.1, 1.0), "chain of 5 points"),
        (SOFT, "elastic body of 27 points"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_a_body_has_a_name(body, noun):
    assert words.noun_of_body(body) == noun


def test_labels_are_unique_and_readable():
    """Also those of the parts of a union, and a floor is one only where something falls."""
    vessel = swarm.Union([swarm.Sphere(0.5), swarm.Cylinder(0.2, length=2.0)])
    floor = swarm.Plane((0.0, 0.0, -1.0), 0.9)
    scene = swarm.Scene([vessel, floor, BALL, swarm.Sphere(0.1, (0.0, 0.0, 0.3), side="outside")], DOWN)
    found = nouns.labels(scene)
    assert list(found.values()) == ["vessel", "floor", "ball 1", "ball 2", "sphere", "cylinder"]
    assert nouns.labels(swarm.Scene([swarm.Sphere(1.0), floor]))[1, ()] == "plane"


def test_the_options_of_a_method_that_were_chosen_are_reported():
    """Two runs that differ by one of them are told apart; what was left out has no word."""
    soft = {"dt": 1e-3, "penalty": 1e4}
    for chosen, words_of_it in [
        (swarm.Penalty(**soft, friction_tolerance=1e-3), ", friction tolerance 0.001"),
        (swarm.Penalty(**soft, exponent=1.5, gradient="mean-value"), ", gradient mean-value"),
        (
            swarm.AugmentedLagrangian(**soft, adaptive=True, contact_start="centred"),
            ", adaptive, contact start centred",
        ),
        (swarm.AugmentedLagrangian(**soft, on_unconverged="count"), ", on unconverged count"),
    ]:
        with row(str(chosen)):
            assert facts.of_method(chosen).text.endswith(words_of_it)
    assert facts.of_method(swarm.Penalty(**soft)).text == "Penalty, steps of 1 ms, penalty 10 000, exponent 1"
