"""Surfaces from data: samples of phi on a grid, and meshes of triangles."""
