"""Unions of several rooms, and foams, as soft walls of points: one spring each, with nothing in the doorways."""

import math

import numpy as np
import pytest

import swarm

SOFT = swarm.Penalty(dt=5e-3, penalty=4e3)
BALLS = np.array([(0.0, 0.0, 0.0), (0.6, 0.1, 0.0)]), np.array([0.5, 0.4])
# A box, and a smaller one beside it: the edges of the doorway are sharp.
HALVES = np.array([(0.5, 0.5, 0.5), (0.4, 0.15, 0.2)]), np.array([(0.0, 0.0, 0.0), (0.8, 0.1, 0.0)])

HALVES_OF_IT = [swarm.Box((0.35, 0.4, 0.45), (x, 0.0, 0.0)) for x in (-0.35, 0.35)]


def spheres(**laws):
    parts = [swarm.Sphere(radius, tuple(center)) for center, radius in zip(*BALLS, strict=True)]
    return swarm.Union(parts, **laws)


def boxes(**laws):
    return swarm.Union([swarm.Box(tuple(half), tuple(center)) for half, center in zip(*HALVES, strict=True)], **laws)


def run(walls, start, until=1.0, method=SOFT, options=None, **scene):
    every = {"every": until / 4.0, "compile": "never", **(options or {})}
    return swarm.simulate(swarm.Scene(walls, **scene), swarm.Particles(*start), method, until=until, **every)


def starts(n=4, seed=2):
    random = np.random.default_rng(seed)
    return random.uniform(-0.2, 0.2, (3, n)), random.normal(size=(3, n))


# --- A loop in NumPy that steps one point by the equations of the paper ------------------------------------


def gap_of_spheres(r):
    centers, radii = BALLS
    away = np.linalg.norm(r - centers, axis=1)
    k = int(np.argmin(away - radii))
    return away[k] - radii[k], (r - centers[k]) / away[k]


def gap_of_boxes(r):
    found = []
    for half, center in zip(*HALVES, strict=True):
        beyond = np.abs(r - center) - half
        out = np.maximum(beyond, 0.0)
        axis = (np.arange(3) == np.argmax(beyond)).astype(float)
        away = np.linalg.norm(out)
        found.append((away, out / away * np.sign(r - center)) if away > 0.0 else
                     (beyond.max(), axis * np.sign(r - center)))  # fmt: skip
    return min(found, key=lambda one: one[0])


def discrete_gradient(gap, r0, r1):
    """Gonzalez's, with the gradients at both ends by how deep they are; across an edge that of the start alone."""
    (g0, n0), (g1, n1) = gap(r0), gap(r1)
    a, b = max(g0, 0.0), max(g1, 0.0)
    if a + b == 0.0:
        a, b = (1.0, 0.0) if g0 > g1 else (0.0, 1.0)
    if a > 0.0:
        b *= np.clip((n0 @ n1 - 0.5) / 0.4, 0.0, 1.0)
    mean, d = (a * n0 + b * n1) / (a + b), r1 - r0
    return mean + (g1 - g0 - mean @ d) / (d @ d) * d


def step(gap, r0, v0, pull, dt, penalty):
    """m (v1 - v0) = h m G - h D alpha (Phi0 + Phi1)/2 and r1 - r0 = h (v0 + v1)/2, with m = 1, by Newton's method."""
    free = r0 + dt * v0 + 0.5 * dt * dt * pull

    def missing(r1):
        f0, f1 = max(gap(r0)[0], 0.0), max(gap(r1)[0], 0.0)
        if f0 == f1 == 0.0:
            return r1 - free
        rise = gap(r1)[0] - gap(r0)[0]
        slope = (f1 - f0) / rise if rise != 0.0 else 1.0
        return r1 - free + 0.25 * dt * dt * penalty * (f0 + f1) * slope * discrete_gradient(gap, r0, r1)

    r1 = free
    for _sweep in range(60):
        f, h = missing(r1), 1e-7
        if np.abs(f).max() < 1e-16:
            break
        jacobian = np.array([(missing(r1 + h * e) - missing(r1 - h * e)) / (2.0 * h) for e in np.eye(3)]).T
        r1 = r1 - np.linalg.solve(jacobian, f)
    return r1, 2.0 * (r1 - r0) / dt - v0


