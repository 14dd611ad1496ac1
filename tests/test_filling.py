"""`fill`: uniform in the volume, isotropic or Maxwellian, and the same for the same seed."""

import math
import pickle

import numpy as np
import pytest

import swarm
from swarm.placing import filling
from swarm.placing.cells import overlaps_of

# The statistics of N points are off by a few 1/sqrt(N).
N = 40_000
FEW = 4.5 / math.sqrt(N)

SPHERE = swarm.Scene([swarm.Sphere(2.0, (1.0, 0.0, -1.0))])


@pytest.mark.parametrize(
    "surface",
    [swarm.Sphere(2.0, (1.0, 0.0, -1.0)), swarm.Ellipsoid((0.3, 0.5, 2.0), (0.0, 1.0, 0.0))],
    ids=["sphere", "ellipsoid"],
)
def test_uniform_in_the_volume(surface):
    """With r scaled to the unit ball: <|r|^k> = 3/(3 + k), and no direction is preferred."""
    particles = swarm.fill(swarm.Scene([surface]), N, speed=1.0, seed=3)
    half = np.array(getattr(surface, "semi_axes", (2.0,) * 3))[:, None]
    unit = (particles.position - np.array(surface.center)[:, None]) / half
    radius = np.sqrt((unit**2).sum(axis=0))
    assert radius.max() <= 1.0 + 1e-12
    for k in (1, 2, 3, 6):
        assert (radius**k).mean() == pytest.approx(3.0 / (3.0 + k), abs=FEW)
    assert unit.mean(axis=1) == pytest.approx(np.zeros(3), abs=FEW)
    assert unit @ unit.T / N == pytest.approx(np.eye(3) / 5.0, abs=FEW)


def test_uniform_between_walls():
    """In a box with a ball cut out the density is the same everywhere."""
    walls = [swarm.Plane(sign * np.eye(3)[axis], 1.0) for axis in range(3) for sign in (1.0, -1.0)]
    scene = swarm.Scene([*walls, swarm.Sphere(1.0, side="outside")])
    points = swarm.fill(scene, N, speed=1.0).position
    assert (scene.gaps(points) <= 0.0).all()
    volume = 8.0 - 4.0 * math.pi / 3.0
    corner = (points > 0.5).all(axis=0).mean()
    # The whole of (0.5, 1)^3 but for what the ball takes, by the same count on a fine grid.
    axis = 0.5 + (np.arange(200) + 0.5) / 400.0
    kept = (axis[:, None, None] ** 2 + axis[:, None] ** 2 + axis**2 > 1.0).mean() * 0.125
    assert corner == pytest.approx(kept / volume, abs=FEW)


def test_speed_is_exact_and_isotropic():
    velocity = swarm.fill(SPHERE, N, speed=3.0, seed=4).velocity
    assert np.sqrt((velocity**2).sum(axis=0)) == pytest.approx(3.0, rel=1e-15)
    assert velocity.mean(axis=1) == pytest.approx(np.zeros(3), abs=3.0 * FEW)
    assert velocity @ velocity.T / N == pytest.approx(3.0 * np.eye(3), abs=9.0 * FEW)
    # uniform on the sphere: each component is uniform in [-3, 3]
    assert (velocity**4).mean(axis=1) == pytest.approx([81.0 / 5.0] * 3, abs=81.0 * FEW)


def test_temperature_is_maxwellian_for_every_mass():
    """<m v_i v_j> = T delta_ij and <(m v_i^2)^2> = 3 T^2, for the light and the heavy."""
    mass = np.where(np.arange(N) % 2, 4.0, 0.25)
    particles = swarm.fill(SPHERE, N, temperature=1.5, mass=mass, seed=5)
    assert (particles.mass == mass).all()
    for group in (mass == 4.0, mass == 0.25):
        scaled = particles.velocity[:, group] * np.sqrt(mass[group])
        assert scaled @ scaled.T / group.sum() == pytest.approx(1.5 * np.eye(3), abs=4.0 * FEW)
        assert (scaled**4).mean(axis=1) == pytest.approx([6.75] * 3, abs=40.0 * FEW)


