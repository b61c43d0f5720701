"""Shared parts of all endpoints: services, fields, pages of lists, errors, middleware."""
