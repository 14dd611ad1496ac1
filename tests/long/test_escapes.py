"""1e9 impacts in scenes of all kinds: no particle leaves its walls, and no energy is lost.

At every frame no particle is outside a wall by more than 1e-12 of the scene's size, and the energy of every particle,
plus what restitution dissipated, is that of the start to 1e-11. Most impacts are in the scenes where one costs
nanoseconds; the others have a million and more. `pytest -m long -s` prints the counts.
"""

import math
import time as clock
from pathlib import Path

import numpy as np
import pytest

import swarm
from swarm import scene_file

pytestmark = pytest.mark.long

FILES = sorted((Path(__file__).parents[2] / "examples" / "scenes").glob("*.toml"))


def has_hard_walls(path):
    """Whether a scene has particles at the start, and walls that they do not enter by design."""
    job = scene_file.read(path)
    return isinstance(job.method, swarm.Impact) and job.scene.surfaces and job.start() is not None


SHIPPED = [path for path in FILES if has_hard_walls(path)]
OUTSIDE, LOST = 1e-12, 1e-11
FRAMES = 50
BILLION = 1_000_000_000

TURN = {"axis": (1.0, 2.0, 3.0), "angle": 0.7}
DOWN = (0.3, -0.2, -9.81)
LID = swarm.Plane((0.0, 0.0, 1.0), 0.6)

# Scenes, gravity, and the least number of impacts in each.
SCENES = {
    "sphere": ([swarm.Sphere(0.5)], None, 250e6),
    "ellipsoid": ([swarm.Ellipsoid((0.3, 0.4, 0.6), (0.1, 0.2, 0.3), rotation=TURN)], None, 250e6),
    "ball in ellipsoid": ([swarm.Ellipsoid((0.3, 0.3, 0.6)), swarm.Sphere(0.15, (0, 0, 0.2), "outside")], None, 150e6),
    "box": ([swarm.Box((0.5, 0.4, 0.3), (0.1, 0.2, 0.3), rotation=TURN)], None, 150e6),
    "can": ([swarm.Cylinder(0.4, (1.0, 0.5, -1.0), 0.9, (0.1, 0.2, 0.3))], None, 150e6),
    "corners": ([swarm.Sphere(0.5), swarm.Plane((1, 0.2, 0), 0.2), swarm.Plane((0, 1, 0.3), 0.1)], None, 50e6),
    "sphere, falling": ([swarm.Sphere(0.5)], DOWN, 20e6),
    "box, falling": ([swarm.Box((0.5, 0.4, 0.3), rotation=TURN)], DOWN, 10e6),
    "can, falling": ([swarm.Cylinder(0.4, (1.0, 0.5, -1.0), 0.9)], DOWN, 10e6),
    "cone and lid": ([swarm.Cone(0.6), LID], None, 10e6),
    "cone and lid, falling": ([swarm.Cone(0.6), LID], DOWN, 2e6),
    "bowl and lid, falling": ([swarm.Paraboloid(0.2), LID], DOWN, 2e6),
    "torus": ([swarm.Torus(0.5, 0.2, rotation=TURN)], None, 10e6),
    "torus, falling": ([swarm.Torus(0.5, 0.2)], DOWN, 2e6),
    "capsule": ([swarm.Capsule(0.3, 0.5, (1.0, 0.5, -1.0))], None, 10e6),
    "capsule, falling": ([swarm.Capsule(0.3, 0.5)], DOWN, 2e6),
    "formula": ([swarm.Formula("x**2/0.09 + y**2/0.09 + z**4/0.13 - 1")], None, 5e6),
    "formula, falling": ([swarm.Formula("x**2/0.09 + y**2/0.09 + z**4/0.13 - 1")], DOWN, 1e6),
    "hourglass": ([swarm.Quadric(np.diag([1.0, 2.0, -1.5]), constant=-0.05), swarm.Box((0.5, 0.4, 0.5))], None, 5e6),
    "solids in a sphere": (
        [
            swarm.Sphere(1.0),
            swarm.Box((0.15, 0.1, 0.2), (0.1, 0.0, -0.6), "outside", rotation=TURN),
            swarm.Cylinder(0.1, (1.0, 1.0, 0.0), 0.5, (0.0, 0.0, 0.6), "outside"),
            swarm.Torus(0.5, 0.1, side="outside"),
        ],
        None,
        2e5,
    ),
    "lossy box, falling": ([swarm.Box((0.5, 0.4, 0.3), rotation=TURN, restitution=0.9)], DOWN, 1e6),
    "lossy sphere": ([swarm.Sphere(0.5, restitution=0.99)], None, 1e6),
    "lossy sphere, falling": ([swarm.Sphere(0.5, restitution=0.8)], DOWN, 1e6),
}
COUNTED = {}


