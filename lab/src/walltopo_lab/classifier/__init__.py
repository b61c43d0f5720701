"""Classification of hold types from masked cutouts: training, and ONNX inference."""
