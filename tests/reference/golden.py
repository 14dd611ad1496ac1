"""Golden runs: the last bits of short runs of every method in every kind of surface, as digests.

    python tests/reference/golden.py           compares with golden.json, and names what differs
    python tests/reference/golden.py --write   writes golden.json
    python tests/reference/golden.py falling   compares the runs whose names have this word
    python tests/reference/golden.py --threads compares compiled runs of one thread, of two, and golden.json

golden.json was written by commit ff6ef0a, before the kernels were rebuilt in vectors. The 46 runs of "rotated
ellipsoid" and "box" were written again when the product of their frames left BLAS, whose last bit depends on the
processor; what that bit changes by their ends is 1e-13, and 1e-8 where Uzawa's loop does not converge. 49 runs of
tori, and of capsules and the drum that fall or slide, were written again when steps in lanes took the place of
marches. Ten chords in walls whose steps are found by Newton's method were written again when a last step took them to
round-off: 1.5e-13 at their ends.
Eleven cells of points and walls with a mass were written again when a strike restored its energy as that of a ball
does, `with_energy`: 1e-16 of the scene at their ends; the energy of 186 464 impacts is 8e-16 off, 1.2e-15 before.
Seven runs of formulas of degree 4 or less were written again when straight flights to them took the coefficients of a
polynomial: places of impact are within 4 roundings of 50 digits. Nine were written again when steps of Halley's method
led to these roots: within 4 roundings as before.
Two cells of walls on a path were written again when the bound of the speed of a path came from its control points:
1e-15 and 4e-14 at their ends.
Seven cells of balls at a formula, a user-defined surface, a paraboloid, a quadric and samples were written again when
Newton's method for the time and the foot at once took the place of safe steps: the same impacts, to round-off. So were
six of balls at such walls beside walls with a mass. All cells of grains were written again when contacts of pairs
were improved eight at once, from the last step's change: 1.4e-10 at their ends, which is what friction is solved to.
One cell of `AugmentedLagrangian` in an intersection that swings was written again when safe steps in a convex cavity
took the steepest place of its wall for a bound of |grad q|: 4e-12 at its end. One of samples beside a
wall that moves was written again when first hits were guessed and proven, aim.py: 2e-16 at its end.
Five cells of grains were written again when a contact's changes became relative to what moved there as its step began,
and 1/(R_i + R_j) a number of the contact: 1e-12 at their ends, for sweeps end one earlier or later.
One cell of `AugmentedLagrangian` in a sphere that turns was written again when its centre swings along a circle
instead: another step of second order, 2e-6 at its end.
Five runs of a formula of degree 4 that is convex were written again when guesses of its roots began where the level
along a flight bends the other way: the same hits, to round-off, 6e-13 at their ends.
The cell of grains where pairs rub was written again when twists were summed as contacts begin: 1e-4 at its end, which
is what friction is solved to. That end is 2.5e-5 from one with friction solved to 1e-9, and was 8.8e-5 from it.
One cell of points, `Penalty` and planes that turn was written again when what a wall carries its points by took
Cayley's form, turned.py: nothing at its end, the last bits of its work.
Twelve cells of a user-defined surface were written again when straight flights to it looked from both sides: hits to
round-off.
One of samples beside a wall that moves was written again when most flights to walls that swing were proven by where
they pass, not by series: 1e-15 at its end; and again when the sine of a contact became that of its proof, a little
later: 8e-16 at its end.
Two cells of soft walls that swing, `Penalty` at a cylinder and `AugmentedLagrangian` in an intersection, were written
again when free steps were jumped over at once: 9e-15 and 1e-11 at their ends, as loops there do not converge.
Nine runs of a formula of degree 4 that falls were written again when the level along a fall took the coefficients of a
polynomial of degree 8, its first root a guess and a proof: hits to round-off, 8e-12 at their ends.
Two cells of balls in a union were written again when flights took longer steps and no bisection of round-off: 4e-16 at
their ends; and again when corners that two rooms have in common were no edges any more; and again when walls that two
rooms have in one place became one wall: the same ends by the bits, and a number fewer for each of these walls.
Seven cells of grains were written again when changes of impulses became relative to how fast two meet, not to how fast
both go: 2e-12 at the ends that are here, for sweeps end one later.
Three cells of grains where pairs rub, or a ball that spins, were written again when friction was swept until its
changes are 2e-2, with 2e-3 for contacts that leave others as they are, not 1e-2 and 3e-3: 5e-9 at the end that is here.
Two cells of balls in a union were written again when flights within one room took one look at its end: the same ends by
the bits, and one number more for each wall of a room. So was one of balls in a mesh that swings when its triangles were
met by steps to planes: the same impacts, 2e-15 at its end.
One cell of bodies was written again when the sums of their energies left BLAS: the same end by the bits, and the same
bits of energies on each processor.
Two cells of balls without a spin at walls with an inertia were written again when friction took the velocity of a wall
where they touch: 6e-16 at their ends. Five cells of grains were written again when the change of a gap at a flat wall
became that along its normal: 4e-16 at their ends.
Three cells of grains with friction were written again when few contacts were solved for friction to round-off: 9e-9 at
the end that is here, which is what it was solved to.
Eleven cells of walls that move, or turn by their inertia, were written again when contacts took the speeds of particle
and wall along the normal, and the acceleration of a turning frame one cross product: 1e-15 at their ends.
Two cells of sources of bodies were written again when centres of mass left BLAS: 1e-13 at their ends.
34 runs of soft walls that meet in edges were written again when each contact of a particle with one wall counted as an
impact, not only the first of those that overlap: the same ends by the bits, and the same observables but for "impacts".
So was the cell of `Penalty` in a box with a log, and that with a temperature, where contacts that overlap no longer
share a random number: two of them were one draw.
Three runs of `Midpoint` that fall into edges were written again when a contact that begins where a step ends counted
also while another wall is touched: the same ends by the bits, and the same observables but for "impacts".

The runs "cell: ..." are those of cells of `bench.cells` that work, one kind of wall for each engine and capability, and
their digests are of the final state, the observables and the datasets of the trajectory, but for dates, versions,
checksums, and what the machine is. Each is "exact", if its arithmetic is + - * / and the square root alone, or "libm":
then golden.json has its end too, and where `libm` is another one it is compared to 1e-9. The machine "each its own"
stands with a run that has other last bits on another processor though its arithmetic is exact.

The kernels give the same bits compiled and in plain Python; plain Python runs these runs without as many
compilations. Still each step costs a thousand times its compiled time, so the runs are as short as they can be and meet
every branch: some ten impacts of 30 particles with `Impact`, one or two of four particles with a fixed step.
"""

