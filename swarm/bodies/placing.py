"""Random bodies, uniform over all admissible places and orientations."""

import numpy as np

from ..common import checks
from ..errors import SceneError
from ..placing.filling import bounding_box
from ..scene import Scene
from ..state import Floats
from ..surfaces.area_samples import directions
from ..surfaces.rotation import matrices
from .body import Body
from .copies import Bodies

# The number of points that are tested together.
_BATCH = 1 << 19
# The number of points after which the search ends if fewer than one body in a million was admissible.
_TRIES = 20_000_000
# The points of each side and link that must be out of solids, as a solid may be between corners.
_SAMPLES = 8
_INSTEAD = "swarm.Bodies(body, position, velocity)"


def place(scene: Scene, body: Body, n: int, *, speed: float = 0.0, spin: float = 0.0, seed: int = 0) -> Bodies:
    """Return n copies of a body at random, uniform over the places and orientations at which it is within the walls.

    Copies may overlap, as bodies do not meet one another. A body is within the walls if all its contact points are. In
    a scene with solids, points on its links and on the sides of its faces must be within the walls too.

    Args:
        scene: its volume must be bounded.
        body: a body without anchors, guides and cavities.
        n: number of copies, 1 or more.
        speed: |v| of every centre of mass [m/s], from 0 to 1e100, in a direction uniform on the sphere.
        spin: |omega| of every copy [rad/s], from 0 to 1e100, about its centre of mass and an axis uniform on the
            sphere.
        seed: the same seed gives the same bodies.

    Raises:
        SceneError: an argument is out of its range, the volume is open, or the body does not fit in it.

    >>> import swarm
    >>> cavity = swarm.Scene(surfaces=[swarm.Sphere(radius=0.5)])
    >>> place(cavity, swarm.tetrahedron(edge=0.1, mass=1.0), 10, speed=0.5, spin=3.0, seed=1)
    Bodies(10 of 4 points)
    """
    checks.of_class("scene", scene, Scene)
    checks.of_class("body", body, Body)
    for name in ("anchors", "guides", "cavities"):
        if getattr(body, name):
            raise SceneError(
                f"place needs a body that can be anywhere, got one with {name}; give its place: {_INSTEAD}"
            )
    n = checks.count("n", n)
    checks.particles_fit("n", n * len(body))
    speed, spin = checks.magnitude("speed", speed), checks.magnitude("spin", spin)
    random = np.random.default_rng(checks.seed("seed", seed))
    # Places are those of the middle of the probes, which is in any box around the scene.
    probes = _probes(scene, body)
    turns, middles = _places(scene, probes, n, random)
    middle = probes.mean(axis=0)
    position = _turned(turns, body.points - middle) + middles[:, None]
    velocity = np.zeros_like(position) + speed * directions(random, n)[:, None]
    arms = _turned(turns, body.points - body.center_of(body.points.T[:, :, None])[:, 0])
    return Bodies(body, position, velocity + spin * np.cross(directions(random, n)[:, None], arms, axis=0))


def _probes(scene: Scene, body: Body) -> Floats:
    """The points (Q, 3) of the body that must be within the walls."""
    # BLAS is not used, as its last bit depends on the processor.
    corners = np.einsum("kp,px->kx", body.contacts, body.points) if len(body.contacts) else body.points
    if not any(surface.is_solid() for surface in scene.surfaces):
        return corners
    sides = corners[np.concatenate([body.faces[:, (0, 1)], body.faces[:, (1, 2)], body.faces[:, (2, 0)]])]
    lines = np.concatenate([sides, body.points[body.bonds()]])
    share = (np.arange(_SAMPLES) + 0.5)[:, None, None] / _SAMPLES
    between = lines[:, 0] * (1.0 - share) + lines[:, 1] * share
    return np.concatenate([corners, between.reshape(-1, 3)])


def _places(scene: Scene, probes: Floats, n: int, random: np.random.Generator) -> tuple[Floats, Floats]:
    """Return the rotation matrices (3, 3, n), and the middles (3, n) of the probes, of n copies within the walls."""
    low, high = bounding_box(scene, "place", f"the bodies as arrays: {_INSTEAD}")
    arms = probes - probes.mean(axis=0)
    count = len(arms)
    turns, middles, found, tried = np.empty((3, 3, n)), np.empty((3, n)), 0, 0
    while found < n:
        # The batches grow while no place is found.
        size = max(1, min(_BATCH // count, max(2 * (n - found) + 64, 0 if found else tried)))
        trial, turn = low + (high - low) * random.random((3, size)), _rotations(random, size)
        inside = np.ones(size, bool)
        for arm in arms:
            # Each point is tested only for copies with all points before it within.
            left = np.flatnonzero(inside)
            places = trial[:, left] + _turned(turn[:, :, left], arm[None])[:, 0]
            inside[left] = scene.admits(places)
        chosen = np.flatnonzero(inside)[: n - found]
        middles[:, found : found + len(chosen)] = trial[:, chosen]
        turns[:, :, found : found + len(chosen)] = turn[:, :, chosen]
        found, tried = found + len(chosen), tried + size
        if tried * count >= _TRIES and found < 1e-6 * tried:
            extent = 2.0 * np.sqrt((arms**2).sum(axis=1).max())
            raise SceneError(
                f"place found {found} places in {tried} tries for a body that is {extent:.3g} m wide, in a scene of "
                f"{' x '.join(f'{edge:.3g}' for edge in (high - low).ravel())} m; make it smaller, or give its place: "
                f"{_INSTEAD}"
            )
    return turns, middles


def _rotations(random: np.random.Generator, n: int) -> Floats:
    """Return rotation matrices (3, 3, n), uniform on SO(3), from quaternions uniform on the sphere."""
    normal = random.standard_normal((4, n))
    return np.moveaxis(matrices((normal / np.sqrt((normal**2).sum(axis=0))).T), 0, 2)


def _turned(turns: Floats, arms: Floats) -> Floats:
    """Return the points (P, 3) in n orientations, (3, P, n)."""
    x, y, z = arms.T[:, :, None]
    # BLAS is not used, as its last bit depends on the processor.
    return np.asarray(turns[:, 0, None] * x + turns[:, 1, None] * y + turns[:, 2, None] * z)
