"""The benchmark runs, so that it does not rot; nothing here is timed."""

import csv
import json
import os
import re
import runpy
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import pytest
from children import python

from bench import bars, collisions, compare, compiling, reference, report
from swarm.kernel import machine_code

pytestmark = pytest.mark.physics


ROOT = Path(__file__).parents[1]


def copied(code, *arguments, **environment):
    """`report.child`, of a process that has imported the libraries."""
    done = python("-c", code, *arguments, env={**os.environ, "PYTHONPATH": str(ROOT), **environment})
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture
def printed(monkeypatch, capsys):
    """What `python -m bench NAME --quick` prints."""
    monkeypatch.setattr(report, "_is_quick", False)
    for module in (bars, collisions):
        monkeypatch.setattr(module, "child", copied)

    def of(name):
        monkeypatch.setattr(sys, "argv", ["bench", name, "--quick"])
        runpy.run_module("bench", run_name="__main__")
        return capsys.readouterr().out

    return of


def at(pattern):
    """A line that begins so."""
    return re.compile("^" + pattern, re.MULTILINE)


# Of each command: texts of its table, and what its lines match.
TABLES = {
    "accuracy": (
        "sphere: Choose Impact",
        "distance <= 1e-06 (bar: Impact takes 1/1000 of plain Verlet in Numba): ",
    ),
    "bars": (
        "Impact, sphere ", "two threads over one", "Penalty, sphere, dt=0.025", "Uzawa, State I", "memory",
        "first frame",
    ),
    "bodies": ("chain of ten, a step, two threads", "tetrahedron in a sphere, link error"),
    "cluster": ("two workers of one thread",),
    "collisions": (
        "8788 balls, packing 0.4, box, a collision", "momentum along the cell", "overlap at 5 frames",
        "ball in a formula, an event", "ball in a formula over one in a box",
    ),
    "contacts": (
        "cone with a lid", "hopper, friction 0.4", "mass ratio 100^2", "composed step, ellipsoid, 2 threads",
    ),
    "endurance": ("checkpoint of 1000 particles", "memory grown", "a particle's path"),
    "fields": ("27 balls, an impact", "  the plain loop", "1000 balls, an impact", "  particles in a ball"),
    "grains": ("Hertz, gap after the contact", "8 rough, mu = 0.5 grains that fall", "  at rest, a grain and step"),
    "laws": ("Lambert, an impact", "user-defined Lambert, an impact", "energy that no book has"),
    "meshes": ("triangles",),
    "motion": (
        "piston, T V^(2/3) - 1", "heavy piston, impacts", "Galperin, 100^2 kg", "box oscillating, an impact",
    ),
    "order": (at("sphere +Impact, centred .* exact "), at(r"torus +AugmentedLagrangian, centred .* [12]\.\d+ ")),
    "pairs": (at(r"points, Impact +2 +0 +0 +100%"), at("gravity +x$")),
    "plane": ("circle", "stadium"),
    "scenes": ("capped cylinder", "formula of the ellipsoid"),
    "stability": (
        "stiffness: Penalty: energy within 1e-12 in 3 of 3 cells",
        "uzawa: State I with exponent 1: 1 of 1 converge",
        "tunnelling: Penalty: 0 % of the particles pass the wall at most; refused from 5.7 thicknesses a step",
        "tunnelling: plain Verlet: 5",
        "grazing: Impact, angles down to 1e-12 rad: energy within",
        "roundoff: Impact, sphere: worst energy error",
    ),
    "sweep": ("compile once", "swarm sweep, nothing compiled before", "memory of a worker, at the end"),
    "throughput": (
        "bare loop in C, sphere", "limit: a square root", "1 thread, output: HDF5+Rerun", "2 threads, output: HDF5 ",
        "2 threads, output: none", "Impact, sphere", "Penalty, dt=0.025, sphere",
    ),
    "unions": ("two balls, an impact", "a box, a tube, a box under gravity, an impact"),
}  # fmt: skip
# They compile kernels that no other test needs.
ALONE = {
    "bodies", "cluster", "collisions", "contacts", "fields", "grains", "laws", "meshes", "motion", "sweep", "unions",
}  # fmt: skip


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow) if name in ALONE else name for name in TABLES]
)
def test_the_table_of_a_command(printed, name):
    table = printed(name)
    for line in TABLES[name]:
        assert line in table if isinstance(line, str) else line.search(table), line