@pytest.mark.parametrize("gravity", [None, (0.3, -0.2, -1.0)], ids=["free", "falling"])
@pytest.mark.parametrize(("wall", "gap"), [(spheres, gap_of_spheres), (boxes, gap_of_boxes)], ids=["spheres", "boxes"])
def test_a_loop_of_steps_by_hand(wall, gap, gravity):
    # The second goes through the doorway, and comes back from the end of the next room.
    place = np.array([(-0.1, 0.2, 0.1), (0.1, 0.1, 0.0)]).T
    speed = np.array([(-0.9, 0.7, 1.1), (1.2, 0.05, 0.06)]).T
    result = run([wall()], (place, speed), until=1.5, gravity=gravity)
    pull = np.zeros(3) if gravity is None else np.array(gravity)
    ends = np.array(place), np.array(speed)
    for i in range(2):
        r, v = place[:, i], speed[:, i]
        for _step in range(300):
            r, v = step(gap, r, v, pull, SOFT.dt, SOFT.penalty)
        ends[0][:, i], ends[1][:, i] = r, v
    assert result.observables["impacts"][-1] > 2
    assert np.abs(result.particles.position - ends[0]).max() < 1e-9
    assert np.abs(result.particles.velocity - ends[1]).max() < 1e-8
    assert result.observables["energy_error"].max() < 1e-14


def test_two_boxes_with_a_face_in_common_are_one_long_box():
    two, one = (run([wall], starts(), gravity=(0.1, -0.2, -1.0)) for wall in (
        swarm.Union(HALVES_OF_IT), swarm.Box((0.7, 0.4, 0.45)),
    ))  # fmt: skip
    assert one.observables["impacts"][-1] >= 4
    assert np.abs(two.particles.position - one.particles.position).max() < 1e-11
    assert two.observables["energy_error"].max() < 1e-14


@pytest.mark.parametrize("gravity", [None, (0.1, -0.2, -1.0)], ids=["free", "falling"])
def test_a_foam_is_the_union_of_its_cavities(gravity):
    # One of them is lossy and rough, as the whole is.
    laws = {"restitution": 0.8, "friction": 0.2}
    foam, union = (run([wall], starts(), gravity=gravity) for wall in (
        swarm.Spheres(*BALLS, side="inside", **laws), spheres(**laws),
    ))  # fmt: skip
    assert union.observables["dissipated_energy"][-1] > 0.1
    for name in ("kinetic_energy", "potential_energy", "contact_energy", "dissipated_energy"):
        assert foam.observables[name] == pytest.approx(union.observables[name], abs=1e-11)
    assert np.abs(foam.particles.position - union.particles.position).max() < 1e-11


@pytest.mark.parametrize("motion", [None, swarm.Oscillation((0.05, 0.03, 0.04), 1.0)], ids=["at rest", "shaken"])
def test_energy_and_depth_at_the_edges_of_a_doorway(motion):
    # Towards the edges of the doorway, from both rooms
    random = np.random.default_rng(5)
    angle = random.uniform(0.0, 2.0 * math.pi, 8)
    edge = np.array([np.full(8, 0.5), 0.1 + 0.155 * np.sign(np.cos(angle)), 0.2 * np.sin(angle)])
    place = np.array([np.where(np.arange(8) % 2, 0.7, 0.3), 0.1 + 0.1 * np.cos(angle), 0.1 * np.sin(angle)])
    speed = 1.5 * (edge - place) / np.linalg.norm(edge - place, axis=0)
    method = swarm.Penalty(dt=2e-3, penalty=4e4)
    result = run([boxes(motion=motion)], (place, speed), 0.4, method)
    assert result.observables["impacts"][-1] > 4
    assert result.observables["energy_error"].max() < 1e-13
    # A spring that has all of the energy is so deep.
    energy = 0.5 * (np.linalg.norm(speed, axis=0).max() + (0.0 if motion is None else 0.5)) ** 2
    depth = swarm.Scene([boxes(motion=motion)]).gaps(result.particles.position, 0.4).max()
    assert depth < math.sqrt(2.0 * energy / method.penalty)


