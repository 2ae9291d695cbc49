"""Writes a network of realistic size with fixed random weights, to measure how long one takes.

    python tests/data/network/make_large.py large.onnx

Its answers mean nothing. Its shape is that of SalsaNext (Cortinhal, Tzelepis and Aksoy, "SalsaNext:
Fast, Uncertainty-aware Semantic Segmentation of LiDAR Point Clouds", ISVC 2020): 5 channels of 64 x
2048 in, 20 classes out, any batch; 6.7 million parameters. It prints their number, the
multiply-adds of one image and the file's size. The file is not kept in the project: 27 MB.

In words: three context blocks at full size; five encoder blocks, of which the first four halve the
image; four decoder blocks that double it again by moving channels into pixels and take in what the
encoder had at that size; one 1x1 convolution to the classes. Encoder and decoder blocks run three
convolutions in a row (3x3, 3x3 dilated by 2, 2x2 dilated by 2), put the three results side by side
and mix them with a 1x1 convolution; context and encoder blocks add their input past a 1x1
convolution. A batch normalisation follows every activation except those of these 1x1 convolutions.
Dropout does nothing after training and is left out, as is all that belongs to the estimate of
uncertainty.
"""

import sys
from pathlib import Path

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

HEIGHT, WIDTH, CLASSES, BASE = 64, 2048, 20, 32


class Builder:
    """Collects nodes and weights; tensors are (name, channels, height, width)."""

    def __init__(self):
        self.rng = np.random.default_rng(1)
        self.nodes, self.constants = [], []
        self.parameters, self.multiply_adds = 0, 0

    def node(self, kind, inputs, **attributes):
        name = f"{kind.lower()}_{len(self.nodes)}"
        self.nodes.append(helper.make_node(kind, inputs, [name], name=name, **attributes))
        return name

    def constant(self, values):
        name = f"weights_{len(self.constants)}"
        self.constants.append(numpy_helper.from_array(values.astype(np.float32), name))
        return name

    def conv(self, data, outside, kernel, dilation=1):
        """A convolution that keeps the image's size."""
        name, inside, height, width = data
        shape = (outside, inside, kernel, kernel)
        weights = self.rng.normal(0, (2 / (inside * kernel**2)) ** 0.5, shape)
        self.parameters += weights.size + outside
        self.multiply_adds += weights.size * height * width
        pad = dilation * (kernel - 1) // 2
        found = self.node(
            "Conv",
            [name, self.constant(weights), self.constant(np.zeros(outside))],
            kernel_shape=[kernel] * 2,
            dilations=[dilation] * 2,
            pads=[pad] * 4,
        )
        return found, outside, height, width

    def active(self, data, normalised=True):
        name, channels, height, width = data
        name = self.node("LeakyRelu", [name], alpha=0.01)
        if normalised:
            self.parameters += 2 * channels
            values = [np.ones(channels), np.zeros(channels)] * 2
            values[2:] = [np.full(channels, 0.1), np.full(channels, 1.0)]
            constants = [self.constant(value) for value in values]
            name = self.node("BatchNormalization", [name, *constants], epsilon=1e-5)
        return name, channels, height, width

    def add(self, one, other):
        return self.node("Add", [one[0], other[0]]), *one[1:]

    def concat(self, *parts):
        name = self.node("Concat", [part[0] for part in parts], axis=1)
        return name, sum(part[1] for part in parts), *parts[0][2:]

    def context(self, data, outside):
        """Two 3x3 convolutions, the second dilated, around a 1x1 one past them."""
        past = self.active(self.conv(data, outside, 1), normalised=False)
        first = self.active(self.conv(past, outside, 3))
        second = self.active(self.conv(first, outside, 3, 2))
        return self.add(past, second)

    def mixed(self, data, outside):
        """Three convolutions in a row, their results side by side, mixed."""
        first = self.active(self.conv(data, outside, 3))
        second = self.active(self.conv(first, outside, 3, 2))
        third = self.active(self.conv(second, outside, 2, 2))
        return self.active(self.conv(self.concat(first, second, third), outside, 1))

    def encoder(self, data, outside):
        past = self.active(self.conv(data, outside, 1), normalised=False)
        return self.add(past, self.mixed(data, outside))

    def halved(self, data):
        name, channels, height, width = data
        shape = {"kernel_shape": [3, 3], "strides": [2, 2], "pads": [1] * 4}
        name = self.node("AveragePool", [name], count_include_pad=1, **shape)
        return name, channels, height // 2, width // 2

    def decoder(self, data, beside, outside):
        name, channels, height, width = data
        name = self.node("DepthToSpace", [name], blocksize=2, mode="CRD")
        doubled = (name, channels // 4, height * 2, width * 2)
        return self.mixed(self.concat(doubled, beside), outside)


def build():
    builder = Builder()
    data = ("input", 5, HEIGHT, WIDTH)
    for _ in range(3):
        data = builder.context(data, BASE)
    beside = []
    for times in (2, 4, 8, 8):
        beside.append(builder.encoder(data, times * BASE))
        data = builder.halved(beside[-1])
    data = builder.encoder(data, 8 * BASE)
    for times in (4, 4, 2, 1):
        data = builder.decoder(data, beside.pop(), times * BASE)
    data = builder.conv(data, CLASSES, 1)
    builder.nodes.append(helper.make_node("Softmax", [data[0]], ["scores"], "softmax", axis=1))

    def tensor(name, channels):
        shape = ["batch", channels, HEIGHT, WIDTH]
        return helper.make_tensor_value_info(name, TensorProto.FLOAT, shape)

    graph = helper.make_graph(
        builder.nodes, "large", [tensor("input", 5)], [tensor("scores", CLASSES)],
        builder.constants,
    )
    model = helper.make_model(
        graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8, producer_name="divmerge"
    )
    onnx.checker.check_model(model, full_check=True)
    return model, builder


def main():
    model, builder = build()
    path = Path(sys.argv[1])
    onnx.save(model, path)
    print(f"{builder.parameters:,} parameters")
    print(f"{builder.multiply_adds / 1e9:.1f} G multiply-adds an image of {HEIGHT} x {WIDTH}")
    print(f"{path.stat().st_size:,} bytes")


if __name__ == "__main__":
    main()
