"""Which lanes of a block are marked."""

from ..kernel.jit import index, inlined
from .arrays import EIGHT


@inlined
def marked_lanes(lanes, live):
    """How many lanes are marked; which, is in `order`.

    Without a branch: which lanes arrive no processor foresees, and each wrong guess costs some 6 ns. All lanes one by
    one were an eighth of the time of a frame with 75 impacts.
    """
    marked, order, some, count = lanes.marked, lanes.order, lanes.some, index(0)
    eights = 0
    for k in range((live + EIGHT - 1) // EIGHT):
        some[eights] = k
        eights += lanes.eights[k] != 0
    for k in range(eights):
        first = EIGHT * some[k]
        for lane in range(first, min(first + EIGHT, live)):
            order[count] = lane
            count += index(marked[lane])
    return int(count)
