"""The range-view pipeline of RangeNet++ in numpy: a reference to hold divmerge's own against.

Written from the published description (Milioto, Vizzo, Behley and Stachniss, "RangeNet++: Fast and
Accurate LiDAR Semantic Segmentation", IROS 2019): a spherical projection, a network on the image,
and a vote of each point's neighbours in the image.

    python tests/python/range_view.py MODEL.onnx CONFIG.yaml RECORDING.mcap...

prints the IoU of each class over all points of simulated recordings, with and without the vote.
Needs numpy; `clouds` needs mcap and mcap-ros2-support, `load` needs onnxruntime and pyyaml.
"""

import sys

import numpy as np

CLOUD_TYPES = {
    1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8",
}


def project(x, y, z, remission, height, width, fov_up_deg, fov_down_deg):
    """Put points into an image over azimuth and elevation, in float64.

    The first column looks backwards, the middle one ahead (along x), columns go on to the right.
    The first row is at `fov_up_deg`, the last at `fov_down_deg`; points above or below go into
    those rows. Of the points of a pixel the nearest is kept, of equally near ones the first.

    Returns the channels (range, x, y, z, remission) as (5, height, width), 0 where empty; a mask of
    the pixels that have a point; the index of that point (-1 where empty); and each point's row and
    column, -1 for points that are not finite or lie at the origin.
    """
    x, y, z, remission = (np.asarray(a, np.float64) for a in (x, y, z, remission))
    with np.errstate(all="ignore"):
        ranges = np.sqrt(x * x + y * y + z * z)
        valid = np.isfinite(ranges) & (ranges > 0)
        pitch = np.arcsin(np.clip(z / ranges, -1, 1))
    up, down = abs(np.radians(fov_up_deg)), abs(np.radians(fov_down_deg))
    across = 0.5 * (-np.arctan2(y, x) / np.pi + 1) * width
    below = (1 - (pitch + down) / (up + down)) * height
    column = np.full(len(x), -1)
    row = np.full(len(x), -1)
    column[valid] = np.clip(np.floor(across[valid]), 0, width - 1)
    row[valid] = np.clip(np.floor(below[valid]), 0, height - 1)

    index = np.full(height * width, -1)
    # The farthest is written first and the nearest last; the sort is stable, so that after the
    # reversal the first of equally near points comes last.
    order = np.flatnonzero(valid)
    order = order[np.argsort(ranges[order], kind="stable")][::-1]
    index[row[order] * width + column[order]] = order
    mask = index >= 0
    channels = np.zeros((5, height * width))
    channels[:, mask] = np.stack([ranges, x, y, z, remission])[:, index[mask]]
    shape = (height, width)
    return channels.reshape(5, *shape), mask.reshape(shape), index.reshape(shape), row, column


def normalise(channels, mask, means, stds):
    """Each channel less its mean, by its standard deviation; 0 where the image is empty."""
    means, stds = (np.asarray(a, np.float64)[:, None, None] for a in (means, stds))
    return np.where(mask, (channels - means) / stds, 0)


def knn(
    ranges, rows, columns, range_image, mask, class_image, classes,
    k=5, search=5, sigma=1.0, cutoff=1.0,
):
    """A class for each point by a vote of its neighbours in the image.

    The neighbours are the pixels of the `search` by `search` window around the point's own pixel.
    Empty pixels and those outside the image never count; the window does not go round the back. A
    neighbour's distance is the difference between its range and the point's; the pixel in the
    centre has distance 0, whatever its range is, but the class that the image has there. Distances
    are multiplied by 1 - g, with g a Gaussian of `sigma` pixels over the window that sums to 1. The
    `k` smallest of these products are chosen (of equal ones the first in row-major order), and
    those whose product, so the weighted distance, exceeds `cutoff` do not vote. A `cutoff` of 0 or
    less is none.

    The class most voted for among 1 to `classes` - 1 wins, of equal ones the lowest; class 0 has no
    votes and is the answer where there is no other vote, as for points without a pixel.

    RangeNet++'s authors compare the weighted distance in the same way. Unlike here, their window
    holds range 0 outside the image, and without any vote they answer class 1.
    """
    half = search // 2
    offsets = np.arange(search) - half
    gaussian = np.exp(-(offsets[:, None] ** 2 + offsets[None, :] ** 2) / (2 * sigma**2))
    weights = (1 - gaussian / gaussian.sum()).ravel()
    padded = np.pad(np.where(mask, range_image, np.inf), half, constant_values=np.inf)
    padded_classes = np.pad(class_image, half)

    has_pixel = rows >= 0
    down = rows[has_pixel, None] + np.repeat(np.arange(search), search)
    right = columns[has_pixel, None] + np.tile(np.arange(search), search)
    own = np.asarray(ranges, np.float64)[has_pixel, None]
    distances = np.abs(padded[down, right] - own) * weights
    distances[:, half * search + half] = 0
    chosen = np.argsort(distances, axis=1, kind="stable")[:, :k]
    distances = np.take_along_axis(distances, chosen, 1)
    voted = np.take_along_axis(padded_classes[down, right], chosen, 1)
    voted = np.where(np.isfinite(distances), voted, 0)
    if cutoff > 0:
        voted[distances > cutoff] = 0

    votes = np.zeros((len(voted), classes), np.int64)
    np.add.at(votes, (np.arange(len(voted))[:, None], voted), 1)
    votes = votes[:, 1:]
    answer = np.zeros(len(rows), np.int64)
    answer[has_pixel] = np.where(votes.any(1), votes.argmax(1) + 1, 0)
    return answer


