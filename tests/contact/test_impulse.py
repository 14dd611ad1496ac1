"""The scalar equation (K) of a penalty step, kappa = c V[g0, g1] g[q0, q1], against 50 digits."""

import itertools
import math

import mpmath as mp
import numpy as np
import pytest
from conftest import EPSILON, LAWS, call, directions, every_quadric, numbers_of, side_of, wall_point
from hypothesis import given, settings
from hypothesis import strategies as st

from swarm.contact import impulse
from swarm.contact import regularisation as laws
from swarm.contact.impulse import Step
from swarm.kernel.vector import Vec, vec
from swarm.surfaces.walls import Walls

mp.mp.dps = 50
some_laws = pytest.mark.parametrize("law", [LAWS["1.0"], LAWS["1.5"], LAWS["2.0"]], ids=["1", "1.5", "2"])

steps = {
    "point": directions,
    "direction": directions,
    "lean": st.floats(0.05, 1.0) | st.floats(-1.0, -0.05),
    "depth": st.sampled_from([0.0, 1e-3, 0.02, 0.1, -1e-4, -1e-2, -0.05]),
    "length": st.sampled_from([1e-4, 1e-2, 0.1, 0.2]),
    "stiffness": st.sampled_from([1e-3, 1.0, 30.0, 1e3]),
}


def exactly(point):
    """A point with 50 digits."""
    return Vec(*map(mp.mpf, point))


class Contact:
    """One step next to the wall: where from, how far the free flight goes, how stiff the wall is for the mass."""

    def __init__(self, name, law, point, direction, lean, depth, length, stiffness, reachable=False):
        self.law, self.surface = law, numbers_of(name)
        wall = wall_point(self.surface, point)
        normal = np.array(call(self.surface.unit_normal, wall))
        along = direction - (direction @ normal) * normal
        along /= max(np.linalg.norm(along), 1e-3)
        self.start = wall - depth * normal
        slope = np.linalg.norm(self.inner_slope(wall))
        self.free = length * (lean * normal + math.sqrt(1.0 - lean * lean) * along)
        # c of (K) from c alpha/2 ~ stiffness where the slope of q is 1
        self.c = stiffness / law.alpha / slope**2
        # No deeper in the wall than kinetic energy alone takes it, m v^2/2 = p^2/(4 c).
        while reachable and self.energy(self.start) > length**2 / (4.0 * self.c):
            depth *= 0.5
            self.start = wall - depth * normal

    def inner_slope(self, point):
        return call(self.surface.discrete_gradient, point, point)

    def gap(self, point):
        return side_of(self.surface) * self.surface.phi(vec(point))

    def energy(self, point):
        """V with 50 digits; its exponent from the law."""
        a = {laws.Linear: mp.mpf(1), laws.Hertz: mp.mpf("1.5")}.get(type(self.law)) or mp.mpf(self.law.a)
        return mp.mpf(self.law.alpha) * max(self.gap(point), 0) ** (a + 1) / (a + 1)

    def end(self, kappa):
        """r1 = r0 + p - kappa D(r0, r1), from D alone: it is affine in r1, D0 + B r1."""
        start = exactly(self.start)
        corners = [Vec(*(mp.mpf(i == k) for i in range(3))) for k in range(-1, 3)]
        zero, *along = (self.surface.discrete_gradient(start, corner) for corner in corners)
        matrix = mp.matrix(3, 3)
        for i, k in itertools.product(range(3), range(3)):
            matrix[i, k] = (i == k) + kappa * (along[k][i] - zero[i])
        right = [r + mp.mpf(p) - kappa * d for r, p, d in zip(start, self.free, zero, strict=True)]
        return vec(mp.lu_solve(matrix, mp.matrix(right)))

    def residual(self, kappa):
        """kappa - c (V1 - V0)/(q1 - q0)."""
        start, end = exactly(self.start), self.end(mp.mpf(float(kappa)))
        q0, q1 = self.surface.inner(start), self.surface.inner(end)
        if q0 == q1:
            return mp.mpf(float(kappa))
        return mp.mpf(float(kappa)) - mp.mpf(self.c) * (self.energy(end) - self.energy(start)) / (q1 - q0)

    def slack(self):
        """How far kappa moves when positions move by round-off, in the stiffest place of the step."""
        depth = max(call(self.surface.gap_of, call(self.surface.inner, r)) for r in (self.start, self.far))
        reach = np.linalg.norm(self.start) + np.linalg.norm(self.free) + 1.0
        force = self.c * call(self.law.stiffness, max(depth, 1e-3)) * 2.0
        return 64 * EPSILON * force * reach / np.linalg.norm(self.inner_slope(self.start))

    def step(self):
        return Step(vec(self.start), vec(self.free), np.float64(self.c))

    @property
    def far(self):
        return self.start + self.free

    def careful(self):
        return call(impulse.equation(self.law, None, self.surface, self.step()).careful)


