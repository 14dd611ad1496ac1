"""Checks of a body's arguments: each returns the value in its final type or raises a `SceneError` that names it."""

from collections.abc import Hashable, Iterable, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..common import checks
from ..errors import SceneError
from ..kernel.limits import EPSILON
from ..state import Floats
from . import room

Pairs = NDArray[np.int64]
Spring = tuple[int, int, float, float]

# Two points nearer than this, relative to their coordinates, define no direction.
_SAME_PLACE = 1e-12
# The round-off of an assembled matrix, and of rows of coefficients, relative to their largest entry.
_ROUND_OFF = 1e-12
# A bound of the numbers of points of a body that is not known yet.
_ANY_POINT = 1 << 31


def places(name: str, value: ArrayLike) -> Floats:
    """Return `value` as places (P, 3)."""
    rows = checks.array(name, value)
    if rows.ndim != 2 or rows.shape[1] != 3 or not len(rows):
        hint = "; transpose it" if rows.ndim == 2 and rows.shape[0] == 3 else ""
        raise SceneError(f"{name} must have shape (P, 3), one row a point, got {rows.shape}{hint}")
    room.require(len(rows))
    return finite(name, np.array(rows))


def finite(name: str, values: Floats) -> Floats:
    """Return `values` if all are finite and at most 1e100."""
    # NaN compares as false.
    bad = np.argwhere(~(np.abs(values) <= checks.LARGEST))
    if len(bad):
        where = ", ".join(map(str, bad[0]))
        raise SceneError(
            f"{name} must hold finite numbers of at most {checks.LARGEST:g}, got {values[tuple(bad[0])]:g} at [{where}]"
        )
    return values


def mass_matrix(mass: ArrayLike | None, matrix: ArrayLike | None, count: int) -> Floats:
    """Return the mass matrix (P, P), from masses or as given."""
    if (mass is None) == (matrix is None):
        came = "neither" if mass is None else "both"
        raise SceneError(f"a body needs one of mass and mass_matrix, got {came}")
    if mass is not None:
        masses = checks.array("mass", mass)
        if masses.shape not in ((), (count,)):
            raise SceneError(f"mass must be one number or have shape ({count},), got shape {masses.shape}")
        return np.diag(_masses("mass", np.broadcast_to(masses, (count,))))
    rows = checks.array("mass_matrix", matrix)  # type: ignore[arg-type]
    if rows.shape != (count, count):
        raise SceneError(f"mass_matrix must have shape ({count}, {count}), got {rows.shape}")
    rows = finite("mass_matrix", np.array(rows))
    _masses("the diagonal of mass_matrix", np.diagonal(rows))
    matrix = symmetric("mass_matrix", rows)
    return positive_definite("mass_matrix", matrix, "a motion, largest at point", "kinetic energy")


def _masses(name: str, masses: Floats) -> Floats:
    allowed = (masses >= checks.SMALLEST) & (masses <= checks.LARGEST)
    if not allowed.all():
        first = int(np.argmin(allowed))
        raise SceneError(
            f"{name} must be finite and above 0, got {masses[first]:g} for point {first}; it may be from "
            f"{checks.SMALLEST:g} to {checks.LARGEST:g} kg"
        )
    return masses


def symmetric(name: str, matrix: Floats) -> Floats:
    """Return `matrix` if it is symmetric, made symmetric to the last bit."""
    off = np.abs(matrix - matrix.T)
    if off.max() > _ROUND_OFF * np.abs(matrix).max():
        i, j = (int(k) for k in np.unravel_index(off.argmax(), off.shape))
        raise SceneError(
            f"{name} must be symmetric, got {matrix[i, j]:g} at [{i}, {j}] and {matrix[j, i]:g} at [{j}, {i}]"
        )
    return 0.5 * (matrix + matrix.T)


def modes_unless_above(bound: float, matrix: Floats) -> tuple[Floats, Floats] | None:
    """Return eigenvalues and eigenvectors of a symmetric matrix; None if all eigenvalues are above a bound."""
    try:
        # A factorization is far faster than eigenvalues, which are needed only to show what is wrong.
        np.linalg.cholesky(matrix - bound * np.eye(len(matrix)))
    except np.linalg.LinAlgError:
        values, vectors = np.linalg.eigh(matrix)
        return values, vectors
    return None


def positive_definite(name: str, matrix: Floats, motion: str, energy: str) -> Floats:
    """Return a symmetric `matrix` if it is positive definite beyond round-off.

    `motion` and `energy` say in the error what an eigenvector is, up to the number of its largest entry, and what an
    eigenvalue is.
    """
    # The matrix is scaled to a diagonal of ones, so that a light point beside a heavy one is no singularity.
    diagonal = np.diagonal(matrix)
    scale = np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    least = _ROUND_OFF + 8.0 * len(matrix) * EPSILON
    modes = modes_unless_above(least, matrix / scale / scale[:, None])
    if modes is not None and modes[0][0] < _ROUND_OFF:
        first = int(np.abs(modes[1][:, 0] / scale).argmax())
        is_singular = modes[0][0] > -_ROUND_OFF
        raise SceneError(
            f"{name} must be positive definite, got one that "
            f"{'is singular' if is_singular else 'has a negative eigenvalue'}: {motion} {first}, has "
            f"{'no' if is_singular else 'a negative'} {energy}"
        )
    return matrix


