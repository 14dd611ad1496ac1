"""A contact step, for every function here that solves one."""

from ..kernel.record import Record
from ..kernel.vector import Vec


class Step(Record):
    """A step from r with the free displacement p = h v0 + h^2 G/2; c = h^2/(2m), in implicit rules h^2/(4m)."""

    r: Vec
    p: Vec
    c: float
