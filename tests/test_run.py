"""The shares of a frame: every particle is in one, whichever thread takes it; and where a frame halts."""

import math
import threading

import numba
import numpy as np
import pytest

import swarm
from swarm import observables
from swarm.common.status import Status
from swarm.contact import events
from swarm.kernel.arrays import next_of
from swarm.kernel.jit import kernel
from swarm.kernel.random import UNSEEDED
from swarm.lanes import lane_arrays as lanes
from swarm.lanes.block import NEVER
from swarm.lanes.share import Draws, Share, ThreadPlace
from swarm.lanes.table import LANES
from swarm.run import watch
from swarm.run.engine import Run

SPHERE = swarm.Scene([swarm.Sphere(0.5)])


@kernel
def draw_all(ticket, most, seen):
    """Mark what is drawn, until all is."""
    while True:
        k = next_of(ticket)
        if k >= most:
            return
        seen[k] += 1


def test_no_two_threads_draw_the_same():
    most = 2_000 if numba.config.DISABLE_JIT else 2_000_000
    ticket, seen = np.zeros(1, np.int64), [np.zeros(most, np.int64) for _ in range(3)]
    draw_all(ticket.copy(), 0, seen[0])  # compiled before the threads race
    threads = [threading.Thread(target=draw_all, args=(ticket, most, one)) for one in seen]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert np.array_equal(sum(seen), np.ones(most))
    assert ticket[0] == most + len(threads)


