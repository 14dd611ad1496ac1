"""Scene files to begin with: they run, their comments are true, and none replaces a file."""

import re
import tomllib

import jsonschema
import pytest
from test_cli import command

import swarm
from swarm import scene_file
from swarm.authoring.schema import schema_of
from swarm.authoring.starters import KINDS, begin, text_of
from swarm.commands.scenes import new

# Short enough for plain Python [s].
UNTIL = {"cavity": 0.5, "hopper": 0.03, "billiard": 0.05, "gas": 0.05, "mechanism": 0.04}


@pytest.mark.parametrize("kind", KINDS)
def test_it_runs(kind, tmp_path):
    path = begin(kind, tmp_path / "mine.toml")
    result = swarm.run(path, until=UNTIL[kind], every=None, compile="never")
    assert result.observables["energy_error"].max() < 1e-13
    assert result.observables["max_penetration"].max() < 1e-14
    assert [file.name for file in tmp_path.iterdir()] == ["mine.toml"]


@pytest.mark.parametrize("kind", KINDS)
def test_what_its_comments_offer_is_valid(kind):
    """Every line of a table or a key behind a comment sign, as it is without that."""
    text = re.sub(r"(?m)^# (?=\[|\w+ = )", "", text_of(kind))
    assert (text != text_of(kind)) == (kind != "mechanism")
    assert [
        error.message for error in jsonschema.Draft202012Validator(schema_of()).iter_errors(tomllib.loads(text))
    ] == []


def test_the_command(tmp_path):
    done = command("new", "gas", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (0, "written to gas.toml; next:  swarm run gas.toml\n")
    assert scene_file.read(tmp_path / "gas.toml").scene.period == (1.0, 1.0, 1.0)
    again = command("new", "gas", cwd=tmp_path)
    assert (again.returncode, "scene file: gas.toml exists" in again.stderr) == (2, True)
    other = command("new", "gaz", cwd=tmp_path)
    assert (other.returncode, "got 'gaz'; did you mean 'gas'?" in other.stderr) == (2, True)
    kinds = new.__annotations__["kind"].__metadata__[0].help
    assert set(re.findall(r"\w+", kinds)) - {"or"} == set(KINDS)
