"""Scripts of the repository: documentation, fuzzing, releases, building. Not installed."""
