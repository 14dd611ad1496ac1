"""Runs of too many impacts are refused before they begin, and honest ones are not."""

import logging
import math

import numba
import numpy as np
import pytest

import swarm
from swarm.lanes import block as blocks
from swarm.run.preflight import workload

THIN = 1e-12
BOX = swarm.Box((0.5, 0.5, 0.5))
# Each closed to a bounded scene.
DEGENERATE = {
    "slab": ([swarm.Slab((0.0, 0.0, 1.0), THIN), BOX], (0.1, 0.0, 0.0)),
    "turned slab": ([swarm.Slab((1.0, 2.0, 3.0), THIN), swarm.Sphere(0.5)], (0.0, 0.0, 0.0)),
    "cone": ([swarm.Cone(THIN), swarm.Plane((0.0, 0.0, 1.0), 1.0)], (0.0, 0.0, 0.5)),
    "turned cone": ([swarm.Cone(THIN, axis=(1.0, 1.0, 0.0)), swarm.Sphere(1.0)], (0.5 / math.sqrt(2.0),) * 2 + (0.0,)),
    "ellipsoid": ([swarm.Ellipsoid((THIN, 0.5, 0.5))], (0.0, 0.1, 0.1)),
}
COUNTED = {
    "impact": swarm.Impact(),
    "chord": swarm.Impact(contact_step=1e-14),
    "multipliers": swarm.AugmentedLagrangian(dt=1e-14, penalty=1e4, adaptive=True),
}


def moving(*position, n=3):
    """Particles at one place, in random directions, with speed 1."""
    velocity = np.random.default_rng(1).normal(size=(3, n))
    return swarm.Particles(np.tile(np.array(position)[:, None], n), velocity / np.sqrt((velocity**2).sum(axis=0)))


@pytest.mark.parametrize("method", COUNTED.values(), ids=COUNTED)
@pytest.mark.parametrize("name", DEGENERATE)
def test_degenerate_scenes_are_refused(name, method):
    surfaces, place = DEGENERATE[name]
    before = None if numba.config.DISABLE_JIT else len(blocks.advance_block.signatures)
    with pytest.raises(swarm.SceneError) as caught:
        swarm.simulate(swarm.Scene(surfaces), moving(*place), method, until=1.0)
    message = str(caught.value)
    for part in ("1e+10 impacts a frame", f"surfaces[0] ({type(surfaces[0]).__name__})", "lasts 1 s", "every at most"):
        assert part in message
    assert before == (None if numba.config.DISABLE_JIT else len(blocks.advance_block.signatures))


@pytest.mark.parametrize("name", ["slab", "cone", "ellipsoid"])
def test_filled_ones_too(name):
    scene = swarm.Scene(DEGENERATE[name][0])
    with pytest.raises(swarm.SceneError, match="impacts a frame"):
        swarm.simulate(scene, swarm.fill(scene, 100, speed=1.0), swarm.Impact(), until=1.0)


def test_the_frame_that_is_named_is_one_that_runs(caplog):
    scene, particles = swarm.Scene(DEGENERATE["slab"][0]), moving(0.1, 0.0, 0.0)
    with pytest.raises(swarm.SceneError) as caught:
        workload.require_few_impacts(scene.compiled(), particles, swarm.Impact(), 1.0, 1.0)
    every = float(str(caught.value).split("every at most ")[1].split(" s")[0])
    workload.require_few_impacts(scene.compiled(), particles, swarm.Impact(), 1.0, 0.99 * every)


SOFT = [
    swarm.Penalty(dt=1e-2, penalty=1e4),
    swarm.AugmentedLagrangian(dt=1e-2, penalty=1e4),
    swarm.Verlet(dt=1e-2, penalty=1e4),
    swarm.Midpoint(dt=1e-2, penalty=1e4),
    swarm.Trapezoidal(dt=1e-2, penalty=1e4),
]


@pytest.mark.parametrize("method", SOFT, ids=lambda method: type(method).__name__)
def test_fixed_steps_cost_what_they_cost(method):
    """Their work is in their steps, however many walls are in each."""
    surfaces, place = DEGENERATE["slab"]
    workload.require_few_impacts(swarm.Scene(surfaces).compiled(), moving(*place), method, 1.0, 1.0)


