"""Storage of a gas of particles that are lost at impacts: an exponential, a tail 1/t^3, and a bottle of neutrons.

    python -m examples.neutron_bottle

In a ball with diffuse walls that absorb the part p of the impacts, exp(-s v t) of the particles of speed v are left,
with s = 3p/4R for small p, and for any p from the chords l = 2R U^(1/2) between impacts, (1 - p) <exp(s l)> = 1. One
speed gives an exponential. Of a Maxwellian gas fast particles are lost first; with tau = s v_p t, v_p^2 = 2 k_B T/m,

    N/N0 = (1 + tau^2/2) erfcx(tau/2) - tau/pi^(1/2), for long times 8/(pi^(1/2) tau^3).

The second vessel is a bottle of ultracold neutrons, open at the top, with gravity. Those that can rise to the top, or
come with more energy along the normal than the optical potential of the wall, leave soon. Each of the others has
v^2 = v0^2 - 2 g z, with v0 at the floor, and is lost at the rate p (3/4) (g/v0 + v0/2R) (Golub, Richardson &
Lamoreaux, Ultra-Cold Neutrons (1991)).
"""

import math
from pathlib import Path
from typing import NamedTuple

import numpy as np

import swarm

from .asked import Asked
from .page import law, page

# The ball: radius [m], loss at an impact, most probable speed [m/s].
RADIUS, LOSS, PROBABLE = 1.0, 0.01, 1.0
# The bottle: radius and height [m], loss at an impact; k_B T of what is let in, optical potential of Fomblin [J].
NEUTRON, G, NEV = 1.674927e-27, 9.80665, 1.602177e-28
WIDE, HIGH, LEAK, TEMPERATURE, BARRIER = 0.3, 1.0, 2e-3, 50.0 * NEV, 106.0 * NEV

# A normal error says something of what is left while so many particles are expected to be left, and so many lost.
KNOWN = 20.0


class Curve(NamedTuple):
    """What of a gas is left at times."""

    time: np.ndarray  # s v_p t in a ball, [s] in the bottle
    left: np.ndarray  # part of the particles
    law: np.ndarray  # what it should be
    error: np.ndarray  # its standard error
    count: int  # of the particles at the start

    def off(self) -> np.ndarray:
        """How many standard errors what is left is above the law; NaN where a normal error says nothing."""
        known = np.minimum(self.law, 1.0 - self.law) * self.count > KNOWN
        return np.where(known, (self.left - self.law) / np.where(known, self.error, 1.0), np.nan)


def rate(loss: float, radius: float) -> float:
    """s: how many particles of 1 m/s are lost in a second, of those that are left, by Newton's iteration."""
    a = 1.5 * loss
    for _ in range(20):
        mean, slope = 2.0 * (math.exp(a) * (a - 1.0) + 1.0) / a**2, 2.0 * math.exp(a) / a
        a -= ((1.0 - loss) * mean - 1.0) / ((1.0 - loss) * (slope - 2.0 * mean / a))
    return a / (2.0 * radius)


def maxwellian(tau: np.ndarray) -> np.ndarray:
    """What is left of a Maxwellian gas: the integral of its density of speeds x v_p times exp(-x tau).

    Its trapezoidal sum over log(x) is exact to round-off, since the integrand is smooth and vanishes at both ends.
    """
    log, step = np.linspace(math.log(1e-9), math.log(8.0), 2001, retstep=True)
    x = np.exp(log)
    values = 4.0 / math.sqrt(math.pi) * x**3 * np.exp(-(x**2) - x * tau[:, None])
    return np.asarray(step * values.sum(axis=1))


