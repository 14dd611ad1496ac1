"""The periodic Lorentz gas: a particle among discs on a triangular lattice diffuses, without any randomness.

    python -m examples.lorentz_gas

The discs have radius 1 and gaps w between neighbours; the particles have speed 1. The mean free path is half the free
area of a disc, exactly (Chernov, J. Stat. Phys. 88 (1997) 1). For narrow gaps particles hop from triangle to triangle
without memory, with the diffusion coefficient of Machta and Zwanzig (Phys. Rev. Lett. 50 (1983) 1959). They do have
memory, as Klages and Dellago show (J. Stat. Phys. 101 (2000) 145): most of it is how often a hop goes back.
"""

import tempfile
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import swarm

from .asked import Asked
from .page import law, page, solid

# Narrower than the gap at which a straight line through the lattice is free for ever: w < 4/sqrt(3) - 2 = 0.309.
GAPS = (0.01, 0.02, 0.035, 0.05, 0.075, 0.1, 0.125, 0.15, 0.175, 0.2, 0.225, 0.25, 0.275, 0.3)
# Displacements are taken over so many mean times of a hop: the memory is lost much sooner.
HOPS = 10.0
# The path that is drawn, and how many discs to each side.
PATH_GAP, WIDE = 0.2, 12


class Measured(NamedTuple):
    """What a run shows; errors are standard errors by the spread of its particles."""

    diffusion: tuple[float, float]
    free_path: tuple[float, float]
    impacts: int


def lattice(gap: float) -> swarm.Scene:
    """Two discs in a rectangle that repeats."""
    a = 2.0 + gap
    discs = swarm.Cylinders([[0.0, 0.0, 0.0], [a / 2.0, np.sqrt(0.75) * a, 0.0]], 1.0, axes=(0.0, 0.0, 1.0))
    return swarm.Scene([discs], period=(a, np.sqrt(3.0) * a, 1.0))


def free_area(gap: float) -> float:
    """The area between the discs, for each of them."""
    return float(np.sqrt(0.75) * (2.0 + gap) ** 2 - np.pi)


def hop_time(gap: float) -> float:
    """Mean time in a triangle between three discs: pi times its area over the width of its three exits."""
    return np.pi * 0.5 * free_area(gap) / (3.0 * gap)


def machta_zwanzig(gap: float) -> float:
    """D = l^2 / (4 tau), hops of length l = (2 + w)/sqrt(3) without memory: the limit of narrow gaps."""
    return (2.0 + gap) ** 2 / 3.0 / (4.0 * hop_time(gap))


def run(gap: float, count: int, until: float, every: float) -> tuple[np.ndarray, swarm.Result]:
    """The places (frames, 2, count) of particles that begin uniform in place and direction, and the end."""
    scene = lattice(gap)
    made = swarm.fill(scene, count, speed=1.0, seed=1)
    angle = np.random.default_rng(1).uniform(0.0, 2.0 * np.pi, count)
    start = swarm.Particles(made.position, np.stack([np.cos(angle), np.sin(angle), np.zeros(count)]))
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "lorentz.h5"
        result = swarm.simulate(scene, start, swarm.Impact(), until=until, every=every, trajectory=file)
        with swarm.load(file) as trajectory:
            frames = [scene.unwrapped(trajectory.frame(k))[:2] for k in range(len(trajectory))]
    return np.array(frames), result


def measure(gap: float, count: int, windows: int = 64) -> Measured:
    """D by so many displacements of each particle, one after the other, and by twice so many of half the length."""
    window = HOPS * hop_time(gap)
    places, result = run(gap, count, 2 * windows * window, window)
    # <x^2 + y^2> = 4 D t + c, as soon as the memory is lost: the difference of two lengths has no c.
    short, long = places[1:] - places[:-1], places[2::2] - places[:-1:2]
    each = ((long**2).sum(axis=1).mean(axis=0) - (short**2).sum(axis=1).mean(axis=0)) / (4.0 * window)
    rate, error = mean_of(result.impacts_per_particle / (2 * windows * window))
    return Measured(mean_of(each), (1.0 / rate, error / rate**2), int(result.impacts_per_particle.sum()))


def going_back(gap: float, count: int, hops: int = 100) -> float:
    """The part of hops that lead back through the gap through which the particle came: 1/3 without memory."""
    # No particle crosses a triangle from gap to gap, or comes back into one, within half a unit of time.
    places, _result = run(gap, count, hops * hop_time(gap), 0.5)
    v = places[:, 1] / (np.sqrt(0.75) * (2.0 + gap))
    u = places[:, 0] / (2.0 + gap) - 0.5 * v
    triangles = np.stack([np.floor(u), np.floor(v), u % 1.0 + v % 1.0 > 1.0])
    back = []
    for one in np.moveaxis(triangles, 2, 0):
        visited = one[:, np.append(True, (np.diff(one, axis=1) != 0.0).any(axis=0))]
        back.append((visited[:, 2:] == visited[:, :-2]).all(axis=0))
    return float(np.concatenate(back).mean())


