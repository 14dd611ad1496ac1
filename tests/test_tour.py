"""The notebook of the examples: it runs from top to bottom, and the file has what it shows."""

from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

TOUR = Path(__file__).parents[1] / "examples" / "tour.ipynb"


def shown(book):
    """What the code cells of a notebook show: the text that they print, and the kinds of what they display."""
    return [
        [(output.get("text", ""), sorted(output.get("data", {}))) for output in cell.outputs]
        for cell in book.cells
        if cell.cell_type == "code"
    ]


@pytest.mark.physics
@pytest.mark.filterwarnings("default")  # of the libraries of Jupyter
def test_the_tour_shows_what_the_file_has(tmp_path):
    stored, book = nbformat.read(TOUR, 4), nbformat.read(TOUR, 4)
    for cell in book.cells:
        # A frame of a film takes as long as a picture.
        cell.source = cell.source.replace("film(frames=60,", "film(frames=2,")
    NotebookClient(book, timeout=600, resources={"metadata": {"path": str(tmp_path)}}).execute()
    assert shown(book) == shown(stored)
    assert sum("image/png" in kinds for cell in shown(book) for _text, kinds in cell) == 5
    films = [output for cell in book.cells for output in cell.get("outputs", []) if "<video" in str(output)]
    assert len(films) == 2
