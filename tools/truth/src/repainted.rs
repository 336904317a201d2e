//! A scene whose objects are made of something else, under any light, as the test views of a folder show it.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use anyhow::Context as _;
use glam::Vec3;
use motes_formats::environment::read_environment;

use crate::changed::finite_numbers;
use crate::expose;
use crate::lights::environment;
use crate::made::Made;
use crate::path::PathTracer;
use crate::render::{Buffers, buffers};
use crate::scenes::{SceneName, SceneRecipe};
use crate::texture::{Paint, Pattern};
use crate::world::World;

/// Sets its random numbers apart from those of the scene's own lights.
const FIRST_SALT: u64 = 64;

/// Another paint, of one color, for the objects of a name: `handle` means `handle` and `handle_1`.
#[derive(Clone, Debug, PartialEq)]
pub struct Repaint {
    /// Of the objects.
    pub name: String,
    /// Linear Rec. 709.
    pub base_color: Vec3,
    /// Perceptual.
    pub roughness: f32,
    /// 0 or 1.
    pub metallic: f32,
}

impl FromStr for Repaint {
    type Err = String;

    /// `NAME=R,G,B,ROUGHNESS,METALLIC`.
    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || "expected NAME=R,G,B,ROUGHNESS,METALLIC, numbers from 0 to 1".to_owned();
        let (name, numbers) = text.split_once('=').ok_or_else(wrong)?;
        let numbers = finite_numbers(numbers).filter(|n| n.iter().all(|v| (0.0..=1.0).contains(v)));
        let [r, g, b, roughness, metallic] = numbers.ok_or_else(wrong)?;
        let base_color = Vec3::new(r, g, b);
        Ok(Self { name: name.into(), base_color, roughness, metallic })
    }
}

impl Repaint {
    /// Paints its objects.
    ///
    /// # Errors
    /// There are none.
    pub fn apply(&self, recipe: &mut SceneRecipe) -> anyhow::Result<()> {
        let is_meant = |name: &str| {
            let rest = name.strip_prefix(self.name.as_str());
            rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('_'))
        };
        let mut found = false;
        for thing in recipe.things.iter_mut().filter(|thing| is_meant(thing.name)) {
            thing.paint = Paint {
                pattern: Pattern::Plain,
                palette: vec![self.base_color],
                cell: 1.0,
                roughness: self.roughness,
                metallic: self.metallic,
            };
            found = true;
        }
        let names: Vec<&str> = recipe.things.iter().map(|thing| thing.name).collect();
        anyhow::ensure!(found, "there is no object {}, but {}", self.name, names.join(", "));
        Ok(())
    }
}

/// Writes `test/relight_LIGHT/` for every light into a folder that [`crate::make`] wrote: the test views with other paints. A light
/// is a map in Blender's axes whose values are photo values.
///
/// # Errors
/// When the scene has no such object, the folder is of another scene, or a file cannot be read or written.
pub fn make_repainted(
    name: SceneName,
    repaints: &[Repaint],
    lights: &[(String, PathBuf)],
    folder: &Path,
) -> anyhow::Result<()> {
    let mut recipe = name.recipe();
    repaints.iter().try_for_each(|repaint| repaint.apply(&mut recipe))?;
    let made = Made::read(folder, &recipe)?;
    let world = World::new(&recipe, made.lobes)?;
    let guides: Vec<Buffers> = made.shots.iter().map(|shot| buffers(&world, shot)).collect();
    let out = made.reopen(folder, &recipe)?;
    for (salt, (light, file)) in (FIRST_SALT..).zip(lights) {
        let map = read_environment(file).with_context(|| file.display().to_string())?;
        let radiance = environment(&map.scaled(1.0 / made.exposure as f32))?;
        let seed = made.seed ^ (salt << 32);
        let tracer = PathTracer::new(&world, &radiance, made.bounces, seed);
        let views = made.shots.iter().zip(&guides).zip(made.first..);
        let frames = expose(&tracer, views, made.samples, seed);
        out.frames(&format!("test/relight_{light}"), &made.shots, &frames, &guides)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_paint_is_read_and_covers_the_objects_of_its_name() {
        let brass: Repaint = "handle=0.9,0.8,0.4,0.2,1".parse().unwrap();
        let mut recipe = SceneName::Kitchen.recipe();
        brass.apply(&mut recipe).unwrap();
        for thing in &recipe.things {
            let is_brass = thing.paint.base_color(Vec3::ONE) == brass.base_color;
            assert_eq!(is_brass, thing.name.starts_with("handle_"), "{}", thing.name);
        }
        let none = Repaint { name: "hand".into(), ..brass };
        assert!(none.apply(&mut recipe).unwrap_err().to_string().contains("handle_1"));
        for wrong in ["handle", "handle=1,1,1,1", "handle=2,0,0,1,0", "handle=a,0,0,1,0"] {
            assert!(wrong.parse::<Repaint>().is_err(), "{wrong}");
        }
    }
}
