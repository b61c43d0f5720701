"""The HTTP server: application, pages, start."""
