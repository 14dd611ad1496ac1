"""Checks of arguments: each returns the value in its final type or raises a `SceneError` that names it."""

import difflib
import errno
import functools
import itertools
import math
import operator
import os
import re
import sys
from collections.abc import Collection, Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import SceneError

Vector = tuple[float, float, float]
# Bounds of magnitudes with finite squares and inverse squares.
SMALLEST, LARGEST = 1e-100, 1e100
# Bytes for each particle in a run (`python -m bench bars`), and a number of particles that fits into every memory.
PARTICLE, FEW = 146, 1_000_000
_DOUBLE = 8
# Characters of a value that a message shows.
_SHOWN = 200
# The beginning of a message about an argument, or about a part of it.
_ARGUMENT = re.compile(r"[a-z_]\w*(\[\d+\])*(\.[a-z_]\w*(\[\d+\])*)*( must | has | is |: )")
# The similarity of two names from which one is taken for the other.
_SIMILAR = 0.54
# Other names for arguments and kinds.
_OTHER_WORDS = {
    "friction": "mu mu_s mu_d cof",
    "restitution": "e cor eps bounce",
    "count": "n num number",
    "n": "count num number",
    "until": "t_end tend t_max tmax t_final duration end time steps n_steps",
    "every": "interval save_every output_every dt_out",
    "radius": "r d diameter",
    "speed": "v v0 velocity",
    "temperature": "t temp kt",
    "penalty": "k kn k_n stiffness dem spring soft-sphere",
    "rate": "omega angular_velocity frequency",
    "center": "position pos origin centre",
    "half_widths": "size sides lengths half_lengths extents",
    "trajectory": "output out",
    "impact": "event-driven edmd hard-sphere elastic",
    "lambert": "diffuse cosine",
    "sphere": "ball circle disc disk",
    "box": "cube cuboid brick rectangle square",
    "cylinder": "tube pipe",
    "plane": "wall floor",
    "inside": "in internal",
    "outside": "out external",
    "mesh": "stl",
}
_SECONDS = {"": 1.0, "s": 1.0, "m": 60.0, "min": 60.0, "h": 3600.0, "d": 86400.0}


def shown(value: Any) -> str:
    """Return the `repr` of a value, in one line of at most 200 characters, for the message of an error.

    >>> shown(np.zeros((2, 2)))
    'array([[0., 0.], [0., 0.]])'
    """
    try:
        text = repr(value)
    except Exception:  # an object with errors, or a number of too many digits
        return f"a {type(value).__name__}"
    return " ".join(text.split())[:_SHOWN]


def assign(frozen: Any, **values: Any) -> None:
    """Set fields of a frozen dataclass to checked values."""
    for name, value in values.items():
        object.__setattr__(frozen, name, value)


def of_class(name: str, value: Any, cls: type[Any]) -> None:
    """Raise a `SceneError` unless `value` is an object of a public class."""
    if not isinstance(value, cls):
        raise SceneError(f"{name} must be a swarm.{cls.__name__}, got {shown(value)}{brackets(value)}")


def is_masked(value: Any) -> bool:
    """Whether a value is a masked array; none exist before `numpy.ma` is imported, which takes 8 ms."""
    module = sys.modules.get("numpy.ma")
    return module is not None and isinstance(value, module.MaskedArray)


def number(name: str, value: Any, expected: str = "a finite number") -> float:
    """Return `value` as a finite float."""
    try:
        # float() would take the last two, and drop the imaginary part or the mask.
        if isinstance(value, (bool, str, bytes, np.complexfloating)) or is_masked(value):
            raise TypeError
        result = float(value)
    except Exception:  # of float(), or of a foreign object
        raise SceneError(f"{name} must be {expected}, got {shown(value)}") from None
    if not math.isfinite(result):
        raise SceneError(f"{name} must be {expected}, got {result}")
    return result


def positive(name: str, value: Any) -> float:
    """Return `value` as a finite float above zero."""
    result = number(name, value, "a finite number above 0")
    if result <= 0.0:
        raise SceneError(f"{name} must be above 0, got {result:g}")
    return result


def at_least(name: str, value: Any, bound: float) -> float:
    """Return `value` as a finite float not below `bound`."""
    result = number(name, value, f"a finite number, {bound:g} or more")
    if result < bound:
        raise SceneError(f"{name} must be {bound:g} or more, got {result:g}")
    return result


def length(name: str, value: Any) -> float:
    """Return `value` as a length [m] above zero; its square is finite and not zero."""
    result = positive(name, value)
    if not SMALLEST <= result <= LARGEST:
        raise SceneError(f"{name} must be between {SMALLEST:g} and {LARGEST:g} m, got {result:g}")
    return result


def magnitude(name: str, value: Any) -> float:
    """Return `value` as a number, 0 or more, with a finite square."""
    result = at_least(name, value, 0.0)
    if result > LARGEST:
        raise SceneError(f"{name} must be at most {LARGEST:g}, got {result:g}")
    return result


