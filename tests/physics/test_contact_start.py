"""Contact steps begun half of their length before the impact: their order, and where they begin and end."""

import math
import tomllib

import numpy as np
import pytest
import tomli_w
from conftest import call
from methods.passes import one_pass, simulate

import swarm
from bench import order as chart
from swarm.kernel.vector import vec
from swarm.serialization import tables

pytestmark = pytest.mark.physics

# The paper's ellipsoid, and a particle that meets it once in 0.62 s and six times in 5.3 s.
PAPER = swarm.Scene([swarm.Ellipsoid((0.3, 0.3, 0.6))])
START = swarm.Particles((0.05, 0.02, 0.1), (0.4, 0.4, 0.4))
SPHERE = swarm.Scene([swarm.Sphere(0.5)])


def centred(h, **keywords):
    return swarm.Impact(contact_step=h, contact_start="centred", **keywords)


def methods(h):
    """Both methods with a centred step."""
    return [make(h, "centred") for make in chart.METHODS.values()]


# --- Order ------------------------------------------------------------------------------------------------


def orders(name, start):
    """Of both methods in a scene of the chart, where the method knows it."""
    fall = chart.SCENES[name].gravity is not None
    made = {kind: make for kind, make in chart.METHODS.items() if not fall or kind == "Impact"}
    return [chart.order(name, make, start, chart.STEPS[::2]) for make in made.values()]


@pytest.mark.parametrize("name", ["box", "sphere", "ellipsoid"])
def test_a_step_from_the_impact_is_of_first_order(name):
    """Of both methods, and with the same error, also on a plane: the step ends (h/2)(v0 - v1) from where it would."""
    found = orders(name, "impact")
    assert found[0].errors == pytest.approx(found[1].errors, rel=1e-8)
    for one in found:
        assert np.mean(one.slopes) == pytest.approx(1.0, abs=0.1)
        assert one.energy <= 1e-14


@pytest.mark.parametrize("name", ["box", "box, falling", "sphere", "cylinder", "ball in a sphere"])
def test_a_centred_step_is_exact_on_planes_spheres_and_cylinders(name):
    for one in orders(name, "centred"):
        assert max(one.errors) <= 1e-13
        assert one.energy <= 1e-14
        assert one.penetration == 0.0


@pytest.mark.parametrize("name", ["torus", "sphere, falling"])
def test_it_is_of_second_order_where_the_slope_is_the_same_all_over_the_wall(name):
    for one in orders(name, "centred"):
        assert one.slopes == pytest.approx([2.0] * len(one.slopes), abs=0.05)
        assert one.energy <= 1e-14


@pytest.mark.parametrize("name", ["ellipsoid", "solid ellipsoid", "quartic"])
def test_it_is_of_first_order_elsewhere(name):
    beside = orders(name, "impact")[0]
    for one in orders(name, "centred"):
        assert np.mean(one.slopes) == pytest.approx(1.0, abs=0.1)
        assert (np.array(one.errors) < 0.5 * np.array(beside.errors)).all()
        assert one.energy <= 1e-14
        assert one.penetration <= 1e-15


@pytest.mark.parametrize("until", [0.62, 5.3])
def test_it_is_five_times_nearer_in_the_ellipsoid_of_the_paper(until):
    exact = simulate(PAPER, START, swarm.Impact(), until).particles.position
    for make in chart.METHODS.values():
        for h in (8e-3, 2e-3):
            impact, centred = (
                np.linalg.norm(simulate(PAPER, START, make(h, start), until).particles.position - exact)
                for start in chart.STARTS
            )
            assert 0.0 < centred < 0.2 * impact


