//! Which triangle every pixel of a pinhole camera sees first, by rasterizing the mesh: a fifth of the time
//! of a ray per pixel.
//!
//! Edges are tested in homogeneous coordinates (Olano & Greer, "Triangle scan conversion using 2D homogeneous
//! coordinates", 1997): with corners `a, b, c` in the camera and the direction `d = ((x - cx) / fx, (y - cy) / fy, 1)`
//! of a pixel, `(b × c) · d`, `(c × a) · d` and `(a × b) · d` have one sign inside of the triangle, whether or not it reaches
//! behind the camera. Two triangles compute the same number for an edge that they share, with opposite
//! signs, so that nothing shows through between them. The depth is that of the plane, `a · n / d · n`.

use glam::Vec3;
use motes_scene::{Pinhole, Pose, Surface};
use rayon::prelude::*;

/// Marks a pixel that sees no triangle.
pub(crate) const NOTHING: u32 = u32::MAX;
/// Nearer than this share of the farthest vertex a triangle does not count.
const NEAR: f32 = 1e-6;
/// Rounding of a vertex's place on the image, pixels; boxes are larger by it.
const SLACK: f32 = 1.0 / 64.0;
/// Rows of pixels per task; the result does not depend on it.
const BAND: usize = 24;

/// The triangle at the center of every pixel, row by row; either side of it counts. Of two at one depth the first.
pub(crate) fn first_triangles(
    surface: &Surface,
    camera: &Pinhole,
    camera_from_world: &Pose,
) -> Vec<u32> {
    let (width, height) = (camera.width, camera.height);
    let rotation = camera_from_world.rotation_matrix();
    let center = camera_from_world.center_in_world();
    let in_camera: Vec<Vec3> = surface
        .vertices
        .par_iter()
        .with_min_len(4096)
        .map(|v| (rotation * (Vec3::from(*v).as_dvec3() - center)).as_vec3())
        .collect();
    let far = in_camera.iter().map(|p| p.z).filter(|z| z.is_finite()).fold(0.0, f32::max);
    let near = NEAR * far;
    let project = |p: Vec3| {
        let [x, y] = [camera.fx as f32 * (p.x / p.z), camera.fy as f32 * (p.y / p.z)];
        [x + camera.cx as f32, y + camera.cy as f32]
    };
    // NaN for what is not before the camera. On its own: most triangles need nothing else.
    let on_image: Vec<[f32; 2]> = in_camera
        .par_iter()
        .with_min_len(4096)
        .map(|p| if p.z > near { project(*p) } else { [f32::NAN; 2] })
        .collect();
    let boxed: Vec<(u32, [u32; 4])> = surface
        .triangles
        .par_iter()
        .enumerate()
        .with_min_len(4096)
        .filter_map(|(i, triangle)| {
            let places = triangle.map(|v| on_image[v as usize]);
            let outline = if places.iter().flatten().any(|v| v.is_nan()) {
                Outline::cut(triangle.map(|v| in_camera[v as usize]), near, &project)?
            } else {
                Outline::of(places)
            };
            Some((i as u32, outline.pixels(width, height)?))
        })
        .collect();
    let slopes = |count: usize, center: f64, focal: f64| -> Vec<f32> {
        (0..count).map(|i| ((i as f64 + 0.5 - center) / focal) as f32).collect()
    };
    let (slopes_x, slopes_y) =
        (slopes(width, camera.cx, camera.fx), slopes(height, camera.cy, camera.fy));
    let mut first = vec![(f32::INFINITY, NOTHING); width * height];
    first.par_chunks_mut((BAND * width).max(1)).enumerate().for_each(|(band, first)| {
        let rows = (band * BAND) as u32..(band * BAND + first.len() / width) as u32;
        for (i, [x0, x1, y0, y1]) in &boxed {
            let (y0, y1) = ((*y0).max(rows.start), (*y1).min(rows.end));
            if y0 >= y1 {
                continue;
            }
            let ids = surface.triangles[*i as usize];
            let edges = Edges::new(ids, ids.map(|v| in_camera[v as usize]));
            let columns = *x0 as usize..*x1 as usize;
            for y in y0..y1 {
                let row = (y - rows.start) as usize * width;
                let pixels = &mut first[row + columns.start..row + columns.end];
                for (slope, pixel) in slopes_x[columns.clone()].iter().zip(pixels) {
                    let z = edges.depth_at(Vec3::new(*slope, slopes_y[y as usize], 1.0));
                    if z > near && z < pixel.0 {
                        *pixel = (z, *i);
                    }
                }
            }
        }
    });
    first.into_iter().map(|(_, i)| i).collect()
}

/// Box round the visible part of a triangle, pixels: least x, y and largest x, y.
struct Outline([f32; 4]);

