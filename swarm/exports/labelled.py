"""A trajectory as a Dataset of xarray: its particles are read from the file when they are used."""

from typing import Any

import numpy as np
import xarray as xr
from xarray.backends import BackendArray
from xarray.core import indexing

from ..common.catalog import OBSERVABLES
from ..files import layout
from ..words.named import name_of, names_of_parts

# The columns of particles in the file: the name in the Dataset and the unit. "impacts" are those of all particles.
_PARTICLES = {
    "position": ("position", "m"),
    "velocity": ("velocity", "m s-1"),
    layout.IMAGES: (layout.IMAGES, "1"),
    layout.COUNTS: ("impacts_per_particle", "1"),
    layout.ESCAPES: (layout.ESCAPES, "s"),
    layout.ABSORBED: (layout.ABSORBED, "s"),
    layout.COLLISIONS: ("collisions_per_particle", "1"),
    layout.SPINS: (layout.SPINS, "rad s-1"),
}
_AXES = ("x", "y", "z")


class _Column(BackendArray):  # type: ignore[misc]
    """A dataset of the file as an array that reads only the requested part, of complete frames."""

    def __init__(self, trajectory: Any, name: str) -> None:
        self._trajectory, self._name = trajectory, name
        frames = len(trajectory)
        with trajectory._reading(name) as file:
            found = file[name]
            self.shape, self.dtype = (frames, *found.shape[1:]), found.dtype

    def __getitem__(self, key: Any) -> Any:
        return indexing.explicit_indexing_adapter(key, self.shape, indexing.IndexingSupport.OUTER_1VECTOR, self._read)

    def _read(self, key: Any) -> Any:
        # A slice without an end would reach incomplete frames.
        first = key[0]
        if isinstance(first, slice):
            first = slice(*first.indices(self.shape[0]))
        with self._trajectory._reading(self._name) as file:
            return np.asarray(file[self._name][(first, *key[1:])])


def dataset_of(trajectory: Any) -> xr.Dataset:
    """The Dataset of a trajectory; see `Trajectory.to_xarray`."""
    data: dict[str, Any] = {}
    coordinates = _coordinates(trajectory)
    own = trajectory.own_observables
    for name, values in trajectory.observables.items():
        if name in own or name not in OBSERVABLES:
            data[name] = (("time", *(f"{name}_{axis}" for axis in range(values.ndim - 1))), values)
        elif name != "time":
            known = OBSERVABLES[name]
            data[name] = (("time", *known.axes), values, {"units": known.unit})
    if any("quaternion" in dimensions for dimensions, *_rest in data.values()):
        coordinates["quaternion"] = list("wxyz")
    if trajectory.has_particles():
        with trajectory._reading("its particles") as file:
            everything = file["particles/all"]
            coordinates["particle"] = everything["id"][()]
            data["mass"] = ("particle", everything["mass"][()], {"units": "kg"})
            kept = [name for name in _PARTICLES if name in everything]
            for name, unit in zip((*layout.BIRTHS, layout.RADII), ("s", "1", "m"), strict=True):
                if name in everything:
                    data[name] = ("particle", everything[name][()], {"units": unit})
        for name in kept:
            column = _Column(trajectory, f"particles/all/{name}/value")
            label, unit = _PARTICLES[name]
            dimensions = ("time", "particle", "axis")[: len(column.shape)]
            data[label] = (dimensions, indexing.LazilyIndexedArray(column), {"units": unit})
    about = {"source": str(trajectory.path), **{name: trajectory.descriptions[name] for name in ("scene", "method")}}
    return xr.Dataset(data, coordinates, about)


def _coordinates(trajectory: Any) -> dict[str, Any]:
    """The coordinates of every Dataset."""
    found: dict[str, Any] = {
        "time": ("time", trajectory.times, {"units": "s"}),
        "axis": list(_AXES),
        "surface": [name_of(trajectory.scene, i) for i in range(len(trajectory.scene.surfaces))],
    }
    if parts := names_of_parts(trajectory.scene):
        found["part"] = parts
    if trajectory.counters:
        found["sense"] = ["out", "back"]
    return found
