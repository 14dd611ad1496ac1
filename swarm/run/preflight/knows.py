"""The capabilities of each engine, and the sentences of the errors for capabilities that it does not support.

The particles of a run, its method, and whether impacts move a wall determine its engine. A capability is a property
that a run may have: a law of a wall, a source, a period. `CAPABILITIES` has a `Refusal` for each pair of an engine
and a capability that is not supported; all other pairs are supported. `require_supported` raises the first refusal
that applies to a run, before anything is compiled.
"""

import functools
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

from ...compiled_scene import MOST_WALLS
from ...errors import SceneError
from ...methods import Impact
from ...methods.base import Method
from ...particles import Particles, TiedParticles
from ...scene import Scene
from ...surfaces.in_motion.drive import drive_of
from ...surfaces.periodic.images import MASS_AND_PERIOD, WITHOUT_PERIOD
from ...surfaces.pieces import differing_in
from ...surfaces.wall_law import lets_wait
from ..options import RunOptions

# --- Engines ---------------------------------------------------------------------------------------------

POINTS, CHORDS, MASSIVE = "points with Impact", "points with a contact_step", "points and walls with a mass"
SOFT, PAPER, BASELINE = "points with Penalty", "points with AugmentedLagrangian", "points with a baseline"
BALLS, HEAVY, GRAINS = "balls with Impact", "balls and walls with a mass", "balls with Penalty"
BODIES, SOFT_BODIES, PAPER_BODIES = "bodies with Impact", "bodies with Penalty", "bodies with AugmentedLagrangian"
# Balls and bodies with a method that they do not support; points with a user-defined method, which has its own checks.
OTHER_POINTS, OTHER_BALLS, OTHER_BODIES = (f"{kind} with another method" for kind in ("points", "balls", "bodies"))

_RIGID_POINTS, _FIXED_STEPS = (POINTS, CHORDS, MASSIVE), (SOFT, PAPER, BASELINE)
_EVERY_POINT = _RIGID_POINTS + _FIXED_STEPS
_RIGID_BALLS = (BALLS, HEAVY)
_EVERY_BALL = (*_RIGID_BALLS, GRAINS)
_EVERY_BODY = (BODIES, SOFT_BODIES, PAPER_BODIES)
ENGINES = (*_EVERY_POINT, *_EVERY_BALL, *_EVERY_BODY)
_ALONE = (*_EVERY_POINT, OTHER_POINTS)


class Asked(NamedTuple):
    """The arguments of a run, with the right types; `particles` is None if all come from sources."""

    scene: Scene
    particles: Particles | TiedParticles | None
    method: Method
    options: RunOptions


def engine_of(asked: Asked) -> str:
    """Return the engine of a run: one of `ENGINES`, or `OTHER_POINTS`, `OTHER_BALLS` or `OTHER_BODIES`."""
    scene, particles, method, options = asked
    if isinstance(particles, TiedParticles):
        return _by_method(method, (BODIES, SOFT_BODIES, PAPER_BODIES), OTHER_BODIES)
    sizes = [one.radius for one in (options.sources or () if particles is None else [particles])]
    if sizes and sizes[0] is not None:
        return _by_method(method, (HEAVY if scene.reacts() else BALLS, GRAINS, OTHER_BALLS), OTHER_BALLS)
    if isinstance(method, Impact):
        return CHORDS if method.contact_step > 0.0 else MASSIVE if scene.reacts() else POINTS
    from ...methods.fixed_step import SoftWalls

    return _by_method(method, (POINTS, SOFT, PAPER), BASELINE if isinstance(method, SoftWalls) else OTHER_POINTS)


def _by_method(method: Method, engines: tuple[str, str, str], other: str) -> str:
    if isinstance(method, Impact):
        return engines[0]
    from ...methods import AugmentedLagrangian, Penalty  # loaded only if used

    kinds = zip((Penalty, AugmentedLagrangian), engines[1:], strict=True)
    return next((engine for kind, engine in kinds if isinstance(method, kind)), other)


# --- Capabilities ----------------------------------------------------------------------------------------

# The places where a run needs a capability, as fields of its sentence: `i` the surface, `k` its law, `got` the value.
Found = Iterator[dict[str, Any]]


def _of_walls(name: str, without: Any) -> Callable[[Asked], Found]:
    """Return a function that finds the walls with another value of an attribute than `without`."""

    def found(asked: Asked) -> Found:
        for i, wall in asked.scene.pieces.owned():
            if (got := getattr(wall, name)) != without:
                yield {"i": i, **_shown(got)}

    return found


