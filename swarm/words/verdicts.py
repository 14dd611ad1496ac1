"""Verdicts on a run: a sentence with its figure for each quantity that should be kept.

Limits follow from the arithmetic of a method. A number is rounded to 1.1e-16 of itself once or a few times in an
impact or a step, so errors of round-off grow at most in proportion to their number; measured errors grow far less, and
up to 1e5 impacts of a particle the project's own tests require 1e-12.
"""

from typing import Any

import numpy as np

from ..common.catalog import OBSERVABLES
from ..kernel.limits import SUMMED
from ..observables import books, drift
from ..pairs import MOST_PRESSED
from .amounts import amount, counted_in_words, listed, many, plain
from .statements import Statement, lines_of

# The bound of the project's tests for a quantity that should be kept.
ROUND_OFF = 1e-12
# Methods that keep the energy to round-off or to their tolerance: verdicts on others say that they drift.
_CONSERVING = ("Impact", "Penalty", "AugmentedLagrangian")


def judged(content: Any) -> list[Statement]:
    """The verdicts on the `Content` of a run."""
    found = _numbers(content)
    if any(one.verdict is False for one in found):
        return found  # verdicts on infinite or undefined values would mean nothing
    for judge in (_energy, _balance, _penetration, _overlap, _momentum, _multipliers, _links, _books):
        found[-1:-1] = judge(content)
    return found


def marked(content: Any) -> list[str]:
    """The verdicts as lines of a picture; the one on numbers only if some values are not finite."""
    return lines_of(one for one in judged(content) if one.label != "numbers" or not one.verdict)


def energy_limit(content: Any) -> float:
    """The largest relative error of the energy of one particle that round-off, or a tolerance, explains."""
    seen, method = content.seen, content.method
    steps = float(seen["time"][-1] - seen["time"][0]) / step if (step := getattr(method, "dt", None)) else 0.0
    each = float(seen["impacts"][-1] + seen.get("collisions", [0.0])[-1]) / max(1, content.count)
    limit = max(ROUND_OFF, SUMMED * (each + steps))
    return float(limit + _tolerated(content, each)) if method.has_multipliers() else float(limit)


def _tolerated(content: Any, each: float) -> float:
    """The relative energy that `each` contacts of a particle may change within the tolerance of the loop.

    A contact ends with a gap of at most g, V = penalty g^2/2 = tolerance; its force, the impulse over the step, has
    done at most force times g of work, which is missing in the balance of energy. A particle may have four times the
    mean impulse.
    """
    seen, method = content.seen, content.method
    most = float((seen["kinetic_energy"] + np.abs(seen["contact_energy"])).max()) / max(1, int(content.count))
    impulse = float(np.abs(seen["impulse"][-1]).sum()) / max(1.0, float(seen["impacts"][-1]))
    gap = float(np.sqrt(2.0 * method.tolerance / method.penalty))
    return (1.0 + each) * 4.0 * impulse / method.dt * gap / most if most else 0.0


def _numbers(content: Any) -> list[Statement]:
    """Whether all observables of every run are numbers."""
    bad = []
    for name, values in content.seen.items():
        if name in OBSERVABLES and not OBSERVABLES[name].may_be_nan and np.asarray(values).dtype.kind == "f":
            wrong = ~np.isfinite(np.asarray(values).reshape(len(values), -1)).all(axis=1)
            bad += [f"{name} from {amount(content.seen['time'][wrong.argmax()], 's')} on"] if wrong.any() else []
    if bad:
        return [Statement("numbers", f"not finite: {listed(bad)}", False)]
    return [Statement("numbers", "every observable is finite in every frame", True)]


def _energy(content: Any) -> list[Statement]:
    """The energy of the worst particle, with its losses and heat."""
    worst, limit = float(content.seen["energy_error"].max()), energy_limit(content)
    one, name = "particle" if content.body is None else "body", type(content.method).__name__
    figure = f"the worst {one}'s error is {plain(worst, 2)} of its energy"
    if worst == 0.0:
        return [Statement("energy", "the balance closes to the last bit", True)]
    if worst <= max(ROUND_OFF, limit if not content.method.has_multipliers() else 0.0):
        return [Statement("energy", f"kept to round-off: {figure}", True)]
    if worst <= limit:
        return [Statement("energy", f"kept to the tolerance of the loop: {figure}", True)]
    why = "the tolerance of the loop" if content.method.has_multipliers() else "round-off"
    if name not in _CONSERVING:
        return [Statement("energy", f"not kept, {name} does not conserve it: {figure}", False)]
    return [Statement("energy", f"not kept: {figure}, and {why} explains {plain(limit, 1)}", False)]


