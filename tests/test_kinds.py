"""What makes a new kind of scene, as examples/guide/compiling.md says; and the order of surfaces changes nothing.

Kinds are compared without a compilation: each kernel of a run has one, of the types of its arguments.
"""

import itertools
import pickle

import numpy as np
import pytest

import swarm
from swarm.kernel import cache
from swarm.run import engine
from swarm.run.engine import Run
from swarm.run.machine import run_of
from swarm.run.options import RunOptions
from swarm.run.preflight.admission import task_of

UP, DOWN = (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)
TURN = {"axis": (1.0, -2.0, 3.0), "angle": 1.2}
BY_A_RIGHT_ANGLE = {"axis": (1.0, 0.0, 0.0), "angle": np.pi / 2.0}
VESSEL = swarm.Sphere(2.0)
PLACES = np.random.default_rng(0).uniform(-1.0, 1.0, (100, 3))
UP_AND_DOWN = swarm.Oscillation((0.0, 0.0, 0.05), 2.0)


def plane(normal=(0.0, 0.0, 1.0), offset=0.9, **laws):
    return swarm.Plane(normal, offset, **laws)


def ball(x=0.6, radius=0.3, **laws):
    return swarm.Sphere(radius, (x, 0.1, 0.0), "outside", **laws)


def egg(x=-0.7, **laws):
    return swarm.Ellipsoid((0.2, 0.3, 0.4), (x, 0.0, 0.2), "outside", **laws)


def balls(n, **laws):
    return swarm.Spheres(PLACES[:n], 0.05, **laws)


def listed(n, y=0.0, **laws):
    return [swarm.Sphere(0.05, (x, y, 0.0), "outside", **laws) for x in np.linspace(-1.0, 1.0, n)]


def large(n, y):
    return [swarm.Sphere(0.15, (x, y, 0.1 * y), "outside") for x in np.linspace(-0.8, 0.8, n)]


def phial(a, b="0.09"):
    return swarm.Formula(f"x**2/a + y**2/{b} + z**4/0.13 - 1", parameters={"a": a})


def sampled(dtype=np.float64, order="C"):
    x, y, z = np.meshgrid(*3 * [np.linspace(-1.0, 1.0, 12)], indexing="ij")
    return swarm.Sampled(np.asarray(x * x + y * y + 1.5 * z * z - 0.5, dtype, order), 2.0 / 11.0, (-1.0, -1.0, -1.0))


def kinds(surfaces, gravity=None, method=None, period=None, body=None, start=None, n=8, **options):
    """Kernel -> its kind, of all kernels of a run."""
    scene = surfaces if isinstance(surfaces, swarm.Scene) else swarm.Scene(surfaces, gravity, period)
    if start is None:
        start = swarm.place(scene, body, n) if body is not None else swarm.fill(scene, n, speed=1.0, seed=1)
    task = task_of(scene, start, method or swarm.Impact(), RunOptions(until=1.0, compile="never", **options))
    with run_of(task) as run:
        if isinstance(run, Run) and run.state.contacts is not None:
            run._kinds = set(engine._KINDS)
        return {kernel.__name__: cache.kind(kernel, arguments) for kernel, arguments in run.calls()}


def moved(scene):
    """What another process is sent."""
    return pickle.loads(pickle.dumps(swarm.Scene(scene)))


def start_of(made):
    position, velocity = np.linspace(-0.2, 0.2, 12).reshape(3, 4), np.ones((3, 4))
    return swarm.Particles(made(position), made(velocity), 1.0)


