"""The contacts of bodies with walls, in the lanes of a pass: rigid walls in hold.py, springs in soft.py."""

from typing import Any

from ...kernel.record import Record


class Contacts(Record):
    """The contacts of a pass, by the kind of its walls; i is a lane."""

    body: Any  # (Ties, Touching)
    chain: Any
    rule: Any
    lanes: Any
    pace: Any
    held: Any

    def begin(self, i):
        """The contacts of a lane at the start of a trial, and how they press."""
        raise NotImplementedError

    def turn(self, i, r1):
        """Directions of the contacts of a lane: the discrete gradient of each gap from the start of the stage to r1."""
        raise NotImplementedError

    def correct(self, i, number):
        """Correct the forces of contacts, and for it f, the corrections of ties and guides; whether it is the last."""
        raise NotImplementedError

    def gap_gradient(self, wall, y):
        """The gradient of the gap that the contacts solve for."""
        raise NotImplementedError

    def begin_loop(self):
        """Begin Uzawa's loop of a stage in all lanes."""

    def again(self):
        """Update the multipliers of lanes whose loop goes on, and count these; the stage of the others is done."""
        return 0

    def judge(self, i):
        """The action of a lane whose trial ends outside, has no solution, or looks for the time of an impact."""
        raise NotImplementedError

    def end(self, state, i):
        """Book the impulses of the walls in a step; whether contacts last."""
        raise NotImplementedError

    def strike(self, state, i):
        """An impact at this instant; contacts may last from there."""
        raise NotImplementedError
