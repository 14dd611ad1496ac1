"""AugmentedLagrangian: what its loops tell, what happens where they do not converge, and its limit, Impact.

`simulate` runs in plain Python here, a few particles and contacts each; tests/physics/test_multipliers.py has the rest.
"""

import math
from unittest import mock

import numpy as np
import pytest
from passes import simulate

import swarm
from swarm.lanes import block as blocks

SPHERE = swarm.Scene([swarm.Sphere(0.5)])
SCENES = {
    "sphere": SPHERE,
    "ellipsoid": swarm.Scene([swarm.Ellipsoid((0.3, 0.4, 0.6))]),
    "cut sphere": swarm.Scene([swarm.Sphere(0.5), swarm.Plane((0.0, 0.0, -1.0), 0.2)]),
    "shell": swarm.Scene([swarm.Sphere(0.5), swarm.Sphere(0.2, (0.1, 0.0, 0.0), side="outside")]),
}
# On the wall after 20 steps of 0.025; and between the 19th and the 20th.
STATE_ONE = swarm.Particles((0.25, 0.10, 0.0), (0.3, 0.4, 0.0))
STATE_TWO = swarm.Particles((0.25, 0.10, 0.0), (0.5 * math.sqrt(0.5), 0.5 * math.sqrt(0.5), 0.0))


def method_of(dt=0.025, penalty=1e4, **keywords):
    return swarm.AugmentedLagrangian(dt, penalty, **keywords)


def speed2(particles):
    return (particles.velocity**2).sum(axis=0)


# --- The limit -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("acceleration", ["none", "secant", "reflection"])
@pytest.mark.parametrize("name", SCENES)
def test_its_limit_is_impact(name, acceleration):
    """adaptive, V <= 1e-28: the trajectories of Impact's chord steps, with the same energy."""
    scene, dt = SCENES[name], 0.02
    start = swarm.fill(scene, 5, speed=1.0, mass=[0.5, 1.0, 2.0, 1.0, 1.0], seed=1)
    method = method_of(dt, 1e6, tolerance=1e-28, adaptive=True, acceleration=acceleration)
    found = simulate(scene, start, method, 3.0, 1.5)
    limit = simulate(scene, start, swarm.Impact(contact_step=dt, shortest_flight=1e-12), 3.0)
    assert found.particles.position == pytest.approx(limit.particles.position, abs=1e-9)
    assert found.particles.velocity == pytest.approx(limit.particles.velocity, abs=1e-8)
    assert found.observables["energy_error"].max() <= 1e-12
    assert found.observables["max_penetration"].max() <= 1e-14
    assert found.observables["unconverged"][-1] == 0
    assert found.multipliers.contacts.sum() >= 10
    assert found.observables["impulse"][-1] == pytest.approx(limit.observables["impulse"][-1], rel=1e-8)


@pytest.mark.parametrize("name", SCENES)
def test_impacts_are_those_of_impact(name):
    scene, dt = SCENES[name], 0.02
    start = swarm.fill(scene, 10, speed=1.0, seed=1)
    method = method_of(dt, 1e6, tolerance=1e-28, adaptive=True, acceleration="reflection")
    found = simulate(scene, start, method, 5.0)
    limit = simulate(scene, start, swarm.Impact(contact_step=dt, shortest_flight=1e-12), 5.0)
    assert found.observables["impacts"][-1] == limit.observables["impacts"][-1]


def test_the_error_falls_with_the_tolerance():
    """Towards Impact as the root of the tolerance, which is the gap that is left."""
    scene, dt = SCENES["ellipsoid"], 0.02
    start = swarm.fill(scene, 4, speed=1.0, seed=2)
    limit = simulate(scene, start, swarm.Impact(contact_step=dt, shortest_flight=1e-12), 2.0).particles
    errors, energies = [], []
    for tolerance in (1e-8, 1e-12, 1e-16, 1e-20):
        found = simulate(scene, start, method_of(dt, 3e4, tolerance=tolerance, adaptive=True), 2.0)
        errors.append(np.linalg.norm(found.particles.position - limit.position, axis=0).max())
        energies.append(found.observables["energy_error"].max())
    for values in (errors, energies):
        slopes = -np.diff(np.log10(values))
        assert (slopes >= 1.0).all(), values
        assert slopes.mean() == pytest.approx(2.0, abs=0.4), values