impl Outline {
    const EMPTY: Self = Self([f32::INFINITY, f32::INFINITY, f32::NEG_INFINITY, f32::NEG_INFINITY]);

    fn of(places: [[f32; 2]; 3]) -> Self {
        let mut outline = Self::EMPTY;
        places.into_iter().for_each(|place| outline.add(place));
        outline
    }

    /// Of a triangle that is not wholly before the camera, cut off at the near plane; `None` when nothing is left
    /// or it is not finite.
    fn cut(corners: [Vec3; 3], near: f32, project: &impl Fn(Vec3) -> [f32; 2]) -> Option<Self> {
        let before = corners.map(|p| p.z > near);
        if before == [false; 3] || !corners.iter().all(|p| p.is_finite()) {
            return None;
        }
        let mut outline = Self::EMPTY;
        for k in 0..3 {
            let (p, q) = (corners[k], corners[(k + 1) % 3]);
            if before[k] {
                outline.add(project(p));
            }
            if before[k] != before[(k + 1) % 3] {
                let cut = p.lerp(q, ((near - p.z) / (q.z - p.z)).clamp(0.0, 1.0));
                outline.add(project(Vec3::new(cut.x, cut.y, near)));
            }
        }
        Some(outline)
    }

    fn add(&mut self, [x, y]: [f32; 2]) {
        let [x0, y0, x1, y1] = self.0;
        self.0 = [x0.min(x), y0.min(y), x1.max(x), y1.max(y)];
    }

    /// Half-open ranges of pixels whose centers may be inside, `[x0, x1, y0, y1]`.
    fn pixels(&self, width: usize, height: usize) -> Option<[u32; 4]> {
        let [x0, y0, x1, y1] = self.0;
        let (x, y) = (centers(x0, x1, width), centers(y0, y1, height));
        (x[0] < x[1] && y[0] < y[1]).then_some([x[0], x[1], y[0], y[1]])
    }
}

/// Pixels with centers from `low` to `high`; NaN gives none or all. Conversions cut off and saturate.
fn centers(low: f32, high: f32, count: usize) -> [u32; 2] {
    let (low, high) = (low - 0.5 - SLACK, high - 0.5 + SLACK);
    let whole = low.max(0.0) as u32;
    let first = if (whole as f32) < low { whole.saturating_add(1) } else { whole };
    let last = if high >= 0.0 { (high as u32).saturating_add(1).min(count as u32) } else { 0 };
    [first, last]
}

/// A triangle before the camera, ready for pixels.
struct Edges {
    /// `b × c`, `c × a`, `a × b`.
    normals: [Vec3; 3],
    /// Of the plane, not unit.
    plane: Vec3,
    /// `a · plane`.
    offset: f32,
}

impl Edges {
    /// `ids` say in which order an edge is computed: the same for both triangles that have it.
    fn new(ids: [u32; 3], corners: [Vec3; 3]) -> Self {
        let edge = |i: usize, j: usize| {
            // p × (q - p) is p × q with fewer digits lost.
            let (p, q) = (corners[i], corners[j]);
            if ids[i] < ids[j] { p.cross(q - p) } else { -q.cross(p - q) }
        };
        let [a, b, c] = corners;
        let plane = (b - a).cross(c - a);
        Self { normals: [edge(1, 2), edge(2, 0), edge(0, 1)], plane, offset: a.dot(plane) }
    }

    /// z of the triangle's point in the direction `d`; NaN outside of it.
    #[inline]
    fn depth_at(&self, d: Vec3) -> f32 {
        let [u, v, w] = self.normals.map(|n| n.dot(d));
        let inside = (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0);
        if inside { self.offset / self.plane.dot(d) } else { f32::NAN }
    }
}

#[cfg(test)]
mod tests {
    use glam::{DQuat, DVec3};
    use motes_shading::tracing::{BuildQuality, MeshTracer, Ray, Tracer as _, TriangleMesh};

    use super::*;
    use crate::g_buffer::Rays;

