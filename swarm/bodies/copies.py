"""Many copies of one body, each with its own place and velocity."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..common import checks
from ..errors import SceneError
from ..kernel.limits import TINY
from ..motion import led
from ..particles import Births, Particles, TiedParticles
from ..scene import Scene
from ..state import Floats
from . import checked, holding
from .algebra import solved
from .body import Body
from .checked import Pairs
from .tied import Tie, ties

# The largest relative error of the length of a link at the start.
_LINK = 1e-9

# The largest velocity that contradicts a tie, relative to the fastest point of the copy. A stage conserves lengths, so
# that such a velocity is reversed at each step and never vanishes. The limit is that of lengths, which determine the
# directions of ties. The part that is reversed at each step is then 1e-18 of the kinetic energy.
_AGREED = 1e-9
# The corrections of a projection; each one removes the error but for round-off of the equations.
_CORRECTIONS = 3
# The most numbers in the systems of ties that are solved together.
_BATCH = 1 << 20


class Bodies(TiedParticles):
    """n copies of a body.

    Args:
        body: the template. An anchored point of a copy is fixed at its place in the copy, or led from there.
        position: (3, P, n), or (3, P) for one copy [m], rows x, y, z of every point; links have their lengths.
        velocity: in the shape of `position` [m/s]. The points of a link have the same velocity along it; a guided point
            has none across its guide; an anchored point has that of its path at the start, or 0, which stands for it.
        project: whether to take the nearest velocities that agree with links, guides and paths, in the metric of the
            kinetic energy; False: velocities that do not agree are an error.

    The arrays are copied, in C order. The velocities of a result or a trajectory agree to the order of the steps.

    Raises:
        SceneError: wrong shapes, no copy, a value that is not finite or beyond 1e100, a link with a wrong length, a
            guided point that is not on its surface, velocities that contradict a link, a guide or a path.

    >>> import swarm
    >>> rod = swarm.dumbbell(length=2.0, mass=1.0)
    >>> Bodies(rod, rod.points.T, np.zeros((3, 2)))
    Bodies(1 of 2 points)
    >>> Bodies(rod, rod.points.T, [[1.0, 0.0], [0.0, 2.0], [0.0, 0.0]], project=True).velocity[:, :, 0]
    array([[0.5, 0.5],
           [0. , 2. ],
           [0. , 0. ]])
    """

    body: Body
    position: Floats
    velocity: Floats
    # The births of all copies, in a run with sources.
    births: Births | None = None
    # (3, n) the cell of each copy, in a run of a periodic scene.
    image: NDArray[np.int64] | None = None
    # Whether the copies are the result of a run: velocities then agree with ties only to the order of the step.
    _is_of_run = False

    def __init__(self, body: Body, position: ArrayLike, velocity: ArrayLike, *, project: bool = False) -> None:
        self._take(body, position, velocity)
        self.velocity = led_along(body, self.position, self.velocity)
        if checks.flag("project", project):
            self.velocity = projected(body, self.position, self.velocity)
        require_agreed(body, self.position, self.velocity, project)

    def _take(self, body: Body, position: ArrayLike, velocity: ArrayLike) -> None:
        checks.of_class("body", body, Body)
        self.body = body
        self.position = _rows("position", position, len(body))
        self.velocity = _rows("velocity", velocity, len(body))
        if self.velocity.shape != self.position.shape:
            raise SceneError(
                f"velocity must have the shape of position, {self.position.shape}, got {self.velocity.shape}"
            )
        _require_lengths(body, self.position)
        for k, (point, surface) in enumerate(body.guides):
            holding.on_surface(f"guides[{k}]: point {point}", surface, self.position[:, point])

    def copy(self) -> "Bodies":
        """Return the same bodies as a start, checked again, in copied arrays."""
        if not self._is_of_run:
            return Bodies(self.body, self.position, self.velocity)
        made = Bodies.of_run(self.body, self.position, self.velocity)
        made.velocity = led_along(made.body, made.position, made.velocity)
        return made

    def __repr__(self) -> str:
        return f"Bodies({len(self)} of {len(self.body)} points)"

    def contact_points(self) -> Floats:
        """The points (3, K, n) that can touch walls."""
        return np.asarray(np.einsum("kp,xpn->xkn", self.body.contacts, self.position))

    def centers(self) -> Floats:
        """The centres of mass (3, n)."""
        return self.body.center_of(self.position)

    def in_cell(self, scene: Scene) -> "Bodies":
        """Return the same bodies, in a periodic scene with their centres of mass in the cell."""
        if scene.period is None:
            return self
        center = self.centers()
        inside, away = scene.wrapped(center)
        made = Bodies.unchecked(self.body, self.position + (inside - center)[:, None], self.velocity)
        made.births, made.image = self.births, away
        return made

    def bonds(self) -> Pairs:
        """The tied pairs of points (B n, 2) of all copies, as numbers of `particles`."""
        n = len(self)
        return np.asarray((self.body.bonds()[:, None] * n + np.arange(n)[:, None]).reshape(-1, 2))

    def moved(self, particles: Particles) -> "Bodies":
        """Return these bodies at the present places of their points, which are `particles`."""
        shape = self.position.shape
        return Bodies.unchecked(self.body, particles.position.reshape(shape), particles.velocity.reshape(shape))

    @staticmethod
    def unchecked(body: Body, position: Floats, velocity: Floats) -> "Bodies":
        """Return the bodies of a run without checks: Uzawa's loop may leave larger errors than a start may have."""
        made = object.__new__(Bodies)
        made.body, made.position, made.velocity, made._is_of_run = body, position, velocity, True
        return made

    @staticmethod
    def of_run(body: Body, position: ArrayLike, velocity: ArrayLike) -> "Bodies":
        """Return the bodies of a run, checked as a start but for their velocities."""
        made = object.__new__(Bodies)
        made._take(body, position, velocity)
        made._is_of_run = True
        return made

    def particles(self) -> Particles:
        """Return all points as particles: point p of copy i has the number p n + i.

        Their masses are the diagonal of the mass matrix, scaled to the mass of the body: always above 0.
        """
        matrix = self.body.mass_matrix
        mass = np.diagonal(matrix) * (matrix.sum() / np.trace(matrix))
        flat = self.position.reshape(3, -1), self.velocity.reshape(3, -1)
        image = None if self.image is None else np.tile(self.image, len(self.body))
        made = Particles(*flat, np.repeat(mass, len(self)), image)
        if (births := self.births) is not None:
            points = len(self.body)
            made.births = births._replace(time=np.tile(births.time, points), source=np.tile(births.source, points))
        return made


