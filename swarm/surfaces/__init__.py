"""The surfaces by their kind in a scene file."""

from .base import Surface
from .ellipsoid import Ellipsoid
from .plane import Plane
from .sphere import Sphere
from .torus import Torus

__all__ = ["ALL_SURFACES", "Ellipsoid", "Plane", "Sphere", "Surface", "Torus"]

ALL_SURFACES: dict[str, type[Surface]] = {"sphere": Sphere, "ellipsoid": Ellipsoid, "plane": Plane, "torus": Torus}
