"""Status codes of kernels."""

from enum import IntEnum


class Status(IntEnum):
    """Codes that kernels return; the worst one of a run becomes a message."""

    DONE = 0
    INTERRUPTED = 1
    UNSOLVED = 2
    NOT_FINITE = 3
    STALLED = 4
    UNCONVERGED = 5
    TOO_FAST = 6
    HARD_CONTACT = 7
    LEASE_ENDED = 8
    LOG_FULL = 9
    TIMELESS = 10
    SENT_WRONG = 11
    WAITS = 12
    TOO_DEEP = 13

    @property
    def sentence(self) -> str:
        """Return the meaning, for the user."""
        return _SENTENCES[self]


_SENTENCES = {
    Status.DONE: "the block reached the frame time",
    Status.INTERRUPTED: "the run was interrupted",
    Status.UNSOLVED: "the contact equations of a step were not solved; a smaller dt or a softer penalty helps",
    Status.STALLED: "the particle meets its walls without end, as in a cusp or in a gap that is too thin to resolve; "
    "start it elsewhere, or use more frames",
    Status.TOO_FAST: "a step is longer than the thinnest solid, so that the particle could jump over it",
    Status.UNCONVERGED: "the multipliers of a contact did not converge",
    Status.NOT_FINITE: "position or velocity are no longer finite numbers",
    Status.HARD_CONTACT: "a contact needs the slow-path kernel",
    Status.LEASE_ENDED: "walls that react have moved so far that all particles are predicted again",
    Status.LOG_FULL: "the log of impacts needs an empty part",
    Status.SENT_WRONG: "one of the laws of a wall gave it no velocity, or one into the wall, or out of the plane",
    Status.WAITS: "one of the laws of a wall lets it wait there, although no particle waited in its trials before the "
    "run; let particles wait more often, or leave at once",
    Status.TOO_DEEP: "it has passed the middle of a solid, or its centre has passed a surface: the contact is too soft "
    "for the speed; use a larger penalty, or a smaller speed",
    Status.TIMELESS: "it goes from step to step, or from wall to wall, and no time passes; start it elsewhere, or end "
    "the run before",
}
