"""A plain event loop, one particle at a time: sampled gaps, bisection, and the law of an impact as it is written.

It shares with the engine only phi and its gradient of each surface at rest. What moves a wall is written anew here.
"""

import cmath
import dataclasses
import math
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq, minimize_scalar

import swarm
from swarm.kernel.random import Stream, tangents
from swarm.kernel.vector import Vec
from swarm.motion.given import parts_of

# Between two samples of the gap [s], and how many at once.
STEP, WINDOW = 5e-4, 400
# A flight that is shorter [s] is the beginning of a contact that lasts.
SHORTEST = 3e-3
# A gap that comes so near to 0 and falls again [m]: whether it is an impact is round-off.
GRAZES = 1e-9
ALWAYS = ((0.0, math.inf),)
# A normal with so small a part along z: which tangents it has is round-off.
FLAT = 1e-9


class Wall(NamedTuple):
    """A surface as it is at rest, its motion, when it is there, and where and when it is open."""

    rest: object
    parts: tuple
    sign: float
    e: float
    mu: float
    present: tuple
    openings: tuple
    laws: tuple

    @staticmethod
    def of(surface):
        sign = -1.0 if getattr(surface, "side", "inside") == "outside" else 1.0
        rest = dataclasses.replace(surface, motion=None, present=None, openings=())
        e, mu, laws = surface.restitution, surface.friction, surface.laws
        if laws and laws[0]._fields == ("e", "mu"):
            # A user-defined law is a pair of both.
            (e, mu), laws = laws[0], ()
        return Wall(rest, parts_of(surface.motion), sign, e, mu, surface.present or ALWAYS, surface.openings, laws)

    def shift(self, t):
        """Displacements (3, T) and their rates at times (T,)."""
        d, u = np.zeros((3, t.size)), np.zeros((3, t.size))
        for part in self.parts:
            if isinstance(part, swarm.Translation):
                way, rate = t, np.ones_like(t)
                ahead = np.array(part.velocity)
            elif isinstance(part, swarm.Oscillation):
                omega, ahead = 2.0 * math.pi * part.frequency, np.array(part.amplitude)
                way = np.sin(omega * t + part.phase) - math.sin(part.phase)
                rate = omega * np.cos(omega * t + part.phase)
            else:
                continue
            d, u = d + ahead[:, None] * way, u + ahead[:, None] * rate
        return d, u

    def turning(self):
        """(unit axis, rate, center) of its rotation."""
        for part in self.parts:
            if isinstance(part, swarm.Rotation):
                axis = np.array(part.axis, dtype=float)
                return axis / np.linalg.norm(axis), part.rate, np.array(part.center, dtype=float)
        return np.array([0.0, 0.0, 1.0]), 0.0, np.zeros(3)

    def as_given(self, r, t):
        """Points (3, T) at times (T,) in the frame in which the wall is given."""
        k, rate, center = self.turning()
        arm = r - self.shift(t)[0] - center[:, None]
        return center[:, None] + turned(k, -rate * t, arm)

    def gap(self, r, t):
        there = np.any([(begin <= t) & (t < end) for begin, end in self.present], axis=0)
        return np.where(there, self.sign * self.rest.phi(self.as_given(r, t)), -1.0)

    def lets_out(self, r, t):
        """Whether it is open at a point (3,) of it."""
        return any(
            one.surface.phi(r[:, None])[0] <= 0.0 and any(begin <= t < end for begin, end in one.times)
            for one in self.openings
        )

    def normal(self, r, t):
        """The outward unit normal at a point (3,)."""
        t = np.array([t])
        k, rate, _center = self.turning()
        n = self.sign * turned(k, rate * t, self.rest.gradient(self.as_given(r[:, None], t)))[:, 0]
        return n / np.linalg.norm(n)

    def velocity(self, r, t):
        """Of the wall's material at a point (3,)."""
        t = np.array([t])
        k, rate, center = self.turning()
        d, u = self.shift(t)
        return u[:, 0] + rate * np.cross(k, r - d[:, 0] - center)


def turned(k, angles, vectors):
    """Vectors (3, T), each turned about the unit axis k by its angle: Rodrigues' formula."""
    c, s = np.cos(angles), np.sin(angles)
    along = (k[:, None] * vectors).sum(axis=0)
    return c * vectors + s * np.cross(k, vectors.T).T + (1.0 - c) * along * k[:, None]


class Followed(NamedTuple):
    """States at the times that are before the end, how many impacts came before each, and that end."""

    position: np.ndarray
    velocity: np.ndarray
    impacts: list
    end: float


