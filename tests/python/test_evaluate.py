"""The figures of `divmerge evaluate` against the published rules, written down here with numpy.

Rules: semantic-kitti-api's panoptic evaluation (Behley et al. 2020). Sums are numpy's own, so the digits have to
agree to the last one. LSTQ: 4D Panoptic LiDAR Segmentation (Aygün et al. 2021) and the facts of its authors'
evaluation, but for rounding.
"""

import json
import subprocess

import numpy as np
import pytest

from test_independent_readers import BINARY

# Class number by raw id, and the raw ids that random labels are drawn from.
CLASS_OF = {0: 0, 10: 1, 252: 1, 11: 2, 15: 3, 18: 4, 20: 5, 30: 6, 31: 7, 32: 8, 40: 9, 44: 10,
            48: 11, 49: 12, 50: 13, 51: 14, 70: 15, 71: 16, 72: 17, 80: 18, 81: 19}
RAW = np.array(sorted(CLASS_OF))
THINGS = range(1, 9)
CLASSES = range(1, 20)
EPSILON = 1e-15


def write(path, words):
    path.parent.mkdir(parents=True, exist_ok=True)
    words.astype("<u4").tofile(path)


def random_scan(rng, points):
    """Truth of runs of equal labels, and a prediction that errs in places."""
    starts = rng.random(points) < 0.004
    run = np.cumsum(starts)
    raw = RAW[rng.integers(0, len(RAW), run[-1] + 1)]
    truth = raw[run] | (rng.integers(0, 40, run[-1] + 1)[run] << 16)
    prediction = truth + (rng.integers(0, 2, run[-1] + 1)[run] << 22)
    shifted = np.roll(prediction, 7)
    wrong = rng.random(points) < 0.3
    return truth, np.where(wrong & (np.arange(points) % 3 == 0), shifted, prediction)


def reference(scans, min_points):
    lut = np.zeros(1 << 16, int)
    for raw, number in CLASS_OF.items():
        lut[raw] = number
    iou, tp, fp, fn = (np.zeros(20) for _ in range(4))
    confusion = np.zeros((20, 20))
    for truth, prediction in scans:
        of_truth, of_prediction = lut[truth & 0xffff], lut[prediction & 0xffff]
        seen = of_truth != 0
        np.add.at(confusion, (of_prediction[seen], of_truth[seen]), 1)
        for number in CLASSES:
            t = np.where(of_truth == number, truth.astype(np.int64) + 1, 0)[seen]
            p = np.where(of_prediction == number, prediction.astype(np.int64) + 1, 0)[seen]
            sizes_t = dict(zip(*np.unique(t[t > 0], return_counts=True)))
            sizes_p = dict(zip(*np.unique(p[p > 0], return_counts=True)))
            both = (t > 0) & (p > 0)
            pairs, common = np.unique(p[both] + (t[both] << 32), return_counts=True)
            ids_t, ids_p = pairs >> 32, pairs & 0xffffffff
            unions = np.array([sizes_t[a] + sizes_p[b] for a, b in zip(ids_t, ids_p)]) - common
            ious = common.astype(float) / unions.astype(float)
            hit = ious > 0.5
            iou[number] += np.sum(ious[hit])
            tp[number] += np.sum(hit)
            found_t, found_p = set(ids_t[hit]), set(ids_p[hit])
            fn[number] += sum(n >= min_points for i, n in sizes_t.items() if i not in found_t)
            fp[number] += sum(n >= min_points for i, n in sizes_p.items() if i not in found_p)
    sq = iou / np.maximum(tp, EPSILON)
    rq = tp / np.maximum(tp + 0.5 * fp + 0.5 * fn, EPSILON)
    hits = confusion.diagonal()
    union = confusion.sum(axis=0) + confusion.sum(axis=1) - hits
    return sq * rq, sq, rq, hits / np.maximum(union, EPSILON)


