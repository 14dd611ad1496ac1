"""How a surface bends along a flight, by its normal, beside closed forms."""

import pytest

import swarm
from swarm.kernel.vector import Vec
from swarm.surfaces import curvature

V, PULL = Vec(0.3, 0.4, 0.1), Vec(0.0, 0.1, -9.81)
WALLS = {
    "sphere": (swarm.Sphere(0.5), Vec(0.0, 0.3, -0.4)),
    "ball": (swarm.Sphere(0.5, center=(0.0, 0.0, 1.0), side="outside"), Vec(0.5, 0.0, 1.0)),
    "cylinder": (swarm.Cylinder(0.5), Vec(0.3, -0.4, 7.0)),
    "torus": (swarm.Torus(1.0, 0.25), Vec(1.25, 0.0, 0.0)),
    "plane": (swarm.Plane((0.0, 0.6, 0.8), 1.0), Vec(3.0, 0.6, 0.8)),
}


@pytest.mark.parametrize("name", WALLS)
@pytest.mark.parametrize("speed", [0.0, 1.0, 1e-6])
def test_the_acceleration_out_of_a_wall_follows_from_its_normal(name, speed):
    surface, r = WALLS[name]
    (wall,) = surface.walls()
    normal = wall.unit_normal(r)
    v = speed * (V - (normal.x * V.x + normal.y * V.y + normal.z * V.z) * normal)
    expected = wall.outward_acceleration(r, v, PULL)
    assert curvature.outward_acceleration(wall, r, v, PULL) == pytest.approx(expected, rel=1e-7, abs=1e-9)
