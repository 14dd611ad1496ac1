"""A maze: how long particles that bounce through it need to its exit.

    python -m examples.maze

The scene is `examples/scenes/maze.toml`: one outline of 68 sides, in a plane, with an opening in the wall of its last
cell. All corridors are parallel to x or y, so that a particle keeps |v_x| and |v_y|, and has four directions; yet it
wanders from cell to cell, and the times of escape of a start that fills the maze have a tail.
"""

from pathlib import Path

import numpy as np

import swarm
from swarm import scene_file

from .asked import Asked
from .page import outline, page

SCENE = Path(__file__).parent / "scenes" / "maze.toml"


def run(count: int | None = None, until: float | None = None) -> tuple[swarm.Scene, swarm.Result]:
    """The run of the file, or of so many particles until another time."""
    job = scene_file.read(SCENE)
    start = job.start() if count is None else swarm.fill(job.scene, count, speed=1.0, seed=1)
    return job.scene, swarm.simulate(job.scene, start, job.method, until=until or job.run.times.until)


def draw(scene: swarm.Scene, result: swarm.Result, file: Path) -> None:
    """The maze with the particles left in it, and how many are left over time."""
    from swarm.pictures.style import BLUE, RED

    title = "A maze: most particles find the exit, some need very long"
    with page(file, title, 1, 2, (10.0, 3.9), width_ratios=(1.35, 1.0)) as axes:
        outline(axes[0], scene)
        left = np.isnan(result.escape_time)
        for who, color, name in ((left, BLUE, "still in it"), (~left, RED, "where each went out")):
            axes[0].plot(
                *result.particles.position[:2, who], ".", color=color, markersize=3.0, markeredgewidth=0.0, label=name
            )
        axes[0].set(title=f"{len(left)} particles after {result.observables['time'][-1]:g} s")
        axes[0].legend(loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=2, markerscale=3.0)
        times = np.sort(np.nan_to_num(result.escape_time, nan=np.inf))
        axes[1].loglog(times, 1.0 - np.arange(1, len(times) + 1) / len(times), color=BLUE)
        axes[1].set(title="particles still in it", xlabel="time [s]", ylabel="part of the particles", xlim=(1.0, None))
        axes[1].set_yticks([0.3, 0.4, 0.5, 0.7, 1.0], ["0.3", "0.4", "0.5", "0.7", "1"], minor=False)
        axes[1].set_yticks([], minor=True)


def main() -> None:
    """Run, print and draw."""
    ask = Asked(__doc__, "maze.png", "plot")
    ask.add_argument("--particles", type=int, default=10_000)
    asked = ask.parse_args()
    scene, result = run(asked.particles)
    times = result.escape_time
    print(f"{100.0 * np.mean(~np.isnan(times)):.1f} % have left, half of these within {np.nanmedian(times):.0f} s")
    draw(scene, result, asked.output)
    print(f"written {asked.output}")


if __name__ == "__main__":
    main()
