"""Mechanisms of tied points: anchors that are led, guides, cavities that a point carries; and elastic vibrations."""

import math

import numpy as np
import pytest
from bodies_reference import bobs, double_pendulum, longitudinal

import swarm
from examples import pendulum_in_cavity, slider_crank
from swarm.bodies.elastic import block

FAR = [swarm.Sphere(10.0)]
DOWN = (0.0, 0.0, -9.81)


def at_rest(body):
    """As much as anchors that are led along a link let it be."""
    return swarm.Bodies(body, body.points.T[:, :, None], np.zeros((3, len(body), 1)), project=True)


def run(bodies, until, dt, order=2, gravity=DOWN, walls=FAR, **options):
    scene = swarm.Scene(walls, gravity=gravity)
    return swarm.simulate(scene, bodies, swarm.Impact(dt=dt, order=order), until=until, **options)


# --- Against other software --------------------------------------------------------------------------------


@pytest.mark.parametrize("order", [2, 4])
def test_a_double_pendulum_converges_with_its_order_to_dop853(order):
    lengths, masses, angles, rates = (0.3, 0.2), (1.0, 2.0), np.array([0.7, -0.4]), np.array([0.5, 1.0])
    points, velocity = bobs(lengths, angles, rates)
    exact = bobs(lengths, *double_pendulum(lengths, masses, angles, rates, 9.81, 0.5))[0]
    body = swarm.Body(points.T, mass=[1.0, *masses], links=[(0, 1), (1, 2)], anchors={0: None})
    start = swarm.Bodies(body, points[:, :, None], velocity[:, :, None])
    coarse, fine = (np.abs(run(start, 0.5, dt, order).bodies.position[:, :, 0] - exact).max() for dt in (4e-3, 2e-3))
    assert math.log2(coarse / fine) == pytest.approx(order, abs=0.25)


@pytest.mark.parametrize("order", [2, 4])
def test_a_bar_vibrates_with_its_eigenfrequency(order):
    body = swarm.elastic(block((0.4, 0.1, 0.1), (3, 1, 1)), 1e6, 0.3, 1000.0)
    frequency, mode = longitudinal(body)
    # So small that the strain is linear.
    amplitude = 1e-8 * 0.4 / np.abs(mode).max()
    period = 2.0 * math.pi / frequency
    position = body.points.T + amplitude * mode
    start = swarm.Bodies(body, position[:, :, None], np.zeros((*position.shape, 1)))

    def phase_error(steps):
        # At a fourth of a period the mode passes through 0; what is left is the error of the phase.
        end = run(start, 1.25 * period, period / steps, order, gravity=None).bodies
        left = np.einsum("xp,pq,xq->", mode, body.mass_matrix, end.position[:, :, 0] - body.points.T)
        return abs(left) / amplitude

    coarse, fine = (phase_error(steps) for steps in ((40, 80) if order == 2 else (20, 40)))
    assert math.log2(coarse / fine) == pytest.approx(order, abs=0.3)
    assert fine < 0.02


# --- Guides ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("order", [2, 4])
@pytest.mark.parametrize("tier", ["always", "never"])
def test_a_bead_stays_on_its_surface_and_keeps_its_energy(order, tier):
    guide = swarm.Sphere(0.3)
    body = swarm.Body([[0.3, 0, 0], [0.5, 0.1, -0.2]], mass=1.0, links=[(0, 1)], guides=[(0, guide)])
    result = run(at_rest(body), 0.5 if tier == "never" else 5.0, 5e-3, order, compile=tier)
    assert result.observables["energy_error"].max() < 1e-13
    assert np.linalg.norm(result.bodies.position[:, 0, 0]) == pytest.approx(0.3, abs=1e-14)


def test_a_bead_slides_down_a_cylinder_like_a_pendulum():
    # A bead on a sphere of radius R swings in a vertical plane as a pendulum of length R.
    angle, radius = 0.5, 0.3
    start = radius * np.array([[math.sin(angle), 0.0, -math.cos(angle)]])
    body = swarm.Body(start, mass=1.0, guides=[(0, swarm.Sphere(radius))])
    ends = [run(at_rest(body), 0.4, dt).bodies.position[0, 0, 0] for dt in (2e-3, 1e-3)]
    lengths = (radius, 1.0)
    exact = bobs(lengths, *double_pendulum(lengths, (1.0, 0.0), [angle, 0.0], [0.0, 0.0], 9.81, 0.4))[0][0, 1]
    errors = np.abs(np.array(ends) - exact)
    assert math.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.2)


