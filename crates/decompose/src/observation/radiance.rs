//! The pixels of a photo as linear radiance.

use glam::Vec3;
use motes_scene::ImageF32;

/// Linear radiance of every pixel of a photo, row by row.
///
/// A photo has 256 values per channel. Those are kept, with a table of what they stand for: all photos are in memory at once.
#[derive(Clone, Debug, PartialEq)]
pub struct Radiance {
    size: [usize; 2],
    pixels: Pixels,
}

#[derive(Clone, Debug, PartialEq)]
enum Pixels {
    /// Values of the photo, and what each stands for per channel.
    Bytes(Vec<[u8; 3]>, Box<[[f32; 256]; 3]>),
    Floats(Vec<[f32; 3]>),
}

impl Radiance {
    /// Of a picture `[h, w, 3]` of bytes, `linear` being what each value stands for in every channel.
    ///
    /// # Panics
    /// When the number of pixels is not that of the size.
    pub fn of_bytes([width, height]: [usize; 2], values: Vec<[u8; 3]>, linear: [f32; 256]) -> Self {
        assert_eq!(values.len(), width * height);
        Self { size: [width, height], pixels: Pixels::Bytes(values, Box::new([linear; 3])) }
    }

    /// Number of pixels.
    pub fn count(&self) -> usize {
        self.size[0] * self.size[1]
    }

    /// The radiance of pixel `i`.
    #[inline]
    pub fn at(&self, i: usize) -> Vec3 {
        match &self.pixels {
            Pixels::Bytes(values, linear) => {
                let [r, g, b] = linear.as_ref();
                let [x, y, z] = values[i].map(usize::from);
                Vec3::new(r[x], g[y], b[z])
            }
            Pixels::Floats(values) => values[i].into(),
        }
    }

    /// All pixels.
    pub fn pixels(&self) -> impl ExactSizeIterator<Item = Vec3> {
        (0..self.count()).map(|i| self.at(i))
    }

    /// As an image `[h, w, 3]`.
    pub fn image(&self) -> ImageF32 {
        let data = self.pixels().flat_map(|v| v.to_array()).collect();
        ImageF32::from_data(self.size[0], self.size[1], 3, data)
    }

    /// Every value turned into another; of a photo's bytes, each of the 256 once per channel.
    pub(crate) fn turned<F: Fn(usize, f32) -> f32>(&self, of: F) -> Turned<'_, F> {
        match &self.pixels {
            Pixels::Bytes(values, linear) => {
                let turn = |c: usize| std::array::from_fn(|v| of(c, linear[c][v]));
                Turned::Bytes(values, Box::new(std::array::from_fn(turn)))
            }
            Pixels::Floats(values) => Turned::Floats(values, of),
        }
    }

    /// Changes every value by the number of its channel and itself.
    pub fn map(&mut self, of: impl Fn(usize, f32) -> f32) {
        let change = |values: &mut [f32; 3]| {
            values.iter_mut().enumerate().for_each(|(c, v)| *v = of(c, *v));
        };
        match &mut self.pixels {
            Pixels::Bytes(_, linear) => {
                let tables = linear.iter_mut().enumerate();
                tables.for_each(|(c, table)| table.iter_mut().for_each(|v| *v = of(c, *v)));
            }
            Pixels::Floats(values) => values.iter_mut().for_each(change),
        }
    }

    /// The pixels as numbers of their own, which takes four times the memory.
    pub fn floats_mut(&mut self) -> &mut [[f32; 3]] {
        if let Pixels::Bytes(..) = self.pixels {
            self.pixels = Pixels::Floats(self.pixels().map(|v| v.to_array()).collect());
        }
        match &mut self.pixels {
            Pixels::Floats(values) => values,
            Pixels::Bytes(..) => &mut [],
        }
    }
}

/// Values of a [`Radiance`] turned into others.
pub(crate) enum Turned<'a, F> {
    /// Values of the photo, and what each is turned into per channel.
    Bytes(&'a [[u8; 3]], Box<[[f32; 256]; 3]>),
    /// Turned as they are asked for.
    Floats(&'a [[f32; 3]], F),
}

impl<F: Fn(usize, f32) -> f32> Turned<'_, F> {
    /// Of channel `c` of pixel `i`.
    #[inline]
    pub(crate) fn at(&self, i: usize, c: usize) -> f32 {
        match self {
            Self::Bytes(values, table) => table[c][usize::from(values[i][c])],
            Self::Floats(values, of) => of(c, values[i][c]),
        }
    }
}

impl From<ImageF32> for Radiance {
    /// Of an image with three channels.
    fn from(image: ImageF32) -> Self {
        let values = image.data.as_chunks().0.to_vec();
        Self { size: [image.width, image.height], pixels: Pixels::Floats(values) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_and_floats_are_the_same_radiance() {
        let linear: [f32; 256] = std::array::from_fn(|v| (v as f32 / 255.0).powf(2.2));
        let values: Vec<[u8; 3]> = (0..6).map(|k| [k, 40 * k, 255 - k]).collect();
        let mut bytes = Radiance::of_bytes([3, 2], values, linear);
        let mut floats = Radiance::from(bytes.image());
        let change = |c: usize, v: f32| (v * [0.5, 1.0, 3.0][c]).min(0.9);
        let turned = [&bytes, &floats].map(|radiance| radiance.turned(change));
        for (i, c) in (0..6).flat_map(|i| [0, 1, 2].map(|c| (i, c))) {
            let turned = [turned[0].at(i, c), turned[1].at(i, c)];
            assert_eq!(turned, [change(c, bytes.at(i)[c]); 2], "{i} {c}");
        }
        bytes.map(change);
        floats.map(change);
        assert_eq!(bytes.image(), floats.image());
        assert_eq!(bytes.at(4), Vec3::new(0.5 * linear[4], linear[160].min(0.9), 0.9));
        bytes.floats_mut()[4] = [7.0; 3];
        assert_eq!((bytes.at(4), bytes.at(3)), (Vec3::splat(7.0), floats.at(3)));
    }
}
