//! A set of pixels of an image, numbered in row-major order.

/// Bits of a word.
const WORD: usize = u64::BITS as usize;

/// M of the H x W pixels of an image, numbered from 0 in row-major order: a bit per pixel, and per
/// 64 pixels how many of the set lie before them.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct PixelSet {
    rows: usize,
    columns: usize,
    bits: Vec<u64>,
    before: Vec<u32>,
}

impl PixelSet {
    /// The set of some pixels, in any order; one that is named twice is in it once.
    ///
    /// # Panics
    /// If one lies outside of the image.
    pub fn new(rows: usize, columns: usize, pixels: impl IntoIterator<Item = u32>) -> Self {
        let size = rows * columns;
        let mut bits = vec![0_u64; size.div_ceil(WORD)];
        for pixel in pixels {
            let pixel = pixel as usize;
            assert!(pixel < size, "pixel {pixel} of {rows} x {columns}");
            bits[pixel / WORD] |= 1 << (pixel % WORD);
        }
        let mut count = 0;
        let before = bits.iter().map(|word| {
            count += word.count_ones();
            count - word.count_ones()
        });
        PixelSet { rows, columns, before: before.collect(), bits }
    }

    /// Rows of the image.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Columns of the image.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// The number of a pixel of the image, if it is in the set.
    #[inline]
    pub fn number(&self, pixel: usize) -> Option<u32> {
        let (word, bit) = (pixel / WORD, 1 << (pixel % WORD));
        let bits = self.bits[word];
        (bits & bit != 0).then(|| self.before[word] + (bits & (bit - 1)).count_ones())
    }

    /// The pixels of the set, ascending.
    pub fn pixels(&self) -> Vec<u32> {
        let last = self.bits.last().zip(self.before.last());
        let count = last.map_or(0, |(bits, before)| before + bits.count_ones());
        let mut pixels = Vec::with_capacity(count as usize);
        for (first, &word) in (0_u32..).step_by(WORD).zip(&self.bits) {
            let mut bits = word;
            while bits != 0 {
                pixels.push(first + bits.trailing_zeros());
                bits &= bits - 1;
            }
        }
        pixels
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_row_major() {
        let set = PixelSet::new(3, 50, [149, 63, 64, 0, 64, 127]);
        assert_eq!(set.pixels(), [0, 63, 64, 127, 149]);
        for (number, pixel) in (0..).zip(set.pixels()) {
            assert_eq!(set.number(pixel as usize), Some(number));
        }
        assert_eq!([1, 62, 65, 148].map(|pixel| set.number(pixel)), [None; 4]);
        assert!(PixelSet::new(0, 7, []).pixels().is_empty());
    }

    proptest::proptest! {
        #[test]
        fn agrees_with_a_sorted_list(mut pixels in proptest::collection::vec(0..300_u32, 0..200)) {
            let set = PixelSet::new(4, 75, pixels.iter().copied());
            pixels.sort_unstable();
            pixels.dedup();
            proptest::prop_assert_eq!(set.pixels(), pixels.clone());
            for pixel in 0..300 {
                let expected = pixels.binary_search(&pixel).ok();
                proptest::prop_assert_eq!(set.number(pixel as usize).map(|n| n as usize), expected);
            }
        }
    }
}
