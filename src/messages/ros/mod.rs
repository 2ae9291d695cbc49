//! The bytes of ROS messages: a cursor that reads them and one that writes them.
//!
//! ROS 2 has XCDR1: a header of four bytes (`00 00` big endian, `00 01` little endian, two bytes of
//! options that are ignored) and a body. Numbers are aligned to their own size, counted from the
//! start of the body; strings end with a zero. ROS 1 has neither header nor alignment nor that
//! zero, is little endian, and begins a `std_msgs/Header` with a counter.
//!
//! Ours because the crates for CDR need a copy of every cloud in a type of its own
//! (docs/decisions/0001-own-cdr.md).

use crate::error::frame::{FrameError, Result, Unsupported};

/// Bytes of CDR's encapsulation header before the body.
const HEADER_LEN: usize = 4;

/// Order of the bytes of a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ByteOrder {
    /// Least significant byte first.
    Little,
    /// Most significant byte first.
    Big,
}

/// Layout of a ROS message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Layout {
    /// ROS 2.
    Cdr(ByteOrder),
    /// ROS 1.
    Ros1,
}

impl Layout {
    /// Order of the bytes of its numbers.
    pub fn byte_order(self) -> ByteOrder {
        match self {
            Layout::Cdr(byte_order) => byte_order,
            Layout::Ros1 => ByteOrder::Little,
        }
    }

    /// Bytes before the body.
    fn header_len(self) -> usize {
        match self {
            Layout::Cdr(_) => HEADER_LEN,
            Layout::Ros1 => 0,
        }
    }

    /// Bytes from `position` of the body to where a number of `size` bytes can start.
    fn padding(self, position: usize, size: usize) -> usize {
        match self {
            Layout::Cdr(_) => position.next_multiple_of(size) - position,
            Layout::Ros1 => 0,
        }
    }
}

/// The numbers that the messages are made of, from and to bytes of either order.
macro_rules! numbers {
    ($($number:ident $size:literal $get:ident $put:ident;)*) => {
        impl ByteOrder {
            $(
                #[doc = concat!("A `", stringify!($number), "` from its bytes.")]
                #[inline]
                pub fn $get(self, bytes: [u8; $size]) -> $number {
                    match self {
                        ByteOrder::Little => $number::from_le_bytes(bytes),
                        ByteOrder::Big => $number::from_be_bytes(bytes),
                    }
                }

                #[doc = concat!("The bytes of a `", stringify!($number), "`.")]
                #[inline]
                pub fn $put(self, value: $number) -> [u8; $size] {
                    match self {
                        ByteOrder::Little => value.to_le_bytes(),
                        ByteOrder::Big => value.to_be_bytes(),
                    }
                }
            )*
        }

        impl RosReader<'_> {
            $(
                #[doc = concat!("The next `", stringify!($number), "`.")]
                ///
                /// # Errors
                /// [`FrameError::Malformed`] if the message ends before it does.
                pub fn $number(&mut self) -> Result<$number> {
                    let bytes = self.aligned()?;
                    Ok(self.layout.byte_order().$get(bytes))
                }
            )*
        }

        impl RosWriter<'_> {
            $(
                #[doc = concat!("Appends a `", stringify!($number), "`.")]
                pub fn $number(&mut self, value: $number) {
                    self.align($size);
                    self.out.extend_from_slice(&self.layout.byte_order().$put(value));
                }
            )*
        }
    };
}

numbers! {
    u8 1 get_u8 put_u8;
    i8 1 get_i8 put_i8;
    u16 2 get_u16 put_u16;
    i16 2 get_i16 put_i16;
    u32 4 get_u32 put_u32;
    i32 4 get_i32 put_i32;
    u64 8 get_u64 put_u64;
    i64 8 get_i64 put_i64;
    f32 4 get_f32 put_f32;
    f64 8 get_f64 put_f64;
}

/// Reads one message from front to back; every read is checked against the bytes that are there.
#[derive(Debug, Clone)]
pub struct RosReader<'a> {
    message: &'static str,
    layout: Layout,
    body: &'a [u8],
    position: usize,
}