DUMBBELL = swarm.dumbbell(0.2, 1.0)
ROD = {"method": swarm.Impact(dt=1e-2), "body": DUMBBELL}
STEP = {"dt": 1e-2, "penalty": 1e3}
# What a user calls the same but for numbers, as arguments of `kinds`: (surfaces, others) twice. A formula takes a third
# of a second to make, so those that have one are made by their tests.
SAME = {
    "order": ([VESSEL, plane(), ball(), egg()], [egg(), ball(), plane(), VESSEL]),
    "order of fields": (
        [VESSEL, balls(60), swarm.Boxes(PLACES, (0.05, 0.04, 0.03)), plane()],
        [swarm.Boxes(PLACES, (0.05, 0.04, 0.03)), plane(), VESSEL, balls(60)],
    ),
    "order of fields, of few and of many": ([VESSEL, balls(10), balls(60)], [VESSEL, balls(60), balls(10)]),
    "order of lists": (
        [VESSEL, *listed(9), *listed(30, 0.5, restitution=0.5)], [*listed(30, 0.5, restitution=0.5), VESSEL, *listed(9)]
    ),
    "order of lists of boxes": (
        [VESSEL, *(swarm.Box((0.03, 0.02, 0.01), (x, 0.0, 0.0), "outside") for x in np.linspace(-1.0, 1.0, 8)), plane(),
         *listed(9, 0.5)],
        [*listed(9, 0.5), plane(), VESSEL,
         *(swarm.Box((0.03, 0.02, 0.01), (x, 0.0, 0.0), "outside") for x in np.linspace(-1.0, 1.0, 8))],
    ),
    "order of walls that move": (
        [VESSEL, plane(motion=UP_AND_DOWN), plane((1.0, 0.0, 0.0)), ball()],
        [ball(), plane((1.0, 0.0, 0.0)), plane(motion=UP_AND_DOWN), VESSEL],
    ),
    "order of walls that react": (
        [VESSEL, ball(mass=1.0), egg(mass=2.0), plane(mass=3.0, motion=swarm.Guide((0.0, 0.0, 1.0)))],
        [plane(mass=3.0, motion=swarm.Guide((0.0, 0.0, 1.0))), egg(mass=2.0), ball(mass=1.0), VESSEL],
    ),
    "order for bodies": ([VESSEL, plane(), ball()], [ball(), plane(), VESSEL], ROD),
    "order of openings": (
        [swarm.Sphere(2.0, openings=[swarm.Sphere(0.1, (0, 0, 2)), swarm.Ellipsoid((0.1, 0.2, 0.3), (0, 2, 0))])],
        [swarm.Sphere(2.0, openings=[swarm.Ellipsoid((0.1, 0.2, 0.3), (0, 2, 0)), swarm.Sphere(0.1, (0, 0, 2))])],
    ),
    "axis of a cylinder": ([VESSEL, swarm.Cylinder(0.5)], [VESSEL, swarm.Cylinder(0.5, (0, -1, 0))]),
    "axis of a solid cone": (
        [VESSEL, swarm.Cone(0.3, (0, 0, 1), side="outside")], [VESSEL, swarm.Cone(0.4, (1, 0, 0), side="outside")]
    ),
    "axis of a bowl": ([VESSEL, swarm.Paraboloid(0.3)], [VESSEL, swarm.Paraboloid(0.4, (1, 0, 0))]),
    "tilted slabs": ([VESSEL, swarm.Slab((1, 0, 1), 0.5)], [VESSEL, swarm.Slab((0, 1, 2), 0.5)]),
    "turned boxes": (
        [swarm.Box((0.3, 0.4, 0.5), rotation=TURN)], [swarm.Box((0.3, 0.4, 0.5), rotation=(1.0, 2.0, 3.0, 4.0))]
    ),
    "tilted cylinders": ([swarm.Cylinder(0.5, (0, 2, 1), 1.0)], [swarm.Cylinder(0.5, (1, 2, 3), 1.0)]),
    "ellipsoid by a right angle": (
        [swarm.Ellipsoid((0.3, 0.4, 0.5))], [swarm.Ellipsoid((0.3, 0.4, 0.5), rotation=BY_A_RIGHT_ANGLE)]
    ),
    "turned sphere": ([VESSEL], [swarm.Sphere(1.0, (1.0, 2.0, 3.0), rotation=TURN)]),
    "gravity": ([VESSEL], [VESSEL], {"gravity": DOWN}, {"gravity": np.array([1, 2, 0], np.float32)}),
    "whole numbers": ([swarm.Sphere(2), plane((0, 0, 1), 1)], [VESSEL, plane()]),
    "restitution": ([VESSEL, plane(restitution=0.5)], [swarm.Sphere(2.0, restitution=0.5), plane(restitution=0.1)]),
    "friction": ([VESSEL, plane(friction=0.5)], [swarm.Sphere(2.0, friction=1), plane()]),
    "temperature": ([VESSEL, plane(temperature=0.5)], [swarm.Sphere(2.0, temperature=1, accommodation=0.5), plane()]),
    "laws on two walls": (
        [swarm.Sphere(2.0, friction=0.1), plane(restitution=0.5)],
        [swarm.Sphere(2.0, restitution=0.1), plane(friction=0.5)],
    ),
    "law of a field or of its vessel": (
        [VESSEL, balls(60, restitution=0.5)], [swarm.Sphere(2.0, restitution=0.5), balls(60)]
    ),
    "opening in another wall": (
        [VESSEL, plane(openings=[swarm.Sphere(0.1, (0.0, 0.0, 0.9))]), plane((1.0, 0.0, 0.0))],
        [swarm.Sphere(2.0, openings=[swarm.Sphere(0.2, (0.0, 0.0, -2.0))]), plane(), plane((1.0, 0.0, 0.0))],
    ),
    "openings of many": (
        [swarm.Sphere(2.0, openings=[swarm.Spheres(2.0 * np.eye(3), 0.1)])],
        [swarm.Sphere(2.0, openings=[swarm.Spheres(2.0 * np.eye(3).repeat(30, axis=0), 0.1)])],
    ),
    "motion of another wall of a kind": (
        [VESSEL, plane(motion=UP_AND_DOWN), plane((1.0, 0.0, 0.0))],
        [VESSEL, plane(), plane((1.0, 0.0, 0.0), motion=swarm.Oscillation((0.1, 0.0, 0.0), 3, 1))],
    ),
    "order of a sum of motions": (
        [VESSEL, plane(motion=UP_AND_DOWN + swarm.Translation((0.0, 0.0, 0.01)))],
        [VESSEL, plane(motion=swarm.Translation((0, 0, 1)) + UP_AND_DOWN)],
    ),
    "knots of a path": (
        [VESSEL, plane(motion=swarm.Path((0, 1), ((0, 0, 0), (0, 0, 0.1))))],
        [VESSEL, plane(motion=swarm.Path((0, 1, 2), ((0, 0, 0), (0, 0, 0.1), (0, 0, 0))))],
    ),
    "lengths of a cell": (
        [swarm.Sphere(0.3, (1, 1, 1), "outside")], [swarm.Sphere(0.4, (1, 1, 1), "outside")],
        {"period": (2, 2, 2)}, {"period": (2.0, 3.0, 2.5)},
    ),
    "bodies of a field": ([VESSEL, balls(60)], [VESSEL, balls(100)]),
    "few bodies of a field": ([VESSEL, balls(7)], [VESSEL, balls(48)]),
    "bodies of a field under gravity": ([VESSEL, balls(7)], [VESSEL, balls(100)], {"gravity": DOWN}),
    "bodies of a field that moves": (
        [VESSEL, balls(7, motion=UP_AND_DOWN)], [VESSEL, balls(100, motion=UP_AND_DOWN)]
    ),
    "bodies among few and many": ([VESSEL, balls(7)], [VESSEL, balls(100)], ROD),
    "length of a list": ([VESSEL, *listed(7)], [VESSEL, *listed(20)]),
    "parameters of a formula": (lambda: [phial(0.1)], lambda: [phial(1)]),
    "samples": ([sampled()], [sampled(np.float32, "F")]),
    "threads": ([VESSEL], [VESSEL], {"threads": 1}, {"threads": 2}),
    "particles": ([VESSEL], [VESSEL], {"n": 1}, {"n": 3000}),
    "Penalty": ([VESSEL], [VESSEL], {"method": swarm.Penalty(1, 1000)}, {"method": swarm.Penalty(**STEP)}),
    "Impact": ([VESSEL], [VESSEL], {}, {"method": swarm.Impact(sliding_tolerance=1e-6, shortest_flight=1)}),
    "order of memory": (
        [VESSEL], [VESSEL], {"start": start_of(np.asfortranarray)},
        {"start": start_of(lambda a: a.repeat(2, 1)[:, ::2])},
    ),
    "types of arrays": (
        [VESSEL], [VESSEL], {"start": start_of(np.float32)}, {"start": start_of(lambda a: (9.0 * a).astype(">i4"))}
    ),
    "another process": (
        lambda: [VESSEL, balls(60), plane(), phial(1.0)], lambda: moved([VESSEL, balls(60), plane(), phial(1.0)])
    ),
    "samples in another process": ([sampled()], moved([sampled()])),
}  # fmt: skip
# Kinds of their own, some of which are the same to a user: with vectors for all slabs, or a grid of few
# bodies, an impact would take half as long again.
OWN = {
    "one more wall": ([VESSEL, ball()], [VESSEL, ball(), ball(-0.6)]),
    "a solid": ([VESSEL, ball()], [VESSEL, swarm.Sphere(2.5)]),
    "turned ellipsoid": ([swarm.Ellipsoid((0.3, 0.4, 0.5))], [swarm.Ellipsoid((0.3, 0.4, 0.5), rotation=TURN)]),
    "tilted cylinder": ([swarm.Cylinder(0.5, (0, 0, 1), 1.0)], [swarm.Cylinder(0.5, (0, 1, 1), 1.0)]),
    "axis of a slab": ([VESSEL, swarm.Slab((1, 0, 0), 0.5)], [VESSEL, swarm.Slab((0, 1, 0), 0.5)]),
    "axis of a cylinder with caps": ([swarm.Cylinder(0.5, (0, 0, 1), 1.0)], [swarm.Cylinder(0.5, (0, 1, 0), 1.0)]),
    "turned box": ([swarm.Box((0.3, 0.4, 0.5))], [swarm.Box((0.3, 0.4, 0.5), rotation=TURN)]),
    "gravity": ([VESSEL], [VESSEL], {}, {"gravity": DOWN}),
    "restitution": ([VESSEL], [swarm.Sphere(2.0, restitution=0.5)]),
    "motion": ([VESSEL, plane()], [VESSEL, plane(motion=UP_AND_DOWN)]),
    "motion of a wall of another kind": (
        [VESSEL, plane(motion=UP_AND_DOWN)], [swarm.Sphere(2.0, motion=UP_AND_DOWN), plane()]
    ),
    "opening": ([VESSEL], [swarm.Sphere(2.0, openings=[swarm.Sphere(0.1, (0.0, 0.0, 2.0))])]),
    "another period": (
        [swarm.Sphere(0.3, (1, 1, 1), "outside"), swarm.Slab((0, 0, 1), 1.0, (1, 1, 1))],
        [swarm.Sphere(0.3, (1, 1, 1), "outside"), swarm.Slab((0, 0, 1), 1.0, (1, 1, 1))],
        {"period": (2, 2, None)}, {"period": (2, 2, 3)},
    ),
    "a list of 7": ([VESSEL, *listed(6)], [VESSEL, *listed(7)]),
    "49 balls in straight flights": ([VESSEL, balls(48)], [VESSEL, balls(49)]),
    "25 ellipsoids in straight flights": (
        [VESSEL, swarm.Ellipsoids(PLACES[:24], (0.05, 0.04, 0.03))],
        [VESSEL, swarm.Ellipsoids(PLACES[:25], (0.05, 0.04, 0.03))],
    ),
    "text of a formula": (lambda: [phial(1.0)], lambda: [phial(1.0, "0.08")]),
    "method": ([VESSEL], [VESSEL], {}, {"method": swarm.Penalty(**STEP)}),
    "exponent": (
        [VESSEL], [VESSEL], {"method": swarm.Penalty(**STEP)}, {"method": swarm.Penalty(**STEP, exponent=1.5)}
    ),
}  # fmt: skip