def test_a_contact_by_hand():
    """Onto a plane wall and off it: one step of dt at the wall, where v_n turns, and both flights are straight."""
    scene = swarm.Scene([swarm.Plane((1.0, 0.0, 0.0))])
    start = swarm.Particles((-1.0, 0.0, 0.0), (2.0, 0.5, 0.0), 3.0)
    result = simulate(scene, start, method_of(0.1, 1e4, tolerance=1e-26, adaptive=True), 1.0)
    assert result.particles.position[:, 0] == pytest.approx([-0.8, 0.5, 0.0], abs=1e-12)
    assert result.particles.velocity[:, 0] == pytest.approx([-2.0, 0.5, 0.0], abs=1e-12)
    assert result.observables["impulse"][-1] == pytest.approx([3.0 * 4.0], rel=1e-11)
    assert result.observables["impacts"][-1] == 1


def test_a_contact_is_cut_at_the_frame():
    """A frame within the contact step: a chord of the time that is left, at whose end the particle is on the wall."""
    method = method_of(0.1, 1e4, tolerance=1e-28, adaptive=True)
    start = swarm.Particles((0.4, 0.3, 0.0), (0.3, 0.4, 0.0))
    result, chord = (simulate(SPHERE, start, m, 0.04) for m in (method, swarm.Impact(contact_step=0.04)))
    assert result.observables["energy_error"].max() <= 1e-13
    assert np.linalg.norm(result.particles.position) == pytest.approx(0.5, rel=1e-14)
    assert result.particles.position == pytest.approx(chord.particles.position, abs=1e-14)
    assert result.particles.velocity == pytest.approx(chord.particles.velocity, abs=1e-13)
    assert result.multipliers.contacts.tolist() == [1]


def test_a_contact_that_is_cut_takes_no_more_sweeps():
    """The rate of the loop depends on alpha h^2, so a shorter step gets a larger alpha."""
    start, method = swarm.Particles((0.4, 0.3, 0.0), (0.3, 0.4, 0.0)), method_of(0.1, 1e4, adaptive=True)
    sweeps = [simulate(SPHERE, start, method, until).observables["sweeps"][-1] for until in (0.1, 0.01, 1e-3, 1e-4)]
    assert sweeps[0] >= sweeps[1] >= sweeps[2] >= sweeps[3] >= 1
    plain = simulate(SPHERE, start, method_of(1e-3, 1e4, adaptive=True, max_sweeps=5000), 1e-3)
    assert plain.observables["sweeps"][-1] > 20 * sweeps[2]


# --- The paper's fixed steps ------------------------------------------------------------------------------


def test_state_one_converges():
    """The paper's contact: 13 sweeps, E = 0.12499775; as `contact_history` tells it."""
    result = simulate(SPHERE, STATE_ONE, method_of(), 0.525)
    assert result.observables["sweeps"][-1] == 13
    assert result.observables["kinetic_energy"][-1] == pytest.approx(0.1249977520218393, rel=1e-9)
    assert result.particles.position[:, 0] == pytest.approx([0.39791540381831, 0.30275962393705147, 0.0], rel=1e-9)


