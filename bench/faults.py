"""`python -m bench.faults`: which of a hundred planted faults the tests see.

Each fault is planted alone, in a copy of a commit, and tests run there up to the first that fails. That test is then
run without the fault, so that what fails anyway is not counted.
"""

import argparse
import contextlib
import csv
import json
import os
import queue
import random
import re
import shlex
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

from .planting import Fault, chosen, found_again

ROOT = Path(__file__).parents[1]
# README's test command, without its processes: a test that fails ends the run.
TESTS = ""
NEAREST = 10
# A test that takes this long where a fault is planted hangs [s].
HANGS = 150.0
_FAILED = re.compile(r"^(?:FAILED|ERROR) (.+?)(?: - .*)?$", re.MULTILINE)
_BEGUN = re.compile(r"^((?:tests|swarm)/\S+\.py(?:::\S.*?)?)(?: (PASSED|FAILED|SKIPPED|XFAIL|ERROR).*)?$", re.MULTILINE)


@dataclass
class Outcome:
    """What became of one fault.

    Attributes:
        seen: whether a test fails with it that passes without it; None where the time was over before all tests ran.
        where: the test that fails, or what was run.
        seconds: wall time.
    """

    number: int
    fault: Fault
    seen: bool | None
    where: str
    seconds: float

    def __str__(self) -> str:
        said = {True: "seen", False: "NOT SEEN", None: "not seen in time"}[self.seen]
        return f"{self.number:3d} {said:16s} {self.seconds:5.0f} s  {self.where}\n    {self.fault}"


class Tree:
    """A private copy of a commit, with kernels and bytecode of its own, in which one fault at a time is planted."""

    def __init__(self, folder: Path, commit: str) -> None:
        self.folder = folder / "tree"
        self._cache = folder / "numba"
        self._changes = 0
        self._child: subprocess.Popen[bytes] | None = None
        self._is_over = False
        self.folder.mkdir(parents=True)
        self._cache.mkdir()
        archive = subprocess.run(["git", "archive", commit], cwd=ROOT, check=True, capture_output=True).stdout
        subprocess.run(["tar", "x", "-C", str(self.folder)], input=archive, check=True)

    @contextlib.contextmanager
    def planted(self, fault: Fault) -> Iterator[None]:
        """The fault is there in this context."""
        path = self.folder / fault.file
        source = path.read_bytes()
        try:
            self._write(path, fault.planted(source))
            yield
        finally:
            self._write(path, source)

    def _write(self, path: Path, source: bytes) -> None:
        # Bytecode is found by the second and the size of its source, which a fault may leave as they were.
        path.write_bytes(source)
        self._changes += 1
        moment = path.stat().st_mtime + 2.0 * self._changes
        os.utime(path, (moment, moment))

    def run(self, arguments: list[str], seconds: float) -> tuple[int | None, str]:
        """Exit code of pytest, None where its time was over, and what it said."""
        if self._is_over:
            sys.exit(1)
        # Kernels are keyed by the code that they hold: of the unchanged tree those are found that a fault leaves alone.
        own = {"PYTHONPATH": str(self.folder), "NUMBA_CACHE_DIR": str(self._cache), "NUMBA_OPT": "0"}
        command = [sys.executable, "-m", "pytest", "-x", "-v", "--tb=line", "-p", "no:cacheprovider"]
        command += ["-o", f"faulthandler_timeout={HANGS}", "-o", "faulthandler_exit_on_timeout=true", *arguments]
        with tempfile.TemporaryFile("w+") as said:
            child = self._child = subprocess.Popen(
                command, cwd=self.folder, env={**os.environ, **own}, stdout=said, stderr=said, start_new_session=True
            )
            try:
                code: int | None = child.wait(timeout=seconds)
            except subprocess.TimeoutExpired:
                code = None
            finally:
                self._end()
            said.seek(0)
            return code, said.read()

    def stop(self) -> None:
        """End what runs here, and start nothing more."""
        self._is_over = True
        self._end()

    def _end(self) -> None:
        # With the processes that the tests started.
        if self._child is not None:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self._child.pid, signal.SIGKILL)
            self._child.wait()


