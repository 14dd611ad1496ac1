"""Ties: the equations of their multipliers in one stage of a step, in all lanes at once.

    r1 = p - (h^2/2) W sum lambda D,  v1 = v0 + h G - h W sum lambda D,  p = r0 + h v0 + h^2 G/2
with D = y0 + y1, the discrete gradient of |y|^2 of each tie (a quadratic, so it is exact), and for every tie
    link     |y1|^2 = l^2
    spring   lambda = k (1 - 2 l/(|y0| + |y1|))/2, the composite discrete gradient of k (|y| - l)^2/2
    edges    lambda = K ((|y0|^2 + |y1|^2)/2 - s0)
    relaxed  alpha (c0 + c1)/2 + lambda' of the link c = (|y|^2 - l^2)/(2 l) along its discrete gradient D/(2 l): an
             edge with K = alpha/(4 l^2), and 4 l lambda'/alpha more on the left
so that links do no work and what springs and edges do is the change of their energy, exactly. v1 in this form, because
2 (r1 - r0)/h - v0 cancels: 3e-10 instead of 1e-15.
"""

import math

from ...kernel.jit import select

# Where the relative error of |y|^2 would be below this after a correction, it is the last.
_TOLERANCE = 1e-15
# By how much a correction shrinks the error: this times h^2 W lambda, over neighbours of ties too.
_NEGLECTED = 4.0
# By how much D may still change, in units of round-off of a place.
_SETTLED = 64.0
# A tie under pressure makes the first guess of D longer; at most by 1 over this.
_LEAST = 0.5
# What a first correction is trusted with: D lags behind it, and what D is off by is missing in the energy.
_AT_FIRST = 1e-3
# The rest length that scales the equation of a spring is at least this part of its length.
_SHORTEST = 1e-8


def launch(ties, gravity, lanes, pace):
    """Where the stage would end without ties, p, and D for that."""
    points, count = lanes.force.shape[0], lanes.force.shape[2]
    for q in range(points):
        if ties.is_free[q]:
            for x in range(3):
                g = gravity[x]
                for i in range(count):
                    pull = 0.5 * pace.h[i] * g
                    lanes.p[q, x, i] = lanes.ra[q, x, i] + pace.h[i] * (lanes.va[q, x, i] + pull)
        else:
            for x in range(3):
                for i in range(count):
                    lanes.p[q, x, i] = lanes.r1[q, x, i]
    for a in range(ties.ends.shape[0]):
        first, second = ties.ends[a, 0], ties.ends[a, 1]
        w = ties.couplings[a, a]
        alone = ties.ends.shape[0] == 1
        for i in range(count):
            longer = 1.0 + 0.5 * pace.h[i] * pace.h[i] * w * lanes.multiplier[a, i]
            pace.rate[i] = 1.0 / select(longer > _LEAST, longer, _LEAST) if alone else 1.0
        for x in range(3):
            for i in range(count):
                y = lanes.ra[first, x, i] - lanes.ra[second, x, i]
                lanes.y0[a, x, i] = y
                # One tie alone is this much shorter, exactly. Of several, each made shorter by its own would turn the
                # forces between them: 1e-13 of the angular momentum a step, where all as they are leave its round-off.
                d = (y + (lanes.p[first, x, i] - lanes.p[second, x, i])) * pace.rate[i]
                lanes.d[a, x, i] = select(pace.waits[i] > 0, lanes.d[a, x, i], d)


def arrive(ties, gravity, lanes, pace):
    """v1 = v0 + h G - h W sum lambda D"""
    for q in range(lanes.force.shape[0]):
        if ties.is_free[q]:
            for x in range(3):
                g = gravity[x]
                for i in range(lanes.force.shape[2]):
                    lanes.v1[q, x, i] = lanes.va[q, x, i] + pace.h[i] * (g - lanes.force[q, x, i])


def move(lanes, pace):
    """r1 = p - (h^2/2) of the deceleration"""
    for q in range(lanes.r1.shape[0]):
        for x in range(3):
            for i in range(lanes.r1.shape[2]):
                k2 = 0.5 * pace.h[i] * pace.h[i]
                lanes.r1[q, x, i] = lanes.p[q, x, i] - k2 * lanes.force[q, x, i]


def follow(ties, lanes, pace):
    """D = y0 + y1

    In a lane that is done D stays as it is: with the multipliers, which stay too, it gives the same r1 again.
    """
    for i in range(lanes.r1.shape[2]):
        pace.lag[i] = 0.0
    for a in range(ties.ends.shape[0]):
        first, second = ties.ends[a, 0], ties.ends[a, 1]
        for x in range(3):
            for i in range(lanes.r1.shape[2]):
                d = lanes.y0[a, x, i] + (lanes.r1[first, x, i] - lanes.r1[second, x, i])
                change = d - lanes.d[a, x, i]
                pace.lag[i] += change * change
                lanes.d[a, x, i] = select(pace.done[i], lanes.d[a, x, i], d)


