use glam::{DVec3, Vec3};
use motes_scene::{Gaussians, Materials, Surface};

use super::bake::tangent_space;
use super::target::GltfFrame;
use super::{Look, MeshError, MeshOptions, MeshSource, PbrMesh, write_glb};

/// A square from -1 to 1 at z = 0 of `n` x `n` cells, green on the left and red on the right.
fn square(n: u32) -> Surface {
    let mut surface = Surface::default();
    for k in 0..=n {
        for i in 0..=n {
            let at = |v: u32| 2.0 * v as f32 / n as f32 - 1.0;
            surface.vertices.push([at(i), at(k), 0.0]);
            surface.normals.push([0.0, 0.0, 1.0]);
            let red = i > n / 2;
            surface.base_color_linear.push(if red { [0.8, 0.1, 0.1] } else { [0.1, 0.6, 0.1] });
            surface.roughness.push(if red { 0.2 } else { 0.9 });
            surface.metallic.push(if red { 1.0 } else { 0.0 });
        }
    }
    for k in 0..n {
        for i in 0..n {
            let a = k * (n + 1) + i;
            let c = a + n + 1;
            surface.triangles.extend([[a, a + 1, c], [a + 1, c + 1, c]]);
        }
    }
    surface
}

fn mesh_of(surface: &Surface, options: &MeshOptions) -> Result<PbrMesh, MeshError> {
    MeshSource { surface, gaussians: None, is_lambert: false }.mesh(options)
}

const SMALL: MeshOptions = MeshOptions { triangles: 0, texture_size: 128, no_atlas: false };

/// The texel that shows a point of the world.
fn texel_at(mesh: &PbrMesh, point: Vec3) -> usize {
    let Look::Textures(textures) = &mesh.look else { panic!("no textures") };
    for t in &mesh.parts[0].triangles {
        let [a, b, c] = t.map(|v| Vec3::from(mesh.positions[v as usize]));
        let n = (b - a).cross(c - a);
        let v = (point - a).cross(c - a).dot(n) / n.length_squared();
        let w = (b - a).cross(point - a).dot(n) / n.length_squared();
        if v >= 0.0 && w >= 0.0 && v + w <= 1.0 {
            let uv: glam::Vec2 = t
                .iter()
                .zip([1.0 - v - w, v, w])
                .map(|(corner, weight)| glam::Vec2::from(textures.uvs[*corner as usize]) * weight)
                .sum();
            let (width, height) = (textures.base_color.width, textures.base_color.height);
            let x = ((uv.x * width as f32) as usize).min(width - 1);
            let y = ((uv.y * height as f32) as usize).min(height - 1);
            return y * width + x;
        }
    }
    panic!("{point} is off the mesh")
}

#[test]
fn textures_show_the_surface_where_it_is() {
    let mesh = mesh_of(&square(8), &SMALL).unwrap();
    let Look::Textures(textures) = &mesh.look else { panic!("no textures") };
    let green = texel_at(&mesh, Vec3::new(-0.6, 0.3, 0.0));
    let red = texel_at(&mesh, Vec3::new(0.8, -0.5, 0.0));
    // 0.1 and 0.6 encoded are 0.349 and 0.798, 0.8 is 0.906.
    assert_eq!(textures.base_color.data[3 * green..][..3], [89, 203, 89]);
    assert_eq!(textures.base_color.data[3 * red..][..3], [231, 89, 89]);
    assert_eq!(textures.orm.data[3 * green..][..3], [255, 230, 0]);
    assert_eq!(textures.orm.data[3 * red..][..3], [255, 51, 255]);
    assert_eq!(textures.normal.data[3 * red..][..3], [128, 128, 255]);
    assert!(mesh.summary.charts >= 1 && mesh.summary.utilization > 0.3);
}

