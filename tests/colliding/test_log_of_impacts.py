"""The log of impacts of balls: rows of walls and of collisions, whatever the log is filled by."""

import numpy as np
import pytest
from colliding.test_colliding import gas
from physics import ball_loop

import swarm
from swarm.run import impacts
from swarm.words import facts


def logged(folder, scene, start, **options):
    path = folder / "impacts.h5"
    path.unlink(missing_ok=True)
    options = {"until": 0.5, "compile": "never", **options}
    run = swarm.simulate(scene, start, swarm.Impact(), impacts=path, **options)
    with swarm.load_impacts(path) as log:
        return run, log.table(), log.counts()


def test_rows_are_the_events_of_a_plain_loop(tmp_path):
    scene, start = gas(n=20)
    run, table, counts = logged(tmp_path, scene, start)
    expected = ball_loop.follow(scene, start, [0.5])
    partner = [(i, j) for _t, i, j in expected.events]
    assert list(zip(table["particle"].tolist(), table["partner"].tolist(), strict=True)) == partner
    np.testing.assert_allclose(table["time"], [t for t, *_ in expected.events], atol=1e-9)
    met = table["partner"] >= 0
    assert met.sum() == run.observables["collisions"][-1]
    assert (~met).sum() == run.observables["impacts"][-1] == counts.sum()
    assert (table["surface"] == np.where(met, -1, 0)).all()
    change = table["velocity_after"] - table["velocity_before"]
    pushed = start.mass[table["particle"]] * np.sqrt((change**2).sum(axis=1))
    np.testing.assert_allclose(table["impulse"], pushed, rtol=1e-12)
    np.testing.assert_allclose(table["impulse"][~met].sum(), run.observables["impulse"][-1].sum(), rtol=1e-12)


@pytest.mark.parametrize("options", [{}, {"period": (2.0, 2.0, 2.0)}])
def test_a_log_that_is_full_goes_on_in_the_next_one(tmp_path, monkeypatch, options):
    scene, start = gas(n=20, **options)
    run, table, _counts = logged(tmp_path, scene, start, until=1.5)
    monkeypatch.setattr(impacts, "_ROWS", 7)
    again, same, _counts = logged(tmp_path, scene, start, until=1.5)
    assert (again.particles.position == run.particles.position).all()
    assert (same == table).all()
    assert len(table) > 10


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_the_impulse_of_a_collision_is_along_the_line_of_centres(tmp_path, friction):
    scene, start = gas(n=20, restitution=0.9, friction=friction)
    start.volume = 8.0
    run, table, _counts = logged(tmp_path, scene, start)
    met = table[table["partner"] >= 0]
    virial = (met["impulse"] * (start.radius[met["particle"]] + start.radius[met["partner"]])).sum()
    kinetic, pressure = (run.observables[name] for name in ("kinetic_energy", "pressure"))
    assert pressure[-1] == pytest.approx((kinetic.sum() + virial / 0.5) / (3.0 * 8.0), rel=1e-12)


def test_rows_of_some_balls_only(tmp_path):
    scene, start = gas(n=20)
    _run, table, _counts = logged(tmp_path, scene, start)
    _run, some, _counts = logged(tmp_path, scene, start, impact_particles=[3, 7])
    of_these = np.isin(table["particle"], [3, 7]) | np.isin(table["partner"], [3, 7])
    assert (some == table[of_these]).all()


def test_impacts_of_members_are_counted():
    scene, start = gas(n=20)
    seen = swarm.simulate(scene, start, swarm.Impact(), until=0.5, compile="never", member_impacts=True)
    assert seen.observables["member_impacts"][-1].sum() == seen.observables["impacts"][-1] > 5


def test_a_cell_without_a_surface_has_a_log(tmp_path):
    _scene, start = gas(n=20, period=(2.0, 2.0, 2.0))
    counters = [swarm.Plane((0.0, 0.0, 1.0), 1.1)]
    run, table, counts = logged(tmp_path, swarm.Scene([], period=(2.0, 2.0, 2.0)), start, counters=counters)
    met = table["partner"] >= 0
    assert len(counts) == 0
    assert met.sum() == run.observables["collisions"][-1] > 3
    assert (table["surface"] == -1).all()
    assert (table["member"] == -1).all()
    crossed = [(table["sense"][~met] == sense).sum() for sense in (0, 1)]
    assert crossed == run.observables["crossings"][-1, 0].tolist()
    assert min(crossed) > 0
    with swarm.load_impacts(tmp_path / "impacts.h5") as log:
        stated = facts.of_log(log)
        assert (stated["impacts"], stated["collisions"]) == ("0", str(met.sum()))
        with pytest.raises(swarm.SceneError, match="surfaces must be left out of a scene without any, got 0"):
            log.table(surfaces=[0])
