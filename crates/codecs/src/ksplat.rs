//! mkkellogg's `.ksplat`, which is read only: its program is no longer developed.
//!
//! A header of 4096 bytes, section headers of 1024 bytes, and for each section the lengths of its partly
//! filled buckets, the centers of its buckets, and its splats. Compression level 0 stores f32, 1 and 2 store
//! positions as 16 bits relative to the bucket and f16; level 2 stores harmonics as bytes.

use std::path::Path;

use half::f16;
use motes_scene::Gaussians;

use super::bytes::{Bytes, f32_at, u16_at, u32_at};
use super::merge::merge_gaussians;
use super::quantize::{dc_of_color, logit_of_byte};
use super::registry::{Codec, Input};
use super::rows::with_room;
use motes_formats::error::{FormatError, Result};
use motes_formats::ply::GaussianFile;

const HEADER_BYTES: u64 = 4096;
const SECTION_BYTES: u64 = 1024;
/// Range of harmonics of level 2 in files that do not say one.
const USUAL_RANGE: [f32; 2] = [-1.5, 1.5];
/// Steps of a position on each side of the center of a bucket, where the section does not say.
const USUAL_STEPS: u32 = 32767;
/// Components of harmonics by degree.
const HARMONICS: [usize; 4] = [0, 9, 24, 45];

/// Bytes of the parts of a splat at a compression level.
#[derive(Clone, Copy)]
struct Layout {
    level: u16,
    /// Of a number of position, and of one of scale and rotation.
    number: usize,
    harmonic: usize,
}

impl Layout {
    fn of(level: u16) -> Option<Self> {
        match level {
            0 => Some(Self { level, number: 4, harmonic: 4 }),
            1 => Some(Self { level, number: 2, harmonic: 2 }),
            2 => Some(Self { level, number: 2, harmonic: 1 }),
            _ => None,
        }
    }

    fn splat_bytes(&self, harmonics: usize) -> usize {
        10 * self.number + 4 + harmonics * self.harmonic
    }

    fn float(&self, row: &[u8], at: usize) -> f32 {
        if self.number == 4 { f32_at(row, at) } else { f16::from_bits(u16_at(row, at)).to_f32() }
    }
}

struct Section {
    splats: u32,
    stored: u32,
    bucket_capacity: u32,
    buckets: u32,
    block_size: f32,
    bucket_bytes: u16,
    steps: u32,
    full_buckets: u32,
    partial_buckets: u32,
    degree: u16,
}

impl Section {
    fn of(header: &[u8], level: u16) -> Self {
        let steps = u32_at(header, 24);
        let usual = if level == 0 { 1 } else { USUAL_STEPS };
        Self {
            splats: u32_at(header, 0),
            stored: u32_at(header, 4),
            bucket_capacity: u32_at(header, 8),
            buckets: u32_at(header, 12),
            block_size: f32_at(header, 16),
            bucket_bytes: u16_at(header, 20),
            steps: if steps == 0 { usual } else { steps },
            full_buckets: u32_at(header, 32),
            partial_buckets: u32_at(header, 36),
            degree: u16_at(header, 40),
        }
    }
}

pub(super) static CODEC: Codec = Codec {
    name: "ksplat",
    about: "mkkellogg .ksplat",
    suffixes: &[".ksplat"],
    read: Input::Bytes(read),
    ..Codec::DEFAULT
};

fn read(data: &[u8], path: &Path) -> Result<GaussianFile> {
    let mut bytes = Bytes::new(data, path);
    let header = bytes.take(HEADER_BYTES, "the header")?;
    let fault = |place: &str, cause: String| FormatError::invalid(path, place, cause);
    if header[0] != 0 || header[1] < 1 {
        let cause = format!("ksplat version {}.{}; 0.1 and later are known", header[0], header[1]);
        return Err(FormatError::not_supported(path, "byte 0", cause));
    }
    let level = u16_at(header, 20);
    let layout = Layout::of(level)
        .ok_or_else(|| fault("byte 20", format!("compression level {level}; 0 to 2 are known")))?;
    let said = [f32_at(header, 36), f32_at(header, 40)];
    let range = std::array::from_fn(|i| {
        if said[i] != 0.0 && said[i].is_finite() { said[i] } else { USUAL_RANGE[i] }
    });
    let sections = u64::from(u32_at(header, 4));
    let headers = bytes.take(sections.saturating_mul(SECTION_BYTES), "the section headers")?;
    let mut sets = Vec::new();
    for (i, header) in headers.chunks_exact(SECTION_BYTES as usize).enumerate() {
        let section = Section::of(header, level);
        sets.push(read_section(
            &section,
            layout,
            range,
            &mut bytes,
            &format!("section {i}"),
            path,
        )?);
    }
    let gaussians = merge_gaussians(sets);
    let expected = u32_at(header, 16);
    if gaussians.len() as u64 != u64::from(expected) {
        let cause =
            format!("the header promises {expected} splats, the sections have {}", gaussians.len());
        return Err(fault("byte 16", cause));
    }
    Ok(GaussianFile::new(gaussians, Vec::new()))
}

