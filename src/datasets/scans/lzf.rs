//! LZF, the compression inside `.pcd` files (Marc Lehmann's LibLZF): runs of bytes as they are, and
//! pieces that were there before.
//!
//! A control byte below 32 is followed by that many bytes and one more. Any other holds a length in
//! its upper three bits (7: the next byte is added) and, in its lower five and a byte more, how far
//! back the piece begins; a piece is two bytes longer than its length and may reach into itself.
//!
//! Ours because the crate `lzf` is deprecated and the whole is thirty lines.

use super::scan::Parsed;

/// Bytes that a byte of input can become, at most: three give 7 + 255 + 2.
const MOST_GROWTH: usize = 88;

/// Decompresses to exactly `length` bytes.
pub(super) fn decompress(input: &[u8], length: usize) -> Parsed<Vec<u8>> {
    let short = || "the compressed data ends in the middle of a piece".to_owned();
    let mut out = Vec::with_capacity(length.min(input.len().saturating_mul(MOST_GROWTH)));
    let mut rest = input.iter();
    while let Some(&control) = rest.next() {
        if control < 32 {
            let run = usize::from(control) + 1;
            let bytes = rest.as_slice();
            out.extend_from_slice(bytes.get(..run).ok_or_else(short)?);
            rest = bytes[run..].iter();
        } else {
            let mut next = || rest.next().copied().map(usize::from).ok_or_else(short);
            let mut piece = usize::from(control >> 5) + 2;
            if control >> 5 == 7 {
                piece += next()?;
            }
            let back = (usize::from(control & 0x1f) << 8) + next()? + 1;
            let start = out.len().checked_sub(back).ok_or_else(|| {
                format!("a piece begins {back} bytes back where {} are there", out.len())
            })?;
            (start..start + piece).for_each(|at| out.push(out[at]));
        }
        if out.len() > length {
            return Err(format!("the data is longer than the {length} bytes that were announced"));
        }
    }
    if out.len() < length {
        return Err(format!("{} bytes where {length} were announced", out.len()));
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_and_pieces() {
        // "abc", then 6 bytes from 3 back, then 2 + 7 + 1 from 1 back.
        let input = [2, b'a', b'b', b'c', 4 << 5, 2, 7 << 5, 1, 0];
        assert_eq!(decompress(&input, 19).unwrap(), b"abcabcabccccccccccc");
        assert!(decompress(&input, 20).unwrap_err().contains("19 bytes where 20"));
        assert!(decompress(&input, 18).unwrap_err().contains("longer than the 18"));
        assert!(decompress(&input[..8], 19).unwrap_err().contains("in the middle"));
        assert!(decompress(&[3, b'a'], 4).unwrap_err().contains("in the middle"));
        assert!(decompress(&[0, b'a', 1 << 5, 1], 4).unwrap_err().contains("2 bytes back where 1"));
        assert_eq!(decompress(&[], 0).unwrap(), b"");
    }
}
