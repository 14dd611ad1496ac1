"""The shares of a frame: every particle in one of them, whoever draws it."""

import threading

import numpy as np
import pytest

import swarm
from swarm import _jit, lanes, observables
from swarm._jit import kernel, next_of
from swarm.run import Run

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
    most = 2_000 if _jit.numba.config.DISABLE_JIT else 2_000_000
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
    done = np.random.default_rng(n).random(n) < 0.4
    draws = lanes.Draws(np.zeros(1, np.int64), size, np.empty(-(-n // size), np.int64))
    i, stop, drawn, found = 0, 0, 0, []
    while True:
        i, stop, drawn = lanes.following_particle(draws, done, i, stop, drawn)
        if i == stop:
            break
        found.append(i)
        i += 1
    assert found == np.flatnonzero(~done).tolist()
    assert draws.mine[:drawn].tolist() == list(range(len(draws.mine)))


@pytest.mark.parametrize("n", [1, observables.CHUNK, 3 * observables.CHUNK + 5])
@pytest.mark.parametrize(("threads", "block_size"), [(1, None), (2, None), (3, 2 * observables.CHUNK), (2, 10**9)])
def test_the_start_and_every_frame_are_observed_whole(n, threads, block_size):
    particles = swarm.fill(SPHERE, n, speed=1.0, seed=1)
    with Run(SPHERE, particles, swarm.Impact(), threads, block_size) as run:
        run.observe()
        for moment in (0.0, 0.3, 0.6):
            if moment > 0.0:
                run.advance(0.3, moment)
            seen = run.seen()
            momentum = run.state.velocity @ run.state.mass
            assert seen["momentum"] == pytest.approx(momentum, abs=1e-13 * n)
            assert seen["kinetic_energy"] == pytest.approx(0.5 * n, rel=1e-13)


def test_a_short_frame_wakes_no_thread(monkeypatch):
    """And a long one after it does: what counts is the work in it, by the pace of the last."""
    particles = swarm.fill(SPHERE, 4 * observables.CHUNK, speed=1.0, seed=1)
    with Run(SPHERE, particles, swarm.Impact(), 2, None) as run:
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
