"""Surfaces by a formula or by a user's own functions."""
