"""Verlet, Midpoint, Trapezoidal: every step satisfies its rule's equations, with forces from phi and its gradient."""

import numpy as np
import pytest
from conftest import EPSILON, ITERATED, call, directions, every_surface, numbers_of, scene_of, vectors, wall_point
from hypothesis import given, settings
from hypothesis import strategies as st
from passes import one_pass, run

import swarm

RULES = {"verlet": swarm.Verlet, "midpoint": swarm.Midpoint, "trapezoidal": swarm.Trapezoidal}
every_rule = pytest.mark.parametrize("rule", RULES)


def acceleration(scene, method, mass, point):
    """G - sum V'(g) grad g/m, V' = alpha g^a."""
    pull = np.zeros(3) if scene.gravity is None else np.array(scene.gravity)
    for surface in scene.surfaces:
        side = -1.0 if surface.is_solid() else 1.0
        gap = max(side * float(surface.phi(point[:, None])[0]), 0.0)
        pull = pull - method.penalty * gap**method.exponent * side * surface.gradient(point[:, None])[:, 0] / mass
    return pull


def misses(rule, scene, method, mass, before, after):
    """By how much r1 and v1 miss the rule's equations."""
    h, r0, v0, r1, v1 = method.dt, before.position, before.velocity, after.position, after.velocity
    a0, a1 = (acceleration(scene, method, mass, r) for r in (r0, r1))
    if rule == "verlet":
        return r1 - r0 - h * v0 - 0.5 * h * h * a0, v1 - v0 - 0.5 * h * (a0 + a1)
    if rule == "midpoint":
        middle = acceleration(scene, method, mass, 0.5 * (r0 + r1))
        return r1 - r0 - 0.5 * h * (v0 + v1), v1 - v0 - h * middle
    return r1 - r0 - h * v0 - 0.25 * h * h * (a0 + a1), v1 - v0 - 0.5 * h * (a0 + a1)


@every_surface
@every_rule
@settings(max_examples=12)
@given(
    point=directions,
    velocity=directions,
    depth=st.sampled_from([0.05, 1e-3, 0.0, -1e-3, -1e-2]),
    mass=st.sampled_from([1e-3, 1.0, 1e3]),
    stiffness=st.sampled_from([1e-2, 1.0, 1e2]),
    exponent=st.sampled_from([1.0, 1.5, 2.5]),
    pull=st.none() | vectors,
)
def test_a_step_is_the_rule(rule, name, point, velocity, depth, mass, stiffness, exponent, pull):
    """Entering, staying and leaving, with gravity or none."""
    scene = scene_of(name, gravity=pull)
    method = RULES[rule](dt=0.02, penalty=stiffness * mass / 0.02**2, exponent=exponent)
    numbers = numbers_of(name)
    wall = wall_point(numbers, point)
    start = wall - depth * np.array(call(numbers.unit_normal, wall))
    before = one_pass(method, scene, start, velocity, 1.0, mass)._replace(position=start, velocity=velocity)
    after = one_pass(method, scene, start, velocity, 1.0, mass)
    assert after.remaining == 0.0
    r, v = misses(rule, scene, method, mass, before, after)
    # A step in which the force is h^2 alpha/m times the depth has its round-off as many times.
    size = 1.0 + stiffness * (1.0 + np.abs(after.position).max() + np.abs(after.velocity).max())
    slack = (4096.0 if name in ITERATED else 256.0) * EPSILON * size
    assert np.abs(r).max() <= slack
    assert np.abs(v).max() <= slack / method.dt


@every_rule
def test_free_steps_are_jumped_over(rule):
    """Ten thousand steps that no wall meets are one pass, with gravity too: the rule is exact there."""
    scene = swarm.Scene([swarm.Plane((0.0, 0.0, -1.0), 100.0)], (0.0, 0.0, -1.0))
    method = RULES[rule](dt=1e-3, penalty=1e4)
    passes = run(method, scene, [0.1, 0.2, 0.3], [1.0, 0.0, 5.0], 10_000.0)
    assert len(passes) <= 3
    assert passes[-1].position == pytest.approx([10.1, 0.2, 0.3], abs=1e-12)
    assert passes[-1].velocity == pytest.approx([1.0, 0.0, -5.0], abs=1e-12)


@every_rule
def test_a_corner_is_pushed_by_both_walls(rule):
    """Into an edge of two planes at right angles each wall acts as if it were alone."""
    both = swarm.Scene([swarm.Plane((1.0, 0.0, 0.0), 0.0), swarm.Plane((0.0, 1.0, 0.0), 0.0)])
    method, mass = RULES[rule](dt=0.01, penalty=2e3), 0.7
    start, velocity = [-0.004, -0.002, 0.0], [1.0, 0.8, 0.3]
    corner = run(method, both, start, velocity, 12.0, mass)
    assert any(one.hard for one in corner)
    impulse = sum(one.impulse for one in corner)
    for axis, plane in enumerate(both.surfaces):
        alone = run(method, swarm.Scene([plane]), start, velocity, 12.0, mass)
        assert corner[-1].position[axis] == pytest.approx(alone[-1].position[axis], abs=1e-13)
        assert corner[-1].velocity[axis] == pytest.approx(alone[-1].velocity[axis], abs=1e-12)
        assert impulse[axis] == pytest.approx(sum(one.impulse for one in alone)[0], rel=1e-12)
        # What the wall gave is what the velocity changed by.
        assert impulse[axis] == pytest.approx(velocity[axis] - corner[-1].velocity[axis], rel=1e-12)


