"""The walls of a scene as triangles, for pictures, recordings and files."""
