"""Match the holds and routes of two scans of one wall."""
