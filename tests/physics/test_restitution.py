"""Impacts that lose energy: heights and times of bounces, rest in finite time, and the account of what is lost."""

import math

import numpy as np
import pytest
from energy_books import unbooked
from physics.billiards import EPSILON, run

import swarm

pytestmark = pytest.mark.physics

G = 9.81
DOWN = (0.0, 0.0, -G)


def cut_sphere(e, gravity=None):
    """A sphere and two planes, with their restitutions; the floor is at z = -0.3."""
    walls = [
        swarm.Sphere(0.7, restitution=e[0]),
        swarm.Plane((0.0, 0.0, -1.0), 0.3, restitution=e[1]),
        swarm.Plane((1.0, 0.2, -0.1), 0.4, restitution=e[2]),
    ]
    return swarm.Scene(walls, gravity)


def account(result):
    """Largest change of total + dissipated energy, relative to the largest of either."""
    observables = result.observables
    size = max(np.abs(observables[name]).max() for name in ("total_energy", "kinetic_energy", "dissipated_energy"))
    return unbooked(observables) / size


@pytest.mark.parametrize("e", [0.9, 0.5])
def test_bounces_are_e_times_as_fast(e):
    """Impact k at t_0 (1 + 2 (e + ... + e^(k-1))); then up to e^(2k) h."""
    height = 0.4
    fall = math.sqrt(2.0 * height / G)
    start = swarm.Particles([0.05, 0.0, height - 0.3], [0.0, 0.0, 0.0])
    time = fall
    for k in range(1, 7):
        top = time + fall * e**k
        end = run(cut_sphere((1.0, e, 1.0), DOWN), start, swarm.Impact(), top)
        assert end.observables["impacts"][-1] == k
        assert end.particles.position[2, 0] + 0.3 == pytest.approx(e ** (2 * k) * height, abs=1e-14)
        assert end.particles.velocity[2, 0] == pytest.approx(0.0, abs=1e-13)
        lost = G * height * (1.0 - e ** (2 * k))
        assert end.observables["dissipated_energy"][-1] == pytest.approx(lost, rel=1e-13)
        time += 2.0 * fall * e**k


@pytest.mark.parametrize("e", [0.95, 0.8, 0.3, 0.0])
def test_it_comes_to_rest_in_finite_time(e):
    """At sqrt(2h/g) (1 + e)/(1 - e), to the shortest flight; all of m g h is lost, and the floor carries the weight."""
    height, mass, until = 0.4, 2.0, 20.0
    scene = cut_sphere((1.0, e, 1.0), DOWN)
    start = swarm.Particles([0.05, 0.0, height - 0.3], [0.0, 0.0, 0.0], mass)
    rest = math.sqrt(2.0 * height / G) * (1.0 + e) / (1.0 - e)
    # With e < 1 what is left of the bounces when they are cut short lasts (1 + e)/(1 - e) of the shortest flight.
    slack = 1e-4 * 0.5 / math.sqrt(G * 0.5) * (1.0 + e) / (1.0 - e)
    moving = run(scene, start, swarm.Impact(), rest - 2.0 * slack - 1e-9)
    assert moving.observables["kinetic_energy"][-1] > 0.0
    still = run(scene, start, swarm.Impact(), rest + 2.0 * slack)
    assert still.observables["kinetic_energy"][-1] == 0.0
    end = run(scene, start, swarm.Impact(), until)
    assert (end.particles.velocity == 0.0).all()
    assert end.particles.position[:, 0] == pytest.approx([0.05, 0.0, -0.3], abs=2.0 * EPSILON)
    assert end.observables["impacts"][-1] < 1000
    assert end.observables["dissipated_energy"][-1] == pytest.approx(mass * G * height, rel=1e-14)
    # Momentum: nothing moves, so the floor has given back all that gravity gave.
    assert end.observables["impulse"][-1] == pytest.approx([0.0, mass * G * until, 0.0], rel=1e-12)


