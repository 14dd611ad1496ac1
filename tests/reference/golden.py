"""Golden runs: the last bits of short runs of every method in every kind of surface, as digests.

    python tests/reference/golden.py           compares with golden.json, and names what differs
    python tests/reference/golden.py --write   writes golden.json
    python tests/reference/golden.py falling   compares the runs whose names have this word

golden.json was written by commit ff6ef0a, before the kernels were rebuilt in vectors. The 46 runs of "rotated
ellipsoid" and "box" were written again when the product of their frames left BLAS, whose last bit depends on the
processor; what that bit changes by their ends is 1e-13, and 1e-8 where Uzawa's loop does not converge. 49 runs of
tori, and of capsules and the drum that fall or slide, were written again when steps in lanes took the place of
marches. Ten chords in walls whose steps are found by Newton's method were written again when a last step took them to
round-off: 1.5e-13 at their ends.

The kernels give the same bits compiled and in plain Python; plain Python runs these runs without as many
compilations. Still each step costs a thousand times its compiled time, so the runs are as short as they can be and meet
every branch: some ten impacts of 30 particles with `Impact`, one or two of four particles with a fixed step.
"""

import functools
import hashlib
import json
import multiprocessing
import sys
import warnings
from pathlib import Path

import numpy as np

import swarm

FILE = Path(__file__).parent / "golden.json"
TURN = {"axis": (1.0, -2.0, 3.0), "angle": 1.2}
CENTER = (0.2, -0.1, 0.1)
VESSEL = swarm.Sphere(2.0)


def surfaces(restitution=1.0):
    """Name -> surfaces of a closed scene, all with this restitution."""
    e = {"restitution": restitution}
    cavities = {
        "sphere": swarm.Sphere(0.7, CENTER, **e),
        "ellipsoid": swarm.Ellipsoid((0.4, 0.5, 0.8), CENTER, **e),
        "rotated ellipsoid": swarm.Ellipsoid((0.4, 0.5, 0.8), CENTER, rotation=TURN, **e),
        "torus": swarm.Torus(0.7, 0.3, CENTER, **e),
        "capsule": swarm.Capsule(0.5, 0.6, (1.0, 0.5, -1.0), CENTER, **e),
        "formula": swarm.Formula("x**2/0.16 + y**2/0.25 + z**4 - 1", center=CENTER, **e),
        "box": swarm.Box((0.5, 0.4, 0.3), CENTER, rotation=TURN, **e),
        "straight box": swarm.Box((0.5, 0.4, 0.3), CENTER, **e),
        "cylinder": swarm.Cylinder(0.5, (1.0, 2.0, 3.0), 1.0, CENTER, **e),
        "quadric": swarm.Quadric(np.diag([1.0, 2.0, 3.0]).tolist(), (0.1, 0.0, 0.0), -1.0, rotation=TURN, **e),
    }
    solids = {
        "ball": swarm.Sphere(0.7, CENTER, "outside", **e),
        "egg": swarm.Ellipsoid((0.4, 0.5, 0.8), CENTER, "outside", **e),
        "ring": swarm.Torus(0.7, 0.3, CENTER, "outside", **e),
        "rod": swarm.Capsule(0.5, 0.6, center=CENTER, side="outside", **e),
        "block": swarm.Box((0.5, 0.4, 0.3), CENTER, "outside", rotation=TURN, **e),
        "drum": swarm.Cylinder(0.5, (1.0, 2.0, 3.0), 1.0, CENTER, "outside", **e),
        "plate": swarm.Slab((1.0, 2.0, 3.0), 0.2, CENTER, "outside", **e),
        "hyperboloid": swarm.Quadric(np.diag([1.0, 1.0, -1.0]).tolist(), constant=-0.25, side="outside", **e),
        "spike": swarm.Cone(0.4, (0.0, 0.0, 1.0), CENTER, "outside", **e),
        "plane": swarm.Plane((1.0, -2.0, 0.5), 0.3, **e),
        "slab": swarm.Slab((1.0, 0.0, 0.0), 0.5, **e),
        "cone": swarm.Cone(0.5, (1.0, 2.0, 3.0), **e),
        "bowl": swarm.Paraboloid(0.25, (1.0, 2.0, 3.0), **e),
    }
    return {
        **{name: [cavity] for name, cavity in cavities.items()},
        **{name: [solid, VESSEL] for name, solid in solids.items()},
        "three walls": [swarm.Sphere(0.7, **e), swarm.Plane((0, 0, 1), 0.3, **e), swarm.Plane((0, 1, 1), 0.2, **e)],
    }


