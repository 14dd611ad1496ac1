"""The pictures of the reports."""

import statistics
import textwrap
from pathlib import Path
from typing import Any

from .report import file_of, machine, name_of_machine

# Okabe and Ito: told apart by every kind of eye.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#999999")
# (threads, output) -> line
_STYLES = {(1, "none"): "-", (2, "none"): "--", (1, "HDF5"): ":"}

Found = dict[Any, list[float]]  # case -> nanoseconds an impact or step
Limits = dict[str, list[float]]  # yardstick -> nanoseconds


def subplots(count: int, width: float, height: float, **options: Any) -> tuple[Any, Any]:
    """A picture of so many panels side by side [inches], drawn without a screen."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    return pyplot.subplots(1, count, figsize=(width, height), layout="constrained", **options)


def save(picture: Any, path: Path) -> None:
    """Write it, and let it go."""
    from matplotlib import pyplot

    picture.savefig(path, dpi=100)
    pyplot.close(picture)
    print(f"written to {path}")


def throughput(found: Found, limits: Limits, fixed_step: list[str]) -> None:
    """Impacts a second by scene, steps a second by method, and what a second thread brings, as PNG."""
    picture, (impacts, steps, scaling) = subplots(3, 16.0, 5.4)
    scenes = list(dict.fromkeys(case.scene for case in found))
    _speeds(impacts, found, [("Impact", scene, scene) for scene in scenes])
    _speeds(steps, found, [(method, "sphere", method) for method in fixed_step])
    _bounds(impacts, limits, "bare loop in C, sphere")
    _bounds(steps, limits, "bare Verlet in C, sphere", "plain Verlet in Numba, sphere")
    _scaling(scaling, found, limits, scenes)
    impacts.set(title="Impact", ylabel="million impacts per second", yscale="log")
    steps.set(title="Methods of fixed step, sphere", ylabel="million particle-steps per second", yscale="log")
    scaling.set(title="Impact, two threads over one", ylabel="ratio of the speeds")
    scaling.set_ylim(bottom=0.0)
    for axes in (impacts, steps, scaling):
        axes.set(xlabel="particles", xscale="log")
        axes.grid(alpha=0.3, which="major")
        axes.legend(fontsize=8, loc="lower right")
    picture.suptitle(f"{machine()}: one thread (full), two (dashed), one and a trajectory (dotted)", fontsize=10)
    save(picture, file_of(f"throughput-{name_of_machine()}.png"))


def _speeds(axes: Any, found: Found, lines: list[tuple[str, str, str]]) -> None:
    """One colour a (method, scene, label)."""
    for colour, (method, scene, label) in zip(COLOURS, lines, strict=False):
        for (threads, output), style in _STYLES.items():
            wanted = (method, scene, threads, output)
            chosen = sorted((c.n, c) for c in found if (c.method, c.scene, c.threads, c.output) == wanted)
            axes.plot(
                [n for n, _case in chosen], [1e3 / min(found[case]) for _n, case in chosen], style,
                color=colour, marker="o", markersize=3.5, linewidth=1.4, label=label if style == "-" else None,
            )  # fmt: skip


def _bounds(axes: Any, limits: Limits, *names: str) -> None:
    """What is not ours, as grey lines."""
    for name in names:
        if name in limits:
            _grey_line(axes, 1e3 / min(limits[name]), f"{name}, one core")


def _grey_line(axes: Any, height: float, text: str) -> None:
    axes.axhline(height, color="0.4", linewidth=1.0)
    place = {"xycoords": ("axes fraction", "data"), "ha": "right", "va": "bottom"}
    axes.annotate(text, (0.99, height), color="0.4", fontsize=8, **place)


def _scaling(axes: Any, found: Found, limits: Limits, scenes: list[str]) -> None:
    """Speed of two threads over one."""
    for colour, scene in zip(COLOURS, scenes, strict=False):
        best = {
            (c.n, c.threads): min(v)
            for c, v in found.items()
            if (c.method, c.scene) == ("Impact", scene) and c.output == "none"
        }
        numbers = sorted(n for n, threads in best if threads == 2)
        axes.plot(
            numbers, [best[n, 1] / best[n, 2] for n in numbers],
            color=colour, marker="o", markersize=3.5, linewidth=1.4, label=scene,
        )  # fmt: skip
    one, two = (limits.get(name) for name in ("bare loop in C, sphere", "bare loop in C, two at once"))
    if one and two:
        _grey_line(axes, 2.0 * statistics.median(one) / statistics.median(two), "two bare loops in C at once")


# One colour a method, whatever the scene.
_CURVES = (
    "Impact", "Penalty", "Impact, contact_step", "AugmentedLagrangian", "Midpoint", "Trapezoidal", "Verlet",
    "plain Verlet in Numba",
)  # fmt: skip
# Zero has no place on a logarithmic axis.
_LEAST = 1e-17


def accuracy(name: str, found: list[Any], front: list[Any], advice: str) -> None:
    """Errors over wall time, one curve a method, as PNG."""
    picture, panels = subplots(3, 12.0, 5.6, sharex=True)
    for method in dict.fromkeys(p.method for p in found):
        curve = [p for p in found if p.method == method]
        seconds = [p.seconds for p in curve]
        mark = {"marker": "*", "markersize": 13} if method == "Impact" else {"marker": "o", "markersize": 4}
        line = {"color": COLOURS[_CURVES.index(method)], "linewidth": 1.4, **mark}
        panels[0].plot(seconds, [max(p.energy, _LEAST) for p in curve], **line)
        for k, style in enumerate((":", "--", "-")):
            faint = {"alpha": 1.0 if style == "-" else 0.45, "markersize": mark["markersize"] if style == "-" else 2}
            panels[1].plot(seconds, [max(p.errors[k], _LEAST) for p in curve], style, **{**line, **faint})
        label = f"{method} (default)" if method == "Impact" else method
        panels[2].plot(seconds, [max(p.penetration, _LEAST) for p in curve], label=label, **line)
    panels[1].plot(
        [p.seconds for p in front], [max(p.errors[-1], _LEAST) for p in front], color="0.7", linewidth=7, alpha=0.5,
        zorder=0, solid_capstyle="round",
    )  # fmt: skip
    panels[2].plot([], [], color="0.7", linewidth=7, alpha=0.5, label="nothing is faster and nearer")
    panels[0].set(title="worst particle's energy error", ylabel="relative error")
    panels[1].set(title="median distance after 64 impacts\n(faint: 20 dashed, 5 dotted)", ylabel="m")
    panels[2].set(title="largest penetration", ylabel="part of the scene's size")
    for axes in panels:
        axes.set(xscale="log", yscale="log", xlabel="wall time [s]")
        axes.set_ylim(0.5 * _LEAST, 10.0)
        axes.grid(alpha=0.3, which="major")
    picture.legend(loc="outside lower center", ncols=5, fontsize=9)
    heading = f"{name}: wall time per particle and simulated second, one thread, {machine()}"
    picture.suptitle("\n".join([heading, *textwrap.wrap(advice + ".", 150)]), fontsize=10)
    save(picture, file_of(f"accuracy-{name.replace(' ', '-')}-{name_of_machine()}.png"))