@pytest.mark.parametrize("size", [1, 7, 64])
@pytest.mark.parametrize("n", [1, 63, 64, 65, 200])
def test_every_particle_that_is_not_done_follows_once(n, size):
    phase = np.where(np.random.default_rng(n).random(n) < 0.4, events.ARRIVED, events.FLYING).astype(np.int8)
    number, pending = -(-n // size), np.zeros(events.PHASES, np.int64)
    draws = Draws(np.zeros(1, np.int64), np.arange(number), size, np.empty(number, np.int64))
    share = Share(None, phase, pending, lanes.none_halted(1), draws, np.zeros(1, np.int64), 1.0, UNSEEDED, 1.0)
    place, found = share.following(events.FLYING, ThreadPlace(0, 0, 0)), []
    while not place.is_end():
        found.append(place.i)
        place = share.following(events.FLYING, place.after())
    assert found == np.flatnonzero(phase == events.FLYING).tolist()
    assert pending.sum() == pending[events.ARRIVED] == n - len(found)
    assert draws.mine[: place.drawn].tolist() == list(range(len(draws.mine)))


@pytest.mark.parametrize("n", [1, observables.CHUNK, 3 * observables.CHUNK + 5])
@pytest.mark.parametrize(("threads", "block_size"), [(1, None), (2, None), (3, 2 * observables.CHUNK), (2, 10**9)])
def test_the_start_and_every_frame_are_observed_whole(n, threads, block_size):
    particles = swarm.fill(SPHERE, n, speed=1.0, seed=1)
    with Run(SPHERE.compiled(), particles, swarm.Impact(), threads, block_size) as run:
        run.observe()
        for moment in (0.0, 0.3, 0.6):
            if moment > 0.0:
                run.advance(0.3, moment)
            seen = run.seen()
            momentum = run.state.velocity @ run.state.mass
            assert seen["momentum"] == pytest.approx(momentum, abs=1e-13 * n)
            assert seen["kinetic_energy"] == pytest.approx(0.5 * n, rel=1e-13)


def test_a_short_frame_uses_no_thread(monkeypatch):
    """And a long one after it does: what counts is the work in it, by the pace of the last."""
    # A slow machine frees the caller's thread, and others take the frame up.
    monkeypatch.setattr(watch, "_FREED", math.inf)
    particles = swarm.fill(SPHERE, 4 * observables.CHUNK, speed=1.0, seed=1)
    with Run(SPHERE.compiled(), particles, swarm.Impact(), 2, None) as run:
        run._watch._alone = dict.fromkeys((False, True), NEVER)
        run.advance(0.1, 0.1)
        monkeypatch.setattr(run, "_pace", 1e-3)
        submitted, submit = [], run._pool.submit
        monkeypatch.setattr(run._pool, "submit", lambda *job: submitted.append(job) or submit(*job))
        run.advance(0.1, 0.2)
        assert submitted == []
        monkeypatch.setattr(run, "_pace", 1e-3)
        run.advance(1.0, 1.2)
        assert len(submitted) == 1
        monkeypatch.setattr(run, "_pace", 1.0)
        run.advance(1.0, 2.2)
        assert len(submitted) == 3


# --- Halts ------------------------------------------------------------------------------------------------


def along_diameters(n):
    """Particles that start in the middle of SPHERE: they meet its wall at 0.5 s, 1.5 s, ..."""
    directions = swarm.fill(SPHERE, n, speed=1.0, seed=1).velocity
    return swarm.Particles(np.zeros((3, n)), directions)


@pytest.mark.parametrize(("halts", "share"), [([3], 0.625), ([5, 2, 4], 0.375), ([1, 0], 0.0), ([0, 7], 0.0)])
@pytest.mark.parametrize("threads", [1, 2])
def test_a_run_halts_at_the_pass_requested(threads, halts, share):
    """At the soonest one, each thread by its own count, and that frame only: a pass is a flight to the wall."""
    n = threads * LANES
    with Run(SPHERE.compiled(), along_diameters(n), swarm.Impact(), threads, None) as run:
        for passes in halts:
            run.halt(passes)
        assert not run.advance(4.0, 4.0)
        assert run.share_done(4.0) == pytest.approx(share, abs=1e-14)
        assert run.advance(4.0, 4.0)
        assert (run.state.impacts == 4).all()
        assert run.advance(2.0, 6.0)


def test_at_its_end_a_run_is_halted_for_good():
    """A share that runs then, or begins, is interrupted immediately; no thread waits for it."""
    with Run(SPHERE.compiled(), along_diameters(LANES), swarm.Impact(), 1, None) as run:
        pass
    run.halt(1000)
    status, _particle, left = run._share(10.0)
    assert status == Status.INTERRUPTED
    assert (left.time_left() == 10.0).all()


def test_a_frame_whose_time_is_over_is_halted():
    """It would take a quarter of an hour."""
    with Run(SPHERE.compiled(), along_diameters(1), swarm.Impact(), 1, None) as run:
        assert not run.advance(1e10, 1e10, latest=0.0)
        assert run.state.impacts[0] == 0
        assert run.share_done(1e10) < 1.0


@pytest.mark.physics
@pytest.mark.parametrize("threads", [1, 2])
def test_a_halt_and_a_hard_contact_in_one_frame(threads):
    """What begins again with the kernel of those that slide counts its passes anew, and is halted like the first."""
    start = swarm.fill(SPHERE, 600, speed=1.0, seed=6)
    start.position[:, 300], start.velocity[:, 300] = (0.5, 0.0, 0.0), (0.0, 1.0, 0.0)
    method = swarm.Impact(shortest_flight=1e-2)
    with Run(SPHERE.compiled(), start.copy(), method, threads, None) as whole:
        assert whole.advance(3.0, 3.0)
    with Run(SPHERE.compiled(), start.copy(), method, threads, None) as run:
        assert not run._kinds
        run.halt()
        assert not run.advance(3.0, 3.0)
        assert run.share_done(3.0) == 0.0
        passes = 1
        while True:
            run.halt(passes)
            if run.advance(3.0, 3.0):
                break
            passes += 1
        assert events.HELD in run._kinds
        # The grazing particle slides, a hundred steps a second; the others fly.
        assert passes >= 3
        for name, array in whole.arrays().items():
            assert np.array_equal(array, run.arrays()[name]), name
