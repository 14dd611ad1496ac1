"""The graphs of a sweep: each main observable against each parameter that varies, its mean and its spread."""

import re
from typing import Any

import numpy as np

from ..common.catalog import ERRORS, MAIN, NAMES, OBSERVABLES
from ..pages.pictures import PagePicture, svg
from ..pictures import style
from ..words.amounts import plain
from .folder import SweepFolder

# The largest number of graphs of a parameter, and of curves of another parameter in one.
_MOST, _CURVES = 6, 6
# Numbers that differ by a smaller part of the largest are equal; errors below the second value are round-off.
_SAME, _ROUND_OFF = 1e-9, 1e-12
_REPEATS = "seed"


def drawn(sweep: SweepFolder) -> list[tuple[str, list[PagePicture]]]:
    """The graphs of each parameter that varies."""
    names = main_observables(sweep)
    rows = [row for row in sweep.rows if row["state"] == "done"]
    if not rows:
        return []
    return [(key, [_graph(sweep, rows, key, name) for name in names]) for key in sweep.varying()] if names else []


def main_observables(sweep: SweepFolder) -> list[str]:
    """The most informative observables that differ between runs; user-defined ones come first."""
    columns = {name: _numbers([row.get(name) for row in sweep.rows]) for name in sweep.observables}
    columns = {name: values[np.isfinite(values)] for name, values in columns.items()}
    found = [name for name, values in columns.items() if len(values) and _differ(values)]
    found = [name for name in found if name not in ERRORS or columns[name].max() > _ROUND_OFF]
    own = [name for name in found if not any(name == known or name.startswith(f"{known}_") for known in NAMES)]
    main = sorted((name for name in found if _stem(name) in MAIN), key=lambda name: MAIN.index(_stem(name)))
    chosen: list[str] = []
    for name in [*own, *main]:
        # Without gravity the total energy is the kinetic energy.
        if not any(_alike(columns[name], columns[other]) for other in chosen):
            chosen.append(name)
    return chosen[:_MOST]


def _differ(values: Any) -> bool:
    return bool(np.ptp(values) > _SAME * np.abs(values).max())


def _alike(one: Any, other: Any) -> bool:
    return len(one) == len(other) and bool((np.abs(one - other) <= _SAME * np.abs(one).max()).all())


def worst(sweep: SweepFolder) -> list[tuple[str, str]]:
    """The largest error of the energy and the largest penetration of all runs that have them."""
    texts = []
    for name, what, unit in zip(ERRORS, ("largest error of the energy", "largest penetration"), ("", "m"), strict=True):
        values = {str(row["file"]): row[name] for row in sweep.rows if isinstance(row.get(name), (int, float))}
        if values:
            file = max(values, key=lambda file: values[file])
            of = unit or "of the worst particle's energy"
            texts.append((what, f"{plain(values[file], 2)} {of}, in {file}" if values[file] else "none"))
    return texts


def _stem(name: str) -> str:
    """The observable of a column, such as impulse for impulse_0, or crossings for crossings_0_1."""
    return next((known for known in MAIN if re.fullmatch(rf"{known}(_\d+)*", name)), "")


def _graph(sweep: SweepFolder, rows: list[dict[str, Any]], key: str, name: str) -> PagePicture:
    others = [one for one in sweep.varying() if one != key and not one.endswith(_REPEATS)]
    split = next((one for one in others if 1 < len({str(row[one]) for row in rows}) <= _CURVES), None)
    places, labels = _places([row[key] for row in rows])
    with style.applied():
        figure = style.picture(4.2, 2.9)
        axes = figure.subplots()
        groups = list(dict.fromkeys(str(row[split]) for row in rows)) if split else [""]
        for colour, group in zip(style.CURVES, groups, strict=False):
            mine = [k for k, row in enumerate(rows) if not split or str(row[split]) == group]
            _curve(axes, places[mine], _numbers([rows[k].get(name) for k in mine]), colour, group)
        if labels:
            axes.set_xticks(range(len(labels)), labels)
        elif (places == places.round()).all():
            from matplotlib.ticker import MaxNLocator

            axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        if split:
            # Beside the axes, where it covers no curve.
            axes.legend(title=split, fontsize=7.5, title_fontsize=7.5, loc="center left", bbox_to_anchor=(1.0, 0.5))
        axes.set_xlabel(key)
        unit = OBSERVABLES[_stem(name)].unit if _stem(name) else "1"
        axes.set_title(f"{name}{f' [{unit}]' * (unit != '1')}")
        return PagePicture(svg(figure, f"{name} against {key}"), "")


def _curve(axes: Any, places: Any, values: Any, colour: str, label: str) -> None:
    """Draw the mean at each place with the standard deviation of a run, and the runs."""
    known = np.isfinite(values)
    places, values = places[known], values[known]
    where = np.unique(places)
    mean = [values[places == x].mean() for x in where]
    spread = [values[places == x].std(ddof=1) if (places == x).sum() > 1 else 0.0 for x in where]
    axes.plot(places, values, ".", color=colour, alpha=0.35, markersize=3)
    axes.errorbar(where, mean, spread, color=colour, marker="o", label=label)


def _places(values: list[Any]) -> tuple[Any, list[str]]:
    """The positions of values on an axis, and their labels if they are not numbers."""
    if all(isinstance(value, (int, float)) and not isinstance(value, bool) for value in values):
        return np.array(values, np.float64), []
    texts = [str(value) for value in values]
    known = list(dict.fromkeys(texts))
    return np.array([known.index(text) for text in texts], np.float64), [f"{text:.12}" for text in known]


def _numbers(values: list[Any]) -> Any:
    return np.array([value if isinstance(value, (int, float)) else np.nan for value in values], np.float64)
