"""Impacts counted on each member of a surface: those of the log, for any threads, halts and sessions."""

import numpy as np
import pytest
from conftest import rarely
from test_impacts import BALLS, DOWN, LISTED, SCENES, SPHERE, table_of
from test_sessions import stopped_at

import swarm
from swarm.run.engine import Run
from swarm.run.state import Seeding
from swarm.run.tally import Tally, Watched

MANY = {
    **SCENES,
    "fields and a list": swarm.Scene([swarm.Box((0.5, 0.5, 0.5)), *LISTED, BALLS], DOWN, None),
    "restless": swarm.Scene([swarm.Box((0.5, 0.5, 0.5), restitution=0.6), BALLS], DOWN),
    "open": swarm.Scene([swarm.Sphere(0.5, openings=[swarm.Sphere(0.3, (0.0, 0.0, -0.5))]), BALLS]),
}


def run(scene, n=12, until=2.0, **keywords):
    keywords = {"compile": "never", "threads": 1, "member_impacts": True, **keywords}
    start = swarm.fill(scene, n, speed=1.0, seed=1)
    return swarm.simulate(
        scene, start, swarm.Impact(), until=until, every=keywords.pop("every", min(until, 1.0)), **keywords
    )


def require_same(one, other):
    for counts, others in zip(one.member_impacts, other.member_impacts, strict=True):
        assert counts.dtype == others.dtype == np.int64
        assert counts.tolist() == others.tolist()


def of_log(scene, path):
    """The same from the rows of a log."""
    table = table_of(path)
    table = table[table["impulse"] != 0.0]
    for s, surface in enumerate(scene.surfaces):
        members = len(surface) if isinstance(surface, swarm.Spheres) else 1
        yield np.bincount(np.maximum(table["member"][table["surface"] == s], 0), minlength=members).tolist()


@pytest.mark.parametrize("name", MANY)
def test_they_are_the_rows_of_the_log(tmp_path, name):
    scene = MANY[name]
    result = run(scene, impacts=tmp_path / "i.h5", until=3.0)
    assert [counts.tolist() for counts in result.member_impacts] == list(of_log(scene, tmp_path / "i.h5"))
    assert sum(counts.sum() for counts in result.member_impacts) == result.impacts_per_particle.sum() > 4


def test_they_are_the_same_alone_and_of_any_threads_and_blocks():
    scene = MANY["restless"]
    one = run(scene, 600, 0.2)
    for threads, size in ((2, 512), (3, 1)):
        require_same(run(scene, 600, 0.2, threads=threads, block_size=size), one)
    assert (one.member_impacts[1] > 0).sum() > 6
    assert sum(counts.sum() for counts in one.member_impacts) == one.observables["impacts"][-1]


@pytest.mark.physics
@pytest.mark.parametrize("name", [rarely("restless"), "thermal", "cell that repeats"])
def test_kernels_that_are_compiled_count_the_same(name):
    one = run(MANY[name], 600, 3.0, compile="always", threads=2)
    require_same(run(MANY[name], 600, 3.0), one)


def test_halts_and_sessions_lose_and_repeat_none(tmp_path):
    scene, whole = MANY["restless"], run(MANY["restless"], 30, 2.0)
    start, halts = swarm.fill(scene, 30, speed=1.0, seed=1), 0

    def begun():
        tally = Tally(scene)
        return Run(scene, start.copy(), swarm.Impact(), 1, None, "never", Seeding(), Watched(None, tally)), tally

    one, tally = begun()
    for moment in (1.0, 2.0):
        passes = 1
        while True:
            one.halt(passes)
            done = one.advance(1.0, moment)
            kept = {name: array.copy() for name, array in one.arrays().items()}
            one.__exit__()
            one, tally = begun()
            one.restore(kept, not done)
            if done:
                break
            halts, passes = halts + 1, 2 * passes
    one.__exit__()
    assert halts > 3
    for counts, others in zip(whole.member_impacts, tally.of_members(), strict=True):
        assert counts.tolist() == others.tolist()


def test_a_run_that_is_resumed_counts_on(tmp_path):
    path, more = tmp_path / "run.h5", {"compile": "never", "member_impacts": True}
    stopped_at(path, 2, **more)
    start = swarm.fill(SPHERE, 20, speed=1.0, seed=1)

    def ended(**keywords):
        return swarm.simulate(SPHERE, start, swarm.Impact(), until=2.0, every=0.5, **more | keywords)

    with pytest.raises(swarm.SceneError, match="its member_impacts is True, got False"):
        ended(trajectory=path, resume=True, member_impacts=False)
    require_same(ended(trajectory=path, resume=True), ended())


def test_without_it_there_is_none():
    assert run(SPHERE, member_impacts=False).member_impacts is None
    (counts,) = run(SPHERE).member_impacts
    assert counts.shape == (1,)


def test_what_has_no_impacts_of_members():
    body = swarm.place(SPHERE, swarm.dumbbell(0.1, 1.0), 2)
    with pytest.raises(swarm.SceneError, match=r"member_impacts must be False here, .* not of bodies"):
        swarm.simulate(SPHERE, body, swarm.Impact(dt=1e-2), until=1.0, member_impacts=True)
    start = swarm.fill(SPHERE, 2, speed=1.0)
    with pytest.raises(swarm.SceneError, match=r"member_impacts must be False here, .* not of Penalty"):
        swarm.simulate(SPHERE, start, swarm.Penalty(dt=1e-2, penalty=1e4), until=1.0, member_impacts=True)
    with pytest.raises(swarm.SceneError, match="member_impacts"):
        run(SPHERE, member_impacts="yes")
