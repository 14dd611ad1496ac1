"""Frames, blocks, threads, and what is refused."""

from dataclasses import replace

import numba
import numpy as np
import pytest
from same_bits import require_same

import swarm
from swarm.lanes import block as blocks
from swarm.run.engine import Run
from swarm.surfaces import rotation

SPHERE = swarm.Scene([swarm.Sphere(0.5)])
NESTED = swarm.Scene([swarm.Sphere(0.5), swarm.Sphere(0.2, side="outside")])
NAMES = {
    "time",
    "kinetic_energy",
    "potential_energy",
    "contact_energy",
    "total_energy",
    "energy_error",
    "momentum",
    "angular_momentum",
    "max_penetration",
    "impacts",
    "impulse",
    "dissipated_energy",
    "escaped",
    "unconverged",
    "sliding",
    "sliding_time",
    "wall_heat",
}


def _run(n=50, scene=SPHERE, method=None, until=2.0, **keywords):
    particles = swarm.fill(scene, n, speed=1.0, seed=1)
    return swarm.simulate(scene, particles, method or swarm.Impact(), until=until, **{"threads": 1, **keywords})


@pytest.mark.parametrize(
    ("until", "every", "times"),
    [
        (2.0, None, [0.0, 2.0]),
        (2.0, 2.0, [0.0, 2.0]),
        (2.0, 0.5, [0.0, 0.5, 1.0, 1.5, 2.0]),
        (1.0, 0.4, [0.0, 0.4, 0.8, 1.0]),
        (0.3, 0.1, [0.0, 0.1, 0.2, 0.3]),
        (0.7, 0.1, [0.0, 0.1, 0.2, 3 * 0.1, 0.4, 0.5, 6 * 0.1, 0.7]),
    ],
)
def test_frames_are_the_start_every_and_the_end(until, every, times):
    """The last frame is `until` exactly; decimal times that miss it by round-off add no frame."""
    result = _run(until=until, every=every)
    assert result.times.tolist() == result.observables["time"].tolist() == times


def test_simulate_does_not_change_its_argument():
    particles = swarm.fill(SPHERE, 20, speed=1.0, seed=1)
    before = [array.copy() for array in (particles.position, particles.velocity, particles.mass)]
    result = swarm.simulate(SPHERE, particles, swarm.Impact(), until=5.0, threads=1)
    for array, copy in zip((particles.position, particles.velocity, particles.mass), before, strict=True):
        assert np.array_equal(array, copy)
    assert not np.array_equal(result.particles.position, particles.position)


def test_observables_have_one_entry_a_frame():
    observables = _run(scene=NESTED, every=0.5).observables
    assert set(observables) == NAMES
    shapes = {"momentum": (5, 3), "angular_momentum": (5, 3), "impulse": (5, 2), "wall_heat": (5, 2)}
    assert {name: column.shape for name, column in observables.items()} == {
        name: shapes.get(name, (5,)) for name in NAMES
    }
    assert observables["impacts"].dtype.kind == "i"
    assert (np.diff(observables["impacts"]) >= 0).all()
    assert observables["impacts"][0] == 0
    assert (observables["impulse"][0] == 0.0).all()


def test_result_arrays():
    result = _run(n=7)
    for array in (result.particles.position, result.particles.velocity):
        assert (array.shape, array.dtype, array.flags.c_contiguous) == ((3, 7), np.float64, True)
    assert result.particles.mass.tolist() == [1.0] * 7
    each = result.impacts_per_particle
    assert (each.shape, each.dtype, each.sum()) == ((7,), np.int64, result.observables["impacts"][-1])
    assert result.trajectory is None
    assert result.wall_time > 0.0


def test_impacts_of_each_particle():
    """At unit speed along a diameter of 1 m, from its middle; and one that rests."""
    start = swarm.Particles(np.zeros((3, 3)), [[1.0, 3.0, 0.0], [0.0] * 3, [0.0] * 3])
    result = swarm.simulate(SPHERE, start, swarm.Impact(), until=4.0, compile="never")
    assert result.impacts_per_particle.tolist() == [4, 12, 0]


