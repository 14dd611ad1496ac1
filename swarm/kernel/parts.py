"""Helpers of kernels are compiled to LLVM's text only, and a kernel optimises all that it calls as one module.

By itself Numba optimises each function, with all that it calls, and makes machine code of it, which never runs: a
kernel links the text. For the 180 functions of `Impact` in an ellipsoid around a ball, under gravity, that was 3.9 of
11.2 s. A kernel is no slower this way: 11.3 instead of 13.3 ns an impact of a fall in a sphere, 20.5 instead of 22.0 ns
with Uzawa's loop, 5.4 and 5.4 ns in a sphere.
"""

from typing import Any

from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler


class _Part(JITCodeLibrary):  # type: ignore[misc]
    """The text of a helper and of all that it calls."""

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        return 0  # as for any function without a wrapper for Python

    @property
    def codegen(self) -> Any:
        return self

    def set_env(self, name: str, environment: Any) -> None:
        """Without machine code there is no place for it: `cache.py` stores it in the kernel."""


class PartCompiler(Compiler):  # type: ignore[misc]
    """Numba's compiler for helpers, by `pipeline_class`, an option of `jit`."""

    def define_pipelines(self) -> Any:
        """The passes of Numba, into a library that is a `_Part`."""
        self.state.library = _Part(self.state.targetctx.codegen(), self.state.func_id.func_qualname)
        return super().define_pipelines()
