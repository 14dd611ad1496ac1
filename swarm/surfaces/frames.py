"""A surface in a frame of its own: what is asked of it is asked of its body there.

Each argument of the contract has a role, by which it goes into the frame, and each answer one by which it comes out: a
place, a velocity and any other vector are turned, a place is moved too, in a wall that moves a velocity loses that of
the wall, and a number is the same in any frame. Over a step the wall may be elsewhere at its end: that is the place
`end`, the free displacement is a `way`, and the `normal` of the step is turned to both.
"""

from typing import Any

from .contract import Smooth

# What is asked: the roles of its arguments, and of the answer.
_FORWARDED: tuple[tuple[str, tuple[str | None, ...], str | None], ...] = (
    ("gap_of", (None,), None),
    ("level_of", (None,), None),
    ("gap_slope", (None, None), None),
    ("phi", ("place",), None),
    ("polynomial", ("place",), None),
    ("inner", ("place",), None),
    ("distance", ("place",), None),
    ("gap_scale", ("place",), None),
    ("gradient", ("place",), "vector"),
    ("inner_gradient", ("place",), "vector"),
    ("unit_normal", ("place",), "vector"),
    ("project", ("place",), "place"),
    ("out_of", ("place",), None),
    ("far", ("place",), None),
    ("reach", ("lease",), None),
    ("farthest_push", (), None),
    ("first_hit", ("place", "velocity"), None),
    ("falling_hit", ("place", "velocity", "vector"), None),
    ("safe_time", ("place", "velocity", "vector"), None),
    ("course", ("place", "velocity", "vector"), None),
    ("level_along", ("seen",), None),
    ("moving_step", ("seen", None), None),
    ("passage", ("place", "velocity", "swings"), None),
    ("outward_acceleration", ("place", "velocity", "vector"), None),
    ("steps", ("gravity", "place", "velocity"), None),
    ("fall", ("gravity", "place", "velocity"), None),
    ("refined", ("gravity", "place", "velocity", None), None),
    ("entry", ("gravity", "place", "velocity"), None),
    ("end_inner", ("end",), None),
    ("discrete_gradient", ("place", "end"), "normal"),
    ("gap_gradient", ("place", "end"), "normal"),
    ("resting_gradient", ("place", "end"), "normal"),
    ("step_normal", ("place", "end"), "normal"),
    ("push", ("place", "way", None), "end"),
    ("rise", ("place", "way", None), None),
    ("free_rise", ("place", "way"), None),
    ("turned_push", ("place", "way", None, "vector"), "end"),
    ("turned_rise", ("place", "way", None, "vector"), None),
    ("resolve", ("place", None), "place"),
    ("chord_guess", ("place", "way"), None),
    ("chord_improve", ("place", "way", None), None),
    ("chord_normal", ("place", "way", None), "normal"),
    # Of a field: see `Members`
    ("count", (), None),
    ("field_hit", ("gravity", "place", "velocity"), None),
    ("until_next_cell", ("place", "velocity"), None),
    ("is_in_another", (None, "place"), None),
    ("count_in_cell", ("place",), None),
    ("list_in_cell", (None, None, "place", None), None),
    ("one_in_cell", (None, "place"), None),
    ("deepest_in_cell", ("place",), None),
    ("is_there", (None, "place", None), None),
    ("wall_after", (None, "place", None), None),
    ("goes_on", (None, None), None),
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
    """A surface `body`, asked in its own frame.

    A class of frames gives the ways in, such as `place_in`, and out, as far as its surfaces are asked, and overrides
    what depends on more than its arguments.
    """

    def grown(self, radius):
        return self._replace(body=self.body.grown(radius))

    def reversible(self):
        body = self.body.reversible()
        return None if body is None else self._replace(body=body)

    def seen_in(self, seen):
        """A particle as the wall sees it, in the frame of the body."""
        return self._flight_in(seen)

    def _flight_in(self, flight):
        return flight._replace(r=self.place_in(flight.r), v=self.vector_in(flight.v), a=self.vector_in(flight.a))

    def lease_in(self, lease):
        """A `Lease` in the frame of the body."""
        return self._flight_in(lease)._replace(axis=None if lease.axis is None else self.vector_in(lease.axis))


def _forwarded(name: str, roles: tuple[str | None, ...], result: str | None) -> Any:
    ways = tuple(role and f"{role}_in" for role in roles)
    out = result and f"{result}_out"

    def asked(self, *given):
        own = (a if way is None else getattr(self, way)(a) for a, way in zip(given, ways, strict=True))
        answer = getattr(self.body, name)(*own)
        return answer if out is None else getattr(self, out)(answer)

    return asked


for _name, _roles, _result in _FORWARDED:
    setattr(Framed, _name, _forwarded(_name, _roles, _result))
for _name in _CONSTANTS:
    setattr(Framed, _name, property(lambda self, name=_name: getattr(self.body, name)))  # type: ignore[misc]


class Unturned(Framed):
    """A surface in the frame of its body: each way in and out is the identity. Subclasses change what is answered."""

    def _same(self, given):
        return given

    place_in = end_in = velocity_in = vector_in = way_in = gravity_in = swings_in = _same
    place_out = end_out = vector_out = normal_out = _same
