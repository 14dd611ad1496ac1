"""A vacuum chamber: a gas inlet, a pump at the end of a tube, and the pressure everywhere, without collisions.

    python -m examples.vacuum_chamber

Q particles a second come in at a patch of the wall, as a gas effuses; all walls have its temperature.
The wall at the end of the tube captures the part c of what reaches it: a pump. Clausing's factor W of the tube makes of
both the part of those that enter the tube that is captured, c W/(c + W - c W), so the pumping speed of a mouth of area
A is S = (<v> A/4) times that, and the number in the chamber of volume V settles at Q V/S, as 1 - exp(-S t/V).

Counters are the gauges: small balls and discs that stop no particle. The momentum that crosses a disc is a pressure,
and on a ball the sum of 1/|v_n| is the mean density over its surface.
"""

import math
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import swarm

from .asked import Asked
from .page import law, page
from .tube_flow import FACTORS

# Chamber and tube [m]: radius and half a length along x; the tube begins at the chamber's end.
WIDE, HALF, NARROW, LENGTH = 0.5, 0.5, 0.12, 0.6
# The part of what reaches the pump that it captures; k_B T [J] of particles of 1 kg.
CAPTURE, TEMPERATURE = 0.5, 1.0
# What comes in does so within this distance of a point of the wall [m].
INLET, PATCH = (-0.3, 0.0, -WIDE), 0.12
# Gauges: balls in the chamber at y = 0, and discs across the tube [m].
GAUGE, DISC = 0.06, 0.1
BALLS = [(x, z) for x in (-0.35, 0.0, 0.35) for z in (-0.35, 0.0, 0.35)]
DISCS = [HALF + part * LENGTH for part in (0.1, 0.35, 0.6, 0.85)]

AREA = math.pi * NARROW**2
MEAN_SPEED = math.sqrt(8.0 * TEMPERATURE / math.pi)
FACTOR = FACTORS[round(LENGTH / NARROW, 1)]
CAPTURED = CAPTURE * FACTOR / (CAPTURE + FACTOR - CAPTURE * FACTOR)
# Densities in the tube over that in the chamber, at its mouth and at the pump: mean of what goes to and fro.
AT_MOUTH, AT_PUMP = 1.0 - 0.5 * CAPTURED, CAPTURED * (2.0 - CAPTURE) / (2.0 * CAPTURE)
# V [m^3], of the tube as much as its mean density makes of it.
VOLUME = 2.0 * HALF * math.pi * WIDE**2 + LENGTH * AREA * 0.5 * (AT_MOUTH + AT_PUMP)
# S [m^3/s], and the time in which the chamber settles [s].
SPEED = 0.25 * MEAN_SPEED * AREA * CAPTURED
SETTLES = VOLUME / SPEED


class Vacuum(NamedTuple):
    """What a run shows; times in units of V/S, numbers and densities in those of the law for the chamber."""

    time: np.ndarray
    inside: np.ndarray  # how many are in the vessel
    pumped: np.ndarray  # how many the pump has captured, of those that have come by the end
    balls: np.ndarray  # density at each ball
    discs: np.ndarray  # pressure on each disc
    entered: float  # how many go into the tube, with those that come back taken off, in the steady state
    captured: float  # how many the pump captures then
    part: tuple[float, float]  # of those that go into the tube, how many are captured, and its standard error
    at_pump: tuple[float, float]  # of those that reach the pump


def vessel() -> swarm.Scene:
    """A chamber and a tube in one, and the pump at the tube's end."""
    tube = swarm.Cylinder(NARROW, (1, 0, 0), 2.0 * LENGTH + 0.1, center=(HALF, 0, 0))
    room = swarm.Union([swarm.Cylinder(WIDE, (1, 0, 0), 2.0 * HALF), tube], temperature=TEMPERATURE)
    laws = [swarm.Absorb(CAPTURE), swarm.CercignaniLampis(TEMPERATURE, normal=1.0, tangential=1.0)]
    pump = swarm.Plane((1, 0, 0), HALF + LENGTH, laws=laws)
    return swarm.Scene([room, pump])


