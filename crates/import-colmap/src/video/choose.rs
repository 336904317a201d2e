//! The choice of frames.

use std::ops::RangeInclusive;

/// Image motion between neighbors that is aimed at, in image widths: they share nine tenths, and frames three apart still
/// two thirds.
const STEP: f64 = 0.1;
/// Numbers of frames that are chosen where the user names none.
const COUNTS: RangeInclusive<usize> = 24..=150;
/// Motion in image widths below which a frame counts as standing still: what noise looks like.
const STILL: f64 = 0.002;

/// Frames that become photos.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Chosen {
    /// Their indices among the frames that were looked at, ascending.
    pub(crate) frames: Vec<usize>,
    /// Image motion of the whole video, in image widths.
    pub(crate) motion: f64,
}

/// Chooses `wanted` frames, or as many as the motion asks for. `motions[k]` lies between frames `k` and `k + 1`; where it is not
/// known the median of the others stands for it.
///
/// Fewer frames than wanted where the camera moved so fast that a step holds none; none at all where it did not move.
pub(crate) fn choose(sharpness: &[f64], motions: &[Option<f64>], wanted: Option<usize>) -> Chosen {
    let usual = motes_math::median::median(motions.iter().flatten().copied()).unwrap_or(0.0);
    let mut path = vec![0.0];
    for motion in motions {
        let step = motion.unwrap_or(usual);
        let so_far = path.last().copied().unwrap_or(0.0);
        path.push(so_far + if step < STILL { 0.0 } else { step });
    }
    let motion = path.last().copied().unwrap_or(0.0);
    if motion <= 0.0 {
        return Chosen { frames: Vec::new(), motion };
    }
    let asked_for = (motion / STEP).ceil() as usize;
    let count = wanted.unwrap_or(asked_for.clamp(*COUNTS.start(), *COUNTS.end())).max(1);
    let bin_of = |at: f64| ((at / motion * count as f64) as usize).min(count - 1);
    let mut sharpest: Vec<Option<usize>> = vec![None; count];
    for (frame, (&at, &value)) in path.iter().zip(sharpness).enumerate() {
        let best = &mut sharpest[bin_of(at)];
        if best.is_none_or(|best| value > sharpness[best]) {
            *best = Some(frame);
        }
    }
    Chosen { frames: sharpest.into_iter().flatten().collect(), motion }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sharpest_frame_of_each_step_of_motion_is_taken() {
        // Stands still for 40 frames, then moves evenly for 60.
        let motions: Vec<Option<f64>> =
            (0..99).map(|k| Some(if k < 40 { 0.0005 } else { 0.05 })).collect();
        let sharpness: Vec<f64> = (0..100).map(|k| if k % 3 == 0 { 9.0 } else { 4.0 }).collect();
        let chosen = choose(&sharpness, &motions, Some(10));
        assert_eq!(chosen.frames.len(), 10);
        assert!(chosen.frames.iter().all(|k| k % 3 == 0), "{:?}", chosen.frames);
        assert_eq!(chosen.frames.iter().filter(|&&k| k < 40).count(), 1, "{:?}", chosen.frames);
        assert!((chosen.motion - 59.0 * 0.05).abs() < 1e-9);
        assert_eq!(choose(&sharpness, &motions, None).frames.len(), 30);
    }

    #[test]
    fn still_short_and_unknown_videos() {
        assert_eq!(choose(&[1.0; 9], &[Some(0.001); 8], Some(4)).frames, [0usize; 0]);
        assert_eq!(choose(&[], &[], None).frames, [0usize; 0]);
        assert_eq!(choose(&[1.0], &[], None).frames, [0usize; 0]);
        // A jump leaves bins without a frame; what is not known counts as usual.
        let jump = choose(&[1.0; 4], &[Some(0.1), Some(0.9), None], Some(12));
        assert_eq!(jump.frames, [0, 2, 3]);
    }
}
