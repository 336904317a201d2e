//! A recipe as something that rays meet.

use glam::{Mat3, Vec3};
use motes_shading::brdf::{Lobes, Material};
use motes_shading::integrate::SurfacePoint;
use motes_shading::tracing::{
    BuildQuality, MeshError, MeshTracer, Ray, Tracer, TriangleMesh, offset_origin,
};

use crate::glass::{MOST_PANES, pane_transmittance};
use crate::lamps::{Lamp, parallelogram};
use crate::scenes::SceneRecipe;
use crate::shapes::{SmoothMesh, vertex_normals};
use crate::texture::{Paint, Pattern, fractal};

/// Steps of the shapes' meshes.
pub const STEPS: u32 = 112;
/// Half the side of the ground, in units of the scene: it fills every picture.
const GROUND: f32 = 14.0;
/// Half the side of its finely meshed middle.
const MIDDLE: f32 = 2.6;

/// One object: the ground is the first.
#[derive(Clone, Debug)]
struct Object {
    paint: Paint,
    /// Into the coordinates of the paint.
    to_paint: (Mat3, Vec3, f32),
    /// In the buffers: 1 the support, 2 and up everything else.
    id: u8,
    /// Number among the lamps.
    lamp: Option<u8>,
    /// Of thin glass, tinted by the first color of its paint.
    is_glass: bool,
}

/// A scene, ready for rays. Object ids start at 1, the ground's.
pub struct World {
    tracer: MeshTracer,
    mesh: TriangleMesh,
    normals: Vec<Vec3>,
    objects: Vec<Object>,
    /// Object of every triangle.
    owners: Vec<u16>,
    lobes: Lobes,
    lamps: Vec<Lamp>,
    has_glass: bool,
    /// Lowest and highest corner of every object, world.
    pub bounds: Vec<(Vec3, Vec3)>,
}

/// A hit with its material.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// What the integrator takes.
    pub point: SurfacePoint,
    /// Distance along the ray, over all panes.
    pub distance: f32,
    /// Id of the object.
    pub object: u8,
    /// Number among the lamps, on their bright side.
    pub lamp: Option<u8>,
    /// Thin glass; its base color is what it lets pass.
    pub is_glass: bool,
}

impl Seen {
    /// The ray that goes on behind a pane.
    pub fn behind(&self, direction: Vec3) -> Ray {
        let (position, n) = (self.point.position, self.point.geometric_normal);
        Ray::new(offset_origin(position, n, direction, 0.0), direction)
    }
}

impl World {
    /// Builds the meshes; `lobes` of everything that is not Lambert by its recipe.
    ///
    /// # Errors
    /// When a mesh is damaged, which no recipe's is.
    pub fn new(recipe: &SceneRecipe, lobes: Lobes) -> Result<Self, MeshError> {
        Self::with_steps(recipe, lobes, STEPS)
    }

