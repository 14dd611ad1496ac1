"""What each engine supports, and the sentence that says what to use instead of what it does not.

A run has one engine, by its particles, its method and whether impacts move a wall. A capability is something that a run
may ask for: a law of a wall, a source, a period. `CAPABILITIES` has the sentence for each pair that is not
supported; every other pair is. `require_known` raises the first sentence that applies, before anything is compiled.
"""

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

from ..bodies.state import Bodies
from ..errors import SceneError
from ..methods import AugmentedLagrangian, Impact, Penalty
from ..methods.base import Method
from ..methods.fixed_step import SoftWalls
from ..particles import Particles
from ..scene import BESIDE_MASS, MOST_WALLS, Scene
from ..surfaces.drive import drive_of
from ..surfaces.facets.mesh import Mesh
from ..surfaces.fields.many import Many
from ..surfaces.laws.sticky import Sticky
from ..surfaces.outlines.outlined import Outlined
from ..surfaces.surface import Surface
from ..surfaces.wall_law import lets_wait
from .options import RunOptions

# --- Engines ---------------------------------------------------------------------------------------------

POINTS, CHORDS, MASSIVE = "points with Impact", "points with a contact_step", "points and walls with a mass"
SOFT, PAPER, BASELINE = "points with Penalty", "points with AugmentedLagrangian", "points with a baseline"
BALLS, HEAVY, GRAINS = "balls with Impact", "balls and walls with a mass", "balls with Penalty"
BODIES, SOFT_BODIES, PAPER_BODIES = "bodies with Impact", "bodies with Penalty", "bodies with AugmentedLagrangian"
# Of methods that balls or bodies do not support, and of user-defined ones, which check by themselves.
OTHER_POINTS, OTHER_BALLS, OTHER_BODIES = (f"{kind} with another method" for kind in ("points", "balls", "bodies"))

_RIGID_POINTS, _FIXED_STEPS = (POINTS, CHORDS, MASSIVE), (SOFT, PAPER, BASELINE)
_EVERY_POINT = _RIGID_POINTS + _FIXED_STEPS
_RIGID_BALLS = (BALLS, HEAVY)
_EVERY_BALL = (*_RIGID_BALLS, GRAINS)
_EVERY_BODY = (BODIES, SOFT_BODIES, PAPER_BODIES)
ENGINES = (*_EVERY_POINT, *_EVERY_BALL, *_EVERY_BODY)
_ALONE = (*_EVERY_POINT, OTHER_POINTS)


class Asked(NamedTuple):
    """A run as it is asked for, whose arguments are of the right types; no particles where all come from sources."""

    scene: Scene
    particles: Particles | Bodies | None
    method: Method
    options: RunOptions


def engine_of(asked: Asked) -> str:
    """The engine of a run: one of `ENGINES`, or that of a method which this kind of particles does not support."""
    scene, particles, method, _options = asked
    if isinstance(particles, Bodies):
        return _by_method(method, (BODIES, SOFT_BODIES, PAPER_BODIES), OTHER_BODIES)
    if particles is not None and particles.radius is not None:
        return _by_method(method, (HEAVY if scene.reacts() else BALLS, GRAINS, OTHER_BALLS), OTHER_BALLS)
    rigid = POINTS if not isinstance(method, Impact) else CHORDS if method.contact_step > 0.0 else POINTS
    soft = BASELINE if isinstance(method, SoftWalls) else OTHER_POINTS
    return _by_method(method, (MASSIVE if rigid == POINTS and scene.reacts() else rigid, SOFT, PAPER), soft)


def _by_method(method: Method, engines: tuple[str, str, str], other: str) -> str:
    kinds = zip((Impact, Penalty, AugmentedLagrangian), engines, strict=True)
    return next((engine for kind, engine in kinds if isinstance(method, kind)), other)


# --- Capabilities ----------------------------------------------------------------------------------------

