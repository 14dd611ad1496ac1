"""Particles among the bodies of a field move as among the same bodies one by one, and keep what is to be kept."""

import numpy as np
import pytest
from energy_books import unbooked

import swarm

DOWN = (0.0, 0.0, -9.81)
BOX = (0.5, 0.5, 0.5)


def places(n, seed=1):
    return np.random.default_rng(seed).uniform(-0.4, 0.4, (n, 3))


def run(scene, start, until, **options):
    return swarm.simulate(scene, start, swarm.Impact(), until=until, **{"compile": "never", **options})


def both(places, radius, gravity=None, **laws):
    """The same balls as a field and one by one."""
    box = swarm.Box(BOX, **laws)
    balls = [swarm.Sphere(radius, tuple(c), "outside", **laws) for c in places.tolist()]
    return swarm.Scene([box, swarm.Spheres(places, radius, **laws)], gravity), swarm.Scene([box, *balls], gravity)


@pytest.mark.parametrize(
    ("gravity", "laws", "until"),
    [
        (None, {}, 2.0),
        (DOWN, {}, 0.5),
        (DOWN, {"restitution": 0.3}, 0.6),
        (DOWN, {"restitution": 0.3, "friction": 0.2}, 2.0),
    ],
    ids=["straight", "falling", "losing", "rubbing, to rest"],
)
def test_a_field_is_its_balls(gravity, laws, until):
    field, apart = both(places(4), 0.15, gravity, **laws)
    assert len(apart.compiled().order.others) == 5
    start = swarm.fill(field, 10, speed=1.0, seed=2)
    one, other = run(field, start, until), run(apart, start, until)
    # What a flight through cells rounds differently grows from impact to impact.
    assert one.particles.position == pytest.approx(other.particles.position, abs=1e-7)
    assert one.observables["impacts"][-1] == other.observables["impacts"][-1] > 10
    seen = one.observables["impulse"][-1]
    wanted = other.observables["impulse"][-1]
    assert [seen[0], seen[1]] == pytest.approx([wanted[0], wanted[1:].sum()], rel=1e-6)
    assert one.observables["max_penetration"].max() <= 1e-15


def test_listed_balls_keep_a_row_each():
    """Seven are a field for kernels, and seven surfaces for the user."""
    field, apart = both(places(7), 0.12)
    start = swarm.fill(field, 60, speed=1.0, seed=2)
    one, other = run(field, start, 2.0).observables, run(apart, start, 2.0).observables
    assert other["impulse"].shape == (2, 8)
    assert (other["impulse"][-1, 1:] > 0.0).sum() > 2
    assert other["impulse"][-1, 1:].sum() == pytest.approx(one["impulse"][-1, 1], rel=1e-9)


def test_a_grain_rests_in_the_pocket_of_three_balls():
    """It chatters on one, slides into the edge of two, and stops where the third holds it too."""
    angle = np.array([0.0, 2.0, 4.0]) * np.pi / 3.0
    around = np.stack([0.1 * np.cos(angle), 0.1 * np.sin(angle), 0.0 * angle], axis=1)
    scene = swarm.Scene([swarm.Spheres(around, 0.12, restitution=0.2)], DOWN)
    # The place at distance R from all three centres, below which there is no way through.
    low = np.sqrt(0.12**2 - 0.1**2)
    end = run(scene, swarm.Particles([0.01, 0.003, 0.2], [0.0, 0.0, 0.0]), 30.0)
    assert end.particles.position[:, 0] == pytest.approx((0.0, 0.0, low), abs=1e-8)
    assert np.abs(end.particles.velocity).max() < 1e-6
    assert end.observables["max_penetration"].max() <= 1e-14


def test_a_particle_leaves_a_ball_of_a_field_where_it_leaves_a_ball():
    """It slides from near the top, and falls off where cos = 2/3: at that instant the speed is sqrt(2 g (1 - 2/3))."""
    far = np.array([[0.0, 0.0, 0.0], [0.0, 3.0, 0.0], [3.0, 0.0, 0.0]])
    start = swarm.Particles([1e-2, 0.0, np.sqrt(1.0 - 1e-4)], [0.0, 0.0, 0.0])
    surfaces = swarm.Spheres(far, 1.0), swarm.Sphere(1.0, side="outside")
    ends = [run(swarm.Scene([surface], (0.0, 0.0, -1.0)), start, 7.5) for surface in surfaces]
    assert ends[0].particles.position == pytest.approx(ends[1].particles.position, abs=1e-9)
    assert (ends[0].particles.position[:, 0] ** 2).sum() > 1.5
    assert ends[0].observables["sliding_time"][-1] == pytest.approx(ends[1].observables["sliding_time"][-1], abs=1e-9)


