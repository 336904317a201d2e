//! Where the networks run.

use candle_core::{DType, Device};
use clap::ValueEnum;
use serde::{Deserialize, Serialize};

use crate::error::{DiffusionError, Result};

/// Where the networks run
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DeviceChoice {
    /// A GPU that this program was built for, otherwise the CPU
    Auto,
    /// The CPU
    Cpu,
    /// The first GPU of NVIDIA
    Cuda,
    /// The GPU of Apple
    Metal,
}

/// Numbers of the UNet
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Precision {
    /// 32 bits
    F32,
    /// 16 bits, IEEE
    F16,
    /// 16 bits with the range of 32
    Bf16,
}

impl DeviceChoice {
    /// The device.
    ///
    /// # Errors
    /// It is not there, or the program was built without it.
    pub fn open(self) -> Result<Device> {
        let absent = |name: &str, feature: &str, cause: String| {
            let cause = format!("the device {name} is not there: {cause}");
            DiffusionError::picture(
                cause,
                format!("--device cpu, or build with FEATURES={feature}"),
            )
        };
        match self {
            Self::Cpu => Ok(Device::Cpu),
            Self::Cuda => Device::new_cuda(0).map_err(|e| absent("cuda", "cuda", first_line(&e))),
            Self::Metal => {
                Device::new_metal(0).map_err(|e| absent("metal", "metal", first_line(&e)))
            }
            Self::Auto => {
                let cuda = cfg!(feature = "cuda").then(|| Device::new_cuda(0).ok()).flatten();
                let metal = cfg!(feature = "metal").then(|| Device::new_metal(0).ok()).flatten();
                Ok(cuda.or(metal).unwrap_or(Device::Cpu))
            }
        }
    }
}

fn first_line(error: &candle_core::Error) -> String {
    error.to_string().lines().next().unwrap_or_default().to_owned()
}

impl Precision {
    /// The type of the numbers; where none was chosen, 16 bits on a GPU.
    pub fn dtype(chosen: Option<Self>, device: &Device) -> DType {
        match chosen {
            Some(Self::F32) => DType::F32,
            Some(Self::F16) => DType::F16,
            Some(Self::Bf16) => DType::BF16,
            None if device.is_cpu() => DType::F32,
            None => DType::F16,
        }
    }
}
