"""Contact steps on members of fields, on faces and in rooms, against a loop over balls and planes in plain NumPy."""

import math

import numpy as np
import pytest
from physics.billiards import places_outside

import swarm

pytestmark = pytest.mark.physics

STEP, UNTIL = 0.15, 5.0
NEVER = (math.inf, None)


# --- The loop: balls and convex polyhedra, each solid or a cavity --------------------------------------------


class Ball:
    """A ball, solid or a cavity; those of one vessel are a foam, or a union of rooms."""

    def __init__(self, center, radius, solid):
        self.center, self.radius, self.solid = np.array(center), radius, solid

    def times(self, r, v):
        """When a flight enters it and leaves it."""
        d = r - self.center
        a, b, c = v @ v, d @ v, d @ d - self.radius**2
        if b * b < a * c:
            return NEVER[0], -NEVER[0]
        root = math.sqrt(b * b - a * c)
        return (-b - root) / a, (-b + root) / a

    def normal(self, r, _met):
        return (r - self.center) / self.radius

    def slide(self, r, p, _met):
        """The chord q of a step with the free displacement p: q = p - kappa (2 a + q), |a + q| = |a|."""
        a = r - self.center
        kappa = (p @ (2.0 * a + p)) / (2.0 * a @ (2.0 * a + p))
        return (p - 2.0 * kappa * a) / (1.0 + kappa)

    def reaches(self, _r, _met):
        return True


class Polyhedron(Ball):
    """A convex polyhedron, normals n and offsets d: n.r <= d inside."""

    def __init__(self, normals, offsets, solid):
        self.normals, self.offsets, self.solid = np.array(normals), np.array(offsets), solid

    def by_face(self, r, v):
        approach, gap = self.normals @ v, self.offsets - self.normals @ r
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(approach < 0.0, gap / approach, -np.inf), np.where(approach > 0.0, gap / approach, np.inf)

    def times(self, r, v):
        enters, leaves = self.by_face(r, v)
        return (enters.max(), leaves.min()) if enters.max() <= leaves.min() else (NEVER[0], -NEVER[0])

    def face(self, r):
        return int(np.argmin(np.abs(self.normals @ r - self.offsets)))

    def normal(self, _r, met):
        return self.normals[met]

    def slide(self, _r, p, met):
        return p - (p @ self.normals[met]) * self.normals[met]

    def reaches(self, r, met):
        """Whether a place on the plane of a face is on the face."""
        return (np.delete(self.normals @ r - self.offsets, met) <= 1e-12).all()


def _met(r, v, solids, rooms):
    """The first hit of a flight."""
    first = NEVER
    for one in solids:
        enters, _leaves = one.times(r, v)
        if -1e-12 <= enters < first[0] and (one.normal(r, one.face(r + enters * v)) if isinstance(one, Polyhedron)
                                            else r + enters * v - one.center) @ v < -1e-12:  # fmt: skip
            first = max(enters, 0.0), one
    last = 0.0
    for _room in rooms:
        # It goes on in a room that holds it where it leaves another one.
        ends = [(leaves, one) for one in rooms for enters, leaves in [one.times(r, v)] if enters <= last + 1e-12]
        time, room = max(ends, key=lambda end: end[0])
        last = max(last, time)
    return first if first[0] < last else (last, room)


def billiard(r, v, step, solids, rooms, centred=False):
    """Place and velocity of a particle at the end, and how many of its impacts had a step."""
    left, steps, flown = UNTIL, [], 0.0
    while True:
        time, one = _met(r, v, solids, rooms)
        if time >= left:
            return r + left * v, v, steps
        r, left, flown = r + time * v, left - time, time
        met = one.face(r) if isinstance(one, Polyhedron) else None
        n = one.normal(r, met)
        h = min(step, left) if not centred else 2.0 * min(0.5 * step, flown, left)
        start = r - 0.5 * h * v if centred else r
        q = one.slide(start, h * v, met)
        # The step is a reflection about a vector along p - q.
        axis = h * v - q
        w = 2.0 * q / h - v
        opposed = np.linalg.norm(axis) > 1e-3 * h and (axis @ n > 0.0) == (not one.solid)
        others = [other for other in solids if other is not one]
        if centred:
            free = _met(r, w, solids, rooms)[0] > 0.5 * h
        else:
            free = all(not -1e-12 <= other.times(r, q)[0] <= 1.0 for other in others)
            free = free and (one in rooms or not rooms or max(room.times(r, q)[1] for room in rooms) > 1.0)
            free = free and one.reaches(r + q, met)
        if opposed and free:
            r, v, left = start + q, w, left - (0.5 * h if centred else h)
        else:
            v = v - 2.0 * (v @ n) * n
        steps.append(opposed and free)


