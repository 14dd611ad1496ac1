"""The particles of a run in the scene at a frame: all, or in a run with sources the first ones."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..observables import CHUNK, add_up
from ..particles import Births
from ..state import Floats, State


class Presence:
    """The particles of the start, and the particles born by the end of a frame: only these are drawn and summed.

    Args:
        births: the births, or None if all particles are in the scene from the start.
        state: the state at the start, with the energy that each particle of a source brings in.
        size: the number of particles in a draw.

    Attributes:
        count: the number of these particles.
        order: the numbers of their draws.
    """

    def __init__(self, births: Births | None, state: State, size: int) -> None:
        self._births, self._size, self.count = births, size, state.mass.size
        self.order = np.arange(math.ceil(self.count / size))
        if births is not None:
            self._energy = np.where(births.source >= 0, state.mass * state.energy, 0.0)

    def reach(self, moment: float) -> None:
        """Set the particles of the frame that ends at a moment [s]."""
        if self._births is not None:
            self.count = self._births.there(moment)
            self.order = np.arange(math.ceil(self.count / self._size))

    def of(self, array: NDArray[Any]) -> NDArray[Any]:
        """Return the part of an array (N,) of these particles."""
        return array if self._births is None else array[: self.count]

    def seen(self, state: State) -> State:
        """Return the state that observers take, with the masses of these particles, which give their number."""
        if self._births is None and state.starts is None:
            return state
        return state._replace(mass=self.of(state.mass), starts=None)

    def sums(self, sums: Floats) -> Floats:
        """Return the sums over chunks (quantities, chunks), with a last row for the energy that sources brought in."""
        if self._births is None:
            return sums
        brought = np.zeros((1, sums.shape[1]))
        add_up(self._energy[None], self.count, brought)
        return np.concatenate([sums, brought])

    def observed(self) -> dict[str, Any]:
        """Return the number of particles born so far from each source, and the energy that they brought in."""
        if self._births is None:
            return {}
        source = self._births.source[: self.count]
        chunks = math.ceil(len(self._births.time) / CHUNK)
        brought = total_of(self.sums(np.zeros((0, chunks))))
        born = np.bincount(source[source >= 0], minlength=self._births.sources)
        return {"born": born.astype(np.int64), **brought}

    def flying(self, state: State) -> State:
        """Return the state that kernels take, with the times of starts only if a law may let particles wait."""
        return state if state.starts is None or state.absorbed_time is not None else state._replace(starts=None)


def total_of(sums: Floats) -> dict[str, Any]:
    """Return the energy brought in by sources so far, from the sums over all chunks of `Presence.sums`."""
    return {"source_energy": float(np.add.reduce(np.ascontiguousarray(sums[-1])))}
