"""The local server: a scan's page, and in edit mode the API that saves corrections.

Its guarantees, and the test of each: `docs/security.md`.
"""
