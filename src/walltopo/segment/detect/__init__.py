"""Seeing holds in photos: detectors behind one protocol, and the stage that runs them."""
