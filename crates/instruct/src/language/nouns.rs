//! Words for objects, and for which of them is meant.

use motes_formats::scene_card::{ObjectDocument, Relation};

use super::cursor::Cursor;
use super::lexicon::color_named;

/// Words that stand for any object.
pub(crate) const ANY: [&str; 5] = ["object", "thing", "item", "one", "ones"];
pub(crate) const WHOLE: [&str; 16] = [
    "the whole scene",
    "the entire scene",
    "this whole scene",
    "the scene",
    "this scene",
    "everything",
    "the picture",
    "the room",
    "this room",
    "the whole room",
    "the kitchen",
    "the living room",
    "the bedroom",
    "the garden",
    "the view",
    "the whole thing",
];

/// Which of several is meant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Pick {
    Largest,
    Smallest,
    Tallest,
    Shortest,
    Leftmost,
    Rightmost,
    Nearest,
    Farthest,
    Highest,
    Lowest,
}

pub(crate) const PICKS: &[(&[&str], Pick)] = &[
    (&["largest", "biggest"], Pick::Largest),
    (&["smallest", "tiniest", "littlest"], Pick::Smallest),
    (&["tallest"], Pick::Tallest),
    (&["shortest"], Pick::Shortest),
    (&["leftmost", "left most", "left"], Pick::Leftmost),
    (&["rightmost", "right most", "right"], Pick::Rightmost),
    (&["nearest", "closest", "front", "frontmost"], Pick::Nearest),
    (&["farthest", "furthest", "back", "rear"], Pick::Farthest),
    (&["highest", "topmost", "top"], Pick::Highest),
    (&["lowest", "bottom"], Pick::Lowest),
];

/// Words that only describe.
pub(crate) const CLASSES: &[(&str, &str)] = &[
    ("metal", "metal"),
    ("metallic", "metal"),
    ("shiny", "glossy"),
    ("glossy", "glossy"),
    ("matte", "matte"),
    ("wooden", "wood"),
    ("wood", "wood"),
];

/// A relation, and whether it is said the other way round.
pub(crate) fn relation(cursor: &mut Cursor<'_>) -> Option<(Relation, bool)> {
    const WORDS: &[(&str, Relation, bool)] = &[
        ("to the left of", Relation::LeftOf, false),
        ("on the left of", Relation::LeftOf, false),
        ("left of", Relation::LeftOf, false),
        ("to the right of", Relation::LeftOf, true),
        ("on the right of", Relation::LeftOf, true),
        ("right of", Relation::LeftOf, true),
        ("in front of", Relation::Behind, true),
        ("behind", Relation::Behind, false),
        ("on top of", Relation::On, false),
        ("under", Relation::On, true),
        ("below", Relation::On, true),
        ("on", Relation::On, false),
    ];
    let (_, relation, inverse) = WORDS.iter().find(|(words, ..)| cursor.eat(words))?;
    Some((*relation, *inverse))
}

pub(crate) fn is_adjective(word: &str) -> bool {
    color_named(word).is_some() || CLASSES.iter().any(|(class, _)| *class == word)
}

pub(crate) fn is(object: &ObjectDocument, adjective: &str) -> bool {
    if let Some((name, _)) = color_named(adjective) {
        return object.color.name == name;
    }
    let class = CLASSES.iter().find(|(word, _)| *word == adjective).map(|(_, class)| *class);
    object.material.as_ref().is_some_and(|material| {
        Some(material.class.as_str()) == class || material.made_of.as_deref() == class
    })
}

/// Words of a name, the last in the singular.
pub(crate) fn words_of(name: &str) -> Vec<String> {
    let name = name.to_lowercase().replace('-', " ");
    let mut words: Vec<String> = name.split_whitespace().map(str::to_owned).collect();
    if let Some(last) = words.last_mut() {
        *last = singular(last);
    }
    words
}

/// English plurals of things.
pub(crate) fn singular(word: &str) -> String {
    let cut = |n: usize| word[..word.len() - n].to_owned();
    match word {
        _ if word.ends_with("ss") || word.len() < 4 => word.into(),
        _ if word.ends_with("ves") && word != "gloves" => match word {
            "knives" => "knife".into(),
            _ => cut(3) + "f",
        },
        _ if word.ends_with("ies") => cut(3) + "y",
        _ if ["ches", "shes", "xes", "sses"].iter().any(|end| word.ends_with(end)) => cut(2),
        _ if word.ends_with('s') => cut(1),
        _ => word.into(),
    }
}
