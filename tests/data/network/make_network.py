"""Trains the small range-view network of this folder on simulated drives and writes it as ONNX.

    cargo build --release
    pip install -r tests/data/network/requirements.txt
    python tests/data/network/make_network.py --out tests/data/network --cache /tmp/drives

Writes `network.onnx` and `network.yaml` into the folder of --out and prints the IoU of each class
on the validation drives; with --validate only prints them, for the network in --out. On two shared
cores of a server (AMD EPYC) it takes 6 minutes to simulate the drives, which --cache keeps in 1.4
GB (delete it after a change of what is simulated), 26 minutes to train and 1 to validate. The same
versions on the same machine train the same network from the same --seed (checked over 20 steps).

Drives are simulated with `divmerge simulate`: seeds from 1001 for training, from 2001 for
validation, one frame each. Seeds below 1001 are for tests and never used here.

The network is a small U-net. Images shrink along the width by 2, 4 and 8, along the height by 2 at
the last step alone, so that the width has to be a multiple of 8 and the height of 2. Its weights
are standardised while training (each filter less its mean, by its standard deviation, times a
gain), which takes the place of batch normalisation and is gone once the weights are written.
"""

import argparse
import functools
import multiprocessing
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "tests" / "python"))
import range_view  # noqa: E402

HEIGHT, WIDTH, FOV_UP, FOV_DOWN = 64, 1024, 3.0, -25.0
SCENES = ["street", "parking", "crowd", "hills", "yard"]
# Drives by sensor and scene.
TRAINING = {
    "hdl-64e": {"street": 400, "parking": 120, "crowd": 200, "hills": 120, "yard": 100},
    "hdl-32e": {"street": 40, "parking": 15, "crowd": 20, "hills": 15, "yard": 15},
    "os1-128": {"street": 40, "parking": 15, "crowd": 20, "hills": 15, "yard": 15},
    "vlp-16": {"street": 30, "parking": 10, "crowd": 15, "hills": 10, "yard": 10},
}
VALIDATION = {
    "hdl-64e": dict.fromkeys(SCENES, 10),
    "hdl-32e": dict.fromkeys(SCENES, 3),
    "os1-128": dict.fromkeys(SCENES, 3),
    "vlp-16": dict.fromkeys(SCENES, 3),
}
# SemanticKITTI's raw ids: name and the network's class.
RAW = {
    0: ("unlabeled", 0),
    1: ("outlier", 0),
    10: ("car", 1),
    11: ("bicycle", 3),
    13: ("bus", 2),
    15: ("motorcycle", 3),
    16: ("on-rails", 2),
    18: ("truck", 2),
    20: ("other-vehicle", 2),
    30: ("person", 4),
    31: ("bicyclist", 5),
    32: ("motorcyclist", 5),
    40: ("road", 6),
    44: ("parking", 6),
    48: ("sidewalk", 6),
    49: ("other-ground", 6),
    50: ("building", 7),
    51: ("fence", 7),
    52: ("other-structure", 7),
    60: ("lane-marking", 6),
    70: ("vegetation", 8),
    71: ("trunk", 8),
    72: ("terrain", 6),
    80: ("pole", 9),
    81: ("traffic-sign", 9),
    99: ("other-object", 0),
    252: ("moving-car", 1),
    253: ("moving-bicyclist", 5),
    254: ("moving-person", 4),
    255: ("moving-motorcyclist", 5),
    256: ("moving-on-rails", 2),
    257: ("moving-bus", 2),
    258: ("moving-truck", 2),
    259: ("moving-other-vehicle", 2),
}
CLASSES = 10
# The raw id that stands for each class.
INVERSE = {0: 0, 1: 10, 2: 18, 3: 11, 4: 30, 5: 31, 6: 40, 7: 50, 8: 70, 9: 80}
THINGS = range(1, 6)


