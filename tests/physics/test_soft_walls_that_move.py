"""Soft walls that move: the same physics in every frame of reference, work that balances the energy, and order 2."""

import math

import numpy as np
import pytest
from conftest import every_pair, gaps_along, rarely
from energy_books import unbooked

import swarm
from swarm.kernel.vector import vec
from swarm.methods import fixed_step
from swarm.motion import pose
from swarm.surfaces.time_of_impact import safe

pytestmark = pytest.mark.physics

VELOCITY = (0.3, -0.2, 0.1)
PULL = (0.2, 0.0, -1.0)
SWING = swarm.Oscillation((0.05, 0.03, 0.08), frequency=0.7, phase=0.4)
PATH = swarm.Path(
    times=tuple(np.linspace(0.0, 6.0, 13).tolist()),
    positions=tuple((0.04 * math.sin(k), 0.05 * math.cos(k) - 0.05, 0.03 * math.sin(2.0 * k)) for k in range(13)),
)
MOTIONS = {
    "translation": swarm.Translation(VELOCITY),
    "oscillation": SWING,
    "path": PATH,
    "sum": swarm.Translation(VELOCITY) + SWING + PATH,
}
CAVITIES = {
    "sphere": lambda motion: [swarm.Sphere(0.5, motion=motion)],
    "box": lambda motion: [swarm.Box((0.5, 0.4, 0.3), rotation=(1.0, 0.3, -0.2, 0.5), motion=motion)],
    "ellipsoid": lambda motion: [swarm.Ellipsoid((0.5, 0.6, 0.4), motion=motion)],
    "planes": lambda motion: [
        swarm.Plane((0.0, 0.2, -1.0), 0.3, motion=motion), swarm.Plane((0.3, 0.0, 1.0), 0.4, motion=motion),
    ],
    "torus": lambda motion: [swarm.Torus(0.6, 0.3, motion=motion)],
    "ball in a box": lambda motion: [
        swarm.Box((0.5, 0.5, 0.5), motion=motion), swarm.Sphere(0.2, side="outside", motion=motion),
    ],
}  # fmt: skip
DT = 5e-3
METHODS = {
    "penalty": swarm.Penalty(DT, 1e3),
    "hertz": swarm.Penalty(DT, 1e4, exponent=1.5),
    "verlet": swarm.Verlet(DT, 1e3),
    "midpoint": swarm.Midpoint(DT, 1e3),
    "trapezoidal": swarm.Trapezoidal(DT, 1e3),
}
# Whose gap is about a length in every cavity of these tests.
BALANCED = ("penalty", "hertz")


def run(scene, particles, method, until, frames=1, **options):
    return swarm.simulate(
        scene, particles, method, until=until, every=until / frames, **{"compile": "never", **options}
    )  # fmt: skip


def imbalance(result):
    """What the energy less the work has changed by, relative to the largest energy."""
    seen = result.observables
    return unbooked(seen) / np.abs(seen["total_energy"]).max()


def carried(particles, velocity=VELOCITY):
    return swarm.Particles(particles.position, particles.velocity + np.array(velocity)[:, None], particles.mass)


# --- Uniform motion: the trajectory at rest, transformed -------------------------------------------------


def require_the_same_run(surfaces, gravity, method, start, until, impacts, within=1e-10):
    """Walls in uniform motion do what they do at rest, seen from a frame that moves."""
    rest, moving = (swarm.Scene(surfaces(motion), gravity) for motion in (None, swarm.Translation(VELOCITY)))
    here, there = run(rest, start, method, until), run(moving, carried(start), method, until)
    assert here.observables["impacts"][-1] == there.observables["impacts"][-1] >= impacts
    shift = np.array(VELOCITY)[:, None]
    assert np.abs(there.particles.position - until * shift - here.particles.position).max() <= within
    assert np.abs(there.particles.velocity - shift - here.particles.velocity).max() <= 100.0 * within
    # The impulse of a wall does work at the velocity of all of them.
    kept = here.observables["total_energy"], there.observables["total_energy"]
    assert there.observables["wall_work"][0] == pytest.approx(0.0, abs=0.0)
    if gravity is None:
        given = start.mass * (there.particles.velocity - carried(start).velocity)
        work = float((given * shift).sum())
        assert there.observables["wall_work"][-1].sum() == pytest.approx(work, rel=1e-9, abs=1e-9)
        change = kept[0][-1] - kept[0][0]
        assert kept[1][-1] - kept[1][0] - work == pytest.approx(change, rel=1e-8, abs=1e-9)


