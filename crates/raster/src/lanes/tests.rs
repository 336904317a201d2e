//! Lanes against the standard library and against indexing.

use fearless_simd::{Level, Simd, dispatch};

use super::*;
use crate::SimdLevel;

/// The instruction sets that this machine has.
pub(crate) fn levels() -> Vec<Level> {
    use SimdLevel::{Avx2, Avx512, Baseline, Best, Sse42};
    [Best, Avx512, Avx2, Sse42, Baseline].iter().filter_map(|level| level.level()).collect()
}

#[inline(always)]
fn apply<S: Simd>(simd: S, x: f32) -> [f32; 3] {
    let x = S::f32s::simd_from(simd, x);
    [exp(simd, x), log2::<S>(x), sigmoid(simd, x)].map(|v| v.as_slice()[S::f32s::LEN - 1])
}

#[test]
fn functions_are_those_of_the_standard_library() {
    for level in levels() {
        let of = |x: f32| dispatch!(level, simd => apply(simd, x));
        for i in -870..=870 {
            let x = i as f32 * 0.1;
            let exact = f64::from(x).exp();
            assert!((f64::from(of(x)[0]) / exact - 1.0).abs() < 3e-7, "exp {x}: {}", of(x)[0]);
            let exact = 1.0 / (1.0 + (-f64::from(x)).exp());
            assert!((f64::from(of(x)[2]) / exact - 1.0).abs() < 4e-7, "sigmoid {x}");
        }
        for i in 1..4000 {
            let x = i as f32 * 1e-3;
            let exact = f64::from(x).log2();
            let error = (f64::from(of(x)[1]) - exact).abs();
            assert!(error < 3e-7 * exact.abs().max(1.0), "log2 {x}: {error:e}");
        }
    }
}

#[test]
fn functions_at_their_ends() {
    for level in levels() {
        let of = |x: f32| dispatch!(level, simd => apply(simd, x));
        assert_eq!(
            [0.0, 1e9, f32::INFINITY].map(|x| of(x)[0]),
            [1.0, f32::INFINITY, f32::INFINITY]
        );
        assert_eq!([-1e9, -88.0, f32::NEG_INFINITY].map(|x| of(x)[0]), [0.0; 3]);
        assert!(of(f32::NAN)[0].is_nan() && of(f32::NAN)[2].is_nan());
        assert_eq!(
            [f32::NEG_INFINITY, -1e4, 1e4, f32::INFINITY].map(|x| of(x)[2]),
            [0., 0., 1., 1.]
        );
        assert_eq!(of(1.0)[1], 0.0);
    }
}

#[inline(always)]
fn there_and_back<S: Simd>(simd: S, source: &[f32], columns: usize, stride: usize) -> Vec<f32> {
    let n = S::f32s::LEN;
    let zero = S::f32s::simd_from(simd, 0.0);
    let mut out = [zero; 80];
    let rows: [u32; MAX_LANES] = std::array::from_fn(|lane| lane as u32 * 7 % 5);
    gather_columns(simd, source, stride, 0, &rows[..n], columns, &mut out);
    for (column, v) in out.iter().take(columns).enumerate() {
        for (lane, v) in v.as_slice().iter().enumerate() {
            assert_eq!(
                *v,
                source[rows[lane] as usize * stride + column],
                "column {column} lane {lane} of {n}"
            );
        }
    }
    let mut back = vec![-1.0; 5 * columns];
    // The first four lanes name four rows.
    scatter_columns::<S>(&mut out, &mut back, &rows[..4], columns);
    back
}

#[test]
fn padding_repeats_the_last_row() {
    let padded = Padded::new((0..21).collect());
    let vectors: Vec<_> = padded.vectors(8).collect();
    assert_eq!(vectors.len(), 3);
    assert_eq!(vectors[2], (&[16, 17, 18, 19, 20, 20, 20, 20][..], 5));
    assert_eq!(Padded::new(Vec::new()).vectors(4).count(), 0);
}

#[test]
fn rows_go_to_lanes_and_back() {
    for level in levels() {
        for (columns, stride) in [(3, 3), (12, 12), (9, 48), (27, 27), (48, 48), (75, 75)] {
            let source: Vec<f32> = (0..5 * stride).map(|i| i as f32).collect();
            let back = dispatch!(level, simd => there_and_back(simd, &source, columns, stride));
            for (i, b) in back.iter().enumerate() {
                let (row, column) = (i / columns, i % columns);
                let a = if row == 3 { -1.0 } else { source[row * stride + column] };
                assert_eq!(*b, a, "{columns} of {stride}: {i}");
            }
        }
    }
}
