"""The Rerun viewer: live during a run, or headless for pictures."""

import contextlib
import os
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from ..errors import RunError, SceneError

_PORT = 9876
_PATIENCE = 30.0  # [s]
_PAUSE = 0.1
# Time to draw a frame with a software driver [s].
_DRAWING = 1.0
_HERE = "127.0.0.1"


def live_url(live: bool | str) -> str:
    """The URL of the viewer that shows a run: the given one, that of a viewer on this machine, or of a new one.

    Raises:
        SceneError: no viewer listens, and there is no screen for a new one.
    """
    if isinstance(live, str):
        return live
    if not _listens(_PORT):
        if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
            raise SceneError(
                "live needs a screen, or a viewer that listens on this machine (over ssh: ssh -R "
                f"{_PORT}:localhost:{_PORT} from where a viewer runs); without one, record to a file and use swarm view"
            )
        _Viewer("--port", str(_PORT), "--expect-data-soon").wait_for(_PORT)
    return _url(_PORT)


def _url(port: int) -> str:
    return f"rerun+http://{_HERE}:{port}/proxy"


def _listens(port: int) -> bool:
    with socket.socket() as connection:
        connection.settimeout(1.0)
        return connection.connect_ex((_HERE, port)) == 0


class _Viewer:
    """The process of a viewer, which listens to this machine only; by default it would listen to the network."""

    def __init__(self, *arguments: str) -> None:
        # A file, not a pipe: a pipe would fill up unread, and the child of the viewer would keep it open.
        self._messages = tempfile.TemporaryFile()  # noqa: SIM115 (closed by end)
        self.process = subprocess.Popen(
            [sys.executable, "-m", "rerun", "--bind", _HERE, *arguments],
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=self._messages, start_new_session=True,
        )  # fmt: skip

    def wait_for(self, port: int) -> None:
        """Return when the viewer listens on the port."""
        self.wait_until(lambda: _listens(port), "start")

    def wait_until(self, ready: Callable[[], Any], did: str) -> None:
        """Return when `ready` is true."""
        deadline = time.monotonic() + _PATIENCE
        while not ready():
            self.require_alive()
            if time.monotonic() > deadline:
                raise RunError(f"the Rerun viewer did not {did} in {_PATIENCE:g} s")
            time.sleep(_PAUSE)

    def require_alive(self) -> None:
        """Raise a RunError with its last message if the viewer has ended."""
        if self.process.poll() is None:
            return
        self._messages.seek(0)
        lines = self._messages.read().decode(errors="replace").splitlines()
        reasons = [line for line in lines if "adapter" in line or "panicked" in line or "rror" in line]
        raise RunError(f"the Rerun viewer ended: {(reasons or lines or ['no message'])[-1].strip()}")

    def end(self) -> None:
        """Kill the process, and the viewer that it has started."""
        import psutil  # which rerun-sdk brings

        with contextlib.suppress(psutil.NoSuchProcess):
            for child in psutil.Process(self.process.pid).children(recursive=True):
                with contextlib.suppress(psutil.NoSuchProcess):
                    child.kill()
        self.process.kill()
        self.process.wait()
        self._messages.close()


def no_driver() -> str | None:
    """The reason why the viewer cannot draw here, or None: it needs a Vulkan driver, which may be a software driver."""
    if sys.platform != "linux":
        return None
    named = os.environ.get("VK_DRIVER_FILES") or os.environ.get("VK_ICD_FILENAMES")
    if named:
        files = [Path(name) for name in named.split(os.pathsep)]
    else:
        shared = os.environ.get("XDG_DATA_DIRS") or "/usr/local/share:/usr/share"
        folders = ["/etc", "/usr/local/etc", str(Path.home() / ".local/share"), *shared.split(os.pathsep)]
        files = [file for folder in folders for file in Path(folder, "vulkan", "icd.d").glob("*.json")]
    if any(file.is_file() for file in files):
        return None
    return "there is no Vulkan driver (Debian: apt install mesa-vulkan-drivers libvulkan1, which needs no GPU)"


@contextlib.contextmanager
def headless(recording: Path) -> Iterator[Any]:
    """A viewer without a window that has loaded a recording: a `rerun.experimental.ViewerClient`.

    Raises:
        RunError: it did not start, did not load the recording, or ended.
    """
    from rerun.experimental import ViewerClient

    with socket.socket() as free:
        free.bind((_HERE, 0))
        port = free.getsockname()[1]
    process = _Viewer("--headless", "--port", str(port))
    try:
        process.wait_for(port)
        client = ViewerClient.connect(_url(port))
        client.open(str(recording.resolve()))

        def is_loaded() -> bool:
            state = client.get_state()
            return bool(state.recordings and state.views and not state.loading)

        process.wait_until(is_loaded, "load the recording")
        yield client
    except RunError:
        raise
    except Exception as error:  # gRPC's errors have no type of their own
        # If the viewer has ended, its last message says more.
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.process.wait(_DRAWING)
        process.require_alive()
        raise RunError(f"the Rerun viewer did not draw: {error}") from error
    finally:
        process.end()


def pictures(recording: Path, numbers: list[int], folder: Path) -> list[Path]:
    """Draw pictures of the 3-D view at these frames, as PNG in a folder.

    Raises:
        RunError: the viewer did not start, or ended before it had drawn.
    """
    files = []
    with headless(recording) as client:
        (view,) = (view for view in client.get_state().views if view.view_class == "3D")
        for number in numbers:
            client.set_time("frame", sequence=number, play_state="paused")
            time.sleep(_DRAWING)
            files.append(folder / f"{number}.png")
            client.save_screenshot(str(files[-1].resolve()), view_id=view.view_id)
    return files
