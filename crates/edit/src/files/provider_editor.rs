//! A provider of the kind instruct-edit as the editor of `stylize`.

use std::cell::RefCell;
use std::path::Path;

use motes_formats::FormatError;
use motes_formats::atomic::ScratchFolder;
use motes_formats::images::{read_image, write_png};
use motes_formats::provider::{
    EditView, InstructEditResult, InstructEditTask, ProviderRequest, Task, TaskResult,
};
use motes_protocol::{Provider, ProviderUse};
use motes_scene::{ImageF32, ImageU8};

use crate::stylize::{EditorError, Picture, PictureEditor, Round};

/// A provider and what it is told.
pub(super) struct ProviderEditor {
    provider: RefCell<Provider>,
}

impl ProviderEditor {
    /// Of a provider that was opened for instruct-edit.
    pub(super) fn new(provider: Provider) -> Self {
        Self { provider: provider.into() }
    }

    /// Who answered so far.
    pub(super) fn used(&self) -> ProviderUse {
        self.provider.borrow().used().clone()
    }
}

impl PictureEditor for ProviderEditor {
    fn edit(
        &self,
        prompt: &str,
        pictures: &[Picture<'_>],
        round: Round,
        stopped: &dyn Fn() -> bool,
    ) -> Result<Vec<ImageF32>, EditorError> {
        let io = |source| FormatError::io(Path::new("temporary folder"), source);
        let scratch = ScratchFolder::new().map_err(io)?;
        let folder = scratch.path();
        let mut views = Vec::with_capacity(pictures.len());
        for (i, picture) in pictures.iter().enumerate() {
            let original = format!("original-{i}.png");
            write_png(&folder.join(&original), &picture.original.to_u8())?;
            let start = format!("start-{i}.png");
            write_png(&folder.join(&start), &picture.current.to_u8())?;
            views.push(EditView { original, start: Some(start) });
        }
        let task = InstructEditTask { prompt: prompt.to_owned(), views, noise: round.noise };
        let request = ProviderRequest::new(Task::InstructEdit(task), round.seed);
        let reply = self.provider.borrow_mut().ask(folder, &request, stopped)?;
        reply.warnings.iter().for_each(|warning| tracing::warn!("{warning}"));
        let TaskResult::InstructEdit(InstructEditResult { pictures }) = reply.result else {
            return Err(EditorError::NoPicture { view: "any view".into() });
        };
        let read = |name: &String| Ok(rgb(&read_image(&folder.join(name))?));
        pictures.iter().map(read).collect()
    }
}

/// The colors of a picture with or without alpha; gray becomes color.
pub(super) fn rgb(image: &ImageU8) -> ImageF32 {
    let data = image.to_f32();
    let pixels = data.data.chunks_exact(data.channels);
    let rgb = match data.channels {
        1 | 2 => pixels.flat_map(|p| [p[0]; 3]).collect(),
        _ => pixels.flat_map(|p| [p[0], p[1], p[2]]).collect(),
    };
    ImageF32::from_data(image.width, image.height, 3, rgb)
}
