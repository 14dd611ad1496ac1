"""One step of Penalty: the energy balance, the jump over free steps, several walls at once."""

import math

import numpy as np
import pytest
from conftest import EPSILON, QUADRICS, call, directions, every_surface, numbers_of, scene_of, vectors, wall_point
from hypothesis import given, settings
from hypothesis import strategies as st
from passes import energy_of, one_pass, run

import swarm
from swarm.contact.energy import contact_energy

exponents = pytest.mark.parametrize("exponent", [1.0, 1.5, 2.5])


def slack(method, scene, mass, *steps):
    """Round-off of the energy: of its terms, and of the stored energy for positions rounded in their last place."""
    terms = 0.0
    for step in steps:
        stored = call(contact_energy, method.law(), scene.compiled().walls(), 1.0, step.position)
        depth = scene.gaps(step.position[:, None]).max()
        # V' = (a + 1) V/g; no gap of the table is steeper than 5.
        force = 5.0 * (method.exponent + 1.0) * stored / depth if depth > 0.0 else 0.0
        force += mass * np.linalg.norm(scene.gravity or (0.0, 0.0, 0.0)) + step.impulse.sum() * mass / method.dt
        terms += 0.5 * mass * step.velocity @ step.velocity + stored + force * (1.0 + np.linalg.norm(step.position))
    return 16 * EPSILON * terms


@every_surface
@exponents
@settings(max_examples=15)
@given(
    point=directions,
    velocity=directions,
    depth=st.sampled_from([0.05, 1e-3, 0.0, -1e-3, -1e-2]),
    mass=st.sampled_from([1e-3, 1.0, 1e3]),
    stiffness=st.sampled_from([1e-2, 1.0, 1e2]),
    pull=st.none() | vectors,
)
def test_a_step_conserves_energy(name, exponent, point, velocity, depth, mass, stiffness, pull):
    """By itself, at any dt, for free steps and in the wall, entering and leaving, with gravity or none."""
    scene = scene_of(name, gravity=pull)
    method = swarm.Penalty(dt=0.02, penalty=stiffness * mass / 0.02**2, exponent=exponent)
    numbers = numbers_of(name)
    wall = wall_point(numbers, point)
    start = wall - depth * np.array(call(numbers.unit_normal, wall))
    before, *passes = run(method, scene, start, velocity, 12.0, mass, restores=False)
    first = energy_of(method, scene, before.position, before.velocity, mass)
    total_slack = 0.0
    for after in passes:
        # A torus is pushed by an iteration, which ends some units of round-off from its fixed point.
        total_slack += slack(method, scene, mass, before, after) * (1.0 if name in QUADRICS else 64.0)
        now = energy_of(method, scene, after.position, after.velocity, mass)
        assert abs(now - first) <= total_slack
        before = after
    assert before.remaining == 0.0


@pytest.mark.parametrize("pull", [None, (0.0, 0.0, 1.0)], ids=["straight", "falling"])
@pytest.mark.parametrize("name", ["torus", "capsule", "sphere", "ellipsoid"])
def test_deep_in_a_soft_wall(name, pull):
    """As far outside as the cavity is thick it is held all the same: a torus let go of it there."""
    scene, mass = scene_of(name, gravity=pull), 1e-3
    method = swarm.Penalty(dt=0.02, penalty=0.0025 * mass / 0.02**2, exponent=1.5)
    wall = wall_point(numbers_of(name), np.array([0.0, 1.0, 0.0]))
    before, *passes = run(method, scene, 0.99 * wall, [0.0, 1.0, 0.0], 40.0, mass, restores=False)
    first = energy_of(method, scene, before.position, before.velocity, mass)
    assert max(scene.gaps(after.position[:, None]).max() for after in passes) > 0.1
    for after in passes:
        assert energy_of(method, scene, after.position, after.velocity, mass) == pytest.approx(first, rel=1e-10)


