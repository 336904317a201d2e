//! Photos out of a video: ffmpeg decodes, [`crate::video`] chooses.
//!
//! Two passes: small gray frames to look at, then the chosen ones in full size.

use std::path::{Path, PathBuf};
use std::process::Command;

use clap::Args;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::error::{IngestError, Result};
use crate::files::process::{self, Line};
use crate::progress::Progress;
use crate::video::{Gray, choose, image_motion, sharpness};

/// Frames per second that are looked at, at most.
const RATE: f64 = 10.0;
/// Frames that are looked at, at most: a longer video is looked at less often.
const MOST_FRAMES: f64 = 2000.0;
/// Longer side of the frames that are looked at, pixels.
const SMALL_SIDE: u32 = 240;
/// Fewer photos give no poses.
const FEWEST: usize = 3;
/// Transfer functions of high dynamic range, which 8-bit pictures show too flat.
const HDR: [&str; 2] = ["smpte2084", "arib-std-b67"];
const SET_UP: &str = "install ffmpeg (Debian: apt-get install ffmpeg), or export frames with another program and give --photos DIR";

/// How frames of a video become photos.
#[derive(Clone, Debug, Default, Args, Serialize, Deserialize)]
#[command(next_help_heading = "Video")]
pub struct VideoOptions {
    /// Video to take photos from, by ffmpeg; COLMAP estimates their poses
    #[arg(long, value_name = "FILE", conflicts_with_all = ["input", "photos", "model", "images", "masks"])]
    pub video: Option<PathBuf>,

    /// Number of frames, the sharpest at equal steps of image motion [default: one per tenth of an
    /// image width, 24 to 150]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(3..=2000), requires = "video")]
    pub frames: Option<u32>,
}

/// What was taken from a video.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct VideoReport {
    /// Frames that were looked at.
    pub frames_seen: usize,
    /// Those per second of the video.
    pub frames_seen_per_second: f64,
    /// How far the picture moved in all, in image widths.
    pub image_motion_widths: f64,
    /// When the photos were taken, seconds from the start of the video.
    pub photo_times_seconds: Vec<f64>,
    /// What may spoil the result.
    #[serde(skip)]
    pub(crate) warnings: Vec<String>,
}

/// Takes photos from `video` into `folder`, which is made: `frame_0001.png` and so on.
pub(crate) fn take_photos(
    video: &Path,
    wanted: Option<u32>,
    folder: &Path,
    progress: &dyn Progress,
) -> Result<VideoReport> {
    let facts = examine(video, progress)?;
    let rate = RATE.min(facts.frame_rate).min(MOST_FRAMES / facts.seconds);
    // What lies there would be solved too, and may be somebody's.
    if std::fs::read_dir(folder).is_ok_and(|mut entries| entries.next().is_some()) {
        let cause = format!("this folder holds files already: {}", folder.display());
        return Err(IngestError::usage(cause, "move it away, or give another --sfm-workspace"));
    }
    let small = folder.join("small");
    make_folder(&small)?;
    let filter =
        format!("fps={rate},scale='if(gt(iw,ih),{SMALL_SIDE},-2)':'if(gt(iw,ih),-2,{SMALL_SIDE})'");
    let expected = (facts.seconds * rate).ceil() as usize;
    progress.begin("looking at frames", expected);
    ffmpeg(video, &filter, "gray", &small.join("%06d.pgm"), progress)?;
    let (sharpness, motions) = look(&small, expected)?;
    let _ = std::fs::remove_dir_all(&small);
    let chosen = choose(&sharpness, &motions, wanted.map(|n| n as usize));
    if chosen.frames.len() < FEWEST {
        return Err(IngestError::bad_input(
            format!(
                "the camera hardly moves in this video ({} frames differ by {:.2} image widths in all): {}",
                sharpness.len(),
                chosen.motion,
                video.display()
            ),
            "walk around the scene while filming, slowly and without a pause; turning on the spot shows no depth",
        ));
    }
    let terms: Vec<String> = chosen.frames.iter().map(|k| format!("eq(n\\,{k})")).collect();
    // New times, or the gaps would be filled with copies.
    let filter = format!("fps={rate},select='{}',setpts=N/{rate}/TB", terms.join("+"));
    progress.begin("extracting photos", chosen.frames.len());
    ffmpeg(video, &filter, "rgb24", &folder.join("frame_%04d.png"), progress)?;
    let written = numbered(folder, "png")?.len();
    if written != chosen.frames.len() {
        return Err(IngestError::Failed {
            cause: format!(
                "ffmpeg wrote {written} of {} photos: {}",
                chosen.frames.len(),
                video.display()
            ),
            remedy: "convert the video to H.264 in MP4 and try again".into(),
        });
    }
    let mut warnings = Vec::new();
    if HDR.contains(&facts.transfer.as_str()) {
        warnings.push(format!(
            "the video has high dynamic range ({}), and its photos look flat: film with HDR off, or convert it with a tone curve first",
            facts.transfer
        ));
    }
    Ok(VideoReport {
        frames_seen: sharpness.len(),
        frames_seen_per_second: rate,
        image_motion_widths: chosen.motion,
        photo_times_seconds: chosen.frames.iter().map(|&k| k as f64 / rate).collect(),
        warnings,
    })
}

