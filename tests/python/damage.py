"""Damage by someone who knows the format: one record of a recording is changed, and every length,
index and checksum around it is made right again, so that nothing stops a reader before it.

A recording is taken apart into records, and put together in a random shape: with or without chunks,
compression, checksums, indexes, summary and statistics. Each record passes through a hook on its
way, which may change it.
"""

import struct
import zlib
from collections import Counter
from dataclasses import dataclass
from io import BytesIO

import lz4.frame
import zstandard

MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE = 1, 2, 3, 4, 5
CHUNK, MESSAGE_INDEX, CHUNK_INDEX, ATTACHMENT = 6, 7, 8, 9
STATISTICS, METADATA, SUMMARY_OFFSET, DATA_END = 11, 12, 14, 15

# The fields of each record: numbers by their letter in `struct`, `s` a text, `b` bytes of a 32-bit
# length, `l` bytes of a 64-bit length, `*` the rest; in brackets what an array of a 32-bit length
# holds.
LAYOUTS = {
    HEADER: "ss",
    FOOTER: "QQ",
    SCHEMA: "Hssb",
    CHANNEL: "HHss(ss)",
    MESSAGE: "HIQQ*",
    CHUNK: "QQQIsl",
    MESSAGE_INDEX: "H(QQ)",
    CHUNK_INDEX: "QQQQ(HQ)QsQQ",
    ATTACHMENT: "QQssl",
    STATISTICS: "QHIIIIQQ(HQ)",
    METADATA: "s(ss)",
    SUMMARY_OFFSET: "BQQ",
    DATA_END: "I",
}

TEXTS = [
    b"",
    b"/points",
    b"zstd",
    b"lz4",
    b"cdr",
    b"sensor_msgs/msg/PointCloud2",
    b"\xff\xfe",
    b"\x1b[2J",
    b"a" * 300,
]


@dataclass
class Shape:
    """How records become a file."""

    per_chunk: int
    compression: str
    crcs: bool
    index: bool
    summary: bool
    statistics: bool

    @staticmethod
    def random(rng):
        compression = rng.choice(["", "lz4", "zstd"])
        flags = [rng.random() < chance for chance in (0.7, 0.8, 0.8, 0.7)]
        return Shape(rng.choice([0, 1, 3, 100]), compression, *flags)


def taken_apart(data, at=len(MAGIC)):
    """Schemas, channels, messages, attachments and metadata of a recording in order, as far as it
    can be read. No checksum is checked, and no record is looked into."""
    while at + 9 <= len(data):
        opcode, length = struct.unpack_from("<BQ", data, at)
        body = data[at + 9 : at + 9 + length]
        at += 9 + length
        if len(body) < length or opcode == DATA_END:
            return
        if opcode == CHUNK:
            name = struct.unpack_from("<I", body, 28)[0]
            packed = body[32 + name + 8 :]
            unpack = {b"": bytes, b"lz4": lz4.frame.decompress, b"zstd": unpacked_zstd}[
                body[32 : 32 + name]
            ]
            yield from taken_apart(unpack(packed), 0)
        elif opcode in (SCHEMA, CHANNEL, MESSAGE, ATTACHMENT, METADATA):
            yield opcode, body


def unpacked_zstd(packed):
    return zstandard.ZstdDecompressor().decompressobj().decompress(packed)


