"""Flights through a cell that repeats go on over its faces where nothing is in the way: exact, and at no cost."""

import numpy as np
import pytest

import swarm
from swarm.lanes import block
from swarm.surfaces.periodic.axes import Free
from swarm.surfaces.periodic.gaps import Beside, Gap
from swarm.surfaces.periodic.period import Period

EPSILON = float(np.finfo(np.float64).eps)
CELL = (1.0, 1.0, 1.0)
BALL = swarm.Sphere(0.1, (0.5, 0.5, 0.5), "outside")
CORNER = swarm.Sphere(0.1, (0.0, 0.0, 0.0), "outside")
ROD = swarm.Cylinder(0.1, (1.0, 0.0, 0.0), center=(0.0, 0.5, 0.5), side="outside")
GRID = swarm.Spheres(np.indices((3, 3, 3)).reshape(3, -1).T + 0.5, np.full(27, 0.1))
CHANNEL = [swarm.Plane((0.0, 0.0, -1.0), 0.0), swarm.Plane((0.0, 0.0, 1.0), 1.0)]
HALL = [CHANNEL[0], swarm.Plane((0.0, 0.0, 1.0), 3.0)]
BELT = swarm.Plane((0, 0, -1), 0.0, friction=0.5, motion=swarm.Translation((0.3, 0.0, 0.0)))


@pytest.fixture
def passes(monkeypatch):
    """How many passes kernels make in plain Python."""
    counted, one = [], block._pass
    monkeypatch.setattr(block, "_pass", lambda *given: counted.append(1) or one(*given))
    return counted


def run(scene, r, v, until, **options):
    start = swarm.Particles(r, v)
    return swarm.simulate(scene, start, swarm.Impact(), until=until, compile="never", threads=1, **options)


def error_of(scene, result, r, v, until):
    """How far a particle is from its straight or falling way, in roundings of the coordinates that it went over."""
    way = 0.5 * np.array(scene.gravity or (0.0, 0.0, 0.0)) * until**2 + np.array(v) * until
    size = np.maximum(np.abs(np.array(r) + way), 1.0)
    return np.abs(scene.unwrapped(result.particles)[:, 0] - (np.array(r) + way)) / (0.5 * EPSILON * size)


# Walls, gravity, period; position, velocity, time: 1e8 to 2e12 cells.
OVER = {
    "channel": (CHANNEL, None, (1.0, 1.0, None), (0.1, 0.2, 0.5), (1e3, 3.7, 0.0), 1e5),
    "channel, for ever": (CHANNEL, None, (0.7, 1.0, None), (0.1, 0.2, 0.5), (-1e3, 3.7, 0.0), 2e8),
    "channel that moves": ([BELT, CHANNEL[1]], None, (1.0, 1.0, None), (0.1, 0.2, 0.5), (1e3, 3.7, 0.0), 1e5),
    "pipe": ([swarm.Cylinder(0.4, (1, 0, 0))], None, (0.3, None, None), (0.1, 0.2, 0.1), (1e3, 0, 0), 1e5),
    "rods": ([ROD], None, CELL, (0.1, 0.2, 0.45), (1e3, 0.0, 0.0), 1e5),
    "over a ball": ([BALL], None, CELL, (0.1, 0.45, 0.1), (1e3, 37.0, 0.0), 1e5),
    "over a ball, slowly up": ([BALL], None, CELL, (0.1, 0.45, 0.1), (1e3, 37.0, 1e-6), 1e5),
    "beside a ball, along an axis": ([BALL], None, CELL, (0.1, 0.41, 0.41), (1e3, 0.0, 0.0), 1e5),
    "and back": ([BALL], None, CELL, (0.1, 0.41, 0.41), (0.0, 0.0, -1e3), 1e5),
    "over a ball in a face": (
        [swarm.Sphere(0.1, (0, 0.5, 0.5), "outside")],
        None,
        CELL,
        (0.5, 0.5, 0),
        (0, 9.9, 0),
        1e7,
    ),
    "over a ball on a floor": ([BALL, *CHANNEL], None, (1.0, 1.0, None), (0.1, 0.45, 0.1), (1e3, 37.0, 0.0), 1e5),
    "under a ball": ([BALL, *CHANNEL], None, (1.0, None, None), (0.1, 7.0, 0.1), (-1e3, 0.0, 0.0), 1e5),
    "past a ball": ([BALL], None, (1.0, None, None), (0.1, 0.61, 0.61), (-1e3, 1e-3, 0.0), 1e5),
    "over balls of a field": ([GRID], None, (3.0, 3.0, 3.0), (0.1, 0.45, 0.1), (1e3, 37.0, 0.0), 1e5),
    "over a field on a floor": ([GRID, *HALL], None, (3.0, 3.0, None), (0.1, 0.45, 0.1), (1e3, 37.0, 0.0), 1e5),
    "over a ball in a corner": ([CORNER], None, CELL, (0.1, 0.5, 0.5), (-1e3, 37.0, 0.0), 1e5),
    "a fall": ([BALL], (9.81, 0.0, 0.0), CELL, (0.1, 0.2, 0.1), (0.0, 0.0, 0.0), 1e4),
    "a fall in a shaft": ([swarm.Cylinder(0.4)], (0, 0, -9.81), (None, None, 0.5), (0.1, 0.2, 0.1), (0, 0, 3.0), 1e4),
}