# Where a run asks for a capability, in the fields that sentences name: `i` the surface, `k` its law, `got` the value.
Found = Iterator[dict[str, Any]]


def _walls(asked: Asked) -> Iterator[tuple[int, Surface]]:
    """The simple surfaces of a scene, each with the number of the surface that it is a part of."""
    return zip(asked.scene.owners_of_pieces, asked.scene.pieces, strict=True)


def _of_walls(name: str, without: Any) -> Callable[[Asked], Found]:
    """Walls whose attribute has another value than that of a wall without it."""

    def found(asked: Asked) -> Found:
        for i, wall in _walls(asked):
            if (got := getattr(wall, name)) != without:
                shown = f"{got:g}" if isinstance(got, float) else got
                yield {"i": i, "got": shown, "count": len(got) if isinstance(got, tuple) else 1}

    return found


def _option(name: str) -> Callable[[Asked], Found]:
    def found(asked: Asked) -> Found:
        if got := getattr(asked.options, name):
            yield {"got": got, "count": len(got) if isinstance(got, tuple) else 1}

    return found


def _of_scene(name: str) -> Callable[[Asked], Found]:
    def found(asked: Asked) -> Found:
        if (got := getattr(asked.scene, name)) is not None:
            yield {"got": got}

    return found


def _argument(name: str, *without: Any) -> Callable[[Asked], Found]:
    """A method whose argument has another value than these."""

    def found(asked: Asked) -> Found:
        got = getattr(asked.method, name, without[0])
        if got not in without:
            yield {"got": f"{got:g}" if isinstance(got, float) else got}

    return found


def _masses(asked: Asked) -> Found:
    for i, one in enumerate(asked.scene.surfaces):
        if one.reacts():
            name = "inertia" if one.mass is None else "mass"
            value = getattr(one, name)
            yield {"i": i, "got": one, "name": name, "value": f"{value:g}" if isinstance(value, float) else value}


def _rotations(asked: Asked) -> Found:
    for i, wall in _walls(asked):
        if wall.motion is not None and drive_of(wall, 0.0).turn is not None:
            yield {"i": i, "got": wall.motion}


def _waits(asked: Asked) -> Found:
    for i, wall in _walls(asked):
        for k, law in enumerate(wall.laws):
            if not isinstance(law, str) and lets_wait(law):
                yield {"i": i, "k": k, "got": law}


def _waits_beside_motions(asked: Asked) -> Found:
    yield from _waits(asked) if asked.scene.moves() else ()


def _sticky(asked: Asked) -> Found:
    for i, surface in enumerate(asked.scene.surfaces):
        yield from ({"i": i, "k": k, "got": law} for k, law in enumerate(surface.laws) if isinstance(law, Sticky))


def _doors(asked: Asked) -> Found:
    if asked.scene.has_doors():
        yield {}


def _rubs_that_move(asked: Asked) -> Found:
    yield from ({"i": i, "got": f"{one.friction:g}"} for i, one in _walls(asked) if one.friction > 0.0 and one.reacts())


def _losses_that_fall(asked: Asked) -> Found:
    for i, wall in _walls(asked):
        if wall.restitution < 1.0 and asked.scene.gravity is not None:
            yield {"i": i, "got": f"{wall.restitution:g}"}


def _rooms(asked: Asked) -> Found:
    """Unions of several rooms, and foams."""
    for i, surface in enumerate(asked.scene.surfaces):
        if i in asked.scene.unions() or (isinstance(surface, Many) and surface.is_foam()):
            yield {"i": i, "got": surface}


def _fields(asked: Asked) -> Found:
    yield from ({"i": i, "got": asked.scene.surfaces[i]} for i in asked.scene.fields())


def _fields_that_rest(asked: Asked) -> Found:
    scene = asked.scene
    for i in scene.order.fields if scene.moves() else ():
        yield {"i": scene.owners_of_pieces[i], "got": scene.pieces[i]}