def configuration(means, stds):
    """What network.yaml holds."""
    sensor = {
        "name": "simulated",
        "type": "spherical",
        "fov_up": FOV_UP,
        "fov_down": FOV_DOWN,
        "img_prop": {"width": WIDTH, "height": HEIGHT},
        "img_means": [round(float(mean), 4) for mean in means],
        "img_stds": [round(float(std), 4) for std in stds],
    }
    params = {"knn": 5, "search": 5, "sigma": 1.0, "cutoff": 1.0}
    return {
        "backbone": {"input_depth": {"range": True, "xyz": True, "remission": True}},
        "dataset": {"sensor": sensor},
        "post": {"KNN": {"use": True, "params": params}},
        "labels": {raw: name for raw, (name, _) in RAW.items()},
        "learning_map": {raw: number for raw, (_, number) in RAW.items()},
        "learning_map_inv": INVERSE,
        "learning_ignore": {number: number == 0 for number in range(CLASSES)},
        "thing_class": {number: number in THINGS for number in range(CLASSES)},
    }


# Data


def drives(plan, first_seed):
    """(sensor, scene, seed) of every drive; no two share a seed's number within a scene."""
    listed = []
    for scene in SCENES:
        seed = first_seed
        for sensor, counts in plan.items():
            listed += [(sensor, scene, seed + i) for i in range(counts[scene])]
            seed += counts[scene]
    return listed


def simulate(binary, drive, path):
    sensor, scene, seed = drive
    command = [binary, "simulate", "--sensor", sensor, "--scene", scene, "--frames", 1]
    command += ["--seed", seed, "--force", "-o", path]
    subprocess.run(list(map(str, command)), check=True, stdout=subprocess.DEVNULL)


