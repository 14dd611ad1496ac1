"""The next impact of one point: that of the engine, step by step, and what is refused."""

import numpy as np
import pytest
from conftest import row

import swarm

SPHERE = swarm.Scene([swarm.Sphere(0.5)])
BODIES = np.array([[0.5, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, -0.5]])
SCENES = {
    "losses, in a fall": swarm.Scene([swarm.Box((0.5, 0.5, 0.5), restitution=0.9)], gravity=(0.0, 0.0, -9.81)),
    "a field": swarm.Scene([swarm.Box((1.0, 1.0, 1.0)), swarm.Spheres(BODIES, [0.2, 0.2, 0.2])]),
    "rooms": swarm.Scene([swarm.Union([swarm.Sphere(0.5), swarm.Capsule(0.2, 3.0, center=(0.0, 0.0, 1.0))])]),
    "safe steps": swarm.Scene([swarm.Torus(0.5, 0.2, center=(0.5, 0.0, 0.0))], gravity=(0.0, 0.0, -9.81)),
    "a hot wall": swarm.Scene([swarm.Sphere(0.5, temperature=1.0)]),
}


@pytest.mark.parametrize("name", SCENES)
def test_it_is_that_of_a_run(name, tmp_path):
    """Of a hot wall the first one, with the random numbers of the seed."""
    scene, r, v = SCENES[name], np.array([0.01, 0.02, 0.03]), np.array([1.0, 0.3, 0.2])
    log, start = tmp_path / "log.h5", swarm.Particles(r, v)
    swarm.simulate(scene, start, swarm.Impact(), until=3.0, impacts=log, compile="never", seed=7)
    with swarm.load_impacts(log) as impacts:
        rows = impacts.table()[: 1 if name == "a hot wall" else 3]
    time = 0.0
    for met in rows:
        found = swarm.bounce(scene, r, v, seed=7)
        time, r, v = time + found.time, found.position, found.velocity
        with row(f"{met['time']:g} s"):
            assert abs(time - met["time"]) < 1e-14
            np.testing.assert_allclose(r, met["position"], rtol=0.0, atol=1e-14)
            np.testing.assert_allclose(v, met["velocity_after"], rtol=0.0, atol=1e-13)
            np.testing.assert_allclose(found.velocity_before, met["velocity_before"], rtol=0.0, atol=1e-13)
            assert found.surface == met["surface"]


def test_a_walk_keeps_the_energy_and_the_angular_momentum():
    r, v = np.array([0.1, 0.2, 0.0]), np.array([1.0, -0.5, 0.25])
    energy, spin = v @ v, np.cross(r, v)
    for _impact in range(20):
        met = swarm.bounce(SPHERE, r, v)
        r, v = met.position, met.velocity
        assert abs(r @ r - 0.25) < 1e-15
    assert abs(v @ v / energy - 1.0) < 1e-14
    np.testing.assert_allclose(np.cross(r, v), spin, rtol=0.0, atol=1e-14)


@pytest.mark.parametrize(
    ("scene", "position", "velocity", "message"),
    [
        (SPHERE, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), "velocity must lead to a surface, got .* which never does"),
        (SPHERE, (0.0, 0.0, 0.9), (1.0, 0.0, 0.0), r"0.4 m outside surfaces\[0\]"),
        (SPHERE, np.zeros((3, 2)), np.ones((3, 2)), r"position must be three numbers, got shape \(3, 2\)"),
        (
            SPHERE,
            (0.0, 0.0, -0.5),
            (1.0, 0.0, 0.0),
            r"goes along surfaces\[0\] at \(0.0, 0.0, -0.5\): the point slides",
        ),
        ("cavity", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), "scene must be a swarm.Scene, got 'cavity'"),
        (
            swarm.Scene([swarm.Sphere(0.5, motion=swarm.Translation((1.0, 0.0, 0.0)))]),
            (0.0, 0.0, 0.0),
            (1.0, 0.0, 0.0),
            r"surfaces\[0\] must have no motion for a bounce, .* use simulate with impacts=",
        ),
        (
            swarm.Scene([swarm.Sphere(0.5, openings=[swarm.Sphere(0.1, center=(0.0, 0.0, 0.5))])]),
            (0.0, 0.0, 0.0),
            (1.0, 0.0, 0.0),
            r"surfaces\[0\] must have no openings for a bounce",
        ),
        (
            swarm.Scene([swarm.Sphere(0.1, side="outside")], period=(1.0, 1.0, 1.0)),
            (0.5, 0.5, 0.5),
            (1.0, 0.0, 0.0),
            "period must be None for a bounce, got one",
        ),
    ],
)
def test_what_is_refused(scene, position, velocity, message):
    with pytest.raises(swarm.SceneError, match=message):
        swarm.bounce(scene, position, velocity)
