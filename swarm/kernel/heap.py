"""A queue of events: a heap that knows the place of each item, with four children for each node.

The order is that of the keys, and of the numbers of the items for equal keys: the first item does not depend on the
history of the heap.
"""

from typing import NamedTuple

from .arrays import index
from .jit import Array, select

# Children of a node: half as many levels as with two, and the children are neighbours in memory.
_CHILDREN = 4


class Heap(NamedTuple):
    """The key of each item, and the nodes: arrays of one length."""

    key: Array  # (N,) of the items
    item: Array  # (N,) in the nodes; node 0 is the first
    place: Array  # (N,) the node of each item


def _comes_before(heap, item, other):
    one, two = heap.key[index(item)], heap.key[index(other)]
    return (one < two) | ((one == two) & (item < other))


def _put(heap, node, item):
    heap.item[index(node)] = item
    heap.place[index(item)] = node


def _least_child(heap, node):
    """Return the child node with the item that comes first, or -1 for a node without children."""
    first = _CHILDREN * node + 1
    least, end = first, min(first + _CHILDREN, heap.item.size)
    for child in range(first + 1, end):
        before = _comes_before(heap, heap.item[index(child)], heap.item[index(least)])
        least = select(before, child, least)
    return select(first < end, least, -1)


def sink(heap, node):
    """Restore the order of a heap after the key of the item at this node has grown."""
    item = heap.item[index(node)]
    while True:
        child = _least_child(heap, node)
        if child < 0 or not _comes_before(heap, heap.item[index(child)], item):
            break
        _put(heap, node, heap.item[index(child)])
        node = child
    _put(heap, node, item)


def rise(heap, node):
    """Restore the order of a heap after the key of the item at this node has become smaller."""
    item = heap.item[index(node)]
    while node > 0:
        above = (node - 1) // _CHILDREN
        if not _comes_before(heap, item, heap.item[index(above)]):
            break
        _put(heap, node, heap.item[index(above)])
        node = above
    _put(heap, node, item)


def build(heap):
    """Order a heap with arbitrary keys."""
    for node in range((heap.item.size - 2) // _CHILDREN, -1, -1):
        sink(heap, node)


def change(heap, item, key):
    """Give an item another key."""
    heap.key[index(item)] = key
    rise(heap, heap.place[index(item)])
    sink(heap, heap.place[index(item)])
