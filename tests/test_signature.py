"""What `help` shows first: signatures of public functions in the lines of a terminal."""

import inspect
import pydoc
import re

import pytest

import swarm
from swarm.commands.run import run
from swarm.common.signature import in_columns
from swarm.run.options import RunOptions

LINED = ["contact_history", "elastic", "fill", "pack", "place", "rigid", "simulate", "sweep"]
SHOWN = [name for name in swarm.__all__ if callable(getattr(swarm, name))]


@pytest.mark.parametrize("name", LINED)
def test_help_begins_with_lines_as_wide_as_a_terminal(name):
    function = getattr(swarm, name)
    lines = pydoc.plain(pydoc.render_doc(function)).splitlines()
    assert max(map(len, lines[: len(inspect.signature(function).parameters) + 5])) <= 80


@pytest.mark.parametrize("name", LINED)
def test_the_signature_holds_every_name_and_default(name):
    function = getattr(swarm, name)
    shown, plain = inspect.signature(function), inspect.Signature.from_callable(inspect.unwrap(function))
    code = inspect.unwrap(function).__code__
    names = code.co_varnames[: code.co_argcount + code.co_kwonlyargcount]
    assert tuple(shown.parameters) == names
    assert shown.parameters == plain.parameters
    defaults = dict(
        zip(names[code.co_argcount - len(function.__defaults__ or ()) :], function.__defaults__ or (), strict=False)
    )
    for key, value in (defaults | (function.__kwdefaults__ or {})).items():
        assert shown.parameters[key].default is value
    assert shown.return_annotation == function.__annotations__["return"]
    for key in names:
        assert key in str(shown)


def test_help_of_a_function_is_as_wide_as_a_terminal():
    """The longest one, all of it."""
    for function in (swarm.simulate, swarm.fill, swarm.pack, swarm.sweep):
        lines = pydoc.plain(pydoc.render_doc(function)).splitlines()
        assert [line for line in lines if len(line) > 80] == []


def test_help_of_a_class_is_in_lines_of_a_terminal():
    """Its own text and those of its methods; examples and headings of Python are as they are."""
    lines = pydoc.plain(pydoc.render_doc(swarm.Impact)).splitlines()[1:]
    assert [line for line in lines if len(line) > 80] == []
    method = pydoc.plain(pydoc.render_doc(swarm.Trajectory)).partition("Data descriptors")[0].splitlines()
    assert [line for line in method if len(line) > 80 and not re.match(r" \|\s+(>>>|\.\.\.)", line)] == []


def test_help_of_the_package_begins_with_all_public_names_by_topic():
    text = pydoc.plain(pydoc.render_doc(swarm))
    assert max(map(len, text.partition("PACKAGE CONTENTS")[0].splitlines())) <= 80
    topics = swarm.__doc__.split("\n\n")[2]
    names = re.findall(r"\w+", re.sub(r"(?m)^    \w[\w ]{13}", "", topics))
    assert sorted(names) == sorted(set(swarm.__all__) - {"__version__"})
    assert len(text.partition(topics.splitlines()[0].strip())[0].splitlines()) < 10


ENTRY = (4, "one: two"), (8, "three"), (8, "four"), (8, "five.")


@pytest.mark.parametrize(
    ("text", "lines"),
    [
        ("One two three four five.", ["One two three", "four five."]),
        (
            "Args:\n    one: two three four five.",
            ["Args:", "    one: two", "        three", "        four", "        five."],
        ),
        (
            "Args:\n    one: or\n        more: two three.",
            ["Args:", "    one: or", "        more:", "        two", "        three."],
        ),
        ("As it is:\n\n    code(which, is, longer)", ["As it is:", "", "    code(which, is, longer)"]),
        (">>> print('an example')\nan example of more", [">>> print('an example')", "an example of more"]),
        ("| a | table | of numbers |", ["| a | table | of numbers |"]),
        ("Conserves: the energy.\nOrder: 2.", ["Conserves: the", "energy.", "Order: 2."]),
    ],
)
def test_docstrings_in_columns(text, lines):
    assert in_columns(text, 16).splitlines() == lines


def test_arguments_are_bound_as_before():
    bound = inspect.signature(swarm.fill).bind("scene", 3, speed=1.0)
    assert bound.arguments == {"scene": "scene", "n": 3, "speed": 1.0}


@pytest.mark.parametrize("name", SHOWN)
def test_help_has_no_long_line_of_a_signature(name):
    """Nor of a method; and no module of NumPy in the name of an array."""
    text = pydoc.plain(pydoc.render_doc(getattr(swarm, name)))
    assert max(map(len, text.splitlines())) <= 120
    assert "_array_like" not in text.partition("Data descriptors")[0]


def test_classes_are_made_as_before():
    shown = inspect.signature(swarm.Box)
    assert list(shown.parameters)[:3] == ["half_widths", "center", "side"]
    assert shown.bind((1, 1, 1), restitution=0.5).arguments == {"half_widths": (1, 1, 1), "restitution": 0.5}
    assert swarm.Box((1.0, 1.0, 1.0), side="outside").side == "outside"


def test_simulate_takes_the_options_of_a_run():
    """The same names in the same order with the same defaults, each described."""
    shown = list(inspect.signature(swarm.simulate).parameters.values())[3:]
    options = inspect.signature(RunOptions).parameters
    assert [(one.name, one.default) for one in shown] == [(one.name, one.default) for one in options.values()]
    assert all(one.kind is one.KEYWORD_ONLY for one in shown)
    assert all(f"    {one.name}: " in swarm.simulate.__doc__ for one in shown)


def test_the_command_line_takes_options_of_a_run():
    """All but its own, with the defaults of Python, or None where a scene file may say something else."""
    own = {"scene_file", "output", "quiet", "plugins", "as_json"}
    options = inspect.signature(RunOptions).parameters
    for one in inspect.signature(run).parameters.values():
        if one.name not in own:
            assert one.default in (None, options[one.name].default)
