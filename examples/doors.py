"""Doors: a shutter that goes, a valve that opens for a while, and a door between two rooms.

    python -m examples.doors

`shutter.png`: a gas in one half of a vessel, behind a wall that is `present` until it goes; then a valve is open for a
time, and the gas leaves at the rate n v A/4. `doors.png`: two rooms, which are a union, and a door between them, which
opens: what flows through it makes their densities equal.
"""

import math
import tempfile
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import swarm

from .asked import Asked

# k_B T [J] of particles of mass 1 kg, and their mean speed.
TEMPERATURE = 1.0
MEAN_SPEED = math.sqrt(8.0 * TEMPERATURE / math.pi)
HALF, HOLE, BALL = 0.5, 0.04, 0.15
WARM: Any = {"temperature": TEMPERATURE}
AREA = math.pi * HOLE**2


class Flow(NamedTuple):
    """What a run shows, frame by frame: a part of the particles, its standard error, and the law."""

    time: np.ndarray
    part: np.ndarray
    error: np.ndarray
    law: np.ndarray
    shown: list[np.ndarray]  # x, y and z of the particles at the times `at`
    at: list[float]


def shutter(count: int, goes: float = 1.0, valve: tuple[float, float] = (20.0, 140.0), until: float = 180.0) -> Flow:
    """A vessel of which a shutter keeps one half empty, and then a valve lets out: the part that is inside."""
    opening = swarm.Opening(swarm.Sphere(HOLE, center=(HALF, 0.2, 0.3)), times=[valve])
    walls = swarm.Box((HALF, HALF, HALF), openings=[opening], **WARM)
    balls = [swarm.Sphere(BALL, center=(x, 0.0, 0.0), side="outside") for x in (-0.25, 0.25)]
    scene = swarm.Scene([walls, *balls, swarm.Plane((1.0, 0.0, 0.0), 0.0, present=[(0.0, goes)])])
    start = swarm.fill(scene, count, temperature=TEMPERATURE, seed=1)
    result = swarm.simulate(scene, start, swarm.Impact(), until=until, every=until / 45.0, seed=2)
    time = result.observables["time"]
    rate = MEAN_SPEED * AREA / (4.0 * ((2.0 * HALF) ** 3 - 2.0 * 4.0 / 3.0 * math.pi * BALL**3))
    law = np.exp(-rate * (np.clip(time, *valve) - valve[0]))
    return _flow(time, 1.0 - result.observables["escaped"] / count, law, (scene, start, [goes, goes + 0.15]))


def door(count: int, opens: float = 5.0, until: float = 200.0) -> Flow:
    """Two rooms and a door between them, of which the larger one is full at the start: the part that is in it."""
    left = swarm.Box((HALF, HALF, HALF), center=(-HALF, 0.0, 0.0), **WARM)
    right = swarm.Box((0.5 * HALF, HALF, HALF), center=(0.5 * HALF, 0.0, 0.0), **WARM)
    way = swarm.Opening(swarm.Sphere(HOLE), times=[(opens, math.inf)], between=True)
    scene = swarm.Scene([swarm.Union([left, right], openings=[way])])
    start = swarm.fill(swarm.Scene([left]), count, temperature=TEMPERATURE, seed=1)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "door.h5"
        swarm.simulate(scene, start, swarm.Impact(), until=until, every=until / 40.0, seed=2, trajectory=path)
        with swarm.load(path) as trajectory:
            time = trajectory.times
            part = np.array([(trajectory.frame(k).position[0] < 0.0).mean() for k in range(len(time))])
    # Of rooms of 1 and 1/2 m^3: dN/dt = -k N + 2 k (n - N)
    law = (2.0 + np.exp(-3.0 * MEAN_SPEED * AREA / 4.0 * np.clip(time - opens, 0.0, None))) / 3.0
    return _flow(time, part, law, (scene, start, [opens, until]))


def _flow(time: np.ndarray, part: np.ndarray, law: np.ndarray, run: Any) -> Flow:
    scene, start, at = run
    ends = [swarm.simulate(scene, start, swarm.Impact(), until=end, seed=2).particles.position for end in at]
    return Flow(time, part, np.sqrt(law * (1.0 - law) / len(start)), law, ends, at)


def draw(flow: Flow, file: Path, lines: list[list[tuple[float, float]]], names: tuple[str, ...]) -> None:
    """The particles at two times, seen along z, between walls; and the part over time."""
    from .paper.plotting import BLUE, GREY, RED, page

    title, label, *captions = names
    with page(file, title, 1, 3, (11.0, 3.5)) as axes:
        for one, points, caption in zip(axes, flow.shown, captions, strict=False):
            some = slice(None, None, max(1, points.shape[1] // 4000))
            one.plot(points[0, some], points[1, some], ".", color=BLUE, markersize=1.0)
            for line in lines:
                one.plot(*zip(*line, strict=True), color="black", linewidth=1.5)
            one.set(title=caption, aspect="equal", xlabel="x [m]", ylabel="y [m]")
            one.grid(visible=False)
        axes[2].plot(flow.time, flow.law, color=GREY, linewidth=0.8, label="law")
        axes[2].errorbar(flow.time, flow.part, flow.error, fmt=".", color=RED, label="run")
        axes[2].set(xlabel="time [s]", ylabel=label)
        axes[2].legend()


def main() -> None:
    """Run, draw and print."""
    ask = Asked(__doc__, "doors.png", "plot")
    ask.add_argument("--particles", type=int, default=20_000)
    asked = ask.parse_args()
    half = [(-HALF, -HALF), (HALF, -HALF), (HALF, HALF), (-HALF, HALF), (-HALF, -HALF)]
    rooms = [[(x * HALF, y * HALF) for x, y in ((0, -1), (-2, -1), (-2, 1), (0, 1))],
             [(x * HALF, y * HALF) for x, y in ((0, 1), (1, 1), (1, -1), (0, -1))],
             [(0.0, -HALF), (0.0, -HOLE)], [(0.0, HOLE), (0.0, HALF)]]  # fmt: skip
    shut, opened = shutter(asked.particles), door(asked.particles)
    captions = "at 1 s, as the shutter goes", "0.15 s later"
    title = "A shutter, and a valve that is open from 20 to 140 s"
    file = asked.output.with_name("shutter.png")
    draw(shut, file, [half], (title, "part of the particles inside", *captions))
    captions = "at 5 s, as the door opens", "at 200 s"
    title = "A door between two rooms"
    draw(opened, asked.output, rooms, (title, "part of the particles in the left room", *captions))
    for name, flow in (("through the valve", shut), ("through the door", opened)):
        off = np.abs(flow.part - flow.law)[flow.error > 0.0] / flow.error[flow.error > 0.0]
        print(
            f"{name}: {flow.part[-1]:.4f} ({flow.law[-1]:.4f} by the law), at most {off.max():.1f} standard errors off"
        )
    print(f"written {file} and {asked.output}")


if __name__ == "__main__":
    main()