def _balance(content: Any) -> list[Statement]:
    """The energy of all particles against the energy that walls, sources and anchors took and gave."""
    changes, part = books(content.seen), drift(content.seen)
    limit = energy_limit(content)
    holds = part <= limit
    if not changes:
        known = type(content.method).__name__ in _CONSERVING
        why = "" if holds or known else f", {type(content.method).__name__} does not conserve it"
        if part == 0.0:
            return [Statement("total energy", "constant to the last bit", True)]
        kept, moved = "constant" if holds else "not constant", f"{plain(part, 2)} of the energy that moved"
        return [Statement("total energy", f"{kept}: it changes by {moved}{why}", holds)]
    terms = [
        f"{name} {amount(float(values[-1]) * (-1 if name == 'dissipated' else 1), 'J', 3)}"
        for name, values in changes.items()
    ]
    closes = "closes" if holds else "does not close: it is off by"
    to = f"to {plain(part, 2)}" if holds else plain(part, 2)
    return [Statement("balance of energy", f"{closes} {to} of what moved ({listed(terms)})", holds)]


def _penetration(content: Any) -> list[Statement]:
    """The largest distance of a particle outside a wall."""
    if not content.scene.surfaces:
        return []
    deepest, one = float(content.seen["max_penetration"].max()), "particle" if content.body is None else "point"
    if deepest == 0.0:
        kind = "a rigid wall" if content.method.law() is None else "a wall"
        return [Statement("walls", f"no {one} was outside {kind}", True)]
    size = reach_of(content.scene)
    if content.method.law() is not None and not content.method.has_multipliers():
        part = f", {plain(100.0 * deepest / size, 2)} % of the vessel" if size else ""
        return [Statement("walls", f"springs gave way by at most {amount(deepest, 'm', 2)}{part}", None)]
    limit = penetration_limit(content)
    outside = f"at most {amount(deepest, 'm', 2)} outside a rigid wall"
    if deepest <= limit:
        return [Statement("walls", f"{outside}, round-off of {amount(size, 'm', 2)}", True)]
    why = "the tolerance of the loop" if content.method.has_multipliers() else "round-off"
    return [Statement("walls", f"{outside}, where {why} explains {amount(limit, 'm', 1)}", False)]


def _overlap(content: Any) -> list[Statement]:
    """The largest depth at which soft balls pressed on one another and on walls, at any step."""
    radius = next((frame.radius for frame in content.frames.values() if frame.radius is not None), None)
    if "largest_overlap" not in content.seen or radius is None:
        return []
    deepest, least, most = (
        float(f(x)) for f, x in ((np.max, content.seen["largest_overlap"]), (np.min, radius), (np.max, radius))
    )
    if deepest == 0.0:
        return [Statement("contacts", "no ball pressed on another one or on a wall", True)]
    found = f"balls overlapped by at most {amount(deepest, 'm', 2)}, {plain(100.0 * deepest / least, 2)} % of "
    found += "their radius" if least == most else "the smallest radius"
    if deepest <= MOST_PRESSED * least:
        return [Statement("contacts", found, True)]
    wanted = f"{found}; up to {100.0 * MOST_PRESSED:g} % of a radius they are small: use a larger penalty"
    return [Statement("contacts", wanted, False if deepest > MOST_PRESSED * most else None)]


def penetration_limit(content: Any) -> float:
    """The largest distance outside a rigid wall that round-off, or a tolerance, explains [m]."""
    method, limit = content.method, ROUND_OFF * reach_of(content.scene)
    if method.has_multipliers():
        limit += float(np.sqrt(2.0 * method.tolerance / method.penalty))
    return limit


def reach_of(scene: Any) -> float:
    """The largest distance of walls from the origin [m]: numbers of that size are rounded."""
    sizes = [scene.finite_size(), *(surface.extent() for surface in scene.surfaces)]
    return float(max(size for size in sizes if np.isfinite(size)))


