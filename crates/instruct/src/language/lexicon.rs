//! Words for colors, materials and lights.

use edit::changes::materials::{LibraryMaterial, material_named};

use super::cursor::Cursor;

/// A color by name, sRGB 8 bits: the basic color terms of English (Berlin & Kay 1969) and a few of the CSS names.
pub(crate) const COLORS: &[(&str, [u8; 3])] = &[
    ("red", [200, 30, 30]),
    ("orange", [235, 125, 25]),
    ("yellow", [240, 205, 40]),
    ("green", [45, 140, 60]),
    ("blue", [40, 80, 190]),
    ("purple", [115, 55, 150]),
    ("pink", [235, 140, 175]),
    ("brown", [110, 70, 40]),
    ("black", [12, 12, 12]),
    ("gray", [128, 128, 128]),
    ("white", [235, 235, 235]),
    ("beige", [225, 210, 180]),
    ("turquoise", [60, 190, 185]),
    ("teal", [20, 125, 125]),
    ("navy", [20, 30, 85]),
    ("cream", [245, 235, 205]),
    ("violet", [130, 70, 180]),
    ("magenta", [200, 40, 140]),
    ("cyan", [50, 190, 215]),
    ("maroon", [110, 20, 35]),
    ("olive", [115, 115, 40]),
];

/// Names that a mean color may get.
pub(crate) const BASIC: usize = 11;

/// Other spellings.
const COLOR_ALIASES: &[(&str, &str)] = &[
    ("grey", "gray"),
    ("crimson", "red"),
    ("scarlet", "red"),
    ("lilac", "violet"),
    ("tan", "beige"),
];

/// Linear Rec. 709 of a color's name.
pub(crate) fn color_named(word: &str) -> Option<(&'static str, [f64; 3])> {
    let alias = COLOR_ALIASES.iter().find(|(alias, _)| *alias == word);
    let word = alias.map_or(word, |(_, name)| name);
    let (name, rgb) = COLORS.iter().find(|(name, _)| *name == word)?;
    Some((name, rgb.map(|v| motes_math::srgb::decode_f64(f64::from(v) / 255.0))))
}

/// What a material phrase says: "matte black", "polished marble", "red plastic".
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Stuff {
    /// A material of the library.
    pub(crate) name: Option<&'static str>,
    /// Linear Rec. 709, with its name.
    pub(crate) color: Option<(String, [f64; 3])>,
    pub(crate) roughness: Option<f64>,
    pub(crate) metallic: Option<f64>,
}

impl Stuff {
    /// A color and nothing else: what a plain splat can have, too.
    pub(crate) fn is_color_alone(&self) -> bool {
        self.name.is_none() && self.roughness.is_none() && self.metallic.is_none()
    }
}

/// Finishes: word, roughness, metallic.
const FINISHES: &[(&str, Option<f64>, Option<f64>)] = &[
    ("matte", Some(0.9), None),
    ("matt", Some(0.9), None),
    ("flat", Some(0.9), None),
    ("rough", Some(0.9), None),
    ("dull", Some(0.8), None),
    ("satin", Some(0.45), None),
    ("brushed", Some(0.4), None),
    ("smooth", Some(0.25), None),
    ("glossy", Some(0.15), None),
    ("shiny", Some(0.15), None),
    ("polished", Some(0.1), None),
    ("metallic", Some(0.3), Some(1.0)),
];

/// Words for materials of the library that are not their names.
const SUBSTANCES: &[(&str, &str)] = &[
    ("golden", "gold"),
    ("steel", "iron"),
    ("stainless steel", "iron"),
    ("wood", "oak"),
    ("wooden", "oak"),
    ("oak wood", "oak"),
    ("walnut wood", "walnut"),
    ("pine wood", "pine"),
    ("clay", "terracotta"),
    ("cement", "concrete"),
    ("stone", "concrete"),
    ("mirror", "chrome"),
    ("a mirror", "chrome"),
    ("coal", "charcoal"),
];

/// Known substances that no material of the library stands for, and why.
pub(crate) const BEYOND: &[(&str, &str)] = &[
    ("glass", "light does not go through the materials of motes"),
    ("water", "light does not go through the materials of motes"),
    ("crystal", "light does not go through the materials of motes"),
    ("ice", "light does not go through the materials of motes"),
    ("neon", "the materials of motes do not shine by themselves"),
    ("fur", "the materials of motes have no hair"),
];

/// Lightness of a color.
const SHADES: &[(&str, f64)] =
    &[("dark", 0.35), ("deep", 0.5), ("light", 1.9), ("pale", 2.2), ("bright", 1.4)];