STEP = {"dt": 1e-2, "penalty": 1e3}
STEPPED = {
    "penalty": swarm.Penalty(**STEP),
    "penalty 1.5": swarm.Penalty(**STEP, exponent=1.5),
    "penalty mean-value": swarm.Penalty(**STEP, exponent=2.0, gradient="mean-value"),
    "uzawa": swarm.AugmentedLagrangian(**STEP, on_unconverged="count"),
    "verlet": swarm.Verlet(**STEP),
    "midpoint": swarm.Midpoint(**STEP),
    "trapezoidal": swarm.Trapezoidal(**STEP),
}
# Without gravity only.
ADAPTIVE = {
    "adaptive": swarm.AugmentedLagrangian(
        **STEP, adaptive=True, acceleration="reflection", on_unconverged="impact", tolerance=1e-20
    ),
    "adaptive plain": swarm.AugmentedLagrangian(**STEP, adaptive=True, on_unconverged="count"),
    "as impacts": swarm.AugmentedLagrangian(**STEP, acceleration="secant", on_unconverged="impact"),
}
# Observables that are younger than the digests.
LATER = {"sliding", "sliding_time", "wall_heat"}
FALL = (0.3, -0.2, -1.0)
# Nested solves in plain Python, where each step of the inner one is a march: minutes a run.
SLOW = {
    ("penalty mean-value", name) for name in ("torus", "ring", "capsule", "rod", "formula", "block", "drum", "spike")
}


@functools.cache
def runs():
    """Name -> (surfaces, gravity, method, particles, until)."""
    made = {}
    for fall, gravity in (("", None), (", falling", FALL)):
        for e in (1.0, 0.9):
            for name, walls in surfaces(e).items():
                made[f"impact e={e:g}, {name}{fall}"] = walls, gravity, swarm.Impact(), 30, 8.0 if e == 1.0 else 4.0
        for name, walls in surfaces().items():
            made[f"chord, {name}{fall}"] = walls, gravity, swarm.Impact(contact_step=1e-2), 10, 5.0
            for kind, method in {**STEPPED, **({} if gravity else ADAPTIVE)}.items():
                if (kind, name) not in SLOW:
                    made[f"{kind}, {name}{fall}"] = walls, gravity, method, 4, 1.0
    return made


def digest(name):
    """The SHA-256 of the end of a run and of its observables, or the sentence with which it fails."""
    walls, gravity, method, n, until = runs()[name]
    warnings.simplefilter("ignore")
    scene = swarm.Scene(walls, gravity)
    try:
        start = swarm.fill(scene, n, speed=1.0, seed=3)
        result = swarm.simulate(scene, start, method, until=until, compile="never")
    except swarm.SwarmError as error:
        return f"{type(error).__name__}: {error}"
    total = hashlib.sha256(result.particles.position.tobytes() + result.particles.velocity.tobytes())
    for key in sorted(result.observables.keys() - LATER):
        total.update(np.ascontiguousarray(result.observables[key]).tobytes())
    return total.hexdigest()


def main():
    """Write the digests, or compare with those that were written."""
    wanted = [name for name in runs() if all(word in name for word in sys.argv[1:] if word != "--write")]
    with multiprocessing.get_context("spawn").Pool() as pool:
        found = dict(zip(wanted, pool.map(digest, wanted, chunksize=1), strict=True))
    if "--write" in sys.argv:
        FILE.write_text(json.dumps(found, indent=1) + "\n")
        return
    known = json.loads(FILE.read_text())
    other = [name for name in found if found[name] != known.get(name)]
    for name in other:
        print(f"{name}: {found[name]:.80} instead of {known.get(name, 'nothing')[:80]}")
    print(f"{len(found) - len(other)} of {len(found)} runs have the same bits")
    sys.exit(1 if other else 0)


if __name__ == "__main__":
    main()
