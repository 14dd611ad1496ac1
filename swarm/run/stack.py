"""Threads whose stack is as large as the scratch arrays of the kernels that run on them, which are on it."""

import threading
from concurrent.futures import ThreadPoolExecutor

# What a thread has for all else; and stacks are whole pages.
_REST, _PAGE = 8 << 20, 1 << 16


def threads_with(count: int, scratch: int) -> ThreadPoolExecutor:
    """A pool of `count` threads, all of them begun, each with room for so many bytes of scratch arrays.

    Memory that is not used is none: a system maps a stack page by page.
    """
    before = threading.stack_size(-(-(scratch + _REST) // _PAGE) * _PAGE)
    try:
        pool = ThreadPoolExecutor(count, thread_name_prefix="swarm")
        # Each waits for all the others, so none takes the turn of two.
        together = threading.Barrier(count)
        for begun in [pool.submit(together.wait) for _ in range(count)]:
            begun.result()
    finally:
        threading.stack_size(before)
    return pool