class Writer:
    """Puts records together. `hook(opcode, number, body)` gives the bytes of each record; `number`
    counts the records of its kind."""

    def __init__(self, shape, hook):
        self.shape, self.hook, self.numbers, self.out = shape, hook, Counter(), BytesIO()
        self.chunks = []

    def put(self, out, opcode, body):
        """Writes a record, and returns its bytes."""
        written = self.hook(opcode, self.numbers[opcode], body)
        self.numbers[opcode] += 1
        out.write(written)
        return written

    def crc(self, data):
        return zlib.crc32(data) if self.shape.crcs else 0

    def chunk(self, group):
        inner, places, times = BytesIO(), {}, []
        for opcode, body in group:
            at = inner.tell()
            written = self.put(inner, opcode, body)
            if written[:1] == bytes([MESSAGE]) and len(written) >= 9 + 14:
                channel, _, time = struct.unpack_from("<HIQ", written, 9)
                places.setdefault(channel, []).append((time, at))
                times.append(time)
        raw, name = inner.getvalue(), self.shape.compression
        packed = {
            "": bytes,
            "lz4": lz4.frame.compress,
            "zstd": zstandard.ZstdCompressor(1).compress,
        }[name](raw)
        first, last = min(times, default=0), max(times, default=0)
        body = struct.pack("<QQQI", first, last, len(raw), self.crc(raw)) + text(name.encode())
        start = self.out.tell()
        self.put(self.out, CHUNK, body + struct.pack("<Q", len(packed)) + packed)
        length, offsets, indexes = self.out.tell() - start, [], self.out.tell()
        for channel, entries in places.items() if self.shape.index else ():
            offsets.append(struct.pack("<HQ", channel, self.out.tell()))
            self.put(
                self.out,
                MESSAGE_INDEX,
                struct.pack("<H", channel) + array(struct.pack("<QQ", *e) for e in entries),
            )
        index = struct.pack("<QQQQ", first, last, start, length) + array(offsets)
        index += struct.pack("<Q", self.out.tell() - indexes) + text(name.encode())
        self.chunks.append(index + struct.pack("<QQ", len(packed), len(raw)))

    def written(self, records):
        self.out.write(MAGIC)
        self.put(self.out, HEADER, text(b"ros2") + text(b"damage.py"))
        group, messages = [], 0
        for opcode, body in records:
            if not self.shape.per_chunk or opcode in (ATTACHMENT, METADATA):
                self.put(self.out, opcode, body)
                continue
            group.append((opcode, body))
            messages += opcode == MESSAGE
            if messages == self.shape.per_chunk:
                self.chunk(group)
                group, messages = [], 0
        if group:
            self.chunk(group)
        self.put(self.out, DATA_END, struct.pack("<I", self.crc(self.out.getvalue())))
        self.finish(records)
        return self.out.getvalue()

    def finish(self, records):
        start, groups = self.out.tell(), []
        definitions = {
            kind: [body for opcode, body in records if opcode == kind] for kind in (SCHEMA, CHANNEL)
        }
        kinds = list(definitions.items()) if self.shape.summary else []
        if self.shape.summary and self.shape.index:
            kinds.append((CHUNK_INDEX, self.chunks))
        if self.shape.summary and self.shape.statistics:
            kinds.append((STATISTICS, [statistics(records, len(self.chunks))]))
        for kind, bodies in kinds:
            begin = self.out.tell()
            for body in bodies:
                self.put(self.out, kind, body)
            if bodies:
                groups.append((kind, begin, self.out.tell() - begin))
        offsets = self.out.tell()
        for group in groups:
            self.put(self.out, SUMMARY_OFFSET, struct.pack("<BQQ", *group))
        places = (start, offsets) if self.shape.summary else (0, 0)
        self.put(self.out, FOOTER, struct.pack("<QQ", *places))
        # Behind the hook, so that the checksum is right whatever it did.
        self.out.write(struct.pack("<I", self.crc(self.out.getvalue()[start:])) + MAGIC)


def statistics(records, chunks):
    times = [struct.unpack_from("<HIQ", body) for opcode, body in records if opcode == MESSAGE]
    counts = {}
    for channel, _, _ in times:
        counts[channel] = counts.get(channel, 0) + 1
    count = {kind: sum(opcode == kind for opcode, _ in records) for kind in LAYOUTS}
    kinds = [count[kind] for kind in (SCHEMA, CHANNEL, ATTACHMENT, METADATA)]
    logged = [time for _, _, time in times]
    body = struct.pack("<QHIIIIQQ", len(times), *kinds, chunks, min(logged), max(logged))
    return body + array(struct.pack("<HQ", *item) for item in counts.items())


def text(value):
    return struct.pack("<I", len(value)) + value


def array(items):
    return text(b"".join(items))


def record(opcode, body, length=None):
    """A record. The checksum of an attachment is made right; that of a footer is written later."""
    if opcode == ATTACHMENT:
        body = body[:-4] + struct.pack("<I", zlib.crc32(body[:-4]))
    size = len(body) + 4 * (opcode == FOOTER) if length is None else length
    return struct.pack("<BQ", opcode & 255, size & (1 << 64) - 1) + body


# What is changed ---------------------------------------------------------------------------------


def places(layout, body):
    """Numbers as (letter, offset) and texts as (start, end) with their length before them."""
    numbers, texts, at = [], [], 0

    def walk(layout, end):
        nonlocal at
        rest = list(layout)
        while rest and at < end:
            letter = rest.pop(0)
            if letter in "sb(l":
                wide = letter == "l"
                numbers.append(("Q" if wide else "I", at))
                length = struct.unpack_from("<Q" if wide else "<I", body, at)[0]
                at += 8 if wide else 4
                if letter == "(":
                    close = rest.index(")")
                    inner, rest[: close + 1] = rest[:close], []
                    last = at + length
                    while at < last:
                        walk(inner, last)
                else:
                    texts.append((at, at + length))
                    at += length
            elif letter != "*":
                numbers.append((letter, at))
                at += struct.calcsize(letter)

    walk(layout, len(body))
    return numbers, texts


def cloud_places(data, base):
    """The same of a PointCloud2 message in CDR, whose points begin `points` bytes behind `base`."""
    numbers, texts, at = [], [], 4

    def number(letter):
        nonlocal at
        size = struct.calcsize(letter)
        at += -(at - 4) % size
        numbers.append((letter, base + at))
        at += size
        return struct.unpack_from("<" + letter, data, at - size)[0]

    def name():
        nonlocal at
        length = number("I")
        texts.append((base + at, base + at + length))
        at += length

    number("I"), number("I"), name(), number("I"), number("I")
    for _ in range(number("I")):
        name(), number("I"), number("B"), number("I")
    number("B"), number("I"), number("I"), number("I")
    return numbers, texts, base + at