@every_pair(name=["sphere", "box"], method=list(METHODS), gravity={"straight": None, "falling": PULL})
def test_a_cavity_in_uniform_motion_is_one_at_rest(name, method, gravity):
    start = swarm.fill(swarm.Scene(CAVITIES[name](None)), 3, speed=1.0, seed=3)
    require_the_same_run(CAVITIES[name], gravity, METHODS[method], start, 2.0, impacts=6)


@pytest.mark.parametrize("method", METHODS)
def test_planes_in_uniform_motion_are_planes_at_rest(method):
    start = swarm.Particles(np.zeros((3, 2)), [[0.1, -0.1], [0.2, 0.1], [1.0, -1.3]], [1.0, 2.0])
    require_the_same_run(CAVITIES["planes"], None, METHODS[method], start, 3.0, impacts=6)


@pytest.mark.parametrize("method", ["penalty", "verlet", "midpoint", "trapezoidal"])
def test_a_corner_in_uniform_motion_is_one_at_rest(method):
    """The particle presses on two walls at once, of which each does its part of the work."""

    def corner(motion):
        return [swarm.Plane(n, 0.2, motion=motion) for n in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))]

    start = swarm.Particles([0.0, 0.01, 0.0], [1.0, 0.9, 0.2], 2.0)
    require_the_same_run(corner, None, METHODS[method], start, 0.4, impacts=1)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", ["ellipsoid", "ball in a box"])
def test_curved_walls_in_uniform_motion_are_walls_at_rest(name, method):
    # |grad g| = 5 on the ellipsoid, so its wall is 25 times as stiff.
    made = METHODS[method]
    softer = type(made)(DT, 100.0, made.exponent) if name == "ellipsoid" else made
    start = swarm.fill(swarm.Scene(CAVITIES[name](None)), 2, speed=1.0, seed=5)
    require_the_same_run(CAVITIES[name], None, softer, start, 1.5, impacts=3)


def test_the_mean_value_form_in_uniform_motion():
    """One contact: its nested solves are slow."""
    method = swarm.Penalty(DT, 1e3, exponent=2.0, gradient="mean-value")
    start = swarm.Particles([0.3, 0.2, 0.1], [1.0, 0.3, 0.2], 1.0)
    require_the_same_run(CAVITIES["sphere"], None, method, start, 0.4, impacts=1)


# --- Work ------------------------------------------------------------------------------------------------


@every_pair(name=list(CAVITIES), motion=list(MOTIONS), gravity={"straight": None, "falling": PULL})
def test_penalty_balances_energy_and_work(name, motion, gravity):
    scene = swarm.Scene(CAVITIES[name](MOTIONS[motion]), gravity)
    closed = scene if name != "planes" else swarm.Scene([swarm.Sphere(0.25)])
    for method in BALANCED[: 1 if name == "torus" else None]:
        # Planes are met less often than the walls of a cavity.
        mass = np.array([0.5, 2.0, 1.0] if name == "planes" else [0.5, 2.0])
        start = swarm.fill(closed, len(mass), speed=1.0, mass=mass, seed=2)
        result = run(scene, start, METHODS[method], 2.0, frames=8)
        assert result.observables["impacts"][-1] >= 2
        assert imbalance(result) <= 1e-12
        # Of every particle, with the work on it
        assert result.observables["energy_error"].max() <= 1e-12
        assert np.abs(result.observables["wall_work"][-1]).max() > 1e-3


def test_walls_do_not_jump_where_frames_meet():
    """Frames may miss whole steps by a millionth of one, and walls go with the steps."""
    scene = swarm.Scene(CAVITIES["sphere"](swarm.Oscillation((0.4, 0.0, 0.0), frequency=0.5)))
    start = swarm.fill(scene, 3, speed=1.0, seed=2)
    dt = 0.01 * (1.0 + 2e-9)
    result = run(scene, start, swarm.Penalty(dt, 300.0), 2.0, frames=50)
    assert imbalance(result) <= 1e-13


