//! Scenes that differ from a recipe: without an object, under another light.

use crate::MakeOptions;
use crate::scenes::{SceneName, SceneRecipe};

/// The recipe as the options want it.
///
/// # Errors
/// When the scene has no such object or light.
pub fn recipe_of(name: SceneName, options: &MakeOptions) -> anyhow::Result<SceneRecipe> {
    let mut recipe = name.recipe();
    if let Some(object) = &options.omit {
        let at = find_object(&recipe, object)?;
        recipe.things.remove(at);
    }
    if let Some(light) = options.light.as_ref().filter(|light| *light != recipe.capture_light.0) {
        let names: Vec<&str> = recipe.relights.iter().map(|(name, _)| *name).collect();
        let Some(at) = names.iter().position(|name| name == light) else {
            anyhow::bail!("there is no light {light}, but {}", names.join(", "));
        };
        std::mem::swap(&mut recipe.capture_light, &mut recipe.relights[at]);
    }
    if options.no_relights {
        recipe.relights.clear();
    }
    Ok(recipe)
}

/// Place of an object among the things of a recipe.
///
/// # Errors
/// When there is none of this name.
pub fn find_object(recipe: &SceneRecipe, object: &str) -> anyhow::Result<usize> {
    let names: Vec<&str> = recipe.things.iter().map(|thing| thing.name).collect();
    let found = names.iter().position(|name| *name == object);
    found.ok_or_else(|| anyhow::anyhow!("there is no object {object}, but {}", names.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_object_leaves_and_a_light_changes_places() {
        let options = MakeOptions {
            omit: Some("jar".into()),
            light: Some("overcast".into()),
            ..MakeOptions::default()
        };
        let recipe = recipe_of(SceneName::Matte, &options).unwrap();
        assert!(recipe.things.iter().all(|t| t.name != "jar") && recipe.things.len() == 3);
        assert_eq!(recipe.capture_light.0, "overcast");
        assert!(recipe.relights.iter().any(|(name, _)| *name == "noon"));
        let wrong = MakeOptions { omit: Some("cat".into()), ..MakeOptions::default() };
        let error = recipe_of(SceneName::Matte, &wrong).unwrap_err().to_string();
        assert!(error.contains("jar"), "{error}");
    }
}
