//! What the steps of a decomposition work on: the inputs, which stay, and the state, which each step changes a part of.

use glam::Vec3;
use motes_raster::RenderOptions;
use motes_scene::{Gaussians, ImageF32, Materials, Residual, ScaleAnchor, Surface};
use motes_shading::emitters::Emitters;
use motes_shading::environment::{
    Convention, Environment, MapAxes, Orientation, direction_from_uv,
};
use motes_shading::tracing::{Ray, Tracer};

use crate::appearance::{FoundMaterials, ModelOptions, PixelShading};
use crate::error::DecomposeError;
use crate::illumination::{CellLight, environment};
use crate::observation::{Observed, Photo, TracedSurface, ViewRays};

/// Distance at which rays leave the surface, as a share of the distance between camera and point: some pixels.
const RAY_BIAS: f32 = 3e-3;

/// The base color at a pixel of a photo, linear.
#[derive(Clone, Debug, PartialEq)]
pub struct BaseColorAnchor {
    /// What errors call it.
    pub label: String,
    /// Index of the photo.
    pub photo: usize,
    /// Image point, pixels.
    pub pixel: [f32; 2],
    /// Linear, 0 to 1.
    pub base_color_linear: Vec3,
}

impl BaseColorAnchor {
    /// The point of a surface that the pixel shows, world.
    ///
    /// # Errors
    /// When it shows none.
    pub fn position(
        &self,
        photos: &[Photo],
        scene: &TracedSurface,
    ) -> Result<Vec3, DecomposeError> {
        let rays = ViewRays::new(&photos[self.photo]);
        let [x, y] = self.pixel;
        let ray = Ray::new(rays.eye, rays.direction(x, y));
        let hit = scene.tracer.closest_hit(&ray);
        let hit = hit.ok_or_else(|| DecomposeError::AnchorMissesSurface(self.label.clone()))?;
        Ok(ray.at(hit.distance))
    }
}

/// What is known beforehand.
#[derive(Debug, Default)]
pub struct Known {
    /// The surface; extracted from the Gaussians when there is none.
    pub surface: Option<Surface>,
    /// Light of every capture, photo units; empty when it is to be found.
    pub lights: Vec<Environment>,
    /// Axes and turn in degrees of maps whose zenith is the up of the surface, which is found first; none for maps that
    /// stand where they are.
    pub upright_lights: Option<(Convention, f64)>,
    /// The scale of light against base color is set so that these come out.
    pub anchors: Vec<BaseColorAnchor>,
    /// Base colors that another program predicted, per photo, `[h, w, 3]`, linear, up to a factor per photo.
    pub base_color_priors: Vec<Option<ImageF32>>,
    /// Normals that another program predicted, per photo, `[h, w, 3]`, unit vectors in world; shorter than 1/2 where there is none.
    pub normal_priors: Vec<Option<ImageF32>>,
}

/// What a decomposition is made from.
#[derive(Debug)]
pub struct Inputs<'a> {
    /// The Gaussians, fitted to the photos of light 0.
    pub gaussians: &'a Gaussians,
    /// The photos that everything is fitted to.
    pub photos: &'a [Photo],
    /// Further photos, which results are only compared with.
    pub held_out: &'a [Photo],
    /// What is known beforehand.
    pub known: &'a Known,
    /// How the Gaussians are drawn.
    pub render: RenderOptions,
    /// The model.
    pub model: &'a ModelOptions,
    /// Key of all random numbers.
    pub seed: u64,
}

impl Inputs<'_> {
    /// Number of lights that the photos were taken under.
    pub fn light_count(&self) -> usize {
        self.photos.iter().map(|p| p.light + 1).max().unwrap_or(1)
    }
}

/// The light with the materials that go with it, and the scale between the two.
#[derive(Debug)]
pub struct Illumination {
    /// Cells per capture; empty when the light is known.
    pub cells: Vec<CellLight>,
    /// The same as something that can be sampled, or the light that is known.
    pub lights: Vec<Environment>,
    /// Per vertex of the surface: the lamp that it is part of, from 1; 0 for none. Empty where there are no lamps.
    pub lamp_of_vertex: Vec<u32>,
    /// Materials under that light.
    pub materials: FoundMaterials,
    /// Factor that the anchor put on base colors.
    pub base_color_factor: Vec3,
    /// What the scale rests on.
    pub anchor: ScaleAnchor,
}