def test_observables_are_sums_over_particles():
    """What a frame reports is what the arrays say."""
    mass = np.linspace(0.5, 2.0, 3000)
    particles = swarm.fill(SPHERE, 3000, speed=0.7, mass=mass, seed=2)
    result = swarm.simulate(SPHERE, particles, swarm.Impact(), until=1.0, threads=1)
    r, v, seen = result.particles.position, result.particles.velocity, result.observables
    assert seen["kinetic_energy"][-1] == pytest.approx(0.5 * (mass * v**2).sum(), rel=1e-13)
    assert seen["total_energy"][-1] == pytest.approx(seen["total_energy"][0], rel=1e-13)
    assert seen["momentum"][-1] == pytest.approx((mass * v).sum(axis=1), abs=1e-10)
    assert seen["angular_momentum"][-1] == pytest.approx(np.cross(r, mass * v, axis=0).sum(axis=1), abs=1e-10)


@pytest.mark.skipif(numba.config.DISABLE_JIT, reason="minutes in plain Python; which lane is which is the same there")
@pytest.mark.parametrize("scene", [SPHERE, NESTED], ids=["sphere", "nested"])
def test_threads_and_blocks_change_no_bit(scene):
    """A particle's steps depend on itself alone, and sums run over fixed chunks in a fixed order.

    With every method: physics/test_methods.py.
    """
    variants = [{"threads": 1}, {"threads": 2}, {"threads": 3, "block_size": 1}]
    variants += [{"threads": 2, "block_size": size} for size in (100, 1024, 1025, 5000, 100_000)]
    first, *others = [_run(5000, scene, swarm.Impact(), until=4.0, every=1.0, **variant) for variant in variants]
    for other in others:
        require_same(first, other)


def test_a_particle_does_not_depend_on_its_neighbours():
    """Lanes share a loop and no data."""
    all_of_them = swarm.fill(NESTED, 700, speed=1.0, seed=3)
    together = swarm.simulate(NESTED, all_of_them, swarm.Impact(), until=3.0, threads=1).particles
    for i in (0, 255, 256, 699):
        alone = swarm.Particles(all_of_them.position[:, i], all_of_them.velocity[:, i])
        end = swarm.simulate(NESTED, alone, swarm.Impact(), until=3.0, threads=1).particles
        assert np.array_equal(end.position[:, 0], together.position[:, i])
        assert np.array_equal(end.velocity[:, 0], together.velocity[:, i])


def test_progress_is_called_with_every_frame():
    seen = []
    result = _run(every=0.5, progress=seen.append)
    assert [frame.number for frame in seen] == [0, 1, 2, 3, 4]
    assert [frame.time for frame in seen] == result.observables["time"].tolist()
    assert {frame.until for frame in seen} == {2.0}
    assert [frame.observables["impacts"] for frame in seen] == result.observables["impacts"].tolist()


def test_an_error_in_progress_ends_the_run():
    def stop(frame):
        if frame.number == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        _run(every=0.5, threads=2, progress=stop)


@pytest.mark.parametrize(
    ("keywords", "words"),
    [
        ({"until": 0.0}, "until must"),
        ({"until": -1.0}, "until must"),
        ({"until": float("nan")}, "until must be a finite number above 0, got nan"),
        ({"until": float("inf")}, "until must be a finite number above 0, got inf"),
        ({"until": "soon"}, "until must be a finite number above 0, got 'soon'"),
        ({"every": 0.0}, "every must be above 0, got 0"),
        ({"every": -0.5}, "every must be above 0, got -0.5"),
        ({"every": 3.0}, "every must be at most until = 2, got 3"),
        ({"threads": 0}, "threads must be 1 or more, got 0"),
        ({"threads": 1.5}, "threads must be a whole number, 1 or more, got 1.5"),
        ({"threads": True}, "threads must be a whole number, 1 or more, got True"),
        ({"block_size": 0}, "block_size must be 1 or more, got 0"),
        ({"method": swarm.Penalty(dt=0.3, penalty=1e3)}, "until must be a whole number of steps, got until = 2 s"),
        ({"method": swarm.Penalty(dt=0.3, penalty=1e3)}, "which is 6.66667 steps; take until = 2.1 s"),
        ({"method": swarm.Penalty(dt=3.0, penalty=1e3)}, "take until = 3 s"),
        ({"method": swarm.Penalty(dt=1e-6, penalty=1e3), "until": 12.34567849}, "take until = 12.345678 s"),
        ({"method": swarm.Penalty(dt=0.5, penalty=1e3), "every": 0.75}, "every must be a whole number of steps"),
        ({"method": swarm.Impact(contact_step=9.0)}, "contact_step must be at most the crossing time"),
    ],
)
def test_bad_arguments_are_named(keywords, words):
    with pytest.raises(swarm.SceneError) as caught:
        _run(**keywords)
    assert words in str(caught.value)


