"""Fig. 13: the particle's path in State I with a = 1: 20 free steps, the contact step along a chord, and away."""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import swarm

from ..page import page
from .cases import DT, PENALTY, SPHERE, Floats, history, state_i
from .table import Row

FILE = "fig_13_trajectory.png"
STEPS_AFTER = 30


class Numbers(NamedTuple):
    """Positions at the ends of steps, and the two of the contact step among them."""

    path: Floats
    contact: Floats
    velocity_before: Floats
    velocity_after: Floats


def numbers() -> Numbers:
    """Free steps, one contact step, free steps."""
    start = state_i()
    loop = history(SPHERE, start, swarm.AugmentedLagrangian(DT, PENALTY))
    before, after = np.arange(-start.steps, 1)[:, None], np.arange(STEPS_AFTER + 1)[:, None]
    velocity, position = loop.velocity[-1], loop.position[-1]
    path = np.concatenate([start.position + before * DT * start.velocity, position + after * DT * velocity])
    return Numbers(path, np.array([start.position, position]), start.velocity, velocity)


def angles(numbers: Numbers) -> tuple[float, float]:
    """Angles [degrees] of the path before and after the contact with the normal of the chord."""
    normal = numbers.contact.sum(axis=0)
    normal /= np.linalg.norm(normal)
    cosines = [abs(v @ normal) / np.linalg.norm(v) for v in (numbers.velocity_before, numbers.velocity_after)]
    return float(np.degrees(np.arccos(cosines[0]))), float(np.degrees(np.arccos(cosines[1])))


def draw(numbers: Numbers, folder: Path) -> Path:
    """The path in the cavity, and the contact step magnified."""
    file = folder / FILE
    with page(
        file, "Fig. 13: steps to the wall, one along a chord of it, and away at the same angle", 1, 2, (9.0, 4.4)
    ) as (whole, near):
        for axes in (whole, near):
            _path(axes, numbers)
            axes.set(xlabel="x [m]", ylabel="y [m]", aspect="equal")
        whole.set(title="path of the particle", xlim=(-0.55, 0.55), ylim=(-0.55, 0.55))
        x, y = numbers.contact.mean(axis=0)[:2]
        near.set(title="the contact step", xlim=(x - 0.03, x + 0.03), ylim=(y - 0.03, y + 0.03))
        near.legend(loc="upper right")
    return file


def _path(axes: Any, numbers: Numbers) -> None:
    from swarm.pictures.style import BLUE, CAVITY_LINE, RED

    angle = np.linspace(0.0, 2.0 * np.pi, 2001)
    axes.plot(0.5 * np.cos(angle), 0.5 * np.sin(angle), color=CAVITY_LINE, label="wall of the sphere")
    axes.plot(*numbers.path.T[:2], color=BLUE, marker="o", markersize=2.0, label="free steps")
    axes.plot(*numbers.contact.T[:2], color=RED, marker="o", label="contact step")


def rows(numbers: Numbers) -> list[Row]:
    """The law of reflection, about the middle of the chord."""
    before, after = angles(numbers)
    return [Row("Fig. 13: angle of incidence, of reflection", "-", f"{before:.3f}°, {after:.3f}°")]
