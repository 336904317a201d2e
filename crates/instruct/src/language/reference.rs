//! "the red ball", "the largest object", "both chairs", "it": phrases to objects of the card.

use glam::DVec3;
use motes_formats::scene_card::{ObjectDocument, SceneCardDocument};

use super::cursor::Cursor;
use super::error::{Misread, nearest, shown};
use super::nouns::{
    ANY, CLASSES, PICKS, Pick, WHOLE, is, is_adjective, relation, singular, words_of,
};

/// What a phrase is about.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Referent {
    /// Objects of the card.
    Objects(Vec<usize>),
    /// The whole scene.
    Scene,
}

/// Reads references against a card.
pub(crate) struct Finder<'c> {
    card: &'c SceneCardDocument,
    /// Names in the singular: words of an object's name, and the object.
    names: Vec<(Vec<String>, usize)>,
}

/// What a phrase asks for.
#[derive(Default)]
struct Asked {
    every: bool,
    count: Option<usize>,
    adjectives: Vec<String>,
    pick: Option<Pick>,
    named: Option<String>,
}

impl<'c> Finder<'c> {
    pub(crate) fn new(card: &'c SceneCardDocument) -> Self {
        let mut names = Vec::new();
        for (i, object) in card.objects.iter().enumerate() {
            for name in &object.names {
                names.push((words_of(name), i));
            }
        }
        Self { card, names }
    }

    /// The objects that the phrase at the cursor means; none, and the cursor where it was, when no phrase of an object begins there.
    ///
    /// # Errors
    /// No object is it, or more than one.
    pub(crate) fn referent(
        &self,
        cursor: &mut Cursor<'_>,
        last: &[usize],
        with_place: bool,
    ) -> Result<Option<Referent>, Misread> {
        let from = cursor.at;
        if let Some(said) = cursor
            .eat_any(&["it", "them", "this", "that", "these", "those"])
            .filter(|_| !self.begins_name(cursor))
        {
            return match last {
                [] => Err(Misread::new(
                    format!("{} refers to nothing that was named before", shown(said)),
                    self.help(),
                )),
                last => Ok(Some(Referent::Objects(last.to_vec()))),
            };
        }
        cursor.at = from;
        if cursor.eat_any(&WHOLE).is_some() {
            return Ok(Some(Referent::Scene));
        }
        let Some(asked) = self.asked(cursor) else {
            cursor.at = from;
            return Ok(None);
        };
        let phrase = cursor.since(from);
        let mut candidates = self.candidates(&asked, &phrase)?;
        if with_place {
            self.filter_by_place(cursor, last, &mut candidates, from)?;
        }
        let phrase = cursor.since(from);
        self.chosen(&asked, candidates, &phrase).map(|found| Some(Referent::Objects(found)))
    }

    /// As [`Self::referent`], of several phrases with "and" between them.
    pub(crate) fn referents(
        &self,
        cursor: &mut Cursor<'_>,
        last: &[usize],
        with_place: bool,
    ) -> Result<Option<Referent>, Misread> {
        let first = self.referent(cursor, last, with_place)?;
        let Some(Referent::Objects(mut all)) = first else { return Ok(first) };
        loop {
            let before = cursor.at;
            let separated = cursor.eat_mark(',') | cursor.eat("and");
            let article = cursor.clone().eat_article() || cursor.sees("both") || cursor.sees("all");
            if !(separated && (article || self.begins_name(cursor))) {
                cursor.at = before;
                break;
            }
            match self.referent(cursor, last, with_place) {
                Ok(Some(Referent::Objects(more))) => {
                    all.extend(more.into_iter().filter(|i| !all.contains(i)).collect::<Vec<_>>());
                }
                _ => {
                    cursor.at = before;
                    break;
                }
            }
        }
        Ok(Some(Referent::Objects(all)))
    }

