"""Convert a TFLite network of floats to ONNX: the operators that BlazePose uses.

TFLite stores pictures as NHWC, ONNX as NCHW: each tensor of rank 4 is transposed once, at
conversion; tensors of other ranks keep their order. Weights that TFLite stores as float16, or
sparse, are constants of the ONNX graph.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo_lab.train.pose.tflite_file import Operator, TfliteGraph

OPSET = 17
_IR_VERSION = 8  # of ONNX 1.12 and later
_SAME = 0  # TFLite's `Padding`
_ACTIVATIONS = {0: "", 1: "Relu", 3: "Clip"}  # TFLite's `ActivationFunctionType`: none, ReLU, ReLU6
_NHWC_TO_NCHW, _NCHW_TO_NHWC = (0, 3, 1, 2), (0, 2, 3, 1)


def convert(graph: TfliteGraph, source: str, outputs: Mapping[int, str]) -> Any:
    """Return the `onnx.ModelProto` of a network with one picture as its input, `pictures`, NCHW.

    Parameters
    ----------
    graph : the network.
    source : name of the network, for error messages.
    outputs : the outputs to keep, by their position in the file, and their names; operators that
        no such output needs are left out.

    Raises
    ------
    InputError : an operator is used in a way that this converter lacks.
    """
    conversion = _Conversion(graph, source)
    for operator in graph.operators:
        conversion.add(operator)
    return conversion.model({graph.outputs[k]: name for k, name in outputs.items()})


class _Conversion:
    """An ONNX graph under construction."""

    def __init__(self, graph: TfliteGraph, source: str) -> None:
        self._graph, self._source = graph, source
        self._nodes: list[Any] = []
        self._arrays: dict[str, NDArray[Any]] = {}
        self._values = {
            k: tensor.value for k, tensor in enumerate(graph.tensors) if tensor.value is not None
        }
        self._names = {k: f"t{k}" for k in range(len(graph.tensors))}
        self._names[graph.inputs[0]] = "pictures"
        self._converters: dict[str, Callable[[Operator], None]] = {
            "ADD": self._add_sum,
            "CONCATENATION": self._add_concatenation,
            "CONV_2D": self._add_convolution,
            "DEPTHWISE_CONV_2D": self._add_convolution,
            "DEPTH_TO_SPACE": self._add_depth_to_space,
            "DEQUANTIZE": self._unpack,
            "DENSIFY": self._unpack,
            "LOGISTIC": lambda operator: self._emit("Sigmoid", operator),
            "MAX_POOL_2D": self._add_pool,
            "PAD": self._add_pad,
            "RESHAPE": self._add_reshape,
            "RESIZE_BILINEAR": self._add_resize,
        }

    def add(self, operator: Operator) -> None:
        """Add the nodes of an operator."""
        self._converters[operator.kind](operator)

    def model(self, outputs: Mapping[int, str]) -> Any:
        """Return the model with the tensors `outputs`, by their new names."""
        from onnx import TensorProto, helper, numpy_helper

        for number, name in outputs.items():
            self._nodes.append(helper.make_node("Identity", [self._names[number]], [name]))
        nodes = self._nodes_behind(set(outputs.values()))
        used = {name for node in nodes for name in node.input}
        source = self._graph.inputs[0]
        graph = helper.make_graph(
            nodes,
            "pose",
            [helper.make_tensor_value_info("pictures", TensorProto.FLOAT, self._shape(source))],
            [
                helper.make_tensor_value_info(name, TensorProto.FLOAT, self._shape(number))
                for number, name in outputs.items()
            ],
            [numpy_helper.from_array(a, name) for name, a in self._arrays.items() if name in used],
        )
        return helper.make_model(
            graph, opset_imports=[helper.make_opsetid("", OPSET)], ir_version=_IR_VERSION
        )

    def _nodes_behind(self, wanted: set[str]) -> list[Any]:
        """Return the nodes that tensors need, in the order of execution."""
        kept = []
        for node in reversed(self._nodes):
            if wanted & set(node.output):
                kept.append(node)
                wanted |= set(node.input)
        return kept[::-1]

    def _shape(self, number: int) -> tuple[int, ...]:
        """Return the shape of a tensor in ONNX's order."""
        shape = self._graph.tensors[number].shape
        return tuple(shape[k] for k in _NHWC_TO_NCHW) if len(shape) == 4 else shape

    def _fail(self, operator: Operator, problem: str) -> InputError:
        return InputError(f"{self._source}: {operator.kind} {problem} is not supported")

    def _constant(self, operator: Operator, k: int) -> NDArray[Any]:
        """Return the value of an operator's input, which must be a constant."""
        number = operator.inputs[k]
        if number not in self._values:
            raise self._fail(operator, f"with a variable input {k}")
        return self._values[number]

    def _store(self, number: int, name: str, array: NDArray[Any]) -> str:
        """Add a constant of the ONNX graph; return its name."""
        full = f"t{number}_{name}"
        self._arrays[full] = np.asarray(array, order="C")
        return full

    def _emit(
        self, kind: str, operator: Operator, *constants: str, first: int = 1, **attributes: Any
    ) -> None:
        """Add a node with the first `first` inputs of an operator, and its activation."""
        from onnx import helper

        number = operator.outputs[0]
        for k in operator.inputs[:first]:
            if k in self._values:
                raise self._fail(operator, "of a constant")
        activation = operator.options.get("activation", 0)
        if activation not in _ACTIVATIONS:
            raise self._fail(operator, f"with the activation {activation}")
        inputs = [*(self._names[k] for k in operator.inputs[:first]), *constants]
        name = self._names[number]
        raw = f"{name}_raw" if activation else name
        self._nodes.append(helper.make_node(kind, inputs, [raw], **attributes))
        if activation:
            bounds = []
            if _ACTIVATIONS[activation] == "Clip":
                limits = (np.array(0, np.float32), np.array(6, np.float32))
                bounds = [self._store(number, f"limit{k}", at) for k, at in enumerate(limits)]
            self._nodes.append(helper.make_node(_ACTIVATIONS[activation], [raw, *bounds], [name]))

    def _unpack(self, operator: Operator) -> None:
        """Resolve a constant that is stored sparse or as float16."""
        value = self._constant(operator, 0)
        if operator.kind == "DEQUANTIZE":
            if value.dtype != np.float16:
                raise self._fail(operator, f"of {value.dtype}")
            value = value.astype(np.float32)
        self._values[operator.outputs[0]] = value

    def _add_sum(self, operator: Operator) -> None:
        shapes = {self._graph.tensors[k].shape for k in operator.inputs}
        if len(shapes) != 1:
            raise self._fail(operator, f"of the shapes {shapes}")
        self._emit("Add", operator, first=2)

    def _add_concatenation(self, operator: Operator) -> None:
        number = operator.inputs[0]
        rank = len(self._graph.tensors[number].shape)
        axis = operator.options["axis"] % rank
        if rank == 4:
            axis = _NHWC_TO_NCHW.index(axis)
        self._emit("Concat", operator, first=len(operator.inputs), axis=axis)

    def _add_convolution(self, operator: Operator) -> None:
        weights, bias = self._constant(operator, 1), self._constant(operator, 2)
        channels = self._graph.tensors[operator.inputs[0]].shape[3]
        if operator.kind == "CONV_2D":  # (out, height, width, in)
            group, weights = 1, weights.transpose(0, 3, 1, 2)
        else:  # (1, height, width, out)
            group, weights = channels, weights.transpose(3, 0, 1, 2)
        if weights.shape[1] * group != channels:
            raise self._fail(operator, "in groups")
        number = operator.outputs[0]
        dilations = [operator.options["dilation_h"], operator.options["dilation_w"]]
        kernel = [(size - 1) * d + 1 for size, d in zip(weights.shape[2:], dilations, strict=True)]
        self._emit(
            "Conv",
            operator,
            self._store(number, "weights", weights),
            self._store(number, "bias", bias),
            group=group,
            dilations=dilations,
            **self._window(operator, kernel),
        )

    def _window(self, operator: Operator, kernel: list[int]) -> dict[str, Any]:
        """Return strides and pads of a window of `kernel` pixels, height first."""
        strides = [operator.options["stride_h"], operator.options["stride_w"]]
        missing = [0, 0]
        if operator.options["padding"] == _SAME:
            sizes = self._graph.tensors[operator.inputs[0]].shape[1:3]
            missing = [
                max(0, (-(-size // step) - 1) * step + reach - size)
                for size, step, reach in zip(sizes, strides, kernel, strict=True)
            ]
        before = [total // 2 for total in missing]
        after = [total - half for total, half in zip(missing, before, strict=True)]
        return {"strides": strides, "pads": [*before, *after]}

    def _add_pool(self, operator: Operator) -> None:
        kernel = [operator.options["filter_h"], operator.options["filter_w"]]
        window = self._window(operator, kernel)
        self._emit("MaxPool", operator, kernel_shape=kernel, **window)

    def _add_depth_to_space(self, operator: Operator) -> None:
        size = operator.options["block_size"]
        self._emit("DepthToSpace", operator, blocksize=size, mode="DCR")

    def _add_pad(self, operator: Operator) -> None:
        pads = self._constant(operator, 1)
        if len(pads) != 4:
            raise self._fail(operator, f"of rank {len(pads)}")
        order = pads[list(_NHWC_TO_NCHW)].astype(np.int64)
        self._emit("Pad", operator, self._store(operator.outputs[0], "pads", order.T.ravel()))

    def _add_reshape(self, operator: Operator) -> None:
        from onnx import helper

        source, number = operator.inputs[0], operator.outputs[0]
        shape = self._graph.tensors[number].shape
        if len(shape) == 4:
            raise self._fail(operator, "to rank 4")
        name = self._names[source]
        if len(self._graph.tensors[source].shape) == 4:
            last = f"t{number}_nhwc"
            self._nodes.append(helper.make_node("Transpose", [name], [last], perm=_NCHW_TO_NHWC))
            name = last
        target = self._store(number, "shape", np.array(shape, np.int64))
        self._nodes.append(helper.make_node("Reshape", [name, target], [self._names[number]]))

    def _add_resize(self, operator: Operator) -> None:
        number = operator.outputs[0]
        mode = "asymmetric"
        if operator.options["align_corners"]:
            mode = "align_corners"
        elif operator.options["half_pixel_centers"]:
            mode = "half_pixel"
        sizes = self._store(number, "sizes", np.array(self._shape(number), np.int64))
        self._emit(
            "Resize",
            operator,
            "",
            "",
            sizes,
            mode="linear",
            coordinate_transformation_mode=mode,
        )