def _faces(asked: Asked) -> Found:
    yield from ({"i": i, "got": one} for i, one in _walls(asked) if isinstance(one, (Mesh, Outlined)))


def _groups(asked: Asked) -> Found:
    for i, one in enumerate(asked.scene.surfaces):
        if isinstance(one, Mesh) and one.groups is not None:
            yield {"i": i, "got": ", ".join(one.groups)}


def _period(asked: Asked) -> Found:
    is_known = not isinstance(asked.particles, Bodies) and asked.method.knows_period()
    if asked.scene.period is not None and not is_known:
        yield {"got": asked.scene.period}


def _no_walls(asked: Asked) -> Found:
    if not asked.scene.surfaces:
        yield {}


def _duration(asked: Asked) -> Found:
    pairs = asked.scene.pairs
    if pairs is not None and pairs.contact_duration is not None:
        yield {"got": f"{pairs.contact_duration:g}"}


def _rough_pairs(asked: Asked) -> Found:
    pairs = asked.scene.pairs
    if pairs is not None and pairs.friction > 0.0:
        yield {"got": f"{pairs.friction:g}"}


def _spins(asked: Asked) -> Found:
    if isinstance(asked.particles, Particles) and asked.particles.spin is not None:
        yield {}


def _any(_asked: Asked) -> Found:
    yield {}


def _no_step(asked: Asked) -> Found:
    if getattr(asked.method, "dt", None) is None:
        yield {}


def _cuts_at_impacts(asked: Asked) -> str | None:
    """The argument of `AugmentedLagrangian` by which its steps are cut at impacts with walls at rest."""
    if getattr(asked.method, "adaptive", False):
        return "adaptive = True"
    return 'on_unconverged = "impact"' if getattr(asked.method, "on_unconverged", "") == "impact" else None


def _motions_at_impacts(asked: Asked) -> Found:
    if cut := _cuts_at_impacts(asked):
        yield from ({**one, "cut": cut} for one in _of_walls("motion", None)(asked))


def _gravity_at_impacts(asked: Asked) -> Found:
    if asked.scene.gravity is not None and (cut := _cuts_at_impacts(asked)):
        yield {"cut": cut, "got": tuple(asked.scene.gravity)}


def _members_in_fixed_steps(asked: Asked) -> Found:
    method: Any = asked.method
    is_fixed = getattr(method, "on_unconverged", "") == "impact" and not getattr(method, "adaptive", True)
    yield from _option("member_impacts")(asked) if is_fixed else ()


def _cavities(asked: Asked) -> Found:
    body = asked.particles.body if isinstance(asked.particles, Bodies) else None
    for k, (surface, _carrier, _point) in enumerate(() if body is None else body.cavities):
        yield {"k": k, "got": surface}


def _lossy_cavities(asked: Asked) -> Found:
    yield from (one for one in _cavities(asked) if one["got"].restitution != 1.0 or one["got"].friction != 0.0)


def _members_beside_cavities(asked: Asked) -> Found:
    if asked.options.member_impacts and any(_cavities(asked)):
        yield {}


def _part_of_particles(asked: Asked) -> Found:
    if asked.options.frames not in ("all", "none"):
        yield {"got": asked.options.frames}


def _on_cluster(found: Callable[[Asked], Found]) -> Callable[[Asked], Found]:
    return lambda asked: found(asked) if asked.options.cluster is not None else iter(())


def _no_trajectory(asked: Asked) -> Found:
    if asked.options.trajectory is None:
        yield {}


def _recorded(asked: Asked) -> Found:
    if asked.options.recording is not None or asked.options.live:
        yield {}


def _measured_in_part(asked: Asked) -> Found:
    options = asked.options
    if options.observables and (options.frames, options.precision) != ("all", "float64"):
        yield {"got": f"{options.frames!r} and {options.precision!r}"}


# --- The table -------------------------------------------------------------------------------------------

