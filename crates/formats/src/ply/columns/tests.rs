//! Files of several blocks and many tasks: bytes that are made here, row by row, against what is read and written.

use std::path::Path;

use motes_scene::{ColumnValues, Gaussians};

use crate::ply::{PlyWriteOptions, open_gaussians, read_gaussians_from, write_gaussians_to};

/// More than a block of four megabytes, and no multiple of anything.
const ROWS: usize = 17_777;
/// From this row on one normal is not zero; it lies in the second block.
const FIRST_NORMAL: usize = 17_000;

/// The columns that motes writes at SH degree 3, in its order.
fn standard() -> Vec<String> {
    let mut names: Vec<String> = ["x", "y", "z", "nx", "ny", "nz"].map(String::from).to_vec();
    names.extend((0..3).map(|i| format!("f_dc_{i}")));
    names.extend((0..45).map(|i| format!("f_rest_{i}")));
    names.push("opacity".into());
    names.extend((0..3).map(|i| format!("scale_{i}")));
    names.extend((0..4).map(|i| format!("rot_{i}")));
    names
}

fn column_of(name: &str) -> usize {
    standard().iter().position(|n| n == name).unwrap()
}

/// A number of its own for every value: exact in single precision.
fn value_at(row: usize, name: &str, column: usize) -> f32 {
    match name {
        "nx" | "nz" => 0.0,
        "ny" if row < FIRST_NORMAL => 0.0,
        _ => (row * 64 + column + 1) as f32,
    }
}

fn value(row: usize, name: &str) -> f32 {
    value_at(row, name, column_of(name))
}

fn file(names: &[String], big_endian: bool) -> Vec<u8> {
    let order = if big_endian { "big" } else { "little" };
    let mut header = format!("ply\nformat binary_{order}_endian 1.0\n");
    header.push_str("comment motes format motes/gaussians 1.0\ncomment SH degree: 3\n");
    header.push_str(&format!("element vertex {ROWS}\n"));
    names.iter().for_each(|name| header.push_str(&format!("property float {name}\n")));
    let mut bytes = (header + "end_header\n").into_bytes();
    let columns: Vec<(&String, usize)> = names.iter().map(|name| (name, column_of(name))).collect();
    for row in 0..ROWS {
        for (name, column) in &columns {
            let value = value_at(row, name, *column);
            bytes.extend(if big_endian { value.to_be_bytes() } else { value.to_le_bytes() });
        }
    }
    bytes
}

fn check(gaussians: &Gaussians) {
    assert!(gaussians.is_consistent());
    assert_eq!((gaussians.len(), gaussians.sh_degree), (ROWS, 3));
    for row in (0..ROWS).step_by(7).chain(16_900..17_010) {
        let of = |names: &[&str]| names.iter().map(|n| value(row, n)).collect::<Vec<_>>();
        assert_eq!(gaussians.means[row][..], of(&["x", "y", "z"]), "row {row}");
        assert_eq!(gaussians.rotations[row][..], of(&["rot_0", "rot_1", "rot_2", "rot_3"]));
        assert_eq!(gaussians.log_scales[row][..], of(&["scale_0", "scale_1", "scale_2"]));
        assert_eq!(gaussians.opacity_logits[row], value(row, "opacity"));
        let sh = gaussians.sh_of(row);
        assert_eq!(sh[..3], of(&["f_dc_0", "f_dc_1", "f_dc_2"]));
        // Coefficient 5 of green, 15 of blue.
        assert_eq!([sh[16], sh[47]], of(&["f_rest_19", "f_rest_44"])[..], "row {row}");
    }
    let mut normals: Vec<_> = gaussians.extra.iter().collect();
    normals.sort_by(|a, b| a.name.cmp(&b.name));
    let names: Vec<&str> = normals.iter().map(|column| column.name.as_str()).collect();
    assert_eq!(names, ["nx", "ny", "nz"]);
    assert_eq!(normals[0].values, ColumnValues::F32(vec![0.0; ROWS]));
    let ny: Vec<f32> = (0..ROWS).map(|row| value(row, "ny")).collect();
    assert_eq!(normals[1].values, ColumnValues::F32(ny));
}

#[test]
fn values_find_their_place_across_blocks_whatever_the_order() {
    let name = Path::new("t.ply");
    let plain = file(&standard(), false);
    let gaussians = read_gaussians_from(plain.as_slice(), name).unwrap().gaussians;
    check(&gaussians);
    // Of a file, whose size is known.
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.ply");
    std::fs::write(&path, &plain).unwrap();
    assert_eq!(open_gaussians(&path).unwrap().gaussians, gaussians);

    let mut written = Vec::new();
    write_gaussians_to(&mut written, &gaussians, &PlyWriteOptions::default(), name).unwrap();
    assert!(written == plain, "what was read is written, byte for byte");

    let reversed: Vec<String> = standard().into_iter().rev().collect();
    for big_endian in [false, true] {
        let bytes = file(&reversed, big_endian);
        check(&read_gaussians_from(bytes.as_slice(), name).unwrap().gaussians);
    }
}

#[test]
fn a_file_that_ends_in_its_second_block_names_the_row() {
    let mut bytes = file(&standard(), false);
    let row_bytes = 4 * standard().len();
    bytes.truncate(bytes.len() - (ROWS - FIRST_NORMAL) * row_bytes + 5);
    let error = read_gaussians_from(bytes.as_slice(), Path::new("t.ply")).unwrap_err();
    let said = error.to_string();
    assert!(said.contains(&format!("row {FIRST_NORMAL} of the {ROWS}")), "{said}");
}