@exponents
def test_round_off_does_not_add_up(exponent):
    """In a stiff wall each step is off by round-off of its gap; every contact restores the energy of the start."""
    scene, mass = scene_of("sphere", gravity=(0.1, 0.2, -0.3)), 3.0
    method = swarm.Penalty(dt=0.02, penalty=1e7, exponent=exponent)
    start, velocity = np.array([0.1, 0.2, 0.3]), np.array([1.0, -2.0, 0.5])
    errors = {}
    for restores in (True, False):
        last = run(method, scene, start, velocity, 2000.0, mass, restores)[-1]
        end = energy_of(method, scene, last.position, last.velocity, mass)
        errors[restores] = abs(end / energy_of(method, scene, start, velocity, mass) - 1.0)
    assert errors[True] <= 4 * EPSILON
    assert errors[False] <= 1e-9


def test_a_contact_that_does_not_balance_is_not_accepted():
    """Energy that is missing by more than round-off is left to the careful solve, and then reported."""
    scene, start, velocity = scene_of("sphere"), np.array([0.2, -0.3, 0.799]), np.array([0.0, 0.0, 1.0])
    method = swarm.Penalty(dt=0.01, penalty=1e4)
    right = energy_of(method, scene, start, velocity)
    assert not one_pass(method, scene, start, velocity, 1.0, energy=right).hard
    with pytest.raises(AssertionError, match="UNSOLVED"):
        one_pass(method, scene, start, velocity, 1.0, energy=right * (1.0 + 1e-10))


@every_surface
@given(point=directions, velocity=directions, pull=st.none() | directions)
def test_a_step_is_the_papers(name, point, velocity, pull):
    """(v0 + v1)/2 = (r1 - r0)/h, and m (v1 - v0 - h G) = -(V1 - V0)/(q1 - q0) h D(r0, r1)."""
    scene, numbers, h, mass = scene_of(name, gravity=pull), numbers_of(name), 0.02, 2.0
    method = swarm.Penalty(dt=h, penalty=1e4)
    wall = wall_point(numbers, point)
    normal = np.array(call(numbers.unit_normal, wall))
    start = wall + 2e-3 * normal
    after = one_pass(method, scene, start, velocity, 1.0, mass)
    assert after.remaining == 0.0
    assert after.position - start == pytest.approx(0.5 * h * (velocity + after.velocity), abs=256 * EPSILON)
    gravity = np.zeros(3) if pull is None else np.array(scene.gravity)
    q0, q1 = (call(numbers.inner, r) for r in (start, after.position))
    walls = scene.compiled().walls()
    rise = np.subtract(*(call(contact_energy, method.law(), walls, 1.0, r) for r in (after.position, start)))
    discrete = np.array(call(numbers.discrete_gradient, start, after.position))
    force = -rise / (q1 - q0) * discrete
    given_ = mass * (after.velocity - velocity - h * gravity)
    assert given_ == pytest.approx(h * force, abs=1e-8 * np.linalg.norm(given_))
    assert after.impulse[0] * mass == pytest.approx(np.linalg.norm(given_), rel=1e-10)


@every_surface
@given(point=directions, velocity=directions, pull=st.none() | vectors)
def test_free_steps_are_jumped_over(name, point, velocity, pull):
    """The pass that jumps is the exact parabola over a whole number of steps; no step starts outside unnoticed."""
    scene, numbers, h = scene_of(name, gravity=pull), numbers_of(name), 1e-3
    method = swarm.Penalty(dt=h, penalty=1e4)
    wall = wall_point(numbers, point)
    start = wall - 0.05 * np.array(call(numbers.unit_normal, wall))
    after = one_pass(method, scene, start, velocity, 5.0)
    steps = 5.0 - after.remaining
    assert steps == round(steps) >= 1.0
    if after.impulse[0] == 0.0:
        gravity = np.zeros(3) if scene.gravity is None else np.array(scene.gravity)
        time = steps * h
        assert after.position == pytest.approx(start + velocity * time + 0.5 * gravity * time**2, abs=8 * EPSILON)
        assert after.velocity == pytest.approx(velocity + gravity * time, abs=8 * EPSILON)


