"""Particles in a cell that repeats: as in endless space, to round-off."""

import importlib.util
import math
import subprocess
import sys

import numpy as np
import pytest
from energy_books import unbooked
from test_sessions import require_resumed_is_whole

import swarm

pytestmark = pytest.mark.physics

EPSILON = float(np.finfo(np.float64).eps)
FLOOR, CEILING = {"normal": (0.0, 0.0, -1.0), "offset": 0.0}, {"normal": (0.0, 0.0, 1.0), "offset": 1.0}
G, SLOPE = 9.81, 0.6
CHUTE = (G * math.sin(SLOPE), 0.0, -G * math.cos(SLOPE))
# Four balls in a cell, one of which reaches over all faces; a cubic close packing, with gaps.
LATTICE = [(0.02, -0.03, 0.01), (0.5, 0.5, 0.0), (0.5, 0.0, 0.5), (0.0, 0.5, 0.5)]


def lorentz(radius, **laws):
    balls = [swarm.Sphere(radius, center, "outside", **laws) for center in LATTICE[1:]]
    return swarm.Scene([swarm.Sphere(radius, LATTICE[0], "outside", **laws), *balls], period=(1.0, 1.0, 1.0))


# --- Flights ---------------------------------------------------------------------------------------------


def test_free_flights_are_straight():
    """A round-off a face, in all directions: along the diagonal, through an edge, along a face."""
    scene = swarm.Scene([swarm.Sphere(0.01, (0.5, 0.5, 0.5), "outside")], period=(1.0, 0.7, 0.9))
    start = np.array([[0.1, 0.0, 0.05, 0.2], [0.1, 0.0, 0.0, 0.3], [0.1, 0.0, 0.05, 0.4]])
    v = np.array([[0.0, 1.0, 1.3, 0.0], [1.0, 0.7, 0.0, 0.0], [-1.7, 0.0, 0.0, 0.0]])
    v[:, 0] *= 0.9, 1.0, 1.0
    until = 1000.0
    end = swarm.simulate(scene, swarm.Particles(start, v), swarm.Impact(), until=until, every=10.0, compile="never")
    assert end.observables["impacts"][-1] == 0
    assert np.abs(end.particles.image).max() > 1000
    np.testing.assert_array_equal(end.particles.velocity, v)
    # Each pass rounds the position, and what is left of the frame.
    np.testing.assert_allclose(scene.unwrapped(end.particles), start + until * v, rtol=0.0, atol=until * 4e-15)
    straight = np.abs(scene.unwrapped(end.particles) - start - until * v).max(axis=0) / np.sqrt(
        (v**2).sum(axis=0) + 1e-300
    )
    assert straight.max() <= 1e-15 * until


def reference(centers, radius, r, v, until):
    """One particle among balls in endless space, images and all, by the exact billiard; and its impacts."""
    hits, reach = 0, np.arange(-2, 3)
    shifts = np.array(np.meshgrid(reach, reach, reach)).reshape(3, -1).T
    while True:
        # Shorter than a cell, so that every ball on the way is among those looked at.
        step = min(until, 0.9 / np.sqrt(v @ v))
        around = (np.array(centers)[:, None] + shifts + np.floor(r)).reshape(-1, 3)
        d = r - around
        b, c, a = d @ v, (d * d).sum(axis=1) - radius**2, v @ v
        root = b * b - a * c
        with np.errstate(divide="ignore", invalid="ignore"):
            times = np.where((root > 0.0) & (b < 0.0), c / (np.sqrt(np.maximum(root, 0.0)) - b), np.inf)
        first = int(np.argmin(times))
        if times[first] > step:
            r, until = r + step * v, until - step
            if not until > 0.0:
                return r, v, hits
            continue
        t = max(times[first], 0.0)
        r, until, hits = r + t * v, until - t, hits + 1
        n = (r - around[first]) / radius
        v = v - 2.0 * (v @ n) * n


