"""The surfaces by their kind in a scene file.

To add one, write a file in shapes/ with a dataclass derived from `Surface`, for users, and a record derived from
`contract.Smooth`, which describes all methods, for kernels; then name the dataclass in ALL_SURFACES.
examples/own_surface.py is a complete surface. If a method of simulation needs what is missing, an error says so before
the run.
"""

from .contract import Smooth as Smooth
from .data.sampled import Sampled
from .facets.mesh import Mesh
from .fields.bodies import Boxes, Capsules, Cylinders, Ellipsoids, Spheres
from .fields.many import Many
from .formulas.formula import Formula
from .formulas.own import OwnSurface
from .outlines.polygon import Polygon, Prism, Stadium
from .shapes.box import Box
from .shapes.capsule import Capsule
from .shapes.cone import Cone
from .shapes.cylinder import Cylinder
from .shapes.ellipsoid import Ellipsoid
from .shapes.paraboloid import Paraboloid
from .shapes.plane import Plane
from .shapes.quadric import Quadric
from .shapes.slab import Slab
from .shapes.sphere import Sphere
from .shapes.torus import Torus
from .surface import Surface
from .union import Intersection, Union

__all__ = [
    "ALL_FIELDS",
    "ALL_SURFACES",
    "Box",
    "Boxes",
    "Capsule",
    "Capsules",
    "Cone",
    "Cylinder",
    "Cylinders",
    "Ellipsoid",
    "Ellipsoids",
    "Formula",
    "Intersection",
    "Mesh",
    "OwnSurface",
    "Paraboloid",
    "Plane",
    "Polygon",
    "Prism",
    "Quadric",
    "Sampled",
    "Slab",
    "Sphere",
    "Spheres",
    "Stadium",
    "Surface",
    "Torus",
    "Union",
]

# Many bodies of one kind.
ALL_FIELDS: dict[str, type[Many]] = {
    "spheres": Spheres,
    "cylinders": Cylinders,
    "capsules": Capsules,
    "boxes": Boxes,
    "ellipsoids": Ellipsoids,
}
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
    "sampled": Sampled,
    "mesh": Mesh,
    "union": Union,
    "intersection": Intersection,
    "polygon": Polygon,
    "prism": Prism,
    "stadium": Stadium,
    **ALL_FIELDS,
}