def _given(path: str, *without: Any) -> Callable[[Asked], Found]:
    """Return a function that finds another value than these at a path of attributes; a missing one has the first."""
    without = without or (None, False, ())

    def found(asked: Asked) -> Found:
        got = functools.reduce(lambda part, name: getattr(part, name, without[0]), path.split("."), asked)
        if got not in without:
            yield _shown(got)

    return found


def _shown(got: Any) -> dict[str, Any]:
    """Return a value, and the number of its entries, as fields of a sentence."""
    return {"got": f"{got:g}" if isinstance(got, float) else got, "count": len(got) if isinstance(got, tuple) else 1}


def _where(
    holds: Callable[[Asked], Any], found: Callable[[Asked], Found] = lambda asked: iter([{}])
) -> Callable[[Asked], Found]:
    """Return a function with the results of `found` in a run for which a condition holds, else without results."""
    return lambda asked: found(asked) if holds(asked) else iter(())


def _masses(asked: Asked) -> Found:
    for i, one in enumerate(asked.scene.surfaces):
        if one.reacts():
            name = "inertia" if one.mass is None else "mass"
            value = getattr(one, name)
            yield {"i": i, "got": one, "name": name, "value": f"{value:g}" if isinstance(value, float) else value}


def _heavy_laws(asked: Asked) -> Found:
    for i, wall in asked.scene.pieces.owned():
        if asked.scene.surfaces[i].reacts() and (wall.laws or wall.temperature is not None):
            yield {"i": i, "got": wall}


def _rotations(asked: Asked) -> Found:
    for i, wall in asked.scene.pieces.owned():
        if wall.motion is not None and drive_of(wall, 0.0).turn is not None:
            yield {"i": i, "got": wall.motion}


def _waits(asked: Asked) -> Found:
    for i, wall in asked.scene.pieces.owned():
        for k, law in enumerate(wall.laws):
            if not isinstance(law, str) and lets_wait(law):
                yield {"i": i, "k": k, "got": law}


def _waits_beside_motions(asked: Asked) -> Found:
    scene = asked.scene
    if any(piece.motion is not None and not scene.surfaces[i].reacts() for i, piece in scene.pieces.owned()):
        yield from _waits(asked)
    else:
        yield from (one for one in _waits(asked) if scene.surfaces[one["i"]].reacts())


def _losses_under_gravity(asked: Asked) -> Found:
    for i, wall in asked.scene.pieces.owned():
        if wall.restitution < 1.0 and asked.scene.gravity is not None:
            yield {"i": i, "got": f"{wall.restitution:g}"}


def _rooms(asked: Asked) -> Found:
    """Yield unions of several rooms, and foams."""
    for i, surface in enumerate(asked.scene.surfaces):
        if i in asked.scene.compiled().unions() or surface.is_foam():
            yield {"i": i, "got": surface}


def _unions(asked: Asked) -> Found:
    yield from ({"i": i, "got": asked.scene.surfaces[i]} for i in asked.scene.compiled().unions())


def _takes_rooms(asked: Asked) -> bool:
    """Whether the steps of a method are cut at impacts, so that each step is in one room."""
    return bool(getattr(asked.method, "adaptive", False))


def _rooms_that_touch(asked: Asked) -> Found:
    if not _takes_rooms(asked) and any(_unions(asked)) and asked.scene.compiled().walls().inset is not None:
        yield from _unions(asked)


def _rooms_that_differ(asked: Asked) -> Found:
    for one in () if _takes_rooms(asked) else _unions(asked):
        if (what := differing_in(one["got"])) is not None:
            yield {**one, "name": what}


def _heavy_rooms(asked: Asked) -> Found:
    for one in _rooms(asked):
        if (surface := one["got"]).reacts():
            yield {**one, "name": "inertia" if surface.mass is None else "mass"}


def _unions_beside_guides(asked: Asked) -> Found:
    body = asked.particles.body if isinstance(asked.particles, TiedParticles) else None
    if body is not None and (body.guides or body.cavities):
        yield from _unions(asked)


def _fields(asked: Asked) -> Found:
    yield from ({"i": i, "got": asked.scene.surfaces[i]} for i in asked.scene.compiled().fields())


def _sheets(asked: Asked) -> Found:
    yield from (one for one in _faces(asked) if getattr(one["got"], "open", False))


def _faces(asked: Asked) -> Found:
    yield from ({"i": i, "got": one} for i, one in asked.scene.pieces.owned() if one.face_noun)


def _groups(asked: Asked) -> Found:
    for i, one in enumerate(asked.scene.surfaces):
        if one.groups is not None:
            yield {"i": i, "got": ", ".join(one.groups)}