#[test]
fn normals_of_the_full_surface_come_back_through_the_texture() {
    let mut bumpy = square(32);
    for (p, n) in bumpy.vertices.iter_mut().zip(&mut bumpy.normals) {
        p[2] = 0.02 * (6.0 * p[0]).sin();
        *n = Vec3::new(-0.12 * (6.0 * p[0]).cos(), 0.0, 1.0).normalize().to_array();
    }
    let options = MeshOptions { triangles: 40, texture_size: 256, ..SMALL };
    let mesh = mesh_of(&bumpy, &options).unwrap();
    assert!(mesh.summary.triangles <= 60, "{:?}", mesh.summary);
    let Look::Textures(textures) = &mesh.look else { panic!("no textures") };
    let (mut worst, mut flat) = (0.0f32, 0.0f32);
    for i in 0..60 {
        let x = -0.9 + 0.03 * i as f32;
        let expected = Vec3::new(-0.12 * (6.0 * x).cos(), 0.0, 1.0).normalize();
        for t in &mesh.parts[0].triangles {
            let ([a, b, c], y) = (t.map(|v| Vec3::from(mesh.positions[v as usize])), 0.13);
            let area = (b - a).truncate().perp_dot((c - a).truncate());
            let p = glam::Vec2::new(x, y);
            let v = (p - a.truncate()).perp_dot((c - a).truncate()) / area;
            let w = (b - a).truncate().perp_dot(p - a.truncate()) / area;
            if !(v >= 0.0 && w >= 0.0 && v + w <= 1.0) {
                continue;
            }
            let weights = [1.0 - v - w, v, w];
            let mix = |f: &dyn Fn(usize) -> Vec3| -> Vec3 {
                t.iter().zip(weights).map(|(k, w)| f(*k as usize) * w).sum()
            };
            let uv = mix(&|k| glam::Vec2::from(textures.uvs[k]).extend(0.0));
            let (width, height) = (textures.normal.width, textures.normal.height);
            let (tx, ty) = ((uv.x * width as f32) as usize, (uv.y * height as f32) as usize);
            let texel =
                &textures.normal.data[3 * (ty.min(height - 1) * width + tx.min(width - 1))..][..3];
            let local = Vec3::new(f32::from(texel[0]), f32::from(texel[1]), f32::from(texel[2]))
                / 127.5
                - 1.0;
            let tangent = mix(&|k| Vec3::from_slice(&textures.tangents[k][..3]));
            let normal = mix(&|k| Vec3::from(mesh.normals[k]));
            let sign = textures.tangents[t[0] as usize][3];
            // As a reader of glTF shades it.
            let read =
                tangent * local.x + normal.cross(tangent) * (sign * local.y) + normal * local.z;
            worst = worst.max(read.normalize().angle_between(expected));
            flat = flat.max(normal.normalize().angle_between(expected));
            break;
        }
    }
    assert!(worst < 0.035, "{worst} rad with the texture, {flat} without");
    assert!(flat > 2.0 * worst, "without the texture it would be {flat}");
}

#[test]
fn tangent_space_is_undone_by_its_own_frame() {
    let (t, n) = (Vec3::new(0.9, 0.1, 0.0), Vec3::new(0.1, -0.2, 0.95));
    for sign in [-1.0, 1.0] {
        let target = Vec3::new(0.3, 0.4, 0.8).normalize();
        let local = tangent_space(t, n, sign, target);
        let back = t * local.x + n.cross(t) * (sign * local.y) + n * local.z;
        assert!(back.normalize().distance(target) < 1e-5);
    }
    assert_eq!(tangent_space(n, n, 1.0, t), Vec3::Z, "singular");
}

/// Flat Gaussians over the square whose color is blue, a hair above it.
fn cover(n: usize) -> (Gaussians, Materials) {
    let mut gaussians = Gaussians::empty(0);
    let mut materials = Materials::default();
    for k in 0..n * n {
        let at = |v: usize| 2.0 * (v as f32 + 0.5) / n as f32 - 1.0;
        gaussians.means.push([at(k % n), at(k / n), 0.002]);
        gaussians.rotations.push([1.0, 0.0, 0.0, 0.0]);
        let s = (1.2 / n as f32).ln();
        gaussians.log_scales.push([s, s, f32::NEG_INFINITY]);
        gaussians.opacity_logits.push(4.0);
        gaussians.sh.extend([0.0; 3]);
        materials.normals.push([0.0, 0.0, 1.0]);
        materials.base_color_linear.push([0.05, 0.1, 0.7]);
        materials.roughness.push(0.5);
        materials.metallic.push(0.25);
        materials.visibility.push(0.5);
        materials.observations.push(2);
    }
    (gaussians, materials)
}

