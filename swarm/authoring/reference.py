"""Pages of every public name, observable, key of scene files and option of commands, from their declarations.

The pages are plain HTML with one script, which searches in `search.js`: they work without a network and a server.
(Rejected: pdoc and mkdocstrings. Their search has the names of Python alone, not keys, options and observables.)
"""

import html
import inspect
import itertools
import json
import re
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

from ..common.catalog import OBSERVABLES
from ..common.signature import show_in_lines
from ..errors import FileError, SceneError
from ..files import marks
from ..files.paths import target_of
from ..version import VERSION
from . import file_run
from .docstrings import entries_of, first_line, meanings_of, sections_of
from .keys import Form, Table, tables

_HERE, _PACKAGE = Path(__file__).parent, sys.modules[__package__.partition(".")[0]]
# A topic and its names, also on the next lines, in the docstring of the package.
_TOPIC = re.compile(r"(?m)^ {4}(\S[\w ]*?) {2,}(.*(?:\n {10,}.*)*)")
_SECTIONS = ("Returns", "Raises", "Conserves", "Order", "Cost", "Source", "Reference")
_WITH_ENTRIES = ("Args", "Attributes", "Raises")


class Entry(NamedTuple):
    """An entry of a page, and of the search.

    Attributes:
        anchor: its name, unique on all pages.
        title: its title.
        about: its description in one line.
        body: its HTML.
    """

    anchor: str
    title: str
    about: str
    body: str


class Section(NamedTuple):
    """A page: the name of its file, its title, its entries."""

    file: str
    title: str
    entries: tuple[Entry, ...]


def topics() -> dict[str, list[str]]:
    """The public names by topic, from the docstring of the package.

    >>> topics()["Particles"]
    ['Particles', 'fill', 'pack']
    """
    text = inspect.getdoc(_PACKAGE) or ""
    return {title: re.findall(r"\w+", names) for title, names in _TOPIC.findall(text)}


def write(folder: Path, commands: Mapping[str, Any], overwrite: bool = False) -> Path:
    """Write the pages into a folder, which may be created; return the first page; `commands` are those of click.

    Raises:
        SceneError: the folder is a file, or has a page that may not be replaced.
        FileError: a page cannot be written.
    """
    target = target_of("folder", folder)
    if target.exists() and not target.is_dir():
        raise SceneError(f"folder: expected the name of a folder, got the file {target}")
    made = sections(commands)
    pages = {"index.html": _index(made)} | {f"{one.file}.html": _page(one, made) for one in made}
    search = f"// swarm {VERSION}\nconst ENTRIES = {json.dumps(_found(made), ensure_ascii=False)};\n"
    script = f"// swarm {VERSION}\n{(_HERE / 'reference.js').read_text('utf-8')}"
    try:
        target.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(f"cannot make the folder {target}: {error.strerror}") from error
    for name, text in {**pages, "search.js": search, "reference.js": script}.items():
        marks.write(target / name, text.encode(), "page of the reference", overwrite)
    return target / "index.html"


def sections(commands: Mapping[str, Any]) -> tuple[Section, ...]:
    """All pages: the topics of public names, the observables, the keys of scene files, the commands."""
    named = tuple(
        Section(_file(title), title, tuple(_of_name(name) for name in names)) for title, names in topics().items()
    )
    return (
        *named,
        Section("observables", "Observables", (_of_observables(), *map(_of_observable, OBSERVABLES))),
        Section("scene-files", "Keys of scene files", tuple(map(_of_table, tables()))),
        Section("commands", "Commands", tuple(itertools.starmap(_of_command, commands.items()))),
    )


def _file(title: str) -> str:
    return title.lower().replace(" ", "-")


# --- Public names ----------------------------------------------------------------------------------------


