"""Particles that start on the wrong side of a wall: the error says of which, how far, and what would mend it."""

import re

import numpy as np
import pytest
from conftest import SURFACES, every_surface
from test_cli import command

import swarm
from swarm.run.preflight.starts import require_inside

DEPTH = 0.02
ROOM = swarm.Box((5.0, 5.0, 5.0))


def started(surfaces, position):
    """What is said of particles at these places."""
    position = np.array(position, dtype=np.float64)
    with pytest.raises(swarm.SceneError) as caught:
        require_inside(swarm.Scene(surfaces), swarm.Particles(position, np.zeros_like(position)))
    return str(caught.value), caught.value.particle


def beyond(surface, depth):
    """A place that far outside of the admissible side, found between one inside and one outside."""
    side = -1.0 if surface.is_solid() else 1.0
    points = np.random.default_rng(1).uniform(-1.5, 1.5, (3, 1000))
    gaps = side * surface.phi(points)
    low, high = points[:, np.argmin(gaps)], points[:, np.argmax(gaps)]
    for _halving in range(60):
        wall = 0.5 * (low + high)
        low, high = (low, wall) if side * surface.phi(wall[:, None])[0] > 0.0 else (wall, high)
    normal = side * surface.gradient(wall[:, None])[:, 0]
    return wall + depth * normal / np.sqrt(normal @ normal)


@every_surface
def test_how_far_and_which_side(name):
    surface = SURFACES[name]()
    message, particle = started([surface, ROOM], beyond(surface, DEPTH)[:, None])
    assert particle == 0
    side = "inside" if surface.is_solid() else "beyond" if name == "plane" else "outside"
    found = re.search(rf"([\d.e-]+) m {side} surfaces\[0\] \({type(surface).__name__}\): admissible is ", message)
    assert found is not None, message
    # Along the gradient, not by the shortest way, where the two differ.
    assert float(found[1]) == pytest.approx(DEPTH, rel=0.02)
    which = "its outside, where phi is 0 or more" if surface.is_solid() else "its inside, where phi is 0 or less"
    assert ("normal.r <= offset" if name == "plane" else which) in message
    assert re.search(r"and phi = |and normal.r = ", message)


BALL, PEBBLE = swarm.Sphere(0.5), swarm.Sphere(0.5, side="outside")
LINE = [[0.0, 0.1, 0.2], [0.0] * 3, [0.0] * 3]


@pytest.mark.parametrize(
    ("surfaces", "position", "sentences"),
    [
        ([PEBBLE, ROOM], LINE, ["got 3 of 3 outside;", 'surface side = "inside", if its other side is meant']),
        ([swarm.Plane((0, 0, -1), -1.0), ROOM], LINE,
         ["1 m beyond surfaces[0] (Plane)", "the reversed normal, normal = (0.0, 0.0, 1.0) and offset = 1,"]),
        ([swarm.Box((0.5,) * 3)], [[0.05, 0.9], [0.1, 0.95], [0.02, 0.6]],
         ["particle 1 at", "0.61 m outside", "surface center = (0.475, 0.525, 0.31), which holds all of them"]),
        ([BALL], [[0.0, 0.6], [0.0, 0.0], [0.0, 0.0]], ["particle 1", "0.1 m outside", "center = (0.3, 0.0, 0.0)"]),
        ([BALL], [[0.0, 0.6, -3.0], [0.0] * 3, [0.0] * 3], ["got 2 of 3 outside; ", "move them, or let swarm.fill"]),
        ([BALL], [[0.6], [0.0], [0.0]], ["got 1 of 1 outside", "; move it, or let swarm.fill"]),
        ([ROOM, swarm.Sphere(0.5, side="outside")], [[0.1, 6.0, 1.0, 7.0], [0.0] * 4, [0.0] * 4],
         ["got 3 of 4 outside (surfaces[0]: 2, surfaces[1]: 1); the first is particle 0", "0.4 m inside surfaces[1]"]),
        ([swarm.Spheres([(0, 0, 0), (0.5, 0, 0)], 0.3), ROOM], LINE, ["inside surfaces[0] (Spheres): admissible is"]),
    ],
)  # fmt: skip
def test_what_would_mend_it(surfaces, position, sentences):
    message, _particle = started(surfaces, position)
    for sentence in sentences:
        assert sentence in message