@pytest.mark.parametrize("argument", ["scene", "particles", "method"])
def test_wrong_types_are_named(argument):
    arguments = {"scene": SPHERE, "particles": swarm.fill(SPHERE, 2, speed=1.0), "method": swarm.Impact()}
    arguments[argument] = "impact"
    with pytest.raises(swarm.SceneError, match=f"{argument} must be a swarm.* got 'impact'"):
        swarm.simulate(**arguments, until=1.0)


def test_particles_outside_are_counted_and_the_first_is_named():
    position = np.zeros((3, 5))
    position[0] = [0.3, 0.75, 0.4, 0.1, 0.3]
    with pytest.raises(swarm.SceneError) as caught:
        swarm.simulate(NESTED, swarm.Particles(position, np.ones((3, 5))), swarm.Impact(), until=1.0)
    message = str(caught.value)
    for words in ("2 of 5 outside", "particle 1 at (0.75, 0.0, 0.0)", "0.25 m outside surfaces[0] (Sphere)"):
        assert words in message
    position[0, 1] = 0.3
    with pytest.raises(swarm.SceneError, match=r"1 of 5 .* particle 3 at \(0\.1, .* 0\.1 m inside surfaces\[1\]"):
        swarm.simulate(NESTED, swarm.Particles(position, np.ones((3, 5))), swarm.Impact(), until=1.0)


@pytest.mark.parametrize(
    "method", [swarm.Impact(shortest_flight=1e-2), swarm.Penalty(dt=0.125, penalty=1e3)], ids=["impact", "penalty"]
)
def test_particles_on_the_wall_and_at_rest_are_valid(method):
    """On a wall, moving out, in or along it, or at rest anywhere: all are states of a billiard."""
    third = 0.5 / np.sqrt(3.0)
    position = np.array([[0.5, 0, 0], [0.5, 0, 0], [0, 0.5, 0], [third] * 3, [0.2, 0, 0], [0.3, 0, 0]]).T
    velocity = np.array([[1.0, 0, 0], [-1.0, 0, 0], [1.0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0]]).T
    result = swarm.simulate(NESTED, swarm.Particles(position, velocity), method, until=2.0, every=0.5, threads=1)
    assert np.array_equal(result.particles.position[:, 3:], position[:, 3:])
    assert (result.particles.velocity[:, 3:] == 0.0).all()
    assert result.observables["energy_error"].max() <= 1e-12
    if isinstance(method, swarm.Impact):
        assert result.observables["max_penetration"].max() <= 4.0 * np.spacing(0.5)


@pytest.mark.parametrize("name", ["position", "velocity", "mass"])
def test_arrays_changed_to_nan_after_construction_are_refused(name):
    """`Particles` checks its arrays, but they can be written to: `simulate` looks again."""
    particles = swarm.fill(SPHERE, 5, speed=1.0)
    getattr(particles, name)[..., 3] = np.nan
    with pytest.raises(swarm.SceneError, match=rf"{name} must be .* particle 3"):
        swarm.simulate(SPHERE, particles, swarm.Impact(), until=1.0)


