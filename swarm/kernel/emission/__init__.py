"""Instructions of operations of kernels, which modules of `kernel/` define in plain Python."""
