"""Read the poses that phones and other programs give, one module per format."""
