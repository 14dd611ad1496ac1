"""Common parts of all kernels: flags of the compiler, dispatch, vectors, gravity."""
