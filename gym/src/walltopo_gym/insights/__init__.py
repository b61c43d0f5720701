"""What setters and owners learn: counted from what was climbed, said and scanned."""
