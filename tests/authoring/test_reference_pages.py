"""The reference: every public name, observable, key of scene files and option of commands is on one page."""

import html
import inspect
import re
from collections import Counter

import pytest
from conftest import row
from test_cli import command

import swarm
from swarm.authoring.docstrings import entries_of, meanings_of, sections_of
from swarm.authoring.keys import tables
from swarm.authoring.reference import topics, write
from swarm.commands.cli import app
from swarm.common.catalog import OBSERVABLES

# Arguments that a file or another call gives.
MADE = {"mesh_weld", "args", "kwargs", "common"}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    target = tmp_path_factory.mktemp("docs") / "pages"
    write(target, app.commands)
    return target


@pytest.fixture(scope="module")
def pages(folder):
    return {path.name: path.read_text("utf-8") for path in folder.glob("*.html")}


@pytest.fixture(scope="module")
def places(pages):
    """How often each anchor is on any page."""
    return Counter(anchor for text in pages.values() for anchor in re.findall(r" id='([^']+)'", text))


def once(places, anchors):
    return {anchor: places[anchor] for anchor in anchors if places[anchor] != 1}


def test_every_public_name_is_on_one_page(places):
    names = set(swarm.__all__) - {"__version__"}
    assert {name for some in topics().values() for name in some} == names
    assert once(places, [f"swarm.{name}" for name in names]) == {}


def test_every_argument_of_a_public_name_is_described(pages, places):
    """On its page, or with those of all surfaces; but for what `load` opens and what a class makes by itself."""
    opened = {"Trajectory", "ImpactLog", "Frame", "run"}
    for name in sorted(set(swarm.__all__) - {"__version__"} - opened):
        value = getattr(swarm, name)
        if isinstance(value, type) and issubclass(value, Exception):
            continue
        known = meanings_of(value) | entries_of(sections_of(value).get("Attributes", ""))
        with row(name):
            taken = [one for one in inspect.signature(value).parameters if one not in MADE and not one.startswith("_")]
            assert [one for one in taken if one not in known] == []
    assert places["argument.swarm.simulate.until"] == places["argument.swarm.Box.half_widths"] == 1
    assert "described once for all surfaces" in pages["surfaces.html"]


def test_every_observable_is_on_one_page(places):
    assert once(places, [f"observable.{name}" for name in OBSERVABLES]) == {}


def test_every_key_of_a_scene_file_is_on_one_page(places):
    anchors = [
        ".".join(filter(None, ("key", table.place, table.kind, key.name))) for table in tables() for key in table.keys
    ]
    assert len(anchors) > 200
    assert once(places, anchors) == {}


def test_every_option_of_every_command_is_on_one_page(places):
    known = app.commands
    assert len(known) > 10
    assert once(places, [f"command.{name}" for name in known]) == {}
    for name, one in known.items():
        with row(name):
            words = [word for param in one.params for word in param.opts if word.startswith("--")]
            assert once(places, [f"option.{name}.{option}" for option in words if option != "--help"]) == {}


def test_links_lead_somewhere_and_nothing_needs_a_network(pages, places):
    for name, text in pages.items():
        with row(name):
            for file, _, anchor in (link.partition("#") for link in re.findall(r"href=['\"]([^'\"]+)['\"]", text)):
                assert file in pages
                assert not anchor or places[anchor] == 1
            assert not re.search(r"(src|href|url)\W{1,3}https?:", text)


def test_a_page_has_the_signature_the_arguments_the_errors_and_the_example(pages):
    text = html.unescape(re.sub(r"<[^>]+>", " ", pages["runs.html"]))
    for words in (
        "until: float,",
        "impact_particles: str | int | Sequence[int] = 'all'",
        "end of the run [s], above 0.",
    ):
        assert words in text
    for words in ("Arguments", "Returns", "Errors", "Example", '>>> result.observables["time"]', "WallTimeError"):
        assert words in text
    scenes = html.unescape(re.sub(r"<[^>]+>", " ", pages["scene-files.html"]))
    assert re.search(r"radius\s+a number above 0\s+needed", scenes)


def test_the_search_knows_them_all(folder, places):
    text = (folder / "search.js").read_text("utf-8")
    for anchor in places:
        assert f'#{anchor}"' in text


def test_the_command_replaces_its_own_pages_alone(tmp_path):
    assert command("docs", "-o", "pages", cwd=tmp_path).stdout == "written to pages/index.html\n"
    assert command("docs", "-o", "pages", cwd=tmp_path).returncode == 2
    assert command("docs", "-o", "pages", "--overwrite", cwd=tmp_path).returncode == 0
    (tmp_path / "pages" / "index.html").write_text("mine")
    refused = command("docs", "-o", "pages", "--overwrite", cwd=tmp_path)
    assert (refused.returncode, "is not a page of swarm" in refused.stderr) == (2, True)


def test_the_list_of_commands_is_in_whole_sentences(tmp_path):
    lines = command("--help", cwd=tmp_path).stdout.partition("Commands:")[2].splitlines()
    assert [line for line in lines if line.endswith("...") or len(line) > 80] == []
