"""A kernel is one module of LLVM, which is optimised as a whole, as far as that pays.

By itself Numba optimises each function, with all that it calls, and makes machine code of it that never runs: a
kernel links the text. So helpers that a trace leaves to Numba are compiled to LLVM's text only. The garbage collector
is disabled while a kernel compiles.

Where it pays, the loops over lanes of flights use vectors of 512 bits.
"""

import contextlib
import copy
import functools
import sys
import threading
from collections.abc import Iterator
from typing import Any

import llvmlite.binding as llvm
import numba
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler

from .arguments import wrap
from .collection import uncollected

_CONFIG: Any = numba.config
# The frames that a trace may nest; 1600 take less than 512 kB of a stack.
_DEEPEST = 10_000

# LLVM's level for the module of flights, unless $NUMBA_OPT is lower.
_ENOUGH = 2

# A processor with this feature is an Ice Lake, a Zen 4, or a later one.
_RECENT = "+avx512vbmi2"
_WIDE = ",-prefer-256-bit"


def _level() -> int:
    """Return the level of LLVM's optimisation, $NUMBA_OPT, by default 3."""
    return int(_CONFIG.OPT)


def features_of(codegen: Any) -> str:
    """Return LLVM's features of the processor for kernels of flights: Numba's, and vectors of 512 bits where they pay.

    By itself LLVM uses 256 bits on Intel's processors, as the first of those with AVX-512 lower their frequency for
    wider ones. These lack the instruction set `_RECENT` and keep 256 bits; nothing was measured on them.
    Measured in turn on a Sapphire Rapids, times of 256 bits: an impact on walls that swing or turn 0.7 to 0.8, a
    formula of degree 4 0.80, boxes and rotated ellipsoids 0.8 to 0.9, other shapes 0.9 to 1.0 with gravity or without,
    meshes 0.93 to 0.97, first calls the same. Balls, bodies and sliding gain nothing (0.97 to 1.07): their loops are
    short or in scalars, so a `_LongKernel` keeps 256 bits, except that of grains, where all lanes of a group are one
    vector.

    No sum over lanes is reordered, so bits are the same. $NUMBA_CPU_FEATURES is taken as it is.
    """
    features = str(codegen._tm_features)
    return features + _WIDE if _CONFIG.CPU_FEATURES is None and _RECENT in features.split(",") else features


@functools.cache
def _in_wide_vectors(codegen: Any) -> Any:
    """Return Numba's code generator, with the same engine, with passes for `features_of`."""
    if features_of(codegen) == codegen._tm_features:
        return codegen
    options: dict[str, Any] = {"opt": _level()}
    codegen._customize_tm_options(options)
    options["features"] = features_of(codegen)
    wide = copy.copy(codegen)
    wide._tm = llvm.Target.from_triple(llvm.get_process_triple()).create_target_machine(**options)
    return wide


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
        """Do nothing: without machine code there is no place for it, and `cache.py` stores it in the kernel."""


class PartCompiler(Compiler):  # type: ignore[misc]
    """Numba's compiler for helpers that are not traced, set by `pipeline_class`, an option of `jit`."""

    def define_pipelines(self) -> Any:
        """Return Numba's passes, into a library that is a `_Part`."""
        self.state.library = _Part(self.state.targetctx.codegen(), self.state.func_id.func_qualname)
        return super().define_pipelines()


