"""The pictures of the reports, in the look of the package."""

import statistics
import textwrap
from pathlib import Path
from typing import Any

from examples import page

from .report import file_of

# (threads, output) -> line
_STYLES = {(1, "none"): "-", (2, "none"): "--", (1, "HDF5"): ":"}

Found = dict[Any, list[float]]  # case -> nanoseconds an impact or step
Limits = dict[str, list[float]]  # yardstick -> nanoseconds


def colours() -> tuple[str, ...]:
    """One for each curve of a picture."""
    from swarm.pictures import style

    return (*style.CURVES, style.ink(), style.GREY)


def subplots(count: int, width: float, height: float, rows: int = 1, **options: Any) -> tuple[Any, Any]:
    """A picture of so many panels side by side [inches], or in so many rows, drawn without a screen."""
    from matplotlib import style as styles

    from swarm.pictures import style

    styles.use("swarm.pictures.look")
    picture = style.picture(width, height)
    return picture, picture.subplots(rows, count // rows, **options)


def save(picture: Any, path: Path) -> None:
    """Write it."""
    page.save(picture, path)
    print(f"written to {path}")


def throughput(found: Found, limits: Limits, fixed_step: list[str], where: str, name: str) -> None:
    """Impacts a second by scene, steps a second by method, and what a second thread brings, as PNG.

    `where` is the machine, `name` that of the file.
    """
    picture, (impacts, steps, scaling) = subplots(3, 11.0, 4.9)
    scenes = list(dict.fromkeys(case.scene for case in found))
    _speeds(impacts, found, [("Impact", scene, scene) for scene in scenes])
    _speeds(steps, found, [(method, "sphere", method) for method in fixed_step])
    _bounds(impacts, limits, "bare loop in C, sphere")
    _bounds(steps, limits, "bare Verlet in C, sphere", "plain Verlet in Numba, sphere")
    _scaling(scaling, found, limits, scenes)
    impacts.set(title="Impact, in five scenes", ylabel="million impacts a second", yscale="log")
    steps.set(title="methods of fixed step, in a sphere", ylabel="million steps of a particle a second", yscale="log")
    scaling.set(title="Impact, two threads over one", ylabel="ratio of the speeds")
    scaling.set_ylim(bottom=0.0)
    for axes in (impacts, steps, scaling):
        axes.set(xlabel="particles", xscale="log")
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.15))
    picture.suptitle(
        f"Speed over the number of particles (dashed: two threads; dotted: a trajectory is written)\n{where}"
    )
    save(picture, file_of(f"{name}.png"))


def _speeds(axes: Any, found: Found, lines: list[tuple[str, str, str]]) -> None:
    """One colour a (method, scene, label)."""
    for colour, (method, scene, label) in zip(colours(), lines, strict=False):
        for (threads, output), dash in _STYLES.items():
            wanted = (method, scene, threads, output)
            chosen = sorted((c.n, c) for c in found if (c.method, c.scene, c.threads, c.output) == wanted)
            axes.plot(
                [n for n, _case in chosen], [1e3 / min(found[case]) for _n, case in chosen], dash,
                color=colour, marker="o", linewidth=1.2, label=label if dash == "-" else None,
            )  # fmt: skip


def _bounds(axes: Any, limits: Limits, *names: str) -> None:
    """What is not ours, as grey lines."""
    from swarm.pictures.style import GREY, ink

    for colour, name in zip((GREY, ink()), names, strict=False):
        if name in limits:
            axes.axhline(1e3 / min(limits[name]), color=colour, linewidth=1.0, label=f"{name}, one core")


def _scaling(axes: Any, found: Found, limits: Limits, scenes: list[str]) -> None:
    """Speed of two threads over one."""
    from swarm.pictures.style import GREY

    for colour, scene in zip(colours(), scenes, strict=False):
        best = {
            (c.n, c.threads): min(v)
            for c, v in found.items()
            if (c.method, c.scene) == ("Impact", scene) and c.output == "none"
        }
        numbers = sorted(n for n, threads in best if threads == 2)
        ratios = [best[n, 1] / best[n, 2] for n in numbers]
        axes.plot(numbers, ratios, color=colour, marker="o", linewidth=1.2, label=scene)
    one, two = (limits.get(name) for name in ("bare loop in C, sphere", "bare loop in C, two at once"))
    if one and two:
        height = 2.0 * statistics.median(one) / statistics.median(two)
        axes.axhline(height, color=GREY, linewidth=1.0, label="two bare loops in C at once")


# One colour a method, whatever the scene.
_CURVES = (
    "Impact", "Penalty", "Impact, contact_step", "AugmentedLagrangian", "Midpoint", "Trapezoidal", "Verlet",
    "plain Verlet in Numba",
)  # fmt: skip
# Zero has no place on a logarithmic axis: it is drawn here, at round-off.
_LEAST = 1e-17


def accuracy(name: str, found: list[Any], front: list[Any], advice: str, where: str, file: str) -> None:
    """Errors over processor time, one curve a method, as PNG; `where` is the machine, `file` the name of the file."""
    from swarm.pictures.style import GREY

    picture, panels = subplots(3, 11.0, 5.4, sharex=True)
    for method in dict.fromkeys(p.method for p in found):
        curve = [p for p in found if p.method == method]
        seconds = [p.seconds for p in curve]
        # Steps that are centred about the impact have the colour of those that begin there.
        begun = method.removesuffix(", centred")
        mark = {"marker": "*", "markersize": 13} if method == "Impact" else {"marker": "o", "markersize": 4}
        if method != begun:
            mark = {"marker": "s", "markersize": 4, "markerfacecolor": "none"}
        line = {"color": colours()[_CURVES.index(begun)], "linewidth": 1.4, **mark}
        panels[0].plot(seconds, [max(p.energy, _LEAST) for p in curve], **line)
        for k, dash in enumerate((":", "--", "-")):
            faint = {"alpha": 1.0 if dash == "-" else 0.45, "markersize": mark["markersize"] if dash == "-" else 2}
            panels[1].plot(seconds, [max(p.errors[k], _LEAST) for p in curve], dash, **{**line, **faint})
        label = f"{method} (default)" if method == "Impact" else method
        panels[2].plot(seconds, [max(p.penetration, _LEAST) for p in curve], label=label, **line)
    band: Any = {"color": GREY, "linewidth": 7, "alpha": 0.35}
    panels[1].plot(
        [p.seconds for p in front], [max(p.errors[-1], _LEAST) for p in front], zorder=0, solid_capstyle="round", **band
    )
    panels[2].plot([], [], label="nothing is faster and nearer", **band)
    panels[0].set(title="energy error of the worst particle", ylabel="relative error")
    panels[1].set(title="distance from the exact place\nafter 64 impacts (faint: 20 and 5)", ylabel="median [m]")
    panels[2].set(title="largest penetration", ylabel="part of the scene's size")
    for axes in panels:
        axes.set(xscale="log", yscale="log", xlabel="processor time [s]")
        axes.set_ylim(0.5 * _LEAST, 10.0)
        ticks = [10.0**k for k in range(-15, 2, 3)]
        axes.set_yticks([_LEAST, *ticks], ["0", *(f"$10^{{{k}}}$" for k in range(-15, 2, 3))])
    picture.legend(loc="outside lower center", ncols=4)
    heading = f"Which method is near at which cost, {name}: time a particle and simulated second, one thread"
    picture.suptitle("\n".join([heading, *textwrap.wrap(f"{advice}. {where}.", 118)]), fontsize=10)
    save(picture, file_of(f"{file}.png"))
