//! The streams of an spz file, compressed and not.

use std::io::{self, Read, Write};
use std::path::Path;

use flate2::Compression;
use flate2::bufread::GzDecoder;
use flate2::write::GzEncoder;
use rayon::prelude::*;

use super::super::bytes::Bytes;
use super::super::rows::check_rows;
use super::{FLAG_EXTENSIONS, MAGIC, MOST_FRACTIONAL_BITS, Packed, stride};
use motes_formats::error::{FormatError, Result};

const HEADER_BYTES: u32 = 32;
/// A zstd block of at least 3 bytes gives at most 128 KiB.
const MOST_ZSTD_RATIO: u64 = (128 << 10) / 3 + 1;
/// Beyond this level the time grows several times faster than the file shrinks.
const ZSTD_LEVEL: i32 = 9;

struct Header {
    version: u32,
    rows: u32,
    sh_degree: u8,
    fractional_bits: u8,
    flags: u8,
    last: u8,
}

impl Header {
    fn read(bytes: &mut Bytes<'_>, path: &Path) -> Result<Self> {
        let place = bytes.place();
        let fault = |cause: String| Err(FormatError::invalid(path, place.clone(), cause));
        if bytes.u32("the magic number")? != MAGIC {
            return fault("not an spz file: the magic number is not NGSP".into());
        }
        let version = bytes.u32("the version")?;
        let rows = bytes.u32("the number of Gaussians")?;
        let [sh_degree, fractional_bits, flags, last] = bytes.array("the header")?;
        if !(1..=4).contains(&version) {
            let cause = format!("spz version {version}; versions 1 to 4 are known");
            return Err(FormatError::not_supported(path, place, cause));
        }
        if sh_degree > 4 {
            return fault(format!("the SH degree is {sh_degree}, at most 4 exist"));
        }
        if fractional_bits > MOST_FRACTIONAL_BITS {
            return fault(format!("coordinates have {fractional_bits} fractional bits"));
        }
        Ok(Self { version, rows, sh_degree, fractional_bits, flags, last })
    }

    fn packed(&self, streams: [Vec<u8>; 6]) -> Packed {
        Packed {
            version: self.version,
            rows: self.rows as usize,
            sh_degree: self.sh_degree,
            fractional_bits: self.fractional_bits,
            flags: self.flags,
            streams,
        }
    }
}

pub(super) fn read(data: &[u8], path: &Path) -> Result<Packed> {
    if data.starts_with(&MAGIC.to_le_bytes()) {
        read_zstd(data, path)
    } else {
        read_gzip(data, path)
    }
}

fn read_gzip(data: &[u8], path: &Path) -> Result<Packed> {
    let mut decoder = GzDecoder::new(data);
    let broken = |error: io::Error| {
        FormatError::invalid(path, "gzip stream", format!("cannot be decompressed: {error}"))
            .with_remedy("the file is incomplete or was damaged: copy or export it again")
    };
    let mut start = Vec::new();
    (&mut decoder).take(16).read_to_end(&mut start).map_err(broken)?;
    let header = Header::read(&mut Bytes::new(&start, path), path)?;
    if header.version > 3 {
        let cause = format!("version {} in a gzip stream; it has a plain header", header.version);
        return Err(FormatError::invalid(path, "spz header", cause));
    }
    let sizes = stride(header.version, header.sh_degree).map(|n| n as u64 * u64::from(header.rows));
    let expected: u64 = sizes.iter().sum();
    check_rows(path, "spz header", header.rows.into(), header.sh_degree, data.len())?;
    // Grows as bytes arrive; one more than expected shows that there are more.
    let mut body = Vec::new();
    let has_extensions = header.flags & FLAG_EXTENSIONS != 0;
    let most = if has_extensions { expected + (1 << 20) } else { expected + 1 };
    (&mut decoder).take(most).read_to_end(&mut body).map_err(broken)?;
    let found = body.len() as u64;
    if found < expected || (found > expected && !has_extensions) {
        let cause = format!(
            "{} Gaussians of SH degree {} take {expected} bytes, there are {}{found}",
            header.rows,
            header.sh_degree,
            if found > expected { "at least " } else { "" },
        );
        return Err(FormatError::invalid(path, "spz header", cause));
    }
    // Extensions lie between header and streams.
    let mut bytes = Bytes::new(&body[(found - expected) as usize..], path);
    let mut streams: [Vec<u8>; 6] = Default::default();
    for (stream, size) in streams.iter_mut().zip(sizes) {
        *stream = bytes.take(size, "the streams")?.to_vec();
    }
    Ok(header.packed(streams))
}

