"""Background jobs: declared once, queued in the caller's transaction, run by DBOS."""