# --- The scenes ----------------------------------------------------------------------------------------------

PLACES, RADII = [(0.4, 0.1, 0.0), (-0.45, -0.1, 0.1), (0.0, 0.5, -0.2), (0.1, 0.35, 0.2)], [0.25, 0.3, 0.2, 0.22]
BUBBLES, WIDTHS = [(-0.4, 0.0, 0.0), (0.3, 0.1, 0.0), (0.1, 0.6, 0.2)], [0.6, 0.5, 0.45]
CORNERS = np.array([(0.8, 0.0), (0.3, 0.75), (-0.6, 0.5), (-0.7, -0.4), (0.2, -0.8)])
VESSEL = swarm.Box((1.6, 1.6, 1.6))
CUBE = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]


def _prism_faces(half):
    along = np.roll(CORNERS, -1, axis=0) - CORNERS
    out = np.stack([along[:, 1], -along[:, 0]], axis=1) / np.linalg.norm(along, axis=1)[:, None]
    sides = [(*n, 0.0) for n in out]
    return [*sides, (0, 0, 1), (0, 0, -1)], [*(out * CORNERS).sum(axis=1), half, half]


def _mesh(half, side):
    k = len(CORNERS)
    points = [(*corner, z) for z in (-half, half) for corner in CORNERS]
    around = [three for i in range(k) for j in [(i + 1) % k] for three in ((i, j, k + j), (i, k + j, k + i))]
    caps = [three for i in range(1, k - 1) for three in ((0, i + 1, i), (k, k + i, k + i + 1))]
    return swarm.Mesh(np.array(points), [*around, *caps], side)


def scenes():
    vessel = Polyhedron(CUBE, [1.6] * 6, False)
    (normals, offsets), sides = _prism_faces(0.7), len(CORNERS)
    faces, beyond = Polyhedron(normals, offsets, False), Polyhedron(normals, offsets, True)
    column = Polyhedron(normals[:sides], offsets[:sides], True)
    rooms = [Ball(*one, False) for one in zip(BUBBLES, WIDTHS, strict=True)]
    return {
        "field": ([swarm.Spheres(PLACES, RADII), swarm.Sphere(1.3)],
                  [Ball(*one, True) for one in zip(PLACES, RADII, strict=True)], [Ball((0.0, 0.0, 0.0), 1.3, False)]),
        "foam": ([swarm.Spheres(BUBBLES, WIDTHS, side="inside")], [], rooms),
        "union": ([swarm.Union([swarm.Sphere(w, c) for c, w in zip(BUBBLES, WIDTHS, strict=True)])], [], rooms),
        "prism": ([swarm.Prism(CORNERS, 1.4)], [], [faces]),
        "mesh": ([_mesh(0.7, "inside")], [], [faces]),
        "solid polygon": ([swarm.Polygon(CORNERS, side="outside"), VESSEL], [column], [vessel]),
        "solid mesh": ([_mesh(0.7, "outside"), VESSEL], [beyond], [vessel]),
    }  # fmt: skip


def loop_of_multipliers(start):
    return swarm.AugmentedLagrangian(
        STEP, 1e4, adaptive=True, acceleration="reflection", tolerance=1e-28, max_sweeps=200, contact_start=start
    )


METHODS = {
    "Impact": lambda start: swarm.Impact(contact_step=STEP, contact_start=start),
    "AugmentedLagrangian": loop_of_multipliers,
}


# It has no rooms.
REFUSED = [("foam", "AugmentedLagrangian"), ("union", "AugmentedLagrangian")]


