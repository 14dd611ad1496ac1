"""The equations of points in guides, and the derivatives of these and of ties."""

from ...kernel.jit import outlined
from ...kernel.vector import Vec, dot
from .contacts import point_of


@outlined
def turn(body, chain, lanes, i, r1):
    """Directions of guides: the discrete gradient of each gap from the start of the stage to r1."""
    tied, touching = body
    for g in range(touching.guides):
        k, row = touching.points + g, tied.ends.shape[0] + g
        y0, y1 = point_of(touching, lanes.ra, k, i), point_of(touching, r1, k, i)
        n = chain.step_normal(float(touching.walls + g), y0, y1)
        lanes.d[row, 0, i], lanes.d[row, 1, i], lanes.d[row, 2, i] = n.x, n.y, n.z


@outlined
def guide(body, chain, lanes, pace, i):
    """The equations of the guides of a lane: D.(q1 - q0) + gap of q0 = 0."""
    tied, touching = body
    count = tied.ends.shape[0]
    half = 0.5 * pace.h[i] * pace.h[i]
    for g in range(touching.guides):
        k, row, wall = touching.points + g, count + g, float(touching.walls + g)
        y0, y1 = point_of(touching, lanes.ra, k, i), point_of(touching, lanes.r1, k, i)
        n = chain.unit_normal(wall, y1)
        lanes.y1[row, 0, i], lanes.y1[row, 1, i], lanes.y1[row, 2, i] = n.x, n.y, n.z
        lanes.f[row, i] = dot(vector_of(lanes.d, row, i), y1 - y0) + chain.distance(wall, y0)
        for other in range(tied.start[row], row + 1):
            c = half * tied.couplings[row + touching.points, name_of(body, other)]
            lanes.a[row, other, i] = c * dot(n, vector_of(lanes.d, other, i))
            if other < row:
                lanes.a[other, row, i] = c * dot(slope_of(tied, lanes, other, i), vector_of(lanes.d, row, i))


def vector_of(y, row, i):
    """The vector of a tie or guide."""
    return Vec(y[row, 0, i], y[row, 1, i], y[row, 2, i])


def name_of(body, row):
    """The row of a tie or guide among all couplings."""
    tied, touching = body
    return row if row < tied.ends.shape[0] else row + touching.points


def slope_of(tied, lanes, row, i):
    """The derivative of the equation of a tie, |y1|^2, or guide by its end."""
    return (2.0 if row < tied.ends.shape[0] else 1.0) * vector_of(lanes.y1, row, i)


def worst(touching, lanes, pace, rule, i):
    """How far ties and guides are from their equations: the worst, in units of round-off."""
    error = pace.error[i] / rule.noise
    count = lanes.f.shape[0] - touching.guides
    for g in range(touching.guides):
        error = max(error, abs(lanes.f[count + g, i]) / rule.room)
    return error