def checked(scene, particles, method, until, name):
    """Run to `until` and check every frame. Returns the number of impacts."""
    result = swarm.simulate(scene, particles, method, until=until, every=until / FRAMES, threads=2, progress=False)
    seen, size = result.observables, scene.finite_size()
    outside, lost = float(seen["max_penetration"].max()) / size, float(seen["energy_error"].max())
    worst = COUNTED.setdefault(name, [0, 0.0, 0.0])
    impacts = int(seen["impacts"][-1])
    COUNTED[name] = [worst[0] + impacts, max(worst[1], outside), max(worst[2], lost)]
    assert outside <= OUTSIDE
    assert lost <= LOST
    # Independently of the observables: no particle is behind a wall.
    points = result.particles.position if result.bodies is None else result.bodies.contact_points().reshape(3, -1)
    gaps = scene.gaps(points)
    assert np.isfinite(points).all()
    assert gaps.max() <= 1e-9
    return impacts


def report(name, began, capsys):
    """Print one line with the counts."""
    impacts, outside, lost = COUNTED[name]
    with capsys.disabled():
        print(
            f"\n{name:28} {impacts:>13,} impacts, outside by {outside:.1e} of the size, energy off by {lost:.1e},"
            f" {clock.perf_counter() - began:.1f} s",
            end="",
        )


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_nothing_escapes_in_the_shipped_scenes(path, capsys):
    began, job = clock.perf_counter(), scene_file.read(path)
    checked(job.scene, job.start(), job.method, job.run.until, path.stem)
    report(path.stem, began, capsys)


@pytest.mark.parametrize("name", SCENES)
def test_nothing_escapes(name, capsys):
    began = clock.perf_counter()
    surfaces, gravity, wanted = SCENES[name]
    scene = swarm.Scene(surfaces, gravity=gravity)
    particles = swarm.fill(scene, 2000, speed=1.0, seed=9)
    # Particles come to slide: coarse sliding steps are cheap, and test escapes as well as fine ones.
    method = swarm.Impact(shortest_flight=1e-3) if gravity else swarm.Impact()
    trial = 2.0
    impacts = checked(scene, particles, method, trial, name)
    if impacts < wanted:
        # With losses impacts end, or sliding does not.
        until = trial * min(wanted / max(impacts, 1), 1e7)
        if surfaces[0].restitution < 1.0:
            until = min(until, 50.0 * trial)
        else:
            until *= 1.1
        impacts = checked(scene, particles, method, until, name)
    report(name, began, capsys)
    assert impacts >= (wanted if surfaces[0].restitution == 1.0 else 1e4)
    assert math.isfinite(COUNTED[name][2])


def test_the_sum_is_a_billion(capsys):
    """Runs last: the sum over the other tests."""
    with capsys.disabled():
        print(f"\n{sum(impacts for impacts, _outside, _lost in COUNTED.values()):,} impacts, no escape", end="")
    assert sum(wanted for surfaces, _gravity, wanted in SCENES.values() if surfaces[0].restitution == 1.0) >= BILLION