_TO_MOTION = "give that wall a motion instead of a mass"
_LOSES = (
    "contact_step must be 0 where a surface has a restitution below 1, friction, a temperature or a motion, got "
    "{step:g}: the contact step conserves the energy"
)
_CHANGES = (
    "contact_step must be 0 where a wall is present, or an opening open, for some times only, got {step:g}: a contact "
    "step would last while they change"
)
_SENDS = (
    "surfaces must have no temperature and no laws of their own with Penalty, got a scene with them; use restitution "
    "and friction, or Impact"
)
_IS_ABSENT = (
    "surfaces must have no openings and always be present with particles that have a radius and Penalty, got a scene "
    "with them; build the wall of parts that leave the opening, such as solid boxes"
)
_OF_POINTS = (
    "must be left out where particles have a radius, got {got!r:.100}; it is of points, which do not meet one another"
)
_SOFT_WALLS = (*_FIXED_STEPS, SOFT_BODIES, PAPER_BODIES)


def _elastic(name: str, without: str) -> str:
    return (
        f"surfaces[{{i}}].{name} must be {without} with {{method}}, which knows elastic walls only, got {{got}}; use "
        "Impact"
    )


def _of_one_room(what: str) -> str:
    return (
        f"surfaces[{{i}}] must not be a {{kind}} of several rooms with {what}, got {{got!r:.200}}; use Impact with "
        "contact_step = 0, for particles"
    )


def _alone(what: str) -> str:
    return (
        f"surfaces[{{i}}] must not be {{kind}} with {what}, got {{got}}; use Impact with contact_step = 0, or list its "
        f"bodies one by one, at most {MOST_WALLS} walls"
    )


class Capability(NamedTuple):
    """Something that a run may ask for.

    Attributes:
        name: what it is.
        found: where a run asks for it.
        refused: the sentence for each engine that does not support it. Its fields are those of `found`, the `kind` of
            what was found, the name of the `method`, the `whole` method and its contact `step`.
        is_argument: whether it is an argument of a method, which other methods do not have.
        within: the name of the capability that this is a kind of, or "".
    """

    name: str
    found: Callable[[Asked], Found]
    refused: dict[tuple[str, ...], str]
    is_argument: bool = False
    within: str = ""

    def sentence(self, engine: str) -> str | None:
        """The sentence for an engine, with its fields in braces; None if the engine supports this."""
        return next((text for engines, text in self.refused.items() if engine in engines), None)