def accelerate(ties, lanes):
    """W sum lambda D, the deceleration by the ties."""
    force, points, count = lanes.force, lanes.force.shape[0], lanes.force.shape[2]
    for q in range(points):
        for x in range(3):
            for i in range(count):
                force[q, x, i] = 0.0
    for a in range(ties.ends.shape[0]):
        first, second = ties.ends[a, 0], ties.ends[a, 1]
        for x in range(3):
            for i in range(count):
                g = lanes.multiplier[a, i] * lanes.d[a, x, i]
                force[first, x, i] += g
                force[second, x, i] -= g
    if ties.is_diagonal:
        for q in range(points):
            w = ties.inverse_mass[q, q]
            for x in range(3):
                for i in range(count):
                    force[q, x, i] *= w
        return
    # v1 of points that are not free is their path's.
    for q in range(points):
        if ties.is_free[q]:
            for x in range(3):
                for i in range(count):
                    lanes.v1[q, x, i] = 0.0
            for s in range(points):
                w = ties.inverse_mass[q, s]
                if w != 0.0:
                    for x in range(3):
                        for i in range(count):
                            lanes.v1[q, x, i] += w * force[s, x, i]
    for q in range(points):
        for x in range(3):
            for i in range(count):
                force[q, x, i] = lanes.v1[q, x, i] if ties.is_free[q] else 0.0


def residual(ties, lanes, pace, turn, rule):
    """How far each tie is from its equation, as an error of |y1|^2; which lanes need no more than one correction."""
    f, count, rows = lanes.f, lanes.f.shape[1], ties.ends.shape[0]
    links, soft = ties.links, ties.links + ties.springs
    for i in range(count):
        pace.error[i] = 0.0
        pace.rate[i] = 0.0
    for a in range(rows):
        first, second = ties.ends[a, 0], ties.ends[a, 1]
        for i in range(count):
            f[a, i] = 0.0
        for x in range(3):
            for i in range(count):
                y = lanes.r1[first, x, i] - lanes.r1[second, x, i]
                lanes.y1[a, x, i] = y
                f[a, i] += y * y
        if a < links:
            rest, inverse = ties.rest[a], 1.0 / ties.rest[a]
            for i in range(count):
                f[a, i] -= rest
                _worse(pace.error, i, abs(f[a, i]) * inverse)
        elif a < soft - ties.relaxed:
            rest, softness = ties.rest[a], 2.0 / ties.stiffness[a]
            for i in range(count):
                y = lanes.y0[a, 0, i] * lanes.y0[a, 0, i] + lanes.y0[a, 1, i] * lanes.y0[a, 1, i]
                after = math.sqrt(f[a, i])
                both = math.sqrt(y + lanes.y0[a, 2, i] * lanes.y0[a, 2, i]) + after
                short = select(rest > _SHORTEST * both, rest, _SHORTEST * both)
                # The equation times this has the derivative 1 by |y1|^2.
                scale = both * both * after / short
                unmet = 1.0 - 2.0 * rest / both - softness * lanes.multiplier[a, i]
                f[a, i] = scale * unmet
                lanes.soft[a, i] = scale * softness
                _worse(pace.error, i, abs(unmet))
        elif a < soft:
            rest, give, inverse = 2.0 * ties.rest[a], ties.give[a], 1.0 / ties.rest[a]
            for i in range(count):
                y = lanes.y0[a, 0, i] * lanes.y0[a, 0, i] + lanes.y0[a, 1, i] * lanes.y0[a, 1, i]
                f[a, i] += (y + lanes.y0[a, 2, i] * lanes.y0[a, 2, i]) - rest
                lanes.soft[a, i] = give * pace.ease[i]
                f[a, i] += lanes.offset[a, i] - lanes.soft[a, i] * lanes.multiplier[a, i]
                _worse(pace.error, i, abs(f[a, i]) * inverse)
        else:
            rest, inverse = 2.0 * ties.rest[a], 1.0 / ties.rest[a]
            for i in range(count):
                y = lanes.y0[a, 0, i] * lanes.y0[a, 0, i] + lanes.y0[a, 1, i] * lanes.y0[a, 1, i]
                f[a, i] += (y + lanes.y0[a, 2, i] * lanes.y0[a, 2, i]) - rest
            for b in range(soft, rows):
                give = ties.compliance[a - soft, b - soft]
                if give != 0.0:
                    for i in range(count):
                        f[a, i] -= give * lanes.multiplier[b, i]
            for i in range(count):
                _worse(pace.error, i, abs(f[a, i]) * inverse)
        for i in range(count):
            # What the correction neglects: that D changes with r1
            k2 = _NEGLECTED * pace.h[i] * pace.h[i]
            _worse(pace.rate, i, abs(k2 * ties.couplings[a, a] * lanes.multiplier[a, i]))
    _decide(links == rows, pace, turn, rule)


