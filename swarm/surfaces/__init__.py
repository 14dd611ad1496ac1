"""The surfaces by their kind in a scene file."""

# These only register their definitions.
from . import rotated as _rotated  # noqa: F401
from . import smooth as _smooth  # noqa: F401
from .base import Surface
from .box import Box
from .capsule import Capsule
from .cone import Cone
from .cylinder import Cylinder
from .ellipsoid import Ellipsoid
from .formula import Formula
from .own import OwnSurface
from .paraboloid import Paraboloid
from .plane import Plane
from .quadric import Quadric
from .slab import Slab
from .sphere import Sphere
from .torus import Torus

__all__ = [
    "ALL_SURFACES",
    "Box",
    "Capsule",
    "Cone",
    "Cylinder",
    "Ellipsoid",
    "Formula",
    "OwnSurface",
    "Paraboloid",
    "Plane",
    "Quadric",
    "Slab",
    "Sphere",
    "Surface",
    "Torus",
]

ALL_SURFACES: dict[str, type[Surface]] = {
    "sphere": Sphere,
    "ellipsoid": Ellipsoid,
    "plane": Plane,
    "torus": Torus,
    "box": Box,
    "cylinder": Cylinder,
    "capsule": Capsule,
    "cone": Cone,
    "paraboloid": Paraboloid,
    "quadric": Quadric,
    "slab": Slab,
    "formula": Formula,
}
