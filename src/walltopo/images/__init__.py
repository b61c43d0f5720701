"""Read photos as arrays, convert colour spaces, run ONNX networks."""
