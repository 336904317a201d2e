//! Prepared views on disk, named after everything that they depend on.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use motes_formats::selection::{sha256_of_bytes, sha256_of_file};
use motes_formats::tensors::{TensorData, read_tensors, write_tensors};
use motes_raster::{Antialias, LabelVotes};
use motes_scene::{Pinhole, Pose};

use crate::error::SelectError;
use crate::view_data::{Border, SUPERPIXEL_PX, Segment, ViewData};

/// Changes whenever [`ViewData::new`] computes something else.
const VERSION: u32 = 1;
/// Floats per segment and border in the file.
const SEGMENT: usize = 16;
const BORDER: usize = 3;

/// The place of one prepared view.
pub(crate) struct ViewCache {
    file: PathBuf,
    camera: Pinhole,
    camera_from_world: Pose,
}

impl ViewCache {
    pub(crate) fn new(
        folder: &Path,
        gaussians_sha256: &str,
        camera: &Pinhole,
        camera_from_world: &Pose,
        antialias: Antialias,
        photo: &Path,
    ) -> Self {
        let photo = sha256_of_file(photo).unwrap_or_default();
        let key = format!(
            "{VERSION} {SUPERPIXEL_PX} {} {gaussians_sha256} {camera:?} {camera_from_world:?} {antialias:?} {photo}",
            env!("CARGO_PKG_VERSION"),
        );
        let name = format!("view-{}.safetensors", &sha256_of_bytes(key.as_bytes())[..24]);
        Self { file: folder.join(name), camera: *camera, camera_from_world: *camera_from_world }
    }

    pub(crate) fn write(&self, data: &ViewData) -> Result<(), SelectError> {
        if let Some(folder) = self.file.parent() {
            let error = |error| motes_formats::FormatError::io(folder, error);
            fs::create_dir_all(folder).map_err(error)?;
        }
        let segments: Vec<f32> = data.segments.iter().flat_map(floats_of).collect();
        let ends: Vec<u32> = data.borders.iter().flat_map(|b| b.segments).collect();
        let borders: Vec<f32> =
            data.borders.iter().flat_map(|b| [b.length_px, b.at_px[0], b.at_px[1]]).collect();
        let votes = &data.votes;
        let u32s = |v: &[u32]| TensorData::U32(vec![v.len()], v.to_vec());
        let f32s = |v: &[f32]| TensorData::F32(vec![v.len()], v.to_vec());
        let tensors = [
            ("labels", u32s(&data.labels)),
            ("depth", f32s(&data.depth)),
            ("segments", f32s(&segments)),
            ("border_ends", u32s(&ends)),
            ("borders", f32s(&borders)),
            ("vote_offsets", u32s(&votes.offsets)),
            ("vote_gaussians", u32s(&votes.gaussians)),
            ("vote_weights", f32s(&votes.weights)),
        ];
        let tensors = tensors.map(|(name, tensor)| (name.to_owned(), tensor));
        Ok(write_tensors(&self.file, &tensors, &BTreeMap::new())?)
    }

    /// The prepared view; `None` when it is not there or not whole, so that it is made again.
    pub(crate) fn read(&self, gaussians: usize) -> Option<ViewData> {
        let (mut tensors, _) = read_tensors(&self.file).ok()?;
        // What is used stays longest where a cache is bounded; a cache that cannot be written is used all the same.
        let file = fs::File::options().append(true).open(&self.file);
        let _ = file.and_then(|file| file.set_modified(SystemTime::now()));
        let mut u32s = |name: &str| match tensors.remove(name) {
            Some(TensorData::U32(_, v)) => Some(v),
            _ => None,
        };
        let labels = u32s("labels")?;
        let ends = u32s("border_ends")?;
        let (offsets, ids) = (u32s("vote_offsets")?, u32s("vote_gaussians")?);
        let mut f32s = |name: &str| match tensors.remove(name) {
            Some(TensorData::F32(_, v)) => Some(v),
            _ => None,
        };
        let (depth, segments, borders) = (f32s("depth")?, f32s("segments")?, f32s("borders")?);
        let weights = f32s("vote_weights")?;
        let count = segments.len() / SEGMENT;
        let pixels = self.camera.width * self.camera.height;
        let ordered = offsets.windows(2).all(|w| w[0] <= w[1]);
        let is_whole = labels.len() == pixels
            && depth.len() == pixels
            && segments.len() == count * SEGMENT
            && offsets.len() == count + 1
            && ordered
            && offsets.last() == Some(&(ids.len() as u32))
            && ids.len() == weights.len()
            && ends.len() % 2 == 0
            && borders.len() == ends.len() / 2 * BORDER
            && labels.iter().chain(&ends).all(|&l| (l as usize) < count)
            && ids.iter().all(|&i| (i as usize) < gaussians);
        if !is_whole {
            return None;
        }
        let border = |(e, b): (&[u32], &[f32])| Border {
            segments: [e[0], e[1]],
            length_px: b[0],
            at_px: [b[1], b[2]],
        };
        Some(ViewData {
            camera: self.camera,
            camera_from_world: self.camera_from_world,
            labels,
            depth,
            segments: segments.chunks_exact(SEGMENT).map(segment_of).collect(),
            borders: ends.chunks_exact(2).zip(borders.chunks_exact(BORDER)).map(border).collect(),
            votes: LabelVotes { offsets, gaussians: ids, weights },
        })
    }
}

fn floats_of(s: &Segment) -> [f32; SEGMENT] {
    let ([x, y], [l, a, b], [px, py, pz]) = (s.center_px, s.lab, s.point);
    let ([nx, ny, nz], [ia, ib, ic]) = (s.normal, s.inverse_depth);
    [x, y, s.area_px, l, a, b, px, py, pz, nx, ny, nz, s.width, ia, ib, ic]
}

fn segment_of(v: &[f32]) -> Segment {
    Segment {
        center_px: [v[0], v[1]],
        area_px: v[2],
        lab: [v[3], v[4], v[5]],
        point: [v[6], v[7], v[8]],
        normal: [v[9], v[10], v[11]],
        width: v[12],
        inverse_depth: [v[13], v[14], v[15]],
    }
}
