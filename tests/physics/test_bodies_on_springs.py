"""Bodies at walls that are springs, and the paper's own loop for walls and links: what they keep, and their limits."""

import numpy as np
import pytest

import swarm
from swarm.bodies.body_run import BodyRun

SPHERE, BOX = [swarm.Sphere(1.0)], [swarm.Box((1.0, 0.9, 0.8))]
# The same beside a wall out of reach: one kind of scene, which is compiled once.
BESIDE = {"sphere": [*SPHERE, swarm.Box((2.0, 2.0, 2.0))], "box": [swarm.Sphere(2.0), *BOX]}
DOWN = (0.0, 0.0, -2.0)
SOME = 8
BODIES = {"dumbbell": lambda: swarm.dumbbell(0.3, 1.0), "tetrahedron": lambda: swarm.tetrahedron(0.3, 1.0)}
SPRINGS = {
    "linear": swarm.Penalty(dt=1e-2, penalty=1e4),
    "hertz": swarm.Penalty(dt=1e-2, penalty=1e5, exponent=1.5),
    "stiff": swarm.Penalty(dt=1e-2, penalty=1e8),
}


def loop(tolerance=1e-20, **options):
    return swarm.AugmentedLagrangian(
        dt=1e-2, penalty=1e6, tolerance=tolerance, max_sweeps=200, adaptive=True, **options
    )


def some(kind, surfaces, n=SOME, gravity=None):
    scene = swarm.Scene(surfaces, gravity=gravity)
    return scene, swarm.place(scene, BODIES[kind](), n, speed=1.0, spin=2.0, seed=3)


@pytest.mark.parametrize("gravity", [None, DOWN], ids=["free", "falling"])
@pytest.mark.parametrize("name", BESIDE)
@pytest.mark.parametrize("method", SPRINGS)
@pytest.mark.parametrize("kind", BODIES)
def test_springs_keep_energy_and_links(kind, method, name, gravity):
    # 24 cases of three kinds: seconds each in plain Python. Those of linear springs are those of the loop below.
    surfaces = BESIDE[name] if method == "hertz" else SPHERE if name == "sphere" else BOX
    scene, start = some(kind, surfaces, gravity=gravity)
    seen = swarm.simulate(scene, start, SPRINGS[method], until=10.0, every=0.1, compile="always").observables
    assert seen["impacts"][-1] > SOME * 5
    # V feels the last bit of a place: alpha g of it, in each of so many steps.
    assert seen["energy_error"].max() < (1e-9 if method == "stiff" else 2e-11)
    assert seen["link_error"].max() < 1e-13
    assert 0.0 < seen["contact_energy"].max() < seen["total_energy"][0]


@pytest.mark.parametrize("method", [SPRINGS["linear"], loop()], ids=["springs", "loop"])
def test_angular_momentum_about_the_centre_of_a_sphere_is_kept(method):
    scene, start = some("tetrahedron", SPHERE)
    seen = swarm.simulate(scene, start, method, until=10.0, every=1.0).observables
    change = np.abs(seen["angular_momentum"] - seen["angular_momentum"][0]).max()
    assert change < 2e-13 * np.abs(seen["angular_momentum"][0]).max()


@pytest.mark.parametrize("surfaces", [SPHERE, BOX], ids=["sphere", "box"])
@pytest.mark.parametrize("kind", BODIES)
def test_the_loop_takes_what_walls_and_links_store_to_its_tolerance(kind, surfaces):
    scene, start = some(kind, surfaces)
    errors = []
    for tolerance in (1e-10, 1e-20):
        seen = swarm.simulate(scene, start, loop(tolerance), until=5.0, every=0.1).observables
        # V = alpha c^2/2 of a link, and alpha g^2/2 of a wall
        deepest = np.sqrt(2.0 * tolerance / 1e6)
        assert seen["impacts"][-1] > 20
        assert seen["unconverged"][-1] == 0
        assert seen["sweeps"][-1] > SOME * 500
        assert seen["max_penetration"].max() <= deepest + 1e-13
        assert seen["link_error"].max() <= 1.01 * deepest / 0.3 + 1e-14
        errors.append(seen["energy_error"].max())
    assert errors[1] < 1e-8
    assert errors[1] < 0.01 * errors[0]


@pytest.mark.parametrize(
    ("method", "tolerance"),
    [(SPRINGS["linear"], 1e-9), (loop(1e-26), 1e-7)],
    ids=["springs", "loop"],
)
def test_a_body_of_one_point_moves_as_a_particle(method, tolerance):
    scene = swarm.Scene(SPHERE)
    place, velocity = np.array([[0.1], [0.2], [-0.3]]), np.array([[0.9], [0.5], [0.3]])
    body = swarm.Body([(0.0, 0.0, 0.0)], mass=[2.0])
    bodies = swarm.simulate(scene, swarm.Bodies(body, place[:, :, None], velocity[:, :, None]), method, until=3.0)
    particle = swarm.simulate(scene, swarm.Particles(place, velocity, 2.0), method, until=3.0)
    assert particle.observables["impacts"][-1] >= 2
    np.testing.assert_allclose(bodies.bodies.position[:, 0, 0], particle.particles.position[:, 0], atol=tolerance)


