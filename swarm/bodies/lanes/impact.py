"""Blows: the impulses of the walls at one instant, which reverse the motion of a body."""

import math
from typing import Any

import numpy as np

from ...kernel.arrays import scratch
from ...kernel.jit import Array, outlined
from ...kernel.limits import ENERGY_OF_IMPACT, EPSILON
from ...kernel.record import Record
from ...kernel.vector import column, dot, put, square
from ...lanes.watching.log import Struck
from ...surfaces.periodic.period import into
from .contacts import MOST_CONTACTS, direction, missing, sweep

# The most blows at one instant; the most sweeps over the contacts of a blow, and the relative change of their impulses
# that ends the sweeps.
_BLOWS, SWEEPS = 200, (2000, 1e-17)
# After this number of short steps from impact to impact, a wall that takes energy takes all of the normal velocity.
_CHATTER = 12
# A step from impact to impact below this part of a whole step is a bounce on the way to rest.
SHORT = 1.0 / 16.0


def chatters(touching, state, number):
    """Whether bounces follow one another ever faster, and are to end."""
    laws = touching.laws
    loses = laws is not None and (laws.may_dissipate or laws.thermal is not None)
    return state.short[number] > _CHATTER and (loses or min(touching.restitution) < 1.0)


def is_absorbed(state, number):
    """Whether a wall has absorbed a body."""
    return state.absorbed_wall is not None and state.absorbed_wall[number] >= 0


@outlined
def restore(bodies, state, i):
    """Restore the energy of a body after a blow if only round-off is missing; any more is an error that must show.

    Steps lose or gain 1.5e-16 of the energy and blows 3e-16, at random: 3e-12 after 10^5 impacts. All velocities are
    scaled, so that links keep their lengths.
    """
    ties, r, v, number = bodies.ties, bodies.lanes.r, bodies.lanes.v, bodies.pace.body[i]
    kinetic, fall, elastic = kinetic_of(ties, v, i), 0.0, _stretched(ties, r, i)
    for p in range(ties.mass.shape[0]):
        mass = 0.0
        for q in range(ties.mass.shape[0]):
            mass += ties.mass[p, q]
        for x in range(3):
            fall -= mass * bodies.rule.gravity[x] * r[3 * p + x, i]
    lost = state.energy[number] + state.work[number] - state.dissipated[number] - (kinetic + fall + elastic)
    if abs(lost) <= ENERGY_OF_IMPACT * (kinetic + abs(fall) + elastic) and kinetic > 0.0:
        # The correction is of first order only, as a body at rest has no velocity to scale.
        factor = 0.5 * lost / kinetic
        if factor * factor <= EPSILON:
            for row in range(v.shape[0]):
                v[row, i] += factor * v[row, i]


def _stretched(ties, r, i):
    """The energy of springs of a lane."""
    total = 0.0
    for a in range(ties.links, ties.ends.shape[0]):
        y = column(r, 3 * ties.ends[a, 0], i) - column(r, 3 * ties.ends[a, 1], i)
        longer = math.sqrt(square(y)) - ties.rest[a]
        total += 0.5 * ties.stiffness[a] * longer * longer
    return total


def kinetic_of(ties, v, i):
    """The kinetic energy of a lane."""
    total = 0.0
    for p in range(ties.mass.shape[0]):
        for q in range(ties.mass.shape[0]):
            m = ties.mass[p, q]
            if m != 0.0:
                total += 0.5 * m * dot(column(v, 3 * p, i), column(v, 3 * q, i))
    return total


@outlined
def strike(bodies, state, i):
    """Carry out the blows at one instant, until no contact at its wall approaches it; return their number.

    At a wall without friction v+ = v- - (1 + e) (n.v)/(n K n) K n, where K is the inverse mass that links and guides
    leave: K = W - W J (J W J)^-1 J W with a row of J for each. This is the contact step of the scheme for h -> 0.
    """
    name = scratch((MOST_CONTACTS, 2), np.int64)
    frame = scratch((MOST_CONTACTS, 3, 3), np.float64)
    for turn in range(_BLOWS):
        found = bodies.near(i, name, frame, True)
        if found == 0 or is_absorbed(state, bodies.pace.body[i]):
            return turn
        if not bodies.send_off(state, name, frame, found, i) and not _blow(bodies, state, name, frame, found, i):
            return turn
    return _BLOWS


