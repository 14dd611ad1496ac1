"""Nothing hangs: what gets nowhere ends with a sentence, and the wall time, SIGINT and SIGTERM end any run.

Runs without end are made by force: in plain Python steps of kernels are replaced by ones that let no time pass, and for
compiled ones a kernel is. So they stay without end when scenes that were are mended.
"""

import itertools
import math
import re
import signal
import time
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import pytest
from children import python

import swarm
from examples.own_method import Mirror, MirrorNumbers
from swarm.contact.events import CAREFUL, EVENT
from swarm.events.reacting import queue
from swarm.lanes import block, careful, contact_events, slide
from swarm.lanes.table import LANES
from swarm.run import base, machine, progress, turns
from swarm.run.engine import Run
from swarm.run.machine import run_of
from swarm.run.options import RunOptions
from swarm.run.preflight.admission import task_of
from swarm.run.watch import Watch

FLOOR = swarm.Scene([swarm.Plane((0.0, 0.0, -1.0), 0.0)], (0.0, 0.0, -9.81))
# The first flies, and does not come back; the second slides.
TWO = swarm.Particles([[0.0, 0.2], [0.0, 0.0], [1.0, 0.0]], [[1.0, 1.0], [0.0, 0.0], [50.0, 0.0]])
NOWHERE = "no time passes; .*"
REPORT = "; if nothing is special about the place, it is an error of swarm: please report it with the scene$"


def in_turn(method, walls, gravity, share, i):
    """From one kernel to the next, and no time passes."""
    following = EVENT if share.phase[i] == CAREFUL else CAREFUL
    share.phase[i] = following
    share.pending[following] += 1
    return True


def run_in_plain_python(scene, start, **options):
    return swarm.simulate(scene, start, swarm.Impact(), until=1.0, compile="never", threads=1, **options)


# --- What gets nowhere -----------------------------------------------------------------------------------


@pytest.mark.parametrize("every", [None, 0.05])
def test_turns_between_kernels_without_time_are_bounded(monkeypatch, every):
    """A sentence with particle, wall and time, in long frames and in short ones, which the caller's thread computes."""
    turned = []

    def decide(*about):
        turned.append(about[-1])
        return in_turn(*about)

    monkeypatch.setattr(contact_events, "_decide", decide)
    monkeypatch.setattr(careful, "_step", in_turn)
    monkeypatch.setattr(careful, "return_particle", lambda *about: None)
    where = r"at \(0\.2, 0, 0\) m, at surfaces\[0\] \(Plane\) at 0(\.\d+|e-\d+)? s"
    with pytest.raises(swarm.RunError, match=rf"failed at particle 1: .*{NOWHERE}; it is {where}{REPORT}"):
        run_in_plain_python(FLOOR, TWO, **({} if every is None else {"every": every}))
    assert 1000 <= 2 * len(turned) <= 3 * turns.MOST


class Size(NamedTuple):
    a: float


def of_octahedron(p, x, y, z):
    return abs(x) + abs(y) + abs(z) - p.a


def gradient_of_octahedron(p, x, y, z):
    return math.copysign(1.0, x), math.copysign(1.0, y), math.copysign(1.0, z)


KINKED = swarm.OwnSurface(
    Size(0.5), of_octahedron, gradient_of_octahedron, size=0.5, bounds=((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0))
)
MAY_HAVE = (
    r"; phi of surfaces\[{}\] \(OwnSurface\) must be twice differentiable, but is user-defined and may have a jump, a "
    r"kink or a second derivative above `curvature`"
)


def test_what_gets_nowhere_names_a_user_defined_surface(monkeypatch):
    """Not the wall that is near alone, and it is no error of swarm then."""
    monkeypatch.setattr(contact_events, "_decide", in_turn)
    monkeypatch.setattr(careful, "_step", in_turn)
    monkeypatch.setattr(careful, "return_particle", lambda *about: None)
    kinked = replace(KINKED, side="outside", center=(0.0, 0.0, 50.0))
    scene = swarm.Scene([*FLOOR.surfaces, kinked], FLOOR.gravity)
    with pytest.raises(swarm.RunError, match=rf"{NOWHERE}; it is at .* at surfaces\[0\] .*{MAY_HAVE.format(1)}$"):
        run_in_plain_python(scene, TWO)


