"""Bodies and solids that are smaller than their faces: what passes is said before the run, contact points hold it."""

import itertools
import logging
import re

import numpy as np
import pytest

import swarm
from swarm.bodies.admission import warn_of_passing

CUBE = np.array(list(itertools.product((-0.5, 0.5), repeat=3)))
VESSEL = swarm.Sphere(10.0)


def pedestal(**laws):
    """Narrower than the cube by a quarter."""
    return swarm.Box((0.375, 0.375, 0.375), side="outside", **laws)


def fall(contacts, until, solid=None):
    """A cube that falls on the pedestal."""
    body = swarm.rigid(CUBE, density=1.0, contacts=contacts)
    scene = swarm.Scene([solid or pedestal(), VESSEL], gravity=(0.0, 0.0, -9.81))
    position = (body.points + np.array([0.03, 0.02, 1.2])).T
    start = swarm.Bodies(body, position, np.zeros((3, 4)))
    return swarm.simulate(scene, start, swarm.Impact(dt=0.01), until=until, every=until / 4, compile="never", threads=1)


def test_a_cube_lands_on_a_pedestal_with_contact_points_on_its_faces(caplog):
    result = fall(0.3, 0.45)
    seen = result.observables
    assert "can pass through" not in caplog.text
    assert seen["impacts"][-1] > 0
    assert seen["energy_error"].max() < 1e-12
    assert seen["max_penetration"].max() < 1e-9
    # It bounces off: what fell freely from 0.325 m above has met the top at sqrt(2 0.325/9.81) = 0.257 s, elastic.
    time = 0.45 - 2.0 * np.sqrt(2.0 * 0.325 / 9.81)
    middle = result.bodies.position.mean(axis=1)[:, 0]
    assert middle == pytest.approx([0.03, 0.02, 0.875 + 0.325 - 0.5 * 9.81 * time**2], abs=0.05)


def test_a_cube_comes_to_rest_on_a_pedestal():
    result = fall(0.5, 0.32, pedestal(restitution=0.0, friction=0.3))
    seen = result.observables
    assert seen["sliding"][-1] == 1
    assert seen["energy_error"].max() < 1e-12
    assert seen["max_penetration"].max() < 1e-9
    assert result.bodies.position[2].mean() == pytest.approx(0.875, abs=1e-9)
    # What it has lost is what it fell.
    assert seen["dissipated_energy"][-1] == pytest.approx(9.81 * 0.325, rel=1e-6)


def test_a_cube_that_passes_is_reported_before_the_run(caplog):
    """By its corners alone it meets nothing; the sentence says what would hold it."""
    seen = fall(None, 0.6).observables
    assert seen["impacts"][-1] == 0
    (record,) = caplog.records
    assert record.levelno == logging.WARNING
    message = record.getMessage()
    assert message.startswith(
        "surfaces[0] (Box) can pass through the body without an impact: only contact points touch"
    )
    assert "0.71 m away from them" in message
    assert "contacts = 0.1 [m] of rigid" in message
    caplog.clear()
    fall(0.1, 0.01)
    assert not caplog.text


SMALL = swarm.rigid(0.1 * CUBE, 1.0)


@pytest.mark.parametrize(
    ("surface", "body", "sentence"),
    [
        (swarm.Sphere(0.01, side="outside"), SMALL, r"\(Sphere\) can pass through the body"),
        (swarm.Spheres([(0.0, 0.0, 0.0), (3.0, 0.0, 0.0)], [0.5, 0.01]), SMALL, r"\(Spheres\) can pass through"),
        (swarm.Cylinder(0.01, (0.0, 0.0, 1.0), side="outside"), SMALL, r"\(Cylinder\) can pass through"),
        # A ball that is wider than the face sinks in by the arrow of its arc, a much wider one by nothing to speak of.
        (swarm.Sphere(0.08, side="outside"), SMALL, r"\(Sphere\) can enter the body by 0\.04"),
        (swarm.Sphere(1.0, side="outside"), SMALL, None),
        (swarm.Sphere(0.08, side="outside"), swarm.rigid(0.1 * CUBE, 1.0, contacts=0.04), None),
        # A corner always enters.
        (swarm.Box((1.0, 1.0, 1.0), side="outside"), SMALL, r"\(Box\) can enter the body by 0\.07"),
        (swarm.Box((1.0, 1.0, 1.0), side="outside"), swarm.rigid(0.1 * CUBE, 1.0, contacts=0.02), None),
        (swarm.Boxes([(0.0, 0.0, 0.0)], (1.0, 1.0, 1.0)), SMALL, r"\(Boxes\) can enter"),
        (swarm.Cylinder(1.0, (0.0, 0.0, 1.0), length=2.0, side="outside"), SMALL, r"\(Cylinder\) can enter"),
        # Walls without a side to go around, and the cavity itself.
        (swarm.Plane((0.0, 0.0, -1.0), 0.0), SMALL, None),
        (swarm.Box((1.0, 1.0, 1.0)), SMALL, None),
        # Points and links alone are no solid.
        (swarm.Sphere(0.01, side="outside"), swarm.dumbbell(1.0, 1.0), None),
    ],
)
def test_the_warning(surface, body, sentence, caplog):
    warn_of_passing(swarm.Scene([VESSEL, surface]), body)
    if sentence is None:
        assert not caplog.text
    else:
        assert caplog.records
        assert re.search(r"surfaces\[1\] " + sentence, caplog.text)


@pytest.mark.parametrize("surface", [
    swarm.Box((0.4, 0.3, 0.5), side="outside"),
    swarm.Sphere(0.2, side="outside"),
    swarm.Capsule(0.1, 1.0, (0.0, 0.0, 1.0), side="outside"),
])  # fmt: skip
def test_the_proposed_spacing_is_enough(surface, caplog):
    scene = swarm.Scene([VESSEL, surface])
    warn_of_passing(scene, swarm.rigid(CUBE, 1.0))
    spacing = float(caplog.text.split("contacts = ")[1].split(" ")[0])
    caplog.clear()
    warn_of_passing(scene, swarm.rigid(CUBE, 1.0, contacts=spacing))
    assert not caplog.text