/// What ffprobe says of a video.
struct Facts {
    seconds: f64,
    frame_rate: f64,
    transfer: String,
}

fn examine(video: &Path, progress: &dyn Progress) -> Result<Facts> {
    if !video.is_file() {
        let cause = format!("there is no such video: {}", video.display());
        return Err(IngestError::bad_input(cause, "check the path"));
    }
    let mut command = Command::new("ffprobe");
    command.args(["-v", "error", "-protocol_whitelist", "file", "-select_streams", "v:0"]);
    command.args(["-show_entries", "stream=avg_frame_rate,color_transfer:format=duration"]);
    command.args(["-of", "json"]).arg(file_address(video));
    let mut answer = String::new();
    let ended = process::run(&mut command, progress, &mut |line| {
        if let Line::Out(text) = line {
            answer.push_str(text);
        }
    })
    .map_err(without_ffmpeg)?;
    let answer: Value = serde_json::from_str(&answer).unwrap_or_default();
    let stream = &answer["streams"][0];
    if !ended.status.success() {
        return Err(unreadable(video, &ended.last_words));
    }
    if stream.is_null() {
        return Err(unreadable(video, &["it has no pictures".to_owned()]));
    }
    let positive = |value: f64| (value > 0.0 && value.is_finite()).then_some(value);
    let seconds = answer["format"]["duration"].as_str().and_then(|text| text.parse().ok());
    let Some(seconds) = seconds.and_then(positive) else {
        return Err(unreadable(video, &["its length is not known".to_owned()]));
    };
    Ok(Facts {
        seconds,
        frame_rate: stream["avg_frame_rate"]
            .as_str()
            .and_then(ratio)
            .and_then(positive)
            .unwrap_or(RATE),
        transfer: stream["color_transfer"].as_str().unwrap_or_default().to_owned(),
    })
}

/// `30000/1001` or `25`.
fn ratio(text: &str) -> Option<f64> {
    match text.split_once('/') {
        Some((over, under)) => Some(over.parse::<f64>().ok()? / under.parse::<f64>().ok()?),
        None => text.parse().ok(),
    }
}

