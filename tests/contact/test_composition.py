"""The five steps that a step of a slide is composed of: of fourth order, and how each is begun."""

import pytest

from swarm.contact import sliding

STEPS = range(5)


def test_the_steps_are_a_whole_one_of_fourth_order():
    lengths = [sliding.part(k) for k in STEPS]
    assert lengths == lengths[::-1]
    assert sum(lengths) == pytest.approx(1.0, abs=1e-15)
    assert sum(length**3 for length in lengths) == pytest.approx(0.0, abs=1e-15)
    for k in STEPS:
        assert sliding.before(k) == pytest.approx(sum(lengths[:k]), abs=1e-15)
        assert sliding.inverse_part(k) * lengths[k] == pytest.approx(1.0, abs=1e-15)


def test_a_step_begins_with_the_acceleration_of_a_constant_jerk():
    """Of a(t) = t the mean over a step is that of its middle, and of its change of place that of its first third."""
    middle = [sliding.before(k) + 0.5 * sliding.part(k) for k in STEPS]
    third = [sliding.before(k) + sliding.part(k) / 3.0 for k in STEPS]
    earlier = [0.0, *middle]
    assert sliding.lead(0) == 0.0
    for k in STEPS[1:]:
        last, change = middle[k - 1], middle[k - 1] - earlier[k - 1]
        assert last + sliding.lead(k) * change == pytest.approx(third[k], abs=1e-14)
