"""Pictures of benchmarks are drawn again from the tables of their reports, which that does not change."""

import json
import shutil
from pathlib import Path

import pytest
from children import python

from bench import accuracy, cells, pairs, redraw

pytest.importorskip("matplotlib")
ROOT = Path(__file__).parents[1]
RESULTS = ROOT / "bench" / "results"


def test_pictures_are_made_of_tables_alone(tmp_path):
    """One of each kind."""
    tables = [
        "accuracy-soft-sphere-intel-r-xeon-r-processor-avx-512-2-cores.csv",
        "throughput-amd-epyc-avx2-2-cores.csv",
        "stability-tunnelling.csv",
        "pairs.csv",
    ]
    for name in tables:
        shutil.copy(RESULTS / name, tmp_path)
    done = python("-m", "bench.redraw", str(tmp_path), cwd=ROOT)
    assert done.returncode == 0, done.stderr[-2000:]
    assert sorted(path.stem for path in tmp_path.glob("*.png")) == sorted(Path(name).stem for name in tables)
    for name in tables:
        assert (tmp_path / name).read_bytes() == (RESULTS / name).read_bytes(), name


def test_a_case_of_the_table_is_what_it_was(monkeypatch):
    """Scenes and methods have commas in their names."""
    given = []
    monkeypatch.setattr(redraw.figure, "throughput", lambda found, limits, *rest: given.append((found, limits, rest)))
    redraw.redraw_throughput(RESULTS / "throughput-amd-epyc-avx2-2-cores.csv")
    ((found, limits, (_fixed, where, _file)),) = given
    table = [row["what"] for row in redraw.rows(RESULTS / "throughput-amd-epyc-avx2-2-cores.csv")]
    assert sorted([*limits, *map(str, found)]) == sorted(table)
    assert all("thr" not in name for name in limits)
    assert where == "AMD EPYC, AVX2, 2 cores"


@pytest.mark.parametrize("name", accuracy.scenes())
def test_the_accuracy_tables_have_every_curve(name):
    """A picture is as old as its table, which is measured again when a method comes or goes."""
    (path,) = [one for one in RESULTS.glob("accuracy-*.csv") if redraw.scene_of(one) == name]
    assert list(dict.fromkeys(row["method"] for row in redraw.rows(path))) == list(
        accuracy.ways(name, accuracy.scenes()[name])
    )


def test_a_machine_by_the_name_of_a_file():
    assert redraw.machine_of("intel-r-xeon-r-processor-avx-512-2-cores") == "Intel Xeon Processor, AVX-512, 2 cores"


@pytest.mark.parametrize(
    ("seconds", "errors", "expected"),
    [
        ([1.0, 4.0, 3.0], [3e-16, 2e-16, 4e-16], "; Uzawa is as near, first at dt=2, in 3.0 times its time"),
        ([1.0, 4.0, 3.0], [3e-16, 1e-6, 1e-7], "; the nearest of the others, Uzawa at dt=2, is 1e-07 m off in 3.0"),
    ],
)
def test_the_advice_names_the_fastest_that_is_exact_or_the_nearest(seconds, errors, expected):
    names, settings = ("Impact", "Uzawa", "Uzawa"), ("default", "dt=1", "dt=2")
    found = [
        accuracy.Point("sphere", name, setting, spent, (error,) * 3, 0.0, 0.0)
        for name, setting, spent, error in zip(names, settings, seconds, errors, strict=True)
    ]
    assert expected in accuracy.advice("sphere", found)


def test_a_folder_that_is_not_there_is_a_sentence(tmp_path):
    done = python("-m", "bench.redraw", str(tmp_path / "nothing"), cwd=ROOT)
    assert done.returncode == 2
    assert "is no folder" in done.stderr


def test_the_table_of_pairs_is_that_of_the_committed_list():
    """So are the shares of the picture."""
    known = json.loads((ROOT / "tests" / "reference" / "pairs.json").read_text())
    names, words = known["capabilities"].split(", "), {"w": "works", "r": "refused", "!": "third"}
    assert pairs.read(RESULTS / "pairs.csv") == {
        cells.Cell(engine, wall, name): words[letter]
        for engine, rows in known["cells"].items()
        for wall, row in rows.items()
        for name, letter in zip(names, row.split(), strict=True)
        if letter != "-"
    }
