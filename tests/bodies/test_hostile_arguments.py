"""Whatever is given to what makes bodies: it works, or says so in a sentence, at once."""

import itertools
import math
import warnings

import numpy as np
import pytest

import swarm
from swarm.bodies.elastic import block

SQUARE = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 1.0)]
SCENE = swarm.Scene([swarm.Sphere(5.0)])
ROD = swarm.dumbbell(1.0, 1.0)
FIELD = swarm.Spheres([(0.0, 0.0, 0.0), (3.0, 0.0, 0.0)], 0.5)
CUBE = list(itertools.product((0.0, 1.0), repeat=3))
SAMPLES = sum(axis**2 for axis in np.meshgrid(*[np.linspace(-1.0, 1.0, 9)] * 3)) - 0.5
NODES, ELEMENTS = block((1.0, 1.0, 1.0), (1, 1, 1))


class Odd:
    """An object of another kind than asked for, whose parts cannot be read either."""

    def __len__(self):
        return -1

    def __iter__(self):
        yield self
        raise TypeError("odd")

    def __getitem__(self, key):
        raise KeyError(key)

    def __repr__(self):
        return "odd"


class Unspeakable:
    def __repr__(self):
        raise RuntimeError("no words")


ITSELF = []
ITSELF.append(ITSELF)

HOSTILE = {
    "None": None,
    "5": 5,
    "-1": -1,
    "0": 0,
    "True": True,
    "0.5": 0.5,
    "nan": math.nan,
    "inf": math.inf,
    "1e300": 1e300,
    "1e-300": 1e-300,
    "10**400": 10**400,
    "10**5000": 10**5000,
    "-10**5000": -(10**5000),
    "a part 10**5000": [(10**5000, -(10**5000))],
    "itself": ITSELF,
    "unspeakable": Unspeakable(),
    "unspeakable parts": [(Unspeakable(), Unspeakable())],
    "complex": 1j,
    "text": "abc",
    "bytes": b"abc",
    "object": object(),
    "type": int,
    "odd": Odd(),
    "empty": [],
    "empties": [[]],
    "nested": [[[[1]]]],
    "deep": [[[1.0, 2.0, 3.0]]],
    "ragged": [(0, 1), (1, 2, 3)],
    "ragged3": [(0, 1, 2), (1, 2)],
    "pair": [(0, 1)],
    "pairs of text": [("a", "b")],
    "pairs of None": [(None, None)],
    "pairs of nan": [(math.nan, math.nan)],
    "pairs of bool": [(True, False)],
    "pairs of huge": [(10**400, 1)],
    "numbers": [1, 2, 3],
    "row of None": [None],
    "mixed": [1, "a", None, (2, 3)],
    "dict": {0: 1},
    "dict of dicts": {None: {}},
    "dict of huge": {10**400: None},
    "set": {1, 2},
    "generator": range(3),
    "array": np.zeros((4, 4)),
    "scalar array": np.array(1.0),
    "array of nan": np.full((4, 3), math.nan),
    "array of huge": np.full((4, 3), 1e300),
    "array of text": np.array(["a", "b"]),
    "array of objects": np.array([object(), None], dtype=object),
    "array of ragged": np.array([(1, 2), (3,)], dtype=object),
    "array of bool": np.ones((4, 3), bool),
    "array of times": np.zeros(3, "M8[s]"),
    "structured": np.zeros(3, [("x", float)]),
    "masked": np.ma.masked_array([1.0, 2.0], [True, False]),
    "wide": np.broadcast_to(np.zeros(1), (10**9, 3)),
    "field": FIELD,
    "field as guide": [(0, FIELD)],
    "field as cavity": [(FIELD, 0, 1)],
    "box as guide": [(0, swarm.Box((1.0, 1.0, 1.0)))],
    "rough guide": [(0, swarm.Plane((0.0, 0.0, 1.0), 0.0, friction=0.1))],
    "class as guide": [(0, swarm.Sphere)],
    "surface": swarm.Sphere(1.0),
    "body": ROD,
    "scene": SCENE,
    "strain": swarm.Strain([(0, 1)], [1.0], [[1.0]]),
}

CALLS = {
    "Body": (swarm.Body, {"points": SQUARE, "mass": 1.0}, (
        "points", "mass", "mass_matrix", "links", "springs", "contacts", "strain", "anchors", "guides", "cavities",
        "faces",
    )),
    "matrix": (swarm.Body, {"points": SQUARE, "mass_matrix": np.eye(4)}, ("mass_matrix",)),
    "Strain": (swarm.Strain, {"edges": [(0, 1)], "rest": [1.0], "stiffness": [[1.0]]}, None),
    "dumbbell": (swarm.dumbbell, {"length": 1.0, "mass": 1.0}, None),
    "tetrahedron": (swarm.tetrahedron, {"edge": 1.0, "mass": 1.0}, None),
    "chain": (swarm.chain, {"n": 3, "length": 1.0, "mass": 1.0}, None),
    "rigid": (swarm.rigid, {"vertices": CUBE, "density": 1.0}, ("vertices", "density", "faces", "contacts")),
    "block": (block, {"lengths": (1.0, 1.0, 1.0), "cells": (1, 1, 1)}, None),
    "elastic": (swarm.elastic, {
        "mesh": (NODES, ELEMENTS), "young": 1.0, "poisson": 0.3, "density": 1.0, "mass": "lumped",
    }, None),
    "nodes": (lambda nodes: swarm.elastic((nodes, ELEMENTS), 1.0, 0.3, 1.0), {"nodes": NODES}, None),
    "elements": (lambda elements: swarm.elastic((NODES, elements), 1.0, 0.3, 1.0), {"elements": ELEMENTS}, None),
    "place": (swarm.place, {"scene": SCENE, "body": ROD, "n": 2, "speed": 0.0, "spin": 0.0, "seed": 0}, None),
    "Bodies": (swarm.Bodies, {
        "body": ROD, "position": ROD.points.T, "velocity": np.zeros((3, 2)), "project": False,
    }, None),
    "Particles": (swarm.Particles, {
        "position": np.zeros((3, 2)), "velocity": np.zeros((3, 2)), "mass": 1.0, "image": None,
    }, None),
    "fill": (swarm.fill, {"scene": SCENE, "n": 2, "speed": 1.0, "mass": 1.0, "seed": 0}, None),
    "Sampled": (swarm.Sampled, {"values": SAMPLES, "spacing": 0.25, "origin": (-1.0, -1.0, -1.0)}, None),
    "Spheres": (swarm.Spheres, {"centers": [(0.0, 0.0, 0.0)], "radii": 1.0}, None),
    "projected": (lambda velocity: swarm.Bodies(ROD, ROD.points.T, velocity, project=True), {"velocity": 0}, None),
}  # fmt: skip
CASES = [(call, name) for call, (_make, whole, names) in CALLS.items() for name in names or whole]


def outcome(make, arguments):
    """What is wrong with what comes of it; None: it works, or says why not in one line."""
    try:
        made = make(**arguments)
    except swarm.SwarmError as error:
        message = str(error)
        return None if 0 < len(message) < 700 and "\n" not in message else message
    except Exception as error:
        return repr(error)
    return None if made is not None else "nothing"


@pytest.mark.parametrize(("call", "name"), CASES, ids=[f"{call}-{name}" for call, name in CASES])
def test_it_works_or_says_so_in_a_sentence(call, name):
    make, whole, _names = CALLS[call]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = {value: outcome(make, whole | {name: given}) for value, given in HOSTILE.items()}
    assert not {value: wrong for value, wrong in found.items() if wrong is not None}