def positive_magnitude(name: str, value: Any) -> float:
    """Return `value` as a number above zero with a finite square."""
    return magnitude(name, positive(name, value))


def part(name: str, value: Any, least: float = 0.0) -> float:
    """Return `value` as a number from `least` to 1."""
    result = number(name, value, f"a number from {least:g} to 1")
    if not least <= result <= 1.0:
        raise SceneError(f"{name} must be from {least:g} to 1, got {result:g}")
    return result


def bounded(name: str, value: Any) -> float:
    """Return `value` as a number of either sign, with a finite square."""
    result = number(name, value)
    magnitude(f"|{name}|", abs(result))
    return result


def count(name: str, value: Any, least: int = 1) -> int:
    """Return `value` as an integer not below `least`."""
    try:
        if isinstance(value, (bool, np.bool_)) or is_masked(value):
            raise TypeError
        result = operator.index(value)
    except TypeError:
        raise SceneError(f"{name} must be a whole number, {least} or more, got {shown(value)}") from None
    if result < least:
        raise SceneError(f"{name} must be {least} or more, got {shown(result)}")
    return result


def seed(name: str, value: Any) -> int:
    """Return `value` as the seed of random numbers: an integer from 0 to 2**64 - 1."""
    result = count(name, value, least=0)
    if result >= 1 << 64:
        raise SceneError(f"{name} must be below 2**64, got {min(result, 10**300):.6g}")
    return result


@functools.cache
def memory() -> int:
    """Return the memory of this machine [bytes]."""
    if hasattr(os, "sysconf"):
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    import psutil  # on Windows

    return int(psutil.virtual_memory().total)


def in_bytes(size: float) -> str:
    """Return a number of bytes in a suitable unit.

    >>> in_bytes(1.46e14)
    '146 TB'
    """
    units = ["bytes", "kB", "MB", "GB", "TB", "PB", "EB"]
    while size >= 999.5 and len(units) > 1:
        size, units = size / 1000.0, units[1:]
    return f"{size:.3g} {units[0]}"


def _too_large(name: str, given: str, size: float) -> SceneError:
    return SceneError(f"{name} must fit in memory{given} {in_bytes(size)}; this machine has {in_bytes(memory())}")


def require_memory(name: str, given: str, size: float) -> None:
    """Raise a `SceneError` if an argument of `size` bytes does not fit in the memory of this machine."""
    if size > memory():
        raise _too_large(name, given, size)


def particles_fit(name: str, count: int) -> None:
    """Raise a `SceneError` if `count` particles do not fit in the memory of this machine."""
    count = min(count, 10**300)  # which float() can convert
    if count > FEW:
        require_memory(name, f", got {count:.6g} particles, which take", PARTICLE * count)


def duration(name: str, value: str) -> float:
    """Return a time such as "2h", "1h30m", "45 min" or "90" (seconds) in seconds above 0."""
    parts = re.findall(r"(\d+\.?\d*)\s*([a-z]*)\s*", value)
    known = all(unit in _SECONDS for _number, unit in parts)
    if not known or not re.fullmatch(r"(\d+\.?\d*\s*[a-z]*\s*)+", value):
        raise SceneError(f'{name} must be a time such as "2h", "1h30m" or "90s", got {value!r}')
    return positive(name, sum(float(number) * _SECONDS[unit] for number, unit in parts))


def path_of(name: str, value: Any) -> Path:
    """Return the argument `name` as the path of a file.

    Raises:
        SceneError: it is not a path, it is empty, or it is too long for the system.
    """
    text = os.fspath(value) if isinstance(value, (str, os.PathLike)) else value
    if not isinstance(text, str) or not text or "\0" in text:
        raise SceneError(f"{name} must be the path of a file, got {shown(text)}")
    path = Path(text)
    require_short(name, path, path)
    return path


def require_short(name: str, path: Path, longest: Path) -> None:
    """Raise a `SceneError` if the name of the file `longest`, derived from `path`, is too long for the system."""
    try:
        os.lstat(longest)
    except OSError as error:
        if error.errno == errno.ENAMETOOLONG:
            raise SceneError(
                f"{name} must be the path of a file, got one of {len(str(path))} characters, which is too long for "
                f"this system, {path!s:.40}...; choose a shorter name"
            ) from None


def flag(name: str, value: Any) -> bool:
    """Return `value` as true or false."""
    if not isinstance(value, (bool, np.bool_)):
        raise SceneError(f"{name} must be true or false, got {shown(value)}")
    return bool(value)


def parts_of(value: Any) -> tuple[Any, ...] | None:
    """Return the items of an iterable as a tuple; None for a text, a class and a value that is not iterable.

    >>> parts_of(np.array(5.0)) is None, parts_of([1, 2])
    (True, (1, 2))
    """
    if isinstance(value, (str, bytes, type)):
        return None
    try:
        return tuple(value)
    except Exception:  # an array without axes, or an object with errors
        return None


