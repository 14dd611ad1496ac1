"""The common part of all walls that the centre of a ball meets, with the distance as their phi."""

from typing import TYPE_CHECKING, Any

from .. import contract


class AtRadius(contract.Smooth):
    """The places at the field `radius` from a wall: phi is the distance from these places, with a unit gradient."""

    if TYPE_CHECKING:
        radius: Any

    def grown(self, radius):
        return self._replace(radius=radius)

    def distance(self, r):
        return self.side * self.phi(r)

    def unit_normal(self, r):
        return self.side * self.gradient(r)

    def clearance(self, r):
        return -self.distance(r)
