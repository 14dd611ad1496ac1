"""Verdicts on runs: what holds, what does not, and the figure of each."""

import types

import numpy as np
import pytest

import swarm
from swarm.pictures import plots
from swarm.words import verdicts

SPHERE = swarm.Scene([swarm.Sphere(0.5)])


def content_of(result, scene, method, body=None):
    count = len(result.particles)
    return plots.Content("", scene, method, body, count, dict(result.observables), {"end": result.particles})


def run(scene, method, n=20, until=2.0, every=0.2, speed=1.0, **keywords):
    start = keywords.pop("start", None) or swarm.fill(scene, n, speed=speed, seed=1)
    result = swarm.simulate(scene, start, method, until=until, every=every, compile="never", **keywords)
    return content_of(result, scene, method)


def verdicts_by_label(content):
    return {one.label: one for one in verdicts.judged(content)}


def test_impact_is_good_in_every_way():
    found = verdicts_by_label(run(SPHERE, swarm.Impact()))
    assert set(found) == {"energy", "total energy", "walls", "numbers"}
    assert all(one.verdict for one in found.values())
    assert found["energy"].text.startswith("kept to round-off: the worst particle's error is ")
    assert found["walls"].text == "no particle was outside a rigid wall"


@pytest.mark.parametrize(
    "method", [swarm.Verlet(5e-3, 1e4), swarm.Trapezoidal(5e-3, 1e4)], ids=["verlet", "trapezoidal"]
)
def test_a_drift_is_judged_bad(method):
    found = verdicts_by_label(run(SPHERE, method))
    name = type(method).__name__
    assert found["energy"].verdict is False
    assert found["energy"].text.startswith(f"not kept, {name} does not conserve it")
    assert found["walls"].verdict is None
    assert "springs gave way by at most" in found["walls"].text


def test_penalty_keeps_the_energy_and_gives_way():
    found = verdicts_by_label(run(SPHERE, swarm.Penalty(5e-3, 1e4)))
    assert found["energy"].verdict
    assert found["walls"].verdict is None


def test_a_loop_keeps_the_energy_up_to_its_tolerance():
    """And particles that do not converge are counted."""
    method = swarm.AugmentedLagrangian(1e-2, 1e4, tolerance=1e-8, adaptive=True)
    content = run(SPHERE, method, n=5)
    found = verdicts_by_label(content)
    assert found["energy"].verdict
    assert found["loops"].verdict
    content.seen["unconverged"] = content.seen["unconverged"] + 3
    assert verdicts_by_label(content)["loops"] == ("loops", "three contacts did not converge", False)


def test_the_balance_closes_with_losses_heat_and_work():
    """And a change that no book has is found, of less than 1e-9 of what moved."""
    walls = [
        swarm.Box((0.5, 0.5, 0.5), restitution=0.8, temperature=1.0, accommodation=0.3),
        swarm.Sphere(0.1, side="outside", motion=swarm.Oscillation((0.0, 0.0, 0.05), 2.0)),
    ]
    content = run(swarm.Scene(walls, (0.0, 0.0, -9.81)), swarm.Impact())
    balance = verdicts_by_label(content)["balance of energy"]
    assert balance.verdict
    for what in ("dissipated", "heat of the walls", "work of the walls"):
        assert what in balance.text
    content.seen["dissipated_energy"] = content.seen["dissipated_energy"] * (1.0 - 1e-9)
    balance = verdicts_by_label(content)["balance of energy"]
    assert balance.verdict is False
    assert balance.text.startswith("does not close")


def test_numbers_add_up(tmp_path):
    """Inside, absorbed and escaped are all particles, those born during the run included."""
    walls = [swarm.Sphere(0.5, laws=[swarm.Absorb(0.05)], openings=[swarm.Sphere(0.2, (0.0, 0.0, 0.5))])]
    source = swarm.Source(0, rate=5.0, speed=1.0)
    scene = swarm.Scene(walls)
    start = swarm.fill(scene, 30, speed=1.0, seed=1)
    result = swarm.simulate(
        scene,
        start,
        swarm.Impact(),
        until=5.0,
        every=1.0,
        sources=[source],
        compile="never",
        seed=3,
        trajectory=tmp_path / "run.h5",
    )
    with swarm.load(tmp_path / "run.h5") as trajectory:
        content = plots.content_of(trajectory)
    number = verdicts_by_label(content)["particles"]
    assert number.verdict
    born, escaped = int(result.observables["born"][-1].sum()), int(result.observables["escaped"][-1])
    absorbed, n = int(result.observables["absorbed"][-1].sum()), len(result.particles)
    assert n == 30 + born
    assert min(born, escaped, absorbed) > 0
    assert number.text == (
        f"{n} = {n - escaped - absorbed} inside + {escaped} escaped + {absorbed} absorbed, {born} of them from sources"
    )
    content.seen["born"][-1] += 1
    assert verdicts_by_label(content)["particles"].verdict is False


def test_a_particle_that_leaves_a_closed_vessel_is_reported():
    content = run(SPHERE, swarm.Impact())
    content.seen["escaped"] = content.seen["escaped"] + 2
    assert verdicts_by_label(content)["particles"] == ("particles", "2 of 20 passed through a closed wall", False)


def test_momentum_holds_where_there_are_no_walls():
    scene = swarm.Scene([], period=(1.0, 1.0, 1.0))
    start = swarm.fill(scene, 20, temperature=1.0, radius=0.1, seed=1)
    content = run(scene, swarm.Impact(), start=start, until=0.5)
    assert verdicts_by_label(content)["momentum"].verdict
    assert "walls" not in verdicts_by_label(content)
    content.seen["momentum"] = content.seen["momentum"] + np.arange(len(content.seen["time"]))[:, None] * 1e-6
    assert verdicts_by_label(content)["momentum"].verdict is False


def test_links_of_bodies_keep_their_lengths():
    body = swarm.dumbbell(0.1, 1.0)
    bodies = swarm.place(SPHERE, body, 3, speed=1.0, seed=1)
    method = swarm.Impact(dt=1e-2)
    result = swarm.simulate(SPHERE, bodies, method, until=0.5, every=0.1, compile="never")
    content = content_of(result, SPHERE, method, body)
    assert verdicts_by_label(content)["links"].verdict
    assert "worst body" in verdicts_by_label(content)["energy"].text
    content.seen["link_error"] = content.seen["link_error"] + 1e-6
    assert verdicts_by_label(content)["links"].verdict is False


def test_what_is_not_a_number_is_reported_alone():
    content = run(SPHERE, swarm.Impact())
    content.seen["total_energy"] = np.where(content.seen["time"] > 0.5, np.nan, 1.0)
    assert list(verdicts.judged(content)) == [("numbers", "not finite: total_energy from 0.6 s on", False)]
    # One's own observables may be what they like, and pressures are unknown at the start.
    content = run(SPHERE, swarm.Impact())
    content.seen.update(mine=np.full(11, np.nan), pressure=np.full(11, np.nan))
    assert verdicts_by_label(content)["numbers"].verdict


@pytest.mark.parametrize("each", [0, 10, 10**9])
def test_round_off_grows_at_most_with_the_impacts(each):
    """The limit is that of the project's tests up to 500 impacts a particle, then in proportion."""
    seen = {"time": np.array([0.0, 1.0]), "impacts": np.array([0, 7 * each])}
    content = types.SimpleNamespace(seen=seen, method=swarm.Impact(), count=7)
    assert verdicts.energy_limit(content) == pytest.approx(max(1e-12, 8.0 * 2.0**-52 * each))
