"""The search for the instant at which a contact point meets a wall."""

import math
from types import SimpleNamespace

import numpy as np

from swarm.bodies.lanes import impact_time
from swarm.bodies.lanes.through import WayThrough
from swarm.kernel.vector import Vec

DT, ROOM = 2e-3, 2.07e-16


def search(gap, first):
    """How many trials a search takes, and the action that ends it, with the gap of the point after a time."""
    none = np.zeros(1)
    pace = SimpleNamespace(
        step=np.array([DT]), trial=none.copy(), low=none.copy(), high=np.array([math.inf]), inside=none.copy(),
        outside=none.copy(), stuck=np.zeros(1, int), solved=np.ones(1, bool), active=np.zeros(1, int),
        wall=np.full(1, -1), point=np.full(1, -1), remaining=np.array([DT]),
    )  # fmt: skip
    walls = SimpleNamespace(
        fields=lambda: (), joined=lambda: (), unions=(), distance=lambda wall, c: gap(c.x),
        unit_normal=lambda wall, c: Vec(1.0, 0.0, 0.0),
    )  # fmt: skip
    touching = SimpleNamespace(
        plain=np.zeros(1, int), span=lambda k: (0, 1), place=lambda row, k, i: row, dissipates=lambda wall: False
    )
    lanes = SimpleNamespace(r=Vec(0.0, 0.0, 0.0), r1=None, v1=Vec(1.0, 0.0, 0.0))
    bodies = SimpleNamespace(
        touching=touching, rule=SimpleNamespace(dt=DT, room=ROOM), lanes=lanes, pace=pace, walls_then=lambda i: walls,
        active=SimpleNamespace(name=None),
        walls_now=lambda i: walls, is_free=lambda k, i: False, in_cell=lambda k, c, by: c,
        passed=lambda k, c, room, i: WayThrough(math.inf, -1.0, -math.inf), slip=lambda walls, wall, c, u: u,
    )  # fmt: skip
    for trial in range(300):
        pace.step[0] = first if trial == 0 else pace.trial[0]
        lanes.r1 = Vec(float(pace.step[0]), 0.0, 0.0)
        action = impact_time.look(bodies, 0, ROOM)
        if action != impact_time.AGAIN:
            return trial, action, float(pace.step[0])
    return 300, impact_time.AGAIN, float(pace.step[0])


def test_a_gap_that_jumps_over_round_off_at_the_impact_has_its_instant():
    # By round-off a place is two steps of its last bit inside of a wall until a time, and outside from there on: never
    # nearer. So it is for the corner of a die that turns.
    for instant in np.random.default_rng(3).uniform(1e-4, 1.9e-3, 100):

        def gap(t, instant=instant):
            return 0.1 * (t - instant) + math.copysign(1.1 * ROOM, t - instant)

        trials, action, time = search(gap, DT)
        assert action == impact_time.STRIKE
        assert trials < 100
        assert abs(time - instant) < 1e-12 * DT


def test_a_gap_that_grows_steadily_has_its_instant_in_few_trials():
    trials, action, time = search(lambda t: 0.7 * (t - 3e-4) + 2.0 * (t - 3e-4) ** 2, DT)
    assert action == impact_time.STRIKE
    assert trials < 10
    assert abs(0.7 * (time - 3e-4)) <= ROOM