#[test]
fn gaussians_give_the_material_where_they_cover_the_surface() {
    let surface = square(8);
    let (mut gaussians, mut materials) = cover(12);
    // Rows that are not numbers, or that nobody saw, do not count.
    gaussians.means[3] = [f32::NAN; 3];
    materials.base_color_linear[20] = [1.0, 1.0, 0.0];
    materials.observations[20] = 0;
    let source = MeshSource {
        surface: &surface,
        gaussians: Some((&gaussians, &materials)),
        is_lambert: true,
    };
    let mesh = source.mesh(&SMALL).unwrap();
    assert!(mesh.summary.from_gaussians > 0.95, "{:?}", mesh.summary);
    let Look::Textures(textures) = &mesh.look else { panic!("no textures") };
    let texel = texel_at(&mesh, Vec3::new(0.8, -0.5, 0.0));
    assert_eq!(textures.base_color.data[3 * texel..][..3], [63, 89, 218]);
    assert_eq!(textures.orm.data[3 * texel..][..3], [128, 128, 64]);
    // From below the Gaussians face away, so a surface that looks down keeps its own.
    let mut down = surface.clone();
    down.normals.iter_mut().for_each(|n| n[2] = -1.0);
    down.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    let source = MeshSource { surface: &down, ..source };
    assert_eq!(source.mesh(&SMALL).unwrap().summary.from_gaussians, 0.0);
}

#[test]
fn without_an_atlas_matter_is_grouped() {
    let mesh = mesh_of(&square(8), &MeshOptions { no_atlas: true, ..SMALL }).unwrap();
    assert!(mesh.parts.len() >= 2);
    let metal = mesh.parts.iter().find(|p| p.metallic > 0.9).unwrap();
    assert!((metal.roughness - 0.2).abs() < 0.05);
    let total: usize = mesh.parts.iter().map(|p| p.triangles.len()).sum();
    assert_eq!(total, 128);
}

#[test]
fn what_is_no_mesh_is_refused() {
    let empty = Surface::default();
    assert_eq!(mesh_of(&empty, &SMALL).unwrap_err(), MeshError::Empty);
    let mut bare = square(2);
    (bare.base_color_linear, bare.roughness, bare.metallic) = Default::default();
    assert_eq!(mesh_of(&bare, &SMALL).unwrap_err(), MeshError::NoMaterials);
    let mut broken = square(2);
    broken.triangles.push([0, 1, 99]);
    assert_eq!(mesh_of(&broken, &SMALL).unwrap_err(), MeshError::Inconsistent);
    let mut lines = square(2);
    lines.triangles = vec![[0, 1, 1], [2, 2, 2]];
    assert_eq!(mesh_of(&lines, &SMALL).unwrap_err(), MeshError::Empty);
}

#[test]
fn numbers_that_are_none_are_left_out_and_nothing_panics() {
    let mut surface = square(6);
    surface.vertices[10] = [f32::NAN, f32::INFINITY, 0.0];
    surface.normals[20] = [0.0; 3];
    surface.base_color_linear[30] = [f32::NAN, 2.0, -1.0];
    surface.triangles.push([5, 5, 6]);
    for options in
        [SMALL, MeshOptions { no_atlas: true, ..SMALL }, MeshOptions { triangles: 20, ..SMALL }]
    {
        let mesh = mesh_of(&surface, &options).unwrap();
        assert!(mesh.positions.iter().flatten().all(|v| v.is_finite()));
        assert!(mesh.normals.iter().all(|n| (Vec3::from(*n).length() - 1.0).abs() < 1e-4));
        let mut bytes = Vec::new();
        write_glb(&mesh, &GltfFrame::new(DVec3::Z, 1.0), &mut bytes).unwrap();
        let text = String::from_utf8_lossy(&bytes[20..]).into_owned();
        assert!(!text.contains(":null"), "a number of the document is none");
    }
}

#[test]
fn the_file_is_a_glb_whose_lengths_add_up() {
    let mesh = mesh_of(&square(8), &SMALL).unwrap();
    let mut bytes = Vec::new();
    write_glb(&mesh, &GltfFrame::new(DVec3::Z, 1.0), &mut bytes).unwrap();
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    assert_eq!(&bytes[..4], b"glTF");
    assert_eq!((word(4), word(8)), (2, bytes.len()));
    let text = word(12);
    let document: serde_json::Value = serde_json::from_slice(&bytes[20..20 + text]).unwrap();
    assert_eq!(20 + text + 8 + word(20 + text), bytes.len());
    assert_eq!(document["nodes"][0]["extras"]["gltf_from_world"][1][2], 1.0);
    let position = &document["accessors"][0];
    assert_eq!(position["max"], serde_json::json!([1.0, 0.0, 1.0]));
    assert_eq!(document["materials"][0]["normalTexture"]["index"], 2);
}
