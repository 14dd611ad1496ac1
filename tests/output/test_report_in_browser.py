"""Reports in a headless browser: they load without an error, tables are sorted, light and dark."""

import re
import shutil
import subprocess

import numpy as np
import pytest

import swarm
from swarm.pages.html import filled

BROWSER = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
pytestmark = pytest.mark.skipif(BROWSER is None, reason="there is no Chromium here (Debian: apt install chromium)")
_SECONDS = 120


def browser(folder, *arguments):
    """What Chromium prints, and what it logs."""
    words = [
        BROWSER, "--headless=new", "--no-sandbox", "--disable-gpu", "--no-first-run", "--hide-scrollbars",
        f"--user-data-dir={folder}/profile", "--enable-logging=stderr", "--virtual-time-budget=3000",
        "--host-resolver-rules=MAP * ~NOTFOUND", *arguments,
    ]  # fmt: skip
    done = subprocess.run(words, capture_output=True, text=True, timeout=_SECONDS, check=True)
    assert "CONSOLE" not in done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("page")
    scene = swarm.Scene(surfaces=[swarm.Sphere(radius=0.5)])
    start = swarm.fill(scene, 20, speed=1.0)
    swarm.simulate(
        scene, start, swarm.Impact(), until=1.0, every=0.25, trajectory=folder / "run.h5", compile="never"
    ).report(folder / "run.html")
    return folder


@pytest.mark.parametrize(("scheme", "is_dark"), [(0, True), (1, False)], ids=["dark", "light"])
def test_a_page_is_light_or_dark_as_the_reader_asks(run, scheme, is_dark):
    from matplotlib.image import imread

    picture = run / f"{scheme}.png"
    browser(
        run, f"--blink-settings=preferredColorScheme={scheme}", f"--screenshot={picture}", "--window-size=1000,1600",
        (run / "run.html").as_uri(),
    )  # fmt: skip
    seen = imread(picture)[..., :3]
    assert (np.median(seen) < 0.5) == is_dark
    # Particles and graphs have colours, text has contrast.
    assert np.ptp(seen, axis=2).max() > 0.3
    assert np.ptp(seen) > 0.7


def test_the_first_screen_has_the_answer_the_numbers_and_the_particles(run):
    """Without scrolling at 1200 x 800: where each section ends [pixels]."""
    names = "verdicts", "happened", "places"
    ends = ", ".join(f"document.getElementById('{name}').getBoundingClientRect().bottom" for name in names)
    page = run / "first.html"
    script = f"<script>document.body.dataset.ends = JSON.stringify([{ends}, innerHeight]);</script></body>"
    page.write_text((run / "run.html").read_text().replace("</body>", script))
    document = browser(run, "--window-size=1200,800", "--dump-dom", page.as_uri())
    *ends, height = map(float, re.search(r'data-ends="\[([^\]]+)\]"', document)[1].split(","))
    assert max(ends) <= 800.0
    assert min(ends) > 100.0
    assert height > 600.0


def test_a_page_needs_no_network_and_logs_nothing(run):
    page = browser(run, "--dump-dom", (run / "run.html").as_uri())
    assert "How to reproduce it" in page
    assert page.count("<svg") >= 3


def sweep_with(energies):
    """The page of a sweep with a row for each of these energies; that of None is not known."""
    cells = [("", "") if value is None else (f"{value:.3g}", repr(value)) for value in energies]
    return filled(
        "sweep.html.j2", title="Sweep", about="", notes=[], failures=[], columns=["file", "energy"],
        rows=[[(f"{k}.h5", ""), cell] for k, cell in enumerate(cells)], table=None, left_out=0, graphs=[], worst=[],
        sweep_file="", command="", name="sweep",
    )  # fmt: skip


@pytest.mark.parametrize(
    ("asked", "order"),
    [("", [0, 1, 2, 3]), ("#sort=1", [3, 0, 2, 1]), ("#sort=-1", [2, 0, 3, 1]), ("#sort=-0", [3, 2, 1, 0])],
)
def test_the_table_of_a_sweep_is_sorted(tmp_path, asked, order):
    page = tmp_path / "sweep.html"
    page.write_text(sweep_with([2.0, None, 10.0, -1.0]))
    document = browser(tmp_path, "--dump-dom", page.as_uri() + asked)
    assert [int(k) for k in re.findall(r'data-value="(\d)\.h5"', document)] == order
    assert len(re.findall(r"<th [^>]*aria-sort", document)) == (asked != "")


def test_a_click_sorts_too(tmp_path):
    clicks = "<script>for (let k = 0; k < 2; k++) document.querySelectorAll('th button')[1].click();</script></body>"
    page = tmp_path / "sweep.html"
    page.write_text(sweep_with([2.0, 1.0]).replace("</body>", clicks))
    document = browser(tmp_path, "--dump-dom", page.as_uri())
    assert 'aria-sort="descending"' in document
    assert [int(k) for k in re.findall(r'data-value="(\d)\.h5"', document)] == [0, 1]
