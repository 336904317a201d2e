use motes_scene::{ColumnValues, ExposureResponse, ExtraColumn, Gaussians, SparsePoints, Surface};

use super::*;

/// A file with one row; every column holds a number of its own.
fn ascii(columns: &[(&str, &str, &str)]) -> String {
    let mut text = String::from("ply\nformat ascii 1.0\nelement vertex 1\n");
    for (kind, name, _) in columns {
        text.push_str(&format!("property {kind} {name}\n"));
    }
    let values: Vec<&str> = columns.iter().map(|(_, _, value)| *value).collect();
    text + "end_header\n" + &values.join(" ") + "\n"
}

fn read(bytes: impl AsRef<[u8]>) -> GaussianFile {
    read_gaussians_from(bytes.as_ref(), Path::new("t.ply")).unwrap()
}

fn fault(bytes: impl AsRef<[u8]>) -> String {
    read_gaussians_from(bytes.as_ref(), Path::new("t.ply")).unwrap_err().to_string()
}

const SHAPE: [(&str, &str, &str); 8] = [
    ("float", "scale_0", "-1"),
    ("float", "scale_1", "-2"),
    ("float", "rot_3", "0.4"),
    ("float", "rot_2", "0.3"),
    ("float", "rot_1", "0.2"),
    ("float", "rot_0", "0.1"),
    ("double", "y", "2"),
    ("short", "z", "3"),
];

fn with_shape<'a>(more: &[(&'a str, &'a str, &'a str)]) -> Vec<(&'a str, &'a str, &'a str)> {
    let mut columns = SHAPE.to_vec();
    columns.extend(more);
    columns.extend([("half", "x", "0.5"), ("float", "opacity", "inf")]);
    columns
}

#[test]
fn columns_are_found_by_name_and_the_rest_is_carried() {
    let dc = [("float", "f_dc_2", "0.3"), ("float", "f_dc_0", "0.1"), ("float", "f_dc_1", "0.2")];
    let mut columns = with_shape(&dc);
    columns.extend([
        ("float", "scale_2", "nan"),
        ("uint", "label", "4294967295"),
        ("half", "h", "1"),
    ]);
    let Gaussians { means, rotations, log_scales, opacity_logits, sh_degree, sh, extra } =
        read(ascii(&columns)).gaussians;
    assert_eq!(means, [[0.5, 2.0, 3.0]]);
    assert_eq!(rotations, [[0.1, 0.2, 0.3, 0.4]]);
    assert_eq!(log_scales[0][..2], [-1.0, -2.0]);
    assert!(log_scales[0][2].is_nan());
    assert_eq!(opacity_logits, [f32::INFINITY]);
    assert_eq!((sh_degree, sh), (0, vec![0.1, 0.2, 0.3]));
    assert_eq!(extra[0].values, ColumnValues::U32(vec![u32::MAX]));
    assert_eq!(extra[1], ExtraColumn { name: "h".into(), values: ColumnValues::F32(vec![1.0]) });
}

#[test]
fn colors_stand_in_for_coefficients_and_flat_gaussians_get_a_thickness() {
    let rgb = [("uchar", "red", "255"), ("uchar", "green", "0"), ("uchar", "blue", "51")];
    let gaussians = read(ascii(&with_shape(&rgb))).gaussians;
    let color: Vec<f32> = gaussians.sh.iter().map(|dc| 0.5 + SH_C0 * dc).collect();
    for (found, expected) in color.iter().zip([1.0, 0.0, 0.2]) {
        assert!((found - expected).abs() < 1e-6, "{color:?}");
    }
    assert!(gaussians.extra.is_empty());
    assert_eq!(gaussians.log_scales, [[-1.0, -2.0, -2.0 + FLAT_LOG_RATIO]]);
}

#[test]
fn f_rest_is_channel_major_in_the_file() {
    let mut gaussians = Gaussians::empty(2);
    gaussians.means = vec![[0.0; 3]; 2];
    gaussians.rotations = vec![[1.0, 0.0, 0.0, 0.0]; 2];
    gaussians.log_scales = vec![[0.0; 3]; 2];
    gaussians.opacity_logits = vec![0.0; 2];
    gaussians.sh = (0..54).map(|v| v as f32).collect();
    let bytes = written(&gaussians);
    let floats = payload(&bytes);
    // Gaussian 0, red: coefficients 1 to 8 follow each other.
    assert_eq!(floats[9..17], [3.0, 6.0, 9.0, 12.0, 15.0, 18.0, 21.0, 24.0]);
    assert_eq!(floats[17], 4.0, "then green");
    assert_eq!(read(&bytes).gaussians, gaussians);
}

