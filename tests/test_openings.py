"""Openings: volumes inside which a wall is not there, through which particles escape."""

import math

import numpy as np
import pytest

import swarm

HOLE = swarm.Sphere(0.05, center=(0.0, 0.0, 0.5))


def run(scene, particles, until=4.0, frames=8, **options):
    options = {"compile": "never", **options}
    method = options.pop("method", swarm.Impact())
    return swarm.simulate(scene, particles, method, until=until, every=until / frames, **options)


def thrown(position, velocity):
    return swarm.Particles(np.array(position, dtype=float).T, np.array(velocity, dtype=float).T)


# --- In flight -------------------------------------------------------------------------------------------


def test_one_particle_escapes_when_and_where_it_reaches_the_opening():
    scene = swarm.Scene([swarm.Sphere(0.5, openings=[swarm.Sphere(0.05, center=(0.0, 0.0, 0.5))])])
    # The second one passes beside the opening, and comes back along the diameter.
    found = run(scene, thrown([(0, 0, 0.1), (0.1, 0, 0)], [(0, 0, 0.8), (1.0, 0, 0)]))
    assert found.escape_time[0] == pytest.approx(0.4 / 0.8, rel=1e-15)
    assert math.isnan(found.escape_time[1])
    assert found.particles.position[:, 0].tolist() == pytest.approx([0.0, 0.0, 0.5], rel=1e-15)
    assert found.particles.velocity[:, 0].tolist() == [0.0, 0.0, 0.8]
    # The frame at the instant itself is that of the escape.
    assert found.observables["escaped"].tolist() == [0, 1, 1, 1, 1, 1, 1, 1, 1]
    assert found.impacts_per_particle.tolist() == [0, 4]
    assert found.observables["total_energy"].tolist() == [0.5 * (0.64 + 1.0)] * 9


def test_who_escapes_has_reached_the_opening_and_nobody_else():
    scene = swarm.Scene([swarm.Sphere(0.5, openings=[HOLE])])
    found = run(scene, swarm.fill(scene, 400, speed=1.0, seed=1), until=20.0)
    out, r = ~np.isnan(found.escape_time), found.particles.position
    assert 5 < out.sum() == found.observables["escaped"][-1] < 50
    assert np.abs(np.sqrt((r[:, out] ** 2).sum(axis=0)) - 0.5).max() < 1e-15
    assert (HOLE.phi(r[:, out]) <= 0.0).all()
    assert (r[:, out] * found.particles.velocity[:, out]).sum(axis=0).min() > 0.0
    assert found.observables["max_penetration"].max() < 1e-15
    assert found.observables["energy_error"].max() < 1e-14
    assert (np.diff(found.observables["escaped"]) >= 0).all()
    # Until then they fly as they would without: those that stay have the same bits.
    whole = run(swarm.Scene([swarm.Sphere(0.5)]), swarm.fill(scene, 400, speed=1.0, seed=1), until=20.0)
    for name in ("position", "velocity"):
        assert (getattr(found.particles, name)[:, ~out] == getattr(whole.particles, name)[:, ~out]).all()


# --- Along walls -----------------------------------------------------------------------------------------

VOLUMES = {
    "ball": swarm.Sphere(0.1, center=(0.5, 0.0, -0.5)),
    "balls": swarm.Spheres([(0.5, 0.0, -0.5), (1.5, 1.0, -0.5)], [0.1, 0.2]),
    "formula": swarm.Formula("x**2 + y**2 + z**2 - 0.01", center=(0.5, 0.0, -0.5), bounds=((-0.2,) * 3, (0.2,) * 3)),
}


@pytest.mark.parametrize("volume", VOLUMES.values(), ids=VOLUMES)
@pytest.mark.parametrize("tolerance", [1e-9, 1e-3])
def test_who_slides_into_an_opening_leaves_at_its_edge(volume, tolerance):
    y = np.array([0.0, 0.05, 0.0999, 0.0999999, 0.1001, -0.02])
    start = np.array([0.0 * y - 0.3, y, 0.0 * y - 0.5]), np.array([0.0 * y + 1.0, 0.0 * y, 0.0 * y])
    scene = swarm.Scene([swarm.Box((2.0, 2.0, 0.5), openings=[volume])], gravity=(0.0, 0.0, -9.81))
    found = run(scene, swarm.Particles(*start), 1.5, 3, method=swarm.Impact(sliding_tolerance=tolerance))
    edge = np.where(np.abs(y) < 0.1, 0.8 - np.sqrt(np.maximum(0.01 - y**2, 0.0)), np.nan)
    # Where a way meets the edge at an angle, round-off moves the place by more.
    assert np.allclose(found.escape_time, edge, rtol=0.0, atol=1e-12, equal_nan=True)
    out = ~np.isnan(edge)
    assert np.allclose(found.particles.position[0, out], edge[out] - 0.3, rtol=0.0, atol=1e-12)
    assert (found.particles.position[2] == -0.5).all()
    assert found.observables["sliding"].tolist() == [0, 6, 1, 1]
    assert found.observables["energy_error"].max() < 1e-14
