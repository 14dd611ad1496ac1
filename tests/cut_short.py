"""Runs in many sessions: each ends within a frame, or at one, and the next one begins with its checkpoint."""

from swarm.run.session import Session


def in_sessions(monkeypatch, kind, passes, run, most=300):
    """The result of `run`, whose engine is of this kind, and how many sessions ended before its last one.

    Each call of the engine is halted after so many passes, or events; `run` resumes what is there.
    """
    advance, look = kind.advance, Session.look

    def stops(self, *given):
        self.stop()
        return look(self, *given)

    def halting(self, *given, **more):
        self.halt(passes)
        return advance(self, *given, **more)

    with monkeypatch.context() as patched:
        patched.setattr(Session, "look", stops)
        patched.setattr(kind, "advance", halting)
        for ended in range(most):
            try:
                return run(), ended
            except KeyboardInterrupt:
                continue
    raise AssertionError(f"the run has not ended after {most} sessions")