    /// A bumpy sheet below and all round the camera, a ball of small triangles on it, and what no one can see.
    fn scene(scale: f32, origin: Vec3) -> Surface {
        let mut surface = Surface::default();
        let n = 60u32;
        for i in 0..n * n {
            let (x, y) = ((i % n) as f32 / 10.0 - 3.0, (i / n) as f32 / 10.0 - 3.0);
            surface.vertices.push([x, y, 0.05 * (7.0 * x).sin() * (5.0 * y).cos()]);
        }
        for i in 0..(n - 1) * (n - 1) {
            let v = i / (n - 1) * n + i % (n - 1);
            surface.triangles.extend([[v, v + 1, v + n], [v + n, v + 1, v + n + 1]]);
        }
        let (first, m) = (surface.vertices.len() as u32, 80u32);
        for i in 0..m * m {
            let theta = std::f32::consts::PI * ((i / m) as f32 + 0.5) / m as f32;
            let phi = std::f32::consts::TAU * (i % m) as f32 / m as f32;
            let r = 0.4 * theta.sin();
            surface.vertices.push([r * phi.cos(), r * phi.sin(), 0.4 + 0.4 * theta.cos()]);
        }
        for i in 0..(m - 1) * m {
            let (v, right) = (first + i, first + i / m * m + (i + 1) % m);
            surface.triangles.extend([[v, right, v + m], [v + m, right, right + m]]);
        }
        let odd = surface.vertices.len() as u32;
        surface.vertices.extend([[f32::NAN; 3], [f32::INFINITY, 0.0, 0.0], [0.0, 0.0, 9.0]]);
        surface.triangles.extend([[odd, 0, 1], [odd + 1, 0, 1], [odd + 2, odd + 2, 0]]);
        surface.vertices.iter_mut().for_each(|v| *v = (Vec3::from(*v) * scale + origin).to_array());
        surface
    }

    #[test]
    fn pixels_see_the_triangles_that_rays_meet() {
        for (scale, origin) in
            [(1.0, Vec3::ZERO), (40.0, Vec3::new(300.0, -900.0, 50.0)), (1e-3, Vec3::ZERO)]
        {
            let surface = scene(scale, origin);
            let mesh = TriangleMesh {
                vertices: surface.vertices.iter().map(|v| Vec3::from(*v)).collect(),
                triangles: surface.triangles.clone(),
            };
            let tracer = MeshTracer::new(&mesh, BuildQuality::Fast).unwrap();
            let camera =
                Pinhole { width: 173, height: 131, fx: 120.0, fy: 121.0, cx: 85.0, cy: 66.0 };
            // Over the sheet, looking at the ball: part of the sheet is behind the camera.
            let eye = origin.as_dvec3() + f64::from(scale) * DVec3::new(0.9, -1.3, 0.7);
            let rotation = DQuat::from_rotation_x(1.9) * DQuat::from_rotation_z(-0.6);
            let pose = Pose { rotation, translation: -(rotation * eye) };
            let first = first_triangles(&surface, &camera, &pose);
            let rays = Rays::new(&camera, &pose);
            let (mut others, mut seen) = (0, 0);
            for (i, triangle) in first.iter().enumerate() {
                let (x, y) = ((i % camera.width) as f64 + 0.5, (i / camera.width) as f64 + 0.5);
                let (ray, _) = rays.through(x, y);
                let met = tracer.closest_hit(&ray);
                assert_eq!(met.is_none(), *triangle == NOTHING, "pixel {i} of scale {scale}");
                let Some(met) = met else { continue };
                seen += 1;
                if met.primitive == *triangle {
                    continue;
                }
                // A neighbor, then: its plane is met at the same distance.
                others += 1;
                let [a, b, c] = mesh.triangles[*triangle as usize]
                    .map(|v| mesh.vertices[v as usize] - ray.origin);
                let normal = (b - a).cross(c - a);
                let distance = a.dot(normal) / ray.direction.dot(normal);
                let apart = (distance - met.distance).abs();
                assert!(apart < 2e-3 * met.distance, "pixel {i}: {distance} and {}", met.distance);
            }
            assert!(seen > 12_000, "{seen}");
            assert!(others < seen / 200, "{others} of {seen}");
        }
    }

    #[test]
    fn no_surface_and_no_pixels_are_fine() {
        let camera = Pinhole { width: 5, height: 4, fx: 5.0, fy: 5.0, cx: 2.5, cy: 2.0 };
        let pose = Pose { rotation: DQuat::IDENTITY, translation: DVec3::ZERO };
        assert_eq!(first_triangles(&Surface::default(), &camera, &pose), vec![NOTHING; 20]);
        let none = Pinhole { width: 0, ..camera };
        assert!(first_triangles(&scene(1.0, Vec3::ZERO), &none, &pose).is_empty());
    }

    #[test]
    fn of_two_triangles_in_one_place_the_first_is_seen_from_either_side() {
        let surface = Surface {
            vertices: vec![[-9.0, -9.0, 2.0], [9.0, -9.0, 2.0], [0.0, 9.0, 2.0]],
            triangles: vec![[0, 2, 1], [0, 1, 2]],
            ..Surface::default()
        };
        let camera = Pinhole { width: 3, height: 3, fx: 3.0, fy: 3.0, cx: 1.5, cy: 1.5 };
        let pose = Pose { rotation: DQuat::IDENTITY, translation: DVec3::ZERO };
        assert_eq!(first_triangles(&surface, &camera, &pose), vec![0; 9]);
        let ray = Ray::new(Vec3::ZERO, Vec3::Z);
        assert_eq!(Rays::new(&camera, &pose).through(1.5, 1.5).0, ray);
    }
}