fn read_zstd(data: &[u8], path: &Path) -> Result<Packed> {
    let mut bytes = Bytes::new(data, path);
    let header = Header::read(&mut bytes, path)?;
    let table_at = u64::from(bytes.u32("the offset of the table")?);
    let fault = |cause: String| FormatError::invalid(path, "spz header", cause);
    if header.version < 4 {
        return Err(fault(format!("version {} without gzip", header.version)));
    }
    if table_at < u64::from(HEADER_BYTES) || table_at > data.len() as u64 {
        return Err(fault(format!("the table of streams is said to be at byte {table_at}")));
    }
    let wanted = stride(header.version, header.sh_degree);
    // Without harmonics the last stream may be left out.
    let needed = if header.sh_degree == 0 { 5 } else { 6 };
    if usize::from(header.last) < needed {
        return Err(fault(format!("{} streams instead of {needed}", header.last)));
    }
    let mut table = Bytes::new(&data[table_at as usize..], path);
    let mut sizes = Vec::new();
    for _ in 0..header.last {
        sizes.push((table.u64("the table of streams")?, table.u64("the table of streams")?));
    }
    let mut streams: [Vec<u8>; 6] = Default::default();
    for (i, (compressed, raw)) in sizes.into_iter().enumerate() {
        let frame = table.take(compressed, "the streams")?;
        let Some(stream) = streams.get_mut(i) else { break };
        let expected = wanted[i] as u64 * u64::from(header.rows);
        if raw != expected || raw > compressed.saturating_mul(MOST_ZSTD_RATIO) {
            let cause = format!(
                "stream {i} of {compressed} bytes is said to have {raw} when decompressed; {} Gaussians of SH degree {} need {expected}",
                header.rows, header.sh_degree
            );
            return Err(fault(cause));
        }
        check_rows(path, "spz header", header.rows.into(), header.sh_degree, data.len())?;
        *stream = decompress(frame, raw, i, path)?;
    }
    Ok(header.packed(streams))
}

fn decompress(frame: &[u8], raw: u64, i: usize, path: &Path) -> Result<Vec<u8>> {
    let fault = |cause: String| {
        FormatError::invalid(path, format!("stream {i}"), cause)
            .with_remedy("the file is incomplete or was damaged: copy or export it again")
    };
    let broken = |error: io::Error| fault(format!("cannot be decompressed: {error}"));
    if raw == 0 {
        return Ok(Vec::new());
    }
    let mut decoder = zstd::Decoder::with_buffer(frame).map_err(broken)?;
    // A frame of one segment has a window as large as its content, which was compared with the
    // size of the file.
    decoder.window_log_max(31).map_err(broken)?;
    let mut stream = Vec::new();
    decoder.take(raw + 1).read_to_end(&mut stream).map_err(broken)?;
    if stream.len() as u64 != raw {
        return Err(fault(format!("{} bytes instead of {raw}", stream.len())));
    }
    Ok(stream)
}

pub(super) fn write(writer: &mut dyn Write, packed: &Packed) -> io::Result<()> {
    let mut header = Vec::new();
    for value in [MAGIC, packed.version, packed.rows as u32] {
        header.extend(value.to_le_bytes());
    }
    header.extend([packed.sh_degree, packed.fractional_bits, packed.flags]);
    if packed.version < 4 {
        header.push(0);
        let mut encoder = GzEncoder::new(writer, Compression::default());
        encoder.write_all(&header)?;
        for stream in &packed.streams {
            encoder.write_all(stream)?;
        }
        return encoder.finish().map(drop);
    }
    let frames: Vec<Vec<u8>> = packed
        .streams
        .par_iter()
        .map(|stream| zstd::bulk::compress(stream, ZSTD_LEVEL))
        .collect::<io::Result<_>>()?;
    header.push(frames.len() as u8);
    header.extend(HEADER_BYTES.to_le_bytes());
    header.resize(HEADER_BYTES as usize, 0);
    for (frame, stream) in frames.iter().zip(&packed.streams) {
        header.extend((frame.len() as u64).to_le_bytes());
        header.extend((stream.len() as u64).to_le_bytes());
    }
    writer.write_all(&header)?;
    frames.iter().try_for_each(|frame| writer.write_all(frame))
}
