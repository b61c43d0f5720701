"""The local server: a scan's page, and in edit mode the place where corrections are saved.

What it promises, and the test of each promise: `docs/security.md`.
"""