@pytest.mark.parametrize("gravity", [None, (1.0, 2.0, -9.0)], ids=["no gravity", "gravity"])
@pytest.mark.parametrize("e", [(0.9, 0.9, 0.9), (0.9, 0.5, 1.0), (1.0, 0.0, 0.5), (0.0, 0.0, 0.0), (1e-3, 1e-8, 0.999)])
def test_the_account_of_energy_closes(e, gravity):
    """Total + dissipated energy: from fast impacts down to rest and sliding along edges, inside."""
    scene = cut_sphere(e, gravity)
    start = swarm.fill(scene, 20, speed=1.0, seed=4)
    result = run(scene, start, swarm.Impact(), 4.0, 0.25, "always")
    dissipated = result.observables["dissipated_energy"]
    assert dissipated[-1] > 0.1 * result.observables["kinetic_energy"][0]
    assert (np.diff(dissipated) >= 0.0).all()
    assert account(result) <= 1e-14
    assert result.observables["energy_error"].max() <= 1e-14
    assert result.observables["max_penetration"].max() <= 4.0 * np.spacing(0.7)
    assert result.observables["impacts"][-1] <= 20 * 4e5


@pytest.mark.parametrize("speed", [1e-8, 1.0, 1e8])
def test_head_on_without_restitution_it_stops(speed):
    """What is left is the round-off of what is lost; it was once restored by a step that blew it up to NaN."""
    scene = cut_sphere((0.0, 0.0, 0.0))
    start = swarm.fill(scene, 500, speed=1.0, seed=9)
    radial = start.position / np.linalg.norm(start.position, axis=0)
    for velocity in (radial, np.array([[0.0], [0.0], [-1.0]]) + 0.0 * radial):
        result = run(scene, swarm.Particles(start.position, speed * velocity), swarm.Impact(), 3.0 / speed, 1.0 / speed)
        assert account(result) <= 1e-14
        assert np.abs(result.particles.velocity).max() <= speed
        assert result.observables["max_penetration"].max() <= 4.0 * np.spacing(0.7)
    # Straight down on the floor, or on the sphere on its way there.
    head_on = swarm.Particles([0.1, 0.1, 0.1], [0.0, 0.0, -speed])
    end = run(scene, head_on, swarm.Impact(), 3.0 / speed)
    assert np.abs(end.particles.velocity).max() <= 1e-7 * speed


def test_without_restitution_it_slides():
    """e = 0 keeps the velocity along the wall, which then follows the wall."""
    start = swarm.Particles([0.0, 0.0, 0.0], [0.6, 0.0, -0.8])
    end = run(cut_sphere((1.0, 0.0, 1.0)), start, swarm.Impact(), 0.5)
    assert end.particles.position[:, 0] == pytest.approx([0.3, 0.0, -0.3], abs=1e-15)
    assert end.particles.velocity[:, 0] == pytest.approx([0.6, 0.0, 0.0], abs=1e-15)
    assert end.observables["dissipated_energy"][-1] == pytest.approx(0.32, rel=1e-14)


@pytest.mark.parametrize("e", [0.9, 0.5, 0.0])
def test_sliding_in_a_bowl_loses_next_to_nothing(e):
    """Along the wall there is no impact; the steps lose 1e-10 of the energy in 10 s."""
    angle = 1.0
    r = 0.7 * np.array([math.sin(angle) * 0.6, math.sin(angle) * -0.8, math.cos(angle)])
    scene = swarm.Scene(
        [swarm.Sphere(0.7, restitution=e), swarm.Plane((0.0, 0.0, -1.0), 5.0), swarm.Plane((1.0, 0.0, 0.0), 5.0)], DOWN
    )
    result = run(scene, swarm.Particles([r[0], r[1], -r[2]], [0.0] * 3), swarm.Impact(), 10.0, 0.5)
    assert 0.0 <= result.observables["dissipated_energy"][-1] <= 1e-9 * G * 0.7
    assert account(result) <= 1e-14