def _of_name(name: str) -> Entry:
    value = getattr(_PACKAGE, name)
    if isinstance(value, ModuleType):
        value = getattr(file_run, name)
        show_in_lines(value)
    body = f"{_signature(name, value)}{_described(value, name)}"
    if isinstance(value, type):
        body += _of_bases(value)
        body += "".join(_of_member(name, member, one) for member, one in _members(value))
    return Entry(f"swarm.{name}", f"swarm.{name}", first_line(value), body)


def _of_bases(cls: type[Any]) -> str:
    """The names of the common arguments of a class, and a link to their description."""
    own = entries_of(sections_of(cls).get("Args", ""))
    taken = [name for name in inspect.signature(cls).parameters if name not in own] if own else []
    common = [name for name in meanings_of(cls) if name in taken]
    names = ", ".join(f"<code>{name}</code>" for name in common)
    link = "<a href='scene-files.html#table.surface'>described once for all surfaces</a>"
    return f"<p>And {names}, {link}.</p>" if common else ""


def _signature(name: str, value: Any) -> str:
    try:
        return f"<pre class='signature'>{_text(name)}{_text(str(inspect.signature(value)))}</pre>"
    except (TypeError, ValueError):
        return ""


def _members(cls: type[Any]) -> Iterator[tuple[str, Any]]:
    """The public methods and properties of a class that have a docstring, with those of bases of the package."""
    seen: set[str] = set()
    for kind in cls.__mro__:
        if kind.__module__.partition(".")[0] != _PACKAGE.__name__:
            continue
        for name, one in vars(kind).items():
            function = getattr(one, "__func__", one)
            is_shown = callable(function) or isinstance(one, property) or hasattr(one, "attrname")
            if not name.startswith("_") and name not in seen and is_shown and not isinstance(one, type) and one.__doc__:
                seen.add(name)
                yield name, function


def _of_member(owner: str, name: str, value: Any) -> str:
    shown = _signature(name, value) if callable(value) else f"<pre class='signature'>{_text(name)}</pre>"
    return f"<section class='member' id='swarm.{owner}.{name}'>{shown}{_described(value)}</section>"


def _described(value: Any, owner: str = "") -> str:
    """The docstring of a value; with `owner`, a public name, its arguments get anchors for the search."""
    found = sections_of(value)
    body = _prose(found.get("", ""))
    for title in ("Args", "Attributes", *_SECTIONS):
        if title not in found:
            continue
        shown = {"Args": "Arguments", "Raises": "Errors"}.get(title, title)
        entries = entries_of(found[title]) if title in _WITH_ENTRIES else {}
        body += f"<h4>{shown}</h4>" + (
            _entries(entries, owner * (title == "Args")) if entries else _prose(inspect.cleandoc(found[title]))
        )
    return body + (f"<h4>Example</h4><pre>{_text(found['Example'])}</pre>" if "Example" in found else "")


def _entries(entries: dict[str, str], owner: str = "") -> str:
    rows = ""
    for name, about in entries.items():
        anchor = f" id='argument.swarm.{owner}.{name}'" if owner else ""
        rows += f"<dt{anchor}>{_text(name)}</dt><dd>{_line(about)}</dd>"
    return f"<dl>{rows}</dl>"


def _prose(text: str) -> str:
    """Paragraphs in HTML; indented blocks and tables stay as they are."""
    made = ""
    for block in re.split(r"\n\s*\n", text):
        if block.strip():
            stays = block.startswith((" ", "|", ">>>"))
            made += f"<pre>{_text(inspect.cleandoc(block))}</pre>" if stays else f"<p>{_line(block)}</p>"
    return made


def _text(text: str) -> str:
    return html.escape(text, quote=False)


def _line(text: str) -> str:
    """A text in HTML, with text between backquotes as code, and public names as links."""
    parts = _text(" ".join(text.split())).split("`")
    return "".join(part if k % 2 == 0 else _code(part) for k, part in enumerate(parts))


