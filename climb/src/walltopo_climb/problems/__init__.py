"""Propose problems on the present holds, and changes that make a route easier."""
