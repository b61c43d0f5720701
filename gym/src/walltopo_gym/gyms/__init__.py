"""Gyms: who belongs to them, their grades, their walls, and who may see them."""
