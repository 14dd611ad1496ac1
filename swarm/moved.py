"""Modules that moved: imports by earlier names find them, with a `DeprecationWarning`."""

import importlib
import importlib.machinery
import importlib.util
import sys
import warnings
from collections.abc import Sequence
from types import ModuleType
from typing import Any

# The earlier folder, the present one, and the modules that moved from one to the other.
_FOLDERS = [
    ("", "common", "catalog checks columns extras frames interrupt links notebook rows signature snapshot status"),
    ("", "serialization", "law_tables=tables plugins run_tables tables"),
    ("", "surfaces", "pieces plane"),
    ("", "placing", "filling"),
    ("", "events", "packing colliding reacting"),
    ("", "commands", "cli summary"),
    ("", "", "output=pictures"),
    ("", "", "cluster=fleet ensemble=fleet"),
    ("run", "", "cluster=fleet"),
    ("run.cluster", "fleet", "*"),
    ("run.cluster", "fleet", "client=sharded_run worker=shard_run"),
    ("cluster", "fleet", "*"),
    ("cluster", "fleet", "client=sharded_run worker=shard_run"),
    ("ensemble", "fleet", "*"),
    ("ensemble", "fleet", "hand=processes pool=sweeping worker=sweep_run"),
    ("sources", "surfaces", "pieces=area_samples"),
    ("colliding", "events.colliding", "*"),
    ("reacting", "events.reacting", "*"),
    ("contact", "contact", "doorways=absence passing=absence"),
    ("lanes", "bodies", "bodies=lanes"),
    ("lanes.bodies", "bodies.lanes", "*"),
    ("lanes.bodies", "bodies.lanes", "arrays=body_arrays"),
    ("reacting", "events.reacting", "walls=strikes"),
    ("lanes", "lanes", "arrays=lane_arrays"),
    ("bodies", "bodies", "passing=admission state=copies velocities=copies"),
    ("methods", "methods", "implicit_rule=implicit midpoint=implicit trapezoidal=implicit"),
    ("run.preflight", "run.preflight", "overlaps=hints"),
    ("serialization", "serialization", "law_tables=tables"),
    ("sources", "sources", "velocities=births"),
    ("grains", "grains", "arrays=grain_arrays described=matter soft=matter"),
    ("run", "run", "state=starting_state"),
    ("placing", "placing", "shapes=fitting_shapes"),
    ("surfaces.data", "surfaces.data", "cells=sample_cells flight=sampled_numbers numbers=sampled_numbers"),
    ("surfaces.facets", "surfaces.facets", "cells=facet_cells made=members room=free_room"),
    ("surfaces.laws", "surfaces.laws", "numbers=law_numbers"),
    ("lanes", "lanes.watching", "counted_lanes counters counts crossings log"),
    ("run", "events", "balls resting windows colliding=balls_run growing=growing_run heavy=heavy_run"),
    ("run", "events", "reacting=walls_run"),
    ("run", "bodies", "bodies=body_run energies passing=admission with_bodies=admission"),
    ("run", "grains", "faces grains=grains_run refused soft=matter"),
    ("run", "run.preflight", "admission counting hints knows overlaps=hints sinking=softness starts workload"),
    ("run", "kernel", "compiling"),
    ("surfaces", "surfaces.facets", "data.mending=mending data.mesh_files=mesh_files data.triangles=triangles"),
    ("surfaces", "surfaces", "depth=walls"),
    ("surfaces", "surfaces.in_motion", "at_rest drive moving posed"),
    ("surfaces.outlines", "surfaces.outlines", "apart=outline"),
    ("surfaces", "surfaces.periodic", "axes gaps images period"),
    ("surfaces", "surfaces.presence", "doors joined openings patched rooms seams"),
    ("surfaces.presence", "surfaces.presence", "ajar=doors"),
    ("surfaces", "surfaces.time_of_impact", "approach course flights march rising safe strides"),
    ("output", "", "page=pages views"),
    ("output", "exports", "export exported gsd labelled obj ply spreadsheet vtkhdf walls xyz"),
    ("output", "files", "appended background checkpoint checksums driver impact_log impacts layout lock marks origin"),
    ("output", "files", "paths provenance replaced sources storage stored superblock trajectory writer"),
    ("output", "pictures", "balls colours drawing drawn eye film flat framed graphs plots raster scenery sentences"),
    ("output", "pictures", "series shown_film silhouette speeds style triad"),
    ("output", "recording", "about instanced looks playback recorded recording=writer sheet sight viewer widget"),
    ("output", "pages", "page.html=html page.pictures=pictures page.reproduce=reproduce page.run=of_run"),
    ("output", "run", "sequence"),
    ("output", "triangles", "curves cut given gridded parts planar shape shapes sharp solids"),
    ("commands", "commands", "docs=scenes export=trajectories info=trajectories report=pictures"),
    ("fleet", "fleet", "shard_run=sharded_run sharded=sharded_run shown=sweeping"),
    ("authoring", "files", "texts=marks"),
    ("kernel.trace", "kernel.trace", "expressions=twins"),
    ("surfaces", "surfaces", "polyhedron=room"),
    ("triangles", "triangles", "given=sharp"),
    ("events", "events.colliding", "resting windows=window"),
    ("events.colliding", "events", "growing=growing_run"),
    ("events.colliding", "events.colliding", "ahead=events"),
    ("pictures", "pictures", "silhouette=scenery"),
    ("recording", "recording", "about=looks sight=looks"),
    ("output", "words", "amounts content facts gone named nouns verdicts words=titles"),
]


def _dotted(*parts: str) -> str:
    return ".".join((__package__, *filter(None, parts)))


# The folders that moved as a whole, with their present names.
_WHOLE = {_dotted(old): _dotted(new) for old, new, names in _FOLDERS if names == "*"}
MOVED = {
    _dotted(old, before): _dotted(new, after or before)
    for old, new, names in _FOLDERS
    if names != "*"
    for before, _, after in (name.partition("=") for name in names.split())
}


def present_name(name: str) -> str | None:
    """Return the present name of a module that moved, or None.

    >>> present_name("swarm.output.style")
    'swarm.pictures.style'
    >>> present_name("swarm.colliding.cells")
    'swarm.events.colliding.cells'
    """
    folder, _, leaf = name.rpartition(".")
    present = MOVED.get(name) or (f"{_WHOLE[folder]}.{leaf}" if folder in _WHOLE else None)
    # Some modules moved more than once.
    return present and (present_name(present) or present)


class _Finder:
    def find_spec(
        self, name: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        present = present_name(name)
        if present is None:
            return None
        # Frames of the import system are not counted.
        warnings.warn(f"the module {name} is now {present}", DeprecationWarning, stacklevel=2)
        loader: Any = _Loader(present)
        return importlib.util.spec_from_loader(name, loader)


class _Loader:
    """A loader of the module with another name."""

    def __init__(self, present: str) -> None:
        self._present = present

    def create_module(self, spec: importlib.machinery.ModuleSpec) -> ModuleType:
        module = importlib.import_module(self._present)
        self._spec = module.__spec__
        return module

    def exec_module(self, module: ModuleType) -> None:
        # The import system has written the earlier name into the module.
        module.__spec__ = self._spec


def find() -> None:
    """Let imports find modules by their earlier names."""
    # In front of other finders, which would find a second copy where an earlier folder has the path of a present one.
    sys.meta_path.insert(0, _Finder())
