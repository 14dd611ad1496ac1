"""Velocities that contradict what holds the points are refused, or projected in the metric of the kinetic energy."""

import numpy as np
import pytest

import swarm

FAR = swarm.Scene([swarm.Sphere(10.0)])
ROD = swarm.dumbbell(length=2.0, mass=1.0)
FLOOR = swarm.Plane((0.0, 0.0, 1.0), 0.0)
BEAD = swarm.Body([(0.0, 0.0, 0.0), (0.0, 1.0, 1.0)], mass=[1.0, 3.0], links=[(0, 1)], guides=[(0, FLOOR)])
HANGING = swarm.Body([(0.0, 0.0, 0.0), (0.0, 0.0, -1.0)], mass=1.0, links=[(0, 1)], anchors={0: None})
SHAKEN = swarm.Oscillation((0.0, 0.0, 0.1), 1.0)
SHAKEN_PENDULUM = swarm.Body(HANGING.points, mass=1.0, links=[(0, 1)], anchors={0: SHAKEN})


def start(body, velocity, copies=3, **options):
    """Copies at rest, but for one with this velocity."""
    velocities = np.zeros((3, len(body), copies))
    velocities[:, :, 1] = np.array(velocity).T
    return swarm.Bodies(body, np.repeat(body.points.T[:, :, None], copies, axis=2), velocities, **options)


@pytest.mark.parametrize(
    ("body", "velocity", "parts"),
    [
        (ROD, [(1, 0, 0), (-1, 0, 0)], ["2 m/s along links[0], (0, 1)", "copy 1", "1 such", "project=True"]),
        # A beginner's error: the spin is of one end only.
        (ROD, [(0, 0, 0), (1e-6, 1, 0)], ["1e-06 m/s along links[0]"]),
        (BEAD, [(0, 0, 0.5), (0, 0, 0.5)], ["0.5 m/s of point 0 across guides[0], Plane(", "copy 1"]),
        (HANGING, [(0, 0, 0), (0, 0, 0.25)], ["0.25 m/s along links[0]"]),
        (HANGING, [(1, 0, 0), (0, 0, 0)], ["anchors[0]", "[1.0, 0.0, 0.0] m/s for point 0 of copy 1", "fixed"]),
        (SHAKEN_PENDULUM, [(0, 0, 0.1), (0, 0, 0.1)], ["anchors[0]", "its path, or 0", "led at [0.0, 0.0, 0.628"]),
    ],
)  # fmt: skip
def test_a_contradiction_is_refused(body, velocity, parts):
    with pytest.raises(swarm.SceneError) as caught:
        start(body, velocity)
    assert all(part in str(caught.value) for part in parts), str(caught.value)


def test_a_led_point_has_the_velocity_of_its_path():
    """0 stands for it; what is tied to the point along its path must agree with it from the start."""
    with pytest.raises(swarm.SceneError, match=r"along links\[0\], \(0, 1\), in copy 0 \(3 such\)"):
        start(SHAKEN_PENDULUM, np.zeros((2, 3)))
    made = start(SHAKEN_PENDULUM, np.zeros((2, 3)), project=True)
    assert made.velocity[2] == pytest.approx(np.full((2, 3), 0.2 * np.pi), rel=1e-15)


def test_paths_with_which_no_velocity_agrees():
    """Two links that are stretched between a fixed point and one that is led away."""
    away = {0: swarm.Translation((-0.1, 0.0, 0.0)), 2: None}
    bent = swarm.Body([(0.0, 0.0, 0.0), (3.0, 4.0, 0.0), (6.0, 0.0, 0.0)], 1.0, links=[(0, 1), (1, 2)], anchors=away)
    straight = [[0.0, 5.0, 10.0], [0.0] * 3, [0.0] * 3]
    with pytest.raises(swarm.SceneError, match=r"no velocities of the other points agree"):
        swarm.Bodies(bent, straight, np.zeros((3, 3)), project=True)
    made = swarm.Bodies(bent, bent.points.T, np.zeros((3, 3)), project=True)
    assert made.velocity[:, 1, 0] == pytest.approx([-0.05, -0.0375, 0.0], rel=1e-14)


@pytest.mark.parametrize("scale", [1e-30, 1.0, 1e30])
def test_round_off_is_no_contradiction(scale):
    """A velocity as another program computes it, far from the origin and of a drift much faster than the spin."""
    points = swarm.tetrahedron(edge=1.0, mass=1.0)
    for seed in range(20):
        random = np.random.default_rng(seed)
        place, drift, spin = random.standard_normal((3, 3)) * [[1e3], [1e3 * scale], [scale]]
        position = place[:, None] + points.points.T
        middle = position.mean(axis=1)
        velocity = drift[:, None] + np.cross(spin, (position.T - middle)).T
        swarm.Bodies(points, position, velocity)
        with pytest.raises(swarm.SceneError, match="velocity must agree"):
            swarm.Bodies(points, position, velocity * (1.0 + 1e-6 * np.arange(4.0)))


# --- The nearest velocities that agree --------------------------------------------------------------------


