"""What a surface must provide: one error sentence before anything compiles, and no default that means "never"."""

import re
from dataclasses import dataclass
from typing import NamedTuple

import numba
import numpy as np
import pytest
from conftest import METHODS, SURFACES, call

import swarm
from swarm import observables
from swarm.kernel.vector import Symmetric, dot, square
from swarm.lanes import block as blocks
from swarm.methods import base as methods
from swarm.surfaces import contract, rotation
from swarm.surfaces.shapes.solid import body
from swarm.surfaces.surface import Surface, box_around, side_sign
from swarm.surfaces.time_of_impact.course import Quartic

SHIPPED = {
    **SURFACES,
    "box": lambda: swarm.Box((0.5, 0.5, 0.5)),
    "rotated box": lambda: swarm.Box((0.5, 0.5, 0.5), rotation=(1.0, 2.0, 3.0, 4.0)),
    "brick": lambda: swarm.Box((0.5, 0.5, 0.5), side="outside"),
    "cylinder": lambda: swarm.Cylinder(0.5),
    "pillar": lambda: swarm.Cylinder(0.5, side="outside"),
    "cone": lambda: swarm.Cone(0.5),
    "spike": lambda: swarm.Cone(0.5, side="outside", rotation=(1.0, 2.0, 3.0, 4.0)),
    "paraboloid": lambda: swarm.Paraboloid(0.5),
    "hill": lambda: swarm.Paraboloid(0.5, side="outside"),
    "quadric": lambda: swarm.Quadric(((1.0, 0.0, 0.0), (0.0, 2.0, 0.0), (0.0, 0.0, 3.0)), (0.0, 0.0, 0.0), -1.0),
    "slab": lambda: swarm.Slab((0.0, 0.0, 1.0), 0.5),
    "plate": lambda: swarm.Slab((0.0, 0.0, 1.0), 0.5, side="outside"),
}
PULL = (0.0, 0.0, -9.81)


# --- Surfaces as a developer writes them -----------------------------------------------------------------


def ball_like(*given, sided=True):
    """A new class of numbers, and the surface of it: the unit sphere, with these methods."""
    fields = {"r": float, "side" if sided else "sign": float}
    methods = {name: DEFINITIONS[name] for name in given}
    numbers = type(contract.Smooth)(
        "MineNumbers", (contract.Smooth,), {"__module__": __name__, "__annotations__": fields, **methods}
    )

    @dataclass(frozen=True, repr=False)
    class Mine(Surface):
        side: str = "inside"

        def numbers(self):
            return numbers(1.0, side_sign(self.side))

        def size(self):
            return 1.0

        def bounds(self):
            return box_around((0.0, 0.0, 0.0), (1.0, 1.0, 1.0), self.side)

        def extent(self):
            return 1.0

        def own_center(self):
            return (0.0, 0.0, 0.0)

    return Mine


def _first_hit(self, r, v):
    b, a = dot(r, v), square(v)
    return (np.sqrt(b * b - a * (square(r) - 1.0)) - b) / a, True


def _course(self, r, v, pull):
    return Quartic(
        self.side * (square(r) - 1.0),
        self.side * dot(r, v),
        self.side * (square(v) + dot(r, pull)),
        self.side * dot(v, pull),
        self.side * 0.25 * square(pull),
        1.0,
    )


DEFINITIONS = {
    "phi": lambda self, r: square(r) - self.r * self.r,
    "gradient": lambda self, r: 2.0 * r,
    "first_hit": _first_hit,
    "hessian": lambda self, r: Symmetric(1.0, 1.0, 1.0, 0.0, 0.0, 0.0),
    "hessian_bounds": lambda self, r: (1.0, 1.0, 1.0),
    "farthest_push": lambda self: self.side * np.inf,
    "is_quartic": True,
    "inner": lambda self, r: square(r),
    "course": _course,
    "push": lambda self, r0, p, kappa: ((1.0 - kappa) * r0 + p) / (1.0 + kappa),
    "rise": lambda self, r0, p, kappa: (0.0, 1.0),
}
LEVEL = ("phi", "gradient")
PARTICLES = swarm.Particles([[0.1], [0.2], [0.3]], [[0.5], [0.0], [0.1]])


