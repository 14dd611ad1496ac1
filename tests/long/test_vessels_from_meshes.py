"""Thousands of particles that chatter, slide, let go and come to rest in a vessel from a mesh, whose walls ripple."""

import pytest
import trimesh
from energy_books import unbooked

import swarm

pytestmark = pytest.mark.long

N, UNTIL = 2000, 3.0


def test_all_of_them_arrive_with_the_right_energy(tmp_path):
    path = tmp_path / "can.stl"
    trimesh.creation.cylinder(radius=0.25, height=0.6, sections=96).export(path)
    scene = swarm.Scene([swarm.from_mesh(path, 0.02, restitution=0.9)], gravity=(0.0, 0.0, -9.81))
    start = swarm.fill(scene, N, speed=1.0, seed=1)
    result = swarm.simulate(scene, start, swarm.Impact(), until=UNTIL, every=0.1, compile="always", progress=False)
    seen = result.observables
    assert unbooked(seen) < 1e-12 * abs(seen["dissipated_energy"][-1])
    assert seen["max_penetration"].max() < 1e-15
    assert seen["dissipated_energy"][-1] > 0.5 * (seen["kinetic_energy"][0] + 9.81 * 0.3 * start.mass.sum())
    # From the particles themselves, not from what is booked
    v, z = result.particles.velocity, result.particles.position[2]
    own = 0.5 * start.mass @ (v**2).sum(axis=0) + 9.81 * start.mass @ z
    assert own == pytest.approx(seen["total_energy"][-1], rel=1e-12)
