use super::*;

fn parse_text(text: &str) -> Result<Header> {
    parse(&mut text.as_bytes(), Path::new("x.ply"))
}

fn cause(text: &str) -> String {
    parse_text(text).unwrap_err().to_string()
}

#[test]
fn everything_in_a_header_is_kept() {
    let text = "ply\nformat binary_big_endian 1.0\ncomment  two  words \nobj_info x\n\
        element vertex 3\nproperty float x\nproperty list uchar int16 neighbors\n\
        element face 0\nend_header\nbody";
    let header = parse_text(text).unwrap();
    assert_eq!(header.encoding, Encoding::BigEndian);
    assert_eq!(header.comments, ["two  words"]);
    assert_eq!((header.lines, header.bytes), (9, text.len() as u64 - 4));
    let vertex = &header.elements[0];
    assert_eq!((vertex.count, vertex.fixed_row_bytes()), (3, None));
    assert_eq!(vertex.least_row_bytes(header.encoding), 5);
    let list = PropertyKind::List { count: Scalar::U8, item: Scalar::I16 };
    assert_eq!(vertex.properties[1].kind, list);
    assert_eq!(header.elements[1].fixed_row_bytes(), Some(0));
}

#[test]
fn marks_and_line_ends_of_other_systems_are_accepted() {
    let header = "\u{feff}ply\r\nformat ascii 1.0\r\nelement vertex 1\r\nend_header\r\n";
    assert_eq!(parse_text(header).unwrap().bytes, header.len() as u64);
}

#[test]
fn faults_are_named_with_their_line() {
    for (text, expected) in [
        ("", "the file is empty (byte 0)"),
        ("PNG", "not a PLY file: it starts with other bytes"),
        ("plywood\n", "not a PLY file"),
        ("ply\n", "the file ends inside its header (ply header line 2)"),
        ("ply\nend_header\n", "there is no format line"),
        ("ply\nformat ascii 2.0\n", "PLY version \"2.0\" instead of 1.0"),
        ("ply\nformat text 1.0\n", "the format is \"text\" (ply header line 2)"),
        ("ply\nproperty float x\n", "a property before the first element"),
        ("ply\nelement vertex -1\n", "the number of rows is \"-1\""),
        ("ply\nelement vertex 99999999999999999999\n", "the number of rows is"),
        (
            "ply\nelement vertex 1\nproperty quad x\n",
            "\"quad\" is not a PLY type (ply header line 3)",
        ),
        ("ply\nelement v 1\nproperty list float int x\n", "must be of an integer type"),
        ("ply\nelement v 1\nproperty int a\nproperty int a\n", "already declared on line 3"),
        ("ply\nelement v 1\nelement v 1\n", "a second element \"v\""),
        ("ply\nfrobnicate\n", "\"frobnicate\" is not a PLY keyword"),
    ] {
        let found = cause(text);
        assert!(found.contains(expected), "{text:?}: {found}");
    }
    let long = format!("ply\ncomment {}", "x".repeat(1 << 20));
    assert!(cause(&long).contains("more than 16384 bytes"));
    let many = format!("ply\n{}", "comment\n".repeat(1 << 15));
    assert!(cause(&many).contains("more than 16384 lines"));
}