def test_openings_counters_and_sources():
    # What comes to the end of the second room is out; each counts at the doorway first.
    hole = swarm.Plane((-1.0, 0.0, 0.0), -1.0)
    doorway = swarm.Plane((1.0, 0.0, 0.0), 0.5)
    inlet = swarm.Sphere(0.05, (0.2, 0.1, 0.0))
    source = swarm.Source(inlet, volume=True, times=[0.1, 0.2], speed=1.0, mass=1.0)
    options = {"counters": [doorway], "sources": [source], "seed": 1}
    result = run([boxes(openings=[hole])], ([(0.1,), (0.1,), (0.0,)], [(2.0,), (0.0,), (0.0,)]), 1.0, options=options)
    assert result.observables["born"][-1] == 2
    assert result.observables["escaped"][-1] >= 1
    assert result.observables["crossings"][-1].sum() >= 1
    assert result.particles.position[0, 0] == pytest.approx(1.2, abs=2.0 * SOFT.dt)
    assert result.observables["energy_error"].max() < 1e-14


def test_what_one_spring_cannot_be_is_a_sentence():
    fixed = swarm.AugmentedLagrangian(dt=5e-3, penalty=4e3)

    def refused(wall, what):
        for method in (SOFT, fixed):
            with pytest.raises(swarm.SceneError, match=what + f".*{type(method).__name__}"):
                run([wall], starts(1), method=method)

    parts = [swarm.Box((0.35, 0.4, 0.45), (x, 0.0, 0.0)) for x in (-0.35, 0.35)]
    door = swarm.Opening(swarm.Plane((0.0, 1.0, 0.0), 0.0), between=True)
    refused(swarm.Union(parts, openings=[door]), "must not have rooms that touch at a wall between them with")
    lossy = [swarm.Sphere(0.5, restitution=0.5), swarm.Sphere(0.4, (0.6, 0.1, 0.0))]
    refused(swarm.Union(lossy), "must have the same restitution in all of its parts with")
    hole = swarm.Sphere(0.1, (0.0, 0.0, 0.5))
    one = [swarm.Box((0.5, 0.5, 0.5), openings=[hole]), swarm.Box((0.4, 0.4, 0.5), (0.5, 0.0, 0.0))]
    refused(swarm.Union(one), "must have the same openings in all of its parts")


# --- Multipliers ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("start", ["impact", "centred"])
@pytest.mark.parametrize(
    "wall", [spheres, boxes, lambda **_laws: swarm.Spheres(*BALLS, side="inside")], ids=["spheres", "boxes", "foam"]
)
def test_a_loop_that_converges_is_the_chord_on_the_wall_of_one_room(wall, start):
    # It is found without a loop by `Impact`.
    place = np.array([(-0.1, 0.2, 0.1), (0.1, 0.1, 0.0), (0.7, 0.15, 0.1)]).T
    speed = np.array([(-0.9, 0.7, 1.1), (1.2, 0.05, 0.06), (-0.5, 0.9, -0.2)]).T
    loop = swarm.AugmentedLagrangian(
        dt=5e-3, penalty=1e6, tolerance=1e-28, adaptive=True, acceleration="reflection", max_sweeps=200,
        contact_start=start,
    )  # fmt: skip
    by_loop = run([wall()], (place, speed), 2.5, loop)
    chord = run([wall()], (place, speed), 2.5, swarm.Impact(contact_step=5e-3, contact_start=start))
    assert by_loop.observables["impacts"][-1] > 6
    assert by_loop.observables["impacts"][-1] == chord.observables["impacts"][-1]
    assert np.abs(by_loop.particles.position - chord.particles.position).max() < 1e-10
    assert by_loop.observables["energy_error"].max() < 1e-13
    assert by_loop.observables["contact_energy"].max() < 1e-20
    assert swarm.Scene([wall()]).gaps(by_loop.particles.position).max() < 1e-12


