"""Reports of runs: what a page says, that it needs nothing besides itself, and that runs can be reproduced by it."""

import contextlib
import re
from dataclasses import dataclass, replace

import filelock
import h5py
import numpy as np
import pytest
from children import python
from matplotlib.backends.backend_agg import FigureCanvasAgg
from pages import Read
from scene_texts import in_a_sphere

import swarm
from examples.own_law import Viscoelastic
from examples.own_method import Mirror
from swarm.commands import summary
from swarm.files import paths
from swarm.pages import html, of_run, pictures
from swarm.pictures import drawing, style
from swarm.triangles.shapes import shapes_of
from swarm.words.facts import of_trajectory
from swarm.words.statements import Statement

SCENE = in_a_sphere("until = 1.0\nevery = 0.25", "20\nseed = 3", before="gravity = [0.0, 0.0, -9.81]")
SECTIONS = ["verdicts", "happened", "places", "scene", "series", "numbers", "speed", "reproduce"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A run of a scene file, in a file whose name is a tag."""
    folder = tmp_path_factory.mktemp("<script>alert(1)<")
    job = folder / "scene.toml"
    job.write_text(SCENE)
    run(folder / "<b>run.h5", scene_text=SCENE)
    return folder


def run(path, until=1.0, method=None, laws=(), **options):
    scene = swarm.Scene(surfaces=[swarm.Sphere(radius=0.5, laws=laws)], gravity=(0.0, 0.0, -9.81))
    start = swarm.fill(scene, 20, speed=1.0, seed=3)
    return swarm.simulate(scene, start, method, until=until, every=0.25, trajectory=path, compile="never", **options)


@pytest.fixture(scope="module")
def page(folder):
    return swarm.report(folder / "<b>run.h5")


@pytest.fixture
def words(monkeypatch):
    """Pages without pictures, which take three seconds: for tests of what they say."""
    monkeypatch.setattr(pictures, "of_series", lambda content: [])
    monkeypatch.setattr(pictures, "of_places", lambda content: [])


@pytest.fixture
def coarse(monkeypatch):
    """Pages whose pictures have few pixels."""
    monkeypatch.setattr(pictures, "_DPI", 30)


def test_a_page_has_its_sections_and_needs_nothing_besides_itself(page):
    read = Read(page.html)
    assert [name for name in read.ids if not re.match(r"g[0-9a-f]{12}-", name)] == SECTIONS
    assert not re.search(r"""(src|href|srcset)\s*=\s*["'](https?:)?//""", page.html)
    assert "script" not in read.tags
    assert len(page.html) < 2e6
    assert read.tags.count("svg") >= 4
    assert read.tags.count("picture") == 2


def test_it_says_what_ran_how_well_and_how_fast(page):
    read = Read(page.html)
    assert page.title == "20 particles in a sphere, under gravity: Impact, 1 s"
    assert "✓ holds" in read.texts["verdicts"]
    assert "energy" in read.texts["verdicts"]
    assert "✓ yes: all 4 checks hold" in read.texts["verdicts"]
    for word in ("impacts", "wall time", "20 particles of 1 kg", "a sphere of radius 0.5 m", "Impact"):
        assert word in read.texts["happened"]
    for word in ("wall time", "threads", "swarm", "Python", "NumPy", "Numba", "HDF5", "machine", np.__version__):
        assert word in read.texts["speed"]
    assert "9.81" in read.texts["scene"]
    assert SCENE.strip() in read.texts["reproduce"]
    assert "swarm run '<b>run.toml' -o again.h5" in read.texts["reproduce"]


@pytest.mark.parametrize(
    ("judged", "answer"),
    [
        ([True, True, None], ("✓ yes: all 2 checks hold", True)),
        ([True], ("✓ yes: it holds", True)),
        ([True, False], ("✗ no: 1 of 2 checks fails", False)),
        ([False, False, True], ("✗ no: 2 of 3 checks fail", False)),
    ],
)
def test_the_answer_in_short(judged, answer):
    assert of_run._answer([Statement("one", "of some", verdict) for verdict in judged]) == answer


def test_names_are_escaped(page):
    assert "<b>run" not in page.html
    assert "&lt;b&gt;run.h5" in page.html


def test_texts_of_a_scene_file_are_escaped(tmp_path, words):
    evil = SCENE + "# </pre><script>alert(1)</script>\n"
    run(tmp_path / "run.h5", scene_text=evil)
    page = swarm.report(tmp_path / "run.h5")
    assert "<script" not in page.html
    assert "<script>alert(1)</script>" in Read(page.html).texts["reproduce"]


def test_it_is_written_where_it_may_be(folder, page, tmp_path, monkeypatch):
    target = tmp_path / "page.html"
    with swarm.load(folder / "<b>run.h5") as trajectory:
        with monkeypatch.context() as graphs_alone:
            graphs_alone.setattr(pictures, "of_places", lambda content: [])
            assert trajectory.report(target).title == page.title
        before = target.read_text()
        assert Read(before).ids == [name for name in Read(page.html).ids if name != "places"]
        with pytest.raises(swarm.SceneError, match=r"report: .*page.html exists"):
            trajectory.report(target)
        monkeypatch.setattr(pictures, "of_series", lambda content: [])
        monkeypatch.setattr(pictures, "of_places", lambda content: [])
        trajectory.report(target, overwrite=True)
    assert Read(target.read_text()).ids == [name for name in SECTIONS if name != "places"] != Read(before).ids
    with pytest.raises(swarm.SceneError, match=r"ends in \.html, got .*page\.pdf"):
        page.save(tmp_path / "page.pdf")
    with pytest.raises(swarm.SceneError, match="does not exist; create it first"):
        page.save(tmp_path / "no" / "page.html")
    with pytest.raises(swarm.SceneError, match=r"is also the page\.html that it is of"):
        html.checked_target(target, True, (target,))


def test_a_notebook_shows_it(page):
    shown = page._repr_html_()
    assert shown.startswith("<iframe")
    assert "<script" not in shown
    assert "&lt;!DOCTYPE html&gt;" in shown


def test_a_result_without_a_trajectory_has_one_too(tmp_path, coarse):
    scene = swarm.Scene(surfaces=[swarm.Sphere(radius=0.5)])
    result = swarm.simulate(scene, swarm.fill(scene, 5, speed=1.0), swarm.Impact(), until=1.0, compile="never")
    read = Read(result.report(tmp_path / "page.html").html)
    assert "keep the script" in read.texts["reproduce"]
    assert (tmp_path / "page.html").is_file()


def test_the_wall_times_of_frames_and_what_made_the_file_are_kept(folder):
    with swarm.load(folder / "<b>run.h5") as trajectory:
        assert (np.diff(trajectory.wall_times) >= 0.0).all()
        assert len(trajectory.wall_times) == len(trajectory) == 5
        assert trajectory.until == 1.0
        assert trajectory.threads >= 1
        assert {"name", "version", "python", "numpy", "numba", "hdf5", "machine", "date"} <= set(trajectory.makers)


# --- How to reproduce it ---------------------------------------------------------------------------------


def last(path):
    with swarm.load(path) as trajectory:
        return trajectory.frame(-1).position


def reproduce(page, folder):
    return Read(page.html).texts["reproduce"]


def test_the_lines_of_python_give_the_same_bits(folder, page, tmp_path):
    lines = reproduce(page, folder).split("In Python")[1]
    done = python("-c", lines, cwd=folder)
    assert done.stderr == ""
    assert (last(folder / "again.h5") == last(folder / "<b>run.h5")).all()


def test_a_run_of_python_gets_a_scene_file(tmp_path, words):
    run(tmp_path / "run.h5", seed=4)
    section = reproduce(swarm.report(tmp_path / "run.h5"), tmp_path)
    assert "only this file holds" in section
    text = section[section.index("gravity = ") : section.index("In Python")]
    (tmp_path / "again.toml").write_text(text)
    done = python("-m", "swarm", "run", "again.toml", "-o", "again.h5", "--quiet", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert (last(tmp_path / "again.h5") == last(tmp_path / "run.h5")).all()


@dataclass(frozen=True)
class Weaker(Mirror):
    """A user-defined method with a number."""

    share: float = 1.0


def test_a_run_by_a_method_of_the_user_is_repeated_where_that_is_defined(tmp_path, words):
    run(tmp_path / "run.h5", method=Weaker(0.5))
    with swarm.load(tmp_path / "run.h5") as trajectory:
        assert repr(trajectory.method) == "Weaker(share=0.5)"
        assert of_trajectory(trajectory)["method"] == "Weaker, share 0.5"
    section = reproduce(swarm.report(tmp_path / "run.h5"), tmp_path)
    lines = section.split("In Python")[1]
    assert f"from {__name__} import Weaker" in lines
    with contextlib.chdir(tmp_path):
        exec(lines, {})
    assert (last(tmp_path / "again.h5") == last(tmp_path / "run.h5")).all()


def test_a_method_of_a_script_has_no_command(tmp_path, words, monkeypatch):
    monkeypatch.setattr(Weaker, "__module__", "__main__")
    run(tmp_path / "run.h5", method=Weaker(0.5))
    section = reproduce(swarm.report(tmp_path / "run.h5"), tmp_path)
    assert "the script that defines it" in section
    assert "swarm run" not in section
    assert "start, Weaker(share=0.5), until" in section


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"laws": [Viscoelastic(0.1)]}, "Viscoelastic(slow=0.1) is code"),
        ({"frames": "none"}, "keeps no particles"),
        ({"frames": 3}, "one particle in 3"),
        ({"precision": "float32"}, "in float32"),
    ],
    ids=str,
)
def test_what_cannot_be_reproduced_is_reported(options, reason, tmp_path, words):
    run(tmp_path / "run.h5", **options)
    assert reason in reproduce(swarm.report(tmp_path / "run.h5"), tmp_path)