@pytest.mark.parametrize(
    ("particles", "keywords", "parts"),
    [
        (STATE_TWO, {}, ["particle 1", "step from 0.475 s (step 20 of dt)", "50 sweeps", "V = 0.00105 J", "1e-10 J"]),
        (STATE_ONE, {"exponent": 1.5}, ["particle 1", "from 0.5 s (step 21 of dt)", "50 sweeps", "V = 0.000316 J"]),
        (STATE_ONE, {"max_sweeps": 5}, ["particle 1", "from 0.5 s (step 21 of dt)", "5 sweeps", "tolerance = 1e-10"]),
        (STATE_ONE, {"max_sweeps": 5, "adaptive": True}, ["particle 1", "from 0.5 s", "5 sweeps"]),
    ],
    ids=["state II", "exponent", "sweeps", "adaptive"],
)
def test_raise_names_the_contact(particles, keywords, parts):
    """Step, particle, sweeps, V, and what helps; the first particle here meets no wall."""
    resting = swarm.Particles(
        np.column_stack([[0.1, 0.0, 0.0], particles.position]), np.column_stack([np.zeros(3), particles.velocity])
    )
    with pytest.raises(swarm.RunError) as caught:
        simulate(SPHERE, resting, method_of(**keywords), 1.0)
    assert all(part in str(caught.value) for part in parts), str(caught.value)
    history = swarm.contact_history(
        SPHERE,
        particles.position[:, 0] + (0.475 if particles is STATE_TWO else 0.5) * particles.velocity[:, 0],
        particles.velocity[:, 0],
        1.0,
        method_of(**keywords),
    )
    assert f"V = {history.stored_energy[-1]:.3g} J" in str(caught.value)


def test_count_goes_on():
    """The contact is accepted as it is, and counted."""
    result = simulate(SPHERE, STATE_TWO, method_of(on_unconverged="count"), 0.5, 0.025)
    assert result.observables["unconverged"].tolist() == [0] * 20 + [1]
    assert result.multipliers.unconverged.tolist() == [1]
    assert result.multipliers.sweeps.tolist() == [50]
    history = swarm.contact_history(
        SPHERE, STATE_TWO.position[:, 0] + 0.475 * STATE_TWO.velocity[:, 0], STATE_TWO.velocity[:, 0], 1.0, method_of()
    )
    assert result.particles.position[:, 0] == pytest.approx(history.position[-1], rel=1e-12)
    assert result.multipliers.stored_energy[0] == pytest.approx(history.stored_energy[-1], rel=1e-9)


@pytest.mark.parametrize("name", SCENES)
def test_impact_replaces_the_contact(name):
    """Then fixed steps are the exact billiard: energy to round-off, and never outside."""
    scene = SCENES[name]
    start = swarm.fill(scene, 4, speed=1.0, seed=3)
    method = method_of(1.0 / 64.0, 1e4, max_sweeps=3, tolerance=1e-20, on_unconverged="impact")
    found = simulate(scene, start, method, 3.0, 0.25)
    exact = simulate(scene, start, swarm.Impact(), 3.0)
    assert found.observables["unconverged"][-1] >= 6
    assert found.observables["impacts"][-1] == exact.observables["impacts"][-1]
    assert found.observables["max_penetration"].max() <= 2e-16
    assert speed2(found.particles) == pytest.approx(speed2(start), rel=1e-14)
    assert found.particles.position == pytest.approx(exact.particles.position, abs=1e-12)


@pytest.mark.parametrize("acceleration", ["none", "secant", "reflection"])
def test_impact_replaces_an_adaptive_contact(acceleration):
    method = method_of(0.02, 1e4, max_sweeps=1, tolerance=1e-20, adaptive=True, on_unconverged="impact")
    start = swarm.fill(SPHERE, 4, speed=1.0, seed=3)
    found, exact = (simulate(SPHERE, start, m, 3.0) for m in (method, swarm.Impact()))
    assert found.particles.position == pytest.approx(exact.particles.position, abs=1e-12)
    assert found.observables["unconverged"][-1] == exact.observables["impacts"][-1]


