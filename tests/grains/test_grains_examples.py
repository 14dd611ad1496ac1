"""The scenes of grains in examples/scenes, shorter: a drum that carries them up, a silo that runs out, a lid."""

from pathlib import Path

import numba
import numpy as np
import pytest

import swarm
from swarm.scene_file import read

pytestmark = [
    pytest.mark.physics,
    pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="hours in plain Python"),
]
SCENES = Path(__file__).parents[2] / "examples" / "scenes"


def run_of(name, count, until, measured):
    """A scene with fewer grains, and a mean of each of its frames."""
    job = read(SCENES / f"{name}.toml")
    mass, radius = (getattr(job.start(), key)[0] for key in ("mass", "radius"))
    start = swarm.fill(job.scene, count, speed=0.0, mass=mass, radius=radius, seed=1)
    return swarm.simulate(
        job.scene, start, job.method, until=until, every=0.05, progress=False, observables={"measured": measured}
    ).observables


def test_a_drum_carries_grains_up_to_a_slope(compiled_at_once):
    """The centre of grains that fill half of a drum is as far from below the axis as their surface is from level."""
    seen = run_of("drum_grains", 200, 0.3, lambda snapshot: snapshot.position.mean(axis=1))
    x, _y, z = seen["measured"].T
    angle = np.degrees(np.arctan2(-x, -z))
    assert 20.0 < angle[-1] < 55.0
    assert seen["wall_work"][-1, 0] > 0.0
    assert seen["energy_error"].max() < 1e-13


def test_an_oedometer_weighs_its_lid(compiled_at_once):
    seen = run_of("oedometer", 60, 0.35, lambda snapshot: float(snapshot.position[2].max()))
    force = np.diff(seen["impulse"][:, 1])[-1] / 0.05
    assert force == pytest.approx(0.3 * 9.81, rel=0.02)
    # The lid lies on the highest grain.
    assert seen["measured"][-1] + 0.003 == pytest.approx(0.07 + seen["wall_position"][-1, 1, 2], abs=2e-4)
    assert seen["energy_error"].max() < 1e-12


def test_a_silo_is_poured(compiled_at_once):
    """Before its door is gone: all that have come are above the floor."""
    job = read(SCENES / "poured_silo.toml")
    result = swarm.simulate(
        job.scene, None, job.method, until=0.04, sources=job.run.sources, counters=job.run.counters, seed=1
    )
    seen, there = result.observables, result.particles.born()
    assert 120 < seen["born"][-1, 0] == len(there) == np.isfinite(result.birth_time).sum()
    assert there.position[2].min() > 0.0
    assert seen["crossings"].tolist() == [[[0, 0]]] * len(seen["time"])
    assert seen["energy_error"].max() < 1e-12


def test_a_silo_runs_out_through_its_orifice(compiled_at_once):
    seen = run_of("silo", 300, 0.4, lambda snapshot: float((snapshot.position[2] < -0.055).sum()))
    assert seen["measured"][-1] > seen["measured"][0] + 30.0
    assert (np.diff(seen["measured"]) >= 0.0).all()
    assert seen["energy_error"].max() < 1e-12
    # The bottom holds up what is on it.
    assert seen["max_penetration"].max() < 2e-3
