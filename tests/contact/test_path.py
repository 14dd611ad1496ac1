"""The first place of a sliding step where something is so: `first_true`."""

import math

import pytest

from swarm.contact.path import BEFORE, PLACES, first_true


def is_beyond(edge, margin, part):
    return part - edge > margin


def is_within(low, high, margin, part):
    return low + margin < part < high - margin


@pytest.mark.parametrize("edge", [0.01, 0.3, 0.5, 1.0 / 3.0, 0.9])
def test_an_edge_is_found_to_the_last_bit(edge):
    found = first_true(is_beyond, (edge,), 0.0, 0.01, 0.0)
    assert 0.0 < found - edge <= math.ulp(1.0)


@pytest.mark.parametrize("edge", [0.1, 0.62])
def test_it_is_surely_so_at_one_margin_and_begins_at_the_other(edge):
    assert first_true(is_beyond, (edge,), 0.0, 0.01, 0.008) == pytest.approx(edge + 0.008, abs=math.ulp(1.0))
    # It is nowhere so by that much.
    assert first_true(is_beyond, (edge,), 0.0, 1.1 - edge, 0.0) == math.inf


def test_what_was_so_before_a_part_is_not_looked_at():
    given = (0.1, 0.3)
    assert first_true(is_within, given, 0.0, 0.0, 0.0) == math.nextafter(0.1, 1.0)
    # From within, the next place that is looked at is still within: it begins right behind the start.
    assert first_true(is_within, given, 0.2, 0.0, 0.0) == pytest.approx(0.2, rel=1e-15)
    assert first_true(is_within, given, 0.3, 0.0, 0.0) == math.inf
    assert first_true(is_beyond, (0.5,), 1.0, 0.0, 0.0) == math.inf


def test_the_start_is_looked_at_if_it_is_asked_for():
    assert first_true(is_beyond, (-0.5,), BEFORE, 0.0, 0.0) == 0.0
    assert first_true(is_within, (-1.0, 1e-3), BEFORE, 0.0, 0.0) == 0.0
    assert first_true(is_within, (-1.0, 1e-3), 0.0, 0.0, 0.0) == math.inf


@pytest.mark.parametrize("k", range(PLACES))
def test_what_is_between_two_places_is_found_closer(k):
    low, high = (k + 0.4) / PLACES, (k + 0.6) / PLACES

    def middle(low_there, high_there, margin, before, part, after):
        # Between the places on either side of one, so that none is between two searches.
        assert before <= part < after or part == after == 1.0
        return min(max(0.5 * (low_there + high_there), before), after)

    assert first_true(is_within, (low, high), BEFORE, 0.0, 0.0) == math.inf
    assert first_true(is_within, (low, high), BEFORE, 0.0, 0.0, middle) == pytest.approx(low, rel=1e-12)