def gauges() -> list[Any]:
    """Balls, discs, the mouth of the tube, and what is just before the pump."""
    balls = [swarm.Sphere(GAUGE, center=(x, 0.0, z)) for x, z in BALLS]
    discs = [swarm.Counter(swarm.Plane((1, 0, 0), x), inside=swarm.Cylinder(DISC, (1, 0, 0))) for x in DISCS]
    mouth, end = (
        swarm.Counter(swarm.Plane((1, 0, 0), x), inside=swarm.Cylinder(1.01 * NARROW, (1, 0, 0)))
        for x in (HALF + 1e-6, HALF + LENGTH - 1e-6)
    )
    return [*balls, *discs, mouth, end]


def run(count: int, settled: float = 5.0, until: float = 10.0, seed: int = 1) -> Vacuum:
    """The chamber, empty at the start, until some `count` particles have come; steady from a time V/S on."""
    flow = count / (until * SETTLES)
    inlet = swarm.Source(0, within=swarm.Sphere(PATCH, center=INLET), rate=flow, temperature=TEMPERATURE)
    result = swarm.simulate(
        vessel(),
        None,
        swarm.Impact(),
        until=until * SETTLES,
        every=0.25 * SETTLES,
        sources=[inlet],
        counters=gauges(),
        seed=seed,
    )
    seen = result.observables
    first = int(np.searchsorted(seen["time"], settled * SETTLES * (1.0 - 1e-9)))
    span = seen["time"][-1] - seen["time"][first]
    crossings, momentum, slowness = (
        seen[name][-1] - seen[name][first] for name in ("crossings", "crossed_momentum", "crossed_slowness")
    )
    # Q/S, the density that the law has in the chamber.
    density, n = flow / SPEED, len(BALLS)
    balls = slowness[:n].sum(axis=1) / (4.0 * math.pi * GAUGE**2 * span)
    # Those that come back have a momentum of the other sign.
    discs = (momentum[n:-2, 0, 0] - momentum[n:-2, 1, 0]) / (math.pi * DISC**2 * span)
    captured = float(seen["absorbed"][-1].sum() - seen["absorbed"][first].sum())
    into, reach = crossings[-2, 0], crossings[-1, 0]
    pumped = seen["absorbed"].sum(axis=1)
    return Vacuum(
        seen["time"] / SETTLES,
        (seen["born"].sum(axis=1) - pumped) / (density * VOLUME),
        pumped / count,
        balls / density,
        discs / (density * TEMPERATURE),
        float(crossings[-2, 0] - crossings[-2, 1]),
        captured,
        (captured / into, math.sqrt(CAPTURED * (1.0 - CAPTURED) / into)),
        (captured / reach, math.sqrt(CAPTURE * (1.0 - CAPTURE) / reach)),
    )


def expected(x: np.ndarray) -> np.ndarray:
    """The density along the axis by the law: that of the chamber, and in the tube a straight fall to the pump."""
    return np.where(x < HALF, 1.0, AT_MOUTH + (AT_PUMP - AT_MOUTH) * (x - HALF) / LENGTH)


def draw_vessel(axes: Any, gas: Vacuum) -> None:
    """The section at y = 0, with the gauges in the colour of what they show."""
    from matplotlib.patches import Circle

    from swarm.pictures.style import CAVITY, CAVITY_LINE, GREEN, MAP, PINK

    end = HALF + LENGTH
    upper = np.array([[-HALF, 0.0], [-HALF, WIDE], [HALF, WIDE], [HALF, NARROW], [end, NARROW]])
    whole = np.concatenate([upper, upper[::-1] * (1.0, -1.0)])
    axes.fill(*whole.T, facecolor=CAVITY, edgecolor=CAVITY_LINE, linewidth=1.5, alpha=0.6)
    axes.plot([end, end], [-NARROW, NARROW], color=PINK, linewidth=4.0)
    axes.text(end, NARROW + 0.22, f"pump, takes\n{100.0 * CAPTURE:g} % of hits", color=PINK, ha="center", va="center")
    axes.plot([INLET[0] - PATCH, INLET[0] + PATCH], [-WIDE, -WIDE], color=GREEN, linewidth=4.0)
    arrow = {"arrowstyle": "->", "color": GREEN}
    axes.annotate("gas inlet", (INLET[0], -WIDE), (INLET[0], -WIDE - 0.25), color=GREEN, ha="center", arrowprops=arrow)
    values = np.concatenate([gas.balls, gas.discs])
    colours = axes.scatter([], [], c=[], cmap=MAP, vmin=0.0, vmax=max(1.2, values.max()))
    for (x, z), value in zip(BALLS, gas.balls, strict=True):
        axes.add_patch(Circle((x, z), GAUGE, facecolor=colours.to_rgba(value), edgecolor="none"))
        axes.text(x, z + 1.3 * GAUGE, f"{value:.2f}", ha="center", fontsize=8.5)
    for k, (x, value) in enumerate(zip(DISCS, gas.discs, strict=True)):
        axes.plot([x, x], [-DISC, DISC], color=colours.to_rgba(value), linewidth=4.0)
        place = x - 0.03 * (k == 0), -NARROW - 0.09 - 0.09 * (k % 2)
        axes.text(*place, f"{value:.2f}", ha="center" if k else "left", fontsize=8.5)
    axes.set(aspect="equal", xlim=(-HALF - 0.05, end + 0.25), ylim=(-WIDE - 0.35, WIDE + 0.05))
    axes.set_title("gauges and what they show")
    axes.set_axis_off()
    scale = axes.inset_axes((0.5, 0.1, 0.48, 0.04))
    axes.figure.colorbar(colours, cax=scale, orientation="horizontal", label="pressure, over $QkT/S$")


