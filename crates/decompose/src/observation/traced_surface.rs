//! What every pixel of a photo sees of the surface.

use glam::{DVec3, Vec3};
use motes_scene::{Pinhole, Pose, Surface};
use motes_shading::tracing::{BuildQuality, MeshError, MeshTracer, Ray, Tracer, TriangleMesh};
use rayon::prelude::*;

use super::flat_pieces::sheet_of_triangles;
use super::photo::Photo;

/// Where the ray of a pixel meets the surface.
#[derive(Clone, Copy, Debug)]
pub struct PixelHit {
    /// Triangle, or [`PixelHit::MISS`].
    pub triangle: u32,
    /// Weights of its second and third corner, of 65,535: hits of all pixels of all photos are kept.
    barycentrics: [u16; 2],
    /// Camera z, world units; infinite for a miss.
    pub depth: f32,
}

impl PixelHit {
    /// The value of [`Self::triangle`] where nothing is met.
    pub const MISS: u32 = u32::MAX;

    /// A point of a triangle by the weights of its second and third corner, and its depth.
    pub fn new(triangle: u32, barycentrics: [f32; 2], depth: f32) -> Self {
        let stored = |v: f32| (v * f32::from(u16::MAX)).round() as u16;
        Self { triangle, barycentrics: barycentrics.map(stored), depth }
    }

    /// What a ray sees that meets nothing.
    pub const fn miss() -> Self {
        Self { triangle: Self::MISS, barycentrics: [0; 2], depth: f32::INFINITY }
    }

    /// Weights of the second and third corner of the triangle.
    #[inline]
    pub fn barycentrics(&self) -> [f32; 2] {
        self.barycentrics.map(|v| f32::from(v) / f32::from(u16::MAX))
    }

    /// Whether the ray met the surface.
    pub fn is_hit(&self) -> bool {
        self.triangle != Self::MISS
    }
}

/// A surface that rays can meet.
#[derive(Debug)]
pub struct TracedSurface {
    /// The mesh with its attributes.
    pub surface: Surface,
    /// Its tree.
    pub tracer: MeshTracer,
    /// Per triangle: the flat piece it belongs to, 0 for none.
    pub sheets: Vec<u32>,
    /// Length of the diagonal of its box, world units; 1 when empty.
    pub extent: f32,
}

impl TracedSurface {
    /// Builds the tree.
    ///
    /// # Errors
    /// A triangle refers to a vertex that does not exist.
    pub fn new(surface: Surface) -> Result<Self, MeshError> {
        let mesh = TriangleMesh::from(&surface);
        let diagonal = mesh.diagonal();
        let extent = if diagonal > 0.0 && diagonal.is_finite() { diagonal } else { 1.0 };
        // Refuses corners that are no vertices, which the median cannot.
        let tracer = MeshTracer::new(&mesh, BuildQuality::High)?;
        let tracer = tracer.one_sided_within(TriangleMesh::LAYERS * mesh.roughness());
        let sheets = sheet_of_triangles(&surface);
        Ok(Self { surface, tracer, sheets, extent })
    }

    /// Its triangles.
    pub(crate) fn mesh(&self) -> TriangleMesh {
        (&self.surface).into()
    }

    /// Whether vertices of which this holds lie on no flat piece: there normals are exact.
    pub(crate) fn off_sheets(&self, holds: impl Fn(usize) -> bool) -> Vec<bool> {
        let mut off: Vec<bool> = (0..self.surface.vertices.len()).map(holds).collect();
        for (t, _) in self.surface.triangles.iter().zip(&self.sheets).filter(|(_, s)| **s != 0) {
            t.iter().for_each(|&v| off[v as usize] = false);
        }
        off
    }

    /// Mean of a vertex attribute at a point of a triangle.
    #[inline]
    pub fn interpolate(&self, triangle: u32, [b, c]: [f32; 2], of: &[Vec3]) -> Vec3 {
        let [i, j, k] = self.surface.triangles[triangle as usize];
        of[i as usize] * (1.0 - b - c) + of[j as usize] * b + of[k as usize] * c
    }

    /// Position, shading normal and geometric normal at a point of a triangle, facing `to_viewer`.
    pub fn frame(&self, hit: &PixelHit, to_viewer: Vec3) -> (Vec3, Vec3, Vec3) {
        let corners = self.surface.triangles[hit.triangle as usize];
        let at = |of: &[[f32; 3]]| {
            let [p, q, r] = corners.map(|i| Vec3::from(of[i as usize]));
            let [b, c] = hit.barycentrics();
            p * (1.0 - b - c) + q * b + r * c
        };
        let [p, q, r] = corners.map(|i| Vec3::from(self.surface.vertices[i as usize]));
        let geometric = (q - p).as_dvec3().cross((r - p).as_dvec3()).normalize_or_zero().as_vec3();
        let geometric = if geometric.dot(to_viewer) < 0.0 { -geometric } else { geometric };
        let shading = at(&self.surface.normals).normalize_or(geometric);
        let shading = if shading.dot(geometric) < 0.0 { -shading } else { shading };
        (at(&self.surface.vertices), shading, geometric)
    }
}

/// The rays of a camera's pixels.
#[derive(Clone, Debug)]
pub struct ViewRays {
    /// Center of projection in world.
    pub eye: Vec3,
    /// Axes of the camera in world, as columns: x right, y down, z forward.
    axes: [Vec3; 3],
    camera: Pinhole,
    camera_from_world: Pose,
}

impl ViewRays {
    /// Rays of `photo`.
    pub fn new(photo: &Photo) -> Self {
        Self::of(&photo.camera, &photo.camera_from_world)
    }

