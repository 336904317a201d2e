//! A small library of materials by name.
//!
//! Metals: reflectance at normal incidence as linear Rec. 709, from optical constants (Johnson and Christy 1972, Palik 1985) over the
//! visible spectrum as tabulated by Lagarde ("Memo on Fresnel equations", 2013) and by Hoffman ("Physics and math of shading",
//! SIGGRAPH 2013); brass from the CC0 table physicallybased.info. Dielectrics: diffuse reflectance as tabulated in the CC0 table
//! physicallybased.info, but for oak, walnut and pine, which are CIE L*a*b* (D65) of planed wood, the middle of what
//! colour studies of these woods report: oak (70, 7, 22), walnut (45, 8, 16), pine (80, 5, 27). Roughness is not part of
//! those tables: it is that of the usual finish, and the key `roughness` changes it.

/// A material of the library.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LibraryMaterial {
    /// Its name in plans.
    pub name: &'static str,
    /// Linear Rec. 709.
    pub base_color_linear: [f32; 3],
    /// Perceptual.
    pub roughness: f32,
    /// 0 or 1.
    pub metallic: f32,
}

const fn metal(name: &'static str, base_color_linear: [f32; 3], roughness: f32) -> LibraryMaterial {
    LibraryMaterial { name, base_color_linear, roughness, metallic: 1.0 }
}

const fn matter(
    name: &'static str,
    base_color_linear: [f32; 3],
    roughness: f32,
) -> LibraryMaterial {
    LibraryMaterial { name, base_color_linear, roughness, metallic: 0.0 }
}

/// All materials, by name.
pub const MATERIALS: &[LibraryMaterial] = &[
    metal("aluminium", [0.913, 0.922, 0.924], 0.25),
    metal("brass", [0.910, 0.778, 0.423], 0.2),
    matter("brick", [0.262, 0.095, 0.061], 0.9),
    matter("charcoal", [0.020, 0.020, 0.020], 0.95),
    metal("chrome", [0.550, 0.556, 0.554], 0.05),
    matter("concrete", [0.510, 0.510, 0.510], 0.9),
    metal("copper", [0.955, 0.638, 0.538], 0.2),
    metal("gold", [1.000, 0.766, 0.336], 0.15),
    metal("iron", [0.562, 0.565, 0.578], 0.4),
    matter("marble", [0.830, 0.791, 0.753], 0.25),
    matter("matte_black", [0.030, 0.030, 0.030], 0.9),
    matter("matte_white", [0.800, 0.800, 0.800], 0.9),
    metal("nickel", [0.660, 0.609, 0.526], 0.2),
    matter("oak", [0.565, 0.379, 0.229], 0.55),
    matter("paper", [0.794, 0.834, 0.884], 0.95),
    matter("pine", [0.758, 0.537, 0.298], 0.55),
    matter("plastic_black", [0.030, 0.030, 0.030], 0.3),
    matter("plastic_white", [0.800, 0.800, 0.800], 0.3),
    matter("rubber", [0.023, 0.023, 0.023], 0.85),
    matter("sand", [0.440, 0.386, 0.231], 0.95),
    metal("silver", [0.972, 0.960, 0.915], 0.15),
    matter("terracotta", [0.555, 0.212, 0.110], 0.85),
    metal("titanium", [0.542, 0.497, 0.449], 0.3),
    matter("walnut", [0.218, 0.130, 0.081], 0.5),
];

/// The material of a name; `-` and spaces stand for `_`.
pub fn material_named(name: &str) -> Option<&'static LibraryMaterial> {
    let name = name.trim().to_ascii_lowercase().replace(['-', ' '], "_");
    MATERIALS.iter().find(|material| material.name == name)
}

/// The names, for messages.
pub fn material_names() -> String {
    MATERIALS.iter().map(|m| m.name).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// CIE L*a*b* (D65) to linear Rec. 709 (IEC 61966-2-1).
    fn linear_of_lab([l, a, b]: [f64; 3]) -> [f64; 3] {
        let fy = (l + 16.0) / 116.0;
        let cube = |f: f64| if f > 6.0 / 29.0 { f.powi(3) } else { 0.128_418_5 * (f - 4.0 / 29.0) };
        let x = 0.950_47 * cube(fy + a / 500.0);
        let y = cube(fy);
        let z = 1.088_83 * cube(fy - b / 200.0);
        [
            3.240_454 * x - 1.537_139 * y - 0.498_531 * z,
            -0.969_266 * x + 1.876_011 * y + 0.041_556 * z,
            0.055_643 * x - 0.204_026 * y + 1.057_225 * z,
        ]
    }

    #[test]
    fn woods_are_their_lab_colours() {
        for (name, lab) in
            [("oak", [70.0, 7.0, 22.0]), ("walnut", [45.0, 8.0, 16.0]), ("pine", [80.0, 5.0, 27.0])]
        {
            let linear = linear_of_lab(lab);
            let listed = material_named(name).unwrap().base_color_linear;
            for (a, b) in linear.iter().zip(listed) {
                assert!((a - f64::from(b)).abs() < 2e-3, "{name}: {linear:?} {listed:?}");
            }
        }
    }

    #[test]
    fn names_are_sorted_forgiving_and_in_range() {
        assert!(MATERIALS.windows(2).all(|w| w[0].name < w[1].name));
        assert_eq!(material_named("Matte Black"), material_named("matte_black"));
        assert!(material_named("matte-black").is_some() && material_named("mithril").is_none());
        for m in MATERIALS {
            assert!(m.base_color_linear.iter().all(|v| (0.0..=1.0).contains(v)), "{}", m.name);
        }
    }
}