def test_peers_quick(printed):
    """None of them is installed where the tests run: a sentence says so, and how to get it."""
    table = printed("peers")
    for peer in ("lammps", "openmm", "warp", "granular", "embree", "mujoco"):
        assert f"{peer} is left out: " in table or peer in table.lower()
    assert "swarm, Penalty: alpha=1e4, dt=1e-3" in table
    assert "plain Verlet in Numba" in table


def test_reference_quick(capsys):
    reference.main(reference.PATH, quick=True)
    assert "sphere: [" in capsys.readouterr().out


# They have no --quick: one reads tables, and its tests are below, the other one is tested in test_faults.py.
WITHOUT_QUICK = {"compare", "faults"}


def test_every_command_of_the_readme_runs():
    listed = re.findall(r"^\| `python -m bench[ .](\w+)", (ROOT / "bench" / "README.md").read_text(), re.MULTILINE)
    alone = {name.removeprefix("test_").removesuffix("_quick") for name in globals() if name.endswith("_quick")}
    assert len(listed) > 20
    assert set(listed) == alone | set(TABLES) | WITHOUT_QUICK


def table(path, **rows):
    """A report with these (min, median, unit)."""
    lines = [f'"{what}",{best},{median},{unit},,' for what, (best, median, unit) in rows.items()]
    path.write_text("\n".join(["what,min,median,unit,bar,ratio", *lines]) + "\n")
    return path


def test_compare_tells_a_change_from_the_noise_and_from_the_clock(tmp_path, capsys):
    yard = compare._YARDSTICK
    old = table(
        tmp_path / "old.csv",
        **{yard: (2.0, 2.02, "ns/impact"), "worse": (5.0, 5.05, "ns/impact"), "noisy": (5.0, 6.0, "ns/impact")},
        **{
            "limit: a root": (1.0, 1.0, "ns/item"),
            "better": (5.0, 5.05, "ns/impact"),
            "scaling": (1.8, 1.79, "x"),
            "energy": (1e-16, 1e-16, "relative"),
        },
        gone=(1.0, 1.0, "s"),
    )
    new = table(
        tmp_path / "new.csv",
        **{yard: (4.0, 4.04, "ns/impact"), "worse": (11.0, 11.1, "ns/impact"), "noisy": (11.0, 11.2, "ns/impact")},
        **{
            "limit: a root": (9.0, 9.0, "ns/item"),
            "better": (9.0, 9.1, "ns/impact"),
            "scaling": (1.5, 1.49, "x"),
            "energy": (1e-15, 1e-15, "relative"),
        },
    )
    verdicts = {row.what: row.verdict() for row in compare.changes(compare.read(old), compare.read(new))}
    assert verdicts == {"worse": "slower", "noisy": "", "better": "faster", "scaling": "slower"}
    assert compare.main(old, new) == 1
    assert "2 of 4 got slower" in capsys.readouterr().out
    assert compare.main(old, old) == 0


def test_compare_wants_a_report(tmp_path):
    path = tmp_path / "other.csv"
    path.write_text("a,b\n1,2\n")
    with pytest.raises(SystemExit, match="no report of bench"):
        compare.read(path)


def test_what_others_took_is_reported(monkeypatch):
    monkeypatch.setattr(report, "stolen", lambda: (130, 1200))
    assert report.told_of_others((100, 1000)).split(" of the time")[0].endswith("took 15 %")
    monkeypatch.setattr(report, "stolen", lambda: (100, 1000))
    assert "an unknown part" in report.told_of_others((100, 1000))