def nearest(folder: Path, file: str) -> list[str]:
    """The module with its doctests, then the files of tests that mention it and its names most, and golden runs."""
    source = (folder / file).read_text()
    stem, package = Path(file).stem, Path(file).parent.relative_to("swarm").parts
    names = set(re.findall(r"^(?:def|class) ([A-Za-z]\w*)", source, re.MULTILINE))
    dotted = ".".join(Path(file).with_suffix("").parts)
    importing = re.compile(rf"{re.escape(dotted)}\b|from {re.escape(dotted.rpartition('.')[0])} import .*\b{stem}\b")
    texts = {
        path.relative_to(folder).as_posix(): path.read_text()
        for path in sorted((folder / "tests").rglob("test_*.py"))
        if "long" not in path.relative_to(folder).parts
    }
    words = {path: set(re.findall(r"\w+", text)) for path, text in texts.items()}
    spread = {name: sum(name in said for said in words.values()) for name in names}
    # `reacting/queue.py` and `test_walls_that_react.py`: the first letters are alike in forms of a word.
    own = {part[:4] for part in (*package, stem)}
    users = {
        path.stem[:4]
        for path in (folder / "swarm").rglob("*.py")
        if re.search(rf"\.{stem} import|import .*\b{stem}\b", path.read_text())
    }
    shared = {part: sum(part in path for path in texts) for part in users - own}
    score = {}
    for path, text in texts.items():
        said = path.removeprefix("tests/")
        score[path] = 4.0 * bool(importing.search(text)) + sum(1.0 / spread[name] for name in names & words[path])
        score[path] += sum(part in said for part in own) + sum(2.0 / n for part, n in shared.items() if part in said)
    found = [path for path in sorted(texts, key=lambda path: (-score[path], path)) if score[path] > 0.0][:NEAREST]
    golden = "tests/test_golden.py"
    return [file, *found, *([golden] if golden in texts and golden not in found else [])]


def measured(
    tree: Tree, number: int, fault: Fault, rounds: list[tuple[list[str], float]], failing: set[str]
) -> Outcome:
    """Run tests in rounds, the arguments of pytest and a limit of time each, until one sees the fault.

    `failing` are the tests that fail without a fault: they are left out, and those that are found are added.
    """
    begun, complete = time.monotonic(), True
    for arguments, limit in rounds:
        end = time.monotonic() + limit
        while True:
            left_out = [f"--deselect={test}" for test in sorted(failing)]
            with tree.planted(fault):
                code, said = tree.run([*arguments, *left_out], max(end - time.monotonic(), 1.0))
            if code in (0, 5):
                break
            test = _failed(said)
            if code is None or test is None:
                # A module that cannot be imported ends the run before any test.
                if code is None or not _fails_alone(tree, fault, arguments):
                    complete = False
                    break
                return Outcome(number, fault, True, "no test can start", time.monotonic() - begun)
            alone, _ = tree.run([test], 2.0 * HANGS)
            if alone == 0:
                return Outcome(number, fault, True, test, time.monotonic() - begun)
            failing.add(test)
    where = "; ".join(" ".join(arguments) or "all tests" for arguments, _ in rounds)
    return Outcome(number, fault, False if complete else None, where, time.monotonic() - begun)


def _failed(said: str) -> str | None:
    """The test that failed, or the one in which Python ended."""
    failed = _FAILED.findall(said)
    if failed:
        return str(failed[0])
    begun = [one for one in _BEGUN.findall(said) if "::" in one[0]]
    return str(begun[-1][0]).strip() if begun and not begun[-1][1] else None


def _fails_alone(tree: Tree, fault: Fault, arguments: list[str]) -> bool:
    """Whether tests can be collected without the fault and cannot with it."""
    with tree.planted(fault):
        planted, _ = tree.run(["--collect-only", "-q", *arguments], HANGS)
    without, _ = tree.run(["--collect-only", "-q", *arguments], HANGS)
    return planted != 0 and without == 0


def again(folder: Path, table: Path) -> Iterator[tuple[int, Fault, str]]:
    """Number, fault and test of each row of a table; its lines may be elsewhere or in another module by now."""
    modules = {
        path.relative_to(folder).as_posix(): path.read_bytes() for path in sorted((folder / "swarm").rglob("*.py"))
    }
    for row in csv.DictReader(table.read_text("utf-8").splitlines()):
        line, before = int(row["line"]), row["before"]
        own = [row["file"]] if row["file"] in modules else []
        holding = [file for file in (*own, *modules) if before.encode() in modules[file]]
        found = (found_again(modules[file], file, line, before, row["after"]) for file in holding)
        fault = next(filter(None, found), None)
        if fault is None:
            print(f"{row['number']:>3} is gone: no module has the line {before}")
        else:
            yield int(row["number"]), fault, row["seen by"]


