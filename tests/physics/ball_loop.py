"""A plain event loop of balls: all pairs, all walls, no cells and no heap; in floats, or in mpmath with any digits.

It shares nothing with the engine but the description of the scene: distances from walls, motions and impacts are
written anew, for numbers of any kind.
"""

import itertools
import math
from typing import Any, NamedTuple

import numpy as np
from physics.ball_walls import Walls

import swarm

# Between two looks at the gap of a ball that is near a wall [s], so that it turns at most once within.
STEP = 4e-3
# A flight from a wall back to it that is shorter [s] is the beginning of a contact that lasts.
SHORTEST = 1e-5
# A gap that comes so near to 0 and grows again [m]: whether it is an impact is round-off.
GRAZES = 1e-9
# A smaller gap counts as contact [m].
ROUND_OFF = 1e-12
# An impact in which so little of the velocity is along the normal is known to as few digits less.
SLOW = 1e-3
WALL = -1
UNTURNED = np.eye(3)


class Followed(NamedTuple):
    """States at the times that are before the end, and what happened until then."""

    position: np.ndarray  # (times, 3, N), unwrapped
    velocity: np.ndarray
    collisions: np.ndarray  # (times,) of pairs
    impacts: np.ndarray  # (times,) at walls
    events: list[tuple[Any, int, int]]  # (time, particle, partner or WALL)
    virial: Any  # the sum of r_ij . J_ij
    lost: Any  # energy [J]
    end: Any


def follow(scene, start, times, module=math, most=100_000):
    """Balls from 0 s on, until the last time, `most` events, or an impact that is a matter of round-off.

    `module` is math, or mpmath with its precision set.
    """
    loop = _Loop(scene, start, times[-1], module)
    seen = []
    for time in times:
        if not loop.advance(loop.number(time), most):
            break
        seen.append((*loop.at(loop.number(time)), loop.collisions, loop.impacts))
    position, velocity, collisions, impacts = ([one[k] for one in seen] for k in range(4))
    return Followed(
        np.array(position), np.array(velocity), np.array(collisions), np.array(impacts), loop.events, loop.virial,
        loop.lost, loop.now,
    )  # fmt: skip


