//! A look at the tags of a TIFF file before its decoder makes room for their values: it takes a
//! count of values on trust, up to 256 MB.

/// The first tag of the first directory that claims more values than the file has bytes for.
pub(super) fn tag_beyond_file(bytes: &[u8]) -> Option<u64> {
    let big_endian = bytes.starts_with(b"MM");
    let number = |at: usize, size: usize| -> Option<u64> {
        let field = bytes.get(at..at.checked_add(size)?)?;
        let fold = |value: u64, byte: &u8| (value << 8) | u64::from(*byte);
        Some(if big_endian { field.iter().fold(0, fold) } else { field.iter().rev().fold(0, fold) })
    };
    // BigTIFF has 8-byte counts and offsets.
    let big = number(2, 2)? == 43;
    let (offset_at, wide) = if big { (8, 8) } else { (4, 4) };
    let (count_size, entry_size) = if big { (8, 20) } else { (2, 12) };
    let directory = usize::try_from(number(offset_at, wide)?).ok()?;
    let entries = number(directory, count_size)?;
    let mut at = directory.checked_add(count_size)?;
    for _ in 0..entries {
        let (tag, kind, count) = (number(at, 2)?, number(at + 2, 2)?, number(at + 4, wide)?);
        let value_size = match kind {
            3 | 8 => 2,
            4 | 9 | 11 | 13 => 4,
            5 | 10 | 12 | 16..=18 => 8,
            _ => 1,
        };
        if count.saturating_mul(value_size) > bytes.len() as u64 {
            return Some(tag);
        }
        at += entry_size;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::tag_beyond_file;

    #[test]
    fn counts_are_compared_with_the_length_of_the_file() {
        let mut file = b"II*\0\x08\0\0\0\x01\0\x11\x01\x04\0".to_vec();
        file.extend(5u32.to_le_bytes());
        file.extend([0; 8]);
        assert_eq!(file.len(), 26);
        assert_eq!(tag_beyond_file(&file), None);
        file[14..18].copy_from_slice(&7u32.to_le_bytes());
        assert_eq!(tag_beyond_file(&file), Some(0x111));
        let mut big =
            b"MM\0\x2b\0\x08\0\0\0\0\0\0\0\0\0\x10\0\0\0\0\0\0\0\x01\x01\x11\0\x10".to_vec();
        big.extend(u64::MAX.to_be_bytes());
        assert_eq!(tag_beyond_file(&big), Some(0x111));
        for end in 0..big.len() {
            assert_eq!(tag_beyond_file(&big[..end]), None);
        }
    }
}