# In the order in which they are looked for.
CAPABILITIES = (
    Capability("method", _any, {
        (OTHER_BODIES,): "bodies need the method Impact with a step, Penalty or AugmentedLagrangian, got {whole}; give "
        "Impact(dt=...) [s]",
        (OTHER_BALLS,): "radius of the particles must be None with {method}, got radii; Impact and Penalty know "
        "particles that meet",
    }, True),
    Capability("no step", _no_step, {
        (BODIES,): "bodies need the method Impact with a step, Penalty or AugmentedLagrangian, got {whole}; give "
        "Impact(dt=...) [s]",
    }, True),
    Capability("source", _option("sources"), {
        _EVERY_BODY: "sources must be left out here, particles come during a run of particles, not of bodies; use "
        "particles",
        (CHORDS, *_FIXED_STEPS, OTHER_POINTS, GRAINS): "sources must be left out here, particles come during a run "
        "with Impact() with contact_step = 0, whose flights may begin at any time, got {whole!r:.200}",
        (MASSIVE, HEAVY): "sources must be left out here, particles come during a run where impacts move no wall, got "
        "a scene with a mass or an inertia; give that wall a motion",
        (BALLS,): f"sources {_OF_POINTS}",
    }),
    Capability("log of impacts", _option("impacts"), {
        _EVERY_BODY: "impacts must be None here, a log of impacts is of particles, not of bodies, whose points meet "
        "walls together; got {got}",
        (*_FIXED_STEPS, GRAINS, OTHER_POINTS): "impacts must be None here, a log of impacts is of Impact, whose "
        "impacts have an instant, not of {method}; use Impact; got {got}",
        (MASSIVE, HEAVY): "impacts must be None here, a log of impacts is of walls that impacts do not move; give them "
        "a motion instead of a mass; got {got}",
    }),
    Capability("counter", _option("counters"), {
        _EVERY_BODY: "counters must be left out here, they are of particles, not of bodies, whose points are tied to "
        "one another; got {count}",
        _EVERY_BALL: f"counters {_OF_POINTS}",
        (*_FIXED_STEPS, OTHER_POINTS): "counters must be left out here, they are of flights by Impact, not of the "
        "steps of {method}; use Impact; got {count}",
        (CHORDS,): "counters must be left out here, they are of flights, got a contact_step of {step:g}; use Impact(); "
        "got {count}",
        (MASSIVE,): "counters must be left out here, they are of walls that impacts do not move; give them a motion "
        "instead of a mass; got {count}",
    }),
    Capability("union", _rooms, {
        _EVERY_BODY: _of_one_room("bodies"),
        (GRAINS,): _of_one_room("Penalty"),
        (*_FIXED_STEPS, OTHER_POINTS): _of_one_room("{method}"),
        (CHORDS,): _of_one_room("a contact_step"),
        (MASSIVE, HEAVY): BESIDE_MASS,
    }),
    Capability("field", _fields, {
        (SOFT_BODIES, PAPER_BODIES): _alone("bodies and soft walls"),
        (*_FIXED_STEPS, OTHER_POINTS): _alone("{method}"),
        (CHORDS,): _alone("a contact_step"),
        (MASSIVE, HEAVY): BESIDE_MASS,
    }),
    Capability("dt of Impact", _argument("dt", None), {
        (*_RIGID_POINTS, *_RIGID_BALLS): "dt of Impact is the step of bodies, got {got} for particles, which need "
        "none; leave it out",
    }, True),
    Capability("contact_step", _argument("contact_step", 0.0), {
        (BODIES,): "contact_step must be 0 with bodies, whose blows are exact, got {got}",
        _RIGID_BALLS: "contact_step must be 0 where particles have a radius, got {got}; leave it out",
    }, True),
    Capability("gradient", _argument("gradient", "composite"), {
        (SOFT_BODIES, PAPER_BODIES): 'gradient of {method} must be "composite" with bodies, got "{got}"',
        (GRAINS,): 'gradient must be "composite" where particles have a radius, got "{got}"; leave it out',
    }, True),
    Capability("acceleration", _argument("acceleration", "none"), {
        (PAPER_BODIES,): 'acceleration of {method} must be "none" with bodies, got "{got}"',
    }, True),
    Capability("contact_start", _argument("contact_start", "impact"), {
        (PAPER_BODIES,): 'contact_start of {method} must be "impact" with bodies, got "{got}"',
    }, True),
    Capability("exponent of multipliers", _argument("exponent", 1.0), {
        (PAPER_BODIES,): "exponent of AugmentedLagrangian must be 1 with bodies, got {got}: its loop has no limit for "
        "others; such walls are for Penalty",
    }, True),
    Capability("fixed steps of multipliers", _argument("adaptive", True), {
        (PAPER_BODIES,): "adaptive of AugmentedLagrangian must be True with bodies, got {got}: a loop that does not "
        "start from the wall has no limit, and its multiplier would tear the links",
    }, True),
    Capability("impacts of what did not converge", _argument("on_unconverged", "raise", "count"), {
        (PAPER_BODIES,): 'on_unconverged must be "raise" or "count" with bodies, got "{got}"; use Impact(dt=...)',
    }, True),
    Capability("period", _period, {
        (CHORDS, *_FIXED_STEPS, OTHER_POINTS): "period must be None with {whole}, whose steps do not end where a "
        "particle leaves the cell, got {got}; use Impact() with contact_step = 0",
        _EVERY_BODY: "period must be None with bodies, whose points would be torn apart by the faces, got {got}; use "
        "particles, or a vessel without a period",
        (MASSIVE, HEAVY): "surfaces[{i}].mass and inertia must be None where the scene has a period, got {got}: "
        "impacts would move its images",
    }),
    Capability("no wall", _no_walls, {
        _ALONE: "surfaces must hold at least one surface for particles without a radius, which meet nothing else, got "
        "none; give the walls, or give the particles a radius, by which they meet one another in free space",
    }, True),
    Capability("law of pairs", _of_scene("pairs"), {
        _ALONE: "pairs must be None where particles have no radius, points do not meet one another, got {got}; give "
        "the particles a radius, or leave pairs out",
        _EVERY_BODY: "pairs must be None with bodies, which do not meet one another, got {got}",
    }),
    Capability("contact duration", _duration, {
        (GRAINS,): "pairs.contact_duration must be None with Penalty, whose contacts last as long as they do, got "
        "{got} s; leave it out, or use Impact",
    }, within="law of pairs"),
    Capability("friction of pairs", _rough_pairs, {
        _RIGID_BALLS: "pairs.friction must be 0 with Impact, which has none between particles, got {got}; use Penalty, "
        "or leave it out",
    }, within="law of pairs"),
    Capability("spin", _spins, {
        _RIGID_BALLS: "spin must be None with Impact, whose impacts turn no ball, got spins; use Penalty, or set spin "
        "to None",
        _ALONE: "spin must be None without a radius, a point does not turn; give a radius too",
    }),
    Capability("plane", _of_scene("plane"), {
        _EVERY_BODY: 'plane must be None with bodies, which turn in space, got "{got}"; use particles, or leave it out',
    }),
    Capability("restitution", _of_walls("restitution", 1.0), {
        _SOFT_WALLS: _elastic("restitution", "1"),
        (CHORDS,): _LOSES,
    }),
    Capability("restitution under gravity", _losses_that_fall, {
        (MASSIVE, HEAVY): "surfaces[{i}].restitution must be 1 under gravity where a wall has a mass, got {got}: "
        "particles would come to rest on walls that move with them; leave gravity out, or give the wall a motion "
        "instead of a mass",
    }, within="restitution"),
    Capability("friction", _of_walls("friction", 0.0), {
        _SOFT_WALLS: _elastic("friction", "0"),
        (CHORDS,): _LOSES,
    }),
    Capability("friction of a wall with a mass", _rubs_that_move, {
        (MASSIVE, HEAVY): "surfaces[{i}].friction must be 0 of a wall with a mass, which is pushed along its normals, "
        "got {got}",
    }, within="friction"),
    Capability("temperature", _of_walls("temperature", None), {
        (BODIES,): "surfaces[{i}].temperature must be None with bodies, got {got}",
        _SOFT_WALLS: _elastic("temperature", "None"),
        (CHORDS,): _LOSES,
        (GRAINS,): _SENDS,
        (MASSIVE, HEAVY): "surfaces[{i}].temperature must be None where a wall has a mass, got {got}; heat the "
        "particles at the start, or give the wall a motion instead of a mass",
    }),
    Capability("law of a wall", _of_walls("laws", ()), {
        (BODIES,): "surfaces[{i}].laws must be left out with bodies, got {got}",
        _SOFT_WALLS: _elastic("laws", "()"),
        (CHORDS,): _LOSES,
        (GRAINS,): _SENDS,
        (MASSIVE, HEAVY): f"surfaces[{{i}}].laws must be left out where a wall has a mass, got {{got}}; {_TO_MOTION}",
    }),
    Capability("laws of groups of a mesh", _groups, {
        (GRAINS,): "surfaces[{i}].groups must be None with particles that have a radius and Penalty, got laws of "
        "{got}; give all of the mesh one law, make two of it, or use Impact",
    }, within="law of a wall"),
    Capability("wait beside walls that move", _waits_beside_motions, {
        (*_RIGID_POINTS, *_RIGID_BALLS): "surfaces[{i}].laws[{k}] must let nobody wait where walls move, which would "
        "carry who waits along, got {got}; leave it out, or the motions",
    }, within="law of a wall"),
    Capability("wait", _sticky, {
        _RIGID_BALLS: "surfaces[{i}].laws[{k}] must let particles that have a radius leave at once with Impact, got "
        "{got!r:.200}; leave it or the radius out",
    }, within="law of a wall"),
    Capability("mass of a wall", _masses, {
        _EVERY_BODY: "surfaces[{i}] must have no mass and no inertia with bodies, got {got}; make it a body, whose "
        "cavities= are walls that it carries",
        _FIXED_STEPS: "surfaces[{i}].{name} must be None with {method}, which knows elastic walls only, got {value}; "
        "use Impact",
        (CHORDS,): _LOSES,
        (GRAINS,): "surfaces must have no mass and no inertia with particles that have a radius and Penalty, got a "
        "scene in which impacts move one; give it a motion instead",
    }),
    Capability("opening", _of_walls("openings", ()), {
        (BODIES,): "surfaces[{i}].openings must be left out with bodies, which escape through none, got {count}; use "
        "particles, or a box with an open face",
        _SOFT_WALLS: _elastic("openings", "()"),
        (GRAINS,): _IS_ABSENT,
        (MASSIVE, HEAVY): "surfaces[{i}].openings must be left out where a wall has a mass, got {count}; "
        + _TO_MOTION,
    }),
    Capability("opening for a time", _doors, {(CHORDS,): _CHANGES, (GRAINS,): _IS_ABSENT}, within="opening"),
    Capability("present", _of_walls("present", None), {
        (BODIES,): "surfaces[{i}].present must be None with bodies, which a wall that comes would cut, got {got}; use "
        "particles, or leave it out",
        _SOFT_WALLS: _elastic("present", "None"),
        (CHORDS,): _CHANGES,
        (GRAINS,): _IS_ABSENT,
        (MASSIVE, HEAVY): f"surfaces[{{i}}].present must be None where a wall has a mass, got {{got}}; {_TO_MOTION}",
    }),
    Capability("motion", _of_walls("motion", None), {
        _EVERY_BODY: "surfaces[{i}].motion must be None with bodies, got {got}; lead a point of the body, by anchors, "
        "in the frame of the wall",
        (CHORDS,): _LOSES,
    }),
    Capability("motion at cut steps", _motions_at_impacts, {
        (PAPER,): "surfaces[{i}].motion must be None with {cut}, whose impacts are with walls at rest, got {got}; use "
        'fixed steps with on_unconverged="count", Penalty, or Impact',
    }, True),
    Capability("rotation", _rotations, {
        _FIXED_STEPS: "surfaces[{i}].motion must not turn the surface with {method}, got {got}: in the frame of a wall "
        "that turns its step has no solution in closed form; use Impact, a Translation, Oscillation or Path, or a "
        "rotation that leaves the surface as it is",
    }, within="motion"),
    Capability("motion beside a field", _fields_that_rest, {
        (GRAINS,): "surfaces must not move beside a field or a mesh with particles that have a radius and Penalty, got "
        "surfaces[{i}] ({kind}) in a scene with a motion; use Impact, or build it of single surfaces",
    }, within="motion"),
    Capability("gravity at cut steps", _gravity_at_impacts, {
        (PAPER,): "{cut} does not know gravity yet, got gravity={got}; use fixed steps with "
        'on_unconverged="count", Penalty, or gravity=None',
    }, True),
    Capability("mesh or outline", _faces, {
        _EVERY_BODY: "surfaces[{i}] must not be {kind} with bodies, got {got!r:.200}; use particles, or from_mesh with "
        "a spacing for a vessel of bodies",
    }),
    Capability("cavity with losses", _lossy_cavities, {
        (SOFT_BODIES, PAPER_BODIES): "cavities[{k}] must be elastic with {method}, got {got}; use Impact(dt=...)",
    }),
    Capability("impacts on members", _option("member_impacts"), {
        (HEAVY,): "member_impacts must be False where particles have a radius and impacts move a surface, got True; "
        "leave it out, or give that surface a motion instead of a mass",
        (GRAINS,): f"member_impacts {_OF_POINTS}",
    }),
    Capability("impacts on members beside cavities", _members_beside_cavities, {
        _EVERY_BODY: "member_impacts must be False with bodies that carry cavities, which are no surfaces of the "
        "scene, got True",
    }),
    Capability("impacts on members in fixed steps", _members_in_fixed_steps, {
        (PAPER,): 'member_impacts must be False with on_unconverged = "impact" in fixed steps, one of which may have '
        'impacts on several walls, got True; use adaptive=True, or on_unconverged = "count"',
    }, True),
    Capability("frames of some particles", _part_of_particles, {
        _EVERY_BODY: 'frames must be "all" or "none" with bodies, so that none is torn apart, got {got}',
    }),
    Capability("cluster", _option("cluster"), {_EVERY_BALL: f"cluster {_OF_POINTS}"}),
    Capability("cluster and mass of a wall", _on_cluster(_masses), {
        (MASSIVE,): "surfaces[{i}] must not react with a cluster: through a wall that has a mass or an inertia every "
        "particle depends on all others, so that they cannot be shards; give the wall a motion in place of it, or run "
        "without a cluster",
    }),
    Capability("cluster without a trajectory", _on_cluster(_no_trajectory), {
        ENGINES: "trajectory must be given with a cluster, whose shards it joins, got none; add trajectory=",
    }),
    Capability("cluster and recording", _on_cluster(_recorded), {
        ENGINES: "recording and live must be left out with a cluster; make the recording from the trajectory "
        "afterwards: swarm record RUN.h5 -o OUT.rrd",
    }),
    Capability("cluster and log of impacts", _on_cluster(_option("impacts")), {
        ENGINES: "impacts must be None with a cluster, whose shards keep no common log, got {got}; run without a "
        "cluster",
    }),
    Capability("cluster and observables of some particles", _on_cluster(_measured_in_part), {
        ENGINES: "observables need all particles with a cluster, which are read from the files of its shards: frames "
        'must be "all" and precision "float64", got {got}; or run without a cluster',
    }),
)  # fmt: skip