@pytest.mark.parametrize(
    ("name", "assigned", "as_run"),
    [
        ("velocity", np.array([[2], [0], [0]]), [[2.0], [0.0], [0.0]]),
        ("velocity", np.array([[0.1], [0.7], [0.0]], np.float32), np.array([[0.1], [0.7], [0.0]], np.float32)),
        ("velocity", [[0.1], [0.7], [0.0]], [[0.1], [0.7], [0.0]]),
        ("velocity", np.asfortranarray([[0.1], [0.7], [0.0]]), [[0.1], [0.7], [0.0]]),
        ("position", [0.1, 0.2, 0.0], [[0.1], [0.2], [0.0]]),
        ("mass", 3, [3.0]),
        ("mass", np.float32(0.1), [np.float32(0.1)]),
    ],
)
def test_assigned_arrays_run_as_their_values(name, assigned, as_run):
    """An integer array would truncate the kernel's velocities."""
    arrays = {"position": np.array([[0.1], [0.2], [0.0]]), "velocity": np.array([[0.3], [0.4], [0.5]]), "mass": [1.0]}
    expected = swarm.Particles(**{**arrays, name: np.asarray(as_run, np.float64)})
    particles = swarm.Particles(**arrays)
    setattr(particles, name, assigned)
    whole, other = (swarm.simulate(SPHERE, one, swarm.Impact(), until=5.0, threads=1) for one in (expected, particles))
    require_same(whole, other)
    assert other.particles.velocity.dtype == np.float64
    assert getattr(particles, name) is assigned


@pytest.mark.parametrize(
    ("name", "assigned", "words"),
    [
        ("velocity", np.ones((3, 5)) * 1j, "velocity must be an array of numbers, got complex128"),
        ("position", np.ma.masked_less(np.zeros((3, 5)), 1.0), "position must be an array without a mask"),
        ("velocity", "fast", "velocity must be an array of numbers, got str"),
        ("velocity", np.zeros((3, 4)), r"velocity must have the shape of position, \(3, 5\), got \(3, 4\)"),
        ("velocity", np.full((3, 5), 1e300), r"velocity must be finite and at most 1e\+100"),
        ("mass", 0, "mass must be a finite number above 0"),
    ],
)
def test_what_particles_would_not_take_is_refused(name, assigned, words):
    particles = swarm.fill(SPHERE, 5, speed=1.0)
    setattr(particles, name, assigned)
    with pytest.raises(swarm.SceneError, match=words):
        swarm.simulate(SPHERE, particles, swarm.Impact(), until=1.0)


@pytest.mark.parametrize("method", [swarm.Impact(), swarm.AugmentedLagrangian(1e-2, 1e3, adaptive=True)], ids=repr)
def test_a_flight_out_of_a_tip_is_refused(method):
    """No normal says how it is reflected: it took 10 000 impacts, and stayed with the velocity that it had."""
    scene = swarm.Scene([swarm.Cone(0.5)])
    start = swarm.Particles(np.zeros((3, 2)), [[0.0, 1.0], [0.0, 0.0], [1.0, 0.0]])
    with pytest.raises(swarm.SceneError, match=r"particle 1 at \(0.0, 0.0, 0.0\), a tip of surfaces\[0\] \(Cone\)"):
        swarm.simulate(scene, start, method, until=1.0, compile="never")
    inwards = swarm.Particles((0.0, 0.0, 0.0), (0.0, 0.1, 1.0))
    end = swarm.simulate(scene, inwards, method, until=0.5, compile="never")
    assert end.particles.position[:, 0] == pytest.approx([0.0, 0.05, 0.5], abs=1e-12)


def test_a_phi_that_is_no_number_is_outside():
    wall = swarm.Formula("x**2 + y**2 + z**2 - 0.25 + log(z + 0.4)/1e3", bounds=((-0.6, -0.6, -0.39), (0.6, 0.6, 0.6)))
    start = swarm.Particles([[0.0], [0.0], [-0.41]], np.ones((3, 1)))
    with pytest.raises(swarm.SceneError, match=r"outside surfaces\[0\] .* its phi is not a number there"):
        swarm.simulate(swarm.Scene([wall]), start, swarm.Impact(), until=1.0)


