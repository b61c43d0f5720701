"""Pictures as arrays: reading, colour curves, packing into an atlas."""