/// Decodes a video through a filter into numbered pictures.
fn ffmpeg(
    video: &Path,
    filter: &str,
    pixels: &str,
    pictures: &Path,
    progress: &dyn Progress,
) -> Result<()> {
    let mut command = Command::new("ffmpeg");
    // A playlist in disguise opens nothing but files.
    command.args(["-nostdin", "-v", "error", "-progress", "pipe:1", "-protocol_whitelist", "file"]);
    command.arg("-i").arg(file_address(video));
    command.args(["-map", "0:v:0", "-an", "-sn", "-vf", filter, "-pix_fmt", pixels]);
    command.args(["-f", "image2", "-y"]).arg(pictures);
    let ended = process::run(&mut command, progress, &mut |line| {
        if let Line::Out(text) = line
            && let Some(done) = text.strip_prefix("frame=").and_then(|n| n.trim().parse().ok())
        {
            progress.advance_to(done);
        }
    })
    .map_err(without_ffmpeg)?;
    if ended.status.success() { Ok(()) } else { Err(unreadable(video, &ended.last_words)) }
}

/// Never a flag, a device or an address, whatever the name.
fn file_address(video: &Path) -> std::ffi::OsString {
    let mut address = std::ffi::OsString::from("file:");
    address.push(video);
    address
}

/// Sharpness of every small frame, and the motion from each to the next.
fn look(folder: &Path, expected: usize) -> Result<(Vec<f64>, Vec<Option<f64>>)> {
    let mut paths = numbered(folder, "pgm")?;
    // The rate is ours: more than twice the frames that fit in are a broken file.
    paths.truncate(2 * expected + 16);
    let frames: Vec<Gray> = paths.par_iter().map(|path| read(path)).collect::<Result<_>>()?;
    let motions = frames.par_windows(2).map(|pair| image_motion(&pair[0], &pair[1])).collect();
    Ok((frames.par_iter().map(sharpness).collect(), motions))
}

fn read(path: &Path) -> Result<Gray> {
    let picture = image::open(path).map_err(|error| IngestError::Failed {
        cause: format!("ffmpeg wrote a picture that cannot be read ({error}): {}", path.display()),
        remedy: "check that the disk is not full".into(),
    })?;
    let picture = picture.into_luma8();
    let (width, height) = (picture.width() as usize, picture.height() as usize);
    Ok(Gray { width, height, data: picture.into_raw() })
}

/// Files with a suffix, by name.
fn numbered(folder: &Path, suffix: &str) -> Result<Vec<PathBuf>> {
    let listed = std::fs::read_dir(folder).map_err(|error| cannot_use(folder, &error))?;
    let mut paths: Vec<PathBuf> = listed
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| path.extension().is_some_and(|s| s == suffix))
        .collect();
    paths.sort();
    Ok(paths)
}

fn make_folder(folder: &Path) -> Result<()> {
    std::fs::create_dir_all(folder).map_err(|error| cannot_use(folder, &error))
}

fn cannot_use(folder: &Path, error: &std::io::Error) -> IngestError {
    IngestError::Failed {
        cause: format!("cannot use the folder of frames ({error}): {}", folder.display()),
        remedy: "give a folder with --sfm-workspace".into(),
    }
}

fn unreadable(video: &Path, last_words: &[String]) -> IngestError {
    let cause = last_words.last().map_or("ffmpeg said nothing", String::as_str);
    IngestError::bad_input(
        format!("this video cannot be decoded ({cause}): {}", video.display()),
        "check that it plays; convert it to H.264 in MP4",
    )
}

fn without_ffmpeg(error: IngestError) -> IngestError {
    match error {
        IngestError::Failed { cause, .. } => IngestError::Failed { cause, remedy: SET_UP.into() },
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_and_addresses() {
        assert_eq!(ratio("30000/1001").map(|r| (r * 100.0).round()), Some(2997.0));
        assert_eq!((ratio("25"), ratio("a/b"), ratio("")), (Some(25.0), None, None));
        assert!(ratio("0/0").is_some_and(f64::is_nan));
        assert_eq!(file_address(Path::new("-i")), "file:-i");
        assert_eq!(file_address(Path::new("http://a/b.m3u8")), "file:http://a/b.m3u8");
    }
}