def test_a_huge_block_is_all_particles():
    assert np.array_equal(_run(block_size=10**30).particles.position, _run().particles.position)


@pytest.mark.parametrize("side", ["+z", "-x"])
@pytest.mark.parametrize("gravity", [None, "out", "back", "across"])
def test_particles_beyond_an_open_face_have_escaped(side, gravity):
    """The side walls extend without end and stop no escaping particle; gravity may."""
    turn = {"axis": (1.0, 2.0, 3.0), "angle": 0.7}
    box = swarm.Box((0.5, 0.4, 0.3), center=(0.1, 0.2, 0.3), open=[side], rotation=turn)
    axes = rotation.matrix(rotation.quaternion("turn", turn))
    normal = axes[:, "xyz".index(side[1])] * (1.0 if side[0] == "+" else -1.0)
    pulls = {None: None, "out": 0.5 * normal, "back": -50.0 * normal, "across": np.cross(normal, (0.3, 0.2, 0.1))}
    scene = swarm.Scene([box], pulls[gravity])
    start = np.array(box.center)[:, None] + axes @ np.random.default_rng(1).uniform(-0.29, 0.29, (3, 200))
    velocity = np.random.default_rng(2).normal(size=(3, 200))
    result = swarm.simulate(scene, swarm.Particles(start, velocity), swarm.Impact(), until=1.0, every=0.25, threads=1)
    half = box.half_widths["xyz".index(side[1])]
    beyond = normal @ (result.particles.position - np.array(box.center)[:, None]) > half
    leaving = normal @ result.particles.velocity > 0.0
    escaped = result.observables["escaped"]
    if gravity == "back":
        assert escaped.tolist() == [0] * 5
    else:
        assert escaped[-1] == (beyond & leaving).sum() == beyond.sum() > 50
        assert (np.diff(escaped) >= 0).all()


def test_too_many_impacts_in_a_frame_are_an_error(monkeypatch):
    """An error that names the particle and its walls, not a hang."""
    monkeypatch.setattr(blocks, "MOST_HITS", 5000.0)
    monkeypatch.setattr(blocks, "LOOK", 16)
    start = swarm.Particles([[0.0, 0.0], [0.0, 0.0], [0.0, 0.0]], [[1.0, 0.0], [0.0, 0.0], [0.0, 1.0]])
    with pytest.raises(swarm.RunError, match=r"particle 1: .*without end.* surfaces\[0\] \(Slab\)"):
        swarm.simulate(swarm.Scene([swarm.Slab((0, 0, 1), 1e-4)]), start, swarm.Impact(), until=2.0, compile="never")


@pytest.mark.parametrize("threads", [1, 2])
def test_a_contact_that_lasts_loads_its_kernels_and_changes_no_bit(threads):
    """A run starts without the kernels of sliding; with a grazing particle the others go on where they were."""
    start = swarm.fill(SPHERE, 1100, speed=1.0, seed=6)
    start.position[:, 800], start.velocity[:, 800] = (0.5, 0.0, 0.0), (0.0, 1.0, 0.0)
    both = swarm.simulate(SPHERE, start, swarm.Impact(), until=1.2, every=0.4, threads=threads, block_size=512)
    assert both.observables["sliding"].tolist() == [0, 1, 1, 1]
    for some in (np.arange(1100) != 800, np.arange(1100) == 800):
        part = swarm.Particles(start.position[:, some], start.velocity[:, some])
        alone = swarm.simulate(SPHERE, part, swarm.Impact(), until=1.2, every=0.4, threads=1)
        assert np.array_equal(alone.particles.position, both.particles.position[:, some])
        assert np.array_equal(alone.particles.velocity, both.particles.velocity[:, some])
        assert np.array_equal(alone.impacts_per_particle, both.impacts_per_particle[some])


def test_a_frame_that_begins_at_the_wall_needs_no_slow_path():
    """A flight that a frame cuts short does not graze: a cavity without grazing never needs the slow-path kernel."""
    wall = swarm.Particles((0.5 - 1e-9, 0.0, 0.0), (1.0, 0.2, 0.0))
    with Run(SPHERE.compiled(), wall, swarm.Impact(), 1, None) as one:
        one.advance(3.0, 3.0)
        assert one.state.impacts[0] >= 3
        assert one._hard is None


