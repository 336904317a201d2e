//! Prompts as flags.

use clap::Args;
use motes_formats::selectors::{
    BoxPrompt, Candidate, MaskPrompt, ObjectPrompt, Scribble, SelectStep, Selector, SelectorStep,
    parse_candidate, parse_click, parse_step,
};
use motes_scene::Combine;
use motes_stage::StageError;
use serde::Serialize;

/// What to select. Clicks, boxes and scribbles together point at one object; --select steps follow in
/// their order.
#[derive(Args, Clone, Debug, Serialize)]
#[command(next_help_heading = "Prompts")]
pub struct PromptFlags {
    /// Click on a pixel of a view on the object, or, with ",-", off it; repeatable
    #[arg(long, value_name = "VIEW,X,Y[,-]", value_parser = |text: &str| {
        parse_click(text).map(|_| text.to_owned())
    })]
    pub click: Vec<String>,

    /// Rectangle around the object in a view; repeatable
    #[arg(long = "box", value_name = "VIEW,X0,Y0,X1,Y1", value_parser = |text: &str| {
        parse_box(text).map(|_| text.to_owned())
    })]
    pub boxes: Vec<String>,

    /// Stroke over the object in a view, or, with ",-", off it; repeatable
    #[arg(long, value_name = "VIEW,X,Y,X,Y,..[,-]", value_parser = |text: &str| {
        parse_scribble(text).map(|_| text.to_owned())
    })]
    pub scribble: Vec<String>,

    /// Mask image of a view: white on the object, gray where uncertain; repeatable
    #[arg(long, value_name = "VIEW=FILE", value_parser = |text: &str| {
        parse_mask(text).map(|_| text.to_owned())
    })]
    pub mask: Vec<String>,

    /// Selection step: [set:|add:|subtract:|intersect:]KIND=VALUES, or invert, grow=D, shrink=D; repeatable.
    /// KIND is sphere, box, oriented-box, half-space, ground, color, eyedropper, connected, property,
    /// ids, label, file, rectangle, polygon, brush, click, mask or all
    #[arg(long, value_name = "STEP", value_parser = |text: &str| {
        parse_step(text).map(|_| text.to_owned())
    })]
    pub select: Vec<String>,

    /// Which of the nested candidates to select: whole, part or subpart
    #[arg(long, value_name = "NAME", default_value = "whole", value_parser = |text: &str| {
        parse_candidate(text).map(|_| text.to_owned())
    })]
    pub candidate: String,

    /// Number of candidates to write: 2 adds the part, 3 the subpart, beside the output and with
    /// scores
    #[arg(long, value_name = "COUNT", default_value_t = 1, value_parser = clap::value_parser!(u8).range(1..=3))]
    pub candidates: u8,
}

fn parse_scribble(text: &str) -> Result<Scribble, String> {
    let expected = || "expected VIEW,X,Y,X,Y,.. and ,- at the end beside the object".to_owned();
    let (text, positive) = match text.strip_suffix(",-") {
        Some(rest) => (rest, false),
        None => (text, true),
    };
    let (view, rest) = text.split_once(',').ok_or_else(expected)?;
    let numbers: Option<Vec<f64>> =
        rest.split(',').map(|v| v.trim().parse().ok().filter(|v: &f64| v.is_finite())).collect();
    let numbers = numbers.filter(|n| n.len() >= 2 && n.len() % 2 == 0).ok_or_else(expected)?;
    let points = numbers.chunks_exact(2).map(|p| [p[0], p[1]]).collect();
    Ok(Scribble { view: view.into(), points, positive })
}

fn parse_box(text: &str) -> Result<BoxPrompt, String> {
    let expected = || "expected VIEW,X0,Y0,X1,Y1".to_owned();
    let mut parts = text.rsplitn(5, ',');
    let mut pixels = [0.0; 4];
    for slot in pixels.iter_mut().rev() {
        let value = parts.next().and_then(|v| v.trim().parse().ok());
        *slot = value.filter(|v: &f64| v.is_finite()).ok_or_else(expected)?;
    }
    let view = parts.next().filter(|v| !v.is_empty()).ok_or_else(expected)?;
    Ok(BoxPrompt { view: view.into(), pixels })
}

fn parse_mask(text: &str) -> Result<MaskPrompt, String> {
    match text.split_once('=') {
        Some((view, path)) if !view.is_empty() && !path.is_empty() => {
            Ok(MaskPrompt { view: view.into(), path: path.into() })
        }
        _ => Err("expected VIEW=FILE".into()),
    }
}

impl PromptFlags {
    /// The prompt that clicks, boxes and scribbles make, when there are any.
    pub fn object(&self) -> Option<ObjectPrompt> {
        let prompt = ObjectPrompt {
            clicks: self.click.iter().filter_map(|t| parse_click(t).ok()).collect(),
            boxes: self.boxes.iter().filter_map(|t| parse_box(t).ok()).collect(),
            scribbles: self.scribble.iter().filter_map(|t| parse_scribble(t).ok()).collect(),
            candidate: parse_candidate(&self.candidate).unwrap_or(Candidate::Whole),
        };
        (prompt != ObjectPrompt { candidate: prompt.candidate, ..Default::default() })
            .then_some(prompt)
    }

    /// All flags as steps.
    ///
    /// # Errors
    /// When nothing was asked for, or several answers without a prompt that has any.
    pub fn steps(&self) -> Result<Vec<SelectStep>, StageError> {
        let mut steps = Vec::new();
        let step = |combine, selector| SelectStep::Select(SelectorStep { combine, selector });
        if let Some(prompt) = self.object() {
            steps.push(step(Combine::Set, Selector::Object(prompt)));
        }
        if !self.mask.is_empty() {
            let masks = self.mask.iter().filter_map(|t| parse_mask(t).ok()).collect();
            steps.push(step(Combine::Add, Selector::Masks { masks }));
        }
        steps.extend(self.select.iter().filter_map(|t| parse_step(t).ok()));
        if steps.is_empty() {
            return Err(StageError::usage("nothing was asked for")
                .help("give --click, --box, --scribble, --mask or --select"));
        }
        if self.candidates > 1 && (steps.len() > 1 || self.object().is_none()) {
            return Err(StageError::usage(
                "--candidates answers clicks, boxes and scribbles alone, without --mask and --select",
            ));
        }
        Ok(steps)
    }

    /// Whether views must be prepared.
    pub fn needs_views(&self) -> bool {
        let mut steps = self.select.iter().filter_map(|t| parse_step(t).ok());
        let needs = |step: SelectStep| match step {
            SelectStep::Select(SelectorStep { selector, .. }) => matches!(
                selector,
                Selector::Object(_)
                    | Selector::Masks { .. }
                    | Selector::Eyedropper { .. }
                    | Selector::GroundPlane { .. }
            ),
            SelectStep::Post(_) => false,
        };
        self.object().is_some() || !self.mask.is_empty() || steps.any(needs)
    }
}
