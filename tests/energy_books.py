"""The energy of a run and its books: what was lost, and what walls, sources and anchors gave."""

import numpy as np

_GIVEN = ("wall_work", "wall_heat", "source_energy", "work")


def booked(seen):
    """The total energy of each frame, with what was lost and without what was given [J]: all of them are the same."""
    given = [seen[name].reshape(len(seen["time"]), -1).sum(axis=1) for name in _GIVEN if name in seen]
    return seen["total_energy"] + seen["dissipated_energy"] - sum(given)


def unbooked(seen):
    """The largest change of the energy that no book has [J]."""
    energy = booked(seen)
    return np.abs(energy - energy[0]).max()