@pytest.mark.parametrize("seed,min_points", [(1, 50), (2, 50), (3, 1)])
def test_figures_agree_with_the_rules(tmp_path, seed, min_points):
    rng = np.random.default_rng(seed)
    scans = [random_scan(rng, 60000) for _ in range(3)]
    for number, (truth, prediction) in enumerate(scans):
        write(tmp_path / "t" / f"sequences/0{number}/labels/000000.label", truth)
        write(tmp_path / "p" / f"sequences/0{number}/predictions/000000.label", prediction)
    figures = tmp_path / "figures.json"
    done = subprocess.run(
        [BINARY, "evaluate", "--truth", tmp_path / "t", "--predictions", tmp_path / "p",
         "--min-points", str(min_points), "--json", figures], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    found = json.loads(figures.read_text())
    pq, sq, rq, iou = reference(scans, min_points)
    assert 0.2 < pq[1:].mean() < 0.98
    for number, of_class in zip(CLASSES, found["classes"]):
        assert [of_class[key] for key in ("pq", "sq", "rq", "iou")] == [
            pq[number], sq[number], rq[number], iou[number]], of_class["name"]
    for name, chosen in [("all", list(CLASSES)), ("things", list(THINGS)), ("stuff", list(range(9, 20)))]:
        means = [float(np.mean(figure[chosen])) for figure in (pq, sq, rq, iou)]
        assert [found[name][key] for key in ("pq", "sq", "rq", "miou")] == means, name
    dagger = np.mean(list(pq[list(THINGS)]) + list(iou[9:20]))
    assert found["pq_dagger"] == dagger


def lstq(sequences, min_points):
    """S_assoc and S_cls by the definition: tubes as sets of points, one after the other."""
    lut = np.zeros(1 << 16, int)
    for raw, number in CLASS_OF.items():
        lut[raw] = number
    terms, confusion = [], np.zeros((20, 20))
    for scans in sequences:
        frame = np.concatenate([np.full(len(truth), number) for number, (truth, _) in enumerate(scans)])
        truth, found = (np.concatenate(side) for side in zip(*scans))
        of_truth, of_found = lut[truth & 0xffff], lut[found & 0xffff]
        truth, found = truth >> 16, found >> 16
        seen = of_truth != 0
        np.add.at(confusion, (of_found[seen], of_truth[seen]), 1)
        sizes = {s: np.sum(seen & (found == s) & (of_found != 0)) for s in np.unique(found) if s != 0}
        for number in THINGS:
            for t in np.unique(truth[of_truth == number]):
                tube = (of_truth == number) & (truth == t) & (t != 0)
                large = np.bincount(frame[tube], minlength=len(scans)) > min_points
                tube &= large[frame]
                if not tube.any():
                    continue
                shared = {s: np.sum(tube & (found == s)) for s in np.unique(found[tube]) if s != 0}
                inner = sum(n * n / (tube.sum() + sizes[s] - n) for s, n in shared.items() if sizes[s])
                terms.append(inner / tube.sum())
    hits = confusion.diagonal()
    union = confusion.sum(axis=0) + confusion.sum(axis=1) - hits
    return np.mean(terms), np.mean(hits[union > 0] / union[union > 0]), len(terms)


@pytest.mark.parametrize("seed,min_points", [(1, 50), (2, 10)])
def test_association_over_time_agrees_with_its_definition(tmp_path, seed, min_points):
    rng = np.random.default_rng(seed)
    sequences = [[random_scan(rng, 30000) for _ in range(4)] for _ in range(2)]
    for name, scans in enumerate(sequences):
        for number, (truth, prediction) in enumerate(scans):
            file = f"{number:06}.label"
            write(tmp_path / "t" / f"sequences/0{name}/labels" / file, truth)
            write(tmp_path / "p" / f"sequences/0{name}/predictions" / file, prediction)
    figures = tmp_path / "figures.json"
    done = subprocess.run(
        [BINARY, "evaluate", "--truth", tmp_path / "t", "--predictions", tmp_path / "p", "--over-time",
         "--min-points", str(min_points), "--json", figures], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    found = json.loads(figures.read_text())["over_time"]
    s_assoc, s_cls, tubes = lstq(sequences, min_points)
    assert 0.01 < s_assoc < 0.99 and sum(of_class["tubes"] for of_class in found["classes"]) == tubes
    assert found["s_assoc"] == pytest.approx(s_assoc, rel=1e-12)
    assert found["s_cls"] == pytest.approx(s_cls, rel=1e-12)
    assert found["lstq"] == pytest.approx(np.sqrt(s_assoc * s_cls), rel=1e-12)
