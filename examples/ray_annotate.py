#!/usr/bin/env python3
"""Annotates recordings on a Ray cluster, slice by slice, and joins each as soon as its slices are done.

    pip install ./python ray
    python examples/ray_annotate.py drives/ more/b.mcap -o annotated --shards 64
    python examples/ray_annotate.py drives/ -o annotated --address auto --set preset=paper --set semantics=ground

Inputs are recordings, folders of them, addresses of object stores (with a divmerge that was built for those), or text files
with one of these a line (@list.txt). Every worker has to see the inputs and the folder of the outputs under the same names.
A slice whose worker is lost is done again by another; a slice that fails because of what is in the recording is named at
the end, and so is its recording, while all others are finished. What comes out is what `divmerge annotate` writes, byte for
byte.
"""

import argparse
import pathlib
import sys
import time
from collections import defaultdict

import ray

import divmerge


# One core each: Ray runs as many at a time as there are cores. Only lost workers are reason to try again.
@ray.remote(num_cpus=1, max_retries=5)
def annotate(piece, folder, parameters):
    """Annotates a slice into a folder; the report, and the seconds it took."""
    started = time.monotonic()
    report = divmerge.annotate_slice(piece, folder, threads=1, force=True, **parameters)
    return report, time.monotonic() - started


@ray.remote(num_cpus=1, max_retries=5)
def join(files, output, force):
    """Joins the slices of a recording and removes them; the report, and the seconds it took."""
    started = time.monotonic()
    pathlib.Path(output).parent.mkdir(parents=True, exist_ok=True)
    report = divmerge.join(files, output, threads=1, force=force)
    for file in files:
        pathlib.Path(file).unlink(missing_ok=True)
    return report, time.monotonic() - started


class Recording:
    """A recording on its way: slices, reports, and what they took."""

    def __init__(self, name):
        self.name = name
        self.pieces = []
        self.files = {}
        self.clouds = 0
        self.seconds = 0.0
        self.report = None
        self.problem = None


def run(inputs, output, shards, parameters=None, force=False, tell=print):
    """Annotates recordings into a folder on the cluster that `ray.init` has joined; the recordings with their reports."""
    parameters = parameters or {}
    output = pathlib.Path(output).absolute()
    slices = output / ".slices"
    recordings = {}
    for piece in divmerge.plan(inputs, shards):
        recordings.setdefault(piece["name"], Recording(piece["name"])).pieces.append(piece)
    for recording in recordings.values():
        if not force and (output / recording.name).exists():
            raise FileExistsError(f"{output / recording.name} exists already; force replaces it")
    waiting = {}
    for recording in recordings.values():
        for piece in recording.pieces:
            waiting[annotate.remote(piece, str(slices), parameters)] = (recording, piece)
    everything = len(waiting)
    done = 0
    while waiting:
        ready, _ = ray.wait(list(waiting), num_returns=1)
        recording, piece = waiting.pop(ready[0])
        try:
            report, seconds = ray.get(ready[0])
        except (ray.exceptions.RayTaskError, ray.exceptions.RaySystemError) as error:
            recording.problem = recording.problem or reason(error)
            done += piece is not None
            continue
        recording.seconds += seconds
        if piece is None:
            recording.report = report
            tell(f"joined {recording.name}")
            continue
        done += 1
        recording.files[piece["number"]] = report["output"]
        recording.clouds += sum(topic["frames"] for topic in report["topics"].values())
        tell(f"{done} of {everything} slices: {recording.name}, slice {piece['number']}, {seconds:.1f} s")
        if len(recording.files) == len(recording.pieces):
            files = [file for _, file in sorted(recording.files.items())]
            waiting[join.remote(files, str(output / recording.name), force)] = (recording, None)
    if all(recording.report for recording in recordings.values()):
        remove_empty(slices)
    return list(recordings.values())


def reason(error):
    """What went wrong in a task, without where in the code."""
    return str(getattr(error, "cause", None) or error).strip().splitlines()[-1]


def remove_empty(folder):
    """Removes a folder whose files are gone."""
    for below in sorted(folder.rglob("*"), reverse=True):
        if below.is_dir():
            below.rmdir()
    folder.rmdir()


def table(recordings):
    """What was done, a line for each recording."""
    head = ["recording", "slices", "clouds", "points", "instances", "MB", "task-seconds"]
    rows = []
    totals = defaultdict(float)
    for recording in recordings:
        topics = (recording.report or {"topics": {}})["topics"].values()
        figures = {
            "slices": len(recording.pieces),
            "clouds": recording.clouds,
            "points": sum(topic["points"] for topic in topics),
            "instances": sum(topic["instances"] for topic in topics),
            "MB": (recording.report or {"output_bytes": 0})["output_bytes"] / 1e6,
            "task-seconds": recording.seconds,
        }
        for name, figure in figures.items():
            totals[name] += figure
        rows.append([recording.name, *figures.values()])
    if len(rows) > 1:
        rows.append(["all", *totals.values()])
    cells = [head] + [
        [row[0], *(f"{figure:,.1f}" if name in ("MB", "task-seconds") else f"{int(figure):,}"
                   for name, figure in zip(head[1:], row[1:]))]
        for row in rows
    ]
    widths = [max(len(row[column]) for row in cells) for column in range(len(head))]
    lines = []
    for row in cells:
        numbers = [cell.rjust(width) for cell, width in zip(row[1:], widths[1:])]
        lines.append("  ".join([row[0].ljust(widths[0]), *numbers]))
    return "\n".join(lines)


def listed(inputs):
    """Inputs, with those that stand in lists."""
    for text in inputs:
        if text.startswith("@"):
            yield from pathlib.Path(text[1:]).read_text().split("\n")
        else:
            yield text


def parameter(text):
    """A parameter of divmerge.annotate: a number where it reads as one."""
    name, _, value = text.partition("=")
    try:
        return name, float(value) if "." in value else int(value)
    except ValueError:
        return name, value


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("inputs", nargs="+", metavar="IN", help="recordings, folders, or @lists of them")
    parser.add_argument("-o", "--output", required=True, metavar="FOLDER", help="where annotated recordings go")
    parser.add_argument("--shards", type=int, default=0, metavar="N", help="slices in all [default: 4 for each core]")
    parser.add_argument("--address", help="of a Ray cluster; `auto` for the one of this machine [default: start one here]")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", dest="parameters",
                        help="a parameter of divmerge.annotate, as in preset=paper; may be given several times")
    parser.add_argument("--force", action="store_true", help="replace existing outputs")
    arguments = parser.parse_args()
    ray.init(address=arguments.address, log_to_driver=False, logging_level="warning")
    shards = arguments.shards or 4 * int(ray.cluster_resources().get("CPU", 1))
    inputs = [text for text in listed(arguments.inputs) if text]
    parameters = dict(parameter(text) for text in arguments.parameters)
    try:
        recordings = run(inputs, arguments.output, shards, parameters, arguments.force)
    except (divmerge.Error, OSError, ValueError) as error:
        sys.exit(f"error: {error}")
    except KeyboardInterrupt:
        sys.exit(130)
    print(table(recordings))
    failed = [recording for recording in recordings if recording.problem]
    for recording in failed:
        print(f"error: {recording.name}: {recording.problem}", file=sys.stderr)
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