WEDGE = [
    swarm.Plane((0.0, 0.0, -1.0), 0.0),
    swarm.Plane((-math.sin(1e-3), 0.0, math.cos(1e-3)), 0.0),
    swarm.Sphere(1.0),
]
HONEST = {
    "one frame of 1e9 impacts": ([swarm.Sphere(0.5)], None, moving(0.1, 0.0, 0.0), 1e9),
    "a small ball in a large cavity": (
        [swarm.Sphere(1.0), swarm.Sphere(1e-9, side="outside")], None, moving(0.1, 0.0, 0.0), 1e4
    ),
    "one next to a small ball": (
        [swarm.Sphere(1.0), swarm.Sphere(1e-9, center=(0.0, 0.0, -1.0 + 2.1e-9), side="outside")],
        None,
        swarm.Particles([1.05e-9, 0.0, -1.0 + 1e-14], [-1.0, 0.0, 0.0]),
        1e4,
    ),
    "all in a narrow corner": (WEDGE, None, moving(1e-9, 0.0, 5e-13), 1.0),
    "along the wall": ([swarm.Sphere(0.5)], None, swarm.Particles([0.5, 0.0, 0.0], [0.0, 1.0, 0.0]), 1e3),
    "almost along it": ([swarm.Sphere(0.5)], None, swarm.Particles([0.5, 0.0, 0.0], [-1e-13, 1.0, 0.0]), 1e3),
    "at rest on the floor": ([BOX], (0.0, 0.0, -9.81), swarm.Particles([0.0, 0.0, -0.5], [0.0, 0.0, 0.0]), 1e6),
    "a little above the floor": (
        [BOX], (0.0, 0.0, -9.81), swarm.Particles([0.0, 0.0, -0.5 + 1e-16], [0.0, 0.0, 0.0]), 1e6
    ),
    "at rest": ([BOX], None, swarm.Particles([0.0, 0.0, 0.0], [0.0, 0.0, 0.0]), 1e9),
    "an open scene": ([swarm.Slab((0.0, 0.0, 1.0), 1.0)], None, swarm.Particles([0.0] * 3, [1.0, 0.0, 0.0]), 1e12),
}  # fmt: skip


@pytest.mark.parametrize("name", HONEST)
def test_honest_runs_are_not_refused(name, caplog):
    surfaces, gravity, particles, until = HONEST[name]
    with caplog.at_level(logging.WARNING, "swarm"):
        workload.require_few_impacts(swarm.Scene(surfaces, gravity).compiled(), particles, swarm.Impact(), until, until)
    assert not caplog.records


@pytest.mark.parametrize("law", [{"restitution": 0.5}, {"friction": 0.5}, {"temperature": 300.0}], ids=str)
def test_what_loses_or_gets_energy_is_not_judged_by_its_start(law):
    scene = swarm.Scene([swarm.Slab((0.0, 0.0, 1.0), THIN, **law), BOX])
    workload.require_few_impacts(scene.compiled(), moving(0.0, 0.0, 0.0), swarm.Impact(), 1.0, 1.0)


def test_a_long_run_is_counted(caplog):
    """1e6 particles with 1e8 impacts each: 1e14 in all, of frames that end."""
    scene = swarm.Scene([swarm.Sphere(0.5)])
    particles = swarm.fill(scene, 1_000_000, speed=1.0)
    with caplog.at_level(logging.WARNING, "swarm"):
        workload.require_few_impacts(scene.compiled(), particles, swarm.Impact(), 1e8, 1e3)
    (record,) = caplog.records
    assert "impacts" in record.getMessage()
    count = float(record.getMessage().split("about ")[1].split()[0])
    # The mean chord of a sphere is 4R/3.
    assert 0.5e14 < count * (4.0 * 0.5 / 3.0) < 2e14


def test_a_box_is_counted_by_its_mean_chord():
    """A walk through the volume sees what the flights of its particles see: 4 V/S, within a factor."""
    with np.errstate(all="ignore"):
        found = workload._of_volume(swarm.Scene([BOX]).compiled(), moving(0.1, 0.2, 0.3), 0.0)
    assert 0.5 < found.between / (4.0 * 1.0 / 6.0) < 2.0
