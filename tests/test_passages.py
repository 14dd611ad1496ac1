"""Openings of walls between the rooms of a union: a particle that comes to one goes on in the other room."""

import math

import numpy as np
import pytest
from conftest import rarely
from test_openings import run, thrown
from test_sessions import require_resumed_is_whole

import swarm
from swarm.run.doors import DoorRun

DOWN = (0.0, 0.0, -1.0)
DOOR = swarm.Sphere(0.2)


def two(opening=None, one=None, other=None, **law):
    """Two boxes side by side, with openings of the whole, or of each."""
    left = swarm.Box((0.5, 0.4, 0.3), center=(-0.5, 0.0, 0.0), openings=[one] if one else [], **law)
    right = swarm.Box((0.5, 0.4, 0.3), center=(0.5, 0.0, 0.0), openings=[other] if other else [], **law)
    return swarm.Union([left, right], openings=[opening] if opening else [])


WAYS = {
    "the whole": two(DOOR),
    "the one": two(one=DOOR),
    "the other": two(other=DOOR),
    "both": two(None, DOOR, DOOR),
    "between": two(swarm.Opening(DOOR, between=True)),
    "between, of one": two(one=swarm.Opening(DOOR, between=True)),
}


@pytest.mark.parametrize("union", WAYS.values(), ids=WAYS)
def test_a_hole_of_a_wall_between_two_rooms_lets_through_both_ways(union):
    start = thrown(
        [(-0.5, 0, 0), (0.5, 0, 0.1), (-0.5, 0.3, 0), (0.5, 0, 0.25)], [(1, 0, 0), (-1, 0, 0), (1, 0, 0), (-1, 0, 0)]
    )
    found = run(swarm.Scene([union]), start, until=1.0, frames=4)
    assert found.particles.position[0].tolist() == pytest.approx([0.5, -0.5, -0.5, 0.5], abs=1e-12)
    assert found.impacts_per_particle.tolist() == [0, 0, 1, 1]
    assert np.isnan(found.escape_time).all()
    assert found.observables["escaped"].tolist() == [0] * 5


@pytest.mark.parametrize("gravity", [None, (0.0, -0.3, -0.2), (0.5, 0.0, -1.0)])
def test_two_rooms_with_no_wall_between_them_are_one(gravity):
    face = swarm.Opening(swarm.Box((0.1, 1.0, 1.0)), between=True)
    start = swarm.fill(swarm.Scene([two()]), 100, speed=1.0, seed=1)
    found = run(swarm.Scene([two(face)], gravity), start, until=2.0, frames=4)
    whole = run(swarm.Scene([swarm.Box((1.0, 0.4, 0.3))], gravity), start, until=2.0, frames=4)
    assert found.particles.position == pytest.approx(whole.particles.position, abs=1e-9)
    assert (found.impacts_per_particle == whole.impacts_per_particle).all()
    assert found.observables["energy_error"].max() < 1e-12
    assert swarm.Scene([two()]).distances_outside(found.particles.position).max() < 1e-12


def test_an_opening_outwards_stays_an_exit():
    """Also where the volume reaches into the other room, whose outer walls it leaves alone."""
    wide = swarm.Sphere(0.35, center=(-0.1, 0.0, 0.3))
    start = thrown([(-0.2, 0, 0), (0.1, 0, 0), (0.4, 0, 0)], [(0, 0, 1)] * 3)
    found = run(swarm.Scene([two(one=wide)]), start, until=1.0, frames=1)
    assert np.isnan(found.escape_time).tolist() == [False, True, True]
    # Of the whole it opens the walls of both.
    found = run(swarm.Scene([two(wide)]), start, until=1.0, frames=1)
    assert np.isnan(found.escape_time).tolist() == [False, False, True]


def test_through_a_round_wall():
    """A ball in a box around it: rooms that touch where the wall is round."""
    ball = swarm.Sphere(0.5)
    around = swarm.Intersection([swarm.Box((1.0, 1.0, 1.0)), swarm.Sphere(0.5, side="outside")])
    hole = swarm.Cylinder(0.1)
    scene = swarm.Scene([swarm.Union([ball, around], openings=[hole])])
    # Along the hole to the lid of the box, which the endless cylinder opens; beside it; from outside.
    start = thrown(
        [(0, 0, 0.01), (0.2, 0, 0), (0.7, 0, 0), (0.05, 0, 0.9)], [(0, 0, 1), (0, 0, 1), (-1, 0, 0), (0, 0, -1)]
    )
    found = run(scene, start, until=2.0, frames=2)
    assert found.escape_time.tolist() == pytest.approx([0.99, np.nan, np.nan, 1.9], nan_ok=True)
    assert found.impacts_per_particle.tolist()[::3] == [0, 0]
    assert found.impacts_per_particle[1] > 1