@pytest.mark.parametrize("n", [1, 2, 10, 1000])
def test_an_exact_temperature_is_that_of_these_particles(n):
    """The mean of m v^2/2 is 3/2 T to round-off, for one seed as for any; the directions stay as they were drawn."""
    mass = np.linspace(0.5, 2.0, n)
    for seed in range(5):
        drawn, exact = (swarm.fill(SPHERE, n, temperature=0.7, mass=mass, seed=seed, exact=e) for e in (False, True))
        kinetic = 0.5 * exact.mass * (exact.velocity**2).sum(axis=0)
        assert kinetic.mean() == pytest.approx(1.5 * 0.7, rel=1e-14)
        ratio = exact.velocity / drawn.velocity
        np.testing.assert_allclose(ratio, ratio[0, 0], rtol=1e-14)


def test_the_temperature_of_few_is_off_by_what_the_docstring_says():
    """A relative standard deviation of sqrt(2/(3 n)), over 400 seeds to 5 standard errors."""
    n = 10
    means = [(swarm.fill(SPHERE, n, temperature=1.0, seed=seed).velocity ** 2).sum() / (3 * n) for seed in range(400)]
    assert np.std(means) == pytest.approx(math.sqrt(2.0 / (3.0 * n)), rel=5.0 / math.sqrt(2 * 400))


def test_velocity_does_not_know_the_position():
    particles = swarm.fill(SPHERE, N, temperature=1.0, seed=6)
    centred = particles.position - particles.position.mean(axis=1, keepdims=True)
    assert centred @ particles.velocity.T / N == pytest.approx(np.zeros((3, 3)), abs=FEW)


def test_the_seed_decides():
    first, same, other = (swarm.fill(SPHERE, 100, speed=1.0, seed=seed) for seed in (7, 7, 8))
    assert (first.position == same.position).all()
    assert (first.velocity == same.velocity).all()
    assert not (first.position == other.position).any()
    assert not (first.velocity == other.velocity).any()


@pytest.mark.parametrize("keyword", ["speed", "temperature"])
def test_nothing_moves_at_zero(keyword):
    assert (swarm.fill(SPHERE, 10, **{keyword: 0.0}).velocity == 0.0).all()


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        ({"n": 0, "speed": 1.0}, ["n must be 1 or more", "got 0"]),
        ({"n": 10.0, "speed": 1.0}, ["n must be a whole number", "10.0"]),
        ({"n": 10}, ["speed and temperature", "neither"]),
        ({"n": 10, "speed": 1.0, "temperature": 1.0}, ["speed and temperature", "both"]),
        ({"n": 10, "speed": -1.0}, ["speed must be 0 or more", "got -1"]),
        ({"n": 10, "speed": math.nan}, ["speed", "finite", "nan"]),
        ({"n": 10, "temperature": -1.0}, ["temperature must be 0 or more", "got -1"]),
        ({"n": 10, "speed": 1.0, "seed": -1}, ["seed must be 0 or more", "got -1"]),
        ({"n": 10, "speed": 1.0, "exact": True}, ["exact must be False with speed", "got True"]),
        ({"n": 10, "temperature": 1.0, "exact": 1}, ["exact must be true or false", "got 1"]),
        ({"n": 10, "speed": 1.0, "mass": 0.0}, ["mass", "above 0"]),
        ({"n": 10, "speed": 1.0, "mass": [1.0, 2.0]}, ["mass", "(10,)", "(2,)"]),
    ],
    ids=repr,
)
def test_errors_name_the_argument(arguments, parts):
    with pytest.raises(swarm.SceneError) as caught:
        swarm.fill(SPHERE, **arguments)
    assert all(part in str(caught.value) for part in parts), str(caught.value)