def draw(gas: Vacuum, file: Path) -> None:
    """The vessel with its gauges, the pressure along the axis, and the numbers over time."""
    from swarm.pictures.style import BLUE, CAVITY, GREEN, PINK

    title = "Gas comes into a vacuum chamber and leaves by a tube to a pump: gauges show the pressure everywhere"
    with page(file, title, 1, 3, (11.0, 4.0), width_ratios=(1.15, 1.0, 1.0)) as axes:
        draw_vessel(axes[0], gas)
        axis = np.linspace(-HALF, HALF + LENGTH, 400)
        law(axes[1], axis, expected(axis), "law: level, and a straight fall")
        middle = [k for k, (_x, z) in enumerate(BALLS) if z == 0.0]
        axes[1].plot([BALLS[k][0] for k in middle], gas.balls[middle], "o", color=BLUE, label="balls on the axis")
        axes[1].plot(DISCS, gas.discs, "s", color=PINK, label="discs in the tube")
        axes[1].axvspan(HALF, HALF + LENGTH, color=CAVITY, alpha=0.4, linewidth=0.0)
        axes[1].text(HALF + 0.5 * LENGTH, 1.14, "tube", ha="center")
        axes[1].text(0.0, 1.14, "chamber", ha="center")
        axes[1].set(title="pressure along the axis", ylim=(0.0, 1.25), xlim=(-HALF, HALF + LENGTH))
        axes[1].set(xlabel="place [m]", ylabel="over $QkT/S$")
        axes[1].legend(loc="lower left")
        law(axes[2], gas.time, 1.0 - np.exp(-gas.time), r"law: $1-e^{-St/V}$")
        axes[2].plot(gas.time, gas.inside, ".", color=GREEN, markersize=5, label="in the vessel, over $QV/S$")
        axes[2].plot(gas.time, gas.pumped, ".", color=PINK, markersize=5, label="captured, of all that come")
        axes[2].set(title="particles over time", xlabel="time, over $V/S$", ylabel="number", ylim=(0.0, 1.5))
        axes[2].legend(loc="upper left")


def main() -> None:
    """Run, draw and print."""
    ask = Asked(__doc__, "vacuum_chamber.png", "plot")
    ask.add_argument("--particles", type=int, default=200_000)
    asked = ask.parse_args()
    gas = run(asked.particles)
    steady = gas.inside[gas.time >= 5.0].mean()
    print(
        f"In the steady state {steady:.3f} of Q V/S are in the vessel; of {gas.entered:.0f} that go into the tube and"
    )
    print(
        f"stay {gas.captured:.0f} are captured. Of all that enter it these are {gas.part[0]:.4f} +- {gas.part[1]:.4f}"
    )
    print(
        f"({CAPTURED:.4f} by Clausing's factor), and {gas.at_pump[0]:.4f} +- {gas.at_pump[1]:.4f} of those at the pump."
    )
    draw(gas, asked.output)
    print(f"written {asked.output}")


if __name__ == "__main__":
    main()