    fn asked(&self, cursor: &mut Cursor<'_>) -> Option<Asked> {
        let mut asked = Asked::default();
        let mut any = false;
        if cursor.eat_any(&["all of", "all", "every", "each"]).is_some() {
            asked.every = true;
        } else if cursor.eat_any(&["both of", "both"]).is_some() {
            asked.count = Some(2);
        }
        any |= asked.every | asked.count.is_some();
        any |= cursor.eat_article() | cursor.eat("other");
        if cursor.eat("two") {
            asked.count = Some(2);
        }
        loop {
            if let Some(name) = self.name(cursor, &mut asked) {
                asked.named = Some(name);
                return Some(asked);
            }
            let pick =
                PICKS.iter().find_map(|(words, pick)| cursor.eat_any_of(words).then_some(*pick));
            if pick.is_some() {
                asked.pick = pick;
            } else if let Some(word) = cursor.word().filter(|word| is_adjective(word)) {
                asked.adjectives.push(word.to_owned());
                cursor.step();
            } else {
                break;
            }
            any = true;
        }
        if let Some(word) =
            ANY.iter().find(|word| cursor.sees(word) || cursor.word() == Some(&format!("{word}s")))
        {
            asked.every |= cursor.word() != Some(*word) && asked.count.is_none();
            cursor.step();
            return Some(asked);
        }
        // "the wood", "the black": what describes names.
        if let Some(word) = asked.adjectives.last().filter(|_| any) {
            // A substance is all of it.
            asked.every |= CLASSES.iter().any(|(class, _)| class == word);
            return asked.every.then_some(asked);
        }
        let word = cursor.word().filter(|_| any)?;
        asked.named = Some(word.to_owned());
        cursor.step();
        Some(asked)
    }

    /// The longest name of an object that comes next.
    fn name(&self, cursor: &mut Cursor<'_>, asked: &mut Asked) -> Option<String> {
        let comes = |words: &[String]| {
            words.iter().enumerate().all(|(k, word)| {
                let next = cursor.word_at(k);
                next.is_some_and(|next| next == word || singular(next) == *word)
            })
        };
        let found = self
            .names
            .iter()
            .filter(|(words, _)| comes(words))
            .max_by_key(|(words, _)| words.len());
        let (words, _) = found?;
        let last = cursor.word_at(words.len() - 1).unwrap_or_default();
        let is_own = self
            .card
            .objects
            .iter()
            .any(|o| o.names.iter().any(|n| n.to_lowercase().ends_with(last)));
        asked.every |= last != words[words.len() - 1] && asked.count.is_none() && !is_own;
        cursor.at += words.len();
        Some(words.join(" "))
    }

    fn begins_name(&self, cursor: &Cursor<'_>) -> bool {
        let mut ahead = cursor.clone();
        while ahead.word().is_some_and(is_adjective) {
            ahead.step();
        }
        let any = ahead.word().is_some_and(|word| ANY.contains(&word));
        any || self.name(&mut ahead, &mut Asked::default()).is_some()
    }

    fn candidates(&self, asked: &Asked, phrase: &str) -> Result<Vec<usize>, Misread> {
        let mut found: Vec<usize> = match &asked.named {
            Some(name) => {
                let named = self.names.iter().filter(|(words, _)| words.join(" ") == *name);
                let mut found: Vec<usize> = named.map(|(_, i)| *i).collect();
                found.sort_unstable();
                found.dedup();
                found
            }
            None => (0..self.card.objects.len()).collect(),
        };
        if found.is_empty() {
            let name = asked.named.as_deref().unwrap_or("object");
            let known: Vec<String> = self.names.iter().map(|(words, _)| words.join(" ")).collect();
            let near = nearest(&singular(name), known.iter().map(String::as_str));
            let near =
                near.map(|near| format!("did you mean {}? ", shown(near))).unwrap_or_default();
            return Err(Misread::new(
                format!("there is nothing called {} in the scene", shown(name)),
                format!("{near}{}", self.help()),
            ));
        }
        let named = found.clone();
        for adjective in &asked.adjectives {
            found.retain(|&i| is(&self.card.objects[i], adjective));
        }
        if found.is_empty() {
            return Err(Misread::new(
                format!("nothing in the scene is {phrase}"),
                format!("there is {}", self.listed(&named)),
            ));
        }
        Ok(found)
    }