def _decide(is_rigid, pace, turn, rule):
    """Which lanes need no more than one correction; `is_rigid`: no tie of the body changes its length."""
    for i in range(pace.error.size):
        error, before = pace.error[i], pace.previous[i]
        # In a pass that goes on D has followed twice since: the ratio says too little.
        rate = select(pace.waits[i] == 0, 0.0, error / before)
        rate = select(turn > 0, error / before, select(rate > _AT_FIRST, rate, _AT_FIRST))
        # Of slow turns what D lags behind is along D, where it does no work, but for ties whose length changes.
        turned = select((pace.rate[i] < 1.0) & is_rigid, pace.rate[i], 1.0)
        counts = turned * turned * turned * turned
        rate = select(rate > pace.rate[i], rate, pace.rate[i])
        # What is put off goes on from here in the next pass, however many corrections its neighbours take in this one.
        pace.previous[i] = select(pace.done[i], before, error)
        # A turn by 1 in a step can meet the lengths with a D that is far off, and loses 2e-8 of the energy.
        room = _SETTLED * rule.room
        settled = counts * counts * pace.lag[i] <= room * room
        pace.last[i] = settled & ((error * rate <= _TOLERANCE) | (error <= rule.noise))


def _worse(worst, i, value):
    """Keep the larger one; NaN counts as infinite."""
    value = select(value < math.inf, value, math.inf)
    worst[i] = select(value > worst[i], value, worst[i])


def assemble(ties, lanes, pace):
    """The derivative of each equation by each multiplier, h^2 (beta W beta) y1.D, within the skyline."""
    a, y, d, count = lanes.a, lanes.y1, lanes.d, lanes.f.shape[1]
    links, soft = ties.links, ties.links + ties.springs
    for row in range(ties.ends.shape[0]):
        for column in range(ties.start[row], row + 1):
            w = ties.couplings[row, column]
            give = 0.0
            if column >= soft:
                give = ties.compliance[row - soft, column - soft]
            for i in range(count):
                k = w * pace.h[i] * pace.h[i]
                along = y[row, 0, i] * d[column, 0, i] + y[row, 1, i] * d[column, 1, i]
                a[row, column, i] = k * (along + y[row, 2, i] * d[column, 2, i]) + give
            if column < row:
                for i in range(count):
                    k = w * pace.h[i] * pace.h[i]
                    along = y[column, 0, i] * d[row, 0, i] + y[column, 1, i] * d[row, 1, i]
                    a[column, row, i] = k * (along + y[column, 2, i] * d[row, 2, i]) + give
        if links <= row < soft:
            for i in range(count):
                a[row, row, i] += lanes.soft[row, i]


def factor(start, a):
    """A = L U in place, with 1/U on the diagonal; the entries before `start` of a row, and of its column, are 0."""
    count = a.shape[2]
    for row in range(a.shape[0]):
        first = start[row]
        for column in range(first, row):
            for k in range(max(first, start[column]), column):
                for i in range(count):
                    a[column, row, i] -= a[column, k, i] * a[k, row, i]
                for i in range(count):
                    a[row, column, i] -= a[row, k, i] * a[k, column, i]
            for i in range(count):
                a[row, column, i] *= a[column, column, i]
        for k in range(first, row):
            for i in range(count):
                a[row, row, i] -= a[row, k, i] * a[k, row, i]
        for i in range(count):
            a[row, row, i] = 1.0 / a[row, row, i]


def substitute(start, a, f):
    """f = A^-1 f, where A is factored."""
    count = f.shape[1]
    for row in range(f.shape[0]):
        for k in range(start[row], row):
            for i in range(count):
                f[row, i] -= a[row, k, i] * f[k, i]
    for row in range(f.shape[0] - 1, -1, -1):
        for k in range(row + 1, f.shape[0]):
            if start[k] <= row:
                for i in range(count):
                    f[row, i] -= a[row, k, i] * f[k, i]
        for i in range(count):
            f[row, i] *= a[row, row, i]


def correct(lanes, pace):
    """Add A^-1 f to the multipliers of lanes that are not done."""
    for row in range(lanes.f.shape[0]):
        for i in range(lanes.f.shape[1]):
            g = lanes.multiplier[row, i]
            lanes.multiplier[row, i] = select(pace.done[i], g, g + lanes.f[row, i])
    for i in range(lanes.f.shape[1]):
        pace.done[i] = pace.done[i] | pace.last[i]
