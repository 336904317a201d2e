//! Cryptomatte: which object covers how much of each pixel, in channels that compositors read.
//!
//! Friedman and Jones 2015, "Fully automatic ID mattes with support for motion blur and transparency", and the
//! specification that Psyop published with it: the id of an object is MurmurHash3 (x86, 32 bit, seed 0) of its
//! name, as a float32; channels hold pairs of id and coverage, the most covering first; a manifest in the header
//! names the ids.

use motes_formats::exr_aov::AovChannel;
use motes_raster::{RenderOptions, render_scalars};
use motes_scene::{Gaussians, Pinhole, Pose};

/// Name of the layer.
const LAYER: &str = "CryptoObject";
/// Objects that one pixel may hold: 3 layers of 2.
const RANKS: usize = 6;
/// Coverage below this is left out: less than a step of an 8-bit matte.
const LEAST: f32 = 1.0 / 512.0;

/// Named sets of Gaussians.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MatteObjects {
    /// Name and, per Gaussian, 1 where it belongs.
    pub objects: Vec<(String, Vec<f32>)>,
}

impl MatteObjects {
    /// Channels of a picture, and the attributes of its header.
    pub fn channels(
        &self,
        gaussians: &Gaussians,
        camera: &Pinhole,
        camera_from_world: &Pose,
        options: &RenderOptions,
    ) -> Vec<AovChannel> {
        let pixels = camera.width * camera.height;
        let mut ranks = vec![[(0.0f32, 0.0f32); RANKS]; pixels];
        for chunk in self.objects.chunks(3) {
            let planes: Vec<&[f32]> = chunk.iter().map(|o| o.1.as_slice()).collect();
            let picture = render_scalars(gaussians, &planes, camera, camera_from_world, options);
            for (k, (name, _)) in chunk.iter().enumerate() {
                let id = id_of(name);
                for (ranks, pixel) in ranks.iter_mut().zip(picture.data.chunks_exact(3)) {
                    insert(ranks, id, pixel[k].min(1.0));
                }
            }
        }
        let mut channels = Vec::new();
        for layer in 0..RANKS / 2 {
            for (k, suffix) in ["R", "G", "B", "A"].into_iter().enumerate() {
                let rank = 2 * layer + k / 2;
                let value =
                    |r: &[(f32, f32); RANKS]| if k % 2 == 0 { r[rank].0 } else { r[rank].1 };
                let values = ranks.iter().map(value).collect();
                channels.push(AovChannel::float(format!("{LAYER}{layer:02}.{suffix}"), values));
            }
        }
        channels
    }

    /// The attributes of the header, `cryptomatte/KEY/...`.
    pub fn attributes(&self) -> Vec<(String, String)> {
        let key = format!("{:08x}", murmur3(LAYER.as_bytes()));
        let entries: Vec<String> = self
            .objects
            .iter()
            .map(|(name, _)| {
                let name = serde_json::Value::from(name.as_str());
                format!("{name}:\"{:08x}\"", id_of(name.as_str().unwrap_or("")).to_bits())
            })
            .collect();
        [
            ("name", LAYER.to_owned()),
            ("hash", "MurmurHash3_32".to_owned()),
            ("conversion", "uint32_to_float32".to_owned()),
            ("manifest", format!("{{{}}}", entries.join(","))),
        ]
        .map(|(name, value)| (format!("cryptomatte/{}/{name}", &key[..7]), value))
        .to_vec()
    }
}

/// Puts an object in its place by coverage; equal ones stay in their order.
fn insert(ranks: &mut [(f32, f32); RANKS], id: f32, coverage: f32) {
    if !(coverage >= LEAST) {
        return;
    }
    if let Some(at) = ranks.iter().position(|r| r.1 < coverage) {
        ranks[at..].rotate_right(1);
        ranks[at] = (id, coverage);
    }
}

/// The id of a name: its hash as a float, with one bit of the exponent turned where the float would be
/// no number, zero or subnormal.
fn id_of(name: &str) -> f32 {
    let hash = murmur3(name.as_bytes());
    let exponent = hash >> 23 & 0xff;
    f32::from_bits(if exponent == 0 || exponent == 255 { hash ^ 1 << 23 } else { hash })
}

/// MurmurHash3, x86, 32 bit, seed 0 (Appleby, public domain).
fn murmur3(bytes: &[u8]) -> u32 {
    let mix = |k: u32| k.wrapping_mul(0xcc9e_2d51).rotate_left(15).wrapping_mul(0x1b87_3593);
    let mut h = 0u32;
    let chunks = bytes.chunks_exact(4);
    let rest = chunks.remainder();
    for chunk in chunks {
        h ^= mix(u32::from_le_bytes([chunk[0], chunk[1], chunk[2], chunk[3]]));
        h = h.rotate_left(13).wrapping_mul(5).wrapping_add(0xe654_6b64);
    }
    let tail = rest.iter().rev().fold(0u32, |k, &b| k << 8 | u32::from(b));
    if !rest.is_empty() {
        h ^= mix(tail);
    }
    h ^= bytes.len() as u32;
    h = (h ^ h >> 16).wrapping_mul(0x85eb_ca6b);
    h = (h ^ h >> 13).wrapping_mul(0xc2b2_ae35);
    h ^ h >> 16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hashes_are_those_that_were_published() {
        // Test vectors of MurmurHash3_x86_32 with seed 0, and of the Cryptomatte specification.
        assert_eq!(murmur3(b""), 0);
        assert_eq!(murmur3(b"hello"), 0x248b_fa47);
        assert_eq!(murmur3(b"hello, world"), 0x149b_bb7f);
        assert_eq!(murmur3(b"The quick brown fox jumps over the lazy dog"), 0x2e4f_f723);
        for i in 0..20_000 {
            assert!(id_of(&format!("object_{i}")).is_normal());
        }
    }

    #[test]
    fn the_most_covering_object_comes_first() {
        let mut ranks = [(0.0, 0.0); RANKS];
        for (id, coverage) in [(1.0, 0.2), (2.0, 0.5), (3.0, 0.3), (4.0, 0.0), (5.0, f32::NAN)] {
            insert(&mut ranks, id, coverage);
        }
        assert_eq!(ranks[..4], [(2.0, 0.5), (3.0, 0.3), (1.0, 0.2), (0.0, 0.0)]);
    }

    #[test]
    fn the_manifest_names_the_ids() {
        let object = |name: &str| (name.to_owned(), Vec::new());
        let matte = MatteObjects { objects: vec![object("bun\"ny"), object("hello")] };
        let attributes = matte.attributes();
        let manifest = &attributes.iter().find(|a| a.0.ends_with("/manifest")).unwrap().1;
        let parsed: serde_json::Value = serde_json::from_str(manifest).unwrap();
        assert_eq!(parsed["hello"], "248bfa47");
        assert!(parsed["bun\"ny"].is_string());
        assert!(
            attributes
                .iter()
                .all(|a| a.0.starts_with("cryptomatte/") && a.0[12..].find('/') == Some(7))
        );
    }
}