def of_pair(first, second, more=None, others=None):
    first, second = (made() if callable(made) else made for made in (first, second))
    more = more or {}
    return kinds(first, **more), kinds(second, **(more if others is None else others))


@pytest.mark.parametrize("name", SAME)
def test_scenes_that_differ_in_numbers_are_of_one_kind(name):
    first, second = of_pair(*SAME[name])
    assert first == second


@pytest.mark.parametrize("name", OWN)
def test_others_are_not(name):
    first, second = of_pair(*OWN[name])
    assert first["advance_block"] != second["advance_block"]


# --- The order of surfaces -------------------------------------------------------------------------------

COLD = {"restitution": 0.8, "friction": 0.3}
ROOM = swarm.Sphere(1.0)
LID = swarm.Plane((0.0, 1.0, 2.0), 0.4)
FLOOR = swarm.Plane((0.0, 0.2, -1.0), 0.4, **COLD)
# Name -> surfaces of different kinds, and other arguments.
MIXED = {
    "laws": ([ROOM, FLOOR, ball(temperature=0.4), egg(restitution=0.5)], {"gravity": DOWN}),
    "springs": ([ROOM, LID, egg()], {"gravity": UP, "method": swarm.Penalty(1e-2, 1e3, exponent=1.5), "n": 8}),
    "multipliers": ([ROOM, LID, egg()], {"method": swarm.AugmentedLagrangian(**STEP, on_unconverged="count"), "n": 5}),
    "fields": ([swarm.Boxes(PLACES[:30] - 0.1, (0.1, 0.2, 0.1)), VESSEL, balls(60, restitution=0.9), LID], {}),
    "lists": ([*large(4, -0.4), ROOM, *large(5, 0.4), swarm.Box((1.2, 0.9, 0.6))], {}),
    "motion": (
        [plane(offset=0.5, motion=UP_AND_DOWN), ROOM, ball(),
         egg(motion=swarm.Rotation((0.0, 0.0, 1.0), 2.0, (-0.7, 0.1, 0.0)))], {"gravity": UP},
    ),
    "reactions": ([egg(mass=0.5), swarm.Box((1.0, 1.2, 1.4)), ball(mass=1.0, restitution=0.8), LID], {}),
    "openings": ([plane(offset=0.5, openings=[swarm.Sphere(0.3, (0.0, 0.0, 0.5))]), ROOM, ball(), egg()], {}),
    "cell": ([swarm.Sphere(0.4, side="outside"), swarm.Slab((0, 0, 1), 0.8), egg(1.2)], {"period": (2.5, 2.5, None)}),
    "bodies": ([FLOOR, ROOM, ball(restitution=0.7)], {"gravity": DOWN, "method": swarm.Impact(dt=1e-2)}),
}  # fmt: skip
# Of each surface one entry.
BY_SURFACE = ("impulse", "wall_heat", "wall_work", "wall_position", "wall_orientation", "wall_energy", "wall_velocity")


