"""Checks before a run starts."""

import numpy as np

from ...common import checks
from ...compiled_scene import CompiledScene
from ...contact.laws import NONE
from ...errors import SceneError
from ...files.origin import require_near
from ...methods import ALL_METHODS
from ...methods.base import Method, check_surfaces
from ...motion import Path, parts_of
from ...motion.given import require_angle
from ...particles import Particles, TiedParticles
from ...scene import Scene
from ...sources.ball_places import place_unborn
from ...sources.births import with_births
from ...surfaces.instant import gaps_of, gradient_of
from ...surfaces.plane import require_start
from ...surfaces.surface import named
from .. import engines
from ..impacts import require_logged
from ..options import RunOptions, Task
from . import workload
from .counting import require_compiled, require_counters
from .knows import Asked, require_supported
from .softness import depths_at_start
from .starts import require_inside

# A trial flight of the length `_NEAR`, in sizes of the scene, shows on which side of a wall a particle starts. If it
# starts in a tip and flies out, the end of this flight is outside by more than the part `_TIP` of its length.
_NEAR, _TIP = 1e-6, 1e-2
# How long before 0 s a piece of a path may begin, in lengths of the run: float64 then resolves 1e-4 of the run.
_LONG_AGO = 1e12
# The most cells: floats do not hold all larger whole numbers, and the numbers of images are multiplied by lengths.
_MOST_CELLS = 2.0**53


def task_of(scene: Scene, particles: Particles | TiedParticles | None, method: Method, options: RunOptions) -> Task:
    """Return the checked run, with a copy of the particles of the start, followed by those that sources add.

    Raises:
        SceneError: an argument is wrong, or the arguments do not go together.
    """
    kinds = (
        ("scene", scene, (Scene,)),
        ("particles", particles, (Particles, TiedParticles)),
        ("method", method, (Method,)),
    )
    for name, value, allowed in kinds:
        if not isinstance(value, allowed) and not (name == "particles" and value is None and options.sources):
            instead = "; None goes with sources=[...]" if value is None and name == "particles" else ""
            got = f"{checks.shown(value)}{instead or checks.brackets(value)}"
            raise SceneError(f"{name} must be a swarm.{allowed[0].__name__}, got {got}")
    require_supported(Asked(scene, particles, method, options))
    if isinstance(particles, TiedParticles):
        _require_motions(scene, options.times.until)
        task: Task = engines.wing("bodies.admission").task_of(scene, particles, method, options)
        return task
    # The arrays of particles may have been changed since they were checked.
    start = None if particles is None else _in_the_cell(scene, particles.copy(), options.times.until)
    check_surfaces(method, scene)
    times = options.times
    # The balls of the start and the balls of sources.
    balls = _balls(scene, start, method, options)
    radius = None if balls is None else balls.radius
    compiled = scene.compiled(None if radius is None else float(radius.max()), method.apart())
    _require_laws_applied(compiled, method)
    require_compiled(scene, options)
    _require_motions(scene, times.until)
    if balls is None:
        particles = with_births(scene, start, options.sources, options.seed, times.until, method.birth_times)
    else:
        particles = balls
        place_unborn(scene, balls, options.seed)
    require_logged(len(particles), options)
    if options.keeps_float32():
        require_near(scene, particles)
    method.check(scene, particles)
    require_counters(scene, particles, options)
    assert times.every is not None
    method.span("until", times.until)
    method.span("every", times.every)
    require_start(scene, particles)
    # Particles from sources are born later, inside the walls of that time.
    if start is not None and balls is not None:
        engines.wing("events.balls").require_apart(scene, start, method)
    elif start is not None:
        require_inside(scene, start, depths_at_start(scene, start, method))
        _require_normals(scene, start)
    workload.require_few_impacts(compiled, particles, method, times.until, times.every)
    return Task(compiled, particles, method, options)


def _balls(scene: Scene, start: Particles | None, method: Method, options: RunOptions) -> Particles | None:
    """Return the balls of a run, with all checks but those of their places; None in a run of points."""
    if start.radius is None if start is not None else options.sources[0].radius is None:
        return None
    balls = with_births(scene, start, options.sources, options.seed, options.until)
    engines.wing("events.balls").require_balls(scene, balls, method)
    return balls