impl Illumination {
    /// Light that is known.
    pub fn known(lights: Vec<Environment>) -> Self {
        Self {
            cells: Vec::new(),
            lights,
            lamp_of_vertex: Vec::new(),
            materials: FoundMaterials::default(),
            base_color_factor: Vec3::ONE,
            anchor: ScaleAnchor::Environment,
        }
    }

    /// Light that was found.
    pub fn of_cells(cells: Vec<CellLight>) -> Self {
        let lights = cells.iter().map(environment).collect();
        Self { cells, ..Self::known(lights) }
    }

    /// What every vertex sends out on its own, linear, photo units; empty where nothing shines.
    pub fn emission(&self) -> Vec<Vec3> {
        let Some(lamps) = self.cells.first().map(|light| &light.lamps) else { return Vec::new() };
        let of = |lamp: &u32| match lamp.checked_sub(1).and_then(|k| lamps.get(k as usize)) {
            Some(lamp) => lamp.radiance,
            None => Vec3::ZERO,
        };
        self.lamp_of_vertex.iter().map(of).collect()
    }

    /// The lamps as triangles of a surface; none where nothing shines.
    pub(crate) fn emitters(&self, scene: &TracedSurface) -> Option<Emitters> {
        let emission = self.emission();
        (!emission.is_empty()).then(|| Emitters::new(&scene.mesh(), &emission)).flatten()
    }
}

/// The Gaussians with one base color each.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BaseColored {
    /// Degree 0, colors sRGB-encoded; the rows of the input.
    pub gaussians: Gaussians,
    /// Views in which a Gaussian is responsible for more than a thousandth of a pixel.
    pub observations: Vec<u16>,
}

/// A view under the light that was found.
#[derive(Clone, Debug)]
pub struct RenderedView {
    /// Index of the photo: training photos, then those held out.
    pub photo: usize,
    /// PSNR of the sRGB-encoded picture, dB, over the pixels of full weight that the Gaussians cover as they were given; where the
    /// surface is missed there, the light shows. NaN where no pixel counts. Where training photos have gains, one per channel is fitted to a photo
    /// held out first.
    pub psnr_db: f64,
}

/// What the steps know and change. Before the step that fills it, a field is empty.
#[derive(Debug)]
pub struct State<'a> {
    /// What stays.
    pub inputs: &'a Inputs<'a>,
    /// The surface and what the photos show of it. `surface`, `samples`, `shape-from-shading`, `shape-from-reflection`
    /// change it, and `base-color` gives it a material.
    pub observed: Observed<'a>,
    /// Unit vector away from the ground, of `surface`.
    pub up_in_world: Vec3,
    /// Median distance between cameras and points of the first surface, world units, of `samples`.
    pub camera_distance: f32,
    /// Cells of the light after every round, of `light`.
    pub light_cells: Vec<usize>,
    /// Light, materials and scale: `light`, `materials`, `reflected-light`; materials also after the surface has moved.
    pub illumination: Illumination,
    /// Shading of every pixel of the photos, those held out last, of `shading`.
    pub shading: Vec<PixelShading>,
    /// Of `base-color` and `refinement`.
    pub base_colored: BaseColored,
    /// The Gaussians with shapes, opacities and captured colors as the photos have them under one base color each, of
    /// `refinement`; same rows.
    pub refined: Option<Gaussians>,
    /// Materials of the Gaussians, of `attributes`.
    pub attributes: Materials,
    /// What the model leaves unexplained, of `appearance-residual`.
    pub residual: Option<Residual>,
    /// Views under the light, of `evaluation`.
    pub views: Vec<RenderedView>,
    /// How far every Gaussian is to be trusted, 0 to 1, of `evaluation`.
    pub confidence: Vec<f32>,
    /// Share of every Gaussian that is sky, 0 to 1, of `evaluation`; empty where the photos show none.
    pub sky: Vec<f32>,
}

