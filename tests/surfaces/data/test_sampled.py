"""What is said of sampled surfaces, kept of them in files, and refused."""

import h5py
import numpy as np
import pytest
from conftest import EPSILON, METHODS
from samples import ball, bumpy, grid

import swarm
from swarm import scene_file
from swarm.serialization import tables

AXIS, POINTS = grid(8)
SQUARE = sum(x * x for x in POINTS) - 0.16
SPACING = float(AXIS[1] - AXIS[0])
ORIGIN = (AXIS[0],) * 3


def sampled(values=SQUARE, spacing=SPACING, origin=ORIGIN, **common):
    return swarm.Sampled(values, spacing, origin, **common)


def sphere(**common):
    return swarm.Sphere(0.4, **common)


def spoiled(value, place=(1, 2, 3)):
    values = SQUARE.copy()
    values[place] = value
    return values


# --- Refused ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: sampled(spoiled(np.nan)), ["values must be finite", "nan at values[1, 2, 3]"]),
        (lambda: sampled(spoiled(np.inf)), ["values must be finite", "inf at values[1, 2, 3]"]),
        (lambda: sampled(SQUARE + 1.0), ["above 0 everywhere", "no surface in the grid"]),
        (lambda: sampled(SQUARE - 2.0), ["below 0 everywhere"]),
        (lambda: sampled(0.0 * SQUARE), ["0 everywhere"]),
        (lambda: sampled(SQUARE[:3]), ["shape (nx, ny, nz), 4 samples or more", "got (3, 8, 8)"]),
        (lambda: sampled(SQUARE[0]), ["shape (nx, ny, nz)", "got (8, 8)"]),
        (lambda: sampled("phi"), ["cannot read the samples in phi"]),
        (lambda: sampled(np.array([["a"]])), ["values must be an array of numbers"]),
        (lambda: sampled(spacing=0.0), ["spacing must be above 0, got 0"]),
        (lambda: sampled(spacing=(0.1, 0.1)), ["spacing must be three numbers, got 2"]),
        (lambda: sampled(spacing=(0.1, -0.1, 0.1)), ["spacing[1] must be above 0"]),
        (lambda: sampled(origin=(0.0, 0.0)), ["origin must be three numbers"]),
        (lambda: sampled(side="in"), ["side", "did you mean 'inside'?"]),
        (lambda: sampled(mass=1.0, inertia=1.0, motion=swarm.Rotation((0, 0, 1), 1.0, (0, 0, 0))), ["no center"]),
    ],
)
def test_bad_arguments_are_one_sentence(make, message):
    with pytest.raises(swarm.SceneError) as caught:
        make()
    assert all(part in str(caught.value) for part in message), str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_surface_that_comes_twice_through_an_edge_is_refused():
    # A gap between two bodies: the samples next to it are in the bodies where it is thinner than a cell.
    def gap(width):
        box = np.maximum(np.maximum(np.abs(POINTS[0]), np.abs(POINTS[1])), np.abs(POINTS[2])) - 0.4
        return sampled(np.maximum(box, 0.5 * width * SPACING - np.abs(POINTS[0])))

    swarm.Scene([gap(1.3)])
    with pytest.raises(
        swarm.SceneError, match=r"too coarse: between values\[3, \d, \d\] = .* phi changes its sign twice"
    ):
        gap(0.9)


def test_a_surface_at_the_border_needs_others_that_keep_particles_in_the_grid():
    pipe = sampled(POINTS[0] ** 2 + POINTS[1] ** 2 - 0.16)
    with pytest.raises(swarm.SceneError, match=r"must be known wherever particles go.*border of its grid"):
        swarm.Scene([pipe])
    with pytest.raises(swarm.SceneError, match="must be known"):
        swarm.Scene([pipe, swarm.Slab((0.0, 0.0, 1.0), 0.5, motion=swarm.Translation((0.0, 0.0, 1.0)))])
    with pytest.raises(swarm.SceneError, match="must be known"):
        swarm.Scene([sampled(-SQUARE)])
    walls = [swarm.Box((0.55, 0.55, 0.55))]
    scene, exact = (swarm.Scene([one, *walls]) for one in (pipe, swarm.Cylinder(0.4)))
    start = swarm.fill(exact, 5, speed=1.0, seed=1)
    ends = [swarm.simulate(one, start, swarm.Impact(), until=3.0, compile="never") for one in (scene, exact)]
    assert np.abs(ends[0].particles.position - ends[1].particles.position).max() < 1e-9


