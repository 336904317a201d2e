//! Reading a ground-truth folder.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, bail};
use motes_formats::exr_aov::{AovImage, open_exr};
use motes_formats::images::{read_image, read_mask};
use motes_scene::{ImageF32, ImageU8};
use serde::Deserialize;

/// An object of the scene.
#[derive(Clone, Debug, Deserialize)]
pub struct TruthObject {
    /// Gray value of its pixels in the id pictures; 1 is the support.
    pub id: u8,
    /// Its name.
    pub name: String,
    /// 0 or 1.
    #[serde(default)]
    pub metallic: f64,
    /// Perceptual.
    #[serde(default)]
    pub roughness: f64,
}

#[derive(Deserialize)]
struct SceneDocument {
    title: String,
    width: usize,
    height: usize,
    exposure: f64,
    relight_lights: Vec<String>,
    objects: Vec<TruthObject>,
    #[serde(default)]
    masked: bool,
}

#[derive(Deserialize)]
struct Transforms {
    frames: Vec<Frame>,
}

#[derive(Deserialize)]
struct Frame {
    file_path: String,
}

/// A folder of ground truth.
#[derive(Clone, Debug)]
pub struct TruthFolder {
    /// Where it is.
    pub root: PathBuf,
    /// Name of the scene.
    pub title: String,
    /// Columns and rows.
    pub size: (usize, usize),
    /// Linear photo value over radiance.
    pub exposure: f64,
    /// Lights that the test views are there under.
    pub lights: Vec<String>,
    /// What is in the scene.
    pub objects: Vec<TruthObject>,
    /// Whether its pictures show things alone: the rest counts for nothing.
    pub is_masked: bool,
    /// Names of the test views, without suffix.
    pub views: Vec<String>,
}

/// Buffers of a view.
#[derive(Clone, Debug)]
pub struct TruthBuffers {
    /// Linear base color.
    pub albedo: ImageF32,
    /// Unit, world.
    pub normal: ImageF32,
    /// Perceptual, 1 channel.
    pub roughness: ImageF32,
    /// 1 channel.
    pub metallic: ImageF32,
    /// Object of every pixel.
    pub ids: ImageU8,
}