# --- Runs of all kinds -----------------------------------------------------------------------------------


def cut(path, **options):
    """A run that was stopped after three frames."""

    def stop(frame):
        if frame.number == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(path, progress=stop, **options)


def test_a_run_that_was_cut_says_so(tmp_path, words):
    cut(tmp_path / "run.h5")
    page = Read(swarm.report(tmp_path / "run.h5").html).texts[""]
    assert "This run is not complete: it was stopped at" in page
    assert "of 1 s" in page
    sentence = (
        "This run is not complete: it was stopped at 0.5 s of 1 s. There is no checkpoint beside it to go on from."
    )
    rows = summary.of_file(tmp_path / "run.h5")
    assert (next(iter(rows)), rows["state"]) == ("state", sentence)
    run(tmp_path / "whole.h5")
    assert "state" not in summary.of_file(tmp_path / "whole.h5")


def test_a_run_that_was_cut_names_its_own_scene_file(tmp_path):
    """Whatever the names of both; SCENE.toml stands for one that is not there."""
    path, text = tmp_path / "job_7.h5", "[run]\nuntil = 1.0\n"
    cut(path, scene_text=text)
    (tmp_path / "job_7.h5.checkpoint").touch()
    (tmp_path / "job_7.toml").write_text("[run]\nuntil = 2.0\n")
    assert summary.of_file(path)["state"].endswith("by its scene file: swarm run SCENE.toml -o job_7.h5 --resume")
    (tmp_path / "gas.toml").write_text(text)
    assert summary.of_file(path)["state"].endswith("Go on with it: swarm run gas.toml -o job_7.h5 --resume")


