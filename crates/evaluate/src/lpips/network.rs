//! The convolutional parts of the two networks that LPIPS is defined on.
use super::options::LpipsNet;

/// One step through a network; every convolution is followed by a rectifier.
#[derive(Clone, Copy, Debug)]
pub(super) enum Step {
    /// Convolution number `feature` in torchvision's `features`.
    Convolution { feature: usize, kernel: usize, stride: usize, padding: usize },
    /// Maximum over `size`×`size` windows at a stride of 2, no padding.
    MaxPool { size: usize },
    /// The features here enter the distance.
    Tap,
}

const fn conv(feature: usize, kernel: usize, stride: usize, padding: usize) -> Step {
    Step::Convolution { feature, kernel, stride, padding }
}

const ALEX: &[Step] = &[
    conv(0, 11, 4, 2),
    Step::Tap,
    Step::MaxPool { size: 3 },
    conv(3, 5, 1, 2),
    Step::Tap,
    Step::MaxPool { size: 3 },
    conv(6, 3, 1, 1),
    Step::Tap,
    conv(8, 3, 1, 1),
    Step::Tap,
    conv(10, 3, 1, 1),
    Step::Tap,
];

const VGG: &[Step] = &[
    conv(0, 3, 1, 1),
    conv(2, 3, 1, 1),
    Step::Tap,
    Step::MaxPool { size: 2 },
    conv(5, 3, 1, 1),
    conv(7, 3, 1, 1),
    Step::Tap,
    Step::MaxPool { size: 2 },
    conv(10, 3, 1, 1),
    conv(12, 3, 1, 1),
    conv(14, 3, 1, 1),
    Step::Tap,
    Step::MaxPool { size: 2 },
    conv(17, 3, 1, 1),
    conv(19, 3, 1, 1),
    conv(21, 3, 1, 1),
    Step::Tap,
    Step::MaxPool { size: 2 },
    conv(24, 3, 1, 1),
    conv(26, 3, 1, 1),
    conv(28, 3, 1, 1),
    Step::Tap,
];

impl LpipsNet {
    /// The name on the command line and in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Alex => "alex",
            Self::Vgg => "vgg",
        }
    }

    pub(super) fn steps(self) -> &'static [Step] {
        match self {
            Self::Alex => ALEX,
            Self::Vgg => VGG,
        }
    }
}