def follow(scene, r, v, times, start=0.0, particle=0):
    """One particle from a time on; it ends where a contact begins to last, or an impact is a matter of round-off."""
    walls = [Wall.of(surface) for surface in scene.surfaces]
    pull = np.array(scene.gravity if scene.gravity is not None else (0.0, 0.0, 0.0))
    count, seen = 0, []
    until = times[-1]
    while True:

        def place(t, r=r, v=v, start=start):
            s = t - start
            return r[:, None] + v[:, None] * s + 0.5 * pull[:, None] * s * s

        hit, wall, clear = first_impact(walls, place, start, until)
        end = min(hit, until)
        for time in times[len(seen) :]:
            if time > end or (time == end and hit <= until):
                break
            seen.append((place(np.array([time]))[:, 0], v + pull * (time - start), count))
        if hit > until or not clear or hit - start < SHORTEST:
            break
        r, v = place(np.array([hit]))[:, 0], v + pull * (hit - start)
        if wall.lets_out(r, hit):
            seen += [(r, v, count)] * (len(times) - len(seen))
            break
        n, u = wall.normal(r, hit), wall.velocity(r, hit)
        w = v - u
        if w @ n <= 1e-6:
            break
        if wall.laws and abs(n[2]) < FLAT and any(type(law) is not swarm.Absorb for law in wall.laws):
            break
        w, stays = after(wall, w, n, particle, count)
        if not stays:
            seen += [(r, v, count + 1)] * (len(times) - len(seen))
            break
        v, start, count = u + w, hit, count + 1
    position, velocity, impacts = ([one[k] for one in seen] for k in range(3))
    return Followed(np.array(position).reshape(-1, 3), np.array(velocity).reshape(-1, 3), impacts, end)


def after(wall, w, n, particle, count):
    """(velocity after, whether it stays) relative to a wall with the outward normal n."""
    if wall.laws:
        return by_laws(wall.laws, w, n, [Stream(0, particle, count).of_law(k) for k in range(len(wall.laws))])
    b = w @ n
    slip = w - b * n
    speed = np.linalg.norm(slip)
    share = min(wall.mu * (1.0 + wall.e) * b / speed, 1.0) if speed > 0.0 else 0.0
    return (1.0 - share) * slip - wall.e * b * n, True


def by_laws(laws, w, n, streams):
    """(velocity after, whether it stays) by laws of swarm's, relative to a wall with the outward normal n; mass 1."""
    stays = True
    for k, (law, stream) in enumerate(zip(laws, streams, strict=True)):
        w = w if k == 0 else w - 2.0 * (w @ n) * n
        b, u, kind = w @ n, [stream.uniform(j) for j in range(4)], type(law)
        first, second = map(np.array, tangents(Vec(*-n)))
        turn = [math.cos(2.0 * math.pi * u[j]) * first + math.sin(2.0 * math.pi * u[j]) * second for j in (1, 3)]
        if kind is swarm.Absorb:
            chance = law.probability if law.barrier is None else 1.0 if 0.5 * b * b > law.barrier else law.loss or 0.0
            stays = stays and u[0] >= chance
            w = w - 2.0 * b * n
        elif kind is swarm.Lambert and u[0] < law.probability:
            part = u[0] / law.probability
            w = np.linalg.norm(w) * (math.sqrt(1.0 - part) * turn[0] - math.sqrt(part) * n)
        elif kind is swarm.Lambert:
            w = w - 2.0 * b * n
        else:
            speed2, spread = 2.0 * law.temperature, law.tangential * (2.0 - law.tangential)
            drawn = cmath.rect(math.sqrt(-law.normal * speed2 * math.log(u[0])), 2.0 * math.pi * u[1])
            away = abs(math.sqrt(1.0 - law.normal) * b + drawn)
            w = (1.0 - law.tangential) * (w - b * n) - away * n + math.sqrt(-spread * speed2 * math.log(u[2])) * turn[1]
    return w, stays


def first_impact(walls, place, start, until):
    """(time, wall, whether it is clear) of the first rise of a gap through 0; later than `until` if it never rises."""
    # The wall that was left is still within round-off: it counts once it has been left.
    begin, left = start, start + 0.1 * SHORTEST
    while begin < until:
        t = np.minimum(begin + STEP * np.arange(WINDOW + 2), until + STEP)
        hits = [(*first_rise(wall, place, t, left), wall) for wall in walls]
        hit, clear, wall = min(hits, key=lambda one: one[0])
        if hit <= until:
            return hit, wall, clear
        begin = t[WINDOW]
    return math.inf, None, True


def first_rise(wall, place, t, left):
    """(time, whether it is clear) of the first rise of a wall's gap among samples; infinite if it never rises."""
    g = wall.gap(place(t), t)

    def gap(s):
        return wall.gap(place(np.array([s])), np.array([s]))[0]

    rises = (g[:-1] <= 0.0) & (g[1:] > 0.0)
    tops = np.zeros_like(rises)
    # A parabola through three samples rises above the middle one by an eighth of its fall to them.
    fall = g[1:-1] - np.minimum(g[:-2], g[2:])
    tops[1:] = (g[1:-1] >= g[:-2]) & (g[1:-1] >= g[2:]) & (g[1:-1] <= 0.0) & (g[1:-1] + fall > -GRAZES)
    for i in np.flatnonzero(rises | tops):
        low, high = t[i], t[i + 1]
        if not rises[i]:
            low = t[max(i - 1, 0)]
            top = minimize_scalar(lambda s: -gap(s), bounds=(low, high), method="bounded", options={"xatol": 1e-12})
            if top.fun >= GRAZES:
                continue
            if top.fun >= -GRAZES:
                return top.x, False
            high = top.x
        low = max(low, left)
        # Else it is back within the first samples after its impact.
        clear = low < high and gap(low) <= 0.0
        return (brentq(gap, low, high, xtol=1e-15, rtol=9e-16) if clear else t[i]), clear
    return math.inf, True