def list_of(name: str, value: Any, expected: str, *one: type[Any]) -> tuple[Any, ...]:
    """Return `value` as a tuple; refuse an instance of the class `one`, which may be iterable itself."""
    given = None if isinstance(value, one) else parts_of(value)
    if given is None:
        raise SceneError(f"{name} must be a list of {expected}, got {shown(value)}{brackets(value)}")
    return given


def brackets(value: Any) -> str:
    """Return a hint if a class was given in place of an object, or an empty text.

    >>> brackets(float)
    '; to make one of the class, call it: float(...)'
    """
    return f"; to make one of the class, call it: {value.__name__}(...)" if isinstance(value, type) else ""


def entries(name: str, value: Any, count: int, expected: str) -> tuple[Any, ...]:
    """Return `value` as a tuple of `count` parts; `expected` describes them."""
    try:
        # One more than expected, to refuse an endless iterable.
        parts = tuple(itertools.islice(value, count + 1))
    except Exception:  # it has no parts, or is an object with errors
        raise SceneError(f"{name} must be {expected}, got {shown(value)}") from None
    if len(parts) != count:
        came = len(value) if isinstance(value, (list, tuple)) else len(parts) if len(parts) < count else "more"
        raise SceneError(f"{name} must be {expected}, got {came}: {shown(value)}")
    return parts


def vector(name: str, value: Any) -> Vector:
    """Return `value` as three finite floats."""
    if isinstance(value, (str, bytes)):
        raise SceneError(f"{name} must be three numbers, got {shown(value)}")
    x, y, z = (number(f"{name}[{i}]", part) for i, part in enumerate(entries(name, value, 3, "three numbers")))
    return x, y, z


def three_lengths(name: str, value: Any) -> Vector:
    """Return `value` as three lengths [m] above zero."""
    x, y, z = (length(f"{name}[{i}]", part) for i, part in enumerate(vector(name, value)))
    return x, y, z


def array(name: str, value: ArrayLike) -> NDArray[np.float64]:
    """Return `value` as an array of floats."""
    parts = value if isinstance(value, (list, tuple)) else (value,)
    if any(map(is_masked, parts)):
        raise SceneError(f"{name} must be an array without a mask, got a masked one; remove or fill the masked entries")
    try:
        given = np.asarray(value)
        if given.dtype.kind not in "iufO":
            raise TypeError
        # A broadcast view of one number can have any shape: it is not copied if it would not fit.
        if _DOUBLE * given.size <= memory():
            return given.astype(np.float64, copy=False)
    except Exception:  # of float(), or of an object with errors
        came = value.dtype.name if isinstance(value, np.ndarray) else type(value).__name__
        raise SceneError(f"{name} must be an array of numbers, got {came}") from None
    raise _too_large(name, f", got shape {given.shape}, which takes", _DOUBLE * given.size)


def one_of(name: str, value: Any, choices: Iterable[str]) -> str:
    """Return `value` if it is one of `choices`; otherwise the error names the closest choice."""
    known = list(choices)
    if isinstance(value, str) and value in known:
        return value
    raise SceneError(f"{name} must be one of {listed(known)}, got {shown(value)}{closest(value, known)}")


def closest(value: Any, known: Iterable[str]) -> str:
    """Return the hint "; did you mean ...?" with a synonym or the most similar name, or an empty text.

    >>> closest("mu", ("restitution", "friction")), closest("raduis", ("radius", "center")), closest("x", ("radius",))
    ("; did you mean 'friction'?", "; did you mean 'radius'?", '')
    """
    text, names = value if isinstance(value, str) else shown(value), list(known)
    found = [name for name in names if text.lower() in _OTHER_WORDS.get(name, "").split()]
    found += difflib.get_close_matches(text, names, n=1, cutoff=_SIMILAR)
    return f"; did you mean {found[0]!r}?" if found else ""


def known_keys(where: str, table: Iterable[str], known: Collection[str], hints: Mapping[str, str] = {}) -> None:
    """Raise a `SceneError` for an unknown key of a table; `hints` are for keys that belong to other tables.

    >>> known_keys("run.", {"untill": 1.0}, ("until", "every"))
    Traceback (most recent call last):
    swarm.errors.SceneError: run.untill: unknown key, expected 'until' and 'every'; did you mean 'until'?
    """
    for key in table:
        if key not in known:
            hint = hints.get(key) or closest(key, known)
            raise SceneError(f"{where}{key}: unknown key, expected {listed(known) or 'none'}{hint}")


def located(where: str, error: object) -> str:
    """Return a message about a part after its place, joined by a dot if it begins with an argument.

    >>> located("surface[0]", "radius must be above 0"), located("surface[0]", "cannot read the mesh part.stl")
    ('surface[0].radius must be above 0', 'surface[0]: cannot read the mesh part.stl')
    """
    return f"{where}{'.' if _ARGUMENT.match(str(error)) else ': '}{error}"


def listed(names: Iterable[str]) -> str:
    """Return the names in quotes, joined by commas and "and": 'a', 'b' and 'c'."""
    quoted = [repr(name) for name in names]
    return " and ".join([", ".join(quoted[:-1]), quoted[-1]]) if len(quoted) > 1 else "".join(quoted)
