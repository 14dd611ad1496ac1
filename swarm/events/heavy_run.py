"""The run of rigid balls in a scene in which some walls have a mass."""

from typing import Any

import numpy as np

from ..compiled_scene import CompiledScene
from ..kernel.vector import vec
from ..run.observed import Observed, observed_of
from ..scene import Scene
from ..state import Floats
from ..surfaces.walls import penetration
from .balls_run import CollidingRun
from .colliding.heavy import COUNTS, Heavy
from .reacting.described import bring_walls, freedoms_of, scenery_of, walls_now
from .reacting.freedoms import Freedoms, alone


class HeavyRun(CollidingRun):
    """A `CollidingRun` in which impacts move walls."""

    _freedoms: Freedoms
    _observed: Observed

    def _is_clear(self, place: Floats, radius: float, moment: float) -> bool:
        r, now = vec(place), self._since(moment)
        walls = [wall.grown(radius) for wall in self._heavy.walls]
        return all(penetration(alone(wall.freedom.posed(wall.body, self._freedoms, now)), r) <= 0.0 for wall in walls)

    def _with_heavy(self, compiled: CompiledScene, box: Any) -> Any:
        state = self.state
        n = state.mass.size
        self._freedoms = freedoms_of(compiled, state.velocity)
        scenery = scenery_of(compiled, 0.0)
        ways = tuple({wall.freedom.row: wall.freedom for wall in scenery.reacting}.values())
        self._heavy = Heavy(
            scenery.reacting, ways, self._freedoms, self._clock, np.zeros(COUNTS), np.zeros(n, bool), np.zeros(n, bool),
            np.zeros(n, np.int64),
        )  # fmt: skip
        self._flock = self._flock._replace(freedoms=self._freedoms)
        gates = None if box.gates is None else box.gates._replace(openings=scenery.openings)
        return box._replace(heavy=self._heavy, owners=scenery.owners, rows=scenery.rows, gates=gates)

    def _set_window(self) -> None:
        if self._windows is not None:
            self._heavy = self._heavy._replace(walls=self._windows.scenery().reacting)
            self._box = self._box._replace(heavy=self._heavy)
        super()._set_window()

    def _scene_at(self, instant: float) -> Scene:
        self._walls_seen(instant)
        return self._scene.placed(self._observed.position, self._observed.orientation)

    def _begin(self) -> None:
        for freedom in self._heavy.ways:
            freedom.renew(self._freedoms, 0.0)
        super()._begin()

    def _walls_seen(self, moment: float) -> Any:
        """Return the walls at a moment [s], moved there in a copy, as frames have no influence on the motion."""
        freedoms, since = Freedoms(*(array.copy() for array in self._freedoms)), self._since(moment)
        scenery = scenery_of(self._compiled, moment)
        bring_walls(scenery, freedoms, since)
        self._observed = observed_of(self._scene, freedoms, moment)
        return walls_now(self._compiled, scenery, freedoms)

    def _scale_of(self, seen: dict[str, Any]) -> float:
        return super()._scale_of(seen) + float(self._observed.kinetic.sum())

    def _arrays(self) -> dict[str, Any]:
        heavy = self._heavy._asdict()
        own = {f"heavy.{name}": heavy[name] for name in ("counts", "near", "listed", "close")}
        return {**super()._arrays(), "walls": self._freedoms, **own}
