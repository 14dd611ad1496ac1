"""Grazing, corners, wedges and cusps: the run ends, cheaply, inside and with its energy."""

import math

import numpy as np
import pytest
from conftest import rarely
from physics.billiards import EPSILON, run, scene_of
from physics.hard_cases import CASES

import swarm

pytestmark = pytest.mark.physics


@pytest.mark.parametrize(
    "name", [rarely(name) if name in ("graze_ellipsoid", "graze_ball") else name for name in CASES]
)
def test_it_ends_inside_with_its_energy(name):
    """No launch may take too many passes, leave the volume or change its speed."""
    for launch, facts in CASES[name]().items():
        assert facts["energy"] <= 1e-12, launch
        assert facts["ulps"] <= 4.0, launch
        if name.startswith("graze"):
            assert facts["impacts"] <= 2.0 * facts["time"] / facts["shortest"] + 10.0, launch


def test_whispering_gallery_runs_at_full_speed():
    """A tangential launch slides along a great circle: off by no more than the tolerance a crossing."""
    start = swarm.Particles([0.5, 0.0, 0.0], [0.0, 1.0, 0.0])
    for tolerance in (1e-9, 1e-12):
        method = swarm.Impact(sliding_tolerance=tolerance)
        x, y, _z = run(scene_of("sphere"), start, method, 1.5, compile="always").particles.position[:, 0]
        travelled = 0.5 * (math.atan2(y, x) % (2.0 * math.pi))
        assert abs(travelled - 1.5) <= 3.0 * tolerance


@pytest.mark.parametrize("angle", [1e-3, 1e-2, 0.1])
def test_steep_whispering_is_the_exact_polygon(angle):
    """Flights longer than the shortest are exact reflections: the polygon's corners turn by 2 angle each."""
    start = swarm.Particles([0.5, 0.0, 0.0], [-math.sin(angle), math.cos(angle), 0.0])
    chord = 2.0 * 0.5 * math.sin(angle)
    corners = 20
    result = run(scene_of("sphere"), start, swarm.Impact(), (corners + 0.5) * chord)
    x, y, _z = result.particles.position[:, 0]
    middle = (2 * corners + 1) * angle
    assert result.observables["impacts"][-1] in (corners, corners + 1)  # the launch itself may count
    assert np.hypot(x - 0.5 * math.cos(angle) * math.cos(middle), y - 0.5 * math.cos(angle) * math.sin(middle)) <= (
        100.0 * EPSILON / angle
    )
