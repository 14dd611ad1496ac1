"""Billiards in 50 digits: where rigid walls, and the springs of a soft sphere, really send a particle.

`python -m bench.reference -o bench/references/billiards.npz` makes that file, some minutes on one core: for each scene
the start of 256 particles and where they are after about 5, 20 and 64 impacts each. Rigid walls go event by event; a
sphere, rigid or with linear springs, has a closed form.
"""

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import swarm

from .report import OUT

PATH = Path(__file__).with_name("references") / "billiards.npz"
DIGITS = 50
PARTICLES, SPEED = 256, 0.5
# Impacts of the mean particle at the three times.
IMPACTS = (5, 20, 64)
# alpha of the soft sphere, for a mass of 1 kg.
PENALTY = 1e4
SOFT = "soft sphere"
_GRAVITY = (0.0, 0.0, -0.5)
SCENES = {
    "sphere": swarm.Scene([swarm.Sphere(0.5)]),
    "ellipsoid": swarm.Scene([swarm.Ellipsoid((0.3, 0.4, 0.6))]),
    "sphere with gravity": swarm.Scene([swarm.Sphere(0.5)], _GRAVITY),
    "box": swarm.Scene([swarm.Box((0.5, 0.4, 0.3))]),
    "sphere with a ball": swarm.Scene([swarm.Sphere(0.5), swarm.Sphere(0.15, (0.1, 0.0, 0.0), "outside")]),
}

Vector = list  # of three numbers of 50 digits
# A hit this soon after an impact is that impact.
_SAME = 1e-30


@dataclass(frozen=True)
class Wall:
    """When a flight from r with v first reaches it, and its normal there."""

    hit: Callable[[Vector, Vector], object]
    normal: Callable[[Vector], Vector]


