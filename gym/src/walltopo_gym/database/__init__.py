"""The database: SQLite by default, PostgreSQL by a URL."""