@pytest.mark.parametrize("start", ["impact", "centred"])
@pytest.mark.parametrize(
    ("name", "method"), [(one, kind) for one in scenes() for kind in METHODS if (one, kind) not in REFUSED]
)
def test_steps_are_those_of_a_loop_over_balls_and_planes(name, method, start):
    """Each is a step on the body, the face or the room that is met, or the mirror where that ends or another is met."""
    surfaces, solids, rooms = scenes()[name]
    places = np.array([(0.1, -0.15, 0.1), (-0.2, 0.1, -0.1), (0.2, 0.1, 0.15), (-0.1, -0.2, 0.0)]).T
    speeds = np.array([(-0.9, 0.4, -0.5), (-0.3, -0.9, 0.3), (0.3, -0.2, -0.9), (0.8, 0.4, 0.5)]).T
    if "solid" in name:
        # The first comes so near to an edge that a step would go over it.
        places = places + np.array([(0.677, 0.455, 0.0), (0.0, 1.2, 0.0), (0.8, 0.9, 1.0), (-1.1, 0.0, 0.0)]).T
        speeds[:, 0] = 0.028, -0.943, 0.1
    elif name == "field":
        places = places * 0.5 - 0.3 * np.array([0.0, 1.0, 1.0])[:, None]
    scene, particles = swarm.Scene(surfaces), swarm.Particles(places, speeds)
    result = swarm.simulate(scene, particles, METHODS[method](start), until=UNTIL, compile="never")
    assert result.observables["energy_error"].max() <= 1e-12
    assert places_outside(scene, result) <= 1.5
    taken = []
    for i in range(4):
        r, v, steps = billiard(places[:, i], speeds[:, i], STEP, solids, rooms, start == "centred")
        assert result.particles.position[:, i] == pytest.approx(r, abs=1e-9)
        assert result.particles.velocity[:, i] == pytest.approx(v, abs=1e-9)
        taken += steps
    assert len(taken) == result.observables["impacts"][-1] >= 8
    assert sum(taken) > 0.5 * len(taken)


# --- Soft faces ----------------------------------------------------------------------------------------------

STIFFNESS, SHORT, SPAN = 4e3, 4e-3, 0.24


def spring(faces, r, v):
    """Place and velocity of a particle of 1 kg after steps against one face at a time, and how many touched one."""
    touched, sign = 0, -1.0 if faces.solid else 1.0
    for _step in range(round(SPAN / SHORT)):
        ends = [sign * (faces.normals @ place - faces.offsets) for place in (r, r + SHORT * v)]
        if faces.solid:
            # The depth in it is that behind the nearest face.
            met = [int(np.argmin(max(ends, key=lambda gaps: gaps.min())))] if max(e.min() for e in ends) > 0.0 else []
        else:
            met = np.flatnonzero(np.maximum(*ends) > 0.0)
        assert len(met) <= 1
        impulse = 0.0
        if len(met):
            touched += 1
            g, u = ends[0][met[0]], sign * faces.normals[met[0]] @ v
            low, high = 0.0, 4.0 * (abs(u) + STIFFNESS * SHORT * (abs(g) + SHORT * abs(u)))
            for _halving in range(80):
                # What it takes of u is h (V1 - V0)/(g1 - g0), for g1 at the mean of both velocities.
                impulse = 0.5 * (low + high)
                g1 = g + SHORT * (u - 0.5 * impulse)
                stored = 0.5 * STIFFNESS * (max(g1, 0.0) ** 2 - max(g, 0.0) ** 2)
                low, high = (impulse, high) if impulse < SHORT * stored / (g1 - g) else (low, impulse)
            v0, v = v, v - impulse * sign * faces.normals[met[0]]
            r = r + 0.5 * SHORT * (v0 + v)
        else:
            r = r + SHORT * v
    return r, v, touched


@pytest.mark.parametrize("side", ["inside", "outside"])
def test_soft_faces_of_a_mesh_are_springs_of_a_loop(side):
    """Each step against one face of a mesh takes the energy of its spring, and gives it back.

    The first particle is on its face, to round-off, where a step begins.
    """
    faces = Polyhedron(*_prism_faces(0.7), side == "outside")
    places = np.array([(0.1, 0.0, 0.67), (-0.62, 0.045, 0.1)]).T
    speeds = np.array([(0.05, 0.1, 0.3), (-0.3, 0.05, 0.02)]).T
    if side == "outside":
        places = np.array([(0.1, 0.0, 0.73), (-0.68, 0.05, 0.1)]).T
        speeds = speeds * np.array([(1.0, 1.0, -1.0), (-1.0, 1.0, 1.0)]).T
    scene, particles = swarm.Scene([_mesh(0.7, side)]), swarm.Particles(places, speeds)
    result = swarm.simulate(scene, particles, swarm.Penalty(SHORT, STIFFNESS), until=SPAN, compile="never")
    assert result.observables["energy_error"].max() <= 1e-12
    for i in range(len(particles)):
        r, v, touched = spring(faces, places[:, i], speeds[:, i])
        assert touched > 10
        assert result.particles.position[:, i] == pytest.approx(r, abs=1e-9)
        assert result.particles.velocity[:, i] == pytest.approx(v, abs=1e-9)
