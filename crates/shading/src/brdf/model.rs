//! What a reflection model is, and how one is chosen.

use glam::{DVec3, Vec3};

use super::Material;
use super::reference::{self, Value};

/// `f_r (n · w_i)⁺`, per steradian.
#[derive(Clone, Copy, Debug, Default)]
pub struct BrdfValue {
    /// Diffuse part, proportional to base color.
    pub diffuse: Vec3,
    /// Specular part, single and multiple scattering.
    pub specular: Vec3,
}

impl BrdfValue {
    /// Both parts.
    #[inline]
    pub fn total(&self) -> Vec3 {
        self.diffuse + self.specular
    }
}

/// A reflection model: its definition in f64, and the f32 path, prepared for one viewer and one surface point so that what
/// does not depend on the light is computed once.
///
/// The diffuse part of both is proportional to base color; the specular part of a dielectric (metallic 0) does not depend on
/// it. `decompose` solves for base color in closed form because of this.
pub trait Model: Copy {
    /// A white material, dielectric or metal, reflects all light but for this share; infinite where the model does not conserve
    /// energy.
    const FURNACE_ERROR: f64;

    /// Prepares `material` at a point with unit `normal`, seen along the unit vector `to_viewer`.
    fn new(material: &Material, normal: Vec3, to_viewer: Vec3) -> Self;

    /// The shading normal.
    fn normal(&self) -> Vec3;

    /// Whether the normal faces away from the viewer: the point reflects nothing and samples nothing.
    fn faces_away(&self) -> bool;

    /// `f_r (n · w_i)⁺` and the density of [`Self::sample`] at the unit vector `to_light`.
    fn eval_pdf(&self, to_light: Vec3) -> (BrdfValue, f32);

    /// The values of [`Self::eval_pdf`] for materials that differ in base color and metallic only, at one point and seen from
    /// one side: what they have in common may be computed once.
    #[inline]
    fn eval_alike<const N: usize>(models: &[Self; N], to_light: Vec3) -> [BrdfValue; N] {
        models.each_ref().map(|model| model.eval_pdf(to_light).0)
    }

    /// A direction toward the light; `u` in [0, 1)³. None when the sampled direction goes into the surface, or the point faces
    /// away.
    fn sample(&self, u: [f32; 3]) -> Option<Vec3>;

    /// The factors by which base color enters the diffuse and the specular part.
    fn factors(material: &Material) -> [Vec3; 2];

    /// `f_r(w_i, w_o)` in the local frame (normal = z), both directions above the surface.
    fn eval_reference(material: &reference::Material, w_i: DVec3, w_o: DVec3) -> Value;

    /// Density per steradian of [`Self::sample_reference`] in the local frame, both directions above the surface.
    fn pdf_reference(material: &reference::Material, w_i: DVec3, w_o: DVec3) -> f64;

    /// A direction toward the light in the local frame, possibly below the surface; `u` in [0, 1)³.
    fn sample_reference(material: &reference::Material, w_o: DVec3, u: [f64; 3]) -> DVec3;
}

/// Work that is compiled for every model, see [`super::with_model`].
pub trait WithModel {
    /// What comes of it.
    type Output;

    /// Does it with the model of the material.
    fn run<M: Model>(self) -> Self::Output;
}

/// Declares [`super::with_model`], [`super::Brdf`] and [`super::LOBES`].
macro_rules! models {
    ($($lobes:ident = $model:ty,)*) => {
        /// Every choice of lobes.
        pub const LOBES: &[Lobes] = &[$(Lobes::$lobes,)*];

        /// Runs `work` with the model of `lobes`: one match outside of loops, no branch inside.
        #[inline]
        pub fn with_model<W: WithModel>(lobes: Lobes, work: W) -> W::Output {
            match lobes { $(Lobes::$lobes => work.run::<$model>(),)* }
        }

        /// A material seen from one direction at one point, whatever its model. Loops take [`with_model`].
        #[derive(Clone, Copy, Debug)]
        pub enum Brdf {
            $(
                #[doc = concat!("Of [`Lobes::", stringify!($lobes), "`].")]
                $lobes($model),
            )*
        }

        impl Brdf {
            /// As [`Model::new`].
            #[inline]
            pub fn new(material: &Material, normal: Vec3, to_viewer: Vec3) -> Self {
                match material.lobes {
                    $(Lobes::$lobes => Self::$lobes(Model::new(material, normal, to_viewer)),)*
                }
            }

            /// As [`Model::normal`].
            pub fn normal(&self) -> Vec3 {
                match self { $(Self::$lobes(model) => model.normal(),)* }
            }

            /// As [`Model::faces_away`].
            #[inline]
            pub fn faces_away(&self) -> bool {
                match self { $(Self::$lobes(model) => model.faces_away(),)* }
            }

            /// As [`Model::eval_pdf`].
            #[inline]
            pub fn eval_pdf(&self, to_light: Vec3) -> (BrdfValue, f32) {
                match self { $(Self::$lobes(model) => model.eval_pdf(to_light),)* }
            }

            /// As [`Model::sample`].
            #[inline]
            pub fn sample(&self, u: [f32; 3]) -> Option<Vec3> {
                match self { $(Self::$lobes(model) => model.sample(u),)* }
            }
        }
    };
}
pub(super) use models;
