"""The depths of soft contacts at the speeds known before a run, and the warning if they are too deep."""

import logging
import math

import numpy as np

from ...contact.damping import damping_of
from ...methods.base import Method
from ...motion import speed_at_start
from ...pairs import MOST_PRESSED, Pairs
from ...particles import Particles
from ...scene import Scene
from ...state import Floats, State
from ...surfaces.in_motion.drive import drive_of
from ...surfaces.instant import side_of
from ...surfaces.surface import Surface, named, shown
from ..options import Task

_LOG = logging.getLogger("swarm")
# The density of osmium, the densest metal [kg/m^3].
_DENSEST = 22_590.0


def warn_of_depths(task: Task) -> None:
    """Warn if a particle sinks too deep into a wall, or into another particle."""
    method, particles = task.method, task.particles
    if task.bodies is not None or method.law() is None or method.is_rigid() or method.has_multipliers():
        return
    with np.errstate(all="ignore"):
        if particles.radius is None:
            _warn_of_solids(task)
        elif len(particles):
            _warn_of_walls(task.scene, particles, particles.radius, method)
            _warn_of_pairs(task.scene, particles, particles.radius, method)


# --- Depths ----------------------------------------------------------------------------------------------


def depths_of(method: Method, mass: Floats, speed: Floats | float, restitution: float = 1.0) -> Floats:
    """Return the largest overlaps [m] of contacts of single moving masses [kg] that begin at these speeds [m/s].

    Without losses the depth d follows from the energy, alpha d^(a + 1)/(a + 1) = m v^2/2. Phi(d) is then the amplitude
    of an oscillator (`damping_of`). With the part z of critical damping it is smaller by the factor
        exp(-z acos(z)/sqrt(1 - z^2)).
    """
    a, alpha = float(method.exponent), float(method.penalty)  # type: ignore[attr-defined]
    damping = damping_of(1.0, restitution)
    z = 0.0 if damping is None else 0.5 * damping
    slowed = math.exp(-_turned(z)) ** (2.0 / (a + 1.0))
    return np.asarray(slowed * (0.5 * mass * speed * speed * (a + 1.0) / alpha) ** (1.0 / (a + 1.0)))


def _turned(z: float) -> float:
    """z acos(z)/sqrt(1 - z^2), continued by hyperbolic functions beyond 1."""
    if abs(z - 1.0) < 1e-9:
        return 1.0
    root = math.sqrt(abs(1.0 - z * z))
    return z * (math.acos(z) if z < 1.0 else math.acosh(z)) / root


def _penalty(method: Method, depth: float, allowed: float) -> float:
    """Return the penalty with which a contact has the allowed depth [m], rounded up to two digits."""
    a, alpha = float(method.exponent), float(method.penalty)  # type: ignore[attr-defined]
    enough = float(alpha * math.pow(depth / allowed, a + 1.0))
    # The penalty is rounded up, so that the one in the sentence is enough.
    unit = 10.0 ** (math.floor(math.log10(enough)) - 1)
    return math.ceil(enough / unit) * unit


# --- Speeds ----------------------------------------------------------------------------------------------


def _falls(scene: Scene, position: Floats) -> Floats:
    """Return the squares of the speeds that gravity may give to particles at these places [m^2/s^2]."""
    added = np.zeros(position.shape[1])
    low, high = scene.bounds()
    for axis, pull in enumerate(scene.gravity or ()):
        ways = np.abs((high if pull > 0.0 else low)[axis] - position[axis])
        added += 2.0 * abs(pull) * np.where(np.isfinite(ways), ways, scene.finite_size() if pull else 0.0)
    return added


def pace_of(surface: Surface) -> float:
    """Return a bound of the speed of a surface with a motion [m/s]."""
    if surface.motion is None:
        return 0.0
    if surface.reacts():
        return math.hypot(*speed_at_start(surface.motion))
    drive = drive_of(surface, 0.0)
    turns = 0.0 if drive.turn is None else math.hypot(*drive.spin) * (surface.extent() + math.hypot(*drive.center))
    return drive.fastest + turns


