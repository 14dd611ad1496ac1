"""A run: the loop over frames, its sessions, and the threads that advance it."""