impl<'a> RosReader<'a> {
    /// A cursor at the start of a message of ROS 1 or of ROS 2. `message` names the type in errors.
    ///
    /// # Errors
    /// Those of [`RosReader::cdr`].
    pub fn new(message: &'static str, is_ros1: bool, bytes: &'a [u8]) -> Result<Self> {
        match is_ros1 {
            true => Ok(RosReader::ros1(message, bytes)),
            false => RosReader::cdr(message, bytes),
        }
    }

    /// A cursor at the start of a ROS 1 message. `message` names the type in errors.
    pub fn ros1(message: &'static str, body: &'a [u8]) -> Self {
        RosReader { message, layout: Layout::Ros1, body, position: 0 }
    }

    /// A cursor at the start of a ROS 2 message's body. `message` names the type in errors.
    ///
    /// # Errors
    /// [`FrameError::Malformed`] for fewer than four bytes, [`FrameError::Unsupported`] for an
    /// encapsulation other than plain CDR.
    pub fn cdr(message: &'static str, cdr: &'a [u8]) -> Result<Self> {
        let Some((header, body)) = cdr.split_first_chunk::<HEADER_LEN>() else {
            return Err(FrameError::Malformed {
                message,
                problem: format!(
                    "{} bytes cannot hold the encapsulation header of {HEADER_LEN}",
                    cdr.len()
                ),
            });
        };
        let byte_order = match [header[0], header[1]] {
            [0, 0] => ByteOrder::Big,
            [0, 1] => ByteOrder::Little,
            bytes => {
                let problem = Unsupported::Encapsulation { bytes };
                return Err(FrameError::Unsupported { message, problem });
            }
        };
        Ok(RosReader { message, layout: Layout::Cdr(byte_order), body, position: 0 })
    }

    /// The message's layout.
    pub fn layout(&self) -> Layout {
        self.layout
    }

    /// Bytes of the body that are still to be read.
    pub fn remaining(&self) -> usize {
        self.body.len() - self.position
    }

    /// The next `length` bytes, unaligned.
    ///
    /// # Errors
    /// [`FrameError::Malformed`] if there are fewer.
    pub fn bytes(&mut self, length: usize) -> Result<&'a [u8]> {
        let bytes =
            self.body[self.position..].get(..length).ok_or_else(|| self.too_short(length))?;
        self.position += length;
        Ok(bytes)
    }

    /// The next `bool`: any byte but zero is true.
    ///
    /// # Errors
    /// [`FrameError::Malformed`] at the end of the message.
    pub fn bool(&mut self) -> Result<bool> {
        Ok(self.u8()? != 0)
    }

    /// The next `std_msgs/Header`: seconds (without a sign in ROS 1) and nanoseconds of the stamp,
    /// coordinate frame.
    ///
    /// # Errors
    /// [`FrameError::Malformed`] if it is not all there.
    pub fn header(&mut self) -> Result<(i64, u32, String)> {
        let sec = match self.layout {
            Layout::Ros1 => {
                self.u32()?; // seq
                self.u32()?.into()
            }
            Layout::Cdr(_) => self.i32()?.into(),
        };
        Ok((sec, self.u32()?, self.string()?))
    }

    /// The next N `float64`.
    ///
    /// # Errors
    /// [`FrameError::Malformed`] if the message ends before they do.
    pub fn f64s<const N: usize>(&mut self) -> Result<[f64; N]> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.f64()?;
        }
        Ok(values)
    }

    /// The bytes of the next `uint8[]`.
    ///
    /// # Errors
    /// [`FrameError::Malformed`] if there are fewer than its length says.
    pub fn data(&mut self) -> Result<&'a [u8]> {
        let length = self.sequence(1)?;
        self.bytes(length)
    }

    /// The next string, without the zero that closes it in CDR.
    ///
    /// # Errors
    /// [`FrameError::Malformed`] if it does not fit, is not closed by a zero in CDR or is not
    /// UTF-8.
    pub fn string(&mut self) -> Result<String> {
        let length = self.u32()? as usize;
        let at = self.position;
        let mut text = self.bytes(length)?;
        // An empty string without its zero is not what CDR says, but some writers do it.
        if let (Layout::Cdr(_), Some((&last, before))) = (self.layout, text.split_last()) {
            if last != 0 {
                return Err(self.malformed(format!(
                    "the string at byte {at} of the body is not closed by a zero but by {last:#04x}"
                )));
            }
            text = before;
        }
        String::from_utf8(text.to_vec()).map_err(|_| {
            self.malformed(format!("the string at byte {at} of the body is not UTF-8"))
        })
    }

    /// The next sequence's length, which must be possible: at least `element_size` bytes each.
    ///
    /// # Errors
    /// [`FrameError::Malformed`] if that many elements cannot be in what is left of the message.
    pub fn sequence(&mut self, element_size: usize) -> Result<usize> {
        let length = self.u32()? as usize;
        let needed = length.checked_mul(element_size);
        if needed.is_none_or(|needed| needed > self.remaining()) {
            return Err(self.malformed(format!(
                "a sequence of {length} elements of at least {element_size} bytes in the {} bytes \
                 that are left",
                self.remaining()
            )));
        }
        Ok(length)
    }

    /// An error about this message.
    pub fn malformed(&self, problem: String) -> FrameError {
        FrameError::Malformed { message: self.message, problem }
    }

    fn too_short(&self, length: usize) -> FrameError {
        self.malformed(format!(
            "{length} bytes wanted at byte {} of the body, {} are left",
            self.position,
            self.remaining()
        ))
    }

    fn aligned<const N: usize>(&mut self) -> Result<[u8; N]> {
        let start = self.position + self.layout.padding(self.position, N);
        let bytes = self
            .body
            .get(start..)
            .and_then(<[u8]>::first_chunk::<N>)
            .ok_or_else(|| self.too_short(N))?;
        self.position = start + N;
        Ok(*bytes)
    }
}

