//! Ways to damage a file.

use motes_math::rng::keyed_rng;
use rand::RngExt as _;

/// Numbers that break arithmetic on sizes.
const NASTY: [u64; 8] =
    [0, 1, 0x7f, 0xff, 0x7fff_ffff, 0xffff_ffff, 0x7fff_ffff_ffff_ffff, 0xffff_ffff_ffff_ffff];
/// Words that mean something to one of the parsers.
const WORDS: [&str; 16] = [
    "1000000000000000000",
    "-1",
    "nan",
    "1e999",
    "null",
    "\"\"",
    "../",
    "{",
    "[",
    "list uint ",
    "element vertex 3\n",
    "property half y\n",
    "\0",
    "\r\n",
    "end_header\n",
    "255",
];

pub(crate) struct Mutator {
    seed: u64,
    run: u64,
}

impl Mutator {
    pub(crate) fn new(seed: u64) -> Self {
        Self { seed, run: 0 }
    }

    /// A seed with one to eight faults.
    pub(crate) fn mutate(&mut self, seeds: &[Vec<u8>]) -> Vec<u8> {
        let mut rng = keyed_rng(self.seed, 0xf022, self.run);
        self.run += 1;
        let mut bytes = seeds[rng.random_range(0..seeds.len())].clone();
        for _ in 0..rng.random_range(1..=8) {
            let at = rng.random_range(0..=bytes.len());
            match rng.random_range(0..8) {
                0 => bytes.truncate(at),
                1 | 2 if at < bytes.len() => bytes[at] ^= 1u8 << rng.random_range(0..8),
                3 if at < bytes.len() => bytes[at] = rng.random(),
                4 => {
                    // A number where one may be, in either byte order.
                    let width = 1usize << rng.random_range(0..4);
                    let nasty = NASTY[rng.random_range(0..NASTY.len())];
                    let big = rng.random::<bool>();
                    let value = if big { nasty.to_be_bytes() } else { nasty.to_le_bytes() };
                    let value = if big { &value[8 - width..] } else { &value[..width] };
                    let end = bytes.len().min(at + width);
                    bytes[at..end].copy_from_slice(&value[..end - at]);
                }
                5 => {
                    let word = WORDS[rng.random_range(0..WORDS.len())].bytes();
                    bytes.splice(at..at, word);
                }
                6 => {
                    let end = bytes.len().min(at + rng.random_range(0..64));
                    bytes.drain(at..end);
                }
                _ => {
                    // A piece of another seed, or of this one.
                    let other = &seeds[rng.random_range(0..seeds.len())];
                    let start = rng.random_range(0..=other.len());
                    let end = other.len().min(start + rng.random_range(0..64));
                    bytes.splice(at..at, other[start..end].iter().copied());
                }
            }
        }
        bytes
    }
}
