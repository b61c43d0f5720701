"""Detect holds in photos: detectors behind one protocol, and the detection of a photo set."""