import argparse
import functools
import hashlib
import json
import math
import multiprocessing
import sys
import tempfile
import warnings
from pathlib import Path
from unittest import mock

import h5py
import numpy as np

import swarm

sys.path.insert(0, str(Path(__file__).parents[2]))
from bench import cells, outcomes
from bench.cells import Cell

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


def digest(name, **options):
    """The SHA-256 of the end of a run and of its observables, or the sentence with which it fails."""
    walls, gravity, method, n, until = runs()[name]
    warnings.simplefilter("ignore")
    scene = swarm.Scene(walls, gravity)
    try:
        start = swarm.fill(scene, n, speed=1.0, seed=3)
        result = swarm.simulate(scene, start, method, until=until, **{"compile": "never", **options})
    except swarm.SwarmError as error:
        return f"{type(error).__name__}: {error}"
    total = hashlib.sha256(result.particles.position.tobytes() + result.particles.velocity.tobytes())
    for key in sorted(result.observables.keys() - LATER):
        total.update(np.ascontiguousarray(result.observables[key]).tobytes())
    return total.hexdigest()


# --- Cells -----------------------------------------------------------------------------------------------

# Of the datasets of a file: what differs from one run of the same bits to another.
APART = ("parameters/checksums", "parameters/wall_time", "parameters/threads", "frames")
# What is not rounded correctly: its last bit depends on the library of the machine.
_BOTH = (
    *("sin", "cos", "tan", "sinh", "cosh", "tanh"),
    *("exp", "exp2", "expm1", "log", "log1p", "log2", "log10", "cbrt", "hypot"),
)
INEXACT = (*_BOTH, "asin", "acos", "atan", "atan2", "asinh", "acosh", "atanh", "pow", "dist", "erf", "erfc", "gamma")
OF_NUMPY = (*_BOTH, "arcsin", "arccos", "arctan", "arctan2", "arcsinh", "arccosh", "arctanh", "power", "float_power")
NEAR = 1e-9