def test_a_point_beyond_a_kink_names_what_phi_must_be():
    scene = swarm.Scene([KINKED])
    with pytest.raises(swarm.RunError, match=rf"m outside surfaces\[0\] \(OwnSurface\){MAY_HAVE.format(0)}$"):
        run_in_plain_python(scene, swarm.fill(scene, 5, speed=2.0, seed=1))


def test_a_flight_that_gets_nowhere_is_bounded(monkeypatch):
    passes = []

    def nothing(*about):
        passes.append(1)
        return False, False, False

    monkeypatch.setattr(block, "_pass", nothing)
    with pytest.raises(
        swarm.RunError, match=rf"failed at particle 0: .*{NOWHERE}; it is at \(0, 0, 1\) m.* at 0 s{REPORT}"
    ):
        run_in_plain_python(FLOOR, TWO)
    assert len(passes) <= 2 * block.LOOK


def test_a_slide_that_gets_nowhere_is_bounded(monkeypatch):
    """Also one whose time passes by a hair a step: a crossing would take 1e9 steps."""
    passes = []

    def creep(call, live):
        passes.append(1)
        call.lanes.lane(0).remaining -= 1e-15
        call.lanes.event[0] = 0

    monkeypatch.setattr(slide, "compose", creep)
    monkeypatch.setattr(slide, "end_steps", lambda *about: None)
    monkeypatch.setattr(slide.Slide, "account", lambda *about: None)
    with pytest.raises(
        swarm.RunError, match=rf"failed at particle 1: .*{NOWHERE}; it is at \(0\.2, 0, 0\) m.*{REPORT}"
    ):
        run_in_plain_python(FLOOR, TWO)
    assert len(passes) <= 2 * slide.LOOK


def test_impacts_in_a_gap_of_no_width_are_bounded(monkeypatch):
    """Between two stones that touch a particle goes to and fro without time; in a narrow wedge it comes out again."""
    passes, one_pass = [], block._pass

    def counted(*about):
        passes.append(1)
        return one_pass(*about)

    monkeypatch.setattr(block, "_pass", counted)
    stones = [swarm.Box((0.5, 0.5, 0.1), center=(x, 0.0, 0.0), side="outside") for x in (0.0, 1.0)]
    start = swarm.Particles([[0.3], [0.0], [0.3]], [[1.0], [0.0], [-1.0]])
    with pytest.raises(swarm.RunError, match=r"meets its walls without end, .* at \(0.5, 0, 0.1\) m"):
        run_in_plain_python(swarm.Scene([swarm.Box((3.0, 1.0, 2.0)), *stones]), start)
    assert len(passes) <= 4 * block.LOOK
    passes.clear()
    wedge = [swarm.Plane((way, 0.0, -1.4e-3)) for way in (1.0, -1.0)]
    end = run_in_plain_python(swarm.Scene(wedge), swarm.Particles([[0.0], [0.0], [0.5]], [[1e-18], [0.0], [-1.0]]))
    assert end.particles.velocity[2, 0] > 0.9
    assert len(passes) > block.LOOK


def test_impacts_in_a_cusp_that_is_thinner_than_round_off_are_bounded(monkeypatch):
    """Between two balls that touch a particle would turn round after more impacts than a run has."""
    passes, one_pass = [], block._pass

    def counted(*about):
        passes.append(1)
        assert len(passes) <= 4 * block.LOOK
        return one_pass(*about)

    monkeypatch.setattr(block, "_pass", counted)
    balls = [swarm.Sphere(1.0, center=(0.0, 0.0, z), side="outside") for z in (1.0, -1.0)]
    start = swarm.Particles([[-1e-8], [0.0], [0.0]], [[0.9998], [0.0], [0.02]])
    with pytest.raises(swarm.RunError, match=r"meets its walls without end, as in a cusp"):
        run_in_plain_python(swarm.Scene([swarm.Sphere(9.0), *balls]), start)


@dataclass(frozen=True)
class Lossy(Mirror):
    """A user-defined method that halves the normal velocity at each impact, and lets no particle rest."""

    def numbers(self, scene):
        return LossyNumbers()


class LossyNumbers(MirrorNumbers):
    def contact(self, walls, gravity, lane, wall, solution):
        after = super().contact(walls, gravity, lane, wall, solution)
        return after._replace(v=lane.v + 0.75 * (after.v - lane.v), impulse=0.75 * after.impulse)


