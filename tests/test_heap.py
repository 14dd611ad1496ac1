"""The queue of events: its first item is the least whatever was done to it."""

import numpy as np
import pytest

from swarm.kernel.heap import Heap, build, change


def heap_of(keys):
    number = np.arange(len(keys))
    heap = Heap(np.array(keys, float), number.copy(), number.copy())
    build(heap)
    return heap


@pytest.mark.parametrize("count", [1, 2, 5, 6, 21, 100])
def test_the_first_is_the_least(count):
    random = np.random.default_rng(count)
    # Few different keys: many are equal.
    heap = heap_of(random.integers(0, 5, count))
    for _step in range(300):
        assert int(heap.item[0]) == min(range(count), key=lambda item: (heap.key[item], item))
        assert (heap.item[heap.place] == np.arange(count)).all()
        change(heap, int(random.integers(count)), float(random.integers(0, 5)))


def test_taken_one_by_one_they_are_in_order():
    random = np.random.default_rng(1)
    keys = random.random(200)
    heap, taken = heap_of(keys), []
    for _item in keys:
        taken.append(float(heap.key[heap.item[0]]))
        change(heap, int(heap.item[0]), np.inf)
    assert taken == sorted(keys)


def test_infinite_keys_are_last():
    heap = heap_of([np.inf, 1.0, np.inf])
    assert heap.item[0] == 1
    change(heap, 1, np.inf)
    assert heap.item[0] == 0