@outlined
def _blow(bodies, state, name, frame, found, i):
    """Carry out one blow at all these contacts; return whether any wall pushes."""
    ties, touching, v, number = bodies.ties, bodies.touching, bodies.lanes.v, bodies.pace.body[i]
    bounces = 0.0 if chatters(touching, state, number) else 1.0
    m, wide = ties.links + touching.guides, touching.width(name, found)
    rows = wide * found
    lost, elastic = 0.0, bounces == 1.0 and not touching.dissipate(name, found)
    blow = body_impact(bodies, name, frame, (wide, found), i)
    rate, wanted, p = scratch(rows, np.float64), scratch(rows, np.float64), scratch(rows, np.float64)
    for a in range(rows):
        rate[a] = blow.rate(a, i)
        # The velocity strains links by the order of the scheme; the part of the rate that this causes is left out.
        for row in range(m):
            rate[a] -= blow.answer[a, row] * dot(column(blow.across, 0, row), blow.between(v, row, i))
        # w+ = -e w- where a wall pushes.
        bounced = bounces * touching.restitution[name[a // wide, 1]] if a % wide == 0 else 0.0
        wanted[a] = (1.0 + bounced) * rate[a]
    sweep(touching, (name, p, wide, wide), blow.schur, wanted, p, SWEEPS)
    if max(p) == 0.0:
        return False
    against = scratch(m, np.float64)
    if not elastic:
        # Strains of links would lose their energy in the next short step, which reverses them.
        lost += blow.strain(scratch(m, np.float64), against, i)
        lost = blow.taken(lost, rate, p)
    before = scratch((3, found), np.float64)
    if state.watchers.log is not None:
        for a in range(found):
            put(before, 0, a, touching.place(v, name[a, 0], i))
    state.work[number] += blow.push(state, p, against, lost, i)
    state.dissipated[number] += lost
    for a in range(found):
        state.impulse[bodies.walls.row(float(name[a, 1])), number] += p[wide * a]
        if p[wide * a] > 0.0:
            blow.tell(state, a, column(before, 0, a), p[wide * a], i)
    return True


def body_impact(bodies, name, frame, size, i):
    """Return the `BodyImpact` of contacts; `size` is the number of directions of each contact, and of contacts."""
    wide, found = size
    m, rows = bodies.ties.links + bodies.touching.guides, wide * found
    blow = BodyImpact(
        bodies, name, frame, wide, scratch((3, m), np.float64), scratch((m, m), np.float64),
        scratch((rows, m), np.float64), scratch((rows, rows), np.float64),
    )  # fmt: skip
    blow.hold(i)
    blow.respond()
    return blow


class BodyImpact(Record):
    """One blow: its contacts, the links and guides that it strains, and the responses of velocities to impulses."""

    bodies: Any
    name: Array
    frame: Array
    wide: int  # directions of each contact
    across: Array  # (3, m) the vector of every link and guide
    system: Array  # (m, m) the Cholesky factor of J W J
    answer: Array  # (rows, m) x = (J W J)^-1 J W b d of each direction d
    schur: Array  # (rows, rows) n K n

    def direction(self, a):
        """The direction of row a."""
        return direction(self.frame, a // self.wide, a % self.wide)

    def rate(self, a, i):
        """The velocity of the contact of row a along its direction, relative to the wall."""
        k, wall, bodies = self.name[a // self.wide, 0], self.name[a // self.wide, 1], self.bodies
        u = bodies.touching.place(bodies.lanes.v, k, i)
        if bodies.walls_move():
            u = bodies.slip(bodies.walls_now(i), wall, bodies.spot(bodies.lanes.r, k, i), u)
        return dot(self.direction(a), u)

    def unstrained_rate(self, a, strain, i):
        """The velocity of `rate` after links and guides have removed their strains, the rates J v."""
        rate = self.rate(a, i)
        for row in range(strain.size):
            rate -= self.answer[a, row] * strain[row]
        return rate

    def taken(self, lost, rate, p):
        """The energy `lost` by strains plus that taken by impulses: p times the mean of the rates before and after."""
        for a in range(p.size):
            lost += 0.5 * p[a] * (rate[a] + missing(self.schur, a, rate[a], p))
        return lost

    def push(self, state, p, against, lost, i):
        """Apply impulses of walls, links and guides; return the work of walls and of led points.

        The work of led points is the change of the kinetic energy plus `lost`.
        """
        ties, v = self.bodies.ties, self.bodies.lanes.v
        is_led = max(ties.led) >= 0
        before = kinetic_of(ties, v, i) if is_led else 0.0
        work = self.work(state, p, i)
        self.give(p, against, i)
        return (kinetic_of(ties, v, i) - before) + lost if is_led else work

    def work(self, state, p, i):
        """Book the work of each moving wall by these impulses, which are against the directions; return its sum."""
        total, bodies = 0.0, self.bodies
        if state.wall_work is not None:
            walls, number = bodies.walls_now(i), bodies.pace.body[i]
            for a in range(p.size):
                k, wall = self.name[a // self.wide, 0], float(self.name[a // self.wide, 1])
                u = walls.velocity(wall, bodies.spot(bodies.lanes.r, k, i))
                work = -p[a] * dot(self.direction(a), u)
                state.wall_work[bodies.walls.row(wall), number] += work
                total += work
        return total

    def tell(self, state, a, before, impulse, i):
        """Count the impact at contact a, with the velocity `before`, and show it to the watchers."""
        state.impacts[self.bodies.pace.body[i]] += 1
        # Watchers see no cavity that a point carries.
        if self.name[a, 1] < self.bodies.touching.walls:
            state.watchers.hit(state.image, self.struck(a, before, impulse, i))

    def struck(self, a, before, impulse, i):
        """Return the `Struck` of contact a, with the velocity `before`."""
        bodies, (k, wall) = self.bodies, (self.name[a, 0], self.name[a, 1])
        c, u = bodies.spot(bodies.lanes.r, k, i), bodies.touching.place(bodies.lanes.v, k, i)
        images = into(bodies.rule.period, bodies.touching.place(bodies.lanes.r, k, i)).images
        n, slip = self.direction(self.wide * a), bodies.slip(bodies.walls_now(i), wall, c, before)
        time = bodies.rule.end - bodies.pace.remaining[i]
        return Struck(
            bodies.pace.body[i], float(wall), time, c, before, u, impulse, slip - dot(slip, n) * n, images=images
        )  # fmt: skip

    def coupling(self, row):
        """The row of a link or guide among all couplings."""
        ties = self.bodies.ties
        return row if row < ties.links else row - ties.links + ties.ends.shape[0] + self.bodies.touching.points

    def contact(self, a):
        """The row of the contact of a direction among all couplings."""
        return self.bodies.ties.ends.shape[0] + self.name[a // self.wide, 0]

    def between(self, r, row, i):
        """The vector between the ends of a link, or the place of a guided point."""
        ties, touching = self.bodies.ties, self.bodies.touching
        if row >= ties.links:
            return touching.place(r, touching.points + row - ties.links, i)
        return column(r, 3 * ties.ends[row, 0], i) - column(r, 3 * ties.ends[row, 1], i)

    def hold(self, i):
        """Compute the vector of every link and guide, and the Cholesky factor of J W J."""
        bodies, system = self.bodies, self.system
        ties, touching = bodies.ties, bodies.touching
        for a in range(system.shape[0]):
            y = self.between(bodies.lanes.r, a, i)
            if a >= ties.links:
                y = bodies.walls_now(i).unit_normal(float(touching.walls + a - ties.links), y)
            put(self.across, 0, a, y)
            for b in range(a + 1):
                s = ties.couplings[self.coupling(a), self.coupling(b)] * dot(y, column(self.across, 0, b))
                for k in range(b):
                    s -= system[a, k] * system[b, k]
                system[a, b] = s / system[b, b] if b < a else math.sqrt(s)

    def respond(self):
        """Compute the Delassus matrix: the responses of the velocities of contacts to impulses at them."""
        couplings, system, answer, schur = self.bodies.ties.couplings, self.system, self.answer, self.schur
        rows, m = answer.shape
        for a in range(rows):
            d = self.direction(a)
            for row in range(m):
                s = couplings[self.contact(a), self.coupling(row)] * dot(column(self.across, 0, row), d)
                for k in range(row):
                    s -= system[row, k] * answer[a, k]
                answer[a, row] = s / system[row, row]
            for b in range(a + 1):
                s = couplings[self.contact(a), self.contact(b)] * dot(d, self.direction(b))
                for row in range(m):
                    s -= answer[a, row] * answer[b, row]
                schur[a, b] = schur[b, a] = s
        for a in range(rows):
            for row in range(m - 1, -1, -1):
                for j in range(row + 1, m):
                    answer[a, row] -= system[j, row] * answer[a, j]
                answer[a, row] /= system[row, row]

    def strain(self, rate, against, i):
        """Compute the rates J v of links and guides and the impulses -(J W J)^-1 J v; return the energy they take.

        Velocities keep rates of the order of the scheme, as a step reverses them.
        """
        m, system = rate.size, self.system
        for row in range(m):
            rate[row] = dot(column(self.across, 0, row), self.between(self.bodies.lanes.v, row, i))
            against[row] = -rate[row]
            for k in range(row):
                against[row] -= system[row, k] * against[k]
            against[row] /= system[row, row]
        lost = 0.0
        for row in range(m - 1, -1, -1):
            for k in range(row + 1, m):
                against[row] -= system[k, row] * against[k]
            against[row] /= system[row, row]
            lost -= 0.5 * against[row] * rate[row]
        return lost

    def give(self, p, against, i):
        """Compute v -= W (sum p (b d - sum x J) - sum against J); `against` is overwritten."""
        ties, touching, v = self.bodies.ties, self.bodies.touching, self.bodies.lanes.v
        m, points = self.answer.shape[1], v.shape[0] // 3
        push = scratch((3, points), np.float64)
        for a in range(p.size):
            for q in range(points):
                g = p[a] * touching.reach[self.name[a // self.wide, 0], q]
                put(push, 0, q, column(push, 0, q) + g * self.direction(a))
            for row in range(m):
                against[row] += p[a] * self.answer[a, row]
        for row in range(m):
            for q in range(points):
                if row < ties.links:
                    w = ties.inverse_mass[q, ties.ends[row, 0]] - ties.inverse_mass[q, ties.ends[row, 1]]
                else:
                    w = touching.reach[touching.points + row - ties.links, q]
                put(push, 0, q, column(push, 0, q) - against[row] * w * column(self.across, 0, row))
        for q in range(points):
            put(v, 3 * q, i, column(v, 3 * q, i) - column(push, 0, q))
