"""What becomes of input and output when something goes wrong: the real binary, killed, starved and lied to.

    python tests/python/faults.py                     # every fault, the table of docs/reliability.md
    python tests/python/faults.py --only flip --runs 1000 --seed 7

Every run must end in a correct output or a clear error. Correct: another reader (PyPI `mcap`) reads the output
through with all checksums, and finds every message of the input there unchanged and in order, up to where the
error said that the input ends. Clear: exit code 1, 2 or 130 and a message that names the file. Nothing else counts:
not a panic, not a wrong output, not a changed input or older output, not a file left behind. Faults are random, by
the seed; the moment at which a signal arrives is not. FAULTS_KEEP names a folder for damaged inputs whose run goes
wrong.

Needs the release binary (`cargo build --release`) and `pip install -r tests/python/requirements.txt`; a full and a
read-only disk are small tmpfs mounts, which need root.
"""

import argparse
import hashlib
import os
import random
import re
import resource
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from pathlib import Path

import lz4.frame
import zstandard
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer
from rosbags.typesys import Stores, get_typestore

import damage

ROOT = Path(__file__).resolve().parents[2]
BINARY = ROOT / "target" / "release" / "divmerge"
CLOUD = "sensor_msgs/msg/PointCloud2"
TYPES = get_typestore(Stores.ROS2_HUMBLE)
SECONDS = 60
# A folder for inputs that come to a wrong end.
KEEP = os.environ.get("FAULTS_KEEP")


# Recordings ------------------------------------------------------------------------------------------------------


def simulated(path, frames):
    """A drive of the simulator, about half a megabyte a frame."""
    arguments = ["simulate", "--sensor", "vlp-16", "--scene", "parking", "--frames", str(frames)]
    subprocess.run([BINARY, *arguments, "-o", path], check=True, capture_output=True)
    return path


def rewritten(source, path, compression=CompressionType.ZSTD, crcs=True, chunked=True, every=2):
    """The same messages by another writer, with fewer points, and what recordings have besides."""
    with open(path, "wb") as file:
        writer = Writer(
            file,
            chunk_size=300_000,
            compression=compression,
            use_chunking=chunked,
            enable_crcs=crcs,
            enable_data_crcs=crcs,
        )
        writer.start("ros2", "faults.py")
        text = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data\n")
        log = writer.register_channel("/log", "cdr", text)
        ids, channels = {}, {}
        with open(source, "rb") as read:
            for record in StreamReader(read).records:
                kind = type(record).__name__
                if kind == "Schema" and record.id not in ids:
                    ids[record.id] = writer.register_schema(record.name, record.encoding, record.data)
                elif kind == "Channel" and record.id not in channels:
                    schema = ids[record.schema_id]
                    channels[record.id] = (
                        writer.register_channel(record.topic, record.message_encoding, schema, record.metadata),
                        record.topic,
                    )
                elif kind == "Message":
                    channel, topic = channels[record.channel_id]
                    data = thinned(record.data, every) if topic.endswith("points") else record.data
                    times = (record.log_time, record.publish_time)
                    writer.add_message(channel, times[0], data, times[1], record.sequence)
                    line = b"\0\1\0\0\5\0\0\0fine\0"
                    writer.add_message(log, times[0] + 1, line, times[1], record.sequence)
        writer.add_attachment(5, 6, "calib.txt", "text/plain", b"Tr: 1 0 0 0 0 1 0 0 0 0 1 0\n")
        writer.add_metadata("rosbag2", {"version": "9"})
        writer.finish()
    return path


def thinned(data, every):
    """Some of the points of a cloud."""
    cloud = TYPES.deserialize_cdr(data, CLOUD)
    points = cloud.data.reshape(-1, cloud.point_step)[::every]
    cloud.height, cloud.width = 1, len(points)
    cloud.row_step = len(points) * cloud.point_step
    cloud.data = points.reshape(-1)
    return bytes(TYPES.serialize_cdr(cloud, CLOUD))


