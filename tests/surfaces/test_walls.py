"""What is asked of all walls: minima, sums and picks over the list of surfaces."""

import math

import numpy as np
import pytest
from conftest import SURFACES, call, directions, vectors
from hypothesis import given
from hypothesis import strategies as st

import swarm
from swarm.kernel.gravity import Gravity
from swarm.surfaces.time_of_impact import flights
from swarm.surfaces.walls import Walls, all_walls

every_chain = pytest.mark.parametrize(
    "names",
    [
        (),
        ("sphere",),
        ("plane", "ellipsoid"),
        ("plane", "plane", "ball"),
        ("egg", "sphere", "plane", "ellipsoid"),
        ("torus", "rotated egg", "rotated torus"),
    ],
    ids=", ".join,
)


def both(names):
    """The walls, and the surfaces' numbers one by one."""
    surfaces = tuple(SURFACES[name]() for name in names)
    return all_walls(surfaces), [wall for surface in surfaces for wall in surface.walls()]


def is_out(numbers, point):
    """Outside one surface, by its level."""
    return call(numbers.level_of, call(numbers.inner, point)) > 0.0


def first_least(hits):
    """Least time and the first index that has it, -1 where that is not found; infinity and 0 without walls."""
    times = [time for time, _found in hits]
    if not times or min(times) == math.inf:
        return math.inf, 0.0
    index = int(np.argmin(times))
    return times[index], float(index) if hits[index][1] else -1.0


@every_chain
@pytest.mark.parametrize("falling", [False, True])
@given(point=vectors, velocity=directions, pull=directions)
def test_first_hit_is_the_least_of_all(names, falling, point, velocity, pull):
    whole, single = both(names)
    gravity = Gravity(*pull) if falling else None
    one, more = ("falling_hit", (pull,)) if falling else ("first_hit", ())
    hits = [call(getattr(numbers, one), point, velocity, *more) for numbers in single]
    assert whole.length() == len(names)
    assert call(flights.first_hit, whole, gravity, point, velocity) == first_least(hits)
    for index, hit in enumerate(hits):
        assert call(flights.hit_of, whole, gravity, index, point, velocity) == hit


@every_chain
@given(point=vectors, velocity=directions)
def test_other_hit_is_the_least_of_the_others(names, point, velocity):
    whole, single = both(names)
    hits = [call(numbers.first_hit, point, velocity) for numbers in single]
    for index in range(len(hits)):
        others = [(math.inf, True) if i == index else hit for i, hit in enumerate(hits)]
        least, other = call(flights.other_hit, whole, index, point, velocity)
        assert least == min(time for time, _found in others)
        if least < math.inf:
            assert other == np.argmin([time for time, _found in others])


@every_chain
@given(point=vectors, velocity=directions, pull=directions)
def test_free_time_is_the_least_safe_time(names, point, velocity, pull):
    whole, single = both(names)
    safe = [call(numbers.safe_time, point, velocity, pull) for numbers in single]
    assert call(flights.safe_time, whole, point, velocity, pull) == min(safe, default=math.inf)
    assert call(flights.free_time, Gravity(*pull), whole, point, velocity) == min(safe, default=math.inf)
    free = call(flights.free_time, None, whole, point, velocity)
    if any(is_out(numbers, point) for numbers in single):
        assert free == 0.0
    else:
        assert free == call(flights.first_hit, whole, None, point, velocity)[0]


@every_chain
@given(point=directions, free=vectors, kappa=st.floats(-0.02, 0.02))
def test_an_index_picks_its_surface(names, point, free, kappa):
    whole, single = both(names)
    for index, numbers in enumerate(single):
        for name, arguments in [
            ("unit_normal", (point,)),
            ("chord_guess", (point, 0.1 * free)),
            ("chord_improve", (point, 0.1 * free, kappa)),
            ("chord_normal", (point, 0.1 * free, kappa)),
            ("project", (point,)),
            ("push", (point, free, kappa)),
            ("discrete_gradient", (point, free)),
        ]:
            assert call(getattr(whole, name), index, *arguments) == call(getattr(numbers, name), *arguments), name


@every_chain
@given(point=vectors, free=vectors)
def test_which_walls_are_violated_and_which_are_touched(names, point, free):
    whole, single = both(names)
    out = [is_out(numbers, point) for numbers in single]
    assert call(Walls.outside, whole, -1.0, point) == any(out)
    for index in range(len(single)):
        assert call(Walls.outside, whole, index, point) == any(out[:index] + out[index + 1 :])
    touched = [now or is_out(numbers, point + free) for now, numbers in zip(out, single, strict=True)]
    first = touched.index(True) if any(touched) else -1
    assert call(Walls.touched, whole, point, free) == (first, sum(touched))


@pytest.mark.parametrize("pull", [None, (0.3, -0.2, -1.0)], ids=["straight", "falling"])
@given(point=vectors, velocity=directions)
def test_a_wall_in_uniform_translation_is_asked_in_its_frame(pull, point, velocity):
    """Its hits are those of the wall at rest, bit for bit, and not found by safe steps."""
    moved = swarm.Sphere(1.0, motion=swarm.Translation((0.2, -0.1, 0.3)))
    (wall,) = swarm.Scene([moved], pull).compiled().walls(1.0).at(0.25).each
    shift, speed = np.array(wall.pose.shift), np.array(wall.pose.velocity)
    (body,) = swarm.Sphere(1.0).walls()
    ask, more = ("first_hit", ()) if pull is None else ("falling_hit", (np.array(pull),))
    here = call(getattr(wall, ask), point, velocity, *more)
    assert here == call(getattr(body, ask), point - shift, velocity - speed, *more)


@pytest.mark.parametrize("number", [0.0, 2.0, 3.0, 5.0, 6.0])
def test_plain_python_asks_only_the_wall_with_the_number(number):
    """A field of three, a box of three, and of any other number the last one."""
    balls = swarm.Spheres([(x, 0.0, 0.0) for x in (-0.5, 0.0, 0.5)], 0.1)
    walls, asked = swarm.Scene([swarm.Box((1.0, 1.1, 1.2)), balls]).compiled().walls(0.0), []
    field, *slabs = walls.each
    each = [*(field.members.wall(float(k)) for k in range(3)), *slabs]

    def level(wall, r):
        asked.append(wall)
        return wall.phi(r)

    r = np.array([0.3, -0.2, 0.1])
    found = call(walls.of, number, 0.0, level, r)
    assert len(asked) == 1
    assert found == call(each[min(int(number), 5)].phi, r)
