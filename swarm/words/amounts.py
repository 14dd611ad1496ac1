"""Numbers as readers expect them: with units and prefixes, grouped digits, words for small numbers."""

import math
from collections.abc import Sequence

_PREFIXES = {-12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G", 12: "T"}
_SMALL = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten")
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
# Numbers from this one on keep their unit: 0.5 m, not 500 mm.
_LEAST_WHOLE = 0.1


def many(count: float) -> str:
    """A number with its digits in groups from 10 000 on.

    >>> many(5000), many(10_000), many(2_500_000)
    ('5000', '10 000', '2 500 000')
    """
    return f"{int(count)}" if abs(count) < 10_000 else f"{int(count):,}".replace(",", " ")


def counted(count: int, noun: str) -> str:
    """A number of things, in digits.

    >>> counted(1, "ball"), counted(2, "ball")
    ('1 ball', '2 balls')
    """
    return f"{many(count)} {noun if count == 1 else plural_of(noun)}"


def counted_in_words(count: int, noun: str) -> str:
    """A number of things, small ones in words.

    >>> counted_in_words(2, "ball"), counted_in_words(78, "peg"), counted_in_words(1, "egg")
    ('two balls', '78 pegs', 'an egg')
    """
    if count == 1:
        return one(noun)
    return f"{_SMALL[count]} {plural_of(noun)}" if count < len(_SMALL) else counted(count, noun)


def one(noun: str) -> str:
    """A noun with its article."""
    return f"{'an' if noun[:1].lower() in 'aeio' and not noun.startswith('one') else 'a'} {noun}"


def plural_of(noun: str) -> str:
    """The plural of a noun: "blocks of stone" for "block of stone"."""
    first, of, rest = noun.partition(" of ")
    if first.endswith("hedron"):
        return f"{first[:-2]}a{of}{rest}"
    if first.endswith(("x", "s", "sh", "ch")):
        return f"{first}es{of}{rest}"
    if first.endswith("y") and first[-2:-1] not in "aeiou":
        return f"{first[:-1]}ies{of}{rest}"
    return f"{first}s{of}{rest}"


def plain(value: float, digits: int = 4) -> str:
    """A number without a unit, its power of ten raised.

    >>> plain(0.25), plain(6.7e-16, 2), plain(1e5)
    ('0.25', '6.7·10⁻¹⁶', '100 000')
    """
    if not math.isfinite(value):
        return {math.inf: "infinite", -math.inf: "minus infinity"}.get(value, "not a number")
    if value == int(value) and abs(value) < 1e7:
        return many(value)
    value = float(f"{value:.{digits}g}")
    if 1e-3 <= abs(value) < 1e4:
        return f"{value:g}"
    mantissa, _, exponent = f"{value:.{digits - 1}e}".partition("e")
    if "." in mantissa:
        mantissa = mantissa.rstrip("0").rstrip(".")
    raised = f"10{str(int(exponent)).translate(_RAISED)}"
    return {"1": raised, "-1": f"-{raised}"}.get(mantissa, f"{mantissa}·{raised}")


def amount(value: float, unit: str, digits: int = 4) -> str:
    """A number with its unit and the prefix that readers expect.

    >>> amount(0.005, "m"), amount(2e-5, "m"), amount(3000.0, "m"), amount(0.5, "m"), amount(2.8e-4, "kg")
    ('5 mm', '20 µm', '3 km', '0.5 m', '0.28 g')
    >>> amount(4.14e-21, "J"), amount(0.0, "s"), amount(9.81, "m/s²")
    ('4.14·10⁻²¹ J', '0 s', '9.81 m/s²')
    """
    return amounts([value], unit, digits)


def amounts(values: Sequence[float], unit: str, digits: int = 4) -> str:
    """Numbers with one unit, and the prefix of the largest.

    >>> amounts([0.002, 0.03], "m"), amounts([0.5, 0.5, 0.7], "m")
    ('2 and 30 mm', '0.5, 0.5 and 0.7 m')
    >>> amount(9.996e-7, "m", 2)
    '1 µm'
    """
    largest = max((abs(value) for value in values if math.isfinite(value)), default=0.0)
    factor, written = prefixed(float(f"{largest:.{digits}g}"), unit)
    texts = [plain(float(f"{value * factor:.12g}"), digits) for value in values]
    return f"{listed(texts)} {written}"


def prefixed(size: float, unit: str) -> tuple[float, str]:
    """The factor of numbers of this size and the unit with its prefix; powers of a unit have no prefix."""
    if unit == "kg":
        return (1.0, unit) if size >= _LEAST_WHOLE or size == 0.0 else _of_prefixes(size * 1e3, "g", 1e3)
    if size == 0.0 or "²" in unit.partition("/")[0] or "³" in unit or not unit or unit.startswith("1"):
        return 1.0, unit
    return _of_prefixes(size, unit, 1.0)


def _of_prefixes(size: float, unit: str, factor: float) -> tuple[float, str]:
    size = float(f"{size:.4g}")
    power = 0 if _LEAST_WHOLE <= size < 1e3 else 3 * math.floor(math.log10(size) / 3.0 + 1e-12)
    # Seconds take no prefix above 1, masses from 1 kg on are in kg, and prefixes outside of `_PREFIXES` are not used.
    if power not in _PREFIXES or (power > 0 and unit == "s") or (unit == "g" and power > 0):
        return (1e-3 * factor, "kg") if unit == "g" else (1.0, unit)
    return factor * 10.0**-power, f"{_PREFIXES[power]}{unit}"


def listed(texts: Sequence[str]) -> str:
    """Texts as a list in a sentence.

    >>> listed(["a", "b", "c"]), listed(["a"])
    ('a, b and c', 'a')
    """
    return texts[0] if len(texts) == 1 else f"{', '.join(texts[:-1])} and {texts[-1]}" if texts else ""


def place(point: Sequence[float]) -> str:
    """A point, or a displacement, with its unit.

    >>> place((0.0, 0.0, -0.1)), place((0.0, 0.0, 0.002))
    ('(0, 0, -0.1) m', '(0, 0, 2) mm')
    """
    factor, written = prefixed(max(map(abs, point)), "m")
    return f"({', '.join(plain(float(f'{part * factor:.12g}')) for part in point)}) {written}"


def direction(vector: Sequence[float]) -> str:
    """A direction; an axis has its name.

    >>> direction((0.0, 0.0, -2.0)), direction((1.0, 1.0, 0.0))
    ('-z', '(0.7071, 0.7071, 0)')
    """
    length = math.sqrt(sum(part * part for part in vector)) or 1.0
    unit = [part / length for part in vector]
    for name, part in zip("xyz", unit, strict=True):
        if abs(part) > 1.0 - 1e-12:
            return name if part > 0.0 else f"-{name}"
    return f"({', '.join(plain(round(part, 4)) for part in unit)})"
