"""Migrations of the tables, by Alembic; run by `walltopo gym serve` and `walltopo gym migrate`."""
