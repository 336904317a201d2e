//! Triangle meshes while they are worked on, and least squares over their vertices.

pub(crate) mod conjugate_gradients;
pub(crate) mod triangles;

pub(crate) use triangles::{Mesh, Neighbors, averaged};
