"""Summaries show what lasts of contacts, and the heat of walls, only where there is some."""

import json
import re
from html import unescape

import h5py
import numpy as np
import pytest
from conftest import edited
from pages import Read

import swarm
from swarm import observables
from swarm.commands import summary
from swarm.common.catalog import OBSERVABLES
from swarm.pages import pictures as page_pictures
from swarm.pictures import graphs, plots, series
from swarm.recording import playback, recorded, sheet
from swarm.recording import writer as recording
from swarm.words import facts, verdicts
from swarm.words.amounts import plain
from swarm.words.content import content_of
from swarm.words.statements import rows_of

HOT = swarm.Scene([swarm.Sphere(0.5, temperature=300.0), swarm.Sphere(0.2, side="outside")])
FRAMES = 3
YOUNGER = ("sliding", "sliding_time", "wall_heat")


@pytest.fixture
def path(tmp_path):
    """A trajectory in which nothing slides, and no wall gives heat: a start that never moves."""
    rest = swarm.Particles([0.3, 0.0, 0.0], [0.0, 0.0, 0.0])
    swarm.simulate(HOT, rest, swarm.Impact(), until=1.0, every=0.5, trajectory=tmp_path / "run.h5", compile="never")
    return tmp_path / "run.h5"


def observed(path, **values):
    """Put these observables, each with one entry a frame, into a trajectory."""
    with edited(path) as file:
        for name, entries in values.items():
            file[f"observables/{name}/value"][:] = entries


LASTING = {
    "sliding": [0, 3, 12],
    "sliding_time": [0.0, 1.0, 3.4],
    "wall_heat": [[0.0, 0.0], [0.5, 0.0], [0.75, -0.5]],
    "total_energy": [1.0, 1.5, 1.25],
}


def test_where_nothing_lasts_there_is_no_word_of_it(path):
    assert {"sliding", "wall heat"}.isdisjoint(summary.of_file(path))
    totals = summary.numbers(path)
    assert [totals[name] for name in YOUNGER] == [0, 0.0, [0.0, 0.0]]


def test_sliding_and_wall_heat_are_reported(path):
    observed(path, **LASTING)
    rows, totals = summary.of_file(path), summary.numbers(path)
    assert rows["sliding"] == "12 at the end, 3.4 s in all"
    assert rows["wall heat"] == "surface 0: 0.75 J, surface 1: -0.5 J"
    assert rows["balance of energy"].startswith("✓ closes to 0 of what moved")
    assert [totals[name] for name in YOUNGER] == [12, 3.4, [0.75, -0.5]]
    assert totals["energy_drift"] == 0.0


def test_what_is_dissipated_is_beside_kinetic_energies(tmp_path):
    """Potential energy has no zero: a fall that begins near it dissipates more than the total energy at the start."""
    scene = swarm.Scene([swarm.Plane((0, 0, -1), 3.0, restitution=0.5)], gravity=(0, 0, -10.0))
    start = swarm.Particles([[0.0], [0.0], [0.0]], [[0.0], [0.0], [1.0]], 2.0)
    file = tmp_path / "fall.h5"
    result = swarm.simulate(scene, start, swarm.Impact(), until=1.0, trajectory=file, compile="never")
    seen = result.observables
    assert seen["dissipated_energy"][-1] > 10.0 * seen["total_energy"][0]
    text = f"{seen['dissipated_energy'][-1]:.4g} J; the kinetic energy: 1 J, then {seen['kinetic_energy'][-1]:.4g} J"
    assert summary.of_file(file)["dissipated"] == summary.of_result(result, None)["dissipated"] == text


def test_the_drift_of_a_fall_that_begins_near_the_zero_of_its_energy_is_round_off():
    """Of its total energy at the start it would be 7e-6."""
    scene = swarm.Scene([swarm.Sphere(0.5)], gravity=(0.0, 0.0, -9.81))
    start = swarm.Particles([[0.1, -0.1], [0.0, 0.0], [1e-12, 0.0]], np.zeros((3, 2)), 2.0)
    result = swarm.simulate(scene, start, swarm.Impact(), until=5.0, every=0.1, compile="never")
    rows = summary.of_result(result, None)
    row = rows["total energy"]
    part = observables.drift(result.observables)
    assert 0.0 < part < 1e-15
    assert row == f"✓ constant: it changes by {plain(part, 2)} of the energy that moved"


