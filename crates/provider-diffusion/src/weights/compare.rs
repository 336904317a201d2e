//! Whether a file holds exactly the tensors of a network.

use std::collections::BTreeMap;
use std::path::Path;

use crate::error::{DiffusionError, Result};

/// Shapes of tensors by name.
pub type Shapes = BTreeMap<String, Vec<usize>>;

const WHERE: &str = "check which file belongs where";

/// Refuses a file that has not exactly the tensors of `wanted`; `of` says what they are of.
///
/// # Errors
/// A tensor is missing, too many or of another shape.
pub fn compare(found: &Shapes, wanted: &Shapes, path: &Path, of: &str) -> Result<()> {
    let error = |cause: String| {
        Err(DiffusionError::weights(format!("weights of another model: {cause}"), path, WHERE))
    };
    let extra: Vec<&String> = found.keys().filter(|name| !wanted.contains_key(*name)).collect();
    if extra.iter().any(|name| name.starts_with("model.diffusion_model.")) {
        let cause = "a checkpoint in one file, in the layout before diffusers";
        let help = "take the folder of the model with unet/, vae/ and text_encoder/, or convert it with the script of diffusers";
        return Err(DiffusionError::weights(cause, path, help));
    }
    let missing: Vec<&String> = wanted.keys().filter(|name| !found.contains_key(*name)).collect();
    let listed = |names: &[&String]| match names.len() {
        0 | 1 => names.first().map(ToString::to_string).unwrap_or_default(),
        count => format!("{} and {} more", names[0], count - 1),
    };
    if !missing.is_empty() {
        return error(format!("{} of {of} missing", listed(&missing)));
    }
    if !extra.is_empty() {
        return error(format!("{} not of {of}", listed(&extra)));
    }
    let odd = wanted.iter().find(|(name, shape)| found[*name] != **shape);
    if let Some((name, shape)) = odd {
        let (a, b) = (sizes(&found[name]), sizes(shape));
        return error(format!("{name} is {a}, {of} has {b}"));
    }
    Ok(())
}

fn sizes(shape: &[usize]) -> String {
    shape.iter().map(ToString::to_string).collect::<Vec<_>>().join("x")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_differs_is_named() {
        let wanted: Shapes = [("a".into(), vec![2, 3]), ("b".into(), vec![1])].into();
        let say = |found: &[(&str, &[usize])]| {
            let found = found.iter().map(|(n, s)| ((*n).to_owned(), s.to_vec())).collect();
            compare(&found, &wanted, Path::new("w"), "the UNet").map_err(|e| e.to_string())
        };
        assert!(say(&[("a", &[2, 3]), ("b", &[1])]).is_ok());
        assert!(say(&[]).unwrap_err().contains("a and 1 more of the UNet missing: w"));
        let extra = say(&[("a", &[2, 3]), ("b", &[1]), ("c", &[1])]);
        assert!(extra.unwrap_err().contains("c not of the UNet"));
        let other = say(&[("a", &[3, 2]), ("b", &[1])]);
        assert!(other.unwrap_err().contains("a is 3x2, the UNet has 2x3"));
        let single = say(&[("model.diffusion_model.x", &[1])]);
        assert!(single.unwrap_err().contains("in one file"));
    }
}
