"""Helpers for Numba and for traces: each is traced into its kernel; Numba compiles those that cannot be traced."""

import functools
import inspect
import logging
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

from numba import types
from numba.core.errors import NumbaError, TypingError
from numba.core.imputils import impl_ret_borrowed
from numba.core.typing.templates import Signature, infer, infer_global, make_overload_template
from numba.extending import lower_builtin

from ..cache import is_disabled
from . import calls, values
from .calls import traced
from .emit import FunctionPart, emit, key_of
from .notes import Argument, context, noting, taken

_LOG = logging.getLogger("swarm.trace")
_HERE = Path(__file__).parent
# The reasons for which Numba compiles helpers, by their modules and names.
left_to_numba: dict[str, str] = {}


class Helper:
    """A function for kernels.

    Args:
        function: the function that Python calls.
        body: the function that kernels call.
        outlined: whether it is a function of its own in a kernel, called and not inlined.
    """

    def __init__(self, function: Any, body: Any, outlined: bool) -> None:
        self._function, self._body, self._outlined = function, body, outlined
        self.signature = inspect.signature(function)
        self.name: str = function.__name__
        kinds = self.signature.parameters.values()
        self._keywords = [one.name for one in kinds if one.kind is inspect.Parameter.KEYWORD_ONLY]
        self._parts: dict[Any, FunctionPart | None] = {}
        self._whole: dict[Any, FunctionPart | None] = {}
        self.errors: dict[Any, Exception] = {}

    def called(self, *given: Any, **named: Any) -> Any:
        """Return the result of a call of the helper in a trace."""
        if named or len(given) < len(self.signature.parameters):
            bound = self.signature.bind(*given, **named)
            bound.apply_defaults()
            given = (*bound.args, *bound.kwargs.values())
        if not self._outlined:
            return self._inlined(given)
        part = self._part(given)
        return values.noted(self._function, *given) if part is None else part.called(given)

    def whole(self, context: Any, kinds: tuple[Any, ...]) -> FunctionPart | None:
        """Return the helper as Numba calls it, for arguments of these types, or None if it cannot be traced."""
        if kinds not in self._whole:
            self._whole[kinds] = None
            part = FunctionPart(self.name, inlined=True)
            part.arguments = [Argument(kind, k) for k, kind in enumerate(kinds)]
            with noting(part.notes, context):
                given = tuple(values.opened(one.kind, one) for one in part.arguments)
                try:
                    if self._outlined:
                        outlined = self._part(given)
                        if outlined is None:
                            return None
                        part.result = outlined.called(given)
                    else:
                        part.result = self._run(given)
                    part.kind = values.kind_of(part.result)
                    self._whole[kinds] = part
                except Exception as error:  # Python's errors if a proxy is not the type that a function expects
                    self.errors[kinds] = error
                    _tell(self._function, error)
        return self._whole[kinds]

    def known(self, kinds: tuple[Any, ...]) -> FunctionPart | None:
        """Return the result of `whole`."""
        return self._whole.get(kinds)

    def _part(self, given: Any) -> FunctionPart | None:
        """Return the helper as a part for such arguments, or None if it cannot be traced."""
        key = key_of(given)
        if key not in self._parts:
            self._parts[key] = None
            part = FunctionPart(self.name, inlined=False)
            with noting(part.notes):
                try:
                    part.give(self._run(part.take(given)))
                    self._parts[key] = part
                except Exception as error:  # Python's errors if a proxy is not the type that a function expects
                    _tell(self._function, error)
        return self._parts[key]

    def _inlined(self, given: Any) -> Any:
        notes = taken()
        mark = len(notes)
        try:
            return self._run(given)
        except Exception as error:  # Python's errors if a proxy is not the type that a function expects
            del notes[mark:]
            _tell(self._function, error)
            return values.noted(self._function, *given)

    def _run(self, given: Any) -> Any:
        first = len(given) - len(self._keywords)
        named = dict(zip(self._keywords, given[first:], strict=True))
        return traced(self._body, given[:first], named)


def _tell(function: Any, error: Exception) -> None:
    """Keep why and where a function is left to Numba: the line of the error, or the first line of the function."""
    frames = [one for one in traceback.extract_tb(error.__traceback__) if Path(one.filename).parent != _HERE]
    code = inspect.unwrap(function).__code__
    places = [(code.co_filename, code.co_firstlineno), *((one.filename, one.lineno) for one in frames)]
    reason = f"{type(error).__name__}: {error} ({places[-1][0]}, line {places[-1][1]})"
    left_to_numba.setdefault(f"{function.__module__}.{function.__name__}", reason)
    _LOG.debug("%s is compiled by Numba: %s", function.__name__, error, exc_info=error)


def leaving(options: Any) -> Callable[[Any, Exception], None]:
    """Return the function with which a trace leaves a user's function to Numba, to be compiled with these options."""

    def leave(function: Any, error: Exception) -> None:
        _tell(function, error)
        if function not in _LEFT:
            _LEFT.add(function)
            made: Any = make_overload_template(function, lambda *kinds: function, options, False, "never")
            infer_global(function, types.Function(made))
            context().refresh()

    return leave


_LEFT: set[Any] = set()


def prepare(function: Any, options: Any, outlined: bool, body: Any = None, is_kernel: bool = False) -> None:
    """Let traces and Numba call a helper, or `body` in its place; as a kernel, Numba compiles no function by itself."""
    if is_disabled():
        return
    helper = Helper(function, body or function, outlined)
    calls.REPLACED[function] = helper.called
    base: Any = make_overload_template(function, _definition(function, body), options, body is not None, "never")

    class Template(base):  # type: ignore[misc]
        def generic(self, args: Any, kws: Any) -> Any:
            kinds = tuple(map(types.unliteral, args))
            if not kws and len(kinds) == len(helper.signature.parameters) and all(map(_is_open, kinds)):
                part = helper.whole(self.context, kinds)
                if part is not None:
                    return Signature(part.kind, kinds, recvr=None)
                if is_kernel:
                    return self._whole_kernel(args, kws, helper.errors.get(kinds))
            return super().generic(args, kws)

        def _whole_kernel(self, args: Any, kws: Any, error: Any) -> Any:
            try:
                return super().generic(args, kws)
            except NumbaError as also:
                # It calls a function that Numba does not know: the reason why it cannot be traced says more.
                raise TypingError(str((error and error.__cause__) or error or also)) from also

        def get_impl_key(self, sig: Any) -> Any:
            return super().get_impl_key(sig) if helper.known(sig.args) is None else helper

    Template.__name__ = base.__name__
    infer(Template)
    infer_global(function, types.Function(Template))

    # The key is the helper, not its function: a function that is prepared again has another helper.
    @lower_builtin(helper, types.VarArg(types.Any))
    def _emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        part: Any = helper.known(sig.args)
        result = emit(context, builder, part, args)
        return impl_ret_borrowed(context, builder, sig.return_type, result)


def _definition(function: Any, body: Any) -> Any:
    """Return the function that Numba compiles for the types of arguments."""

    @functools.wraps(function)
    def compiled(*kinds: Any, **named: Any) -> Any:
        return body or function

    return compiled


def _is_open(kind: Any) -> bool:
    """Whether values of a type are known in a trace."""
    if isinstance(kind, types.BaseTuple):
        return all(map(_is_open, kind.types))  # type: ignore[attr-defined]
    return isinstance(kind, (types.Number, types.Boolean, types.NoneType, types.Array, types.NumberClass))
