"""What each hold is (colour, type, size) and which holds make a route."""