def left_at(times: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """The part of particles that has not ended, NaN for never, at times."""
    return 1.0 - np.searchsorted(np.sort(ends[np.isfinite(ends)]), times, side="right") / len(ends)


def ball(count: int, thermal: bool, until: float = 100.0) -> Curve:
    """A gas in the ball until so many times 1/s v_p."""
    scene = swarm.Scene([swarm.Sphere(RADIUS, laws=[swarm.Absorb(LOSS), swarm.Lambert()])])
    gas = {"temperature": 0.5 * PROBABLE**2} if thermal else {"speed": PROBABLE}
    start, s = swarm.fill(scene, count, **gas, seed=1), rate(LOSS, RADIUS)
    end = until if thermal else min(until, 12.0)
    result = swarm.simulate(scene, start, swarm.Impact(), until=end / (s * PROBABLE), seed=2)
    tau = np.geomspace(0.02, end, 40)
    law = maxwellian(tau) if thermal else np.exp(-tau)
    left = left_at(tau / (s * PROBABLE), result.absorbed_time)
    return Curve(tau, left, law, np.sqrt(law * (1.0 - law) / count), count)


def bottle(count: int, until: float = 400.0) -> tuple[Curve, np.ndarray, float]:
    """Neutrons in the bottle: the curve of those that may stay, what is left of all, and the part of those that may."""
    wall = {"laws": [swarm.Absorb(barrier=BARRIER, loss=LEAK), swarm.Lambert()]}
    lid = swarm.Plane((0, 0, 1), HIGH, openings=[swarm.Sphere(2.0 * WIDE, (0, 0, HIGH))])
    scene = swarm.Scene([swarm.Plane((0, 0, -1), **wall), swarm.Cylinder(WIDE, **wall), lid], gravity=(0, 0, -G))
    # As the atmosphere is: then those of each energy are everywhere in proportion to their speed there.
    gas = swarm.fill(scene, 2 * count, temperature=TEMPERATURE, mass=NEUTRON, seed=1)
    drawn = np.random.default_rng(1).random(len(gas)) < np.exp(-NEUTRON * G * gas.position[2] / TEMPERATURE)
    start = swarm.Particles(gas.position[:, drawn], gas.velocity[:, drawn], NEUTRON)
    result = swarm.simulate(scene, start, swarm.Impact(), until=until, seed=2)
    time = np.geomspace(0.02, until, 40)
    ends = np.fmin(result.absorbed_time, result.escape_time)
    speed = np.sqrt((start.velocity**2).sum(axis=0) + 2.0 * G * start.position[2])
    stays = 0.5 * speed**2 < G * HIGH
    lost = LEAK * 0.75 * (G / speed[stays] + speed[stays] / (2.0 * WIDE))
    kept = np.exp(-lost * time[:, None])
    # Of given neutrons, each with its own probability to be there still.
    law, error = kept.mean(axis=1), np.sqrt((kept * (1.0 - kept)).sum(axis=1)) / len(lost)
    return Curve(time, left_at(time, ends[stays]), law, error, len(lost)), left_at(time, ends), float(stays.mean())


def draw(one: Curve, thermal: Curve, neutrons: Curve, whole: np.ndarray, file: Path) -> None:
    """The curves beside their laws, and how far they are from them."""
    from swarm.pictures.style import BLUE, GREEN, GREY, PINK, RED

    title = "Gases that are lost at walls: one speed is lost exponentially, a thermal gas by a tail, as the laws say"
    with page(file, title, 1, 3, (11.0, 4.0)) as axes:
        kinds = (("one speed: exponential", one, BLUE), ("thermal: a tail", thermal, RED))
        for name, curve, color in kinds:
            seen = curve.left > 0.0
            law(axes[0], curve.time, curve.law, "laws" if curve is thermal else None)
            axes[0].plot(curve.time[seen], curve.left[seen], ".", color=color, markersize=5, label=name)
        tail = thermal.time[thermal.time > 4.0]
        law(axes[0], tail, 8.0 / (math.sqrt(math.pi) * tail**3), r"its tail, $8/\sqrt{\pi}\tau^3$", "--")
        axes[0].set(xscale="log", yscale="log", ylim=(3e-7, 2.0), xlabel=r"time $\tau$, in lifetimes $1/s\,v_p$")
        axes[0].set(ylabel="part of the particles that is left", title="ball, 1 % is lost at an impact")
        law(axes[1], neutrons.time, neutrons.law, "law of the slow ones")
        axes[1].plot(
            neutrons.time, neutrons.left, ".", color=GREEN, markersize=5, label="those too slow to rise to the top"
        )
        axes[1].plot(neutrons.time, whole, ".", color=PINK, markersize=5, label="all: fast ones leave within seconds")
        axes[1].set(xscale="log", yscale="log", xlabel="time [s]", ylabel="part of the neutrons that is left")
        axes[1].set(title="neutrons in a bottle 1 m high, open above")
        axes[2].axhspan(-3.0, 3.0, color=GREY, alpha=0.15, linewidth=0.0, label="within three errors")
        for name, curve, color in (
            ("one speed", one, BLUE),
            ("thermal gas", thermal, RED),
            ("slow neutrons", neutrons, GREEN),
        ):
            axes[2].plot(curve.time, curve.off(), ".-", color=color, linewidth=0.6, markersize=5, label=name)
        axes[2].set(xscale="log", ylim=(-4.0, 7.5), xlabel=r"time $\tau$, of neutrons [s]")
        axes[2].set(ylabel="in standard errors", title="what is left, less the law")
        for place, panel in zip(("lower left", "lower left", "upper left"), axes, strict=True):
            panel.legend(loc=place)


def main() -> None:
    """Run, draw and print."""
    ask = Asked(__doc__, "neutron_bottle.png", "plot")
    ask.add_argument("--particles", type=int, default=400_000)
    asked = ask.parse_args()
    one, thermal = (ball(asked.particles, thermal) for thermal in (False, True))
    neutrons, whole, stays = bottle(asked.particles // 10)
    for name, curve in (("one speed", one), ("Maxwellian gas", thermal), ("slow neutrons", neutrons)):
        off = curve.off()
        last = int(np.flatnonzero(np.isfinite(off))[-1])
        print(f"{name}: {curve.left[last]:.2e} are left ({curve.law[last]:.2e} by the law), at most")
        print(f"{np.nanmax(np.abs(off)):.1f} standard errors off")
    print(f"{stays:.3f} of the neutrons are too slow to rise to the top")
    draw(one, thermal, neutrons, whole, asked.output)
    print(f"written {asked.output}")


if __name__ == "__main__":
    main()