def wild(rng, letter, old):
    most = (1 << 8 * struct.calcsize(letter)) - 1
    other = [
        0,
        1,
        2,
        7,
        255,
        65_536,
        10**11,
        old + 1,
        old - 1,
        old * 2,
        old // 2,
        most,
        most >> 1,
        rng.randrange(most),
    ]
    return rng.choice(other) & most


def replaced(body, start, end, new):
    return body[:start] + new + body[end:]


def with_number(rng, body, numbers):
    letter, at = rng.choice(numbers)
    old = struct.unpack_from("<" + letter, body, at)[0]
    new = struct.pack("<" + letter, wild(rng, letter, old))
    return replaced(body, at, at + len(new), new)


def change_number(rng, opcode, body):
    return record(opcode, with_number(rng, body, places(LAYOUTS[opcode], body)[0]))


def change_text(rng, opcode, body):
    start, end = rng.choice(places(LAYOUTS[opcode], body)[1])
    return record(opcode, replaced(body, start - 4, end, text(rng.choice(TEXTS))))


def change_length(rng, opcode, body):
    size = len(body) + 4 * (opcode == FOOTER)
    return record(opcode, body, wild(rng, "Q", size))


def change_opcode(rng, opcode, body):
    return record(
        rng.choice([other for other in range(1, 16) if other != opcode] + [0, 16, 128, 255]), body
    )


def change_size(rng, opcode, body):
    if rng.random() < 0.3:
        return record(opcode, body + rng.randbytes(rng.randrange(1, 40)))
    return record(opcode, body[: rng.randrange(len(body))])


def change_number_of_records(rng, opcode, body):
    return record(opcode, body) * rng.choice([0, 2, 3])


def change_packed(rng, opcode, body):
    """Bytes of a chunk's records as they are in the file."""
    start = places(LAYOUTS[opcode], body)[1][-1][0]
    changed = bytearray(body)
    for _ in range(rng.choice([1, 1, 5])):
        changed[rng.randrange(start, len(body))] ^= 1 << rng.randrange(8)
    return record(opcode, bytes(changed))


def change_cloud(rng, opcode, body):
    """A number of a cloud's head, or one of its names."""
    numbers, texts, _ = cloud_places(body[22:], 22)
    if rng.random() < 0.8:
        return record(opcode, with_number(rng, body, numbers))
    start, end = rng.choice(texts)
    return record(opcode, replaced(body, start, end, rng.randbytes(end - start)))


def change_points(rng, opcode, body):
    """Numbers of a cloud's points."""
    start, changed = cloud_places(body[22:], 22)[2], bytearray(body)
    for _ in range(rng.choice([1, 30, 1000])):
        number = rng.choice([float("nan"), float("inf"), 3e38, -1e30, 1e19, 1e-45, 0.0])
        struct.pack_into("<f", changed, rng.randrange(start, len(body) - 4), number)
    return record(opcode, bytes(changed))


ALL = set(LAYOUTS)
WITH_TEXTS = {HEADER, SCHEMA, CHANNEL, CHUNK, CHUNK_INDEX, ATTACHMENT, METADATA}
CLOUD = {"cloud"}

# What is changed in words, which records it is changed in, and how.
CHANGES = {
    "a number of a record": (ALL, change_number),
    "a text of a record": (WITH_TEXTS, change_text),
    "the length of a record": (ALL, change_length),
    "the opcode of a record": (ALL, change_opcode),
    "a record is cut or has more": (ALL - {FOOTER}, change_size),
    "a record is missing or repeated": (ALL - {FOOTER}, change_number_of_records),
    "bytes within a chunk": ({CHUNK}, change_packed),
    "a number or name of a cloud": (CLOUD, change_cloud),
    "coordinates of a cloud": (CLOUD, change_points),
}
SEVERAL = "two or three of these"
KINDS = [*CHANGES, SEVERAL]


def damaged(rng, records, change, cloud_channel):
    """The bytes of a recording in which something is changed."""
    names = rng.choices(list(CHANGES), k=rng.choice([2, 3])) if change == SEVERAL else [change]
    shape = Shape.random(rng)
    if "bytes within a chunk" in names:
        shape.per_chunk = shape.per_chunk or 1
    seen = {}

    def note(opcode, number, body):
        is_cloud = opcode == MESSAGE and body[:2] == struct.pack("<H", cloud_channel)
        for kind in [opcode, "cloud"][: 1 + is_cloud]:
            seen.setdefault(kind, []).append((opcode, number))
        return record(opcode, body)

    Writer(shape, note).written(records)
    changes = {}
    for name in names:
        kinds, how = CHANGES[name]
        changes[rng.choice(seen[rng.choice(sorted(seen.keys() & kinds, key=str))])] = how

    def apply(opcode, number, body):
        how = changes.get((opcode, number))
        return how(rng, opcode, body) if how else record(opcode, body)

    return Writer(shape, apply).written(records)
