"""Films in notebooks: their HTML, their files, and that they play in a browser."""

import base64
import re
import shutil
import subprocess
import sys
from io import BytesIO

import pytest
from PIL import Image

import swarm
from swarm.errors import FileError, SceneError
from swarm.pictures import film, shown_film

FRAMES = 5


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    cavity = swarm.Scene([swarm.Sphere(0.5)])
    start = swarm.fill(cavity, 10, speed=1.0, seed=1)
    path = tmp_path_factory.mktemp("film") / "run.h5"
    return swarm.simulate(
        cavity, start, swarm.Impact(), until=1.0, every=1.0 / (FRAMES - 1), trajectory=path, compile="never"
    )


def content(html, kind):
    return base64.b64decode(re.search(rf'src="data:{kind};base64,([^"]+)"', html)[1])


def test_a_film_is_a_video_in_the_page(result, tmp_path):
    with swarm.load(result.trajectory) as trajectory:
        made = trajectory.film(size=(161, 120), fps=10)
    html = made._repr_html_()
    video = content(html, "video/mp4")
    assert video[4:8] == b"ftyp"
    assert b"avc1" in video  # H.264, which browsers play
    assert re.match(r'<video controls loop muted autoplay playsinline width="160" height="120" ', html)
    assert repr(made).startswith("Film(run.h5: 5 frames, 0.5 s, 160 x 120 pixels, ")
    assert made.save(tmp_path / "run.mp4") == tmp_path / "run.mp4"
    assert (tmp_path / "run.mp4").read_bytes() == video == made.content
    with pytest.raises(SceneError, match=r"run\.mp4 exists"):
        made.save(tmp_path / "run.mp4")
    assert made.save(str(tmp_path / "run.mp4"), overwrite=True)
    with pytest.raises(SceneError, match=r"this film is an \.mp4, expected a file name that ends so, got run\.gif"):
        made.save("run.gif")
    with pytest.raises(SceneError, match="does not exist"):
        made.save(tmp_path / "none" / "run.mp4")
    (tmp_path / ".film.mp4.swarm-part.mp4").mkdir()
    with pytest.raises((FileError, OSError), match="film"):
        made.save(tmp_path / "film.mp4")


def test_without_ffmpeg_a_film_is_a_gif(result, monkeypatch):
    monkeypatch.setattr(film.shutil, "which", lambda _name: None)
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    html = result.film(size=(160, 120), frames=2)._repr_html_()
    assert html.startswith('<img alt="film" width="160" ')
    with Image.open(BytesIO(content(html, "image/gif"))) as image:
        assert (image.n_frames, image.size) == (2, (160, 120))


def test_a_large_film_is_not_put_into_the_page(result, monkeypatch):
    made = result.film(size=(160, 120), frames=2)
    monkeypatch.setattr(shown_film, "_MOST", len(made.content))
    html = made._repr_html_()
    assert len(html) < 400
    assert re.search("more than .* MB in a notebook make it hang: take fewer frames= or a smaller size=", html)


def test_what_a_film_needs(result):
    with pytest.raises(SceneError, match="frames must be"):
        result.film(frames=0)
    with pytest.raises(SceneError, match="size must be width and height"):
        result.film(size=100)
    cavity = swarm.Scene([swarm.Sphere(0.5)])
    run = swarm.simulate(cavity, swarm.fill(cavity, 2, speed=1.0), swarm.Impact(), until=1.0, compile="never")
    with pytest.raises(SceneError, match="a film are those of the trajectory, and this run has written none"):
        run.film()


CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on the path")
def test_a_film_plays_in_a_browser(result, tmp_path):
    """The browser has decoded a frame ahead (readyState 4), and knows how long it is and its size."""
    page = tmp_path / "film.html"
    html = result.film(size=(160, 120), fps=10)._repr_html_()
    script = """<p id="state"></p><script>
    const film = document.querySelector("video"), state = document.querySelector("#state");
    film.addEventListener("canplaythrough", () => { state.textContent =
        `ready ${film.readyState}, ${film.duration} s, ${film.videoWidth} x ${film.videoHeight}`; });
    film.addEventListener("error", () => { state.textContent = `error ${film.error.message}`; });
    </script>"""
    page.write_text(f"<!doctype html><body>{html}{script}</body>")
    command = [CHROMIUM, "--headless=new", "--no-sandbox", "--disable-gpu", f"--user-data-dir={tmp_path / 'profile'}",
               "--virtual-time-budget=10000", "--dump-dom", page.as_uri()]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    state = re.search('<p id="state">(.*?)</p>', done.stdout)
    assert state is not None, done.stderr[-1000:]
    assert state[1] == "ready 4, 0.5 s, 160 x 120"
