//! `.pcd`, Point Cloud Library's format: lines of a header, then points as text, as bytes, or field
//! by field and compressed with LZF.
//!
//! Written after the format's description (pointclouds.org, "The PCD file format") for version 0.7,
//! with what older files differ in: `COLUMNS` for `FIELDS`, no `COUNT`, `HEIGHT` or `WIDTH`. Fields
//! called `_` are padding.
//!
//! Ours because the crate `pcd-rs` makes vectors of every point, which would have to be packed
//! again into the bytes that the file had (docs/decisions/0005-own-scan-files.md).

use super::lzf::decompress;
use super::scan::{Parsed, Scan, datatype, field, shape};
use crate::messages::clouds::{Datatype, PointField};

/// Where the header has to end; no point cloud has that many fields.
const MOST_HEADER: usize = 1 << 16;

/// Name of fields that are padding.
const PADDING: &str = "_";

struct Header {
    fields: Vec<Column>,
    /// Bytes of a point, padding included.
    step: u32,
    height: u64,
    width: u64,
    encoding: Encoding,
    has_viewpoint: bool,
    /// Bytes of the header.
    length: usize,
}

struct Column {
    name: String,
    kind: char,
    size: u32,
    count: u32,
    offset: u32,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Encoding {
    Ascii,
    Binary,
    Compressed,
}

pub(super) fn parse(bytes: &[u8]) -> Parsed<Scan> {
    let header = Header::parse(bytes)?;
    let [height, width] = shape(header.height, header.width, header.step)?;
    let points = height as usize * width as usize;
    let body = &bytes[header.length..];
    let data = match header.encoding {
        Encoding::Ascii => ascii(&header, body, points)?,
        Encoding::Binary => exactly(body, points * header.step as usize)?.to_vec(),
        Encoding::Compressed => compressed(&header, body, points)?,
    };
    let (fields, mut left_out) = header.fields();
    if header.has_viewpoint {
        left_out.push("the viewpoint, which is not the origin".into());
    }
    let point_step = header.step;
    Ok(Scan { fields, point_step, height, width, is_bigendian: false, data, left_out })
}

impl Header {
    fn parse(bytes: &[u8]) -> Parsed<Self> {
        let mut entries: Vec<(&str, Vec<&str>)> = Vec::new();
        let mut length = 0;
        for line in bytes[..bytes.len().min(MOST_HEADER)].split_inclusive(|&byte| byte == b'\n') {
            length += line.len();
            let text =
                std::str::from_utf8(line).map_err(|_| no_header("a line that is not text"))?;
            let mut words = text.split_ascii_whitespace();
            let Some(key) = words.next().filter(|key| !key.starts_with('#')) else { continue };
            if entries.iter().any(|&(other, _)| other == key) {
                return Err(format!("two lines {key} in the header"));
            }
            entries.push((key, words.collect()));
            if key == "DATA" {
                return Entries(entries).header(length);
            }
        }
        Err(no_header("no line DATA"))
    }

    /// The fields that a message can have, and what it cannot, in words.
    fn fields(&self) -> (Vec<PointField>, Vec<String>) {
        let (mut fields, mut left_out) = (Vec::new(), Vec::new());
        for column in self.fields.iter().filter(|column| column.name != PADDING) {
            match column.datatype() {
                Some(datatype) => {
                    fields.push(field(&column.name, column.offset, datatype, column.count));
                }
                None => left_out.push(format!(
                    "field `{}`, whose type {}{} a message does not have",
                    column.name,
                    column.kind.to_ascii_uppercase(),
                    column.size
                )),
            }
        }
        (fields, left_out)
    }
}

fn no_header(problem: &str) -> String {
    format!("no header of a PCD file: {problem}")
}

/// Lines of a header: key and words.
struct Entries<'a>(Vec<(&'a str, Vec<&'a str>)>);

impl Entries<'_> {
    fn words(&self, key: &str) -> Option<&[&str]> {
        self.0.iter().find(|(other, _)| *other == key).map(|(_, words)| words.as_slice())
    }

    /// The numbers of a line, one for each field.
    fn numbers(&self, key: &str, fields: usize) -> Parsed<Vec<u32>> {
        let words = self.words(key).ok_or_else(|| no_header(&format!("no line {key}")))?;
        if words.len() != fields {
            return Err(format!("{} numbers in line {key} for {fields} fields", words.len()));
        }
        words.iter().map(|word| number(key, word)).collect()
    }