def point(name: str, value: Any, count: int | None) -> int:
    """Return `value` as the number of one of `count` points."""
    number, below = checks.count(name, value, least=0), _ANY_POINT if count is None else count
    if number >= below:
        came = f"{number}" if number < _ANY_POINT else f"{min(number, 10**300):.6g}"
        raise SceneError(f"{name} must be the number of a point, from 0 to {below - 1}, got {came}")
    return number


def numbers(name: str, rows: Iterable[Any], width: int, count: int | None) -> Pairs:
    """Return `rows` as numbers of points (N, width), distinct in and between rows; count None: of any body."""
    result = []
    for row, parts in each(name, rows, width, "numbers of points"):
        given = tuple(point(f"{row}[{i}]", part, count) for i, part in enumerate(parts))
        if len(set(given)) < width:
            raise SceneError(f"{row} must name {width} different points, got {given}")
        result.append(given)
    _require_once(name, map(frozenset, result), [f", {given}," for given in result])
    return np.array(result, dtype=np.int64).reshape(-1, width)


def _require_once(name: str, keys: Iterable[Hashable], names: Sequence[str]) -> None:
    found: dict[Hashable, int] = {}
    for k, key in enumerate(keys):
        if found.setdefault(key, k) < k:
            raise SceneError(f"{name}[{k}]{names[k]} is listed already as {name}[{found[key]}]; leave one of them out")


def each(name: str, rows: Iterable[Any], width: int, parts: str) -> Iterator[tuple[str, tuple[Any, ...]]]:
    """Yield the name, such as links[3], and the parts of each row of an argument.

    The parts are of one kind, such as "numbers of points", or have names, such as "(i, j, stiffness, rest length)".
    """
    named = parts.startswith("(")
    try:
        for k, row in enumerate(rows):
            given = row.tolist() if isinstance(row, np.ndarray) else row
            where = f"{name}[{k}]"
            yield where, checks.entries(where, given, width, f"{width} {'values ' * named}{parts}")
    except SceneError:
        raise
    except Exception:  # the argument has no parts, or is an object of another package
        expected = f"rows {parts}" if named else f"rows of {width} {parts}"
        raise SceneError(f"{name} must be {expected}, got {checks.shown(rows)}") from None


def links(rows: Iterable[Any], places: Floats) -> Pairs:
    """Return `rows` as pairs (L, 2) of points at different places."""
    pairs = numbers("links", rows, 2, len(places))
    for k, (i, j) in enumerate(pairs.tolist()):
        if _at_one_place(places[i], places[j]):
            raise SceneError(
                f"links[{k}], {(i, j)}, must tie points at different places, got both at {places[i].tolist()}; a link "
                "has no direction there"
            )
    return pairs


def _at_one_place(first: Floats, second: Floats) -> bool:
    return bool(np.abs(first - second).max() <= _SAME_PLACE * max(np.abs(first).max(), np.abs(second).max()))


def springs(rows: Iterable[Any], places: Floats) -> tuple[Spring, ...]:
    """Return `rows` as springs (i, j, stiffness, rest length)."""
    result = []
    for row, given in each("springs", rows, 4, "(i, j, stiffness, rest length)"):
        i, j = (point(f"{row}[{n}]", given[n], len(places)) for n in range(2))
        if i == j:
            raise SceneError(f"{row} must name 2 different points, got {(i, j)}")
        stiffness = checks.positive(f"{row}[2], its stiffness,", given[2])
        rest = checks.magnitude(f"{row}[3], its rest length,", given[3])
        checks.magnitude(f"{row}[2], its stiffness,", stiffness)
        if rest > 0.0 and _at_one_place(places[i], places[j]):
            raise SceneError(
                f"{row} must tie points at different places, got {(i, j)}, both at {places[i].tolist()}, and a "
                f"rest length of {rest:g} m: its force has no direction there"
            )
        result.append((i, j, stiffness, rest))
    return tuple(result)


def contacts(value: ArrayLike | None, count: int, anchored: Iterable[int]) -> Floats:
    """Return `value`, numbers of points or rows of coefficients, as coefficients (K, P) of distinct contacts."""
    held = set(anchored)
    if value is None:
        free = [p for p in range(count) if p not in held]
        room.require(count, contacts=len(free))
        return np.eye(count)[free]
    rows = checks.array("contacts", value)
    room.require(count, contacts=len(rows) if rows.ndim else 0)
    if rows.ndim == 1:
        chosen = [point(f"contacts[{k}]", number, count) for k, number in enumerate(np.asarray(value).tolist())]
        # Comparing numbers is faster than comparing rows.
        _require_once("contacts", chosen, [""] * len(chosen))
        rows = np.eye(count)[chosen]
    if rows.ndim != 2 or rows.shape[1] != count:
        raise SceneError(f"contacts must be numbers of points or have shape (K, {count}), got shape {rows.shape}")
    rows = finite("contacts", np.array(rows))
    sums, sizes = rows.sum(axis=1), np.abs(rows).sum(axis=1)
    for k in np.flatnonzero(np.abs(sums - 1.0) > _ROUND_OFF * np.maximum(sizes, 1.0)).tolist():
        raise SceneError(
            f"contacts[{k}], its coefficients, must add up to 1, got {sums[k]:g}: the point must move with its body"
        )
    can_move = (np.delete(rows, sorted(held), axis=1) != 0.0).any(axis=1)
    for k in np.flatnonzero(~can_move)[:1]:
        raise SceneError(f"contacts[{k}] must be able to move, got one made of anchored points alone; leave it out")
    _require_once("contacts", (row.tobytes() for row in rows + 0.0), [""] * len(rows))
    return rows
