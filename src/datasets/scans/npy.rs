//! `.npy`, numpy's format for one array: a header in Python's literals, then the numbers.
//!
//! Written after numpy's description (numpy.lib.format), versions 1 to 3. Points are the rows of an
//! N x C array, the pixels of an H x W x C array, or the records of an N or H x W array of a
//! structured type, whose names are kept.
//!
//! The crate `npyz` is not used: it would read the header alone (the numbers stay as they are),
//! does not know titles of fields nor Python 2's long integers, makes room for a header of any
//! length that is claimed, and brings some twenty crates with it.

use serde_json::Value;

use super::columns::{Columns, NAMED};
use super::scan::{Parsed, Scan, datatype, field, shape};
use crate::datasets::yaml;
use crate::messages::clouds::{Datatype, PointField};
use crate::messages::ros::ByteOrder;

const MAGIC: &[u8] = b"\x93NUMPY";

pub(super) fn parse(mut bytes: Vec<u8>, columns: Option<&Columns>) -> Parsed<Scan> {
    let (header, start) = header(&bytes)?;
    let is_fortran = match header.get("fortran_order") {
        Some(Value::Bool(is_fortran)) => *is_fortran,
        _ => return Err("no fortran_order in the header".into()),
    };
    let dimensions = dimensions(&header)?;
    let layout = match header.get("descr") {
        Some(Value::String(text)) => plain(text, &dimensions, columns)?,
        Some(Value::Array(_)) if columns.is_some() => return Err(NAMED.into()),
        Some(Value::Array(fields)) => structured(fields, &dimensions)?,
        _ => return Err("no descr in the header".into()),
    };
    let [height, width] = shape(layout.height, layout.width, layout.step)?;
    let expected = height as usize * width as usize * layout.step as usize;
    let found = bytes.len() - start;
    if found != expected {
        return Err(format!("{found} bytes of numbers where the header has {expected}"));
    }
    bytes.drain(..start);
    let data = if is_fortran { last_fastest(&bytes, &dimensions, layout.element) } else { bytes };
    Ok(Scan {
        fields: layout.fields,
        point_step: layout.step,
        height,
        width,
        is_bigendian: layout.is_bigendian,
        data,
        left_out: layout.left_out,
    })
}

/// The numbers of an array of one plain type, the last dimension fastest.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::datasets) enum Numbers {
    /// Of integers or truth values.
    Integers(Vec<i64>),
    /// Of floats.
    Floats(Vec<f32>),
}

/// Reads an array of numbers: its dimensions, and the numbers.
pub(in crate::datasets) fn numbers(bytes: &[u8]) -> Parsed<(Vec<usize>, Numbers)> {
    let (header, start) = header(bytes)?;
    let Some(Value::String(descr)) = header.get("descr") else {
        return Err("records, where plain numbers are expected".into());
    };
    let dimensions = dimensions(&header)?;
    let (kind, order) = (descr.trim_start_matches(['<', '>', '|']), Type::parse(descr)?);
    let size = order.size as usize;
    let count = dimensions.iter().try_fold(1_u64, |count, &side| count.checked_mul(side));
    let expected = count.and_then(|count| count.checked_mul(size as u64));
    let found = bytes.len() - start;
    if expected != Some(found as u64) {
        return Err(format!("{found} bytes of numbers for {dimensions:?} of type {descr}"));
    }
    let is_fortran = matches!(header.get("fortran_order"), Some(Value::Bool(true)));
    let data = match is_fortran && dimensions.len() > 1 {
        true => last_fastest(&bytes[start..], &dimensions, size),
        false => bytes[start..].to_vec(),
    };
    let order = match order.is_bigendian {
        Some(true) => ByteOrder::Big,
        _ => ByteOrder::Little,
    };
    macro_rules! each {
        ($get:ident as $to:ty) => {
            data.chunks_exact(size)
                .filter_map(|bytes| Some(order.$get(*bytes.first_chunk()?) as $to))
                .collect()
        };
    }
    let numbers = match kind {
        "i1" => Numbers::Integers(each!(get_i8 as i64)),
        "u1" | "b1" => Numbers::Integers(each!(get_u8 as i64)),
        "i2" => Numbers::Integers(each!(get_i16 as i64)),
        "u2" => Numbers::Integers(each!(get_u16 as i64)),
        "i4" => Numbers::Integers(each!(get_i32 as i64)),
        "u4" => Numbers::Integers(each!(get_u32 as i64)),
        "i8" => Numbers::Integers(each!(get_i64 as i64)),
        "u8" => Numbers::Integers(each!(get_u64 as i64)),
        "f4" => Numbers::Floats(each!(get_f32 as f32)),
        "f8" => Numbers::Floats(each!(get_f64 as f32)),
        _ => return Err(format!("numbers of type {descr}")),
    };
    Ok((dimensions.iter().map(|&side| side as usize).collect(), numbers))
}

