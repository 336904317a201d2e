//! Value types that every stage of motes shares, and their invariants.
//!
//! Nothing here reads or writes files: layouts on disk live in `motes-formats`.
//! Frames are part of a name (`camera_from_world`), and so is the space in which a
//! value is stored (`log_scales`, `opacity_logits`). Conventions: right-handed world;
//! camera axes +x right, +y down, +z forward; pixel centers at +0.5; quaternions are
//! stored `w, x, y, z`; colors are linear only where the name says `_linear`.

pub mod camera;
pub mod camera_path;
mod capture;
mod confidence;
mod environment;
mod exposure_response;
mod gaussians;
mod image;
mod local_light;
mod materials;
mod names;
mod pose;
mod residual;
mod selection;
mod sky;
mod surface;
mod switch;
mod unit_column;
mod unit_world;

pub use camera::{Camera, CameraModel, Pinhole};
pub use capture::{Capture, SparsePoints, Split, SplitChoice, View, stem_of, view_among};
pub use confidence::{CONFIDENCE_COLUMN, attach_confidence, confidence_of, photos_share};
pub use environment::{Convention, ScaleAnchor};
pub use exposure_response::{ExposureResponse, MAX_EXPOSURE_STOPS};
pub use gaussians::{ColumnValues, ExtraColumn, Gaussians};
pub use image::{Image, ImageF32, ImageU8};
pub use local_light::{LOCAL_LIGHT_COLUMNS, attach_local_light, local_light_of};
pub use materials::{LAMP_BASE_COLOR, Lobes, MATERIAL_COLUMNS, Materials};
pub use names::told_apart;
pub use pose::Pose;
pub use residual::{LARGEST_LOG_RATIO, Residual};
pub use selection::{Combine, Selection};
pub use sky::{SKY_COLUMN, attach_sky, sky_of};
pub use surface::Surface;
pub use switch::Switch;
pub use unit_world::UnitWorld;