@pytest.mark.parametrize("angle", [50.0, 90.0])
@every_rule
def test_each_contact_in_an_edge_is_an_impact_on_its_wall(rule, angle):
    """One begins where a step, or for the midpoint rule its middle, is outside of a wall: also while another lasts."""
    turn, seen = np.radians(angle), []
    normals = np.array([[1.0, 0.0, 0.0], [-np.cos(turn), np.sin(turn), 0.0]])
    scene = swarm.Scene([swarm.Plane(normal, 0.0) for normal in normals])
    inwards = -normals.sum(axis=0) / np.linalg.norm(normals.sum(axis=0))
    across = np.array([inwards[1], -inwards[0], 0.0])
    start = np.array([0.03 * inwards + 0.004 * k * across for k in (-2, -1, 0, 1, 2) for _ in range(3)]).T
    velocity = np.array([-inwards + part * across for _ in range(5) for part in (-0.3, 0.1, 0.4)]).T
    simulated = swarm.simulate(
        scene,
        swarm.Particles(start, velocity),
        RULES[rule](dt=5e-3, penalty=2e4),
        until=0.3,
        every=5e-3,
        compile="never",
        member_impacts=True,
        observables={"x": lambda frame: (seen.append(frame.position), 0.0)[1]},
    )
    ways = np.array(seen[-61:])

    def outside(places):
        return np.einsum("wk,tkn->twn", normals, places) > 0.0

    pushed = outside(0.5 * (ways[1:] + ways[:-1])) if rule == "midpoint" else False
    begun = ~outside(ways[:-1]) & (outside(ways[1:]) | pushed)
    assert begun.sum(axis=(0, 1)).tolist() == simulated.impacts_per_particle.tolist()
    assert begun.sum(axis=(0, 2)).tolist() == [impacts.sum() for impacts in simulated.member_impacts]
    assert (outside(ways).sum(axis=1) > 1).any()


@every_rule
def test_a_contact_changes_the_energy_and_penalty_does_not(rule):
    """Why they are here: at dt sqrt(alpha/m) = 0.7 one bounce changes the energy by more than round-off."""
    scene = swarm.Scene([swarm.Plane((1.0, 0.0, 0.0), 0.0)])
    changes = []
    for cls in (RULES[rule], swarm.Penalty):
        end = run(cls(dt=0.01, penalty=4900.0), scene, [-0.0043, 0.0, 0.0], [1.0, 0.0, 0.0], 20.0)[-1]
        assert end.velocity[0] < 0.0
        changes.append(abs(end.velocity @ end.velocity - 1.0))
    assert changes[0] > 1e-4
    assert changes[1] < 1e-14


def test_verlet_is_unstable_beyond_two():
    """A particle held in a spring of dt sqrt(alpha/m) = 2.1 leaves it with ever more energy; at 1.9 it does not."""
    scene = swarm.Scene([swarm.Plane((1.0, 0.0, 0.0), 0.0)], (50.0, 0.0, 0.0))
    speeds = []
    for stiffness in (1.9, 2.1):
        alpha = (stiffness / 0.01) ** 2
        # Deep in the wall, where gravity and spring balance: it never lets go.
        start = [50.0 / alpha + 1e-7, 0.0, 0.0]
        passes = run(swarm.Verlet(dt=0.01, penalty=alpha), scene, start, [0.0, 0.0, 0.0], 30.0)
        speeds.append(max(abs(one.velocity[0]) for one in passes))
    assert speeds[0] < 1e-4
    assert speeds[1] > 10.0 * speeds[0]


@every_rule
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"dt": 0.0, "penalty": 1.0}, "dt must be above 0, got 0"),
        ({"dt": 1.0, "penalty": -1.0}, "penalty must be above 0, got -1"),
        ({"dt": 1.0, "penalty": 1.0, "exponent": 0.5}, "exponent must be 1 or more, got 0.5"),
    ],
)
def test_bad_arguments(rule, arguments, message):
    with pytest.raises(swarm.SceneError, match=message):
        RULES[rule](**arguments)


@every_rule
def test_laws_of_walls_and_fast_particles_are_refused(rule):
    method = RULES[rule](dt=0.1, penalty=1.0)
    lossy = swarm.Scene([swarm.Sphere(0.5, restitution=0.9)])
    with pytest.raises(swarm.SceneError, match=f"with {type(method).__name__}, got 0.9; use"):
        swarm.simulate(lossy, swarm.fill(lossy, 1, speed=1.0), method, until=1.0)
    for law, message in (
        ({"friction": 0.3}, r"surfaces\[1\]\.friction must be 0 with .*, got 0\.3; use Impact"),
        ({"temperature": 0.0}, r"surfaces\[1\]\.temperature must be None with .*, got 0; use Impact"),
    ):
        rough = swarm.Scene([swarm.Sphere(0.5), swarm.Plane((0, 0, 1), 0.3, **law)])
        with pytest.raises(swarm.SceneError, match=message):
            swarm.simulate(rough, swarm.fill(rough, 1, speed=1.0), method, until=1.0)
    ball = swarm.Scene([swarm.Sphere(0.5), swarm.Sphere(0.01, side="outside")])
    with pytest.raises(swarm.SceneError, match="no particle jumps over a solid"):
        swarm.simulate(ball, swarm.fill(ball, 1, speed=1.0), method, until=1.0)
