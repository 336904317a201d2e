//! Videos of numbered pictures, by ffmpeg.

use super::options::VideoOptions;
use std::io;
use std::path::Path;
use std::process::Command;

impl VideoOptions {
    /// Whether pictures are numbered.
    pub fn numbers_frames(&self) -> bool {
        self.video_frames || self.video.is_some()
    }

    /// The command that makes a video of the pictures in `folder`.
    pub fn command(&self, folder: &Path) -> Vec<String> {
        let pattern = folder.join("frame_%04d.png").display().to_string();
        let video = self.video.as_deref().unwrap_or(Path::new("video.mp4")).display().to_string();
        let rate = self.fps.to_string();
        // H.264 needs even sides, hence the padding.
        let words = [
            "ffmpeg",
            "-y",
            "-framerate",
            &rate,
            "-i",
            &pattern,
            "-vf",
            "pad=ceil(iw/2)*2:ceil(ih/2)*2",
            "-c:v",
            "libx264",
            "-pix_fmt",
            "yuv420p",
            &video,
        ];
        words.map(str::to_owned).to_vec()
    }
}

/// The command as a shell takes it.
pub fn shell_words(command: &[String]) -> String {
    let quote = |word: &String| {
        let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=:%+,".contains(c);
        if !word.is_empty() && word.chars().all(plain) {
            word.clone()
        } else {
            format!("'{}'", word.replace('\'', "'\\''"))
        }
    };
    command.iter().map(quote).collect::<Vec<_>>().join(" ")
}

/// Whether ffmpeg can be run.
pub fn ffmpeg_exists() -> bool {
    Command::new("ffmpeg").arg("-version").output().is_ok_and(|done| done.status.success())
}

/// Runs the command.
///
/// # Errors
/// When it cannot be started or fails; the message is the last line that it wrote.
pub fn run_ffmpeg(command: &[String]) -> io::Result<()> {
    let (program, arguments) = command.split_first().ok_or(io::ErrorKind::InvalidInput)?;
    let done = Command::new(program).args(arguments).output()?;
    if done.status.success() {
        return Ok(());
    }
    let said = String::from_utf8_lossy(&done.stderr);
    Err(io::Error::other(said.lines().last().unwrap_or("ffmpeg said nothing").to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_can_be_pasted_into_a_shell() {
        let options = VideoOptions { video_frames: true, video: None, fps: 24 };
        let words = shell_words(&options.command(Path::new("my renders")));
        assert!(words.starts_with("ffmpeg -y -framerate 24 -i 'my renders/frame_%04d.png' -vf '"));
        assert!(words.ends_with(" video.mp4"), "{words}");
    }

    #[test]
    fn a_failing_command_is_reported() {
        let fail = ["sh", "-c", "echo one >&2; echo two >&2; exit 3"].map(String::from);
        assert_eq!(run_ffmpeg(&fail).unwrap_err().to_string(), "two");
        assert!(run_ffmpeg(&["motes-no-such-program".to_owned()]).is_err());
    }
}