class _Kernel(JITCodeLibrary):  # type: ignore[misc]
    """A kernel; its functions are reduced one by one before all of them are optimised together.

    Two passes suffice: one moves variables from memory to registers, the other removes unreachable branches. All passes
    of LLVM's lowest level take ten times as long, an eighth of LLVM's time for points in a mesh that turns, and do not
    shorten the passes over the module. Without any pass the module takes longer by the time that is saved.

    Flights are optimised at level 2, which takes 0.9 of LLVM's time at level 3; they run as fast, 0.99 to 1.01. Balls
    and bodies do not, see `_LongKernel`. Numba's own first round over the module, at level 0, is left out, as it
    changes nothing.

    Only the wrapper for Python calls the function of a kernel. If others might, LLVM would keep the function whole, and
    all of its arguments, beside a copy in the wrapper: a twentieth of the first call of points in a sphere.
    """

    is_in_wrapper = True

    def _optimize_functions(self, module: Any) -> None:
        module.data_layout = self._codegen._data_layout
        if _level() == 0:
            return
        passes = llvm.create_new_function_pass_manager()
        passes.add_sroa_pass()
        passes.add_simplify_cfg_pass()
        builder = self._codegen._pass_builder()
        for function in module.functions:
            if not function.is_declaration:
                passes.run(function, builder)

    def _optimize_final_module(self) -> None:
        passes, builder = self._codegen._module_pass_manager(opt=min(_ENOUGH, _level()))
        passes.run(self._final_module, builder)

    def _get_module_for_linking(self) -> Any:
        """Return the functions that a process needs to load the machine code: no kernel links the text of another."""
        names = [one.name for one in self.get_defined_functions() if one.linkage == llvm.Linkage.external]
        return llvm.parse_assembly("".join(f'define void @"{name}"() {{ ret void }}\n' for name in names))


class _LongKernel(_Kernel):
    """A kernel of many short loops, which LLVM does not unroll.

    By itself it makes twice the code of the kernel of bodies: of 10.6 s for tetrahedra 4.4 are for that, and it runs no
    faster. In flights it unrolls little, and that pays. Within its wrapper a step of bodies would take 1.05 to 1.09 of
    the time, so only kernels with many arguments are within their wrappers, see `wrap`.
    """

    is_in_wrapper = False

    # Whether neighbouring numbers in a row form a vector, without a loop over them.
    has_rows = False

    def _optimize_final_module(self) -> None:
        tuning = llvm.create_pipeline_tuning_options(speed_level=_level())
        tuning.loop_unrolling = False
        tuning.slp_vectorization = self.has_rows
        builder = llvm.create_pass_builder(self._codegen._tm, tuning)
        builder.getModulePassManager().run(self._final_module, builder)


class _WideLongKernel(_LongKernel):
    """The kernel of grains, where a row of eight numbers is read and written for each grain.

    With vectors the loops over grains take 0.8 of the time and a step 0.97 to 0.99; compiling takes as long.
    """

    has_rows = True


class KernelCompiler(Compiler):  # type: ignore[misc]
    """Numba's compiler for kernels, with the garbage collector disabled: all parts of a kernel live until it is done.

    A collection walks through all of them again and again, an eighth of the time.
    """

    library: type[_Kernel] = _Kernel
    is_wide = True

    def define_pipelines(self) -> Any:
        """Return Numba's passes, into a library that is a `_Kernel`."""
        codegen = self.state.targetctx.codegen()
        codegen = _in_wide_vectors(codegen) if self.is_wide else codegen
        self.state.library = self.library(codegen, self.state.func_id.func_qualname)
        self.state.library.enable_object_caching()
        # The target belongs to this kernel alone: Numba has made it for the kernel.
        self.state.targetctx.create_cpython_wrapper = functools.partial(wrap, self.state.targetctx)
        return super().define_pipelines()

    def compile_extra(self, func: Any) -> Any:
        """Compile a kernel with its helpers."""
        with uncollected(), deep():
            return super().compile_extra(func)


class LongKernelCompiler(KernelCompiler):
    """Numba's compiler for a `_LongKernel`."""

    library = _LongKernel
    is_wide = False


class WideLongKernelCompiler(LongKernelCompiler):
    """Numba's compiler for a `_WideLongKernel`, with vectors of 512 bits."""

    library = _WideLongKernel
    is_wide = True


_limits = threading.Lock()
_inside: list[int] = []


@contextlib.contextmanager
def deep() -> Iterator[None]:
    """Let Python nest `_DEEPEST` frames until the last thread leaves: the limit holds for the whole process."""
    with _limits:
        before = _inside[0] if _inside else sys.getrecursionlimit()
        _inside.append(before)
        raised = max(before, _DEEPEST)
        if len(_inside) == 1:
            sys.setrecursionlimit(raised)
    try:
        yield
    finally:
        with _limits:
            _inside.pop()
            # A limit that other code has set meanwhile is kept.
            if not _inside and sys.getrecursionlimit() == raised:
                sys.setrecursionlimit(before)
