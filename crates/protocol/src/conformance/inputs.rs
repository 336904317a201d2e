//! Requests of every kind, with pictures that a program makes.

use std::path::Path;

use motes_formats::images::write_png;
use motes_formats::provider::{
    ChatMessage, ChatRole, ChatTask, EditView, EnvironmentTask, InstructEditTask, NovelViewTask,
    PointPrompt, PosedPicture, PredictTask, ProviderKind, ProviderRequest, Quantity, RelightTask,
    SegmentTask, Task, ViewCamera,
};
use motes_scene::ImageU8;
use serde_json::json;

use crate::ProviderError;

/// A request of this kind about a disc on a slope of colors, whose pictures are written into `folder`.
///
/// # Errors
/// A picture cannot be written.
pub fn request(
    kind: ProviderKind,
    folder: &Path,
    (width, height): (usize, usize),
) -> Result<ProviderRequest, ProviderError> {
    write_png(&folder.join("picture.png"), &disc(width, height))?;
    let picture = || "picture.png".to_owned();
    let task = match kind {
        ProviderKind::Segment => {
            let (x, y) = (0.5 * width as f64, 0.5 * height as f64);
            let points = vec![PointPrompt { x, y, positive: true }];
            Task::Segment(SegmentTask {
                picture: picture(),
                points,
                candidates: 3,
                ..Default::default()
            })
        }
        ProviderKind::Relight => {
            let prompt = "warm light from the left".into();
            Task::Relight(RelightTask { picture: picture(), prompt, ..Default::default() })
        }
        ProviderKind::InstructEdit => {
            let view = || EditView { original: picture(), start: None };
            let prompt = "make it snow".into();
            Task::InstructEdit(InstructEditTask { prompt, views: vec![view(), view()], noise: 0.5 })
        }
        ProviderKind::Predict => {
            let quantities = vec![
                Quantity::Normal,
                Quantity::Depth,
                Quantity::BaseColor,
                Quantity::Roughness,
                Quantity::Metallic,
            ];
            Task::Predict(PredictTask { pictures: vec![picture()], quantities })
        }
        ProviderKind::Environment => Task::Environment(EnvironmentTask { picture: picture() }),
        ProviderKind::NovelView => {
            let (w, h) = (width as f64, height as f64);
            let (focal_px, center_px) = ([w; 2], [0.5 * w, 0.5 * h]);
            let photo = ViewCamera { focal_px, center_px, ..Default::default() };
            let camera = ViewCamera { translation: [0.1, 0.0, 0.0], ..photo };
            let references = vec![PosedPicture { picture: picture(), camera: photo }];
            Task::NovelView(NovelViewTask { rendering: picture(), camera, references })
        }
        ProviderKind::Chat => {
            let text = "Name a color.".into();
            let message = ChatMessage { role: ChatRole::User, text, pictures: vec![picture()] };
            let schema = json!({
                "type": "object",
                "properties": {"color": {"type": "string"}},
                "required": ["color"],
            });
            Task::Chat(ChatTask { messages: vec![message], schema })
        }
    };
    Ok(ProviderRequest::new(task, 1))
}

/// A red disc in the middle of a slope from blue to green.
fn disc(width: usize, height: usize) -> ImageU8 {
    let (w, h) = (width as f64, height as f64);
    let radius = 0.3 * w.min(h);
    let pixel = |p: usize| {
        let (x, y) = ((p % width) as f64 + 0.5, (p / width) as f64 + 0.5);
        match (x - 0.5 * w).hypot(y - 0.5 * h) <= radius {
            true => [200, 40, 30],
            false => [20, (220.0 * y / h) as u8, (220.0 * x / w) as u8],
        }
    };
    ImageU8::from_data(width, height, 3, (0..width * height).flat_map(pixel).collect())
}
