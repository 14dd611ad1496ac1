"""Triangles as walls."""