@pytest.mark.parametrize("where", ["corner", "edge", "face"])
def test_a_ball_over_faces_is_the_lattice(where):
    """Eight, four or two images, against the exact billiard among balls in endless space."""
    center = {"corner": (0.02, -0.03, 0.01), "edge": (1.0, 0.02, 0.5), "face": (0.5, 0.4, 0.98)}[where]
    scene = swarm.Scene([swarm.Sphere(0.3, center, "outside")], period=(1.0, 1.0, 1.0))
    assert len(scene.compiled().numbering.surfaces_of_rows) == {"corner": 8, "edge": 4, "face": 2}[where]
    start = swarm.fill(scene, 30, speed=1.0, seed=4)
    end = swarm.simulate(scene, start, swarm.Impact(), until=6.0, every=1.0, compile="never")
    found, most = scene.unwrapped(end.particles), 0
    for i in range(len(start)):
        r, v, hits = reference([center], 0.3, start.position[:, i], start.velocity[:, i], 6.0)
        assert end.impacts_per_particle[i] == hits
        # Each impact on a ball makes an error some ten times as large.
        bound = 1e-14 * 20.0**hits
        np.testing.assert_allclose(found[:, i], r, rtol=0.0, atol=bound)
        np.testing.assert_allclose(end.particles.velocity[:, i], v, rtol=0.0, atol=10.0 * bound)
        most = max(most, hits)
    assert most >= 4
    assert np.abs(end.particles.image).max() >= 2


# --- Gravity along the period ----------------------------------------------------------------------------


def test_a_fall_without_end_keeps_its_energy():
    """10^4 wraps and impacts on a pipe: the energy is right to the round-off of what is kinetic, and does not drift."""
    scene = swarm.Scene([swarm.Cylinder(0.05, center=(0.1, 0.1, 0.0))], (0.0, 0.0, -G), period=(None, None, 0.1))
    start = swarm.Particles([0.1, 0.12, 0.03], [0.3, 0.2, 0.7])
    until = math.sqrt(2.0 * 1000.0 / G)
    for every in (until, until / 100.0):
        result = swarm.simulate(scene, start, swarm.Impact(), until=until, every=every, compile="always")
        kinetic, total = result.observables["kinetic_energy"], result.observables["total_energy"]
        # From impact to impact, some hundred cells, each pass rounds the velocity.
        assert (np.abs(total - total[0]) <= 16.0 * EPSILON * kinetic).all()
        scale = G * 0.05 + kinetic[0]
        assert (result.observables["energy_error"] * scale <= 16.0 * EPSILON * kinetic).all()
        fallen = 0.03 + 0.7 * until - 0.5 * G * until**2
        assert result.particles.image[2, 0] == math.floor(fallen / 0.1) < -9800
        assert scene.unwrapped(result.particles)[2, 0] == pytest.approx(fallen, rel=1e-13)
        assert result.observables["impacts"][-1] > 50


def test_a_throw_turns_in_a_face():
    """Up through many cells, to an apex a hair above, on and below a face, and down again."""
    scene = swarm.Scene([swarm.Plane((1.0, 0.0, 0.0), 5.0)], (0.0, 0.0, -G), period=(None, None, 0.5))
    for apex in (3.0, 3.0 + 1e-10, 3.0 - 1e-10, 3.0 + 1e-16, 3.0 + 1e-6):
        v = math.sqrt(2.0 * G * apex)
        start = swarm.Particles([0.0, 0.0, 0.0], [0.0, 0.0, v])
        result = swarm.simulate(scene, start, swarm.Impact(), until=2.0 * v / G, compile="never")
        assert scene.unwrapped(result.particles)[2, 0] == pytest.approx(0.0, abs=1e-13)
        assert result.particles.velocity[2, 0] == pytest.approx(-v, rel=1e-14)


# --- Along walls -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_a_grain_slides_down_a_chute(friction):
    """x = x0 + v t + (sin - mu cos) g t^2/2, through hundreds of cells."""
    walls = [swarm.Plane(**FLOOR, friction=friction, restitution=0.5), swarm.Plane(**CEILING)]
    scene = swarm.Scene(walls, CHUTE, period=(0.5, 0.7, None))
    result = swarm.simulate(
        scene, swarm.Particles([0.1, 0.2, 0.0], [1.0, 0.0, 0.0]), swarm.Impact(), until=10.0, every=1.0
    )
    pull = G * (math.sin(SLOPE) - friction * math.cos(SLOPE))
    expected = 0.1 + 10.0 + 0.5 * pull * 100.0
    assert result.particles.image[0, 0] == math.floor(expected / 0.5)
    assert scene.unwrapped(result.particles)[:, 0] == pytest.approx([expected, 0.2, 0.0], rel=1e-13)
    assert result.particles.velocity[:, 0] == pytest.approx([1.0 + 10.0 * pull, 0.0, 0.0], rel=1e-13)
    seen = result.observables
    assert (seen["sliding"][1:] == 1).all()
    assert unbooked(seen) <= 8.0 * EPSILON * 0.5 * (G * 10.0 + 1.0) ** 2
    lost = friction * G * math.cos(SLOPE) * (expected - 0.1)
    assert seen["dissipated_energy"][-1] == pytest.approx(lost, rel=1e-12)