def _code(text: str) -> str:
    found = next((title for title, names in topics().items() if text in names), None)
    code = f"<code>{text}</code>"
    return code if found is None else f"<a href='{_file(found)}.html#swarm.{text}'>{code}</a>"


# --- Observables, keys, commands -------------------------------------------------------------------------


def _of_observables() -> Entry:
    about = "What every frame has, in result.observables and in trajectories: arrays with one entry a frame."
    return Entry("observables", "result.observables", about, f"<p>{_text(about)}</p>")


_JOINED = {"sum": "the sum of the shards", "largest": "the largest of the shards", "same": "the same in each shard"}


def _of_observable(name: str) -> Entry:
    one = OBSERVABLES[name]
    facts = {
        "unit": "a number" if one.unit == "1" else one.unit,
        "shape": f"({', '.join(one.axes_in_words())}{',' * (not one.axes)})",
        "of a run in shards": _JOINED[one.joined],
    }  # fmt: skip
    facts |= {"NaN": "where it has no value"} if one.may_be_nan else {}
    return Entry(f"observable.{name}", name, one.meaning, f"<p>{_line(one.meaning)}.</p>{_entries(facts)}")


def _of_table(table: Table) -> Entry:
    place = f"[{table.place}]" if table.place else "at the top"
    if table.place in ("surface", "source", "counter"):
        place = f"[{place}]"
    title = f'{place} kind = "{table.kind}"' if table.kind else place
    place_name = ".".join(filter(None, ("key", table.place, table.kind)))
    rows = ""
    for key in table.keys:
        default = "needed" if key.needed else "" if key.default in (None, ()) else json.dumps(key.default, default=str)
        cells = f"<code>{_text(key.name)}</code>", _text(form_in_words(key.form)), _text(default), _line(key.meaning)
        rows += f"<tr id='{place_name}.{key.name}'>{''.join(f'<td>{cell}</td>' for cell in cells)}</tr>"
    head = "<tr><th>key</th><th>value</th><th>default</th><th>meaning</th></tr>"
    anchor = place_name.replace("key", "table", 1)
    return Entry(anchor, title, table.meaning, f"<p>{_line(table.meaning)}</p><table>{head}{rows}</table>")


def form_in_words(form: Form) -> str:
    """The form of a key in words.

    >>> form_in_words({"type": "number", "exclusiveMinimum": 0}), form_in_words({"enum": ["x", "y"]})
    ('a number above 0', '"x" or "y"')
    >>> form_in_words({"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3})
    'three numbers'
    """
    if "anyOf" in form:
        return " or ".join(form_in_words(one) for one in form["anyOf"])
    if "enum" in form or "const" in form:
        return " or ".join(json.dumps(one) for one in form.get("enum", [form.get("const")]))
    if "$ref" in form:
        return _NAMED[form["$ref"].rpartition("/")[2]]
    kind = form.get("type")
    if kind == "array":
        return _list_in_words(form)
    if kind == "string":
        return '"module:Name"' if "pattern" in form else "a text"
    name = {"number": "a number", "integer": "a whole number", "boolean": "true or false"}.get(str(kind), "a table")
    least, most, above = (form.get(word) for word in ("minimum", "maximum", "exclusiveMinimum"))
    if above is not None:
        return f"{name} above {above:g}"
    if least is not None and most is not None and abs(most) < 1e99:
        return f"{name} from {least:g} to {most:g}"
    # A length is above the smallest number with a positive square.
    return (
        name if least is None or least < 0 else f"{name} above 0" if 0 < least < 1e-9 else f"{name}, {least:g} or more"
    )


def _list_in_words(form: Form) -> str:
    if "prefixItems" in form:
        return f"[{', '.join(form_in_words(one) for one in form['prefixItems'])}]"
    each, least, most = form_in_words(form["items"]), form.get("minItems", 0), form.get("maxItems")
    if " or " in each:
        several = f"entries, each {each}"
    elif form["items"].get("type") == "array":
        several = f"rows, each {each}"
    else:
        several = re.sub(r"^an? (whole number|[a-z]+)", r"\1s", each)
    if most is not None and most == least:
        return f"{_FEW[most]} {several}"
    return f"a list of {several}"


