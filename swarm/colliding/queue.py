"""The queue of events: a heap of four children a node, whose nodes hold the times, so that few balls are looked at.

The order is that of the times; of equal ones that of the smaller ball of a collision, then of the other one (none at a
wall), so that it does not depend on what was done to the heap before.
"""

from ..kernel.arrays import index
from ..kernel.jit import outlined, select
from .rows import FLOATS, MEETS, NOBODY, NODE, PARTNER, WHOLES

# Children of a node.
_CHILDREN = 4


@outlined
def _wins(flock, item, other, key):
    """Whether the event of one ball goes before that of another one at the same time."""
    low, high = _pair(flock, item, key)
    least, most = _pair(flock, other, key)
    alike = (low == least) & (high == most)
    return (low < least) | ((low == least) & (high < most)) | (alike & (item < other))


def _pair(flock, item, key):
    """The balls of an event, the smaller number first; of one ball alone the other is nobody."""
    mate = flock.tag[index(WHOLES * item + PARTNER)]
    meets = (flock.event[index(FLOATS * item + MEETS)] == key) & (mate >= 0)
    return select(meets & (mate < item), mate, item), select(meets, select(mate < item, item, mate), NOBODY)


def _comes_before(flock, item, key, other, later):
    if key == later:
        return _wins(flock, item, other, key)
    return key < later


def _set(flock, node, item, key):
    flock.item[index(node)], flock.key[index(node)] = item, key
    flock.tag[index(WHOLES * item + NODE)] = node


def _sink(flock, node, item, key):
    """Put a ball at this node, or below it."""
    last = flock.item.size
    while True:
        first = _CHILDREN * node + 1
        if first >= last:
            break
        least, soonest = first, flock.key[index(first)]
        for child in range(first + 1, min(first + _CHILDREN, last)):
            one = flock.key[index(child)]
            if _comes_before(flock, flock.item[index(child)], one, flock.item[index(least)], soonest):
                least, soonest = child, one
        if not _comes_before(flock, flock.item[index(least)], soonest, item, key):
            break
        _set(flock, node, flock.item[index(least)], soonest)
        node = least
    _set(flock, node, item, key)


def _rise(flock, node, item, key):
    """The node, at or above this one, where a ball is to be: those that it passes are moved down."""
    while node > 0:
        above = (node - 1) // _CHILDREN
        other, later = flock.item[index(above)], flock.key[index(above)]
        if not _comes_before(flock, item, key, other, later):
            break
        _set(flock, node, other, later)
        node = above
    return node


@outlined
def requeue(flock, item, node, key):
    """Give the ball at a node another time."""
    top = _rise(flock, node, item, key)
    if top < node:
        _set(flock, top, item, key)
    else:
        _sink(flock, node, item, key)


def build(flock):
    """Order the queue by what is next for each ball."""
    size = flock.item.size
    for node in range(size):
        flock.key[index(node)] = flock.next_of(flock.item[index(node)])
    for node in range((size - 2) // _CHILDREN, -1, -1):
        _sink(flock, node, flock.item[index(node)], flock.key[index(node)])
    for node in range(size):
        flock.tag[index(WHOLES * flock.item[index(node)] + NODE)] = node