class _Loop:
    """The state of the loop: each ball is known at the time of its last impact."""

    def __init__(self, scene, start, last, module):
        self.module, self.number = module, float if module is math else module.mpf
        exact = np.vectorize(self.number, otypes=[float if module is math else object])
        self.r, self.v = exact(start.position.T), exact(start.velocity.T)
        self.mass, self.radius = exact(start.mass), exact(start.radius)
        self.pull = exact(scene.gravity if scene.gravity is not None else (0.0, 0.0, 0.0))
        self.period = scene.period
        pairs = scene.pairs or swarm.Pairs()
        self.e, self.duration = self.number(pairs.restitution), self.number(pairs.contact_duration or 0.0)
        self.epsilon = 2.0**-52 if module is math else module.eps
        walls = Walls(self.number, module, self.epsilon, scene.period)
        self.walls = [wall for one in scene.surfaces for wall in walls.of(one)]
        n = len(self.mass)
        zero, self.last = self.number(0), self.number(last)
        self.now, self.time, self.met = zero, [zero] * n, [-self.number("inf")] * n
        self.left = [None] * n
        self.collisions = self.impacts = 0
        self.events, self.virial, self.lost, self.work = [], zero, zero, zero
        self.at_walls = [self._next_at_walls(i) for i in range(n)]
        self.pairs = {(i, j): self._next_of_pair(i, j) for i, j in itertools.combinations(range(n), 2)}

    # --- From event to event -----------------------------------------------------------------------------

    def advance(self, until, most):
        """Take all events until a time; False where they end before it."""
        while True:
            wall = min(self.at_walls, key=lambda one: one[0])
            (i, j), pair = min(self.pairs.items(), key=lambda item: item[1][0])
            hit = min(wall[0], pair[0])
            if hit > until:
                return True
            if len(self.events) >= most:
                return False
            self.now = hit
            if pair[0] > wall[0]:
                i = self.at_walls.index(wall)
                changed = (i,)
                if not self._strike(i, wall):
                    return False
            elif pair[1] is not None:
                changed = (i, j)
                self._collide(i, j, pair)
            else:
                changed = ()
                self.pairs[i, j] = self._next_of_pair(i, j, hit)
            for k in changed:
                self.at_walls[k] = self._next_at_walls(k)
            for one in self.pairs:
                if one[0] in changed or one[1] in changed:
                    self.pairs[one] = self._next_of_pair(*one, hit)

    def at(self, time):
        """Positions and velocities (3, N) at a time."""
        states = [self._place(i, time) for i in range(len(self.mass))]
        return np.array([r for r, _ in states]).T, np.array([v for _, v in states]).T

    def _place(self, i, time):
        s = time - self.time[i]
        return self.r[i] + self.v[i] * s + self.pull * (s * s / 2), self.v[i] + self.pull * s

    def _move(self, i, time):
        self.r[i], self.v[i] = self._place(i, time)
        self.time[i] = time

    # --- Pairs -------------------------------------------------------------------------------------------

    def _next_of_pair(self, i, j, begin=0):
        """(time, the image of j that i meets, as a shift), or (time, None) where it is to be asked again."""
        begin = self.number(begin)
        (ri, vi), (rj, vj) = self._place(i, begin), self._place(j, begin)
        r, v, sigma = ri - rj, vi - vj, self.radius[i] + self.radius[j]
        shifts, horizon = [0 * r], math.inf
        if self.period is not None:
            speed, size = self._length(v), min(one for one in self.period if one is not None)
            horizon = size / (2 * speed) if speed > 0 else math.inf
            ways = [(0,) if one is None else (-1, 0, 1) for one in self.period]
            near = [0 if one is None else round(float(r[k] / one)) for k, one in enumerate(self.period)]
            lengths = [self.number(one or 0.0) for one in self.period]
            shifts = [np.array([(near[k] + way[k]) * lengths[k] for k in range(3)]) for way in itertools.product(*ways)]
        best = math.inf, None
        for shift in shifts:
            s = self._until(r - shift, v, sigma)
            if s <= horizon and begin + s < best[0]:
                best = begin + s, shift
        return best if best[1] is not None else (begin + horizon, None)

    def _until(self, r, v, sigma):
        b, c = r @ v, r @ r - sigma * sigma
        if b >= 0:
            return math.inf
        rest = b * b - (v @ v) * c
        if rest <= 0:
            return math.inf
        return max(c / (self.module.sqrt(rest) - b), self.number(0))

    def _collide(self, i, j, pair):
        for k in (i, j):
            self._move(k, self.now)
        r = self.r[i] - self.r[j] - pair[1]
        n = r / self._length(r)
        e = self._restitution(self.e, i, j)
        b, reduced = (self.v[i] - self.v[j]) @ n, self.mass[i] * self.mass[j] / (self.mass[i] + self.mass[j])
        impulse = -(1 + e) * b * reduced
        self.v[i] = self.v[i] + impulse / self.mass[i] * n
        self.v[j] = self.v[j] - impulse / self.mass[j] * n
        self.lost += (1 - e * e) * reduced * b * b / 2
        self.virial += impulse * self._length(r)
        self.met[i] = self.met[j] = self.now
        self.left[i] = self.left[j] = None
        self.collisions += 1
        self.events.append((self.now, i, j))

    # --- Walls -------------------------------------------------------------------------------------------

    def _next_at_walls(self, i):
        """(time, wall, whether it is clear) of the next impact of a ball at any wall, until the last time."""
        best = (math.inf, None, True)
        for wall in self.walls:
            found = self._first_hit(i, wall, min(self.last, best[0]))
            if found[0] < best[0]:
                best = (found[0], wall, found[1])
        return best

    def _first_hit(self, i, wall, until):
        """(time, whether it is clear) of the first fall of the gap of a ball through 0, later than the last impact."""
        a, just_left = self.time[i], self.left[i] is wall
        g, rate = self._gap(i, wall, a)
        if abs(g) < ROUND_OFF and rate <= 0:
            # It touches the wall and moves into it: an impact now, but for one that has just been.
            return a, not just_left
        while a <= until:
            speed = self._fastest(i, wall, a)
            b = a + max(g / speed if speed > 0 else math.inf, self.number(STEP))
            if b > 2 * (until + 1):
                break
            h, slope = self._gap(i, wall, b)
            if h <= 0 and just_left and a == self.time[i]:
                top = self._turns(i, wall, a, b)
                return self._root(i, wall, top, b), top - a > SHORTEST
            if h <= 0:
                return self._root(i, wall, a, b), True
            if rate < 0 < slope and min(g, h) < abs(rate) * (b - a):
                low = self._turns(i, wall, a, b)
                least = self._gap(i, wall, low)[0]
                if least < GRAZES:
                    return (self._root(i, wall, a, low), True) if least < -GRAZES else (low, False)
            a, g, rate = b, h, slope
        return math.inf, True

    def _fastest(self, i, wall, time):
        """A bound of the speed at which the gap may fall within the next flight to the wall."""
        v = self._length(self._place(i, time)[1])
        pull, own = self._length(self.pull), self.number(0)
        for part in wall.parts:
            if isinstance(part, swarm.Translation):
                own += math.hypot(*part.velocity)
            elif isinstance(part, swarm.Oscillation):
                own += 2 * math.pi * part.frequency * math.hypot(*part.amplitude)
            else:
                own += abs(part.rate) * 4
        # Under gravity the speed grows on the way: as much as in half a second.
        return (v + own + pull / 2) * self.number(1.0001)

    def _gap(self, i, wall, time):
        """(gap, its rate) of a ball and a wall at a time."""
        r, v = self._place(i, time)
        here, turn, u = self._as_given(wall, r, time)
        n = turn @ wall.normal(here)
        return wall.distance(here) - self.radius[i], -(n @ (v - u))

    def _as_given(self, wall, r, time):
        """A point in the frame in which a wall is given, the turn of that frame, and the velocity of the wall there."""
        shift, rate = 0 * r, 0 * r
        if not wall.parts:
            return r, UNTURNED, rate
        turn, k, omega, center = np.eye(3), np.array([0.0, 0.0, 1.0]), 0.0, np.zeros(3)
        sin, cos = self.module.sin, self.module.cos
        for part in wall.parts:
            if isinstance(part, swarm.Translation):
                way = np.array(part.velocity)
                shift, rate = shift + way * time, rate + way
            elif isinstance(part, swarm.Oscillation):
                w, far = 2 * self._pi() * self.number(part.frequency), np.array(part.amplitude)
                phase = self.number(part.phase)
                shift = shift + far * (sin(w * time + phase) - sin(phase))
                rate = rate + far * (w * cos(w * time + phase))
            else:
                k = np.array(part.axis, dtype=float) / math.hypot(*part.axis)
                omega, center = part.rate, np.array(part.center, dtype=float)
                x, y, z = k
                cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
                angle = omega * time
                turn = np.eye(3) + cross * sin(angle) + cross @ cross * (1 - cos(angle))
        arm = r - shift - center
        return center + turn.T @ arm, turn, rate + omega * np.cross(k, arm) if omega else rate

    def _pi(self):
        return self.module.pi if self.module is math else self.module.mpf(self.module.pi)

    def _root(self, i, wall, a, b):
        """Where the gap falls through 0: Newton's method within a bracket."""
        t = (a + b) / 2
        g, rate = self._gap(i, wall, t)
        for _step in range(2000):
            if g > 0:
                a = t
            else:
                b = t
            new = t - g / rate if rate < 0 else (a + b) / 2
            if not a <= new <= b:
                new = (a + b) / 2
            if new == t or b - a <= abs(b) * self.epsilon:
                return new
            near = abs(new - t) <= 4 * abs(t) * self.epsilon
            t = new
            if near:
                return t
            g, rate = self._gap(i, wall, t)
        return t

    def _turns(self, i, wall, a, b):
        """Where the rate of the gap goes through 0."""
        sign = 1 if self._gap(i, wall, a)[1] > 0 else -1
        for _step in range(60):
            t = (a + b) / 2
            if sign * self._gap(i, wall, t)[1] > 0:
                a = t
            else:
                b = t
        return (a + b) / 2

    def _strike(self, i, hit):
        """The impact of a ball; False where round-off decides of it, or is large in it."""
        # A ball that is back at a wall as soon as that is in a contact that may last.
        if not hit[2]:
            return False
        time, wall, _clear = hit
        self._move(i, time)
        here, turn, u = self._as_given(wall, self.r[i], time)
        n, e = turn @ wall.normal(here), self._restitution(self.number(wall.e), i)
        b = (self.v[i] - u) @ n
        if b < SLOW * self._length(self.v[i] - u):
            return False
        before = self.v[i] @ self.v[i]
        self.v[i] = self.v[i] - (1 + e) * b * n
        self.lost += self.mass[i] * (1 - e * e) * b * b / 2
        self.work += self.mass[i] * (self.v[i] @ self.v[i] - before) / 2
        self.left[i] = wall
        self.impacts += 1
        self.events.append((time, i, WALL))
        return True

    def _restitution(self, e, *balls):
        """Of an impact of balls; a ball that met another one within the contact duration before keeps its energy."""
        recent = max(self.met[k] for k in balls)
        return self.number(1) if self.now - recent < self.duration else e

    def _length(self, v):
        return self.module.sqrt(v @ v)