/// The header and where the numbers begin.
fn header(bytes: &[u8]) -> Parsed<(Value, usize)> {
    let no_header = || "no header of a numpy file".to_owned();
    let rest = bytes.strip_prefix(MAGIC).ok_or_else(no_header)?;
    let (version, rest) = rest.split_first_chunk::<2>().ok_or_else(no_header)?;
    let (length, rest) = match version {
        [1, _] => rest.split_first_chunk().map(|(l, rest)| (u16::from_le_bytes(*l).into(), rest)),
        [2 | 3, _] => rest.split_first_chunk().map(|(l, rest)| (u32::from_le_bytes(*l), rest)),
        [major, minor] => return Err(format!("version {major}.{minor} of the format")),
    }
    .ok_or_else(no_header)?;
    let text = rest.get(..length as usize).ok_or("the file ends within its header")?;
    let text = std::str::from_utf8(text).map_err(|_| "the header is not text".to_owned())?;
    Ok((literal(text)?, bytes.len() - rest.len() + length as usize))
}

/// A literal of Python: with brackets for its parentheses it is YAML.
fn literal(text: &str) -> Parsed<Value> {
    // A name with an escape has no place in a message anyway.
    if let Some(at) = text.find('\\') {
        return Err(format!("the header cannot be read at `\\` (byte {at})"));
    }
    let (mut yaml, mut quote) = (String::with_capacity(text.len()), None);
    for c in text.chars() {
        match quote {
            Some(opened) if c == opened => quote = None,
            None if c == '\'' || c == '"' => quote = Some(c),
            _ => {}
        }
        yaml.push(match (quote, c) {
            (None, '(') => '[',
            (None, ')') => ']',
            // Python 2 wrote long integers as `7L`.
            (None, 'L') => ' ',
            _ => c,
        });
    }
    yaml::parse(&yaml).map_err(|problem| format!("the header cannot be read at {problem}"))
}

fn dimensions(header: &Value) -> Parsed<Vec<u64>> {
    let Some(Value::Array(values)) = header.get("shape") else {
        return Err("no shape in the header".into());
    };
    let number = |value: &Value| {
        value.as_u64().ok_or_else(|| format!("the shape cannot be read at `{value}`"))
    };
    values.iter().map(number).collect()
}

/// How points lie in the numbers.
struct Layout {
    fields: Vec<PointField>,
    left_out: Vec<String>,
    /// Bytes of a point.
    step: u32,
    /// Bytes of an element of the array.
    element: usize,
    is_bigendian: bool,
    height: u64,
    width: u64,
}

/// An array of numbers of one type: the last dimension is the columns.
fn plain(descr: &str, dimensions: &[u64], columns: Option<&Columns>) -> Parsed<Layout> {
    let kind = Type::parse(descr)?;
    let datatype = kind.datatype.ok_or_else(|| format!("numbers of type {descr}"))?;
    let (height, width, count) = match *dimensions {
        [width, count] => (1, width, count),
        [height, width, count] => (height, width, count),
        _ => {
            return Err(format!(
                "an array of {} dimensions; 2 or 3 make a cloud",
                dimensions.len()
            ));
        }
    };
    // More columns would not be a point's.
    let count = usize::try_from(count).ok().filter(|count| (3..=1024).contains(count));
    let Some(count) = count else {
        return Err(format!("the shape {dimensions:?} has no 3 to 1024 columns"));
    };
    let usual = Columns::usual(count);
    let columns = columns.unwrap_or(&usual);
    if columns.count() != count {
        return Err(format!("{count} columns where {} are named", columns.count()));
    }
    Ok(Layout {
        fields: columns.fields(datatype),
        left_out: Vec::new(),
        step: kind.size * count as u32,
        element: kind.size as usize,
        is_bigendian: kind.is_bigendian == Some(true),
        height,
        width,
    })
}