def clouds(path):
    """The PointCloud2 messages of a recording, each as a structured array."""
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    with open(path, "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for schema, _, _, message in reader.iter_decoded_messages():
            if not schema.name.endswith("PointCloud2"):
                continue
            layout = {
                "names": [field.name for field in message.fields],
                "formats": [CLOUD_TYPES[field.datatype] for field in message.fields],
                "offsets": [field.offset for field in message.fields],
                "itemsize": message.point_step,
            }
            yield np.frombuffer(bytes(message.data), np.dtype(layout))


def class_table(config):
    """The network's class of each raw id; 0 for ids that the configuration does not know."""
    table = np.zeros(1 << 16, np.int64)
    for raw, number in config["learning_map"].items():
        table[raw] = number
    return table


def truth(cloud, config):
    """The network's class of each point, by the cloud's `label`."""
    return class_table(config)[cloud["label"].astype(np.int64) & 0xFFFF]


def load(model, configuration):
    """A session of onnxruntime and the configuration."""
    import onnxruntime
    import yaml

    with open(configuration, encoding="utf-8") as file:
        config = yaml.safe_load(file)
    return onnxruntime.InferenceSession(model, providers=["CPUExecutionProvider"]), config


def segment(session, config, x, y, z, remission):
    """The class of each point: by its pixel alone, and by the vote of its neighbours."""
    sensor = config["dataset"]["sensor"]
    size = sensor["img_prop"]
    channels, mask, _, rows, columns = project(
        x, y, z, remission, size["height"], size["width"], sensor["fov_up"], sensor["fov_down"]
    )
    image = normalise(channels, mask, sensor["img_means"], sensor["img_stds"])
    feed = {session.get_inputs()[0].name: image[None].astype(np.float32)}
    scores = session.run(None, feed)[0][0]
    best = scores.argmax(0)
    alone = np.where(rows >= 0, best[rows, columns], 0)
    x, y, z = (np.asarray(a, np.float64) for a in (x, y, z))
    ranges = np.sqrt(x * x + y * y + z * z)
    params = config["post"]["KNN"]["params"]
    voted = knn(
        ranges, rows, columns, channels[0], mask, best, len(scores),
        params["knn"], params["search"], params["sigma"], params["cutoff"],
    )
    return alone, voted


def confusion(true, found, classes):
    """Points by true class (rows) and found class (columns); those of true class 0 are left out."""
    counted = true > 0
    pairs = true[counted] * classes + found[counted]
    return np.bincount(pairs, minlength=classes * classes).reshape(classes, classes)


def ious(table):
    """The IoU of each class from 1 on; NaN for classes that no point truly has."""
    hits = np.diag(table).astype(np.float64)
    union = table.sum(0) + table.sum(1) - hits
    return np.where(table.any(1), hits / np.maximum(union, 1), np.nan)[1:]


def main():
    session, config = load(sys.argv[1], sys.argv[2])
    inverse = config["learning_map_inv"]
    names = [config["labels"][inverse[number]] for number in sorted(inverse)]
    tables = np.zeros((2, len(names), len(names)), np.int64)
    for path in sys.argv[3:]:
        for cloud in clouds(path):
            true = truth(cloud, config)
            found = segment(session, config, *(cloud[f] for f in ("x", "y", "z", "intensity")))
            tables += [confusion(true, one, len(names)) for one in found]
    print(f"{'IoU over points, %':20}{'pixel':>8}{'vote':>8}")
    alone, voted = (100 * ious(table) for table in tables)
    for name, one, other in zip(names[1:], alone, voted, strict=True):
        print(f"{name:20}{one:8.1f}{other:8.1f}")
    print(f"{'mean':20}{np.nanmean(alone):8.1f}{np.nanmean(voted):8.1f}")


if __name__ == "__main__":
    main()
