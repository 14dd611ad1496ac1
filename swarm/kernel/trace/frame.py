"""The control flow of a helper while it is traced."""

import operator
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from .decisions import DONE, NEXT, Decisions, Get, Put
from .notes import Assign, Branch, Label, Slot, add, taken
from .values import TraceError, Value, has_value, kind_of, noted
from .ways import all_of, carried, goes_round

# The rounds of a loop that are written out if it cannot be a loop of the kernel.
UNROLLED = 8


class _Loop:
    """A loop that is being traced."""

    def __init__(self, get: Get) -> None:
        self.get = get
        self.advance: Get = get
        self.head, self.end = Label(), Label()
        self.exits: list[tuple[Assign, Any]] = []
        self.nexts: list[tuple[Assign, Any]] = []


class CallFrame(Decisions):
    """One call of a function while it is traced; the statements that `twins.py` makes call this."""

    def __init__(self, call: Callable[..., Any]) -> None:
        super().__init__(call)
        self._loops: list[_Loop] = []

    # --- Loops ---

    def leave(self) -> bool:
        """`break`"""
        loop = self._loops[-1]
        values = loop.get()
        loop.exits.append((self._ends_at(loop.end), values))
        return DONE

    def again(self) -> bool:
        """`continue`"""
        loop = self._loops[-1]
        values = loop.advance()
        loop.nexts.append((self._ends_at(loop.head), values))
        return DONE

    def repeat(self, test: Callable[[], Any], body: Callable[[], bool], get: Get, put: Put) -> bool:
        """`while test(): body()`"""
        return self._rounds(test, body, get, put, get)

    def each(self, values: Any, take: Callable[[Any], None], body: Callable[[], bool], get: Get, put: Put) -> bool:
        """`for value in values: body()`; the values of a `range` may be known only in the kernel."""
        if isinstance(values, Value):
            whole = values
            return self.each(Range(whole.shape[0]), lambda k: take(whole[k]), body, get, put)
        if not isinstance(values, Range):
            return self._written_out(values, take, body, get, put)
        mark, gives, before, depth, loops = len(taken()), len(self._gives), get(), self._depth, len(self._loops)
        try:
            return self._counted(values, take, body, get, put)
        except TraceError:
            known = values.known()
            if known is None or len(known) > UNROLLED:
                raise
        # The statements of each round depend on its number.
        del taken()[mark:], self._gives[gives:], self._loops[loops:]
        self._depth = depth
        put(before)
        return self._written_out(known, take, body, get, put)

    def _counted(
        self, values: "Range", take: Callable[[Any], None], body: Callable[[], bool], get: Get, put: Put
    ) -> bool:
        start, stop, step = values.numbers()
        counter = [start]

        def test() -> Any:
            return counter[0] > stop if step < 0 else counter[0] < stop

        def take_and_go() -> bool:
            take(counter[0])
            return body()

        def both() -> tuple[Any, ...]:
            return (*get(), counter[0])

        def set_both(state: tuple[Any, ...]) -> None:
            put(state[:-1])
            counter[0] = state[-1]

        return self._rounds(test, take_and_go, both, set_both, lambda: (*get(), counter[0] + step))

    def _written_out(
        self, values: Any, take: Callable[[Any], None], body: Callable[[], bool], get: Get, put: Put
    ) -> bool:
        loop = _Loop(get)
        self._loops.append(loop)
        reached = NEXT
        for value in values:
            loop.head, loop.nexts = Label(), []
            take(value)
            self._depth += 1  # an earlier round may have left the loop
            reached = body()
            self._depth -= 1
            if loop.nexts:
                if reached is NEXT:
                    loop.nexts.append((self._ends_at(loop.head), get()))
                put(self._met(loop.head, loop.nexts))
                reached = NEXT
            if reached is DONE:
                break
        self._loops.pop()
        if not loop.exits:
            return reached
        if reached is NEXT:
            loop.exits.append((self._ends_at(loop.end), get()))
        put(self._met(loop.end, loop.exits))
        return NEXT

    def _rounds(self, test: Callable[[], Any], body: Callable[[], bool], get: Get, put: Put, advance: Get) -> bool:
        noted_so_far, before, gives = taken(), get(), len(self._gives)
        mark, wider = len(noted_so_far), dict[tuple[int, ...], Any]()
        while True:
            loop = _Loop(get)
            loop.advance = advance
            entry = self._ends_at(loop.head)
            add(loop.head)
            slots: dict[tuple[int, ...], Slot] = {}
            put(carried(before, entry, slots, wider, ()))
            going = self.test(test())
            if going is False:
                del noted_so_far[mark:]
                put(before)
                return NEXT
            if isinstance(going, Value):
                inside, out = Label(), Label()
                add(Branch(going, inside, out))
                add(out)
                loop.exits.append((self._ends_at(loop.end), get()))
                add(inside)
            self._loops.append(loop)
            self._depth += 1
            reached = body()
            self._depth -= 1
            self._loops.pop()
            if reached is NEXT:
                values = advance()
                loop.nexts.append((self._ends_at(loop.head), values))
            if all_of(goes_round(before, slots, wider, assign, value, ()) for assign, value in loop.nexts):
                break
            # A variable changes its type in the loop: trace it again with the type that holds both.
            del noted_so_far[mark:]
            del self._gives[gives:]
            put(before)
        if not loop.exits:
            return DONE
        put(self._met(loop.end, loop.exits))
        return NEXT

    # --- Expressions ---

    def item(self, of: Any, place: Any) -> Any:
        """`of[place]`"""
        if isinstance(of, (tuple, np.ndarray)) and has_value(place):
            return noted(operator.getitem, of, place)
        return of[place]


class Range:
    """The `range` of a loop; its bounds may be known only in the kernel."""

    def __init__(self, *given: Any) -> None:
        start, stop, step = (0, *given, 1) if len(given) == 1 else (*given, 1)[:3]
        self._given = start, stop, step

    def known(self) -> range | None:
        """Return it as a Python range, or None."""
        return None if has_value(self._given) else range(*map(int, self._given))

    def __iter__(self) -> Iterator[int]:
        known = self.known()
        if known is None:
            raise TraceError("it asks for the numbers of a range that is known in the kernel only")
        return iter(known)

    def numbers(self) -> tuple[Any, Any, Any]:
        """Return start, stop and step, of one type; the step is known."""
        start, stop, step = self._given
        if isinstance(step, Value):
            raise TraceError("the step of a range must be known before the kernel runs")
        kinds = [kind_of(one) for one in (start, stop) if isinstance(one, Value)]
        unsigned = bool(kinds) and all(not kind.signed for kind in kinds)
        number = np.uint64 if unsigned else np.int64
        first, last = (noted(number, one) if isinstance(one, Value) else number(one) for one in (start, stop))
        return first, last, number(step)