def messages(path):
    """Messages in the order of the file, and why reading ended early if it did."""
    found, schemas, channels = [], {}, {}
    try:
        with open(path, "rb") as file:
            for record in StreamReader(file, validate_crcs=True).records:
                kind = type(record).__name__
                if kind == "Schema":
                    schemas[record.id] = record.name
                elif kind == "Channel":
                    channels[record.id] = (record.topic, schemas.get(record.schema_id))
                elif kind == "Message":
                    times = (record.sequence, record.log_time, record.publish_time)
                    digest = hashlib.sha1(record.data).digest()
                    found.append((*channels[record.channel_id], *times, digest))
    except Exception as error:  # noqa: BLE001: whatever the reader makes of a broken file
        return found, f"{type(error).__name__}: {error}"
    return found, None


def plain_messages(path):
    """Messages with their header, as far as a reader comes that looks into nothing else."""
    found = []
    try:
        for opcode, body in damage.taken_apart(path.read_bytes()):
            if opcode == damage.MESSAGE:
                found.append(body)
    except (KeyError, RuntimeError, struct.error, zstandard.ZstdError):
        pass
    return found


def sha(path):
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()


# Judging a run ---------------------------------------------------------------------------------------------------


class Tally:
    """What came of the runs of a fault."""

    def __init__(self):
        self.counts = Counter()
        self.problems = []
        self.slowest = 0.0
        self.peak_kb = 0

    def take(self, verdict, about=""):
        kind = verdict.split(":")[0]
        self.counts[kind] += 1
        self.counts["runs"] += 1
        if kind in ("wrong", "harmed", "litter"):
            self.problems.append(f"{verdict} {about}")

    @property
    def is_clean(self):
        return not self.problems

    def row(self, name):
        count = self.counts
        kinds = ["runs", "correct", "error", "nothing", "wrong", "harmed", "litter"]
        cells = [name, *(str(count[kind]) for kind in kinds), f"{self.peak_kb / 1000:.0f} MB"]
        return "| " + " | ".join(cells) + " |"


def is_subsequence(few, many):
    rest = iter(many)
    return all(any(other == message for other in rest) for message in few)


def own(found):
    """Messages that were not added."""
    clouds = {topic for topic, schema, *_ in found if schema == CLOUD}
    added = {f"{topic}/{end}" for topic in clouds for end in ("instances", "objects")}
    return [message for message in found if message[0] not in added]


def judge_output(source, output, whole, code):
    """Whether the output is right. `whole` are the messages of the input before it was broken;
    `None` if the input has others."""
    found, problem = messages(output)
    kept = own(found)
    expected, cut = messages(source) if source.exists() else (whole, None)
    if whole is None:
        readable = plain_messages(source)
        if not is_subsequence(readable, plain_messages(output)):
            return f"wrong: a message of {len(readable)} is missing"
        if len(expected) < len(readable) and problem in (None, cut):
            # That reader stumbles in input and output alike: over a name that is no UTF-8, or over
            # more bytes in a record than its fields have.
            return "correct"
    if problem:
        return f"wrong: the output cannot be read: {problem}"
    if cut is None and kept != expected:
        return f"wrong: {len(kept)} messages kept of {len(expected)}"
    is_own = whole is None or is_subsequence(kept, whole)
    if cut is not None and not (is_subsequence(expected, kept) and is_own):
        return f"wrong: {len(kept)} messages kept, {len(expected)} readable before: {cut}"
    clouds = sum(message[1] == CLOUD for message in kept)
    annotated = sum(message[0].endswith("/instances") for message in found)
    if annotated > clouds or (code == 0 and annotated < clouds):
        return f"wrong: {annotated} annotations of {clouds} clouds"
    return "correct"


def judge(done, source, output, whole, before=None):
    """The verdict on a run. `before` is the hash of an older output."""
    code, said = done.returncode, done.stderr
    if "panicked" in said or code not in (0, 1, 2, 3, 130, -signal.SIGKILL):
        return f"wrong: exit code {code}: {said[-300:]}"
    exists = os.path.lexists(output)
    if code in (0, 3):
        return judge_output(source, output, whole, code) if exists else "wrong: no output"
    if before and (not exists or sha(output) != before):
        # It may be done just before a signal arrives.
        verdict = judge_output(source, output, whole, 0) if exists else "harmed: the older output"
        return verdict if verdict == "correct" else "harmed: the older output"
    if exists and not before:
        verdict = judge_output(source, output, whole, 0)
        return verdict if code == -signal.SIGKILL else f"wrong: an output in spite of code {code}"
    if code == -signal.SIGKILL:
        return "nothing"
    if "error:" not in said or not any(path.name in said for path in (source, output)):
        return f"wrong: an error that names no file: {said[-300:]}"
    return "error"