# --- Anchors that are led --------------------------------------------------------------------------------

LED = {
    "oscillation": swarm.Oscillation((0.05, 0.0, 0.02), 1.3),
    "rotation": swarm.Rotation((0.0, 1.0, 0.2), 4.0, (0.1, 0.0, 0.0)),
    "translation": swarm.Translation((0.3, -0.1, 0.2)),
}


def led_pendulum(motion):
    return swarm.Body([[0, 0, 0], [0.3, 0, 0]], mass=1.0, links=[(0, 1)], anchors={0: motion})


@pytest.mark.parametrize("order", [2, 4])
@pytest.mark.parametrize("name", LED)
def test_the_work_of_a_led_anchor_is_the_change_of_the_energy(name, order):
    motion = LED[name]
    result = run(at_rest(led_pendulum(motion)), 3.0, 5e-3, order, every=0.5)
    seen = result.observables
    assert np.ptp(seen["work"]) > 0.01
    assert seen["energy_error"].max() < 1e-13
    path = motion.harmonic((0.0, 0.0, 0.0))
    np.testing.assert_allclose(result.bodies.position[:, 0, 0], path.position(3.0), rtol=0.0, atol=1e-13)


def test_a_steady_translation_changes_nothing():
    # In the frame of an anchor that moves steadily the pendulum is one with a fixed anchor.
    drift = np.array([0.3, -0.1, 0.2])
    body, fixed = led_pendulum(swarm.Translation(tuple(drift))), led_pendulum(None)
    velocity = np.zeros((3, 2, 1)) + drift[:, None, None]
    end = run(swarm.Bodies(body, body.points.T[:, :, None], velocity), 1.0, 5e-3).bodies.position[:, 1, 0]
    still = run(at_rest(fixed), 1.0, 5e-3).bodies.position[:, 1, 0]
    np.testing.assert_allclose(end - drift, still, rtol=0.0, atol=1e-12)


def test_a_resumed_run_with_a_led_anchor_has_the_same_bits(tmp_path):
    start, path = at_rest(led_pendulum(LED["oscillation"])), tmp_path / "led.h5"
    how = {"every": 0.5, "compile": "always"}
    whole = run(start, 2.0, 5e-3, **how).bodies.position

    def stop(frame):
        if frame.number == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(start, 2.0, 5e-3, trajectory=path, checkpoint=0.01, progress=stop, **how)
    found = (tmp_path / "led.h5.checkpoint").exists()
    end = run(start, 2.0, 5e-3, trajectory=path, checkpoint=0.01, resume=found, overwrite=True, **how).bodies.position
    np.testing.assert_array_equal(end, whole)


# --- Cavities that a point carries -------------------------------------------------------------------------


@pytest.mark.parametrize("tier", ["always", "never"])
def test_two_points_in_one_cavity_keep_momentum_and_energy(tier):
    # A heavy carrier and a light point that rattles in its cavity, in free flight.
    body = swarm.Body(
        [[0, 0, 0], [0.02, 0, 0]], mass=[3.0, 1.0], cavities=[(swarm.Sphere(0.1), 0, 1)], contacts=np.zeros((0, 2))
    )
    velocity = np.array([[0.0, 0.7], [0.1, -0.4], [0.0, 0.3]])[:, :, None]
    until = 2.0 if tier == "never" else 50.0
    start = swarm.Bodies(body, body.points.T[:, :, None], velocity)
    result = run(start, until, 5e-3, gravity=None, walls=[swarm.Sphere(100.0)], every=until / 4, compile=tier)
    seen = result.observables
    assert seen["impacts"][-1] > 5
    assert seen["energy_error"].max() < 1e-13
    assert np.abs(seen["momentum"] - seen["momentum"][0]).max() < 1e-13
    assert np.linalg.norm(result.bodies.position[:, 1, 0] - result.bodies.position[:, 0, 0]) <= 0.1 + 1e-14
    assert seen["cavity_impulse"][-1, 0] > 0.0


