"""First hits of straight flights with smooth formulas: none is missed, each is on the wall, in few looks."""

import math
from typing import Any

import numpy as np
import pytest

import swarm
from swarm.kernel.limits import EPSILON
from swarm.kernel.vector import Vec, dot, square

BALL = "x**2/0.09 + y**2/0.09 + z**2/0.16 - 1 + {}*sin(10*x)*sin(10*y)"
# The formula, what else it needs, and how many looks a flight takes on average: of a convex one, 5 at most.
FORMULAS: dict[str, tuple[str, dict[str, Any], float]] = {
    "convex": (BALL.format(0.1), {}, 5.0),
    "wavy": (BALL.format(0.5), {}, 8.0),
    "folded": (BALL.format(2.0), {}, 12.0),
    "solid": (BALL.format(0.5), {"side": "outside"}, 12.0),
    "exponential": ("exp(x*x) + exp(y*y) + exp(z*z) - 4", {}, 6.0),
    "gyroid": ("sin(x)*cos(y) + sin(y)*cos(z) + sin(z)*cos(x)", {"bounds": ((-6.0,) * 3, (6.0,) * 3)}, 16.0),
}


def _flights(surface, count):
    """Flights from places near the surface on its admissible side, and after each impact the reflected one."""
    numbers, (low, high) = surface.numbers(), np.array(surface._form.box)
    generator = np.random.default_rng(3)
    while count > 0:
        r = Vec(*generator.uniform(low, high).tolist())
        if numbers.side * numbers.phi(r) > 0.0:
            continue
        v = Vec(*generator.normal(size=3).tolist())
        for _bounce in range(4):
            time, found = numbers.first_hit(r, v)
            assert found
            yield r, v, time
            count -= 1
            if math.isinf(time):
                break
            r = r + time * v
            n = numbers.gradient(r)
            v = v - (2.0 * dot(v, n) / square(n)) * n


@pytest.mark.parametrize("name", FORMULAS)
def test_nothing_is_missed_and_every_hit_is_on_the_wall(name, monkeypatch):
    text, more, most = FORMULAS[name]
    surface = swarm.Formula(text, **more)
    numbers, looks = surface.numbers(), list[Vec]()
    kind, phi = type(numbers), type(numbers).phi

    def counted(self, r):
        looks.append(r)
        return phi(self, r)

    monkeypatch.setattr(kind, "phi", counted)
    flights = list(_flights(surface, 100))
    assert len(looks) <= most * len(flights)
    monkeypatch.undo()
    reach = np.abs(np.array(surface._form.box)).max()
    for r, v, time in flights:
        ways = np.linspace(0.0, min(time, 4.0 * reach / math.sqrt(square(v))), 402)[1:-1]
        levels = numbers.side * surface.phi(np.array(r)[:, None] + ways * np.array(v)[:, None])
        if not math.isinf(time):
            end = r + time * v
            steepness = math.sqrt(square(numbers.gradient(end)))
            assert abs(numbers.phi(end)) <= 4.0 * EPSILON * max(1.0, steepness * reach)
            # Not through the wall before
            assert levels.max() <= 4.0 * EPSILON * max(1.0, steepness * reach)


@pytest.mark.parametrize("gravity", [None, (0.3, 0.0, -1.0)], ids=["straight", "falls"])
def test_flights_in_lanes_are_those_one_by_one(gravity):
    cavity = swarm.Formula(BALL.format(0.5), rotation=(0.9, 0.1, 0.2, 0.3))
    solid = swarm.Formula("x**2 + y**2 + z**2 - 0.01 + 0.001*sin(30*x)", center=(0.05, 0.0, 0.0), side="outside")
    scene, pull = swarm.Scene([cavity, solid], gravity), Vec(*(gravity or (0.0, 0.0, 0.0)))
    start = swarm.fill(scene, 4, speed=1.0, seed=2)
    result = swarm.simulate(scene, start, swarm.Impact(), until=1.0, compile="never")
    walls, impacts, met = scene.compiled().walls().each, 0, set()
    for k in range(4):
        r, v, left = Vec(*start.position[:, k].tolist()), Vec(*start.velocity[:, k].tolist()), 1.0
        while True:
            times = [_hit(wall, r, v, pull if gravity else None) for wall in walls]
            time = min(min(times), left)
            r, v, left = r + time * v + (0.5 * time * time) * pull, v + time * pull, left - time
            if left == 0.0:
                break
            met.add(times.index(time))
            n = walls[times.index(time)].gradient(r)
            v, impacts = v - (2.0 * dot(v, n) / square(n)) * n, impacts + 1
        assert np.abs(result.particles.position[:, k] - np.array(r)).max() <= 1e-9
    assert met == {0, 1}
    assert result.observables["impacts"][-1] == impacts > 10
    assert result.observables["max_penetration"][-1] <= 4.0 * EPSILON


def _hit(wall, r, v, pull):
    """The first hit of a flight; a fall of many looks is taken up again where they end."""
    before, found = 0.0, False
    while not found:
        with np.errstate(all="ignore"):
            time, found = wall.first_hit(r, v) if pull is None else wall.falling_hit(r, v, pull)
        before = before + time
        if pull is not None and not found:
            r, v = r + time * v + (0.5 * time * time) * pull, v + time * pull
    return before
