"""Training of the hold detector (extra `[train]`)."""
