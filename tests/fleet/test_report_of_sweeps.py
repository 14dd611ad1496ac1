"""Reports of sweeps: the folder as it is found, its table, its graphs, and what a page says of runs that failed."""

import json
import shutil

import pytest
from pages import Read
from scene_texts import in_a_sphere

import swarm
from swarm.fleet import curves
from swarm.fleet.folder import found

SWEEP = in_a_sphere(
    'until = 1.0\nevery = 0.5\ncompile = "never"', 5,
    sweep='"surface.0.restitution" = [0.5, 0.9]\n"particles.seed" = {range = 2}',
)  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("sweeps")
    (place / "gas.toml").write_text(SWEEP)
    swarm.sweep(place / "gas.toml", place / "gas<script>", processes=1)
    return place / "gas<script>"


@pytest.fixture(scope="module")
def page(folder):
    return swarm.report(folder)


def test_a_page_has_the_table_the_graphs_and_the_sweep_file(folder, page):
    read = Read(page.html)
    assert {"numbers", "graphs", "runs", "reproduce"} <= set(read.ids)
    assert "failures" not in read.ids
    assert read.tags.count("tr") >= 5
    # Names of columns may be broken, and are whole where they are copied.
    assert read.tags.count("wbr") >= 3
    assert "surface.0.restitution" in read.texts["runs"]
    # Of two parameters, each observable that differs.
    assert read.tags.count("svg") == 2 * len(curves.main_observables(found(folder)))
    assert SWEEP.strip() in read.texts["reproduce"]
    assert "swarm sweep again.toml -o again" in read.texts["reproduce"]
    assert page.title.startswith("Sweep gas<script>: 4 runs, over surface.0.restitution and particles.seed")


@pytest.fixture
def words(monkeypatch):
    """Pages without graphs, which take a second: for tests of what they say."""
    monkeypatch.setattr(curves, "svg", lambda figure, description: "")


def test_names_of_folders_are_escaped_and_links_lead_to_files(folder, page, words):
    assert "<script>:" not in page.html
    links = Read(page.html).links
    assert len(links) == 5
    assert all(link.startswith("gas%3Cscript%3E/") for link in links)
    inside = Read(swarm.report(folder, folder / "page.html", overwrite=True).html)
    assert all((folder / link).is_file() for link in inside.links)


def test_what_comes_first_is_what_differs(folder):
    names = curves.main_observables(found(folder))
    assert names[0] == "kinetic_energy"
    assert "total_energy" not in names  # the same without gravity
    assert "energy_error" not in names  # round-off


def test_counts_of_what_leaves_and_crosses_are_seen_beside_the_energies_of_balls(tmp_path):
    """They are what such a sweep is made for, and six observables of balls differ between any two runs."""
    text = """
        [particles]
        count = 6
        radius = 0.05
        speed = 1.0
        [pairs]
        restitution = 0.9
        [[surface]]
        kind = "box"
        half_widths = [0.5, 0.5, 0.5]
        restitution = 0.9
        [[surface.openings]]
        kind = "sphere"
        radius = 0.3
        center = [0.0, 0.0, 0.5]
        [[counter]]
        surface = { kind = "plane", normal = [1.0, 0.0, 0.0] }
        [run]
        until = 1.0
        compile = "never"
        [sweep]
        "particles.seed" = { range = 4 }
    """
    (tmp_path / "leaky.toml").write_text(text)
    swarm.sweep(tmp_path / "leaky.toml", tmp_path / "leaky", processes=1)
    names = curves.main_observables(found(tmp_path / "leaky"))
    assert names[:3] == ["escaped", "crossings_0_0", "crossings_0_1"]
    assert "kinetic_energy" in names


def test_a_sweep_that_is_not_complete_and_a_run_that_failed_say_so(folder, tmp_path, words):
    copy = tmp_path / "copy"
    shutil.copytree(folder, copy)
    status = sorted(file for file in copy.glob("*.json"))[0]
    record = json.loads(status.read_text())
    status.write_text(json.dumps({**record, "state": "failed", "error": "it went <b>wrong</b>"}))
    read = Read(swarm.report(copy).html)
    assert "1 run failed" in read.texts["failures"]
    assert "it went <b>wrong</b>" in read.texts["failures"]
    assert "it went <b>wrong</b>" in read.texts["runs"]
    text = (copy / "results.csv").read_text()
    for file in copy.glob("*.json"):
        file.unlink()
    (copy / "results.csv").write_text(text.replace(",done,", ",waiting,", 1))
    assert "not complete: 1 of 4 runs have not ended" in Read(swarm.report(copy).html).texts[""]


def test_a_sweep_without_its_table_or_its_file_has_a_page(folder, tmp_path, words):
    copy = tmp_path / "copy"
    shutil.copytree(folder, copy)
    (copy / "results.csv").unlink()
    (copy / "sweep.toml").unlink()
    read = Read(swarm.report(copy).html)
    assert read.tags.count("tr") >= 5
    # Names of columns may be broken, and are whole where they are copied.
    assert read.tags.count("wbr") >= 3
    assert "surface.0.restitution" in read.texts["runs"]
    assert "does not hold the sweep file" in read.texts["reproduce"]


def test_a_table_that_is_none_is_a_sentence(tmp_path):
    (tmp_path / "results.csv").write_text("a,b\n1,2\n")
    with pytest.raises(swarm.SceneError, match=r"results\.csv is not the table of a sweep: expected the columns file"):
        swarm.report(tmp_path)