/// An array of records: the fields are named.
fn structured(descr: &[Value], dimensions: &[u64]) -> Parsed<Layout> {
    let (height, width) = match *dimensions {
        [width] => (1, width),
        [height, width] => (height, width),
        _ => {
            return Err(format!("records in {} dimensions; 1 or 2 make a cloud", dimensions.len()));
        }
    };
    let (mut fields, mut left_out, mut offset) = (Vec::new(), Vec::new(), 0_u32);
    let mut order = None;
    for entry in descr {
        let (name, text, count) = record_field(entry)?;
        let kind = Type::parse(text)?;
        match kind.datatype {
            Some(datatype) => {
                if kind.is_bigendian.is_some_and(|is| *order.get_or_insert(is) != is) {
                    return Err("numbers of both byte orders".into());
                }
                fields.push(field(name, offset, datatype, count));
            }
            None if name.is_empty() => {}
            None => {
                left_out.push(format!("field `{name}`, whose type {text} a message does not have"))
            }
        }
        let end = kind.size.checked_mul(count).and_then(|bytes| offset.checked_add(bytes));
        offset = end.ok_or_else(|| format!("field `{name}` of {count} x {} bytes", kind.size))?;
    }
    Ok(Layout {
        fields,
        left_out,
        step: offset,
        element: offset as usize,
        is_bigendian: order == Some(true),
        height,
        width,
    })
}

/// Name, type and count of a record's field: `('x', '<f4')` or `('normal', '<f4', (3,))`.
fn record_field(entry: &Value) -> Parsed<(&str, &str, u32)> {
    let wrong = || format!("a field that cannot be read: {entry}");
    let Value::Array(parts) = entry else { return Err(wrong()) };
    let (name, kind, dimensions) = match parts.as_slice() {
        [name, kind] => (name, kind, &[][..]),
        [name, kind, Value::Array(dimensions)] => (name, kind, dimensions.as_slice()),
        _ => return Err(wrong()),
    };
    let count = dimensions.iter().try_fold(1_u32, |count, dimension| {
        count.checked_mul(u32::try_from(dimension.as_u64()?).ok()?)
    });
    match (name, kind, count) {
        // A title in front of the name.
        (Value::Array(names), Value::String(kind), Some(1..)) => match names.as_slice() {
            [_, Value::String(name)] => Ok((name, kind, count.unwrap_or(1))),
            _ => Err(wrong()),
        },
        (Value::String(name), Value::String(kind), Some(count @ 1..)) => Ok((name, kind, count)),
        _ => Err(wrong()),
    }
}

/// A type such as `<f4`.
struct Type {
    /// The message's type, if it has such a one.
    datatype: Option<Datatype>,
    /// Bytes.
    size: u32,
    /// None where there is no order: single bytes.
    is_bigendian: Option<bool>,
}

impl Type {
    fn parse(text: &str) -> Parsed<Type> {
        let unknown = || format!("the unknown type `{text}`");
        let mut letters = text.chars();
        let is_bigendian = match letters.next() {
            Some('<') => Some(false),
            Some('>') => Some(true),
            Some('|') => None,
            _ => return Err(unknown()),
        };
        let kind = letters.next().ok_or_else(unknown)?;
        // Times have a unit behind their size: `<M8[ns]`.
        let size = letters.as_str().split('[').next().unwrap_or_default();
        let size: u32 = size.parse().map_err(|_| unknown())?;
        let size = match kind {
            'f' | 'i' | 'u' | 'b' | 'c' | 'V' | 'S' | 'M' | 'm' => size,
            // Letters of four bytes.
            'U' => size.checked_mul(4).ok_or_else(unknown)?,
            _ => return Err(unknown()),
        };
        let datatype = datatype(if kind == 'b' { 'u' } else { kind }, size);
        let is_bigendian = is_bigendian.filter(|_| size > 1);
        Ok(Type { datatype, size, is_bigendian })
    }
}

