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
from .page import law, page, solid

# k_B T [J] of particles of mass 1 kg, and their mean speed.
TEMPERATURE = 1.0
MEAN_SPEED = math.sqrt(8.0 * TEMPERATURE / math.pi)
HALF, HOLE, BALL = 0.5, 0.04, 0.15
# Pictures show the particles within this height of the middle [m].
SLAB = 0.12
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


def draw(flow: Flow, file: Path, names: tuple[str, ...], walls: Any, opened: tuple[float, float, str]) -> None:
    """The particles at two times, seen along z, between what `walls` draws; and the part over time."""
    from swarm.pictures.style import BLUE, ORANGE

    title, label, *captions = names
    since, until, what = opened
    with page(file, title, 1, 3, (11.0, 4.0)) as axes:
        for one, points, caption in zip(axes, flow.shown, captions, strict=False):
            slab = points[:2, np.abs(points[2]) < SLAB]
            one.plot(*slab[:, :2500], ".", color=BLUE, markersize=2.5, markeredgewidth=0.0)
            walls(one, one is axes[0])
            one.set(title=caption, aspect="equal", xlabel="x [m]", ylabel="y [m]")
            one.grid(visible=False)
            one.legend(loc="upper center", bbox_to_anchor=(0.5, -0.2))
        axes[2].axvspan(since, until, color=ORANGE, alpha=0.15, linewidth=0.0, label=what)
        law(axes[2], flow.time, flow.law, "law: n v A/4 pass a hole in a second")
        axes[2].errorbar(
            flow.time, flow.part, flow.error, fmt=".", color=BLUE, markersize=5, label="run, with standard errors"
        )
        axes[2].set(xlabel="time [s]", title=label, ylabel="part of all particles", xlim=(0.0, flow.time[-1]))
        axes[2].set_ylim(top=1.08)
        axes[2].legend()


def draw_vessel(axes: Any, shut: bool) -> None:
    """The section of the vessel at z = 0, with its shutter if that is there."""
    from swarm.pictures.style import CAVITY_LINE, ORANGE

    axes.plot(
        HALF * np.array([-1, 1, 1, -1, -1]), HALF * np.array([-1, -1, 1, 1, -1]), color=CAVITY_LINE, linewidth=2.0
    )
    for x in (-0.25, 0.25):
        solid(axes, (x, 0.0), BALL)
    dashes = {} if shut else {"linestyle": ":", "linewidth": 1.0}
    axes.plot(
        [0.0, 0.0],
        [-HALF, HALF],
        color=ORANGE,
        label="shutter" if shut else "where it was",
        **{"linewidth": 2.5, **dashes},
    )


def draw_rooms(axes: Any, shut: bool) -> None:
    """The section of the rooms at z = 0, with the door."""
    from swarm.pictures.style import CAVITY_LINE, ORANGE

    low, high = -2.0 * HALF, HALF
    axes.plot([low, high, high, low, low], [-HALF, -HALF, HALF, HALF, -HALF], color=CAVITY_LINE, linewidth=2.0)
    for side in (-1.0, 1.0):
        axes.plot([0.0, 0.0], [side * HOLE, side * HALF], color=CAVITY_LINE, linewidth=2.0)
    axes.plot(
        [0.0, 0.0], [-HOLE, HOLE], color=ORANGE, linewidth=4.0 if shut else 1.5, linestyle="-" if shut else ":",
        label="door" if shut else "door, open",
    )  # fmt: skip


def main() -> None:
    """Run, draw and print."""
    ask = Asked(__doc__, "doors.png", "plot")
    ask.add_argument("--particles", type=int, default=20_000)
    asked = ask.parse_args()
    shut, opened = shutter(asked.particles), door(asked.particles)
    title = "A gas behind a shutter fills the vessel once it is open; later a valve lets it out"
    captions = "in the vessel", "1 s, as the shutter goes", "0.15 s later: fast ones are there"
    file = asked.output.with_name("shutter.png")
    draw(shut, file, (title, *captions), draw_vessel, (20.0, 140.0, "valve is open"))
    title = "A door opens between a full room and an empty one of half its size: their densities become equal"
    captions = "in the left room", "5 s, as the door opens", "200 s"
    draw(opened, asked.output, (title, *captions), draw_rooms, (5.0, opened.time[-1], "door is open"))
    for name, flow in (("through the valve", shut), ("through the door", opened)):
        off = np.abs(flow.part - flow.law)[flow.error > 0.0] / flow.error[flow.error > 0.0]
        print(
            f"{name}: {flow.part[-1]:.4f} ({flow.law[-1]:.4f} by the law), at most {off.max():.1f} standard errors off"
        )
    print(f"written {file} and {asked.output}")


if __name__ == "__main__":
    main()
