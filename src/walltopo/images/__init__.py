"""Photos as arrays, colour spaces, ONNX sessions."""
