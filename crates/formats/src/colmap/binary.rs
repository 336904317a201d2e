//! The binary files. Little endian; every file is a count and that many records.

use std::path::Path;

use glam::DVec3;
use motes_scene::{Camera, CameraModel};

use super::{
    ColmapImage, ColmapPoint, checked_camera, checked_pose, checked_position, invalid, known_error,
    relative_name,
};
use crate::error::{FormatError, Result};

/// Marks a keypoint without a 3D point (-1 as unsigned).
const NO_POINT: u64 = u64::MAX;

/// Reads numbers from a byte slice and knows where it is, for errors.
struct Cursor<'a> {
    bytes: &'a [u8],
    position: usize,
    path: &'a Path,
}

impl<'a> Cursor<'a> {
    fn open(bytes: &'a [u8], path: &'a Path) -> Result<Self> {
        // A count is below 2^32, so bytes 4 to 7 of a binary file are zero and never text.
        let head = &bytes[..bytes.len().min(64)];
        let printable = |b: &u8| matches!(b, b'\t' | b'\n' | b'\r' | b' '..=b'~');
        if !head.is_empty() && head.iter().all(printable) {
            return Err(invalid(path, "byte 0", "this is text, but the suffix .bin says binary")
                .with_remedy("rename the three files to .txt, or convert the model with colmap model_converter"));
        }
        Ok(Self { bytes, position: 0, path })
    }

    fn error(&self, record: &str, cause: impl Into<String>) -> FormatError {
        invalid(self.path, format!("{record}, byte {}", self.position), cause)
    }

    fn take<const N: usize>(&mut self, record: &str) -> Result<[u8; N]> {
        match self.bytes[self.position..].first_chunk::<N>() {
            Some(chunk) => {
                self.position += N;
                Ok(*chunk)
            }
            None => Err(self.error(record, "the file ends in the middle of a record")),
        }
    }

    fn u32(&mut self, record: &str) -> Result<u32> {
        Ok(u32::from_le_bytes(self.take(record)?))
    }

    fn u64(&mut self, record: &str) -> Result<u64> {
        Ok(u64::from_le_bytes(self.take(record)?))
    }

    fn f64(&mut self, record: &str) -> Result<f64> {
        Ok(f64::from_le_bytes(self.take(record)?))
    }

    fn floats<const N: usize>(&mut self, record: &str) -> Result<[f64; N]> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.f64(record)?;
        }
        Ok(values)
    }

    /// A number of records, refused when that many cannot fit into the rest of the file: the
    /// count is not trusted with memory before that.
    fn count(&mut self, record: &str, smallest_record: usize) -> Result<usize> {
        let start = self.position;
        let count = self.u64(record)?;
        let rest = self.bytes.len() - self.position;
        if count > (rest / smallest_record) as u64 {
            self.position = start;
            let cause = format!("{count} records cannot fit into the {rest} bytes that follow");
            return Err(self
                .error(record, cause)
                .with_remedy("the file is cut off or damaged: copy it again"));
        }
        Ok(count as usize)
    }

    fn text(&mut self, record: &str) -> Result<&'a str> {
        let rest = &self.bytes[self.position..];
        let Some(end) = rest.iter().position(|&b| b == 0) else {
            return Err(self.error(record, "the file ends in the middle of a name"));
        };
        let text = std::str::from_utf8(&rest[..end])
            .map_err(|_| self.error(record, "the image name is not UTF-8"))?;
        self.position += end + 1;
        Ok(text)
    }

    fn finish(self, what: &str) -> Result<()> {
        let rest = self.bytes.len() - self.position;
        if rest == 0 {
            Ok(())
        } else {
            Err(self.error(what, format!("{rest} bytes follow the last record")))
        }
    }
}

pub(super) fn parse_cameras(bytes: &[u8], path: &Path) -> Result<Vec<(u32, Camera)>> {
    let mut cursor = Cursor::open(bytes, path)?;
    let count = cursor.count("camera count", 24 + 2 * 8)?;
    let mut cameras = Vec::with_capacity(count);
    for index in 0..count {
        let record = format!("camera record {index}");
        let id = cursor.u32(&record)?;
        let model_id = i64::from(cursor.u32(&record)? as i32);
        let model = CameraModel::from_id(model_id).ok_or_else(|| {
            let cause = format!("camera model {model_id} is unknown");
            cursor.error(&record, cause).with_remedy("COLMAP's models 0 to 17 can be read")
        })?;
        let size = (cursor.u64(&record)?, cursor.u64(&record)?);
        let mut params = Vec::with_capacity(model.parameter_count());
        for _ in 0..model.parameter_count() {
            params.push(cursor.f64(&record)?);
        }
        cameras.push((id, checked_camera(path, &format!("camera {id}"), model, size, params)?));
    }
    cursor.finish("cameras")?;
    Ok(cameras)
}

pub(super) fn parse_images(bytes: &[u8], path: &Path) -> Result<Vec<ColmapImage>> {
    let mut cursor = Cursor::open(bytes, path)?;
    let count = cursor.count("image count", 4 + 7 * 8 + 4 + 1 + 8)?;
    let mut images = Vec::with_capacity(count);
    for index in 0..count {
        let record = format!("image record {index}");
        let id = cursor.u32(&record)?;
        let place = format!("image {id}");
        let camera_from_world = checked_pose(path, &place, &cursor.floats(&record)?)?;
        let camera_id = cursor.u32(&record)?;
        let name = cursor.text(&record)?;
        let name = relative_name(name).map_err(|cause| invalid(path, place, cause))?;
        let keypoints = cursor.count(&record, 24)?;
        let mut observations = Vec::new();
        for _ in 0..keypoints {
            let pixel = cursor.floats(&record)?;
            let point = cursor.u64(&record)?;
            if point != NO_POINT {
                observations.push((pixel, point));
            }
        }
        images.push(ColmapImage { id, name, camera_id, camera_from_world, observations });
    }
    cursor.finish("images")?;
    Ok(images)
}

pub(super) fn parse_points(bytes: &[u8], path: &Path) -> Result<Vec<ColmapPoint>> {
    let mut cursor = Cursor::open(bytes, path)?;
    let count = cursor.count("point count", 8 + 3 * 8 + 3 + 8 + 8)?;
    let mut points = Vec::with_capacity(count);
    for index in 0..count {
        let record = format!("point record {index}");
        let id = cursor.u64(&record)?;
        let position = DVec3::from_array(cursor.floats(&record)?);
        let position = checked_position(path, &format!("point {id}"), position)?;
        let color = cursor.take::<3>(&record)?;
        let error = known_error(cursor.f64(&record)?);
        let length = cursor.count(&record, 8)?;
        let mut track = Vec::with_capacity(length);
        for _ in 0..length {
            track.push(cursor.u32(&record)?);
            cursor.u32(&record)?;
        }
        points.push(ColmapPoint { id, position, color, error, track });
    }
    cursor.finish("points")?;
    Ok(points)
}
