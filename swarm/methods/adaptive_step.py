"""The steps of `AugmentedLagrangian`: of fixed length (None), or cut at the instant of impact (`Adaptive`).

Each function here has one definition for either: how a flight ends, how long its contact step is, whether another wall
has a part in it, and the exact impacts that replace it.
"""

import math
from typing import NamedTuple

from ..contact import regularisation as law_of
from ..contact import uzawa
from ..contact.discrete_gradient import nested
from ..contact.reflection import chord, exact
from ..contact.sliding import impact
from ..kernel.gravity import displacement
from ..kernel.jit import by_type, by_type_outlined, outlined, select
from ..status import Status
from ..surfaces import chain as walls
from ..surfaces import flights
from . import base, fixed_step

# Exact impacts within one step that replace a contact; a step of this many is stuck in a corner.
_SAME_INSTANT = 1e-6
_MOST_BOUNCES = 1000
# A |v|^2 that is off its first value by more than this has lost energy to a tolerance, which is not to be hidden.
_ROUND_OFF = 1e-13


class Adaptive(NamedTuple):
    """Chooses steps that are cut at the impact."""

    shortest_length: float  # of the flights of particles that graze where a step is not possible


@by_type
def flight(adaptive, method, chain, gravity, x, y, z, vx, vy, vz, left):
    """`base.flight` to the start of the next contact step."""
    raise NotImplementedError


@flight.register(type(None))
def _(adaptive, method, chain, gravity, x, y, z, vx, vy, vz, left):
    x, y, z, vx, vy, vz, left = fixed_step.free_steps(chain, gravity, method.dt, x, y, z, vx, vy, vz, left)
    px, py, pz = displacement(gravity, vx, vy, vz, method.dt)
    surface, count = walls.touched(chain, x, y, z, px, py, pz)
    surface = select((count > 1.0) | nested(method.form), base.HARD - surface, surface)
    jumps = fixed_step.too_fast(method.longest, px, py, pz)
    surface = select(jumps, base.HARD, surface)
    touched = (left > 0.0) & ((count > 0.0) | jumps)
    return x, y, z, vx, vy, vz, left, select(touched, surface, -1.0)


@flight.register(Adaptive)
def _(adaptive, method, chain, gravity, x, y, z, vx, vy, vz, left):
    time, surface = flights.first_hit(chain, None, x, y, z, vx, vy, vz)
    hit = time <= left
    t = select(hit, time, left)
    x, y, z = x + t * vx, y + t * vy, z + t * vz
    sx, sy, sz = walls.settle(chain, surface, x, y, z)
    hit = hit & (surface >= 0.0)
    surface = select(nested(method.form), base.HARD - surface, surface)
    # A hit in the last instant of a frame is met again in the next one.
    hit = hit & (left - t > 0.0)
    x, y, z = select(hit, sx, x), select(hit, sy, y), select(hit, sz, z)
    return x, y, z, vx, vy, vz, left - t, select(hit, surface, -1.0)


@by_type
def step_of(adaptive, method, left):
    """Length of the contact step, the same in the unit of `left`, and the regularisation."""
    raise NotImplementedError


@step_of.register(type(None))
def _(adaptive, method, left):
    return method.dt, 1.0, method.law


@step_of.register(Adaptive)
def _(adaptive, method, left):
    # The loop's rate depends on alpha h^2, its fixed point does not: a step cut short by the frame gets a larger alpha.
    dt = method.dt
    h = select(dt < left, dt, left)
    part = dt / h
    return h, h, law_of.stiffened(method.law, part * part)


@by_type
def is_new(adaptive, chain, x, y, z):
    """Whether a contact step starts with an impact."""
    raise NotImplementedError


@is_new.register(type(None))
def _(adaptive, chain, x, y, z):
    return not walls.outside(chain, -1.0, x, y, z)


@is_new.register(Adaptive)
def _(adaptive, chain, x, y, z):
    return True