def _lossy_groups(asked: Asked) -> Found:
    for i, one in enumerate(asked.scene.surfaces):
        groups: dict[str, dict[str, Any]] = one.groups or {}
        names = [name for name, given in groups.items() if given.keys() & {"restitution", "friction", "rolling"}]
        if names:
            yield {"i": i, "got": f"those of {', '.join(names)}"}


def _period(asked: Asked) -> Found:
    is_soft = isinstance(asked.particles, TiedParticles) and not isinstance(asked.method, Impact)
    if asked.scene.period is None:
        return
    if is_soft or not asked.method.supports_period():
        yield {"got": asked.scene.period}
    elif isinstance(asked.method, Impact):
        yield from ({"i": i, "got": one} for i, one in enumerate(asked.scene.surfaces) if one.reacts())


def _cuts_at_impacts(asked: Asked) -> str | None:
    """Return the argument of `AugmentedLagrangian` that cuts its steps at impacts on walls at rest, or None."""
    if _takes_rooms(asked):
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
    yield from _given("options.member_impacts")(asked) if is_fixed else ()


def _cavities(asked: Asked) -> Found:
    body = asked.particles.body if isinstance(asked.particles, TiedParticles) else None
    for k, (surface, _carrier, _point) in enumerate(() if body is None else body.cavities):
        yield {"k": k, "got": surface}


def _lossy_cavities(asked: Asked) -> Found:
    yield from (one for one in _cavities(asked) if one["got"].restitution != 1.0 or one["got"].friction != 0.0)


def _on_cluster(found: Callable[[Asked], Found]) -> Callable[[Asked], Found]:
    return _where(lambda asked: asked.options.cluster is not None, found)


def _recorded(asked: Asked) -> Found:
    options = asked.options
    if options.recording is not None or options.live:
        yield {"got": f"live={options.live!r:.50}" if options.live else f"recording={str(options.recording)!r:.200}"}


def _measured_in_part(asked: Asked) -> Found:
    options = asked.options
    if options.observables and (options.frames, options.precision) != ("all", "float64"):
        yield {"got": f"{options.frames!r} and {options.precision!r}"}


# --- The table -------------------------------------------------------------------------------------------


class Refusal(NamedTuple):
    """The error of an engine for a capability that it does not support: the problem, and the remedy."""

    problem: str
    remedy: str

    def sentence(self) -> str:
        """Return the sentence of the error, with its fields in braces."""
        return f"{self.problem}; {self.remedy}"


_TO_MOTION = "give that wall a motion instead of a mass"
_TO_EXACT = "use Impact() with contact_step = 0"
_TO_ROOMS = "use Impact, or AugmentedLagrangian with adaptive=True"
_NO_STEP = "leave contact_step out"
_WITH_PENALTY = "particles that have a radius and Penalty"
_WITH_IMPACT = "particles that have a radius and Impact"
_AT_AN_INSTANT = "Impact: balls that meet at an instant do not roll on one another"
_ONE_LAW = "give the whole mesh one law, or use Impact"
_NO_METHOD = Refusal(
    "bodies need the method Impact with a step, Penalty or AugmentedLagrangian, got {whole}",
    "use Impact(dt=...), with dt in seconds",
)
_LOSES = Refusal(
    "contact_step must be 0 where a surface has a restitution below 1, friction, a temperature, laws, a motion or a "
    "mass, got {step:g}: a contact step conserves the energy",
    _NO_STEP,
)
_CHANGES = Refusal(
    "contact_step must be 0 where a wall is present, or an opening open, for some times only, got {step:g}", _NO_STEP
)


_WAITS_FOR_A_MASS = Refusal(
    "surfaces[{i}].laws[{k}] must not let particles with a radius wait where a wall has a mass, got {got!r:.200}: the "
    "wall may come to where they wait",
    "use a law without a wait, such as Lambert, or leave the mass out",
)


def _with_method(name: str, without: str, got: str = "got") -> Refusal:
    """Return the error for a property of a wall that a method of fixed steps does not support."""
    return Refusal(f"surfaces[{{i}}].{name} must be {without} with {{method}}, got {{{got}}}", "use Impact")


def _with_bodies(name: str, without: str, remedy: str = "use particles") -> Refusal:
    return Refusal(f"surfaces[{{i}}].{name} must be {without} with bodies, got {{got}}", remedy)


def _without_rolling(name: str, with_what: str) -> Refusal:
    remedy = "leave it out, or use particles with a radius and Penalty"
    return Refusal(f"{name} must be 0 with {with_what}, got {{got}}", remedy)


def _of_one_room(what: str, remedy: str) -> Refusal:
    return Refusal(f"surfaces[{{i}}] must not be a {{kind}} of several rooms with {what}, got {{got!r:.200}}", remedy)


