"""The tables of bodies: what comes back has the same bits, and every key that is wrong is named."""

import tomllib

import numpy as np
import pytest
import tomli_w

import swarm
from swarm.bodies import table
from swarm.bodies.elastic import block

CORNERS = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) / 7.0
CRANK = swarm.Body(
    [(0.0, 0.0, 0.0), (0.1, 0.0, 0.0), (0.1 / 3.0, 0.0, 0.25), (0.3, 0.0, 0.0)],
    mass_matrix=[[1.0, 0.1, 0.0, 0.0], [0.1, 2.0 / 3.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]],
    links=[(0, 1), (1, 2)],
    springs=[(2, 3, 100.0 / 3.0, 0.1)],
    contacts=[[0.0, 1.0 / 3.0, 2.0 / 3.0, 0.0], [0.0, 0.0, 1.0, 0.0]],
    anchors={0: None, 3: swarm.Oscillation(amplitude=(0.0, 0.0, 1e-3 / 3.0), frequency=2.0, phase=0.1)},
    guides=[(1, swarm.Plane((0.0, 1.0, 0.0), 0.0))],
    cavities=[(swarm.Sphere(radius=0.4, center=(0.0, 0.0, 0.1)), 1, 2)],
)
BODIES = {
    "dumbbell": swarm.dumbbell(length=0.1, mass=0.3),
    "cube": swarm.rigid(CORNERS, density=1000.0 / 3.0),
    "dense": swarm.rigid(CORNERS, density=1000.0 / 3.0, contacts=0.1),
    "elastic": swarm.elastic(block((0.1, 0.2, 0.3), (2, 1, 1)), young=1e5 / 3.0, poisson=0.3, density=1.1),
    "consistent": swarm.elastic(block((0.1, 0.2, 0.3), (1, 1, 1)), 1e5, 0.3, 1.1, mass="consistent"),
    "crank": CRANK,
    "turned": swarm.Body([(0.1, 0.0, 0.0), (0.1, 0.0, 0.2)], 1.0, [(0, 1)],
                         anchors={0: swarm.Rotation((0.0, 0.0, 1.0), 0.7, (0.0, 0.0, 0.0))}),
    "pulled": swarm.Body([(0.1, 0.0, 0.0), (0.2, 0.0, 0.0)], 1.0, springs=[(0, 1, 5.0, 0.1)], contacts=[],
                         anchors={0: swarm.Translation((0.0, 0.1, 0.0))}),
}  # fmt: skip


@pytest.mark.parametrize("name", BODIES)
def test_a_body_comes_back_with_the_same_bits(name):
    body = BODIES[name]
    again = table.body_of(tomllib.loads(tomli_w.dumps(table.table_of(body))))
    for part in ("points", "mass_matrix", "links", "contacts", "faces"):
        np.testing.assert_array_equal(getattr(again, part), getattr(body, part), strict=True)
    for part in ("springs", "anchors", "guides", "cavities"):
        assert getattr(again, part) == getattr(body, part)
    assert (again.strain is None) == (body.strain is None)
    if body.strain is not None:
        for part in ("edges", "rest", "stiffness"):
            np.testing.assert_array_equal(getattr(again.strain, part), getattr(body.strain, part), strict=True)


BALL = {"kind": "sphere", "radius": 1.0}
TWO = {"kind": "points", "points": [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]], "mass": 1.0}
STRAIN = {"edges": [[0, 1]], "rest": [1.0], "stiffness": [[0, 1, 2.0]]}


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"strain": STRAIN}, r"strain\.stiffness\[0\] must name two of the 1 edges, got 0 and 1"),
        ({"strain": {"edges": [[0, 1]]}}, r"strain\.rest: expected"),
        ({"strain": 1.0}, r"strain: expected a table, got 1\.0"),
        ({"strain": {**STRAIN, "young": 1.0}}, r"strain\.young: unknown key"),
        ({"anchors": [{"kind": "rotation"}]}, r"anchors\[0\]: expected a table with the number of a point"),
        ({"anchors": [{"point": 0}, {"point": 0}]}, r"anchors\[1\] is of point 0, as anchors\[0\]"),
        ({"anchors": [{"point": 0, "kind": "rotatoin"}]}, r"anchors\[0\]\.kind must be .*did you mean 'rotation'"),
        (
            {"anchors": [{"point": 0, "kind": "translation", "velocity": [0, 0, "a"]}]},
            r"anchors\[0\]\.velocity\[2\]: expected a number, got a text",
        ),
        ({"guides": [{"point": 0}]}, r"guides\[0\]\.surface: expected"),
        ({"guides": [{"point": 0, "surface": {**BALL, "radius": 0}}]}, r"guides\[0\]\.surface\.radius must be"),
        ({"cavities": [{"surface": BALL, "carrier": 0}]}, r"cavities\[0\]\.point: expected"),
        ({"points": [[0.0, 0.0]]}, r"body\.points\[0\]: expected a list of length 3"),
        ({"links": [[0, 0.5]]}, r"body\.links\[0\]\[1\]: expected a whole number"),
        ({"likns": []}, r"body\.likns: unknown key.*did you mean 'links'"),
    ],
)  # fmt: skip
def test_bad_tables_name_the_key(more, message):
    with pytest.raises(swarm.SceneError, match=message):
        table.body_of({**TWO, **more})


def test_another_kind_is_no_table_of_a_trajectory():
    with pytest.raises(swarm.SceneError, match=r"body\.kind must be one of 'points', got 'dumbbell'"):
        table.body_of({"kind": "dumbbell", "length": 1.0, "mass": 1.0})