@pytest.mark.parametrize("method", [SPRINGS["linear"], loop()], ids=["springs", "loop"])
def test_bits_are_the_same_for_threads_blocks_neighbours_and_halts(method):
    scene, start = some("tetrahedron", BOX, 16)
    span, ends = (140.0, []) if isinstance(method, swarm.Penalty) else (1.4, [])
    for first, threads, size in ((None, 2, 6), (3, 1, 16), (50, 2, 5)):
        with BodyRun(scene.compiled(), (start, start.particles()), method, threads, size) as one:
            for k in range(3):
                passes = first
                while True:
                    if first is not None:
                        one.halt(passes)
                    if one.advance(span, 1.4 * (k + 1)):
                        break
                    passes = 2 * passes
            ends.append({name: array.copy() for name, array in one.arrays().items()})
    for end in ends[1:]:
        for name, array in ends[0].items():
            np.testing.assert_array_equal(end[name], array, err_msg=name)


def test_a_pin_in_a_soft_cavity_keeps_the_energy():
    # The cavity is carried by point 0, the pin is point 1; both fly in a large vessel.
    body = swarm.Body(
        [(0.0, 0.0, 0.0), (0.02, 0.0, 0.0)], mass=[1.0, 0.5], contacts=[0], cavities=[(swarm.Sphere(0.05), 0, 1)]
    )
    position = np.array([[0.0, 0.02], [0.0, 0.0], [0.0, 0.0]])
    velocity = np.array([[0.3, -0.2], [0.1, 0.4], [0.0, 0.1]])
    method = swarm.Penalty(dt=1e-3, penalty=1e4)
    seen = swarm.simulate(
        swarm.Scene(SPHERE), swarm.Bodies(body, position, velocity), method, until=5.0, every=0.05, compile="never"
    ).observables
    assert seen["cavity_impulse"][-1].max() > 1.0
    assert seen["contact_energy"].max() > 0.0
    assert seen["energy_error"].max() < 1e-11


@pytest.mark.parametrize(
    ("method", "surfaces", "message"),
    [
        (swarm.Penalty(dt=1e-2, penalty=1e4, exponent=2.0, gradient="mean-value"), SPHERE, "composite"),
        (swarm.AugmentedLagrangian(dt=1e-2, penalty=1e4), SPHERE, "adaptive .* must be True with bodies"),
        (swarm.AugmentedLagrangian(dt=1e-2, penalty=1e4, exponent=1.5, adaptive=True), SPHERE, "exponent .* must be 1"),
        (loop(acceleration="secant"), SPHERE, 'acceleration .* must be "none"'),
        (loop(on_unconverged="impact"), SPHERE, 'on_unconverged must be "raise" or "count"'),
        (SPRINGS["linear"], [swarm.Sphere(1.0, restitution=0.5)], "restitution must be 1"),
        (swarm.Verlet(dt=1e-3, penalty=1e4), SPHERE, "bodies need the method"),
        (SPRINGS["linear"], [swarm.Prism([(0, 0), (1, 0), (0, 1)], 1.0)], "must not be Prism with bodies and soft"),
        (SPRINGS["linear"], [swarm.Union([*SPHERE, swarm.Sphere(1.0, (1, 0, 0))])], "of several rooms with bodies and"),
    ],
)
def test_what_does_not_go_with_bodies_is_refused(method, surfaces, message):
    scene = swarm.Scene(surfaces)
    start = swarm.place(scene, BODIES["dumbbell"](), 2, seed=1)
    with pytest.raises(swarm.SceneError, match=message):
        swarm.simulate(scene, start, method, until=1.0)


def test_frames_of_springs_are_whole_steps():
    scene, start = some("dumbbell", SPHERE, 2)
    with pytest.raises(swarm.SceneError, match="whole number of steps"):
        swarm.simulate(scene, start, SPRINGS["linear"], until=1.005)


def test_a_loop_that_does_not_converge_is_a_sentence_or_is_counted():
    scene, start = some("dumbbell", SPHERE)
    few = {"dt": 1e-2, "penalty": 1e2, "max_sweeps": 3, "adaptive": True}
    with pytest.raises(
        swarm.RunError, match=r"body \d+, at .* 3 sweeps of a step left V above .* J; take a larger penalty"
    ):
        swarm.simulate(scene, start, swarm.AugmentedLagrangian(**few), until=2.0)
    seen = swarm.simulate(
        scene, start, swarm.AugmentedLagrangian(**few, on_unconverged="count"), until=0.05
    ).observables
    assert seen["unconverged"][-1] > 0
