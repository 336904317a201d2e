//! Scaling.

use edit::ops::{OpDocument, TransformOp};
use edit::run::{PivotDocument, PivotName};

use super::amount::{Factor, factor};
use super::draft::rounded;
use super::error::Misread;
use super::reader::Reader;

/// Sizes without a number.
const BIGGER: f64 = 1.25;
const A_BIT_BIGGER: f64 = 1.1;
const MUCH_BIGGER: f64 = 1.5;

impl Reader<'_, '_> {
    /// A size behind an object: "twice as large", "bigger", "30 cm tall"; false when none comes next.
    pub(crate) fn size(&mut self, objects: &[usize]) -> Result<bool, Misread> {
        let from = self.cursor.at;
        if let Some(times) = self.comparison()? {
            self.scaled(objects, times)?;
            return Ok(true);
        }
        self.cursor.at = from;
        let tall = self.said_length();
        if let Ok(Some(said)) = &tall
            && self
                .cursor
                .eat_any(&["tall", "high", "in height", "wide", "in width"])
                .is_some_and(|_| true)
        {
            let is_wide = self.cursor.at > 0 && ["wide", "width"].contains(&self.previous_word());
            for &object in objects {
                let length = self.measured(*said, object)?;
                let size = self.draft.object(object).size;
                let now = if is_wide { size.width } else { size.height };
                if !(now > 0.0) {
                    let cause = format!("{} has no height", self.finder.listed(&[object]));
                    return Err(Misread::new(cause, "say a factor, as in \"twice as large\""));
                }
                self.scaled(&[object], length / now)?;
            }
            return Ok(true);
        }
        self.cursor.at = from;
        Ok(false)
    }

    fn previous_word(&self) -> &str {
        let mut back = self.cursor.clone();
        back.at = back.at.saturating_sub(1);
        back.word().unwrap_or_default()
    }

    /// "twice as large", "half the size", "3 times bigger", "20 % smaller", "a bit bigger".
    fn comparison(&mut self) -> Result<Option<f64>, Misread> {
        const LARGE: [&str; 6] = ["large", "big", "tall", "wide", "high", "huge"];
        const LARGER: [&str; 4] = ["larger", "bigger", "taller", "wider"];
        const SMALLER: [&str; 3] = ["smaller", "shorter", "tinier"];
        let degree = [
            ("a little bit", A_BIT_BIGGER),
            ("a bit", A_BIT_BIGGER),
            ("a little", A_BIT_BIGGER),
            ("slightly", A_BIT_BIGGER),
            ("much", MUCH_BIGGER),
            ("a lot", MUCH_BIGGER),
            ("far", MUCH_BIGGER),
        ];
        let said = degree.iter().find(|(words, _)| self.cursor.eat(words)).map(|(_, times)| *times);
        let said = match said {
            Some(times) => Some(Factor::Times(times)),
            None => factor(&mut self.cursor)?,
        };
        if matches!(said, Some(Factor::Times(_)))
            && self.cursor.eat_any(&["the size", "its size", "as small"]).is_some()
        {
            return Ok(said.map(|said| match said {
                Factor::Times(times) if self.previous_word() == "small" => 1.0 / times,
                Factor::Times(times) | Factor::Percent(times) => times,
            }));
        }
        if self.cursor.eat("as") {
            if self.cursor.eat_any(&LARGE).is_none() {
                return Ok(None);
            }
            self.cursor.eat_any(&["as before", "as it is", "as it was", "as now"]);
            return Ok(said.map(|said| match said {
                Factor::Times(times) => times,
                Factor::Percent(percent) => percent / 100.0,
            }));
        }
        let grows = self.cursor.eat_any(&LARGER).is_some();
        if !grows && self.cursor.eat_any(&SMALLER).is_none() {
            return Ok(None);
        }
        let from = self.cursor.at;
        self.cursor.eat("by");
        let behind = if said.is_none() { factor(&mut self.cursor)? } else { None };
        if behind.is_none() {
            self.cursor.at = from;
        }
        let times = match said.or(behind) {
            Some(Factor::Times(times)) => times,
            Some(Factor::Percent(percent)) if grows => 1.0 + percent / 100.0,
            Some(Factor::Percent(percent)) if percent < 100.0 => 1.0 / (1.0 - percent / 100.0),
            Some(Factor::Percent(_)) => {
                return Err(Misread::new(
                    "nothing would be left of it",
                    "say less than 100 %, or remove it",
                ));
            }
            None => {
                self.draft.note(format!("no amount was said: a factor of {BIGGER} on the size"));
                BIGGER
            }
        };
        Ok(Some(if grows { times } else { 1.0 / times }))
    }

    /// "enlarge ... by 20 %", "scale ... to 150 %", "shrink ...".
    pub(crate) fn rescale(
        &mut self,
        objects: &[usize],
        grows: Option<bool>,
    ) -> Result<(), Misread> {
        let to = self.cursor.eat("to");
        let by = !to && self.cursor.eat("by");
        if !to && self.size(objects)? {
            return Ok(());
        }
        let from = self.cursor.at;
        let a_bit =
            self.cursor.eat_any(&["a little bit", "a bit", "a little", "slightly"]).is_some();
        let a_lot = !a_bit && self.cursor.eat_any(&["a lot", "much"]).is_some();
        let said = if a_bit || a_lot { None } else { factor(&mut self.cursor)? };
        self.cursor.eat_any(&["the size", "its size", "of its size"]);
        let _ = by;
        let times = match (said, grows) {
            (Some(Factor::Times(times)), Some(false)) if times > 1.0 => 1.0 / times,
            (Some(Factor::Times(times)), _) => times,
            (Some(Factor::Percent(percent)), None) => percent / 100.0,
            (Some(Factor::Percent(percent)), Some(_)) if to => percent / 100.0,
            (Some(Factor::Percent(percent)), Some(true)) => 1.0 + percent / 100.0,
            (Some(Factor::Percent(percent)), Some(false)) if percent < 100.0 => {
                1.0 - percent / 100.0
            }
            (Some(Factor::Percent(_)), Some(false)) => {
                return Err(Misread::new(
                    "nothing would be left of it",
                    "say less than 100 %, or remove it",
                ));
            }
            (None, Some(grows)) => {
                let times = match (a_bit, a_lot) {
                    (true, _) => A_BIT_BIGGER,
                    (_, true) => MUCH_BIGGER,
                    _ => BIGGER,
                };
                if !a_bit && !a_lot {
                    self.draft
                        .note(format!("no amount was said: a factor of {BIGGER} on the size"));
                }
                if grows { times } else { 1.0 / times }
            }
            (None, None) => {
                self.cursor.at = from;
                return Err(Misread::new(
                    "it is not said how large it gets",
                    "say \"twice as large\" or \"to 150 %\"",
                ));
            }
        };
        self.scaled(objects, times)
    }

    pub(crate) fn scaled(&mut self, objects: &[usize], times: f64) -> Result<(), Misread> {
        if !(1e-3..=1e3).contains(&times) {
            let cause = format!("a factor of {} on the size is out of reason", rounded(times));
            return Err(Misread::new(cause, "say a factor from 0.001 to 1000"));
        }
        for &object in objects {
            let id = self.draft.target(object)?;
            self.draft.says(&id, "the size", if times > 1.0 { "larger" } else { "smaller" })?;
            self.draft.ops.push(OpDocument::Transform(TransformOp {
                target: Some(id),
                scale: Some(rounded(times)),
                pivot: Some(PivotDocument::Named(PivotName::Base)),
                ..TransformOp::default()
            }));
        }
        Ok(())
    }
}
