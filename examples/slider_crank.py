"""A slider-crank mechanism with a clearance at its pin: the paper's fig. 2, for hundreds of revolutions.

    python -m examples.slider_crank

A crank turns steadily, a rod follows it, and the rod's pin is in a round cavity of the slider, larger than the pin by
the clearance. The slider stays on its line; the pin is free in the cavity until it strikes or slides along its wall.
Dimensions and masses are those of Flores and Ambrosio (2004), Revolute joints with clearance in multibody systems.
"""

import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np

import swarm

from .asked import Asked
from .page import law, page

CRANK, ROD, CLEARANCE = 0.05, 0.12, 0.5e-3
ROD_MASS, SLIDER_MASS = 0.21, 0.14
RATE = 5000.0 / 60.0 * 2.0 * np.pi
# Steps of a revolution and frames of one.
STEPS, FRAMES = 1800, 360


class Motion(NamedTuple):
    """What pictures show, frame by frame."""

    time: np.ndarray
    pin: np.ndarray  # (3, T) in the cavity, from its centre [m]
    slider: np.ndarray  # (T,) [m]
    force: np.ndarray  # (T - 1,) of the cavity on the pin, mean of a frame [N]


def mechanism(restitution: float = 1.0) -> swarm.Body:
    """Crank pin, rod's pin and slider; the rod is light between its two masses."""
    across, up = swarm.Plane((0.0, 1.0, 0.0), 0.0), swarm.Plane((0.0, 0.0, 1.0), 0.0)
    cavity = swarm.Sphere(CLEARANCE, restitution=restitution)
    end = CRANK + ROD
    return swarm.Body(
        points=[(CRANK, 0.0, 0.0), (end, 0.0, 0.0), (end, 0.0, 0.0)],
        mass=[ROD_MASS / 2.0, ROD_MASS / 2.0, SLIDER_MASS],
        links=[(0, 1)],
        anchors={0: swarm.Rotation(axis=(0.0, 0.0, 1.0), rate=RATE, center=(0.0, 0.0, 0.0))},
        guides=[(2, across), (2, up)],
        cavities=[(cavity, 2, 1)],
        contacts=np.zeros((0, 3)),
    )


def ideal(time: np.ndarray) -> np.ndarray:
    """Where the slider is without a clearance [m]."""
    angle = RATE * time
    return CRANK * np.cos(angle) + np.sqrt(ROD**2 - (CRANK * np.sin(angle)) ** 2)


def simulate(start: swarm.Bodies, turns: int, frames: int, file: Path | None = None) -> swarm.Result:
    """So many turns, from an outer dead centre, with so many frames each."""
    turn = 2.0 * np.pi / RATE
    return swarm.simulate(
        swarm.Scene([swarm.Sphere(1.0)]), start, swarm.Impact(dt=turn / STEPS), until=turns * turn, every=turn / frames,
        trajectory=file, precision="float64",
    )  # fmt: skip


def run(revolutions: int, restitution: float = 1.0) -> tuple[swarm.Result, Motion]:
    """The mechanism with the velocities of the ideal one at the start, and two more revolutions frame by frame."""
    body = mechanism(restitution)
    velocity = np.zeros((3, 3, 1))
    velocity[1, 0] = CRANK * RATE
    long = simulate(swarm.Bodies(body, body.points.T[:, :, None], velocity), revolutions, 1)
    assert long.bodies is not None
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "mechanism.h5"
        seen = simulate(long.bodies, 2, FRAMES, file).observables
        with swarm.load(file) as trajectory:
            pin, slider = (trajectory.particle(point)[0] for point in (1, 2))
    force = np.diff(seen["cavity_impulse"][:, 0]) / np.diff(seen["time"])
    return long, Motion(seen["time"], pin - slider, slider[0], force)


def draw(motion: Motion, file: Path) -> None:
    """The pin's path in its cavity, the force, and the slider beside the ideal one."""
    from swarm.pictures.style import BLUE, CAVITY, CAVITY_LINE, GREEN, RED

    turns = motion.time * RATE / (2.0 * np.pi)
    title = "A pin that is loose by 0.5 mm in its joint rattles and slides: two turns of 5000 a minute"
    with page(file, title, 1, 3, (11.0, 3.9)) as axes:
        angle, wide = np.linspace(0.0, 2.0 * np.pi, 400), 1e3 * CLEARANCE
        circle = wide * np.cos(angle), wide * np.sin(angle)
        axes[0].fill(*circle, facecolor=CAVITY, edgecolor=CAVITY_LINE, alpha=0.6, label="cavity, less the pin")
        axes[0].plot(
            1e3 * motion.pin[0], 1e3 * motion.pin[1], ".-", color=BLUE, markersize=4.0, linewidth=0.5,
            label="the pin's centre, a dot a degree",
        )  # fmt: skip
        axes[0].set(title="the pin in its cavity", xlabel="x [mm]", ylabel="y [mm]", aspect="equal", ylim=(-0.75, 0.55))
        axes[0].legend(loc="lower center")
        axes[1].plot(turns[1:], 1e-3 * motion.force, color=RED)
        axes[1].set(title="contact force, mean of a degree", ylabel="force [kN]", ylim=(0.0, None))
        axes[2].plot(turns, 1e3 * (motion.slider - ideal(motion.time)), color=GREEN, label="run")
        for side in (-wide, wide):
            law(axes[2], None, side, "clearance" if side > 0.0 else None, "--")
        axes[2].set(title="slider, less that of a tight joint", ylabel="difference [mm]", ylim=(-0.55, 0.75))
        axes[2].legend(loc="upper right", ncols=2)
        for one in axes[1:]:
            one.set(xlabel="revolutions of the crank", xlim=(0.0, 2.0))


def main() -> None:
    """Run, draw and print."""
    ask = Asked(__doc__, "slider_crank.png", "plot")
    ask.add_argument("--revolutions", type=int, default=300)
    ask.add_argument("--restitution", type=float, default=0.9)
    asked = ask.parse_args()
    result, motion = run(asked.revolutions, asked.restitution)
    seen = result.observables
    print(
        f"{asked.revolutions} revolutions, {seen['impacts'][-1]} impacts, {seen['sliding_time'][-1]:.3g} s in contact"
    )
    print(f"work of the crank {seen['work'][-1]:.6g} J, {seen['dissipated_energy'][-1]:.6g} J lost in impacts")
    print(f"energy error {seen['energy_error'].max():.1e}, rod {seen['link_error'].max():.1e} of its length")
    print(f"largest force, mean of a degree, {motion.force.max():.4g} N")
    draw(motion, asked.output)
    print(f"written {asked.output}")


if __name__ == "__main__":
    main()