def test_late_frames_have_the_round_off_of_the_time():
    """Where a wall is at the end of a frame and at the start of the next one differs by that; no step fails of it."""
    scene = swarm.Scene(
        [swarm.Plane((0, 0, -1), 0.0, motion=swarm.Oscillation((0.0, 0.0, 0.4), 0.5))], (0.0, 0.0, -9.81)
    )
    start = swarm.Particles([0.0, 0.0, 0.5], [0.0, 0.0, 0.0], 1.0)
    result = run(scene, start, swarm.Penalty(0.05, 50.0), 250.0, frames=2500, compile="always")
    assert result.observables["impacts"][-1] > 100
    assert imbalance(result) <= 1e-12


def test_a_ball_that_spins_about_its_centre_does_no_work():
    spin = swarm.Rotation((1.0, 0.5, 0.0), rate=3.0, center=(0.0, 0.0, 0.0))
    rest, turning = (swarm.Scene([swarm.Sphere(0.5, motion=motion)]) for motion in (None, spin))
    start = swarm.fill(rest, 3, speed=1.0, seed=4)
    here, there = (run(scene, start, METHODS["penalty"], 2.0) for scene in (rest, turning))
    assert np.array_equal(here.particles.position, there.particles.position)
    assert there.observables["wall_work"][-1].tolist() == [0.0]


def test_only_the_wall_that_moves_works():
    piston = swarm.Plane((0, 0, 1), 0.5, motion=swarm.Translation((0.0, 0.0, -0.05)))
    scene = swarm.Scene([swarm.Cylinder(0.4), swarm.Plane((0, 0, -1), 0.5), piston])
    result = run(scene, swarm.fill(scene, 8, speed=1.0, seed=6), METHODS["penalty"], 3.0, frames=3)
    assert imbalance(result) <= 1e-12
    work, impulse = result.observables["wall_work"][-1], result.observables["impulse"][-1]
    assert work[:2].tolist() == [0.0, 0.0]
    # Each contact pushes along -z, at a speed of 0.05.
    assert work[2] == pytest.approx(0.05 * impulse[2], rel=1e-12)


@pytest.mark.parametrize("method", ["verlet", "midpoint", "trapezoidal"])
def test_what_the_baselines_miss_vanishes_with_the_step(method):
    """Their energy less the work is off by a power of the step; work that is not theirs would leave a rest."""
    scene = swarm.Scene(CAVITIES["box"](SWING), PULL)
    start = swarm.fill(scene, 3, speed=1.0, seed=2)
    misses = []
    for k in (1, 4):
        result = run(scene, start, type(METHODS[method])(DT / k, 1e3), 0.6)
        assert abs(result.observables["wall_work"][-1]).max() > 0.01
        misses.append(imbalance(result))
    assert misses[1] < 0.4 * misses[0]


# --- A step of multipliers -------------------------------------------------------------------------------


@every_pair(name=["sphere", "ellipsoid", "planes"], motion=list(MOTIONS), acceleration=["none", "secant", "reflection"])
def test_multipliers_from_a_wall_that_moves(name, motion, acceleration):
    """A step that begins on the wall ends on it, where it is then; the energy is that with its work."""
    # At time 0, when no wall has moved yet, but for the sum, whose path has a displacement then.
    scene = swarm.Scene(CAVITIES[name](MOTIONS[motion]))
    tolerance, h = 1e-16, 0.02
    method = swarm.AugmentedLagrangian(h, 1e4, tolerance=tolerance, max_sweeps=3000, acceleration=acceleration)
    away = np.array([[0.36, -0.1, 0.0], [0.1, 0.2, 0.25], [-0.3, 0.2, -0.3]]).T
    moved = scene.poses(0.0)[0].shift[:, None]
    ends = away * (3.0 / np.linalg.norm(away, axis=0))
    inside = np.zeros((3, 3))
    for _ in range(200):
        middle = 0.5 * (inside + ends)
        out = (scene.gaps(middle + moved) > 0.0).any(axis=0)
        inside, ends = np.where(out, inside, middle), np.where(out, middle, ends)
    start = swarm.Particles(inside + moved, 0.8 * away / np.linalg.norm(away, axis=0) + 0.5, np.ones(3))
    result = run(scene, start, method, h)
    seen = result.observables
    assert seen["unconverged"][-1] == 0
    assert seen["sweeps"][-1] >= 2
    # V = alpha g^2/2 of each wall, and what the multipliers miss is lambda g
    gap = math.sqrt(2.0 * tolerance / 1e4)
    assert scene.gaps(result.particles.position, h).max() <= gap
    assert imbalance(result) * seen["total_energy"].max() <= seen["impulse"][-1].sum() / h * gap
    assert np.abs(seen["wall_work"][-1]).max() > 1e-3