@pytest.mark.parametrize("surface", [swarm.Sphere(1.0, side="outside"), swarm.Plane((0, 0, 1))], ids=["ball", "plane"])
def test_an_open_volume_is_refused(surface):
    with pytest.raises(swarm.SceneError, match=r"bounded volume.*open to infinity.*.*a source with a volume$"):
        swarm.fill(swarm.Scene([surface]), 10, speed=1.0)


def test_a_formula_of_the_other_sign_is_named():
    with pytest.raises(swarm.SceneError, match=r"is a cavity as \"-\(0\.2 - x\*\*2 - y\*\*2 - z\*\*2\)\" with side"):
        swarm.fill(swarm.Scene([swarm.Formula("0.2 - x**2 - y**2 - z**2")]), 10, speed=1.0)
    with pytest.raises(swarm.SceneError, match=r"arrays, a CSV file or a source with a volume$"):
        swarm.fill(swarm.Scene([swarm.Formula("x**2 + y**2 - 0.2")]), 10, speed=1.0)


def test_a_volume_too_thin_to_find_is_refused(monkeypatch):
    monkeypatch.setattr(filling, "_LEAST", 1e-5)
    scene = swarm.Scene([swarm.Sphere(1.0), swarm.Sphere(1.0 - 1e-8, side="outside")])
    with pytest.raises(
        swarm.SceneError, match=r"found 0 admissible points in 524288 tries.*below 1e-05 of it, 8e-05 m\^3; giv"
    ):
        swarm.fill(scene, 1000, speed=1.0)


def test_a_thin_volume_is_found_or_refused_by_its_share():
    """Of shares of one in a million and more next to none is refused early, and of a tenth of that all are."""
    scene = swarm.Scene([swarm.Box((1.0, 1.0, 1.0))])
    draw, batch, corners = np.random.default_rng(1), 1 << 18, (-np.ones((3, 1)), np.ones((3, 1)))

    def tries(share):
        """Until it is refused, or 20 million."""
        found = draw.binomial(batch, share, 76).cumsum()
        for k, count in enumerate(found):
            try:
                filling._require_share(scene, "fill", corners, int(count), (k + 1) * batch)
            except swarm.SceneError:
                return (k + 1) * batch
        return math.inf

    assert sum(tries(3e-6) < math.inf for _ in range(300)) <= 1
    thin = [tries(1e-7) for _ in range(300)]
    assert max(thin) < 20_000_000
    assert np.median(thin) < 6_000_000


# --- Balls -----------------------------------------------------------------------------------------------

BALLS = {
    "sphere": swarm.Scene([swarm.Sphere(1.0)]),
    "box": swarm.Scene([swarm.Box((1.0, 0.5, 0.5))]),
    "obstacle": swarm.Scene([swarm.Sphere(1.0), swarm.Sphere(0.3, side="outside")]),
    "cell": swarm.Scene([swarm.Sphere(0.1, (0.0, 0.0, 0.0), side="outside")], period=(1.0, 1.0, 1.0)),
    "table": swarm.Scene([swarm.Stadium(0.5, 1.0)], plane="z"),
}


def radius_of(scene, packing, n):
    volume = swarm.fill(scene, 1, speed=1.0).volume
    share = packing * volume / n
    return math.sqrt(share / math.pi) if scene.plane else (0.75 * share / math.pi) ** (1.0 / 3.0)


