//! PLY: Gaussians, points or a mesh, as the header says.

use std::path::Path;

use motes_codecs::open_gaussians;
use motes_formats::Result;
use motes_formats::ply::header::Header;
use motes_formats::ply::{PlySource, read_mesh, read_points};

use super::{made_by, splats};
use crate::{Description, Kind, measure};

/// A column that only Gaussians have, in either layout.
const OF_GAUSSIANS: [&str; 2] = ["rot_0", "packed_rotation"];

/// A PLY file of any kind.
///
/// # Errors
/// It is broken.
pub(super) fn describe(path: &Path) -> Result<Description> {
    let header = PlySource::open(path)?.header;
    let vertex = header.elements.iter().find(|element| element.name == "vertex");
    let is_splat = |name: &str| vertex.is_some_and(|vertex| vertex.property(name).is_some());
    let mut found = if header.elements.iter().any(|e| e.name == "face" && e.count > 0) {
        of_mesh(path)?
    } else if OF_GAUSSIANS.iter().any(|name| is_splat(name)) {
        let compressed = is_splat(OF_GAUSSIANS[1]);
        let format = if compressed { "compressed-ply" } else { "ply" };
        splats::of_gaussians(&open_gaussians(path)?, format)
    } else {
        let points = read_points(path)?;
        let mut found = Description::new(Kind::Points, "ply").count("points", points.len());
        found.bounds = measure::bounds(&points.positions);
        found.non_finite = Some(0); // The reader refuses others.
        found
    };
    found.columns = columns(&header);
    found.made_by = made_by::of_comments(&header.comments);
    Ok(found)
}

fn of_mesh(path: &Path) -> Result<Description> {
    let mesh = read_mesh(path)?;
    let mut found = Description::new(Kind::Mesh, "ply")
        .count("vertices", mesh.vertices.len())
        .count("triangles", mesh.triangles.len())
        .fact("materials", mesh.has_materials());
    found.bounds = measure::bounds(&mesh.vertices);
    Ok(found)
}

/// Columns of the vertices; other tables by name, before a dot.
fn columns(header: &Header) -> Vec<String> {
    let named = header.elements.iter().flat_map(|element| {
        let prefix = match element.name.as_str() {
            "vertex" => String::new(),
            other => format!("{other}."),
        };
        element.properties.iter().map(move |property| format!("{prefix}{}", property.name))
    });
    named.collect()
}
