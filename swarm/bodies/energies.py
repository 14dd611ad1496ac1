"""The energies and momenta of the copies of a body, and their sums."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..compiled_scene import CompiledScene
from ..contact.energy import contact_energy
from ..kernel.vector import column
from ..observables import COUNTED, of_counters
from ..state import Floats
from .body import Body, squares_between
from .lanes.body_arrays import Ties
from .numbers import led_points


class BodyEnergies:
    """The energies of n copies, each (n,) [J], from positions and velocities (3, P, n).

    Args:
        compiled: the walls.
        carried: a scene for each cavity of the body.
        body, ties: the body.
        law: the law of soft walls; None for rigid walls.
    """

    def __init__(
        self, compiled: CompiledScene, carried: Sequence[CompiledScene], body: Body, ties: Ties, law: Any
    ) -> None:
        self._compiled, self._carried, self._body, self._ties, self._law = compiled, carried, body, ties, law
        self._gravity = np.array(compiled.scene.gravity or (0.0, 0.0, 0.0))

    def kinetic(self, v: Floats) -> Floats:
        """The kinetic energy of all points."""
        return np.asarray(0.5 * (np.einsum("pq,xqn->xpn", self._ties.mass, v) * v).sum(axis=(0, 1)))

    def fall(self, r: Floats) -> Floats:
        """The energy in the field of gravity."""
        return np.asarray(-np.einsum("x,xn->n", self._gravity, np.einsum("p,xpn->xn", self._ties.mass.sum(axis=1), r)))

    def stored(self, r: Floats) -> Floats:
        """The energy stored in springs, in the strain, and in soft walls."""
        return np.asarray(self._elastic(r) + self._in_walls(r))

    def _elastic(self, r: Floats) -> Floats:
        total = np.zeros(r.shape[2])
        for i, j, k, length in self._body.springs:
            total += 0.5 * k * (np.sqrt(((r[:, i] - r[:, j]) ** 2).sum(axis=0)) - length) ** 2
        if self._body.strain is not None:
            edges = self._body.strain.edges
            strain = squares_between(r, edges) - self._ties.rest[-len(edges) :, None]
            total += 0.5 * (strain * np.einsum("ij,jn->in", self._body.strain.stiffness, strain)).sum(axis=0)
        return total

    def _in_walls(self, r: Floats) -> Floats:
        total = np.zeros(r.shape[2])
        if self._law is not None:
            places = [(self._compiled, self.contact_points(r))]
            for compiled, (_surface, carrier, point) in zip(self._carried, self._body.cavities, strict=True):
                places.append((compiled, (r[:, point] - r[:, carrier])[:, None, :]))
            for compiled, points in places:
                walls, flat = compiled.walls(), points.reshape(3, -1)
                for k in np.flatnonzero((compiled.scene.gaps(flat) > 0.0).any(axis=0)) if flat.size else ():
                    total[k % total.size] += contact_energy(self._law, walls, 1.0, column(flat, 0, k))
        return total

    def led(self, r: Floats, v: Floats) -> Floats:
        """The kinetic and potential energy of the led points alone."""
        led = led_points(self._body)
        r, v, mass = r[:, led], v[:, led], self._ties.mass[np.ix_(led, led)]
        moving = np.einsum("pq,xqn->xpn", mass, v)
        fall = np.einsum("x,xn->n", self._gravity, np.einsum("p,xpn->xn", mass.sum(axis=1), r))
        return np.asarray(0.5 * (moving * v).sum(axis=(0, 1)) - fall)

    def momenta(self, r: Floats, v: Floats) -> tuple[Floats, Floats]:
        """Return the momentum, and the angular momentum, of all copies together."""
        momentum = np.einsum("pq,xqn->pxn", self._ties.mass, v).transpose(1, 0, 2)
        return momentum.sum(axis=(1, 2)), np.cross(r, momentum, axis=0).sum(axis=(1, 2))

    def contact_points(self, r: Floats) -> Floats:
        """The contact points (3, K, n)."""
        return np.asarray(np.einsum("kp,xpn->xkn", self._body.contacts, r))


def summed(
    sums: Floats, owners: list[int], surfaces: int, booked: tuple[int, int, bool], counters: int = 0
) -> dict[str, Any]:
    """Return the observables that are sums over bodies, from the sums of all chunks (quantities, chunks).

    `owners` has the surface of each wall. Rows of impulse are of the walls, then of the `own` surfaces of the body, the
    last `cavities` of which are cavities. Then come the work of the walls, if some move, their heat, if they give any,
    and the crossings of the `counters`. `booked` is (own, cavities, whether walls give heat).
    """
    own, cavities, heats = booked
    kinetic, fall, elastic, total, lost, sliding, work, *vectors = (totals := sums.sum(axis=1))[:13].tolist()
    last = len(totals) - COUNTED * counters
    pushed, given = np.split(totals[13:last], [len(owners) + own])
    worked, heat = given[: len(given) - heats * len(owners)], given[len(given) - heats * len(owners) :]
    return {
        "kinetic_energy": kinetic,
        "potential_energy": fall,
        "contact_energy": elastic,
        "total_energy": total,
        "dissipated_energy": lost,
        "momentum": np.array(vectors[:3]),
        "angular_momentum": np.array(vectors[3:]),
        "impulse": np.bincount(owners, weights=pushed[: len(owners)], minlength=surfaces),
        "sliding_time": sliding,
        "wall_heat": np.bincount(owners, weights=heat, minlength=surfaces) if heats else np.zeros(surfaces),
        "work": work,
        **({"wall_work": np.bincount(owners, weights=worked, minlength=surfaces)} if len(worked) else {}),
        **({"cavity_impulse": pushed[len(pushed) - cavities :]} if cavities else {}),
        **of_counters(totals[last:], counters),
    }