@pytest.mark.parametrize("law", [{}, {"friction": 0.1}, {"restitution": 0.7}])
def test_what_slides_slides_on_in_the_other_room(law):
    # In the doorway, and beside it.
    door = swarm.Opening(swarm.Box((0.1, 0.1, 0.4)), between=True)
    start = thrown([(-0.45, 0, -0.3), (-0.47, 0.3, -0.3), (-0.25, 0.0, -0.3)], [(1, 0, 0), (1, 0, 0), (1, 0, 0)])
    found = run(swarm.Scene([two(door, **law)], DOWN), start, until=0.6, frames=3)
    free = run(swarm.Scene([swarm.Box((1.0, 0.4, 0.3), **law)], DOWN), start, until=0.6, frames=3)
    assert found.particles.position[:, [0, 2]] == pytest.approx(free.particles.position[:, [0, 2]], abs=1e-8)
    assert found.particles.position[0, 1] < 0.0
    assert found.observables["sliding"].tolist() == [0, 3, 3, 3]
    assert found.observables["energy_error"].max() < 1e-12


def test_through_a_hatch_in_the_floor():
    above = swarm.Box((0.5, 0.5, 0.5), center=(0, 0, 0.5))
    below = swarm.Box((0.5, 0.5, 0.5), center=(0, 0, -0.5))
    hatch = swarm.Sphere(0.1)
    scene = swarm.Scene([swarm.Union([above, below], openings=[hatch])], DOWN)
    # Falls through; falls beside; slides to its edge and falls; flies through it from below.
    start = thrown(
        [(0, 0, 0.5), (0.3, 0, 0.5), (-0.2, 0, 1e-9), (0.0, 0.0, -0.1)], [(0, 0, 0), (0, 0, 0), (1, 0, 0), (0, 0, 1)]
    )
    found = run(scene, start, until=0.5, frames=1)
    z = found.particles.position[2]
    assert z.tolist() == pytest.approx([0.5 - 0.125, 0.5 - 0.125, -0.5 * 0.4**2, -0.1 + 0.5 - 0.125], abs=5e-5)
    found = run(scene, start, until=1.2, frames=1)
    assert found.particles.position[2, :2].tolist() == pytest.approx([0.5 - 0.72, 0.18], abs=1e-8)


def test_what_rests_at_a_door_that_opens_goes_on_only_if_it_is_pulled():
    def found(gravity):
        union = two(
            swarm.Opening(swarm.Sphere(0.2, center=(0, 0, -0.3)), [(0.5, math.inf)], between=True), restitution=0.2
        )
        start = thrown([(-0.01, 0, -0.3), (-0.01, 0.3, -0.3)], [(0, 0, 0)] * 2)
        return run(swarm.Scene([union], gravity), start, until=1.0, frames=2).particles.position[0]

    assert found((1.0, 0.0, -1.0)) == pytest.approx([0.125, 0.0], abs=1e-6)
    assert found((0.0, 0.0, -1.0)) == pytest.approx([-0.01, -0.01], abs=1e-12)


# --- Doors -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("compile", ["never", "always"])
def test_two_rooms_of_which_the_door_opens(compile):
    door = swarm.Opening(swarm.Box((0.1, 1.0, 1.0)), [(0.5, 1.25)], between=True)
    scene = swarm.Scene([two(door)])
    start = swarm.fill(scene, 400, temperature=1.0, seed=2)
    start.position[0] = -np.abs(start.position[0])
    found = run(scene, start, until=2.0, frames=8, compile=compile, trajectory=None)

    def folded(x, low, high):
        """The place between two walls, and whether it flies back."""
        x = np.mod(x - low, 2.0 * (high - low))
        return low + np.where(x > high - low, 2.0 * (high - low) - x, x), x > high - low

    x, v = start.position[0], start.velocity[0]
    x, back = folded(x + 0.5 * v, -1.0, 0.0)
    v = np.where(back, -v, v)
    x, back = folded(x + 0.75 * v, -1.0, 1.0)
    v, is_right = np.where(back, -v, v), x > 0.0
    x = np.where(is_right, folded(x + 0.75 * v, 0.0, 1.0)[0], folded(x + 0.75 * v, -1.0, 0.0)[0])
    assert found.particles.position[0] == pytest.approx(x, abs=1e-11)
    assert np.isnan(found.escape_time).all()