fn read_section(
    section: &Section,
    layout: Layout,
    range: [f32; 2],
    bytes: &mut Bytes<'_>,
    place: &str,
    path: &Path,
) -> Result<Gaussians> {
    let fault = |cause: String| Err(FormatError::invalid(path, place, cause));
    let Some(&harmonics) = HARMONICS.get(usize::from(section.degree)) else {
        return fault(format!("SH degree {}; at most 3 exist", section.degree));
    };
    if section.splats > section.stored {
        return fault(format!("{} splats in room for {}", section.splats, section.stored));
    }
    let lengths = bytes.take(4 * u64::from(section.partial_buckets), "lengths of buckets")?;
    let centers = u64::from(section.bucket_bytes) * u64::from(section.buckets);
    let centers = bytes.take(centers, "centers of buckets")?;
    let size = layout.splat_bytes(harmonics);
    let splats = bytes.take(size as u64 * u64::from(section.stored), "splats")?;
    let mut gaussians = with_room(section.splats as usize, section.degree as u8);
    let mut buckets = Buckets::new(section, lengths);
    let step = section.block_size / 2.0 / section.steps as f32;
    for row in splats.chunks_exact(size).take(section.splats as usize) {
        let mean = if layout.level == 0 {
            std::array::from_fn(|axis| f32_at(row, 4 * axis))
        } else {
            let bucket = buckets.next();
            let at = bucket as usize * usize::from(section.bucket_bytes);
            if section.bucket_bytes < 12 || at + 12 > centers.len() {
                return fault(format!("a splat is in bucket {bucket} of {}", section.buckets));
            }
            std::array::from_fn(|axis| {
                let steps = f32::from(u16_at(row, 2 * axis)) - section.steps as f32;
                steps * step + f32_at(centers, at + 4 * axis)
            })
        };
        append(&mut gaussians, row, mean, layout, range, harmonics);
    }
    Ok(gaussians)
}

/// Which bucket the next splat is in: first full ones, then partly filled ones.
struct Buckets<'a> {
    capacity: u64,
    full: u64,
    lengths: &'a [u8],
    splat: u64,
    bucket: u64,
    /// First splat behind the current partly filled bucket.
    end: u64,
}

impl<'a> Buckets<'a> {
    fn new(section: &Section, lengths: &'a [u8]) -> Self {
        let (capacity, full) =
            (u64::from(section.bucket_capacity.max(1)), u64::from(section.full_buckets));
        let mut buckets =
            Self { capacity, full, lengths, splat: 0, bucket: full, end: full * capacity };
        buckets.end += buckets.length(0);
        buckets
    }

    fn length(&self, partial: u64) -> u64 {
        let at = 4 * partial as usize;
        // Without a length the bucket takes all that follow.
        if at + 4 <= self.lengths.len() {
            u64::from(u32_at(self.lengths, at))
        } else {
            u64::MAX / 2
        }
    }

    fn next(&mut self) -> u64 {
        let splat = self.splat;
        self.splat += 1;
        if splat < self.full * self.capacity {
            return splat / self.capacity;
        }
        while splat >= self.end {
            self.bucket += 1;
            self.end += self.length(self.bucket - self.full);
        }
        self.bucket
    }
}

fn append(
    to: &mut Gaussians,
    row: &[u8],
    mean: [f32; 3],
    layout: Layout,
    [low, high]: [f32; 2],
    harmonics: usize,
) {
    let number = |i: usize| layout.float(row, layout.number * i);
    to.means.push(mean);
    to.log_scales.push([number(3), number(4), number(5)].map(f32::ln));
    to.rotations.push([number(6), number(7), number(8), number(9)]);
    let colors = 10 * layout.number;
    to.sh.extend((0..3).map(|c| dc_of_color(f32::from(row[colors + c]) / 255.0)));
    to.opacity_logits.push(logit_of_byte(row[colors + 3]));
    let value = |component: usize| -> f32 {
        let at = colors + 4 + component * layout.harmonic;
        match layout.level {
            2 => low + f32::from(row[at]) / 255.0 * (high - low),
            _ => layout.float(row, at),
        }
    };
    // Band after band, in each all of red, then green, then blue.
    let mut first = 0;
    for per_channel in [3, 5, 7] {
        if first >= harmonics {
            break;
        }
        for k in 0..per_channel {
            to.sh.extend((0..3).map(|channel| value(first + channel * per_channel + k)));
        }
        first += 3 * per_channel;
    }
}
