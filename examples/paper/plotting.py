"""What several figures show alike."""

from typing import Any

import numpy as np

import swarm

from .cases import PENALTY, TOLERANCE, Floats

SWEEP = "sweep of Uzawa's loop"
# Phi1 at which the paper's loop ends, for its alpha of the sphere.
CONSTRAINT_BAR = float(np.sqrt(2.0 * TOLERANCE / PENALTY))


def sweeps(history: swarm.ContactHistory) -> Floats:
    """1, 2, ..., the x axis of a history."""
    return np.arange(1.0, len(history) + 1.0)


def curve(axes: Any, history: swarm.ContactHistory, values: Floats, **line: Any) -> None:
    """One quantity by sweep; a value that a log axis cannot show is left out."""
    positive = axes.get_yscale() == "log"
    axes.plot(
        sweeps(history), np.where(values > 0.0, values, np.nan) if positive else values, **{"marker": "o", **line}
    )
