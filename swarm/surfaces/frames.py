"""A surface in a frame of its own: calls are forwarded to its body in that frame.

Each argument of the contract has a role that says how it is transformed into the frame, and each result one that says
how it is transformed out of it. Places, velocities and other vectors are turned; a place is also moved; in a wall that
moves a velocity loses that of the wall; a number is the same in any frame. At the end of a step the wall may be at
another place: this end has the role `end`, the free displacement `way`, and the `normal` of the step is turned to both.
"""

from typing import Any

from .contract import Smooth

# The roles of the arguments and of the result, and the methods with these roles.
_FORWARDED: tuple[tuple[tuple[str | None, ...], str | None, tuple[str, ...]], ...] = (
    ((None,), None, ("gap_of", "level_of")),
    ((None, None), None, ("gap_slope",)),
    (("place",), None, ("phi", "polynomial", "inner", "distance", "gap_scale", "out_of", "far")),
    (("place",), "vector", ("gradient", "inner_gradient", "unit_normal")),
    (("place",), "place", ("project",)),
    # For a flight
    (("place", "velocity"), None, ("first_hit",)),
    (("place", "velocity", "vector"), None, ("falling_hit", "safe_time", "course", "outward_acceleration")),
    (("gravity", "place", "velocity"), None, ("steps", "fall", "entry")),
    (("gravity", "place", "velocity", None), None, ("refined",)),
    (("lease",), None, ("reach",)),
    (("seen",), None, ("level_along",)),
    (("seen", None), None, ("moving_step",)),
    (("place", "velocity", "swings"), None, ("passage",)),
    # For a step
    ((), None, ("farthest_push",)),
    (("end",), None, ("end_inner",)),
    (("place", "end"), "normal", ("discrete_gradient", "gap_gradient", "resting_gradient", "step_normal")),
    (("place", "way"), None, ("free_rise", "chord_guess")),
    (("place", "way", None), None, ("rise", "chord_improve")),
    (("place", "way", None), "end", ("push",)),
    (("place", "way", None), "normal", ("chord_normal",)),
    (("place", "way", None, "vector"), None, ("turned_rise",)),
    (("place", "way", None, "vector"), "end", ("turned_push",)),
    (("place", None), "place", ("resolve",)),
    # For a field: see `Members`
    ((), None, ("count",)),
    ((None, None), None, ("goes_on",)),
    (("place",), None, ("count_in_cell", "deepest_in_cell")),
    (("place", "velocity"), None, ("until_next_cell",)),
    (("gravity", "place", "velocity"), None, ("field_hit",)),
    ((None, "place"), None, ("is_in_another", "one_in_cell")),
    ((None, "place", None), None, ("is_there", "wall_after")),
    ((None, None, "place", None), None, ("list_in_cell",)),
)
_CONSTANTS = (
    "side",
    "degree",
    "flat",
    "is_quartic",
    "may_be_far",
    "in_steps",
    "kept",
    "aims",
    "fall_powers",
    "looked_at",
    "flight",
    "has_levels",
    "has_core",
    "proves",
    "lacks_bend",
    "chord_sweeps",
    "leaves_once",
    "holds_balls",
)


class Framed(Smooth):
    """A surface `body` in a frame of its own.

    A class of frames defines the transformations into the frame, such as `place_in`, and out of it, as far as they are
    needed, and overrides the methods that depend on more than their arguments.
    """

    def grown(self, radius):
        return self._replace(body=self.body.grown(radius))

    def reversible(self):
        body = self.body.reversible()
        return None if body is None else self._replace(body=body)

    def seen_in(self, seen):
        """Return a particle relative to the wall, in the frame of the body."""
        return self._flight_in(seen)

    def _flight_in(self, flight):
        return flight._replace(r=self.place_in(flight.r), v=self.vector_in(flight.v), a=self.vector_in(flight.a))

    def lease_in(self, lease):
        """Return a `Lease` in the frame of the body."""
        return self._flight_in(lease)._replace(axis=None if lease.axis is None else self.vector_in(lease.axis))


def _forwarded(name: str, roles: tuple[str | None, ...], result: str | None) -> Any:
    ways = tuple(role and f"{role}_in" for role in roles)
    out = result and f"{result}_out"

    def asked(self, *given):
        own = (a if way is None else getattr(self, way)(a) for a, way in zip(given, ways, strict=True))
        answer = getattr(self.body, name)(*own)
        return answer if out is None else getattr(self, out)(answer)

    return asked


for _roles, _result, _names in _FORWARDED:
    for _name in _names:
        setattr(Framed, _name, _forwarded(_name, _roles, _result))
for _name in _CONSTANTS:
    setattr(Framed, _name, property(lambda self, name=_name: getattr(self.body, name)))  # type: ignore[misc]


class Unturned(Framed):
    """A surface in the frame of its body: transformations are the identity. Subclasses change results."""

    def flat_normal(self):
        return self.body.flat_normal()

    def _same(self, given):
        return given

    place_in = end_in = velocity_in = vector_in = way_in = gravity_in = swings_in = _same
    place_out = end_out = vector_out = normal_out = _same