def test_a_spring_by_hand():
    """In a linear wall a step is the midpoint rule of m x'' = -alpha x."""
    scene, h, mass, alpha = swarm.Scene([swarm.Plane((1, 0, 0))]), 0.1, 2.0, 3.0
    after = one_pass(swarm.Penalty(h, alpha), scene, [0.3, 0.0, 0.0], [0.2, 1.0, 0.0], 1.0, mass)
    k = alpha * h * h / (4.0 * mass)
    x1 = ((1.0 - k) * 0.3 + h * 0.2) / (1.0 + k)
    assert after.position == pytest.approx([x1, 0.1, 0.0], rel=4 * EPSILON)
    assert after.velocity == pytest.approx([0.2 - alpha * h / mass * 0.5 * (0.3 + x1), 1.0, 0.0], rel=8 * EPSILON)
    assert after.impulse == pytest.approx([alpha * h / mass * 0.5 * (0.3 + x1)], rel=8 * EPSILON)


@exponents
@pytest.mark.parametrize("pull", [None, (0.3, -0.2, -1.0)])
def test_a_corner_of_three_walls_conserves_energy(exponent, pull):
    """Held by several walls at once, the reactions are swept until all are right."""
    walls = [swarm.Plane((1, 0, 0)), swarm.Plane((0, 1, 0)), swarm.Sphere(2.0)]
    scene, mass = swarm.Scene(walls, gravity=pull), 0.5
    method = swarm.Penalty(dt=0.02, penalty=100.0, exponent=exponent)
    # The corner (0, 0, 2), reached by all three walls within a step.
    before, *passes = run(method, scene, [-0.05, -0.05, 1.95], [1.0, 0.9, 1.1], 60.0, mass, restores=False)
    first, total_slack = energy_of(method, scene, before.position, before.velocity, mass), 0.0
    for after in passes:
        total_slack += slack(method, scene, mass, before, after)
        now = energy_of(method, scene, after.position, after.velocity, mass)
        assert abs(now - first) <= total_slack
        before = after
    assert any(step.hard for step in passes)
    assert (sum(step.impulse for step in passes) > 0.0).all()


def test_impacts_count_entries():
    """Into a plane wall and out of it: one impact, of momentum 2 m v less what the step's length leaves open."""
    scene = swarm.Scene([swarm.Plane((1, 0, 0)), swarm.Sphere(5.0)])
    passes = run(swarm.Penalty(dt=1e-3, penalty=1e4), scene, [-0.1, 0.0, 0.0], [1.0, 0.0, 0.0], 200.0)
    assert sum(step.hits for step in passes) == 1.0
    row = scene.compiled().numbering.surfaces_of_rows.index(0)  # of the plane
    assert sum(step.impulse[row] for step in passes[1:]) == pytest.approx(2.0, rel=1e-12)
    assert passes[-1].velocity == pytest.approx([-1.0, 0.0, 0.0], rel=1e-12)


# --- Descriptions ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        ({"dt": 0.0, "penalty": 1.0}, ["dt", "above 0", "got 0"]),
        ({"dt": math.nan, "penalty": 1.0}, ["dt", "finite", "nan"]),
        ({"dt": 1e-3, "penalty": -5.0}, ["penalty", "above 0", "got -5"]),
        ({"dt": 1e-3, "penalty": "stiff"}, ["penalty", "'stiff'"]),
        ({"dt": 1e-3, "penalty": 1.0, "exponent": 0.9}, ["exponent", "1 or more", "got 0.9"]),
        ({"dt": 1e-3, "penalty": 1.0, "gradient": "composit"}, ["gradient", "'composite'", "did you mean"]),
        ({"dt": 1e-3, "penalty": 1.0, "friction_tolerance": 0.0}, ["friction_tolerance", "from 1e-10 to 1", "got 0"]),
    ],
)
def test_errors_name_the_argument(arguments, parts):
    with pytest.raises(swarm.SceneError) as caught:
        swarm.Penalty(**arguments)
    assert all(part in str(caught.value) for part in parts), str(caught.value)


def test_frames_fall_on_whole_steps():
    method = swarm.Penalty(dt=1e-3, penalty=1.0)
    assert method.span("every", 0.1) == 100.0
    assert method.span("until", 0.3) == 300.0
    with pytest.raises(swarm.SceneError, match=r"every must be a whole number of steps.*every = 0\.0015.*dt = 0\.001"):
        method.span("every", 1.5e-3)
    with pytest.raises(swarm.SceneError, match=r"until must be at most .* steps, got until = 1e\+300 s.*dt = 1e-300"):
        swarm.Penalty(dt=1e-300, penalty=1.0).span("until", 1e300)
