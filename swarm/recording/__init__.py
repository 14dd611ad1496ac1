"""Recordings for Rerun: written, read back, and shown."""
