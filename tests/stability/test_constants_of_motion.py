"""1e6 impacts of each of four particles in the shipped scenes, without losses: energy, walls, and what symmetry keeps.

tests/long/test_escapes.py runs the scenes as they are. `pytest -m long -s` prints what was seen.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from physics.billiards import joachimsthal

import swarm
from swarm import scene_file

PARTICLES, IMPACTS = 4, 1_000_000
SCENES = Path(__file__).parents[2] / "examples" / "scenes"
# More time than the trial run predicts: particles differ, and the trial is short.
SPARE = 1.2


def shipped(name, number):
    """A scene of examples/scenes without its losses, some of its particles, and its method if that is Impact.

    Losses would end the impacts; soft walls and multipliers are not tested here.
    """
    job = scene_file.read(SCENES / f"{name}.toml")
    surfaces = [replace(s, restitution=1.0, friction=0.0) for s in job.scene.surfaces]
    particles = job.start()
    few = swarm.Particles(
        *(column[..., :number] for column in (particles.position, particles.velocity, particles.mass))
    )
    method = job.method if isinstance(job.method, swarm.Impact) else swarm.Impact()
    return swarm.Scene(surfaces, job.scene.gravity), few, method


def fly(scene, start, method, impacts, trial=100.0):
    """Run for so many impacts a particle: the result, and how many they were in all."""
    seen = swarm.simulate(scene, start, method, until=trial, every=trial).observables
    until = trial * SPARE * impacts * len(start) / float(seen["impacts"][-1])
    result = swarm.simulate(scene, start, method, until=until, every=until / 20.0)
    return result, int(result.observables["impacts"][-1])


def joachimsthals_integral(scene, particles):
    """Of each particle in an ellipsoid about the origin."""
    return joachimsthal(particles, scene.surfaces[0].semi_axes)


def spin(scene, particles):
    """Angular momentum about the z axis, per mass, of each particle."""
    r, v = particles.position, particles.velocity
    return r[0] * v[1] - r[1] * v[0]


def sideways(scene, particles):
    """|v_y|, which walls along y or across it keep."""
    return np.abs(particles.velocity[1])


@pytest.mark.physics
def test_a_million_impacts_in_the_shipped_cavity():
    """Energy, Joachimsthal's integral and the angular momentum about the axis of each of four particles."""
    scene, start, method = shipped("cavity", PARTICLES)
    end, impacts = fly(scene, start, method, IMPACTS)
    assert impacts >= PARTICLES * IMPACTS
    assert end.observables["energy_error"].max() <= 2e-15
    assert end.observables["max_penetration"].max() <= np.spacing(0.6)
    for constant in (joachimsthals_integral, spin):
        before, after = constant(scene, start), constant(scene, end.particles)
        assert np.abs(after / before - 1.0).max() <= 1e-10, constant.__name__


# Scenes without a symmetry: only their energy is tested.
CONSTANTS = {
    "ball_in_ellipsoid": [spin],
    "bowl": [spin],
    "box": [],
    "cavity": [joachimsthals_integral, spin],
    "floor": [spin],
    "formula": [spin],
    "galton_board": [],
    "groove": [sideways],
    "hopper": [],
    "multipliers": [spin],
    "obstacles": [],
    "splash": [spin],
}


@pytest.mark.long
def test_every_shipped_scene_is_here():
    """Of those of points at walls that rest and have no openings: all others change energies, or let particles out."""
    jobs = {path.stem: scene_file.read(path) for path in SCENES.glob("*.toml")}
    points = [
        name
        for name, job in jobs.items()
        if isinstance(job.source, scene_file.ParticlesTable)
        and job.start().radius is None
        and all(wall.motion is None and not wall.openings for wall in job.scene.surfaces)
    ]
    assert sorted(CONSTANTS) == sorted(points)


@pytest.mark.long
@pytest.mark.parametrize("name", CONSTANTS)
def test_a_million_impacts(name, capsys):
    scene, start, method = shipped(name, PARTICLES)
    result, impacts = fly(scene, start, method, IMPACTS)
    seen = result.observables
    changes = {}
    for constant in CONSTANTS[name]:
        before, after = constant(scene, start), constant(scene, result.particles)
        changes[constant.__name__] = float(np.abs(after / before - 1.0).max())
    outside = float(seen["max_penetration"].max() / np.spacing(scene.finite_size()))
    with capsys.disabled():
        energy = float(seen["energy_error"].max())
        print(f"\n{name:18} {impacts:>11,} impacts, energy {energy:.1e}, {outside:.1f} ulp outside, {changes}", end="")
    assert impacts >= PARTICLES * IMPACTS
    assert seen["energy_error"].max() <= 1e-12
    assert outside <= 64.0
    assert all(change <= 1e-8 for change in changes.values()), changes
