"""Points that are led along a path s(t), and the work of leading them."""

import math

from ...kernel.vector import column, put


def lead(bodies, state, elapsed):
    """Move led points to their places at the end of a stage, with the velocities of their paths.

    `elapsed` is the part of the step at the end of the stage. A point moves by the difference of its path, which is
    smooth in the length of the stage. A place computed from the time alone has steps of the round-off of the time,
    6e-15 m after a second at 26 m/s, in which no time of impact is found.
    """
    led, lanes, pace = bodies.ties.led, bodies.lanes, bodies.pace
    for q in range(led.size):
        if led[q] >= 0:
            path = state.path[led[q]]
            for i in range(pace.h.size):
                if pace.body[i] >= 0:
                    n, h = pace.body[i], pace.h[i]
                    part = 1.0 if pace.whole[i] else elapsed
                    t = bodies.rule.end - (pace.remaining[i] - part * pace.step[i])
                    along, cosines, sines = column(path, 3, n), column(path, 6, n), column(path, 9, n)
                    rate = path[12, n]
                    middle, chord = rate * (t - 0.5 * h), 2.0 * math.sin(0.5 * rate * h)
                    ahead, down = chord * math.cos(middle), chord * math.sin(middle)
                    sine, cosine = math.sin(rate * t), math.cos(rate * t)
                    moved = along * h + (sines * ahead - cosines * down)
                    put(lanes.r1, 3 * q, i, column(lanes.ra, 3 * q, i) + moved)
                    put(lanes.v1, 3 * q, i, along + rate * (sines * cosine - cosines * sine))


def book(bodies, last):
    """Add the work of led points on ties and contacts in a stage: the sum of (sum lambda D + sum p b d).(s1 - s0)."""
    ties, lanes, pace, active = bodies.ties, bodies.lanes, bodies.pace, bodies.active
    for q in range(ties.led.size):
        if ties.led[q] >= 0:
            for i in range(pace.h.size):
                if pace.body[i] >= 0 and (last or not pace.whole[i]):
                    for x in range(3):
                        force = 0.0
                        for a in range(ties.ends.shape[0]):
                            sign = (1.0 if ties.ends[a, 0] == q else 0.0) - (1.0 if ties.ends[a, 1] == q else 0.0)
                            force += sign * lanes.multiplier[a, i] * lanes.d[3 * a + x, i]
                        for a in range(pace.active[i]):
                            b = bodies.touching.coefficients[active.name[i, a, 0], q]
                            for d in range(3):
                                force += b * active.press[i, 3 * a + d] * active.frame[i, a, d, x]
                        pace.work[i] += force * (lanes.r1[3 * q + x, i] - lanes.ra[3 * q + x, i])