def _listed(what: str, remedy: str) -> Refusal:
    return Refusal(
        f"surfaces[{{i}}] must not be {{kind}} with {what}, got {{got}}",
        f"{remedy}, or list its solids one by one, at most {MOST_WALLS} walls in all",
    )


class Capability(NamedTuple):
    """A property that a run may have.

    Attributes:
        name: its name in the table of the guide.
        found: a function that yields the places where a run needs it.
        refused: engines that do not support it -> the error. The fields in braces are those of `found`, the `kind` (the
            class) of its `got`, the name of the `method`, the `whole` method, and its `contact_step` as `step`.
        is_argument: whether it is about an argument of a method, and so no row of the table.
        within: the name of the capability of which this is a special case, or "".
    """

    name: str
    found: Callable[[Asked], Found]
    refused: dict[tuple[str, ...], Refusal]
    is_argument: bool = False
    within: str = ""

    def sentence(self, engine: str) -> str | None:
        """Return the sentence of the error for an engine, with fields in braces; None if the engine supports this."""
        return next((one.sentence() for engines, one in self.refused.items() if engine in engines), None)


# The first refusal that applies is the error of a run.
CAPABILITIES = (
    Capability("method", _where(lambda asked: True), {
        (OTHER_BODIES,): _NO_METHOD,
        (OTHER_BALLS,): Refusal(
            "radius of the particles must be None with {method}, got radii", "use Impact or Penalty"
        ),
    }, True),
    Capability("no step", _where(lambda asked: getattr(asked.method, "dt", None) is None), {
        (BODIES,): _NO_METHOD,
    }, True),
    Capability("source", _given("options.sources"), {
        (SOFT_BODIES, PAPER_BODIES): Refusal(
            "sources must be left out with bodies and {method}, got {count}: a body is born at any time, not at the "
            "end of a step", "use Impact(dt=...)",
        ),
        (CHORDS, OTHER_POINTS): Refusal(
            "sources must be left out with {whole!r:.200}, got {count}: particles are born at any time, not at the end "
            "of a step", _TO_EXACT,
        ),
    }),
    Capability("log of impacts", _given("options.impacts"), {
        (SOFT_BODIES, PAPER_BODIES, BASELINE, OTHER_POINTS): Refusal(
            "impacts must be None with {method}, got {got}: its contacts last for a time", "use Impact"
        ),
    }),
    Capability("counter", _given("options.counters"), {
        (OTHER_POINTS,): Refusal(
            "counters must be left out with {method}, got {count}: a counter follows flights, not steps", "use Impact()"
        ),
        (CHORDS,): Refusal("counters must be left out with a contact_step of {step:g}, got {count}", _NO_STEP),
    }),
    Capability("union", _rooms, {
        (SOFT_BODIES, PAPER_BODIES): _of_one_room("bodies and soft walls", "use Impact(dt=...)"),
        (BASELINE, OTHER_POINTS): _of_one_room("{method}", _TO_EXACT),
    }),
    Capability("union with walls between its rooms", _rooms_that_touch, {
        (BODIES,): Refusal(
            "surfaces[{i}] must not have rooms that touch at a wall between them with bodies, got {got!r:.200}: a step "
            "that ends in the next room would not be seen to have passed it",
            "leave a space between the rooms, let them overlap, or use particles and Impact()",
        ),
        (SOFT, PAPER): Refusal(
            "surfaces[{i}] must not have rooms that touch at a wall between them with {method}, got {got!r:.200}: a "
            "soft wall without a thickness holds no point",
            f"leave a space between the rooms, let them overlap, or {_TO_ROOMS}",
        ),
        (BALLS, HEAVY, GRAINS): Refusal(
            "surfaces[{i}] must not have rooms that touch at a wall between them where particles have a radius, got "
            "{got!r:.200}: the path of a centre around the edge of a wall of no thickness is not supported",
            "make the rooms overlap, or leave the radius out",
        ),
    }, within="union"),
    Capability("union of parts that differ", _rooms_that_differ, {
        (SOFT, PAPER): Refusal(
            "surfaces[{i}] must have the same {name} in all of its parts with {method}, got {got!r:.200}: its walls "
            "are one spring", f"give the {{name}} to the whole, or {_TO_ROOMS}",
        ),
    }, within="union"),
    Capability("union beside guides and cavities", _unions_beside_guides, {
        (BODIES,): Refusal(
            "surfaces[{i}] must not be a {kind} of several rooms with a body that has guides or cavities, got "
            "{got!r:.200}", "use a body without them",
        ),
    }, within="union"),
    Capability("union in a cell that repeats", _where(lambda asked: asked.scene.period, _rooms), {
        (GRAINS,): _of_one_room(f"{_WITH_PENALTY} and a period", "leave the period out, or use one room"),
        (BALLS,): _of_one_room(f"{_WITH_IMPACT} and a period", "leave the period out, or use one room"),
    }, within="union"),
    Capability("union in a plane", _where(lambda asked: asked.scene.plane, _rooms), {
        (GRAINS,): _of_one_room(f"{_WITH_PENALTY} and a plane", "leave the plane out, or use one room"),
    }, within="union"),
    Capability("field", _fields, {
        (SOFT_BODIES, PAPER_BODIES): _listed("bodies and soft walls", "use Impact(dt=...)"),
        (BASELINE, OTHER_POINTS): _listed("{method}", _TO_EXACT),
    }),
    Capability("many walls as one in fixed steps beside motions", _where(
        lambda asked: asked.scene.moves() and not _takes_rooms(asked), _fields
    ), {
        (PAPER,): Refusal(
            "surfaces[{i}] must not be {kind} with adaptive = False where walls move, got {got!r:.200}: loops that do "
            "not converge take too long there", "use Penalty or Impact",
        ),
    }, True, within="motion"),
    Capability("dt of Impact", _given("method.dt", None), {
        (*_RIGID_POINTS, *_RIGID_BALLS): Refusal(
            "dt of Impact must be left out with particles, got {got}: it is the step of bodies", "leave it out"
        ),
    }, True),
    Capability("contact_step", _given("method.contact_step", 0.0), {
        (BODIES,): Refusal("contact_step must be 0 with bodies, got {got}: their impacts are exact", "leave it out"),
        _RIGID_BALLS: Refusal(
            "contact_step must be 0 where particles have a radius, got {got}: an impact of hard balls takes no time",
            "leave it out",
        ),
    }, True),
    Capability("gradient", _given("method.gradient", "composite"), {
        (SOFT_BODIES, PAPER_BODIES): Refusal(
            'gradient of {method} must be "composite" with bodies, got "{got}"', "leave it out"
        ),
        (GRAINS,): Refusal('gradient must be "composite" where particles have a radius, got "{got}"', "leave it out"),
    }, True),
    Capability("friction_tolerance", _given("method.friction_tolerance", 0.02), {
        (SOFT, SOFT_BODIES): Refusal(
            "friction_tolerance must be left out without particles that have a radius, got {got}", "leave it out"
        ),
    }, True),
    Capability("acceleration", _given("method.acceleration", "none"), {
        (PAPER_BODIES,): Refusal('acceleration of {method} must be "none" with bodies, got "{got}"', "leave it out"),
    }, True),
    Capability("contact_start", _given("method.contact_start", "impact"), {
        (PAPER_BODIES,): Refusal('contact_start of {method} must be "impact" with bodies, got "{got}"', "leave it out"),
    }, True),
    Capability("exponent of multipliers", _given("method.exponent", 1.0), {
        (PAPER_BODIES,): Refusal(
            "exponent of AugmentedLagrangian must be 1 with bodies, got {got}: its loop does not converge for another "
            "one", "leave it out, or use Penalty",
        ),
    }, True),
    Capability("fixed steps of multipliers", _given("method.adaptive", True), {
        (PAPER_BODIES,): Refusal(
            "adaptive of AugmentedLagrangian must be True with bodies, got {got}: a loop that does not start from the "
            "wall does not converge", "give adaptive=True, or use Penalty",
        ),
    }, True),
    Capability("impacts of what did not converge", _given("method.on_unconverged", "raise", "count"), {
        (PAPER_BODIES,): Refusal(
            'on_unconverged must be "raise" or "count" with bodies, got "{got}"', "leave it out, or use Impact(dt=...)"
        ),
    }, True),
    Capability("period", _period, {
        (CHORDS, OTHER_POINTS): Refusal(
            "period must be None with {whole}, got {got}: its steps do not end where a particle leaves the cell",
            _TO_EXACT,
        ),
        (SOFT_BODIES, PAPER_BODIES): Refusal(
            "period must be None with bodies and {method}, got {got}: a body may lie across a face of the cell",
            "use Impact(dt=...), or a vessel without a period",
        ),
        (MASSIVE, HEAVY): Refusal(f"surfaces[{{i}}].{MASS_AND_PERIOD}", WITHOUT_PERIOD),
    }),
    Capability("no wall", _where(lambda asked: not asked.scene.surfaces), {
        _ALONE: Refusal(
            "surfaces must hold at least one surface for particles without a radius, got none: such particles do not "
            "meet one another", "give walls, or give the particles a radius",
        ),
    }, True),
    Capability("law of pairs", _given("scene.pairs"), {
        _ALONE: Refusal(
            "pairs must be None where particles have no radius, got {got}: points do not meet one another",
            "give the particles a radius, or leave pairs out",
        ),
        _EVERY_BODY: Refusal(
            "pairs must be None with bodies, got {got}: bodies do not meet one another",
            "leave it out, or use particles with a radius",
        ),
    }),
    Capability("contact duration", _given("scene.pairs.contact_duration", None), {
        (GRAINS,): Refusal(
            "pairs.contact_duration must be None with Penalty, got {got} s: its contacts last as long as particles "
            "overlap", "leave it out, or use Impact",
        ),
    }, within="law of pairs"),
    Capability("spin", _where(lambda asked: getattr(asked.particles, "spin", None) is not None), {
        _ALONE: Refusal(
            "spin must be None without a radius, got spins: a point does not turn",
            "give the particles a radius",
        ),
    }),
    Capability("plane", _given("scene.plane"), {
        (SOFT_BODIES, PAPER_BODIES): Refusal(
            'plane must be None with bodies and {method}, got "{got}"', "use Impact(dt=...), or leave it out"
        ),
    }),
    Capability("restitution", _of_walls("restitution", 1.0), {
        (BASELINE, SOFT_BODIES, PAPER_BODIES): _with_method("restitution", "1"),
        (CHORDS,): _LOSES,
    }),
    Capability("restitution under gravity", _losses_under_gravity, {
        (MASSIVE, HEAVY): Refusal(
            "surfaces[{i}].restitution must be 1 under gravity where a wall has a mass, got {got}: particles would "
            "come to rest on a wall that moves with them",
            "leave gravity out, or give the wall a motion instead of a mass",
        ),
    }, within="restitution"),
    Capability("friction", _of_walls("friction", 0.0), {
        (BASELINE, SOFT_BODIES, PAPER_BODIES): _with_method("friction", "0"),
        (CHORDS,): _LOSES,
    }),
    Capability("rolling", _of_walls("rolling", 0.0), {
        _ALONE: _without_rolling("surfaces[{i}].rolling", "particles without a radius: a point does not roll"),
        _RIGID_BALLS: _without_rolling("surfaces[{i}].rolling", _AT_AN_INSTANT),
        _EVERY_BODY: _without_rolling("surfaces[{i}].rolling", "bodies, which turn by the forces at their points"),
    }),
    Capability("rolling of pairs", _given("scene.pairs.rolling", 0.0), {
        _RIGID_BALLS: _without_rolling("pairs.rolling", _AT_AN_INSTANT),
    }, within="law of pairs"),
    Capability("temperature", _of_walls("temperature", None), {
        (SOFT_BODIES, PAPER_BODIES): _with_bodies("temperature", "None", "use Impact(dt=...)"),
        (BASELINE,): _with_method("temperature", "None"),
        (CHORDS,): _LOSES,
    }),
    Capability("law of a wall", _of_walls("laws", ()), {
        (SOFT_BODIES, PAPER_BODIES): _with_bodies("laws", "left out", "use Impact(dt=...)"),
        (BASELINE,): _with_method("laws", "left out"),
        (CHORDS,): _LOSES,
    }),
    Capability("laws of groups of a mesh", _groups, {
        (SOFT,): Refusal("surfaces[{i}].groups must be None with {method}, got laws of {got}", _ONE_LAW),
    }, within="law of a wall"),
    Capability("losses of groups of a mesh", _lossy_groups, {
        (GRAINS,): Refusal(
            f"surfaces[{{i}}].groups must have no restitution and no friction with {_WITH_PENALTY}, got {{got}}: they "
            "act during contacts, of which the whole mesh has one law",
            "give the whole mesh that restitution and friction, or use Impact",
        ),
    }, within="law of a wall"),
    Capability("wait beside walls that move", _waits_beside_motions, {
        (*_RIGID_POINTS, SOFT, PAPER, *_EVERY_BALL): Refusal(
            "surfaces[{i}].laws[{k}] must not let particles wait where a wall moves, got {got}: a particle that waits "
            "would have to move with its wall", "leave that law out, or the motions",
        ),
    }, within="law of a wall"),
    Capability("wait", _waits, {
        (HEAVY,): _WAITS_FOR_A_MASS,
        (BODIES,): Refusal(
            "surfaces[{i}].laws[{k}] must not let bodies wait, got {got!r:.200}: a wall holds one point of a body, and "
            "the rest would go on",
            "use a law without a wait, such as Lambert, or particles",
        ),
    }, within="law of a wall"),
    Capability("wait beside a wall with a mass", _where(lambda asked: asked.scene.reacts(), _waits), {
        (GRAINS,): _WAITS_FOR_A_MASS,
    }, True),
    Capability("mass of a wall", _masses, {
        _EVERY_BODY: Refusal(
            "surfaces[{i}] must have no mass and no inertia with bodies, got {got}",
            "make it a body: its cavities= are walls that move with it",
        ),
        _FIXED_STEPS: _with_method("{name}", "None", "value"),
        (CHORDS,): _LOSES,
    }),
    Capability("inertia of a wall", _of_walls("inertia", None), {
        (GRAINS,): Refusal(
            f"surfaces[{{i}}].inertia must be None with {_WITH_PENALTY}, got {{got}}: its contacts push a wall and do "
            "not turn it",
            f"give it a mass and a Guide, or {_TO_MOTION}, or use Impact",
        ),
    }, within="mass of a wall"),
    Capability("laws of a wall with a mass", _heavy_laws, {
        (GRAINS,): Refusal(
            f"surfaces[{{i}}] must have no temperature and no laws where it has a mass with {_WITH_PENALTY}, got "
            "{got!r:.200}", "leave them out, or the mass, or use Impact",
        ),
    }, True),
    Capability("mass of a union", _heavy_rooms, {
        (MASSIVE,): Refusal(
            "surfaces[{i}].{name} must be None for a {kind} of several rooms and particles without a radius, got "
            "{got!r:.200}",
            "give it to a surface without re-entrant edges, or a mesh of the whole, or give the particles a radius",
        ),
    }, within="mass of a wall"),
    Capability("opening", _of_walls("openings", ()), {
        (BASELINE, SOFT_BODIES, PAPER_BODIES): _with_method("openings", "left out", "count"),
    }),
    Capability("opening for a time", _where(lambda asked: asked.scene.has_doors()), {
        (CHORDS,): _CHANGES,
    }, within="opening"),
    Capability("present", _of_walls("present", None), {
        (BASELINE, SOFT_BODIES, PAPER_BODIES): _with_method("present", "None"),
        (CHORDS,): _CHANGES,
    }),
    Capability("motion", _of_walls("motion", None), {
        (SOFT_BODIES, PAPER_BODIES): Refusal(
            "surfaces[{i}].motion must be None with bodies and soft walls, got {got}",
            "use Impact(dt=...), or move a point of the body by an anchor, in the frame of the wall",
        ),
        (CHORDS,): _LOSES,
    }),
    Capability("motion at cut steps", _motions_at_impacts, {
        (PAPER,): Refusal(
            "surfaces[{i}].motion must be None with {cut}, got {got}: its steps are cut at impacts on walls at rest",
            'use fixed steps with on_unconverged="count", Penalty, or Impact',
        ),
    }, True),
    Capability("rotation", _rotations, {
        (BASELINE,): Refusal(
            "surfaces[{i}].motion must not turn the surface with {method}, got {got}: it takes its force in the frame "
            "of a wall that does not turn",
            "use Penalty or Impact, or a rotation that leaves the surface as it is",
        ),
    }, within="motion"),
    Capability("rotation with the mean-value form", _where(
        lambda asked: getattr(asked.method, "gradient", "") == "mean-value", _rotations
    ), {
        (SOFT, PAPER): Refusal(
            'gradient must be "composite" where surfaces[{i}].motion turns the surface, got "mean-value"',
            "leave it out",
        ),
    }, True),
    Capability("gravity at cut steps", _gravity_at_impacts, {
        (PAPER,): Refusal(
            "gravity must be None with {cut}, got {got}",
            'use fixed steps with on_unconverged="count", Penalty, or Impact',
        ),
    }, True),
    Capability("mesh or outline", _faces, {}, within="field"),
    Capability("sheet", _sheets, {
        (SOFT,): Refusal(
            "surfaces[{i}] must not be an open mesh with {method}, got {got!r:.200}: a sheet has no inside, into which "
            "a spring could let points", "use a closed mesh, give the particles a radius, or use Impact",
        ),
    }, within="mesh or outline"),
    Capability("cavity with losses", _lossy_cavities, {
        (SOFT_BODIES, PAPER_BODIES): Refusal(
            "cavities[{k}] must be elastic with {method}, got {got}", "use Impact(dt=...)"
        ),
    }),
    Capability("impacts on members", _given("options.member_impacts"), {}),
    Capability("impacts on members of a field", _where(lambda asked: asked.options.member_impacts, _fields), {
        (SOFT,): Refusal(
            "member_impacts must be False with {method} at surfaces[{i}], got True: a soft wall is one spring, in "
            "which several of its members may take part", "leave it out, or use Impact",
        ),
    }, within="impacts on members"),
    Capability("impacts on members beside cavities", _where(
        lambda asked: asked.options.member_impacts and any(_cavities(asked))
    ), {
        _EVERY_BODY: Refusal(
            "member_impacts must be False with bodies that have cavities, got True: a cavity is no surface of the "
            "scene", "leave it out",
        ),
    }),
    Capability("impacts on members in fixed steps", _members_in_fixed_steps, {
        (PAPER,): Refusal(
            'member_impacts must be False with on_unconverged = "impact" in fixed steps, got True: such a step may '
            "have impacts on several walls", 'use adaptive=True, or on_unconverged="count"',
        ),
    }, True),
    Capability("frames of some particles", _given("options.frames", "all", "none"), {
        _EVERY_BODY: Refusal(
            'frames must be "all" or "none" with bodies, got {got}: a body is written as a whole', 'give frames="all"'
        ),
    }),
    Capability("shards", _given("options.shards", None, 1), {
        _EVERY_BALL: Refusal(
            "shards must be 1 or left out where particles have a radius, got {got}: particles that meet one another "
            "cannot be in different shards", "leave it out",
        ),
        (MASSIVE,): Refusal(
            "shards must be 1 or left out where a wall has a mass, got {got}: through such a wall each particle "
            "depends on all others", "leave it out",
        ),
    }),
    Capability("cluster without a trajectory", _on_cluster(_where(lambda asked: asked.options.trajectory is None)), {
        ENGINES: Refusal(
            "trajectory must be given with a cluster, got none: it joins the files of the shards", "give trajectory="
        ),
    }),
    Capability("cluster and recording", _on_cluster(_recorded), {
        ENGINES: Refusal(
            "recording and live must be left out with a cluster, got {got}",
            "make the recording from the trajectory: swarm record RUN.h5 -o OUT.rrd",
        ),
    }),
    Capability("cluster and log of impacts", _on_cluster(_given("options.impacts")), {
        ENGINES: Refusal(
            "impacts must be None with a cluster, got {got}: its shards keep no common log", "run without a cluster"
        ),
    }),
    Capability("cluster and sources of bodies", _on_cluster(_given("options.sources")), {
        _EVERY_BODY: Refusal(
            "sources must be left out with bodies on a cluster, got {count}: its shards have the bodies of the start",
            "run without a cluster",
        ),
    }),
    Capability("cluster and observables of some particles", _on_cluster(_measured_in_part), {
        ENGINES: Refusal(
            'observables need frames = "all" and precision = "float64" with a cluster, got {got}: they are computed '
            "from the files of its shards", "leave frames and precision out, or run without a cluster",
        ),
    }),
)  # fmt: skip


