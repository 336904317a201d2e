//! Selecting: clicks, boxes, masks and properties to a set of Gaussians.
//!
//! [`SceneIndex`] is what is computed once per scene: superpixels of every view on color, rendered depth
//! and normal, how strongly neighbors are parted, which Gaussians each superpixel is made of, and the
//! regions that the views agree on. A prompt is then answered without rasterizing: regions, graph cuts
//! and votes all live on superpixels. `docs/methods/segment-select.md` has the method, its scores are in
//! `docs/benchmarks/segment-select.md`.

mod answers;
mod bounding;
mod coarsening;
mod color;
mod continuation;
mod corrections;
mod depth;
mod diffusion;
mod enclosed;
mod error;
mod extent;
pub mod files;
mod graph;
mod index;
mod interpret;
mod islands;
mod lift;
mod masks;
mod max_flow;
mod multigrid;
mod neighbors;
mod overlay;
mod picture_segmenter;
mod plane;
mod projected;
mod prompt;
mod property;
mod provider;
mod raised;
mod region;
mod rivals;
mod seeds;
mod segment;
mod shapes;
mod source;
mod split;
mod strength;
mod superpixels;
mod view_data;
mod view_votes;
mod walks;

pub use color::{difference, lab_from_srgb};
pub use error::SelectError;
pub use extent::object_box;
pub use index::SceneIndex;
pub use interpret::{Proposal, notes, propose, propose_with, select, select_from};
pub use max_flow::MaxFlow;
pub use overlay::{overlay, selection_mask};
pub use picture_segmenter::{PictureMask, PicturePrompt, PictureSegmenter};
pub use plane::SupportPlane;
pub use projected::{ProjectedPrompts, Resolved};
pub use property::property;
pub use provider::{Asked, GraphCut, MaskProvider};
pub use seeds::Seeds;
pub use segment::SegmentOptions;
pub use source::{MOST_VIEWS, SelectSource, WORKING_PX};
pub use split::{SplitBoundary, split_boundary};
pub use view_data::{Border, SUPERPIXEL_PX, Segment, ViewData};