@pytest.mark.parametrize("scene", BALLS.values(), ids=BALLS)
@pytest.mark.parametrize("packing", [0.05, 0.2])
def test_balls_overlap_neither_one_another_nor_walls(scene, packing):
    n = 40
    radius = radius_of(scene, packing, n) * np.linspace(0.6, 1.2, n)
    particles = swarm.fill(scene, n, speed=2.0, radius=radius, seed=5)
    assert particles.radius.tolist() == radius.tolist()
    assert (scene.distances_outside(particles.position) <= -radius).all()
    assert overlaps_of(particles.position, radius, scene.period) is None
    again = swarm.fill(scene, n, speed=2.0, radius=radius, seed=5)
    assert np.array_equal(again.position, particles.position)
    assert np.array_equal(again.velocity, particles.velocity)
    assert not np.array_equal(swarm.fill(scene, n, speed=2.0, radius=radius, seed=6).position, particles.position)
    assert np.sqrt((particles.velocity**2).sum(axis=0)) == pytest.approx(2.0)
    if scene.plane:
        assert not particles.position[2].any()
        assert not particles.velocity[2].any()


def test_balls_are_not_placed_in_what_they_may_not_meet():
    for place in (swarm.fill, swarm.pack):
        tip = swarm.Quadric(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, -1.0)), side="outside")
        scene = swarm.Scene([tip, swarm.Box((1.0, 1.0, 1.0))])
        with pytest.raises(swarm.SceneError, match=r"surfaces\[0\] must be one that particles with a radius may meet"):
            place(scene, 5, speed=1.0, radius=0.05)


def test_few_small_balls_are_uniform():
    """Their density is that of points: <|r|^2> = 3/5 of a ball of radius 1 that their centres have."""
    found = swarm.fill(BALLS["sphere"], 3000, speed=1.0, radius=0.001, seed=1).position
    assert (found**2).sum(axis=0).mean() == pytest.approx(0.6 * 0.999**2, abs=4.0 * 0.27 / math.sqrt(3000))


def test_the_volume_is_that_of_points():
    box = swarm.fill(BALLS["box"], 100, speed=1.0, radius=0.05)
    assert box.volume == pytest.approx(2.0, rel=1e-12)


def test_points_have_the_bits_that_they_had():
    points = swarm.fill(BALLS["sphere"], 3, speed=1.0, seed=1)
    assert points.radius is None
    assert np.array_equal(points.position, swarm.fill(BALLS["sphere"], 3, speed=1.0, seed=1, radius=None).position)


@pytest.mark.parametrize(
    ("scene", "n", "radius", "sentence"),
    [
        ("box", 100, 0.12, r"radius must leave a packing of at most 0.35 to random places, got 100 balls of 0.12 m in "
         r"2 m\^3, a packing of 0.3619; use fewer or smaller balls, or swarm.pack"),
        ("table", 10, 0.3, "radius must leave a packing of at most 0.5 to random places, got 10 discs of 0.3 m in"),
        ("box", 2, 0.51, r"radius must leave a place within the walls, which are 1 m apart along y, got 0.51 m of"),
        ("box", 3, 0.499, "fill found places for 1 of 3 balls|packing of at most"),
        ("box", 2, 0.0, "radius must be a finite number above 0, got 0 for particle 0"),
        ("box", 2, [0.1, -0.1], "radius must be a finite number above 0, got -0.1 for particle 1"),
        ("box", 2, [0.1, 0.1, 0.1], r"radius must be one number or have shape \(2,\), got shape \(3,\)"),
    ],
)  # fmt: skip
def test_balls_that_do_not_fit_are_one_sentence(scene, n, radius, sentence):
    with pytest.raises(swarm.SceneError, match=sentence):
        swarm.fill(BALLS[scene], n, speed=1.0, radius=radius)


