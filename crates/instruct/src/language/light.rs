//! Lights: "as a sunset", "under sunrise, midday and evening", "a low sun from the left".

use edit::ops::SetEnvironmentOp;
use glam::DVec3;
use motes_scene::Convention;

use super::direction::Direction;
use super::draft::{NamedLight, rounded};
use super::error::{Misread, shown};
use super::lexicon::{LIGHTS, NO_LIGHTS};
use super::reader::Reader;

/// Words between a verb and its light.
const INTO: [&str; 12] = [
    "to look like",
    "look like",
    "as if at",
    "as",
    "at",
    "to",
    "into",
    "under",
    "in",
    "with",
    "like",
    "for",
];
/// Words behind the name of a light.
const BEHIND: [&str; 14] = [
    "lighting",
    "light",
    "lights",
    "sunlight",
    "sun",
    "sky",
    "skies",
    "scene",
    "conditions",
    "day",
    "weather",
    "hour",
    "time",
    "setup",
];

impl Reader<'_, '_> {
    /// "relight this scene as a sunset", "light it like noon".
    pub(crate) fn relight(&mut self) -> Result<(), Misread> {
        self.cursor.eat_any(&[
            "the whole scene",
            "the entire scene",
            "this scene",
            "the scene",
            "scene",
            "everything",
            "this",
            "it",
            "all",
            "the room",
            "the picture",
        ]);
        self.cursor.eat_any(&["so that it looks like", "to make it look like"]);
        let from = self.cursor.at;
        let into = self.cursor.eat_any(&INTO).is_some();
        if self.lights()? {
            return Ok(());
        }
        self.cursor.at = from;
        let rest = self.cursor.rest();
        let cause =
            if into { format!("{rest} names no light") } else { "no light is named".into() };
        Err(Misread::new(cause, known_lights()))
    }

    /// A light as a clause of its own: "sunset lighting, please".
    pub(crate) fn light_alone(&mut self) -> Result<bool, Misread> {
        let from = self.cursor.at;
        self.cursor.eat_any(&INTO);
        if self.lights()? {
            return Ok(true);
        }
        self.cursor.at = from;
        Ok(false)
    }

    /// A light behind a change: "... under a sunset".
    pub(crate) fn light_behind(&mut self) -> Result<bool, Misread> {
        let from = self.cursor.at;
        if self
            .cursor
            .eat_any(&["under", "at", "in", "with", "during", "seen at", "seen under"])
            .is_some()
            && self.lights()?
        {
            return Ok(true);
        }
        self.cursor.at = from;
        Ok(false)
    }

    /// A light, or several with commas and "and" between them, which are alternatives. False when none comes next.
    ///
    /// # Errors
    /// An earlier clause set another light, or the scene is not decomposed.
    pub(crate) fn lights(&mut self) -> Result<bool, Misread> {
        let from = self.cursor.at;
        let Some(first) = self.light()? else { return Ok(false) };
        let mut found = vec![first];
        loop {
            let before = self.cursor.at;
            let separated =
                self.cursor.eat_mark(',') | self.cursor.eat("and") | self.cursor.eat("or");
            // "at sunrise and at noon".
            self.cursor.eat_any(&["at", "in", "under"]);
            match self.light()?.filter(|_| separated) {
                Some(light) => found.push(light),
                None => {
                    self.cursor.at = before;
                    break;
                }
            }
        }
        let said = self.cursor.since(from);
        if !self.draft.card.decomposed {
            return Err(Misread::new(
                format!(
                    "{said} is another light, and the light of this scene is not known: it is a plain splat"
                ),
                "decompose it first, and give the scene folder with --scene",
            ));
        }
        if !self.draft.lights.is_empty() && self.draft.lights != found {
            let before: Vec<&str> = self.draft.lights.iter().map(|l| l.name.as_str()).collect();
            return Err(Misread::new(
                format!(
                    "{said} contradicts the light that was named before: {}",
                    before.join(", ")
                ),
                "name one light, or several with \"and\" between them for a plan each",
            ));
        }
        if let Some(k) =
            (1..found.len()).find(|&k| found[..k].iter().any(|l| l.name == found[k].name))
        {
            let cause = format!("{} is named twice", shown(&found[k].name));
            return Err(Misread::new(cause, "name each light once"));
        }
        self.draft.lights = found;
        Ok(true)
    }

    fn light(&mut self) -> Result<Option<NamedLight>, Misread> {
        let from = self.cursor.at;
        self.cursor.eat_any(&["a", "an", "the"]);
        if let Some((word, why)) = NO_LIGHTS.iter().find(|(word, _)| self.cursor.sees(word)) {
            return Err(no_light(word, why));
        }
        let known = LIGHTS.iter().filter(|(words, _)| self.cursor.sees(words));
        let Some((name, sun)) = known.max_by_key(|(words, _)| words.len()) else {
            self.cursor.at = from;
            return Ok(None);
        };
        self.cursor.eat(name);
        while self.cursor.eat_any(&BEHIND).is_some() {}
        let mut sun = (*sun).to_owned();
        let before = self.cursor.at;
        if self.cursor.eat_any(&["coming from", "from", "shining from"]).is_some() {
            self.cursor.eat("the");
            let side = self.cursor.eat_any(&["left", "right", "front", "behind", "back"]);
            match side {
                Some(_) if sun == "overcast" => {
                    let cause = "an overcast sky comes from no side";
                    return Err(Misread::new(
                        cause,
                        "leave out the side, or take a light with a sun",
                    ));
                }
                Some(side) => {
                    self.cursor.eat("side");
                    let direction = match side {
                        "left" => Direction::Left,
                        "right" => Direction::Right,
                        "front" => Direction::Front,
                        _ => Direction::Back,
                    };
                    sun +=
                        &format!(",azimuth={}", rounded(self.azimuth_deg(self.vector(direction))));
                }
                None => self.cursor.at = before,
            }
        }
        let op = SetEnvironmentOp {
            file: None,
            sun: Some(sun),
            convention: Convention::default(),
            up: None,
            rotate_deg: 0.0,
            exposure: 1.0,
        };
        Ok(Some(NamedLight { name: (*name).to_owned(), op }))
    }

    /// Azimuth of a direction as `relight --sun` counts it: from the world's x axis laid on the ground (z where x is up),
    /// counter-clockwise seen from above. To half a degree: people point with their arms.
    fn azimuth_deg(&self, direction: DVec3) -> f64 {
        let up = self.draft.up();
        let axis = if up.x.abs() > 0.99 { DVec3::Z } else { DVec3::X };
        let ahead = (axis - up * axis.dot(up)).normalize_or_zero();
        let left = up.cross(ahead);
        let azimuth = direction.dot(left).atan2(direction.dot(ahead)).to_degrees();
        let half = (2.0 * azimuth).round() / 2.0;
        if half <= -180.0 { half + 360.0 } else { half }
    }
}

pub(crate) fn no_light(word: &str, why: &str) -> Misread {
    Misread::new(format!("there is no light {}: {why}", shown(word)), known_lights())
}

pub(crate) fn known_lights() -> String {
    let names: Vec<&str> = LIGHTS.iter().map(|(name, _)| *name).collect();
    format!("the lights are {}", names.join(", "))
}
