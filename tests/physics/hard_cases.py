"""Launches that graze, hit corners and enter cusps, and what is known of each run: `CASES[name]()`."""

import math
from unittest import mock

import numpy as np
from physics.billiards import AXES, FACES, launched, run, scene_of, ulps_outside, wall_frames, worst_energy

import swarm
from swarm.run.engine import Run

ANGLES = [0.0, 1e-12, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3]
# Passes of a frame: the dearest, in the thinnest cap, has 200 000 impacts, each of them exact.
MOST_PASSES = 1_000_000

_advance = Run.advance


def _cheaply(run, *arguments):
    """`Run.advance`, but a frame that takes too many passes is an error."""
    run.halt(MOST_PASSES)
    assert _advance(run, *arguments), f"a frame is not done after {MOST_PASSES} passes"
    return True


def _facts(scene, start, until, every=0.25):
    with mock.patch.object(Run, "advance", _cheaply):
        result = run(scene, start, swarm.Impact(), until, every, "always" if len(start) > 1 else "never")
    return {
        "impacts": int(result.observables["impacts"][-1]) / len(start),
        "energy": max(float(result.observables["energy_error"].max()), worst_energy(start, result.particles)),
        "ulps": ulps_outside(scene, result),
        "time": until,
        "shortest": 1e-4 * scene.size(),  # unit speeds
    }


def graze_sphere():
    wall, tangent, inward = wall_frames((0.5,) * 3, 20, 1)
    return {str(a): _facts(scene_of("sphere"), launched(wall, tangent, inward, a), 2.0) for a in ANGLES}


def graze_ellipsoid():
    wall, tangent, inward = wall_frames(AXES, 20, 2)
    return {str(a): _facts(scene_of("ellipsoid"), launched(wall, tangent, inward, a), 2.0) for a in ANGLES}


def graze_floor():
    """Down the sphere's wall to the corner with the floor."""
    wall, tangent, inward = wall_frames((0.5,) * 3, 30, 3)
    wall[2], inward[2] = np.abs(wall[2]), -np.abs(inward[2])
    down = np.zeros((3, 30))
    down[2] = -1.0
    steepest = down - (down * inward).sum(axis=0) * inward
    tangent[2] = 0.0  # any tangent of the upper half goes down
    tangent = np.where(np.arange(30) % 2, steepest, tangent - (tangent * inward).sum(axis=0) * inward)
    tangent /= np.sqrt((tangent**2).sum(axis=0))
    return {str(a): _facts(scene_of("cut sphere"), launched(wall, tangent, inward, a), 3.0) for a in ANGLES}


def corner_circle():
    """Started on the circle where sphere and floor meet, in every direction of interest."""
    angle, z = np.linspace(0.0, 6.0, 20), np.full(20, -0.2)
    r, zero = math.sqrt(0.25 - 0.04), np.zeros(20)
    start = np.array([r * np.cos(angle), r * np.sin(angle), z])
    along, out = np.array([-np.sin(angle), np.cos(angle), zero]), np.array([np.cos(angle), np.sin(angle), zero])
    up = np.array([zero, zero, zero + 1.0])
    directions = {"along": along, "out": out, "up": up, "down": -up, "down and out": 0.6 * out - 0.8 * up}
    return {
        name: _facts(scene_of("cut sphere"), swarm.Particles(start, v), 3.0) for name, v in directions.items()
    }  # fmt: skip


def graze_ball():
    """Tangential to a solid ball, and to a solid egg: the flight touches it and goes on."""
    facts = {}
    for name, axes, solid in (
        ("ball", (0.2,) * 3, swarm.Sphere(0.2, side="outside")),
        ("egg", (0.1, 0.15, 0.2), swarm.Ellipsoid((0.1, 0.15, 0.2), side="outside")),
    ):
        wall, tangent, inward = wall_frames(axes, 200, 4)
        scene = swarm.Scene([swarm.Sphere(0.5), solid])
        for angle in (0.0, 1e-15, 1e-12, 1e-9, 1e-6, -1e-12, -1e-6):
            facts[f"{name} {angle}"] = _facts(scene, launched(wall, tangent, -inward, angle), 10.0)
    return facts


