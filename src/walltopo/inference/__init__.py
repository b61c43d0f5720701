"""ONNX files and sessions."""
