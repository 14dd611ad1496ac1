"""A foam of cavities: free paths, energy, slides off their walls, and what goes with it."""

import math

import numpy as np
import pytest
from energy_books import unbooked

import swarm


def foam(count, seed=0, radius=0.12, **laws):
    """Balls at random in a unit cube, most of which overlap others."""
    centers = np.random.default_rng(seed).random((count, 3))
    return swarm.Spheres(centers, radius, side="inside", **laws)


def test_phi_is_that_of_the_nearest_and_bounds_hold_all():
    cavities = foam(30)
    points = np.random.default_rng(1).uniform(-0.3, 1.3, (3, 2000))
    expected = np.min([np.sqrt(((points.T - c) ** 2).sum(axis=1)) - 0.12 for c in cavities.centers], axis=0)
    assert cavities.phi(points) == pytest.approx(expected, abs=1e-14)
    low, high = (np.array(corner)[:, None] for corner in cavities.bounds())
    inside = expected <= 0.0
    assert ((points >= low) & (points <= high)).all(axis=0)[inside].all()
    assert np.array_equal(swarm.Scene([cavities]).admits(points), expected < 0.0)


@pytest.mark.parametrize("count", [3, 60])
def test_a_foam_is_the_union_of_its_cavities(count):
    """Of as many as a union may have they are the same; each flight of a small run, in plain Python."""
    centers = np.random.default_rng(5).random((3, 3)) * 0.15
    few = swarm.Spheres(centers, 0.12, side="inside")
    union = swarm.Union([swarm.Sphere(0.12, tuple(c)) for c in centers.tolist()])
    start = swarm.fill(swarm.Scene([union]), 10, speed=1.0, seed=2)
    if count > 3:
        # The others are far away.
        far = np.random.default_rng(6).random((count - 3, 3)) + 5.0
        few = swarm.Spheres(np.vstack([centers, far]), 0.12, side="inside")
    one, other = (
        swarm.simulate(swarm.Scene([vessel]), start, swarm.Impact(), until=0.6, every=0.6, threads=1, compile="never")
        for vessel in (few, union)
    )
    assert np.array_equal(one.impacts_per_particle, other.impacts_per_particle)
    assert one.particles.position == pytest.approx(other.particles.position, abs=1e-9)


@pytest.mark.physics
def test_the_mean_free_path_is_four_volumes_an_area(compiled_at_once):
    cavities = foam(200)
    scene = swarm.Scene([cavities])
    start = swarm.fill(scene, 1000, speed=1.0, seed=1)
    until = 20.0
    result = swarm.simulate(scene, start, swarm.Impact(), until=until, every=until, threads=1)
    random = np.random.default_rng(3)
    d = random.normal(size=(3, 100_000))
    d /= np.sqrt((d**2).sum(axis=0))
    which = random.integers(200, size=d.shape[1])
    free = (cavities.phi(cavities.centers[which].T + 0.12 * d) > -1e-12).mean()
    area = 200 * 4.0 * math.pi * 0.12**2 * free
    points = random.uniform(-0.12, 1.12, (3, 500_000))
    part = (cavities.phi(points) <= 0.0).mean()
    expected = area / (4.0 * part * 1.24**3)
    impacts = result.impacts_per_particle / until
    spread = expected * math.hypot(
        math.sqrt((1.0 - free) / free / d.shape[1]), math.sqrt((1.0 - part) / part / points.shape[1])
    )
    assert abs(impacts.mean() - expected) <= 3.0 * math.hypot(impacts.std() / math.sqrt(impacts.size), spread)
    assert result.observables["max_penetration"].max() <= 1e-13
    energy = result.observables["total_energy"]
    assert energy[-1] == pytest.approx(energy[0], rel=1e-13)


@pytest.mark.physics
def test_a_foam_settles_under_gravity():
    cavities = foam(40, radius=0.2, restitution=0.5, friction=0.1)
    scene = swarm.Scene([cavities], (0.0, 0.0, -9.81))
    start = swarm.fill(scene, 4, speed=1.0, seed=1)
    result = swarm.simulate(scene, start, swarm.Impact(), until=20.0, every=10.0, threads=1, compile="never")
    seen = result.observables
    assert np.abs(result.particles.velocity).max() <= 1e-9
    assert seen["max_penetration"].max() <= 1e-12
    assert unbooked(seen) <= 1e-10 * abs(seen["total_energy"][0])


@pytest.mark.parametrize(
    ("gravity", "opening"),
    [
        (None, swarm.Sphere(0.2, (0.7, 0.0, 0.0))),
        ((0.0, 0.0, -2.0), swarm.Opening(swarm.Sphere(0.25, (0.25, 0.0, -0.5)), times=[(0.8, 1.5)])),
    ],
    ids=["opening", "door"],
)
def test_openings_of_a_foam_are_those_of_the_union_of_its_cavities(gravity, opening):
    """Also those into which particles slide, and only while a door is open."""
    places, radii, laws = [(-0.25, 0.0, 0.0), (0.25, 0.0, 0.0)], [0.45, 0.5], {"restitution": 0.3, "friction": 0.1}
    laws = {} if gravity is None else laws
    cavities = swarm.Spheres(places, radii, side="inside", openings=[opening], **laws)
    parts = [swarm.Sphere(radius, place, **laws) for radius, place in zip(radii, places, strict=True)]
    start = swarm.fill(swarm.Scene([cavities]), 12 if gravity is None else 3, speed=1.0, seed=3)
    one, other = (
        swarm.simulate(swarm.Scene([walls], gravity), start, swarm.Impact(), until=1.5, compile="never")
        for walls in (cavities, swarm.Union(parts, openings=[opening]))
    )
    assert one.observables["escaped"][-1] > 0
    assert np.array_equal(np.isfinite(one.escape_time), np.isfinite(other.escape_time))
    assert np.abs(one.particles.position - other.particles.position).max() < 1e-11
    assert one.observables["energy_error"].max() < 1e-12


def test_what_does_not_go_with_a_foam_is_a_sentence():
    cavities = foam(5)
    with pytest.raises(swarm.SceneError, match="must be the only surface of a scene without a period"):
        swarm.Scene([cavities, swarm.Plane((0.0, 0.0, 1.0), 0.5)])
    with pytest.raises(swarm.SceneError, match="motion must be left out for Spheres with side"):
        foam(5, motion=swarm.Translation((1.0, 0.0, 0.0)))
    with pytest.raises(swarm.SceneError, match='side must be "outside" for Capsules'):
        swarm.Capsules([[0.0, 0.0, 0.0]], 0.1, 0.2, side="inside")
    scene = swarm.Scene([cavities])
    with pytest.raises(swarm.SceneError, match=r"surfaces\[0\] must not be a Spheres of several rooms with Verlet"):
        swarm.simulate(scene, swarm.fill(scene, 2, speed=1.0), swarm.Verlet(1e-3, 1e6), until=1.0, every=1.0)
