"""Helpers of kernels, traced into the kernel that calls them: Numba compiles none of them.

Numba takes 40 ms of its own Python for each helper that it compiles, however small: a cone with friction had 520
of them. Here a helper runs once in plain Python on proxies of numbers and arrays, which note the operations on them;
the notes are emitted as instructions of LLVM where the kernel calls it. Types and instructions of an operation are
Numba's own, so that a kernel computes what it would compute if Numba compiled the helper, bit for bit.

Values that Python knows while it traces a helper leave no note: dispatch on classes, `if law is None`, loops over
tuples, methods of records, recursion over walls. Conditions that are known only in the kernel become ways among the
notes, and are written as in any Python: `if`, `while`, `for`, `break`, `return`, `and`, `or`, `not`, `in`. Rejected:
control flow as functions of functions, `cond(x > 0.0, first, second)` and `loop(condition, body, state)`: 700 branches
and loops of the package, and of its users, would have to be written so, and plain Python would pay for their calls.

    values      proxies: numbers and arrays that are known only in the kernel
    notes       the notes
    ways        one value of a variable where several ways meet; `select`
    decisions   branches and returns of one call
    frame       loops of one call
    source      the syntax tree of a function
    expressions, twins   the function with its calls and control flow going through a frame
    calls       calls: an operation, or a function that is traced in its turn
    emit        a helper as a function of its own in a kernel, and notes as instructions
    helpers     the bridge to Numba

Code that cannot be traced (`try`, `with`, lists, a function without a known source) is compiled by Numba as before;
`helpers.left_to_numba` has the reasons.
"""