@every_quadric
@some_laws
@given(**steps)
def test_careful_solves_the_equation(name, law, **step):
    step = Contact(name, law, **step)
    kappa, solved = step.careful()
    assert solved
    assert abs(step.residual(kappa)) <= 8 * EPSILON * abs(kappa) + step.slack()


@every_quadric
@some_laws
@settings(max_examples=10)
@given(**steps)
def test_careful_finds_the_smallest_root(name, law, **step):
    """No change of sign of the residual before the root; a wall pushes, a cavity with kappa >= 0, a solid <= 0."""
    step = Contact(name, law, **step, reachable=True)
    kappa, _ = step.careful()
    assert kappa * side_of(step.surface) >= 0.0
    sign = mp.sign(step.residual(0.0))
    if abs(kappa) > 1e3 * step.slack():
        assert sign != 0
        assert all(mp.sign(step.residual(kappa * part)) == sign for part in np.linspace(0.01, 0.99, 25))


@every_quadric
@some_laws
@given(**steps)
def test_newton_from_the_guess_finds_the_same_root(name, law, **step):
    """Whenever it says that it is done; and it is, within its sweeps, where dt resolves the contact."""
    step = Contact(name, law, **step, reachable=True)
    walls = Walls((step.surface,))
    expected, _ = step.careful()
    kappa, unsolved = call(impulse.guess, walls, 0, law, step.step()), True
    for _ in range(impulse.NEWTON_STEPS):
        if unsolved:
            newton = call(impulse.improve, walls, 0, law, None, step.step(), kappa)
            kappa, unsolved = kappa - newton.step, newton.more
    if not unsolved:
        assert kappa == pytest.approx(expected, rel=1e-12, abs=step.slack())
    else:
        assert expected == 0.0 or step.c * law.alpha * np.linalg.norm(step.inner_slope(step.start)) ** 2 > 0.5


@every_quadric
@some_laws
def test_a_free_step_has_no_impulse(name, law):
    step = Contact(name, law, np.array([0.3, 0.5, -0.4]), np.array([1.0, 0.0, 0.0]), -0.5, 0.05, 0.1, 30.0)
    assert step.careful() == (0.0, True)


@some_laws
def test_a_head_on_plane_by_hand(law):
    """Fully inside the wall at both ends (K) is kappa = c V[g0, g1] with g1 = g0 + p - kappa."""
    numbers, c, g0, p = numbers_of("plane")._replace(normal=Vec(1.0, 0.0, 0.0), offset=0.0), 1e-4, 0.2, 0.1
    kappa, solved = call(impulse.equation(law, None, numbers, Step(Vec(g0, 0.0, 0.0), Vec(p, 0.0, 0.0), c)).careful)
    assert solved
    assert kappa == pytest.approx(c * call(law.energy_slope, g0, g0 + p - kappa)[0], rel=8 * EPSILON)
    if isinstance(law, laws.Linear):
        half = 0.5 * law.alpha * c
        assert kappa == pytest.approx(half * (2 * g0 + p) / (1 + half), rel=8 * EPSILON)


@every_quadric
@some_laws
@settings(max_examples=60)
@given(
    point=directions,
    direction=directions,
    lean=st.floats(-1.0, 1.0),
    depth=st.sampled_from([0.0, 0.1, 1e-9, -1e-9, -1e-3, -0.05]),
    length=st.sampled_from([1.0, 3.0, 10.0]),
    stiffness=st.sampled_from([1.0, 1e4, 1e8]),
)
def test_careful_solves_steps_across_the_cavity(name, law, **step):
    """Free flights of many sizes, deep into the far wall: a root, on this side of the pole of a solid."""
    step = Contact(name, law, **step)
    kappa, solved = step.careful()
    assert solved
    side, pole = side_of(step.surface), abs(step.surface.farthest_push())
    assert 0.0 <= kappa * side < pole
    # F changes its sign within the round-off of the positions.
    width = 1e-9 * abs(kappa) + step.slack()
    low, high = (step.residual(side * max(0.0, kappa * side + part)) * side for part in (-width, width))
    assert low <= 0.0 <= high or (kappa == 0.0 and high == 0.0)
