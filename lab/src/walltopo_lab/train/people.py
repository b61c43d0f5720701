"""Makes the network that finds people from YOLOX-Nano as its authors export it.

    python -m walltopo_lab.train.people yolox_nano.onnx src/walltopo/models/people.onnx

Of COCO's 80 classes people remain, for pictures of any size whose sides are multiples of 32.
Nothing is trained here.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from walltopo_lab.onnx_file import label_export, save_model

_FACTS = {"license": "Apache-2.0", "source": "YOLOX-Nano by Megvii, trained on COCO"}
_VALUES = 6  # of a cell: place, size, whether an object is there, whether it is a person


def keep_person_class(model: Any) -> Any:
    """Return an `onnx.ModelProto` of YOLOX with COCO's first class, for pictures of any size."""
    from onnx import numpy_helper

    for initializer in model.graph.initializer:
        if ".cls_preds." in initializer.name:
            person = numpy_helper.to_array(initializer)[:1]
            initializer.CopyFrom(numpy_helper.from_array(person, initializer.name))
    pictures, found = (
        value.type.tensor_type.shape.dim for value in (model.graph.input[0], model.graph.output[0])
    )
    pictures[2].dim_param, pictures[3].dim_param = "height", "width"
    found[1].dim_param, found[2].dim_value = "cells", _VALUES
    return model


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the network with float16 weights."""
    import onnx

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("weights", type=Path)
    parser.add_argument("out", type=Path)
    args = parser.parse_args(arguments)
    model = keep_person_class(onnx.load(args.weights))
    label_export(model, _FACTS)
    save_model(model, args.out)
    return 0


if __name__ == "__main__":
    sys.exit(main())
