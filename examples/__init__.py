"""Scripts and scenes, all of them run by the tests."""