@pytest.mark.parametrize("acceleration", ["secant", "reflection"])
@pytest.mark.parametrize("policy", ["raise", "count", "impact"])
def test_state_two_is_never_accepted_silently(acceleration, policy):
    """Whatever the policy: an error, a count, or the exact contact; and not 80 % of the energy gone."""
    method = method_of(acceleration=acceleration, on_unconverged=policy)
    try:
        result = simulate(SPHERE, STATE_TWO, method, 0.5)
    except swarm.RunError:
        assert policy == "raise"
        return
    assert policy != "raise"
    assert result.observables["unconverged"][-1] == 1
    if policy == "impact":
        assert result.observables["energy_error"][-1] <= 1e-14


# --- Edges, corners, and walls that are only touched -------------------------------------------------------


TURN, _ = np.linalg.qr(np.array([[1.0, 2.0, 3.0], [0.0, 1.0, 4.0], [5.0, 6.0, 0.0]]))
FACES = [sign * face for face in np.eye(3) for sign in (1.0, -1.0)]


@pytest.mark.parametrize("turn", [np.eye(3), TURN], ids=["straight", "turned"])
@pytest.mark.parametrize("aim", [(1.0, 1.0, 1.0), (1.0, 1.0, 0.0), (1.0, -1.0, 0.3)])
@pytest.mark.parametrize("acceleration", ["none", "reflection"])
def test_into_edges_and_corners(turn, aim, acceleration):
    """From the centre of a box, 12 crossings: every contact converges, with its energy."""
    scene = swarm.Scene([swarm.Plane(tuple(turn @ face), 0.5) for face in FACES])
    method = method_of(0.02, 1e6, tolerance=1e-24, max_sweeps=99, adaptive=True, acceleration=acceleration)
    result = simulate(scene, swarm.Particles(np.zeros(3), turn @ aim), method, 12.0, 1.0)
    assert result.observables["energy_error"].max() <= 1e-12
    assert result.observables["max_penetration"].max() <= 1e-15
    assert result.observables["impulse"][-1].sum() >= 2.0 * 11.0


@pytest.mark.parametrize("policy", ["raise", "impact"])
def test_a_wedge_of_one_radian(policy):
    """Into its edge and past it: the particles come out again, with their energy up to lambda Phi1 a contact."""
    side = swarm.Plane((-math.sin(1.0), math.cos(1.0), 0.0), 0.0)
    scene = swarm.Scene([swarm.Plane((0.0, -1.0, 0.0), 0.0), side, swarm.Sphere(1.0, (0.1, 0.05, 0.0))])
    part = np.linspace(0.1, 0.9, 3)
    start = 0.9 * np.array([np.cos(part), np.sin(part), 0.0 * part])
    for velocity in (-start / 0.9, np.array([-1.0 + 0.0 * part, 0.0 * part, 0.1 + 0.0 * part])):
        method = method_of(
            0.01, tolerance=1e-24, max_sweeps=99, adaptive=True, acceleration="reflection", on_unconverged=policy
        )
        result = simulate(scene, swarm.Particles(start, velocity), method, 4.0, 1.0)
        assert result.observables["unconverged"][-1] == 0
        assert result.observables["energy_error"].max() <= 1e-11
        assert result.observables["max_penetration"].max() <= 1e-14


@pytest.mark.parametrize(
    ("name", "position", "velocity"),
    [
        (
            "cut sphere",
            (0.272642226372063, 0.13365850409250735, 0.3972425212419209),
            (0.7133738760484305, 0.34972016770868447, -0.6072837205700875),
        ),
        (
            "ball",
            (-0.02612934291505777, 0.10734159029816563, -0.16671844658311832),
            (0.9794242094814489, -0.0605782233974933, -0.1925058355781516),
        ),
    ],
    ids=["down to an edge", "past a solid"],
)
def test_along_a_wall(name, position, velocity):
    """A tangential launch takes a bounded number of steps."""
    ball = swarm.Scene([swarm.Sphere(0.5), swarm.Sphere(0.2, side="outside")])
    scene = {**SCENES, "ball": ball}[name]
    method = method_of(0.01, 1e6, tolerance=1e-28, max_sweeps=99, adaptive=True)
    with mock.patch.object(blocks, "MOST_HITS", 1000.0):
        result = simulate(scene, swarm.Particles(position, velocity), method, 2.0)
    assert result.observables["energy_error"].max() <= 1e-12
    assert result.observables["max_penetration"].max() <= 1e-14


