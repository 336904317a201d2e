//! Which network LPIPS runs, and on which range of values.

/// Which network.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum LpipsNet {
    /// AlexNet: fast, the LPIPS authors' choice for measuring
    #[default]
    Alex,
    /// VGG-16: the choice of the INRIA 3DGS paper
    Vgg,
}

/// What the network is fed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum LpipsRange {
    /// RGB rescaled to [-1, 1], as the authors intended
    #[default]
    Symmetric,
    /// RGB left in [0, 1], to compare with numbers of the INRIA 3DGS evaluation script
    Unit,
}
