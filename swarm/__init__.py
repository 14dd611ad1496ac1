"""Particles bouncing in rigid cavities and off rigid solids, with energy conserved to round-off."""

from .errors import FileError, RunError, SceneError, SwarmError
from .fill import fill
from .methods import Impact, Penalty
from .particles import Particles
from .scene import Scene
from .simulate import Frame, Result, simulate
from .surfaces import Ellipsoid, Plane, Sphere
from .version import VERSION

__all__ = [
    "Ellipsoid",
    "FileError",
    "Frame",
    "Impact",
    "Particles",
    "Penalty",
    "Plane",
    "Result",
    "RunError",
    "Scene",
    "SceneError",
    "Sphere",
    "SwarmError",
    "fill",
    "simulate",
]
__version__ = VERSION