def corners():
    """Two and three planes of a box at once, axis-parallel and turned."""
    facts = {}
    turn, _ = np.linalg.qr(np.array([[1.0, 2.0, 3.0], [0.0, 1.0, 4.0], [5.0, 6.0, 0.0]]))
    for name, q in (("straight", np.eye(3)), ("turned", turn)):
        scene = swarm.Scene([swarm.Plane(tuple(q @ face), 0.5) for face in FACES])
        for corner in ((1, 1, 1), (1, 1, 0), (1, -1, 0.3)):
            facts[f"{name} into {corner}"] = _facts(scene, swarm.Particles(np.zeros(3), q @ corner), 20.0)
        edge = swarm.Particles(q @ [0.5, 0.5, 0.0], q @ [0.0, 0.0, 1.0])
        facts[f"{name} along the edge"] = _facts(scene, edge, 20.0)
        tip = swarm.Particles(q @ [0.5, 0.5, 0.5], q @ [1.0, 1.0, 1.0])
        facts[f"{name} from the corner"] = _facts(scene, tip, 20.0)
    return facts


def wedge():
    """Between two planes at 1, 0.1 and 0.01 rad: pi/angle impacts, then out again."""
    facts = {}
    for angle in (1.0, 0.1, 0.01):
        side = swarm.Plane((-math.sin(angle), math.cos(angle), 0.0), 0.0)
        scene = swarm.Scene([swarm.Plane((0.0, -1.0, 0.0), 0.0), side, swarm.Sphere(1.0)])
        part = np.linspace(0.1, 0.9, 40) * angle
        start = 0.9 * np.array([np.cos(part), np.sin(part), 0.0 * part])
        facts[f"{angle} into the edge"] = _facts(scene, swarm.Particles(start, -start / 0.9), 10.0)
        past = np.array([-1.0 + 0.0 * part, 0.0 * part, 0.1 + 0.0 * part])
        facts[f"{angle} past the edge"] = _facts(scene, swarm.Particles(start, past), 10.0)
        for v in ((-1.0, 0.0, 0.1), (-1.0, -1.0, 0.1), (0.0, 0.0, 1.0)):
            facts[f"{angle} from the edge {v}"] = _facts(scene, swarm.Particles(np.zeros(3), v), 10.0)
    return facts


def cusp():
    """Into the cusp between the wall and a solid ball that touches it, or all but."""
    facts = {}
    for gap in (0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3):
        scene = swarm.Scene([swarm.Sphere(0.5), swarm.Sphere(0.2, (0.3 - gap, 0.0, 0.0), side="outside")])
        start = swarm.fill(scene, 200, speed=1.0, seed=5)
        facts[f"{gap} any way"] = _facts(scene, start, 20.0)
        aim = np.array([[0.5], [0.0], [0.0]]) - start.position
        aimed = swarm.Particles(start.position, aim / np.sqrt((aim**2).sum(axis=0)))
        facts[f"{gap} aimed"] = _facts(scene, aimed, 20.0)
    return facts


def _graze_slit(gap):
    angle = np.linspace(0.9, 2.0, 8)
    wall = 0.5 * np.array([np.cos(angle), np.sin(angle), 0.0 * angle])
    along = np.array([np.sin(angle), -np.cos(angle), 0.0 * angle])
    scene = swarm.Scene([swarm.Sphere(0.5), swarm.Sphere(0.2, (0.3 - gap, 0.0, 0.0), side="outside")])
    return _facts(scene, swarm.Particles(wall, along), 5.0)


def graze_slit():
    """Along the wall through the slit between it and a solid ball, and into the cusp where the slit is closed."""
    return {str(gap): _graze_slit(gap) for gap in (1e-3, 1e-6, 1e-10, 0.0)}


def _cap(depth):
    scene = swarm.Scene([swarm.Sphere(0.5), swarm.Plane((0.0, 0.0, -1.0), depth - 0.5)])
    start = [[0.0] * 3, [0.0] * 3, [0.5 - 0.5 * depth] * 3]
    velocity = [[1.0, 0.9, 0.6], [0.0, 0.1, 0.0], [0.0, 0.1, 0.8]]
    return _facts(scene, swarm.Particles(start, velocity), 2.0)


def thin_cap():
    """A cap between sphere and plane, 1e-3 thick: 1e3 impacts a crossing, and a sharp rim."""
    return {str(depth): _cap(depth) for depth in (1e-1, 1e-3)}


def thinner_cap():
    """A cap 1e-6 thick holds particles too."""
    return {"1e-6": _cap(1e-6)}


CASES = {
    "graze_sphere": graze_sphere,
    "graze_ellipsoid": graze_ellipsoid,
    "graze_floor": graze_floor,
    "graze_ball": graze_ball,
    "graze_slit": graze_slit,
    "corner_circle": corner_circle,
    "corners": corners,
    "wedge": wedge,
    "cusp": cusp,
    "thin_cap": thin_cap,
    "thinner_cap": thinner_cap,
}
