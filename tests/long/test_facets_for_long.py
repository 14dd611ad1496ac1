"""1e9 impacts on triangles, and 1e6 flights aimed exactly at edges and corners: none is out, no energy is lost."""

import os
import sys
from pathlib import Path

import numpy as np
import pytest

import swarm

sys.path.insert(0, str(Path(__file__).parents[1] / "surfaces"))
from thorny import aimed, hollow, slivered, thorny

pytestmark = pytest.mark.long

DOWN = (0.3, -0.2, -1.0)
# A part of all, for a look.
PART = float(os.environ.get("SWARM_FACETS_PART", "1.0"))
VESSELS = {"thorny": thorny, "slivered": slivered, "needles": lambda: thorny(seed=5, n=120)}
IMPACTS = {
    ("thorny", None): 400e6,
    ("slivered", None): 100e6,
    ("needles", None): 200e6,
    ("thorny", DOWN): 200e6,
    ("needles", DOWN): 100e6,
}


@pytest.mark.parametrize(("name", "gravity"), IMPACTS, ids=str)
def test_nobody_leaves_a_vessel_of_triangles(name, gravity):
    mesh = swarm.Mesh(*VESSELS[name]())
    scene, wanted, done = swarm.Scene([mesh], gravity=gravity), PART * IMPACTS[name, gravity], 0.0
    seed = 0
    while done < wanted:
        seed += 1
        start = swarm.fill(scene, 20_000, speed=1.0, seed=seed)
        end = swarm.simulate(scene, start, swarm.Impact(), until=20.0, every=5.0, threads=2, compile="always")
        done += float(end.observables["impacts"][-1])
        assert mesh.phi(end.particles.position).max() < 1e-12
        assert end.observables["max_penetration"].max() < 1e-12
        assert end.observables["energy_error"].max() < 1e-11
    print(f"{name}, {gravity}: {done:.3g} impacts")


@pytest.mark.parametrize("name", VESSELS)
@pytest.mark.parametrize("gravity", [None, DOWN], ids=str)
def test_a_million_flights_at_edges_and_corners(name, gravity):
    mesh = swarm.Mesh(*VESSELS[name]())
    scene = swarm.Scene([mesh], gravity=gravity)
    flights = 0
    for seed in range(max(1, round(4 * PART))):
        start = aimed(mesh, swarm.fill(scene, 50_000, speed=1.0, seed=seed), gravity, seed)
        end = swarm.simulate(scene, start, swarm.Impact(), until=1.2, threads=2, compile="always")
        flights += start.position.shape[1]
        assert mesh.phi(end.particles.position).max() < 1e-12
    print(f"{name}, {gravity}: {flights} flights at edges and corners")


def test_nobody_passes_a_hollow_cube():
    cube = swarm.Mesh(*hollow(1e-3), side="outside")
    scene = swarm.Scene([swarm.Box((0.8, 0.8, 0.8)), cube])
    start = swarm.fill(scene, 20_000, speed=1.0, seed=1)
    within = np.abs(start.position).max(axis=0) < 0.5
    end = swarm.simulate(scene, start, swarm.Impact(), until=2000.0 * PART, threads=2, compile="always")
    there = np.abs(end.particles.position).max(axis=0)
    assert there[within].max() <= 0.499 + 1e-12
    assert there[~within].min() >= 0.5 - 1e-12
