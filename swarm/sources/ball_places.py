"""The places at which balls of a source may be born, in blocks that are drawn when needed."""

import logging
from dataclasses import replace

import numpy as np

from ..errors import SceneError
from ..particles import Particles
from ..scene import Scene
from ..state import Floats
from .births import PLACES, VELOCITIES, require_in_plane, stream, velocities_at
from .places import PointBatches, changes, place_of
from .source import Source

_LOG = logging.getLogger("swarm")
# The places of a block, and the most rounds of as many places that are tried for it.
_BLOCK, _MOST_ROUNDS = 1024, 256
# A ball that is born at a wall is at this fraction of its radius from it.
_CLEAR = 1e-9
# The advice, and the failed search, by the argument that can be changed: for balls, and for bodies, which have a size.
_MEND = {"radius": "use smaller balls, or a larger source", "where": "move it, or make it larger"}
_LACKING = {
    "radius": "got {:g} m, for which none of {} random places is large enough; ",
    "where": "got none that is large enough for the ball of {:g} m around a body, of {} random places; ",
}


class BallPlaces:
    """Places, each with a velocity, uniform where the largest ball of a source is within all walls at rest.

    Args:
        scene: the vessel.
        source: a source of balls.
        k: the number of the source.
        seed: the seed of the run.
        sized: the argument of the source that a message asks to change.

    Attributes:
        found: the number of different places in the last block; where there is hardly room for the ball they repeat.

    Raises:
        SceneError: there is no such place, or a beam does not lead into the vessel.
    """

    def __init__(self, scene: Scene, source: Source, k: int, seed: int, sized: str = "radius") -> None:
        self._scene, self._source, self._name = scene, source, (name := f"sources[{k}]")
        self._key, self._sized = (seed, k), sized
        require_in_plane(scene, source, name)
        self._place = place_of(scene, source, name)
        self._points = PointBatches(scene, self._place, name)
        self.radius, self._across = source.largest(), scene.across()
        # The ball is inside of walls of the scene as a whole, not half of it.
        is_wall = self._place.number is not None or bool(self._place.walls)
        self._shift = (1.0 + _CLEAR) * self.radius if is_wall and not self._place.volume else 0.0
        self._lasting = [i for i, one in enumerate(scene.surfaces) if not changes(one)]
        self._known = -1
        self.block(0)

    def block(self, number: int) -> tuple[Floats, Floats]:
        """Return the places and the velocities (3, 1024) of a block; a temperature is for a mass of 1 kg."""
        if number != self._known:
            self._known, self._drawn = number, self._draw(number)
        return self._drawn

    def at(self, k: int) -> tuple[Floats, Floats]:
        """Return place k and its velocity, (3,) each."""
        position, velocity = self.block(k // _BLOCK)
        return position[:, k % _BLOCK], velocity[:, k % _BLOCK]

    def _draw(self, number: int) -> tuple[Floats, Floats]:
        places, speeds = (stream(*self._key, what, number) for what in (PLACES, VELOCITIES))
        found: list[Floats] = []
        count = 0
        for _round in range(_MOST_ROUNDS):
            points, normals = self._points.draw(places, _BLOCK)
            points = points - self._shift * normals
            if self._scene.period is not None:
                points, _image = self._scene.wrapped(points)
            there = np.concatenate([points, normals])[:, self._fits(points)]
            found.append(there[:, : _BLOCK - count])
            count += found[-1].shape[1]
            if count == _BLOCK:
                break
        if not count:
            raise SceneError(
                f"{self._name}.{self._sized} must leave a place within the walls, "
                + _LACKING[self._sized].format(self.radius, _MOST_ROUNDS * _BLOCK)
                + _MEND[self._sized]
            )
        self.found = count
        points, normals = np.resize(np.concatenate(found, axis=1).T, (_BLOCK, 6)).T.reshape(2, 3, _BLOCK)
        source = replace(self._source, mass=1.0, density=None)
        return points, velocities_at(self._place, source, self._name, speeds, (points, normals), self._across)

    def _fits(self, points: Floats) -> Floats:
        """Return whether the largest ball at each point is within all walls at rest."""
        if not self._lasting:
            return np.ones(points.shape[1], np.bool_)
        radius = np.full(points.shape[1], self.radius)
        return np.asarray((self._scene.distances_outside(points, 0.0, radius)[self._lasting] <= 0.0).all(axis=0))


def ball_places(scene: Scene, particles: Particles, seed: int, sized: str = "radius") -> list[BallPlaces]:
    """Return the places of each source of balls of a run, with this seed."""
    given = () if particles.births is None else particles.births.balls
    return [BallPlaces(scene, one, k, seed, sized) for k, one in enumerate(given)]


def place_unborn(scene: Scene, particles: Particles, seed: int, sized: str = "radius") -> None:
    """Give balls that are not yet born a place and a velocity of their source until their birth.

    Raises:
        SceneError: a source has no place for its balls; `sized` is its argument that can be changed.
    """
    for k, places in enumerate(ball_places(scene, particles, seed, sized)):
        assert particles.births is not None
        own = np.flatnonzero(particles.births.source == k)
        if places.found < min(_BLOCK, len(own)):
            _LOG.warning(
                "sources[%d]: only %d of %d random places have room within the walls for a ball of %g m, and births "
                "use these again: they are not uniform; %s", k, places.found, _MOST_ROUNDS * _BLOCK, places.radius,
                _MEND[sized],
            )  # fmt: skip
        position, velocity = places.block(0)
        some = np.arange(len(own)) % position.shape[1]
        particles.position[:, own], particles.velocity[:, own] = position[:, some], velocity[:, some]
