"""A run in several sessions equals the run in one, for every method in scenes of every kind."""

import pytest
from conftest import METHODS, SURFACES
from test_sessions import require_resumed_is_whole

import swarm

pytestmark = pytest.mark.long

DOWN = (0.0, 0.0, -1.0)
BALL = swarm.Sphere(0.1, (0.2, -0.3, 0.1), side="outside")
BOX = swarm.Box((0.5, 0.4, 0.3), rotation={"axis": (1.0, 2.0, 3.0), "angle": 0.7})
SCENES = {
    **{
        name: swarm.Scene([SURFACES[name]()])
        for name in ("sphere", "ellipsoid", "rotated ellipsoid", "torus", "formula")
    },
    "box": swarm.Scene([BOX]),
    "sphere and ball": swarm.Scene([SURFACES["sphere"](), BALL]),
    "sphere, gravity": swarm.Scene([SURFACES["sphere"]()], DOWN),
    "box and ball, gravity": swarm.Scene([BOX, swarm.Sphere(0.1, side="outside")], DOWN),
}
# A contact with springs takes many passes, a reflection one.
EVERY = {"impact": 16.0, "impact, chord": 16.0}


@pytest.mark.parametrize(
    ("scene", "method"),
    # Steps that are cut at the impact refuse gravity.
    [(s, m) for s in SCENES for m in METHODS if not ("gravity" in s and m == "augmented Lagrangian")],
)
def test_every_method_in_every_scene(tmp_path, scene, method):
    require_resumed_is_whole(tmp_path, SCENES[scene], METHODS[method], n=300, every=EVERY.get(method, 4.0))


@pytest.mark.parametrize("gravity", [None, DOWN], ids=["no gravity", "gravity"])
def test_losses(tmp_path, gravity):
    """The energy of each particle, without what it has lost, is in the checkpoint too."""
    scene = swarm.Scene([swarm.Sphere(0.5, restitution=0.98), swarm.Plane((0.0, 0.0, -1.0), 0.3)], gravity)
    require_resumed_is_whole(tmp_path, scene, swarm.Impact(shortest_flight=1e-2), n=300)
