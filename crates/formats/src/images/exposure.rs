//! The brightness setting of a photo, from its EXIF data.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use exif::{Exif, In, Reader, Tag, Value};
use motes_scene::MAX_EXPOSURE_STOPS;

/// `log2(t S / 100 / N²)` with the exposure time `t` in seconds, the ISO speed `S` and the f-number
/// `N` (1 where the photo has none: a lens with a fixed aperture). One more is twice as bright.
///
/// `None` without metadata that says so: damaged metadata is no reason to refuse a photo.
pub fn exposure_stops(path: &Path) -> Option<f64> {
    let mut file = BufReader::new(File::open(path).ok()?);
    let exif = Reader::new().read_from_container(&mut file).ok()?;
    stops_of(&exif)
}

fn stops_of(exif: &Exif) -> Option<f64> {
    let seconds = number(exif, Tag::ExposureTime)?;
    let iso = number(exif, Tag::PhotographicSensitivity)?;
    let f_number = number(exif, Tag::FNumber).unwrap_or(1.0);
    let stops = (seconds * iso / 100.0 / (f_number * f_number)).log2();
    (stops.abs() <= MAX_EXPOSURE_STOPS).then_some(stops)
}

fn number(exif: &Exif, tag: Tag) -> Option<f64> {
    let value = match &exif.get_field(tag, In::PRIMARY)?.value {
        Value::Rational(values) => values.first()?.to_f64(),
        value => f64::from(value.get_uint(0)?),
    };
    (value > 0.0 && value.is_finite()).then_some(value)
}

#[cfg(test)]
mod tests {
    use exif::Reader;

    use super::stops_of;

    /// A TIFF header with one directory of EXIF entries (tag, type, count, value or bits).
    fn tiff(entries: &[(u16, u16, u32)], rationals: &[(u32, u32)]) -> Vec<u8> {
        let ifd = 8 + 2 + 12 + 4;
        let heap = ifd + 2 + 12 * entries.len() + 4;
        let mut out = b"II*\0\x08\0\0\0\x01\0\x69\x87\x04\0\x01\0\0\0".to_vec();
        out.extend((ifd as u32).to_le_bytes());
        out.extend([0; 4]);
        out.extend((entries.len() as u16).to_le_bytes());
        for &(tag, kind, value) in entries {
            out.extend(tag.to_le_bytes());
            out.extend(kind.to_le_bytes());
            out.extend(1u32.to_le_bytes());
            let value = if kind == 5 { heap as u32 + 8 * value } else { value };
            out.extend(value.to_le_bytes());
        }
        out.extend([0; 4]);
        for (a, b) in rationals {
            out.extend(a.to_le_bytes());
            out.extend(b.to_le_bytes());
        }
        out
    }

    fn stops(entries: &[(u16, u16, u32)], rationals: &[(u32, u32)]) -> Option<f64> {
        stops_of(&Reader::new().read_raw(tiff(entries, rationals)).ok()?)
    }

    const TIME: u16 = 0x829a;
    const F_NUMBER: u16 = 0x829d;
    const ISO: u16 = 0x8827;

    #[test]
    fn twice_the_time_or_speed_is_one_stop_more() {
        let all = [(TIME, 5, 0), (F_NUMBER, 5, 1), (ISO, 3, 100)];
        let base = stops(&all, &[(1, 64), (2, 1)]).unwrap();
        assert_eq!(base, -8.0);
        assert_eq!(stops(&all, &[(1, 32), (2, 1)]), Some(base + 1.0));
        let faster = [(TIME, 5, 0), (F_NUMBER, 5, 1), (ISO, 3, 200)];
        assert_eq!(stops(&faster, &[(1, 64), (2, 1)]), Some(base + 1.0));
        assert_eq!(stops(&all, &[(1, 64), (4, 1)]), Some(base - 2.0));
        let fixed_aperture = [(TIME, 5, 0), (ISO, 3, 100)];
        assert_eq!(stops(&fixed_aperture, &[(1, 64)]), Some(-6.0));
    }

    #[test]
    fn what_says_nothing_is_none() {
        assert_eq!(stops(&[(ISO, 3, 100)], &[]), None);
        assert_eq!(stops(&[(TIME, 5, 0), (ISO, 3, 100)], &[(1, 0)]), None);
        assert_eq!(stops(&[(TIME, 5, 0), (ISO, 3, 100)], &[(0, 1)]), None);
        assert_eq!(stops(&[(TIME, 5, 0), (ISO, 3, 0)], &[(1, 64)]), None);
    }
}