def test_multipliers_in_uniform_motion():
    start = swarm.Particles([0.3, 0.4, 0.0], [0.9, 0.2, 0.3], 1.0)
    method = swarm.AugmentedLagrangian(0.02, 1e4, tolerance=1e-20, max_sweeps=3000)
    require_the_same_run(CAVITIES["sphere"], None, method, start, 0.02, impacts=1, within=1e-10)


# --- Convergence -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", ["penalty", "hertz", "midpoint", "trapezoidal", "verlet"])
def test_second_order_in_a_wall_that_swings(method):
    """Deep inside a soft wall, from a start in contact on: there the force has no corner."""
    floor = swarm.Plane((0, 0, -1), 0.0, motion=swarm.Oscillation((0.1, 0.0, 0.15), frequency=0.5))
    scene = swarm.Scene([floor, swarm.Sphere(1.0, center=(0.0, 0.0, 0.4), motion=swarm.Translation((0.1, 0, 0)))])
    start = swarm.Particles([0.0, 0.0, 0.0], [0.2, 0.1, -0.6], 1.0)
    made, until = METHODS[method], 0.16
    ends = []
    for steps in (16, 32, 64, 512):
        found = run(scene, start, type(made)(until / steps, 150.0, made.exponent), until)
        assert found.observables["contact_energy"][-1] > 0.01
        ends.append(np.concatenate([found.particles.position[:, 0], found.particles.velocity[:, 0]]))
    errors = [np.abs(end - ends[-1]).max() for end in ends[:-1]]
    slopes = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (np.abs(slopes - 2.0) <= 0.25).all(), slopes


@pytest.mark.parametrize("motion", MOTIONS)
def test_stiff_walls_are_rigid(motion):
    """With alpha -> infinity and dt -> 0 the soft run ends where that from impact to impact does."""
    scene = swarm.Scene(CAVITIES["sphere"](MOTIONS[motion]), PULL)
    start = swarm.fill(scene, 12, speed=0.6, seed=11)
    hard = run(scene, start, swarm.Impact(), 1.5)
    assert hard.observables["impacts"][-1] >= 12
    distances = []
    for k in (1, 4, 16):
        soft = run(scene, start, swarm.Penalty(0.01 / k, 1e3 * k**2), 1.5)
        distances.append(np.median(np.linalg.norm(soft.particles.position - hard.particles.position, axis=0)))
        work = soft.observables["wall_work"][-1].sum()
    # The depth is |v| sqrt(m/alpha), so that each is a fourth of the last.
    assert distances[0] > 3.0 * distances[1] > 9.0 * distances[2]
    assert work == pytest.approx(hard.observables["wall_work"][-1].sum(), rel=0.05, abs=0.05)


# --- No contact is jumped over ---------------------------------------------------------------------------


@every_pair(name=list(CAVITIES), motion=list(MOTIONS), gravity={"straight": None, "falling": PULL})
def test_free_steps_are_free(name, motion, gravity):
    """What is jumped over is inside at the end of every step."""
    scene, rng = swarm.Scene(CAVITIES[name](MOTIONS[motion]), gravity), np.random.default_rng(4)
    pull, start, span, some = np.array(gravity or (0.0, 0.0, 0.0)), 0.4, 2.0, 0
    walls, still = scene.compiled().walls(start + span), swarm.Scene(CAVITIES[name](None))
    for _ in range(40):
        r, v = rng.uniform(-0.5, 0.5, 3), rng.standard_normal(3)
        if not (scene.gaps(r[:, None], start) < 0.0).all():
            continue
        with np.errstate(all="ignore"):
            free = safe.free_time_moving(walls, scene.pull(), vec(r), vec(v), span)
        times = np.linspace(0.0, min(free, span), 50)
        poses = [pose(MOTIONS[motion], start + t) for t in times.tolist()]
        places = np.transpose([r + v * t + 0.5 * t * t * pull for t in times])
        assert gaps_along(still, poses, places).max() <= 1e-12
        some += free > 0.02
    assert some >= 3


