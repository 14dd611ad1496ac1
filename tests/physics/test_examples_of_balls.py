"""The examples of balls that meet: Haff's law, cradles, a break shot, and two kinds in a formula's cavity."""

import numpy as np
import pytest

from examples import balls_in_formula, break_shot, cooling_gas, newton_cradle

pytestmark = pytest.mark.physics


def test_a_gas_cools_by_haffs_law():
    """8000 balls, e = 0.9: 2 % until the temperature is a 25th."""
    found = cooling_gas.run(0.9, taus=4.0)
    assert found.energy == pytest.approx((1.0 + found.time) ** -2.0, rel=0.02)
    assert found.balance < 1e-13


@pytest.mark.parametrize("name", newton_cradle.CRADLES)
def test_a_cradle_keeps_energy_and_order(name):
    how = newton_cradle.CRADLES[name]
    found = newton_cradle.run(until=2.0, **how)
    assert found.balance < 1e-14
    assert (np.diff(found.place, axis=1) >= 2.0 * newton_cradle.RADIUS - 1e-15).all()
    if "masses" not in how and "restitution" not in how:
        # At 0.7 s as many leave as came, and no other ball moves.
        k = int(np.searchsorted(found.time, 0.7))
        leaves = np.arange(newton_cradle.COUNT) >= newton_cradle.COUNT - how["moving"]
        assert found.velocity[k] == pytest.approx(leaves.astype(float), abs=1e-14)


def test_a_break_shot():
    """No ball is in another one or leaves but through a pocket, and the game is another one with other gaps."""
    games = [break_shot.run(seed, until=2.0) for seed in (1, 2)]
    for game in games:
        assert game.collisions > 20
        assert game.balance < 1e-13
        for position, time in zip(game.position, game.time, strict=True):
            there = position[:2, ~(game.escape_time <= time)]
            apart = np.linalg.norm(there[:, :, None] - there[:, None], axis=0)
            np.fill_diagonal(apart, 1.0)
            assert apart.min() > 2.0 * break_shot.RADIUS - 1e-15
            assert (
                np.abs(there).max(axis=1) <= [break_shot.LONG, break_shot.SHORT] - np.array(break_shot.RADIUS)
            ).all()
        assert not game.position[:, 2].any()
        assert game.pocketed[-1] == np.isfinite(game.escape_time).sum()
    assert np.abs(games[0].position[-1] - games[1].position[-1]).max() > 0.1


def test_heavy_and_light_balls_in_a_formula_share_the_energy():
    """Equal mean energies within 3 standard errors, from 8 to 1; the whole is kept, and no ball is in the wall."""
    found = balls_in_formula.run(count=120, until=60.0)
    ratio, error = balls_in_formula.late_ratio(found)
    assert found.heavy[0] / found.light[0] == pytest.approx(8.0)
    assert abs(ratio - 1.0) < 3.0 * error
    assert error < 0.15
    assert found.balance < 1e-12
    assert found.outside < 1e-15