def refused(surface, method, gravity=None):
    """The sentence, after which nothing has been compiled."""
    kernels = (blocks.advance_block, observables.observe)
    before = [] if numba.config.DISABLE_JIT else [len(kernel.signatures) for kernel in kernels]
    scene = swarm.Scene([swarm.Box((2.0, 2.0, 2.0)), surface], gravity)
    with pytest.raises(swarm.SceneError) as caught:
        swarm.simulate(scene, PARTICLES, method, until=0.1)
    assert before == ([] if numba.config.DISABLE_JIT else [len(kernel.signatures) for kernel in kernels])
    message = str(caught.value)
    assert "\n" not in message
    assert len(message) < 300
    assert "surfaces[1] (Mine)" in message
    assert "MineNumbers" in message
    assert type(method).__name__ in message
    return message


@pytest.fixture(scope="module")
def shipped():
    """Every surface, as a cavity and as a solid, some of them turned."""
    return [make() for make in SHIPPED.values()]


@pytest.mark.parametrize("gravity", [None, PULL], ids=["no gravity", "gravity"])
@pytest.mark.parametrize("name", METHODS)
def test_every_shipped_surface_gives_what_every_method_needs(shipped, name, gravity):
    for surface in shipped:
        methods.check_surfaces(METHODS[name], swarm.Scene([surface], gravity))


# --- No default means "never" ----------------------------------------------------------------------------


def test_no_falling_hit_is_refused_under_gravity():
    message = refused(ball_like(*LEVEL, "first_hit")(), swarm.Impact(), PULL)
    assert "falling_hit()" in message
    assert "hessian_bounds()" in message
    assert "under gravity" in message


def test_without_gravity_it_is_not_asked():
    scene = swarm.Scene([ball_like(*LEVEL, "first_hit", "hessian")()])
    methods.check_surfaces(swarm.Impact(), scene)
    methods.check_surfaces(swarm.Verlet(dt=0.1, penalty=1.0), scene)


def test_without_a_safe_time_every_step_is_taken():
    """A lower bound that says nothing is 0, never infinity."""
    wall = ball_like(*LEVEL)().numbers()
    assert call(wall.safe_time, np.zeros(3), np.ones(3), np.array(PULL)) == 0.0


@pytest.mark.parametrize("given", ["hessian_bounds", "course"], ids=["hessian_bounds", "course"])
def test_flights_follow_from_what_is_given(given):
    """The fall of a unit sphere from its bend or its course is that of the shipped one."""
    mine, shipped = ball_like(*LEVEL, given)().numbers(), swarm.Sphere(1.0).numbers()
    rng = np.random.default_rng(1)
    pull = np.array(PULL)
    for _ in range(20):
        position, velocity = rng.uniform(-0.5, 0.5, 3), rng.normal(size=3)
        assert sum_of_hits(mine, position, velocity, pull) == pytest.approx(
            sum_of_hits(shipped, position, velocity, pull), rel=1e-9
        )
        assert 0.0 < call(mine.safe_time, position, velocity, pull) <= sum_of_hits(mine, position, velocity, pull)


def sum_of_hits(surface, position, velocity, pull):
    """The time of the first hit, in as many parts as it takes."""
    total = 0.0
    for _part in range(100):
        time, found = call(surface.falling_hit, position, velocity, pull)
        total += time
        if found:
            return total
        position, velocity = position + time * velocity + 0.5 * time * time * pull, velocity + time * pull
    raise AssertionError("not found")


def test_what_is_given_is_not_replaced():
    numbers = type(ball_like(*LEVEL, "first_hit", "hessian_bounds")().numbers())
    assert numbers.first_hit is _first_hit
    assert numbers.gives("first_hit")
    assert not numbers.gives("falling_hit")


def test_a_quartic_without_its_polynomial_is_refused():
    surface = ball_like(*LEVEL, "first_hit", "hessian_bounds", "is_quartic")()
    assert "course()" in refused(surface, swarm.Impact(), PULL)


@pytest.mark.parametrize("method", [swarm.Impact(), swarm.Penalty(dt=0.1, penalty=1.0)], ids=["impact", "penalty"])
def test_another_inner_function_comes_with_its_gap(method):
    """q without g(q) would count q itself as the gap."""
    message = refused(ball_like(*LEVEL, "first_hit", "hessian", "farthest_push", "inner")(), method)
    assert "gap_of() for its `inner`" in message