    fn whole(&self, key: &str) -> Parsed<Option<u64>> {
        match self.words(key) {
            None => Ok(None),
            Some([word]) => number(key, word).map(Some),
            Some(words) => Err(format!("{} words in line {key} where one belongs", words.len())),
        }
    }

    fn header(&self, length: usize) -> Parsed<Header> {
        let encoding = match self.words("DATA") {
            Some(["ascii"]) => Encoding::Ascii,
            Some(["binary"]) => Encoding::Binary,
            Some(["binary_compressed"]) => Encoding::Compressed,
            other => return Err(format!("unknown encoding `{}`", other.unwrap_or(&[]).join(" "))),
        };
        let (fields, step) = self.columns()?;
        let (height, width) = self.shape()?;
        let viewpoint = self.words("VIEWPOINT").unwrap_or(&[]);
        let viewpoint = viewpoint.iter().map(|word| word.parse::<f64>());
        let origin = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0];
        let has_viewpoint = viewpoint.zip(origin).any(|(word, origin)| word != Ok(origin));
        Ok(Header { fields, step, height, width, encoding, has_viewpoint, length })
    }

    fn columns(&self) -> Parsed<(Vec<Column>, u32)> {
        let names = self.words("FIELDS").or_else(|| self.words("COLUMNS"));
        let names = names.ok_or_else(|| no_header("no line FIELDS"))?;
        let sizes = self.numbers("SIZE", names.len())?;
        let counts = match self.words("COUNT") {
            Some(_) => self.numbers("COUNT", names.len())?,
            None => vec![1; names.len()],
        };
        let kinds = self.words("TYPE").unwrap_or(&[]);
        if kinds.len() != names.len() {
            return Err(format!("{} types for {} fields", kinds.len(), names.len()));
        }
        let (mut columns, mut offset) = (Vec::with_capacity(names.len()), 0_u32);
        for (((&name, kind), size), count) in names.iter().zip(kinds).zip(sizes).zip(counts) {
            let kind = match *kind {
                "F" => 'f',
                "I" => 'i',
                "U" => 'u',
                other => return Err(format!("field `{name}` has the unknown type {other}")),
            };
            if !matches!(size, 1 | 2 | 4 | 8) || count == 0 {
                return Err(format!("field `{name}` of {count} x {size} bytes"));
            }
            columns.push(Column { name: name.to_owned(), kind, size, count, offset });
            offset = size
                .checked_mul(count)
                .and_then(|bytes| offset.checked_add(bytes))
                .ok_or_else(|| format!("field `{name}` of {count} x {size} bytes"))?;
        }
        Ok((columns, offset))
    }

    fn shape(&self) -> Parsed<(u64, u64)> {
        let (height, width) = (self.whole("HEIGHT")?.unwrap_or(1), self.whole("WIDTH")?);
        let points = self.whole("POINTS")?;
        let width = width.or(points).ok_or_else(|| no_header("neither WIDTH nor POINTS"))?;
        if points.is_some_and(|points| height.checked_mul(width) != Some(points)) {
            let points = points.unwrap_or(0);
            return Err(format!("POINTS {points} where HEIGHT x WIDTH is {height} x {width}"));
        }
        Ok((height, width))
    }
}

fn number<T: std::str::FromStr>(key: &str, word: &str) -> Parsed<T> {
    word.parse().map_err(|_| format!("`{word}` in line {key} is no number"))
}

impl Column {
    fn datatype(&self) -> Option<Datatype> {
        datatype(self.kind, self.size)
    }

    fn bytes(&self) -> usize {
        self.size as usize * self.count as usize
    }

    /// Appends a number written as text, little endian.
    fn append(&self, word: &str, out: &mut Vec<u8>) -> Option<()> {
        match (self.kind, self.size) {
            ('f', 4) => out.extend(float::<f32>(word)?.to_le_bytes()),
            ('f', 8) => out.extend(float::<f64>(word)?.to_le_bytes()),
            ('i', 1) => out.extend(word.parse::<i8>().ok()?.to_le_bytes()),
            ('i', 2) => out.extend(word.parse::<i16>().ok()?.to_le_bytes()),
            ('i', 4) => out.extend(word.parse::<i32>().ok()?.to_le_bytes()),
            ('i', 8) => out.extend(word.parse::<i64>().ok()?.to_le_bytes()),
            ('u', 1) => out.extend(word.parse::<u8>().ok()?.to_le_bytes()),
            ('u', 2) => out.extend(word.parse::<u16>().ok()?.to_le_bytes()),
            ('u', 4) => out.extend(word.parse::<u32>().ok()?.to_le_bytes()),
            ('u', 8) => out.extend(word.parse::<u64>().ok()?.to_le_bytes()),
            _ => return None,
        }
        Some(())
    }
}

