"""Ordered lists of routes and problems: a circuit, a session, homework of a group."""
