"""What every kernel is made of: the compiler's flags, dispatch, vectors, gravity."""
