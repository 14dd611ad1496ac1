"""Many copies of one body, each with its own place and velocity."""

import numpy as np
from numpy.typing import ArrayLike

from ..particles import Floats, Particles
from .body import Body, Pairs


class Bodies:
    """n copies of a body.

    Args:
        body: the template.
        position: (3, P, n) [m], rows x, y, z of every point of every copy.
        velocity: (3, P, n) [m/s].

    The arrays are copied, in C order.

    Raises:
        SceneError: wrong shapes, no copy, or a value that is not finite or beyond 1e100.
    """

    def __init__(self, body: Body, position: ArrayLike, velocity: ArrayLike) -> None:
        self.body = body
        self.position = np.array(position, dtype=np.float64, order="C")
        self.velocity = np.array(velocity, dtype=np.float64, order="C")

    def copy(self) -> "Bodies":
        """The same bodies, checked again, with arrays of their own."""
        return Bodies(self.body, self.position, self.velocity)

    def __len__(self) -> int:
        return int(self.position.shape[2])

    def __repr__(self) -> str:
        return f"Bodies({len(self)} of {len(self.body)} points)"

    def contact_points(self) -> Floats:
        """(3, K, n) the points that can touch walls."""
        return np.einsum("kp,xpn->xkn", self.body.contacts, self.position)

    def bonds(self) -> Pairs:
        """(B n, 2) the pairs of points that are tied, of all copies, as numbers of `particles`."""
        n = len(self)
        return (self.body.bonds()[:, None] * n + np.arange(n)[:, None]).reshape(-1, 2)

    def particles(self) -> Particles:
        """All points as particles: point p of copy i is number p n + i. The mass of each is its row's sum in M."""
        n, mass = len(self), self.body.mass_matrix.sum(axis=1)
        flat = self.position.reshape(3, -1), self.velocity.reshape(3, -1)
        return Particles(*flat, np.repeat(mass, n))
