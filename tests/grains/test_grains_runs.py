"""Runs of soft balls: the same bits whatever stops them, cells that repeat, what is refused in a sentence."""

import numpy as np
import pytest
from grains_runs import ROOM, cloud, ran

import swarm
from swarm.errors import RunError, SceneError
from swarm.files import checkpoint
from swarm.grains.drags import carry, kept_drags, room_for
from swarm.grains.grain_arrays import FACE, near_of
from swarm.grains.grains_run import GrainsRun
from swarm.kernel.cache import in_python
from swarm.kernel.random import Seeding
from swarm.run.tally import Watched

METHOD = swarm.Penalty(0.002, 400.0, 1.5)
LAWS = {"restitution": 0.6, "friction": 0.4}
BOX = swarm.Box((3.2, 3.2, 3.2), (2.5, 2.5, 2.5), **LAWS)
SCENE = swarm.Scene([BOX], gravity=(0.0, 0.0, -2.0), pairs=swarm.Pairs(**LAWS))


def started(scene=SCENE, method=METHOD):
    start = cloud(18)
    start.spin = np.zeros((3, len(start)))
    run = GrainsRun(scene.compiled(), start, method, 1, None, "never", Seeding(), Watched())
    run.observe()
    return run


def bits(run):
    return {name: array.tobytes() for name, array in run.arrays().items()}


def advanced(run, frames=4, span=50.0, halts=()):
    for k in range(frames):
        halts = list(halts)
        if halts:
            run.halt(halts.pop())
        while not run.advance(span, (k + 1) * span * METHOD.dt):
            assert 0.0 <= run.share_done(span) < 1.0
            if halts:
                run.halt(halts.pop())
    return run


def test_halts_do_not_change_a_bit():
    with started() as whole, started() as halted:
        assert bits(advanced(whole)) == bits(advanced(halted, halts=(3, 0, 1, 17, 5)))
        assert whole.state.balls.collisions.sum() > 10


def test_a_run_that_is_restored_goes_on_with_the_same_bits(tmp_path):
    with started() as whole, started() as first, started() as second:
        advanced(whole)
        advanced(first, 2)
        first.halt(7)
        assert not first.advance(50.0, 150.0 * METHOD.dt)
        checkpoint.save(tmp_path / "a", checkpoint.SavedRun("", "", "", "", 30, ""), first.arrays())
        second.restore(checkpoint.read(tmp_path / "a")[1], True)
        for run in (first, second):
            while not run.advance(50.0, 150.0 * METHOD.dt):
                pass
            run.advance(50.0, 200.0 * METHOD.dt)
        assert bits(whole) == bits(first) == bits(second)
        for name in ("position", "velocity", "dissipated", "impulse"):
            assert (getattr(whole.state, name) == getattr(second.state, name)).all()
        assert whole.seen()["largest_overlap"] == second.seen()["largest_overlap"] > 0.0
        assert whole.seen()["pressure"] == second.seen()["pressure"] or not whole.seen()["pressure"] > 0.0


def frictions(run):
    """The impulses of friction that a run keeps, by both particles, on the one with the smaller number."""
    grains, near = run._world.grains, run._world.near
    first = np.repeat(np.arange(len(grains.number)), np.diff(near.first))
    one, other = grains.number[first], grains.number[near.mate[: first.size]]
    kept = near.drag[: first.size] * np.where(one < other, 1.0, -1.0)[:, None]
    pairs = zip(np.minimum(one, other), np.maximum(one, other), strict=True)
    return {pair: tuple(drag) for pair, drag in zip(pairs, kept, strict=True) if drag.any()}


def frictions_at_walls(run):
    """The impulses of friction at walls, by the wall and the particle."""
    grains, near = run._world.grains, run._world.near
    wall = np.repeat(np.arange(len(near.wall_first) - 1), np.diff(near.wall_first))
    number, drags = grains.number[near.slot[: wall.size]], near.wall_drag[: wall.size]
    return {(w, n): tuple(drag) for w, n, drag in zip(wall, number, drags, strict=True) if drag.any()}


def test_friction_is_that_of_the_same_contacts_when_lists_are_made_anew():
    with started() as run:
        advanced(run, 2)
        before, at_walls, kept = frictions(run), frictions_at_walls(run), kept_drags(run._tier.kernel, run._world)
        # In reverse, so that of each pair the other ball comes first.
        for rows in run._world.grains:
            rows[:] = rows[::-1].copy()
        run._list(kept)
        assert frictions(run) == before
        assert frictions_at_walls(run) == at_walls
        assert len(before) > 1 < len(at_walls)


