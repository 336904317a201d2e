//! Triangle meshes of other programs, with textures and the metallic-roughness material.
//!
//! Frames: coordinates stay as the file has them, and [`Mesh::up`] says which axis of it is up (glTF prescribes +y, OBJ files
//! of most programs have it, PLY says nothing and has +z here).

mod creases;
mod model;
mod mtl;
mod obj;
mod texture;
mod words;

pub(crate) use creases::{add_creased_normals, add_flat_normals};
pub(crate) use model::{GRAY, ROUGHNESS, finite_vertices};
pub use model::{Mesh, PointMaterial, barycentrics};
pub(crate) use obj::read as read_obj;
pub(crate) use texture::{Affine, ImageCache};
pub use texture::{Look, Texture, TextureUse, Wrap};
