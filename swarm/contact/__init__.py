"""The mathematics of a contact that methods share, and only that."""