def test_the_sign_of_the_gap_is_asked_for():
    message = refused(ball_like(*LEVEL, "first_hit", sided=False)(), swarm.Impact())
    assert "the field `side`" in message


# --- One sentence ----------------------------------------------------------------------------------------

COMPLETE = (*LEVEL, "first_hit", "hessian_bounds", "hessian", "farthest_push")
NEED_HESSIAN = [name for name in METHODS if name != "verlet"]  # Impact slides by it


@pytest.mark.parametrize("gravity", [None, PULL], ids=["no gravity", "gravity"])
@pytest.mark.parametrize("name", METHODS)
def test_what_each_method_needs(name, gravity):
    given = [f for f in COMPLETE if f != "hessian"]
    without, whole = (swarm.Scene([ball_like(*some)()], gravity) for some in (given, COMPLETE))
    methods.check_surfaces(METHODS[name], whole)
    if name in NEED_HESSIAN:
        with pytest.raises(swarm.SceneError, match=r"hessian\(\)"):
            methods.check_surfaces(METHODS[name], without)
    else:
        methods.check_surfaces(METHODS[name], without)


def test_no_hessian_and_no_farthest_push_are_named_together():
    message = refused(ball_like(*LEVEL, "first_hit")(), swarm.Penalty(dt=0.1, penalty=1.0))
    assert "farthest_push() and hessian()" in message


def test_a_closed_push_is_that_of_a_wall_that_does_not_turn():
    given = (*LEVEL, "first_hit", "hessian_bounds", "farthest_push", "push", "rise")
    resting, turning = ball_like(*given)(), ball_like(*given)(motion=swarm.Rotation((0.0, 0.0, 1.0), 1.0))
    soft = swarm.Penalty(dt=0.1, penalty=1.0)
    methods.check_surfaces(soft, swarm.Scene([resting]))
    soft.check(swarm.Scene([resting]), PARTICLES)
    assert "hessian()" in refused(turning, soft)


def test_no_first_hit():
    assert "first_hit()" in refused(ball_like(*LEVEL)(), swarm.Impact())


def test_a_scene_asks_for_phi_and_gradient():
    for given, missing in ((("phi",), "gradient()"), (("gradient",), "phi()")):
        with pytest.raises(
            swarm.SceneError, match=f"surfaces\\[0\\] \\(Mine\\).*MineNumbers without {re.escape(missing)}"
        ):
            swarm.Scene([ball_like(*given)()])


@pytest.mark.parametrize("name", ["size", "bounds", "extent", "numbers"])
def test_a_class_without_a_method(name):
    kind = ball_like(*COMPLETE)
    delattr(kind, name)
    with pytest.raises(swarm.SceneError, match=rf"surfaces\[0\] .*Mine without {name}\(\)"):
        swarm.Scene([kind()])


def test_the_parts_of_wrapped_walls_are_asked():
    kind = ball_like(*LEVEL, "first_hit")
    part = kind("outside").numbers()
    turned = rotation.rotated((0.5, 0.5, 0.5, 0.5), part)
    for wall in (turned, body((part, swarm.Plane((0.0, 0.0, 1.0), 0.0).numbers())), body((turned,))):

        class Wrapped(kind):
            def walls(self, wall=wall):
                return (wall,)

        scene = swarm.Scene([Wrapped("outside")], PULL)
        with pytest.raises(swarm.SceneError, match=r"MineNumbers without falling_hit\(\)"):
            methods.check_surfaces(swarm.Impact(), scene)


def test_a_history_asks_too():
    scene = swarm.Scene([ball_like(*LEVEL, "first_hit")()])
    with pytest.raises(swarm.SceneError, match=r"hessian\(\)"):
        swarm.contact_history(scene, (0.9, 0.0, 0.0), (1.0, 0.0, 0.0), 1.0, swarm.Penalty(dt=0.2, penalty=1.0))


def test_numbers_that_are_no_surface_are_refused():
    kind = ball_like(*COMPLETE)

    class Bare(NamedTuple):
        side: float

    class Other(kind):
        def numbers(self):
            return Bare(1.0)

    with pytest.raises(swarm.SceneError, match=r"Bare without the base class swarm\.surfaces\.contract\.Smooth"):
        swarm.Scene([Other()])
