//! Values of an accessor, found and checked before anything is made of them.

use std::path::Path;

use super::document::{Accessor, Gltf};
use motes_formats::error::{FormatError, Result};

/// An accessor whose bytes are there.
pub(super) struct Values<'a> {
    data: &'a [u8],
    stride: usize,
    component: Component,
    normalized: bool,
    pub(super) count: usize,
}

#[derive(Clone, Copy)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn of(number: u32) -> Option<Self> {
        Some(match number {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return None,
        })
    }

    fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }
}

impl<'a> Values<'a> {
    /// The values of accessor `index`, which must have `shape` (`SCALAR`, `VEC3`, …).
    pub(super) fn find(
        gltf: &Gltf,
        buffers: &'a [Vec<u8>],
        index: usize,
        shape: &str,
        path: &Path,
    ) -> Result<Self> {
        let place = format!("accessors[{index}]");
        let fault = |cause: String| FormatError::invalid(path, place.clone(), cause);
        let accessor: &Accessor =
            gltf.accessors.get(index).ok_or_else(|| fault("it does not exist".into()))?;
        if accessor.shape != shape {
            return Err(fault(format!("its type is {:?} instead of {shape}", accessor.shape)));
        }
        if accessor.sparse.is_some() {
            return Err(FormatError::not_supported(path, place, "sparse accessors"));
        }
        let width = match shape {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            _ => 4,
        };
        let component = Component::of(accessor.component_type)
            .ok_or_else(|| fault(format!("{} is not a component type", accessor.component_type)))?;
        let view = accessor.buffer_view.and_then(|view| gltf.buffer_views.get(view));
        let view = view.ok_or_else(|| fault("it has no buffer view".into()))?;
        let buffer =
            buffers.get(view.buffer).ok_or_else(|| fault("its buffer does not exist".into()))?;
        let tight = component.bytes() * width;
        let stride = view.byte_stride.map_or(tight, |stride| stride as usize);
        let end = view.byte_offset.checked_add(view.byte_length);
        let range = end.filter(|end| *end <= buffer.len() as u64).ok_or_else(|| {
            fault(format!("its buffer view ends beyond the {} bytes of the buffer", buffer.len()))
        })?;
        let data = &buffer[view.byte_offset as usize..range as usize];
        // The last value needs no padding behind it.
        let needed = accessor
            .count
            .checked_sub(1)
            .map_or(Some(0), |n| n.checked_mul(stride as u64)?.checked_add(tight as u64))
            .and_then(|bytes| bytes.checked_add(accessor.byte_offset));
        if stride < tight || needed.is_none_or(|needed| needed > data.len() as u64) {
            let cause = format!(
                "{} values do not fit into the {} bytes of its buffer view",
                accessor.count,
                data.len()
            );
            return Err(fault(cause));
        }
        Ok(Self {
            data: &data[accessor.byte_offset as usize..],
            stride,
            component,
            normalized: accessor.normalized,
            count: accessor.count as usize,
        })
    }

    /// Component `k` of value `i`.
    pub(super) fn get(&self, i: usize, k: usize) -> f32 {
        let at = i * self.stride + k * self.component.bytes();
        let bytes = &self.data[at..at + self.component.bytes()];
        let scaled = |value: f32, most: f32| if self.normalized { value / most } else { value };
        match self.component {
            Component::I8 => scaled(f32::from(bytes[0] as i8), 127.0).max(if self.normalized {
                -1.0
            } else {
                f32::MIN
            }),
            Component::U8 => scaled(f32::from(bytes[0]), 255.0),
            Component::I16 => {
                let value = f32::from(i16::from_le_bytes([bytes[0], bytes[1]]));
                scaled(value, 32767.0).max(if self.normalized { -1.0 } else { f32::MIN })
            }
            Component::U16 => scaled(f32::from(u16::from_le_bytes([bytes[0], bytes[1]])), 65535.0),
            Component::U32 => u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]) as f32,
            Component::F32 => f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
        }
    }

    /// Value `i` as an index, without the rounding of a float.
    pub(super) fn index(&self, i: usize) -> u32 {
        let bytes = &self.data[i * self.stride..];
        match self.component {
            Component::U32 => u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
            _ => self.get(i, 0) as u32,
        }
    }

    /// Value `i` as a vector.
    pub(super) fn vector<const N: usize>(&self, i: usize) -> [f32; N] {
        std::array::from_fn(|k| self.get(i, k))
    }
}
