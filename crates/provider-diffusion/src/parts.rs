//! What IC-Light and InstructPix2Pix share: pictures to latents and back, texts to embeddings.

use std::path::Path;

use candle_core::{DType, Device, Tensor};
use motes_scene::ImageU8;

use crate::error::Result;
use crate::network::{
    Autoencoder, AutoencoderConfig, TextEncoder, TextEncoderConfig, UNet, UNetConfig,
};
use crate::pictures::signed;
use crate::tokens::Tokens;
use crate::weights::{Part, Place, Source, TensorFile, part};

/// Autoencoder, text encoder and tokenizer of a model's folder, in 32 bits: 16 overflow in the autoencoder.
pub struct Parts {
    /// Pixels to latents and back.
    pub autoencoder: Autoencoder,
    text_encoder: TextEncoder,
    tokens: Tokens,
    device: Device,
}

/// The tensors of a text encoder, compared with its configuration.
fn text_encoder(folder: &Path, device: &Device) -> Result<(Source, TextEncoderConfig)> {
    let part = part(folder, "text_encoder")?;
    let config: TextEncoderConfig = part.config()?;
    let file = TensorFile::open(&part.path)?;
    let build = |place: &Place<'_>| TextEncoder::new(place, &config).map(|_| ());
    let at = (device, DType::F32);
    let source = Source::files(file, None, at, "the text encoder", TextEncoder::renamed, build)?;
    Ok((source, config))
}

/// The tensors of an autoencoder, compared with its configuration.
fn autoencoder(folder: &Path, device: &Device) -> Result<(Source, AutoencoderConfig)> {
    let part = part(folder, "vae")?;
    let config: AutoencoderConfig = part.config()?;
    let file = TensorFile::open(&part.path)?;
    let build = |place: &Place<'_>| Autoencoder::new(place, &config).map(|_| ());
    let at = (device, DType::F32);
    let source = Source::files(file, None, at, "the autoencoder", Autoencoder::renamed, build)?;
    Ok((source, config))
}

/// The tensors of a UNet, compared with its configuration; with `offsets`, a file and its input channels, these are added.
fn unet_source(
    part: &Part,
    offsets: Option<(&Path, usize)>,
    at: (&Device, DType),
) -> Result<(Source, UNetConfig)> {
    let mut config: UNetConfig = part.config()?;
    if let Some((_, channels)) = offsets {
        config.in_channels = channels;
    }
    let file = TensorFile::open(&part.path)?;
    let added = offsets.map(|(path, _)| TensorFile::open(path)).transpose()?;
    let build = |place: &Place<'_>| UNet::new(place, &config).map(|_| ());
    let source = Source::files(file, added, at, "the UNet", |name| Some(name.to_owned()), build)?;
    Ok((source, config))
}

/// The UNet of a model's folder.
///
/// # Errors
/// Its files have not exactly the tensors of the network.
pub fn unet(folder: &Path, offsets: Option<(&Path, usize)>, at: (&Device, DType)) -> Result<UNet> {
    let (source, config) = unet_source(&part(folder, "unet")?, offsets, at)?;
    UNet::new(&source.root(), &config)
}

/// Compares the heads of all files of a model with its networks; reads no values.
///
/// # Errors
/// As [`unet`] and [`Parts::load`].
pub fn check(folder: &Path, offsets: &[(&Path, usize)]) -> Result<()> {
    let unet = part(folder, "unet")?;
    let each = offsets.iter().copied().map(Some);
    let plain = offsets.is_empty().then_some(None);
    for offsets in plain.into_iter().chain(each) {
        unet_source(&unet, offsets, (&Device::Cpu, DType::F32))?;
    }
    autoencoder(folder, &Device::Cpu)?;
    let (_, config) = text_encoder(folder, &Device::Cpu)?;
    Tokens::load(&folder.join("tokenizer"), config.max_position_embeddings)?;
    Ok(())
}

impl Parts {
    /// From a model's folder.
    ///
    /// # Errors
    /// Its files have not exactly the tensors of the networks.
    pub fn load(folder: &Path, device: &Device) -> Result<Self> {
        let (source, config) = text_encoder(folder, device)?;
        let text_encoder = TextEncoder::new(&source.root(), &config)?;
        let (source, config) = autoencoder(folder, device)?;
        let autoencoder = Autoencoder::new(&source.root(), &config)?;
        let tokens = Tokens::load(&folder.join("tokenizer"), text_encoder.longest())?;
        Ok(Self { autoencoder, text_encoder, tokens, device: device.clone() })
    }

    /// Latents of a picture, not scaled; the byte `middle` is what the network knows as nothing.
    ///
    /// # Errors
    /// Memory ran out.
    pub fn latents(&self, picture: &ImageU8, middle: f32) -> Result<Tensor> {
        self.autoencoder.encode(&signed(picture, middle, &self.device)?)
    }

    /// Pixels, about -1 to 1, of scaled latents of one picture.
    ///
    /// # Errors
    /// Memory ran out.
    pub fn pixels(&self, latents: &Tensor) -> Result<Tensor> {
        self.autoencoder.decode(&(latents / self.autoencoder.scale())?)
    }

    /// Columns and rows of latents of pictures of a size, and their channels, as a shape.
    pub fn latent_shape(&self, (width, height): (usize, usize)) -> [usize; 4] {
        let factor = self.autoencoder.factor();
        [1, self.autoencoder.latent_channels(), height / factor, width / factor]
    }

    /// Zeros in the shape of latents.
    ///
    /// # Errors
    /// Memory ran out.
    pub fn empty(&self, size: (usize, usize)) -> Result<Tensor> {
        Ok(Tensor::zeros(&self.latent_shape(size), DType::F32, &self.device)?)
    }

    /// Embedding of a text that fits, `[1, tokens, channels]`.
    ///
    /// # Errors
    /// It does not fit.
    pub fn embedded(&self, text: &str) -> Result<Tensor> {
        self.text_encoder.embedded(&[self.tokens.one(text)?])
    }

    /// Embeddings of two texts of any length, each a sequence of its chunks, which are repeated until both are as long.
    ///
    /// # Errors
    /// A text is longer than the model takes.
    pub fn embedded_pair(&self, prompt: &str, negative: &str) -> Result<[Tensor; 2]> {
        let pair = [self.tokens.chunks(prompt)?, self.tokens.chunks(negative)?];
        let count = pair[0].len().max(pair[1].len());
        let embedded = |chunks: Vec<Vec<u32>>| -> Result<Tensor> {
            let repeated: Vec<_> = chunks.iter().cycle().take(count).cloned().collect();
            let made = self.text_encoder.embedded(&repeated)?;
            let (chunks, tokens, channels) = made.dims3()?;
            Ok(made.reshape((1, chunks * tokens, channels))?)
        };
        let [prompt, negative] = pair;
        Ok([embedded(prompt)?, embedded(negative)?])
    }
}