# --- Said ------------------------------------------------------------------------------------------------


def test_the_description():
    surface = sampled(SQUARE, origin=(1.0 + AXIS[0], AXIS[0], AXIS[0]))
    low, high = np.array(surface.bounds())
    assert (low <= (0.6, -0.4, -0.4)).all()
    assert (high >= (1.4, 0.4, 0.4)).all()
    assert (high - low <= 0.8 + 2.0 * SPACING + 1e-12).all()
    assert 0.4 <= surface.size() <= 0.4 + SPACING
    assert surface.extent() == pytest.approx(1.55)
    assert "<8 x 8 x 8>" in repr(surface)
    assert not np.isfinite(sampled(side="outside").bounds()).any()
    assert surface.phi([3.0, 0.0, 0.0]) > 1.0


def test_it_turns_about_its_middle():
    turn = {"axis": (0.0, 0.0, 1.0), "angle": 0.5}
    squashed = sampled(POINTS[0] ** 2 / 0.09 + POINTS[1] ** 2 / 0.16 + POINTS[2] ** 2 / 0.25 - 1.0, rotation=turn)
    exact = swarm.Ellipsoid((0.3, 0.4, 0.5), rotation=turn)
    points = 0.3 * np.random.default_rng(1).normal(size=(3, 50))
    points = points[:, np.abs(points).max(axis=0) < 0.4]
    assert np.allclose(squashed.phi(points), exact.phi(points), atol=1e-12)
    assert np.allclose(squashed.gradient(points), exact.gradient(points), atol=1e-11)
    assert np.isfinite(swarm.Scene([squashed]).bounds()).all()


@pytest.mark.parametrize("motion", [swarm.Translation((0.1, 0.0, 0.0)), swarm.Oscillation((0.1, 0.0, 0.0), 1.0)])
def test_it_moves_as_the_sphere_does(motion):
    scenes = [swarm.Scene([make(motion=motion)]) for make in (sampled, sphere)]
    start = swarm.fill(scenes[1], 5, speed=1.0, seed=1)
    ends = [swarm.simulate(scene, start, swarm.Impact(), until=2.0, compile="never") for scene in scenes]
    assert np.abs(ends[0].particles.position - ends[1].particles.position).max() < 1e-8


def test_a_solid_has_images_in_a_cell_that_repeats():
    solids = [sampled(side="outside"), swarm.Sphere(0.4, side="outside")]
    scenes = [swarm.Scene([solid], period=(1.2, 1.3, 1.4)) for solid in solids]
    start = swarm.fill(scenes[1], 5, speed=1.0, seed=1)
    ends = [swarm.simulate(scene, start, swarm.Impact(), until=10.0, compile="never") for scene in scenes]
    assert ends[0].observables["impacts"][-1] >= 5
    assert np.abs(ends[0].particles.position - ends[1].particles.position).max() < 1e-8


def test_a_grain_slides_on_it_as_in_the_sphere():
    start = swarm.Particles([[0.1], [0.0], [-0.35]], [[0.1], [0.2], [0.0]])
    scenes = [swarm.Scene([make(restitution=0.0)], gravity=(0.0, 0.0, -1.0)) for make in (sampled, sphere)]
    ends = [swarm.simulate(scene, start, swarm.Impact(), until=1.0, compile="never") for scene in scenes]
    assert ends[0].observables["sliding"][-1] == 1
    assert np.abs(ends[0].particles.position - ends[1].particles.position).max() < 1e-7
    assert ends[0].observables["max_penetration"].max() < 8.0 * EPSILON


@pytest.mark.parametrize("name", METHODS)
def test_every_method_meets_it(name):
    scene = swarm.Scene([sampled()])
    start = swarm.Particles([[0.05], [0.0], [0.2]], [[0.3], [0.1], [1.0]])
    result = swarm.simulate(scene, start, METHODS[name], until=0.35, every=0.05, compile="never")
    assert result.observables["impacts"][-1] >= 1
    assert result.particles.velocity[2] < 0.0
    # Three of them are those that the paper's are compared with.
    conserves = name not in ("verlet", "midpoint", "trapezoidal")
    assert result.observables["energy_error"].max() < (1e-13 if conserves else 1e-2)