def result_of(name, order, path=None):
    surfaces, given = MIXED[name]
    given = {"gravity": None, "method": swarm.Impact(), "period": None, "n": 20, **given}
    scene = swarm.Scene([surfaces[i] for i in order], given["gravity"], given["period"])
    start = swarm.fill(scene, given["n"], speed=1.0, seed=1)
    if name == "bodies":
        start = swarm.place(scene, DUMBBELL, 4, speed=1.0, seed=2)
    more = {} if path is None else {"impacts": path, "member_impacts": True}
    return scene, swarm.simulate(scene, start, given["method"], until=3.0, every=1.5, compile="never", **more)


@pytest.mark.parametrize("name", MIXED)
def test_the_order_of_surfaces_changes_no_bit_and_what_is_given_to_each_is_its_own(tmp_path, name):
    count = len(MIXED[name][0])
    logs = name in ("laws", "fields", "lists", "motion", "cell", "openings")
    _scene, first = result_of(name, range(count), tmp_path / "first.h5" if logs else None)
    assert np.count_nonzero(first.observables["impulse"][-1]) >= count - 2
    for k, order in enumerate([[*range(1, count), 0], [*reversed(range(count))]]):
        path = tmp_path / f"{k}.h5"
        scene, other = result_of(name, order, path if logs else None)
        assert other.particles.position.tobytes() == first.particles.position.tobytes()
        assert other.particles.velocity.tobytes() == first.particles.velocity.tobytes()
        for what, values in first.observables.items():
            if what.startswith("member_"):
                # Those of each surface, one surface behind the other.
                assert [one.tolist() for one in getattr(other, what)] == [
                    getattr(first, what)[i].tolist() for i in order
                ]
                continue
            listed = values[:, order] if what in BY_SURFACE else values
            assert np.asarray(other.observables[what]).tobytes() == np.ascontiguousarray(listed).tobytes(), what
        if logs:
            with swarm.load_impacts(tmp_path / "first.h5") as before, swarm.load_impacts(path) as log:
                table, listed = before.table(), log.table()
                assert [order[i] for i in listed["surface"]] == table["surface"].tolist()
                assert listed["member"].tolist() == table["member"].tolist()
                assert listed["impulse"].tobytes() == table["impulse"].tobytes()
                assert log.scene == scene
            assert other.member_impacts is not None


