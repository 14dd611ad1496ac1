"""Particles that bounce in rigid cavities and keep their energy.

The public names by topic; `help(swarm.simulate)` and so on describe each:

    Scenes         Scene, Pairs, Union, Intersection, Opening, Counter,
                   Source
    Surfaces       Box, Capsule, Cone, Cylinder, Ellipsoid, Formula, Mesh,
                   OwnSurface, Paraboloid, Plane, Polygon, Prism, Quadric,
                   Sampled, Slab, Sphere, Stadium, Torus, from_mesh
    Many solids    Boxes, Capsules, Cylinders, Ellipsoids, Spheres
    Motions        Guide, Oscillation, Path, Rotation, Translation
    Laws of walls  Absorb, CercignaniLampis, Lambert, Leave, Sticky, WallLaw
    Particles      Particles, fill, pack
    Bodies         Bodies, Body, Strain, chain, dumbbell, elastic, place,
                   rigid, tetrahedron
    Methods        Impact, Penalty, AugmentedLagrangian, Verlet, Midpoint,
                   Trapezoidal
    Runs           simulate, run, sweep, bounce, NextImpact, Frame
    Results        Result, Trajectory, load, ImpactLog, load_impacts,
                   report, ContactHistory, contact_history
    Errors         SwarmError, SceneError, RunError, FileError,
                   CompleteError, WallTimeError

They are loaded when they are first used, so that `swarm --help` does not
wait for Numba. `swarm docs -o FOLDER` writes a page for each of them.
"""

import importlib
from typing import TYPE_CHECKING, Any

from . import moved
from .version import VERSION

if TYPE_CHECKING:
    from .authoring.file_run import run
    from .bodies.body import Body, Strain
    from .bodies.copies import Bodies
    from .bodies.elastic import elastic
    from .bodies.placing import place
    from .bodies.shapes import chain, dumbbell, rigid, tetrahedron
    from .common.frames import Frame
    from .errors import CompleteError, FileError, RunError, SceneError, SwarmError, WallTimeError
    from .events.packing import pack
    from .files.impact_log import ImpactLog, load_impacts
    from .files.trajectory import Trajectory, load
    from .fleet.report import report
    from .fleet.sweeping import sweep
    from .history import ContactHistory, contact_history
    from .methods import AugmentedLagrangian, Impact, Midpoint, Penalty, Trapezoidal, Verlet
    from .motion import Guide, Oscillation, Path, Rotation, Translation
    from .pairs import Pairs
    from .particles import Particles
    from .placing.filling import fill
    from .run.next_impact import NextImpact, bounce
    from .run.result import Result
    from .run.simulation import simulate
    from .scene import Scene
    from .sources.source import Source
    from .surfaces import (
        Box,
        Boxes,
        Capsule,
        Capsules,
        Cone,
        Cylinder,
        Cylinders,
        Ellipsoid,
        Ellipsoids,
        Formula,
        Intersection,
        Mesh,
        OwnSurface,
        Paraboloid,
        Plane,
        Polygon,
        Prism,
        Quadric,
        Sampled,
        Slab,
        Sphere,
        Spheres,
        Stadium,
        Torus,
        Union,
    )  # fmt: skip
    from .surfaces.counter import Counter
    from .surfaces.data.mesh import from_mesh
    from .surfaces.laws import Absorb, CercignaniLampis, Lambert, Sticky
    from .surfaces.presence.doors import Opening
    from .surfaces.wall_law import Leave, WallLaw

__version__ = VERSION
moved.find()

# The modules of the package, and the public names that each defines.
_HOMES = {
    "bodies.body": ("Body", "Strain"),
    "bodies.elastic": ("elastic",),
    "bodies.placing": ("place",),
    "bodies.shapes": ("chain", "dumbbell", "rigid", "tetrahedron"),
    "bodies.copies": ("Bodies",),
    "fleet.report": ("report",),
    "fleet.sweeping": ("sweep",),
    "errors": ("FileError", "CompleteError", "RunError", "SceneError", "SwarmError", "WallTimeError"),
    "placing.filling": ("fill",),
    "common.frames": ("Frame",),
    "history": ("ContactHistory", "contact_history"),
    "methods": ("AugmentedLagrangian", "Impact", "Midpoint", "Penalty", "Trapezoidal", "Verlet"),
    "motion": ("Guide", "Oscillation", "Path", "Rotation", "Translation"),
    "files.impact_log": ("ImpactLog", "load_impacts"),
    "files.trajectory": ("Trajectory", "load"),
    "events.packing": ("pack",),
    "pairs": ("Pairs",),
    "particles": ("Particles",),
    "scene": ("Scene",),
    "sources.source": ("Source",),
    "run.next_impact": ("NextImpact", "bounce"),
    "run.result": ("Result",),
    "run.simulation": ("simulate",),
    "surfaces.counter": ("Counter",),
    "surfaces.data.mesh": ("from_mesh",),
    "surfaces.presence.doors": ("Opening",),
    "surfaces": (
        "Box", "Boxes", "Capsule", "Capsules", "Cone", "Cylinder", "Cylinders", "Ellipsoid", "Ellipsoids", "Formula",
        "Intersection", "Mesh", "OwnSurface", "Paraboloid", "Plane", "Polygon", "Prism", "Quadric", "Sampled", "Slab",
        "Sphere", "Spheres", "Stadium", "Torus", "Union",
    ),
    "surfaces.laws": ("Absorb", "CercignaniLampis", "Lambert", "Sticky"),
    "surfaces.wall_law": ("Leave", "WallLaw"),
}  # fmt: skip
# The public names that are packages, which may be called.
_PACKAGES = ("run",)
_HOME = {name: home for home, names in _HOMES.items() for name in names}

__all__ = [
    "Absorb", "AugmentedLagrangian", "Bodies", "Body", "Box", "Boxes", "Capsule", "Capsules", "CercignaniLampis",
    "CompleteError", "Cone", "ContactHistory", "Counter", "Cylinder", "Cylinders", "Ellipsoid", "Ellipsoids",
    "FileError", "Formula", "Frame", "Guide", "Impact", "ImpactLog", "Intersection", "Lambert", "Leave", "Mesh",
    "Midpoint", "NextImpact", "Opening", "Oscillation", "OwnSurface", "Pairs", "Paraboloid", "Particles", "Path",
    "Penalty", "Plane", "Polygon", "Prism", "Quadric", "Result", "Rotation", "RunError", "Sampled", "Scene",
    "SceneError", "Slab", "Source", "Sphere", "Spheres", "Stadium", "Sticky", "Strain", "SwarmError", "Torus",
    "Trajectory", "Translation", "Trapezoidal", "Union", "Verlet", "WallLaw", "WallTimeError", "__version__", "bounce",
    "chain", "contact_history", "dumbbell", "elastic", "fill", "from_mesh", "load", "load_impacts", "pack", "place",
    "report", "rigid", "run", "simulate", "sweep", "tetrahedron",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    if name in _PACKAGES:
        return importlib.import_module(f".{name}", __name__)
    if name not in _HOME:
        raise AttributeError(f"module 'swarm' has no attribute {name!r}")
    # No other public name is the name of a module, as importing the module would hide it.
    value = getattr(importlib.import_module(f".{_HOME[name]}", __name__), name)
    signature = importlib.import_module(".common.signature", __name__)
    signature.show_in_lines(value)
    globals()[name] = value = signature.explain_calls(value)
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