def test_a_wall_that_comes_at_a_particle_at_rest():
    """It is not only the particle's own way that ends a jump over free steps."""
    for motion in (swarm.Translation((0.0, 0.0, 1.0)), swarm.Oscillation((0.0, 0.0, 1.0), frequency=0.2)):
        floor = swarm.Plane((0, 0, -1), 0.3, motion=motion)
        result = run(
            swarm.Scene([floor]), swarm.Particles([0.0, 0.0, 0.0], [0.0, 0.0, 0.0], 1.0), METHODS["penalty"], 1.0
        )
        assert result.observables["impacts"][-1] == 1
        assert result.particles.velocity[2, 0] > 1.0
        assert imbalance(result) <= 1e-12


# --- What is refused -------------------------------------------------------------------------------------

TURN = swarm.Rotation((0.0, 0.0, 1.0), rate=1.0, center=(0.0, 0.0, 0.0))
MULTIPLIERS = {"dt": 0.01, "penalty": 1e4}
CENTRE = swarm.Particles([0.0, 0.0, 0.0], [0.1, 0.0, 0.0], 1.0)


@pytest.mark.parametrize("name", ["verlet", "midpoint", "trapezoidal"])
def test_baselines_do_not_turn(name):
    scene = swarm.Scene([swarm.Sphere(2.0), swarm.Box((0.5, 0.5, 0.5), motion=swarm.Translation(VELOCITY) + TURN)])
    with pytest.raises(swarm.SceneError, match=r"surfaces\[1\]\.motion must not turn the surface with [VMT]"):
        swarm.simulate(scene, CENTRE, METHODS[name], until=1.0)


@pytest.mark.parametrize(
    ("options", "named"),
    [({"adaptive": True}, "adaptive = True"), ({"on_unconverged": "impact"}, 'on_unconverged = "impact"')],
)
def test_exact_impacts_of_multipliers_know_walls_at_rest(options, named):
    scene = swarm.Scene([swarm.Sphere(0.5, motion=SWING)])
    with pytest.raises(swarm.SceneError, match=rf"surfaces\[0\]\.motion must be None with {named}"):
        swarm.simulate(scene, CENTRE, swarm.AugmentedLagrangian(**MULTIPLIERS, **options), until=1.0)


def test_a_solid_that_jumps_over_particles_is_refused():
    bat = swarm.Sphere(0.01, center=(0.3, 0.0, 0.0), side="outside", motion=swarm.Translation((-5.0, 0.0, 0.0)))
    scene = swarm.Scene([swarm.Sphere(1.0), bat])
    with pytest.raises(swarm.SceneError, match=r"no particle jumps over a solid.*flies 0\.0255 m, as it moves"):
        swarm.simulate(scene, CENTRE, METHODS["penalty"], until=1.0)
    assert fixed_step.longest_step(scene, 0.002) == pytest.approx(0.02 - 0.002 * 5.0)
    # A step in which it cannot; a softer bat passes the particle.
    with pytest.raises(swarm.RunError, match=r"goes through the middle of surfaces\[1\] \(Sphere\)"):
        run(scene, CENTRE, swarm.Penalty(1e-3, 1e4), 0.1)
    result = run(scene, CENTRE, swarm.Penalty(1e-3, 4e6), 0.1)
    assert result.observables["impacts"][-1] == 1


# --- The same bits ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(("method", "name"), [("penalty", "sphere"), rarely("trapezoidal", "box")])
def test_threads_and_blocks_change_no_bit(method, name):
    scene = swarm.Scene(CAVITIES[name](SWING), PULL)
    start = swarm.fill(scene, 600, speed=1.0, seed=8)
    results = [
        run(scene, start, METHODS[method], 1.0, 2, compile="always", threads=threads, block_size=size)
        for threads, size in ((1, None), (2, 256))
    ]
    few = swarm.Particles(start.position[:, :3], start.velocity[:, :3], start.mass[:3])
    plain = run(scene, few, METHODS[method], 1.0, 2)
    for one, other in (results, (results[0], plain)):
        count = len(other.particles)
        assert np.array_equal(one.particles.position[:, :count], other.particles.position)
    assert np.array_equal(results[0].observables["wall_work"], results[1].observables["wall_work"])
    assert results[0].observables["impacts"][-1] >= 600