def test_a_frame_that_hardly_goes_on_is_a_warning(monkeypatch, caplog):
    """A particle that begins on the wall meets it without end. The warning ends the run here, as Ctrl-C does."""
    monkeypatch.setattr(progress, "LOOK", 0.1)
    monkeypatch.setattr(machine, "LOOK", 0.1)

    def ends(record):
        if "hardly" in record.getMessage():
            signal.raise_signal(signal.SIGINT)
        return True

    caplog.handler.addFilter(ends)
    try:
        with pytest.raises(KeyboardInterrupt):
            swarm.simulate(FLOOR, TWO, Lossy(), until=10.0, compile="never", threads=1)
    finally:
        caplog.handler.removeFilter(ends)
    message = caplog.messages[-1]
    assert re.match(r"frame 1 hardly goes on: .* the last one is particle 1, at \(0\.2, 0, 0\) m", message)
    assert "let slow particles rest. The run goes on" in message


@pytest.mark.parametrize(("cause", "words"), [("", "rest. The run"), ("phi may jump", "rest; phi may jump. The run")])
def test_the_warning_names_what_else_may_be_the_cause(monkeypatch, caplog, cause, words):
    monkeypatch.setattr(progress, "LOOK", 0.0)
    still = progress.Standstill(lambda: cause)
    for _look in range(3):
        still.look(1, 0.0, None, 0.0)
    assert words in caplog.messages[-1]


def test_impacts_without_time_between_them_are_no_standstill():
    """The tip of a wedge: 3141 impacts, most of them sooner after another than the time can tell."""
    angle, tip = 1e-3, 1e-14
    walls = [swarm.Plane((0.0, -1.0, 0.0), 0.0), swarm.Plane((-np.sin(angle), np.cos(angle), 0.0), 0.0)]
    start = swarm.Particles((1.0, 0.5 * angle, 0.0), (-1.0, -0.5 * angle + tip, 0.0))
    result = swarm.simulate(swarm.Scene(walls), start, swarm.Impact(), until=4.0, compile="never")
    assert result.observables["impacts"][-1] == pytest.approx(np.pi / angle, abs=2.0)
    assert result.particles.velocity[0, 0] == pytest.approx(1.0, rel=1e-6)


# --- What ends any run -----------------------------------------------------------------------------------

# The wall time is over, or a signal comes, at the 50th call of `note`.
ENDS = """
import os, signal, sys, time
import swarm
signal.signal(signal.SIGINT, signal.default_int_handler)
real_time, count, ends = time.monotonic, 0, ""

def note():
    global count
    count += 1
    if count == 50 and ends == "walltime":
        time.monotonic = lambda: real_time() + 1e6
    elif count == 50:
        os.kill(os.getpid(), getattr(signal, ends))

def report(scene, start, method, **options):
    global count, ends
    for ends in ("walltime", "SIGINT", "SIGTERM"):
        count, time.monotonic = 0, real_time
        try:
            swarm.simulate(scene, start, method, walltime=1e4, threads=1, **options)
        except (KeyboardInterrupt, swarm.WallTimeError) as stop:
            print(type(stop).__name__, count >= 50)
"""
ALL_END = "WallTimeError True\nKeyboardInterrupt True\nKeyboardInterrupt True\n"
# Turns between kernels without end.
IN_TURN = """
from swarm.contact.events import CAREFUL, EVENT
from swarm.lanes import careful, contact_events
from swarm.run import turns
turns.MOST = 10**12

def again(method, chain, gravity, share):
    note()
    share.pending[EVENT] += 1
    return 0, 0, 0

def in_turn(method, chain, gravity, share, i):
    note()
    following = EVENT if share.phase[i] == CAREFUL else CAREFUL
    share.phase[i] = following
    share.pending[following] += 1
    return True

tier, every = {tier!r}, {every!r}
if tier == "always":
    contact_events.meet_block = again  # of all kernels only this one is not compiled
else:
    contact_events._decide = careful._step = in_turn
    careful.return_particle = lambda *about: None
# It chatters for 0.04 s first.
scene = swarm.Scene([swarm.Plane((0.0, 0.0, -1.0), 0.0, restitution=0.5)], (0.0, 0.0, -9.81))
start = swarm.Particles([0.0, 0.0, 1e-3], [1.0, 0.0, 0.0])
report(scene, start, swarm.Impact(), until=1.0, every=every, compile=tier)
"""


