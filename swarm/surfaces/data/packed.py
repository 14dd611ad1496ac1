"""Samples as a text that a trajectory keeps."""

import base64
import binascii
import hashlib
import zlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import SceneError

# Samples of more bytes are not kept in files: of those only a digest is.
_MOST_BYTES = 64_000_000


def packed(values: NDArray[np.float64]) -> dict[str, Any]:
    """Their shape, a digest, and their bytes unless they are too many."""
    little = values.astype("<f8")
    found = {"shape": list(values.shape), "sha256": hashlib.sha256(little.tobytes()).hexdigest()}
    if values.nbytes <= _MOST_BYTES:
        found["bytes"] = base64.b64encode(zlib.compress(little.tobytes(), 1)).decode()
    return found


def unpacked(table: dict[str, Any]) -> NDArray[np.float64]:
    """The samples again.

    Raises:
        SceneError: their bytes were not kept, or are not those that were.
    """
    if set(table) != {"shape", "sha256", "bytes"}:
        shape = " x ".join(map(str, table.get("shape", ())))
        raise SceneError(
            f"values must hold the samples, got only the digest of {shape or 'some'}: more than "
            f"{_MOST_BYTES // 10**6} MB of them are not kept in a file; make the scene again from the array or the "
            "mesh that it was made from"
        )
    try:
        data = zlib.decompress(base64.b64decode(table["bytes"], validate=True))
        if hashlib.sha256(data).hexdigest() != table["sha256"]:
            raise ValueError("their digest is another one")
        return np.frombuffer(data, "<f8").astype(np.float64).reshape(table["shape"])
    except (ValueError, TypeError, binascii.Error, zlib.error) as error:
        raise SceneError(f"values must be samples as they were kept, got damaged ones: {error}") from None