def test_the_work_of_walls_is_reported(tmp_path, path):
    """A piston that comes with u gives a particle of mass m and speed v the work 2 m u (v + u)."""
    assert summary.numbers(path)["wall_work"] == []
    ends = swarm.Plane((-1, 0, 0), 1.0), swarm.Plane((1, 0, 0), 1.0, motion=swarm.Translation((-0.5, 0.0, 0.0)))
    scene, start = swarm.Scene(ends), swarm.Particles([0.0, 0.0, 0.0], [1.0, 0.0, 0.0], 2.0)
    file = tmp_path / "piston.h5"
    result = swarm.simulate(scene, start, swarm.Impact(), until=1.0, every=0.5, trajectory=file, compile="never")
    rows, totals = summary.of_file(file), summary.numbers(file)
    assert rows["wall work"] == summary.of_result(result, None)["wall work"] == "surface 1: 3 J"
    assert rows["balance of energy"].startswith("✓ closes to 0 of what moved")
    assert totals["wall_work"] == [0.0, 3.0]
    assert totals["energy_drift"] == 0.0


def test_pictures_show_sliding_where_there_is_some(path, monkeypatch):
    """And the heat of each thermal surface as a power, where it gives any."""
    drawn = {}
    names = {graph: name for name, graph in series.GRAPHS.items()}
    monkeypatch.setattr(graphs, "lines", lambda axes, graph, curves, limit=0: drawn.update({names[graph]: curves}))
    made = path.with_suffix(".rrd")
    for values in ({}, LASTING):
        observed(path, **values)
        with swarm.load(path) as trajectory:
            recorded.record(trajectory, made, recording.Settings(), overwrite=True)
            plots.draw_plot(trajectory, path.with_suffix(".png"))
        by_plot, _ = dict(drawn), drawn.clear()
        sheet.draw_sheet(playback.Playback(made), path.with_suffix(".png"), None, False)
        for found in (by_plot, dict(drawn)):
            assert ("sliding" in found) == bool(values)
            assert ("heat" in found) == bool(values)
            if values:
                times, power = found["heat"]["sphere"]
                np.testing.assert_array_equal(times, [0.5, 1.0])
                np.testing.assert_array_equal(power, [1.0, 0.5])
                np.testing.assert_array_equal(found["sliding"]["all particles"][1], LASTING["sliding"])
        drawn.clear()


def test_a_file_of_an_older_version_is_read(path):
    with h5py.File(path, "r+") as file:
        for name in YOUNGER:
            del file[f"observables/{name}"]
    assert {"sliding", "wall heat"}.isdisjoint(summary.of_file(path))
    assert summary.numbers(path)["sliding_time"] == 0.0
    with swarm.load(path) as trajectory:
        assert trajectory.observed().keys().isdisjoint(YOUNGER)


def test_a_log_of_impacts_is_reported(tmp_path):
    """Not as a broken trajectory."""
    start = swarm.fill(HOT, 6, speed=0.5, seed=1)
    for some, kept in (("all", 6), (4, 2), ([5, 3, 5], 2)):
        swarm.simulate(
            HOT, start, swarm.Impact(), until=1.0, every=0.5, compile="never", impacts=tmp_path / "log.h5",
            impact_particles=some, overwrite=True,
        )  # fmt: skip
        with swarm.load_impacts(tmp_path / "log.h5") as log:
            table, sizes = log.table(), log.counts()
        assert len(table) > 0
        assert sizes.tolist() == [(table["surface"] == i).sum() for i in range(2)]
        rows = summary.of_file(tmp_path / "log.h5")
        assert rows["impacts"] == str(len(table))
        assert rows["particles"] == f"{kept} of 6"
        assert rows["frames"] == "3, 0 s to 1 s"
        assert rows["surface 1, ball"] == f"a ball of radius 0.2 m; {sizes[1]} impacts"
        assert rows["columns"].startswith("time, particle, surface, member, position")
    with pytest.raises(swarm.SceneError, match=r"there is no file .*none\.h5; expected a trajectory or a log"):
        summary.of_file(tmp_path / "none.h5")


def test_info_and_the_end_of_a_run_say_whether_it_went_well(tmp_path):
    """In the lines of pictures and reports; a run that loses energy is marked."""
    file = tmp_path / "run.h5"
    scene, start = swarm.Scene([swarm.Sphere(1.0)]), swarm.Particles([0.0, 0.0, 0.0], [1.0, 0.0, 0.0])
    result = swarm.simulate(scene, start, swarm.Impact(), until=3.0, trajectory=file, compile="never")
    rows, printed = summary.of_file(file), summary.of_result(result, None)
    assert rows["energy"] == "✓ the balance closes to the last bit"
    assert rows["walls"].startswith("✓ ")
    assert {name: text for name, text in rows.items() if name in printed} | printed == printed
    assert set(rows) - set(printed) == {"observables", "size", "checksums"}
    assert "Sphere(" not in " ".join(rows.values())
    observed(file, energy_error=1e-3)
    assert summary.of_file(file)["energy"].startswith("✗ not kept")