def assert_all_end(script):
    """Nothing but the test itself ends what does not end."""
    done = python("-c", ENDS + script, timeout=300)
    assert done.stdout == ALL_END, done.stderr


@pytest.mark.parametrize(("tier", "every"), [("never", 1.0), ("never", 1e-3), ("always", 1e-3)])
def test_turns_without_end_are_ended(tier, every):
    """In long frames, and in short ones, which the caller's thread computes, without a watcher."""
    assert_all_end(IN_TURN.format(tier=tier, every=every))


def test_a_frame_that_becomes_long_frees_the_callers_thread():
    """It was short until now, so this thread computes it: 1e10 impacts. After a few passes another does."""
    scene = swarm.Scene([swarm.Sphere(0.5)])
    with Run(scene.compiled(), swarm.fill(scene, 10, speed=1.0), swarm.Impact(), 1, None, "always") as run:
        for _ in range(3):
            assert run.advance(1e-3, 1e-3)
        run._pace = 0.0
        assert not run.advance(1e9, 1e9, 0.0, time.monotonic() + 0.1)
        assert run._cut_short


def test_passes_that_become_dear_free_the_callers_thread(monkeypatch):
    """The passes that it computes were cheap until now: it is free in a quarter of a second, whatever one costs."""
    dear, cheap = [], block._pass

    def rest(*about):
        dear.append(time.sleep(0.05))
        return cheap(*about)

    scene = swarm.Scene([swarm.Sphere(0.5)])
    with Run(scene.compiled(), swarm.fill(scene, 1, speed=1.0), swarm.Impact(), 1, None, "never") as run:
        assert run.advance(1e-3, 1e-3)
        run._watch._born = -np.inf
        monkeypatch.setattr(block, "_pass", rest)
        run._pace, alone = 0.0, run._watch._alone[True]
        assert not run.advance(1e9, 1e9, 0.0, time.monotonic() + 0.1)
    assert len(dear) < 100 < alone


def test_a_guard_lets_the_halt_that_is_asked_for_come():
    watch = Watch(10)
    watch._born = -np.inf
    watch.halt(5)
    watch.begin(0.0, helps=True, plain=True)
    time.sleep(0.15)
    assert watch.passes[0] == 5
    watch.end()
    watch.begin(0.0, helps=True, plain=True)
    patience = time.monotonic() + 60.0
    while watch.passes[0] != 0 and time.monotonic() < patience:
        time.sleep(0.01)
    assert watch.passes[0] == 0


def test_a_frame_in_two_threads_has_the_same_bits():
    """Wherever the caller's thread leaves it: after any number of passes."""
    scene = swarm.Scene([swarm.Sphere(0.5)], (0.0, 0.0, -9.81))
    start, ends = swarm.fill(scene, 30, speed=1.0, seed=1), set()
    for alone in (0, 1, 3, 10**6):
        with Run(scene.compiled(), start.copy(), swarm.Impact(), 1, None, "never") as run:
            for moment in (0.5, 1.0, 1.5):
                run._pace, run._watch._alone[True] = 0.0 if alone else np.inf, alone
                assert run.advance(0.5, moment)
            ends.add((run.state.position.tobytes(), run.state.velocity.tobytes(), run.state.impacts.tobytes()))
    assert len(ends) == 1


def test_a_frame_of_no_time_leaves_nothing_for_the_next():
    """Of more particles than lanes some are left when the caller's thread is freed: the next frame moves them too."""
    scene = swarm.Scene([swarm.Sphere(0.5)])
    start, ends = swarm.fill(scene, LANES + 44, speed=1.0, seed=1), set()
    for alone in (1, 10**6):
        with Run(scene.compiled(), start.copy(), swarm.Impact(), 1, None, "never") as run:
            run._watch._alone[True] = alone
            assert run.advance(0.0, 0.0)
            assert run.advance(0.5, 0.5)
            ends.add((run.state.position.tobytes(), run.state.impacts.tobytes()))
    assert len(ends) == 1


def test_a_signal_is_not_lost_when_the_callers_thread_is_freed():
    """Whenever it comes: before, between and after what is done to free it."""
    watch = Watch(10)
    watch.begin(np.inf, helps=True, plain=True)
    assert watch.passes[0] > 0
    assert watch.is_freed(0.0)
    watch.halt()
    watch.begin(np.inf, helps=False, plain=True)
    assert watch.passes[0] == 0
    watch.end()
    watch.begin(np.inf, helps=True, plain=True)
    watch.halt()
    assert not watch.is_freed(0.0)