def test_balls_are_reported_too():
    scene = swarm.Scene([swarm.Box((0.5,) * 3)])
    balls = swarm.Particles([[0.0, 0.45], [0.0] * 2, [0.0] * 2], np.zeros((3, 2)), radius=0.1)
    with pytest.raises(
        swarm.SceneError, match=r"beyond surfaces\[0\] \(Box\): admissible is its inside, .*; "
    ) as caught:
        swarm.simulate(scene, balls, swarm.Impact(), until=1.0)
    assert caught.value.particle == 1


def test_the_row_of_a_file_is_named(tmp_path):
    """An empty row belongs to no particle."""
    (tmp_path / "start.csv").write_text("x,y,z,vx,vy,vz\n0,0,0,1,0,0\n\n0.1,0,0,1,0,0\n0.7,0,0,1,0,0\n")
    text = '[particles]\nfrom = "start.csv"\n[[surface]]\nkind = "sphere"\nradius = 0.5\n[method]\nkind = "impact"\n'
    (tmp_path / "scene.toml").write_text(text + "[run]\nuntil = 1.0\n")
    done = command("run", "scene.toml", cwd=tmp_path)
    assert done.returncode == 2
    assert "start.csv, row 5: particles must start inside their walls, got 1 of 3 outside" in done.stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == ["scene.toml", "start.csv"]


def test_cavities_that_are_apart_are_named():
    apart = swarm.Sphere(0.5, (2.0, 0.0, 0.0))
    with pytest.raises(
        swarm.SceneError, match=r"surfaces\[0\] \(Sphere\) and surfaces\[2\] \(Sphere\) are apart: .*Union"
    ):
        swarm.Scene([BALL, swarm.Sphere(0.1, side="outside"), apart])
    with pytest.raises(swarm.SceneError, match="check their `side`"):
        swarm.Scene([BALL, swarm.Sphere(0.6, side="outside")])


def test_a_polygon_that_holds_particles_keeps_none_out():
    table = swarm.Polygon([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
    message, _particle = started([table], [[1.5], [0.5], [0.0]])
    assert "0.5 m outside surfaces[0] (Polygon): admissible is its inside, where phi is 0 or less" in message


@pytest.mark.parametrize("gravity", [None, (0.0, 0.0, -9.81)])
@pytest.mark.parametrize("surface", [swarm.Sphere(0.5), swarm.Box((0.5, 0.5, 0.5))], ids=["sphere", "box"])
def test_a_run_ends_where_another_begins_with_soft_walls_too(surface, gravity):
    """Two runs are one, to round-off, also where particles press on walls between them."""
    scene, soft = swarm.Scene([surface], gravity), swarm.Penalty(dt=5e-4, penalty=1e3)
    start = swarm.fill(scene, 20, speed=1.0, seed=1)
    whole = swarm.simulate(scene, start, soft, until=0.75)
    half = swarm.simulate(scene, start, soft, until=0.5)
    assert half.observables["contact_energy"][-1] > 1e-3
    again = swarm.simulate(scene, half.particles, soft, until=0.25)
    assert again.particles.position == pytest.approx(whole.particles.position, abs=1e-12)
    assert again.observables["energy_error"].max() < 1e-14


def test_a_start_deeper_than_any_contact_is_an_error_with_soft_walls_too():
    scene, soft = swarm.Scene([swarm.Sphere(0.5)]), swarm.Penalty(dt=1e-4, penalty=1e6)
    with pytest.raises(swarm.SceneError, match=r"0\.01 m outside"):
        swarm.simulate(scene, swarm.Particles((0.51, 0.0, 0.0), (1.0, 0.0, 0.0)), soft, until=0.1)
