//! Bytes changed at random, with an eye for what breaks parsers: lengths that lie, values at the
//! edges, cuts, repeats, and pieces of other inputs.

use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Inputs do not grow beyond this.
pub const LONGEST: usize = 64 << 10;

/// Numbers at the edges of what a text may claim.
const NUMBERS: [&str; 14] = [
    "0",
    "-0",
    "1",
    "-1",
    "255",
    "65536",
    "2147483648",
    "4294967295",
    "18446744073709551615",
    "99999999999999999999999",
    "1e39",
    "1e-320",
    "nan",
    "-inf",
];

/// A stream of random changes, the same for the same seed.
pub struct Mutator {
    rng: Pcg64Mcg,
}

impl Mutator {
    /// The stream of a seed.
    pub fn new(seed: u64) -> Self {
        Mutator { rng: Pcg64Mcg::seed_from_u64(seed) }
    }

    /// A number below `end`, which is not 0.
    pub fn below(&mut self, end: usize) -> usize {
        self.rng.random_range(0..end)
    }

    /// True once in `times`.
    pub fn once_in(&mut self, times: usize) -> bool {
        self.below(times) == 0
    }

    /// One of several.
    pub fn pick<'a, T>(&mut self, from: &'a [T]) -> &'a T {
        &from[self.below(from.len())]
    }

    /// Changes `bytes` in one to sixteen ways, mostly few. `others` give pieces, `words` what means
    /// something to the parser.
    pub fn mutate(&mut self, bytes: &mut Vec<u8>, others: &[Vec<u8>], words: &[&[u8]]) {
        let mut times = 1;
        while times < 16 && self.once_in(2) {
            times += 1;
        }
        let is_text = bytes.iter().take(64).all(|byte| byte.is_ascii() && *byte != 0);
        for _ in 0..times {
            match is_text && self.once_in(2) {
                true => self.change_text(bytes),
                false => self.change(bytes, others, words),
            }
        }
        bytes.truncate(LONGEST);
    }

    fn change(&mut self, bytes: &mut Vec<u8>, others: &[Vec<u8>], words: &[&[u8]]) {
        if bytes.is_empty() {
            bytes.push(self.rng.random());
            return;
        }
        let at = self.below(bytes.len());
        match self.below(14) {
            0 | 1 => bytes[at] ^= 1 << self.below(8),
            2 => bytes[at] = *self.pick(&[0, 1, 0x7f, 0x80, 0xfe, 0xff]),
            3 => bytes[at] = self.rng.random(),
            4..=6 => self.lie::<4>(bytes, at),
            7 => self.lie::<8>(bytes, at),
            8 => self.number(bytes, at),
            9 => bytes.truncate(at),
            10 => drop(bytes.drain(self.range(at, bytes.len()))),
            11 => {
                let piece = bytes[self.range(at, bytes.len())].to_vec();
                self.insert(bytes, &piece);
            }
            12 if !others.is_empty() => {
                let other = self.pick(others).clone();
                if !other.is_empty() {
                    let from = self.below(other.len());
                    let piece = &other[self.range(from, other.len())];
                    self.insert(bytes, piece);
                }
            }
            _ if !words.is_empty() => {
                let word = self.pick(words).to_vec();
                match self.once_in(2) {
                    true => self.insert(bytes, &word),
                    false => overwrite(bytes, at, &word),
                }
            }
            _ => bytes[at] = bytes[at].wrapping_add(1),
        }
    }

    /// Puts a length or count that may lie where there might be one: mostly aligned as CDR aligns,
    /// in either order.
    fn lie<const N: usize>(&mut self, bytes: &mut [u8], at: usize) {
        let at = if self.once_in(4) { at } else { at - at % 4 };
        let Some(place) = bytes.get(at..at + N) else { return };
        let mut word = [0; 8];
        word[..N].copy_from_slice(place);
        let (here, left) = (u64::from_le_bytes(word), (bytes.len() - at - N) as u64);
        let all = u64::MAX >> (64 - 8 * N);
        let lie = *self.pick(&[
            0,
            1,
            2,
            all,
            all - 1,
            all >> 1,
            (all >> 1) + 1,
            left,
            left + 1,
            left.wrapping_sub(1),
            here.wrapping_add(1),
            here.wrapping_sub(1),
            here.wrapping_mul(2),
            1 << 16,
            1 << 24,
            100_000_000_000,
        ]);
        let mut word = lie.to_le_bytes()[..N].to_vec();
        if self.once_in(8) {
            word.reverse();
        }
        overwrite(bytes, at, &word);
    }

    /// Puts a float that breaks arithmetic.
    fn number(&mut self, bytes: &mut [u8], at: usize) {
        let value = self.wild();
        match self.once_in(4) {
            false => overwrite(bytes, at - at % 4, &(value as f32).to_le_bytes()),
            true => overwrite(bytes, at - at % 8, &value.to_le_bytes()),
        }
    }

    /// A number that breaks arithmetic.
    pub fn wild(&mut self) -> f64 {
        const WILD: [f64; 14] = [
            f64::NAN,
            f64::INFINITY,
            f64::NEG_INFINITY,
            f64::MAX,
            f32::MAX as f64,
            -f32::MAX as f64,
            1e38,
            -1e19,
            1e9,
            1e-38,
            1e-45,
            -0.0,
            0.0,
            5.0,
        ];
        *self.pick(&WILD)
    }

    fn change_text(&mut self, bytes: &mut Vec<u8>) {
        let words: Vec<(usize, usize)> = words_of(bytes);
        if words.is_empty() {
            return;
        }
        let &(start, end) = self.pick(&words);
        match self.below(4) {
            0 => drop(bytes.drain(start..end)),
            1 => {
                let line_end = bytes[start..].iter().position(|&byte| byte == b'\n');
                let piece = bytes[start..line_end.map_or(end, |at| start + at + 1)].to_vec();
                bytes.splice(start..start, piece);
            }
            _ => {
                let number = self.pick(&NUMBERS).as_bytes().to_vec();
                bytes.splice(start..end, number);
            }
        }
    }

    fn insert(&mut self, bytes: &mut Vec<u8>, piece: &[u8]) {
        let at = self.below(bytes.len() + 1);
        bytes.splice(at..at, piece.iter().copied());
        bytes.truncate(LONGEST);
    }

    /// A range from `start`, mostly short.
    fn range(&mut self, start: usize, end: usize) -> std::ops::Range<usize> {
        let most = if self.once_in(4) { end - start } else { 32.min(end - start) };
        start..start + 1 + self.below(most)
    }

    /// Random bytes.
    pub fn noise(&mut self, length: usize) -> Vec<u8> {
        let mut bytes = vec![0; length];
        self.rng.fill_bytes(&mut bytes);
        bytes
    }
}

fn overwrite(bytes: &mut [u8], at: usize, word: &[u8]) {
    for (byte, new) in bytes[at..].iter_mut().zip(word) {
        *byte = *new;
    }
}

fn words_of(bytes: &[u8]) -> Vec<(usize, usize)> {
    let mut words = Vec::new();
    let mut start = None;
    for (at, byte) in bytes.iter().enumerate() {
        match (byte.is_ascii_whitespace(), start) {
            (false, None) => start = Some(at),
            (true, Some(from)) => {
                words.push((from, at));
                start = None;
            }
            _ => {}
        }
    }
    words.extend(start.map(|from| (from, bytes.len())));
    words
}