def test_parts_may_differ_where_steps_are_cut_at_impacts():
    parts = [swarm.Sphere(0.5, restitution=0.5), swarm.Sphere(0.4, (0.6, 0.1, 0.0), friction=0.3)]
    loop = swarm.AugmentedLagrangian(dt=1e-6, penalty=1e12, adaptive=True, acceleration="reflection", tolerance=1e-22)
    start = starts(3)
    by_loop, exact = (run([swarm.Union(parts)], start, method=method) for method in (loop, swarm.Impact()))
    assert exact.observables["dissipated_energy"][-1] > 0.3
    assert by_loop.observables["dissipated_energy"] == pytest.approx(exact.observables["dissipated_energy"], abs=1e-4)
    assert np.abs(by_loop.particles.position - exact.particles.position).max() < 1e-4


@pytest.mark.parametrize("whole", [True, False], ids=["union", "box"])
def test_the_loop_in_the_edge_of_one_room_takes_the_walls_of_that_room_alone(whole):
    loop = swarm.AugmentedLagrangian(dt=5e-3, penalty=1e6, tolerance=1e-28, adaptive=True, max_sweeps=200)
    wall = boxes() if whole else swarm.Box((0.5, 0.5, 0.5))
    result = run([wall], ([(-0.25,), (-0.25,), (0.0,)], [(-1.0,), (-1.0,), (0.3,)]), 0.4, loop)
    assert result.observables["impacts"][-1] == 1
    # An exact impact in its place takes none.
    assert result.observables["sweeps"].sum() > 1
    assert result.particles.velocity[:, 0] == pytest.approx([1.0, 1.0, 0.3], abs=1e-12)
    assert result.observables["energy_error"].max() < 1e-13


@pytest.mark.parametrize(
    "motion",
    [
        None,
        swarm.Translation((0.3, 0.0, 0.1)),
        swarm.Oscillation((0.05, 0.03, 0.04), 1.0),
        swarm.Rotation((0.2, -0.1, 1.0), 0.5),
    ],
    ids=["at rest", "going", "shaken", "turning"],
)
def test_fixed_steps_of_the_loop_in_two_boxes_are_those_in_one_long_box(motion):
    whole = swarm.Union(HALVES_OF_IT, motion=motion)
    loop = swarm.AugmentedLagrangian(dt=5e-3, penalty=4e3, on_unconverged="count", max_sweeps=3)
    start = [(0.5,), (0.1,), (0.0,)], [(1.0,), (0.3,), (-0.2,)]
    one, other = (
        run([wall], start, 0.4, loop, gravity=(0.1, -0.2, -1.0))
        for wall in (whole, swarm.Box((0.7, 0.4, 0.45), motion=motion))
    )
    assert other.observables["impacts"][-1] >= 1
    assert (one.observables["unconverged"] == other.observables["unconverged"]).all()
    assert np.abs(one.particles.position - other.particles.position).max() < 1e-8
    # With what a wall that moves has given
    assert one.observables["total_energy"] == pytest.approx(other.observables["total_energy"], abs=1e-8)


def test_fixed_steps_of_the_loop_at_a_field_beside_a_wall_that_moves_are_a_sentence():
    loop = swarm.AugmentedLagrangian(dt=5e-3, penalty=4e3)
    field = swarm.Spheres(np.array([(0.2, 0.0, 0.0), (-0.2, 0.1, 0.0)]), np.array([0.05, 0.04]))
    vessel = swarm.Box((0.5, 0.5, 0.5), motion=swarm.Translation((0.1, 0.0, 0.0)))
    with pytest.raises(swarm.SceneError, match="must not be Spheres with adaptive = False where walls move"):
        run([vessel, field], starts(1), method=loop)