def sentence(engine: str, capability: str) -> str | None:
    """Return the sentence of the error for an engine and the name of a capability; None if the engine supports it.

    >>> sentence(POINTS, "source") is None
    True
    >>> sentence(POINTS, "spin")
    'spin must be None without a radius, got spins: a point does not turn; give the particles a radius'
    """
    one = next(one for one in CAPABILITIES if one.name == capability)
    return one.sentence(engine) or (sentence(engine, one.within) if one.within else None)


# Engine -> the capabilities that it does not support, in the order of `CAPABILITIES`, each with its sentence.
_REFUSED = {
    engine: [(one, text) for one in CAPABILITIES if (text := one.sentence(engine)) is not None]
    for engine in (*ENGINES, OTHER_POINTS, OTHER_BALLS, OTHER_BODIES)
}


def require_supported(asked: Asked) -> None:
    """Raise a `SceneError` for the first capability that a run needs and its engine does not support."""
    method = asked.method
    fields = {"method": type(method).__name__, "whole": method, "step": getattr(method, "contact_step", 0.0)}
    for capability, text in _REFUSED[engine_of(asked)]:
        for one in capability.found(asked):
            kind = type(one.get("got")).__name__
            raise SceneError(text.format(**fields, kind=kind, **one))


def markdown() -> list[str]:
    """Return the lines of the table in the guide: whether each engine supports each capability."""
    kinds = [engine for engine in ENGINES if engine != BASELINE]
    rows = [("", *kinds), ("---",) * (1 + len(kinds))]
    shown = (one for one in CAPABILITIES if not one.is_argument)
    rows += [(one.name, *("no" if sentence(engine, one.name) else "yes" for engine in kinds)) for one in shown]
    return [f"| {' | '.join(row)} |" for row in rows]
