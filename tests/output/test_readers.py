"""What other programs read of runs of each kind, by those that are installed; the guide has the table."""

import contextlib
import re

import pytest
from output import readers

CELLS = [
    pytest.param(reader, kind, id=f"{reader.form}-{reader.name}-{kind}")
    for kind in readers.KINDS
    for reader in readers.READERS
]


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """The files of each kind of run, written once."""
    written = {}

    def of(kind):
        if kind not in written:
            written[kind] = tmp_path_factory.mktemp(kind.replace(" ", "_"))
            readers.written(kind, written[kind])
        return written[kind]

    return of


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(("reader", "kind"), CELLS)
def test_every_cell_is_the_trajectory_or_says_why_not(files, reader, kind):
    if not readers.is_installed(reader):
        pytest.skip(f"{reader.name} is not installed")
    cell = reader.cells.get(kind)
    refused = cell is not None and cell.raises
    with pytest.raises(cell.raises, match=cell.match) if refused else contextlib.nullcontext():
        readers.compare(reader, kind, files(kind))


def test_the_guide_has_the_table():
    text = readers.GUIDE.read_text("utf-8")
    (table,) = re.findall(f"{readers.BEGIN}\n\n(.*)\n\n{readers.END}", text, re.DOTALL)
    assert table == readers.markdown(), "python tests/output/readers.py --write"