def test_a_run_that_goes_on_says_so(folder, words):
    path = folder / "<b>run.h5"
    with filelock.FileLock(paths.lock_of(path)):
        assert "A run writes this file now" in Read(swarm.report(path).html).texts[""]


def test_files_of_older_versions_have_one(tmp_path, words):
    run(tmp_path / "run.h5")
    with h5py.File(tmp_path / "run.h5", "r+") as file:
        for name in ("until", "threads", "wall_time", "checksums"):
            del file[f"parameters/{name}"]
        for name in ("python", "date", "machine"):
            del file["h5md/creator"].attrs[name]
    read = Read(swarm.report(tmp_path / "run.h5").html)
    assert "not kept" in read.texts["speed"]


def test_one_frame_and_no_particle_to_draw(tmp_path):
    run(tmp_path / "run.h5", frames="none")
    read = Read(swarm.report(tmp_path / "run.h5").html)
    assert "keeps none of them" in read.texts["scene"]
    assert "picture" not in read.tags


KINDS = {
    "bodies": lambda: (
        (room := swarm.Scene(surfaces=[swarm.Sphere(radius=0.5)])), swarm.place(room, swarm.dumbbell(0.1, 1.0), 2), {}
    ),
    "plane": lambda: (
        (flat := swarm.Scene(surfaces=[swarm.Sphere(radius=0.5)], plane="z")), swarm.fill(flat, 4, speed=1.0), {}
    ),
    "balls": lambda: (
        (gas := swarm.Scene(surfaces=[swarm.Sphere(radius=0.5)])), swarm.fill(gas, 4, speed=1.0, radius=0.05), {}
    ),
    "period": lambda: (
        (cell := swarm.Scene(surfaces=[swarm.Sphere(radius=0.2, side="outside")], period=(1.0, 1.0, 1.0))),
        swarm.fill(cell, 4, speed=1.0), {},
    ),
    "union": lambda: (
        (both := swarm.Scene(surfaces=[swarm.Union([swarm.Sphere(0.5), swarm.Box((0.8, 0.2, 0.2))])])),
        swarm.fill(both, 4, speed=1.0), {"counters": [swarm.Counter(swarm.Plane((1.0, 0.0, 0.0)))]},
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_run_has_one(kind, tmp_path, coarse):
    scene, start, options = KINDS[kind]()
    path = tmp_path / "run.h5"
    method = swarm.Impact(dt=0.01) if kind == "bodies" else swarm.Impact()
    swarm.simulate(scene, start, method, until=0.5, every=0.25, trajectory=path, compile="never", **options)
    read = Read(swarm.report(path).html)
    assert set(SECTIONS) <= set(read.ids)
    assert "swarm.simulate" in read.texts["reproduce"]


def test_bad_input_is_a_sentence(folder, tmp_path):
    for path, message in (
        (tmp_path / "absent.h5", "there is no file"),
        (folder / "scene.toml", "is not an HDF5 file"),
        (tmp_path, "is not the folder of a sweep: expected results.csv"),
    ):
        with pytest.raises(swarm.SceneError, match=message):
            swarm.report(path)
    log = tmp_path / "log.h5"
    run(tmp_path / "run.h5", impacts=log)
    with pytest.raises(swarm.SceneError, match="is a log of impacts, of which there is no report"):
        swarm.report(log)
    whole = (tmp_path / "run.h5").read_bytes()
    (tmp_path / "bad.h5").write_bytes(whole[:100] + bytes(900) + whole[1000:])
    with pytest.raises(swarm.SceneError, match=r"bad\.h5 is damaged"):
        swarm.report(tmp_path / "bad.h5")


def test_very_many_frames_are_pixels(monkeypatch, folder, coarse):
    monkeypatch.setattr(pictures, "_LARGEST", 1000)
    monkeypatch.setattr(pictures, "of_places", lambda content: [])
    read = Read(swarm.report(folder / "<b>run.h5").html)
    assert "svg" not in read.tags


def test_a_picture_says_how_many_of_the_particles_it_draws(folder, page, monkeypatch, coarse):
    assert "are drawn" not in page.html
    monkeypatch.setattr(pictures, "_SHOWN", 7)
    monkeypatch.setattr(pictures, "of_series", lambda content: [])
    page = swarm.report(folder / "<b>run.h5").html
    assert page.count(": 7 of 20 particles are drawn") == 2


def test_the_impacts_a_second_are_named_by_what_they_count(page, folder):
    """A page knows the wall time alone, compilation included; a run says how many there were in the rest of it."""
    assert "impacts a second of it" in page.html
    result = run(folder / "named.h5")
    for compiling, end in ((0.0, " impacts/s"), (0.5 * result.wall_time, " impacts/s in the rest")):
        row = summary.of_result(replace(result, compile_time=compiling), None)["wall time"]
        assert row.endswith(end)


def test_a_cavity_is_dark_on_a_dark_page():
    """Its far side is of the colours of the background, not a white patch."""
    scene = swarm.Scene([swarm.Sphere(0.5)])
    for dark in (False, True):
        with style.applied(dark):
            figure = style.picture(2.0, 2.0)
            axes = figure.add_subplot()
            drawing.frame(axes, np.empty((0, 3)), np.empty(0, np.uint32), shapes_of(scene, np.zeros((3, 1))))
            canvas = FigureCanvasAgg(figure)
            canvas.draw()
        middle = np.asarray(canvas.buffer_rgba())[100, 100, :3]
        assert (middle < 90).all() if dark else (middle > 200).all()
