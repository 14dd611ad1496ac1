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


def test_throughput_quick(printed):
    table = printed("throughput")
    for row in (
        "bare loop in C, sphere",
        "limit: a square root",
        "1 thread, output: HDF5+Rerun",
        "2 threads, output: HDF5 ",
        "2 threads, output: none",
        "Impact, sphere",
        "Penalty, dt=0.025, sphere",
    ):
        assert row in table


def test_peers_quick(printed):
    """None of them is installed where the tests run: a sentence says so, and how to get it."""
    table = printed("peers")
    for peer in ("lammps", "openmm", "warp", "granular", "embree", "mujoco"):
        assert f"{peer} is left out: " in table or peer in table.lower()
    assert "swarm, Penalty: alpha=1e4, dt=1e-3" in table
    assert "plain Verlet in Numba" in table


def test_bars_quick(printed):
    table = printed("bars")
    for row in (
        "Impact, sphere ",
        "two threads over one",
        "Penalty, sphere, dt=0.025",
        "Uzawa, State I",
        "memory",
        "first frame",
    ):
        assert row in table


def test_order_quick(printed):
    table = printed("order")
    assert re.search(r"^sphere +Impact, centred .* exact ", table, re.MULTILINE)
    assert re.search(r"^torus +AugmentedLagrangian, centred .* [12]\.\d+ ", table, re.MULTILINE)


def test_scenes_quick(printed):
    table = printed("scenes")
    assert "capped cylinder" in table
    assert "formula of the ellipsoid" in table


def test_plane_quick(printed):
    table = printed("plane")
    assert "circle" in table
    assert "stadium" in table


@pytest.mark.slow
def test_contacts_quick(printed):
    table = printed("contacts")
    for row in ("cone with a lid", "hopper, friction 0.4", "mass ratio 100^2", "composed step, ellipsoid, 2 threads"):
        assert row in table


@pytest.mark.slow
def test_bodies_quick(printed):
    table = printed("bodies")
    for row in ("chain of ten, a step, two threads", "tetrahedron in a sphere, link error"):
        assert row in table


def test_accuracy_quick(printed):
    table = printed("accuracy")
    assert "sphere: Choose Impact" in table
    assert "distance <= 1e-06 (bar: Impact takes 1/1000 of plain Verlet in Numba): " in table


def test_stability_quick(printed):
    table = printed("stability")
    assert "stiffness: Penalty: energy within 1e-12 in 3 of 3 cells" in table
    assert "uzawa: State I with exponent 1: 1 of 1 converge" in table
    assert (
        "tunnelling: Penalty: 0 % of the particles pass the wall at most; refused from 5.7 thicknesses a step" in table
    )
    assert "tunnelling: plain Verlet: 5" in table
    assert "grazing: Impact, angles down to 1e-12 rad: energy within" in table
    assert "roundoff: Impact, sphere: worst energy error" in table


def test_endurance_quick(printed):
    table = printed("endurance")
    for row in ("checkpoint of 1000 particles", "memory grown", "a particle's path"):
        assert row in table


@pytest.mark.slow
def test_grains_quick(printed):
    table = printed("grains")
    for row in ("Hertz, gap after the contact", "8 rough, mu = 0.5 grains that fall", "  at rest, a grain and step"):
        assert row in table


@pytest.mark.slow
def test_meshes_quick(printed):
    assert "triangles" in printed("meshes")


@pytest.mark.slow
def test_cluster_quick(printed):
    assert "two workers of one thread" in printed("cluster")


def test_pairs_quick(printed):
    table = printed("pairs")
    assert re.search(r"^points, Impact +2 +0 +0 +100%", table, re.MULTILINE)
    assert re.search(r"^gravity +x$", table, re.MULTILINE)


def test_reference_quick(capsys):
    reference.main(reference.PATH, quick=True)
    assert "sphere: [" in capsys.readouterr().out


# They have no --quick: one reads tables, and its tests are below, the other one is tested in test_faults.py.
WITHOUT_QUICK = {"compare", "faults"}


def test_every_command_of_the_readme_runs():
    listed = re.findall(r"^\| `python -m bench[ .](\w+)", (ROOT / "bench" / "README.md").read_text(), re.MULTILINE)
    tested = {name.removeprefix("test_").removesuffix("_quick") for name in globals() if name.endswith("_quick")}
    assert len(listed) > 20
    assert set(listed) == tested | WITHOUT_QUICK


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


@pytest.mark.slow
def test_motion_quick(printed):
    table = printed("motion")
    for row in ("piston, T V^(2/3) - 1", "heavy piston, impacts", "Galperin, 100^2 kg", "box oscillating, an impact"):
        assert row in table


@pytest.mark.slow
def test_fields_quick(printed):
    table = printed("fields")
    for row in ("27 balls, an impact", "  the plain loop", "1000 balls, an impact", "  particles in a ball"):
        assert row in table


@pytest.mark.slow
def test_laws_quick(printed):
    table = printed("laws")
    for row in ("Lambert, an impact", "user-defined Lambert, an impact", "energy that no book has"):
        assert row in table


@pytest.mark.slow
def test_collisions_quick(printed):
    table = printed("collisions")
    rows = ("8788 balls, packing 0.4, box, a collision", "momentum along the cell", "overlap at 5 frames")
    for row in (*rows, "ball in a formula, an event", "ball in a formula over one in a box"):
        assert row in table


@pytest.mark.slow
def test_unions_quick(printed):
    table = printed("unions")
    for row in ("two balls, an impact", "a box, a tube, a box under gravity, an impact"):
        assert row in table


@pytest.mark.slow
def test_sweep_quick(printed):
    table = printed("sweep")
    for row in ("compile once", "swarm sweep, nothing compiled before", "memory of a worker, at the end"):
        assert row in table


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