# --- Reports ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("adaptive", [False, True])
def test_multipliers_add_up(adaptive):
    """Totals of the particles are the observables'; a contact has a sweep at least, and at most max_sweeps."""
    start = swarm.fill(SPHERE, 6, speed=1.0, seed=4)
    method = method_of(1.0 / 64.0, 1e5, tolerance=1e-6, adaptive=adaptive, max_sweeps=30, on_unconverged="count")
    result = simulate(SPHERE, start, method, 2.0, 0.5)
    contact, seen = result.multipliers, result.observables
    assert contact.sweeps.sum() == seen["sweeps"][-1]
    assert contact.unconverged.sum() == seen["unconverged"][-1]
    for name in ("sweeps", "unconverged", "impacts"):
        assert (np.diff(seen[name]) >= 0).all()
        assert seen[name][0] == 0
    assert (contact.contacts >= 1).all()
    assert (contact.sweeps >= contact.contacts).all()
    assert (contact.sweeps <= 30 * contact.contacts).all()
    assert (contact.unconverged <= contact.contacts).all()
    assert ((contact.stored_energy <= 1e-6) == (contact.unconverged == 0)).all()
    if adaptive:
        assert contact.unconverged.sum() == 0


def test_accelerations_take_fewer_sweeps():
    start, sweeps = swarm.fill(SPHERE, 4, speed=1.0, seed=5), []
    for acceleration in ("none", "secant", "reflection"):
        method = method_of(0.02, 1e4, tolerance=1e-24, adaptive=True, max_sweeps=99, acceleration=acceleration)
        result = simulate(SPHERE, start, method, 2.0)
        sweeps.append(result.observables["sweeps"][-1] / result.multipliers.contacts.sum())
    assert sweeps[0] > 2.0 * sweeps[1] > 4.0 * sweeps[2]


def test_other_methods_have_no_multipliers():
    for method in (swarm.Impact(), swarm.Penalty(0.025, 1e4)):
        result = simulate(SPHERE, STATE_ONE, method, 0.5)
        assert result.multipliers is None
        assert "sweeps" not in result.observables
        assert result.observables["unconverged"].tolist() == [0, 0]


def test_gravity_with_fixed_steps():
    """m v^2/2 - m G.r stays within the tolerance; on a floor the bounce is State I where a step ends on it."""
    scene = swarm.Scene([swarm.Plane((0.0, 0.0, -1.0), 0.0)], gravity=(0.0, 0.0, -8.0))
    # From 1 m in 0.5 s: 32 steps.
    start = swarm.Particles((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), 2.0)
    result = simulate(scene, start, method_of(1.0 / 64.0, 1e6, tolerance=1e-24, max_sweeps=99), 0.75, 0.25)
    assert result.observables["unconverged"][-1] == 0
    assert result.observables["energy_error"].max() <= 1e-13
    assert result.observables["impacts"][-1] == 1


