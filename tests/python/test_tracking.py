"""HOTA and occlusions of `divmerge evaluate --over-time` against their definitions, written down with numpy.

HOTA: Luiten et al. 2021 and the evaluation of its authors (TrackEval), with the IoU of points as similarity.
"""

import json
import subprocess

import numpy as np
import pytest

from test_evaluate import CLASS_OF, THINGS, write
from test_independent_readers import BINARY

CAR, PERSON, ROAD, UNLABELED = 10, 30, 40, 0


def random_drive(rng, frames):
    """Objects that come and go, under ids that change, in pieces and together; spurious ids on the road."""
    scans, found_as = [], {}
    for _ in range(frames):
        truth, found = [], []
        for number in range(1, 15):
            if rng.random() < 0.2:
                continue
            if number not in found_as or rng.random() < 0.1:
                found_as[number] = rng.integers(1, 25)
            points = rng.integers(1, 90)
            ids = np.full(points, found_as[number])
            ids[:rng.integers(0, points + 1) if rng.random() < 0.4 else 0] = rng.integers(0, 25)
            truth.append(np.full(points, (CAR if number % 2 else PERSON) | number << 16))
            found.append((CAR if number % 2 else PERSON) | ids << 16)
        for raw, instance in [(ROAD, 0), (UNLABELED, 3), (CAR, 0)]:
            points = rng.integers(1, 60)
            truth.append(np.full(points, raw | instance << 16))
            found.append(np.full(points, CAR | rng.integers(0, 30) << 16))
        scans.append((np.concatenate(truth), np.concatenate(found)))
    return scans


def assign(weights):
    """By row its column: the sum is largest, over subsets of columns one row after the other."""
    rows, columns = weights.shape
    best = {0: (0.0, [])}
    for row in range(rows):
        following = {}
        for taken, (total, chosen) in best.items():
            free = [c for c in range(columns) if not taken >> c & 1 and weights[row, c] > 0]
            for column in [*free, None]:
                now = taken if column is None else taken | 1 << column
                gain = 0.0 if column is None else weights[row, column]
                if now not in following or following[now][0] < total + gain:
                    following[now] = (total + gain, [*chosen, column])
        best = following
    return max(best.values(), key=lambda entry: entry[0])[1]


def similarities(truth, found, min_points):
    """Ids of objects and of found instances of a frame, and the IoU of each with each."""
    of_truth = np.array([CLASS_OF[raw] for raw in truth & 0xffff])
    is_thing = np.isin(of_truth, THINGS)
    objects, sizes = np.unique(truth[is_thing & (truth >> 16 != 0)], return_counts=True)
    small = objects[sizes <= min_points]
    left_out = (of_truth == 0) | (is_thing & (truth >> 16 == 0)) | np.isin(truth, small)
    truth, ids, is_thing = truth[~left_out], found[~left_out] >> 16, is_thing[~left_out]
    instances, sizes = np.unique(ids[ids != 0], return_counts=True)
    instances, objects = instances[sizes > min_points], np.setdiff1d(objects, small)
    iou = np.zeros((len(objects), len(instances)))
    for i, one in enumerate(objects):
        for j, other in enumerate(instances):
            mine, its = is_thing & (truth == one), ids == other
            iou[i, j] = np.sum(mine & its) / np.sum(mine | its)
    return objects, instances, iou


def hota(sequences, min_points):
    thresholds = np.arange(1, 20) * 0.05
    tp, association, objects_seen, found_seen = (np.zeros(19) for _ in range(4))
    for scans in sequences:
        frames = [similarities(truth, found, min_points) for truth, found in scans]
        of_object, of_found, both = np.zeros(1 << 22), np.zeros(64), {}
        for objects, instances, iou in frames:
            of_object[objects] += 1
            of_found[instances] += 1
            either = iou.sum(axis=1, keepdims=True) + iou.sum(axis=0, keepdims=True) - iou
            for i, j in zip(*np.nonzero(iou)):
                pair = objects[i], instances[j]
                both[pair] = both.get(pair, 0.0) + iou[i, j] / either[i, j]
        pairs = []
        for objects, instances, iou in frames:
            aligned = np.zeros_like(iou)
            for i, j in zip(*np.nonzero(iou)):
                shared = both[objects[i], instances[j]]
                aligned[i, j] = shared / (of_object[objects[i]] + of_found[instances[j]] - shared)
            for i, j in enumerate(assign(iou * aligned)):
                if j is not None:
                    pairs.append((objects[i], instances[j], iou[i, j]))
        for number, threshold in enumerate(thresholds):
            together = {}
            for one, other, similarity in pairs:
                if similarity >= threshold - np.finfo(float).eps:
                    together[one, other] = together.get((one, other), 0) + 1
            tp[number] += sum(together.values())
            association[number] += sum(
                n * n / (of_object[one] + of_found[other] - n) for (one, other), n in together.items())
        objects_seen += of_object.sum()
        found_seen += of_found.sum()
    det_a = tp / (objects_seen + found_seen - tp)
    ass_a = association / np.maximum(tp, 1)
    return np.mean(np.sqrt(det_a * ass_a)), np.mean(det_a), np.mean(ass_a)


def evaluate(folder, sequences, min_points):
    for name, scans in enumerate(sequences):
        for number, (truth, prediction) in enumerate(scans):
            file = f"{number:06}.label"
            write(folder / "t" / f"sequences/0{name}/labels" / file, truth)
            write(folder / "p" / f"sequences/0{name}/predictions" / file, prediction)
    done = subprocess.run(
        [BINARY, "evaluate", "--truth", folder / "t", "--predictions", folder / "p", "--over-time",
         "--min-points", str(min_points), "--json", folder / "figures.json"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads((folder / "figures.json").read_text()), done.stdout


@pytest.mark.parametrize("seed,min_points", [(1, 1), (2, 10)])
def test_hota_agrees_with_its_definition(tmp_path, seed, min_points):
    rng = np.random.default_rng(seed)
    sequences = [random_drive(rng, 12) for _ in range(2)]
    found = evaluate(tmp_path, sequences, min_points)[0]["hota"]
    expected = hota(sequences, min_points)
    assert 0.1 < expected[0] < 0.9
    assert [found[name] for name in ("hota", "det_a", "ass_a")] == pytest.approx(expected, rel=1e-9)


def test_occlusions_of_two_seconds_are_counted(tmp_path):
    """Three cars are hidden in frames 5 to 24: one keeps its id, one changes it, one is lost; a fourth stays."""
    def scan(number):
        is_hidden = 5 <= number < 25
        after = {2: 9, 3: 0} if number >= 25 else {}
        cars = [car for car in range(1, 5) if car == 4 or not is_hidden]
        words = [np.full(20, CAR | car << 16) for car in cars]
        found = [np.full(20, CAR | after.get(car, car) << 16) for car in cars]
        return np.concatenate(words), np.concatenate(found)

    figures, text = evaluate(tmp_path, [[scan(number) for number in range(40)]], 1)
    assert figures["occlusions"] == {"cases": 3, "found": 2, "kept": 1}
    assert "3 occlusions of two seconds: 2 found before and after, 1 with the same id" in text
