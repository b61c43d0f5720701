"""The demo gym: real scans of bundled photos, and made-up climbers."""