@pytest.mark.parametrize("case", OVER)
def test_what_meets_nothing_goes_on_over_all_cells(case, passes):
    walls, gravity, period, r, v, until = OVER[case]
    scene = swarm.Scene(walls, gravity, period=period)
    result = run(scene, r, v, until)
    assert result.observables["impacts"][-1] == 0
    assert np.abs(result.particles.image).max() > 1e7
    # Its product with the time, and the sum; of a fall there is one product more.
    assert (error_of(scene, result, r, v, until) <= (2.0 if gravity is None else 4.0)).all()
    assert len(passes) <= 5


def test_the_cost_is_that_of_impacts(passes):
    """Up and down in a channel, over 1e5 cells from one impact to the next."""
    scene = swarm.Scene(CHANNEL, period=(1.0, 1.0, None))
    r, v, until = (0.1, 0.2, 0.5), (1e5, 31.0, 1.0), 100.0
    result = run(scene, r, v, until)
    assert result.impacts_per_particle.tolist() == [100]
    assert len(passes) <= 102
    unwrapped = scene.unwrapped(result.particles)[:, 0]
    assert unwrapped == pytest.approx([0.1 + 1e7, 0.2 + 3100.0, 0.5], rel=100 * EPSILON)


@pytest.mark.parametrize("frames", [1, 7])
@pytest.mark.parametrize(("walls", "period"), [([BALL], CELL), ([GRID], (3.0, 3.0, 3.0))], ids=["ball", "field"])
def test_a_time_that_is_rounded_at_each_face_does_not_add_up(walls, period, frames):
    """Along a diagonal between balls, cell by cell: faces round the position, and not what is left of the frame."""
    scene = swarm.Scene(walls, period=period)
    for speed in (1.0, 0.7, 3e3):
        r, v, until = (0.1, 0.6, 0.41), (speed, speed, 0.0), 1234.5 / speed
        result = run(scene, r, v, until, every=until / frames)
        assert result.observables["impacts"][-1] == 0
        assert (error_of(scene, result, r, v, until) <= 4.0).all()


