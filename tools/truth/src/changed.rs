//! A scene without one of its objects, or with one in another place, as the test views of a folder show it.

use std::path::Path;
use std::str::FromStr;

use glam::Vec3;

use crate::expose;
use crate::lights::environment;
use crate::made::Made;
use crate::path::PathTracer;
use crate::render::{Buffers, buffers};
use crate::scenes::{SceneName, SceneRecipe};
use crate::variant::find_object;
use crate::world::World;

/// Another place for an object.
#[derive(Clone, Debug, PartialEq)]
pub struct Move {
    /// Name of the object.
    pub object: String,
    /// By how much, world units, as `edit --translate` has it.
    pub by: Vec3,
}

impl FromStr for Move {
    type Err = String;

    /// `OBJECT=DX,DY,DZ`.
    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || "expected OBJECT=DX,DY,DZ".to_owned();
        let (object, numbers) = text.split_once('=').ok_or_else(wrong)?;
        let by = finite_numbers(numbers).ok_or_else(wrong)?;
        Ok(Self { object: object.into(), by: Vec3::from_array(by) })
    }
}

/// As many finite numbers as asked for, between commas.
#[must_use]
pub fn finite_numbers<const N: usize>(text: &str) -> Option<[f32; N]> {
    let numbers: Option<Vec<f32>> = text.split(',').map(|n| n.trim().parse().ok()).collect();
    let numbers: [f32; N] = numbers?.try_into().ok()?;
    numbers.iter().all(|n| n.is_finite()).then_some(numbers)
}

impl Move {
    /// Moves the object.
    ///
    /// # Errors
    /// When the scene has no such object.
    pub fn apply(&self, recipe: &mut SceneRecipe) -> anyhow::Result<()> {
        let at = find_object(recipe, &self.object)?;
        let (by, thing) = (self.by / recipe.unit, &mut recipe.things[at]);
        thing.place += by.truncate();
        thing.lift += by.z;
        Ok(())
    }
}

/// Writes `test/removed_OBJECT/` into a folder that [`crate::make`] wrote: the test views under the light of the photos as pictures
/// and as ids, without an object.
///
/// # Errors
/// When the scene has no such object, the folder is of another scene, or a file cannot be read or written.
pub fn make_removed(name: SceneName, object: &str, folder: &Path) -> anyhow::Result<()> {
    let mut recipe = name.recipe();
    let gone = find_object(&recipe, object)?;
    recipe.things.remove(gone);
    // The ids of the whole scene: 1 is the ground, 2 the first object.
    let first_later = gone as u8 + 2;
    let id = |id: u8| if id >= first_later { id + 1 } else { id };
    write_views(&recipe, &format!("test/removed_{object}"), folder, id)
}

/// Writes `test/moved_OBJECT/` as [`make_removed`] does, with an object in another place.
///
/// # Errors
/// As [`make_removed`].
pub fn make_moved(name: SceneName, moved: &Move, folder: &Path) -> anyhow::Result<()> {
    let mut recipe = name.recipe();
    moved.apply(&mut recipe)?;
    write_views(&recipe, &format!("test/moved_{}", moved.object), folder, |id| id)
}

fn write_views(
    recipe: &SceneRecipe,
    place: &str,
    folder: &Path,
    id: impl Fn(u8) -> u8,
) -> anyhow::Result<()> {
    let made = Made::read(folder, recipe)?;
    let world = World::new(recipe, made.lobes)?;
    let mut guides: Vec<Buffers> = made.shots.iter().map(|shot| buffers(&world, shot)).collect();
    let light = environment(&recipe.capture_light.1.picture()?)?;
    let views = made.shots.iter().zip(&guides).zip(made.first..);
    let tracer = PathTracer::new(&world, &light, made.bounces, made.seed).with_lamps();
    let frames = expose(&tracer, views, made.samples, made.seed);
    let out = made.reopen(folder, recipe)?;
    out.frames(place, &made.shots, &frames, &guides)?;
    for (shot, guide) in made.shots.iter().zip(&mut guides) {
        guide.ids.iter_mut().for_each(|i| *i = id(*i));
        out.ids_as(&format!("{place}/{}_id.png", shot.name), guide)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_move_is_read_in_world_units_and_moves_its_object_alone() {
        let moved: Move = "jug=0.4,-0.2,0.1".parse().unwrap();
        let (before, mut after) = (SceneName::Kitchen.recipe(), SceneName::Kitchen.recipe());
        moved.apply(&mut after).unwrap();
        for (b, a) in before.things.iter().zip(&after.things) {
            let by = (a.place - b.place).extend(a.lift - b.lift) * before.unit;
            let wanted = if b.name == "jug" { moved.by } else { Vec3::ZERO };
            assert!((by - wanted).length() < 1e-5, "{}: {by}", b.name);
        }
        for wrong in ["jug", "jug=1,2", "jug=1,2,nan", "jug=1,2,x"] {
            assert!(wrong.parse::<Move>().is_err(), "{wrong}");
        }
        let none = Move { object: "cat".into(), ..moved };
        assert!(none.apply(&mut after).unwrap_err().to_string().contains("jug"));
    }
}