impl<'a> State<'a> {
    /// Before the first step.
    ///
    /// # Errors
    /// Never with an empty surface; the type is that of all surfaces.
    pub fn new(inputs: &'a Inputs<'a>) -> Result<Self, DecomposeError> {
        Ok(Self {
            inputs,
            observed: Observed::unseen(TracedSurface::new(Surface::default())?),
            up_in_world: Vec3::Z,
            camera_distance: 1.0,
            light_cells: Vec::new(),
            illumination: Illumination::known(inputs.known.lights.clone()),
            shading: Vec::new(),
            base_colored: BaseColored::default(),
            refined: None,
            attributes: Materials::default(),
            residual: None,
            views: Vec::new(),
            confidence: Vec::new(),
            sky: Vec::new(),
        })
    }

    /// The surface as it is.
    pub fn surface(&self) -> &Surface {
        &self.observed.scene.surface
    }

    /// Axes of the light's map: up is where it is in the world.
    pub fn convention(&self) -> Convention {
        let up = self.up_in_world;
        if up.z.abs() >= up.y.abs() { Convention::Blender } else { Convention::OpenExr }
    }

    /// The same with its zenith, which is up.
    pub fn map_axes(&self) -> MapAxes {
        MapAxes::upright(self.convention(), self.up_in_world.as_dvec3())
    }

    /// Where the light's map is in the world.
    pub fn orientation(&self) -> Orientation {
        self.map_axes().orientation()
    }

    /// The light of every capture that is known, in the world of the surface; empty when it is to be found.
    pub fn known_lights(&self) -> Vec<Environment> {
        let known = self.inputs.known;
        let Some((convention, rotate_deg)) = known.upright_lights else {
            return known.lights.clone();
        };
        let axes = MapAxes::upright(convention, self.up_in_world.as_dvec3());
        let orientation = axes.orientation().rotated(rotate_deg);
        let map = |light: &Environment| light.map().map(|map| map.clone().turned(orientation));
        known.lights.iter().map(|light| Environment::new(map(light), None)).collect()
    }

    /// Distance at which rays leave the surface, world units.
    pub fn ray_bias(&self) -> f32 {
        RAY_BIAS * self.camera_distance
    }

    /// The surface with what its lamps send.
    pub fn shining_surface(&self) -> Surface {
        let emission = self.illumination.emission();
        let emission_linear = emission.into_iter().map(|e| e.to_array()).collect();
        Surface { emission_linear, ..self.surface().clone() }
    }

    /// What every vertex sends out, per light, lamps included, where light from the surface itself is modeled.
    pub(crate) fn sent_radiance(&self) -> Vec<Vec<Vec3>> {
        let mut all = self.observed.vertex_radiance.clone();
        let emission = self.illumination.emission();
        for sent in &mut all {
            sent.iter_mut().zip(&emission).for_each(|(sent, lamp)| *sent = sent.max(*lamp));
        }
        all
    }

    /// Whether one bounce of light belongs to the model.
    pub fn has_indirect(&self) -> bool {
        !self.observed.vertex_radiance.is_empty()
    }

    /// Whether any part has a specular lobe.
    pub fn is_specular(&self) -> bool {
        self.illumination.materials.reflects()
    }

    /// The light of a capture as a lat-long map, photo units, of [`Self::convention`]; of a light that is known only the first.
    pub fn light_map(&self, light: usize) -> Option<ImageF32> {
        match self.known_lights().first() {
            Some(known) => (light == 0).then(|| map_of(known, self.orientation())),
            None => Some(self.illumination.cells.get(light)?.image(MAP_WIDTH)),
        }
    }

    /// The Gaussians with shapes as they are by now.
    pub fn gaussians(&self) -> &Gaussians {
        self.refined.as_ref().unwrap_or(self.inputs.gaussians)
    }
}

/// Width of the map of a light that was found; that of one that is known is twice as wide.
const MAP_WIDTH: usize = 256;

fn map_of(light: &Environment, orientation: Orientation) -> ImageF32 {
    let mut image = ImageF32::filled(2 * MAP_WIDTH, MAP_WIDTH, 3, 0.0);
    for y in 0..image.height {
        for x in 0..image.width {
            let (u, v) =
                ((x as f64 + 0.5) / image.width as f64, (y as f64 + 0.5) / image.height as f64);
            let d = orientation.world_from_map(direction_from_uv(u, v)).as_vec3();
            image.pixel_mut(x, y).copy_from_slice(&light.radiance_pdf(d).0.to_array());
        }
    }
    image
}