def sentence(engine: str, capability: str) -> str | None:
    """The sentence for an engine and a capability by its name, with its fields in braces; None if it is supported.

    >>> sentence(POINTS, "source") is None
    True
    >>> sentence(BALLS, "spin")
    'spin must be None with Impact, whose impacts turn no ball, got spins; use Penalty, or set spin to None'
    """
    one = next(one for one in CAPABILITIES if one.name == capability)
    return one.sentence(engine) or (sentence(engine, one.within) if one.within else None)


def require_known(asked: Asked) -> None:
    """Raise a `SceneError` with the first sentence that applies to a run."""
    engine, method = engine_of(asked), asked.method
    fields = {"method": type(method).__name__, "whole": method, "step": getattr(method, "contact_step", 0.0)}
    for capability in CAPABILITIES:
        text = capability.sentence(engine)
        for one in () if text is None else capability.found(asked):
            kind = type(one.get("got")).__name__
            raise SceneError(text.format(**fields, kind=kind, **one))  # type: ignore[union-attr]


def markdown() -> list[str]:
    """The table of the guide, in lines of Markdown: whether each engine supports each capability."""
    kinds = [engine for engine in ENGINES if engine != BASELINE]
    rows = [("", *kinds), ("---",) * (1 + len(kinds))]
    shown = (one for one in CAPABILITIES if not one.is_argument)
    rows += [(one.name, *("no" if sentence(engine, one.name) else "yes" for engine in kinds)) for one in shown]
    return [f"| {' | '.join(row)} |" for row in rows]