class Run(subprocess.Popen):
    """A run of the binary, whose peak memory is looked up every 2 ms."""

    def __init__(self, command, before=(), **options):
        pipes = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE, "text": True}
        super().__init__([*before, BINARY, *command], **pipes, **options)
        self.peak_kb = 0
        self.watcher = threading.Thread(target=self.watch)
        self.watcher.start()

    def watch(self):
        try:
            with open(f"/proc/{self.pid}/status", "rb", buffering=0) as file:
                while peak := re.search(rb"VmHWM:\s*(\d+)", file.read(4096)):
                    self.peak_kb = max(self.peak_kb, int(peak[1]))
                    file.seek(0)
                    time.sleep(0.002)
        except OSError:
            pass  # It has ended.

    def finish(self):
        """Waits for its end."""
        said = self.communicate(timeout=SECONDS)[1]
        self.watcher.join()
        return subprocess.CompletedProcess([], self.returncode, "", said)


class Bench:
    """A folder with an input, where runs are made and judged."""

    def __init__(self, folder, source):
        self.folder = Path(folder)
        self.runs = []
        self.original = source
        self.whole, problem = messages(source)
        assert problem is None, problem
        self.size = source.stat().st_size

    def fresh(self):
        """An empty folder with a copy of the input."""
        place = Path(tempfile.mkdtemp(dir=self.folder))
        source = place / "input.mcap"
        shutil.copyfile(self.original, source)
        return place, source, place / "output.mcap"

    def start(self, source, output, *more, **options):
        """Begins to annotate."""
        run = Run(["annotate", source, "-o", output, "--no-layout", *more], **options)
        self.runs.append(run)
        return run

    def annotate(self, source, output, *more, **options):
        """Annotates to the end."""
        return self.start(source, output, *more, **options).finish()

    def peak_kb(self):
        """The peak memory of the runs since the last call."""
        runs, self.runs = self.runs, []
        return max(run.peak_kb for run in runs)

    def reference(self):
        """The hash of the output of a run that nothing happens to."""
        place, source, output = self.fresh()
        done = self.annotate(source, output)
        assert done.returncode == 0, done.stderr
        made = sha(output)
        shutil.rmtree(place)
        return made

    def resumed(self, source, output, reference):
        """What is wrong with a cut-off run that is gone on with; nothing if its output is that of a whole run."""
        done = self.annotate(source, output, "--resume")
        if done.returncode != 0:
            return f"wrong: not resumed: code {done.returncode}: {done.stderr[-200:]}"
        return None if sha(output) == reference else "wrong: resumed to other bytes"

    def verdict(self, done, place, source, output, harmless=None, litter=(), **more):
        """Judges a run in a fresh folder, what is left there included, and removes it."""
        verdict = judge(done, source, output, self.whole, **more)
        if harmless and (not source.exists() or sha(source) != harmless):
            verdict = "harmed: the input"
        left = [path.name for path in place.iterdir() if path not in (source, output)]
        left = [name for name in left if not any(name.endswith(end) for end in litter)]
        if left and verdict in ("correct", "error", "nothing"):
            verdict = f"litter: {left}"
        shutil.rmtree(place)
        return verdict


def duration(bench):
    """Seconds that a run takes."""
    place, source, output = bench.fresh()
    started = time.monotonic()
    done = bench.annotate(source, output)
    taken = time.monotonic() - started
    assert done.returncode == 0, done.stderr
    assert bench.verdict(done, place, source, output) == "correct"
    return taken


# Faults ----------------------------------------------------------------------------------------------------------


def killed(bench, rng, runs, tally):
    """SIGKILL at a random moment. Every second run has an older output to replace; the others are resumed."""
    longest, reference = duration(bench), bench.reference()
    for run in range(runs):
        place, source, output = bench.fresh()
        before = None
        if run % 2:
            output.write_bytes(b"older")
            before = sha(output)
        process = bench.start(source, output, "--force")
        time.sleep(rng.uniform(0, 1.1 * longest))
        process.kill()
        done = process.finish()
        verdict = judge(done, source, output, bench.whole, before=before)
        if verdict == "nothing" and not before:
            verdict = bench.resumed(source, output, reference) or verdict
        # Nobody can clean up behind a process that is killed: what it was writing stays, hidden.
        hidden = (".partial", ".journal") if before else ()
        left = [path.name for path in place.iterdir() if path not in (source, output)]
        left = [name for name in left if not name.endswith(hidden)] if hidden else left
        if sha(source) != sha(bench.original):
            verdict = "harmed: the input"
        elif left and verdict in ("correct", "nothing"):
            verdict = f"litter: {left}"
        shutil.rmtree(place)
        tally.take(verdict, f"(run {run})")


