"""What a call from Python costs beside the method itself.

    python python/benches/overhead.py [--runs 200] [--recording drive.mcap --frame 0]

Medians over many calls on one cloud, which is a simulated sweep of 64 beams and 2048 columns unless a recording is named.
`call` is the wall time of `divmerge.cluster` in Python, `run` that of `pipeline::run` inside it, measured there, and
`overhead` what is left of the one without the other, call by call. It has to be an optimised build:
`maturin develop --release`.
"""

import argparse
import statistics
import tempfile
import time
from pathlib import Path

import numpy as np

import divmerge

LIMIT_MS = 0.3


def a_frame(arguments):
    if arguments.recording:
        return next(divmerge.frames(arguments.recording, start=arguments.frame))
    with tempfile.TemporaryDirectory() as folder:
        drive = Path(folder) / "drive.mcap"
        divmerge.simulate(drive, sensor="hdl-64e", scene="street", frames=1)
        return next(divmerge.frames(drive))


def measure(runs, call):
    """Medians of call, run and the difference in milliseconds, and the highest of nine in ten differences."""
    calls, inside = [], []
    for _ in range(runs):
        started = time.perf_counter()
        result = call()
        calls.append((time.perf_counter() - started) * 1e3)
        inside.append(result.times["run_ms"])
        # The library's caller frees its stages too, and that is no part of `run`.
        del result
    overheads = [call - run for call, run in zip(calls, inside)]
    ninety = statistics.quantiles(overheads, n=10)[-1]
    return *map(statistics.median, (calls, inside, overheads)), ninety


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=200)
    parser.add_argument("--recording", type=Path)
    parser.add_argument("--frame", type=int, default=0)
    arguments = parser.parse_args()

    frame = a_frame(arguments)
    points, classes = frame.points, frame.classes
    four = np.hstack([points, np.ones((len(points), 1), np.float32)])
    cases = {
        "(N, 3) float32, uint16": lambda: divmerge.cluster(points, classes),
        "(N, 4) float32, uint16": lambda: divmerge.cluster(four, classes),
        "(N, 4) float32, ground": lambda: divmerge.cluster(four),
        "a frame": frame.cluster,
    }
    if classes is not None:
        wide = classes.astype(np.int64)
        cases["(N, 3) float32, int64"] = lambda: divmerge.cluster(points, wide)
    double = points.astype(np.float64)
    cases["(N, 3) float64, uint16"] = lambda: divmerge.cluster(double, classes)

    print(f"{len(points):,} points, medians of {arguments.runs} calls, milliseconds")
    print(f"{'':<24} {'call':>8} {'run':>8} {'overhead':>9} {'(90 %)':>8}")
    for name, call in cases.items():
        measure(10, call)
        of_call, of_run, overhead, ninety = measure(arguments.runs, call)
        verdict = "" if overhead < LIMIT_MS else f"   above {LIMIT_MS}"
        print(f"{name:<24} {of_call:8.2f} {of_run:8.2f} {overhead:9.3f} {ninety:8.3f}{verdict}")


if __name__ == "__main__":
    main()