# --- One step ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "surface",
    [
        swarm.Sphere(0.5),
        swarm.Sphere(0.5, side="outside"),
        swarm.Ellipsoid((0.3, 0.4, 0.6)),
        swarm.Ellipsoid((0.3, 0.4, 0.6), side="outside"),
        swarm.Torus(0.5, 0.2),
        swarm.Formula("x**2/0.09 + y**2/0.09 + z**4/0.13 - 1"),
        swarm.Formula("x**2/0.09 + y**2/0.09 + z**4/0.13 - 1", side="outside"),
    ],
    ids=lambda surface: f"{type(surface).__name__}, {surface.side}",
)
@pytest.mark.parametrize("gravity", [None, (0.3, 0.2, -2.0)])
def test_a_step_ends_at_the_gap_at_which_it_begins(surface, gravity):
    """Of D.(r1 - r0) = q1 - q0 and n.(r1 - r0) = 0; with the energy, and half of the step before the impact."""
    scene, h = swarm.Scene([surface], gravity), 0.02
    (wall,) = surface.walls()
    g = np.array(gravity or (0.0, 0.0, 0.0))
    random, steps = np.random.default_rng(7), 0
    while steps < 5:
        # Onto the wall, 0.1 s before.
        on = call(wall.project, _near(surface, random))
        n = np.array(call(wall.unit_normal, on))
        along = np.cross(n, random.standard_normal(3))
        v = 0.6 * n + 0.8 * along / np.linalg.norm(along)
        r = np.array(on) - 0.1 * v + 0.005 * g
        after = one_pass(centred(h), scene, r, v - 0.1 * g, 1.0)
        if after.hard or not after.hits:
            continue
        steps += 1
        met = 1.0 - after.remaining - 0.5 * h
        t = met - 0.5 * h
        r0 = r + t * (v - 0.1 * g) + 0.5 * t * t * g
        q0, q1 = (call(wall.inner, point) for point in (r0, after.position))
        assert q1 == pytest.approx(q0, abs=2e-13)
        energies = [0.5 * u @ u - g @ x for x, u in ((r, v - 0.1 * g), (after.position, after.velocity))]
        assert energies[1] == pytest.approx(energies[0], abs=1e-15 * 8)


def _near(surface, random):
    """A point near a wall, on it after some projections."""
    (wall,) = surface.walls()
    point = np.array([0.35, 0.3, 0.2]) + 0.1 * random.standard_normal(3)
    for _i in range(20):
        point = np.array(call(wall.project, point))
    return point


def test_a_flight_shorter_than_half_a_step_shortens_both_halves():
    """With h = 0.2 s from a tenth of that before the wall: the step begins at once, and lasts twice the flight."""
    r, v = np.array([0.0, 0.2, 0.4]), np.array([0.6, 1.0, 0.0])
    exact = one_pass(swarm.Impact(), PAPER, r, v, 1.0)
    met = 1.0 - exact.remaining
    assert 0.0 < met < 0.05
    for method in (centred(0.2), centred(2.0 * met), chart.uzawa(0.2, "centred")):
        after = one_pass(method, PAPER, r, v, 1.0)
        assert 1.0 - after.remaining == pytest.approx(2.0 * met, rel=1e-9)
        assert after.position == pytest.approx(exact.position + met * after.velocity, abs=1e-13)


@pytest.mark.parametrize("make", chart.METHODS.values(), ids=chart.METHODS)
def test_a_start_on_the_wall_is_reflected_exactly(make):
    """Towards the wall a step has no length, away from it none is taken."""
    wall = swarm.Particles([[0.0, 0.0], [0.3, 0.3], [0.0, 0.0]], [[0.5, 0.5], [0.5, -0.5], [0.1, 0.1]])
    for until in (0.1, 0.3):
        exact = simulate(PAPER, wall, swarm.Impact(), until).particles
        found = simulate(PAPER, wall, make(0.02, "centred"), until).particles
        assert found.position == pytest.approx(exact.position, abs=1e-15)
        assert found.velocity == pytest.approx(exact.velocity, abs=1e-15)


@pytest.mark.parametrize("make", chart.METHODS.values(), ids=chart.METHODS)
def test_a_frame_cuts_the_step(make):
    """A frame before the impact, at it or after it: the step is as much shorter, and no particle is outside."""
    met = 1.0 - one_pass(swarm.Impact(), PAPER, np.array(START.position[:, 0]), START.velocity[:, 0], 1.0).remaining
    exact = simulate(PAPER, START, swarm.Impact(), 1.0).particles.position
    whole = np.linalg.norm(simulate(PAPER, START, make(0.2, "centred"), 1.0).particles.position - exact)
    for before in (0.05, 0.01, 1e-4, 1e-12, 0.0, -1e-12, -1e-4, -0.01, -0.05):
        result = simulate(PAPER, START, make(0.2, "centred"), 2.0 * (met - before), met - before)
        assert result.observables["max_penetration"].max() <= 1e-15
        assert result.observables["energy_error"].max() <= 1e-14
        assert result.observables["impacts"][-1] >= 1
        frame = simulate(PAPER, START, make(0.2, "centred"), met - before)
        if before > 0.0:
            assert frame.particles.position == pytest.approx(
                START.position + (met - before) * START.velocity, abs=1e-15
            )
    assert whole > 0.0


# --- Walls in the way -------------------------------------------------------------------------------------