def test_every_printer_reads_one_list(tmp_path, monkeypatch):
    """Files, results, notebooks, pages, pictures and recordings make the same statements, without Python in them."""
    monkeypatch.setattr(page_pictures, "of_series", lambda content: [])
    monkeypatch.setattr(page_pictures, "of_places", lambda content: [])
    file = tmp_path / "run.h5"
    lossy = swarm.Box((0.5, 0.5, 0.5), restitution=0.9, openings=[swarm.Sphere(0.2, (0.0, 0.0, -0.5))])
    mouth = swarm.Counter(swarm.Plane((0.0, 0.0, -1.0), 0.4), inside=swarm.Sphere(0.2, (0.0, 0.0, -0.4)))
    scene = swarm.Scene([lossy, swarm.Sphere(0.2, side="outside", temperature=1.0)], gravity=(0.0, 0.0, -9.81))
    start = swarm.fill(scene, 30, speed=2.0, seed=1)
    result = swarm.simulate(
        scene, start, swarm.Impact(), until=1.0, every=0.25, trajectory=file, counters=[mouth], compile="never",
    )  # fmt: skip
    with swarm.load(file) as trajectory:
        listed = facts.of_content(content_of(trajectory))
        page = Read(trajectory.report().html)
        sentences = verdicts.marked(content_of(trajectory))
    rows = rows_of(listed)
    assert len(rows) == len(listed)
    assert {"surface 0, box", "counter 0", "balance of energy", "particles", "wall heat"} <= set(rows)
    assert rows["counter 0"].startswith("a plane of offset 0.4 m, normal along -z, within a sphere of radius 0.2 m")
    assert not re.search(r"\w\(\w+=|[\[\]{}<>]|None|True|False|array|  ", " ".join(rows.values()))
    assert summary.of_file(file).items() >= rows.items() <= summary.of_result(result, None).items()
    assert {f"{text[:1]} {label}: {text[2:]}" for label, text in rows.items() if text[0] in "✓✗·"} >= set(sentences)
    html = result._repr_html_()
    texts = " ".join(" ".join(page.texts.values()).split())
    for one in listed:
        assert one.text in unescape(html)
        assert " ".join(one.text.split()) in texts


def test_a_table_has_a_few_of_many_surfaces(tmp_path):
    """And a page all of them; the numbers of surfaces likewise."""
    scene = swarm.Scene([swarm.Sphere(1.0, (3.0 * k, 0.0, 0.0), side="outside") for k in range(12)], plane="z")
    start, file = swarm.Particles([-2.0, 0.0, 0.0], [1.0, 0.0, 0.0]), tmp_path / "run.h5"
    swarm.simulate(scene, start, swarm.Impact(), until=2.0, trajectory=file, compile="never")
    with edited(file) as stored:
        stored["observables/impulse/value"][:] = 1.5
    rows = summary.of_file(file)
    assert [name for name in rows if name.startswith("surface ")] == [f"surface {k}, disc {k + 1}" for k in range(7)]
    assert rows["more surfaces"] == "5"
    assert rows["impulse"].endswith("surface 6: 1.5 N s, 5 more")
    with swarm.load(file) as trajectory:
        assert sum(one.label.startswith("surface ") for one in facts.of_setting(content_of(trajectory))) == 12


def test_the_numbers_of_json_have_their_types(path):
    """Also where a file of an older version does not have them."""
    with h5py.File(path, "r+") as file:
        for name in ("sliding", "sliding_time", "wall_heat"):
            del file[f"observables/{name}"]
    totals = summary.numbers(path)
    floats = {"time", "energy_drift", *(name for name in totals if name in OBSERVABLES and not OBSERVABLES[name].axes)}
    counts = {"impacts", "sliding", "escaped", "unconverged"}
    assert {name: type(totals[name]) for name in counts} == dict.fromkeys(counts, int)
    assert {name: type(totals[name]) for name in floats - counts} == dict.fromkeys(floats - counts, float)
    assert totals["wall_heat"] == totals["born"] == []
    assert json.loads(json.dumps(totals)) == totals
