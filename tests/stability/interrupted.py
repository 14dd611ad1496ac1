"""Runs that are cut: any threads and blocks, halts within frames, and sessions give the same bits."""

from swarm.run.session import Session


def require_same_bits(engine, run, require_same, folder, monkeypatch):
    """Hold what `run(**options)` gives in pieces, by an engine's class, against the whole of it, by `require_same`."""
    require_same(run(threads=2, block_size=256))
    advance, look, passes = engine.advance, Session.look, [5]

    def halting(self, *given, **more):
        self.halt(passes[0])
        return advance(self, *given, **more)

    def stops(self, *given):
        self.stop()
        return look(self, *given)

    with monkeypatch.context() as patch:
        patch.setattr(engine, "advance", halting)
        require_same(run())
        passes[0] = 40
        patch.setattr(Session, "look", stops)
        for _session in range(300):
            try:
                require_same(run(trajectory=folder / "parts.h5", resume=True, checkpoint=1e3))
                return
            except KeyboardInterrupt:
                continue
    raise AssertionError("the sessions have no end")
