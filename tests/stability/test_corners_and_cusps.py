"""Where two walls meet: springs are squeezed out of the edge, multipliers need ever more sweeps; Impact turns round."""

import math

import numpy as np
import pytest
from methods.passes import energy_of, run

import swarm

pytestmark = pytest.mark.physics

EPSILON = float(np.finfo(float).eps)
ALPHA = 1e4


def wedge(angle):
    """Between two planes at +-angle/2 about the x axis; its edge is the z axis, x > 0 is inside."""
    s, c = math.sin(0.5 * angle), math.cos(0.5 * angle)
    return swarm.Scene([swarm.Plane((-s, c, 0.0), 0.0), swarm.Plane((-s, -c, 0.0), 0.0)])


def farthest_out(scene, passes):
    """The largest gap of all passes."""
    return max(scene.gaps(one.position[:, None]).max() for one in passes)


# --- Edges -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("angle", [1.0, 0.1])
def test_springs_let_the_edge_pass(angle):
    """Each of the two springs brakes with sin(angle/2) of itself: beyond by v sqrt(m/2 alpha)/sin(angle/2)."""
    beyond = math.sqrt(0.5 / ALPHA) / math.sin(0.5 * angle)
    method = swarm.Penalty(beyond / 32.0, ALPHA)
    passes = run(method, wedge(angle), [0.5 * beyond, 0.0, 0.0], [-1.0, 0.0, 0.0], 150.0)
    assert min(one.position[0] for one in passes) == pytest.approx(-beyond, rel=1e-2)
    assert passes[-1].velocity[0] == pytest.approx(1.0, rel=1e-9)


@pytest.mark.parametrize("angle", [1.0, 0.1, 0.01])
def test_impact_turns_round_in_the_edge(angle):
    """The same launch, just off the bisector: at most pi/angle impacts and one more, never outside."""
    scene = wedge(angle)
    start = [1.0, 0.1 * angle, 0.0]
    passes = run(swarm.Impact(), scene, start, [-1.0, 0.0, 0.1], 3.0)
    assert passes[-1].velocity[0] > 0.9
    assert passes[-1].velocity @ passes[-1].velocity == pytest.approx(1.01, rel=4.0 * EPSILON)
    assert farthest_out(scene, passes) <= 2.0 * EPSILON
    assert len(passes) <= math.pi / angle + 3.0


def test_multipliers_of_a_sharp_edge_need_too_many_sweeps():
    """State I on both walls, exponent 1: their loops undo each other, the more the sharper the edge."""
    sweeps = {}
    for angle in (1.0, 0.5, 0.01):
        method = swarm.AugmentedLagrangian(0.01, 1e6 if angle > 0.1 else 1e4, tolerance=1e-12, max_sweeps=40)
        found = swarm.contact_history(wedge(angle), (0.0, 0.0, 0.0), (-1.0, 0.0, 0.1), 1.0, method)
        sweeps[angle] = len(found) if found.converged else math.inf
    assert sweeps[1.0] < sweeps[0.5] < sweeps[0.01] == math.inf
    assert abs(found.kinetic_energy[-1] / 0.505 - 1.0) > 1e-3


# --- Cusps -----------------------------------------------------------------------------------------------

# A ball that touches the wall from inside at (1, 0, 0): the slit between them is y^2/2 wide.
CUSP = swarm.Scene([swarm.Sphere(1.0), swarm.Sphere(0.5, (0.5, 0.0, 0.0), side="outside")])
PHI = 0.35
AIMED = 0.97 * np.array([math.cos(PHI), math.sin(PHI), 0.0])
TOWARDS = (np.array([1.0, 0.0, 0.0]) - AIMED) / np.linalg.norm(np.array([1.0, 0.0, 0.0]) - AIMED)


def test_springs_let_a_closed_slit_pass():
    """Both walls give way: through the point where they touch, with all of the energy."""
    passes = run(swarm.Penalty(2.0**-10, ALPHA), CUSP, AIMED, TOWARDS, 640.0)
    assert passes[-1].position[1] < -0.1
    energy = energy_of(swarm.Penalty(2.0**-10, ALPHA), CUSP, passes[-1].position, passes[-1].velocity)
    assert energy == pytest.approx(0.5, rel=1e-12)


def test_impact_turns_round_in_the_cusp():
    """In the plane of the launch there is no way past the tip."""
    passes = run(swarm.Impact(), CUSP, AIMED, TOWARDS, 0.625)
    assert min(one.position[1] for one in passes) > 0.0
    assert passes[-1].velocity[1] > 0.5
    assert passes[-1].velocity @ passes[-1].velocity == pytest.approx(1.0, rel=4.0 * EPSILON)
    assert farthest_out(CUSP, passes) <= 2.0 * EPSILON


@pytest.mark.parametrize("seed", range(3))
def test_no_step_leads_through_the_tip_of_a_cone(seed):
    """Particles that slide into the tip stay there: after steps through it frames ended 1e-6 m outside."""
    random, mu, g = np.random.default_rng(seed), 0.4, 9.81
    walls = {"restitution": 0.5, "friction": mu}
    scene = swarm.Scene([swarm.Cone(math.pi / 6.0, **walls), swarm.Plane((0.0, 0.0, 1.0), 1.5, **walls)], (0, 0, -g))
    angle, way, speed = random.uniform(0.0, 2.0 * math.pi), random.uniform(0.02, 0.05), 3.0
    down = -np.array([0.5 * math.cos(angle), 0.5 * math.sin(angle), math.cos(math.pi / 6.0)])
    pull = g * (math.cos(math.pi / 6.0) - 0.5 * mu)
    arrival = (math.sqrt(speed**2 + 2.0 * pull * way) - speed) / pull
    start = swarm.Particles(-way * (1.0 - 1e-12) * down, speed * down)
    for late in (5e-4, 1e-3):
        until = arrival * (1.0 + late)
        result = swarm.simulate(scene, start, until=until, every=until, compile="never")
        assert np.linalg.norm(result.particles.position) < 1e-9
        assert result.observables["max_penetration"].max() < 1e-10