# --- Kept ------------------------------------------------------------------------------------------------


def test_its_table_makes_it_again():
    for surface in (bumpy(), ball(8, "outside"), sampled(friction=0.1, motion=swarm.Translation((1.0, 0.0, 0.0)))):
        again = tables.of_kind(tables.table_of(surface), "surface[0]", swarm.surfaces.ALL_SURFACES)
        assert np.array_equal(again.values, surface.values)
        assert repr(again) == repr(surface)


def test_a_trajectory_and_a_log_keep_the_samples(tmp_path):
    """As an array beside the text of the scene, which names its digest; others do not go on with the run."""
    axis = np.linspace(-0.6, 0.6, 12)
    values = axis[:, None, None] ** 2 + axis[:, None] ** 2 + 1.2 * axis**2 - 0.16

    def scene(values):
        return swarm.Scene([swarm.Sampled(values, axis[1] - axis[0], (axis[0],) * 3, openings=[sampled(8.0 * SQUARE)])])

    start, path = swarm.fill(scene(values), 3, speed=1.0, seed=1), tmp_path / "t.h5"

    def run(scene, until, **keywords):
        kept = {"trajectory": path, "impacts": tmp_path / "i.h5", "checkpoint": 9.0, "compile": "never"}
        return swarm.simulate(scene, start, swarm.Impact(), until=until, every=0.25, **kept, **keywords)

    with pytest.raises(swarm.WallTimeError):
        run(scene(values), 0.5, walltime=1e-9)
    with swarm.load(path) as trajectory, swarm.load_impacts(tmp_path / "i.h5") as log:
        assert len(trajectory.descriptions["scene"]) < 20000
        for kept in (trajectory.scene, log.scene):
            assert np.array_equal(kept.surfaces[0].values, values)
            assert np.array_equal(kept.surfaces[0].openings[0].values, 8.0 * SQUARE)
        again = trajectory.scene
    with pytest.raises(swarm.SceneError, match="is of another run: its scene is"):
        run(scene(1.01 * values), 0.5, resume=True)
    assert run(again, 0.5, resume=True).observables["time"].tolist() == [0.0, 0.25, 0.5]


TEXT = """
[particles]
count = 3
speed = 1.0
[[surface]]
kind = "sampled"
spacing = {spacing}
origin = [{origin}, {origin}, {origin}]
{more}
[method]
kind = "impact"
[run]
until = 1.0
every = 0.5
"""


def read(folder, more):
    (folder / "scene.toml").write_text(TEXT.format(spacing=SPACING, origin=AXIS[0], more=more))
    return scene_file.read(folder / "scene.toml").scene.surfaces[0]


def test_samples_from_files(tmp_path):
    (tmp_path / "data").mkdir()
    np.save(tmp_path / "data" / "phi.npy", SQUARE)
    with h5py.File(tmp_path / "phi.h5", "w") as file:
        file["one/phi"], file["one/mass"] = SQUARE, np.zeros(3)
    with h5py.File(tmp_path / "two.h5", "w") as file:
        file["phi"], file["psi"] = SQUARE, SQUARE
    for name in ("data/phi.npy", "phi.h5"):
        assert np.array_equal(read(tmp_path, f'file = "{name}"').values, SQUARE)
        assert np.array_equal(sampled(tmp_path / name).values, SQUARE)
    for more, message in {
        'file = "no.npy"': r"surface\[0\].*cannot read the samples in .*no.npy",
        'file = "two.h5"': "one dataset with three axes, got '/phi' and '/psi'",
        'file = "scene.toml"': "cannot read the samples",
        "file = 3": r"surface\[0\].file: expected the name of a file, got 3",
        'file = "phi.h5"\nvalues = [1]': "values: cannot be combined with file",
        "": r"surface\[0\].values: expected",
        'file = "phi.h5"\nradius = 1.0': r"surface\[0\].radius: unknown key",
    }.items():
        with pytest.raises(swarm.SceneError, match=message):
            read(tmp_path, more)
