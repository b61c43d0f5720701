"""`walltopo gym ...`: one thin function a command."""