def _rows(name: str, value: ArrayLike, count: int) -> Floats:
    rows = checks.array(name, value)
    if rows.ndim == 2:
        rows = rows[:, :, None]
    if rows.ndim != 3 or rows.shape[:2] != (3, count) or not rows.shape[2]:
        raise SceneError(
            f"{name} must have shape (3, {count}, n), rows x, y, z of the {count} points of n copies, at least one, "
            f"got {np.shape(value)}"
        )
    checks.particles_fit(name, count * rows.shape[2])
    return checked.finite(name, np.array(rows, order="C"))


def _require_lengths(body: Body, position: Floats) -> None:
    """Raise a `SceneError` unless every link of every copy is as long as in the template."""
    for k, (i, j) in enumerate(body.links.tolist()):
        wanted = np.sqrt(((body.points[i] - body.points[j]) ** 2).sum())
        lengths = np.sqrt(((position[:, i] - position[:, j]) ** 2).sum(axis=0))
        off = np.abs(lengths - wanted) > _LINK * wanted
        for copy in np.flatnonzero(off)[:1]:
            raise SceneError(
                f"position must keep the lengths of the links to {_LINK:g}, got {lengths[copy]:.12g} m for links[{k}], "
                f"{(i, j)}, of copy {copy} ({off.sum()} such), which is {wanted:.12g} m long"
            )


