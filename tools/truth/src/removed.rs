//! A scene without one of its objects, as the test views of a folder show it.

use std::path::Path;

use crate::expose;
use crate::lights::environment;
use crate::made::Made;
use crate::path::PathTracer;
use crate::render::{Buffers, buffers};
use crate::scenes::SceneName;
use crate::variant::find_object;
use crate::world::World;

/// Writes `test/removed_OBJECT/` into a folder that [`crate::make`] wrote: the test views under the light of the photos as pictures
/// and as ids, without an object.
///
/// # Errors
/// When the scene has no such object, the folder is of another scene, or a file cannot be read or written.
pub fn make_removed(name: SceneName, object: &str, folder: &Path) -> anyhow::Result<()> {
    let mut recipe = name.recipe();
    let gone = find_object(&recipe, object)?;
    recipe.things.remove(gone);
    let made = Made::read(folder, &recipe)?;
    let world = World::new(&recipe, made.lobes)?;
    let mut guides: Vec<Buffers> = made.shots.iter().map(|shot| buffers(&world, shot)).collect();
    let light = environment(&recipe.capture_light.1.picture()?)?;
    let views = made.shots.iter().zip(&guides).zip(made.first..);
    let tracer = PathTracer::new(&world, &light, made.bounces, made.seed).with_lamps();
    let frames = expose(&tracer, views, made.samples, made.seed);
    let out = made.reopen(folder)?;
    let place = format!("test/removed_{object}");
    out.frames(&place, &made.shots, &frames)?;
    for (shot, guide) in made.shots.iter().zip(&mut guides) {
        // The ids of the whole scene: 1 is the ground, 2 the first object.
        let first_later = gone as u8 + 2;
        guide.ids.iter_mut().filter(|id| **id >= first_later).for_each(|id| *id += 1);
        out.ids_as(&format!("{place}/{}_id.png", shot.name), guide)?;
    }
    Ok(())
}
