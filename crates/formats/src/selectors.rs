//! How Gaussians are chosen: the steps that `segment-select` takes and that edit plans contain.
//!
//! A step either combines what a [`Selector`] finds with the selection so far, or changes the selection
//! as it is. Positions are world coordinates of the capture; pixels are those of a view, with the center
//! of the first pixel at (0.5, 0.5).

mod parse;
mod post;

use motes_scene::Combine;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use parse::{parse_candidate, parse_click, parse_step};
pub use post::PostDocument;

/// One step of a selection.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum SelectStep {
    /// Combines what a selector finds.
    Select(SelectorStep),
    /// Changes the selection as it is.
    Post(PostDocument),
}

/// A selector and how it is combined.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SelectorStep {
    /// How the selection so far changes.
    #[serde(default)]
    pub combine: Combine,
    /// What is looked for.
    #[serde(flatten)]
    pub selector: Selector,
}

/// What is looked for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "by", rename_all = "kebab-case")]
pub enum Selector {
    /// The object that clicks, boxes and scribbles point at.
    Object(ObjectPrompt),
    /// What masks of views show, lifted by a vote of their pixels.
    Masks {
        /// At least one.
        masks: Vec<MaskPrompt>,
    },
    /// What is drawn inside a rectangle of a view, at any depth.
    Rectangle {
        /// Name of the view, with or without its suffix.
        view: String,
        /// `x0, y0, x1, y1`, pixels.
        pixels: [f64; 4],
    },
    /// What is drawn inside a polygon of a view, at any depth.
    Polygon {
        /// Name of the view.
        view: String,
        /// Corners, pixels.
        points: Vec<[f64; 2]>,
    },
    /// What is seen under the strokes of a brush in a view: the front surface.
    Brush {
        /// Name of the view.
        view: String,
        /// Corners of the stroke, pixels.
        points: Vec<[f64; 2]>,
        /// Pixels.
        radius: f64,
    },
    /// Centers in a sphere.
    Sphere {
        /// World.
        center: [f64; 3],
        /// World units.
        radius: f64,
    },
    /// Centers in a box, which may be turned.
    Box {
        /// Middle, world.
        center: [f64; 3],
        /// Half the lengths of its sides, along its own axes.
        half_size: [f64; 3],
        /// `w, x, y, z`: from the axes of the box to those of the world.
        #[serde(default = "no_rotation")]
        rotation: [f64; 4],
    },
    /// Centers on the side of a plane that its normal points to.
    HalfSpace {
        /// Of any length above 0.
        normal: [f64; 3],
        /// A point on the plane, world.
        point: [f64; 3],
    },
    /// The plane that most of the scene stands on, as it is found.
    GroundPlane {
        /// Which side of it.
        #[serde(default)]
        side: PlaneSide,
        /// Thickness, world units; as noisy as the plane is when it is not given.
        #[serde(default)]
        thickness: Option<f64>,
    },
    /// Base colors (degree 0 of the spherical harmonics) near a color.
    Color {
        /// sRGB-encoded, 0 to 1.
        rgb: [f64; 3],
        /// Largest difference in CIE L*a*b*; 2.3 is just noticeable.
        tolerance: f64,
    },
    /// Base colors near the photo's or the rendering's color at a pixel.
    Eyedropper {
        /// Name of the view.
        view: String,
        /// Pixel.
        pixel: [f64; 2],
        /// Largest difference in CIE L*a*b*.
        tolerance: f64,
    },
    /// All that is connected to a seed: neighbors closer than a distance.
    Connected {
        /// World.
        seed: [f64; 3],
        /// Largest distance between neighbors, world units; 3 times the usual one when not given.
        #[serde(default)]
        distance: Option<f64>,
        /// Largest difference of base color between neighbors, CIE L*a*b*; none when not given.
        #[serde(default)]
        tolerance: Option<f64>,
    },
    /// Values of a property: a column of the file, or `x y z`, `scale`, `scale_min`, `scale_max`,
    /// `opacity`, `red green blue`, `visibility_count`. With `_raw` at its end, values as they are stored.
    Property {
        /// Name.
        name: String,
        /// How it compares.
        compare: Comparison,
        /// With what.
        value: f64,
    },
    /// Rows of the file.
    Ids {
        /// From 0.
        ids: Vec<u32>,
    },
    /// A selection that was written.
    File {
        /// `selection.json` of the same Gaussians.
        path: String,
    },
    /// A value of a column of labels.
    Label {
        /// Name of the column.
        #[serde(default = "object_id")]
        column: String,
        /// Label.
        value: i64,
    },
    /// All of them.
    All,
}

fn no_rotation() -> [f64; 4] {
    [1.0, 0.0, 0.0, 0.0]
}

fn object_id() -> String {
    "object_id".into()
}

/// What points at an object.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct ObjectPrompt {
    /// Points on it and beside it.
    pub clicks: Vec<Click>,
    /// Rectangles around it.
    pub boxes: Vec<BoxPrompt>,
    /// Strokes on it and beside it.
    pub scribbles: Vec<Scribble>,
    /// Which of the nested answers.
    pub candidate: Candidate,
}

/// A point on or beside an object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Click {
    /// Name of the view, with or without its suffix.
    pub view: String,
    /// Pixels.
    pub pixel: [f64; 2],
    /// On it, or not on it.
    #[serde(default = "yes")]
    pub positive: bool,
}

/// A rectangle around an object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BoxPrompt {
    /// Name of the view.
    pub view: String,
    /// `x0, y0, x1, y1`, pixels.
    pub pixels: [f64; 4],
}

/// A stroke on or beside an object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Scribble {
    /// Name of the view.
    pub view: String,
    /// Corners, pixels.
    pub points: Vec<[f64; 2]>,
    /// On it, or not on it.
    #[serde(default = "yes")]
    pub positive: bool,
}

fn yes() -> bool {
    true
}

/// A mask of a view.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MaskPrompt {
    /// Name of the view.
    pub view: String,
    /// Image: white belongs, black does not, gray is undecided in proportion.
    pub path: String,
}

/// Which of the nested answers to a prompt.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Candidate {
    /// The whole object.
    #[default]
    Whole,
    /// A part of it.
    Part,
    /// A part of the part.
    Subpart,
}

/// A side of a plane.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum PlaneSide {
    /// The plane itself.
    #[default]
    On,
    /// Above it.
    Above,
    /// Below it.
    Below,
}

/// How a value compares.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[expect(missing_docs, reason = "the usual abbreviations")]
pub enum Comparison {
    Lt,
    Lte,
    Gt,
    Gte,
    Eq,
    Neq,
}

impl Comparison {
    /// Whether `a` compares so with `b`; NaN compares as nothing, not even as unequal.
    pub fn holds(self, a: f64, b: f64) -> bool {
        match self {
            Self::Lt => a < b,
            Self::Lte => a <= b,
            Self::Gt => a > b,
            Self::Gte => a >= b,
            Self::Eq => a == b,
            Self::Neq => !a.is_nan() && !b.is_nan() && a != b,
        }
    }
}
