"""Which tests are slow, and how tables and products become tests."""

import itertools
from pathlib import Path
from types import SimpleNamespace

import durations
import pytest
from conftest import _cover, row

ROOT = Path(__file__).parents[1]


@pytest.mark.parametrize("sizes", [(2, 3), (3, 3, 3), (16, 4, 2), (34, 3, 3, 3)], ids=str)
def test_a_cover_has_every_pair(sizes):
    rows = list(_cover(sizes))
    for i, j in itertools.combinations(range(len(sizes)), 2):
        assert {(one[i], one[j]) for one in rows} == set(itertools.product(range(sizes[i]), range(sizes[j])))
    largest, second = sorted(sizes)[:-3:-1]
    assert largest * second <= len(rows) <= 1.2 * largest * second


def test_a_failure_names_its_row():
    with pytest.raises(AssertionError) as caught, row("sphere", 1e-6):
        raise AssertionError
    assert caught.value.__notes__ == ["in the row sphere, 1e-06"]


def test_the_table_names_tests_that_are_there():
    seconds, unmeasured = durations.known()
    for name in seconds:
        path, *names = name.partition("[")[0].split("::")
        with row(name):
            text = (ROOT / path).read_text("utf-8")
            assert path.startswith("swarm/") or all(f"def {one}(" in text or f"class {one}" in text for one in names)
    assert [path for path in unmeasured if not (ROOT / path).exists()] == []
    assert min(seconds.values()) >= durations.SLOW


def test_what_is_measured_is_written(tmp_path, monkeypatch):
    monkeypatch.setattr(durations, "FILE", tmp_path / "durations.json")
    durations.FILE.write_text('{"a.py": null, "b.py": {"test_x": 0.9, "test_y": 2.0}, "c.py": null}')
    durations.write({"a.py::test[1]": 0.7, "b.py::test_x": 0.1})
    assert durations.known() == ({"a.py::test[1]": 0.7, "b.py::test_y": 2.0}, {"c.py"})


def test_the_tests_of_a_file_stay_together_and_the_longest_file_comes_first():
    seconds = {"a::one": 1.0, "a::two": 3.0, "b::one": 2.9, "b::two": 2.0}
    items = [SimpleNamespace(nodeid=name, path=Path(name[0])) for name in ("c::one", *seconds, "c::two", "a::three")]
    items.sort(key=durations.order(items, seconds))
    assert [item.nodeid for item in items] == ["b::one", "b::two", "a::two", "a::one", "a::three", "c::one", "c::two"]


def test_of_a_file_of_slow_tests_the_shortest_is_quick(monkeypatch):
    """Unless it takes a second or more, or nothing is known of its file."""
    seconds = {"a.py::one": 2.0, "a.py::other": 0.9, "b.py::one": 1.0, "c.py::one": 0.5, "d.py::one": 0.5}
    monkeypatch.setattr(durations, "known", lambda: (seconds, {"d.py"}))
    names = ["a.py::one", "a.py::other", "b.py::one", "c.py::one", "c.py::quick", "d.py::new"]
    assert durations.slow_ones(names) == {"a.py::one", "b.py::one", "c.py::one", "d.py::new"}
