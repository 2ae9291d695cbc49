"""Instances for the predictions of any network of classes per point: panoptic segmentation in a loop over a data set.

    python examples/panoptic.py                     # simulates its own data
    python examples/panoptic.py drive.mcap          # clouds that carry `label` and `true_instance`

The network here is a stand-in that errs on purpose: it takes classes from the truth, misnames some objects and is unsure at
random points. Put yours in its place: `model(points) -> (classes, confidence)`. Where PyTorch is installed data come by a
`DataLoader` and predictions are tensors, else arrays of NumPy; divmerge takes both.
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np

import divmerge

try:
    import torch
except ImportError:
    torch = None


class Scans:
    """A map-style data set, as PyTorch has it: scan by number."""

    def __init__(self, recording):
        frames = divmerge.frames(recording, fields=["label", "true_instance", "intensity"])
        self.scans = [
            {
                "points": np.column_stack([frame.points, frame.fields["intensity"]]).astype("f4"),
                "classes": frame.fields["label"],
                "instances": frame.fields["true_instance"],
            }
            for frame in frames
        ]

    def __len__(self):
        return len(self.scans)

    def __getitem__(self, number):
        return self.scans[number]


def loader(scans):
    """One scan at a time; scans differ in their number of points, so they are not stacked."""
    if torch is None:
        return (scans[number] for number in range(len(scans)))
    from torch.utils.data import DataLoader

    return DataLoader(scans, batch_size=None, shuffle=False)


class StandIn:
    """Predicts the classes of points as a network would, with errors that come by a seed."""

    def __init__(self, taxonomy, share=0.1, seed=1):
        self.numbers = np.array(list(taxonomy.ids))
        self.share, self.random = share, np.random.default_rng(seed)

    def __call__(self, scan):
        classes = np.asarray(scan["classes"]).astype(np.int64)
        instances = np.asarray(scan["instances"])
        confidence = self.random.uniform(0.7, 1.0, len(classes)).astype(np.float32)
        # Points at random get any class; the network is unsure of them.
        wrong = self.random.random(len(classes)) < self.share
        classes = np.where(wrong, self.random.choice(self.numbers, len(classes)), classes)
        confidence[wrong] = self.random.uniform(0.2, 0.6, wrong.sum())
        # Two points in five of some objects are taken for a truck.
        for instance in np.unique(instances[instances > 0]):
            if self.random.random() < self.share:
                half = (instances == instance) & (self.random.random(len(classes)) < 0.4)
                classes[half], confidence[half] = 18, 0.5
        if torch is None:
            return classes, confidence
        return torch.from_numpy(classes), torch.from_numpy(confidence)


def table(figures):
    print(f"{'class':<14} {'PQ':>6} {'SQ':>6} {'RQ':>6} {'IoU':>6}   found  spurious  missed")
    for one in figures["classes"]:
        if not one["true_points"]:
            continue
        percent = "".join(f"{100 * one[name]:7.1f}" for name in ("pq", "sq", "rq", "iou"))
        counts = one["true_positives"], one["false_positives"], one["false_negatives"]
        print(f"{one['name']:<14}{percent} {counts[0]:7} {counts[1]:9} {counts[2]:7}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("recording", nargs="?", type=Path)
    parser.add_argument("--frames", type=int, default=5, help="scans to simulate")
    parser.add_argument("--share", type=float, default=0.1, help="share of errors of the stand-in")
    arguments = parser.parse_args()

    with tempfile.TemporaryDirectory() as folder:
        recording = arguments.recording
        if recording is None:
            recording = Path(folder) / "drive.mcap"
            divmerge.simulate(recording, frames=arguments.frames)
        scans = Scans(recording)

    model = StandIn(divmerge.Taxonomy(), arguments.share)
    pairs, took = [], []
    for number, scan in enumerate(loader(scans)):
        classes, confidence = model(scan)
        result = divmerge.cluster(scan["points"], classes, confidence=confidence)
        took.append(result.times["run_ms"])
        print(f"scan {number}: {len(result.instances)} instances of {len(result.instance):,} points")
        pairs.append(((scan["classes"], scan["instances"]), result))

    data = "tensors of PyTorch" if torch else "arrays of NumPy, for there is no PyTorch"
    print(f"\n{data}; {np.median(took):.1f} ms a scan for the instances\n")
    table(divmerge.evaluate(pairs))


if __name__ == "__main__":
    main()
