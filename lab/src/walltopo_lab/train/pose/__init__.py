"""Convert the networks of BlazePose from TFLite to ONNX."""
