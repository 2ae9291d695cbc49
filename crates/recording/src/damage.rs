//! What can be wrong with the bytes of a recording.

/// What is wrong at a place in a recording. Records are named with their article, as in `a chunk
/// record`; lengths are bytes.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the fields are the words of the messages")]
pub enum Damage {
    /// The file is not an MCAP that can be read: `kind` says what it is, and what to do.
    #[error("{kind}")]
    NotARecording { kind: String },

    /// The checksum in the file is not that of the bytes it covers.
    #[error("{covered} CRC mismatch: stored {stored:08x}, computed {computed:08x}")]
    Checksum { covered: String, stored: u32, computed: u32 },

    /// The content of a record is not what its opcode says.
    #[error("{record} cannot be parsed")]
    Unreadable { record: &'static str },

    /// A record claims more bytes than are left in the file, or than are read.
    #[error(
        "{record} claims {length} bytes; {}{most} are the most that can be read here",
        left_in_file(*left)
    )]
    TooLong { record: &'static str, length: u64, left: u64, most: u64 },

    /// The first record is not the header.
    #[error("the file starts with {record}, not with its header")]
    NoHeader { record: &'static str },

    /// A record stands where the format does not allow it.
    #[error("{record} (opcode {opcode:#04x}) {place}")]
    Misplaced { record: &'static str, opcode: u8, place: &'static str },

    /// A record is of a later version of the format.
    #[error(
        "a record of {length} bytes with opcode {opcode:#04x}, which this version of the format \
         does not know, is left out"
    )]
    UnknownRecord { opcode: u8, length: u64 },

    /// A message belongs to a channel that was not defined before it.
    #[error(
        "a message (sequence {sequence}, log time {log_time} ns) of channel {channel}, which has \
         not been defined"
    )]
    UndefinedChannel { channel: u16, sequence: u32, log_time: u64 },

    /// A channel that the summary does not list, from which everything else was planned.
    #[error(
        "channel {channel} (`{topic}`) is defined here and missing in the summary at the end of \
         the file, which is wrong: write the summary anew, as with `mcap recover`"
    )]
    UnlistedChannel { channel: u16, topic: String },

    /// A channel has a schema that was not defined before it.
    #[error("channel {channel} (`{topic}`) has schema {schema}, which has not been defined")]
    UndefinedSchema { channel: u16, topic: String, schema: u16 },

    /// A schema has the id that stands for no schema.
    #[error("schema `{name}` has the id 0, which means no schema")]
    SchemaIdZero { name: String },

    /// Two schemas or two channels have the same id.
    #[error("{kind} {id} is defined twice, as `{first}` and differently as `{second}`")]
    DefinedTwice { kind: &'static str, id: u16, first: String, second: String },

    /// A chunk has more or fewer bytes than its header says.
    #[error(
        "the chunk claims {claimed} bytes of records and has {found}{}",
        or_more(*claimed, *found)
    )]
    ChunkSize { claimed: u64, found: u64 },

    /// A chunk claims to hold so much that it is not unpacked.
    #[error(
        "the chunk claims {claimed} bytes of records in {compressed} bytes, more than the {most} \
         that are believed"
    )]
    ChunkTooLarge { claimed: u64, compressed: u64, most: u64 },

    /// A recording unpacks to more than is read.
    #[error(
        "up to here the recording unpacks to more than {most} bytes, far more than recordings do \
         for their size; if you trust it, allow more (`--max-unpacked`)"
    )]
    UnpacksToTooMuch { most: u64 },

    /// The records of a chunk end within one.
    #[error("the chunk ends in the middle of {record}")]
    ChunkEnds { record: &'static str },

    /// A chunk has a compression that cannot be read.
    #[error("the chunk is compressed with `{name}`, which cannot be read here")]
    Compression { name: String },

    /// The compressed bytes of a chunk are damaged.
    #[error("the chunk cannot be decompressed: {problem}")]
    Decompression { problem: String },

    /// A chunk is damaged that holds messages of these topics, by the summary.
    #[error("{damage}; the chunk holds messages of {}", topics.join(", "))]
    OfTopics { damage: Box<Damage>, topics: Vec<String> },

    /// The summary lists a chunk where none is.
    #[error("the index says that a chunk begins here, and none does")]
    NoChunk,

    /// A message index does not follow a chunk.
    #[error(
        "an index of messages without the chunk that should be before it; a chunk may be missing"
    )]
    LostChunk,

    /// The file ends within a record.
    #[error(
        "the file is cut off in {record} of {length} bytes, of which {left} are there{}",
        if *is_salvaged { "; its messages up to there are kept, unchecked" } else { "" }
    )]
    CutInRecord { record: &'static str, length: u64, left: u64, is_salvaged: bool },

    /// The file ends between records, or in the few bytes before or behind one.
    #[error("{place}")]
    CutOff { place: &'static str },

    /// The file ends as a recording does, but its last records are missing.
    #[error("the recording ends without the records that should close it")]
    NoEnd,

    /// The footer points to another place than the summary's.
    #[error("the footer says that the summary starts at byte {stored}, but it starts at {found}")]
    SummaryStart { stored: u64, found: u64 },

    /// The summary counts other numbers of records than were read.
    #[error("the summary counts {stored} {kind}, the file has {found}")]
    SummaryCount { kind: &'static str, stored: u64, found: u64 },

    /// The summary is damaged.
    #[error(
        "the summary at the end of the file is damaged ({damage}); the messages are not affected, \
         but what stands only in the summary is left out"
    )]
    Summary { damage: Box<Damage> },

    /// Bytes follow the end of the recording.
    #[error("there are bytes behind the end of the recording")]
    BytesBehindEnd,

    /// Zeros follow the end of the recording.
    #[error("{zeros} zero bytes follow the end of the recording")]
    ZerosBehindEnd { zeros: u64 },

    /// The file ends as it is cut off, but for zeros in the place of what is missing.
    #[error(
        "{damage}; {zeros} zero bytes follow, which were reserved for the recording and never \
         written"
    )]
    BeforeZeros { damage: Box<Damage>, zeros: u64 },

    /// Another recording follows the end of the first.
    #[error(
        "a second recording begins behind the end of the first and is left out: `tail -c +{} FILE \
         > SECOND.mcap` makes it a file of its own",
        length + 1
    )]
    SecondRecording { length: u64 },

    /// Something else than the closing magic follows the footer.
    #[error("the footer is not followed by the end of the file")]
    NoEndBehindFooter,
}

impl Damage {
    /// Fails if a checksum is stored and not that of the bytes.
    pub(crate) fn check(covered: &str, stored: u32, computed: u32) -> Result<(), Damage> {
        match stored == 0 || stored == computed {
            true => Ok(()),
            false => Err(Damage::Checksum { covered: covered.to_owned(), stored, computed }),
        }
    }
}

/// Bytes left in the file; those of a stream are not known.
fn left_in_file(left: u64) -> String {
    match left {
        u64::MAX => String::new(),
        left => format!("{left} are left in the file, and "),
    }
}

/// Unpacking stops behind the first byte too many.
fn or_more(claimed: u64, found: u64) -> &'static str {
    if found > claimed { " or more" } else { "" }
}