def test_friction_stops_a_grain_beyond_a_face():
    """It comes to rest in another cell, and stays there."""
    walls = [swarm.Plane(**FLOOR, friction=0.9, restitution=0.5), swarm.Plane(**CEILING)]
    scene = swarm.Scene(walls, (0.0, 0.0, -G), period=(0.5, 0.7, None))
    start = swarm.Particles([0.1, 0.2, 0.0], [3.0, -2.0, 0.0])
    result = swarm.simulate(scene, start, swarm.Impact(), until=3.0, every=0.5)
    v = np.array([3.0, -2.0, 0.0])
    stop = start.position[:, 0] + v * np.sqrt(v @ v) / (2.0 * 0.9 * G)
    assert scene.unwrapped(result.particles)[:, 0] == pytest.approx(stop, abs=1e-12)
    assert np.abs(result.particles.image).max() >= 1
    assert (result.particles.velocity == 0.0).all()


def test_blows_against_a_ball_on_the_floor_become_weaker_and_end():
    """Grains slide into an inelastic ball again and again; its next blow is sooner than the time can tell."""
    walls = [
        swarm.Plane(**FLOOR, friction=0.3, restitution=0.6), swarm.Plane(**CEILING),
        swarm.Sphere(0.2, (0.0, 0.4, 0.15), "outside", restitution=0.6),
    ]  # fmt: skip
    scene = swarm.Scene(walls, (4.9, 0.0, -8.5), period=(1.0, 0.8, None))
    start = swarm.fill(scene, 80, speed=0.5, seed=0)
    result = swarm.simulate(scene, start, swarm.Impact(), until=2.0, every=0.1, compile="always")
    seen = result.observables
    assert seen["sliding"][-1] > 66
    assert seen["max_penetration"].max() <= 16.0 * EPSILON
    assert unbooked(seen) <= 1e-13 * abs(seen["total_energy"][0])


@pytest.mark.parametrize("friction", [0.0, 0.2])
def test_a_grain_slides_over_a_ball_in_a_face(friction):
    """The wall in the next cell is another number: as on the same ball in the middle of its cell."""
    paths = []
    for x in (0.0, 0.5):
        walls = [
            swarm.Sphere(0.3, (x, 0.5, 0.5), "outside", friction=friction, restitution=0.5),
            swarm.Plane(**FLOOR), swarm.Plane(**CEILING),
        ]  # fmt: skip
        scene = swarm.Scene(walls, (0.0, 0.0, -G), period=(1.0, None, None))
        on = np.array([x - 0.3 * math.sin(0.2), 0.5, 0.5 + 0.3 * math.cos(0.2)])
        v = 1.1 * np.array([math.cos(0.2), 0.02, math.sin(0.2)])
        result = swarm.simulate(scene, swarm.Particles(on, v), swarm.Impact(), until=0.5, every=0.02, compile="never")
        assert result.observables["sliding"][1] == 1
        assert unbooked(result.observables) <= 16.0 * EPSILON * result.observables["total_energy"][0]
        paths.append(scene.unwrapped(result.particles)[:, 0] - [x, 0.0, 0.0])
    np.testing.assert_allclose(paths[0], paths[1], atol=1e-7)


# --- Bits ------------------------------------------------------------------------------------------------

CASES = {
    "balls": lorentz(0.25),
    "chute": swarm.Scene(
        [
            swarm.Plane(**FLOOR, friction=0.5, restitution=0.7), swarm.Plane(**CEILING, restitution=0.7),
            swarm.Sphere(0.2, (0.0, 0.3, 0.1), "outside", friction=0.1, restitution=0.7),
        ],
        CHUTE, period=(0.9, 1.0, None),
    ),
}  # fmt: skip


def bits(scene, **keywords):
    start = swarm.fill(scene, 300, speed=1.0, seed=5)
    result = swarm.simulate(scene, start, swarm.Impact(), until=2.0, every=0.5, **keywords)
    seen = [result.observables[name] for name in ("total_energy", "sliding", "impacts", "dissipated_energy")]
    arrays = [result.particles.position, result.particles.velocity, result.particles.image, *seen]
    return [np.asarray(array).tobytes() for array in arrays]


