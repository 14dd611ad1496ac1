"""Flow through a tube without collisions: how many of those that come in at one end leave by the other one.

    python -m examples.tube_flow

A gas outside passes the open end of a tube at a steady rate, by the cosine law. Its wall sends each particle off in a
direction of the cosine law too, whatever it comes from, so that particles go to and fro until they leave by one of the
ends. The part that leaves by the other end is Clausing's factor W(L/R) (Ann. Phys. 12 (1932) 961); the number in the
tube settles, and falls from the one end to the other.
"""

import math
from pathlib import Path
from typing import NamedTuple

import numpy as np

import swarm

from .asked import Asked
from .page import law, page

# Length over radius of tubes, and Clausing's factors to the digits of later computations.
FACTORS = {1.0: 0.6720, 2.0: 0.5142, 5.0: 0.3105, 10.0: 0.1910}
# Of all particles [m/s]; radii are 1 m.
SPEED = 1.0
FRAMES = 60


class Flow(NamedTuple):
    """What a run shows; times in units of L/v."""

    time: np.ndarray
    inside: np.ndarray  # how many are in the tube
    factor: float  # the part of those that have come through
    error: float  # its standard error
    place: np.ndarray  # along the tube, from 0 to 1
    density: np.ndarray  # there in the steady state, over its mean


def tube(length: float) -> swarm.Scene:
    """A tube of radius 1 with open ends."""
    ends = [
        swarm.Plane(
            (0.0, 0.0, sign), 0.5 * length, openings=[swarm.Sphere(2.0, center=(0.0, 0.0, sign * 0.5 * length))]
        )
        for sign in (-1.0, 1.0)
    ]
    return swarm.Scene([*ends, swarm.Cylinder(1.0, laws=[swarm.Lambert()])])


def run(count: int, length: float, stays: float = 12.0, seed: int = 1) -> Flow:
    """The tube while some `count` particles come, and until nearly all have left."""
    scene = tube(length)
    # The gas outside is there for so many times of the way across the tube and along it, and then the rest leaves.
    unit = length * (1.0 + 0.5 * length) / SPEED
    stop, until = stays * unit, 3.0 * stays * unit
    source = swarm.Source(scene.surfaces[0].openings[0], rate=count / stop, speed=SPEED, stop=stop)
    shown = []

    def look(frame: swarm.Frame) -> None:
        if 0.5 * stop < frame.time <= stop:
            shown.append(frame.position[2, np.isnan(frame.escape_time)])

    result = swarm.simulate(
        scene, None, swarm.Impact(), until=until, every=until / FRAMES, sources=[source], seed=seed, progress=look
    )
    seen, gone = result.observables, np.isfinite(result.escape_time)
    through = result.particles.position[2, gone] > 0.0
    born = seen["born"][:, 0]
    counts, edges = np.histogram(np.concatenate(shown), bins=20, range=(-0.5 * length, 0.5 * length))
    return Flow(
        seen["time"] * SPEED / length,
        born - seen["escaped"],
        float(through.mean()),
        math.sqrt(float(through.var()) / len(through)),
        0.5 + 0.5 * (edges[1:] + edges[:-1]) / length,
        counts / counts.mean(),
    )


def draw(flows: dict[float, Flow], file: Path) -> None:
    """The number in each tube, the density along it, and the factors."""
    from swarm.pictures.style import CURVES

    title = "A gas flows through tubes without collisions: the longer the tube, the more turn back, as Clausing says"
    with page(file, title, 1, 3, (11.0, 3.9)) as axes:
        for color, (ratio, flow) in zip(CURVES, flows.items(), strict=False):
            name = f"length {ratio:g} radii"
            axes[0].plot(flow.time / flow.time[-1], flow.inside / flow.inside.max(), color=color, label=name)
            axes[1].plot(flow.place, flow.density, ".-", markersize=5, color=color, label=name)
            off, error = 100.0 * (flow.factor - FACTORS[ratio]), 100.0 * flow.error
            label = f"{flow.factor:.4f} come through"
            axes[2].errorbar(ratio, off, error, fmt="o", color=color, label=label)
        axes[0].set(xlim=(0.0, 1.0), ylim=(0.0, 1.05), title="particles in the tube", ylabel="over the most")
        axes[0].set(xlabel="time, over the run; inlet closes at 1/3")
        axes[1].set(title="density along the tube", xlabel="place, over the length", ylabel="over its mean")
        axes[1].set(xlim=(0.0, 1.0), ylim=(0.0, None))
        law(axes[2], None, 0.0, "Clausing's factor")
        axes[2].set(xscale="log", xlabel="length over radius", ylabel="% of the particles", ylim=(-0.3, 0.5))
        axes[2].set(title="transmission less the law")
        axes[2].set_xticks(list(flows), [f"{ratio:g}" for ratio in flows], minor=False)
        axes[2].set_xticks([], minor=True)
        for one, place in zip(axes, ("center right", "lower left", "upper left"), strict=True):
            one.legend(loc=place)


def main() -> None:
    """Run, draw and print."""
    ask = Asked(__doc__, "tube_flow.png", "plot")
    ask.add_argument("--particles", type=int, default=400_000)
    asked = ask.parse_args()
    flows = {ratio: run(asked.particles, ratio) for ratio in FACTORS}
    for ratio, flow in flows.items():
        off = (flow.factor - FACTORS[ratio]) / flow.error
        print(f"L/R = {ratio:g}: {flow.factor:.4f} +- {flow.error:.4f} come through, {FACTORS[ratio]:.4f} by Clausing")
        print(f"({off:+.1f} standard errors); {flow.inside[-1]} are still in the tube")
    draw(flows, asked.output)
    print(f"written {asked.output}")


if __name__ == "__main__":
    main()
