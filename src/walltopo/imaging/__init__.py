"""Photos as arrays, colour spaces, packing."""
