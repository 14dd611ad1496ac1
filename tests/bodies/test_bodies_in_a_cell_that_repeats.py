"""Bodies in a scene that repeats: a scene that is moved has moved places, and a cell beside the next is the same."""

import numpy as np
import pytest
from energy_books import booked

import swarm

LENGTH = 2.0
REST, BOX = np.zeros(3), np.array((1.7, 0.3, 1.0))
MOVE = np.array((0.9, 0.4, -0.3))
DIE = swarm.tetrahedron(edge=0.2, mass=2.0)
CENTERS = np.array([(0.2, 0.3, 0.1), (1.0, 1.75, 1.6)]).T
SPEEDS = np.array([(1.3, 0.9, 0.8), (-1.2, 0.5, -2.0)]).T


def solids(move=REST):
    sphere = swarm.Sphere(0.4, tuple(move + 1.0), "outside")
    return [sphere, swarm.Box((0.3, 0.2, 0.25), tuple(move + BOX), "outside", restitution=0.8)]


def start(move=REST):
    arms = (DIE.points - DIE.points.mean(axis=0)).T
    spin = np.cross((1.0, 2.0, -3.0), arms, axisb=0, axisc=0)
    position = (CENTERS + move[:, None])[:, None] + arms[:, :, None]
    return swarm.Bodies(DIE, position, SPEEDS[:, None] + spin[:, :, None])


def run(scene, bodies, folder, until=1.2, **options):
    return swarm.simulate(
        scene, bodies, swarm.Impact(dt=0.02), until=until, every=until / 3, impacts=folder / "i.h5", compile="never",
        overwrite=True, **options,
    )  # fmt: skip


def log_of(folder):
    with swarm.load_impacts(folder / "i.h5") as log:
        return log.table()


@pytest.mark.parametrize("gravity", [None, (0.3, -0.2, -1.0)])
def test_a_scene_that_is_moved_has_places_that_are_moved(tmp_path, gravity):
    found = []
    for move in (REST, MOVE):
        scene = swarm.Scene(solids(move), gravity=gravity, period=(LENGTH,) * 3)
        counter = swarm.Sphere(0.5, tuple(move + 1.0))
        result = run(scene, start(move), tmp_path, counters=[counter])
        table, seen = log_of(tmp_path), result.observables
        table = table[table["counter"] < 0]
        center = result.bodies.centers()
        assert ((center >= 0.0) & (center < LENGTH)).all()
        assert np.abs(result.particles.image).max() > 0
        assert seen["energy_error"].max() < 1e-12
        assert np.ptp(booked(seen)) < 1e-12 * seen["kinetic_energy"].max()
        assert seen["max_penetration"].max() < 1e-12
        assert ((table["position"] >= 0.0) & (table["position"] <= LENGTH)).all()
        whole = result.particles.position + LENGTH * result.particles.image
        places = table["position"] + LENGTH * table["image"] - move
        found.append((whole - move[:, None], places, table["time"], seen["crossings"][-1]))
    (one, *of_one), (other, *of_other) = found
    assert other == pytest.approx(one, abs=1e-10)
    assert len(of_one[0]) > 1
    assert of_other[0] == pytest.approx(of_one[0], abs=1e-10)
    assert of_other[1] == pytest.approx(of_one[1], abs=1e-10)
    assert (of_other[2] == of_one[2]).all()


def test_a_cell_is_the_same_as_many_solids_beside_one_another(tmp_path):
    beside = [(x, y, z) for x in (-2.0, 0.0, 2.0) for y in (-2.0, 0.0, 2.0) for z in (-2.0, 0.0)]
    spheres = [swarm.Spheres([np.add(shift, 1.0).tolist() for shift in beside], [0.4] * len(beside))]
    ends = []
    for walls, period in ((spheres, None), ([swarm.Sphere(0.4, (1.0, 1.0, 1.0), "outside")], (LENGTH,) * 3)):
        result = run(swarm.Scene(walls, period=period), start(), tmp_path)
        image = result.particles.image
        ends.append((result.particles.position + (0.0 if image is None else LENGTH * image), log_of(tmp_path)))
    assert len(ends[0][1]) > 0
    assert ends[1][0] == pytest.approx(ends[0][0], abs=1e-10)
    assert ends[1][1]["time"] == pytest.approx(ends[0][1]["time"], abs=1e-10)


def test_a_body_longer_than_the_cell_meets_images_of_one_solid(tmp_path):
    # Two balls of a dumbbell, a period and a half apart: one meets the sphere, the other its image.
    rod = swarm.dumbbell(length=3.0, mass=2.0)
    velocity = np.zeros((3, 2, 1))
    velocity[2] = -1.0
    place = rod.points.T[:, :, None] + np.array((1.0, 1.0, 1.8))[:, None, None]
    axis = int(np.argmax(np.ptp(rod.points, axis=0)))
    place[axis] += 0.5
    scene = swarm.Scene([swarm.Sphere(0.4, (1.0, 1.0, 1.0), "outside")], period=(LENGTH,) * 3)
    run(scene, swarm.Bodies(rod, place, velocity), tmp_path, until=0.6)
    table = log_of(tmp_path)
    ends = place[axis, :, 0] % LENGTH
    near = np.flatnonzero(np.abs(ends - 1.0) < 0.4)
    assert len(table) == len(near) == 1
    assert table["position"][0, axis] == pytest.approx(ends[near[0]], abs=1e-12)


def test_what_does_not_repeat_is_refused():
    rod = swarm.Body([(0.0, 0.0, 0.0), (0.1, 0.0, 0.0)], 1.0, links=[(0, 1)], anchors={0: None})
    held = swarm.Bodies(rod, rod.points.T[:, :, None], np.zeros((3, 2, 1)))
    scene = swarm.Scene(solids(), period=(LENGTH,) * 3)
    with pytest.raises(swarm.SceneError, match="period must be None with a body that has anchors or guides, got"):
        swarm.simulate(scene, held, swarm.Impact(dt=0.01), until=1.0)
    with pytest.raises(swarm.SceneError, match=r"period must be None with bodies and Penalty, got"):
        swarm.simulate(scene, start(), swarm.Penalty(dt=0.01, penalty=1e3), until=1.0)