def with_memory(gap: float, back: float) -> float:
    """D of hops that remember the last one: times (1 + <cos>)/(1 - <cos>), their angle 180 or 60 degrees."""
    cosine = 0.5 * (1.0 - back) - back
    return machta_zwanzig(gap) * (1.0 + cosine) / (1.0 - cosine)


def mean_of(values: np.ndarray) -> tuple[float, float]:
    """The mean and its standard error."""
    return float(values.mean()), float(values.std(ddof=1) / np.sqrt(len(values)))


def draw(found: dict[float, Measured], memory: dict[float, float], file: Path) -> None:
    """D over the gap, its ratio to the law of narrow gaps, and the path of a particle."""
    from swarm.pictures.style import BLUE, GREEN

    gaps, fine = np.array(list(found)), np.linspace(1e-3, 0.305, 200)
    value, error = np.transpose([one.diffusion for one in found.values()])
    hops, remembered = (np.array([f(w) for w in gaps]) for f in (machta_zwanzig, memory.__getitem__))
    path = run(PATH_GAP, 1, 120.0, 0.05)[0][:, :, 0]
    title = "A particle hops between discs and diffuses: the wider the gaps, the less often it goes back"
    with page(file, title, 1, 3, (11.0, 3.9)) as axes:
        draw_path(axes[0], path, BLUE)
        told = {"label": "hops that remember the last one", "color": GREEN}
        ran = {"fmt": "o", "color": BLUE, "label": "run, with standard errors"}
        law(axes[1], fine, [machta_zwanzig(w) for w in fine], "hops without memory (Machta, Zwanzig)")
        axes[1].plot(gaps, remembered, **told)
        axes[1].errorbar(gaps, value, error, **ran)
        axes[1].set(title="diffusion coefficient D", ylabel="D at speed 1 m/s [m²/s]", ylim=(0.0, 0.33))
        law(axes[2], None, 1.0, "hops without memory")
        axes[2].plot(gaps, remembered / hops, **told)
        axes[2].errorbar(gaps, value / hops, error / hops, **ran)
        axes[2].set(title="D, over that of hops without memory", ylabel="ratio", ylim=(0.85, 1.65))
        for one in axes[1:]:
            one.set(xlabel="gap w between discs of radius 1 m [m]", xlim=(0.0, 0.31))
            one.legend(loc="upper left")


def draw_path(axes: Any, path: np.ndarray, colour: str) -> None:
    """A path among the discs."""
    a, middle = 2.0 + PATH_GAP, 0.5 * (path.min(axis=0) + path.max(axis=0))
    half = 0.5 * np.ptp(path, axis=0).max() + 1.0
    axes.plot(*path.T, color=colour, linewidth=0.8)
    for i, j in np.ndindex(2 * WIDE + 1, 2 * WIDE + 1):
        x, y = i - WIDE + 0.5 * (j % 2), np.sqrt(0.75) * (j - WIDE)
        solid(axes, (a * x, a * y), 1.0)
    axes.set(xlim=(middle[0] - half, middle[0] + half), ylim=(middle[1] - half, middle[1] + half), aspect="equal")
    axes.set(title=f"a path of 120 s, w = {PATH_GAP:g} m", xlabel="x [m]", ylabel="y [m]")
    axes.grid(False)


def main() -> None:
    """Run, draw and print."""
    ask = Asked(__doc__, "lorentz_gas.png", "plot")
    ask.add_argument("--particles", type=int, default=2_000)
    asked = ask.parse_args()
    found, memory = {}, {}
    print("       diffusion coefficient    over that of hops               free path           off the exact one")
    print("gap    D        error           without memory  with one hop's  mean     error      in errors")
    for w in GAPS:
        found[w], memory[w] = one = measure(w, asked.particles), with_memory(w, going_back(w, asked.particles // 4))
        (d, d_error), (path, path_error) = one[0].diffusion, one[0].free_path
        off = (path - 0.5 * free_area(w)) / path_error
        print(f"{w:<6g} {d:.5f}  {d_error:.5f}  {d / machta_zwanzig(w):14.3f}  {d / memory[w]:15.3f}", end="")
        print(f"         {path:.5f}  {path_error:.5f}  {off:+10.1f}", flush=True)
    print(f"{sum(one.impacts for one in found.values()):.1e} impacts")
    draw(found, memory, asked.output)
    print(f"written {asked.output}")


if __name__ == "__main__":
    main()