    /// Rays of a camera.
    pub fn of(camera: &Pinhole, camera_from_world: &Pose) -> Self {
        let world_from_camera = camera_from_world.inverse();
        let m = world_from_camera.rotation_matrix();
        Self {
            eye: world_from_camera.translation.as_vec3(),
            axes: [m.x_axis.as_vec3(), m.y_axis.as_vec3(), m.z_axis.as_vec3()],
            camera: *camera,
            camera_from_world: *camera_from_world,
        }
    }

    /// Direction of the ray through image point (`x`, `y`), pixels; its component along the axis of view is 1.
    #[inline]
    fn ray(&self, x: f32, y: f32) -> Vec3 {
        let c = &self.camera;
        let u = (x - c.cx as f32) / c.fx as f32;
        let v = (y - c.cy as f32) / c.fy as f32;
        self.axes[0] * u + self.axes[1] * v + self.axes[2]
    }

    /// Unit direction of the ray through image point (`x`, `y`), pixels.
    #[inline]
    pub fn direction(&self, x: f32, y: f32) -> Vec3 {
        self.ray(x, y).normalize()
    }

    /// The point in world that the center of pixel `i`, row by row, sees at a camera z.
    pub(crate) fn place(&self, i: usize, depth: f32) -> Vec3 {
        let (x, y) = (i % self.camera.width, i / self.camera.width);
        self.eye + self.ray(x as f32 + 0.5, y as f32 + 0.5) * depth
    }

    /// Index, row by row, of the pixel that an image point lies in; none out of the picture.
    pub(crate) fn pixel(&self, x: f32, y: f32) -> Option<usize> {
        let (w, h) = (self.camera.width, self.camera.height);
        let is_inside = x >= 0.0 && y >= 0.0 && x < w as f32 && y < h as f32;
        is_inside.then(|| y as usize * w + x as usize)
    }

    /// Camera z of a world point, and its image point when it is in front.
    pub fn project(&self, point: Vec3) -> Option<(f32, f32, f32)> {
        project(&self.camera, &self.camera_from_world, point)
    }

    /// The forward axis.
    pub fn forward(&self) -> Vec3 {
        self.axes[2]
    }

    /// First hits of all pixel centers, row by row.
    pub fn hits(&self, scene: &TracedSurface) -> Vec<PixelHit> {
        let (w, h) = (self.camera.width, self.camera.height);
        let mut out = vec![PixelHit::miss(); w * h];
        out.par_chunks_mut(w.max(1)).enumerate().for_each(|(y, row)| {
            for (x, pixel) in row.iter_mut().enumerate() {
                let d = self.direction(x as f32 + 0.5, y as f32 + 0.5);
                if let Some(hit) = scene.tracer.closest_hit(&Ray::new(self.eye, d)) {
                    let depth = hit.distance * d.dot(self.axes[2]);
                    *pixel = PixelHit::new(hit.primitive, hit.barycentrics, depth);
                }
            }
        });
        out
    }
}

/// Image point and camera z of a world point that is in front.
pub(crate) fn project(
    camera: &Pinhole,
    camera_from_world: &Pose,
    point: Vec3,
) -> Option<(f32, f32, f32)> {
    let p: DVec3 = camera_from_world.transform_point(point.as_dvec3());
    let c = camera;
    (p.z > 0.0)
        .then(|| ((p.x / p.z * c.fx + c.cx) as f32, (p.y / p.z * c.fy + c.cy) as f32, p.z as f32))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_corner_that_is_no_vertex_is_an_error() {
        let vertices = vec![[0.0; 3], [1.0, 0.0, 0.0]];
        let normals = vec![[0.0, 0.0, 1.0]; 2];
        let surface =
            Surface { vertices, normals, triangles: vec![[0, 1, 7]], ..Surface::default() };
        assert!(matches!(TracedSurface::new(surface), Err(MeshError::Index { vertex: 7, .. })));
    }

    #[test]
    fn the_place_of_a_pixel_is_projected_into_its_center() {
        let camera = Pinhole { fx: 90.0, fy: 70.0, cx: 31.5, cy: 20.0, width: 60, height: 44 };
        let eye = DVec3::new(3.0, -7.0, 2.5);
        let pose = Pose::look_at(eye, DVec3::new(0.4, 0.2, -0.3), DVec3::Z).unwrap();
        let rays = ViewRays::of(&camera, &pose);
        for i in (0..60 * 44).step_by(37) {
            let depth = 0.5 + i as f32 * 0.01;
            let (x, y, z) = rays.project(rays.place(i, depth)).unwrap();
            let center = [(i % 60) as f32 + 0.5, (i / 60) as f32 + 0.5];
            assert!((x - center[0]).abs() + (y - center[1]).abs() < 2e-3, "{i}: {x} {y}");
            assert!((z - depth).abs() < 1e-5 * depth.max(1.0), "{i}: {z} for {depth}");
            assert_eq!(rays.pixel(x, y), Some(i));
        }
    }

    #[test]
    fn a_pixel_begins_at_its_upper_left_corner_and_the_picture_ends_before_the_last() {
        let camera = Pinhole { fx: 9.0, fy: 9.0, cx: 2.0, cy: 1.5, width: 4, height: 3 };
        let rays = ViewRays::of(&camera, &Pose::IDENTITY);
        let inside = [(0.0, 0.0), (0.99, 0.99), (1.0, 0.0), (3.99, 2.99)];
        assert_eq!(inside.map(|(x, y)| rays.pixel(x, y)), [0, 0, 1, 11].map(Some));
        let outside = [(-0.01, 1.0), (1.0, -0.01), (4.0, 1.0), (1.0, 3.0), (f32::NAN, 1.0)];
        assert!(outside.iter().all(|(x, y)| rays.pixel(*x, *y).is_none()));
    }
}