def test_compile_quick(printed):
    """The first process compiles what the second one finds; LLVM is a part of it, and the run alone next to nothing."""
    seconds = dict(re.findall(r"^ *cavity, the main job(?:, (.*?))? {2,}(\S+)", printed("compile"), re.MULTILINE))
    seconds = {what: float(least) for what, least in seconds.items()}
    assert seconds["functions compiled"] >= 2.0
    assert seconds["functions compiled there"] == 0.0
    assert 0.0 < seconds["of it LLVM"] < seconds[""]
    assert seconds["the run alone"] < seconds["second process"] < seconds[""]


def test_compile_reports_the_least_and_what_failed(tmp_path, monkeypatch):
    """Each repeat has a cache of its own, for two processes; a scene that fails is a row, and is not tried again."""
    asked, caches = [], []

    def child(_code, name, **environment):
        asked.append(name)
        if name == "planes":
            raise subprocess.CalledProcessError(1, "python", stderr="Traceback\nRecursionError: too deep\n")
        if name == "cone":
            raise subprocess.CalledProcessError(-11, "python", stderr="")
        caches.append(environment["NUMBA_CACHE_DIR"])
        k = len(caches)
        return json.dumps([0.5, 8.0 - k, 100 if k % 2 else 0, 4.0 - 0.5 * k, 0.01 * k])

    monkeypatch.setattr(compiling, "child", child)
    monkeypatch.setattr(report, "_folder", tmp_path)
    compiling.main(quick=False, scenes=["planes", "drum", "cone"], repeats=3)
    assert asked == ["planes", "drum", "drum", "cone", *4 * ["drum"]]
    assert caches[::2] == caches[1::2]
    assert len(set(caches)) == 3
    (path,) = tmp_path.glob("compile-*.csv")
    with open(path, newline="") as file:
        rows = [(row["what"], row["min"], row["median"], row["bar"]) for row in csv.DictReader(file)]
    assert rows == [
        ("24 planes in random directions: RecursionError: too deep", "nan", "nan", "5"),
        ("drum", "3", "5", "10"),
        ("  drum, functions compiled", "100", "100", ""),
        ("  drum, of it LLVM", "1.5", "2.5", ""),
        ("  drum, before the call", "0.5", "0.5", ""),
        ("  drum, second process", "2", "4", ""),
        ("  drum, functions compiled there", "0", "0", "0"),
        ("  drum, the run alone", "0.02", "0.04", ""),
        ("cone, friction 0.4, e = 0.5, a lid, gravity: exit code -11", "nan", "nan", "8"),
    ]


def test_compile_counts_the_time_of_what_is_in_another_once(monkeypatch):
    clock = iter([1.0, 5.0, 7.0, 7.5])
    monkeypatch.setattr(compiling, "time", SimpleNamespace(process_time=lambda: next(clock)))
    heard = compiling.Heard()
    for event in (heard.on_start, heard.on_start, heard.on_end, heard.on_end, heard.on_start, heard.on_end):
        event(None)
    assert (heard.times, heard.seconds) == (3, 4.5)


@pytest.mark.parametrize("wrong", [["--repeats", "0"], ["--repeats", "-1"], ["--scenes", "moon"]])
def test_compile_refuses_what_it_does_not_know(wrong, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["bench", "compile", *wrong])
    with pytest.raises(SystemExit, match="2"):
        runpy.run_module("bench", run_name="__main__")
    assert wrong[-1] in capsys.readouterr().err


@pytest.mark.long
@pytest.mark.parametrize("name", compiling.CASES)
def test_compile_meets_every_kernel_of_a_longer_run(name):
    """Else the report would leave something out that the run of the scene compiles."""
    case = compiling.CASES[name]

    def kernels():
        return {(kernel.__name__, kinds) for kernel in machine_code._kernels for kinds in kernel.overloads}

    compiling.call(case, time.process_time())
    met = kernels()
    compiling.call(case._replace(until=10.0 * case.until), time.process_time())
    assert kernels() == met
