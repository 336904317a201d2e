//! Decoded pixels of any type to 8 bits.

use image::{DynamicImage, ImageBuffer, Pixel};
use motes_math::srgb;
use motes_scene::ImageU8;

/// 3 channels, or 4 when the image has alpha.
pub(super) fn to_rgb_or_rgba(image: DynamicImage) -> ImageU8 {
    let image = match image {
        DynamicImage::ImageRgb32F(linear) => DynamicImage::ImageRgb32F(encode_srgb(linear)),
        DynamicImage::ImageRgba32F(linear) => DynamicImage::ImageRgba32F(encode_srgb(linear)),
        other => other,
    };
    if image.color().has_alpha() { wrap(image.into_rgba8()) } else { wrap(image.into_rgb8()) }
}

/// 1 channel: luminance, multiplied by alpha where there is one.
pub(super) fn to_mask(image: DynamicImage) -> ImageU8 {
    if !image.color().has_alpha() {
        return wrap(image.into_luma8());
    }
    let image = image.into_luma_alpha8();
    let product = |p: &image::LumaA<u8>| {
        let [luma, alpha] = p.0.map(u16::from);
        ((luma * alpha + 127) / 255) as u8
    };
    let data = image.pixels().map(product).collect();
    ImageU8::from_data(image.width() as usize, image.height() as usize, 1, data)
}

fn wrap<P: Pixel<Subpixel = u8>>(image: ImageBuffer<P, Vec<u8>>) -> ImageU8 {
    let (width, height) = (image.width() as usize, image.height() as usize);
    ImageU8::from_data(width, height, P::CHANNEL_COUNT as usize, image.into_raw())
}

/// The sRGB transfer function (IEC 61966-2-1) on linear colors; alpha stays.
fn encode_srgb<P: Pixel<Subpixel = f32>>(
    mut image: ImageBuffer<P, Vec<f32>>,
) -> ImageBuffer<P, Vec<f32>> {
    for pixel in image.pixels_mut() {
        pixel.apply_without_alpha(|linear| srgb::encode(linear.clamp(0.0, 1.0)));
    }
    image
}