def test_a_history_has_its_columns_in_the_order_of_the_surfaces():
    corner = [plane((0.0, 0.0, 1.0), 0.1), swarm.Sphere(0.5), swarm.Slab((1.0, 1.0, 0.0), 0.2)]
    method, at = swarm.AugmentedLagrangian(dt=0.05, penalty=1e4), ((0.14, 0.14, 0.1), (1.0, 2.0, 3.0), 1.0)
    whole = swarm.contact_history(swarm.Scene(corner), *at, method)
    assert (whole.multiplier[-1] > 0.0).tolist() == [True, False, True]
    for order in itertools.permutations(range(3)):
        history = swarm.contact_history(swarm.Scene([corner[i] for i in order]), *at, method)
        for name in ("multiplier", "force_multiplier", "force_penalty", "constraint"):
            assert history[name].tolist() == whole[name][:, order].tolist()


def test_walls_that_react_stand_beside_a_list_of_solids():
    """More than six solids are a field where nothing reacts."""
    surfaces = [ball(mass=1.0), *large(8, 0.5), ROOM]
    start = swarm.fill(swarm.Scene(surfaces), 30, speed=1.0, seed=1)
    first = swarm.simulate(swarm.Scene(surfaces), start, swarm.Impact(), until=2.0, compile="never")
    impulse = first.observables["impulse"][-1]
    assert impulse[0] > 0.0
    assert (impulse[1:9] > 0.0).any()
    last = swarm.simulate(swarm.Scene(surfaces[::-1]), start, swarm.Impact(), until=2.0, compile="never")
    assert last.observables["impulse"][-1].tolist() == impulse[::-1].tolist()