/// A number; `-nan`, which C writes for some not-a-numbers, too.
fn float<T: std::str::FromStr>(word: &str) -> Option<T> {
    match word {
        "-nan" => "nan".parse().ok(),
        _ => word.parse().ok(),
    }
}

/// A line for each point, a word for each number.
fn ascii(header: &Header, body: &[u8], points: usize) -> Parsed<Vec<u8>> {
    let text = std::str::from_utf8(body).map_err(|_| "the points are not text".to_owned())?;
    let is_line = |line: &&str| !line.trim().is_empty() && !line.trim_start().starts_with('#');
    let mut data = Vec::new();
    let mut found = 0;
    for line in text.lines().filter(is_line) {
        if found == points {
            return Err(format!("more than the {points} points of the header"));
        }
        ascii_point(header, line, &mut data)
            .map_err(|problem| format!("point {found}: {problem}"))?;
        found += 1;
    }
    match found == points {
        true => Ok(data),
        false => Err(format!("{found} points where the header has {points}")),
    }
}

fn ascii_point(header: &Header, line: &str, data: &mut Vec<u8>) -> Parsed<()> {
    let mut words = line.split_ascii_whitespace();
    for column in &header.fields {
        for _ in 0..column.count {
            let word = words.next().ok_or_else(|| format!("no number for `{}`", column.name))?;
            column.append(word, data).ok_or_else(|| {
                format!(
                    "`{word}` is no number for `{}` ({}{})",
                    column.name, column.kind, column.size
                )
            })?;
        }
    }
    match words.next() {
        None => Ok(()),
        Some(word) => Err(format!("`{word}` behind the last field")),
    }
}

/// The first bytes of a body; what follows may only be zeros, with which some writers fill a page.
fn exactly(body: &[u8], length: usize) -> Parsed<&[u8]> {
    let Some((data, rest)) = body.split_at_checked(length) else {
        return Err(format!("{} bytes of points where the header has {length}", body.len()));
    };
    match rest.iter().all(|&byte| byte == 0) {
        true => Ok(data),
        false => Err(format!("{} bytes of points where the header has {length}", body.len())),
    }
}

/// Two sizes, then the fields one behind the other, compressed. Padding is usually not among them.
fn compressed(header: &Header, body: &[u8], points: usize) -> Parsed<Vec<u8>> {
    let ([packed, unpacked], body) = match body.as_chunks::<4>() {
        (sizes, _) if sizes.len() >= 2 => {
            ([sizes[0], sizes[1]].map(u32::from_le_bytes), &body[8..])
        }
        _ => return Err("the sizes of the compressed points are missing".into()),
    };
    let has_padding = |is_stored: bool| {
        let columns = header.fields.iter().filter(|column| is_stored || column.name != PADDING);
        (is_stored, points * columns.map(Column::bytes).sum::<usize>())
    };
    let (is_padding_stored, _) = [has_padding(false), has_padding(true)]
        .into_iter()
        .find(|&(_, bytes)| bytes == unpacked as usize)
        .ok_or_else(|| {
            let bytes = has_padding(false).1;
            format!("{unpacked} bytes of points were compressed where the header has {bytes}")
        })?;
    let columns = decompress(exactly(body, packed as usize)?, unpacked as usize)?;
    Ok(rows(header, &columns, points, is_padding_stored))
}

/// Fields one behind the other as points one behind the other.
fn rows(header: &Header, mut columns: &[u8], points: usize, is_padding_stored: bool) -> Vec<u8> {
    let step = header.step as usize;
    let mut data = vec![0; points * step];
    for column in &header.fields {
        if column.name == PADDING && !is_padding_stored {
            continue;
        }
        let (size, offset) = (column.bytes(), column.offset as usize);
        let (values, rest) = columns.split_at(points * size);
        for (point, value) in data.chunks_exact_mut(step).zip(values.chunks_exact(size)) {
            point[offset..offset + size].copy_from_slice(value);
        }
        columns = rest;
    }
    data
}
