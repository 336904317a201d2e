//! A small library of materials by name.
//!
//! From the CC0 table physicallybased.info (data of 2026, <https://github.com/AntonPalmqvist/physically-based-api>), compared value by
//! value:
//!
//! - metals: reflectance at normal incidence by its complex refractive indices at one wavelength per channel, which come from
//!   refractiveindex.info; chrome is its chromium;
//! - brick, charcoal, concrete, marble, sand: its colors; paper is its office paper, rubber its tire; terracotta its measurement
//!   with a spectrophotometer (L*a*b* 59.66, 23.57, 28.85).
//!
//! Not from a table: black and white are 3 and 80 percent; oak, walnut and pine are typical L*a*b* (D65) of planed wood, (70, 7, 22),
//! (45, 8, 16) and (80, 5, 27), which no single publication vouches for. Roughness is that of the usual finish, and the
//! key `roughness` changes it.

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
    metal("aluminum", [0.912, 0.914, 0.920], 0.25),
    metal("brass", [0.887, 0.789, 0.434], 0.2),
    matter("brick", [0.262, 0.095, 0.061], 0.9),
    matter("charcoal", [0.020, 0.020, 0.020], 0.95),
    metal("chrome", [0.638, 0.651, 0.663], 0.05),
    matter("concrete", [0.510, 0.510, 0.510], 0.9),
    metal("copper", [0.926, 0.721, 0.504], 0.2),
    metal("gold", [0.944, 0.776, 0.373], 0.15),
    metal("iron", [0.531, 0.512, 0.496], 0.4),
    matter("marble", [0.830, 0.791, 0.753], 0.25),
    matter("matte_black", [0.030, 0.030, 0.030], 0.9),
    matter("matte_white", [0.800, 0.800, 0.800], 0.9),
    metal("nickel", [0.649, 0.610, 0.541], 0.2),
    matter("oak", [0.565, 0.379, 0.229], 0.55),
    matter("paper", [0.794, 0.834, 0.884], 0.95),
    matter("pine", [0.758, 0.537, 0.298], 0.55),
    matter("plastic_black", [0.030, 0.030, 0.030], 0.3),
    matter("plastic_white", [0.800, 0.800, 0.800], 0.3),
    matter("rubber", [0.023, 0.023, 0.023], 0.85),
    matter("sand", [0.440, 0.386, 0.231], 0.95),
    metal("silver", [0.962, 0.949, 0.922], 0.15),
    matter("terracotta", [0.555, 0.212, 0.110], 0.85),
    metal("titanium", [0.616, 0.582, 0.544], 0.3),
    matter("walnut", [0.218, 0.130, 0.081], 0.5),
];

/// Other names of materials.
const ALIASES: &[(&str, &str)] = &[("aluminium", "aluminum")];

/// The material of a name; `-` and spaces stand for `_`, British spelling is understood.
pub fn material_named(name: &str) -> Option<&'static LibraryMaterial> {
    let name = name.trim().to_ascii_lowercase().replace(['-', ' '], "_");
    let alias = ALIASES.iter().find(|(alias, _)| *alias == name);
    let name = alias.map_or(name.as_str(), |(_, name)| name);
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
    fn woods_are_their_lab_colors() {
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
    fn metals_reflect_what_their_optical_constants_say() {
        // n and k at the wavelengths of red, green and blue, of the same table.
        #[rustfmt::skip]
        let constants = [
            ("aluminum", [[1.3456, 7.4746], [0.965_21, 6.3995], [0.617_22, 5.3031]]),
            ("brass", [[0.444, 3.695], [0.527, 2.765], [1.094, 1.829]]),
            ("chrome", [[3.4256, 4.273], [2.7891, 4.1976], [2.0246, 3.8586]]),
            ("copper", [[0.271_05, 3.6092], [0.676_93, 2.6248], [1.3164, 2.2921]]),
            ("gold", [[0.182_99, 3.4242], [0.421_08, 2.3459], [1.3734, 1.7704]]),
            ("iron", [[2.9114, 3.0893], [2.9497, 2.9318], [2.5845, 2.767]]),
            ("nickel", [[2.0592, 3.7574], [1.8179, 3.2741], [1.621, 2.6933]]),
            ("silver", [[0.159_43, 3.9291], [0.145_12, 3.19], [0.135_47, 2.3808]]),
            ("titanium", [[2.7407, 3.8143], [2.5418, 3.4345], [2.267, 3.0385]]),
        ];
        for (name, channels) in constants {
            let listed = material_named(name).unwrap().base_color_linear;
            for ([n, k], listed) in channels.into_iter().zip(listed) {
                let reflectance: f32 =
                    ((n - 1.0f32).powi(2) + k * k) / ((n + 1.0f32).powi(2) + k * k);
                assert!((reflectance - listed).abs() < 1e-3, "{name}: {reflectance} {listed}");
            }
        }
    }

    #[test]
    fn names_are_sorted_forgiving_and_in_range() {
        assert!(MATERIALS.windows(2).all(|w| w[0].name < w[1].name));
        assert_eq!(material_named("Matte Black"), material_named("matte_black"));
        assert_eq!(material_named("Aluminium").unwrap().name, "aluminum");
        assert!(material_named("matte-black").is_some() && material_named("mithril").is_none());
        for m in MATERIALS {
            assert!(m.base_color_linear.iter().all(|v| (0.0..=1.0).contains(v)), "{}", m.name);
        }
    }
}