def image(binary, drive):
    """The (x, y, z, remission) image of a drive's frame and its classes; 255 where it is empty."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "drive.mcap"
        simulate(binary, drive, path)
        (cloud,) = range_view.clouds(path)
    fields = (cloud[name] for name in ("x", "y", "z", "intensity"))
    channels, mask, index, _, _ = range_view.project(*fields, HEIGHT, WIDTH, FOV_UP, FOV_DOWN)
    classes = np.full(mask.shape, 255, np.uint8)
    classes[mask] = range_view.truth(cloud, configuration([], []))[index[mask]]
    return channels[1:].astype(np.float32), classes


def training_images(binary, cache):
    """All images of the training drives, from the cache where they are there."""
    channels_file, classes_file = cache / "channels.npy", cache / "classes.npy"
    if not classes_file.exists():
        listed = drives(TRAINING, 1001)
        channels = np.empty((len(listed), 4, HEIGHT, WIDTH), np.float32)
        classes = np.empty((len(listed), HEIGHT, WIDTH), np.uint8)
        with multiprocessing.get_context("spawn").Pool(2) as pool:
            work = pool.imap(functools.partial(image, binary), listed, chunksize=4)
            for i, one in enumerate(work):
                channels[i], classes[i] = one
        np.save(channels_file, channels)
        np.save(classes_file, classes)
    return np.load(channels_file), np.load(classes_file)


def statistics(channels, classes):
    """Mean and standard deviation of range, x, y, z and remission over all points."""
    sums, squares, count = np.zeros(5), np.zeros(5), 0
    for one, of_class in zip(channels, classes, strict=True):
        points = one[:, of_class != 255].astype(np.float64)
        points = np.vstack([np.sqrt((points[:3] ** 2).sum(0)), points])
        sums += points.sum(1)
        squares += (points**2).sum(1)
        count += points.shape[1]
    means = sums / count
    return means, np.sqrt(squares / count - means**2)


def augmented(rng, channels, classes, means, stds, width):
    """A random piece of an image, `width` columns wide, changed as another drive might look.

    Half of the pieces hold a random point of a class that is chosen from those there, so that rare
    ones are seen often. Half are turned about the vertical, half mirrored; the sensor is raised or
    lowered by decimetres, returns are lost (at times whole rows of them) and remissions scaled and
    blurred.
    """
    shift = int(rng.integers(WIDTH))
    if rng.random() < 0.5:
        wanted = rng.choice(np.setdiff1d(np.unique(classes), [0, 255]))
        middle = rng.choice(np.nonzero(classes == wanted)[1])
        shift = int(middle - rng.integers(width)) % WIDTH
    columns = (np.arange(width) + shift) % WIDTH
    if rng.random() < 0.5:
        columns = columns[::-1]
        mirror = -1
    else:
        mirror = 1
    x, y, z, remission = channels[:, :, columns]
    classes = classes[:, columns]
    place = shift if rng.random() < 0.5 else int(rng.integers(WIDTH))
    turn = (shift - place) * 2 * np.pi / WIDTH
    x, y = np.cos(turn) * x - np.sin(turn) * y, np.sin(turn) * x + np.cos(turn) * y
    y = mirror * y
    filled = classes != 255
    z = z + np.float32(rng.uniform(-0.2, 0.2))
    blur = rng.normal(0, 0.02, remission.shape).astype(np.float32)
    remission = np.clip(remission * rng.uniform(0.7, 1.3) + blur, 0, 1)
    kept = filled & (rng.random(filled.shape, np.float32) >= rng.uniform(0, 0.15))
    if rng.random() < 0.2:
        kept[rng.random(HEIGHT) < rng.uniform(0, 0.6)] = False
    stacked = np.stack([np.sqrt(x * x + y * y + z * z), x, y, z, remission])
    stacked = range_view.normalise(stacked, kept, means, stds).astype(np.float32)
    target = np.where(kept, classes, 0)
    return stacked.transpose(1, 2, 0), target


# Network: name, kind, channels in, channels out, kernel, stride, dilation.

LAYERS = [
    ("enter", "conv", 5, 12, (3, 3), (1, 1), (1, 1)),
    ("down1", "conv", 12, 24, (3, 3), (1, 2), (1, 1)),
    ("left1", "conv", 24, 24, (3, 3), (1, 1), (1, 1)),
    ("down2", "conv", 24, 32, (3, 3), (1, 2), (1, 1)),
    ("left2", "conv", 32, 32, (3, 3), (1, 1), (1, 1)),
    ("down3", "conv", 32, 44, (3, 3), (2, 2), (1, 1)),
    ("deep1", "conv", 44, 44, (3, 3), (1, 1), (2, 2)),
    ("deep2", "conv", 44, 44, (3, 3), (1, 1), (4, 4)),
    ("up2", "transposed", 44, 32, (2, 2), (2, 2), (1, 1)),
    ("right2", "conv", 32, 32, (3, 3), (1, 1), (1, 1)),
    ("up1", "transposed", 32, 24, (1, 2), (1, 2), (1, 1)),
    ("right1", "conv", 24, 24, (3, 3), (1, 1), (1, 1)),
    ("up0", "transposed", 24, 12, (1, 2), (1, 2), (1, 1)),
    ("right0", "conv", 12, 12, (3, 3), (1, 1), (1, 1)),
    ("leave", "conv", 12, CLASSES - 1, (1, 1), (1, 1), (1, 1)),
]


def run_layers(layer, relu, add, data):
    """The network over any kind of tensor: `layer(name, data)`, `relu(data)` and `add(a, b)`."""
    enter = relu(layer("enter", data))
    half = relu(layer("down1", enter))
    half = add(half, relu(layer("left1", half)))
    quarter = relu(layer("down2", half))
    quarter = add(quarter, relu(layer("left2", quarter)))
    deep = relu(layer("down3", quarter))
    deep = add(deep, relu(layer("deep1", deep)))
    deep = add(deep, relu(layer("deep2", deep)))
    right = relu(add(layer("up2", deep), quarter))
    right = add(right, relu(layer("right2", right)))
    right = relu(add(layer("up1", right), half))
    right = add(right, relu(layer("right1", right)))
    right = relu(add(layer("up0", right), enter))
    right = add(right, relu(layer("right0", right)))
    return layer("leave", right)


def initial(rng):
    """Weights as (height, width, in, out), a gain and a bias for each output channel."""
    parameters = {}
    for name, _, inside, outside, kernel, _, _ in LAYERS:
        gain = 0.5 if name == "leave" else 1.0
        parameters[name] = {
            "weights": rng.normal(0, 0.25, (*kernel, inside, outside)).astype(np.float32),
            "gain": np.full(outside, gain, np.float32),
            "bias": np.zeros(outside, np.float32),
        }
    return parameters


def plain_weights(np_like, name, kind, parameters):
    """The standardised weights of a layer, as they act."""
    weights = parameters[name]["weights"]
    # Each place of a transposed convolution's kernel writes its own output and is its own filter.
    axes = (2,) if kind == "transposed" else (0, 1, 2)
    mean = weights.mean(axes, keepdims=True)
    fan_in = 1
    for axis in axes:
        fan_in *= weights.shape[axis]
    spread = np_like.sqrt(((weights - mean) ** 2).mean(axes, keepdims=True) * fan_in + 1e-6)
    return (weights - mean) / spread * (1.4 * parameters[name]["gain"])


def forward(parameters, data):
    """Scores before the softmax for classes 1 and up, (batch, height, width, classes - 1)."""
    import jax
    import jax.numpy as jnp

    by_name = {line[0]: line for line in LAYERS}

    def layer(name, data):
        _, kind, inside, outside, kernel, stride, dilation = by_name[name]
        weights = plain_weights(jnp, name, kind, parameters)
        if kind == "transposed":
            # Kernel and stride are equal, so that each pixel becomes a patch by itself.
            batch, height, width, _ = data.shape
            patch = weights.transpose(2, 0, 1, 3).reshape(inside, -1)
            data = (data @ patch).reshape(batch, height, width, *stride, outside)
            data = data.transpose(0, 1, 3, 2, 4, 5)
            data = data.reshape(batch, height * stride[0], width * stride[1], outside)
        else:
            pads = [(d * (k // 2),) * 2 for d, k in zip(dilation, kernel, strict=True)]
            data = jax.lax.conv_general_dilated(
                data, weights, stride, pads, rhs_dilation=dilation,
                dimension_numbers=("NHWC", "HWIO", "NHWC"),
            )
        return data + parameters[name]["bias"]

    return run_layers(layer, jax.nn.relu, lambda a, b: a + b, data)


def train(channels, classes, means, stds, arguments, save):
    """The trained weights; `save` is called with those so far after each epoch."""
    import jax
    import jax.numpy as jnp

    rng = np.random.default_rng(arguments.seed)
    # Rare classes weigh more in the loss, or they would not be learnt; the scores are then too high
    # for them. Half of that, in logarithms, is taken back at the end.
    counts = np.bincount(classes.ravel(), minlength=256)[:CLASSES].astype(float)
    share = counts[1:] / counts[1:].sum()
    weights = np.sqrt(1 / np.maximum(share, 1e-4))
    weights = jnp.asarray(weights / (weights * share).sum(), jnp.float32)
    print("share of the points:", " ".join(f"{100 * part:.2f}%" for part in share))

    def loss(parameters, data, target):
        logs = jax.nn.log_softmax(forward(parameters, data))
        wanted = jax.nn.one_hot(target.astype(jnp.int32) - 1, CLASSES - 1)  # class 0: all zeros
        each = wanted * weights
        return -(each * logs).sum() / each.sum()

    @jax.jit
    def step(parameters, first, second, number, rate, data, target):
        """Adam."""
        value, slope = jax.value_and_grad(loss)(parameters, data, target)
        tree = jax.tree_util.tree_map
        first = tree(lambda m, g: 0.9 * m + 0.1 * g, first, slope)
        second = tree(lambda v, g: 0.99 * v + 0.01 * g * g, second, slope)
        by_first, by_second = rate / (1 - 0.9**number), 1 / (1 - 0.99**number)
        parameters = tree(
            lambda p, m, v: p - by_first * m / (jnp.sqrt(v * by_second) + 1e-8),
            parameters, first, second,
        )
        return parameters, first, second, value

    parameters = initial(rng)
    first = jax.tree_util.tree_map(np.zeros_like, parameters)
    second = jax.tree_util.tree_map(np.zeros_like, parameters)
    batch, width = 4, 256
    steps = len(channels) // batch
    total = steps * arguments.epochs
    number = 0
    for epoch in range(arguments.epochs):
        started, losses = time.monotonic(), []
        order = rng.permutation(len(channels))
        for chosen in order[: steps * batch].reshape(steps, batch):
            pieces = [augmented(rng, channels[i], classes[i], means, stds, width) for i in chosen]
            data, target = (np.stack(part) for part in zip(*pieces, strict=True))
            number += 1
            warm = min(1, number / 100)
            rate = arguments.rate * warm * 0.5 * (1 + np.cos(np.pi * number / total))
            parameters, first, second, value = step(
                parameters, first, second, np.float32(number), np.float32(rate), data, target
            )
            losses.append(value)
        seconds = time.monotonic() - started
        print(f"epoch {epoch + 1}: loss {np.mean(losses):.4f}, {seconds:.0f} s", flush=True)
        plain = jax.tree_util.tree_map(np.asarray, parameters)
        plain["leave"]["bias"] = plain["leave"]["bias"] - 0.5 * np.log(np.asarray(weights))
        save(plain)
    return plain


# Export


def export(parameters, path):
    """Write the network with a softmax and a class 0 that is never likely."""
    import onnx
    from onnx import TensorProto, helper, numpy_helper

    by_name = {line[0]: line for line in LAYERS}
    nodes, constants = [], []

    def node(kind, inputs, **attributes):
        name = f"{kind.lower()}_{len(nodes)}"
        nodes.append(helper.make_node(kind, inputs, [name], name=name, **attributes))
        return name

    def layer(name, data):
        _, kind, _, _, kernel, stride, dilation = by_name[name]
        weights = plain_weights(np, name, kind, parameters)
        bias = parameters[name]["bias"]
        if name == "leave":
            weights = np.pad(weights, ((0, 0), (0, 0), (0, 0), (1, 0)))
            bias = np.pad(bias, (1, 0), constant_values=-1000)
        order = (2, 3, 0, 1) if kind == "transposed" else (3, 2, 0, 1)
        for suffix, values in (("weights", weights.transpose(order)), ("bias", bias)):
            values = np.ascontiguousarray(values, np.float32)
            constants.append(numpy_helper.from_array(values, f"{name}_{suffix}"))
        attributes = {"kernel_shape": kernel, "strides": stride}
        if kind == "conv":
            half = [d * (k // 2) for d, k in zip(dilation, kernel, strict=True)]
            attributes |= {"dilations": dilation, "pads": half + half}
        inputs = [data, f"{name}_weights", f"{name}_bias"]
        return node("ConvTranspose" if kind == "transposed" else "Conv", inputs, **attributes)

    scores = run_layers(
        layer, lambda a: node("Relu", [a]), lambda a, b: node("Add", [a, b]), "input"
    )
    nodes.append(helper.make_node("Softmax", [scores], ["scores"], name="softmax", axis=1))

    def tensor(name, channels):
        shape = ["batch", channels, "height", "width"]
        return helper.make_tensor_value_info(name, TensorProto.FLOAT, shape)

    graph = helper.make_graph(
        nodes, "range_view", [tensor("input", 5)], [tensor("scores", CLASSES)], constants
    )
    model = helper.make_model(
        graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8, producer_name="divmerge"
    )
    onnx.checker.check_model(model, full_check=True)
    onnx.save(model, path)


def check(parameters, path):
    """The largest difference between the network here and in onnxruntime."""
    import jax
    import onnxruntime

    session = onnxruntime.InferenceSession(path, providers=["CPUExecutionProvider"])
    worst = 0.0
    for shape in ((1, 5, 64, 1024), (2, 5, 32, 256)):
        data = np.random.default_rng(0).normal(0, 1, shape).astype(np.float32)
        here = jax.nn.softmax(forward(parameters, data.transpose(0, 2, 3, 1)))
        there = session.run(None, {"input": data})[0].transpose(0, 2, 3, 1)
        worst = max(worst, float(np.abs(here - there[..., 1:]).max()), float(there[..., 0].max()))
    return worst


# Validation


def validate(binary, out, cache):
    """Print the IoU of each class over the points of the validation drives."""
    session, config = range_view.load(out / "network.onnx", out / "network.yaml")
    names = [RAW[INVERSE[number]][0] for number in range(CLASSES)]
    tables = {}
    for drive in drives(VALIDATION, 2001):
        path = cache / "-".join(map(str, (*drive, "validation.mcap")))
        if not path.exists():
            simulate(binary, drive, path)
        (cloud,) = range_view.clouds(path)
        fields = (cloud[name] for name in ("x", "y", "z", "intensity"))
        alone, voted = range_view.segment(session, config, *fields)
        true = range_view.truth(cloud, config)
        sensor, scene, _ = drive
        group = f"{sensor} {scene if sensor == 'hdl-64e' else 'all'}"
        table = tables.setdefault(group, np.zeros((2, CLASSES, CLASSES), np.int64))
        table += [range_view.confusion(true, found, CLASSES) for found in (alone, voted)]
    print("IoU over points in %, after the vote; last, their mean before it")
    print(f"{'':17}{'mean':>8}", *(f"{name[:8]:>9}" for name in names[1:]), f"{'before':>9}")
    for group, (alone, voted) in tables.items():
        each = 100 * range_view.ious(voted)
        before = 100 * np.nanmean(range_view.ious(alone))
        cells = [*(f"{value:9.1f}" for value in each), f"{before:9.1f}"]
        print(f"{group:17}{np.nanmean(each):8.1f}", *cells)


def main():
    parser = argparse.ArgumentParser(description="Trains the small range-view network.")
    parser.add_argument("--out", type=Path, default=Path(__file__).parent, help="folder")
    parser.add_argument("--seed", type=int, default=1, help="of the weights and the augmentation")
    parser.add_argument("--epochs", type=int, default=20, help="a quarter image of each drive each")
    parser.add_argument("--rate", type=float, default=8e-3, help="highest learning rate")
    parser.add_argument("--cache", type=Path, default=Path("/tmp/divmerge-network"), help="drives")
    parser.add_argument("--binary", type=Path, default=ROOT / "target" / "release" / "divmerge")
    parser.add_argument("--validate", action="store_true", help="do not train")
    arguments = parser.parse_args()
    import yaml

    for folder in (arguments.out, arguments.cache):
        folder.mkdir(parents=True, exist_ok=True)
    if arguments.validate:
        validate(arguments.binary, arguments.out, arguments.cache)
        return
    started = time.monotonic()
    channels, classes = training_images(arguments.binary, arguments.cache)
    print(f"{len(channels)} training images, {time.monotonic() - started:.0f} s", flush=True)
    means, stds = statistics(channels, classes)
    config = configuration(means, stds)
    text = "# Written by make_network.py: the network's input, post-processing and classes.\n"
    text += yaml.safe_dump(config, sort_keys=False, default_flow_style=None)
    (arguments.out / "network.yaml").write_text(text, encoding="utf-8")
    means, stds = (config["dataset"]["sensor"][key] for key in ("img_means", "img_stds"))
    path = arguments.out / "network.onnx"
    started = time.monotonic()
    parameters = train(
        channels, classes, means, stds, arguments, lambda parameters: export(parameters, path)
    )
    print(f"trained in {time.monotonic() - started:.0f} s; {path.stat().st_size} bytes")
    print(f"largest difference from onnxruntime: {check(parameters, path):.1e}")
    validate(arguments.binary, arguments.out, arguments.cache)


if __name__ == "__main__":
    main()