fn written(gaussians: &Gaussians) -> Vec<u8> {
    let mut bytes = Vec::new();
    let options = PlyWriteOptions::default();
    write_gaussians_to(&mut bytes, gaussians, &options, Path::new("t.ply")).unwrap();
    bytes
}

fn payload(bytes: &[u8]) -> Vec<f32> {
    let end = b"end_header\n";
    let at = bytes.windows(end.len()).position(|w| w == end).unwrap() + end.len();
    bytes[at..].as_chunks::<4>().0.iter().map(|c| f32::from_le_bytes(*c)).collect()
}

#[test]
fn normals_that_were_never_set_are_not_carried() {
    let dc = [("float", "f_dc_0", "0"), ("float", "f_dc_1", "0"), ("float", "f_dc_2", "0")];
    let mut columns = with_shape(&dc);
    columns.extend([("float", "nx", "0"), ("float", "ny", "0"), ("float", "nz", "0")]);
    assert!(read(ascii(&columns)).gaussians.extra.is_empty());
    columns.last_mut().unwrap().2 = "1";
    let gaussians = read(ascii(&columns)).gaussians;
    assert_eq!(gaussians.extra.len(), 3);
    let bytes = written(&gaussians);
    assert_eq!(payload(&bytes)[3..6], [0.0, 0.0, 1.0], "in INRIA's place");
    assert_eq!(read(&bytes).gaussians, gaussians);
}

#[test]
fn comments_tell_the_render_mode() {
    let dc = [("float", "f_dc_0", "0"), ("float", "f_dc_1", "0"), ("float", "f_dc_2", "0")];
    let text = ascii(&with_shape(&dc));
    for (comment, mode) in [
        ("SplatRenderMode: mip", Some(RenderMode::Mip)),
        ("SplatRenderMode: default", Some(RenderMode::Default)),
        ("antialiased 1", Some(RenderMode::Mip)),
        ("SplatRenderMode: other", None),
        ("nothing", None),
    ] {
        let text = text.replace("1.0\n", &format!("1.0\ncomment {comment}\n"));
        let file = read(text);
        assert_eq!((file.render_mode, file.comments), (mode, vec![comment.to_owned()]));
    }
    let options = PlyWriteOptions {
        render_mode: Some(RenderMode::Mip),
        exposure_response: Some(ExposureResponse {
            slope_per_stop: 0.1 + 0.2,
            reference_stops: -29.0 / 3.0,
        }),
        comments: vec!["two\nend_header".into()],
        ..PlyWriteOptions::default()
    };
    let mut bytes = Vec::new();
    write_gaussians_to(&mut bytes, &read(text).gaussians, &options, Path::new("t.ply")).unwrap();
    let file = read(bytes);
    assert_eq!(file.render_mode, Some(RenderMode::Mip));
    let expected = ["motes format motes/gaussians 1.0", "SH degree: 0", "SplatRenderMode: mip"];
    assert_eq!(file.comments[..3], expected);
    assert_eq!(file.comments[4], "two end_header");
    assert_eq!(file.exposure_response, options.exposure_response, "every bit survives");
}

#[test]
fn a_response_that_is_none_is_passed_over() {
    for comment in ["ExposureResponse: 1", "ExposureResponse: nan 0", "ExposureResponse: 1 2 3"] {
        assert_eq!(response_from_comments(&[comment.to_owned()]), None, "{comment}");
    }
    let comments = ["other".to_owned(), "ExposureResponse: 0.25 -9".to_owned()];
    let expected = ExposureResponse { slope_per_stop: 0.25, reference_stops: -9.0 };
    assert_eq!(response_from_comments(&comments), Some(expected));
}

#[test]
fn names_that_would_break_the_file_are_refused() {
    let mut gaussians = Gaussians::empty(0);
    for (name, expected) in [
        ("a b", "cannot have the name \"a b\""),
        ("", "cannot have the name"),
        ("f_rest_3", "\"f_rest_3\" is used twice"),
        ("opacity", "used twice"),
    ] {
        let values = ColumnValues::U8(vec![]);
        gaussians.extra = vec![ExtraColumn { name: name.into(), values }];
        let options = PlyWriteOptions::default();
        let error = write_gaussians_to(Vec::new(), &gaussians, &options, Path::new("t.ply"));
        let text = error.unwrap_err().to_string();
        assert!(text.contains(expected), "{text}");
    }
}

