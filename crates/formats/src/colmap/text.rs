//! The text files. One record per line, `#` starts a comment line; an image takes two lines, of
//! which the second may be empty.

use std::path::Path;
use std::str::{FromStr, SplitAsciiWhitespace};

use glam::DVec3;
use motes_scene::{Camera, CameraModel};

use super::{
    ColmapImage, ColmapPoint, checked_camera, checked_pose, checked_position, invalid, known_error,
    relative_name,
};
use crate::error::{FormatError, Result};

/// The lines of a file with their numbers, comments included.
struct Lines<'a> {
    lines: std::iter::Enumerate<std::str::Lines<'a>>,
}

impl<'a> Lines<'a> {
    fn open(bytes: &'a [u8], path: &Path) -> Result<Self> {
        let text = std::str::from_utf8(bytes).map_err(|error| {
            let place = format!("byte {}", error.valid_up_to());
            invalid(path, place, "this is not text, but the suffix .txt says so")
                .with_remedy("binary model files must have the suffix .bin")
        })?;
        if let Some(byte) = text.bytes().position(|b| b == 0) {
            return Err(invalid(
                path,
                format!("byte {byte}"),
                "this is not text, but the suffix .txt says so",
            )
            .with_remedy("binary model files must have the suffix .bin"));
        }
        // Editors of some systems put a byte order mark first.
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        Ok(Self { lines: text.lines().enumerate() })
    }

    /// The next line, whatever it holds.
    fn next_line(&mut self) -> Option<(usize, &'a str)> {
        self.lines.next().map(|(index, line)| (index + 1, line))
    }

    /// The next line that is neither empty nor a comment.
    fn next_record(&mut self) -> Option<(usize, &'a str)> {
        loop {
            let (number, line) = self.next_line()?;
            let line = line.trim();
            if !line.is_empty() && !line.starts_with('#') {
                return Some((number, line));
            }
        }
    }
}

/// The words of one line.
struct Fields<'a> {
    words: SplitAsciiWhitespace<'a>,
    path: &'a Path,
    line: usize,
}

impl<'a> Fields<'a> {
    fn error(&self, cause: impl Into<String>) -> FormatError {
        invalid(self.path, format!("line {}", self.line), cause)
    }

    fn word(&mut self, what: &str) -> Result<&'a str> {
        self.words.next().ok_or_else(|| self.error(format!("the line ends before {what}")))
    }

    fn parse<T: FromStr>(&mut self, what: &str) -> Result<T> {
        let word = self.word(what)?;
        word.parse().map_err(|_| {
            self.error(format!("{what} should be a number, but is \"{}\"", word.escape_debug()))
        })
    }

    fn floats<const N: usize>(&mut self, what: &str) -> Result<[f64; N]> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.parse(what)?;
        }
        Ok(values)
    }
}

pub(super) fn parse_cameras(bytes: &[u8], path: &Path) -> Result<Vec<(u32, Camera)>> {
    let mut lines = Lines::open(bytes, path)?;
    let mut cameras = Vec::new();
    while let Some((line, record)) = lines.next_record() {
        let mut fields = Fields { words: record.split_ascii_whitespace(), path, line };
        let id = fields.parse("the camera id")?;
        let name = fields.word("the camera model")?;
        let model = CameraModel::from_name(name).ok_or_else(|| {
            let cause = format!("camera model \"{}\" is unknown", name.escape_debug());
            fields.error(cause).with_remedy("the names are COLMAP's, such as PINHOLE or OPENCV")
        })?;
        let size = (fields.parse("the image width")?, fields.parse("the image height")?);
        let mut params = Vec::with_capacity(model.parameter_count());
        for name in model.parameter_names() {
            params.push(fields.parse(&format!("parameter {name} of {}", model.name()))?);
        }
        if fields.words.next().is_some() {
            let count = model.parameter_count();
            return Err(fields.error(format!("{} has only {count} parameters", model.name())));
        }
        cameras.push((id, checked_camera(path, &format!("line {line}"), model, size, params)?));
    }
    Ok(cameras)
}

pub(super) fn parse_images(bytes: &[u8], path: &Path) -> Result<Vec<ColmapImage>> {
    let mut lines = Lines::open(bytes, path)?;
    let mut images = Vec::new();
    while let Some((line, record)) = lines.next_record() {
        let place = format!("line {line}");
        let mut fields = Fields { words: record.split_ascii_whitespace(), path, line };
        let id = fields.parse("the image id")?;
        let pose = fields.floats("the pose (qw qx qy qz tx ty tz)")?;
        let camera_from_world = checked_pose(path, &place, &pose)?;
        let camera_id = fields.parse("the camera id")?;
        // The name is the rest of the line: it may hold spaces.
        let name = relative_name(after_words(record, 9))
            .map_err(|cause| invalid(path, place.as_str(), cause))?;
        let mut observations = Vec::new();
        if let Some((line, keypoints)) = lines.next_line() {
            let mut fields = Fields { words: keypoints.split_ascii_whitespace(), path, line };
            while let Some(x) = fields.words.next() {
                let x = x.parse().map_err(|_| {
                    fields.error("this should be the keypoints of the image in the line before: x y point-id ...")
                        .with_remedy("an image takes two lines; the second may be empty but must be there")
                })?;
                let y = fields.parse("keypoint y")?;
                let point: i64 = fields.parse("the point id of a keypoint")?;
                if let Ok(point) = u64::try_from(point) {
                    observations.push(([x, y], point));
                }
            }
        }
        images.push(ColmapImage { id, name, camera_id, camera_from_world, observations });
    }
    Ok(images)
}

/// What follows the first `count` words of a line.
fn after_words(line: &str, count: usize) -> &str {
    let mut rest = line.trim_start();
    for _ in 0..count {
        rest =
            rest.find(|c: char| c.is_ascii_whitespace()).map_or("", |end| rest[end..].trim_start());
    }
    rest.trim_end()
}

pub(super) fn parse_points(bytes: &[u8], path: &Path) -> Result<Vec<ColmapPoint>> {
    let mut lines = Lines::open(bytes, path)?;
    let mut points = Vec::new();
    while let Some((line, record)) = lines.next_record() {
        let mut fields = Fields { words: record.split_ascii_whitespace(), path, line };
        let id = fields.parse("the point id")?;
        let position = DVec3::from_array(fields.floats("the position")?);
        let position = checked_position(path, &format!("line {line}"), position)?;
        let mut color = [0u8; 3];
        for channel in &mut color {
            *channel = fields.parse("the color (0 to 255)")?;
        }
        let error = known_error(fields.parse("the reprojection error")?);
        let mut track = Vec::new();
        while let Some(word) = fields.words.next() {
            let image = word
                .parse()
                .map_err(|_| fields.error("an image id of the track is not a number"))?;
            fields.parse::<u32>("the keypoint index of a track entry")?;
            track.push(image);
        }
        points.push(ColmapPoint { id, position, color, error, track });
    }
    Ok(points)
}
