"""Soft walls that turn: the energy is that of the work, the order is 2, and a plain loop goes the same way."""

import itertools
import math

import numpy as np
import pytest
from energy_books import unbooked

import swarm
from swarm.kernel.vector import dot, vec
from swarm.surfaces.time_of_impact import strides

H, ALPHA, RATE = 0.01, 300.0, 2.0
TURN = swarm.Rotation((0.3, 0.5, 1.0), RATE, (0.02, -0.01, 0.0))
SWING = swarm.Oscillation((0.05, 0.03, 0.08), 0.7)
WALLS = {
    "ellipsoid": lambda motion: [swarm.Ellipsoid((0.5, 0.6, 0.4), motion=motion)],
    "swinging ellipsoid": lambda motion: [swarm.Ellipsoid((0.5, 0.6, 0.4), motion=SWING + motion)],
    "paddle": lambda motion: [
        swarm.Sphere(0.8), swarm.Ellipsoid((0.1, 0.3, 0.2), (0.3, 0.0, 0.0), side="outside", motion=motion),
    ],
    "box": lambda motion: [swarm.Box((0.3, 0.25, 0.2), rotation=(1.0, 0.3, -0.2, 0.5), motion=motion)],
    "can": lambda motion: [swarm.Cylinder(0.4, axis=(1.0, 0.0, 2.0), length=0.8, motion=motion)],
    "wedge": lambda motion: [swarm.Plane((s, 0.3, -1.0), 0.2, motion=motion) for s in (-1.0, 1.0)],
}  # fmt: skip


def run(surfaces, method, until=1.0, gravity=None, start=None, **given):
    start = swarm.fill(swarm.Scene([swarm.Sphere(0.1)]), 3, speed=1.0, seed=3) if start is None else start
    return swarm.simulate(
        swarm.Scene(surfaces, gravity), start, method, until=until, every=0.5 * until, compile="never", **given
    )


def imbalance(result):
    seen = result.observables
    return unbooked(seen) / np.abs(seen["total_energy"]).max()


FLAT = {
    "plane": swarm.Plane((0.2, 0.3, -1.0), 0.2, motion=TURN),
    "slab": swarm.Slab((0.2, 0.3, -1.0), 0.3, motion=SWING + TURN),
    "plate": swarm.Slab((1.0, 0.3, 0.4), 0.1, side="outside", motion=TURN),
}


CURVED = {
    "ellipsoid": swarm.Ellipsoid((0.5, 0.6, 0.4), motion=TURN),
    "swinging solid": swarm.Ellipsoid((0.4, 0.6, 0.5), (0.3, 0.0, 0.0), side="outside", motion=SWING + TURN),
    "oblique cylinder": swarm.Cylinder(0.5, axis=(1.0, 0.0, 2.0), motion=TURN),
    "paraboloid": swarm.Paraboloid(0.4, axis=(0.2, 0.1, 1.0), motion=TURN),
    "torus": swarm.Torus(0.6, 0.3, motion=TURN),
    "formula": swarm.Formula("x**2 + 2*y**2 + z**4 - 0.3", size=1.0, motion=TURN),
}


def long_steps(surface):
    """A wall over a step of which the angle is 0.4 rad, and steps (r, p) from places near it."""
    wall = swarm.Scene([surface]).compiled().walls(1.3).during(0.5, 0.3).each[0]
    rng = np.random.default_rng(3)
    places, ways = rng.uniform(-0.5, 0.5, (10, 3)), rng.uniform(-0.1, 0.1, (10, 3))
    return wall, [(vec(r), vec(p)) for r, p in zip(places, ways, strict=True)]


def matrix_of(out):
    """The matrix of a linear map of vectors."""
    return np.array([out(vec(row)) for row in np.eye(3)]).T


@pytest.mark.parametrize("kappa", [1e-3, 0.03])
@pytest.mark.parametrize("name", [*FLAT, *CURVED])
def test_a_push_solves_the_equation_of_the_step(name, kappa):
    """r1 = r0 + p - kappa M^-T D with M = (A0 + A1)/2, by the two matrices alone."""
    wall, steps = long_steps((FLAT | CURVED)[name])
    kappa = wall.side * kappa
    mean = 0.5 * (matrix_of(wall.pose.out) + matrix_of(wall.end.out))
    for r, p in steps:
        end = wall.push(r, p, kappa)
        d = np.array(wall.body.discrete_gradient(wall.own_place(r), wall.own_end(end)))
        expected = np.array(r) + np.array(p) - kappa * np.linalg.solve(mean.T, d)
        assert np.array(end) == pytest.approx(expected, abs=1e-14)
        assert np.array(wall.discrete_gradient(r, end)) == pytest.approx(np.linalg.solve(mean.T, d), abs=1e-14)


