"""What one hold is: colour, type, shape."""
