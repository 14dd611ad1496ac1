"""Runs in parts: halted within their frames, and in many sessions, each of which goes on from the last checkpoint."""

import contextlib

from same_bits import require_same

from swarm.run.session import Session


@contextlib.contextmanager
def halted(monkeypatch, kind, passes):
    """Each call of engines of this kind is halted after so many passes, or events; gives a list with one for a call."""
    advance, calls = kind.advance, []

    def halting(self, *given, **more):
        calls.append(1)
        self.halt(passes)
        return advance(self, *given, **more)

    with monkeypatch.context() as patched:
        patched.setattr(kind, "advance", halting)
        yield calls


def in_sessions(monkeypatch, kind, passes, run, most=300):
    """The result of `run`, whose engine is of this kind, and how many sessions ended before its last one.

    Each session ends within a frame, or at one; `run` resumes what is there.
    """
    look = Session.look

    def stops(self, *given):
        self.stop()
        return look(self, *given)

    with monkeypatch.context() as patched, halted(monkeypatch, kind, passes):
        patched.setattr(Session, "look", stops)
        for ended in range(most):
            try:
                return run(), ended
            except KeyboardInterrupt:
                continue
    raise AssertionError(f"the run has not ended after {most} sessions")


def require_same_bits(monkeypatch, kind, whole, run, path):
    """`run(**options)` gives the whole in any threads and blocks, halted within frames, and in sessions."""
    require_same(whole, run(threads=2, block_size=256))
    with halted(monkeypatch, kind, 5):
        require_same(whole, run())
    parts, _sessions = in_sessions(monkeypatch, kind, 40, lambda: run(trajectory=path, resume=True, checkpoint=1e3))
    require_same(whole, parts)