/// An array with the first index fastest as one with the last fastest.
fn last_fastest(bytes: &[u8], dimensions: &[u64], element: usize) -> Vec<u8> {
    let dimensions: Vec<usize> = dimensions.iter().map(|&size| size as usize).collect();
    let strides: Vec<usize> = (0..dimensions.len())
        .map(|axis| dimensions[..axis].iter().product::<usize>() * element)
        .collect();
    let mut index = vec![0; dimensions.len()];
    let mut data = Vec::with_capacity(bytes.len());
    while data.len() < bytes.len() {
        let at: usize = index.iter().zip(&strides).map(|(index, stride)| index * stride).sum();
        data.extend_from_slice(&bytes[at..at + element]);
        for axis in (0..index.len()).rev() {
            index[axis] += 1;
            if index[axis] < dimensions[axis] {
                break;
            }
            index[axis] = 0;
        }
    }
    data
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(header: &str, data: &[u8]) -> Vec<u8> {
        let length = (header.len() as u16).to_le_bytes();
        [MAGIC, &[1, 0], &length, header.as_bytes(), data].concat()
    }

    #[test]
    fn integers_and_floats_of_both_orders() {
        let header = "{'descr': '<i8', 'fortran_order': False, 'shape': (2,), }";
        let data = [7_i64.to_le_bytes(), (-1_i64).to_le_bytes()].concat();
        let expected = (vec![2], Numbers::Integers(vec![7, -1]));
        assert_eq!(numbers(&file(header, &data)), Ok(expected));
        let header = "{'descr': '>f4', 'fortran_order': True, 'shape': (2, 2), }";
        let data = [1.0_f32, 3.0, 2.0, 4.0].map(f32::to_be_bytes).concat();
        let expected = (vec![2, 2], Numbers::Floats(vec![1.0, 2.0, 3.0, 4.0]));
        assert_eq!(numbers(&file(header, &data)), Ok(expected));
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        let header = "{'descr': '<u2', 'fortran_order': False, 'shape': (3,), }";
        assert!(numbers(&file(header, &[0; 4])).unwrap_err().contains("4 bytes"));
        let huge = "{'descr': '<u8', 'fortran_order': False, 'shape': (4294967296, 4294967296), }";
        assert!(numbers(&file(huge, &[])).is_err());
        let times = "{'descr': '<M8[ns]', 'fortran_order': False, 'shape': (0,), }";
        assert!(numbers(&file(times, &[])).is_err());
    }

    #[test]
    fn a_header_with_all_that_python_writes() {
        let header = "{'descr': [(('title', 'x'), '<f4'), (\"n (m)\", '<f4', (3,))], \
                      'fortran_order': False, 'shape': (7L, 2), }  \n";
        let value = literal(header).unwrap();
        let descr = serde_json::json!([[["title", "x"], "<f4"], ["n (m)", "<f4", [3]]]);
        assert_eq!(value.get("descr"), Some(&descr));
        assert_eq!(value.get("fortran_order"), Some(&Value::Bool(false)));
        assert_eq!(dimensions(&value), Ok(vec![7, 2]));
        assert_eq!(literal("()"), Ok(serde_json::json!([])));
        assert_eq!(record_field(&descr[0]), Ok(("x", "<f4", 1)));
        assert_eq!(record_field(&descr[1]), Ok(("n (m)", "<f4", 3)));
    }

    #[test]
    fn what_is_no_header_is_refused() {
        let deep = "(".repeat(100_000);
        for text in
            ["", "{", "{1: 2}", "{'a' 2}", "(1 2)", "'a", "'a\\'", "None", "1 1", "-1", &deep]
        {
            assert!(numbers(&file(text, &[])).is_err(), "{text:.20}");
            let shape = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': {text}}}");
            assert!(numbers(&file(&shape, &[])).is_err(), "{text:.20}");
        }
        let huge = "{'descr': '<u8', 'fortran_order': False, 'shape': (99999999999999999999,)}";
        assert!(numbers(&file(huge, &[])).is_err());
    }
}