def test_friction_at_a_field_is_that_of_the_same_faces_when_lists_are_made_anew():
    near = near_of(2, 1, 0, 4, 3, 0)
    near.wall_first[1], near.slot[:], near.spans[:, FACE] = 4, [0, 0, 1, 1], [5, 9, 5, 9]
    near.wall_drag[:, 0] = [1.0, 2.0, 0.0, 4.0]
    kept = room_for(near)
    in_python(carry)(np.array([7, 3]), near, kept, False)
    # The balls are in the other order, one of them is near another face first, and one is not near face 9.
    row = np.full(8, -1)
    row[[3, 7]] = 0, 1
    near.spans[:, FACE], near.wall_drag[:] = [5, 2, 9, 5], 0.0
    in_python(carry)(row, near, kept, True)
    assert near.wall_drag[:, 0].tolist() == [0.0, 0.0, 2.0, 1.0]


def test_a_run_does_not_depend_on_its_frames():
    one, other = (ran(SCENE, cloud(), METHOD, 0.2, every=every) for every in (0.2, 0.02))
    assert (one.particles.position == other.particles.position).all()
    assert (one.particles.spin == other.particles.spin).all()


@pytest.mark.parametrize("period", [(4.0, 4.0, 4.0), (4.0, None, None)])
def test_a_cell_that_repeats_keeps_energy_and_momentum(period):
    walls = [swarm.Slab(n, 5.0, (0.0, 2.0, 2.0)) for n in ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]
    walls = walls if None in period else []
    start = cloud()
    scene = swarm.Scene(walls, period=period)
    result = ran(scene, start, swarm.Penalty(0.002, 400.0, 1.5), 0.6, every=0.2)
    seen, end = result.observables, result.particles
    assert seen["collisions"][-1] > 10
    assert seen["energy_error"].max() < 1e-13
    scale = (end.mass * np.sqrt((end.velocity**2).sum(axis=0))).sum()
    assert abs(seen["momentum"] - seen["momentum"][0])[:, 0].max() < 1e-14 * scale
    assert end.image.any()
    for k, length in enumerate(period):
        if length is not None:
            assert ((end.position[k] >= 0.0) & (end.position[k] < length)).all()


def test_a_cell_is_as_good_as_its_images():
    """Two balls that meet through a face do as two that meet in the middle."""
    method, scene = swarm.Penalty(0.001, 400.0, 1.5), swarm.Scene([], period=(4.0, 4.0, 4.0))
    ends = []
    for x in (1.7, 3.7):
        start = swarm.Particles(
            [[x, x + 0.55], [2.0, 2.1], [2.0, 2.0]], [[0.5, -0.5], [0.0, 0.0], [0.0, 0.0]], radius=0.25
        )
        result = ran(scene, start, method, 0.4)
        assert result.observables["collisions"][-1] == 1
        ends.append(result.particles.velocity)
    assert ends[0] == pytest.approx(ends[1], abs=1e-13)


@pytest.mark.parametrize(
    ("scene", "words"),
    [
        (swarm.Scene([swarm.Sphere(9.0, restitution=0.0)]), "restitution must be 0.01 or more"),
        (swarm.Scene(ROOM.surfaces, pairs=swarm.Pairs(restitution=0.001)), "pairs.restitution must be 0.01"),
        (
            swarm.Scene([swarm.Sphere(9.0, laws=[swarm.Sticky(0.1)], motion=swarm.Oscillation((0.1, 0.0, 0.0), 1.0))]),
            "must not let particles wait where a wall moves",
        ),
    ],
)
def test_what_soft_balls_do_not_know_is_refused(scene, words):
    with pytest.raises(SceneError, match=words):
        ran(scene, cloud(), METHOD, 0.1)


def test_a_step_that_is_long_for_a_contact_is_reported(caplog):
    start = swarm.Particles([[0.0, 3.0], [0.0, 0.0], [0.0, 0.0]], [[0.1, 0.0], [0.0, 0.0], [0.0, 0.0]], radius=0.5)
    ran(ROOM, start, swarm.Penalty(0.1, 1000.0), 0.1)
    assert "touch for 0.0702 s; use dt <= 0.0035 s" in caplog.text


def test_a_velocity_that_is_no_number_ends_the_run():
    with started() as run:
        run._world.grains.speed[3, 0] = np.nan
        with pytest.raises(RunError):
            run.advance(10.0, 0.02)
