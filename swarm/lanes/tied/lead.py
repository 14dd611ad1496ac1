"""Points that are led along a path s(t), and the work that leading them takes."""

import math


def lead(ties, rule, state, lanes, pace, elapsed):
    """Put led points where their paths are at the end of a stage, with the velocity there.

    `elapsed` is the part of the step at the end of the stage. A point goes on from where it is by the difference of its
    path, which is smooth in the length of the stage: a place of its own for each time has steps of the round-off of the
    time, 6e-15 m after a second at 26 m/s, in which no time of impact is found.
    """
    for q in range(lanes.r1.shape[0]):
        row = ties.led[q]
        if row >= 0:
            path = state.path
            for i in range(lanes.r1.shape[2]):
                if pace.body[i] >= 0:
                    n = pace.body[i]
                    part = 1.0 if pace.whole[i] else elapsed
                    t = rule.end - (pace.left[i] - part * pace.step[i])
                    rate, h = path[row, 12, n], pace.h[i]
                    middle, chord = rate * (t - 0.5 * h), 2.0 * math.sin(0.5 * rate * h)
                    ahead, down = chord * math.cos(middle), chord * math.sin(middle)
                    sine, cosine = math.sin(rate * t), math.cos(rate * t)
                    for x in range(3):
                        turned = path[row, 9 + x, n] * ahead - path[row, 6 + x, n] * down
                        lanes.r1[q, x, i] = lanes.ra[q, x, i] + (path[row, 3 + x, n] * h + turned)
                        turned = path[row, 9 + x, n] * cosine - path[row, 6 + x, n] * sine
                        lanes.v1[q, x, i] = path[row, 3 + x, n] + rate * turned


def book(body, lanes, paces, last):
    """Add the work of led points in a stage on ties and contacts: the sum of (sum lambda D + sum p b d).(s1 - s0)."""
    ties, touching = body
    pace, held = paces
    for q in range(lanes.r1.shape[0]):
        if ties.led[q] >= 0:
            for i in range(lanes.r1.shape[2]):
                if pace.body[i] >= 0 and (last or not pace.whole[i]):
                    for x in range(3):
                        force = 0.0
                        for a in range(ties.ends.shape[0]):
                            sign = (1.0 if ties.ends[a, 0] == q else 0.0) - (1.0 if ties.ends[a, 1] == q else 0.0)
                            force += sign * lanes.multiplier[a, i] * lanes.d[a, x, i]
                        for a in range(pace.held[i]):
                            b = touching.coefficients[held.name[i, a, 0], q]
                            for d in range(3):
                                force += b * held.press[i, 3 * a + d] * held.frame[i, a, d, x]
                        pace.work[i] += force * (lanes.r1[q, x, i] - lanes.ra[q, x, i])
