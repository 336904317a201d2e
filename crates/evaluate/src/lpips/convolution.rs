//! Convolution as matrix multiplication (im2col), and max pooling.

use rayon::prelude::*;

/// Features `[channels, height, width]`.
#[derive(Clone, Debug)]
pub(super) struct FeatureMap {
    pub(super) channels: usize,
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) values: Vec<f32>,
}

/// A convolution with zero padding.
#[derive(Clone, Debug)]
pub(super) struct Convolution {
    pub(super) inputs: usize,
    pub(super) outputs: usize,
    pub(super) kernel: usize,
    pub(super) stride: usize,
    pub(super) padding: usize,
    /// `[outputs, inputs, kernel, kernel]`.
    pub(super) weights: Vec<f32>,
    /// `[outputs]`.
    pub(super) bias: Vec<f32>,
}

/// Output pixels whose patches are gathered at once: bounds the scratch memory (18 MB for the
/// widest VGG layer) and is fixed, so that results do not depend on the number of threads.
const CHUNK_PIXELS: usize = 1024;

impl Convolution {
    /// The rectified response, or `None` when no window fits.
    pub(super) fn apply_relu(&self, input: &FeatureMap) -> Option<FeatureMap> {
        let length = |n: usize| (n + 2 * self.padding).checked_sub(self.kernel);
        let width = length(input.width)? / self.stride + 1;
        let height = length(input.height)? / self.stride + 1;
        let pixels = width * height;
        let chunks: Vec<Vec<f32>> = (0..pixels.div_ceil(CHUNK_PIXELS))
            .into_par_iter()
            .map(|chunk| {
                let first = chunk * CHUNK_PIXELS;
                let count = CHUNK_PIXELS.min(pixels - first);
                let patches = self.gather(input, width, first, count);
                let rows = self.inputs * self.kernel * self.kernel;
                let mut out = multiply(&self.weights, &patches, self.outputs, rows, count);
                for (row, bias) in out.chunks_exact_mut(count).zip(&self.bias) {
                    row.iter_mut().for_each(|v| *v = (*v + bias).max(0.0));
                }
                out
            })
            .collect();
        let mut values = vec![0.0; self.outputs * pixels];
        for (chunk, out) in chunks.iter().enumerate() {
            let first = chunk * CHUNK_PIXELS;
            let count = out.len() / self.outputs;
            for (channel, row) in out.chunks_exact(count).enumerate() {
                let start = channel * pixels + first;
                values[start..start + count].copy_from_slice(row);
            }
        }
        Some(FeatureMap { channels: self.outputs, width, height, values })
    }

    /// The input patches under `count` output pixels from `first`, `[inputs * kernel², count]`.
    fn gather(&self, input: &FeatureMap, width: usize, first: usize, count: usize) -> Vec<f32> {
        let mut patches = vec![0.0; self.inputs * self.kernel * self.kernel * count];
        let mut rows = patches.chunks_exact_mut(count);
        for channel in 0..self.inputs {
            let plane = &input.values[channel * input.width * input.height..];
            for ky in 0..self.kernel {
                for kx in 0..self.kernel {
                    let Some(row) = rows.next() else { return patches };
                    for (i, value) in row.iter_mut().enumerate() {
                        let (y, x) = ((first + i) / width, (first + i) % width);
                        // Wrapping: left of or above the image becomes huge and fails the test.
                        let iy = (y * self.stride + ky).wrapping_sub(self.padding);
                        let ix = (x * self.stride + kx).wrapping_sub(self.padding);
                        if iy < input.height && ix < input.width {
                            *value = plane[iy * input.width + ix];
                        }
                    }
                }
            }
        }
        patches
    }
}

impl FeatureMap {
    /// The maximum of `size`×`size` windows every `stride` pixels, or `None` when none fits.
    pub(super) fn max_pool(&self, size: usize, stride: usize) -> Option<Self> {
        let width = self.width.checked_sub(size)? / stride + 1;
        let height = self.height.checked_sub(size)? / stride + 1;
        let mut values = Vec::with_capacity(self.channels * width * height);
        for plane in self.values.chunks_exact(self.width * self.height) {
            for y in 0..height {
                for x in 0..width {
                    let window = (0..size).flat_map(|dy| {
                        let start = (y * stride + dy) * self.width + x * stride;
                        &plane[start..start + size]
                    });
                    values.push(window.fold(f32::NEG_INFINITY, |m, &v| m.max(v)));
                }
            }
        }
        Some(Self { channels: self.channels, width, height, values })
    }
}

/// `a b` for row-major `a` `[rows, inner]` and `b` `[inner, columns]`.
#[expect(unsafe_code, reason = "matrixmultiply takes raw pointers; the lengths are checked here")]
fn multiply(a: &[f32], b: &[f32], rows: usize, inner: usize, columns: usize) -> Vec<f32> {
    assert_eq!(a.len(), rows * inner, "left matrix");
    assert_eq!(b.len(), inner * columns, "right matrix");
    let mut out = vec![0.0; rows * columns];
    // SAFETY: row-major strides over slices whose lengths were just checked; `out` is not
    // aliased, being new.
    unsafe {
        matrixmultiply::sgemm(
            rows,
            inner,
            columns,
            1.0,
            a.as_ptr(),
            inner as isize,
            1,
            b.as_ptr(),
            columns as isize,
            1,
            0.0,
            out.as_mut_ptr(),
            columns as isize,
            1,
        );
    }
    out
}