_NAMED = {
    "motion": "a motion", "law": "a law", "opening": "an opening", "surface": "a surface", "place": "a surface",
    "opening_of_surface": "an opening by its number", "group": "a table of laws",
}  # fmt: skip
_FEW = {2: "two", 3: "three", 4: "four"}


def _of_command(name: str, command: Any) -> Entry:
    rows = "".join(_of_option(name, one) for one in command.params if one.name != "help")
    head = "<tr><th>argument or option</th><th>default</th><th>meaning</th></tr>"
    about, (example, *_codes) = " ".join(command.help.split()), command.epilog.split("\n")
    body = f"<p>{_line(about)}</p><table>{head}{rows}</table><pre>{_text(example)}</pre>"
    return Entry(f"command.{name}", f"swarm {name}", about, body)


def _of_option(command: str, one: Any) -> str:
    """The row of an argument or option of click: its names, its default, and its help."""
    if one.param_type_name == "argument":
        names, default = [one.metavar], "needed"
    else:
        names, default = [*one.opts, *one.secondary_opts], "" if one.default in (None, False) else str(one.default)
    long = next((name for name in names if name.startswith("--")), names[0])
    cells = f"<code>{_text(', '.join(names))}</code>", _text(default), _line(one.help)
    return f"<tr id='option.{command}.{_text(long)}'>{''.join(f'<td>{cell}</td>' for cell in cells)}</tr>"


# --- Pages -----------------------------------------------------------------------------------------------


def _found(made: tuple[Section, ...]) -> list[list[str]]:
    """The entries of the search: title, address, and description of entries, and of rows of their tables."""
    rows = []
    for section in made:
        for one in section.entries:
            rows.append([one.title, f"{section.file}.html#{one.anchor}", one.about])
            inner = re.findall(r"<(?:tr|section|dt)[^>]* id='([^']+)'", one.body)
            rows += [[f"{name.rpartition('.')[2]} ({one.title})", f"{section.file}.html#{name}", ""] for name in inner]
    return rows


def _index(made: tuple[Section, ...]) -> str:
    lists = "".join(
        f"<h2><a href='{one.file}.html'>{_text(one.title)}</a></h2><ul>"
        + "".join(
            f"<li><a href='{one.file}.html#{entry.anchor}'>{_text(entry.title)}</a> {_line(entry.about)}</li>"
            for entry in one.entries
        )
        + "</ul>"
        for one in made
    )
    about = _line((inspect.getdoc(_PACKAGE) or "").partition("\n")[0])
    return _framed("swarm", f"<h1>swarm {_text(VERSION)}</h1><p>{about}</p>{lists}", made)


def _page(section: Section, made: tuple[Section, ...]) -> str:
    entries = "".join(
        f"<section class='entry' id='{one.anchor}'><h2>{_text(one.title)}</h2>{one.body}</section>"
        for one in section.entries
    )
    return _framed(f"{section.title} - swarm", f"<h1>{_text(section.title)}</h1>{entries}", made)


def _framed(title: str, body: str, made: tuple[Section, ...]) -> str:
    links = "".join(f"<a href='{one.file}.html'>{_text(one.title)}</a>" for one in made)
    return f"""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="generator" content="swarm {_text(VERSION)}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{_text(title)}</title>
<style>
{(_HERE / "reference.css").read_text("utf-8")}</style>
</head>
<body>
<nav><a class="home" href="index.html">swarm</a>
<input id="search" type="search" placeholder="Search" aria-label="Search" autocomplete="off">
<ul id="found"></ul>
{links}</nav>
<main>{body}</main>
<script src="search.js"></script>
<script src="reference.js"></script>
</body>
</html>
"""
