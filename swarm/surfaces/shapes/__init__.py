"""The surfaces with a name: one file a shape."""
