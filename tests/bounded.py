"""A bound of what a run may take: time does not pass where it takes more, whatever the machine."""

import pytest

from swarm.lanes import block, careful, contact_events, slide

# What counts: a pass over lanes that fly or that slide, a decision at a wall, a short step.
_COUNTED = ((block, "_pass"), (slide, "compose"), (contact_events, "_decide"), (careful, "_step"))


def bounded(monkeypatch: pytest.MonkeyPatch, most: int) -> list[int]:
    """Let runs in plain Python fail after so many passes of all kernels together: the count so far."""
    count = [0]
    for module, name in _COUNTED:
        monkeypatch.setattr(module, name, _counted(getattr(module, name), count, most))
    return count


def _counted(one, count, most):
    def counted(*arguments):
        count[0] += 1
        assert count[0] <= most, "time does not pass"
        return one(*arguments)

    return counted