@pytest.mark.physics
@pytest.mark.parametrize("laws", [{}, {"restitution": 0.6, "friction": 0.3}], ids=["smooth", "grains"])
def test_bits_do_not_depend_on_threads_and_blocks(laws):
    random = np.random.default_rng(5)
    packing = swarm.Spheres(random.uniform(-0.5, 0.5, (300, 3)), random.uniform(0.02, 0.06, 300), **laws)
    scene = swarm.Scene([swarm.Box(BOX, **laws), packing], DOWN)
    start = swarm.fill(scene, 300, speed=1.0, seed=3)
    ends = [
        run(scene, start, 0.4, every=0.1, threads=threads, block_size=block, compile="always")
        for threads, block in ((1, None), (2, None), (2, 64))
    ]
    few = swarm.Particles(*(np.ascontiguousarray(a[:, :6]) for a in (start.position, start.velocity)))
    plain, compiled = (run(scene, few, 0.2, every=0.1, compile=how) for how in ("never", "always"))
    assert plain.particles.position.tobytes() == compiled.particles.position.tobytes()
    for end in ends[1:]:
        assert end.particles.position.tobytes() == ends[0].particles.position.tobytes()
        assert end.particles.velocity.tobytes() == ends[0].particles.velocity.tobytes()
    seen = ends[0].observables
    assert unbooked(seen) <= 1e-13 * abs(seen["kinetic_energy"][0])
    assert seen["max_penetration"].max() <= 1e-15


@pytest.mark.physics
def test_a_lattice_in_a_cell_that_repeats_is_a_lattice():
    """27 balls in a cell, and the 8 x 27 of eight cells: the same flight."""
    one = (np.stack(np.meshgrid(*3 * [np.arange(3)], indexing="ij"), -1).reshape(-1, 3) + 0.5) / 3.0
    eight = np.concatenate([one + shift for shift in np.stack(np.meshgrid(*3 * [[0.0, 1.0]]), -1).reshape(-1, 3)])
    cell = swarm.Scene([swarm.Spheres(one, 0.13)], period=(1.0, 1.0, 1.0))
    large = swarm.Scene([swarm.Spheres(eight, 0.13)], period=(2.0, 2.0, 2.0))
    start = swarm.fill(cell, 200, speed=1.0, seed=1)
    ends = [run(scene, start, 2.0, compile="always") for scene in (cell, large)]
    unwrapped = [scene.unwrapped(end.particles) for scene, end in zip((cell, large), ends, strict=True)]
    assert unwrapped[0] == pytest.approx(unwrapped[1], abs=1e-6)
    assert ends[0].observables["impacts"][-1] == ends[1].observables["impacts"][-1] > 500
    assert (ends[0].particles.image != ends[1].particles.image).any()


@pytest.mark.parametrize("laws", [{}, {"restitution": 0.8, "friction": 0.2}], ids=["smooth", "rough"])
def test_bodies_meet_a_field_as_its_balls(laws):
    field, apart = both(places(4), 0.15, DOWN, **laws)
    bodies = swarm.place(field, swarm.dumbbell(0.1, 1.0), 4, speed=0.5, spin=1.0, seed=1)
    ends = [
        swarm.simulate(scene, bodies, swarm.Impact(dt=1e-2), until=0.6, compile="never") for scene in (field, apart)
    ]
    assert ends[0].bodies.position.tobytes() == ends[1].bodies.position.tobytes()
    seen, wanted = (end.observables["impulse"][-1] for end in ends)
    assert [seen[1], seen[0]] == pytest.approx([wanted[1:].sum(), wanted[0]], rel=1e-12)
    assert seen[1] > 0.0


def test_bodies_among_many_balls_stay_outside_of_them():
    random = np.random.default_rng(2)
    packing = swarm.Spheres(random.uniform(-0.4, 0.4, (60, 3)), random.uniform(0.03, 0.08, 60))
    scene = swarm.Scene([swarm.Box(BOX), packing], (0.0, 0.0, -1.0))
    bodies = swarm.place(scene, swarm.dumbbell(0.1, 1.0), 4, speed=0.5, spin=1.0, seed=1)
    end = swarm.simulate(scene, bodies, swarm.Impact(dt=1e-2), until=1.0, every=0.25, compile="never").observables
    assert end["impulse"][-1].min() > 0.0
    assert end["max_penetration"].max() <= 1e-14
    assert end["energy_error"].max() <= 1e-13