def _speeds(scene: Scene, particles: Particles) -> Floats:
    """Return the speeds of particles at walls known before the run [m/s]: of the start, of a fall, of the walls."""
    own = np.sqrt((particles.velocity**2).sum(axis=0) + _falls(scene, particles.position))
    return np.asarray(own + max((pace_of(surface) for surface in scene.surfaces), default=0.0))


def depths_at_start(scene: Scene, particles: Particles, method: Method) -> Floats | None:
    """Return the largest gaps of soft walls at which particles may start, (N,); None for rigid walls.

    A particle at the end of a run may be in a contact. The limit is the depth of a contact at twice the fastest speed.
    """
    if method.law() is None or method.is_rigid() or method.has_multipliers() or not len(particles):
        return None
    with np.errstate(all="ignore"):
        fastest = 2.0 * float(_speeds(scene, particles).max())
        return depths_of(method, particles.mass, np.full(len(particles), fastest))


# --- Warnings --------------------------------------------------------------------------------------------


def _warn_of_walls(scene: Scene, particles: Particles, radius: Floats, method: Method) -> None:
    """Warn of the ball that sinks deepest into a wall, as a part of its radius."""
    if not scene.surfaces:
        return
    speeds = _speeds(scene, particles)
    depths = depths_of(method, particles.mass, speeds, max(surface.restitution for surface in scene.surfaces))
    k = int(np.nanargmax(depths / radius))
    subject = f"particle {k}, which may reach {speeds[k]:.3g} m/s,"
    _warn(method, subject, "a wall", float(depths[k]), float(radius[k]), _too_dense(scene, particles, radius, k))


def _warn_of_pairs(scene: Scene, particles: Particles, radius: Floats, method: Method) -> None:
    """Warn of the ball that sinks deepest into the fastest ball, as a part of the smaller radius."""
    fastest = int(np.nanargmax((particles.velocity**2).sum(axis=0)))
    speeds = np.sqrt(((particles.velocity - particles.velocity[:, [fastest]]) ** 2).sum(axis=0))
    mass = particles.mass * particles.mass[fastest] / (particles.mass + particles.mass[fastest])
    depths = depths_of(method, mass, speeds, (scene.pairs or Pairs()).restitution)
    least = np.minimum(radius, radius[fastest])
    k = int(np.nanargmax(depths / least))
    subject = f"particle {k}, at {speeds[k]:.3g} m/s against particle {fastest},"
    _warn(method, subject, "it", float(depths[k]), float(least[k]), _too_dense(scene, particles, radius, k))


def _too_dense(scene: Scene, particles: Particles, radius: Floats, k: int) -> str:
    """Return the text to add if the mass of a ball is likely to be the default; else ""."""
    density = float(particles.mass[k]) / (4.0 / 3.0 * math.pi * float(radius[k]) ** 3)
    if scene.across() is not None or density <= _DENSEST:
        return ""
    return (
        f"; the mass of particle {k}, {particles.mass[k]:g} kg, is {density:.2g} kg/m^3, above that of every metal: "
        "give the particles a mass"
    )


def _warn(method: Method, subject: str, what: str, depth: float, radius: float, dense: str) -> None:
    if depth > MOST_PRESSED * radius:
        _LOG.warning(
            "contacts are soft for the speed: %s may sink %.2g m into %s, %.2g of its radius; %g is small, and at "
            "1 the run ends; use a penalty of %.1e or more (%g here) with a dt that fits it, or Impact%s",
            subject, depth, what, depth / radius, MOST_PRESSED, _penalty(method, depth, MOST_PRESSED * radius),
            method.penalty, dense,  # type: ignore[attr-defined]
        )  # fmt: skip