RANDOM = {
    "ball": ([BALL], None, CELL),
    "balls of a field": ([swarm.Spheres([(0.5, 0.1, 0.2), (0.2, 0.9, 0.3)], [0.2, 0.1])], None, CELL),
    "balls of a field that fall": ([swarm.Spheres([(0.5, 0.1, 0.2)], [0.2])], (0.1, 0.0, -0.2), CELL),
    "ball in a corner": ([CORNER], None, CELL),
    "field in a channel": ([swarm.Spheres([(0.5, 0.1, 0.2)], [0.15]), *CHANNEL], None, (1.0, 1.0, None)),
    "ball in a face": ([swarm.Sphere(0.2, (0.9, 0.1, 0.5), "outside")], None, CELL),
    "two balls": ([BALL, swarm.Sphere(0.15, (0.1, 0.9, 0.2), "outside")], None, (1.0, 1.3, 0.8)),
    "rod and ball": ([ROD, swarm.Sphere(0.15, (0.5, 0.0, 0.0), "outside")], None, CELL),
    "rods": ([ROD], None, CELL),
    "ball in a channel": ([BALL, *CHANNEL], None, (1.0, 1.0, None)),
    "ball in a channel that falls": ([BALL, *CHANNEL], (0.3, 0.0, -1.0), (1.0, 1.0, None)),
    "ball that falls": ([BALL], (0.0, 0.2, -0.3), CELL),
    "box in a duct": (
        [swarm.Box((0.1, 0.2, 0.1), (0.5,) * 3, side="outside"), swarm.Slab((0, 1, 0), 0.5, (0, 0.5, 0)), *CHANNEL],
        None,
        (1.0, None, None),
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", RANDOM)
def test_flights_over_faces_are_those_from_face_to_face(case, monkeypatch):
    """Also along axes, and along planes of the lattice."""
    walls, gravity, period = RANDOM[case]
    scene = swarm.Scene(walls, gravity, period=period)
    start = swarm.fill(scene, 60, speed=1.0, seed=3)
    start.velocity[0, :20] = 0.0
    start.velocity[1, 10:30] = 0.0
    start.velocity[2, 25:35] = 0.0
    found = swarm.simulate(scene, start, swarm.Impact(), until=4.0, compile="never")
    monkeypatch.setattr(
        "swarm.compiled_scene.cell_in", lambda period, surfaces, fields, fall, wide: Period(*period, fall)
    )
    other = swarm.simulate(scene, start, swarm.Impact(), until=4.0, compile="never")
    assert (found.impacts_per_particle == other.impacts_per_particle).all()
    few = found.impacts_per_particle <= 4
    assert few.sum() >= 20
    one, two = (scene.unwrapped(end.particles)[:, few] for end in (found, other))
    np.testing.assert_allclose(one, two, atol=1e-9)
    assert found.observables["max_penetration"].max() <= 1e-15


def test_where_nothing_is_in_the_way():
    def cell(walls, period=CELL):
        return swarm.Scene(walls, period=period).compiled().cell()

    assert cell(CHANNEL, (1.0, 0.5, None))[:5] == (Free(1.0), Free(0.5), None, None, None)
    assert cell([ROD]).x == Free(1.0)
    assert cell([ROD]).gaps.x is None
    assert cell([ROD]).gaps.y == pytest.approx(Gap(0.601, 1.399))
    assert cell([BALL, *CHANNEL], (1.0, 1.0, None)).gaps.walls is not None
    assert cell([BALL]).gaps.walls is None
    assert cell([BALL], (1.0, None, None)).gaps.z == pytest.approx(Beside(0.3998, 0.6002))
    assert cell([GRID], (3.0, 3.0, 3.0)).gaps.x == pytest.approx(Gap(2.603, 3.397))
    # Where balls are all around, where walls with images move, and with openings nothing is known.
    wide = swarm.Sphere(0.497, (0.5, 0.5, 0.5), "outside")
    assert cell([wide]).gaps[:3] == (None, None, None)
    assert cell([swarm.Spheres([(0.5, 0.5, 0.5)], [0.497])]).gaps is None
    across = swarm.Oscillation((0.0, 0.0, 0.1), 1.0)
    moved = swarm.Sphere(0.1, (0.5, 0.5, 0.5), "outside", motion=across)
    assert cell([moved], (1.0, 1.0, None)).gaps is None
    opened = swarm.Plane((0, 0, 1), 1.0, openings=[swarm.Sphere(0.1, (0.5, 0.5, 1.0))])
    assert cell([CHANNEL[0], opened], (1.0, 1.0, None)).x == 1.0


def test_cells_that_no_file_can_count_are_refused():
    scene = swarm.Scene(CHANNEL, period=(1.0, 1.0, None))
    for r, v, until in (((0, 0, 0.5), (1e10, 0, 0), 1e7), ((1e17, 0, 0.5), (0, 0, 0), 1.0)):
        with pytest.raises(swarm.SceneError, match=r"period\[[01]\] must be so long .* at most 2\*\*53 cells, got 1 m"):
            run(scene, r, v, until)
