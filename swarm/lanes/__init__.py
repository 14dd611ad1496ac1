"""Many particles at once: one a lane, loops over lanes that the compiler vectorises."""
