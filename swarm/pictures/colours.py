"""Colours of particles by speed or by energy error: from dark blue for small to orange for large values."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .. import observables
from ..errors import SceneError
from ..kernel.limits import TINY
from ..methods.base import Method
from ..particles import Particles
from ..scene import Scene
from ..state import Floats

Colours = NDArray[np.uint32]
Values = Callable[[Floats, Floats], Floats]

BACKGROUND = (255, 255, 255)

# Plasma (https://bids.github.io/colormap) from 6 % to 80 %: all of it is visible on a light and on a dark background.
# It goes from dark to light with every kind of colour vision.
_TABLE = np.array(
    [
        (47, 5, 150), (83, 2, 163), (116, 1, 168), (146, 15, 163), (173, 39, 147),
        (196, 62, 127), (215, 86, 108), (231, 111, 90), (244, 137, 72), (252, 166, 54),
    ],
    dtype=np.float64,
)  # fmt: skip
# The palette of Okabe and Ito, distinct with every kind of colour vision; also in look.mplstyle.
BLUE, RED, GREEN, PINK, ORANGE, SKY = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9"
CURVES = (BLUE, RED, GREEN, PINK, ORANGE, SKY)
# The sum of all, on an unknown background: this grey is visible on a light and on a dark one.
SUM, _PURPLE, _BROWN = "#8A8A8A", "#5E3C99", "#8C510A"
# The colour of an energy in every picture, by the beginning of its curve's name. The total has the colour of text.
ENERGIES = {
    "kinetic": BLUE, "rotational": SKY, "potential": GREEN, "contact": PINK, "elastic": PINK, "dissipated": RED,
    "brought by": ORANGE, "work of": _PURPLE, "energy of": _BROWN,
}  # fmt: skip
# Walls of a cavity, and solids: their faces and their lines.
CAVITY, CAVITY_LINE = "#C9D6E2", "#6F8296"
SOLID, SOLID_LINE = "#E3C9A8", "#A5733C"
_STEPS = 256
# The scale ends at this multiple of the speed of the mean energy at the start.
_FASTER = 1.5
# log10 of the relative energy errors at the ends of the scale.
_DECADES = (-16.0, -6.0)


@dataclass(frozen=True)
class Scale:
    """The meaning of colours: the quantity with its unit, and its values at both ends."""

    quantity: str
    low: float
    high: float

    def colours(self, values: Floats) -> Colours:
        """The colours of values as 0xRRGGBBAA; transparent for NaN, which marks absent particles."""
        steps = (values - self.low) * (_STEPS / (self.high - self.low))
        absent = np.isnan(steps)
        if absent.any():
            steps = np.where(absent, 0.0, steps)
        places: NDArray[np.intp] = np.clip(steps, 0.0, _STEPS - 1.0).astype(np.intp)
        return np.where(absent, np.uint32(0), _PACKED[places])


def curve_colour(name: str, k: int, total: str = SUM) -> str:
    """The colour of curve k of a plot, by its name if it is an energy.

    >>> curve_colour("kinetic", 3), curve_colour("ball", 1), curve_colour("total", 0, "black")
    ('#0072B2', '#D55E00', 'black')
    """
    if name.startswith("total"):
        return total
    return next((colour for begin, colour in ENERGIES.items() if name.startswith(begin)), CURVES[k % len(CURVES)])


def rgb(colour: str) -> tuple[int, int, int]:
    """Red, green and blue from 0 to 255 of "#RRGGBB"."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


def table() -> Floats:
    """Red, green and blue from 0 to 1, from the lowest value to the highest: (256, 3)."""
    places = np.linspace(0.0, len(_TABLE) - 1.0, _STEPS)
    return np.stack([np.interp(places, np.arange(len(_TABLE)), part) for part in _TABLE.T], axis=1) / 255.0


_RED, _GREEN, _BLUE = np.rint(table().T * 255.0).astype(np.uint32)
_PACKED: Colours = _RED << 24 | _GREEN << 16 | _BLUE << 8 | 0xFF


def named(quantity: str) -> tuple[str, str]:
    """The name and the unit of a quantity such as "speed [m/s]"."""
    name, _, unit = quantity.rstrip("]").partition(" [")
    return name, unit


def by_speed(scene: Scene, method: Method, start: Particles, last: Particles) -> tuple[Scale, Values]:
    """The scale of speeds in a run, and the speed as a function of positions and velocities (3, N).

    The first frame of a run with sources may hold no particle: the scale is then made from the last frame.
    """
    return colouring("speed", scene, method, last if np.isnan(start.position[0]).any() else start)


def colouring(by: str, scene: Scene, method: Method, start: Particles) -> tuple[Scale, Values]:
    """The scale of a quantity, and the quantity as a function of positions and velocities (3, N).

    Raises:
        SceneError: energy errors are not defined because walls dissipate or give energy.
    """
    law = method.law()
    compiled = scene.compiled(apart=method.apart())
    at_start = observables.energies(compiled, law, start.mass, start.position, start.velocity)
    scale = observables.energy_scale(scene, at_start)
    if by == "speed":
        there = scale[~np.isnan(scale)]
        fastest = (_FASTER * math.sqrt(2.0 * there.mean()) if there.size else 0.0) or 1.0
        # Two digits are enough on a legend.
        fastest = float(f"{fastest:.1e}")
        return Scale("speed [m/s]", 0.0, fastest), lambda _position, velocity: np.sqrt((velocity**2).sum(axis=0))
    if scene.names_laws() or scene.compiled().laws is not None:
        raise SceneError(
            "record_color must be 'speed' where a surface has a restitution below 1, friction, a temperature, a motion "
            "or a mass, got 'energy-error': energy that walls dissipate or give is not an error"
        )
    if np.isnan(scale).any():
        raise SceneError(
            "record_color must be 'speed' of a trajectory with sources, got 'energy-error': its first frame lacks the "
            "energy of those that come later; record during the run"
        )
    before, inverse = at_start.total(), 1.0 / np.maximum(scale, TINY)

    def errors(position: Floats, velocity: Floats) -> Floats:
        now = observables.energies(compiled, law, start.mass, position, velocity).total()
        return np.asarray(np.log10(np.maximum(np.abs(now - before) * inverse, 10.0 ** _DECADES[0])))

    return Scale("log10 of the relative energy error", *_DECADES), errors
