"""Movement, grade ranges and problem setting on the walls of walltopo."""