    /// [`Self::new`] with shapes of other meshes: `2 steps` by `steps`.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_steps(recipe: &SceneRecipe, lobes: Lobes, steps: u32) -> Result<Self, MeshError> {
        let unit = recipe.unit;
        let mut world = Self {
            tracer: MeshTracer::new(&TriangleMesh::default(), BuildQuality::Fast)?,
            mesh: TriangleMesh::default(),
            normals: Vec::new(),
            objects: Vec::new(),
            owners: Vec::new(),
            lobes: if recipe.lambert { Lobes::Lambert } else { lobes },
            lamps: Vec::new(),
            has_glass: recipe.things.iter().any(|thing| thing.is_glass),
            bounds: Vec::new(),
        };
        let ground = if recipe.has_ground { ground(recipe) } else { TriangleMesh::default() };
        let normals = vertex_normals(&ground);
        let to_paint = (Mat3::IDENTITY, recipe.origin, unit);
        let still = |paint: &Paint, id| Object {
            paint: paint.clone(),
            to_paint,
            id,
            lamp: None,
            is_glass: false,
        };
        world.add(ground, normals, still(&recipe.ground, 1));
        for thing in &recipe.things {
            let smooth = thing.shape.mesh(steps);
            let (rotation, scale) = (thing.rotation(), unit * thing.size);
            let turned: Vec<Vec3> =
                smooth.mesh.vertices.iter().map(|&p| rotation * p * scale).collect();
            let lowest = turned.iter().map(|p| p.z).fold(f32::INFINITY, f32::min);
            let at = thing.place * unit;
            // Down to the ground, and a little into it where that is uneven.
            let z = height(recipe, thing.place.x, thing.place.y) * unit - lowest;
            let sunk = (0.25 * recipe.waves - thing.lift) * unit;
            let origin = recipe.origin + Vec3::new(at.x, at.y, z - sunk);
            let vertices = turned.iter().map(|&p| p + origin).collect();
            let normals = smooth.normals.iter().map(|&n| rotation * n).collect();
            let mesh = TriangleMesh { vertices, triangles: smooth.mesh.triangles };
            let to_paint = (rotation.transpose(), origin, scale);
            let id = world.objects.len() as u8 + 1;
            let object = Object { to_paint, is_glass: thing.is_glass, ..still(&thing.paint, id) };
            world.add(mesh, normals, object);
        }
        for (lamp, number) in recipe.lamps.iter().zip(0u8..) {
            let lamp = lamp.placed(unit, recipe.origin);
            let SmoothMesh { mesh, normals } = lamp.mesh();
            let id = world.objects.len() as u8 + 1;
            let object = Object { lamp: Some(number), ..still(&shade(), id) };
            world.add(mesh, normals, object);
            world.lamps.push(lamp);
        }
        for wall in &recipe.walls {
            let corner = wall.corner * unit + recipe.origin;
            let SmoothMesh { mesh, normals } =
                parallelogram(corner, wall.along * unit, wall.up * unit);
            world.add(mesh, normals, still(&wall.paint, 1));
        }
        world.tracer = MeshTracer::new(&world.mesh, BuildQuality::Balanced)?;
        Ok(world)
    }

    fn add(&mut self, mesh: TriangleMesh, normals: Vec<Vec3>, object: Object) {
        let first = self.mesh.vertices.len() as u32;
        let corners =
            mesh.vertices.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), &p| {
                (low.min(p), high.max(p))
            });
        self.bounds.push(corners);
        self.owners.extend(mesh.triangles.iter().map(|_| self.objects.len() as u16));
        self.mesh.triangles.extend(mesh.triangles.iter().map(|t| t.map(|i| i + first)));
        self.mesh.vertices.extend(mesh.vertices);
        self.normals.extend(normals);
        self.objects.push(object);
    }

    /// What a ray meets.
    pub fn see(&self, ray: &Ray) -> Option<Seen> {
        let hit = self.tracer.closest_hit(ray)?;
        let triangle = self.mesh.triangles[hit.primitive as usize].map(|i| i as usize);
        let [b, c] = hit.barycentrics;
        let weights = [1.0 - b - c, b, c];
        let to_viewer = -ray.direction;
        let geometric = hit.geometric_normal;
        let smooth: Vec3 = (0..3).map(|k| self.normals[triangle[k]] * weights[k]).sum();
        let smooth = smooth.normalize_or(geometric);
        // A smooth normal may turn away where the triangle does not.
        let shading_normal = if smooth.dot(to_viewer) > 1e-3 { smooth } else { geometric };
        let position = ray.at(hit.distance);
        let owner = self.owners[hit.primitive as usize];
        let material = self.material(owner, position);
        let point = SurfacePoint {
            position,
            geometric_normal: geometric,
            shading_normal,
            to_viewer,
            material,
        };
        let object = &self.objects[owner as usize];
        let lamp = object.lamp.filter(|_| geometric.dot(to_viewer) > 0.0);
        let (object, is_glass) = (object.id, object.is_glass);
        Some(Seen { point, distance: hit.distance, object, lamp, is_glass })
    }

    /// What a ray meets behind all glass: the object is that of the first pane, everything else what is seen through it.
    pub fn see_through_glass(&self, ray: &Ray) -> Option<Seen> {
        let (mut from, mut way, mut first) = (*ray, 0.0, None);
        for _ in 0..MOST_PANES {
            let seen = self.see(&from)?;
            way += seen.distance;
            let object = *first.get_or_insert(seen.object);
            if !seen.is_glass {
                return Some(Seen { distance: way, object, ..seen });
            }
            from = seen.behind(ray.direction);
        }
        None
    }

    fn material(&self, owner: u16, position: Vec3) -> Material {
        let object = &self.objects[owner as usize];
        let (rotation, origin, scale) = object.to_paint;
        let base = if object.is_glass {
            object.paint.palette[0]
        } else {
            object.paint.base_color(rotation * (position - origin) / scale)
        };
        match self.lobes {
            Lobes::Lambert => Material::lambert(base),
            lobes => Material {
                lobes,
                ..Material::principled(base, object.paint.roughness, object.paint.metallic)
            },
        }
    }

    /// Position, normal and material of every vertex.
    pub fn vertices(&self) -> Vec<(Vec3, Vec3, Material)> {
        let mut owner = vec![0; self.mesh.vertices.len()];
        for (triangle, &object) in self.mesh.triangles.iter().zip(&self.owners) {
            triangle.iter().for_each(|&v| owner[v as usize] = object);
        }
        let all = self.mesh.vertices.iter().zip(&self.normals).zip(owner);
        all.map(|((&p, &n), object)| (p, n, self.material(object, p))).collect()
    }

    /// Number of vertices of the object that was added last.
    pub fn vertices_of_last(&self) -> usize {
        let last = self.objects.len() as u16 - 1;
        let first =
            self.mesh.triangles.iter().zip(&self.owners).filter(|(_, owner)| **owner == last);
        let lowest = first.flat_map(|(t, _)| t.iter().copied()).min();
        lowest.map_or(0, |v| self.mesh.vertices.len() - v as usize)
    }

    /// Three vertices each.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.mesh.triangles
    }

    /// The lamps, world units.
    pub fn lamps(&self) -> &[Lamp] {
        &self.lamps
    }

    /// Whether anything is in the way, glass as well.
    pub fn occluded(&self, ray: &Ray) -> bool {
        self.tracer.occluded(ray)
    }

    /// Share of light that arrives along a ray: glass lets some of it pass, everything else none.
    pub fn transmittance(&self, ray: &Ray) -> Vec3 {
        if !self.has_glass {
            return if self.occluded(ray) { Vec3::ZERO } else { Vec3::ONE };
        }
        let (mut from, mut left, mut passed) = (*ray, ray.t_max, Vec3::ONE);
        for _ in 0..MOST_PANES {
            let Some(seen) = self.see(&Ray { t_max: left, ..from }) else { return passed };
            if !seen.is_glass {
                return Vec3::ZERO;
            }
            let point = &seen.point;
            let cosine = point.shading_normal.dot(point.to_viewer);
            passed *= pane_transmittance(cosine, point.material.base_color_linear);
            left -= seen.distance;
            from = seen.behind(ray.direction);
        }
        Vec3::ZERO
    }
}

