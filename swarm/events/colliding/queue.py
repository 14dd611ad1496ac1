"""The queue of events: a heap with four children a node. Nodes hold the times, so that few balls are read.

Events are in the order of their times. Events at equal times are in the order of the smaller ball, then of the other
ball (none at a wall), so that the order does not depend on the history of the heap. Nodes are numbered from 3 on, so
that children are in one line of the cache. Behind the last node are spare nodes with infinite times.
"""

import math

from ...kernel.arrays import fetch, index
from ...kernel.jit import outlined, select
from .rows import FLOATS, MEETS, NO_PARTNER, PARTNER, WHOLES

# The first node, and the number of spare nodes. The children of a node are 4 (node - 2) to 4 (node - 2) + 3.
FIRST, SPARE = 3, 8
_CHILDREN = 4


@outlined
def _wins(flock, item, other, key):
    """Whether the event of a ball comes before the event of another ball at the same time."""
    low, high = _pair(flock, item, key)
    least, most = _pair(flock, other, key)
    alike = (low == least) & (high == most)
    return (low < least) | ((low == least) & (high < most)) | (alike & (item < other))


def _pair(flock, item, key):
    """The balls of an event, the smaller number first. In an event of one ball the second is `NO_PARTNER`."""
    mate = flock.tag[index(WHOLES * item + PARTNER)]
    meets = (flock.event[index(FLOATS * item + MEETS)] == key) & (mate >= 0)
    return select(meets & (mate < item), mate, item), select(meets, select(mate < item, item, mate), NO_PARTNER)


def _comes_before(flock, item, key, other, later):
    if key == later and key < math.inf:
        return _wins(flock, item, other, key)
    return key < later


def _set(flock, node, item, key):
    flock.item[index(node)], flock.key[index(node)] = item, key
    flock.node[index(item)] = node


@outlined
def _first_of_equals(flock, first, soonest):
    """The child with the first event among the children, from `first` on, with the time `soonest`."""
    least = first
    for child in range(first, first + _CHILDREN):
        if flock.key[index(child)] == soonest:
            behind = flock.key[index(least)] > soonest
            if behind or _wins(flock, flock.item[index(child)], flock.item[index(least)], soonest):
                least = child
    return least


def _sink(flock, node, item, key):
    """Put a ball at a node, or below it."""
    last = flock.number() + FIRST
    first = _CHILDREN * (node - 2)
    while first < last:
        # Fetch the children of all children: the next ones to be read are among them.
        below = _CHILDREN * (first - 2)
        fetch(flock.key, below)
        fetch(flock.key, below + 8)
        fetch(flock.item, below)
        a, b = flock.key[index(first)], flock.key[index(first + 1)]
        c, d = flock.key[index(first + 2)], flock.key[index(first + 3)]
        one, other = select(b < a, b, a), select(d < c, d, c)
        soonest = select(other < one, other, one)
        if key < soonest or soonest == math.inf:
            break
        least = first + select(other < one, select(d < c, 3, 2), select(b < a, 1, 0))
        again = (a == b) | (c == d) | (one == other)
        if again and soonest < math.inf:
            least = _first_of_equals(flock, first, soonest)
        here = flock.item[index(least)]
        if key == soonest and _wins(flock, item, here, key):
            break
        _set(flock, node, here, soonest)
        node = least
        first = _CHILDREN * (node - 2)
    _set(flock, node, item, key)


def _rise(flock, node, item, key):
    """Return the node, at or above a node, where a ball belongs; move the balls that it passes down."""
    while node > FIRST:
        above = (node >> 2) + 2
        other, later = flock.item[index(above)], flock.key[index(above)]
        if not _comes_before(flock, item, key, other, later):
            break
        _set(flock, node, other, later)
        node = above
    return node


@outlined
def requeue(flock, item):
    """Bring a ball to its place in the queue."""
    key, node = flock.next_of(item), flock.node[index(item)]
    top = _rise(flock, node, item, key) if key <= flock.key[index(node)] else node
    if top < node:
        _set(flock, top, item, key)
    else:
        _sink(flock, node, item, key)


def build(flock):
    """Order the queue by the next event of each ball."""
    last = flock.number() + FIRST
    for node in range(FIRST, last):
        flock.key[index(node)] = flock.next_of(flock.item[index(node)])
    for k in range(last - FIRST):
        node = last - 1 - k
        _sink(flock, node, flock.item[index(node)], flock.key[index(node)])
