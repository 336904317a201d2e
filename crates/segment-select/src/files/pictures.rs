//! What prompts are about, as far as it is in files: photos, prepared views, masks, selections.

use std::path::Path;

use motes_formats::images::{read_image, read_mask};
use motes_formats::selection::read_selection;
use motes_formats::selectors::MaskPrompt;
use motes_math::resample;
use motes_scene::{ImageF32, Pinhole, Pose, Selection};

use super::cached_view::ViewCache;
use crate::error::SelectError;
use crate::masks::Mask;
use crate::source::SelectSource;
use crate::view_data::ViewData;

/// Longest side of the pictures that a segmenter gets, pixels: that of the square of SAM.
const SEGMENTED_PX: usize = 1024;

impl SelectSource<'_> {
    /// The selection of a file, which has to be about the same Gaussians.
    pub(crate) fn selection_file(&self, path: &str) -> Result<Selection, SelectError> {
        let Some(bound) = self.bound() else {
            let text = "a selection file needs to know the file of the Gaussians";
            return Err(SelectError::BadValue(text.into()));
        };
        Ok(read_selection(Path::new(path), bound)?.selection)
    }

    /// The mask of a prompt, at its own size.
    pub(crate) fn mask(&self, prompt: &MaskPrompt) -> Result<Mask, SelectError> {
        let view = self.view_named(&prompt.view)?;
        let camera = self.camera(view)?;
        let image = read_mask(Path::new(&prompt.path))?;
        let ratio = |w: usize, h: usize| w as f64 / h.max(1) as f64;
        let (found, wanted) =
            (ratio(image.width, image.height), ratio(camera.width, camera.height));
        if image.pixel_count() == 0 || !((found / wanted - 1.0).abs() < 0.02) {
            return Err(SelectError::MaskShape {
                view: prompt.view.clone(),
                found: format!("{}x{}", image.width, image.height),
                wanted: format!("{}x{}", camera.width, camera.height),
                path: prompt.path.clone(),
            });
        }
        let labels = image.data.iter().step_by(image.channels).map(|&v| u32::from(v)).collect();
        let pose = self.capture("a mask")?.views[view].camera_from_world;
        Ok(Mask { camera: camera.resized(image.width, image.height), pose, labels })
    }

    /// A photo at the size of a camera. A capture may be moved without its photos: then there is none,
    /// and the rendering stands in for it.
    fn photo(file: &Path, camera: &Pinhole) -> Result<Option<ImageF32>, SelectError> {
        match file.exists() {
            true => Ok(Some(fitted(&read_image(file)?.to_f32(), camera))),
            false => Ok(None),
        }
    }

    /// Camera at the working size, pose and photo of a view, or its rendering where there is none.
    pub(crate) fn picture(&self, view: usize) -> Result<(Pinhole, Pose, ImageF32), SelectError> {
        self.picture_of(view, Self::working(&self.camera(view)?))
    }

    /// As [`Self::picture`], at the size that a segmenter gets: larger than the working size where the photo is.
    pub(crate) fn segmented_picture(
        &self,
        view: usize,
    ) -> Result<(Pinhole, Pose, ImageF32), SelectError> {
        let camera = self.camera(view)?;
        self.picture_of(view, Self::at_most(&camera, SEGMENTED_PX))
    }

    fn picture_of(
        &self,
        view: usize,
        camera: Pinhole,
    ) -> Result<(Pinhole, Pose, ImageF32), SelectError> {
        let Some((capture, folder)) = &self.capture else {
            return Err(SelectError::NoCapture("a picture"));
        };
        let view = &capture.views[view];
        let pose = view.camera_from_world;
        let picture = match Self::photo(&folder.join(&view.image), &camera)? {
            Some(photo) => photo,
            None => motes_raster::render(self.gaussians, &camera, &pose, &self.options).color,
        };
        Ok((camera, pose, picture))
    }

    /// Prepares a view, or finds it in the cache.
    pub(crate) fn prepare(&self, view: usize) -> Result<ViewData, SelectError> {
        let (capture, folder) = match &self.capture {
            Some((capture, folder)) => (*capture, folder),
            None => return Err(SelectError::NoCapture("a prompt in pixels")),
        };
        let camera = Self::working(&self.camera(view)?);
        let view = &capture.views[view];
        let photo_file = folder.join(&view.image);
        let cache = match (&self.cache, self.bound()) {
            (Some(cache), Some(bound)) => Some(ViewCache::new(
                cache,
                &bound.sha256,
                &camera,
                &view.camera_from_world,
                self.options.antialias,
                &photo_file,
            )),
            _ => None,
        };
        if let Some(found) = cache.as_ref().and_then(|c| c.read(self.gaussians.len())) {
            return Ok(found);
        }
        let photo = Self::photo(&photo_file, &camera)?;
        let (g, pose) = (self.gaussians, &view.camera_from_world);
        let data = ViewData::new(g, &camera, pose, photo.as_ref(), &self.options);
        if let Some(cache) = cache {
            cache.write(&data)?;
        }
        Ok(data)
    }
}

/// A photo of three channels at the size of a camera.
fn fitted(photo: &ImageF32, camera: &Pinhole) -> ImageF32 {
    let channel = |c: usize| c.min(photo.channels - 1);
    let channels = if photo.channels < 3 { [0, 0, 0] } else { [0, channel(1), channel(2)] };
    let data = photo.data.chunks_exact(photo.channels);
    let data = data.flat_map(|p| channels.map(|c| p[c])).collect();
    let rgb = ImageF32::from_data(photo.width, photo.height, 3, data);
    if (rgb.width, rgb.height) == (camera.width, camera.height) {
        return rgb;
    }
    let size = (rgb.width, rgb.height, 3);
    let new_size = (camera.width, camera.height);
    let data = resample::resize(&rgb.data, size, new_size, resample::Filter::Triangle);
    ImageF32::from_data(camera.width, camera.height, 3, data)
}
