"""The particles of a run that are there at a frame: all, or where some come during the run the first ones."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..particles import Births, State


class Present:
    """Who is there at a frame: who is not is in no draw of a kernel, and in no sum.

    Args:
        births: when particles come, None where all are there from the start.
        n: how many there are in the end.
        size: particles of a draw.

    Attributes:
        count: how many are there.
        order: the draws of them.
    """

    def __init__(self, births: Births | None, n: int, size: int) -> None:
        self._births, self._size = births, size
        self.count, self.order = n, np.arange(math.ceil(n / size))

    def reach(self, moment: float) -> None:
        """Those of the frame that ends at a moment [s]."""
        if self._births is not None:
            self.count = self._births.there(moment)
            self.order = np.arange(math.ceil(self.count / self._size))

    def of(self, array: NDArray[Any]) -> NDArray[Any]:
        """Their part of an array (N,)."""
        return array if self._births is None else array[: self.count]

    def seen(self, state: State) -> State:
        """The state as observers know it: its masses are of them alone, and when they start is no matter."""
        if self._births is None and state.starts is None:
            return state
        return state._replace(mass=self.of(state.mass), starts=None)

    def flying(self, state: State) -> State:
        """The state as kernels know it that do not ask when particles start."""
        return state if state.starts is None else state._replace(starts=None)
