#!/usr/bin/env bash
# A class that msgspec has converted an object to cannot be pickled by value any more.
#
# cloudpickle 3.1.2, msgspec 0.22.0. msgspec keeps what it knows of a dataclass, NamedTuple or TypedDict
# as `__msgspec_cache__` in the class. cloudpickle pickles a class by value, with all that is in it, where the class is
# of `__main__` or of a module given to `register_pickle_by_value`; the objects of msgspec cannot be pickled. So a
# program that reads its settings with msgspec can send its classes to workers (Dask, Ray) before the first
# `msgspec.convert`, and not after it. `msgspec.Struct` is not affected. Deleting the attribute mends it, and msgspec
# makes it again when it is needed.
#
# Seen on 2026-11-28, Python 3.11.7:
#   InMain     before: sent    after: TypeError: cannot pickle 'msgspec._core.DataclassInfo' object    deleted: sent
#   Dataclass  before: sent    after: TypeError: cannot pickle 'msgspec._core.DataclassInfo' object    deleted: sent
#   Named      before: sent    after: TypeError: cannot pickle 'msgspec._core.NamedTupleInfo' object    deleted: sent
#   Typed      before: sent    after: TypeError: cannot pickle 'msgspec._core.TypedDictInfo' object    deleted: sent
#   Struct     before: sent    after: sent    deleted: sent
#
# Exit code 1 if that changes. Usage: bash findings/cloudpickle_after_msgspec.sh
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check cloudpickle==3.1.2 msgspec==0.22.0
cat >"$folder/kinds.py" <<'PYTHON'
from dataclasses import dataclass
from typing import NamedTuple, TypedDict

import msgspec


@dataclass
class Dataclass:
    x: int


class Named(NamedTuple):
    x: int


class Typed(TypedDict):
    x: int


class Struct(msgspec.Struct):
    x: int
PYTHON
cat >"$folder/main.py" <<'PYTHON'
import platform
import sys
from dataclasses import dataclass

import cloudpickle
import kinds
import msgspec


@dataclass
class InMain:
    x: int


def sent(one):
    try:
        cloudpickle.dumps(one)
    except TypeError as error:
        return f"TypeError: {error}"
    return "sent"


print(f"Python {platform.python_version()}, cloudpickle {cloudpickle.__version__}, msgspec {msgspec.__version__}")
cloudpickle.register_pickle_by_value(kinds)
refused = "TypeError: cannot pickle 'msgspec._core.{}' object"
expected = {
    InMain: ({"x": 1}, refused.format("DataclassInfo")),
    kinds.Dataclass: ({"x": 1}, refused.format("DataclassInfo")),
    kinds.Named: ([1], refused.format("NamedTupleInfo")),
    kinds.Typed: ({"x": 1}, refused.format("TypedDictInfo")),
    kinds.Struct: ({"x": 1}, "sent"),
}
changed = False
for kind, (value, wanted) in expected.items():
    before = sent(kind)
    msgspec.convert(value, kind)
    after = sent(kind)
    if "__msgspec_cache__" in vars(kind):
        del kind.__msgspec_cache__
    deleted = sent(kind)
    print(f"{kind.__name__:10} before: {before}    after: {after}    deleted: {deleted}")
    changed |= (before, after, deleted) != ("sent", wanted, "sent")
sys.exit(changed)
PYTHON
cd "$folder" && venv/bin/python main.py