# --- Descriptions ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        ({"dt": 0.0}, ["dt", "above 0", "got 0"]),
        ({"dt": math.nan}, ["dt", "finite", "nan"]),
        ({"penalty": 0.0}, ["penalty", "above 0", "got 0"]),
        ({"penalty": -1.0}, ["penalty", "above 0", "got -1"]),
        ({"exponent": 0.99}, ["exponent", "1 or more", "got 0.99"]),
        ({"exponent": math.inf}, ["exponent", "finite"]),
        ({"tolerance": 0.0}, ["tolerance", "above 0", "got 0"]),
        ({"tolerance": -1e-10}, ["tolerance", "above 0", "got -1e-10"]),
        ({"max_sweeps": 0}, ["max_sweeps", "1 or more", "got 0"]),
        ({"max_sweeps": 2.5}, ["max_sweeps", "whole number", "got 2.5"]),
        ({"max_sweeps": True}, ["max_sweeps", "whole number", "True"]),
        ({"gradient": "scalar"}, ["gradient", "'composite'", "'mean-value'", "'scalar'"]),
        ({"gradient": "mean-value"}, ["gradient", "composite", "exponent = 1", "jumps at the surface"]),
        ({"adaptive": "yes"}, ["adaptive", "true or false", "'yes'"]),
        ({"adaptive": 1}, ["adaptive", "true or false", "got 1"]),
        ({"acceleration": "secants"}, ["acceleration", "'secants'", "did you mean 'secant'"]),
        ({"acceleration": None}, ["acceleration", "'none'", "None"]),
        ({"on_unconverged": "ignore"}, ["on_unconverged", "'raise'", "'count'", "'impact'", "'ignore'"]),
    ],
)
def test_errors_name_the_argument(arguments, parts):
    with pytest.raises(swarm.SceneError) as caught:
        swarm.AugmentedLagrangian(**{"dt": 0.025, "penalty": 1e4, **arguments})
    assert all(part in str(caught.value) for part in parts), str(caught.value)


def test_numbers_are_converted():
    method = swarm.AugmentedLagrangian(np.float32(0.5), 10, 2, max_sweeps=np.int64(7), adaptive=np.bool_(True))
    assert [type(v) for v in (method.dt, method.penalty, method.exponent, method.max_sweeps, method.adaptive)] == [
        float,
        float,
        float,
        int,
        bool,
    ]


def test_a_step_longer_than_a_crossing_is_refused():
    """Only where it is cut at the impact: size/|v| of the fastest particle, here 0.5/2 s."""
    particles = swarm.Particles(np.zeros((3, 2)), [[0.1, 2.0], [0.0, 0.0], [0.0, 0.0]])
    method_of(0.25, adaptive=True).check(SPHERE, particles)
    method_of(0.26).check(SPHERE, particles)
    with pytest.raises(swarm.SceneError, match=r"dt must be at most the crossing time.* 0\.25 s.*got 0\.26"):
        method_of(0.26, adaptive=True).check(SPHERE, particles)


def test_a_solid_that_a_step_can_miss_is_refused():
    """With fixed steps; those that are cut see it."""
    particles = swarm.Particles((0.4, 0.0, 0.0), (1.0, 0.0, 0.0))
    with pytest.raises(swarm.SceneError, match=r"dt must be so small.*surfaces\[1\]"):
        method_of(0.5).check(SCENES["shell"], particles)
    method_of(0.1, adaptive=True).check(SCENES["shell"], particles)


@pytest.mark.parametrize(
    ("keywords", "parts"),
    [
        ({"adaptive": True}, ["adaptive = True", "gravity", "(0.0, 0.0, -9.8)", "on_unconverged", "Impact"]),
        ({"on_unconverged": "impact"}, ["on_unconverged", "impact", "gravity", "(0.0, 0.0, -9.8)"]),
    ],
)
def test_gravity_is_refused_where_it_is_not_supported(keywords, parts):
    scene = swarm.Scene([swarm.Sphere(0.5)], gravity=(0.0, 0.0, -9.8))
    method_of().check(scene, STATE_ONE)
    with pytest.raises(swarm.SceneError) as caught:
        swarm.simulate(scene, STATE_ONE, method_of(**keywords), until=0.5, threads=1)
    assert all(part in str(caught.value) for part in parts), str(caught.value)


def test_frames_fall_on_whole_steps():
    """Of fixed steps; steps that are cut at impacts are cut at frames too."""
    assert method_of().span("until", 0.5) == 20.0
    with pytest.raises(swarm.SceneError, match=r"every must be a whole number of steps.*every = 0\.03 .*dt = 0\.025"):
        swarm.simulate(SPHERE, STATE_ONE, method_of(), until=0.5, every=0.03, threads=1)
    assert method_of(adaptive=True).span("until", 0.51) == 0.51