/// Name of a view, without suffix, from the path of its picture.
pub(crate) fn frame_name(file_path: &str) -> String {
    Path::new(file_path).file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

fn document<T: serde::de::DeserializeOwned>(path: &Path) -> anyhow::Result<T> {
    let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
    serde_json::from_str(&text).with_context(|| path.display().to_string())
}

/// Channels of an EXR side by side.
///
/// # Errors
/// When one is missing; the message names the file.
pub fn channels(path: &Path, image: &AovImage, names: &[&[&str]]) -> anyhow::Result<ImageF32> {
    let mut planes = Vec::new();
    for alternatives in names {
        let found = alternatives.iter().find_map(|name| image.channel(name));
        let Some(channel) = found else {
            bail!("there is no channel {}: {}", alternatives.join(" or "), path.display());
        };
        planes.push(channel.to_f32());
    }
    let n = image.width * image.height;
    let data = (0..n).flat_map(|i| planes.iter().map(move |p| p[i])).collect();
    Ok(ImageF32::from_data(image.width, image.height, planes.len(), data))
}

impl TruthFolder {
    /// Reads the documents of a folder; pictures are read when they are needed.
    ///
    /// # Errors
    /// When `scene.json` or `transforms_test.json` is missing or malformed.
    pub fn open(root: &Path) -> anyhow::Result<Self> {
        let scene: SceneDocument = document(&root.join("scene.json"))?;
        let test: Transforms = document(&root.join("transforms_test.json"))?;
        Ok(Self {
            root: root.to_path_buf(),
            title: scene.title,
            size: (scene.width, scene.height),
            exposure: scene.exposure,
            lights: scene.relight_lights,
            objects: scene.objects,
            is_masked: scene.masked,
            views: test.frames.iter().map(|frame| frame_name(&frame.file_path)).collect(),
        })
    }

    /// Refuses another size than that of the test views.
    ///
    /// # Errors
    /// When it differs; the message names the file.
    pub fn check(&self, path: &Path, size: (usize, usize)) -> anyhow::Result<()> {
        if size != self.size {
            let (w, h) = self.size;
            bail!("{} x {} pixels, the truth has {w} x {h}: {}", size.0, size.1, path.display());
        }
        Ok(())
    }

    /// Which pixels of a view show the scene and nothing else; none where pictures are not masked.
    ///
    /// # Errors
    /// When its picture is missing.
    pub fn mask(&self, view: &str) -> anyhow::Result<Option<Vec<bool>>> {
        if !self.is_masked {
            return Ok(None);
        }
        let places = ["test/capture", "images"];
        let mut paths =
            places.map(|place| self.root.join(format!("{place}/{view}.png"))).into_iter();
        let path = paths.find(|path| path.exists());
        let path =
            path.with_context(|| format!("no picture of {view}: {}", self.root.display()))?;
        let image = read_image(&path)?;
        anyhow::ensure!(image.channels == 4, "there is no alpha channel: {}", path.display());
        Ok(Some(image.data.chunks_exact(4).map(|pixel| pixel[3] == u8::MAX).collect()))
    }

    /// Sets pixels of a test view, three values each, that do not count to 0.
    ///
    /// # Errors
    /// As [`Self::mask`].
    pub fn black_out<T: Copy + Default>(&self, view: &str, data: &mut [T]) -> anyhow::Result<()> {
        let Some(mask) = self.mask(view)? else { return Ok(()) };
        let pixels = data.chunks_exact_mut(3).zip(mask).filter(|(_, counts)| !counts);
        pixels.for_each(|(pixel, _)| pixel.fill(T::default()));
        Ok(())
    }

    /// An 8-bit picture of a test view, 3 channels; black where it does not count.
    ///
    /// # Errors
    /// When it is missing or has another size.
    pub fn picture(&self, folder: &Path, view: &str) -> anyhow::Result<ImageU8> {
        let path = folder.join(format!("{view}.png"));
        let image = read_image(&path)?;
        self.check(&path, (image.width, image.height))?;
        let rgb = |p: &[u8]| [p[0], p[1], p[2]];
        let mut data = image.data.chunks_exact(image.channels).flat_map(rgb).collect::<Vec<u8>>();
        self.black_out(view, &mut data)?;
        Ok(ImageU8::from_data(image.width, image.height, 3, data))
    }

    /// Object of every pixel of a view, photos and test views.
    ///
    /// # Errors
    /// When it is missing.
    pub fn ids(&self, view: &str) -> anyhow::Result<ImageU8> {
        Ok(read_mask(&self.root.join(format!("aov/{view}_id.png")))?)
    }

    /// Depth of a test view, z in the camera, 1 channel.
    ///
    /// # Errors
    /// When it is missing.
    pub fn depth(&self, view: &str) -> anyhow::Result<ImageF32> {
        let path = self.root.join(format!("aov/{view}_depth.exr"));
        channels(&path, &open_exr(&path)?, &[&["Z"]])
    }

    /// The buffers of a test view.
    ///
    /// # Errors
    /// When one is missing or has another size.
    pub fn buffers(&self, view: &str) -> anyhow::Result<TruthBuffers> {
        let read = |what: &str, names: &[&[&str]]| {
            let path = self.root.join(format!("aov/{view}_{what}.exr"));
            let image = open_exr(&path)?;
            self.check(&path, (image.width, image.height))?;
            channels(&path, &image, names)
        };
        let rgb: &[&[&str]] = &[&["R"], &["G"], &["B"]];
        Ok(TruthBuffers {
            albedo: read("albedo", rgb)?,
            normal: read("normal", rgb)?,
            roughness: read("roughness", &[&["R"]])?,
            metallic: read("metallic", &[&["R"]])?,
            ids: self.ids(view)?,
        })
    }
}
