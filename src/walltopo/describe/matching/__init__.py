"""Hold identity over resets: which hold of one scan is which of another."""
