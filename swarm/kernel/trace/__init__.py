"""Helpers of kernels, traced into the kernel that calls them: Numba compiles none of them.

Numba takes 40 ms of its own Python for each helper that it compiles, however small it is: a cone with friction had 520
of them. Here a helper runs once in plain Python on proxies of numbers and arrays, which note what is done with them;
the notes are emitted as instructions of LLVM where the kernel calls it. Types and instructions of an operation are
Numba's own, so that a kernel computes what it would compute if Numba compiled the helper, bit for bit.

What Python knows while a helper is traced leaves no note: dispatch on classes, `if law is None`, loops over tuples,
methods of records, recursion over walls. What is known in the kernel only is a way among the notes, and is written as
in any Python: `if`, `while`, `for`, `break`, `return`, `and`, `or`, `not`, `in`. Rejected: control flow as functions of
functions, `cond(x > 0.0, first, second)` and `loop(condition, body, state)`: 700 branches and loops of the package, and
all of its users, would have to be written so, and plain Python would pay for their calls.

    values      proxies: numbers and arrays that are known in the kernel only
    notes       what is noted
    ways        one value of a variable where several ways meet; `select`
    decisions   branches and returns of one call
    frame       its loops
    source      the syntax tree of a function
    expressions, twins   the same function; its calls and control flow go through a frame
    calls       what a call means: an operation, or a function that is traced in its turn
    emit        a helper as a function of its own in a kernel, and notes as instructions
    helpers     the bridge to Numba

What cannot be traced (`try`, `with`, lists, a function without a known source) is compiled by Numba as before;
`helpers.left_to_numba` says why.
"""
