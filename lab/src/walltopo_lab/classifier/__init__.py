"""Types of holds from masked cutouts: train a classifier, and read one from an ONNX file."""
