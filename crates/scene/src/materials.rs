//! What every Gaussian is made of, as columns that travel with it.

use clap::ValueEnum;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{ColumnValues, ExtraColumn, Gaussians};

/// Lobes of the materials, see `docs/methods/shading.md`.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "lowercase")]
pub enum Lobes {
    /// Diffuse only (`f_r = base_color / π`): roughness and metallic are ignored.
    Lambert,
    /// Energy-conserving specular over diffuse, or metal.
    #[default]
    Principled,
    /// The same specular lobes over Burley's diffuse lobe, as Blender, Mitsuba and engines have it.
    Burley,
    /// The specular lobes of `principled` over rough diffuse reflection: the energy-preserving Oren–Nayar model.
    #[serde(rename = "oren-nayar")]
    OrenNayar,
}

/// Material of `N` Gaussians, as `decompose` finds it.
///
/// | field | columns of the file | value |
/// |---|---|---|
/// | `normals` | `nx ny nz` | unit, world, out of the matter |
/// | `base_color_linear` | `base_color_0..2` | 0 to 1, Rec. 709, linear; blended sRGB-encoded |
/// | `roughness` | `roughness` | perceptual, 0 to 1 |
/// | `metallic` | `metallic` | 0 dielectric, 1 metal |
/// | `visibility` | `visibility` | cosine-weighted share of the hemisphere that is open, 0 to 1 |
/// | `observations` | `observations` | training views that saw it; 0: the material is a guess |
#[derive(Clone, Debug, Default, PartialEq)]
#[expect(missing_docs, reason = "the table above")]
pub struct Materials {
    pub normals: Vec<[f32; 3]>,
    pub base_color_linear: Vec<[f32; 3]>,
    pub roughness: Vec<f32>,
    pub metallic: Vec<f32>,
    pub visibility: Vec<f32>,
    pub observations: Vec<u16>,
}

/// Base color (linear, all channels) of lamps. What they send hides it; shades and panes are white for the most part.
pub const LAMP_BASE_COLOR: f32 = 0.8;

/// Columns of [`Materials`], in the order of the file.
pub const MATERIAL_COLUMNS: [&str; 10] = [
    "nx",
    "ny",
    "nz",
    "base_color_0",
    "base_color_1",
    "base_color_2",
    "roughness",
    "metallic",
    "visibility",
    "observations",
];

impl Materials {
    /// Number of Gaussians.
    pub fn len(&self) -> usize {
        self.roughness.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.roughness.is_empty()
    }

    /// Puts the columns on `gaussians`, in place of older ones.
    ///
    /// # Panics
    /// When the numbers of Gaussians differ.
    pub fn attach(&self, gaussians: &mut Gaussians) {
        assert_eq!(self.len(), gaussians.len(), "one material per Gaussian");
        gaussians.extra.retain(|column| !MATERIAL_COLUMNS.contains(&column.name.as_str()));
        let part = |of: &[[f32; 3]], k: usize| ColumnValues::F32(of.iter().map(|v| v[k]).collect());
        let values = (0..3)
            .map(|k| part(&self.normals, k))
            .chain((0..3).map(|k| part(&self.base_color_linear, k)))
            .chain(
                [&self.roughness, &self.metallic, &self.visibility]
                    .map(|v| ColumnValues::F32(v.clone())),
            )
            .chain([ColumnValues::U16(self.observations.clone())]);
        for (name, values) in MATERIAL_COLUMNS.iter().zip(values) {
            gaussians.extra.push(ExtraColumn { name: (*name).into(), values });
        }
    }

    /// The material that `gaussians` carry.
    ///
    /// # Errors
    /// The name of the first column that is missing or has another type.
    pub fn of(gaussians: &Gaussians) -> Result<Self, &'static str> {
        let find = |name: &'static str| {
            gaussians.extra.iter().find(|c| c.name == name).map(|c| &c.values).ok_or(name)
        };
        let float = |name| match find(name)? {
            ColumnValues::F32(v) => Ok(v.clone()),
            _ => Err(name),
        };
        let triple = |names: [&'static str; 3]| {
            let [x, y, z] = [float(names[0])?, float(names[1])?, float(names[2])?];
            Ok(x.into_iter().zip(y).zip(z).map(|((x, y), z)| [x, y, z]).collect())
        };
        let observations = match find("observations")? {
            ColumnValues::U16(v) => v.clone(),
            _ => return Err("observations"),
        };
        Ok(Self {
            normals: triple(["nx", "ny", "nz"])?,
            base_color_linear: triple(["base_color_0", "base_color_1", "base_color_2"])?,
            roughness: float("roughness")?,
            metallic: float("metallic")?,
            visibility: float("visibility")?,
            observations,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_come_back_and_replace_older_ones() {
        let mut gaussians = Gaussians { means: vec![[0.0; 3]; 2], ..Gaussians::empty(0) };
        let materials = Materials {
            normals: vec![[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]],
            base_color_linear: vec![[0.1, 0.2, 0.3]; 2],
            roughness: vec![0.5, 0.6],
            metallic: vec![0.0, 1.0],
            visibility: vec![1.0, 0.25],
            observations: vec![3, 0],
        };
        materials.attach(&mut gaussians);
        materials.attach(&mut gaussians);
        assert_eq!(gaussians.extra.len(), MATERIAL_COLUMNS.len());
        assert_eq!(Materials::of(&gaussians).as_ref(), Ok(&materials));
        gaussians.extra.retain(|c| c.name != "metallic");
        assert_eq!(Materials::of(&gaussians), Err("metallic"));
    }
}
