//! Why there is no decomposition.

use motes_shading::tracing::MeshError;
use thiserror::Error;

/// Why there is no decomposition.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum DecomposeError {
    /// The observer asked for it.
    #[error("the decomposition was canceled")]
    Canceled,
    /// There is nothing to shade.
    #[error("the Gaussians show no surface that several photos agree about")]
    NoSurface,
    /// Nothing to fit to.
    #[error("no point of the surface is seen by {0} photos: light and material cannot be told")]
    NothingSeen(usize),
    /// A pixel whose base color is given shows no surface.
    #[error("{0} meets no surface")]
    AnchorMissesSurface(String),
    /// The mesh is broken.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The scene that was found cannot be lit.
    #[error("{0}")]
    Relight(String),
}