/// What a lamp is made of: bright even when it is off.
pub(crate) fn shade() -> Paint {
    let palette = vec![Vec3::splat(0.8); 2];
    Paint { pattern: Pattern::Clouds, palette, cell: 1.0, roughness: 0.9, metallic: 0.0 }
}

/// Height of the ground, in units of the scene: waves that fade out far away.
fn height(recipe: &SceneRecipe, x: f32, y: f32) -> f32 {
    if !(recipe.waves > 0.0) {
        return 0.0;
    }
    let fade = (1.0 - (x * x + y * y).sqrt() / MIDDLE).clamp(0.0, 1.0);
    recipe.waves * 2.0 * (fractal(Vec3::new(1.6 * x + 3.0, 1.6 * y, 0.5), 2) - 0.5) * fade
}

fn ground(recipe: &SceneRecipe) -> TriangleMesh {
    let steps = 128;
    let mut mesh = TriangleMesh::default();
    // A fine middle, and one ring around it.
    for j in 0..=steps {
        for i in 0..=steps {
            let at = |k: usize| (2.0 * k as f32 / steps as f32 - 1.0) * MIDDLE;
            let z = height(recipe, at(i), at(j));
            mesh.vertices.push(Vec3::new(at(i), at(j), z) * recipe.unit + recipe.origin);
        }
    }
    let row = steps as u32 + 1;
    for j in 0..row - 1 {
        for i in 0..row - 1 {
            let a = j * row + i;
            mesh.triangles.extend([[a, a + 1, a + row + 1], [a, a + row + 1, a + row]]);
        }
    }
    let inner = [0, row - 1, row * row - 1, row * (row - 1)];
    let first = mesh.vertices.len() as u32;
    for (x, y) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
        mesh.vertices.push(Vec3::new(x, y, 0.0) * (GROUND * recipe.unit) + recipe.origin);
    }
    for k in 0..4u32 {
        let (here, next) = (k as usize, (k as usize + 1) % 4);
        let (outer, outer_next) = (first + k, first + next as u32);
        mesh.triangles.push([outer, outer_next, inner[next]]);
        mesh.triangles.push([outer, inner[next], inner[here]]);
    }
    mesh
}
