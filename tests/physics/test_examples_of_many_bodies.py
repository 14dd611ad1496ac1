"""The examples of many bodies and of cells that repeat, with few particles: the facts that they are there to show."""

from pathlib import Path

import numpy as np
import pytest

from examples import galton_board, lorentz_gas, packed_bed
from swarm import scene_file

pytestmark = pytest.mark.physics
SCENES = Path(__file__).parents[2] / "examples" / "scenes"


def test_the_lorentz_gas_diffuses_as_it_does(compiled_at_once):
    """The free path is exact; D is that of hops, with their memory."""
    for gap, low, high in ((0.05, 0.86, 0.94), (0.3, 1.35, 1.5)):
        found = lorentz_gas.measure(gap, 1000, windows=16)
        path, error = found.free_path
        assert abs(path - 0.5 * lorentz_gas.free_area(gap)) <= 4.0 * error <= 4e-3 * path
        value, error = found.diffusion
        hops = lorentz_gas.machta_zwanzig(gap)
        assert low <= value / hops <= high
        assert error <= 0.02 * value
        back = lorentz_gas.going_back(gap, 500, 20)
        # Most of what is not in hops without memory is in how often they go back.
        assert abs(value - lorentz_gas.with_memory(gap, back)) < 0.7 * abs(value - hops)


def test_rough_pegs_make_a_binomial_board():
    count, fair = 40, 0.25 * galton_board.ROWS
    # One kind of scene: half of what these grains take in plain Python.
    found, smooth = (galton_board.run(n, rough, how="always") for n, rough in ((count, galton_board.ROUGH), (8, 0.0)))
    assert found.bins.sum() == count
    assert found.moving == smooth.moving == 0
    assert abs(found.mean - 0.5 * galton_board.ROWS) <= 4.0 * np.sqrt(fair / count)
    assert abs(found.variance - fair) <= 4.0 * fair * np.sqrt(2.0 / count)
    # Its mean is the number of rows, its variance twice that.
    assert found.chi_squared <= galton_board.ROWS + 4.0 * np.sqrt(2.0 * galton_board.ROWS)
    assert smooth.variance > 5.0 * fair


def test_the_scene_file_of_the_board_is_that_of_the_script():
    job = scene_file.read(SCENES / "galton_board.toml")
    board, start = galton_board.board(), galton_board.grains(500)
    assert len(job.scene.surfaces) == len(board.surfaces)
    for found, wanted in zip(job.scene.surfaces, board.surfaces, strict=True):
        assert type(found) is type(wanted)
        for name in ("centers", "radii", "half_widths", "center", "temperature", "restitution", "friction"):
            if hasattr(wanted, name) and getattr(wanted, name) is not None:
                np.testing.assert_allclose(getattr(found, name), getattr(wanted, name), rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(job.start().position, start.position, rtol=0.0, atol=1e-6)


@pytest.mark.parametrize("rough", [False, True], ids=["smooth", "rough"])
def test_the_mean_free_path_in_a_bed_is_exact(rough, compiled_at_once):
    """1/(n pi a^2), half of the volume among balls that overlap."""
    found = packed_bed.run(0.5, rough, balls=500, count=20, flights=20.0)
    assert abs(found.porosity[0] - 0.5) <= 4.0 * found.porosity[1] <= 0.03
    assert abs(found.free_path[0] - 1.0) <= 4.0 * found.free_path[1] <= 0.15
    # It takes more particles to tell smooth balls from rough ones.
    assert 0.2 < found.diffusion[0] < 1.1