@pytest.mark.parametrize("n", [1, 20, 3000])
@pytest.mark.parametrize(
    "scene",
    [
        swarm.Scene([swarm.Box((0.4, 0.3, 0.2))]),
        swarm.Scene([swarm.Cylinder(0.3, length=1.0)], plane="z"),
        swarm.Scene([swarm.Sphere(0.5), swarm.Sphere(0.49, side="outside")]),
    ],
    ids=["all trials", "plane", "few trials"],
)
def test_few_particles_have_the_bits_of_a_whole_batch(scene, n, monkeypatch):
    """Points, velocities and the volume, which is computed when it is first asked for."""
    few = swarm.fill(scene, n, temperature=1.0, seed=n)
    kept = pickle.loads(pickle.dumps(few.copy()))
    monkeypatch.setattr(filling, "_few_points", lambda *_: None)
    whole = swarm.fill(scene, n, temperature=1.0, seed=n)
    np.testing.assert_array_equal(few.position, whole.position)
    np.testing.assert_array_equal(few.velocity, whole.velocity)
    assert few.volume == kept.volume == whole.volume


@pytest.mark.parametrize(
    "surfaces",
    [
        [swarm.Sphere(0.5), swarm.Plane((0.0, 0.0, 1.0), 0.4)],
        [swarm.Box((0.5, 0.4, 0.3)), swarm.Plane((0.0, 0.0, 1.0), 1.0)],
        [swarm.Sphere(0.5), swarm.Sphere(0.3, (0.3, 0.0, 0.0), side="outside")],
    ],
    ids=["sphere", "box", "hollow"],
)
def test_few_balls_have_the_bits_of_whole_batches(surfaces, monkeypatch):
    """Where no closed form is known, their volume is that of the random points, not all of which are looked at."""
    scene = swarm.Scene(surfaces)
    few = swarm.fill(scene, 5, temperature=1.0, seed=3, radius=0.02)
    kept = pickle.loads(pickle.dumps(few.copy()))
    volume = few.volume
    monkeypatch.setattr(filling, "_roomy", lambda *_: None)
    monkeypatch.setattr(filling, "_is_its_box", lambda *_: False)
    whole = swarm.fill(scene, 5, temperature=1.0, seed=3, radius=0.02)
    np.testing.assert_array_equal(few.position, whole.position)
    np.testing.assert_array_equal(few.velocity, whole.velocity)
    assert volume == kept.volume == whole.volume
    measured = filling._points(scene, filling._POINTS, np.random.default_rng(3))[1]()
    assert (volume, few.volume_error) == measured
    assert 0.0 <= measured.error < 1e-2 * volume


@pytest.mark.parametrize("radius", [None, 0.02])
def test_within_is_the_part_of_a_scene_in_which_particles_start(radius):
    """A scene that is open too, and what the part has in common with its walls alone."""
    floor = swarm.Scene([swarm.Plane((0.0, 0.0, -1.0))], gravity=(0.0, 0.0, -9.81))
    part = swarm.Box((0.2, 0.2, 0.2), center=(1.0, 0.0, 0.1))
    particles = swarm.fill(floor, 200, speed=1.0, seed=1, radius=radius, within=part)
    low, high = np.array([0.8, -0.2, 0.0]), np.array([1.2, 0.2, 0.3])
    reach = radius or 0.0
    assert (particles.position >= low[:, None] + reach - 1e-15).all()
    assert (particles.position <= high[:, None] - reach + 1e-15).all()
    # Four standard deviations of the mean of a uniform distribution.
    means = np.abs(particles.position.mean(axis=1) - 0.5 * (low + high))
    assert (means < 4 * (high - low) / np.sqrt(12 * 200)).all()
    assert float(particles.volume) == pytest.approx(0.048, rel=0.01)
    same = swarm.fill(swarm.Scene([*floor.surfaces, part]), 200, speed=1.0, seed=1, radius=radius)
    np.testing.assert_array_equal(particles.position, same.position)


def test_what_is_within_is_a_surface_and_no_wall():
    for given, sentence in (
        (0.5, "within must be a surface such as swarm.Plane, got 0.5"),
        (swarm.Sphere(0.1, restitution=0.5), "within.restitution must be left out, it is no wall, got 0.5"),
    ):
        with pytest.raises(swarm.SceneError, match=sentence):
            swarm.fill(SPHERE, 10, speed=1.0, within=given)