def _require_laws_applied(compiled: CompiledScene, method: Method) -> None:
    """Raise a `SceneError` if walls have losses or laws that a user-defined method does not apply."""
    laws, name = compiled.laws, type(method).__name__
    if laws is None or not (laws.loses or laws.send_off) or ALL_METHODS.kind_of(type(method)) is not None:
        return
    numbers = method.numbers(compiled.scene)
    if numbers.laws is NONE and numbers.laws_at_ends is None:
        raise SceneError(
            f"method must apply the restitution, friction, temperature and laws of walls, got {name}; its numbers "
            "have no `laws`; leave them out of the walls, use Impact, or give the numbers `laws` and apply them in "
            "`contact`, see help(swarm.methods.contract)"
        )


def _require_motions(scene: Scene, until: float) -> None:
    for i, surface in enumerate(scene.surfaces):
        for one in parts_of(surface.motion):
            require_angle(f"surfaces[{i}].motion", one, until)
            if isinstance(one, Path) and not one.times[0] <= 0.0 <= until <= one.times[-1]:
                raise SceneError(
                    f"surfaces[{i}].motion.times must cover the run from 0 to {until:g} s, got {one.times[0]:g} to "
                    f"{one.times[-1]:g}; add the missing times, or give another until"
                )
            # A piece of a path counts the time since its start: long after it, float64 does not resolve this run.
            if isinstance(one, Path) and max(t for t in one.times if t <= 0.0) < -_LONG_AGO * until:
                raise SceneError(
                    f"surfaces[{i}].motion.times must have one at 0 s or at most {_LONG_AGO:g} times the length of the "
                    f"run before it, {until:g} s, so that the time since then has digits, got {one.times[0]:g} s; add "
                    "the time 0"
                )


def _in_the_cell(scene: Scene, particles: Particles, until: float) -> Particles:
    """Return the particles, in a periodic scene with positions in the cell and images."""
    if scene.period is None:
        if particles.image is not None:
            raise SceneError(
                "particles.image must be None where the scene has no period, got images; set it to None, or give the "
                "scene the period that they are of"
            )
        return particles
    _require_countable(scene, particles, until)
    particles.position, images = scene.wrapped(particles.position)
    particles.image = images if particles.image is None else images + particles.image
    return particles


def _require_countable(scene: Scene, particles: Particles, until: float) -> None:
    """Raise a `SceneError` if a particle may come through more cells than a file can count."""
    for k, length in enumerate(scene.period or ()):
        if length is None:
            continue
        pull = 0.0 if scene.gravity is None else abs(scene.gravity[k])
        reach = float(abs(particles.position[k]).max()) + until * (particles.fastest() + 0.5 * pull * until)
        before = 0 if particles.image is None else int(abs(particles.image[k]).max())
        if not reach / length + before <= _MOST_CELLS:
            raise SceneError(
                f"period[{k}] must be so long that particles come through at most 2**53 cells, got {length:g} m, for "
                f"particles that may be {reach / length + before:.3g} cells away at {until:g} s; give a longer period, "
                "or a shorter run"
            )


def _require_normals(scene: Scene, particles: Particles) -> None:
    """Raise a `SceneError` for a flight out of the tip of a cone, where no normal determines its reflection."""
    step = _NEAR * scene.finite_size()
    for i, surface in enumerate(scene.surfaces):
        if not surface.may_have_tip or surface.motion is not None:
            continue
        on_wall = np.flatnonzero(surface.phi(particles.position) == 0.0)
        r, v = particles.position[:, on_wall], particles.velocity[:, on_wall]
        speed = np.sqrt((v**2).sum(axis=0))
        ahead = r + v * (step / np.where(speed > 0.0, speed, 1.0))
        # If the wall has a normal, a flight that is not against it is outside by the square of the way at most.
        against = (gradient_of((surface,), r) * v).sum(axis=0) > 0.0
        slope = np.sqrt((surface.gradient(ahead) ** 2).sum(axis=0))
        lost = np.flatnonzero((speed > 0.0) & ~against & (gaps_of((surface,), ahead, 0.0)[0] > _TIP * step * slope))
        if lost.size:
            k = int(lost[0])
            raise SceneError(
                f"particles must not fly out of a tip of their walls, which has no normal, got particle {on_wall[k]} "
                f"at {tuple(r[:, k].tolist())}, a tip of {named(i, surface)}, with the velocity "
                f"{tuple(v[:, k].tolist())}; start it beside the tip, or with a velocity into the volume"
            )
