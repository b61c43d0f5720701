"""Photos on their way in: received piece by piece, stored by content, looked at."""
