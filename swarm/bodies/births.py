"""Births of bodies during a run: a body has room at its birth if the ball around it, about its centre, has room.

Each body is turned at random, uniform among all orientations, by its number alone: the same bits for any threads.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import SceneError
from ..particles import Particles
from ..run.feeding import Feed, There
from ..scene import Scene
from ..sources.ball_places import place_unborn
from ..sources.births import stream, with_births
from ..sources.source import Source
from ..state import Floats
from ..surfaces.plane import along
from ..surfaces.rotation import matrices
from .body import Body
from .copies import Bodies

# The stream of the orientations of a source.
_TURNS = 5
# No bodies are in the way, as bodies do not meet one another.
_NONE = There(np.zeros((3, 0)), np.zeros((3, 0)), np.zeros(0))


def reach_of(body: Body) -> float:
    """The largest distance of a point of a body from its centre of mass [m]."""
    return float(np.sqrt((_arms(body) ** 2).sum(axis=0)).max())


def _arms(body: Body) -> Floats:
    """The vectors (3, P) from the centre of mass to each point."""
    points = body.points.T[:, :, None]
    return np.asarray((points - body.center_of(points)[:, None])[:, :, 0])


def with_born(scene: Scene, bodies: Bodies, sources: tuple[Source, ...], seed: int, until: float) -> Bodies:
    """Return the bodies of a run with sources: the bodies of the start, then the bodies to be born.

    Raises:
        SceneError: a source does not fit the bodies or the scene.
    """
    if not sources:
        return bodies
    body = bodies.body
    if body.anchors or body.guides:
        raise SceneError(
            f"sources must be left out with a body that has anchors or guides, got {len(sources)}: its place is given; "
            "give all copies at the start"
        )
    mass = float(body.mass_matrix.sum())
    for k, one in enumerate(sources):
        for name, it_has in (("radius", "a size"), ("density", "a mass")):
            if (got := getattr(one, name)) is not None:
                raise SceneError(f"sources[{k}].{name} must be left out with bodies, got {got}: the body has {it_has}")
        if one.mass not in (None, mass):
            raise SceneError(f"sources[{k}].mass must be that of the body, {mass:g} kg, or left out, got {one.mass:g}")
    around = tuple(replace(one, radius=reach_of(body), mass=mass) for one in sources)
    centers = _centers(bodies)
    made = with_births(scene, centers, around, seed, until)
    assert made.births is not None
    place_unborn(scene, made, seed, "where")
    number = np.arange(len(bodies), len(made))
    spin = np.zeros_like(made.position) if made.spin is None else made.spin
    place, velocity, turning = (rows[:, None, number] for rows in (made.position, made.velocity, spin))
    of, across = made.births.source, scene.across()
    turns = np.array([_turn(seed, int(of[i]), int(i), across) for i in number]).reshape(-1, 4)
    arms = np.einsum("nxy,yp->xpn", matrices(turns), _arms(body))
    position = np.concatenate([bodies.position, place + arms], axis=2)
    velocity = np.concatenate([bodies.velocity, velocity + np.cross(turning, arms, axis=0)], axis=2)
    all_of_them = Bodies.unchecked(body, position, velocity)
    all_of_them.births, all_of_them.image = made.births, made.image
    return all_of_them


def _centers(bodies: Bodies) -> Particles:
    """Return the balls around bodies."""
    body = bodies.body
    return Particles(
        bodies.centers(), body.center_of(bodies.velocity), body.mass_matrix.sum(), bodies.image, reach_of(body)
    )  # fmt: skip


def _turn(seed: int, k: int, number: int, across: int | None) -> Floats:
    """Return the uniform random quaternion (4,) of the birth with a number; in a plane, about its normal."""
    q = stream(seed, k, _TURNS, number).standard_normal(4)
    if across is not None:
        q[[1 + axis for axis in along(across)]] = 0.0
    # BLAS is not used, as its last bit depends on the processor.
    return np.asarray(q / np.sqrt((q**2).sum()))


class BodyFeed(Feed):
    """The births of the bodies of a run.

    Args:
        scene: the vessel.
        bodies: all copies, with their births.
        seed: the seed of the run.
        energy: the function that returns the energies (n,) [J] of positions and velocities (3, P, n).
    """

    def __init__(self, scene: Scene, bodies: Bodies, seed: int, energy: Any) -> None:
        balls = _centers(bodies)
        balls.births = bodies.births
        super().__init__(scene, balls, seed)
        # The places and velocities of the points of each copy relative to its centre.
        self._arms = bodies.position - balls.position[:, None]
        self._slips = bodies.velocity - balls.velocity[:, None]
        self._energy_of = energy

    def until(self, moment: float) -> list[tuple[float, NDArray[np.int64], Floats, Floats]]:
        """Return the births up to a moment [s]: the time, numbers of copies, positions and velocities (3, P, n)."""
        made = []
        while (due := self.next()) <= moment:
            born = self.come(due, _NONE)
            position = born.position[:, None] + self._arms[:, :, born.number]
            velocity = born.velocity[:, None] + self._slips[:, :, born.number]
            self._energy[born.number] = self._energy_of(position, velocity)
            made.append((due, born.number, position, velocity))
        return made

    def _beside(self, there: There, _made: list[tuple[int, Floats, Floats]]) -> There:
        return there