def _momentum(content: Any) -> list[Statement]:
    """The momentum, which is constant in a periodic cell without walls and gravity."""
    scene, seen = content.scene, content.seen
    if scene.surfaces or scene.gravity is not None or content.body is not None or "born" in seen:
        return []
    frame = content.frames.get("start", content.frames.get("end"))
    mass = float(np.nansum(frame.mass)) if frame is not None else float(content.count)
    change = float(np.abs(seen["momentum"] - seen["momentum"][0]).max())
    scale = float(np.sqrt(2.0 * mass * seen["kinetic_energy"].max()))
    part = change / scale if scale else change
    holds = part <= energy_limit(content)
    return [Statement("momentum", f"{'kept' if holds else 'not kept'}: it changes by {plain(part, 2)} of all", holds)]


def _multipliers(content: Any) -> list[Statement]:
    """Whether loops of multipliers, or sweeps over the contacts of grains, have converged."""
    failed = int(content.seen["unconverged"][-1])
    if not content.method.has_multipliers():
        less = f"{counted_in_words(failed, 'step')} met friction, or a damper, to fewer digits than others"
        return [Statement("friction", less, False)] if failed else []
    if failed:
        return [Statement("loops", f"{counted_in_words(failed, 'contact')} did not converge", False)]
    sweeps = float(content.seen.get("sweeps", [0])[-1])
    each = sweeps / max(1.0, float(content.seen["impacts"][-1]))
    return [Statement("loops", f"every contact converged, in {plain(each, 2)} sweeps an impact", True)]


def _links(content: Any) -> list[Statement]:
    """Whether links keep their lengths."""
    if content.body is None or not len(content.body.links):
        return []
    worst, limit = float(np.max(content.seen["link_error"])), energy_limit(content)
    holds = worst <= limit
    kept = "keep their lengths" if holds else "do not keep their lengths"
    return [Statement("links", f"they {kept}: the worst is off by {plain(worst, 2)} of it", holds)]


def _books(content: Any) -> list[Statement]:
    """Whether the numbers of particles balance: all are inside, were absorbed, or escaped.

    The list is empty for a run without sources that no particle left.
    """
    seen, body = content.seen, content.body
    ends = {"escaped": int(seen["escaped"][-1]), "absorbed": int(np.sum(seen.get("absorbed", [0])[-1]))}
    if not any(ends.values()) and "born" not in seen:
        return []
    if body is not None:
        whole = content.scene.is_open()
        return [
            Statement("particles", f"{many(ends['escaped'])} of {many(content.count // len(body))} left", whole or None)
        ]
    if not knows_start(content):
        return []
    born = int(np.sum(seen["born"][-1])) if "born" in seen else 0
    there = content.count if "born" not in seen else at_start(content) + born
    inside = there - sum(ends.values())
    parts = [f"{many(inside)} inside"] + [f"{many(number)} {what}" for what, number in ends.items() if number]
    frame = content.frames.get("end")
    seen_there = there if frame is None else int((~np.isnan(frame.position[0])).sum())
    kept = content.count == (there if frame is None else len(frame.mass))
    came = f", {many(born)} of them from sources" if born else ""
    blocked = int(np.sum(seen["blocked"][-1])) if "blocked" in seen else 0
    came += f"; {many(blocked)} births found no free place at their time" if blocked else ""
    if inside < 0 or (kept and frame is not None and seen_there != there):
        return [Statement("particles", f"{listed(parts)} do not add up to {many(there)}{came}", False)]
    ways = content.scene.is_open() or any(one.openings or one.present is not None for one in content.scene.pieces.each)
    if ends["escaped"] and not ways:
        return [Statement("particles", f"{many(ends['escaped'])} of {many(there)} passed through a closed wall", False)]
    return [Statement("particles", f"{many(there)} = {' + '.join(parts)}{came}", True)]


def knows_start(content: Any) -> bool:
    """Whether the number of particles at the start is known: not all births of balls find a place."""
    frame = content.frames.get("start")
    return "blocked" not in content.seen or (frame is not None and len(frame.mass) == content.count)


def at_start(content: Any) -> int:
    """The number of particles before any came from a source."""
    frame, born = content.frames.get("start"), content.seen.get("born")
    if born is None:
        return int(content.count)
    if frame is not None and len(frame.mass) == content.count:
        return int((~np.isnan(frame.position[0])).sum() - np.sum(born[0]))
    # The run has reached its end: all particles of its sources are born.
    return int(content.count - np.sum(born[-1]))
