//! Photos and masks: PNG, JPEG, TIFF, WebP, BMP, PNM and Radiance files, told apart by their
//! content, not by their suffix.
//!
//! Everything becomes 8-bit, sRGB-encoded, with straight alpha. Samples of 16 bits are rounded,
//! floating-point samples are taken as linear and encoded. Color profiles are ignored.

mod convert;
mod decode;
mod encode;
mod exposure;
mod tiff_tags;

pub(crate) use decode::decode_radiance;
pub use decode::{
    image_dimensions, image_dimensions_upright, read_image, read_image_from, read_image_upright,
    read_mask,
};
pub use encode::{encode_jpeg, encode_png, write_png};
pub use exposure::exposure_stops;

#[cfg(test)]
mod tests;