def interrupted(bench, rng, runs, tally):
    """Ctrl-C (SIGINT) or SIGTERM at a random moment: over in a second; what is left is named, and can be resumed."""
    longest, reference = duration(bench), bench.reference()
    for run in range(runs):
        place, source, output = bench.fresh()
        process = bench.start(source, output)
        time.sleep(rng.uniform(0.02, 1.1 * longest))
        process.send_signal([signal.SIGINT, signal.SIGTERM][run % 2])
        sent = time.monotonic()
        done = process.finish()
        took = time.monotonic() - sent
        tally.slowest = max(tally.slowest, took)
        if done.returncode in (-signal.SIGINT, -signal.SIGTERM):
            # Before the program had begun to listen, so before it had done anything.
            done.returncode = -signal.SIGKILL
        left = sorted(path.name for path in place.iterdir() if path not in (source, output))
        verdict = judge(done, source, output, bench.whole)
        if verdict == "error":
            said = done.stderr
            named = all(name in said for name in left) and ("--resume" in said) == bool(left)
            if not named or (not left and "nothing was written" not in said):
                verdict = f"wrong: left {left} and said {said[-200:]}"
            else:
                verdict = bench.resumed(source, output, reference) or verdict
        elif left and verdict != "nothing":
            verdict = f"litter: {left}"
        if sha(source) != sha(bench.original):
            verdict = "harmed: the input"
        shutil.rmtree(place)
        if took > 1.0:
            verdict = f"wrong: took {took:.2f} s"
        tally.take(verdict, f"(run {run})")


def tmpfs(place, size):
    place.mkdir()
    done = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", place], capture_output=True
    )
    return done.returncode == 0


def disk_full(bench, rng, runs, tally):
    """The output's folder is a tmpfs of fewer bytes than the output; without root, a limit on the file's size."""
    place, source, output = bench.fresh()
    bench.annotate(source, output)
    needed = output.stat().st_size
    shutil.rmtree(place)
    for run in range(runs):
        place, source, _ = bench.fresh()
        disk = place / "disk"
        size = rng.randrange(4096, needed)
        is_mounted = tmpfs(disk, size)
        options = {}
        if not is_mounted:
            def limit(size=size):
                resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))

            options = {"preexec_fn": limit, "restore_signals": False}
        output = disk / "output.mcap"
        before = None
        if run % 2 and size > 2 * 4096:
            output.write_bytes(b"older")
            before = sha(output)
        done = bench.annotate(source, output, "--force", **options)
        verdict = judge(done, source, output, bench.whole, before=before)
        left = [path.name for path in disk.iterdir() if path != output]
        if left:
            verdict = f"litter: {left}"
        if sha(source) != sha(bench.original):
            verdict = "harmed: the input"
        if is_mounted:
            subprocess.run(["umount", disk], check=True)
        shutil.rmtree(place)
        tally.take(verdict, f"({size} bytes)")


def read_only(bench, rng, runs, tally):
    """The output's folder cannot be written to, with and without an older output in it."""
    del rng
    for run in range(runs):
        place, source, _ = bench.fresh()
        disk = place / "disk"
        is_mounted = tmpfs(disk, "1m")
        output = disk / "output.mcap"
        before = None
        if run % 2:
            output.write_bytes(b"older")
            before = sha(output)
        if is_mounted:
            subprocess.run(["mount", "-o", "remount,ro", disk], check=True)
        else:
            disk.chmod(0o555)
        done = bench.annotate(source, output, "--force")
        tally.take(judge(done, source, output, bench.whole, before=before))
        if is_mounted:
            subprocess.run(["umount", disk], check=True)
        else:
            disk.chmod(0o755)
        shutil.rmtree(place)


