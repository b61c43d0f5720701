"""How the tables came to be, by Alembic; run by `walltopo gym serve` and `walltopo gym migrate`."""