@by_type
def is_alone(adaptive, chain, gravity, surface, x, y, z, x1, y1, z1, h, kappa):
    """Whether no other wall has a part in the step, which then one lane can do alone."""
    raise NotImplementedError


@is_alone.register(type(None))
def _(adaptive, chain, gravity, surface, x, y, z, x1, y1, z1, h, kappa):
    return not walls.outside(chain, surface, x1, y1, z1)


@is_alone.register(Adaptive)
def _(adaptive, chain, gravity, surface, x, y, z, x1, y1, z1, h, kappa):
    # Fixed steps look at their ends only; these follow the chord. A solid that it passes by (kappa = 0, the free flight
    # ends outside again) was hit all the same.
    cut, _other = flights.other_hit(chain, surface, x, y, z, x1 - x, y1 - y, z1 - z)
    return (cut > 1.0) & (kappa != 0.0)


@by_type
def is_blocked(adaptive, law, chain, surface, x, y, z, px, py, pz):
    """Whether the chord on `surface` meets another wall later in the step, or passes a solid by."""
    return False


@is_blocked.register(Adaptive)
def _(adaptive, law, chain, surface, x, y, z, px, py, pz):
    kappa = chord(chain, surface, x, y, z, px, py, pz)
    x1, y1, z1 = walls.push(chain, surface, x, y, z, px, py, pz, kappa)
    cut, other = flights.other_hit(chain, surface, x, y, z, x1 - x, y1 - y, z1 - z)
    # Another wall that the particle is on as well takes part in the loop; one that is a little away is met later.
    later = cut <= 1.0 and not uzawa.has_limit(chain, other, law, x, y, z)
    later = later or uzawa.meets_later(chain, surface, law, x, y, z, px, py, pz)
    return not walls.pushes(chain, surface, kappa) or kappa == 0.0 or later


@by_type_outlined
def as_impacts(adaptive, chain, x, y, z, vx, vy, vz, left, h, used, k0, energy, surface, impulse, lane):
    """The contact as exact impacts: the result of `hard_pass`."""
    raise NotImplementedError


@as_impacts.register(Adaptive)
def _(adaptive, chain, x, y, z, vx, vy, vz, left, h, used, k0, energy, surface, impulse, lane):
    speed2 = _first_speed2(energy, vx, vy, vz)
    shortest = adaptive.shortest_length / math.sqrt(speed2)
    touch = _SAME_INSTANT * adaptive.shortest_length
    x, y, z, vx, vy, vz, used, _energy = impact(
        None, None, chain, None, surface, x, y, z, vx, vy, vz, left,
        speed2, 0.5 / speed2, shortest, touch, impulse, lane,
    )  # fmt: skip
    return x, y, z, vx, vy, vz, left - used, 1.0, k0, Status.DONE.value


@as_impacts.register(type(None))
def _(adaptive, chain, x, y, z, vx, vy, vz, left, h, used, k0, energy, surface, impulse, lane):
    speed2 = _first_speed2(energy, vx, vy, vz)
    remaining, hits = h, 0.0
    for _i in range(_MOST_BOUNCES):
        time, wall = flights.first_hit(chain, None, x, y, z, vx, vy, vz)
        t = min(time, remaining)
        x, y, z, remaining = x + t * vx, y + t * vy, z + t * vz, remaining - t
        if not time < math.inf or remaining <= 0.0:
            return x, y, z, vx, vy, vz, left - used, hits, k0, Status.DONE.value
        if wall < 0.0:
            continue
        vx, vy, vz, given, _energy = exact(None, chain, None, wall, x, y, z, vx, vy, vz, speed2, 0.5 / speed2)
        impulse[int(wall), lane] += given
        hits += 1.0
    return x, y, z, vx, vy, vz, left, hits, k0, Status.STALLED.value


@outlined
def _first_speed2(energy, vx, vy, vz):
    """|v|^2 at the start of the run, if it is that up to round-off, else |v|^2 now."""
    now = vx * vx + vy * vy + vz * vz
    return 2.0 * energy if abs(2.0 * energy - now) <= _ROUND_OFF * now else now