@pytest.mark.parametrize("kappa", [1e-3, 0.03])
@pytest.mark.parametrize("name", [*FLAT, *CURVED])
def test_a_rise_is_that_of_the_push(name, kappa):
    wall, steps = long_steps((FLAT | CURVED)[name])
    kappa = wall.side * kappa
    for r, p in steps:
        rise, slope = wall.rise(r, p, kappa)
        assert rise == pytest.approx(wall.end_inner(wall.push(r, p, kappa)) - wall.inner(r), abs=1e-14)
        change = 1e-5
        ahead, behind = (wall.rise(r, p, kappa + one)[0] for one in (change, -change))
        # Of steps by Newton's method the slope is as good as the step is short.
        within = 2e-2 if name in ("torus", "formula") else 1e-6
        assert slope == pytest.approx((ahead - behind) / (2.0 * change), rel=within, abs=within * 1e-2)


@pytest.mark.parametrize("name", [*FLAT, *CURVED])
def test_the_rise_of_a_free_step_is_that_without_a_push(name):
    wall, steps = long_steps((FLAT | CURVED)[name])
    for r, p in steps:
        (free, guessed), (rise, slope) = wall.free_rise(r, p), wall.rise(r, p, 0.0)
        assert free == pytest.approx(rise, abs=1e-14)
        assert guessed == pytest.approx(slope, rel=0.5, abs=0.05)


@pytest.mark.parametrize("name", CURVED)
def test_what_a_wall_carries_its_points_by_is_the_rest_of_the_step(name):
    """D.(r1 - r0 - w) is the change of q of any step: what its force does not give the wall gives."""
    wall, steps = long_steps(CURVED[name])
    for r, p in steps:
        normal, way = wall.discrete_gradient(r, r + p), p - wall.swept(r, r + p)
        assert dot(normal, way) == pytest.approx(wall.end_inner(r + p) - wall.inner(r), abs=1e-14)


# --- Work ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("gravity", [None, (0.0, 0.0, -2.0)], ids=["straight", "falling"])
@pytest.mark.parametrize("name", [*WALLS, "fast ellipsoid", "hertz"])
def test_energy_is_that_of_the_work(name, gravity):
    motion = swarm.Rotation((0.3, 0.5, 1.0), 30.0) if name == "fast ellipsoid" else TURN
    method = swarm.Penalty(H, 3e3, exponent=1.5) if name == "hertz" else swarm.Penalty(0.2 * H, 20.0 * ALPHA)
    start = swarm.Particles(np.array([[-0.1, 0.0], [0.0, 0.1], [0.0, 0.05]]), np.array([[1, 1], [0, 0.1], [0, 0]]), 1.0)
    result = run(WALLS.get(name, WALLS["ellipsoid"])(motion), method, 1.0, gravity, start if name == "paddle" else None)
    assert result.observables["impacts"][-1] >= 1
    assert imbalance(result) <= 1e-12
    assert np.abs(result.observables["wall_work"][-1]).max() > 1e-3


def test_rooms_turn_as_one_wall():
    """Their spheres alone give no bend: about its own centre none of them turns."""
    rooms = swarm.Union((swarm.Sphere(0.4), swarm.Sphere(0.3, (0.4, 0.0, 0.0))), motion=TURN)
    start = swarm.Particles([-0.3, 0.0, 0.0], [-1.0, 0.4, 0.1], 1.0)
    result = run([rooms], swarm.Penalty(2.0 * H, ALPHA), 0.4, start=start)
    assert result.observables["impacts"][-1] >= 1
    assert imbalance(result) <= 1e-12
    assert abs(result.observables["wall_work"][-1].sum()) > 1e-3


def test_laws_take_what_is_dissipated():
    surface = swarm.Ellipsoid((0.5, 0.6, 0.4), motion=TURN, restitution=0.8, friction=0.2)
    result = run([surface], swarm.Penalty(H, ALPHA), 2.0)
    assert result.observables["dissipated_energy"][-1] > 0.0
    assert imbalance(result) <= 1e-12


def test_the_loop_of_multipliers_ends_on_a_wall_that_turns():
    """Its step from the wall converges; the energy then is that of the work up to the tolerance."""
    wall = swarm.Plane((0.0, 0.0, -1.0), 0.0, motion=swarm.Rotation((0.0, 1.0, 0.0), 0.5))
    start = swarm.Particles([0.2, 0.0, 0.0], [0.1, 0.0, -1.0], 1.0)
    result = run([wall], swarm.AugmentedLagrangian(H, 1e6, tolerance=1e-26, max_sweeps=500), 10.0 * H, start=start)
    assert result.observables["unconverged"][-1] == 0
    assert imbalance(result) <= 1e-11
    # The wall goes down there, by 0.5 rad/s times 0.2 m, and takes what it does not give back.
    assert result.observables["wall_work"][-1].sum() < -0.1


# --- What is asked ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["box", "ellipsoid"])
def test_a_step_in_a_contact_asks_for_no_safe_step(name, monkeypatch):
    asked, whole = [], strides.met
    monkeypatch.setattr(strides, "met", lambda *given: asked.append(1) or whole(*given))
    # A contact of pi sqrt(m/alpha) takes 18 steps.
    result = run(WALLS[name](TURN), swarm.Penalty(H, ALPHA), 4.0)
    impacts = result.observables["impacts"][-1]
    assert impacts >= 10
    # A flight to an edge ends in two impacts.
    assert impacts <= 2 * len(asked) <= 6 * impacts


