//! Directions of the frame, in words.

use super::cursor::Cursor;

/// A direction of the frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Direction {
    Left,
    Right,
    Front,
    Back,
    Up,
    Down,
}

/// Ways to say a direction, the longest first.
const DIRECTIONS: &[(&str, Direction)] = &[
    ("away from the camera", Direction::Back),
    ("away from me", Direction::Back),
    ("toward the camera", Direction::Front),
    ("towards the camera", Direction::Front),
    ("toward the viewer", Direction::Front),
    ("towards the viewer", Direction::Front),
    ("toward me", Direction::Front),
    ("towards me", Direction::Front),
    ("to the camera", Direction::Front),
    ("left", Direction::Left),
    ("leftward", Direction::Left),
    ("leftwards", Direction::Left),
    ("right", Direction::Right),
    ("rightward", Direction::Right),
    ("rightwards", Direction::Right),
    ("front", Direction::Front),
    ("forward", Direction::Front),
    ("forwards", Direction::Front),
    ("closer", Direction::Front),
    ("nearer", Direction::Front),
    ("back", Direction::Back),
    ("backward", Direction::Back),
    ("backwards", Direction::Back),
    ("away", Direction::Back),
    ("farther away", Direction::Back),
    ("further away", Direction::Back),
    ("up", Direction::Up),
    ("upward", Direction::Up),
    ("upwards", Direction::Up),
    ("higher", Direction::Up),
    ("down", Direction::Down),
    ("downward", Direction::Down),
    ("downwards", Direction::Down),
    ("lower", Direction::Down),
];

impl Direction {
    /// The word for it.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Left => "left",
            Self::Right => "right",
            Self::Front => "front",
            Self::Back => "back",
            Self::Up => "up",
            Self::Down => "down",
        }
    }

    /// What two opposite directions contradict each other in.
    pub(crate) fn axis(self) -> &'static str {
        match self {
            Self::Left | Self::Right => "the move sideways",
            Self::Front | Self::Back => "the move in depth",
            Self::Up | Self::Down => "the move in height",
        }
    }
}

/// The longest direction that comes next.
pub(crate) fn direction(cursor: &mut Cursor<'_>) -> Option<Direction> {
    let found = DIRECTIONS.iter().filter(|(words, _)| cursor.sees(words));
    let (words, direction) = found.max_by_key(|(words, _)| words.len())?;
    cursor.eat(words);
    Some(*direction)
}