    /// "left of the table", "on the shelf", "on the left".
    fn filter_by_place(
        &self,
        cursor: &mut Cursor<'_>,
        last: &[usize],
        candidates: &mut Vec<usize>,
        from: usize,
    ) -> Result<(), Misread> {
        let before = cursor.at;
        cursor.eat_any(&["that is", "which is", "that are", "which are"]);
        if let Some(side) = cursor
            .eat_any(&["on the left", "on the right", "in the front", "in front", "in the back"])
            .filter(|_| !cursor.sees("of"))
        {
            let pick = match side {
                "on the left" => Pick::Leftmost,
                "on the right" => Pick::Rightmost,
                "in the back" => Pick::Farthest,
                _ => Pick::Nearest,
            };
            if candidates.len() > 1 {
                *candidates = vec![self.picked(pick, candidates, &cursor.since(from))?];
            }
            return Ok(());
        }
        cursor.at = before;
        cursor.eat_any(&["that is", "which is", "that are", "which are"]);
        let Some((relation, inverse)) = relation(cursor) else {
            cursor.at = before;
            return Ok(());
        };
        let Some(Referent::Objects(others)) = self.referent(cursor, last, false)? else {
            cursor.at = before;
            return Ok(());
        };
        let holds = |i: usize| {
            others.iter().any(|&other| {
                let (subject, object) = if inverse { (other, i) } else { (i, other) };
                let id = |k: usize| &self.card.objects[k].id;
                self.card.relations.iter().any(|r| {
                    r.relation == relation && r.subject == *id(subject) && r.object == *id(object)
                })
            })
        };
        let named = candidates.clone();
        candidates.retain(|&i| holds(i));
        if candidates.is_empty() {
            let cause = format!("no object is {}", cursor.since(from));
            return Err(Misread::new(cause, format!("there is {}", self.listed(&named))));
        }
        Ok(())
    }

    fn chosen(
        &self,
        asked: &Asked,
        mut found: Vec<usize>,
        phrase: &str,
    ) -> Result<Vec<usize>, Misread> {
        if let Some(pick) = asked.pick
            && found.len() > 1
        {
            found = vec![self.picked(pick, &found, phrase)?];
        }
        match (asked.every, asked.count) {
            (true, _) => Ok(found),
            (false, Some(count)) if count == found.len() => Ok(found),
            (false, Some(count)) => Err(Misread::new(
                format!("{phrase} are {count}, but the scene has {}", found.len()),
                format!("there is {}", self.listed(&found)),
            )),
            (false, None) if found.len() == 1 => Ok(found),
            (false, None) => Err(Misread::new(
                format!("{phrase} may be {}", self.listed(&found)),
                "say which: by color, \"the largest\", \"the left one\", \"all of them\", or by another label",
            )),
        }
    }

    /// The one that is most so, when it clearly is.
    fn picked(&self, pick: Pick, found: &[usize], phrase: &str) -> Result<usize, Misread> {
        let frame = &self.card.frame;
        let along = |axis: [f64; 3], o: &ObjectDocument| {
            DVec3::from_array(o.center).dot(DVec3::from_array(axis))
        };
        let score = |o: &ObjectDocument| match pick {
            Pick::Largest => o.size.width * o.size.depth * o.size.height,
            Pick::Smallest => -o.size.width * o.size.depth * o.size.height,
            Pick::Tallest => o.size.height,
            Pick::Shortest => -o.size.height,
            Pick::Leftmost => -along(frame.right, o),
            Pick::Rightmost => along(frame.right, o),
            Pick::Nearest => along(frame.front, o),
            Pick::Farthest => -along(frame.front, o),
            Pick::Highest => along(frame.up, o),
            Pick::Lowest => -along(frame.up, o),
        };
        let mut ranked: Vec<(f64, usize)> =
            found.iter().map(|&i| (score(&self.card.objects[i]), i)).collect();
        ranked.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        match ranked.as_slice() {
            [(best, _), (next, _), ..] if best == next => Err(Misread::new(
                format!("{phrase} may be {}", self.listed(&[ranked[0].1, ranked[1].1])),
                "they are equally so: call it by its name",
            )),
            [(_, best), ..] => Ok(*best),
            [] => Err(Misread::new(format!("{phrase} is nothing"), self.help())),
        }
    }

    /// "the ball (red) and the lemon (yellow)".
    pub(crate) fn listed(&self, objects: &[usize]) -> String {
        let one = |i: &usize| {
            let object = &self.card.objects[*i];
            format!("{} ({})", object.id, object.color.name)
        };
        let mut listed: Vec<String> = objects.iter().take(12).map(one).collect();
        if objects.len() > 12 {
            listed.push("more".into());
        }
        listed.join(", ")
    }

    pub(crate) fn help(&self) -> String {
        match self.card.objects.len() {
            0 => "no object has a name: give --labels, which name selections of segment-select"
                .into(),
            n => format!("the scene has {}", self.listed(&(0..n).collect::<Vec<_>>())),
        }
    }
}

impl Cursor<'_> {
    fn eat_any_of(&mut self, words: &[&str]) -> bool {
        words.iter().any(|words| self.eat(words))
    }
}