# --- Against other ways to compute it --------------------------------------------------------------------


@pytest.mark.parametrize("gravity", [None, (0.3, 0.0, -2.0)], ids=["straight", "falling"])
@pytest.mark.parametrize("name", ["ellipsoid", "swinging ellipsoid", "paddle", "box", "swinging box"])
def test_steps_that_are_jumped_over_are_free(name, gravity):
    """Frames of one step jump over none."""
    walls = [swarm.Box((0.3, 0.25, 0.2), motion=SWING)] if name == "swinging box" else WALLS[name](TURN)
    start = swarm.Particles(np.array([[-0.1, 0.0], [0.0, 0.1], [0.0, 0.05]]), np.array([[1, 1], [0, 0.1], [0, 0]]), 1.0)
    method, until, ends = swarm.Penalty(2.0 * H, ALPHA), 1.2, []
    for every in (until, 2.0 * H):
        result = swarm.simulate(
            swarm.Scene(walls, gravity), start, method, until=until, every=every, compile="never"
        )  # fmt: skip
        ends.append((result.observables["impacts"][-1], result.particles.position))
    assert ends[0][0] == ends[1][0] >= 2
    assert np.allclose(ends[0][1], ends[1][1], rtol=0.0, atol=1e-11)


def test_the_order_is_2():
    walls = WALLS["swinging ellipsoid"](TURN)
    ends = [run(walls, swarm.Penalty(0.008 / k, ALPHA), 0.8).particles.position for k in (1, 2, 4)]
    first, second = (np.abs(one - other).max() for one, other in itertools.pairwise(ends))
    assert 3.6 < first / second < 4.4


def test_the_limit_is_that_of_rigid_walls():
    exact = run(WALLS["ellipsoid"](TURN), swarm.Impact(), 0.6).particles.position
    misses = []
    for alpha in (1e3, 1e5):
        soft = swarm.Penalty(0.1 / math.sqrt(10.0 * alpha), alpha)
        misses.append(np.abs(run(WALLS["ellipsoid"](TURN), soft, 0.6).particles.position - exact).max())
    assert misses[1] < 0.2 * misses[0] < 0.05


def turned(angle, a):
    """A vector turned about the z axis."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([c * a[0] - s * a[1], s * a[0] + c * a[1], a[2]])


def plain_step(r, v, time):
    """One step of eq. (5) at the plane n(t).r = 0.2 that turns about z: with its work, which nothing else measures."""
    n = np.array([1.0, 0.0, 0.0])
    a, b = turned(RATE * time, n), turned(RATE * (time + H), n)
    # n of the scene: M^-T n = M S^-2 n, with M = (A0 + A1)/2 and S = cos(w h/2) across the axis
    d = 0.5 * (a + b) / math.cos(0.5 * RATE * H) ** 2
    g0 = a @ r - 0.2

    def kappa_of(g1):
        y0, y1 = max(g0, 0.0), max(g1, 0.0)
        slope = (y1 - y0) / (g1 - g0) if g1 != g0 else 1.0
        return 0.5 * H * H * ALPHA * 0.5 * (y0 + y1) * slope

    free = b @ (r + H * v) - 0.2
    low, high = min(g0, free) - 1.0, free
    for _i in range(200):
        g1 = 0.5 * (low + high)
        low, high = (low, g1) if g1 - (free - kappa_of(g1) * (b @ d)) > 0.0 else (g1, high)
    r1 = r + H * v - kappa_of(high) * d
    return r1, 2.0 / H * (r1 - r) - v


def test_a_plain_loop_goes_the_same_way():
    wall = swarm.Plane((1.0, 0.0, 0.0), 0.2, motion=swarm.Rotation((0.0, 0.0, 1.0), RATE))
    r, v = np.array([0.0, 0.1, 0.0]), np.array([1.0, 0.4, 0.2])
    result = run([wall], swarm.Penalty(H, ALPHA), 0.8, start=swarm.Particles(r, v, 1.0))
    for k in range(80):
        r, v = plain_step(r, v, k * H)
    assert result.observables["impacts"][-1] >= 1
    assert np.allclose(result.particles.position[:, 0], r, atol=1e-10)


def test_a_jump_over_a_blade_that_turns_is_refused():
    blade = swarm.Ellipsoid((0.02, 0.4, 0.4), side="outside", motion=swarm.Rotation((0.0, 0.0, 1.0), 30.0))
    with pytest.raises(swarm.SceneError, match="no particle jumps over a solid in one step"):
        run([swarm.Sphere(0.8), blade], swarm.Penalty(H, ALPHA), start=swarm.Particles([0.5, 0, 0], [0.0, 1, 0], 1.0))


def test_the_mean_value_form_does_not_turn():
    with pytest.raises(swarm.SceneError, match=r'gradient must be "composite" where surfaces\[0\]\.motion turns'):
        run(WALLS["ellipsoid"](TURN), swarm.Penalty(H, ALPHA, exponent=2.0, gradient="mean-value"))
