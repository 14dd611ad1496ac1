"""Fig. 3: the regularised constraint Phi(g; a), eq. (2): with a corner at the surface for a = 1, smooth for a > 1."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from swarm.contact.regularisation import regularisation

from ..page import page
from .cases import Floats
from .table import Row

FILE = "fig_03_regularisation.png"
EXPONENTS = (1.0, 1.5, 2.0, 4.0)


class Numbers(NamedTuple):
    """Phi at gaps, a row an exponent, and its slope on the outside of the surface."""

    gaps: Floats
    values: Floats
    slopes_at_surface: Floats


def numbers() -> Numbers:
    """Phi of the engine's laws; alpha has no part in it."""
    gaps = np.linspace(-1.0, 1.5, 251)
    laws = [regularisation(1.0, a) for a in EXPONENTS]
    values = np.array([[law.constraint(g) for g in gaps] for law in laws])
    return Numbers(gaps, values, np.array([law.constraint_gradient(np.float64(0.0)) for law in laws]))


def draw(numbers: Numbers, folder: Path) -> Path:
    """Phi over g."""
    from swarm.pictures.style import BLUE, GREEN, PINK, RED

    file = folder / FILE
    with page(file, "Fig. 3: the constraint has a corner for a = 1") as (axes,):
        for a, values, colour in zip(EXPONENTS, numbers.values, (BLUE, RED, GREEN, PINK), strict=True):
            axes.plot(numbers.gaps, values, color=colour, label=f"a = {a:g}")
        axes.set(xlabel="gap g [m], outside for g > 0", ylabel="Φ(g; a) [m$^{(a+1)/2}$]")
        axes.legend(loc="upper left")
    return file


def rows(numbers: Numbers) -> list[Row]:
    """The slope on the outside of the surface: with it the multiplier has a force at Phi1 = 0, without it none."""
    paper = ["1", *["0"] * (len(EXPONENTS) - 1)]
    slopes = zip(EXPONENTS, paper, numbers.slopes_at_surface, strict=True)
    return [Row(f"Fig. 3: Φ'(0+) for a = {a:g}", told, f"{slope:g}") for a, told, slope in slopes]
