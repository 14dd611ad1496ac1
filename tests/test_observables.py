"""What is measured at a frame, against NumPy over the whole array."""

import numpy as np
import pytest
from conftest import EPSILON, call, numbers_of, scene_of, wall_point

import swarm
from swarm import observables
from swarm.contact import events
from swarm.contact.regularisation import regularisation
from swarm.state import Contacts, State

# Not a whole number of chunks, nor of the columns of a chunk.
N = observables.CHUNK + 301


def state_of(n, surfaces, seed=1, reach=1.0):
    random = np.random.default_rng(seed)
    return State(
        random.uniform(-reach, reach, (3, n)),
        random.normal(size=(3, n)),
        random.uniform(0.5, 2.0, n),
        np.zeros(n),
        np.zeros(n),
        random.integers(0, 5, n),
        random.uniform(size=(surfaces, n)),
        np.zeros(0),
        None,
    )


def observe(law, scene, state, blocks=1):
    """The observables, from this many blocks."""
    n = len(state.mass)
    partial = np.zeros((-(-n // observables.CHUNK), observables.ROWS))
    size = len(partial) * observables.CHUNK if blocks == 1 else observables.CHUNK
    for k in reversed(range(1 if blocks == 1 else len(partial))):
        observables.observe(law, scene.compiled().walls(), scene.pull(), state, np.array([k]), size, partial)
    return observables.summary(partial, state, list(range(len(state.impulse))), True)


@pytest.fixture(scope="module")
def seen():
    """A scene with every term, its state, and what is seen of it."""
    scene, law = scene_of("sphere", "plane", gravity=(0.5, -1.0, 2.0)), regularisation(30.0, 1.5)
    state = state_of(N, 2)
    observables.start_energies(scene.compiled(), law, state)
    return scene, law, state, observe(law, scene, state)


def test_energies_and_momenta_are_sums(seen):
    scene, law, state, found = seen
    r, v, m = state.position, state.velocity, state.mass
    gaps = np.maximum(scene.gaps(r), 0.0)
    expected = {
        "kinetic_energy": (0.5 * m * (v**2).sum(axis=0)).sum(),
        "potential_energy": -(m * (np.array(scene.gravity) @ r)).sum(),
        "contact_energy": (law.alpha * gaps**2.5 / 2.5).sum(),
        "momentum": (m * v).sum(axis=1),
        "angular_momentum": (m * np.cross(r, v, axis=0)).sum(axis=1),
        "impulse": state.impulse.sum(axis=1),
        "impacts": state.impacts.sum(),
    }
    for name, value in expected.items():
        assert found[name] == pytest.approx(value, rel=1e-12, abs=1e-12 * N), name
    parts = ("kinetic_energy", "potential_energy", "contact_energy")
    assert found["total_energy"] == pytest.approx(sum(found[part] for part in parts), rel=1e-15)
    assert found["unconverged"] == 0


def test_energy_error_is_that_of_the_worst_particle(seen):
    """0 at the start; then |E - E0| over kinetic + contact + m |G| size at the start."""
    scene, law, state, found = seen
    assert found["energy_error"] <= 8 * EPSILON
    worst = 321
    faster = state.velocity.copy()
    faster[:, worst] *= 2.0
    after = observe(law, scene, state._replace(velocity=faster))
    m, kinetic = state.mass[worst], 0.5 * state.mass[worst] * (state.velocity[:, worst] ** 2).sum()
    stored = call(observables.contact_energy, law, scene.compiled().walls(), 1.0, state.position[:, worst])
    scale = kinetic + stored + m * scene.finite_size() * np.abs(scene.gravity).sum()
    assert after["energy_error"] == pytest.approx(3.0 * kinetic / scale, rel=1e-12)


def test_max_penetration_is_the_largest_distance_outside(seen):
    """max(g, 0)/|grad g| over particles and surfaces."""
    scene, _, state, found = seen
    gaps = scene.gaps(state.position)
    slopes = [np.sqrt((surface.gradient(state.position) ** 2).sum(axis=0)) for surface in scene.surfaces]
    assert found["max_penetration"] == pytest.approx((np.maximum(gaps, 0.0) / slopes).max(), rel=1e-12)


def test_rigid_walls_store_nothing_and_particles_inside_do_not_penetrate():
    scene, state = scene_of("sphere"), state_of(10, 1, reach=0.2)
    observables.start_energies(scene.compiled(), None, state)
    found = observe(None, scene, state)
    assert found["contact_energy"] == found["potential_energy"] == found["max_penetration"] == 0.0
    assert (state.inverse_scale > 0.0).all()


def test_what_lasts_of_contacts_and_the_heat_of_walls(seen):
    """Particles on a wall now, how long all were there, and the heat of each surface, whose walls may be several."""
    scene, law, state, found = seen
    assert (found["sliding"], found["sliding_time"], found["wall_heat"].tolist()) == (0, 0.0, [0.0, 0.0])
    random = np.random.default_rng(7)
    phase, sliding = np.zeros(N, np.int8), random.uniform(size=N)
    phase[3], phase[40:50], phase[-1] = events.HELD, events.EDGE, events.ARRIVED  # which is to rest
    two, four = np.zeros((2, N)), np.zeros((4, N))
    contacts = Contacts(phase, two, *four, two, np.zeros(N), two, sliding)
    heat = random.normal(size=(2, N))
    lasting = observe(law, scene, state._replace(contacts=contacts, heat=heat))
    assert (lasting["sliding"], lasting["sliding_time"]) == (12, pytest.approx(sliding.sum(), rel=1e-13))
    assert lasting["wall_heat"] == pytest.approx(heat.sum(axis=1), rel=1e-12)
    partial = np.zeros((-(-N // observables.CHUNK), observables.ROWS))
    of_one = observables.summary(partial, state._replace(heat=heat), [0, 0], True)
    assert of_one["wall_heat"] == pytest.approx([heat.sum()], rel=1e-12)
    for name in found.keys() - {"sliding", "sliding_time", "wall_heat"}:
        assert np.array_equal(found[name], lasting[name]), name


def test_drift_is_what_neither_loss_nor_heat_explains():
    table = {
        "time": [0.0, 1.0], "kinetic_energy": [1.0, 1.75], "potential_energy": [1.0, 0.75],
        "contact_energy": [0.0, 0.0],
        "total_energy": [2.0, 2.5], "dissipated_energy": [0.0, 0.25], "wall_heat": [[0.0, 0.0], [1.0, -0.25]],
    }  # fmt: skip
    seen = {name: np.array(values) for name, values in table.items()}
    assert observables.drift(seen) == 0.0
    del seen["wall_heat"]  # of an older version
    assert observables.drift(seen) == 0.75 / (1.75 + 0.25 + 0.25)
    # The zero of the potential energy is arbitrary: that of the total energy changes nothing.
    for height in (-2.0, 1e3):
        moved = {name: seen[name] + height for name in ("potential_energy", "total_energy")}
        assert observables.drift(seen | moved) == observables.drift(seen)


def test_at_rest_the_energy_error_has_no_scale():
    scene, state = scene_of("sphere"), state_of(3, 1, reach=0.2)
    state.velocity[:] = 0.0
    observables.start_energies(scene.compiled(), None, state)
    assert (state.inverse_scale == 0.0).all()
    assert observe(None, scene, state)["energy_error"] == 0.0


def test_blocks_do_not_change_a_bit(seen):
    scene, law, state, found = seen
    again = observe(law, scene, state, blocks=2)
    assert all(np.array_equal(found[name], again[name]) for name in found)


@pytest.mark.parametrize("name", ["sphere", "ball", "ellipsoid", "egg", "plane"])
def test_penetration_is_the_depth_next_to_the_wall(name):
    surface = numbers_of(name)
    wall = wall_point(surface, np.array([0.3, 0.5, -0.4]))
    normal = np.array(call(surface.unit_normal, wall))
    walls = swarm.Scene([swarm.Sphere(9.0), *scene_of(name).surfaces]).compiled().walls()
    assert call(observables.penetration, walls, wall + 1e-6 * normal) == pytest.approx(1e-6, rel=1e-4)
    assert call(observables.penetration, walls, wall - 1e-6 * normal) == 0.0


def test_walls_beside_a_field_have_their_own_impulse():
    """Particles that fly between the balls of a field along one axis each, and meet one pair of walls."""
    k = np.array([-0.2, 0.2])
    field = swarm.Spheres(np.array(np.meshgrid(k, k, k)).reshape(3, -1).T, 0.1)
    scene = swarm.Scene([field, *(swarm.Slab(axis, 0.5) for axis in np.eye(3))])
    start = swarm.Particles(np.zeros((3, 3)), np.eye(3), [1.0, 2.0, 3.0])
    result = swarm.simulate(scene, start, swarm.Impact(), until=1.7, compile="never", threads=1)
    assert result.observables["impulse"][-1] == pytest.approx([0.0, 4.0, 8.0, 12.0], rel=1e-14)
