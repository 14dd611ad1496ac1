"""The contacts of a body: the walls that its points can meet, the contacts at walls, and their effect on ties.

Contacts with rigid walls are in persistent_contact.py, contacts with soft walls in penalty_contact.py.
"""

import math

from ...kernel.jit import outlined
from ...kernel.limits import EPSILON
from ...kernel.vector import Vec, column, cross, dot, norm, put
from ...surfaces.periodic.period import moved_into
from .constraints import Constrained
from .passages import BEHIND, OUT
from .through import WayThrough, have_ends, is_of_ends, passed

# The distance at which a contact is at its wall, in units of round-off.
NEAR = 64.0
# The most contacts of a blow; more contacts follow in the next blow at the same instant.
MOST_CONTACTS = 16
# The distance outside at which a lasting contact may end, in units of round-off.
ROOM = 64.0
# The distance outside of a wall with edges at which a contact point is behind it, in units of round-off.
_AT = 4.0 * ROOM


class BodyContacts(Constrained):
    """The contacts of a pass; there is one class for each kind of walls."""

    def begin(self, i):
        """Set the contacts of a lane at the start of a trial, and their first forces."""
        raise NotImplementedError

    def turn(self, i, r1):
        """Set the directions of contacts of a lane: discrete gradients of gaps from the start of the stage to r1."""
        raise NotImplementedError

    def correct(self, i, number):
        """Correct the forces of contacts, and f, the corrections of ties and guides; set `pace.last`."""
        raise NotImplementedError

    def gap_gradient(self, wall, y, i):
        """The gradient of the gap that the contacts solve for, at the end of the stage."""
        raise NotImplementedError

    def begin_loop(self):
        """Begin Uzawa's loop of a stage in all lanes."""

    def again(self):
        """Update the multipliers of lanes with a loop that goes on; return their number. Others end the stage."""
        return 0

    def judge(self, i):
        """Return the action of a lane after a trial that ends outside, has no solution, or seeks a time of impact."""
        raise NotImplementedError

    def end(self, state, i):
        """Book the impulses of the walls in a step, and set whether contacts last."""
        raise NotImplementedError

    def strike(self, state, i):
        """Carry out an impact at this instant; contacts may last from there on."""
        raise NotImplementedError

    def send_off(self, state, name, frame, found, i):
        """Send a body off by a law of a wall at one of these approaching contacts; return whether a law acts."""
        return False

    # --- In a periodic cell

    def in_cell(self, k, c, by):
        """A place of contact point k, moved by the shift that brings `by` into the cell, where the walls are."""
        if self.rule.period is None:
            return c
        return c if k >= self.touching.points else moved_into(self.rule.period, c, by)

    def spot(self, r, k, i):
        """The place of contact point k of a lane among the walls, moved into the cell as at the start of the step."""
        c = self.touching.place(r, k, i)
        if self.rule.period is None:
            return c
        return self.in_cell(k, c, self.touching.place(self.lanes.r, k, i))

    # --- In a stage

    def push(self, i):
        """Add the forces of guides and contacts to the deceleration."""
        touching, lanes, active = self.touching, self.lanes, self.active
        points = lanes.force.shape[0] // 3
        for g in range(touching.guides):
            row = self.ties.ends.shape[0] + g
            for q in range(points):
                f = lanes.multiplier[row, i] * touching.reach[touching.points + g, q]
                put(lanes.force, 3 * q, i, column(lanes.force, 3 * q, i) + f * column(lanes.d, 3 * row, i))
        for a in range(self.pace.active[i]):
            k = active.name[i, a, 0]
            for d in range(3):
                p = active.press[i, 3 * a + d]
                if p != 0.0:
                    for q in range(points):
                        f = p * touching.reach[k, q] * direction(active.frame[i], a, d)
                        put(lanes.force, 3 * q, i, column(lanes.force, 3 * q, i) + f)

    def eliminate(self, wide, systems, i):
        """Eliminate ties and guides: compute schur, and gap minus the effect of their corrections."""
        along, across, schur, gap = systems
        ties, lanes, name, frame = self.ties, self.lanes, self.active.name[i], self.active.frame[i]
        m, rows, count = lanes.f.shape[0], schur.shape[0], ties.ends.shape[0]
        half = 0.5 * self.pace.h[i] * self.pace.h[i]
        for a in range(rows):
            k, wall, d = name[a // wide, 0], name[a // wide, 1], direction(frame, a // wide, a % wide)
            e = d
            if a % wide == 0:
                e = self.gap_gradient(float(wall), self.spot(lanes.r1, k, i), i)
            for row in range(m):
                c = half * ties.couplings[count + k, self.coupling(row)]
                along[a, row] = c * dot(e, column(lanes.d, 3 * row, i))
                across[a, row] = c * dot(self.slope(row, i), d)
                gap[a] -= along[a, row] * lanes.f[row, i]
            _substitute(ties.start, lanes.a, across, a, i)
            for b in range(rows):
                c = half * ties.couplings[count + k, count + name[b // wide, 0]]
                schur[a, b] = c * dot(e, direction(frame, b // wide, b % wide))
        for a in range(rows):
            for b in range(rows):
                for row in range(m):
                    schur[a, b] -= along[a, row] * across[b, row]

    def book(self, i):
        """Book the impulses of the walls, and the work of friction, in the stage."""
        touching, lanes, active = self.touching, self.lanes, self.active
        for a in range(self.pace.active[i]):
            k, press, frame = active.name[i, a, 0], active.press[i, 3 * a], active.frame[i]
            active.stages[i, a] += 1 if press > 0.0 else 0
            active.impulse[i, a] += self.pace.h[i] * press * norm(direction(frame, a, 0))
            y0, y1 = self.spot(lanes.ra, k, i), self.spot(lanes.r1, k, i)
            away = y1 - y0
            if self.walls_move():
                carried, moved = self.carried(active.name[i, a, 1], y0, y1, i)
                work = -press * dot(direction(frame, a, 0), moved)
                for d in range(1, 3):
                    work -= active.press[i, 3 * a + d] * dot(direction(frame, a, d), carried)
                active.work[i, a] += work
                self.pace.work[i] += work
                along, away = away - carried, away - moved
            else:
                along = away
            for d in range(1, 3):
                active.lost[i] += active.press[i, 3 * a + d] * dot(direction(frame, a, d), along)
            # The work of a force over the round-off of a gap counts as lost; over more it is an error that must show.
            closer = dot(direction(frame, a, 0), away)
            if touching.dissipates(active.name[i, a, 1]) and abs(closer) <= 2.0 * ROOM * self.rule.room:
                active.lost[i] += press * closer

    def carried(self, wall, y0, y1, i):
        """The displacement in the stage of the material of a wall at a contact, and of its surface."""
        over, h = self.walls_between(i), self.pace.h[i]
        return over.carry(float(wall), y0) - y0, h * over.mean_velocity(float(wall), y0, y1, h)

    def slip(self, walls, wall, c, u):
        """The velocity of a contact at a place, relative to its wall."""
        return u - walls.velocity(float(wall), c) if self.walls_move() else u

    def fastest(self, u, slip):
        """The speed that sets the round-off of a velocity relative to a wall."""
        return norm(u) + norm(slip) if self.walls_move() else norm(u)

    def is_mixed(self, i):
        """Whether a contact pushed only in some stages of a composed step, which does not conserve energy."""
        mixed = False
        for a in range(self.pace.active[i]):
            mixed = mixed or 0 < self.active.stages[i, a] < self.rule.stages.size
        return mixed

    def forget(self, i):
        """Reset the books of a trial."""
        active = self.active
        active.lost[i] = 0.0
        for a in range(active.name.shape[1]):
            active.impulse[i, a], active.work[i, a], active.stages[i, a] = 0.0, 0.0, 0

    # --- At openings

    def is_free(self, k, i):
        """Whether a contact point of a lane has left the walls through an opening."""
        if self.passages is None:
            return False
        number = self.pace.body[i]
        return number >= 0 and k < self.touching.points and self.passages.free[k, number] > 0

    def _passes(self, walls, contact, c, i):
        """Let the point of a contact (point, wall) pass if the wall is open at its place; return whether it is."""
        if self.passages is None:
            return False
        k, wall = contact
        if k >= self.touching.points or not self.passages.takes(walls, float(wall), c, NEAR * self.rule.room):
            return False
        ends = is_of_ends(walls, float(wall))
        self.passages.free[k, self.pace.body[i]] = BEHIND if ends else OUT
        return True

    def is_back(self, k, i):
        """Whether a free point is inside of all walls again, or at a wall that is not open there."""
        walls, room = self.walls_now(i), self.rule.room
        back = self.passages.free[k, self.pace.body[i]] != BEHIND
        c, met = self.spot(self.lanes.r, k, i), self.touching.span(k)
        for j in range(count_at(walls, met, c)):
            w = float(wall_at(walls, met, j, c))
            gap = walls.distance(w, c)
            if gap >= -2.0 * NEAR * room:
                back = back and gap <= 2.0 * ROOM * room and not self.passages.takes(walls, w, c, NEAR * room)
        return back

    # --- At walls with edges

    def passed(self, k, c, room, i):
        """Return the `WayThrough` of a contact point that ends a trial at c, farther than `room` behind a wall."""
        if not have_ends(self.walls) or k >= self.touching.points:
            return WayThrough(math.inf, -1.0, -math.inf)
        start, limits = self.touching.place(self.lanes.r, k, i), (_AT * self.rule.room, room, 0.0)
        if self.rule.period is None:
            return passed(self.walls_now(i), self.walls_then(i), start, c, limits)
        # The walls on a way across a face of the cell are in the cell of its start, or in the cell of its end.
        found = WayThrough(math.inf, -1.0, -math.inf)
        for by in (start, c):
            ends = self.in_cell(k, start, by), self.in_cell(k, c, by)
            way = passed(self.walls_now(i), self.walls_then(i), *ends, limits)
            if way.time < found.time:
                found = way
        return found

    def come_back(self, i):
        """Mark the points behind walls with edges that come back through one of these walls in this step of a lane."""
        at, free, number = _AT * self.rule.room, self.passages.free, self.pace.body[i]
        for k in range(self.touching.points):
            if free[k, number] == BEHIND:
                start, end = self.spot(self.lanes.r, k, i), self.spot(self.lanes.r1, k, i)
                # The reversed way, so that a point that starts at a wall and leaves it inwards comes back through it.
                way = passed(self.walls_then(i), self.walls_now(i), end, start, (at, at, 2.0 * at))
                free[k, number] = OUT if way.wall >= 0.0 else BEHIND

    # --- At their walls

    def near(self, i, name, frame, approaching):
        """Find the contacts at their walls, or only approaching contacts; return their number.

        `name` gets point and wall, and `frame` a normal and two tangents of each contact.
        """
        touching, walls, found = self.touching, self.walls_now(i), 0
        for k in range(touching.plain.size):
            if self.is_free(k, i):
                continue
            c, u = self.spot(self.lanes.r, k, i), touching.place(self.lanes.v, k, i)
            met = touching.span(k)
            for j in range(count_at(walls, met, c)):
                w = wall_at(walls, met, j, c)
                at_wall = found < MOST_CONTACTS and walls.distance(float(w), c) >= -NEAR * self.rule.room
                if at_wall and not self._passes(walls, (k, w), c, i):
                    n, slip = walls.unit_normal(float(w), c), self.slip(walls, w, c, u)
                    # A velocity towards the wall of the size of round-off is no approach.
                    if not approaching or dot(n, slip) > 4.0 * EPSILON * self.fastest(u, slip):
                        name[found, 0], name[found, 1] = k, w
                        flat = Vec(1.0, 0.0, 0.0) if abs(n.x) < 0.6 else Vec(0.0, 1.0, 0.0)
                        t = cross(n, flat)
                        put_frame(frame, found, n, t / norm(t))
                        found += 1
        return found


# --- Walls that a point may meet -------------------------------------------------------------------------


def count_at(walls, span, c):
    """The number of walls of a span that a point may be at: in fields those of its cell, in unions of its room."""
    first, last = span
    fields, unions = walls.fields(), walls.joined()
    if (len(fields) == 0 and len(unions) == 0) or first > 0:
        return last - first
    found = last - int(walls.count_in_fields()) - sum(len(room) for rooms in unions for room in rooms)
    for _number, field in reversed(fields):
        found = int(field.members.count_in_cell(c)) + found
    for rooms in unions:
        found = int(walls.count_in_owner(rooms, c)) + found
    return found


def wall_at(walls, span, j, c):
    """The wall with the number j among the walls that a point may be at."""
    if (len(walls.fields()) == 0 and len(walls.unions) == 0) or span[0] > 0:
        return span[0] + j
    return _wall_of_cells(walls, j, c)


@outlined
def _wall_of_cells(walls, j, c):
    """The wall with the number j among those at a point, in a scene with fields or unions."""
    for number, field in walls.fields():
        here = int(field.members.count_in_cell(c))
        if j < here:
            return int(number) + int(field.members.one_in_cell(j, c))
        j = j - here
    for rooms in walls.joined():
        here = int(walls.count_in_owner(rooms, c))
        if j < here:
            return int(walls.first_in_owner(rooms, c)) + j
        j = j - here
    return int(walls.count_in_fields()) + j


# --- Small arrays of one lane ----------------------------------------------------------------------------


def direction(frame, a, d):
    """The direction d of contact a: its normal, or one of two tangents."""
    return Vec(frame[a, d, 0], frame[a, d, 1], frame[a, d, 2])


def put_direction(frame, a, d, n):
    """Store a direction of a contact."""
    frame[a, d, 0], frame[a, d, 1], frame[a, d, 2] = n.x, n.y, n.z


def put_frame(frame, a, n, t):
    """Store the normal n of a contact, the tangent t, and the other tangent."""
    put_direction(frame, a, 0, n)
    put_direction(frame, a, 1, t)
    put_direction(frame, a, 2, cross(n, t))


def missing(system, j, wanted, x):
    """Return wanted - (A x)_j."""
    for b in range(x.size):
        wanted -= system[j, b] * x[b]
    return wanted


def rubbing(system, j, errors, forces, most):
    """Return the tangential forces of the contact in row j after a step of Gauss-Seidel, of size at most `most`."""
    stiff = max(system[j + 1, j + 1], system[j + 2, j + 2])
    one, other = forces[0] + errors[0] / stiff, forces[1] + errors[1] / stiff
    length = math.sqrt(one * one + other * other)
    within = min(1.0, most / length) if length > 0.0 else 1.0
    return within * one, within * other


def sweep(touching, contacts, system, wanted, change, limits):
    """Find the forces of contacts by projected Gauss-Seidel.

    No contact ends outside, no contact pulls, and the friction of each is within its cone. The `change` of the forces
    solves the system, and may be the array of the forces. `contacts` are names, forces, and the numbers of forces and
    of rows of a contact. `limits` are the most sweeps, and the relative change of the forces that ends them.
    """
    name, force, stride, wide = contacts
    most, small = limits
    for _sweep in range(most):
        moved, size = 0.0, 0.0
        for a in range(wanted.size // wide):
            j, k, mu = wide * a, stride * a, touching.friction[name[a, 1]]
            new = max(0.0, force[k] + missing(system, j, wanted[j], change) / system[j, j])
            moved, size = max(moved, abs(new - force[k])), max(size, new)
            change[j] += new - force[k]
            force[k] = new
            if mu > 0.0:
                errors = missing(system, j + 1, wanted[j + 1], change), missing(system, j + 2, wanted[j + 2], change)
                one, other = rubbing(system, j, errors, (force[k + 1], force[k + 2]), mu * new)
                moved = max(moved, abs(one - force[k + 1]), abs(other - force[k + 2]))
                change[j + 1] += one - force[k + 1]
                change[j + 2] += other - force[k + 2]
                force[k + 1], force[k + 2] = one, other
        if moved <= small * size:
            break


def solve_dense(a, f):
    """Compute f = a^-1 f for a system with a positive symmetric part, but for factors of rows."""
    rows = f.shape[0]
    for k in range(rows):
        for row in range(k + 1, rows):
            part = a[row, k] / a[k, k]
            for other in range(k + 1, rows):
                a[row, other] -= part * a[k, other]
            f[row] -= part * f[k]
    for row in range(rows - 1, -1, -1):
        for other in range(row + 1, rows):
            f[row] -= a[row, other] * f[other]
        f[row] /= a[row, row]


def _substitute(start, a, x, k, i):
    """Compute x[k] = A^-1 x[k] with the factored system of a lane."""
    m = x.shape[1]
    for row in range(m):
        for j in range(start[row], row):
            x[k, row] -= a[row, j, i] * x[k, j]
    for row in range(m - 1, -1, -1):
        for j in range(row + 1, m):
            if start[j] <= row:
                x[k, row] -= a[row, j, i] * x[k, j]
        x[k, row] *= a[row, row, i]
