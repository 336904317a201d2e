//! Scalar types of PLY properties and how their bytes and text become values.

use half::f16;

/// Byte order and kind of a PLY body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// Type of a PLY scalar. `F16` is not in the PLY document, but such files exist.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scalar {
    /// Signed 8-bit integer.
    I8,
    /// Unsigned 8-bit integer.
    U8,
    /// Signed 16-bit integer.
    I16,
    /// Unsigned 16-bit integer.
    U16,
    /// Signed 32-bit integer.
    I32,
    /// Unsigned 32-bit integer.
    U32,
    /// Half-precision float.
    F16,
    /// Single-precision float.
    F32,
    /// Double-precision float.
    F64,
}

impl Scalar {
    pub(crate) fn from_name(name: &[u8]) -> Option<Self> {
        Some(match name {
            b"char" | b"int8" => Self::I8,
            b"uchar" | b"uint8" => Self::U8,
            b"short" | b"int16" => Self::I16,
            b"ushort" | b"uint16" => Self::U16,
            b"int" | b"int32" => Self::I32,
            b"uint" | b"uint32" => Self::U32,
            b"half" | b"float16" => Self::F16,
            b"float" | b"float32" => Self::F32,
            b"double" | b"float64" => Self::F64,
            _ => return None,
        })
    }

    /// Bytes of one value.
    pub(crate) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 | Self::F16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    pub(crate) fn is_integer(self) -> bool {
        !matches!(self, Self::F16 | Self::F32 | Self::F64)
    }

    /// The value at the start of `bytes`, exact: every type fits into f64.
    ///
    /// # Panics
    /// When there are fewer bytes than the type has.
    pub fn decode(self, bytes: &[u8], big_endian: bool) -> f64 {
        fn first<const N: usize>(bytes: &[u8], big_endian: bool) -> [u8; N] {
            let mut value = [0; N];
            value.copy_from_slice(&bytes[..N]);
            if big_endian {
                value.reverse();
            }
            value
        }
        match self {
            Self::I8 => f64::from(bytes[0] as i8),
            Self::U8 => f64::from(bytes[0]),
            Self::I16 => f64::from(i16::from_le_bytes(first(bytes, big_endian))),
            Self::U16 => f64::from(u16::from_le_bytes(first(bytes, big_endian))),
            Self::I32 => f64::from(i32::from_le_bytes(first(bytes, big_endian))),
            Self::U32 => f64::from(u32::from_le_bytes(first(bytes, big_endian))),
            Self::F16 => f64::from(f16::from_le_bytes(first(bytes, big_endian))),
            Self::F32 => f64::from(f32::from_le_bytes(first(bytes, big_endian))),
            Self::F64 => f64::from_le_bytes(first(bytes, big_endian)),
        }
    }

    /// Appends the little-endian bytes of the value that `token` spells. `None` when it does not
    /// spell a value of this type.
    pub(crate) fn encode_text(self, token: &str, bytes: &mut Vec<u8>) -> Option<()> {
        match self {
            // Parsed in its own precision: by way of f64 a value could be rounded twice.
            Self::F32 => bytes.extend(token.parse::<f32>().ok()?.to_le_bytes()),
            Self::F64 => bytes.extend(token.parse::<f64>().ok()?.to_le_bytes()),
            Self::F16 => bytes.extend(f16::from_f64(token.parse().ok()?).to_le_bytes()),
            _ => {
                // Some programs write integers as "255.0".
                let value: f64 = token.parse().ok()?;
                let within =
                    |low: f64, high: f64| value.fract() == 0.0 && (low..=high).contains(&value);
                match self {
                    Self::I8 if within(-128.0, 127.0) => bytes.push(value as i8 as u8),
                    Self::U8 if within(0.0, 255.0) => bytes.push(value as u8),
                    Self::I16 if within(-32768.0, 32767.0) => {
                        bytes.extend((value as i16).to_le_bytes());
                    }
                    Self::U16 if within(0.0, 65535.0) => bytes.extend((value as u16).to_le_bytes()),
                    Self::I32 if within(f64::from(i32::MIN), f64::from(i32::MAX)) => {
                        bytes.extend((value as i32).to_le_bytes());
                    }
                    Self::U32 if within(0.0, f64::from(u32::MAX)) => {
                        bytes.extend((value as u32).to_le_bytes());
                    }
                    _ => return None,
                }
            }
        }
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_of_either_order_decode() {
        for (scalar, little, value) in [
            (Scalar::I8, vec![0xff], -1.0),
            (Scalar::U8, vec![0xff], 255.0),
            (Scalar::I16, vec![0xfe, 0xff], -2.0),
            (Scalar::U16, vec![1, 2], 513.0),
            (Scalar::I32, (-70000i32).to_le_bytes().to_vec(), -70000.0),
            (Scalar::U32, u32::MAX.to_le_bytes().to_vec(), 4294967295.0),
            (Scalar::F16, vec![0x00, 0x3c], 1.0),
            (Scalar::F32, 0.1f32.to_le_bytes().to_vec(), f64::from(0.1f32)),
            (Scalar::F64, 0.1f64.to_le_bytes().to_vec(), 0.1),
        ] {
            assert_eq!(scalar.size(), little.len());
            assert_eq!(scalar.decode(&little, false), value, "{scalar:?}");
            let big: Vec<u8> = little.iter().rev().copied().collect();
            assert_eq!(scalar.decode(&big, true), value, "{scalar:?}");
            let mut text = Vec::new();
            // The shortest text of a float in its own precision.
            let token = if scalar == Scalar::F32 { "0.1".to_owned() } else { format!("{value}") };
            scalar.encode_text(&token, &mut text).unwrap();
            assert_eq!(text, little, "{scalar:?}");
        }
    }

    #[test]
    fn text_out_of_range_is_refused() {
        for (scalar, token) in [
            (Scalar::U8, "256"),
            (Scalar::U8, "-1"),
            (Scalar::U8, "1.5"),
            (Scalar::I32, "1e10"),
            (Scalar::U16, "nan"),
            (Scalar::F32, "one"),
            (Scalar::F32, ""),
        ] {
            assert_eq!(scalar.encode_text(token, &mut Vec::new()), None, "{scalar:?} {token}");
        }
        assert!(Scalar::U8.encode_text("255.0", &mut Vec::new()).is_some());
        assert!(Scalar::F32.encode_text("-NaN", &mut Vec::new()).is_some());
    }
}