# Walls that close on a particle with short frames: 1e7 impacts, minutes in plain Python, in the caller's thread.
CLOSING = """
from swarm.lanes import block
real_pass = block._pass
def noted(*about):
    if about[3].moment > 0.1:
        note()
    return real_pass(*about)
block._pass = noted
walls = [
    swarm.Plane((0.0, 0.0, -1.0), 0.0),
    swarm.Plane((0.0, 0.0, 1.0), 0.1, motion=swarm.Translation((0.0, 0.0, -1.0))),
]
scene, start = swarm.Scene(walls), swarm.Particles([0.0, 0.0, 0.05], [0.0, 0.0, 1.0])
report(scene, start, swarm.Impact(), until=0.2, every=0.04, compile="never")
"""
# An inelastic collapse of a wall on a particle.
COLLAPSE = """
from swarm.events.reacting import queue
queue.MOST_HITS, real = 10**15, queue._carry_out
def noted(*about):
    note()
    return real(*about)
queue._carry_out = noted
plate = swarm.Plane((0.0, 0.0, 1.0), 1.0, mass=100.0, restitution=0.5, motion=swarm.Translation((0.0, 0.0, -1.0)))
scene = swarm.Scene([swarm.Plane((0.0, 0.0, -1.0), 0.0, restitution=0.5), plate])
report(scene, swarm.Particles((0.0, 0.0, 0.2), (0.0, 0.0, 1.0), 0.01), swarm.Impact(), until=1e9, compile="never")
"""
# Leases that end at once.
LEASES = """
from swarm.events.reacting import queue
real = queue.take.py_func
def take(*about):
    note()
    return 8, 0
queue.take = take
plate = swarm.Plane((0.0, 0.0, 1.0), 1.0, mass=100.0)
scene = swarm.Scene([swarm.Plane((0.0, 0.0, -1.0), 0.0), plate])
report(scene, swarm.Particles((0.0, 0.0, 0.2), (0.0, 0.0, 1.0), 0.01), swarm.Impact(), until=1e9, compile="never")
"""
CHAIN = """
from swarm.bodies.lanes import advance
real = advance._judge
def noted(*about):
    note()
    return real(*about)
advance._judge = noted
scene = swarm.Scene([swarm.Sphere(0.5)])
start = swarm.place(scene, swarm.chain(3, 0.9, 1.0), 1, speed=1.0, seed=1)
report(scene, start, swarm.Impact(dt=1e-2), until=1e9, compile="never")
"""
# What rests on a wall that moves, in a frame of 2e9 of its swings.
RESTING = """
from swarm.lanes import sticking
real = sticking._clear
def noted(*about):
    note()
    return real(*about)
sticking._clear = noted
floor = swarm.Plane((0.0, 0.0, -1.0), 0.0, friction=0.9, motion=swarm.Oscillation((0.01, 0.0, 0.0), 0.5))
start = swarm.Particles([0.0, 0.0, 0.0], [0.0, 0.0, 0.0])
report(swarm.Scene([floor], (0.0, 0.0, -9.81)), start, swarm.Impact(), until=1e8, compile="never")
"""
SCRIPTS = {"closing": CLOSING, "resting": RESTING, "collapse": COLLAPSE, "leases": LEASES, "chain": CHAIN}


@pytest.mark.parametrize("script", SCRIPTS.values(), ids=SCRIPTS)
def test_what_does_not_end_is_ended(script):
    """Also walls that react, and bodies."""
    assert_all_end(script)


def test_what_rests_where_walls_move_has_the_same_bits_after_halts():
    """It stays for 128 paces at a time, whether it is halted there or not."""
    floor = swarm.Plane((0.0, 0.0, -1.0), 0.0, friction=0.9, motion=swarm.Oscillation((0.01, 0.0, 0.0), 0.5))
    scene = swarm.Scene([floor], (0.0, 0.0, -9.81))
    # As fast as its floor, from where it is not carried away.
    start = swarm.Particles([0.0, 0.0, 0.0], [0.01 * np.pi, 0.0, 0.0])
    ends = []
    for passes in (None, 1, 2):
        with Run(scene.compiled(), start.copy(), swarm.Impact(), 1, None, "never") as run:
            halts = 0
            run.halt(10**6 if passes is None else passes)
            while not run.advance(10.0, 10.0):
                halts += 1
                run.halt(passes)
            assert (halts > 1) == (passes is not None)
            ends.append({name: array.tobytes() for name, array in run.arrays().items()})
    assert ends[0] == ends[1] == ends[2]
    carried = np.frombuffer(ends[0]["position"])
    assert carried == pytest.approx([0.01 * np.sin(2.0 * np.pi * 0.5 * 10.0), 0.0, 0.0], abs=1e-14)


