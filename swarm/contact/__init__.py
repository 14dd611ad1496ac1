"""What the methods share at a contact, and only that."""