#[test]
fn a_file_of_another_kind_gets_a_hint() {
    let cloud = "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\n\
        property float z\nend_header\n";
    assert!(fault(cloud).contains("looks like a point cloud"));
    let mesh = cloud.replace("end_header", "element face 0\nend_header");
    assert!(fault(mesh).contains("looks like a mesh"));
}

#[test]
fn elements_and_lists_around_the_vertices_are_passed_over() {
    let list = "element strip 2\nproperty list uchar int ids\nproperty float weight\n";
    let dc = [("float", "f_dc_0", "0"), ("float", "f_dc_1", "0"), ("float", "f_dc_2", "0")];
    let plain = ascii(&with_shape(&dc));
    let expected = read(&plain).gaussians;
    let text = plain
        .replace("element vertex", &format!("{list}element vertex"))
        .replace("end_header\n", "property list uchar float w\nend_header\n2 7 8 0.5\n0 0.5\n")
        .replace("inf\n", "inf 3 1 2 3\n");
    assert_eq!(read(text).gaussians, expected);
    // The same in binary: one list before the row, one inside it.
    let mut binary = b"ply\nformat binary_big_endian 1.0\nelement s 1\n\
        property list uchar ushort ids\nelement vertex 1\nproperty list int double d\n"
        .to_vec();
    for (_, name, _) in with_shape(&dc) {
        binary.extend(format!("property float {name}\n").bytes());
    }
    binary.extend(b"end_header\n\x02\0\x01\0\x02");
    binary.extend([0, 0, 0, 1]);
    binary.extend([9; 8]);
    for (_, _, value) in with_shape(&dc) {
        binary.extend(value.parse::<f32>().unwrap().to_be_bytes());
    }
    assert_eq!(read(binary).gaussians, expected);
}

#[test]
fn points_have_colors_of_any_kind() {
    let read = |text: &str| read_points_from(text.as_bytes(), Path::new("p.ply"));
    let head = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n\
        property float z\n";
    let colored = |kind: &str, values: &str| {
        let columns = ["red", "green", "blue"].map(|n| format!("property {kind} {n}\n")).concat();
        read(&format!("{head}{columns}end_header\n1 2 3 {values}\n")).unwrap()
    };
    let expected = SparsePoints { positions: vec![[1.0, 2.0, 3.0]], colors: vec![[255, 0, 51]] };
    assert_eq!(colored("uchar", "255 0 51"), expected);
    assert_eq!(colored("ushort", "65535 0 13107"), expected);
    assert_eq!(colored("float", "1 0 0.2"), expected);
    let gray = read(&format!("{head}end_header\n1 2 3\n")).unwrap();
    assert_eq!(gray.colors, [[128; 3]]);
    let nan = read(&format!("{head}end_header\n1 nan 3\n")).unwrap_err().to_string();
    assert!(nan.contains("the position is [1.0, NaN, 3.0] (row 0 of vertex)"), "{nan}");

    let mut bytes = Vec::new();
    write_points_to(&mut bytes, &expected, Path::new("p.ply")).unwrap();
    assert_eq!(read_points_from(&bytes[..], Path::new("p.ply")).unwrap(), expected);
}

#[test]
fn a_surface_keeps_what_it_sends_and_refuses_less_than_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("lamp.ply");
    let mut surface = Surface {
        vertices: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]],
        normals: vec![[0.0, 0.0, 1.0]; 4],
        triangles: vec![[0, 1, 2], [1, 3, 2]],
        emission_linear: vec![[3.0, 2.0, 1.0], [0.0; 3]],
        ..Surface::default()
    };
    write_surface(&path, &surface).unwrap();
    let read = read_surface(&path).unwrap();
    assert_eq!(read.emission_linear, [[3.0, 2.0, 1.0], [0.0; 3], [0.0; 3], [0.0; 3]]);
    assert!(std::fs::read(&path).unwrap().windows(11).any(|w| w == b"surface 1.1"));
    surface.emission_linear = vec![[0.0; 3]; 4];
    write_surface(&path, &surface).unwrap();
    assert!(std::fs::read(&path).unwrap().windows(11).any(|w| w == b"surface 1.0"));
    assert!(read_surface(&path).unwrap().emission_linear.is_empty());
    surface.emission_linear = vec![[-1.0, 2.0, 2.0]];
    write_surface(&path, &surface).unwrap();
    let error = read_surface(&path).unwrap_err().to_string();
    assert!(error.contains("row 0 of vertex") && error.contains("emission"), "{error}");
}
