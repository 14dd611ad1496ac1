"""What a billiard keeps besides its energy, and the shipped scenes, flown for a number of impacts."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from physics.billiards import joachimsthal

import swarm
from swarm import scene_file

SCENES = Path(__file__).parents[2] / "examples" / "scenes"
# Of the wanted number of impacts: particles differ, and the trial is short.
_SPARE = 1.2


def shipped(name, number):
    """A scene of examples/scenes without its losses, some of its particles, and its method if that is Impact.

    Losses would end the impacts; soft walls and multipliers are not what is witnessed here.
    """
    job = scene_file.read(SCENES / f"{name}.toml")
    surfaces = [replace(s, restitution=1.0) if s.restitution < 1.0 else s for s in job.scene.surfaces]
    particles = job.particles()
    few = swarm.Particles(
        *(column[..., :number] for column in (particles.position, particles.velocity, particles.mass))
    )
    method = job.method if isinstance(job.method, swarm.Impact) else swarm.Impact()
    return swarm.Scene(surfaces, job.scene.gravity), few, method


def fly(scene, start, method, impacts, trial=100.0):
    """Run for so many impacts a particle: the result, and how many they were in all."""
    seen = swarm.simulate(scene, start, method, until=trial, every=trial).observables
    until = trial * _SPARE * impacts * len(start) / float(seen["impacts"][-1])
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