_EDGE = math.tan(0.05)
FLAT = {
    "corner": [swarm.Box((0.3, 0.3, 0.3))],
    "wedge": [swarm.Plane((0.0, -1.0, 0.0)), swarm.Plane((-_EDGE, 1.0, 0.0)), swarm.Sphere(1.0)],
    "thin gap": [swarm.Plane((0.0, 0.0, 1.0), 2e-3), swarm.Plane((0.0, 0.0, -1.0), 2e-3), swarm.Box((0.5, 0.5, 0.5))],
    "plate": [swarm.Slab((1.0, 0.0, 0.0), 5e-3, side="outside"), swarm.Box((0.5, 0.5, 0.5))],
    "small balls": [
        swarm.Box((0.3, 0.3, 0.3)),
        *(swarm.Sphere(0.02, (x, y, 0.27), side="outside") for x in (-0.1, 0.0, 0.1) for y in (-0.1, 0.1)),
    ],
}


@pytest.mark.parametrize("name", FLAT)
def test_where_each_step_is_exact_so_are_those_with_walls_in_the_way(name):
    """Steps longer than the flights between planes and balls: nothing is passed by, in whatever order it is met."""
    scene = swarm.Scene(FLAT[name])
    random, n = np.random.default_rng(3), 8
    if name == "wedge":
        v = random.standard_normal((3, n))
        start = swarm.Particles(np.array([[0.5] * n, [0.012] * n, [0.0] * n]), v / np.linalg.norm(v, axis=0))
    elif name == "small balls":
        start = swarm.fill(scene, n, speed=1.0, seed=3)
        aims = np.array([[x, y, 0.27] for x in (-0.1, 0.0, 0.1) for y in (-0.1, 0.1)])[random.integers(0, 6, n)]
        v = aims.T + 0.01 * random.standard_normal((3, n)) - start.position
        start = swarm.Particles(start.position, v / np.linalg.norm(v, axis=0))
    else:
        start = swarm.fill(scene, n, speed=1.0, seed=3)
    until = 0.6
    exact = simulate(scene, start, swarm.Impact(), until)
    assert exact.observables["impacts"][-1] >= n // 2
    for method in methods(min(0.05, scene.size())):
        found = simulate(scene, start, method, until, 0.1)
        assert found.particles.position == pytest.approx(exact.particles.position, abs=1e-10)
        assert found.particles.velocity == pytest.approx(exact.particles.velocity, abs=1e-8)
        assert found.observables["impacts"][-1] == exact.observables["impacts"][-1]
        assert found.observables["max_penetration"].max() <= 1e-15


def test_grazing_becomes_sliding():
    result = simulate(SPHERE, swarm.Particles((0.5, 0.0, 0.0), (0.0, 1.0, 0.0)), centred(0.01), 0.5)
    assert result.observables["sliding_time"][-1] == pytest.approx(0.5, abs=1e-7)
    assert result.observables["impacts"][-1] <= 1


# --- Files ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", methods(0.01), ids=chart.METHODS)
def test_files_keep_where_steps_begin(method, tmp_path):
    table = tomllib.loads(tomli_w.dumps(tables.table_of(method)))
    assert table["contact_start"] == "centred"
    assert tables.method_of(table) == method
    path = tmp_path / "run.h5"
    swarm.simulate(PAPER, START, method, until=0.1, trajectory=path, compile="never")
    with swarm.load(path) as trajectory:
        assert trajectory.method == method


@pytest.mark.parametrize("make", chart.METHODS.values(), ids=chart.METHODS)
def test_files_from_before_begin_at_the_impact(make):
    """Without the key; and a file of today without it is the same text, so that such a run can be resumed."""
    table = tables.table_of(make(0.01, "impact"))
    assert "contact_start" not in table
    assert tables.method_of(table).contact_start == "impact"


def test_a_log_has_the_place_and_the_time_of_the_impact(tmp_path):
    logs = []
    for name, method in (("exact", swarm.Impact()), ("centred", centred(0.02))):
        path = tmp_path / f"{name}.h5"
        swarm.simulate(SPHERE, START, method, until=4.0, impacts=path, compile="never")
        logs.append(swarm.load_impacts(path).table())
    assert len(logs[0]) == len(logs[1]) > 2
    for name in ("time", "position", "velocity_before", "velocity_after", "impulse"):
        assert logs[1][name] == pytest.approx(logs[0][name], abs=1e-13)


# --- A single step, sweep by sweep ------------------------------------------------------------------------


