//! The interpreter: sentences to operations, by a grammar written by hand, against a scene card.
//!
//! ```text
//! instruction = clause { ("," | "." | "and" | "then") clause }
//! clause      = [verb] objects change { modifier } | stuff objects | light
//! objects     = [article] { color | "largest" | ... } name [place] | "it" | "everything"
//! modifier    = "with" stuff objects | "under" light { "," light }
//! ```
//!
//! A clause without a verb takes that of the clause before it. Whatever is left over is an error that quotes it.

mod amount;
mod clauses;
mod cursor;
mod direction;
mod draft;
mod error;
mod lexicon;
mod light;
mod looks;
mod motion;
mod nouns;
mod reader;
mod reference;
mod size;
mod things;
mod tokens;
mod turn;

use edit::ops::OpDocument;
use edit::plan::EditPlanDocument;
use edit::run::ShadowMode;
use motes_formats::scene_card::{NamedLightDocument, SceneCardDocument};

pub use error::Misread;
pub use tokens::MAX_LETTERS;

/// What an instruction means.
#[derive(Clone, Debug, PartialEq)]
pub struct Interpretation {
    /// One plan; more where the instruction names several lights as alternatives. Files are named as the card names them.
    pub plans: Vec<NamedPlan>,
    /// What was not said and had to be assumed, in sentences.
    pub notes: Vec<String>,
}

/// A plan of an instruction.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedPlan {
    /// The light that it is for, where there are several.
    pub name: Option<String>,
    /// The plan.
    pub plan: EditPlanDocument,
}

/// Reads an instruction about the scene of `card`.
///
/// # Errors
/// It is empty or too long, a part of it is not understood, an object is not there or not the only one, or two parts contradict each
/// other.
pub fn interpret(card: &SceneCardDocument, instruction: &str) -> Result<Interpretation, Misread> {
    let tokens = tokens::tokens(instruction)?;
    let draft = reader::Reader::new(card, instruction, &tokens).read()?;
    let plan = |ops: Vec<OpDocument>| {
        let mut plan = EditPlanDocument::new(0, ops);
        if draft.shadows && !card.decomposed {
            plan.shadow = ShadowMode::Ratio;
        }
        plan
    };
    let lit = |name: Option<&str>, op| {
        let mut ops = draft.ops.clone();
        ops.push(OpDocument::SetEnvironment(op));
        NamedPlan { name: name.map(|name| name.replace(' ', "-")), plan: plan(ops) }
    };
    let plans = match draft.lights.as_slice() {
        [] => vec![NamedPlan { name: None, plan: plan(draft.ops.clone()) }],
        [light] => vec![lit(None, light.op.clone())],
        lights => lights.iter().map(|l| lit(Some(&l.name), l.op.clone())).collect(),
    };
    Ok(Interpretation { plans, notes: draft.notes.clone() })
}

/// The lights that have names, for the card.
pub fn named_lights() -> Vec<NamedLightDocument> {
    let light = |(name, sun): &(&str, &str)| NamedLightDocument {
        name: (*name).to_owned(),
        sun: (*sun).to_owned(),
    };
    lexicon::LIGHTS.iter().map(light).collect()
}

/// The name of a color, linear Rec. 709: the nearest of the basic color terms in CIE L*a*b*.
pub fn color_name(rgb_linear: [f64; 3]) -> &'static str {
    let lab = |rgb: [f64; 3]| segment_select::lab_from_srgb(rgb.map(|v| v as f32));
    let encoded = rgb_linear.map(|v| motes_math::srgb::encode_f64(v.clamp(0.0, 1.0)));
    let [l, a, b] = lab(encoded);
    let chroma = a.hypot(b);
    // Weak colors are white, gray or black, whatever their hue.
    if chroma < 9.0 {
        return match l {
            l if l < 22.0 => "black",
            l if l < 78.0 => "gray",
            _ => "white",
        };
    }
    let distance = |(_, rgb): &&(&str, [u8; 3])| {
        let [l2, a2, b2] = lab(rgb.map(|v| f64::from(v) / 255.0));
        // Hue decides before lightness: a shaded lemon is yellow.
        let hue = (b.atan2(a) - b2.atan2(a2)).abs();
        let hue = hue.min(std::f32::consts::TAU - hue);
        40.0 * hue + 0.35 * (l - l2).abs() + 0.35 * (chroma - a2.hypot(b2)).abs()
    };
    let colorful = lexicon::COLORS[..lexicon::BASIC]
        .iter()
        .filter(|(name, _)| !matches!(*name, "black" | "gray" | "white"));
    colorful.min_by(|x, y| distance(x).total_cmp(&distance(y))).map_or("gray", |(name, _)| name)
}
