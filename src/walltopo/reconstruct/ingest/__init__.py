"""Convert photos and videos to upright, comparable JPEGs without personal metadata."""