@pytest.mark.parametrize("gravity", [None, (0.0, 0.0, -1.0)], ids=["no gravity", "gravity"])
def test_an_open_scene_is_reported_once_and_escaped_particles_are_counted(caplog, gravity):
    scene = swarm.Scene([swarm.Box((0.5, 0.5, 0.5), open=["-z"])], gravity)
    velocity = [[0.0, 0.0, 0.3, 0.1], [0.0, 0.0, 0.0, 0.2], [-1.0, 1.0, 0.0, -0.5]]
    with caplog.at_level("WARNING", "swarm"):
        result = swarm.simulate(
            scene, swarm.Particles(np.zeros((3, 4)), velocity), swarm.Impact(), until=200.0, every=100.0
        )
    assert [record.getMessage() for record in caplog.records] == [
        "the scene is open: particles may fly to infinity; the observable 'escaped' counts them"
    ]
    # Without gravity the third bounces between two walls without end.
    assert result.observables["escaped"][-1] == (4 if gravity else 3)
    caplog.clear()
    closed = swarm.simulate(SPHERE, swarm.fill(SPHERE, 5, speed=1.0), swarm.Impact(), until=1.0)
    assert not caplog.records
    assert closed.observables["escaped"][-1] == 0


DOWN = (0.0, 0.0, -9.81)
GLASS = swarm.Box((0.5, 0.5, 0.5), open=["+z"])
OPEN = {
    "a glass": ([GLASS], DOWN, False),
    "a tube on a floor": ([swarm.Cylinder(0.5), swarm.Plane((0.0, 0.0, -1.0), 0.5)], DOWN, False),
    "a glass that leans": ([GLASS], (3.0, 0.0, -9.0), False),
    "a glass upside down": ([GLASS], (0.0, 0.0, 9.81), True),
    "a glass without gravity": ([GLASS], None, True),
    "a floor": ([swarm.Plane((0.0, 0.0, -1.0), 0.5)], DOWN, True),
    "a side": ([swarm.Box((0.5, 0.5, 0.5), open=["+x"])], DOWN, True),
    "a hole": ([replace(GLASS, openings=[swarm.Sphere(0.2, (0.0, 0.0, -0.5))])], DOWN, True),
    "a glass that goes": ([replace(GLASS, present=[(0.0, 1.0)])], DOWN, True),
}


@pytest.mark.parametrize("name", OPEN)
def test_a_scene_is_not_reported_as_open_where_gravity_pulls_all_particles_back(name, caplog):
    surfaces, gravity, comes = OPEN[name]
    start = swarm.Particles((-0.1, 0.2, 0.3), (3.0, 0.1, 2.0))
    result = swarm.simulate(swarm.Scene(surfaces, gravity), start, swarm.Impact(), until=20.0, compile="never")
    assert ("the scene is open" in caplog.text) == comes
    assert comes or result.observables["escaped"][-1] == 0


def test_a_run_in_two_parts_is_the_run():
    """The end of a run is a start: nothing is hidden in between that moves a particle."""
    particles = swarm.fill(SPHERE, 300, speed=1.0, seed=4)
    whole = swarm.simulate(SPHERE, particles, swarm.Impact(), until=4.0, every=2.0, threads=1).particles
    half = swarm.simulate(SPHERE, particles, swarm.Impact(), until=2.0, threads=1).particles
    rest = swarm.simulate(SPHERE, half, swarm.Impact(), until=2.0, threads=1).particles
    assert rest.position == pytest.approx(whole.position, abs=1e-13)


def test_the_method_is_impact_unless_one_is_given():
    scene = swarm.Scene([swarm.Sphere(0.5)])
    start = swarm.fill(scene, 3, speed=1.0, seed=1)
    one, other = (swarm.simulate(scene, start, *method, until=2.0).particles for method in ((), (swarm.Impact(),)))
    np.testing.assert_array_equal(one.position, other.position)