@pytest.mark.physics
def test_densities_equalise_through_a_door_at_the_rate_of_effusion():
    n, begin, radius = 20_000, 5.0, 0.05
    door = swarm.Opening(swarm.Cylinder(radius, axis=(1.0, 0.0, 0.0)), [(begin, math.inf)], between=True)
    wall = {"temperature": 1.0}
    left = swarm.Box((0.5, 0.5, 0.5), center=(-0.5, 0.0, 0.0), **wall)
    right = swarm.Box((0.25, 0.5, 0.5), center=(0.25, 0.0, 0.0), **wall)
    scene = swarm.Scene([swarm.Union([left, right], openings=[door])])
    start = swarm.fill(swarm.Scene([left]), n, temperature=1.0, seed=5)
    path = []
    found = run(scene, start, until=60.0, frames=12, compile="always", threads=2, progress=path.append)
    assert np.isnan(found.escape_time).all()
    # dN/dt = -k N + 2 k (n - N), k = A <|v|>/4V with <|v|> = sqrt(8 kT/pi m): N = n (2 + exp(-3 k t))/3.
    rate = math.pi * radius**2 * math.sqrt(8.0 / math.pi) / 4.0
    expected = n / 3.0 * (2.0 + math.exp(-3.0 * rate * (60.0 - begin)))
    there = int((found.particles.position[0] < 0.0).sum())
    error = math.sqrt(n * expected / n * (1.0 - expected / n))
    assert abs(there - expected) <= 3.0 * error


def doorway(gravity):
    """Two rooms with a door and a shutter, in which particles slide."""
    door = swarm.Opening(swarm.Sphere(0.25, center=(0.0, 0.0, -0.3)), [(0.25, 0.75), (1.5, math.inf)], between=True)
    return swarm.Scene([two(door, restitution=0.7, friction=0.02)], gravity)


@pytest.mark.physics
@pytest.mark.parametrize("gravity", [None, rarely((0.3, 0.1, -1.0))])
def test_halts_and_sessions_leave_the_bits(tmp_path, gravity):
    require_resumed_is_whole(tmp_path, doorway(gravity), swarm.Impact(), n=100, every=3.0, kind=DoorRun)


@pytest.mark.level3
@pytest.mark.physics
@pytest.mark.parametrize("gravity", [None, rarely((0.3, 0.1, -1.0))])
def test_the_same_bits_compiled_and_for_threads(gravity):
    scene = doorway(gravity)
    start = swarm.fill(scene, 300, speed=0.5, seed=1)
    one = run(scene, start, until=3.0, frames=4)
    for options in ({"threads": 2}, {"threads": 2, "block_size": 128}):
        two = run(scene, start, until=3.0, frames=4, compile="always", **options)
        for name in ("position", "velocity"):
            assert (getattr(one.particles, name) == getattr(two.particles, name)).all()
    assert np.isnan(one.escape_time).all()
    crossed = (start.position[0] < 0.0) != (one.particles.position[0] < 0.0)
    assert crossed.sum() > 8
    assert scene.distances_outside(one.particles.position).max() < 1e-12


@pytest.mark.long
@pytest.mark.parametrize("gravity", [None, (0.1, 0.05, -1.0)])
def test_nobody_is_lost_in_a_maze_of_rooms(gravity):
    """Random rooms that touch, with doors between them."""
    rooms = [swarm.Box((0.5, 0.5, 0.25), center=(x, y, 0.0)) for x in (-0.5, 0.5, 1.5) for y in (-0.5, 0.5)]
    doors = [swarm.Sphere(0.2, center=(x, y, 0.0)) for x in (0.0, 1.0) for y in (-0.5, 0.5)]
    doors += [swarm.Sphere(0.2, center=(x, 0.0, -0.1)) for x in (-0.5, 0.5, 1.5)]
    # They reach the floor.
    doors = [swarm.Opening(one, between=True) for one in doors]
    scene = swarm.Scene([swarm.Union(rooms, openings=doors)], gravity)
    found = run(scene, swarm.fill(scene, 2000, speed=1.0, seed=1), until=300.0, frames=3, compile="always", threads=2)
    assert found.observables["escaped"][-1] == 0
    assert scene.distances_outside(found.particles.position).max() < 1e-12
    assert found.observables["energy_error"].max() < 1e-10
    share = np.histogram2d(*found.particles.position[:2], bins=[[-1, 0, 1, 2], [-1, 0, 1]])[0]
    if gravity is None:
        assert np.abs(share - 2000 / 6).max() < 4.0 * math.sqrt(2000 / 6)