def test_the_loop_ends_at_the_reflection():
    """In State I of the level of its start: Phi falls to 0, with the multiplier and the end of the converged step."""
    given = PAPER, START.position[:, 0], START.velocity[:, 0], 1.0
    limit = swarm.contact_history(*given, centred(0.02))
    for acceleration in ("none", "secant", "reflection"):
        method = swarm.AugmentedLagrangian(
            0.02, 1e5, tolerance=1e-26, adaptive=True, acceleration=acceleration, contact_start="centred"
        )
        found = swarm.contact_history(*given, method)
        assert found.converged
        assert found.position[-1] == pytest.approx(limit.position[-1], abs=1e-13)
        assert found.velocity[-1] == pytest.approx(limit.velocity[-1], abs=1e-12)
        assert found.multiplier[-1] == pytest.approx(limit.multiplier[-1], rel=1e-10)
        assert found.kinetic_energy[-1] == pytest.approx(0.24, rel=1e-12)
        assert abs(found.constraint[-1]) <= 1e-15
    (wall,) = PAPER.surfaces[0].walls()
    assert call(wall.inner, vec(limit.position[-1])) < 1.0 - 1e-3


# --- What it does not go with -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("make", "parts"),
    [
        (lambda: swarm.Impact(contact_start="centred"), ["contact_step must be above 0", '"centred"', "got 0"]),
        (lambda: swarm.Impact(0.1, contact_start="middle"), ["contact_start", "'impact' and 'centred'", "'middle'"]),
        (lambda: swarm.Impact(0.1, contact_start=True), ["contact_start", "got True"]),
        (
            lambda: swarm.AugmentedLagrangian(0.1, 1e4, contact_start="centred"),
            ["adaptive must be True", '"centred"', "got False", "adaptive=True"],
        ),
        (
            lambda: swarm.AugmentedLagrangian(0.1, 1e4, 2.0, adaptive=True, contact_start="centred"),
            ["exponent must be 1", '"centred"', "got 2"],
        ),
    ],
)
def test_errors_name_the_argument(make, parts):
    with pytest.raises(swarm.SceneError) as caught:
        make()
    assert all(part in str(caught.value) for part in parts), str(caught.value)


def test_bodies_begin_at_the_impact():
    bodies = swarm.place(SPHERE, swarm.dumbbell(0.1, 1.0), 1, speed=1.0)
    method = swarm.AugmentedLagrangian(0.01, 1e6, adaptive=True, contact_start="centred")
    with pytest.raises(swarm.SceneError, match='contact_start of AugmentedLagrangian must be "impact" with bodies'):
        swarm.simulate(SPHERE, bodies, method, until=0.1)


# --- A step that is halved at a fixed penalty -------------------------------------------------------------


@pytest.mark.parametrize("start", chart.STARTS)
def test_a_loop_that_is_too_slow_names_the_cause_and_the_remedy(start):
    """alpha h^2/m = 0.25 of a mass of 2.5 kg; what the sentence names mends it."""
    particles = swarm.Particles(START.position, START.velocity, 2.5)
    given = {"adaptive": True, "contact_start": start}
    with pytest.raises(swarm.RunError) as caught:
        simulate(SPHERE, particles, swarm.AugmentedLagrangian(2.5e-3, 1e5, **given), 2.0)
    message = str(caught.value)
    for part in (
        "alpha h^2/m = 0.25 here",
        'acceleration="reflection"',
        "grows as 1/dt^2 (1.6e+06 makes",
        "max_sweeps",
    ):
        assert part in message, message
    simulate(SPHERE, particles, swarm.AugmentedLagrangian(2.5e-3, 1.6e6, **given), 2.0)
    simulate(SPHERE, particles, swarm.AugmentedLagrangian(2.5e-3, 1e5, acceleration="reflection", **given), 2.0)


def test_a_sweep_divides_the_gap_by_what_the_sentence_says():
    """1 + alpha h^2/(4 m) on a plane, exactly."""
    scene = swarm.Scene([swarm.Plane((1.0, 0.0, 0.0))])
    for alpha in (1e3, 1e4):
        method = swarm.AugmentedLagrangian(0.02, alpha, adaptive=True, max_sweeps=5)
        found = swarm.contact_history(scene, (-1.0, 0.0, 0.0), (1.0, 0.5, 0.0), 2.0, method)
        assert found.constraint[:-1] / found.constraint[1:] == pytest.approx(1.0 + alpha * 0.02**2 / 8.0, rel=1e-9)