@pytest.mark.parametrize("name", CASES)
def test_threads_and_blocks(name):
    expected = bits(CASES[name], threads=1, compile="always")
    for keywords in ({"threads": 2}, {"threads": 2, "block_size": 1}, {"threads": 1, "block_size": 10**6}):
        assert bits(CASES[name], compile="always", **keywords) == expected


@pytest.mark.parametrize("name", CASES)
def test_resumed_is_whole(tmp_path, name):
    require_resumed_is_whole(tmp_path, CASES[name], swarm.Impact(), every=4.0)


def test_the_chute_is_followed_to_round_off():
    """Bouncing, sliding and resting grains, from cell to cell: none leaves its walls, no energy is lost sight of."""
    scene = CASES["chute"]
    start = swarm.fill(scene, 700, speed=1.0, seed=5)
    result = swarm.simulate(scene, start, swarm.Impact(), until=4.0, every=0.5, compile="always")
    seen = result.observables
    assert seen["max_penetration"].max() <= 8.0 * EPSILON
    assert seen["sliding"][-1] > 100
    assert result.particles.image[0].max() > 10
    assert result.particles.image[1].any()
    position = result.particles.position
    assert ((position[:2] >= 0.0) & (position[:2] < [[0.9], [1.0]])).all()
    assert unbooked(seen) <= 1e-13 * seen["kinetic_energy"].max()


# --- Diffusion -------------------------------------------------------------------------------------------


def test_a_lorentz_gas_diffuses():
    """With a finite horizon the mean square displacement grows linearly, equally along all axes."""
    scene = lorentz(0.34)
    start = swarm.fill(scene, 4000, speed=1.0, seed=2)
    end, squares = start, []
    for _k in range(4):
        end = swarm.simulate(scene, end, swarm.Impact(), until=20.0, compile="always").particles
        moved = scene.unwrapped(end) - scene.unwrapped(start)
        squares.append((moved**2).mean(axis=1))
    squares = np.array(squares)
    assert np.sqrt((end.velocity**2).sum(axis=0)) == pytest.approx(1.0, rel=1e-13)
    growth = np.diff(np.vstack([np.zeros(3), squares]).sum(axis=1))
    # The spread of a mean of N squares of normal numbers, of three axes; that of a difference from an earlier one.
    error = math.sqrt(2.0 / (3.0 * len(start))) * squares.sum(axis=1)
    assert (np.abs(growth[1:] - growth[1:].mean()) <= 4.0 * np.hypot(error[1:], error[:-1])).all()
    per_axis = squares[-1]
    assert np.abs(per_axis / per_axis.mean() - 1.0).max() <= 5.0 * math.sqrt(2.0 / len(start))


# --- Other programs --------------------------------------------------------------------------------------

MDANALYSIS = """
import sys, warnings
warnings.simplefilter("ignore")
import h5py, MDAnalysis
import numpy as np
from MDAnalysis.transformations.nojump import NoJump
with h5py.File(sys.argv[1], locking=False) as file:
    everything = file["particles/all"]
    position, image = everything["position/value"][()], everything["image/value"][()]
    expected = position + image * everything["box/edges/value"][0]
universe = MDAnalysis.Universe.empty(position.shape[1], trajectory=True)
universe.load_new(sys.argv[1], format="H5MD", convert_units=False)
universe.trajectory.add_transformations(NoJump())
found = np.array([frame.positions.copy() for frame in universe.trajectory])
print(universe.dimensions.tolist(), np.abs(found - expected).max(), np.abs(image).max())
"""


def test_mdanalysis_unwraps_it(tmp_path):
    if importlib.util.find_spec("MDAnalysis") is None:
        pytest.skip("MDAnalysis is not installed")
    scene = swarm.Scene([swarm.Sphere(0.3, (0.0, 0.0, 0.0), "outside")], period=(1.0, 1.0, 1.0))
    path = tmp_path / "run.h5"
    swarm.simulate(
        scene,
        swarm.fill(scene, 30, speed=1.0),
        swarm.Impact(),
        until=10.0,
        every=0.25,
        trajectory=path,
        compile="never",
    )
    done = subprocess.run([sys.executable, "-c", MDANALYSIS, str(path)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    box, rest = done.stdout.split("] ")
    assert box == "[1.0, 1.0, 1.0, 90.0, 90.0, 90.0"
    off, farthest = map(float, rest.split())
    assert farthest >= 3
    # Its positions are in single precision.
    assert off <= 1e-5
