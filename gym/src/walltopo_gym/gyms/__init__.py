"""Gyms: members, roles, grade systems, walls, access."""