def libm():
    """A digest of the functions of this machine that are not rounded correctly."""
    x = np.linspace(0.01, 0.99, 4001)
    total = hashlib.sha256()
    for name in OF_NUMPY:
        function = getattr(np, name)
        given = (x, 1.5 - x) if function.nin == 2 else (x + (name == "arccosh"),)
        total.update(function(*given).tobytes())
    for name in ["sin", "cos", "tan", "asin", "acos", "atan", "exp", "expm1", "log", "log1p", "cbrt"]:
        total.update(np.array([getattr(math, name)(one) for one in x.tolist()]).tobytes())
    return total.hexdigest()[:12]


def cell_of(name):
    """The cell of a run "cell: engine / wall / capability"."""
    return Cell(*name.removeprefix("cell: ").split(" / "))


def cell_names():
    """The golden cells: for each engine and capability a wall with which it works, each in its turn."""
    from pairs import KNOWN

    made, walls = [], cells.SHAPES
    for e, engine in enumerate(cells.ENGINES):
        for c, capability in enumerate(cells.CAPABILITIES):
            first = 5 * e + 3 * c
            turn = [*walls[first % len(walls) :], *walls[: first % len(walls)]]
            fits = [wall for wall in turn if KNOWN.get(str(Cell(engine, wall, capability))) == "works"]
            # What bodies know is so little that each has two.
            some = fits[: 2 if engine == "bodies, Impact" else 1]
            made += [f"cell: {Cell(engine, wall, capability)}" for wall in some]
    return made


def run_cell(name, **options):
    """The digest of a run and its end."""
    draft = cells.draft_of(cell_of(name))
    draft.options.update(options)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.h5"
        result = outcomes.run(draft, str(path)).result
        total = hashlib.sha256()
        for key in ("position", "velocity", "mass", "radius", "spin", "image"):
            _add(total, key, getattr(result.particles, key))
        for key in ("impacts_per_particle", "escape_time", "absorbed_time", "birth_time", "collisions_per_particle"):
            _add(total, key, getattr(result, key))
        for key in sorted(result.observables):
            _add(total, key, result.observables[key])
        with h5py.File(path) as file:
            file.visititems(lambda key, one: _add_dataset(total, key, one))
    ends = [result.particles.position, result.particles.velocity, result.observables["kinetic_energy"][-1:]]
    return total.hexdigest(), [float(x) for one in ends for x in np.ravel(one)]


def _add_dataset(total, key, one):
    if isinstance(one, h5py.Dataset) and not key.startswith(APART):
        _add(total, key, one[()] if one.dtype.kind != "O" else np.array(one.asstr()[()], dtype="U"))


def _add(total, key, values):
    total.update(key.encode())
    if values is not None:
        whole = np.ascontiguousarray(values)
        total.update(f"{whole.shape}{whole.dtype}".encode() + whole.tobytes())


def marked(name):
    """What golden.json has of a cell."""
    # First as it is, for Numba looks for the functions of `math` when it compiles for the first time.
    found, end = run_cell(name)
    of_math = {one: _perturbed(getattr(math, one), math.nextafter) for one in INEXACT if hasattr(math, one)}
    of_numpy = {one: _perturbed(getattr(np, one), np.nextafter) for one in OF_NUMPY}
    with mock.patch.multiple(math, **of_math), mock.patch.multiple(np, **of_numpy):
        other = run_cell(name)[0]
    return {"libm": found, "end": end} if other != found else {"exact": found}


