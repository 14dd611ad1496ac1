"""The accounts of a particle's energy: what it loses and what walls give add up to its change."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

import swarm
from swarm.contact import wall_impact
from swarm.lanes import accounts
from swarm.surfaces.walls import Field

MASS, BEFORE, AFTER, GIVEN, ONE = 3.0, 5.0, 4.0, 0.5, 1
CHANGE = 0.5 * MASS * (AFTER - BEFORE)
DRIFT = swarm.Translation((0.1, 0.0, 0.0))
BALLS = [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
ALONE = [swarm.Sphere(2.0, motion=DRIFT)]
# A field has one row, of listed solids each has one.
MANY = [
    swarm.Box((3.0, 3.0, 3.0), motion=DRIFT), swarm.Spheres(BALLS, 0.1), swarm.Sphere(0.2, side="outside"),
    *(swarm.Sphere(0.1, (0.5, 0.5, 0.3 * k), "outside") for k in range(7)), swarm.Sphere(4.0),
]  # fmt: skip


def opened(surfaces):
    """Walls and an empty account of two particles."""
    walls = swarm.Scene(surfaces).compiled().walls()
    rows = walls.length()
    state = SimpleNamespace(
        mass=np.array([1.0, MASS]), energy=np.zeros(2), dissipated=np.zeros(2), impulse=np.zeros((2 * rows, 2)),
        heat=np.zeros((rows, 2)),
    )  # fmt: skip
    state.energy[ONE] = 0.5 * BEFORE
    return walls, state


@pytest.mark.parametrize("loses", [True, False])
def test_an_impact_on_a_wall_that_moves(loses):
    walls, state = opened(ALONE)
    accounts.book(walls, state, ONE, 0.0, (BEFORE, AFTER), GIVEN, loses)
    work = state.impulse[1, ONE]
    assert work == 0.5 * MASS * (GIVEN if loses else AFTER - BEFORE)
    assert work - state.dissipated[ONE] == CHANGE
    assert (state.dissipated[ONE] > 0.0) == loses
    assert state.energy[ONE] == 0.5 * AFTER


@pytest.mark.parametrize("loses", [True, False])
def test_a_short_step_whose_work_is_booked(loses):
    walls, state = opened(ALONE)
    accounts.book(walls, state, ONE, 0.0, (BEFORE, AFTER), GIVEN, loses, GIVEN)
    work = 0.5 * MASS * GIVEN + state.impulse[1, ONE]
    assert work - state.dissipated[ONE] == CHANGE
    assert (state.dissipated[ONE] > 0.0) == loses
    assert state.energy[ONE] == 0.5 * AFTER


def test_a_wall_at_rest_gives_nothing():
    walls, state = opened([swarm.Sphere(2.0)])
    accounts.book(walls, state, ONE, 0.0, (BEFORE, AFTER), 0.0, True)
    assert -state.dissipated[ONE] == CHANGE
    assert not state.impulse.any()


@pytest.mark.parametrize("lost", [0.0, 0.25, math.inf])
@pytest.mark.parametrize("law", ["all", "some", "none"])
def test_a_law_gives_heat_or_dissipates(law, lost):
    """A loss without an end is all of the change, and then there is no heat."""
    _walls, state = opened(ALONE)
    laws = SimpleNamespace(dissipate_all=law == "all", may_dissipate=law == "some")
    parts = wall_impact.shares(laws, AFTER - BEFORE, lost)
    heat = wall_impact.book_energy(state, (0, ONE, ONE), MASS, SimpleNamespace(lost=parts[0], heat=parts[1]))
    lost = {"all": math.inf, "none": 0.0}.get(law, lost)
    assert heat == state.heat[0, ONE] == (0.0 if lost == math.inf else CHANGE + 0.5 * MASS * lost)
    assert heat - state.dissipated[ONE] == CHANGE


def test_each_wall_has_its_row():
    walls, state = opened(MANY)
    count = sum(int(one.count()) if isinstance(one, Field) else 1 for one in walls.each)
    assert count > walls.length()
    for wall in range(count):
        state.impulse[:] = 0.0
        accounts.add_work(walls, state.impulse, ONE, float(wall), GIVEN)
        assert [tuple(place) for place in np.argwhere(state.impulse)] == [
            (walls.length() + walls.row(float(wall)), ONE)
        ]
