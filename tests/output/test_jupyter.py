"""JupyterLab in a browser: films play, and Rerun's widget draws the scene.

    pip install -e ".[test,browser]" && python -m pytest -m long tests/output/test_jupyter.py

It needs Chromium on the path, no graphics card and no network.
"""

import contextlib
import io
import json
import os
import shutil
import socket
import subprocess
import sys
import time

import nbformat
import numpy as np
import pytest
from PIL import Image

CELLS = (
    "import swarm\n"
    "scene = swarm.Scene([swarm.Ellipsoid((0.3, 0.3, 0.6)), swarm.Sphere(0.15, side='outside')])\n"
    "start = swarm.fill(scene, 300, speed=1.0, seed=1)\n"
    "result = swarm.simulate(scene, start, swarm.Impact(), until=2.0, every=0.1, trajectory='run.h5')\n"
    "result",
    "result.film(fps=10)",
    "trajectory = swarm.load('run.h5')\ntrajectory.show()",
    "result.plot()",
)
FRAMES = 21
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
# WebGL without a graphics card.
SOFTWARE = ["--no-sandbox", "--enable-unsafe-swiftshader", "--use-angle=swiftshader"]
# Patience [s]: the viewer is 67 MB, drawn by software.
PATIENCE = 180.0

FILM = "(() => { const v = document.querySelector('video'); return v && [v.readyState, v.duration, v.videoWidth]; })()"
RAN = "[...document.querySelectorAll('.jp-CodeCell .jp-InputPrompt')].filter(e => /[0-9]/.test(e.textContent)).length"


@contextlib.contextmanager
def jupyter(folder):
    """The address of a JupyterLab that serves a folder, with all of its own files in it."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    own = {f"JUPYTER_{name}_DIR": str(folder / "own" / name) for name in ("CONFIG", "DATA", "RUNTIME")}
    own |= {f"JUPYTERLAB_{name}_DIR": str(folder / "own" / name) for name in ("SETTINGS", "WORKSPACES")}
    options = ["--no-browser", "--allow-root", "--ip=127.0.0.1", f"--port={port}", "--IdentityProvider.token="]
    with open(folder / "jupyter.log", "w") as log:
        server = subprocess.Popen(
            [sys.executable, "-m", "jupyterlab", *options, f"--ServerApp.root_dir={folder}"],
            stdout=log, stderr=log, env=os.environ | own | {"RERUN_NOTEBOOK_ASSET": "serve-local"},
        )  # fmt: skip
        try:
            until(lambda: _listens(port))
            yield f"http://127.0.0.1:{port}/lab/tree/run.ipynb?reset"
        finally:
            server.terminate()
            server.wait(60.0)


def _listens(port):
    with socket.socket() as connection:
        return connection.connect_ex(("127.0.0.1", port)) == 0


def until(ready):
    """Wait, and return what is asked for when it is true."""
    deadline = time.monotonic() + PATIENCE
    while not (found := ready()):
        assert time.monotonic() < deadline
        time.sleep(0.5)
    return found


def colours(png):
    """How many colours a picture has, in steps of 16."""
    pixels = np.asarray(Image.open(io.BytesIO(png)).convert("RGB")) // 16
    return len(np.unique(pixels.reshape(-1, 3), axis=0))


@pytest.mark.long
@pytest.mark.filterwarnings("default")
@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on the path")
@pytest.mark.parametrize("theme", ["Light", "Dark"])
def test_a_notebook_in_a_browser(theme, tmp_path):
    """Pictures of the page are written to the folder that SWARM_PICTURES names, to be looked at."""
    for name in ("jupyterlab", "rerun_notebook"):
        if subprocess.run([sys.executable, "-c", f"import {name}"], capture_output=True).returncode:
            pytest.skip(f"{name} is not installed (pip install '.[browser]')")
    sync_api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    book = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(source) for source in CELLS])
    book.metadata["kernelspec"] = {"name": "python3", "display_name": "Python 3", "language": "python"}
    nbformat.write(book, tmp_path / "run.ipynb")
    settings = tmp_path / "own" / "SETTINGS" / "@jupyterlab"
    for part, chosen in (
        ("apputils-extension/themes", {"theme": f"JupyterLab {theme}"}),
        ("apputils-extension/notification", {"fetchNews": "false"}),
    ):
        path = settings / f"{part}.jupyterlab-settings"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(chosen))
    with jupyter(tmp_path) as address, sync_api.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=CHROMIUM, args=SOFTWARE)
        page = browser.new_page(viewport={"width": 1200, "height": 2400})
        page.goto(address)
        page.wait_for_selector(".jp-Notebook .jp-CodeCell", timeout=1e3 * PATIENCE)
        page.click(".lm-MenuBar-itemLabel:text-is('Run')")
        page.click("text=Run All Cells")
        until(lambda: page.evaluate(RAN) == len(CELLS))
        state, seconds, width = until(lambda: (film := page.evaluate(FILM)) and film[0] == 4 and film)
        assert (state, width) == (4, 640)
        assert seconds == pytest.approx(FRAMES / 10)
        until(lambda: page.query_selector(".rerun_notebook canvas"))
        canvas = page.locator(".rerun_notebook canvas")
        until(lambda: colours(canvas.screenshot()) > 60)  # the welcome page has few
        box, cell = canvas.bounding_box(), page.locator(".jp-OutputArea-output").first.bounding_box()
        assert box["height"] == 600
        assert box["width"] <= cell["width"] + 1
        if "SWARM_PICTURES" in os.environ:
            page.screenshot(path=f"{os.environ['SWARM_PICTURES']}/notebook_{theme.lower()}.png")
        page.keyboard.press("Control+s")
        until(lambda: (saved := nbformat.read(tmp_path / "run.ipynb", 4).cells[1].outputs) and saved)
        page.goto(address)  # with the kernel, and as it is stored
        until(lambda: (film := page.evaluate(FILM)) and film[0] == 4)
        browser.close()