def truncated(bench, rng, runs, tally):
    """The input ends early, anywhere."""
    whole = bench.original.read_bytes()
    for _ in range(runs):
        place, source, output = bench.fresh()
        at = rng.randrange(len(whole))
        source.write_bytes(whole[:at])
        harmless = sha(source)
        done = bench.annotate(source, output)
        tally.take(bench.verdict(done, place, source, output, harmless), f"(at {at})")


def flipped(bench, rng, runs, tally):
    """One bit of one byte of the input is another."""
    whole = bench.original.read_bytes()
    for _ in range(runs):
        place, source, output = bench.fresh()
        at, bit = rng.randrange(len(whole)), rng.randrange(8)
        source.write_bytes(whole[:at] + bytes([whole[at] ^ 1 << bit]) + whole[at + 1 :])
        harmless = sha(source)
        done = bench.annotate(source, output)
        tally.take(bench.verdict(done, place, source, output, harmless), f"(bit {bit} of {at})")


def growing(bench, rng, runs, tally):
    """Another process appends to the input while it is read."""
    longest = duration(bench)
    whole = bench.original.read_bytes()
    for run in range(runs):
        place, source, output = bench.fresh()
        at = rng.randrange(len(whole))
        source.write_bytes(whole[:at])
        rest, pause = whole[at:], longest / 40

        def append(source=source, rest=rest, pause=pause):
            with open(source, "ab", buffering=0) as file:
                for start in range(0, len(rest), len(rest) // 40 + 1):
                    file.write(rest[start : start + len(rest) // 40 + 1])
                    time.sleep(pause)

        writer = threading.Thread(target=append)
        writer.start()
        done = bench.annotate(source, output)
        writer.join()
        # What was there when it began is in the output; what came later may be.
        early = place / "early.mcap"
        early.write_bytes(whole[:at])
        first = messages(early)[0]
        early.unlink()
        if done.returncode == 3 and output.exists():
            found, problem = messages(output)
            kept = own(found)
            is_right = not problem and is_subsequence(first, kept) and is_subsequence(kept, bench.whole)
            shutil.rmtree(place)
            tally.take("correct" if is_right else f"wrong: {len(kept)} kept, {problem}", f"(run {run})")
        else:
            tally.take(bench.verdict(done, place, source, output, sha(bench.original)), f"(run {run})")


def vanishing(bench, rng, runs, tally):
    """The input is removed, or becomes shorter, while it is read."""
    longest = duration(bench)
    for run in range(runs):
        place, source, output = bench.fresh()
        process = bench.start(source, output)
        time.sleep(rng.uniform(0, longest))
        if run % 2:
            source.unlink()
        else:
            os.truncate(source, rng.randrange(bench.size))
        done = process.finish()
        if done.returncode == 3 and output.exists():
            # Cut before it was opened.
            found, problem = messages(output)
            is_right = not problem and is_subsequence(own(found), bench.whole)
            shutil.rmtree(place)
            tally.take("correct" if is_right else f"wrong: {problem}", f"(run {run})")
            continue
        if done.returncode == 0:
            # Read before it happened.
            shutil.copyfile(bench.original, source)
        tally.take(bench.verdict(done, place, source, output), f"(run {run})")


def odd_outputs(bench, rng, runs, tally):
    """An output that is a folder of that name in the way, a dangling link, the input (itself, by a link, by a hard link) or there already."""
    del rng, runs

    def folder(place, source, output):
        # The file would be put into the folder, under the input's name, where something else is already.
        (output / source.name).mkdir(parents=True)
        return source, output

    def dangling(place, source, output):
        output.symlink_to(place / "nowhere")
        return source, output

    def itself(place, source, output):
        return source, source

    def dotted(place, source, output):
        return source, place / "." / ".." / place.name / source.name

    def link(place, source, output):
        output.symlink_to(source)
        return source, output

    def hard_link(place, source, output):
        os.link(source, output)
        return source, output

    def older(place, source, output):
        output.write_bytes(b"older")
        return source, output

    def no_folder(place, source, output):
        return source, place / "no" / "output.mcap"

    for make in (folder, dangling, itself, dotted, link, hard_link, older, no_folder):
        for more in ((), ("--force",)):
            place, source, output = bench.fresh()
            source, output = make(place, source, output)
            kind = (output.is_symlink(), output.is_dir(), os.path.lexists(output))
            content = sha(output) if output.is_file() else None
            done = bench.annotate(source, output, *more)
            is_replaced = done.returncode == 0 and more and make in (hard_link, older)
            if is_replaced:
                verdict = judge_output(source, output, bench.whole, 0)
            elif done.returncode not in (1, 2) or not any(
                f"error: {path.parent}" in done.stderr for path in (source, output)
            ):
                verdict = f"wrong: code {done.returncode}: {done.stderr[-200:]}"
            elif kind != (output.is_symlink(), output.is_dir(), os.path.lexists(output)):
                verdict = "harmed: the output is something else"
            elif content and sha(output) != content:
                verdict = "harmed: the older output"
            else:
                verdict = "error"
            if sha(source) != sha(bench.original):
                verdict = "harmed: the input"
            if any(path.name.endswith(".partial") for path in place.iterdir()):
                verdict = "litter: a partial file"
            shutil.rmtree(place)
            tally.take(verdict, f"({make.__name__} {' '.join(more)})")


def stalled(bench, rng, runs, tally):
    """The input is a pipe that gives nothing, or stops midway: an error at once, or a second after Ctrl-C."""
    whole = bench.original.read_bytes()
    for run in range(runs):
        place, source, output = bench.fresh()
        source.unlink()
        feed, given = None, rng.randrange(len(whole))
        if run % 2:
            os.mkfifo(source)
            process = bench.start(source, output)
        else:
            process = bench.start("-", output, stdin=subprocess.PIPE)

            def pour(pipe=process.stdin.buffer, given=given):
                try:
                    pipe.write(whole[:given])
                    pipe.flush()
                except OSError:
                    pass

            feed = threading.Thread(target=pour)
            feed.start()
        try:
            process.wait(timeout=0.7)
        except subprocess.TimeoutExpired:
            process.send_signal(signal.SIGINT)
        sent = time.monotonic()
        try:
            code = process.wait(timeout=5)
        except subprocess.TimeoutExpired:
            process.kill()
            code = None
        took = time.monotonic() - sent
        said = process.stderr.read()
        if feed:
            feed.join()
            try:
                process.stdin.close()
            except OSError:
                pass
        left = [path.name for path in place.iterdir() if path != source]
        left = [name for name in left if name not in said]
        verdict = "error"
        if code not in (1, 2, 130) or "error:" not in said:
            verdict = f"wrong: code {code}: {said[-200:]}"
        elif took > 1.0:
            verdict = f"wrong: took {took:.2f} s"
        elif left:
            verdict = f"litter: {left}"
        shutil.rmtree(place)
        tally.take(verdict, f"(run {run})")


def bombs(bench, rng, runs, tally):
    """Chunks that claim 100 GB, or truly hold 400 MB of zeros and say so or not; 1 GB of memory is all there is."""
    del rng, runs
    size = 400 << 20
    head = struct.pack("<BQ", 0x90, size - 9)
    zstd, packer = zstandard.ZstdCompressor(1).compressobj(), lz4.frame.LZ4FrameCompressor()
    packed = {"zstd": zstd.compress(head), "lz4": packer.begin() + packer.compress(head)}
    for _ in range(0, size - 9, 1 << 20):
        zeros = bytes(min(1 << 20, size - 9))
        packed["zstd"] += zstd.compress(zeros)
        packed["lz4"] += packer.compress(zeros)
    packed = {"zstd": packed["zstd"] + zstd.flush(), "lz4": packed["lz4"] + packer.flush(), "": b"few"}

    def record(opcode, body):
        return struct.pack("<BQ", opcode, len(body)) + body

    def limit():
        resource.setrlimit(resource.RLIMIT_AS, (1 << 30, 1 << 30))

    magic = b"\x89MCAP0\r\n"
    for name, data in packed.items():
        for claimed in (size, 1000, 200 << 20, 100_000_000_000):
            place, source, output = bench.fresh()
            body = struct.pack("<QQQII", 0, 0, claimed, 0, len(name)) + name.encode()
            body += struct.pack("<Q", len(data)) + data
            ends = record(15, bytes(4)) + record(2, bytes(20)) + magic
            source.write_bytes(magic + record(1, bytes(8)) + record(6, body) + ends)
            done = bench.annotate(source, output, preexec_fn=limit)
            tally.take(bench.verdict(done, place, source, output), f"({name} {claimed})")


def racing(bench, rng, runs, tally):
    """Two or three runs with one output, each with an input of its own. They begin at random, and
    are stopped for a while, or held up before they lock, rename and remove files (with strace,
    where it is installed)."""
    sources = [bench.original]
    for name, frames in (("second.mcap", 10), ("third.mcap", 8)):
        sources.append(simulated(bench.folder / name, frames))
    longest, expected = duration(bench), {}
    for source in sources:
        place, _, output = bench.fresh()
        done = bench.annotate(source, output)
        assert done.returncode == 0, done.stderr
        expected[source] = sha(output)
        shutil.rmtree(place)
    before = [sha(source) for source in sources]
    for number in range(runs):
        place, own, output = bench.fresh()
        own.unlink()
        more = ["--force"] if number % 2 else []
        racers = [Racer(bench, source, output, more) for source in sources[: 2 + number // 2 % 2]]
        for racer in racers:
            racer.plan(rng, longest)
            racer.start()
        for racer in racers:
            racer.join()
        verdict = judge_race(racers, output, expected, bool(more))
        left = [path.name for path in place.iterdir() if path != output]
        if [sha(source) for source in sources] != before:
            verdict = "harmed: an input"
        elif left and verdict == "correct":
            verdict = f"litter: {left}"
        shutil.rmtree(place)
        tally.take(verdict, f"(round {number}, {len(racers)} runs)")


# System calls in which another run may come between.
HELD_UP = ["flock", "renameat", "renameat2", "unlink"]


class Racer(threading.Thread):
    """One of several runs with one output, and what was under its name when this one had ended."""

    def __init__(self, bench, source, output, more):
        super().__init__()
        self.bench, self.source, self.output, self.more = bench, source, output, more

    def plan(self, rng, longest):
        """Draws when it begins, and when and for how long it is stopped or held up."""
        self.waits = rng.choice([0, 0, rng.uniform(0, longest)])
        count = rng.choice([0, 1, 2])
        self.pauses = [(rng.uniform(0, longest / 2), rng.uniform(0, longest)) for _ in range(count)]
        self.before = []
        if shutil.which("strace") and rng.random() < 0.5:
            self.pauses = []
            self.before = ["strace", "-f", "-o", "/dev/null", "-e", f"trace={','.join(HELD_UP)}"]
            for call in HELD_UP:
                microseconds = rng.choice([0, rng.randrange(300_000)])
                self.before += ["-e", f"inject={call}:delay_enter={microseconds}"]

    def run(self):
        time.sleep(self.waits)
        process = self.bench.start(self.source, self.output, *self.more, before=self.before)
        for until, pause in self.pauses:
            time.sleep(until)
            process.send_signal(signal.SIGSTOP)
            time.sleep(pause)
            process.send_signal(signal.SIGCONT)
        self.done = process.finish()
        self.found = sha(self.output) if self.output.exists() else None


def judge_race(racers, output, expected, may_replace):
    """Exactly one wins, or with --force one after the other; what is under the name is a winner's
    whole output."""
    for racer in racers:
        code, said = racer.done.returncode, racer.done.stderr
        if code not in (0, 1, 2) or (code and "error:" not in said) or "a bug" in said:
            return f"wrong: code {code}: {said[-300:]}"
    winners = [racer for racer in racers if racer.done.returncode == 0]
    if not winners or (len(winners) > 1 and not may_replace):
        return f"wrong: {len(winners)} of {len(racers)} ended with 0"
    wanted = {expected[racer.source] for racer in winners}
    if any(racer.found not in wanted for racer in winners) or sha(output) not in wanted:
        return "wrong: another file under the name of a run that ended with 0"
    return "correct"


def damages(change):
    """The fault of damaging a recording in this way."""

    def fault(bench, rng, runs, tally):
        records = list(damage.taken_apart(bench.original.read_bytes()))
        cloud = next(
            struct.unpack_from("<H", body)[0]
            for opcode, body in records
            if opcode == damage.CHANNEL and b"points" in body
        )
        for number in range(runs):
            place, source, output = bench.fresh()
            source.write_bytes(damage.damaged(rng, records, change, cloud))
            harmless = sha(source)
            done = bench.annotate(source, output, preexec_fn=two_gigabytes)
            verdict = judge(done, source, output, None)
            if KEEP and verdict.startswith("wrong"):
                shutil.copyfile(source, Path(KEEP) / f"{change} {number}.mcap")
            if sha(source) != harmless:
                verdict = "harmed: the input"
            left = [path.name for path in place.iterdir() if path not in (source, output)]
            if left and verdict in ("correct", "error"):
                verdict = f"litter: {left}"
            shutil.rmtree(place)
            tally.take(verdict, f"({number})")

    return fault


def two_gigabytes():
    resource.setrlimit(resource.RLIMIT_AS, (2 << 30, 2 << 30))


VARIANTS = {
    "zstd, checksums": {"compression": CompressionType.ZSTD, "crcs": True},
    "zstd, none": {"compression": CompressionType.ZSTD, "crcs": False},
    "lz4, checksums": {"compression": CompressionType.LZ4, "crcs": True},
    "uncompressed, checksums": {"compression": CompressionType.NONE, "crcs": True},
    "uncompressed, none": {"compression": CompressionType.NONE, "crcs": False},
    "no chunks": {"compression": CompressionType.NONE, "crcs": False, "chunked": False},
}

# Name, fault, runs of the whole table, recording, and what it is in words.
FAULTS = {
    "kill": (killed, 100, "long", "killed (SIGKILL) at a random moment"),
    "interrupt": (interrupted, 100, "long", "SIGINT or SIGTERM at a random moment"),
    "full": (disk_full, 40, "long", "disk full"),
    "read-only": (read_only, 4, "small", "output folder read-only"),
    "truncate": (truncated, 100, "small", "input cut off at a random byte"),
    "grow": (growing, 40, "long", "input growing while it is read"),
    "vanish": (vanishing, 40, "long", "input removed or cut while it is read"),
    "odd": (odd_outputs, 1, "small", "output is a folder, a link, the input, there already"),
    "stall": (stalled, 10, "small", "input is a pipe that stalls"),
    "bomb": (bombs, 1, "small", "chunk that claims or holds far more than it should"),
    "race": (racing, 200, "long", "two or three runs with one output, stopped at random"),
    # Of each of the ten changes.
    "damage": (damages, 300, "changes", "damaged, checksums right"),
    # Of each of the six variants.
    "flip": (flipped, 170, "variants", "one bit flipped"),
}


def run_faults(names, seed, runs=None, progress=lambda text: None):
    """Yields the name of each fault and recording with its tally."""
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        long = simulated(folder / "long.mcap", 12)
        small = rewritten(simulated(folder / "source.mcap", 4), folder / "small.mcap")
        benches = {"long": Bench(folder, long), "small": Bench(folder, small)}
        for name in names:
            fault, usual, kind, words = FAULTS[name]
            faults = {words: (fault, benches.get(kind))}
            if kind == "variants":
                faults = {}
                for variant, options in VARIANTS.items():
                    path = folder / f"{variant}.mcap".replace(", ", "-").replace(" ", "-")
                    source = rewritten(folder / "source.mcap", path, **options)
                    faults[f"{words}: {variant}"] = (fault, Bench(folder, source))
            elif kind == "changes":
                few = rewritten(folder / "source.mcap", folder / "few.mcap", every=8)
                bench = Bench(folder, few)
                faults = {f"{words}: {change}": (fault(change), bench) for change in damage.KINDS}
            for about, (fault, bench) in faults.items():
                progress(about)
                tally = Tally()
                fault(bench, random.Random(f"{seed} {about}"), runs or usual, tally)
                tally.peak_kb = bench.peak_kb()
                yield about, tally


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--runs", type=int, help="runs of each fault instead of the table's")
    parser.add_argument("--only", action="append", choices=FAULTS)
    arguments = parser.parse_args()
    kinds = ["runs", "correct output", "clear error", "nothing written"]
    columns = ["fault", *kinds, "wrong", "harmed", "litter", "peak memory"]
    print("| " + " | ".join(columns) + " |\n| --- " + "| ---: " * (len(columns) - 1) + "|")
    problems = []
    names = arguments.only or FAULTS
    for name, tally in run_faults(names, arguments.seed, arguments.runs):
        print(tally.row(name), flush=True)
        if tally.slowest:
            print(f"slowest end after a signal: {tally.slowest:.2f} s", file=sys.stderr)
        problems += [f"{name}: {problem}" for problem in tally.problems]
    for problem in problems:
        print(problem, file=sys.stderr)
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