def _quadric(weights: tuple[float, ...], center: tuple[float, ...], solid: bool, gravity: Vector) -> Wall:
    """Sum w (x - c)^2 = 1."""
    import mpmath

    w, c = [mpmath.mpf(1) / mpmath.mpf(a) ** 2 for a in weights], [mpmath.mpf(a) for a in center]
    half = [g / 2 for g in gravity]

    def polynomial(r: Vector, v: Vector) -> list:
        d = [a - b for a, b in zip(r, c, strict=True)]

        def dot(p: Vector, q: Vector) -> object:
            return sum(k * a * b for k, a, b in zip(w, p, q, strict=True))

        return [dot(d, d) - 1, 2 * dot(d, v), dot(v, v) + 2 * dot(d, half), 2 * dot(v, half), dot(half, half)]

    def hit(r: Vector, v: Vector) -> object:
        c0, c1, c2, c3, c4 = polynomial(r, v)
        if c4 == 0:
            square = c1 * c1 - 4 * c2 * c0
            if square < 0:
                return mpmath.inf
            root = mpmath.sqrt(square)
            t = (-c1 - root if solid else -c1 + root) / (2 * c2)
            return t if t > _SAME else mpmath.inf
        roots = mpmath.polyroots([c4, c3, c2, c1, c0], maxsteps=200, extraprec=200)
        real = [mpmath.re(t) for t in roots if abs(mpmath.im(t)) < mpmath.mpf(10) ** (-DIGITS // 2)]
        # A cavity is left where the level rises.
        rising = [t for t in real if t > _SAME and (c1 + t * (2 * c2 + t * (3 * c3 + t * 4 * c4)) > 0) != solid]
        return min(rising, default=mpmath.inf)

    def normal(r: Vector) -> Vector:
        n = [k * (a - b) for k, a, b in zip(w, r, c, strict=True)]
        size = mpmath.sqrt(sum(a * a for a in n))
        return [a / size for a in n]

    return Wall(hit, normal)


def _face(axis: int, sign: int, half_width: float) -> Wall:
    """sign x[axis] = half_width."""
    import mpmath

    unit = [mpmath.mpf(sign * (k == axis)) for k in range(3)]

    def hit(r: Vector, v: Vector) -> object:
        return (half_width - sign * r[axis]) / (sign * v[axis]) if sign * v[axis] > 0 else mpmath.inf

    return Wall(hit, lambda r: unit)


def walls_of(scene: swarm.Scene) -> list[Wall]:
    """The walls of one of the scenes here."""
    import mpmath

    gravity = [mpmath.mpf(g) for g in scene.gravity or (0.0, 0.0, 0.0)]
    found = []
    for surface in scene.surfaces:
        if isinstance(surface, swarm.Sphere):
            found.append(_quadric((surface.radius,) * 3, surface.center, surface.is_solid(), gravity))
        elif isinstance(surface, swarm.Ellipsoid):
            found.append(_quadric(surface.semi_axes, surface.center, surface.is_solid(), gravity))
        else:
            assert isinstance(surface, swarm.Box)
            found += [
                _face(axis, sign, mpmath.mpf(b)) for axis, b in enumerate(surface.half_widths) for sign in (1, -1)
            ]
    return found


def fly(scene: swarm.Scene, position: NDArray, velocity: NDArray, times: list[float]) -> tuple[NDArray, int]:
    """Positions of one particle at these times, rounded once at the end, and its impacts."""
    import mpmath

    mpmath.mp.dps = DIGITS
    walls, gravity = walls_of(scene), [mpmath.mpf(g) for g in scene.gravity or (0.0, 0.0, 0.0)]
    r, v = ([mpmath.mpf(float(a)) for a in values] for values in (position, velocity))
    now, impacts, seen = mpmath.mpf(0), 0, []

    def moved(t: object) -> tuple[Vector, Vector]:
        place = [a + t * b + t * t * g / 2 for a, b, g in zip(r, v, gravity, strict=True)]
        return place, [b + t * g for b, g in zip(v, gravity, strict=True)]

    while len(seen) < len(times):
        hits = [wall.hit(r, v) for wall in walls]
        first = min(range(len(walls)), key=lambda k: hits[k])
        while len(seen) < len(times) and times[len(seen)] <= now + hits[first]:
            seen.append([float(a) for a in moved(times[len(seen)] - now)[0]])
        r, v = moved(hits[first])
        now += hits[first]
        n = walls[first].normal(r)
        b = sum(a * c for a, c in zip(v, n, strict=True))
        v = [a - 2 * b * c for a, c in zip(v, n, strict=True)]
        impacts += 1
    return np.array(seen), impacts


def in_a_sphere(position: NDArray, velocity: NDArray, radius: float, time: float, penalty: float | None) -> NDArray:
    """Position of one particle of 1 kg in a sphere about the origin: between rigid walls (None), or linear springs.

    Chords of one length, and contacts of one length: each turns the particle by one angle from the one before. NaN
    where it touches a spring at that time.
    """
    import mpmath

    mpmath.mp.dps = DIGITS
    mp = mpmath.mp
    r, v = ([mp.mpf(float(a)) for a in one] for one in (position, velocity))
    speed2 = sum(a * a for a in v)
    b = sum(a * c for a, c in zip(r, v, strict=True))
    root = mp.sqrt(b * b - speed2 * (sum(a * a for a in r) - mp.mpf(radius) ** 2))
    first, chord = (root - b) / speed2, 2 * root / speed2
    hit = [a + first * c for a, c in zip(r, v, strict=True)]
    n = [a / radius for a in hit]
    normal = sum(a * c for a, c in zip(v, n, strict=True))
    tangent = [a - normal * c for a, c in zip(v, n, strict=True)]
    along = mp.sqrt(sum(a * a for a in tangent))
    touch, turn = (0, 0) if penalty is None else soft_contact(normal, along, mp.mpf(radius), mp.mpf(penalty))
    if time < first:
        return np.array([float(a + time * c) for a, c in zip(r, v, strict=True)])
    count = mp.floor((time - first) / (touch + chord))
    rest = time - first - count * (touch + chord) - touch
    if rest < 0:
        return np.full(3, np.nan)
    # A chord spans twice the angle between velocity and wall.
    span = 2 * mp.atan2(normal, along)

    def at(angle: object) -> list:
        return [radius * (mp.cos(angle) * a + mp.sin(angle) * c / along) for a, c in zip(n, tangent, strict=True)]

    here = count * (turn + span) + turn
    return np.array([float(a + rest / chord * (c - a)) for a, c in zip(at(here), at(here + span), strict=True)])


def soft_contact(normal: object, along: object, radius: object, penalty: object) -> tuple[object, object]:
    """How long a contact with a linear spring lasts, and by what angle about the centre it turns the particle.

    Between r = R and the farthest r it is dt = dr/|dr/dt| and dphi = L/r^2 dt, with
    (dr/dt)^2 = v_n^2 + v_t^2 (1 - R^2/r^2) - alpha (r - R)^2.
    """
    import mpmath

    mp = mpmath.mp

    def square(depth: object) -> object:
        r = radius + depth
        return normal**2 + along**2 * depth * (r + radius) / r**2 - penalty * depth**2

    # From that of a flat wall; the tangential part goes deeper.
    deepest = mpmath.findroot(square, normal / mp.sqrt(penalty) * (1 + along**2 / (penalty * radius * radius)))

    def slice_of(u: object) -> tuple[object, object]:
        # depth = deepest (1 - u^2) takes the root's zero out of the integrand.
        depth = deepest * (1 - u * u)
        return 4 * deepest * u / mp.sqrt(square(depth)), radius + depth

    def touch(u: object) -> object:
        return slice_of(u)[0]

    def turn(u: object) -> object:
        time, r = slice_of(u)
        return time * radius * along / r**2

    return tuple(mpmath.quad(one, [0, 1], method="gauss-legendre") for one in (touch, turn))


def times_of(scene: swarm.Scene, particles: swarm.Particles) -> list[float]:
    """When the mean particle has had so many impacts, rounded to 1/64 s: whole steps of every dt that is tried."""
    until = 200.0
    result = swarm.simulate(scene, particles, swarm.Impact(), until=until)
    rate = result.observables["impacts"][-1] / len(particles) / until
    return [round(64.0 * count / rate) / 64.0 for count in IMPACTS]


def soft(particles: swarm.Particles, times: list[float]) -> dict[str, NDArray]:
    """The entries of the soft sphere."""
    starts = list(zip(particles.position.T, particles.velocity.T, strict=True))
    ends = [[in_a_sphere(r, v, 0.5, time, PENALTY) for time in times] for r, v in starts]
    known = {"position": particles.position, "velocity": particles.velocity, "times": np.array(times)}
    return {f"{SOFT}/{key}": values for key, values in {**known, "end": np.array(ends)}.items()}


def main(path: Path, quick: bool = False) -> None:
    """Write the file; `quick`: a particle for the shortest time, and nothing is written."""
    values = {}
    for name, scene in SCENES.items():
        particles = swarm.fill(scene, 1 if quick else PARTICLES, speed=SPEED, seed=5)
        times = times_of(scene, particles)[: 1 if quick else None]
        ends = [fly(scene, r, v, times) for r, v in zip(particles.position.T, particles.velocity.T, strict=True)]
        values[f"{name}/position"], values[f"{name}/velocity"] = particles.position, particles.velocity
        values[f"{name}/times"] = np.array(times)
        values[f"{name}/end"] = np.array([end for end, _impacts in ends])
        print(f"{name}: {times} s, {np.mean([impacts for _end, impacts in ends]):.1f} impacts each")
        if name == "sphere":
            values |= soft(particles, times)
    if quick:
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savez_compressed(path, **values)
    print(f"written to {path}")


if __name__ == "__main__":
    ask = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    ask.add_argument("-o", metavar="FILE", type=Path, default=OUT / PATH.name, help="default: %(default)s")
    ask.add_argument("--quick", action="store_true", help="to see that it runs; nothing is written")
    given = ask.parse_args()
    main(given.o, given.quick)
