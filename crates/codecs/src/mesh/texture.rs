//! Textures, and what a point of a mesh is made of.

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use glam::DVec3;
use motes_formats::budget;
use motes_formats::error::Result;
use motes_formats::images::read_image_from;
use motes_math::srgb;
use motes_scene::ImageU8;

/// What lies beyond the edge of a texture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// The texture again.
    #[default]
    Repeat,
    /// The texture mirrored.
    Mirror,
    /// Its last pixel.
    Clamp,
}

impl Wrap {
    /// The pixel that coordinate `i` of `n` is.
    fn pixel(self, i: i64, n: i64) -> usize {
        (match self {
            Self::Repeat => i.rem_euclid(n),
            Self::Clamp => i.clamp(0, n - 1),
            Self::Mirror => {
                let k = i.rem_euclid(2 * n);
                if k < n { k } else { 2 * n - 1 - k }
            }
        }) as usize
    }
}

/// An image with 3 or 4 channels, as stored.
pub type Texture = Arc<ImageU8>;

/// A texture as a material uses it.
#[derive(Clone, Debug)]
pub struct TextureUse {
    /// The image.
    pub texture: Texture,
    /// Set of texture coordinates, 0 or 1.
    pub set: usize,
    /// From coordinates of the mesh to those of the texture.
    pub(crate) transform: Affine,
    /// Beyond its left and right, its top and bottom.
    pub wrap: [Wrap; 2],
}

/// Rows of a 2 by 3 matrix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Affine(pub(crate) [[f32; 3]; 2]);

impl Affine {
    pub(crate) const IDENTITY: Self = Self([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);

    fn apply(self, [u, v]: [f64; 2]) -> [f64; 2] {
        self.0.map(|row| {
            let [a, b, c] = row.map(f64::from);
            a * u + b * v + c
        })
    }
}

/// Textures and transparency of one material. All factors are in the vertices of the mesh.
#[derive(Clone, Debug, Default)]
pub struct Look {
    /// sRGB-encoded; its alpha is coverage.
    pub base_color: Option<TextureUse>,
    /// Green multiplies roughness and blue metallic, both linear.
    pub metallic_roughness: Option<TextureUse>,
    /// One channel that multiplies roughness, linear.
    pub roughness: Option<TextureUse>,
    /// One channel that multiplies metallic, linear.
    pub metallic: Option<TextureUse>,
    /// Transparency of the whole, 0 to 1.
    pub transparency: f32,
    /// Coverage below this is a hole, and above it whole; `None`: coverage is opacity.
    pub cutoff: Option<f32>,
    /// Whether the alpha of the texture says nothing.
    pub opaque: bool,
}

impl Look {
    pub(super) fn textures(&self) -> impl Iterator<Item = &TextureUse> {
        let all = [&self.base_color, &self.metallic_roughness, &self.roughness, &self.metallic];
        all.into_iter().flatten()
    }
}

/// Decoded images by what names them in the file, and their sum.
pub(crate) struct ImageCache<'p> {
    path: &'p Path,
    images: HashMap<String, Texture>,
    bytes: (u64, u64),
}

impl<'p> ImageCache<'p> {
    pub(crate) fn new(path: &'p Path) -> Self {
        Self { path, images: HashMap::new(), bytes: (0, 0) }
    }

    /// The image that `name` stands for; `read` gets the bytes of its file and the name for errors.
    pub(crate) fn get<'a>(
        &mut self,
        name: &str,
        read: impl FnOnce() -> Result<(std::borrow::Cow<'a, [u8]>, std::path::PathBuf)>,
    ) -> Result<Texture> {
        if let Some(image) = self.images.get(name) {
            return Ok(Arc::clone(image));
        }
        let (bytes, file) = read()?;
        let image = read_image_from(&bytes, &file)?;
        // Many names of the same bytes are more than the guard of one image sees.
        self.bytes.0 += image.data.len() as u64;
        self.bytes.1 = self.bytes.1.max(bytes.len() as u64);
        let (all, one) = self.bytes;
        budget::picture(self.path, "images", "all its textures", all, all, 4 * one, false)?;
        let image = Arc::new(image);
        self.images.insert(name.to_owned(), Arc::clone(&image));
        Ok(image)
    }
}

impl TextureUse {
    /// Bilinear value of all channels at texture coordinates: linear where `encoded` and in color, 0 to 1. Alpha is 1 where there is
    /// none.
    fn sample(&self, uv: [f64; 2], encoded: bool) -> [f32; 4] {
        let [u, v] = self.transform.apply(uv);
        let image = &*self.texture;
        let (w, h) = (image.width as i64, image.height as i64);
        // Far beyond the texture no digit is left for the fraction: any pixel is right.
        let at = |x: f64, n: i64| if x.abs() < 1e9 { x * n as f64 - 0.5 } else { 0.0 };
        let (x, y) = (at(u, w), at(v, h));
        let (i, j) = (x.floor() as i64, y.floor() as i64);
        let (fx, fy) = ((x - x.floor()) as f32, (y - y.floor()) as f32);
        let channels = image.channels;
        let mut sum = [0.0; 4];
        for (dx, dy, weight) in [
            (0, 0, (1.0 - fx) * (1.0 - fy)),
            (1, 0, fx * (1.0 - fy)),
            (0, 1, (1.0 - fx) * fy),
            (1, 1, fx * fy),
        ] {
            let (px, py) = (self.wrap[0].pixel(i + dx, w), self.wrap[1].pixel(j + dy, h));
            let pixel = &image.data[channels * (py * image.width + px)..][..channels];
            for (c, sum) in sum.iter_mut().enumerate() {
                let value = pixel.get(c).map_or(1.0, |b| f32::from(*b) / 255.0);
                *sum += weight * if encoded && c < 3 { srgb::decode(value) } else { value };
            }
        }
        sum
    }

    /// Mean over points between three corners with these texture coordinates; white where there are none.
    pub(super) fn mean(
        &self,
        uv: Option<[[f64; 2]; 3]>,
        points: &[[f64; 3]],
        encoded: bool,
    ) -> [f32; 4] {
        let Some(uv) = uv else { return [1.0; 4] };
        let mut sum = [0.0; 4];
        for weights in points {
            let at = [0, 1].map(|k| (0..3).map(|c| uv[c][k] * weights[c]).sum());
            let value = self.sample(at, encoded);
            sum.iter_mut().zip(value).for_each(|(sum, v)| *sum += v);
        }
        sum.map(|v| v / points.len() as f32)
    }

    /// Pixels per world unit between three corners, at most.
    pub(super) fn density(&self, uv: Option<[[f64; 2]; 3]>, at: [DVec3; 3]) -> f64 {
        let Some(uv) = uv else { return 0.0 };
        let size = [self.texture.width as f64, self.texture.height as f64];
        let uv = uv.map(|uv| self.transform.apply(uv));
        let edge = |a: usize, b: usize| {
            let pixels = (0..2).map(|k| ((uv[b][k] - uv[a][k]) * size[k]).powi(2)).sum::<f64>();
            pixels.sqrt() / at[a].distance(at[b])
        };
        let edges = [edge(0, 1), edge(1, 2), edge(2, 0)];
        edges.into_iter().filter(|d| d.is_finite()).fold(0.0, f64::max)
    }
}