/// Writes one message from front to back.
#[derive(Debug)]
pub struct RosWriter<'a> {
    layout: Layout,
    out: &'a mut Vec<u8>,
}

impl<'a> RosWriter<'a> {
    /// Empties `out` and writes to it what comes before a message's body.
    pub fn new(layout: Layout, out: &'a mut Vec<u8>) -> Self {
        out.clear();
        if let Layout::Cdr(byte_order) = layout {
            out.extend_from_slice(&[0, u8::from(byte_order == ByteOrder::Little), 0, 0]);
        }
        RosWriter { layout, out }
    }

    /// Goes on with a message of which `out` holds the beginning.
    pub(crate) fn resume(layout: Layout, out: &'a mut Vec<u8>) -> Self {
        RosWriter { layout, out }
    }

    /// Appends bytes as they are.
    pub fn bytes(&mut self, bytes: &[u8]) {
        self.out.extend_from_slice(bytes);
    }

    /// Appends a `bool`.
    pub fn bool(&mut self, value: bool) {
        self.u8(u8::from(value));
    }

    /// Appends a string, in CDR with its closing zero.
    ///
    /// # Panics
    /// If it is 4 GiB long.
    pub fn string(&mut self, text: &str) {
        let zero = matches!(self.layout, Layout::Cdr(_)).then_some(0);
        self.length(text.len() + usize::from(zero.is_some()));
        self.out.extend_from_slice(text.as_bytes());
        self.out.extend(zero);
    }

    /// Appends a `std_msgs/Header`: seconds and nanoseconds of the stamp, coordinate frame. The
    /// counter that it has in ROS 1 is 0.
    pub fn header(&mut self, (sec, nanosec, frame_id): (i32, u32, &str)) {
        if self.layout == Layout::Ros1 {
            self.u32(0);
        }
        self.i32(sec);
        self.u32(nanosec);
        self.string(frame_id);
    }

    /// Appends `float64`s one after the other.
    pub fn f64s(&mut self, values: impl IntoIterator<Item = f64>) {
        values.into_iter().for_each(|value| self.f64(value));
    }

    /// Appends the length of a sequence, which its elements must follow.
    ///
    /// # Panics
    /// If it has 2^32 elements.
    pub fn length(&mut self, length: usize) {
        self.u32(u32::try_from(length).expect("lengths have 32 bits"));
    }

    fn align(&mut self, size: usize) {
        let padding = self.layout.padding(self.out.len() - self.layout.header_len(), size);
        self.out.resize(self.out.len() + padding, 0);
    }
}

#[cfg(test)]
mod tests;