@pytest.mark.parametrize("half", [1.2, math.pi / 4.0, 0.4, 0.1, 0.02])
@pytest.mark.parametrize("e", [0.5, 0.0])
def test_it_comes_to_rest_in_a_groove(half, e):
    """However acute: one wall after the other took next to nothing there, and the rest was reflected."""
    walls = [swarm.Plane((s * math.cos(half), 0.0, -math.sin(half)), 0.0, restitution=e) for s in (1.0, -1.0)]
    scene = swarm.Scene([swarm.Sphere(0.7), *walls], DOWN)
    result = run(scene, swarm.Particles([0.1 * half, 0.0, 0.3], [0.0] * 3), swarm.Impact(), 10.0)
    assert (result.particles.velocity == 0.0).all()
    assert abs(result.particles.position[2, 0]) <= 1e-8
    assert result.observables["dissipated_energy"][-1] == pytest.approx(0.3 * G, rel=1e-7)
    assert account(result) <= 1e-14
    # Both walls together carry the weight.
    assert math.sin(half) * result.observables["impulse"][-1][1:].sum() == pytest.approx(10.0 * G, rel=1e-9)


def test_it_comes_to_rest_in_a_corner():
    """All particles in the same place, where sphere and planes meet, and nothing moves."""
    scene = cut_sphere((0.5, 0.8, 0.3), (1.0, 2.0, -9.0))
    result = run(scene, swarm.fill(scene, 5, speed=1.0, seed=4), swarm.Impact(), 20.0)
    assert (result.particles.velocity == 0.0).all()
    assert np.ptp(result.particles.position, axis=1).max() <= 1e-9
    assert np.abs(scene.gaps(result.particles.position)).max() <= 1e-9
    assert account(result) <= 1e-14


@pytest.mark.parametrize("gravity", [None, DOWN], ids=["no gravity", "gravity"])
def test_restitution_of_one_changes_no_bit(gravity):
    bare = swarm.Scene(
        [swarm.Sphere(0.7), swarm.Plane((0.0, 0.0, -1.0), 0.3), swarm.Plane((1.0, 0.2, -0.1), 0.4)], gravity
    )
    given = cut_sphere((1.0, 1.0, 1.0), gravity)
    assert given.compiled().laws is None
    start = swarm.fill(bare, 40, speed=1.0, seed=5)
    one, two = (run(scene, start, swarm.Impact(), 3.0, compile="never") for scene in (bare, given))
    assert (one.particles.position == two.particles.position).all()
    assert (one.particles.velocity == two.particles.velocity).all()


# --- Errors ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "method",
    [swarm.Verlet(dt=1e-3, penalty=1e4), swarm.Midpoint(dt=1e-3, penalty=1e4)],
    ids=["Verlet", "implicit midpoint"],
)
def test_baselines_refuse_it(method):
    scene = cut_sphere((1.0, 0.9, 1.0))
    with pytest.raises(swarm.SceneError, match=r"surfaces\[1\]\.restitution must be 1 .*got 0\.9"):
        run(scene, swarm.Particles([0.0] * 3, [1.0, 0.0, 0.0]), method, 1.0)
    for law in ("friction", "temperature"):
        other = swarm.Scene([swarm.Sphere(0.7, **{law: 0.5})])
        with pytest.raises(swarm.SceneError, match=rf"surfaces\[0\]\.{law} must be .*got 0\.5; use Impact"):
            run(other, swarm.Particles([0.0] * 3, [1.0, 0.0, 0.0]), method, 1.0)


def test_a_contact_step_refuses_it():
    with pytest.raises(swarm.SceneError, match=r"contact_step must be 0 .*restitution"):
        run(cut_sphere((1.0, 0.9, 1.0)), swarm.Particles([0.0] * 3, [1.0, 0.0, 0.0]), swarm.Impact(1e-3), 1.0)


@pytest.mark.parametrize("e", [-0.1, 1.0 + 1e-9, math.nan, math.inf, "much", None])
def test_it_must_be_from_0_to_1(e):
    with pytest.raises(swarm.SceneError, match="restitution"):
        swarm.Sphere(1.0, restitution=e)
