"""`walltopo gym ...`: one thin function per command."""