def test_what_comes_to_rest_on_a_mesh_that_moves_has_the_same_bits_after_halts():
    """Wherever they come: in flights, in slides, and between two particles that rest."""
    corners = 0.3 * np.array(list(itertools.product((-1.0, 1.0), (-1.0, 1.0), (-0.05, 0.05))))
    squares = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    triangles = [part for a, b, c, d in squares for part in ((a, b, c), (a, c, d))]
    how = {"motion": swarm.Oscillation((0.02, 0.0, 0.0), 1.5), "friction": 0.8, "restitution": 0.2}
    scene = swarm.Scene([swarm.Mesh(corners, triangles, "outside", **how)], (0.0, 0.0, -9.81))
    as_fast = np.array([3 * [0.06 * np.pi], 3 * [0.0], 3 * [0.0]])
    start = swarm.Particles([[0.02, -0.1, 0.1], [0.01, 0.15, -0.1], [0.01502, 0.0151, 0.01505]], as_fast)
    ends = []
    for passes in (None, 1):
        with Run(scene.compiled(), start.copy(), swarm.Impact(), 1, None, "never") as run:
            halts = 0
            run.halt(10**6 if passes is None else passes)
            while not run.advance(0.02, 0.02):
                halts += 1
                run.halt(passes)
            assert (halts > 3) == (passes is not None)
            assert run.state.contacts.sliding.min() > 0.0
            ends.append({name: array.tobytes() for name, array in run.arrays().items()})
    assert ends[0] == ends[1]


def test_a_collapse_on_a_wall_that_reacts_is_bounded():
    """Without gravity a wall and a particle that lose energy meet ever sooner: at one instant for ever."""
    plate = swarm.Plane((0.0, 0.0, 1.0), 1.0, mass=100.0, restitution=0.5, motion=swarm.Translation((0.0, 0.0, -1.0)))
    scene = swarm.Scene([swarm.Plane((0.0, 0.0, -1.0), 0.0, restitution=0.5), plate])
    start = swarm.Particles((0.0, 0.0, 0.2), (0.0, 0.0, 1.0), 0.01)
    task = task_of(scene, start, swarm.Impact(), RunOptions(until=5.0, compile="never"))
    with (
        run_of(task) as run,
        pytest.raises(swarm.RunError, match=r"particle 0: the particle meets its walls without end"),
    ):
        run.advance(5.0, 5.0)
    assert run.state.impacts[0] < 1.1 * queue.MOST_HITS / queue.AT_ONCE


def test_predictions_that_are_halted_have_the_same_bits(monkeypatch):
    """After any number of particles, also taken over by another run."""
    monkeypatch.setattr(base, "_AT_ONCE_PLAIN", 3)
    plate = swarm.Plane((0.0, 0.0, 1.0), 0.5, mass=1.0)
    scene = swarm.Scene([swarm.Box((0.5, 0.5, 1.0)), plate])
    start = swarm.fill(scene, 20, speed=1.0, seed=1)
    task = task_of(scene, start, swarm.Impact(), RunOptions(until=2.0, compile="never"))
    with run_of(task) as run:
        run.observe()
        assert run.advance(2.0, 2.0)
        whole = {name: array.copy() for name, array in run.arrays().items()}
    run, calls = run_of(task_of(scene, start, swarm.Impact(), RunOptions(until=2.0, compile="never"))), 0
    run.observe()
    predict = run._in_parts

    def halted(*about, **which):
        nonlocal calls
        calls += 1
        predict(*about, **which)
        if calls < 12:
            run.halt()

    run._in_parts = halted
    while not run.advance(2.0, 2.0):
        other = run_of(task_of(scene, start, swarm.Impact(), RunOptions(until=2.0, compile="never")))
        other.restore(run.arrays(), cut_short=True)
        predict = other._in_parts
        other._in_parts, run = halted, other
    assert calls > 12
    for name, array in run.arrays().items():
        assert array.tobytes() == whole[name].tobytes(), name