def led_along(body: Body, position: Floats, velocity: Floats) -> Floats:
    """Return `velocity` (3, P, n) with the velocity of its path at every anchored point, where it may be 0.

    Raises:
        SceneError: an anchored point has another velocity.
    """
    made = velocity.copy()
    for point, motion in body.anchors.items():
        made[:, point] = 0.0
        if motion is not None:
            for copy, start in enumerate(position[:, point].T):
                made[:, point, copy] = led(motion, start).velocity_at(0.0)
        given, path = velocity[:, point], made[:, point]
        off = np.abs(given - path).max(axis=0) > _AGREED * _fastest(velocity)
        for copy in np.flatnonzero(off & given.any(axis=0))[:1]:
            where = (
                "fixed in space"
                if motion is None
                else f"led at {path[:, copy].tolist()} m/s at the start (a phase lets a motion begin elsewhere)"
            )
            raise SceneError(
                f"velocity of anchors[{point}] must be that of its path, or 0, which stands for it, got "
                f"{given[:, copy].tolist()} m/s for point {point} of copy {copy}, which is {where}"
            )
    return made


def require_agreed(body: Body, position: Floats, velocity: Floats, projected: bool) -> None:
    """Raise a `SceneError` where a velocity contradicts a link or a guide."""
    fastest = _fastest(velocity)
    for tie in ties(body.links, body.guides, position):
        speeds = np.abs(_speed(tie, velocity))
        off = speeds > _AGREED * fastest
        for copy in np.flatnonzero(off)[:1]:
            hint = (
                "no velocities of the other points agree with the paths of the anchored ones; start them otherwise"
                if projected
                else "give velocities that agree, or project=True, for the nearest that do"
            )
            where = (
                f"along {tie.name}, {tie.points}"
                if tie.surface is None
                else f"of point {tie.points[0]} across {tie.name}, {tie.surface!r:.80}"
            )
            raise SceneError(
                f"velocity must agree with links and guides to {_AGREED:g} of the fastest point, got "
                f"{speeds[copy]:.6g} m/s {where}, in copy {copy} ({off.sum()} such); its fastest point has "
                f"{fastest[copy]:.6g} m/s; {hint}"
            )


def projected(body: Body, position: Floats, velocity: Floats) -> Floats:
    """Return the velocities that agree with ties, nearest to `velocity` (3, P, n) in the metric of the kinetic energy.

    These are v - W J^T (J W J^T)^-1 J v, with the inverse W of the masses of points that can move, and J v = 0 of ties.
    """
    made, inverse, tied = velocity.copy(), body.inverse_mass(), len(body.links) + len(body.guides)
    many = max(1, _BATCH // max(1, tied) ** 2)
    for begin in range(0, position.shape[2] if tied else 0, many):
        some = slice(begin, begin + many)
        held = list(ties(body.links, body.guides, position[:, :, some]))
        normal = np.array([tie.normal for tie in held])
        pushed = np.array([sum(sign * inverse[point] for point, sign in tie.ends()) for tie in held])
        coupling = np.array([sum(sign * pushed[:, point] for point, sign in tie.ends()) for tie in held])
        # Each tie is scaled by its own coupling, so that a light point beside a heavy one is no singularity.
        unit = 1.0 / np.sqrt(np.maximum(np.diagonal(coupling), TINY))
        coupling *= unit[:, None] * unit
        system = coupling[:, :, None] * sum(normal[:, None, axis] * normal[:, axis] for axis in range(3))
        for _correction in range(_CORRECTIONS):
            speeds = np.array([_speed(tie, made[:, :, some]) for tie in held])
            force = unit[:, None] * solved(system, unit[:, None] * speeds)
            for one, way, share in zip(force, normal, pushed, strict=True):
                made[:, :, some] -= (one * way)[:, None] * share[:, None]
    return made


def _speed(tie: Tie, velocity: Floats) -> Floats:
    """The velocity along a tie (n,) [m/s], which must be 0, from velocities (3, P, n)."""
    return np.asarray((tie.normal * sum(sign * velocity[:, point] for point, sign in tie.ends())).sum(axis=0))


def _fastest(velocity: Floats) -> Floats:
    """The speed of the fastest point of each copy (n,)."""
    return np.asarray(np.sqrt((velocity**2).sum(axis=0).max(axis=0)))
