"""Uzawa's loop (8) of one contact: sweeps and rate over the exponent, the gap before it and the stiffness.

In State I the step begins on the wall (gap 0), in State II before it: the gap is a part of the way along the normal.
"""

import math
from collections.abc import Sequence

import numpy as np

import swarm

from .. import figure
from . import picture
from .picture import Cell

SCENE = swarm.Scene([swarm.Sphere(0.5)])
SPEED, DT = 0.5, 2.0**-10
# Where neither the exponent nor the stiffness is the axis.
STIFFNESS, EXPONENT, GAP = 2.5, 1.0, 0.0
_STIFFNESS = tuple(10.0 ** (k / 2.0) for k in range(-3, 5))
_EXPONENTS = (1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0)
_GAPS = (0.0, 1e-12, 1e-9, 1e-6, 1e-3, 1e-2, 0.1, 0.3, 0.6, 0.9)
_SWEEPS = 200


def cell(exponent: float, gap: float, stiffness: float) -> Cell:
    """One contact at 45 degrees; no sweeps are enough (infinite) where the loop does not end."""
    normal = SPEED * math.sqrt(0.5)
    depth = normal * DT / stiffness
    penalty = (exponent + 1.0) * normal**2 / (2.0 * depth ** (exponent + 1.0))
    # V falls to 1e-20 of the kinetic energy.
    method = swarm.AugmentedLagrangian(
        DT, penalty, exponent=exponent, tolerance=1e-20 * 0.5 * SPEED**2, max_sweeps=_SWEEPS, on_unconverged="count"
    )
    start = (0.5 - gap * normal * DT, 0.0, 0.0)
    history = swarm.contact_history(SCENE, start, (normal, normal, 0.0), 1.0, method)
    stored = history.stored_energy[history.stored_energy > 0.0]
    # V is the square of what converges.
    ratios = np.sqrt(stored[1:] / stored[:-1])
    return {
        "exponent": exponent,
        "gap": gap,
        "stiffness": stiffness,
        "sweeps": float(len(history)) if history.converged else math.inf,
        "left": float(history.stored_energy[-1]) / (0.5 * SPEED**2),
        "rate": float(np.median(ratios[len(ratios) // 2 :])) if len(ratios) else 0.0,
        "last_multiplier_over_first": float(history.multiplier[-1] / history.multiplier[1])
        if len(history) > 1
        else 1.0,
    }


def measure(quick: bool) -> list[Cell]:
    """Three planes through (exponent, gap, stiffness); quick: the corners of one."""
    if quick:
        return [cell(exponent, gap, STIFFNESS) for exponent in (1.0, 2.0) for gap in (0.0, 0.3)]
    planes = [(a, g, STIFFNESS) for a in _EXPONENTS for g in _GAPS]
    planes += [(EXPONENT, g, s) for g in _GAPS for s in _STIFFNESS]
    planes += [(a, GAP, s) for a in _EXPONENTS for s in _STIFFNESS]
    return [cell(*one) for one in dict.fromkeys(planes)]


def told(cells: Sequence[Cell]) -> list[str]:
    """What converges, and what does not."""
    first = [c for c in cells if c["exponent"] == 1.0 and c["gap"] == 0.0]
    others = [c for c in cells if c not in first]
    ended = [c["sweeps"] for c in first if math.isfinite(c["sweeps"])]
    grown = max(c["last_multiplier_over_first"] for c in others)
    return [
        f"State I with exponent 1: {len(ended)} of {len(first)} converge, "
        f"in {min(ended):.0f} to {max(ended):.0f} sweeps",
        f"elsewhere: {sum(math.isfinite(c['sweeps']) for c in others)} of {len(others)} converge within {_SWEEPS} "
        f"sweeps; the multiplier grows up to {grown:.3g}-fold",
    ]


def draw(cells: Sequence[Cell]) -> None:
    """The energy that is left over one plane, sweeps over the next, the rate over the third."""
    drawn, panels = figure.subplots(3, 11.0, 4.4)
    names = {
        "gap": "gap before contact / normal way of the step",
        "exponent": "exponent a",
        "stiffness": picture.OMEGA,
    }
    planes = (
        ("gap", "exponent", "left", {"stiffness": STIFFNESS}, rf"V left / kinetic energy, $\Omega$ = {STIFFNESS:g}"),
        ("gap", "stiffness", "sweeps", {"exponent": EXPONENT}, "sweeps, a = 1"),
        ("stiffness", "exponent", "rate", {"gap": GAP}, r"rate: $\sqrt{V}$ over that of the sweep before, State I"),
    )
    scales = {"left": (-20.0, 0.0), "sweeps": (0.0, math.log10(_SWEEPS)), "rate": (-2.0, 0.0)}
    for axes, (x, y, value, fixed, title) in zip(panels, planes, strict=True):
        ((key, number),) = fixed.items()
        columns, rows, values = picture.table([c for c in cells if c[key] == number], x, y, value)
        image = picture.heat(axes, [f"{c:.2g}" for c in columns], [f"{r:.3g}" for r in rows], values, *scales[value])
        wording = {"left": lambda one: f"{math.log10(one):.0f}", "sweeps": "{:.0f}".format, "rate": "{:.1f}".format}
        picture.words(axes, image, values, wording[value])
        axes.set(xlabel=names[x], ylabel=names[y])
        axes.set_title(title, fontsize=9)
        axes.tick_params(axis="x", rotation=60)
        drawn.colorbar(image, ax=axes, label=r"$\log_{10}$" + f" of {title.split(',')[0].split(':')[0]}")
    drawn.suptitle(f"Uzawa's loop converges where a = 1 and the step begins at the wall (x: not in {_SWEEPS} sweeps)")
    picture.save(drawn, cells, "uzawa")