def _perturbed(function, nextafter):
    """A function whose last bit is another one."""

    def call(*given, **keywords):
        return nextafter(function(*given, **keywords), math.inf)

    return call


def disagreement(name, known):
    """What is not as golden.json says of a cell, or ""."""
    found, end = run_cell(name)
    if found in known.values():
        return ""
    if "end" in known and known["machine"] != libm():
        off = float(np.max(np.abs(np.subtract(end, known["end"])) / (1.0 + np.abs(known["end"]))))
        return "" if off <= NEAR else f"{name}: the end is off by {off:.2g}"
    return f"{name}: {found} instead of {known}"


# One particle a block, so that each of two threads has blocks of four particles.
ONE_THREAD = {"compile": "always", "threads": 1, "block_size": 1}
TWO_THREADS = ONE_THREAD | {"threads": 2}


def is_compiled(name):
    """Whether a run may be compiled: one in shards of single particles changes a constant of kernels."""
    return not name.startswith("cell: ") or "cluster" not in cells.draft_of(cell_of(name)).options


def disagreement_of_threads(name, known):
    """How the bits of compiled runs of one thread, of two, and of golden.json differ, or ""."""
    if name.startswith("cell: "):
        one, two = (run_cell(name, **options)[0] for options in (ONE_THREAD, TWO_THREADS))
        known = known["libm" if "end" in known else "exact"] if known.get("machine", libm()) == libm() else one
    else:
        one, two = (digest(name, **options) for options in (ONE_THREAD, TWO_THREADS))
    differing = "" if one == two else f"{name}: {one:.80} with one thread, {two:.80} with two"
    return differing or ("" if one == known else f"{name}: {one:.80} compiled, {known:.80} in plain Python")


def main():
    """Write the digests, or compare with those that were written."""
    parser = argparse.ArgumentParser(description="Golden runs: the last bits of short runs, as digests.")
    parser.add_argument("words", nargs="*", help="only the runs whose names have all these words")
    parser.add_argument("--write", action="store_true", help="write golden.json instead of comparing with it")
    parser.add_argument("--threads", action="store_true", help="compare compiled runs of one thread and of two with it")
    given = parser.parse_args()
    words = given.words
    known = json.loads(FILE.read_text())
    wanted = [name for name in [*runs(), *cell_names()] if all(word in name for word in words)]
    if not wanted:
        parser.error(f"no run has all these words in its name: {' '.join(words)}")
    if given.threads:
        wanted = [name for name in wanted if is_compiled(name)]
    job = _written if given.write else disagreement_of_threads if given.threads else _compared
    with multiprocessing.get_context("spawn").Pool() as pool:
        found = dict(zip(wanted, pool.starmap(job, [(one, known.get(one)) for one in wanted], 1), strict=True))
    if given.write:
        kept = known if words else {}
        FILE.write_text(
            "{\n" + ",\n".join(f" {json.dumps(k)}: {json.dumps(v)}" for k, v in (kept | found).items()) + "\n}\n"
        )
        return
    other = [difference for difference in found.values() if difference]
    print("\n".join([*other, f"{len(found) - len(other)} of {len(found)} runs are as they were"]))
    sys.exit(1 if other else 0)


def _written(name, _known):
    if not name.startswith("cell: "):
        return digest(name)
    made = marked(name)
    return made | {"machine": libm()} if "end" in made else made


def _compared(name, known):
    if known is None:
        return f"{name}: golden.json has nothing of it"
    if name.startswith("cell: "):
        return disagreement(name, known)
    found = digest(name)
    return "" if found == known else f"{name}: {found:.80} instead of {known[:80]}"


if __name__ == "__main__":
    main()
