"""The laws of walls besides rigidity: restitution, friction, temperature."""

from typing import Any, NamedTuple


class Thermal(NamedTuple):
    """A wall that exchanges heat; one that does not has accommodation 0."""

    temperature_speed2: Any  # k_B T [J]: over the mass, the variance of a component of the velocity
    accommodation: Any


class Laws(NamedTuple):
    """The laws of all walls, each a chain with one entry a wall, or None where no wall has it."""

    restitution: Any  # e
    friction: Any  # Coulomb's coefficient
    thermal: Any  # Thermal
