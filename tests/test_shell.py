"""The shell of a run: what all engines share is in one class, and does the same for each of them."""

import numpy as np
import pytest

import swarm
from swarm.bodies.body_run import BodyRun
from swarm.events.balls_run import CollidingRun
from swarm.events.heavy_run import HeavyRun
from swarm.events.walls_run import ReactingRun
from swarm.grains.grains_run import GrainsRun
from swarm.kernel.random import seeding_of
from swarm.run.base import BaseRun
from swarm.run.doors import DoorRun
from swarm.run.engine import Run
from swarm.run.machine import run_of
from swarm.run.observed import balance
from swarm.run.options import RunOptions
from swarm.run.preflight.admission import task_of
from swarm.run.tally import Watched, tally_of

BOX, DOWN, ACROSS = swarm.Box((1.0, 1.0, 1.0)), (0.0, 0.0, -1.0), (1.0, 0.0, 0.0)
LID = swarm.Plane((0.0, 0.0, 1.0), 0.95, present=[(0.1, 0.45)])
ROOM = swarm.Scene([BOX])
BELOW = swarm.Scene([swarm.Box((0.8, 0.8, 0.6))])
FRAMES, EVERY = 3, 0.3


def points(scene, radius=None):
    return swarm.fill(scene, 8, speed=1.0, seed=1, radius=radius)


def shelf(**what):
    return swarm.Scene([BOX, swarm.Plane((0.0, 0.0, 1.0), 0.8, **what)])


def piston():
    return swarm.Scene([BOX, swarm.Slab(ACROSS, 0.02, side="outside", mass=5.0, motion=swarm.Guide(ACROSS))])


def heap():
    return swarm.Scene([swarm.Box((1.0, 1.0, 1.0), friction=0.3)], gravity=DOWN, pairs=swarm.Pairs(friction=0.3))


# The engine, the scene, its particles, the method, and whether impacts are counted by walls.
CASES = {
    "points": (Run, ROOM, points(ROOM), swarm.Impact(), True),
    "doors": (DoorRun, swarm.Scene([BOX, LID], gravity=DOWN), points(BELOW), swarm.Impact(), True),
    "reacting": (ReactingRun, shelf(mass=1.0), points(shelf()), swarm.Impact(), True),
    "balls": (CollidingRun, ROOM, points(ROOM, 0.1), swarm.Impact(), True),
    "balls and doors": (CollidingRun, swarm.Scene([BOX, LID]), points(BELOW, 0.05), swarm.Impact(), True),
    "heavy": (HeavyRun, piston(), points(piston(), 0.1), swarm.Impact(), False),
    "grains": (GrainsRun, heap(), points(heap(), 0.1), swarm.Penalty(0.01, 1e3, 1.5), False),
    "bodies": (BodyRun, ROOM, swarm.place(ROOM, swarm.dumbbell(0.2, 1.0), 4, speed=1.0), swarm.Impact(dt=0.05), True),
}
# What an engine may not write again: bodies have sums of their own, and observe the start as any other frame.
SHELL = {"advance", "halt", "share_done", "arrays", "seen", "require_admissible", "observe", "_observing", "_summary"}
SHELL |= {"_advance_piece", "_times", "_called", "_call", "_in_parts", "_limit"}
OWN = {Run: {"seen", "observe"}, GrainsRun: {"observe"}, BodyRun: {"seen", "observe", "require_admissible"}}


def begun(name):
    _kind, scene, start, method, counts = CASES[name]
    options = RunOptions(until=FRAMES * EVERY, every=EVERY, compile="never", threads=1, member_impacts=counts)
    task = task_of(scene, start.copy(), method, options)
    return run_of(task, Watched(None, tally_of(task)))


def ended(name, halted=False):
    """The arrays and observables at the end, and how many halts: each after twice as many passes, by another run."""
    run, (kind, _scene, _start, method, _counts), halts = begun(name), CASES[name], 0
    assert type(run) is kind
    run.observe()
    for k in range(FRAMES):
        moment = (k + 1) * EVERY
        span = method.span("until", moment) - method.span("until", k * EVERY)
        passes = 0
        while True:
            # Not the last frame: some counts are those of its last call.
            if halted and k < FRAMES - 1:
                run.halt(passes)
            if run.advance(span, moment):
                break
            passes = 2 * passes or 1
            assert 0.0 <= run.share_done(span) <= 1.0
            halts += 1
            with run:
                arrays = {name: array.copy() for name, array in run.arrays().items()}
            run = begun(name)
            run.restore(arrays, cut_short=True)
    with run:
        seen = run.seen()
        run.require_admissible(seen, FRAMES * EVERY)
        return {one: array.tobytes() for one, array in run.arrays().items()}, seen, halts


@pytest.mark.parametrize("name", CASES)
def test_a_run_that_is_halted_and_taken_over_has_the_same_bits(name):
    whole, seen, _none = ended(name)
    halted, again, halts = ended(name, halted=True)
    assert halts > 0
    assert halted == whole
    for one, value in seen.items():
        assert np.array_equal(value, again[one], equal_nan=True), one
    assert seen["energy_error"] < (1e-3 if name == "grains" else 1e-9)


def in_pieces(halted):
    """The arrays at the end of one frame, cut at two instants, and the shares done at each halt in a piece."""
    run, shares = begun("doors"), []
    run.observe()
    while True:
        # Once in each piece that is begun.
        for one in [run] * halted:
            switch = one._switch
            one._switch = lambda instant, one=one, switch=switch: (switch(instant), one.halt())
        if run.advance(1.0, 1.0):
            break
        shares.append(run.share_done(1.0))
        with run:
            arrays = {name: array.copy() for name, array in run.arrays().items()}
        run = begun("doors")
        run.restore(arrays, cut_short=True)
    with run:
        return {one: array.tobytes() for one, array in run.arrays().items()}, shares


def test_a_frame_is_halted_in_each_of_its_pieces():
    (whole, none), (halted, shares) = in_pieces(False), in_pieces(True)
    assert none == []
    assert shares == pytest.approx([0.0, 0.1, 0.45])
    assert halted == whole


@pytest.mark.parametrize("kind", dict.fromkeys(kind for kind, *_rest in CASES.values()))
def test_an_engine_does_not_write_the_shell_again(kind):
    assert issubclass(kind, BaseRun)
    for one in kind.__mro__[: kind.__mro__.index(BaseRun)]:
        assert SHELL & vars(one).keys() <= OWN.get(one, set())


def test_the_balance_is_the_energy_without_what_walls_gave():
    seen = {"total_energy": 5.0, "dissipated_energy": 2.0, "wall_heat": np.array([1.0, 0.5])}
    assert balance(seen) == 5.5
    assert balance({**seen, "wall_work": np.array([0.25, 0.25])}) == 5.0


@pytest.mark.parametrize("seed", [0, 1, 2**63 - 1, 2**63, 2**64 - 1])
def test_a_seed_is_the_signed_number_of_the_same_bits(seed):
    seeding = seeding_of(seed)
    assert np.int64(seeding.seed).view(np.uint64) == seeding.unsigned() == seed
