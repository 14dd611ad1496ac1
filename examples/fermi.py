"""Fermi's accelerator: a particle between a wall at rest and one that swings gains no energy beyond a bound.

    python -m examples.fermi

Fermi asked whether such a particle is accelerated without end. Ulam computed that it is not: fast particles stay on
curves of their phase space, which the slow ones cannot cross. The picture has a dot for each particle and period.
"""

import tempfile
from pathlib import Path

import numpy as np

import swarm

from .asked import Asked
from .page import law, page

# Amplitude of the wall [m], its distance [m], and its frequency, so that it moves as sin(t).
AMPLITUDE, LENGTH, FREQUENCY = 0.02, 1.0, 0.5 / np.pi
PERIOD = 1.0 / FREQUENCY


def accelerator() -> swarm.Scene:
    """A wall at x = 0, and one that swings about x = LENGTH."""
    swing = swarm.Oscillation((AMPLITUDE, 0.0, 0.0), FREQUENCY)
    return swarm.Scene([swarm.Plane((-1.0, 0.0, 0.0), 0.0), swarm.Plane((1.0, 0.0, 0.0), LENGTH, motion=swing)])


def run(speeds: np.ndarray, periods: int) -> tuple[np.ndarray, np.ndarray]:
    """Places and velocities (periods + 1, N) at the start of each period of the wall; all begin at x = 0."""
    start = np.zeros((3, len(speeds)))
    start[0] = speeds
    particles = swarm.Particles(np.zeros_like(start), start, np.ones(len(speeds)))
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "fermi.h5"
        swarm.simulate(
            accelerator(), particles, swarm.Impact(), until=periods * PERIOD, every=PERIOD, trajectory=file,
            precision="float64",
        )  # fmt: skip
        with swarm.load(file) as trajectory:
            frames = [trajectory.frame(k) for k in range(len(trajectory))]
    return np.array([one.position[0] for one in frames]), np.array([one.velocity[0] for one in frames])


def in_fifty_digits(speed: float, amplitude: float, impacts: int) -> tuple[float, float]:
    """When a particle from x = 0 comes back there after so many impacts on a wall at LENGTH + amplitude sin t, and how.

    The time [s] and the speed [m/s], from impact to impact in 50 digits.
    """
    import mpmath

    with mpmath.workdps(50):
        a, t, x, v = mpmath.mpf(amplitude), mpmath.mpf(0), mpmath.mpf(0), mpmath.mpf(speed)
        for _impact in range(impacts):
            wait = mpmath.findroot(lambda w: x + v * w - LENGTH - a * mpmath.sin(t + w), (LENGTH - x) / v, tol=1e-90)  # noqa: B023
            t += wait
            hit, v = LENGTH + a * mpmath.sin(t), 2 * a * mpmath.cos(t) - v
            t, x, v = t - hit / v, mpmath.mpf(0), -v
        return float(t), float(v)


def draw(places: np.ndarray, velocities: np.ndarray, file: Path) -> None:
    """The phase space once a period, and the largest and smallest speed of each particle."""
    from swarm.pictures.style import BLUE, RED

    speeds = np.abs(velocities)
    title = "A ball between a wall at rest and one that swings: slow ones wander in chaos, fast ones keep their speed"
    with page(file, title, 1, 2, (10.0, 4.2)) as axes:
        for colour, chosen, name in (
            (RED, np.ptp(speeds, axis=0) > 0.1, "speed changes by more than 0.1 m/s"),
            (BLUE, np.ptp(speeds, axis=0) <= 0.1, "by less"),
        ):
            axes[0].plot(places[:, chosen].ravel(), velocities[:, chosen].ravel(), ",", color=colour, alpha=0.6)
            axes[0].plot([], [], "o", color=colour, label=name)
        axes[0].set(title="each particle, once a period: a dot", xlabel="place x [m]", xlim=(0.0, 1.0))
        axes[0].set(ylabel="velocity away from the wall at rest [m/s]", ylim=(0.0, 0.9))
        axes[0].legend(loc="upper right", framealpha=0.9, frameon=True)
        axes[0].grid(False)
        axes[1].fill_between(
            speeds[0], speeds.min(axis=0), speeds.max(axis=0), color=BLUE, alpha=0.4, linewidth=0.0,
            label=f"from the least to the largest in {len(places) - 1} periods",
        )  # fmt: skip
        law(axes[1], speeds[0], speeds[0], "the speed at the start")
        axes[1].set(title="which speeds a particle reaches", ylim=(0.0, None), xlim=(0.0, 2.0))
        axes[1].set(xlabel="speed at the start [m/s]", ylabel="speeds since then [m/s]")
        axes[1].legend(loc="upper left")


def main() -> None:
    """Run, draw and print."""
    ask = Asked(__doc__, "fermi.png", "plot")
    ask.add_argument("--periods", type=int, default=2000)
    asked = ask.parse_args()
    speeds = np.linspace(0.05, 2.0, 157)
    places, velocities = run(speeds, asked.periods)
    largest = np.abs(velocities).max(axis=0)
    print(f"{asked.periods} periods: particles that begin below 0.3 m/s reach {largest[speeds < 0.3].max():.3f} m/s")
    kept = np.ptp(np.abs(velocities), axis=0)[speeds > 1.5].max()
    print(f"the speed of those above 1.5 m/s varies by {kept:.3f} m/s at most")
    draw(places, velocities, asked.output)
    print(f"written {asked.output}")


if __name__ == "__main__":
    main()