def main() -> None:
    """List the faults of a seed, or measure which of them the tests see."""
    parser = argparse.ArgumentParser(prog="python -m bench.faults", description=__doc__)
    parser.add_argument("--seed", type=int, default=56, help="what chooses the faults (56)")
    parser.add_argument("--commit", default="HEAD", help="the tree that is tested (HEAD)")
    parser.add_argument("--list", action="store_true", help="print the faults, and run nothing")
    parser.add_argument("--only", type=int, nargs="+", metavar="K", help="numbers of the faults to plant, from 0")
    parser.add_argument("--sample", type=int, metavar="N", help="plant N of them, which the seed chooses")
    parser.add_argument("--tests", default=TESTS, help="arguments of pytest (none: README's tests, in one process)")
    parser.add_argument("--nearest", action="store_true", help="first the tests nearest to the module, then the rest")
    parser.add_argument("--nearest-only", action="store_true", help="the tests nearest to the module, and no others")
    parser.add_argument("--limit", type=float, default=3600.0, help="seconds for the tests of a fault (3600)")
    parser.add_argument("--nearest-limit", type=float, default=600.0, help="seconds for the nearest of them (600)")
    parser.add_argument("--processes", type=int, default=1, help="faults that are tested at a time (1)")
    parser.add_argument("--again", type=Path, metavar="TABLE", help="the faults of this table, and first its tests")
    parser.add_argument("--json", type=Path, help="file for the outcomes")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="swarm-faults-") as temporary:
        trees = [Tree(Path(temporary) / str(k), asked.commit) for k in range(asked.processes)]
        faults = list(enumerate(chosen(trees[0].folder / "swarm", asked.seed))) if asked.again is None else []
        asked.seen_by = {}
        for number, fault, test in again(trees[0].folder, asked.again) if asked.again else ():
            faults.append((number, fault))
            asked.seen_by[number] = test
        if asked.only is not None:
            faults = [(number, fault) for number, fault in faults if number in asked.only]
        if asked.sample is not None:
            faults = random.Random(asked.seed).sample(faults, asked.sample)
        if asked.list:
            for number, fault in faults:
                print(f"{number:3d} {fault}")
            return
        _measure(trees, faults, asked)


def _measure(trees: list[Tree], faults: list[tuple[int, Fault]], asked: argparse.Namespace) -> None:
    left: queue.SimpleQueue[tuple[int, Fault]] = queue.SimpleQueue()
    for one in faults:
        left.put(one)
    outcomes: list[Outcome] = []
    failing: set[str] = set()
    saying = threading.Lock()

    def work(tree: Tree) -> None:
        with contextlib.suppress(queue.Empty):
            while True:
                number, fault = left.get_nowait()
                rounds = [(shlex.split(asked.tests), asked.limit)]
                if asked.nearest or asked.nearest_only:
                    near = (nearest(tree.folder, fault.file), asked.nearest_limit)
                    rounds = [near] if asked.nearest_only else [near, *rounds]
                # Its whole file: a test that is named by itself runs also where it is slow.
                if file := asked.seen_by.get(number, "").partition("::")[0]:
                    rounds.insert(0, ([file], asked.nearest_limit))
                outcome = measured(tree, number, fault, rounds, failing)
                with saying:
                    outcomes.append(outcome)
                    print(outcome, flush=True)
                    if asked.json:
                        asked.json.write_text(json.dumps([asdict(one) for one in outcomes], indent=1))

    # A run that is interrupted or killed leaves no tests behind.
    # Tests interrupt themselves: a shell that starts this in the background has SIGINT ignored, also by them.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    threads = [threading.Thread(target=work, args=(tree,), daemon=True) for tree in trees]
    for thread in threads:
        thread.start()
    try:
        for thread in threads:
            thread.join()
    finally:
        for tree in trees:
            tree.stop()
    seen = sum(one.seen is True for one in outcomes)
    print(f"{seen} of {len(outcomes)} seen; fail without a fault: {', '.join(sorted(failing)) or 'none'}")


if __name__ == "__main__":
    main()
