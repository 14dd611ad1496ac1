"""The surfaces by their kind in a scene file.

To add one, write a file in shapes/ with a dataclass derived from `Surface`, for users, and a record derived from
`contract.Smooth`, which describes all methods, for kernels; then name the dataclass in ALL_SURFACES.
examples/own_surface.py is a complete surface. If a method of simulation needs a method that the surface lacks, an
error names it before the run.
"""

from typing import TYPE_CHECKING, Any

from ..common.kinds import Kinds
from .contract import Smooth
from .surface import Surface

if TYPE_CHECKING:
    from .data.sampled import Sampled
    from .facets.mesh import Mesh
    from .fields.bodies import Boxes, Capsules, Cylinders, Ellipsoids, Spheres
    from .fields.many import ManyBodies
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
    from .union import Intersection, Union

__all__ = [
    "ALL_FIELDS", "ALL_SURFACES", "Box", "Boxes", "Capsule", "Capsules", "Cone", "Cylinder", "Cylinders", "Ellipsoid",
    "Ellipsoids", "Formula", "Intersection", "Mesh", "OwnSurface", "Paraboloid", "Plane", "Polygon", "Prism",
    "Quadric", "Sampled", "Slab", "Smooth", "Sphere", "Spheres", "Stadium", "Surface", "Torus", "Union",
]  # fmt: skip

# Many bodies of one kind.
ALL_FIELDS: Kinds["ManyBodies"] = Kinds(
    __name__,
    {
        "spheres": "fields.bodies:Spheres",
        "cylinders": "fields.bodies:Cylinders",
        "capsules": "fields.bodies:Capsules",
        "boxes": "fields.bodies:Boxes",
        "ellipsoids": "fields.bodies:Ellipsoids",
    },
)
ALL_SURFACES: Kinds[Surface] = Kinds(
    __name__,
    {
        "sphere": "shapes.sphere:Sphere",
        "ellipsoid": "shapes.ellipsoid:Ellipsoid",
        "plane": "shapes.plane:Plane",
        "torus": "shapes.torus:Torus",
        "box": "shapes.box:Box",
        "cylinder": "shapes.cylinder:Cylinder",
        "capsule": "shapes.capsule:Capsule",
        "cone": "shapes.cone:Cone",
        "paraboloid": "shapes.paraboloid:Paraboloid",
        "quadric": "shapes.quadric:Quadric",
        "slab": "shapes.slab:Slab",
        "formula": "formulas.formula:Formula",
        "sampled": "data.sampled:Sampled",
        "mesh": "facets.mesh:Mesh",
        "union": "union:Union",
        "intersection": "union:Intersection",
        "polygon": "outlines.polygon:Polygon",
        "prism": "outlines.polygon:Prism",
        "stadium": "outlines.polygon:Stadium",
        **ALL_FIELDS.homes,
    },
)


def __getattr__(name: str) -> Any:
    if name == "OwnSurface":  # of no kind: files do not hold it
        from .formulas.own import OwnSurface

        return OwnSurface
    return ALL_SURFACES.named(name)
