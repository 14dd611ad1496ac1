"""Parts of every kernel: the compiler's flags, dispatch, vectors, gravity."""