def _warn_of_solids(task: Task) -> None:
    """Warn of a point that sinks deep into a solid, beyond the middle of which it leaves on the other side."""
    scene, particles, method = task.scene, task.particles, task.method
    solids = [(i, one) for i, one in enumerate(scene.surfaces) if one.is_solid() and math.isfinite(one.size())]
    if not solids or not len(particles):
        return
    i, thinnest = min(solids, key=lambda one: one[1].size())
    speeds = _speeds(scene, particles)
    k = int(np.nanargmax(particles.mass * speeds * speeds))
    # The slope of phi, which is a length if its slope is 1.
    slope = float(np.median(np.sqrt((thinnest.gradient(particles.position[:, k : k + 1]) ** 2).sum(axis=0))))
    depth = float(depths_of(method, particles.mass[k], speeds[k])) / slope if slope > 0.0 else 0.0
    thickness = 2.0 * thinnest.size()
    if depth > MOST_PRESSED * thickness:
        _LOG.warning(
            "contacts are soft for the speed: particle %d, which may reach %.3g m/s, may sink %.2g m into a wall, and "
            "surfaces[%d] (%s) is %.2g m thick: beyond its middle a particle leaves on the other side; use a penalty "
            "of %.1e or more (%g here) with a dt that fits it, or Impact",
            k, speeds[k], depth, i, type(thinnest).__name__, thickness,
            _penalty(method, depth, MOST_PRESSED * thickness), method.penalty,  # type: ignore[attr-defined]
        )  # fmt: skip


# --- The end of a run -------------------------------------------------------------------------------------


def of_passing(scene: Scene, method: Method, state: State, particle: int, moment: float) -> str:
    """Return the text on a point that goes through the middle of a wall; the state is that at the start of its step."""
    place, velocity, step = state.position[:, particle], state.velocity[:, particle], float(method.dt)  # type: ignore[attr-defined]
    ways = place[:, None] + velocity[:, None] * np.linspace(0.0, step, 9)
    passable = np.array([surface.may_be_passed() for surface in scene.surfaces])
    outside = np.where(passable[:, None], scene.distances_outside(ways, moment), -np.inf)
    wall = int(np.argmax(outside.max(axis=1)))
    surface = scene.surfaces[wall]
    speed = math.hypot(*velocity) + pace_of(surface)
    energy = 0.5 * float(state.mass[particle]) * speed**2 + _stored(method, surface, place[:, None], moment)
    # The energy that the wall would store at a depth that is small.
    entry, inward = _entry(surface, place, velocity, moment)
    half = surface.size() if surface.is_solid() else float(inward @ (ways[:, 4] - entry))
    allowed = _stored(method, surface, (entry + 2.0 * MOST_PRESSED * half * inward)[:, None], moment)
    penalty = float(method.penalty)  # type: ignore[attr-defined]
    enough = f"a penalty of {penalty * energy / allowed:.1e} or more" if allowed > 0.0 else "a larger penalty"
    thick = f", which is {2.0 * half:.3g} m thick," if surface.is_solid() else ""
    return (
        f", at {shown(place, 6)} m: with {speed:.3g} m/s it goes through the middle of "
        f"{named(wall, surface)}{thick} to its other side: contacts are too soft for the speed; "
        f"use {enough}, got {penalty:g}, with a dt that fits it, a smaller speed, or Impact"
    )


def _stored(method: Method, surface: Surface, place: Floats, moment: float) -> float:
    """Return the energy that a wall stores by a point at this place (3, 1) [J]."""
    gap = side_of(surface) * float(surface.phi(place, moment)[0])
    return float(method.law().stored_energy(gap)) if gap > 0.0 else 0.0


def _entry(surface: Surface, place: Floats, velocity: Floats, moment: float) -> tuple[Floats, Floats]:
    """Estimate where a straight way to a place came through the wall; return this place and the inward unit normal."""
    side, way = side_of(surface), velocity / math.hypot(*velocity)
    # Lengths go from near to far, as the way may have begun in the wall.
    lengths = np.concatenate([[-1.0, 0.0], np.geomspace(1e-4, 10.0, 2000)]) * surface.size()
    back = place[:, None] - lengths * way[:, None]
    outside = side * surface.phi(back, moment) <= 0.0
    entered = np.flatnonzero(~outside[:-1] & outside[1:])
    at = back[:, [int(entered[0]) if len(entered) else 0]]
    normal = side * surface.gradient(at, moment)[:, 0]
    return at[:, 0], normal / np.linalg.norm(normal)