@pytest.mark.parametrize("restitution", [1.0, 0.5])
def test_the_impulse_in_a_carried_cavity_is_that_of_two_masses(restitution):
    masses, speed, clearance = (3.0, 1.0), 0.8, 0.01
    cavity = swarm.Sphere(clearance, restitution=restitution)
    body = swarm.Body([[0, 0, 0]] * 2, mass=masses, cavities=[(cavity, 0, 1)], contacts=np.zeros((0, 2)))
    velocity = np.zeros((3, 2, 1))
    velocity[0, 1] = speed
    end = run(swarm.Bodies(body, np.zeros((3, 2, 1)), velocity), 1.5 * clearance / speed, 1e-3, gravity=None)
    reduced = masses[0] * masses[1] / sum(masses)
    impulse = (1.0 + restitution) * reduced * speed
    assert end.observables["cavity_impulse"][-1] == pytest.approx([impulse], rel=1e-12)
    assert end.bodies.velocity[0, :, 0] == pytest.approx([impulse / masses[0], speed - impulse / masses[1]], rel=1e-12)


@pytest.mark.parametrize("restitution", [1.0, 0.9])
def test_a_slider_crank_with_a_clearance_keeps_its_energy(restitution):
    long, motion = slider_crank.run(20, restitution)
    seen = long.observables
    assert seen["impacts"][-1] > 500
    assert seen["energy_error"].max() < 1e-11
    assert seen["link_error"].max() < 1e-14
    assert np.linalg.norm(motion.pin, axis=0).max() <= slider_crank.CLEARANCE * (1.0 + 1e-9)
    # The rod's pin is within the clearance of the slider, and the slider on its line.
    assert np.abs(motion.slider - slider_crank.ideal(motion.time)).max() < 2.0 * slider_crank.CLEARANCE
    assert motion.force.min() >= 0.0


def test_a_pendulum_in_a_cavity_keeps_its_energy():
    seen = pendulum_in_cavity.run(5.0).observables
    assert seen["impacts"][-1] >= 2
    assert seen["energy_error"].max() < 1e-12
    assert seen["max_penetration"].max() < 1e-13


# --- Contacts that last ------------------------------------------------------------------------------------


def test_a_chain_that_whips_along_the_wall_keeps_its_energy():
    walls = [swarm.Sphere(0.5)]
    chain = swarm.chain(10, 0.4, 1.0)
    start = swarm.place(swarm.Scene(walls), chain, 8, speed=1.0, spin=4.0, seed=1)
    seen = run(start, 3.0, 5e-3, walls=walls, every=1.0).observables
    assert seen["sliding_time"][-1] > 0.0
    assert seen["energy_error"].max() < 1e-10
    assert seen["max_penetration"].max() < 1e-12


def test_a_rod_whose_end_slides_on_a_floor_keeps_its_energy():
    # Without friction its centre falls straight down.
    body = swarm.Body([[0, 0, 0], [0.06, 0, 0.08]], mass=1.0, links=[(0, 1)], contacts=[0])
    walls = [swarm.Plane((0.0, 0.0, -1.0), 0.0, restitution=0.0), swarm.Sphere(10.0)]
    # A hundred steps: a tenth of a second of plain Python, and six to compile.
    result = run(at_rest(body), 0.5, 5e-3, gravity=(0.0, 0.0, -1.0), walls=walls, compile="never")
    seen = result.observables
    assert seen["sliding_time"][-1] > 0.4
    assert seen["energy_error"].max() < 1e-13
    assert result.bodies.position[0, :, 0].sum() == pytest.approx(0.06, abs=1e-13)
    # The weight and what lifts the centre: the momentum is what gravity and the floor gave.
    down = result.bodies.velocity[2, :, 0].sum()
    assert seen["impulse"][-1, 0] - 2.0 * 0.5 == pytest.approx(down, abs=1e-12)


# --- What is refused ---------------------------------------------------------------------------------------


def test_a_led_point_with_a_coupled_mass_is_refused():
    matrix = np.array([[2.0, 0.5], [0.5, 2.0]])
    with pytest.raises(swarm.SceneError, match="no mass coupling"):
        swarm.Body([[0, 0, 0], [0.1, 0, 0]], mass_matrix=matrix, links=[(0, 1)], anchors={0: LED["translation"]})


def test_a_guide_with_friction_is_refused():
    with pytest.raises(swarm.SceneError, match=r"guides\[0\].friction must be 0"):
        swarm.Body([[0.3, 0, 0]], mass=1.0, guides=[(0, swarm.Sphere(0.3, friction=0.1))])