/// A material phrase; none, and the cursor where it was, when none comes next.
pub(crate) fn stuff(cursor: &mut Cursor<'_>) -> Option<Stuff> {
    let start = cursor.at;
    let mut found = Stuff::default();
    let mut shade = None;
    let mut any = false;
    loop {
        let before = cursor.at;
        if found.name.is_none()
            && let Some(material) = substance(cursor)
        {
            found.name = Some(material.name);
        } else if cursor.eat("metal") {
            found.metallic = Some(1.0);
            found.roughness = found.roughness.or(Some(0.3));
        } else if found.color.is_some() && cursor.eat("plastic") {
            found.metallic = Some(0.0);
            found.roughness = found.roughness.or(Some(0.3));
        } else if let Some((_, factor)) =
            SHADES.iter().find(|(word, _)| cursor.sees(word) && shade.is_none())
        {
            cursor.step();
            shade = Some(*factor);
        } else if let Some((_, roughness, metallic)) =
            FINISHES.iter().find(|(word, ..)| cursor.eat(word))
        {
            found.roughness = *roughness;
            found.metallic = metallic.or(found.metallic);
        } else if let Some((name, rgb)) =
            cursor.word().and_then(color_named).filter(|_| found.color.is_none())
        {
            cursor.step();
            // "navy blue", "forest green": the narrower name says it.
            if COLORS[BASIC..].iter().any(|(narrow, _)| *narrow == name)
                && cursor.word().is_some_and(|word| COLORS[..BASIC].iter().any(|c| c.0 == word))
            {
                cursor.step();
            }
            found.color = Some((name.to_owned(), rgb));
        } else {
            cursor.at = before;
            break;
        }
        any = true;
        // "matte and black" is one phrase, "black and move" is not.
        let between = cursor.at;
        if cursor.eat_mark(',') | cursor.eat("and") && !starts_stuff(cursor) {
            cursor.at = between;
        }
    }
    if let Some(factor) = shade {
        let Some((name, rgb)) = &mut found.color else {
            cursor.at = start;
            return None;
        };
        *name = format!("{} {name}", if factor < 1.0 { "dark" } else { "light" });
        *rgb = rgb.map(|v| (v * factor).clamp(0.0, 0.9));
    }
    if !any {
        cursor.at = start;
        return None;
    }
    Some(known_combination(found))
}

fn starts_stuff(cursor: &Cursor<'_>) -> bool {
    let mut ahead = cursor.clone();
    let Some(word) = cursor.word() else { return false };
    let is_finish = FINISHES.iter().any(|(finish, ..)| *finish == word);
    (is_finish || color_named(word).is_some() || substance(&mut ahead).is_some())
        // The next word begins an object of its own: "black and red balls".
        && ahead_is_end(cursor)
}

/// Whether behind the next word nothing follows that could be an object.
fn ahead_is_end(cursor: &Cursor<'_>) -> bool {
    cursor.word_at(1).is_none_or(|word| matches!(word, "and" | "then" | "under" | "at" | "with"))
}

/// Two words that the library has one name for.
fn known_combination(mut found: Stuff) -> Stuff {
    let color = found.color.as_ref().map(|(name, _)| name.as_str());
    let library = match (color, found.roughness, found.metallic, found.name) {
        (Some("black"), Some(0.9), None, None) => "matte_black",
        (Some("white"), Some(0.9), None, None) => "matte_white",
        (Some("black"), Some(0.3), Some(0.0), None) => "plastic_black",
        (Some("white"), Some(0.3), Some(0.0), None) => "plastic_white",
        _ => return found,
    };
    found = Stuff { name: material_named(library).map(|m| m.name), ..Stuff::default() };
    found
}

/// A material of the library by its name or another word.
fn substance(cursor: &mut Cursor<'_>) -> Option<&'static LibraryMaterial> {
    let other = SUBSTANCES.iter().filter(|(words, _)| cursor.sees(words));
    if let Some((words, name)) = other.max_by_key(|(words, _)| words.len()) {
        cursor.eat(words);
        return material_named(name);
    }
    let word = cursor.word().filter(|word| !word.contains('_'))?;
    let material = material_named(word)?;
    cursor.step();
    Some(material)
}

/// Lights: what people call them, the value of `sun`, the name that files get.
pub(crate) const LIGHTS: &[(&str, &str)] = &[
    ("sunrise", "sunrise"),
    ("dawn", "sunrise"),
    ("daybreak", "sunrise"),
    ("early morning", "sunrise"),
    ("morning", "morning"),
    ("high noon", "noon"),
    ("noon", "noon"),
    ("midday", "noon"),
    ("mid day", "noon"),
    ("afternoon", "afternoon"),
    ("golden hour", "golden-hour"),
    ("evening", "golden-hour"),
    ("sunset", "sunset"),
    ("sundown", "sunset"),
    ("dusk", "sunset"),
    ("overcast", "overcast"),
    ("cloudy", "overcast"),
    ("studio", "studio"),
];

/// Lights that people ask for and no model here has, and why.
pub(crate) const NO_LIGHTS: &[(&str, &str)] = &[
    ("night", "the sky model has no night"),
    ("moonlight", "the sky model has no moon"),
    ("midnight", "the sky model has no night"),
    ("candlelight", "lamps inside the scene are not modeled"),
];
