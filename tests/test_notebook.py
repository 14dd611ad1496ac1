"""A notebook shows figures and tables once, and its backend is its own."""

import nbformat
import pytest
from nbclient import NotebookClient

CELLS = (
    "import swarm\n"
    "scene = swarm.Scene([swarm.Sphere(0.5)])\n"
    "start = swarm.Particles([0.0, 0.0, 0.0], [1.0, 0.0, 0.0])\n"
    "result = swarm.simulate(scene, start, swarm.Impact(), until=1.0, trajectory='run.h5')\n"
    "result.plot(figsize=(6, 4))",
    "trajectory = swarm.load('run.h5')\ntrajectory",
    "figure = trajectory.plot(figsize=(6, 4))",
    "%matplotlib inline\nfigure",
    "import matplotlib\nfrom matplotlib import pyplot\nprint(matplotlib.get_backend(), pyplot.get_fignums())",
)


@pytest.mark.filterwarnings("default")  # of the libraries of Jupyter
def test_figures_show_once(tmp_path):
    cells = [nbformat.v4.new_code_cell(source) for source in CELLS]
    book = nbformat.v4.new_notebook(cells=cells)
    NotebookClient(book, timeout=120, resources={"metadata": {"path": str(tmp_path)}}).execute()
    shown = [[sorted(output.get("data", {})) for output in cell.outputs] for cell in book.cells]
    assert shown[:4] == [
        [["image/png", "text/plain"]],
        [["text/html", "text/plain"]],
        [],
        [["image/png", "text/plain"]],
    ]
    assert book.cells[4].outputs[0].text.split() == ["inline", "[]"]