def some_body(seed):
    """A frame of five points with unequal, coupled masses: a fixed one, one on a sphere, seven links."""
    random = np.random.default_rng(seed)
    points = random.standard_normal((5, 3))
    points[1] /= np.linalg.norm(points[1])
    root = random.standard_normal((5, 5))
    links = [(0, 2), (1, 2), (1, 3), (2, 3), (2, 4), (3, 4)]
    guides = [(1, swarm.Sphere(1.0))]
    return swarm.Body(points, mass_matrix=root @ root.T + np.eye(5), links=links, guides=guides, anchors={0: None})


@pytest.mark.parametrize("seed", range(5))
def test_the_projection_is_the_nearest_in_the_metric_of_the_kinetic_energy(seed):
    """What it takes away is M-orthogonal to every motion that ties allow, found by the null space of their rows."""
    body = some_body(seed)
    given = np.random.default_rng(seed + 50).standard_normal((3, 5, 2))
    given[:, 0] = 0.0
    position = np.repeat(body.points.T[:, :, None], 2, axis=2)
    made = swarm.Bodies(body, position, given, project=True).velocity
    rows = np.zeros((len(body.links) + 4, 5, 3))
    for row, (i, j) in zip(rows, body.links, strict=False):
        row[i], row[j] = body.points[i] - body.points[j], body.points[j] - body.points[i]
    rows[-4, 1] = body.points[1]
    rows[-3:, 0] = np.eye(3)
    _u, sizes, right = np.linalg.svd(rows.reshape(len(rows), -1))
    motions = right[(sizes > 1e-12).sum() :].reshape(-1, 5, 3)
    assert len(motions) == 15 - len(rows)
    for copy in range(2):
        taken = (given - made)[:, :, copy].T
        assert np.abs(np.einsum("mpx,pq,qx->m", motions, body.mass_matrix, taken)).max() < 1e-12
        assert np.abs(np.einsum("apx,px->a", rows, made[:, :, copy].T)).max() < 1e-13
    again = swarm.Bodies(body, position, made, project=True).velocity
    assert again == pytest.approx(made, abs=1e-14)


def test_velocities_that_agree_are_not_changed():
    made = start(ROD, [(1, 2, 3), (1, -2, 5)], project=True)
    assert (made.velocity == start(ROD, [(1, 2, 3), (1, -2, 5)]).velocity).all()


def test_masses_of_all_sizes_are_projected():
    body = swarm.Body([(0, 0, 0), (1, 0, 0), (2, 1, 0)], mass=[1e-40, 1.0, 1e40], links=[(0, 1), (1, 2)])
    made = start(body, [(1, 0, 0), (0, 0, 0), (0, 0, 1)], project=True).velocity[:, :, 1]
    # The heavy one keeps its velocity, the light one takes that of what it is tied to.
    assert np.abs(made - [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 1.0]]).max() < 1e-30


# --- Runs -------------------------------------------------------------------------------------------------


def test_what_a_run_leaves_goes_on():
    """Velocities of a result agree to the order of the step alone, and are no contradiction."""
    body = swarm.Body(swarm.tetrahedron(1.0, 1.0).points, [1.0, 2.0, 3.0, 4.0], links=swarm.tetrahedron(1.0, 1.0).links)
    first = swarm.place(FAR, body, 2, speed=1.0, spin=4.0)
    how = {"until": 0.4, "compile": "never", "threads": 1}
    left = swarm.simulate(FAR, first, swarm.Impact(dt=0.1), **how).bodies
    with pytest.raises(swarm.SceneError, match="velocity must agree"):
        swarm.Bodies(left.body, left.position, left.velocity)
    after = swarm.simulate(FAR, left, swarm.Impact(dt=0.1), **how).bodies
    whole = swarm.simulate(FAR, first, swarm.Impact(dt=0.1), **(how | {"until": 0.8, "every": 0.4})).bodies
    assert after.velocity == pytest.approx(whole.velocity, abs=1e-12)


def test_a_projected_start_moves_as_one_that_was_right():
    """Ends that push against each other along their link give the rod what is left: its drift."""
    bodies = start(ROD, [(3, 0, 0), (-1, 0, 0)], copies=2, project=True)
    seen = swarm.simulate(FAR, bodies, swarm.Impact(dt=0.1), until=1.0, compile="never", threads=1)
    assert seen.observables["kinetic_energy"][0] == pytest.approx(0.5, rel=1e-15)
    assert seen.bodies.position[0, :, 1] == pytest.approx(ROD.points[:, 0] + 1.0, rel=1e-14)


def test_a_path_that_starts_anew_must_fit():
    """A run goes on from a result at the start of its paths: of an oscillation only where it is there again."""
    body = swarm.Body(HANGING.points, mass=1.0, springs=[(0, 1, 10.0, 1.0)], anchors={0: SHAKEN})
    how = {"compile": "never", "threads": 1}
    first = start(body, np.zeros((2, 3)), copies=2)
    whole = swarm.simulate(FAR, first, swarm.Impact(dt=0.01), until=1.0, **how).bodies
    swarm.simulate(FAR, whole, swarm.Impact(dt=0.01), until=0.1, **how)
    part = swarm.simulate(FAR, first, swarm.Impact(dt=0.01), until=0.4, **how).bodies
    with pytest.raises(swarm.SceneError, match=r"velocity of anchors\[0\] must be that of its path"):
        swarm.simulate(FAR, part, swarm.Impact(dt=0.01), until=0.1, **how)
